"""Pictures of the measurements: work-precision diagrams and the growth with the number of rotors."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib import pyplot
from matplotlib.axes import Axes
from nocdyn_report.style import COLOURS, REFERENCE, add_title, save

from .chains import Scaling
from .work_precision import WorkPrecision

SIZE = (8.0, 5.0)  # [in]
MARKERS = "osD^vPX<>p*h"


def styles(labels: Sequence[str]) -> dict[str, dict]:
    """nocdyn's methods are solid and filled, the others thin, dashed and hollow."""
    own = [label for label in labels if label.startswith("nocdyn")]
    others = [label for label in labels if label not in own]
    found = {}
    for i, label in enumerate(own):
        found[label] = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i], "linewidth": 1.8, "markersize": 5}
    for i, label in enumerate(others):
        found[label] = {
            "color": COLOURS[-1 - i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
            "linewidth": 0.8,
            "linestyle": (0, (4, 2)),
            "markersize": 4,
            "markerfacecolor": "white",
        }
    return found


def draw_work_precision(workload: WorkPrecision, folder: Path) -> None:
    figure, axes = pyplot.subplots(figsize=SIZE)
    drawn = styles([contestant.label for contestant in workload.contestants])
    for contestant in workload.contestants:
        points = [point for point in workload.points_of(contestant) if 0.0 < point.errors["states"] < 1e3]
        axes.loglog(
            [point.errors["states"] for point in points],
            [1e3 * point.seconds for point in points],
            label=contestant.label,
            **drawn[contestant.label],
        )
    for error in workload.errors_wanted:
        axes.axvline(error, **REFERENCE)
    axes.set_xlim(right=min(axes.get_xlim()[1], 1.0))
    axes.invert_xaxis()
    axes.set_xlabel("largest absolute error of a state at an output (rad, rad/s), better to the right")
    axes.set_ylabel("time [ms]")
    _finish(axes, workload.title)
    save(figure, folder, f"{workload.name}_work_precision")


def draw_scaling(workload: Scaling, folder: Path) -> None:
    figure, axes = pyplot.subplots(figsize=SIZE)
    drawn = styles(workload.labels)
    for label in workload.labels:
        found = [(chain.bodies, workload.point(chain, label)) for chain in workload.chains]
        found = [(bodies, point) for bodies, point in found if point]
        axes.loglog(
            [bodies for bodies, _ in found],
            [1e6 * point.seconds / bodies for bodies, point in found],
            label=label,
            **drawn[label],
        )
    axes.set_xlabel("rotors N")
    axes.set_ylabel("time / N [us]: level if the time is linear in N")
    _finish(axes, workload.title)
    save(figure, folder, f"{workload.name}_scaling")


def _finish(axes: Axes, title: str) -> None:
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8)
    add_title(axes.figure, title)
