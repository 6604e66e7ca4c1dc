"""Draws passages of barred ranges over the time: the speed, and below it the quantities that have limits, with their peaks."""

import argparse
import textwrap
from collections.abc import Sequence
from pathlib import Path

from matplotlib import pyplot
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .failure import ResultsError
from .response_figures import PEAK_LIMIT, TRANSIENT
from .response_marks import BARRED
from .speed_panels import DANGER, HALO, SMALL, Figures, draw_folders
from .speed_results import short_unit
from .style import COLOURS, PIXELS, WIDTH, add_format_option, add_title, plain
from .thinning import thin
from .transit_results import NEAR, Limited, Passage, Transit, read_transit

BESIDE = 2  # passages in a figure
MOST_ROWS = 5  # quantities in a figure
WIDE = 11.5  # width of a figure of two passages [in]
SPEED_HEIGHT, HEIGHT = 2.3, 2.1  # of panels [in]
LONGEST = 26  # characters of a line beside a panel
HEADROOM = 0.16  # above and below the curves, of their range
SPEED = {"color": "0.6", "linewidth": 0.7}
MEAN_SPEED = {"color": "black", "linewidth": 1.6}
LOAD = {"color": COLOURS[0], "linewidth": 0.7}
LARGEST = {"color": "black", "marker": "o", "markersize": 4, "linestyle": ""}
HALF_RANGE = {"color": COLOURS[1], "linewidth": 2.0}
EDGE = {"color": DANGER, "linewidth": 0.7, "linestyle": (0, (5, 2))}
NOTE = {"fontsize": SMALL, "bbox": HALO, "zorder": 6}


def draw_page(transit: Transit, passages: Sequence[Passage], quantities: Sequence[Limited]) -> Figure:
    """A column for each passage."""
    across, down = len(passages), 1 + len(quantities)
    heights = [SPEED_HEIGHT, *[HEIGHT] * len(quantities)]
    size = (WIDTH if across == 1 else WIDE, sum(heights) + 1.2)
    figure, grid = pyplot.subplots(down, across, squeeze=False, sharex="col", sharey="row", figsize=size, height_ratios=heights)
    for column, passage in zip(grid.T, passages):
        _draw_speed(column[0], transit, passage)
        for axes in column[1:]:
            axes.axvspan(passage.entry["enters"], passage.entry["leaves"], facecolor=BARRED[True], linewidth=0, zorder=0.5)
        column[-1].set_xlim(passage.time[0], passage.time[-1])
        column[-1].set_xlabel("time [s]")
    for row, quantity in zip(grid[1:], quantities):
        _draw_quantity(row, transit, passages, quantity)
    figure.legend(
        handles=_legend(transit, passages, quantities), loc="outside lower center", ncols=3 if across == 1 else 4, fontsize=8.5
    )
    mean = "1 turn" if transit.turns == 1 else f"{transit.turns} turns"
    add_title(figure, transit.title, f"passage of barred speeds of {transit.body}; mean speed over {mean}")
    return figure


def _draw_speed(axes: Axes, transit: Transit, passage: Passage) -> None:
    low, high = passage.ends
    axes.axhspan(low, high, facecolor=BARRED[True], linewidth=0, zorder=0.5)
    axes.plot(*thin(passage.time, passage.speed, PIXELS), **SPEED)
    axes.plot(*thin(passage.time, passage.mean_speed, PIXELS), **MEAN_SPEED)
    for word, side in (("enters", "left"), ("leaves", "right")):
        at = passage.entry[word]
        axes.axvline(at, zorder=1, **EDGE)
        axes.text(at, 0.04, f"  {at:.4g} s  ", transform=axes.get_xaxis_transform(), ha=side, color=DANGER, **NOTE)
    axes.set_title(_told(passage), loc="left")
    if axes.get_subplotspec().is_first_col():
        axes.set_ylabel(textwrap.fill(plain(f"speed of {transit.body} [rpm]"), LONGEST))


def _told(passage: Passage) -> str:
    """As '1: up, 5.03 s in 48.63 to 58.71 rpm, 27 cycles of order 6'."""
    low, high = passage.ends
    entry = passage.entry
    told = f"{passage.number}: {entry['direction']}, {entry['time_in_range']:.3g} s in {low:.4g} to {high:.4g} rpm"
    if "cycles_of_order" in entry:
        told += f", {entry['cycles_of_order']:.3g} cycles of order {passage.range['order']:.4g}"
    return told


def _draw_quantity(row: Sequence[Axes], transit: Transit, passages: Sequence[Passage], quantity: Limited) -> None:
    """One quantity in all passages of a figure, on one scale."""
    largest = max(one.peak(quantity)["largest"] for one in passages)
    factor, unit = short_unit(quantity.unit, largest)
    far = []
    for axes, passage in zip(row, passages):
        values = passage.values(quantity) / factor
        axes.plot(*thin(passage.time, values, PIXELS), zorder=2, **LOAD)
        _mark_peaks(axes, transit, passage, quantity, factor)
        far += _draw_limits(axes, transit, passage, quantity, factor)
    row[0].margins(y=HEADROOM)
    title = f"{quantity.element}: {quantity.caption}"
    beyond = f"   (limit \N{PLUS-MINUS SIGN}{min(far):.4g} {unit} is outside)" if far else ""
    row[0].set_title(plain(title + beyond), loc="left")
    row[0].set_ylabel(textwrap.fill(f"{quantity.caption} [{unit}]", LONGEST))


def _mark_peaks(axes: Axes, transit: Transit, passage: Passage, quantity: Limited, factor: float) -> None:
    """The largest magnitude as a point, the half range as a bar about the middle of its turn."""
    peak = passage.peak(quantity)
    at = float(passage.values(quantity)[abs(passage.time - peak["time"]).argmin()])
    largest = peak["largest"] if at >= 0 else -peak["largest"]
    axes.plot(peak["time"], largest / factor, zorder=5, **LARGEST)
    offset, side = ((0, 5), "bottom") if largest >= 0 else ((0, -5), "top")
    style = {"textcoords": "offset points", "ha": "center", **NOTE}
    axes.annotate(f"{peak['largest'] / factor:.4g}", (peak["time"], largest / factor), offset, va=side, **style)
    middle, half = passage.centre(quantity, transit.turns) / factor, peak["half_range"] / factor
    axes.errorbar(peak["half_range_time"], middle, half, capsize=4, zorder=5, **HALF_RANGE)
    told = f"\N{PLUS-MINUS SIGN}{half:.4g}"
    axes.annotate(told, (peak["half_range_time"], middle), (6, 0), va="center", color=COLOURS[1], **(style | {"ha": "left"}))


def _draw_limits(axes: Axes, transit: Transit, passage: Passage, quantity: Limited, factor: float) -> list[float]:
    """The limits of the half range and of the magnitude; those that are far outside, in the unit of the panel."""
    peak, far = passage.peak(quantity), []
    allowed = peak.get("half_range_limit")
    limits = [] if allowed is None else [(passage.centre(quantity, transit.turns), allowed, peak["half_range"], TRANSIENT)]
    if quantity.largest_limit is not None:
        limits.append((0.0, quantity.largest_limit, peak["largest"], PEAK_LIMIT))
    for middle, limit, reached, style in limits:
        if limit > NEAR * reached:
            far.append(limit / factor)
            continue
        for side in (-1, 1):
            axes.axhline((middle + side * limit) / factor, zorder=3, **style)
    return far


def _legend(transit: Transit, passages: Sequence[Passage], quantities: Sequence[Limited]) -> list[Artist]:
    handles: list[Artist] = [
        Line2D([], [], label="mean speed", **MEAN_SPEED),
        Line2D([], [], label="speed", **SPEED),
        Patch(facecolor=BARRED[True], label="barred speeds, and the time in them"),
    ]
    if quantities:
        turns = "turn" if transit.turns == 1 else f"{transit.turns} turns"
        handles.append(Line2D([], [], label="largest magnitude", **LARGEST))
        handles.append(Line2D([], [], label=f"half range of the worst {turns}", **HALF_RANGE))
    if any("half_range_limit" in one for passage in passages for one in passage.entry["peaks"]):
        handles.append(Line2D([], [], label="limit of the half range there", **TRANSIENT))
    if any(one.largest_limit is not None for one in quantities):
        handles.append(Line2D([], [], label="limit of the magnitude", **PEAK_LIMIT))
    return handles


def figures_of(folder: Path) -> Figures:
    """A figure for each pair of passages, and further ones if there are many quantities."""
    transit = read_transit(folder)
    if not transit.passages:
        raise ResultsError(f"{folder}: nothing to draw: the run is never in a range of &transit")
    count = 0
    for first in range(0, len(transit.passages), BESIDE):
        for row in range(0, max(1, len(transit.quantities)), MOST_ROWS):
            count += 1
            chosen = transit.quantities[row : row + MOST_ROWS]
            page = draw_page(transit, transit.passages[first : first + BESIDE], chosen)
            yield "transit" if count == 1 else f"transit_{count}", page


def main() -> None:
    parser = argparse.ArgumentParser(prog="nocdyn plot transit", description=__doc__)
    parser.add_argument(
        "results",
        type=Path,
        nargs="+",
        metavar="RESULTS",
        help="folders that 'nocdyn transit' wrote",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures of one folder go (RESULTS/figures)")
    add_format_option(parser)
    arguments = parser.parse_args()
    if arguments.out and len(arguments.results) > 1:
        parser.error("--out is for one folder of results")
    draw_folders(arguments, figures_of)


if __name__ == "__main__":
    main()
