"""The panels of the figures of a sweep: a result over what was varied, or by itself."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm
from matplotlib.tri import Triangulation

from .style import COLOURS, REFERENCE, plain
from .sweep_results import Sweep, Variable

MOST_POINTS = 20_000  # that are drawn one by one
DENSE = 2_000  # points from which contours show more than dots
RASTER = 1_000  # points from which dots are pixels in SVG and PDF too
BINS = (12, 100)  # fewest and most of a histogram
CELLS = 80  # along each side of a density
LABEL_LENGTH = 26  # characters that fit under a panel
WIDE = 1_000.0  # largest over smallest value from which an axis is logarithmic
STEEP = 50.0  # the same of a resonance curve
LINES = 1_000  # of parallel axes
FAILED = COLOURS[1]
COLOUR_MAP = "viridis"


def wrapped(label: str, length: int = LABEL_LENGTH) -> str:
    """A label on several lines if it is long, broken after dots and before brackets."""
    lines = [""]
    for piece in label.replace(".", ".\0").replace(" [", "\0 [").split("\0"):
        if lines[-1] and len(lines[-1]) + len(piece) > length:
            lines.append(piece.strip())
        else:
            lines[-1] += piece
    return plain("\n".join(lines))


def is_wide(values: np.ndarray, ratio: float = WIDE) -> bool:
    return values.min() > 0.0 and values.max() > ratio * values.min()


def is_constant(values: np.ndarray) -> bool:
    """Whether all values are the same but for rounding."""
    return np.ptp(values) <= 1e-12 * np.abs(values).max()


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's; NaN if one of them does not vary."""
    if len(a) < 2 or is_constant(a) or is_constant(b):
        return np.nan
    return float(np.corrcoef(pd.Series(a).rank(), pd.Series(b).rank())[0, 1])


def draw_histogram(axes: Axes, result: Variable, done: np.ndarray) -> None:
    """With the 5 %, 50 % and 95 % values; what lies very far outside is counted, not drawn."""
    values = result.values[done]
    low, median, high = np.quantile(values, (0.05, 0.5, 0.95), method="inverted_cdf")
    reach = 3.0 * (high - low) if high > low else np.inf
    inside = values[(values >= low - reach) & (values <= high + reach)]
    if is_constant(values):
        axes.hist(values, bins=1, range=(median - 0.5, median + 0.5), color=COLOURS[0], alpha=0.5, rwidth=0.1)
    else:
        axes.hist(inside, bins=_bins(inside, high - low), color=COLOURS[0], alpha=0.5)
    for value, name, style in ((low, "5 %", (0, (2, 2))), (median, "median", "-"), (high, "95 %", (0, (5, 3)))):
        axes.axvline(value, color="black", linestyle=style, linewidth=1.1, label=f"{name}: {value:.5g}")
    if len(inside) < len(values):
        axes.plot([], [], " ", label=f"{len(values) - len(inside)} further out,\nup to {_farthest(values, median):.5g}")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_title(plain(result.long_name), loc="left")
    axes.set_xlabel(plain(result.label))
    axes.set_ylabel("variants")
    axes.grid(visible=False, axis="x")


def _bins(values: np.ndarray, width: float) -> int:
    """Freedman and Diaconis' number, from the middle 90 % in place of the middle half."""
    bin_width = 0.82 * width / len(values) ** (1.0 / 3.0)
    return int(np.clip(np.ptp(values) / bin_width, *BINS)) if bin_width > 0.0 else BINS[0]


def _farthest(values: np.ndarray, median: float) -> float:
    return values[np.argmax(np.abs(values - median))]


def draw_scatter(axes: Axes, sweep: Sweep, key: Variable, result: Variable) -> None:
    """Each variant a dot, or how many there are at each place; ticks on the lower edge are variants that were not done."""
    x, y = key.values[sweep.done], result.values[sweep.done]
    if is_wide(x):
        axes.set_xscale("log")
    if len(x) > MOST_POINTS:
        _draw_density(axes, x, y)
    else:
        size = np.clip(6000.0 / len(x), 1.5, 16.0)
        axes.scatter(x, y, s=size, color=COLOURS[0], alpha=0.9 if len(x) < 200 else 0.45, linewidths=0,
                     rasterized=len(x) > RASTER)
    mark_not_done(axes, key.values[sweep.not_done])
    correlation = rank_correlation(x, y)
    axes.set_title("no correlation: constant" if np.isnan(correlation) else f"rank correlation {correlation:+.2f}")


def _draw_density(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    edges = np.geomspace(x.min(), x.max(), CELLS + 1) if is_wide(x) else CELLS
    counts, x_edges, y_edges = np.histogram2d(x, y, bins=(edges, CELLS))
    shown = np.ma.masked_equal(counts.T, 0)
    axes.pcolormesh(x_edges, y_edges, shown, norm=LogNorm(), cmap="Blues", rasterized=True)


def mark_not_done(axes: Axes, places: np.ndarray) -> None:
    if places.size:
        axes.plot(places, np.zeros(places.size), "|", color=FAILED, markersize=9, markeredgewidth=1.2, clip_on=False,
                  transform=axes.get_xaxis_transform(), label="not done", rasterized=places.size > RASTER)


def draw_curve(axes: Axes, sweep: Sweep, key: Variable, result: Variable, mark_peak: bool) -> None:
    """A result over the only number that varies."""
    done = sweep.done[np.argsort(key.values[sweep.done], kind="stable")]
    x, y = key.values[done], result.values[done]
    axes.plot(x, y, color=COLOURS[0], marker="o" if len(x) <= 200 else None, markersize=2.5)
    if is_wide(x):
        axes.set_xscale("log")
    if mark_peak and is_wide(y, STEEP):
        axes.set_yscale("log")
    if mark_peak and not is_constant(y):
        peak = np.argmax(y)
        axes.axvline(x[peak], **REFERENCE)
        axes.plot(x[peak], y[peak], "o", color=COLOURS[1], markersize=6,
                  label=f"largest: {y[peak]:.5g} {result.unit}\nat {x[peak]:.5g} {key.unit}".replace(" 1\n", "\n"))
    mark_not_done(axes, key.values[sweep.not_done])
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_title(plain(result.long_name), loc="left")
    axes.set_ylabel(wrapped(result.label))


def draw_map(axes: Axes, sweep: Sweep, result: Variable) -> None:
    """A result over both numbers that vary: cells of a grid, contours or dots; crosses are variants that were not done."""
    first, second = sweep.varied
    x, y, colour = (variable.values[sweep.done] for variable in (first, second, result))
    if sweep.is_grid:
        drawn = _draw_cells(axes, sweep, result)
    elif DENSE < len(x) and not (is_wide(x) or is_wide(y)):
        drawn = _draw_contours(axes, x, y, colour)
    else:
        chosen = slice(None, None, -(-len(x) // MOST_POINTS))
        drawn = axes.scatter(x[chosen], y[chosen], c=colour[chosen], s=np.clip(8000.0 / len(x), 2.0, 24.0), cmap=COLOUR_MAP,
                             linewidths=0, rasterized=len(x) > RASTER)
    if not sweep.is_grid and is_wide(x):
        axes.set_xscale("log")
    if not sweep.is_grid and is_wide(y):
        axes.set_yscale("log")
    axes.plot(first.values[sweep.not_done], second.values[sweep.not_done], "x", color=FAILED, markersize=5, markeredgewidth=1.2,
              label="not done" if sweep.not_done.size else None, rasterized=sweep.not_done.size > RASTER)
    bar = axes.figure.colorbar(drawn, ax=axes)
    bar.set_label(wrapped(result.label, 40))
    axes.set_title(plain(result.long_name), loc="left")
    axes.grid(visible=False)


def _draw_cells(axes: Axes, sweep: Sweep, result: Variable):
    """The cells of a grid, their centres at its points."""
    first, second = sweep.varied
    x, columns = np.unique(first.values, return_inverse=True)
    y, rows = np.unique(second.values, return_inverse=True)
    cells = np.ma.masked_all((y.size, x.size))
    cells[rows[sweep.done], columns[sweep.done]] = result.values[sweep.done]
    return axes.pcolormesh(_edges(x), _edges(y), cells, cmap=COLOUR_MAP, rasterized=True)


def _edges(centres: np.ndarray) -> np.ndarray:
    if centres.size == 1:
        return centres[0] + np.array([-0.5, 0.5]) * (abs(centres[0]) or 1.0)
    middles = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(([2 * centres[0] - middles[0]], middles, [2 * centres[-1] - middles[-1]]))


def _draw_contours(axes: Axes, x: np.ndarray, y: np.ndarray, colour: np.ndarray):
    chosen = slice(None, None, -(-len(x) // MOST_POINTS))
    # between 0 and 1 the triangles do not depend on the units
    triangles = Triangulation((x[chosen] - x.min()) / np.ptp(x), (y[chosen] - y.min()) / np.ptp(y)).triangles
    levels = 20 if not is_constant(colour) else [colour[0] - 0.5, colour[0] + 0.5]
    return axes.tricontourf(Triangulation(x[chosen], y[chosen], triangles), colour[chosen], levels=levels, cmap=COLOUR_MAP)


def draw_parallel(axes: Axes, sweep: Sweep, result: Variable) -> None:
    """An axis for each varied number and one for the result; a line for each variant, coloured by the result."""
    chosen = sweep.done[::-(-sweep.done.size // LINES)]
    chosen = chosen[np.argsort(np.abs(_share(result.values[chosen]) - 0.5), kind="stable")]  # the extremes on top
    variables = [*sweep.varied, result]
    ranges = [(variable.values[sweep.done].min(), variable.values[sweep.done].max()) for variable in variables]
    shares = np.column_stack([_share(variable.values, *ends) for variable, ends in zip(variables, ranges)])
    places = np.arange(len(variables))
    lines = LineCollection([np.column_stack((places, row)) for row in shares[chosen]], array=result.values[chosen],
                           cmap=COLOUR_MAP, linewidths=0.8, alpha=0.6, rasterized=True)
    axes.add_collection(lines)
    for row in shares[sweep.not_done[::-(-max(1, sweep.not_done.size) // LINES)], :-1]:
        axes.plot(places[:-1], row, color=FAILED, linewidth=0.9, linestyle=(0, (3, 2)))
    for place, (low, high) in zip(places, ranges):
        axes.axvline(place, color="0.2", linewidth=0.9)
        axes.text(place, 1.02, f"{high:.4g}", ha="center", va="bottom", fontsize=8)
        axes.text(place, -0.02, f"{low:.4g}", ha="center", va="top", fontsize=8)
    axes.set_xlim(-0.3, len(variables) - 0.7)
    axes.set_ylim(-0.1, 1.1)
    axes.set_yticks([])
    axes.set_xticks(places, [wrapped(variable.label, 18) for variable in variables], fontsize=8)
    axes.tick_params(length=0)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.grid(visible=False)
    axes.set_title(plain(result.long_name), loc="left", pad=10)
    axes.figure.colorbar(lines, ax=axes, alpha=1.0).set_label(wrapped(result.label, 40))


def _share(values: np.ndarray, low: float | None = None, high: float | None = None) -> np.ndarray:
    """Where values are between their ends: 0 to 1; 1/2 if these are equal."""
    low, high = (values.min(), values.max()) if low is None else (low, high)
    return (values - low) / (high - low) if high > low else np.full(values.shape, 0.5)
