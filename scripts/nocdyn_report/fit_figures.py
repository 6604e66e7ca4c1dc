"""Draws what 'nocdyn fit' wrote: measurements before and after, the unknowns with their confidence, their correlations."""

import argparse
import textwrap
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from .comparisons import FREQUENCY, SERIES, Comparison, read_comparisons
from .json_files import read_json, with_case
from .measured_figures import COMPUTED, DIGITS, LONGEST, MEASURED, MOST_POINTS, abscissa_label, add_legend_above, draw_bars
from .report.result_files import case_of
from .speed_results import rpm
from .style import COLOURS, PIXELS, WIDTH, add_format_option, add_title, plain, save, saved
from .thinning import thin

REPORT = "fit.json"
BEFORE = {"color": COLOURS[1], "linewidth": 0.9}
CONFIDENT = 1.959963984540054  # standard errors on either side of 95 % of a normal distribution
MOST_NUMBERS = 12  # unknowns whose correlations have room as numbers
BAND = {"color": "0.85", "linewidth": 0.0, "zorder": 0}


def draw_measurement(one: Comparison, title: str) -> Figure:
    """What was measured with the computed values before and after, and below the differences."""
    figure, (upper, lower) = pyplot.subplots(2, 1, sharex=True, figsize=(WIDTH, 5.6), height_ratios=(2, 1))
    x = one.abscissa if one.kind == SERIES else rpm(one.abscissa)
    mark = {"marker": "o", "markersize": 3.5} if one.kind != SERIES or len(x) <= MOST_POINTS else {}
    line = {} if one.kind == SERIES else {"linestyle": "none", "zorder": 3}
    upper.plot(*thin(x, one.measured, PIXELS), label="measured", **MEASURED, **mark, **line)
    for label, values, look in (("before", one.before, BEFORE), ("after", one.computed, COMPUTED)):
        if values is not None:
            upper.plot(*thin(x, values, PIXELS), label=label, **look)
            lower.plot(*thin(x, values - one.measured, PIXELS), **look, **mark)
    if deviation := one.facts.get("deviation"):
        lower.axhspan(-2 * deviation, 2 * deviation, **BAND, label="below: ± 2 standard deviations of the measurement")
    add_legend_above(upper, lower)
    upper.set_ylabel(plain(textwrap.fill(f"{one.facts['caption']} [{one.unit}]", LONGEST)))
    lower.set_ylabel(f"computed less\nmeasured\n[{one.unit}]")
    lower.set_xlabel(plain(abscissa_label(one)))
    add_title(figure, title, f"{one.name}: {one.subject}", _remark(one))
    return figure


def _remark(one: Comparison) -> str:
    words = [f"{word} {one.value(f'{word}_before'):.{DIGITS}g} → {one.value(word):.{DIGITS}g}" for word in ("bias", "spread")]
    return ", ".join(words) + f" {one.unit}"


def draw_values(one: Comparison, title: str) -> Figure:
    """Frequencies with their damping ratios, or one value: bars of what was measured, before and after."""
    is_frequency = one.kind == FREQUENCY
    label = "natural frequency" if is_frequency else one.facts["caption"]
    panels = [(f"{label} [{one.unit}]", (one.measured, one.before, one.computed))]
    if one.dampings:
        panels.append(("damping ratio", (one.dampings[0], one.damping_before, one.dampings[1])))
    figure, grid = pyplot.subplots(len(panels), 1, squeeze=False, figsize=(WIDTH, 2.6 * len(panels) + 1.1))
    places = one.abscissa if is_frequency else np.arange(len(one.measured))
    for axes, (words, values) in zip(grid.flat, panels):
        named = zip(("measured", "before", "after"), (MEASURED, BEFORE, COMPUTED), values)
        draw_bars(axes, places, [(name, look["color"], bars) for name, look, bars in named if bars is not None])
        axes.set_ylabel(plain(textwrap.fill(words, LONGEST)))
        if not is_frequency:
            axes.set_xticks([])
    grid.flat[0].legend(loc="upper left", ncols=3)
    grid.flat[-1].set_xlabel("mode; above the bars: difference to the measured value" if is_frequency else "")
    add_title(figure, title, f"{one.name}: {one.subject}")
    return figure


def draw_unknowns(unknowns: Sequence[dict], title: str) -> Figure:
    """Where the values lie between their bounds, and how exactly they are known."""
    height = 0.42 * len(unknowns) + 1.9
    figure, (left, right) = pyplot.subplots(1, 2, sharey=True, figsize=(1.35 * WIDTH, height), width_ratios=(3, 2))
    for row, one in enumerate(unknowns):
        span = one["high"] - one["low"]
        before, fitted = ((one[key] - one["low"]) / span for key in ("before", "fitted"))
        left.plot([0, 1], [row, row], color="0.85", linewidth=3, solid_capstyle="butt", zorder=1)
        left.plot(before, row, "o", color=COLOURS[1], markerfacecolor="none", markersize=9, label="before" if row == 0 else None)
        left.plot(fitted, row, "o", color=COLOURS[0], label="fitted" if row == 0 else None)
        if word := _doubt(one):
            right.annotate(word, (0, row), ha="center", va="center", color=COLOURS[1])
            continue
        half = 100 * CONFIDENT * one["standard_error"] / abs(one["fitted"])
        right.errorbar(0, row, xerr=half, fmt="o", color=COLOURS[0], capsize=4)
        right.annotate(f"± {half:.2g} %", (0, row), (0, 6), textcoords="offset points", ha="center", fontsize=8)
    names = [f"{one['target']}\n{_amount(one)}" for one in unknowns]
    left.set_yticks(range(len(unknowns)), [plain(name) for name in names], fontsize=8.5)
    left.set_ylim(len(unknowns) - 0.4, -0.6)
    left.set_xlim(-0.03, 1.03)
    left.set_xticks([0, 0.5, 1], ["low", "middle", "high"])
    left.set_xlabel("between the bounds")
    left.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    right.set_xlabel("95 % confidence interval, about the fitted value [%]")
    right.margins(x=0.15)
    add_title(figure, title, "unknowns")
    return figure


def _doubt(one: dict) -> str:
    """Why an unknown has no interval; '' if it has one."""
    return "not determined" if not one["is_determined"] else "at its bound" if one["is_at_bound"] else ""


def _amount(one: dict) -> str:
    half = float(f"{CONFIDENT * one['standard_error']:.2g}")
    error = "" if _doubt(one) else f" ± {half:g}"
    return f"{one['fitted']:.6g}{error} {one['unit']}".rstrip()


def draw_correlations(unknowns: Sequence[dict], title: str) -> Figure:
    """Of the errors of the unknowns; towards 1 or -1 the measurements hardly tell two of them apart."""
    matrix = np.array([one["correlation"] for one in unknowns])
    names = [plain(one["target"]) for one in unknowns]
    count = len(names)
    side = max(4.5, min(0.75 * count, 8.0))
    figure, axes = pyplot.subplots(figsize=(side + 3.0, side + 1.2))
    image = axes.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
    figure.colorbar(image, ax=axes, shrink=0.8)
    axes.set_xticks(range(count), names, rotation=35, ha="right", fontsize=8.5)
    axes.set_yticks(range(count), names, fontsize=8.5)
    axes.grid(visible=False)
    for i, k in np.ndindex(count, count) if count <= MOST_NUMBERS else ():
        shade = "white" if abs(matrix[i, k]) > 0.6 else "black"
        axes.text(k, i, f"{matrix[i, k]:.2f}", ha="center", va="center", fontsize=8.5, color=shade)
    add_title(figure, title, "correlations of the unknowns")
    return figure


def draw_all(folder: Path) -> dict[str, Figure]:
    report = read_json(folder / REPORT, ("unknowns", "measurements"))
    title = with_case(report["title"] or Path(report["input"]).name, case_of(folder, "fit"))
    figures = {}
    for one in read_comparisons(folder, REPORT):
        is_curve = one.kind != FREQUENCY and len(one.measured) > 1
        draw = draw_measurement if is_curve else draw_values
        figures[one.facts["file"].removesuffix(".csv")] = draw(one, title)
    figures["fit_unknowns"] = draw_unknowns(report["unknowns"], title)
    if len(report["unknowns"]) > 1:
        figures["fit_correlations"] = draw_correlations(report["unknowns"], title)
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(prog="nocdyn plot fit", description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder that 'nocdyn fit' wrote")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where the figures go (RESULTS/figures)")
    add_format_option(parser)
    arguments = parser.parse_args()
    folder = arguments.out or arguments.results / "figures"
    figures = draw_all(arguments.results)
    for name, figure in figures.items():
        save(figure, folder, name, arguments.format)
    print(saved(list(figures), arguments.format, folder))


if __name__ == "__main__":
    main()
