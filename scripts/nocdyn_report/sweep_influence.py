"""How much each varied number of a sweep has to do with each result."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from .style import COLOURS, plain
from .sweep_panels import chance, rank_correlation
from .sweep_results import Sweep, Variable

MOST_BARS = 15
TITLE_LENGTH = 60  # characters that fit on a line beside the names
RISING, FALLING = COLOURS[0], COLOURS[1]


class Influence:
    """Rank correlations, 0 where there is none."""

    def __init__(self, sweep: Sweep) -> None:
        self.keys = sweep.varied
        self.correlations = {
            result.name: np.array([_correlation(sweep, key, result) for key in sweep.varied]) for result in sweep.results
        }

    def strongest_first(self, result: Variable | None = None) -> list[Variable]:
        """The varied numbers by their influence on a result, or on any."""
        rows = list(self.correlations.values()) if result is None else [self.correlations[result.name]]
        return [self.keys[place] for place in np.argsort(-np.abs(rows).max(axis=0), kind="stable")]

    def of(self, key: Variable, result: Variable) -> float:
        return self.correlations[result.name][[one.name for one in self.keys].index(key.name)]


def _correlation(sweep: Sweep, key: Variable, result: Variable) -> float:
    known = sweep.known(result)
    return float(np.nan_to_num(rank_correlation(result.values[known], key.values[known])))


def draw_influence(axes: Axes, sweep: Sweep, influence: Influence, result: Variable) -> None:
    """Bars of the numbers with the most influence on a result, the first on top."""
    keys: Sequence[Variable] = influence.strongest_first(result)[:MOST_BARS]
    values = np.array([influence.of(key, result) for key in keys])
    places = np.arange(len(keys))
    variants = sweep.known(result).size
    if variants > 1:
        axes.axvspan(-chance(variants), chance(variants), color="0.9", linewidth=0, zorder=0)
    axes.barh(places, values, height=0.7, color=np.where(values >= 0.0, RISING, FALLING))
    for place, value in zip(places, values):
        axes.annotate(
            f"{round(value, 2) + 0.0:+.2f}",
            (value, place),
            xytext=(4 if value >= 0.0 else -4, 0),
            textcoords="offset points",
            ha="left" if value >= 0.0 else "right",
            va="center",
            fontsize=8,
        )
    axes.axvline(0.0, color="0.2", linewidth=0.9)
    axes.set_xlim(-1.15, 1.15)
    axes.set_yticks(places, [plain(key.name) for key in keys], fontsize=9)
    axes.set_ylim(len(keys) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_title(plain(textwrap.fill(result.title, TITLE_LENGTH)), loc="left")
