"""Phase planes of the bodies and of the twists of the couplings."""

import math
from dataclasses import dataclass

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .results import Results
from .style import COLOURS, WIDTH, draw_lines, plain

MOST_PANELS = 9  # with more planes than that, those of a kind share one panel


@dataclass(frozen=True)
class Plane:
    name: str
    angle: np.ndarray  # [rad]
    rate: np.ndarray  # [rad/s]


@dataclass(frozen=True)
class Kind:
    """Planes of bodies or of couplings, and how their axes are called."""

    noun: str
    angle_label: str
    rate_label: str
    planes: list[Plane]


def draw_phase_planes(results: Results) -> Figure:
    kinds = [kind for kind in (_bodies(results), _couplings(results)) if kind.planes]
    if sum(len(kind.planes) for kind in kinds) <= MOST_PANELS:
        return _draw_apart(kinds)
    return _draw_together(kinds)


def _bodies(results: Results) -> Kind:
    pairs = zip(results.columns("phi"), results.columns("omega"))
    planes = [Plane(phi.element, phi.values, omega.values) for phi, omega in pairs]
    return Kind("body", "angle φ [rad]", "speed ω [rad/s]", planes)


def _couplings(results: Results) -> Kind:
    planes = [Plane(twist.element, twist.values, results.twist_rate(twist.element)) for twist in results.columns("twist")]
    return Kind("twist of", "twist Δφ [rad]", "rate of twist Δω [rad/s]", planes)


def _draw_apart(kinds: list[Kind]) -> Figure:
    """A panel for each plane, with where it starts and where it ends."""
    panels = [(kind, plane) for kind in kinds for plane in kind.planes]
    across = math.ceil(math.sqrt(len(panels)))
    down = math.ceil(len(panels) / across)
    figure, grid = pyplot.subplots(down, across, squeeze=False, figsize=(WIDTH * max(across, 2) / 2, 3.0 * down + 0.6))
    for axes, (kind, plane) in zip(grid.flat, panels):
        axes.plot(plane.angle, plane.rate, color=COLOURS[kinds.index(kind)])
        axes.plot(plane.angle[0], plane.rate[0], "o", color="black", markerfacecolor="white", label="start")
        axes.plot(plane.angle[-1], plane.rate[-1], "o", color="black", label="end")
        axes.set_title(plain(f"{kind.noun} {plane.name}"))
        _label(axes, kind)
    for axes in grid.flat[len(panels) :]:
        axes.set_visible(False)
    figure.legend(*grid.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _draw_together(kinds: list[Kind]) -> Figure:
    figure, grid = pyplot.subplots(len(kinds), 1, squeeze=False, figsize=(WIDTH, 4.0 * len(kinds)))
    for axes, kind in zip(grid.flat, kinds):
        draw_lines(axes, [plane.name for plane in kind.planes], [(plane.angle, plane.rate) for plane in kind.planes])
        _label(axes, kind)
    return figure


def _label(axes: Axes, kind: Kind) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    axes.set_xlabel(kind.angle_label)
    axes.set_ylabel(kind.rate_label)
