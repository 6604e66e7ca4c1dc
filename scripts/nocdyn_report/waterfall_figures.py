"""Waterfalls of run-ups: frequencies and orders over the speed as colours, measured and computed side by side."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from .comparisons import SERIES, Comparison, read_comparisons
from .failure import ChoiceError
from .results import RPM, Results
from .speed_results import rpm
from .style import WIDTH, add_title, plain
from .waterfalls import Waterfall, frequency_waterfall, order_waterfall

DEPTH = 300.0  # the largest amplitude over the smallest that has a colour of its own
SEEN = 0.02  # of the largest amplitude: lines above the last one are cut off
NAMED, MOST_NAMED = 0.02, 6  # orders whose amplitude reaches this part of the largest have lines
APART = 0.2  # between two of them
ROOM = 1.15  # above what is seen
SPEED = "omega_"  # signals that are speeds of bodies
MAP = "viridis"

Record = tuple[str, np.ndarray, np.ndarray, np.ndarray]  # name, times [s], values, speeds [rad/s]


def draw_waterfalls(records: Sequence[Record], label: str, titles: Sequence[str]) -> Figure:
    """A column for each record: frequencies over the speed with the largest orders as lines, and below the orders."""
    maps = [(frequency_waterfall(*one[1:]), order_waterfall(*one[1:])) for one in records]
    largest = max(1e-300, *(float(one.amplitudes.max()) for pair in maps for one in pair))
    norm = LogNorm(largest / DEPTH, largest)
    size = (WIDTH if len(maps) == 1 else 1.5 * WIDTH, 7.0)
    figure, grid = pyplot.subplots(2, len(maps), squeeze=False, sharex=True, sharey="row", figsize=size)
    orders = _largest_orders(maps[0][1])
    for (upper, lower), record, (frequencies, by_order) in zip(grid.T, records, maps):
        image = _draw_map(upper, frequencies, norm)
        _draw_map(lower, by_order, norm)
        top = max(_seen(pair[0]) for pair in maps)
        for order in orders:
            ends = rpm(frequencies.speeds[[0, -1]])
            upper.plot(ends, order * ends / 60.0, color="white", linewidth=0.7, linestyle=(0, (4, 3)), alpha=0.8)
            at = min(ends[1], 60.0 * top / order)  # where it leaves the picture, at the right or above
            side = {"ha": "left", "va": "center"} if at == ends[1] else {"ha": "center", "va": "bottom"}
            upper.annotate(f" {order:.4g}", (at, order * at / 60.0), fontsize=8.5, **side)
        upper.set_title(plain(record[0]), pad=14)
        lower.set_xlabel("speed [rpm]")
    for row, name in zip(grid, ("frequency [Hz]", "order")):
        row[0].set_ylabel(name)
    for row, place in zip(grid, (0, 1)):
        row[0].set_ylim(0, max(_seen(pair[place]) for pair in maps))
    figure.colorbar(image, ax=grid, label=plain(label), extend="min", aspect=40)
    add_title(figure, *titles)
    return figure


def _draw_map(axes: Axes, one: Waterfall, norm: LogNorm) -> object:
    axes.grid(visible=False)
    axes.set_facecolor(pyplot.get_cmap(MAP)(0.0))
    colours = np.maximum(one.amplitudes.T, norm.vmin)
    return axes.pcolormesh(rpm(one.speeds), one.lines, colours, norm=norm, cmap=MAP, shading="nearest", rasterized=True)


def _seen(one: Waterfall) -> float:
    """The last line that is worth its room."""
    largest = one.amplitudes.max(axis=0)
    return ROOM * float(one.lines[np.flatnonzero(largest >= SEEN * largest.max())[-1]]) or float(one.lines[-1])


def _largest_orders(one: Waterfall) -> list[float]:
    """Where the largest amplitudes of orders have their peaks; a mode that rings down is at no order for long."""
    typical = np.quantile(one.amplitudes, 0.5, axis=0)
    largest = one.amplitudes.max(axis=0)
    typical[one.lines < APART] = 0.0  # slow changes of the mean
    inner = typical[1:-1]
    peaks = 1 + np.flatnonzero((inner > typical[:-2]) & (inner >= typical[2:]) & (inner > NAMED * typical[1:].max()))
    chosen: list[int] = []
    for place in sorted(peaks, key=lambda at: -largest[at]):
        if all(abs(one.lines[place] - one.lines[other]) > APART for other in chosen):
            chosen.append(place)
    return sorted(float(one.lines[place]) for place in chosen[:MOST_NAMED])


def measured_waterfalls(folder: Path, title: str) -> dict[str, Figure]:
    """Of each measured series beside a measured speed; none where this speed is no run-up."""
    series = [one for one in read_comparisons(folder, "summary.json") if one.kind == SERIES and len(one.measured) > 3]
    speed = next((one for one in series if one.facts["signal"].startswith(SPEED)), None)
    figures = {}
    for one in series if speed else ():
        if one is not speed:
            try:
                figures["waterfall_" + _file(one)] = _draw_comparison(one, speed, title)
            except ChoiceError:  # nothing to see over the speed
                continue
    return figures


def _file(one: Comparison) -> str:
    return one.facts["file"].removeprefix("measured_").removesuffix(".csv")


def _draw_comparison(one: Comparison, speed: Comparison, title: str) -> Figure:
    """The record over the measured speed, and the run over the computed one."""
    inside = (one.abscissa >= speed.abscissa[0]) & (one.abscissa <= speed.abscissa[-1])
    times = one.abscissa[inside]
    records = [
        (name, times, values[inside], np.interp(times, speed.abscissa, speeds))
        for name, values, speeds in (
            ("measured", one.measured, speed.measured),
            ("computed", one.computed, speed.computed),
        )
    ]
    label = f"amplitude of the {one.facts['caption']} [{one.unit}]"
    return draw_waterfalls(records, label, (title, f"{one.name}: {one.subject} over {speed.facts['signal']}"))


def column_waterfalls(results: Results, labels: Sequence[str], speed_label: str) -> dict[str, Figure]:
    """Of columns of a trajectory over the speed of a body."""
    speed = results.header.columns[speed_label]
    speeds = results.values(speed_label) * RPM.get(speed.unit, 1.0) / RPM["rad/s"]
    figures = {}
    for label in labels:
        column = results.header.columns[label]
        record = (column.title, results.time, results.values(label), speeds)
        words = f"amplitude of the {column.caption} [{column.unit}]"
        try:
            drawn = draw_waterfalls([record], words, (results.title, f"{column.name} over the speed of {speed.title}"))
        except ChoiceError as error:
            raise ChoiceError(f"{results.folder}: {column.name} over {speed.name}: {error}") from None
        figures[f"waterfall_{column.name}".replace("/", "_")] = drawn
    return figures
