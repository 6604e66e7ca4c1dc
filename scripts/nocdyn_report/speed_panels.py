"""What the figures over the speed share: speeds in operation, labels that do not overlap, options, the loop over folders."""

import argparse
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerPatch
from matplotlib.patches import Patch, Rectangle
from matplotlib.transforms import blended_transform_factory

from .failure import ChoiceError
from .speed_results import Operation
from .style import COLOURS, add_format_option, save, saved

OPERATION, DANGER = COLOURS[2], "#B2182B"
NEAR = 0.2  # half the width of a short label, about [in]
SMALL = 7.5  # font size of labels in panels
HALO = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8}
SHADES = {
    False: {"facecolor": OPERATION, "alpha": 0.11, "linewidth": 0},
    True: {"facecolor": "none", "edgecolor": OPERATION, "alpha": 0.35, "hatch": "////", "linewidth": 0},
}

Figures = Iterator[tuple[str, Figure]]


class OperationPatch(Patch):
    """What a legend shows of the speeds in operation: their shade with the bar at the axis."""


class _OperationHandler(HandlerPatch):
    def create_artists(self, legend, handle, x, y, width, height, size, transform):
        """A patch as any other, and the bar on its lower edge."""
        patches = super().create_artists(legend, handle, x, y, width, height, size, transform)
        bar = Rectangle((-x, -y), width, 0.3 * height, facecolor=OPERATION, linewidth=0, transform=transform)
        return [*patches, bar]


Legend.update_default_handler_map({OperationPatch: _OperationHandler()})


class Labels:
    """Places of texts in a panel [in] so that none covers another."""

    def __init__(self, axes: Axes, size: tuple[float, float]) -> None:
        """`size` is that of the panel [in], which is laid out later."""
        self.axes = axes
        self.size = size
        self.boxes: list[tuple[float, float, float, float]] = []
        self.curve = (np.empty(0), np.empty(0))

    def avoid(self, x: np.ndarray, y: np.ndarray) -> None:
        """A curve over a rising x, in fractions of the panel, on which texts stand only if there is no other place."""
        self.curve = (x * self.size[0], y * self.size[1])

    def top_of_curve(self, x: float) -> float:
        """The height of the curve about x, in fractions of the panel."""
        near = np.abs(self.curve[0] - x * self.size[0]) < NEAR
        return float(self.curve[1][near].max() / self.size[1])

    def beside(self, x: float, y: float) -> list[tuple[float, float]]:
        """Places right and left of a peak."""
        return [(x + side * NEAR / self.size[0], y - 2 * NEAR / 3 / self.size[1]) for side in (1, -1)]

    def is_crossed(self, x: float, y: float, width: float, height: float) -> bool:
        """Whether the curve passes through the box around a point."""
        x, y = x * self.size[0], y * self.size[1]
        ends = np.interp([x - width / 2, x + width / 2], *self.curve)
        inside = self.curve[1][(self.curve[0] > x - width / 2) & (self.curve[0] < x + width / 2)]
        heights = np.concatenate((ends, inside))
        return heights.min() < y + height / 2 and heights.max() > y - height / 2

    def is_free(self, x: float, y: float, width: float, height: float) -> bool:
        """Takes the box around a point in fractions of the panel, if nothing is there."""
        x, y = x * self.size[0], y * self.size[1]
        box = (x - width / 2, x + width / 2, y - height / 2, y + height / 2)
        if any(box[0] < b[1] and b[0] < box[1] and box[2] < b[3] and b[2] < box[3] for b in self.boxes):
            return False
        self.boxes.append(box)
        return True

    def put_nearby(self, text: str, places: Sequence[tuple[float, float]], colour: str) -> None:
        """Above the first place, in fractions of the panel, where it is free."""
        width, height = text_size(text)
        for may_cross in (False, True):
            for x, y in places:
                x = min(max(x, width / 2 / self.size[0]), 1 - width / 2 / self.size[0])
                middle = y + (height / 2 + 0.02) / self.size[1]
                if middle >= 1 or (not may_cross and self.is_crossed(x, middle, width, height)):
                    continue
                if self.is_free(x, middle, width, height):
                    style = {"fontsize": SMALL, "color": colour, "ha": "center", "va": "center", "bbox": HALO, "zorder": 6}
                    self.axes.text(x, middle, text, transform=self.axes.transAxes, **style)
                    return


def text_size(text: str) -> tuple[float, float]:
    """Width and height of a small text [in]."""
    return (0.6 * len(text) + 0.5) * SMALL / 72, 1.35 * SMALL / 72


def share_of(axes: Axes, x: np.ndarray | float) -> np.ndarray | float:
    """Where a value is between the ends of the axis, 0 to 1."""
    low, high = axes.get_xlim()
    return (x - low) / (high - low)


def height_of(axes: Axes, y: np.ndarray) -> np.ndarray:
    low, high = axes.get_ylim()
    if axes.get_yscale() == "log":
        return np.log(np.maximum(y, low) / low) / math.log(high / low)
    return (y - low) / (high - low)


def spread(positions: np.ndarray, distance: float) -> np.ndarray:
    """Positions moved as little as needed to be so far apart, in their order."""
    order = np.argsort(positions, kind="stable")
    ranks = distance * np.arange(len(order))
    rest = positions[order] - ranks  # must not fall: its best rising fit, by pooling neighbours
    pools: list[list[float]] = []
    for value in rest:
        pools.append([value, 1])
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (a, n), (b, m) = pools[-2:]
            pools[-2:] = [[(a * n + b * m) / (n + m), n + m]]
    moved = np.empty(len(order))
    moved[order] = np.repeat([pool[0] for pool in pools], [int(pool[1]) for pool in pools]) + ranks
    return moved


def shade_operation(axes: Axes, operation: Operation | None) -> list[Patch]:
    """Shades the speeds in operation and their margins, and gives what the legend shows of them."""
    if operation is None:
        return []
    for start, end, is_margin in operation.spans:
        axes.axvspan(start, end, zorder=0, **SHADES[is_margin])
        if not is_margin:  # seen where barred speeds hide the shade
            axes.axvspan(start, end, 0.0, 0.015, facecolor=OPERATION, linewidth=0, zorder=1.5)
    patches: list[Patch] = [
        OperationPatch(**SHADES[False], label=f"in operation: {operation.slow:.5g} to {operation.fast:.5g} rpm")
    ]
    if operation.margin > 0:
        patches.append(Patch(**SHADES[True], label=f"margin of {100 * operation.margin:.3g} %"))
    return patches


def above(axes: Axes) -> object:
    """Speeds along the axis, heights in fractions of the panel."""
    return blended_transform_factory(axes.transData, axes.transAxes)


def speed_label(body: str) -> str:
    return f"speed of {body} [rpm]"


def figure_parser(program: str, command: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=program, description=description)
    parser.add_argument("results", type=Path, nargs="+", metavar="RESULTS", help=f"folders that 'nocdyn {command}' wrote")
    parser.add_argument("--from", dest="start", type=finite, default=-math.inf, metavar="RPM", help="first speed [rpm]")
    parser.add_argument("--to", dest="end", type=finite, default=math.inf, metavar="RPM", help="last speed [rpm]")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures of one folder go (RESULTS/figures)")
    add_format_option(parser)
    return parser


def finite(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"'{text}' is no number")
    return number


def arguments_of(parser: argparse.ArgumentParser) -> argparse.Namespace:
    arguments = parser.parse_args()
    if arguments.start >= arguments.end:
        parser.error(f"--from {arguments.start:g} must be less than --to {arguments.end:g}")
    if arguments.out and len(arguments.results) > 1:
        parser.error("--out is for one folder of results")
    return arguments


def window_of(folder: Path, speed: np.ndarray, arguments: argparse.Namespace, unit: str = "rpm") -> tuple[float, float]:
    """The chosen part of the speeds."""
    inside = speed[(speed >= arguments.start) & (speed <= arguments.end)]
    if len(inside) < 2 or inside[0] == inside[-1]:
        raise ChoiceError(
            f"{folder}: nothing to draw: {len(inside)} row(s) at the chosen speeds; "
            f"the table goes from {speed[0]:.6g} to {speed[-1]:.6g} {unit}"
        )
    return inside[0], inside[-1]


def draw_folders(arguments: argparse.Namespace, draw: Callable[[Path], Figures]) -> None:
    """Draws and saves the figures of every folder."""
    for results in arguments.results:
        folder = arguments.out or results / "figures"
        names = []
        for name, figure in draw(results):
            save(figure, folder, name, arguments.format)
            names.append(name)
        print(saved(names, arguments.format, folder))
