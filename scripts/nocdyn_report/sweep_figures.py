"""Draws the results of a sweep: how each is distributed, and how it depends on what was varied."""

import argparse
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from .band_figures import band_figures
from .band_results import read_bands
from .style import WIDTH, add_format_option, add_title, plain, save, saved
from .sweep_curves import Family, add_hertz, draw_family, explain_marks, family_of
from .sweep_influence import MOST_BARS, Influence, draw_influence
from .sweep_panels import (
    LINES,
    MOST_POINTS,
    NOT_DONE_LINES,
    add_note,
    draw_histogram,
    draw_map,
    draw_parallel,
    draw_scatter,
    explain_not_done,
    has_outliers,
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


def draw_scatters(sweep: Sweep, results: Sequence[Variable], influence: Influence) -> Figure:
    """A row for each result; a column for each varied number, or for those with the most influence on the result."""
    columns = min(COLUMNS, len(sweep.varied))
    are_all = columns == len(sweep.varied)
    figure, grid = pyplot.subplots(
        len(results),
        columns,
        squeeze=False,
        sharex="col" if are_all else "none",
        sharey="row",
        figsize=(max(0.85 * WIDTH, 2.9 * columns + 1.0), (2.5 if are_all else 2.9) * len(results) + 1.2),
    )
    for row, result in zip(grid, results):
        row[0].set_ylabel(wrapped(result.full_label), fontsize=9)
        for axes, key in zip(row, sweep.varied if are_all else influence.strongest_first(result)):
            draw_scatter(axes, sweep, key, result)
            if not are_all or result is results[-1]:
                axes.set_xlabel(wrapped(key.label))
    far_out = any(has_outliers(sweep, result.values[sweep.known(result)]) for result in results)
    add_note(
        figure,
        "" if are_all else f"of {len(sweep.varied)} varied numbers the {columns} most correlated with the result",
        "grey: no more than chance alone gives, 95 % of the time",
        "darker: more variants" if sweep.status.size > MOST_POINTS else "",
        "triangles: beyond the axis" if far_out else "",
    )
    explain_not_done(figure, sweep, **TICK)
    return figure


def draw_curves(sweep: Sweep, results: Sequence[Variable], family: Family) -> Figure:
    """Each result over one number; in Hz too, if that is a frequency."""
    figure, panels = _stack(len(results), 2.6, width=WIDTH if family.parameter is None else 1.2 * WIDTH, sharex=True)
    for axes, result in zip(panels, results):
        draw_family(axes, sweep, family, result)
    panels[-1].set_xlabel(plain(family.key.label))
    if family.is_resonance and family.key.unit != "Hz":
        add_hertz(panels[0])
    add_note(figure, explain_marks(family))
    explain_not_done(figure, sweep, **TICK)
    return figure


def draw_influences(sweep: Sweep, results: Sequence[Variable], influence: Influence) -> Figure:
    bars = min(MOST_BARS, len(sweep.varied))
    figure, panels = _stack(len(results), 0.6 + 0.24 * bars, sharex=True)
    for axes, result in zip(panels, results):
        draw_influence(axes, sweep, influence, result)
    panels[-1].set_xlabel("rank correlation with the result")
    add_note(
        figure,
        "grey: what chance alone gives, 95 % of the time",
        f"{bars} of {len(sweep.varied)} varied numbers" if bars < len(sweep.varied) else "",
    )
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
    add_note(
        figure,
        f"{LINES} of {sweep.status.size} variants are drawn" if sweep.status.size > LINES else "",
        numbers if len(keys) < len(sweep.varied) else "",
    )
    explain_not_done(figure, sweep, NOT_DONE_LINES, linestyle=(0, (3, 2)), linewidth=0.9)
    return figure


def _stack(rows: int, height: float, width: float = WIDTH, sharex: bool = False) -> tuple[Figure, np.ndarray]:
    figure, grid = pyplot.subplots(rows, 1, squeeze=False, sharex=sharex, figsize=(width, height * rows + 1.2))
    return figure, grid[:, 0]


def figures_of(sweep: Sweep) -> Iterator[tuple[str, Figure]]:
    """Names and figures; those of many results go on in NAME_2 ..."""
    if not sweep.results:
        return
    sweep = sweep.in_short()
    family = family_of(sweep)
    if family is None or not sweep.is_grid:  # how often a value comes along a curve says nothing
        yield from _paged("histograms", sweep, draw_histograms)
    if family is not None:
        yield from _paged("resonance" if family.is_resonance else "curves", sweep, partial(draw_curves, family=family))
    else:
        yield from _clouds(sweep)
    if len(sweep.varied) == 2:
        yield from _paged("map", sweep, draw_maps)


def _clouds(sweep: Sweep) -> Iterator[tuple[str, Figure]]:
    """The figures of variants that do not lie on curves."""
    influence = Influence(sweep)
    if not sweep.is_grid:
        yield from _paged("influence", sweep, partial(draw_influences, influence=influence))
    yield from _paged("scatter", sweep, partial(draw_scatters, influence=influence))
    if len(sweep.varied) > 2:
        keys = influence.strongest_first()[:AXES] if len(sweep.varied) > COLUMNS else sweep.varied
        yield from _paged("parallel", sweep, partial(draw_parallels, keys=keys))


def _paged(name: str, sweep: Sweep, draw: Callable[[Sweep, Sequence[Variable]], Figure]) -> Iterator[tuple[str, Figure]]:
    for page, first in enumerate(range(0, len(sweep.results), ROWS), start=1):
        yield name if page == 1 else f"{name}_{page}", draw(sweep, sweep.results[first : first + ROWS])


def main() -> None:
    parser = argparse.ArgumentParser(prog="nocdyn plot sweep", description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'nocdyn sweep' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures go (RESULTS/figures)")
    add_format_option(parser)
    arguments = parser.parse_args()
    folder = arguments.out or arguments.results / "figures"
    sweep = read_sweep(arguments.results)
    names = []
    bands = read_bands(arguments.results, sweep)
    for name, figure in chain(band_figures(bands, sweep.title) if bands else (), figures_of(sweep)):
        add_title(figure, sweep.title, sweep.remark)
        save(figure, folder, name, arguments.format)
        names.append(name)
    print(saved(names, arguments.format, folder))


if __name__ == "__main__":
    main()
