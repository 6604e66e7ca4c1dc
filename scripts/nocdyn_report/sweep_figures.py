"""Draws the results of a sweep: how each is distributed, and how it depends on what was varied."""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from .results import ResultsError
from .style import WIDTH, add_title, plain, save
from .sweep_panels import (
    LINES,
    MOST_POINTS,
    NOT_DONE_LINES,
    TURN,
    add_note,
    draw_curve,
    draw_histogram,
    draw_map,
    draw_parallel,
    draw_scatter,
    explain_not_done,
    has_outliers,
    rank_correlation,
    wrapped,
)
from .sweep_results import Sweep, Variable, read_sweep

ROWS = 4  # of panels in a figure
COLUMNS = 4
AXES = 10  # of parallel axes, but that of the result
TICK = {"marker": "|", "linestyle": "", "markersize": 8}


def draw_histograms(sweep: Sweep, results: Sequence[Variable]) -> Figure:
    figure, panels = _stack(len(results), 2.2)
    for axes, result in zip(panels, results):
        draw_histogram(axes, sweep, result)
    return figure


def draw_scatters(sweep: Sweep, results: Sequence[Variable], keys: Sequence[Variable]) -> Figure:
    """A row for each result, a column for each varied number."""
    figure, grid = pyplot.subplots(len(results), len(keys), squeeze=False, sharex="col", sharey="row",
                                   figsize=(max(0.85 * WIDTH, 2.9 * len(keys) + 1.0), 2.5 * len(results) + 1.2))
    for row, result in zip(grid, results):
        row[0].set_ylabel(wrapped(result.label))
        for axes, key in zip(row, keys):
            draw_scatter(axes, sweep, key, result)
    for axes, key in zip(grid[-1], keys):
        axes.set_xlabel(wrapped(key.label))
    far_out = any(has_outliers(result.values[sweep.known(result)]) for result in results)
    add_note(figure, "darker: more variants" if sweep.status.size > MOST_POINTS else "",
             "triangles: beyond the axis" if far_out else "")
    explain_not_done(figure, sweep, **TICK)
    return figure


def draw_curves(sweep: Sweep, results: Sequence[Variable]) -> Figure:
    """Each result over the only number that varies; with the largest value marked, and in Hz too, if that is a frequency."""
    key = sweep.varied[0]
    is_frequency = is_resonance(sweep)
    figure, panels = _stack(len(results), 2.6, sharex=True)
    for axes, result in zip(panels, results):
        draw_curve(axes, sweep, key, result, mark_peak=is_frequency)
    panels[-1].set_xlabel(plain(key.label))
    if is_frequency:
        top = panels[0].secondary_xaxis("top", functions=(lambda omega: omega / TURN, lambda hertz: hertz * TURN))
        top.set_xlabel("frequency [Hz]")
    explain_not_done(figure, sweep, **TICK)
    return figure


def draw_maps(sweep: Sweep, results: Sequence[Variable]) -> Figure:
    figure, panels = _stack(len(results), 3.2, sharex=True)
    for axes, result in zip(panels, results):
        draw_map(axes, sweep, result)
        axes.set_ylabel(wrapped(sweep.varied[1].label))
    panels[-1].set_xlabel(plain(sweep.varied[0].label))
    explain_not_done(figure, sweep, marker="x", linestyle="", markersize=5)
    return figure


def draw_parallels(sweep: Sweep, results: Sequence[Variable], keys: Sequence[Variable]) -> Figure:
    figure, panels = _stack(len(results), 3.2, width=max(WIDTH, 1.4 * len(keys) + 3.0))
    for axes, result in zip(panels, results):
        draw_parallel(axes, sweep, keys, result)
    numbers = f"{len(keys)} of {len(sweep.varied)} varied numbers, the most correlated first"
    add_note(figure, f"no more than {LINES} variants are drawn" if sweep.status.size > LINES else "",
             numbers if len(keys) < len(sweep.varied) else "")
    explain_not_done(figure, sweep, NOT_DONE_LINES, linestyle=(0, (3, 2)), linewidth=0.9)
    return figure


def _stack(rows: int, height: float, width: float = WIDTH, sharex: bool = False) -> tuple[Figure, np.ndarray]:
    figure, grid = pyplot.subplots(rows, 1, squeeze=False, sharex=sharex, figsize=(width, height * rows + 1.2))
    return figure, grid[:, 0]


def is_resonance(sweep: Sweep) -> bool:
    return len(sweep.varied) == 1 and sweep.varied[0].key == "frequency" and sweep.varied[0].unit == "rad/s"


def figures_of(sweep: Sweep) -> Iterator[tuple[str, Figure]]:
    """Names and figures; those of many results go on in NAME_2 ..."""
    yield from _paged("histograms", sweep, draw_histograms)
    if len(sweep.varied) == 1:
        yield from _paged("resonance" if is_resonance(sweep) else "curves", sweep, draw_curves)
        return
    keys = sorted(sweep.varied, key=lambda key: -strongest(sweep, key)) if len(sweep.varied) > COLUMNS else sweep.varied
    for first in range(0, len(keys), COLUMNS):
        name = "scatter" if first == 0 else f"scatter_keys{first + 1}"
        yield from _paged(name, sweep, partial(draw_scatters, keys=keys[first:first + COLUMNS]))
    if len(sweep.varied) == 2:
        yield from _paged("map", sweep, draw_maps)
    else:
        yield from _paged("parallel", sweep, partial(draw_parallels, keys=keys[:AXES]))


def _paged(name: str, sweep: Sweep, draw: Callable[[Sweep, Sequence[Variable]], Figure]) -> Iterator[tuple[str, Figure]]:
    for page, first in enumerate(range(0, len(sweep.results), ROWS), start=1):
        yield name if page == 1 else f"{name}_{page}", draw(sweep, sweep.results[first:first + ROWS])


def strongest(sweep: Sweep, key: Variable) -> float:
    """The largest rank correlation of a varied number with any result."""
    known = ((result.values[rows], key.values[rows]) for result in sweep.results for rows in [sweep.known(result)])
    return max(np.nan_to_num(abs(rank_correlation(*pair))) for pair in known)


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/plot_sweep", description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'nocdyn sweep' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="where the figures go, as PNG, SVG and PDF (RESULTS/figures)")
    arguments = parser.parse_args()
    folder = arguments.out or arguments.results / "figures"
    try:
        sweep = read_sweep(arguments.results)
    except ResultsError as error:
        sys.exit(f"{parser.prog}: {error}")
    names = []
    for name, figure in figures_of(sweep):
        add_title(figure, sweep.title, sweep.remark)
        save(figure, folder, name)
        names.append(name)
    print(f"{', '.join(names)} (PNG, SVG, PDF) are in {folder}")


if __name__ == "__main__":
    main()
