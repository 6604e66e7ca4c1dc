"""Draws periodic motions over their parameter: half ranges with unstable parts dashed, jumps, chosen motions, harmonics."""

import argparse
import math
import textwrap
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .columns import Column, by_sort
from .failure import ChoiceError
from .orbit_results import HALF_RANGE, Motion, Orbits, Settled, Special, read_orbits, read_settled
from .selection import matches
from .speed_panels import HALO, SMALL, Figures, draw_folders
from .speed_results import short_unit
from .style import COLOURS, WIDTH, add_format_option, add_legend, add_title, plain

MOST_PANELS = 6  # of a figure
MOST_PLANES = 9
WIDE = 11.5  # width of a figure of two columns [in]
PANEL = 2.9  # height of a panel [in]
LONGEST = 34  # characters of a line beside a panel
UNSTABLE = (0, (4, 2))
MARKS = {  # of kinds of special points
    "fold": {"marker": "o", "markerfacecolor": "white"},
    "period_doubling": {"marker": "s", "markerfacecolor": "black"},
    "neimark_sacker": {"marker": "D", "markerfacecolor": "black"},
    "branch_point": {"marker": "^", "markerfacecolor": "black"},
    "torque_fold": {"marker": "v", "markerfacecolor": "white"},
}
OTHER = {"marker": "*", "markerfacecolor": "black"}
MARK = {"color": "black", "linestyle": "", "markersize": 5, "zorder": 5}
SETTLED = {"color": "black", "marker": ".", "markersize": 4, "linestyle": "", "zorder": 4}
JUMP = {"arrowstyle": "-|>", "color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 1.5)), "shrinkA": 3, "shrinkB": 1}
FREQUENCY, QUASI_LINEAR = "frequency [Hz]", "quasi_linear_frequency [Hz]"  # of a nonlinear mode
LARGEST_RATIO = 1e-6  # of amplitudes that a map of harmonics shows


def colour_of(orbits: Orbits, branch: int) -> str:
    return COLOURS[orbits.branches.index(branch) % (len(COLOURS) - 1)]


def draw_half_ranges(orbits: Orbits, page: Sequence[Column], settled: Settled | None) -> Figure:
    """A panel for each signal of one sort."""
    across = 1 if len(page) == 1 else 2
    down = -(-len(page) // across)
    width, height = (WIDTH, 1.5 * PANEL) if across == 1 else (WIDE, PANEL)
    figure, grid = pyplot.subplots(down, across, squeeze=False, figsize=(width, height * down + 1.5))
    factor, unit = short_unit(page[0].unit, max(orbits.half_range(one).max() for one in page))
    for axes, column in zip(grid.flat, page):
        _draw_branches(axes, orbits, column, factor)
        if settled is not None and (values := settled.half_range(column)) is not None:
            axes.plot(settled.value, values / factor, **SETTLED)
        axes.set_xlim(orbits.window)
        axes.set_ylim(bottom=0.0)
        axes.margins(y=0.1)
        axes.set_title(plain(column.title), loc="left")
        axes.set_ylabel(textwrap.fill(f"{column.caption} [{unit}]", LONGEST))
    for axes in grid.flat[len(page) :]:
        axes.set_visible(False)
    for axes in grid.flat[max(len(page) - across, 0) : len(page)]:
        axes.set_xlabel(plain(orbits.axis_label))
    add_legend(figure, handles=_legend(orbits, settled), ncols=3 if across == 1 else 4, fontsize=8.5)
    add_title(figure, orbits.title, f"periodic motions: half range over {orbits.axis_name}")
    return figure


def _draw_branches(axes: Axes, orbits: Orbits, column: Column, factor: float) -> None:
    values = orbits.half_range(column) / factor
    for one in orbits.stretches:
        style = "-" if one.is_stable else UNSTABLE
        axes.plot(
            orbits.value[one.rows],
            values[one.rows],
            color=colour_of(orbits, one.branch),
            linestyle=style,
            linewidth=1.5,
            zorder=3,
        )
    if len(values) == 1:
        axes.plot(orbits.value, values, "o", color=colour_of(orbits, orbits.branches[0]))
    named: list[tuple[float, float]] = []
    for special in orbits.specials:
        place = special.value, values[special.row]
        axes.plot(*place, **(MARK | MARKS.get(special.kind, OTHER)))
        for landing in orbits.landings(special, column):
            axes.annotate("", (special.value, landing / factor), place, arrowprops=JUMP, zorder=2)
        if special.kind == "torque_fold":
            continue
        _name(axes, orbits, special, place, values.max(), named)


def _name(
    axes: Axes, orbits: Orbits, special: Special, place: tuple[float, float], top: float, named: list[tuple[float, float]]
) -> None:
    """The value of the parameter beside a special point, unless another one stands there."""
    x, y = (place[0] - orbits.window[0]) / (orbits.window[1] - orbits.window[0]), place[1] / (top or 1.0)
    if any(abs(x - a) < 0.13 and abs(y - b) < 0.07 for a, b in named):
        return
    named.append((x, y))
    is_right = x < 0.8
    offset = (6 if is_right else -6, 3)
    style = {"fontsize": SMALL, "va": "bottom", "ha": "left" if is_right else "right", "zorder": 6, "bbox": HALO}
    axes.annotate(f"{special.value:.6g}", place, offset, textcoords="offset points", **style)


def _legend(orbits: Orbits, settled: Settled | None) -> list[Artist]:
    handles: list[Artist] = []
    for branch in orbits.branches:
        name = f"branch {branch}" if len(orbits.branches) > 1 else "motions"
        stable = f"{name}, stable" if orbits.has_stability else name
        handles.append(Line2D([], [], color=colour_of(orbits, branch), linewidth=1.5, label=stable))
    if any(not one.is_stable for one in orbits.stretches):
        handles.append(Line2D([], [], color="0.3", linestyle=UNSTABLE, linewidth=1.5, label="unstable"))
    for kind in dict.fromkeys(one.kind for one in orbits.specials):
        name = next(one.name for one in orbits.specials if one.kind == kind)
        handles.append(Line2D([], [], label=name, **(MARK | MARKS.get(kind, OTHER))))
    if any(one.lands_on for one in orbits.specials):
        handles.append(Line2D([], [], color=JUMP["color"], linestyle=JUMP["linestyle"], linewidth=0.9, label="jump"))
    if settled is not None:
        handles.append(Line2D([], [], label="settled runs", **SETTLED))
    return handles


def draw_planes(orbits: Orbits, motions: Sequence[Motion], columns: Sequence[Column]) -> Figure:
    """Phase planes of the motions at one value of the parameter: a panel for each twist or angle."""
    across = math.ceil(math.sqrt(len(columns)))
    down = math.ceil(len(columns) / across)
    figure, grid = pyplot.subplots(down, across, squeeze=False, figsize=(WIDTH * max(across, 2) / 2, 3.2 * down + 1.2))
    for axes, column in zip(grid.flat, columns):
        for place, motion in enumerate(motions):
            label = _label_in(motion, column)
            style = UNSTABLE if motion.entry.get("stable") is False else "-"
            axes.plot(motion.wave(label), motion.rate(label), color=COLOURS[place % len(COLOURS)], linestyle=style)
            axes.plot(motion.wave(label)[0], motion.rate(label)[0], "o", color=COLOURS[place % len(COLOURS)], markersize=4)
        unit = _label_in(motions[0], column).rpartition(" [")[2].removesuffix("]")
        axes.set_title(plain(column.title), loc="left")
        axes.set_xlabel(textwrap.fill(f"{column.caption} [{unit}]", LONGEST))
        axes.set_ylabel(f"its rate [{unit}/s]")
    for axes in grid.flat[len(columns) :]:
        axes.set_visible(False)
    handles: list[Artist] = [
        Line2D(
            [],
            [],
            color=COLOURS[place % len(COLOURS)],
            linestyle=UNSTABLE if motion.entry.get("stable") is False else "-",
            label=f"motion {motion.entry['motion']}: {motion.name}",
        )
        for place, motion in enumerate(motions)
    ]
    handles.append(Line2D([], [], color="0.3", marker="o", markersize=4, linestyle="", label="begin of the period"))
    add_legend(figure, handles=handles, ncols=2, fontsize=8.5)
    at = f"{orbits.axis_name} {motions[0].value:.6g}\N{NO-BREAK SPACE}{orbits.unit}".strip()
    add_title(figure, orbits.title, f"phase planes, without the mean rotation, at {at}")
    return figure


def _label_in(motion: Motion, column: Column) -> str:
    """Of its column in the file of a motion."""
    return next((label for label in motion.table if label.rpartition(" [")[0] == column.name), "")


def draw_harmonics(orbits: Orbits, column: Column) -> Figure:
    """A map of the amplitudes of the harmonics over the parameter; where two motions are stable, the larger amplitude."""
    table = orbits.harmonics()
    label = next(name for name in table if name.rpartition(" [")[0] == column.name or name == column.name)
    subharmonic = orbits.report.get("subharmonic", 1)
    count = int(table["harmonic"].max())
    amplitude = np.zeros((len(orbits.table), count))
    amplitude[table["point"].astype(int) - 1, table["harmonic"].astype(int) - 1] = table[label]
    parts = [one for one in orbits.stretches if one.is_stable] or orbits.stretches
    places = np.linspace(*orbits.window, 400)
    picture = np.full((count, len(places)), np.nan)
    for one in parts:
        x = orbits.value[one.rows]
        order = np.argsort(x, kind="stable")
        inside = (places >= x.min()) & (places <= x.max())
        for h in range(count):
            picture[h, inside] = np.fmax(picture[h, inside], np.interp(places[inside], x[order], amplitude[one.rows, h][order]))
    top = float(np.nanmax(picture, initial=0.0)) or 1.0
    seen = np.flatnonzero(np.nanmax(np.nan_to_num(picture), axis=1) > LARGEST_RATIO * top)
    rows = int(seen.max()) + 1 if len(seen) else 1
    figure, axes = pyplot.subplots(figsize=(WIDTH, 4.8))
    edges = (np.arange(rows + 1) + 0.5) / subharmonic
    mesh = axes.pcolormesh(
        places,
        0.5 * (edges[:-1] + edges[1:]),
        np.maximum(picture[:rows], LARGEST_RATIO * top),
        norm=LogNorm(LARGEST_RATIO * top, top),
        cmap="viridis",
        shading="nearest",
        rasterized=True,
    )
    axes.grid(visible=False)
    axes.set_xlabel(plain(orbits.axis_label))
    axes.set_ylabel("multiple of the excitation's frequency")
    figure.colorbar(mesh, label=f"amplitude [{label.rpartition(' [')[2].removesuffix(']')}]")
    axes.set_title(plain(column.title), loc="left")
    stable = "stable motions" if orbits.has_stability else "motions"
    add_title(figure, orbits.title, f"harmonics of {column.caption}, {stable}")
    return figure


def draw_backbone(orbits: Orbits) -> Figure:
    """The frequency of a nonlinear mode over its amplitude, with that of describing functions and that of the linear mode."""
    figure, axes = pyplot.subplots(figsize=(WIDTH, 4.8))
    axes.plot(orbits.value, orbits.table[FREQUENCY], color=COLOURS[0], linewidth=1.8, label="nonlinear mode")
    if QUASI_LINEAR in orbits.table:
        axes.plot(orbits.value, orbits.table[QUASI_LINEAR], color=COLOURS[1], linestyle=UNSTABLE, label="describing functions")
    linear = orbits.report.get("backbone", {}).get("linear_frequency_hz")
    if linear is not None:
        axes.axhline(linear, color="0.35", linestyle=(0, (1, 1.5)), label="linear mode")
    axes.set_xlim(orbits.window)
    axes.set_xlabel(plain(orbits.axis_label))
    axes.set_ylabel("frequency [Hz]")
    axes.ticklabel_format(axis="y", useOffset=False)
    add_legend(figure, *axes.get_legend_handles_labels(), ncols=3, fontsize=8.5)
    mode = orbits.report.get("backbone", {}).get("mode", "")
    add_title(figure, orbits.title, f"backbone of mode {mode}: frequency over amplitude")
    return figure


def chosen(orbits: Orbits, patterns: Sequence[str] | None) -> list[Column]:
    """The signals that patterns name, loads without any."""
    if not patterns:
        return orbits.loads()
    found: list[Column] = []
    for pattern in patterns:
        more = [one for one in orbits.columns if matches(pattern, one.name, one.label, f"{HALF_RANGE}_{one.name}")]
        if not more:
            there = ", ".join(one.name for one in orbits.columns[:8])
            raise ChoiceError(f"{orbits.folder}: no signal matches '{pattern}'; there are: {there}")
        found += [one for one in more if one not in found]
    return found


def figures_of(folder: Path, arguments: argparse.Namespace) -> Figures:
    orbits = read_orbits(folder)
    settled = read_settled(arguments.runs, orbits) if arguments.runs else None
    columns = chosen(orbits, arguments.columns)
    if FREQUENCY in orbits.table:
        yield "orbit_backbone", draw_backbone(orbits)
    pages: dict[str, int] = {}
    for members in by_sort(columns):
        for first in range(0, len(members), MOST_PANELS):
            kind = members[0].kind
            pages[kind] = pages.get(kind, 0) + 1
            name = f"orbit_{kind}" if pages[kind] == 1 else f"orbit_{kind}_{pages[kind]}"
            yield name, draw_half_ranges(orbits, members[first : first + MOST_PANELS], settled)
    yield from _planes(orbits, arguments.columns)
    if orbits.harmonics() is not None:
        for column in columns[:MOST_PANELS]:
            yield f"orbit_harmonics_{column.name}", draw_harmonics(orbits, column)


def _planes(orbits: Orbits, patterns: Sequence[str] | None) -> Iterator[tuple[str, Figure]]:
    """A figure for each value of which there are motions; of the twists, or of the angles without any."""
    named = chosen(orbits, patterns) if patterns else orbits.columns
    of_kind = [[one for one in named if one.kind == kind and not one.is_inner] for kind in ("twist", "phi")]
    columns = (of_kind[0] or of_kind[1])[:MOST_PLANES]
    values = list(dict.fromkeys(motion.value for motion in orbits.motions))
    for number, value in enumerate(values, start=1):
        motions = [one for one in orbits.motions if one.value == value]
        there = [one for one in columns if all(_label_in(motion, one) for motion in motions)]
        if there:
            yield f"orbit_phase_planes_{number}" if len(values) > 1 else "orbit_phase_planes", draw_planes(orbits, motions, there)


def main() -> None:
    parser = argparse.ArgumentParser(prog="nocdyn plot orbit", description=__doc__)
    parser.add_argument("results", type=Path, nargs="+", metavar="RESULTS", help="folders that 'nocdyn orbit' wrote")
    parser.add_argument(
        "--columns",
        nargs="+",
        metavar="PATTERN",
        help="draws these signals only, e.g. 'total_moment_*' phi_rotor; '*' stands for any text, '?' for a character",
    )
    parser.add_argument(
        "--runs",
        type=Path,
        metavar="FILE",
        help="a table (CSV) of settled runs to lay over: the parameter first, then half ranges named as in orbit.csv",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures of one folder go (RESULTS/figures)")
    add_format_option(parser)
    arguments = parser.parse_args()
    if arguments.out and len(arguments.results) > 1:
        parser.error("--out is for one folder of results")
    draw_folders(arguments, partial(figures_of, arguments=arguments))


if __name__ == "__main__":
    main()
