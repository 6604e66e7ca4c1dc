"""Draws Campbell diagrams: natural frequencies over the speed, the orders, and where they meet."""

import argparse
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .speed_panels import (
    DANGER,
    HALO,
    SMALL,
    Figures,
    Labels,
    arguments_of,
    draw_folders,
    figure_parser,
    finite,
    shade_operation,
    share_of,
    speed_label,
    spread,
    text_size,
    window_of,
)
from .speed_results import Campbell, Critical, roman
from .speed_results import read_campbell as read
from .style import COLOURS, PIXELS, add_legend, add_title, plain
from .thinning import thin

SIZE = (9.5, 6.6)  # of the figure [in]
PANEL = (7.4, 5.0)  # of its axes, about [in]
ROOM = 1.12  # above the highest frequency that a line meets or might meet
MODE_NAMES = 1.25  # distance of the names of modes, of that of the orders' numbers
LEADER = {"arrowstyle": "-", "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0}
ORDER = {"color": "0.55", "linewidth": 0.8}
TILT = 60  # of the speeds at which lines meet [degrees]
DISTANCE = 0.14  # between two of them [in]
CLOSE = 0.4  # of a mode above, whose line a speed would cross [in]
SAME = 1e-3  # relative distance of a crossing from its own mode, between rows
MODE_COLOURS = (*COLOURS[:6], "#7F3C8D")
FAR = {"color": "0.25", "marker": "o", "linestyle": "", "markersize": 3.5}
MARGIN = {**FAR, "color": "#E69F00", "markersize": 7, "markeredgecolor": "black", "markeredgewidth": 0.7}
INSIDE = {**MARGIN, "color": DANGER}


def draw_campbell(campbell: Campbell, window: tuple[float, float], top: float | None) -> Figure:
    figure, axes = pyplot.subplots(figsize=SIZE)
    axes.set_xlim(window)
    axes.set_ylim(0.0, top or top_of(campbell, window))
    shades = shade_operation(axes, campbell.operation)
    for _, frequency in campbell.lines:
        axes.plot(*thin(campbell.speed, frequency, PIXELS), zorder=2, **ORDER)
    for mode, frequency in campbell.modes.items():
        axes.plot(*thin(campbell.speed, frequency, PIXELS), color=colour_of(mode), linewidth=1.8, zorder=3)
    name_lines(axes, campbell)
    name_modes(axes, campbell)
    shown = [one for one in campbell.crossings if window[0] <= one.speed <= window[1] and one.frequency <= axes.get_ylim()[1]]
    handles = _mark_crossings(axes, campbell, shown)
    axes.set_xlabel(plain(speed_label(campbell.body)))
    axes.set_ylabel("frequency [Hz]")
    above = [mode for mode, frequency in campbell.modes.items() if frequency.min() > axes.get_ylim()[1]]
    lines = Line2D([], [], label="orders, named at the border", **ORDER)
    add_legend(figure, handles=[lines, *handles, *shades], ncols=4, fontsize=8.5)
    add_title(figure, campbell.title, "natural frequencies and orders over the speed" + hidden_words(above))
    return figure


def hidden_words(modes: list[int]) -> str:
    """What the title says of modes above the diagram."""
    if not modes:
        return ""
    return f"; modes {roman(modes[0])} to {roman(modes[-1])} are above" if modes[1:] else f"; mode {roman(modes[0])} is above"


def _inside(campbell: Campbell, window: tuple[float, float]) -> np.ndarray:
    return (campbell.speed >= window[0]) & (campbell.speed <= window[1])


def top_of(campbell: Campbell, window: tuple[float, float]) -> float:
    """Above the modes that a line meets, or comes near; the higher modes concern nobody."""
    inside = _inside(campbell, window)
    modes = sorted(frequency[inside].max() for frequency in campbell.modes.values())
    if not campbell.lines:
        return ROOM * modes[-1]
    reach = max(frequency[inside].max() for _, frequency in campbell.lines)
    within = [mode for mode in modes if mode <= reach]
    if not within:
        return ROOM * max(modes[0], reach)
    beyond = next((mode for mode in modes if mode > reach), np.inf)
    return ROOM * (beyond if beyond <= 1.3 * reach else min(reach, max(2.0 * within[-1], 0.3 * reach)))


def name_lines(axes: Axes, campbell: Campbell) -> None:
    """Numbers of the orders where their lines leave the diagram: above it or at its right."""
    inside = _inside(campbell, axes.get_xlim())
    speed, top = campbell.speed[inside], axes.get_ylim()[1]
    upper, right = [], []
    for line, frequency in campbell.lines:
        heights = frequency[inside] / top
        changes = np.flatnonzero(np.diff(heights > 1.0))
        if changes.size:
            near = slice(changes[-1], changes[-1] + 2)
            rising = np.argsort(heights[near])
            upper.append((share_of(axes, np.interp(1.0, heights[near][rising], speed[near][rising])), line.name))
        elif heights[-1] <= 1.0:
            right.append((heights[-1], line.name))
    style = {"fontsize": SMALL, "color": "0.3", "annotation_clip": False, "xycoords": "axes fraction"}
    style |= {"textcoords": "axes fraction", "arrowprops": {**LEADER, "color": "0.7"}}
    if upper:
        widest = max(text_size(name)[0] for _, name in upper)
        for (x, name), place in zip(upper, spread(np.array([x for x, _ in upper]), widest / PANEL[0])):
            axes.annotate(name, (x, 1.0), (place, 1.025), ha="center", va="bottom", **style)
    height = text_size("")[1] / PANEL[1]
    for (y, name), place in zip(right, spread(np.array([y for y, _ in right]), height)):
        axes.annotate(name, (1.0, y), (1.015, place), ha="left", va="center", **style)


def name_modes(axes: Axes, campbell: Campbell) -> None:
    """At the right of the orders' numbers."""
    top = axes.get_ylim()[1]
    last = np.flatnonzero(_inside(campbell, axes.get_xlim()))[-1]
    ends = [(frequency[last] / top, mode) for mode, frequency in campbell.modes.items() if frequency[last] <= top]
    places = spread(np.array([y for y, _ in ends]), MODE_NAMES * text_size("")[1] / PANEL[1])
    for (y, mode), place in zip(ends, places):
        style = {"fontsize": 9, "color": colour_of(mode), "ha": "left", "va": "center", "annotation_clip": False}
        style |= {"xycoords": "axes fraction", "textcoords": "axes fraction", "arrowprops": {**LEADER, "color": colour_of(mode)}}
        axes.annotate(f"{roman(mode)}   {y * top:.4g} Hz", (1.0, y), (1.075, place), **style)


def colour_of(mode: int) -> str:
    return MODE_COLOURS[(mode - 1) % len(MODE_COLOURS)]


def _mark_crossings(axes: Axes, campbell: Campbell, crossings: list[Critical]) -> list[Artist]:
    """Those near the speeds in operation are large and have the speed, as far as there is room."""
    handles: list[Artist] = []
    for places, style, label in (
        (("", "clear"), FAR, "mode and order meet at rpm"),
        (("margin",), MARGIN, "meet within the margin"),
        (("inside",), INSIDE, "meet in operation"),
    ):
        if chosen := [one for one in crossings if one.place in places]:
            axes.plot([one.speed for one in chosen], [one.frequency for one in chosen], zorder=5, **style)
            handles.append(Line2D([], [], label=label, **style))
    labels = Labels(axes, PANEL)
    for one in sorted(crossings, key=lambda one: not one.is_too_near):
        x, y = share_of(axes, one.speed), one.frequency / axes.get_ylim()[1]
        side = -1 if _is_close_below(campbell, one, axes.get_ylim()[1] * CLOSE / PANEL[1]) else 1
        far = 0.0 if one.is_too_near else 0.2
        if labels.is_free(x + side * far / 2 / PANEL[0], y + side * far / PANEL[1], DISTANCE + far, DISTANCE + 1.5 * far):
            style = {"fontsize": SMALL, "rotation": TILT, "rotation_mode": "anchor", "zorder": 4, "bbox": HALO}
            offset = {"xytext": (1.5 * side, 5.5 * side), "textcoords": "offset points", "va": "center"}
            colour = "black" if one.is_too_near else "0.35"
            alignment = "left" if side > 0 else "right"
            axes.annotate(f"{one.speed:.4g}", (one.speed, one.frequency), color=colour, ha=alignment, **offset, **style)
    return handles


def _is_close_below(campbell: Campbell, crossing: Critical, gap: float) -> bool:
    """Whether another mode is so close above a crossing that there is more room below."""
    others = [np.interp(crossing.speed, campbell.speed, frequency) for frequency in campbell.modes.values()]
    above = [frequency - crossing.frequency for frequency in others if frequency > crossing.frequency * (1 + SAME)]
    below = [crossing.frequency - frequency for frequency in others if frequency < crossing.frequency * (1 - SAME)]
    return min(above, default=np.inf) < min(gap, *below, np.inf)


def figures_of(folder: Path, arguments: argparse.Namespace) -> Figures:
    campbell = read(folder)
    yield "campbell", draw_campbell(campbell, window_of(folder, campbell.speed, arguments), arguments.top)


def main() -> None:
    parser = figure_parser("nocdyn plot campbell", "campbell", __doc__)
    parser.add_argument("--top", type=finite, metavar="HZ", help="highest frequency (just above those that the orders meet)")
    arguments = arguments_of(parser)
    if arguments.top is not None and arguments.top <= 0:
        parser.error("--top must be above 0")
    draw_folders(arguments, partial(figures_of, arguments=arguments))


if __name__ == "__main__":
    main()
