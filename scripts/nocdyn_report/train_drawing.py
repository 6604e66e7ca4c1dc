"""A drivetrain seen from the side, and the shapes of its modes along it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from .modes_results import Modes, marks_of, motion_of
from .style import COLOURS, REFERENCE, plain
from .train_layout import GROUND, Train

MOST_NAMES = 24  # bodies that are named
FEW_NAMES = 8  # that are named of more bodies
ROW = 0.7  # height of a shaft line in the drawing [in]
EDGE = 0.6  # room at both ends of the train, in places
LONGEST = 60  # characters that fit along the train side by side
LINE_COLOURS = (COLOURS[0], COLOURS[1], COLOURS[2], COLOURS[3], COLOURS[4], COLOURS[5], "#7F3C8D")
SMALLEST, LARGEST = 0.18, 0.78  # heights of discs, in rows
THICK = 0.1  # of a disc, in places
TO_GROUND = 0.42  # length of a shaft to the ground, in places
STRETCH = 0.12  # room above and below the largest motion
STEP = {**REFERENCE, "zorder": 1}  # from a gear to its mate


def draw_train(axes: Axes, modes: Modes, train: Train) -> None:
    """Discs by the fourth root of their inertias on their shaft lines; gears are dashed, with the ratio of the speeds."""
    place, row = np.array(train.place), np.array(train.row)
    heights = _heights(np.array(modes.content.get("inertia_kg_m2", np.ones(len(place))), dtype=float))
    thick = min(THICK, 0.012 * (np.ptp(place) + 1) + 0.04)
    for a, b in modes.pairs("couplings"):
        if GROUND in (a, b):
            body = max(a, b)
            end = place[body] + _free_side(body, modes, train) * TO_GROUND
            axes.plot([place[body], end], [row[body]] * 2, color=_colour(train, body), linewidth=2.2, zorder=2)
            axes.plot([end] * 2, [row[body] - 0.25, row[body] + 0.25], color="0.2", linewidth=3.5, zorder=3)
        else:
            axes.plot(place[[a, b]], row[[a, b]], color=_colour(train, b), linewidth=2.2, zorder=2)
    for (a, b), gear in zip(modes.pairs("gears"), modes.content["gears"]):
        if GROUND not in (a, b):
            axes.plot(place[[a, b]], row[[a, b]], **STEP)
            if len(place) <= MOST_NAMES:
                side = -1 if place[a] == place[b] else 1
                axes.annotate(
                    f"1 : {gear['ratio']:.3g}",
                    (place[[a, b]].mean(), row[[a, b]].mean()),
                    xytext=(4 * side, 0 if side < 0 else 3),
                    textcoords="offset points",
                    fontsize=7.5,
                    color="0.35",
                    ha="right" if side < 0 else "left",
                    va="center" if side < 0 else "bottom",
                )
    for body, height in enumerate(heights):
        corner = place[body] - thick / 2, row[body] - height / 2
        edge = 0.6 if len(place) <= MOST_NAMES else 0.0
        style = {"facecolor": _colour(train, body), "edgecolor": "black", "linewidth": edge, "zorder": 4}
        axes.add_patch(Rectangle(corner, thick, height, **style))
    _name_discs(axes, modes, train, heights)
    axes.set_ylim(row.min() - 0.85, row.max() + 0.5)
    axes.set_axis_off()


def _heights(inertia: np.ndarray) -> np.ndarray:
    return SMALLEST + (LARGEST - SMALLEST) * (inertia / (inertia.max() or 1.0)) ** 0.25


def _colour(train: Train, body: int) -> str:
    return LINE_COLOURS[train.line[body] % len(LINE_COLOURS)]


def _free_side(body: int, modes: Modes, train: Train) -> int:
    """The side of a body on which no shaft goes on, -1 or 1."""
    others = [b if a == body else a for a, b in modes.pairs("couplings") if body in (a, b) and GROUND not in (a, b)]
    return 1 if any(train.place[other] < train.place[body] for other in others) else -1


def _name_discs(axes: Axes, modes: Modes, train: Train, heights: np.ndarray) -> None:
    """Below the discs, slanted where the names are long, beside the line to a gear below."""
    count = len(train.place)
    named = range(count) if count <= MOST_NAMES else np.unique(np.linspace(0, count - 1, FEW_NAMES).round().astype(int))
    longest = max(len(modes.bodies[body]) for body in named)
    columns = np.ptp(train.place) + 1 if count <= MOST_NAMES else FEW_NAMES
    slanted = longest * columns > LONGEST
    meshes = [pair for pair in modes.pairs("gears") if GROUND not in pair]
    for body in named:
        mates = [b if a == body else a for a, b in meshes if body in (a, b)]
        is_beside = not slanted and any(
            train.row[mate] < train.row[body] and train.place[mate] == train.place[body] for mate in mates
        )
        axes.annotate(
            plain(modes.bodies[body]),
            (train.place[body], train.row[body] - heights[body] / 2),
            xytext=(3 if slanted or is_beside else 0, -2),
            textcoords="offset points",
            fontsize=7.5,
            ha="right" if slanted else "left" if is_beside else "center",
            va="top",
            rotation=30 if slanted else 0,
            rotation_mode="anchor" if slanted else "default",
            zorder=5,
        )


def draw_shape(axes: Axes, modes: Modes, train: Train, mode: dict) -> None:
    """Along every shaft line what moves in phase with the largest motion; what lags shows by its amplitude, an open circle."""
    amplitude = np.array(mode["shape"])
    motion = motion_of(mode)
    place = np.array(train.place)
    few = len(motion) <= MOST_NAMES
    axes.axhline(0.0, color="0.5", linewidth=0.6)
    for a, b in modes.pairs("couplings"):
        if GROUND in (a, b):
            body = max(a, b)
            end = place[body] + _free_side(body, modes, train) * TO_GROUND
            axes.plot([place[body], end], [motion[body], 0.0], color=_colour(train, body), linewidth=1.6)
        else:
            axes.plot(place[[a, b]], motion[[a, b]], color=_colour(train, b), linewidth=1.6)
    for a, b in modes.pairs("gears"):
        if GROUND not in (a, b):
            axes.plot(place[[a, b]], motion[[a, b]], **STEP)
    if few:
        sizes = 4.0 + 14.0 * _heights(np.array(modes.content.get("inertia_kg_m2", np.ones(len(place))), dtype=float)) ** 2
        for body, (x, y) in enumerate(zip(place, motion)):
            axes.plot(x, y, "o", color=_colour(train, body), markersize=sizes[body], markeredgecolor="white", markeredgewidth=0.6)
            if amplitude[body] - abs(y) > 0.02:
                open_circle = {"color": _colour(train, body), "markersize": sizes[body] + 2.0, "fillstyle": "none"}
                axes.plot(x, np.copysign(amplitude[body], y), "o", **open_circle)
    axes.set_ylim(-1 - STRETCH, 1 + STRETCH)
    axes.tick_params(labelbottom=False, bottom=False)
    axes.grid(visible=False, axis="x")
    damping = mode["damping_ratio"]
    told = [f"mode {mode['mode']}: {mode['frequency_Hz']:.5g} Hz", f"damping ratio {damping:.3g}"]
    told += [*(["unstable"] if damping < 0 else []), *marks_of(mode)]
    axes.set_title(plain(", ".join(told)), loc="left")
