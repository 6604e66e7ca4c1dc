"""Draws the results of any run: motion, phase planes, torques, energy."""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .phase_planes import draw_phase_planes
from .results import Column, Results, ResultsError, read_results
from .style import COLOURS, WIDTH, add_format_option, add_title, draw_lines, save, saved

MOTION = {"omega": "speed", "twist": "twist"}
TORQUES = {
    "torque": "motors, loads,\nexcitations",
    "moment": "elastic moment\non the first body",
    "damping": "damping moment\non the first body",
    "throttle": "throttle",
    "current": "current",
    "reaction": "reaction of\ngears, joints",
}
SMOOTH_ROWS = 12  # of an oscillation, with which its phase plane looks round
FEWEST_TURNS = 20  # turning points that make an oscillation
ENERGIES = {
    "kinetic": "kinetic_energy [J]",
    "elastic": "elastic_energy [J]",
    "work put in": "work_in [J]",
    "work taken out": "work_out [J]",
}


def draw_over_time(results: Results, captions: dict[str, str]) -> Figure | None:
    """One panel over time for each quantity and unit that the run has; None if it has none of them."""
    panels = [(captions[quantity], columns) for quantity in captions for columns in _by_unit(results.columns(quantity))]
    if not panels:
        return None
    figure, grid = pyplot.subplots(len(panels), 1, squeeze=False, sharex=True, figsize=(WIDTH, 2.4 * len(panels) + 0.8))
    for axes, (caption, columns) in zip(grid.flat, panels):
        draw_lines(axes, [column.element for column in columns], [(results.time, column.values) for column in columns])
        axes.set_ylabel(f"{caption} [{columns[0].unit}]")
    _finish_time_axis(grid.flat[-1], results)
    return figure


def draw_energy(results: Results) -> Figure:
    """Energies and works, and below them the energy balance error."""
    figure, (energies, residual) = pyplot.subplots(2, 1, sharex=True, figsize=(WIDTH, 6.0), height_ratios=(2, 1))
    draw_lines(energies, list(ENERGIES), [(results.time, results.values(label)) for label in ENERGIES.values()])
    energies.set_ylabel("energy [J]")
    residual.plot(results.time, results.values("energy_residual [J]"), color=COLOURS[-1], linewidth=0.8)
    residual.set_ylabel("energy residual [J]")
    _finish_time_axis(residual, results)
    return figure


def _by_unit(columns: list[Column]) -> Iterator[list[Column]]:
    """Tooth forces [N] and gear moments [N m] do not share an axis."""
    for unit in dict.fromkeys(column.unit for column in columns):
        yield [column for column in columns if column.unit == unit]


def _finish_time_axis(axes: Axes, results: Results) -> None:
    axes.set_xlim(results.time[0], results.time[-1])
    axes.set_xlabel("time [s]")


def draw_run(results: Results, folder: Path, formats: Sequence[str]) -> list[str]:
    """Saves the figures and gives their names."""
    figures = {
        "motion": draw_over_time(results, MOTION),
        "phase_planes": draw_phase_planes(results),
        "torques": draw_over_time(results, TORQUES),
        "energy": draw_energy(results),
    }
    drawn = [name for name, figure in figures.items() if figure]
    for name in drawn:
        add_title(figures[name], results.title, results.shortfall)
        save(figures[name], folder, name, formats)
    return drawn


def coarsest(results: Results) -> tuple[str, float]:
    """The twist with the fewest rows for each of its oscillations, and how many; infinity without oscillations."""
    rows = [(column.element, _rows_per_oscillation(column.values)) for column in results.columns("twist")]
    return min(rows, key=lambda pair: pair[1], default=("", np.inf))


def _rows_per_oscillation(values: np.ndarray) -> float:
    steps = np.diff(values)
    rising = steps[np.abs(steps) > 0.01 * np.ptp(values)] > 0.0
    turns = np.flatnonzero(rising[1:] != rising[:-1])
    return 2.0 * np.median(np.diff(turns)) if turns.size >= FEWEST_TURNS else np.inf


def _advise(results: Results) -> str:
    """What draws a run smoothly that has too few rows, '' if it has enough."""
    name, rows = coarsest(results)
    if rows >= SMOOTH_ROWS:
        return ""
    interval = np.diff(results.time).max() * rows / (2 * SMOOTH_ROWS)
    return f"about {rows:.0f} rows for an oscillation of '{name}' draw corners; smooth: &output interval = {interval:.1g}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/plot", description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'nocdyn run' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures go (RESULTS/figures)")
    add_format_option(parser)
    arguments = parser.parse_args()
    folder = arguments.out or arguments.results / "figures"
    try:
        results = read_results(arguments.results)
        if results.shortfall:
            print(f"{parser.prog}: {arguments.results}: the trajectory is partial: {results.shortfall}", file=sys.stderr)
        names = draw_run(results, folder, arguments.format)
    except ResultsError as error:
        sys.exit(f"{parser.prog}: {error}")
    print(saved(names, arguments.format, folder))
    if advice := _advise(results):
        print(advice)


if __name__ == "__main__":
    main()
