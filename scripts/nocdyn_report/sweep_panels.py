"""The panels of the figures of a sweep: a result over what was varied, or by itself."""

import re
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize, PowerNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.tri import Triangulation

from .style import COLOURS, add_legend, plain
from .sweep_results import Sweep, Variable

MOST_POINTS = 20_000  # that are drawn one by one
DENSE = 2_000  # points from which contours show more than dots
RASTER = 1_000  # points from which dots are pixels in SVG and PDF too
BINS = (12, 100)  # fewest and most of a histogram
CONTOURS = 20
CELLS = 80  # along each side of a density
LABEL_LENGTH = 26  # characters that fit under a panel
WIDE = 50.0  # 95 % over 5 % value from which an axis is logarithmic; of evenly distributed numbers it is at most 19
DECADES = 100.0  # largest over smallest value from which the colours of a grid are
FEWEST_DIGITS = 5
REACH = 3.0  # distances from 5 % to 95 % beyond which a value is an outlier
LINES = 500  # of parallel axes
MOST_MARKS = 100  # of variants that were not done
NOT_DONE_LINES = 20  # of them on parallel axes
CHANCE = 1.96  # standard deviations, 95 % of what chance alone gives
NOT_DONE = COLOURS[1]
COLOUR_MAP = "viridis"
SHADES = LinearSegmentedColormap.from_list("shades", colormaps["Blues"](np.linspace(0.25, 1.0, 64)))


def wrapped(label: str, length: int = LABEL_LENGTH) -> str:
    """A label on several lines if it is long, broken after words, dots and underscores and before the unit."""
    lines = [""]
    for piece in re.split(r"(?<=[._])(?!\d)|(?<= )(?![^[]*\])(?!\[)|(?= \[)", label):
        if lines[-1] and len(lines[-1]) + len(piece) > length:
            lines.append(piece.lstrip())
        else:
            lines[-1] += piece
    return plain("\n".join(line.rstrip() for line in lines))


def is_wide(values: np.ndarray) -> bool:
    low, high = np.quantile(values, (0.05, 0.95))
    return values.min() > 0.0 and high > WIDE * low


def shown(sweep: Sweep, values: np.ndarray) -> np.ndarray:
    """Those within the axes and colours of a figure. On a grid all are: there, an extreme is what was looked for."""
    return values if sweep.is_grid else without_outliers(values)


def without_outliers(values: np.ndarray) -> np.ndarray:
    low, high = np.quantile(values, (0.05, 0.95))
    reach = REACH * (high - low) if high > low else np.inf
    return values[(values >= low - reach) & (values <= high + reach)]


def add_note(figure: Figure, *remarks: str) -> None:
    """Small print below the figure; empty remarks do not count."""
    if any(remarks):
        figure.supxlabel("; ".join(filter(None, remarks)), fontsize=8, x=0.01, ha="left")


def thinned(places: np.ndarray, most: int) -> np.ndarray:
    """At most so many, evenly taken."""
    return places[:: max(1, -(-places.size // most))]


def has_outliers(sweep: Sweep, values: np.ndarray) -> bool:
    return shown(sweep, values).size < values.size


def is_constant(values: np.ndarray) -> bool:
    """Whether all values are the same but for rounding."""
    return np.ptp(values) <= 1e-12 * np.abs(values).max()


def chance(variants: int) -> float:
    """The rank correlation that 95 % of so many variants of unrelated numbers do not exceed."""
    return min(1.0, CHANCE / np.sqrt(max(variants - 1, 1)))


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's; NaN if one of them does not vary."""
    if len(a) < 2 or is_constant(a) or is_constant(b):
        return np.nan
    return float(np.corrcoef(pd.Series(a).rank(), pd.Series(b).rank())[0, 1])


def draw_histogram(axes: Axes, sweep: Sweep, result: Variable) -> None:
    """With the 5 %, 50 % and 95 % values; what lies very far outside is counted, not drawn."""
    values = result.values[sweep.known(result)]
    low, median, high = np.quantile(values, (0.05, 0.5, 0.95))
    inside = shown(sweep, values)
    if is_constant(values):
        room = 0.1 * abs(median) or 1.0
        axes.bar(median, len(values), width=0.1 * room, color=COLOURS[0], alpha=0.5)
        axes.set_xlim(median - room, median + room)
    else:
        axes.hist(inside, bins=_bins(inside, high - low), color=COLOURS[0], alpha=0.5)
    digits = _digits(low, high)
    for value, name, style in ((low, "5 %", (0, (2, 2))), (median, "median", "-"), (high, "95 %", (0, (5, 3)))):
        axes.axvline(
            value,
            color="black",
            linestyle=style,
            linewidth=1.1,
            label=plain(f"{name}: {value:.{digits}g} {result.shown_unit}".rstrip()),
        )
    if len(inside) < len(values):
        axes.plot([], [], " ", label=plain(f"{len(values) - len(inside)} further out,\n{_far_ends(values, inside, result)}"))
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_title(plain(result.long_name), loc="left")
    axes.set_xlabel(plain(result.short_label))
    axes.set_ylabel("variants")
    axes.grid(visible=False, axis="x")


def _bins(values: np.ndarray, width: float) -> int:
    """Freedman and Diaconis' number, from the middle 90 % in place of the middle half."""
    bin_width = 0.82 * width / len(values) ** (1.0 / 3.0)
    return int(np.clip(np.ptp(values) / bin_width, *BINS)) if bin_width > 0.0 else BINS[0]


def _digits(low: float, high: float) -> int:
    """Significant ones that show three of the difference of two numbers, if it is more than rounding."""
    if is_constant(np.array([low, high])):
        return FEWEST_DIGITS
    return max(FEWEST_DIGITS, 3 + int(np.ceil(np.log10(max(abs(low), abs(high)) / (high - low)))))


def _far_ends(values: np.ndarray, inside: np.ndarray, result: Variable) -> str:
    """How far the outliers go, on the sides on which there are some."""
    ends = ((values.min(), "down to", values.min() < inside.min()), (values.max(), "up to", values.max() > inside.max()))
    return ",\n".join(f"{words} {value:.5g} {result.shown_unit}".rstrip() for value, words, is_out in ends if is_out)


def draw_scatter(axes: Axes, sweep: Sweep, key: Variable, result: Variable) -> None:
    """Each variant a dot; of very many, a shade for how many are in a cell; outliers at the edges."""
    known = sweep.known(result)
    x, y = key.values[known], result.values[known]
    if is_wide(x):
        axes.set_xscale("log")
    inside = shown(sweep, y)
    is_near = (y >= inside.min()) & (y <= inside.max())
    if len(x) > MOST_POINTS:
        _draw_density(axes, x[is_near], y[is_near])
    else:
        size = np.clip(6000.0 / len(x), 1.5, 16.0)
        axes.scatter(
            x[is_near],
            y[is_near],
            s=size,
            color=COLOURS[0],
            alpha=0.9 if len(x) < 200 else 0.45,
            linewidths=0,
            rasterized=len(x) > RASTER,
        )
    _mark_outliers(axes, x[y > inside.max()], "^", 1.0)
    _mark_outliers(axes, x[y < inside.min()], "v", 0.0)
    mark_not_done(axes, sweep, key)
    correlation = rank_correlation(x, y)
    axes.set_title(
        "constant" if np.isnan(correlation) else f"rank correlation {round(correlation, 2) + 0.0:+.2f}",
        color="black" if abs(correlation) > chance(len(x)) else "0.5",
    )


def _draw_density(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    edges = np.geomspace(x.min(), x.max(), CELLS + 1) if is_wide(x) else CELLS
    counts, x_edges, y_edges = np.histogram2d(x, y, bins=(edges, CELLS))
    axes.pcolormesh(x_edges, y_edges, np.ma.masked_equal(counts.T, 0), norm=PowerNorm(0.5), cmap=SHADES, rasterized=True)


def _mark_outliers(axes: Axes, x: np.ndarray, marker: str, edge: float) -> None:
    """Triangles at the upper or lower edge, where their result is far beyond."""
    if x.size:
        places = thinned(x, MOST_MARKS)
        axes.plot(
            places,
            np.full(places.size, edge),
            marker,
            color="0.35",
            markersize=4,
            markeredgewidth=0,
            clip_on=False,
            transform=axes.get_xaxis_transform(),
        )


def mark_not_done(axes: Axes, sweep: Sweep, key: Variable) -> None:
    """Ticks on the lower edge."""
    if sweep.not_done.size == 0:  # an empty line that is not clipped would spoil the layout
        return
    places = thinned(key.values[sweep.not_done], MOST_MARKS)
    axes.plot(
        places,
        np.zeros(places.size),
        "|",
        color=NOT_DONE,
        markersize=8,
        markeredgewidth=1.0,
        clip_on=False,
        transform=axes.get_xaxis_transform(),
    )


def explain_not_done(figure: Figure, sweep: Sweep, most: int = MOST_MARKS, **style: object) -> None:
    """A legend below the figure, if there is something to explain."""
    count = sweep.not_done.size
    if count == 0:
        return
    share = -(-count // most)
    label = sweep.not_done_words + (f" (one in {share} is shown)" if share > 1 else "")
    add_legend(figure, [Line2D([], [], color=NOT_DONE, **style)], [label], place="right")


def draw_map(axes: Axes, sweep: Sweep, result: Variable) -> None:
    """A result over both numbers that vary: cells of a grid, contours or dots; crosses are variants that were not done."""
    first, second = sweep.varied
    known = sweep.known(result)
    x, y, colour = (variable.values[known] for variable in (first, second, result))
    limits = shown(sweep, colour)
    is_steep = sweep.is_grid and 0.0 < DECADES * limits.min() < limits.max()
    scale = {"cmap": COLOUR_MAP, "norm": (LogNorm if is_steep else Normalize)(limits.min(), limits.max())}
    if sweep.is_grid:
        drawn = axes.pcolormesh(*grid_cells(sweep, result), rasterized=True, **scale)
    elif len(x) > DENSE and not is_wide(x) and not is_wide(y) and not is_constant(limits) and fill_a_plane(x, y):
        drawn = _draw_contours(axes, x, y, colour, scale)
    else:
        chosen = thinned(np.arange(len(x)), MOST_POINTS)
        drawn = axes.scatter(
            x[chosen],
            y[chosen],
            c=colour[chosen],
            s=np.clip(16000.0 / len(x), 3.0, 24.0),
            linewidths=0,
            rasterized=len(x) > RASTER,
            **scale,
        )
    if not sweep.is_grid and is_wide(x):
        axes.set_xscale("log")
    if not sweep.is_grid and is_wide(y):
        axes.set_yscale("log")
    marks = thinned(sweep.not_done, MOST_MARKS)
    axes.plot(first.values[marks], second.values[marks], "x", color=NOT_DONE, markersize=5, markeredgewidth=1.2)
    _add_colour_bar(axes, drawn, result, colour)
    axes.set_title(plain(result.long_name), loc="left")
    axes.grid(visible=False)


def _add_colour_bar(axes: Axes, drawn: ScalarMappable, result: Variable, values: np.ndarray) -> None:
    """Of all colours, opaque; with a tip where values are beyond them."""
    extend = ("neither", "min", "max", "both")[(values.min() < drawn.norm.vmin) + 2 * (values.max() > drawn.norm.vmax)]
    bar = axes.figure.colorbar(ScalarMappable(drawn.norm, drawn.cmap), ax=axes, extend=extend)
    bar.set_label(wrapped(result.short_label))


def grid_cells(sweep: Sweep, result: Variable) -> tuple[np.ndarray, np.ndarray, np.ma.MaskedArray]:
    """Edges and values of the cells of a grid, their centres at its points."""
    first, second = sweep.varied
    x, columns = np.unique(first.values, return_inverse=True)
    y, rows = np.unique(second.values, return_inverse=True)
    cells = np.ma.masked_all((y.size, x.size))
    known = sweep.known(result)
    cells[rows[known], columns[known]] = result.values[known]
    return _edges(x), _edges(y), cells


def _edges(centres: np.ndarray) -> np.ndarray:
    if centres.size == 1:
        return centres[0] + np.array([-0.5, 0.5]) * (abs(centres[0]) or 1.0)
    middles = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(([2 * centres[0] - middles[0]], middles, [2 * centres[-1] - middles[-1]]))


def fill_a_plane(x: np.ndarray, y: np.ndarray) -> bool:
    """Whether the points do not lie on a line, which no triangles cover."""
    return not is_constant(x) and not is_constant(y) and abs(np.corrcoef(x, y)[0, 1]) < 1.0 - 1e-6


def _draw_contours(axes: Axes, x: np.ndarray, y: np.ndarray, colour: np.ndarray, scale: dict) -> ContourSet:
    chosen = thinned(np.arange(len(x)), MOST_POINTS)
    # between 0 and 1 the triangles do not depend on the units
    triangles = Triangulation((x[chosen] - x.min()) / np.ptp(x), (y[chosen] - y.min()) / np.ptp(y)).triangles
    levels = np.linspace(scale["norm"].vmin, scale["norm"].vmax, CONTOURS + 1)
    contours = axes.tricontourf(
        Triangulation(x[chosen], y[chosen], triangles), colour[chosen], levels=levels, extend="both", **scale
    )
    contours.set_rasterized(True)
    return contours


def draw_parallel(axes: Axes, sweep: Sweep, keys: Sequence[Variable], result: Variable) -> None:
    """An axis for each varied number and one for the result; a line for each variant, coloured by the result."""
    chosen = thinned(sweep.known(result), LINES)
    variables = [*keys, result]
    shares = np.full((sweep.status.size, len(variables)), np.nan)
    places = np.arange(len(variables))
    for place, variable in zip(places, variables):
        known = sweep.known(result) if variable is result else slice(None)
        shares[known, place] = _draw_parallel_axis(axes, place, variable, variable.values[known])
    middle_first = np.argsort(np.abs(shares[chosen, -1] - 0.5), kind="stable")
    chosen = chosen[middle_first]
    values = result.values[sweep.known(result)]
    limits = shown(sweep, values)
    lines = LineCollection(
        [np.column_stack((places, row)) for row in shares[chosen]],
        array=result.values[chosen],
        norm=Normalize(limits.min(), limits.max()),
        cmap=COLOUR_MAP,
        linewidths=0.7,
        alpha=0.5,
        rasterized=True,
    )
    axes.add_collection(lines)
    axes.plot(
        places[:-1], shares[thinned(sweep.not_done, NOT_DONE_LINES), :-1].T, color=NOT_DONE, linewidth=0.9, linestyle=(0, (3, 2))
    )
    axes.set_xlim(-0.3, len(variables) - 0.7)
    axes.set_ylim(-0.12, 1.12)
    axes.set_yticks([])
    axes.set_xticks(places, [wrapped(variable.short_label, 18) for variable in variables], fontsize=8)
    axes.tick_params(length=0)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.grid(visible=False)
    axes.set_title(plain(result.long_name), loc="left")
    _add_colour_bar(axes, lines, result, values)


def _draw_parallel_axis(axes: Axes, place: int, variable: Variable, values: np.ndarray) -> np.ndarray:
    """Draws one axis and gives the places of the values on it, 0 to 1; of wide ranges by their logarithms."""
    low, high = values.min(), values.max()
    axes.plot([place, place], [0.0, 1.0], color="0.2", linewidth=0.9, zorder=3)
    for share, value, alignment in ((1.02, high, "bottom"), (-0.02, low, "top")):
        axes.text(place, share, f"{value:.4g}", ha="center", va=alignment, fontsize=8)
    if is_constant(values):
        return np.full(values.shape, 0.5)
    if is_wide(values):
        return np.log(values / low) / np.log(high / low)
    return (values - low) / (high - low)
