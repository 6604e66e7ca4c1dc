"""Draws the bands of a sweep: quantiles of responses and of natural frequencies over the speed."""

import textwrap
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib import pyplot
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .band_results import RANGES, Bands, CriticalBand, Curve
from .campbell_figures import ORDER, PANEL, colour_of, hidden_words, name_lines, name_modes, top_of
from .campbell_figures import SIZE as CAMPBELL_SIZE
from .columns import by_sort
from .response_figures import HEADROOM, LIMIT, LONGEST, MOST_PANELS, WIDE
from .response_figures import PANEL as HEIGHT
from .speed_panels import HALO, SMALL, Labels, shade_operation, share_of, text_size
from .speed_results import NEAR, roman
from .style import COLOURS, WIDTH, add_legend, plain

SHADES = (0.14, 0.22, 0.34)  # opacity of the ranges, one above the other, the widest first
RANGE_NAMES = ("all variants", "90 % of the variants", "half of the variants")
MEDIAN = {"linewidth": 1.5}
NOMINAL = {"color": "black", "linewidth": 1.0, "linestyle": (0, (4, 1.5))}
INSIDE = {"color": "0.15", "linewidth": 2.6, "solid_capstyle": "butt"}  # of an order within the band of a mode
NEUTRAL = "0.35"  # of what all modes have, each in its own colour
CRITICAL = "#7F3C8D"
CRITICAL_SHADES = (0.14, 0.28)  # of all variants, and of 90 % above them
PLACES = 9  # along a text where it must not cover a mode
CLEARANCE = 0.06  # of a text from the band of a mode [in]


def band_figures(bands: Bands, title: str) -> Iterator[tuple[str, Figure]]:
    """Names and figures: the responses, a page for each kind of them, and the Campbell diagram."""
    responses = {curve.column.label + curve.title: curve for curve in bands.curves if not curve.is_mode}
    page = 0
    for columns in by_sort({curve.column.sort: curve.column for curve in responses.values()}.values()):
        members = [curve for curve in responses.values() if curve.column.sort == columns[0].sort]
        largest = max(curve.largest for curve in members)
        members = [curve.in_short(largest) for curve in members]
        for first in range(0, len(members), MOST_PANELS):
            page += 1
            yield "bands" if page == 1 else f"bands_{page}", draw_responses(bands, members[first : first + MOST_PANELS])
    if any(curve.is_mode for curve in bands.curves):
        yield "campbell_bands", draw_campbell(bands, title)


def draw_responses(bands: Bands, page: Sequence[Curve]) -> Figure:
    across = 1 if len(page) == 1 else 2
    down = -(-len(page) // across)
    width, height = (WIDTH, 1.5 * HEIGHT) if across == 1 else (WIDE, 1.1 * HEIGHT)
    figure, grid = pyplot.subplots(down, across, squeeze=False, figsize=(width, height * down + 1.7))
    shades: list[Patch] = []
    for axes, curve in zip(grid.flat, page):
        axes.set_xlim(bands.speed[0], bands.speed[-1])
        shades = shade_operation(axes, bands.operation)
        _draw_response(axes, bands, curve)
    for axes in grid.flat[len(page) :]:
        axes.set_visible(False)
    for axes in grid.flat[max(len(page) - across, 0) : len(page)]:
        axes.set_xlabel(plain(f"{bands.axis.label} [{bands.axis.unit}]"))
    handles = _legend(page, COLOURS[0])
    if any(curve.has("limit") for curve in page):
        handles.append(Line2D([], [], label="limit in continuous operation", **LIMIT))
    add_legend(figure, handles=handles + shades, ncols=3 if across == 1 else 4, fontsize=8.5)
    return figure


def _draw_response(axes: Axes, bands: Bands, curve: Curve) -> None:
    """One panel: the ranges, the median, the curve of the input and the limit, if that is not far above."""
    _draw_ranges(axes, bands.speed, curve, COLOURS[0])
    top = max(curve.largest, 1e-300)
    remark = ""
    if curve.has("limit"):
        lowest = float(np.nanmin(curve.statistics["limit"]))
        axes.plot(bands.speed, curve.statistics["limit"], zorder=5, **LIMIT)
        if lowest > NEAR * top:
            remark = f"limit, from {lowest:.4g} {curve.unit} on, is above"
        else:
            top = max(top, lowest)
            limit = "the limit" if curve.order is None else "the limit of one order"
            above = curve.share_above
            remark = f"no variant exceeds {limit}" if above == 0 else f"{_percent(above)} of the variants exceed {limit}"
    axes.set_ylim(0.0, HEADROOM * top)
    axes.set_title(plain(curve.title), loc="left")
    if remark:
        style = {"fontsize": 8.5, "ha": "right", "va": "top", "bbox": HALO, "zorder": 6, "color": "0.2"}
        axes.text(0.985, 0.97, remark, transform=axes.transAxes, **style)
    axes.set_ylabel(textwrap.fill(f"{curve.column.caption} [{curve.unit}]", LONGEST))


def _percent(share: float) -> str:
    """Of variants, without hiding a few of many."""
    percent = 100.0 * share
    return "less than 1 %" if percent < 1.0 else "more than 99 %" if 99.0 < percent < 100.0 else f"{percent:.0f} %"


def _draw_ranges(axes: Axes, speed: np.ndarray, curve: Curve, colour: str) -> None:
    for (low, high), shade in zip(RANGES, SHADES):
        ends = curve.statistics[low], curve.statistics[high]
        axes.fill_between(speed, *ends, facecolor=colour, alpha=shade, linewidth=0, zorder=3)
    axes.plot(speed, curve.statistics["median"], color=colour, zorder=4, **MEDIAN)
    if curve.has("nominal"):
        axes.plot(speed, curve.statistics["nominal"], zorder=4.5, **NOMINAL)


def _legend(curves: Sequence[Curve], colour: str) -> list[Artist]:
    """What the shades are: where they lie one above the other, they are darker."""
    seen = [1.0 - np.prod([1.0 - shade for shade in SHADES[: place + 1]]) for place in range(len(SHADES))]
    handles: list[Artist] = [
        Patch(facecolor=colour, alpha=float(shade), linewidth=0, label=name) for shade, name in zip(seen, RANGE_NAMES)
    ]
    handles.append(Line2D([], [], color=colour, label="median", **MEDIAN))
    if any(curve.has("nominal") for curve in curves):
        handles.append(Line2D([], [], label="machine of the input", **NOMINAL))
    return handles


def draw_campbell(bands: Bands, title: str) -> Figure:
    """Natural frequencies and orders; where an order is within the band of a mode, and the critical speeds that were kept."""
    campbell = bands.campbell(title)
    modes = [curve for curve in bands.curves if curve.is_mode]
    window = (bands.speed[0], bands.speed[-1])
    figure, axes = pyplot.subplots(figsize=CAMPBELL_SIZE)
    axes.set_xlim(window)
    axes.set_ylim(0.0, top_of(campbell, window))
    shades = shade_operation(axes, bands.operation)
    for _, frequency in bands.lines:
        axes.plot(bands.speed, frequency, zorder=2, **ORDER)
    for curve in modes:
        _draw_ranges(axes, bands.speed, curve, colour_of(curve.mode))
        for _, frequency in bands.lines:
            _mark_inside(axes, bands.speed, curve, frequency)
    name_lines(axes, campbell)
    name_modes(axes, campbell)
    labels = Labels(axes, PANEL)
    for critical in sorted(bands.criticals, key=lambda one: one.speeds[2]):
        _mark_critical(axes, labels, critical, modes, bands.speed)
    axes.set_xlabel(plain(f"{bands.axis.label} [{bands.axis.unit}]"))
    axes.set_ylabel("frequency [Hz]")
    above = [curve.mode for curve in modes if np.nanmin(curve.statistics["min"]) > axes.get_ylim()[1]]
    axes.set_title("natural frequencies and orders" + hidden_words(above), loc="left", pad=22)
    handles = [
        Line2D([], [], label="orders, named at the border", **ORDER),
        *_legend(modes, colour_of(modes[0].mode) if len(modes) == 1 else NEUTRAL),
    ]
    if bands.lines:
        handles.append(Line2D([], [], label="order within 90 % of a mode", **INSIDE))
    if bands.criticals:
        handles += [
            Patch(facecolor=CRITICAL, alpha=shade, linewidth=0, label=f"critical speeds: {name}")
            for shade, name in ((CRITICAL_SHADES[0], "all variants"), (sum(CRITICAL_SHADES), "90 %"))
        ]
    add_legend(figure, handles=handles + shades, ncols=4, fontsize=8.5)
    return figure


def _mark_inside(axes: Axes, speed: np.ndarray, curve: Curve, frequency: np.ndarray) -> None:
    """The part of an order at whose speeds it meets the mode in 90 % of the variants."""
    fine = np.linspace(speed[0], speed[-1], 40 * len(speed))
    low, order, high = (np.interp(fine, speed, values) for values in (curve.statistics["p5"], frequency, curve.statistics["p95"]))
    axes.plot(fine, np.where((low <= order) & (order <= high), order, np.nan), zorder=5, **INSIDE)


def _mark_critical(axes: Axes, labels: Labels, critical: CriticalBand, modes: Sequence[Curve], speed: np.ndarray) -> None:
    """Shades the critical speeds of an order and a mode below the band of the mode, and tells their range."""
    first, low, middle, high, last = critical.speeds
    if not (axes.get_xlim()[0] <= middle <= axes.get_xlim()[1]):
        return
    top = axes.get_ylim()[1]
    medians = [curve.statistics["median"] for curve in modes if curve.mode == critical.mode]
    reach = min([float(np.interp(middle, speed, median)) / top for median in medians] + [1.0])
    for (start, end), shade in zip(((first, last), (low, high)), CRITICAL_SHADES):
        axes.axvspan(start, end, 0.0, reach, facecolor=CRITICAL, alpha=shade, linewidth=0, zorder=1)
    text = f"{roman(critical.mode)}/{critical.order:.6g}: {low:.4g}\N{EN DASH}{high:.4g} rpm"
    width, line = text_size(text)
    x = min(max(float(share_of(axes, middle)), width / 2 / labels.size[0]), 1 - width / 2 / labels.size[0])
    ends = axes.get_xlim()[0] + (x + np.array([-0.5, 0.5]) * width / labels.size[0]) * np.ptp(axes.get_xlim())
    below = np.linspace(*ends, PLACES)
    taken = [[np.interp(below, speed, curve.statistics[word]) / top for word in RANGES[0]] for curve in modes]
    room = (0.5 * line + CLEARANCE) / labels.size[1]
    for y in np.arange(1.5 * line, 0.9 * labels.size[1], 0.3 * line) / labels.size[1]:
        hides_a_mode = any(((bottom < y + room) & (y - room < peak)).any() for bottom, peak in taken)
        if not hides_a_mode and labels.is_free(x, float(y), width, line):
            style = {"fontsize": SMALL, "color": CRITICAL, "ha": "center", "va": "center", "bbox": HALO, "zorder": 6}
            axes.text(x, y, text, transform=axes.transAxes, **style)
            return
