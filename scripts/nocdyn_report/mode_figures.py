"""Draws the modes that 'nocdyn modes --out' wrote: the drivetrain, the shapes along it, and where their energies are."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .failure import ResultsError
from .json_files import with_case
from .measured_figures import measured_figures
from .modes_results import Modes, read_modes
from .report.result_files import case_of
from .style import COLOURS, WIDTH, add_format_option, add_title, plain, save, saved
from .train_drawing import EDGE, MOST_NAMES, ROW, draw_shape, draw_train

MOST_LETTERS = 24  # of names that stand side by side under the narrower axes
MOST_MODES = 6  # of a figure
GAP = 0.6  # between the bars of bodies and those of couplings
KINETIC, POTENTIAL, OF_SHAFTS = COLOURS[0], COLOURS[1], COLOURS[5]


def draw_modes(modes: Modes, chosen: list[dict]) -> Figure:
    """The drivetrain on top; below it a row for every mode: its shape, and the shares of bodies and couplings in its energies."""
    train = modes.train
    height = 0.35 + ROW * (1 + max(train.row) - min(train.row))
    figure, grid = pyplot.subplots(
        len(chosen) + 1,
        2,
        squeeze=False,
        sharex="col",
        figsize=(1.5 * WIDTH, 1.9 * len(chosen) + height + 1.6),
        width_ratios=(3, 2),
        height_ratios=(height, *[1.9] * len(chosen)),
    )
    draw_train(grid[0, 0], modes, train)
    grid[0, 1].set_axis_off()
    for (shape, energy), mode in zip(grid[1:], chosen):
        draw_shape(shape, modes, train, mode)
        _draw_energy(energy, modes, mode)
    grid[-1, 0].set_xlim(-EDGE, max(train.place) + EDGE)
    _name_bars(grid[-1, 1], modes)
    grid[0, 1].legend(*grid[1, 1].get_legend_handles_labels(), loc="lower left", ncols=3, fontsize=8.5, columnspacing=1.2)
    return figure


def _draw_energy(axes: Axes, modes: Modes, mode: dict) -> None:
    """Kinetic energy upwards, potential energy downwards; the couplings stand right of the bodies, each over its name."""
    count = len(modes.bodies)
    places = count + GAP + np.arange(len(modes.couplings))
    kinetic = 100 * np.array(mode["kinetic_share"])
    axes.bar(np.arange(count), kinetic[:count], width=0.8, color=KINETIC, label="kinetic energy\nin bodies [%]")
    if shafts := modes.shafts_with_inertia:
        axes.bar(
            places[shafts],
            kinetic[count : count + len(shafts)],
            width=0.8,
            color=OF_SHAFTS,
            edgecolor=KINETIC,
            linewidth=0.6,
            label="kinetic energy\nin shafts [%]",
        )
    axes.bar(
        places, -100 * np.array(mode["potential_share"]), width=0.8, color=POTENTIAL, label="potential energy\nin couplings [%]"
    )
    axes.axhline(0.0, color="0.5", linewidth=0.6)
    axes.yaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")


def _name_bars(axes: Axes, modes: Modes) -> None:
    """Bodies, and right of them couplings."""
    names = [*modes.bodies, *modes.couplings]
    count = len(names)
    chosen = np.arange(count) if count <= MOST_NAMES else np.unique(np.linspace(0, count - 1, 8).round().astype(int))
    slanted = sum(len(names[one]) for one in chosen) > MOST_LETTERS
    axes.set_xticks(
        chosen + GAP * (chosen >= len(modes.bodies)),
        [plain(names[one]) for one in chosen],
        rotation=45 if slanted else 0,
        ha="right" if slanted else "center",
    )


def draw_all(modes: Modes, most: int, folder: Path, formats: Sequence[str]) -> list[str]:
    """Saves figures of the first modes, a few in each, and of measured frequencies; gives their names."""
    chosen = modes.shaped[:most]
    if not chosen:
        raise ResultsError(f"{modes.folder / 'modes.json'}: nothing to draw: no mode oscillates")
    titles = (
        with_case(modes.content["title"] or Path(modes.content["input"]).name, case_of(modes.folder, "modes")),
        f"modes about {modes.content['about']}",
    )
    names = []
    for part in range(math.ceil(len(chosen) / MOST_MODES)):
        figure = draw_modes(modes, chosen[part * MOST_MODES : (part + 1) * MOST_MODES])
        add_title(figure, *titles)
        names.append("modes" if part == 0 else f"modes_{part + 1}")
        save(figure, folder, names[-1], formats)
    for name, figure in measured_figures(modes.folder, "modes.json", titles[0]).items():
        save(figure, folder, name, formats)
        names.append(name)
    return names


def main() -> None:
    parser = argparse.ArgumentParser(prog="nocdyn plot modes", description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'nocdyn modes --out' wrote")
    parser.add_argument(
        "--modes",
        type=int,
        default=2 * MOST_MODES,
        metavar="N",
        help=f"how many modes are drawn, from the lowest on ({2 * MOST_MODES})",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures go (RESULTS/figures)")
    add_format_option(parser)
    arguments = parser.parse_args()
    if arguments.modes < 1:
        parser.error("--modes must be at least 1")
    folder = arguments.out or arguments.results / "figures"
    names = draw_all(read_modes(arguments.results), arguments.modes, folder, arguments.format)
    print(saved(names, arguments.format, folder))


if __name__ == "__main__":
    main()
