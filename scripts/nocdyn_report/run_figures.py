"""Draws the results of any run: motion, phase planes, torques, energy; or the columns that --columns names."""

import argparse
import math
import sys
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .columns import CURRENT, FORCE, LOSS, MOMENT, REACTION, SLIP, SPEED, STRESS, TORQUE, TWIST, Column, by_sort
from .failure import ChoiceError, ResultsError
from .measured_figures import measured_figures
from .multiples import MOST_PANELS, draw_multiples
from .phase_planes import MOST_PLANES, draw_phase_planes
from .results import Header, Results, read_results
from .selection import matching, widest
from .style import COLOURS, PIXELS, WIDTH, add_format_option, add_title, draw_lines, save, saved
from .thinning import thin
from .waterfall_figures import column_waterfalls, measured_waterfalls

MOTION = (SPEED, SLIP, TWIST)
TORQUES = (MOMENT, REACTION, FORCE, STRESS, TORQUE, LOSS, CURRENT)
RESIDUAL = "energy_residual"
LONGEST = 32  # characters of a line beside a panel
SMOOTH_ROWS = 12  # of an oscillation, with which its phase plane looks round
FEWEST_TURNS = 20  # turning points that make an oscillation

Figures = dict[str, Figure]


def draw_over_time(results: Results, name: str, labels: Sequence[str]) -> Figures:
    """A figure with a panel for each sort of columns, and figures with a panel for each column where these are many."""
    sorts = by_sort(results.header.columns[label] for label in labels)
    few = [columns for columns in sorts if len(columns) <= len(COLOURS)]
    figures = {name: _draw_panels(results, few)} if few else {}
    for columns in sorts:
        for start in range(0, len(columns) if columns not in few else 0, MOST_PANELS):
            page = columns[start : start + MOST_PANELS]
            figure = draw_multiples(results.time, [results.series(column.label) for column in page], page[0].caption)
            _add_title(figure, results, _left_out(results.header, len(columns), page[0]))
            figures[_unused(page[0].kind, figures)] = figure
    return figures


def _unused(name: str, figures: Figures) -> str:
    """The name, with a number from the second figure on."""
    pages = sum(other == name or other.startswith(f"{name}_") for other in figures)
    return f"{name}_{pages + 1}" if pages else name


def _draw_panels(results: Results, sorts: list[list[Column]]) -> Figure:
    figure, grid = pyplot.subplots(len(sorts), 1, squeeze=False, sharex=True, figsize=(WIDTH, 2.4 * len(sorts) + 0.8))
    for axes, columns in zip(grid.flat, sorts):
        series = [results.series(column.label) for column in columns]
        draw_lines(axes, [one.name for one in series], [(results.time, one.values) for one in series])
        axes.set_ylabel(textwrap.fill(f"{columns[0].caption} [{series[0].unit}]", LONGEST))
    _finish_time_axis(grid.flat[-1], results)
    _add_title(figure, results)
    return figure


def draw_energy(results: Results) -> Figure | None:
    """Energies and works, and below them the energy balance error; what the trajectory has of them."""
    there = results.columns(*(column.kind for column in _energies(results.header)))
    panels = [[one for one in there if (one.kind == RESIDUAL) == is_residual] for is_residual in (False, True)]
    panels = [columns for columns in panels if columns]
    if not panels:
        return None
    heights = [1 if columns[0].kind == RESIDUAL else 2 for columns in panels]
    size = (WIDTH, 1.7 * sum(heights) + 0.9)
    figure, grid = pyplot.subplots(len(panels), 1, squeeze=False, sharex=True, figsize=size, height_ratios=heights)
    for axes, columns in zip(grid.flat, panels):
        one = columns[0]
        if one.kind == RESIDUAL:
            axes.plot(*thin(results.time, results.values(one.label), PIXELS), color=COLOURS[-1], linewidth=0.8)
        else:
            draw_lines(axes, [one.caption for one in columns], [(results.time, results.values(one.label)) for one in columns])
        axes.set_ylabel(textwrap.fill(f"{one.caption if one.kind == RESIDUAL else 'energy'} [{one.unit}]", LONGEST))
    _finish_time_axis(grid.flat[-1], results)
    _add_title(figure, results)
    return figure


def _energies(header: Header) -> list[Column]:
    return [column for column in header.columns.values() if column.unit == "J" and not column.element]


def _finish_time_axis(axes: Axes, results: Results) -> None:
    axes.set_xlim(results.time[0], results.time[-1])
    axes.set_xlabel("time [s]")


def _add_title(figure: Figure, results: Results, *remarks: str) -> None:
    add_title(figure, results.title, results.shortfall, *remarks)


def _left_out(header: Header, shown: int, column: Column) -> str:
    """What says that not all columns of a sort are drawn."""
    total = sum(1 for other in header.columns.values() if other.sort == column.sort)
    return f"{shown} of {total}: {'those that vary most' if header.ranges else 'the first'}" if shown < total else ""


def _sorts(header: Header, *ranks: int) -> list[list[str]]:
    """Labels, by their sorts."""
    return [[one.label for one in columns] for columns in by_sort(one for one in header.columns.values() if one.rank in ranks)]


def default_labels(header: Header) -> dict[str, list[str]]:
    """The columns of each figure: of sorts that many elements have, those that vary most."""

    def shown(sorts: list[list[str]]) -> list[str]:
        return [label for labels in sorts for label in widest(labels, header.ranges, MOST_PANELS)]

    angles = [] if header.of("omega") else [header.of("phi")]
    motion, torques = shown(angles + _sorts(header, *MOTION)), shown(_sorts(header, *TORQUES))
    energies = [column.label for column in _energies(header)]
    return {"motion": motion, "phase_planes": _plane_labels(header), "torques": torques, "energy": energies}


def _plane_labels(header: Header) -> list[str]:
    """Twists and angles if all have room, else twists, for the angles of bodies that turn say little; with their speeds."""
    twists, angles = header.of("twist"), header.of("phi")
    if len(twists) + len(angles) <= MOST_PLANES:
        return twists + angles + header.of("omega")
    if not twists:
        return widest(angles, header.ranges, MOST_PLANES) + header.of("omega")
    planes = widest(twists, header.ranges, MOST_PLANES)
    return planes + [speed for twist in planes for speed in header.speeds_about(twist)]


def default_figures(results: Results) -> Figures:
    labels = default_labels(results.header)
    figures = draw_over_time(results, "motion", labels["motion"])
    if planes := draw_phase_planes(results, labels["phase_planes"]):
        kind = "twist" if results.header.of("twist") else "phi"
        drawn = [label for label in labels["phase_planes"] if label in results.header.of(kind)]
        _add_title(planes, results, _left_out(results.header, len(drawn), results.header.columns[drawn[0]]))
        figures["phase_planes"] = planes
    figures |= draw_over_time(results, "torques", labels["torques"])
    if energy := draw_energy(results):
        figures["energy"] = energy
    return figures


def coarsest(results: Results) -> tuple[str, float]:
    """The twist with the fewest rows for each of its oscillations, and how many; infinity without oscillations."""
    rows = [(column.title, _rows_per_oscillation(results.values(column.label))) for column in results.columns("twist")]
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


def _parser() -> argparse.ArgumentParser:
    usage = "%(prog)s RESULTS [--columns PATTERN ...] [--from T] [--to T] [--rpm]\n"
    usage += "       [--waterfall PATTERN ...] [--speed BODY] [--format KINDS] [--out DIR]"
    parser = argparse.ArgumentParser(prog="nocdyn plot run", usage=usage, description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'nocdyn run' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures go (RESULTS/figures)")
    parser.add_argument(
        "--columns",
        nargs="+",
        metavar="PATTERN",
        help="draws these columns only, e.g. 'total_moment_*' omega_motor; '*' stands for any text, '?' for a character",
    )
    parser.add_argument("--from", dest="start", type=_time, default=-math.inf, metavar="T", help="first time [s]")
    parser.add_argument("--to", dest="end", type=_time, default=math.inf, metavar="T", help="last time [s]")
    parser.add_argument("--rpm", action="store_true", help="speeds in rpm")
    parser.add_argument(
        "--waterfall",
        nargs="+",
        metavar="PATTERN",
        help="draws the amplitudes of frequencies and orders of these columns only, over the speed of a run-up",
    )
    parser.add_argument("--speed", metavar="BODY", help="the body whose speed and turns --waterfall takes; the first one")
    add_format_option(parser)
    return parser


def _speed_label(header: Header, body: str | None) -> str:
    """The column of the speed of a body."""
    speeds = header.of("omega")
    if not speeds:
        raise ChoiceError(f"{header.folder}: the trajectory has no speed of a body, over which waterfalls are")
    named = {header.columns[label].title.lower(): label for label in speeds}
    if body and body.lower() not in named:
        raise ChoiceError(f"{header.folder}: no speed of '{body}'; there are: {', '.join(named)}")
    return named[body.lower()] if body else speeds[0]


def _hint(header: Header, patterns: Sequence[str] | None) -> str:
    """What draws the columns that are left out, '' if all are drawn."""
    many = [labels[0] for labels in _sorts(header, *MOTION, *TORQUES) if len(labels) > MOST_PANELS]
    kinds = dict.fromkeys(header.columns[label].kind for label in many)
    return "" if patterns or not kinds else "others: --columns " + " ".join(f"'{kind}_*'" for kind in kinds)


def _time(text: str) -> float:
    try:
        time = float(text)
    except ValueError:
        time = math.nan
    if not math.isfinite(time):
        raise argparse.ArgumentTypeError(f"'{text}' is no time")
    return time


def _drawn(results: Results, arguments: argparse.Namespace) -> Figures:
    if arguments.waterfall:
        return column_waterfalls(
            results, _waterfall_labels(results.header, arguments), _speed_label(results.header, arguments.speed)
        )
    if arguments.columns:
        return draw_over_time(results, "columns", matching(results.header, arguments.columns))
    return default_figures(results)


def _waterfall_labels(header: Header, arguments: argparse.Namespace) -> list[str]:
    speed = _speed_label(header, arguments.speed)
    return [label for label in matching(header, arguments.waterfall) if label != speed]


def _needed(header: Header, arguments: argparse.Namespace) -> Iterator[str]:
    if arguments.waterfall:
        return iter([*_waterfall_labels(header, arguments), _speed_label(header, arguments.speed)])
    if arguments.columns:
        return iter(matching(header, arguments.columns))
    return (label for labels in default_labels(header).values() for label in labels)


def main() -> None:
    parser = _parser()
    arguments = parser.parse_args()
    if arguments.waterfall and arguments.columns:
        parser.error("--waterfall and --columns are for one figure each")
    if arguments.speed and not arguments.waterfall:
        parser.error("--speed is of --waterfall")
    if arguments.start >= arguments.end:
        parser.error(f"--from {arguments.start:g} must be less than --to {arguments.end:g}")
    folder = arguments.out or arguments.results / "figures"
    results = read_results(arguments.results, lambda header: _needed(header, arguments), arguments.rpm)
    results = results.between(arguments.start, arguments.end)
    if results.shortfall:
        print(f"{parser.prog}: {arguments.results}: the trajectory is partial: {results.shortfall}", file=sys.stderr)
    figures = _drawn(results, arguments)
    chosen = arguments.columns or arguments.waterfall
    if not chosen:
        figures |= measured_figures(arguments.results, "summary.json", results.title)
        figures |= measured_waterfalls(arguments.results, results.title)
    if not figures:
        raise ResultsError(f"{arguments.results}: nothing to draw: the trajectory has the time only")
    for name, figure in figures.items():
        save(figure, folder, name, arguments.format)
    print(saved(list(figures), arguments.format, folder))
    for remark in (_hint(results.header, chosen), "" if arguments.waterfall else _advise(results)):
        if remark:
            print(remark)


if __name__ == "__main__":
    main()
