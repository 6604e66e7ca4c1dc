"""Phase planes of the bodies and of the twists of the couplings."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .results import Results, Series
from .style import COLOURS, WIDTH, add_legend, plain
from .thinning import thin_curve

MOST_PLANES = 9
PIXELS = 1000
MANY = 5000  # points that thick lines would hide
LONGEST_PATH = 20_000  # points that SVG and PDF store as a path


@dataclass(frozen=True)
class Plane:
    noun: str
    angle_label: str
    rate_label: str
    colour: str
    angle: Series
    rate: Series


def draw_phase_planes(results: Results, labels: Sequence[str] | None = None) -> Figure | None:
    """A panel for each plane, with where it starts and where it ends; of all angles and twists, or of those among the labels."""
    panels = list(_planes(results, results.header.columns if labels is None else labels))
    if not panels:
        return None
    across = math.ceil(math.sqrt(len(panels)))
    down = math.ceil(len(panels) / across)
    figure, grid = pyplot.subplots(down, across, squeeze=False, figsize=(WIDTH * max(across, 2) / 2, 3.0 * down + 0.6))
    for axes, plane in zip(grid.flat, panels):
        _draw_plane(axes, plane)
    for axes in grid.flat[len(panels) :]:
        axes.set_visible(False)
    add_legend(figure, *grid.flat[0].get_legend_handles_labels(), ncols=2)
    return figure


def _planes(results: Results, labels: Iterable[str]) -> Iterator[Plane]:
    """Bodies and couplings whose speeds the trajectory has."""
    columns = [column for column in results.columns("phi", "twist") if column.label in set(labels)]
    for column in sorted(columns, key=lambda one: one.kind == "twist"):
        if column.kind == "phi":
            if speed := results.speed(column.title):
                yield Plane("body", "angle φ", "speed ω", COLOURS[0], results.series(column.label), speed)
        elif rate := results.twist_rate(column):
            yield Plane("twist of", "twist Δφ", "rate of twist Δω", COLOURS[1], results.series(column.label), rate)


def _draw_plane(axes: Axes, plane: Plane) -> None:
    angle, rate = thin_curve(plane.angle.values, plane.rate.values, PIXELS)
    width = 1.3 if len(angle) < MANY else 0.6
    axes.plot(angle, rate, color=plane.colour, linewidth=width, rasterized=len(angle) > LONGEST_PATH)
    axes.plot(angle[0], rate[0], "o", color="black", markerfacecolor="white", label="start")
    axes.plot(angle[-1], rate[-1], "o", color="black", label="end")
    axes.set_title(plain(f"{plane.noun} {plane.angle.name}"))
    axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.set_xlabel(f"{plane.angle_label} [{plane.angle.unit}]")
    axes.set_ylabel(f"{plane.rate_label} [{plane.rate.unit}]")
