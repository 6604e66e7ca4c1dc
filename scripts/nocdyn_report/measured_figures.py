"""Measured values over the computed ones, and their differences: of a run, a response or modes with &measurement."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .comparisons import FREQUENCY, ORDER, SERIES, Comparison, read_comparisons
from .speed_panels import speed_label
from .speed_results import rpm
from .style import COLOURS, PIXELS, REFERENCE, WIDTH, add_title, plain
from .thinning import thin

MEASURED = {"color": "0.55", "linewidth": 1.0}
COMPUTED = {"color": COLOURS[0], "linewidth": 1.2}
LONGEST = 28  # characters of a line beside a panel
MOST_POINTS = 40  # of a record that has a mark for each value
DIGITS = 4
GROUP = 0.78  # width of the bars side by side
FEWEST = 4  # of such groups that have room


def remark_on(comparison: Comparison) -> str:
    """Its statistics."""
    facts = comparison.facts
    words = [f"bias {_value(comparison, 'bias')}", f"spread {_value(comparison, 'spread')} {comparison.unit}"]
    if "correlation" in facts:
        words.append(f"correlation {facts['correlation']:.{DIGITS}g}")
    if facts.get("delay_s"):
        words.append(f"clock moved by {facts['delay_s']:.{DIGITS}g} s")
    if "band_Hz" in facts:
        words.append("{:g} to {:g} Hz".format(*facts["band_Hz"]))
    return ", ".join(words)


def _value(comparison: Comparison, key: str) -> str:
    return f"{comparison.value(key):.{DIGITS}g}"


def draw_comparison(comparison: Comparison, title: str) -> Figure:
    """Both over the time or the speed, and below them the differences."""
    figure, (upper, lower) = pyplot.subplots(2, 1, sharex=True, figsize=(WIDTH, 5.4), height_ratios=(2, 1))
    x = comparison.abscissa if comparison.kind == SERIES else rpm(comparison.abscissa)
    mark = {"marker": "o", "markersize": 3.5} if comparison.kind == ORDER or len(x) <= MOST_POINTS else {}
    line = {} if comparison.kind == SERIES else {"linestyle": "none"}  # between the measured speeds it may have been anything
    upper.plot(*thin(x, comparison.measured, PIXELS), label="measured", **MEASURED, **mark, **line)
    upper.plot(*thin(x, comparison.computed, PIXELS), label="computed", **COMPUTED, **mark)
    lower.axhline(comparison.value("bias"), label="below: bias, their mean difference", **REFERENCE)
    lower.plot(*thin(x, comparison.computed - comparison.measured, PIXELS), color=COLOURS[1], linewidth=1.0, **mark)
    add_legend_above(upper, lower)
    upper.set_ylabel(plain(textwrap.fill(f"{comparison.facts['caption']} [{comparison.unit}]", LONGEST)))
    lower.set_ylabel(f"computed less\nmeasured\n[{comparison.unit}]")
    lower.set_xlabel(plain(abscissa_label(comparison)))
    if not mark:
        lower.set_xlim(min(x), max(x))
    add_title(figure, title, f"{comparison.name}: {comparison.subject}", remark_on(comparison))
    return figure


def abscissa_label(comparison: Comparison) -> str:
    if comparison.kind == SERIES:
        return "time [s]"
    return speed_label(comparison.body) if comparison.body else "speed [rpm]"


def add_legend_above(upper: Axes, lower: Axes) -> None:
    """Of both panels, above them: in them are curves."""
    entries = [axes.get_legend_handles_labels() for axes in (upper, lower)]
    handles, labels = ([*one, *other] for one, other in zip(*entries))
    upper.legend(handles, labels, loc="lower left", bbox_to_anchor=(0, 1), ncols=len(handles), fontsize=8.5)


def draw_frequencies(comparison: Comparison, title: str) -> Figure:
    """Measured and computed frequencies by the number of their mode, and damping ratios below if they were measured."""
    panels = [("natural frequency [Hz]", comparison.measured, comparison.computed)]
    if comparison.dampings:
        panels.append(("damping ratio", *comparison.dampings))
    figure, grid = pyplot.subplots(len(panels), 1, squeeze=False, figsize=(WIDTH, 2.6 * len(panels) + 1.0))
    for axes, (label, measured, computed) in zip(grid.flat, panels):
        bars = [("measured", MEASURED["color"], measured), ("computed", COMPUTED["color"], computed)]
        draw_bars(axes, comparison.abscissa, bars)
        axes.set_ylabel(label)
    grid.flat[0].legend(loc="upper left", ncols=2)
    grid.flat[-1].set_xlabel("mode; above the bars: difference of the computed value")
    remark = remark_on(comparison) if len(comparison.measured) > 1 else ""
    add_title(figure, title, f"{comparison.name}: {comparison.subject}", remark)
    return figure


def draw_bars(axes: Axes, places: np.ndarray, bars: Sequence[tuple[str, str, np.ndarray]]) -> None:
    """Bars side by side, (label, colour, values) each; above those after the first, the measured ones, by what they differ."""
    width = GROUP / len(bars)
    measured = bars[0][2]
    for side, (label, colour, values) in enumerate(bars):
        at = places + (side - 0.5 * (len(bars) - 1)) * width
        axes.bar(at, values, width=width, color=colour, label=label)
        for x, value, one in zip(at, values, measured) if side else ():
            told, sign = f"{100 * (value - one) / abs(one):+.2g} %" if one else "", 1 if value >= 0 else -1
            look = {"ha": "center", "va": "bottom" if sign > 0 else "top", "fontsize": 8}
            axes.annotate(told, (x, value), (0, 3 * sign), textcoords="offset points", **look)
    room = 0.5 * max(FEWEST, places.max() - places.min() + 1)
    axes.set_xlim((places.min() + places.max()) / 2 - room, (places.min() + places.max()) / 2 + room)
    axes.margins(y=0.3)
    axes.grid(visible=False, axis="x")
    axes.set_xticks(places, [f"{place:g}" for place in places])


def measured_figures(folder: Path, report: str, title: str) -> dict[str, Figure]:
    """A figure for each measurement with several values, and of all frequencies, by the name of its file."""
    figures = {}
    for one in read_comparisons(folder, report):
        name = one.facts["file"].removesuffix(".csv")
        if one.kind == FREQUENCY:
            figures[name] = draw_frequencies(one, title)
        elif one.facts["values"] > 1:
            figures[name] = draw_comparison(one, title)
    return figures
