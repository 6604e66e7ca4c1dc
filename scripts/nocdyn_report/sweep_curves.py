"""Curves of a sweep over one number, that of a frequency above all; of a grid, one for each value of a second number."""

from dataclasses import dataclass

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes

from .style import COLOURS, REFERENCE, plain
from .sweep_panels import COLOUR_MAP, is_constant, is_wide, mark_not_done, wrapped
from .sweep_results import Sweep, Variable

FEW = 100  # points of a curve that are marked
STEEP = 50.0  # largest over smallest value from which the axis of a resonance curve is logarithmic
TURN = 2.0 * np.pi  # [rad]
MOST_CURVES = 8  # of a family


@dataclass(frozen=True)
class Family:
    """The number along the axis, and that which tells the curves apart, if there is one."""

    key: Variable
    parameter: Variable | None = None

    @property
    def is_resonance(self) -> bool:
        return is_frequency(self.key)

    @property
    def members(self) -> list[tuple[float, np.ndarray]]:
        """Of each curve its value of the parameter and its variants in the order of the key."""
        order = np.argsort(self.key.values, kind="stable")
        if self.parameter is None:
            return [(np.nan, order)]
        own = self.parameter.values[order]
        return [(value, order[own == value]) for value in np.unique(own)]


def is_frequency(key: Variable) -> bool:
    return (key.key, key.unit) in {("frequency", "rad/s"), ("frequency_hz", "Hz")}


def family_of(sweep: Sweep) -> Family | None:
    """How a sweep is drawn as curves, if it is: over its only number, or over a frequency for few values of another one."""
    if len(sweep.varied) == 1:
        return Family(sweep.varied[0])
    if len(sweep.varied) != 2 or not sweep.is_grid:
        return None
    parameter, key = sorted(sweep.varied, key=lambda one: (is_frequency(one), np.unique(one.values).size))
    return Family(key, parameter) if is_frequency(key) and np.unique(parameter.values).size <= MOST_CURVES else None


def draw_family(axes: Axes, sweep: Sweep, family: Family, result: Variable) -> None:
    """A result over one number, the end of each resonance curve marked."""
    members = family.members
    palette = COLOURS if family.parameter is None else colormaps[COLOUR_MAP](np.linspace(0.0, 0.9, len(members)))
    values = result.values[sweep.known(result)]
    has_peaks = family.is_resonance and result.unit != "s" and not is_constant(values)  # the latest of times is no peak
    for (value, variants), colour in zip(members, palette):
        x, y = family.key.values[variants], result.values[variants]  # NaN breaks the line
        name = "" if family.parameter is None else f"{value:.5g}"
        if has_peaks and np.isfinite(y).any():
            name = _mark_peak(axes, family, result, (x, y), name)
        axes.plot(
            x,
            y,
            color=colour,
            marker="o" if len(x) <= FEW else None,
            markersize=3,
            zorder=2,
            label=plain(name) if family.parameter is not None else None,
        )
    if is_wide(family.key.values):
        axes.set_xscale("log")
    if has_peaks and 0.0 < STEEP * values.min() < values.max():
        axes.set_yscale("log")
    if has_peaks or family.parameter is not None:
        title = None if family.parameter is None else wrapped(family.parameter.label)
        axes.legend(
            loc="upper left",
            bbox_to_anchor=(1.0, 1.0),
            title=title,
            alignment="left",
            fontsize=10 if family.parameter is None else 9,
        )
    mark_not_done(axes, sweep, family.key)
    axes.set_title(plain(result.long_name), loc="left")
    axes.set_ylabel(wrapped(result.short_label))


def _mark_peak(axes: Axes, family: Family, result: Variable, curve: tuple[np.ndarray, np.ndarray], name: str) -> str:
    """Marks the extreme of a curve; what the legend says of the curve."""
    x, y = curve
    peak, word = (np.nanargmin(y), "smallest") if result.is_minimum else (np.nanargmax(y), "largest")
    height, place = f"{y[peak]:.5g} {result.shown_unit}".rstrip(), f"{x[peak]:.5g} {family.key.unit}"
    hertz = "" if family.key.unit == "Hz" else f" = {x[peak] / TURN:.4g} Hz"
    if family.parameter is not None:
        axes.plot(x[peak], y[peak], "o", color="black", markersize=3.5, zorder=3)
        return f"{name}: {word} {height} at {place}"
    axes.axvline(x[peak], **REFERENCE)
    axes.plot(
        x[peak],
        y[peak],
        "o",
        color="black",
        markersize=5,
        zorder=3,
        label=plain(f"{word}: {height}\nat {place}{hertz}"),
    )
    return name


def add_hertz(axes: Axes) -> None:
    """A second scale of a frequency above a panel."""
    top = axes.secondary_xaxis("top", functions=(lambda omega: omega / TURN, lambda hertz: hertz * TURN))
    top.set_xlabel("frequency [Hz]")


def explain_marks(family: Family) -> str:
    """What a note says of the marks of a family."""
    return "dots: the extremes of the curves" if family.is_resonance and family.parameter is not None else ""
