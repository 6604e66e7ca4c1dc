"""The picture of a verification: differences against tolerances."""

import io
from collections.abc import Sequence

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .outcomes import Outcome

LOWEST = 1e-8  # a share of the tolerance that is drawn as nothing
COLOURS = {True: "#0072B2", False: "#D55E00"}

matplotlib.use("Agg")
STYLE = {
    "font.size": 9,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "grid.color": "0.88",
    "grid.linewidth": 0.6,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "nocdyn",
}


def draw(outcomes: Sequence[Outcome], width: float) -> Figure:
    """The picture by itself."""
    features = {one.case.feature for one in outcomes}
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, 0.9 + 0.26 * len(features)), layout="constrained")
        draw_on(figure.add_subplot(), outcomes)
    return figure


def draw_on(axes: Axes, outcomes: Sequence[Outcome]) -> None:
    """Each case a point: its difference as a share of its tolerance, by features."""
    features = list(dict.fromkeys(one.case.feature for one in outcomes))
    for row, feature in enumerate(features):
        draw_row(axes, row, [one for one in outcomes if one.case.feature == feature])
    axes.set_xscale("log")
    axes.set_xlim(LOWEST / 2, 1e3 if any(not one.passes for one in outcomes) else 3)
    axes.axvline(1, color="#D55E00", linewidth=1.2)
    axes.set_yticks(range(len(features)), features)
    axes.set_ylim(len(features) - 0.4, -0.6)
    axes.set_xlabel(f"difference / tolerance (the line: allowed; at the left edge: below {LOWEST:g})")


def draw_row(axes: Axes, row: int, outcomes: Sequence[Outcome]) -> None:
    """The cases of a feature, beside each other."""
    for place, one in enumerate(outcomes):
        share = 1e3 if one.share is None else min(max(one.share, LOWEST / 1.5), 1e3)
        offset = 0.3 * (2 * (place + 0.5) / len(outcomes) - 1)
        marker = "o" if one.passes else "X"
        axes.plot(share, row + offset, marker, color=COLOURS[one.passes], markersize=4 if one.passes else 8)


def as_svg(figure: Figure) -> str:
    """The picture as a part of a page."""
    with matplotlib.rc_context(STYLE):
        file = io.StringIO()
        figure.savefig(file, format="svg", metadata={"Date": None})
    text = file.getvalue()
    return text[text.index("<svg") :]
