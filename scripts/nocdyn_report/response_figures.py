"""Draws forced responses over the speed: the half range of every moment and reaction, its orders, limits, barred speed ranges."""

import argparse
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .columns import by_sort
from .failure import ChoiceError
from .measured_figures import measured_figures
from .response_marks import BARRED, draw_barred, mark_criticals
from .selection import matches
from .speed_panels import (
    DANGER,
    Figures,
    Labels,
    arguments_of,
    draw_folders,
    figure_parser,
    finite,
    height_of,
    shade_operation,
    share_of,
    window_of,
)
from .speed_results import NAMED, NEAR, Quantity, Response, read_response
from .style import COLOURS, PIXELS, WIDTH, add_legend, add_title, plain
from .thinning import thin

MOST_PANELS = 6  # of a figure
WIDE = 11.5  # width of a figure of two columns [in]
PANEL = 2.75  # height of a panel [in]
AXES_SHARE = 0.84  # of a panel that its axes have, about
SMALLEST = 0.02  # of the largest half range that a named order has
LONGEST = 34  # characters of a line beside a panel
HEADROOM = 1.3  # for the names of critical speeds
MOST_OF, AT_END = 0.5, 0.9  # of the half range that an order has whose name stands above it; at the ends of the speeds
MOST_PEAKS = 3  # of a curve that may bear its name
SPOTS = 25  # along a curve where its name may stand
DECADES = 1e-4  # lowest value of a logarithmic axis, of the largest one
ORDER_COLOURS = (*COLOURS[:6], "#7F3C8D")
DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1.2)), (0, (5, 1.2, 1.2, 1.2)))
SYNTHESIS = {"color": "black", "linewidth": 1.6}
OTHERS = {"color": "0.72", "linewidth": 0.6}
PEAK = {"color": "0.35", "linewidth": 1.1, "linestyle": (0, (4, 1.5))}
MEAN = {"color": "0.35", "linewidth": 1.1, "linestyle": (0, (1, 1.2))}
LIMIT = {"color": DANGER, "linewidth": 1.4}
PEAK_LIMIT = {"color": DANGER, "linewidth": 1.4, "linestyle": (0, (1.2, 1.2))}
TRANSIENT = {"color": DANGER, "linewidth": 1.4, "linestyle": (0, (5, 2))}


@dataclass(frozen=True)
class Look:
    """What the user chose."""

    window: tuple[float, float]  # [rpm]
    orders: Sequence[float] = ()  # that are named; none: the largest
    with_peak: bool = False
    is_logarithmic: bool = False


def named_lines(response: Response, quantity: Quantity, look: Look) -> list[int]:
    """Places of the lines that are named, the largest first."""
    if quantity.orders is None or len(response.lines) == 1:
        return []
    if look.orders:
        return [place for place, line in enumerate(response.lines) if line.is_order and line.value in look.orders]
    inside = (response.speed >= look.window[0]) & (response.speed <= look.window[1])
    return response.largest_lines(quantity, inside, SMALLEST)


def _has_orders(response: Response, quantity: Quantity) -> bool:
    """Whether there are curves beside that of all orders."""
    return quantity.orders is not None and len(response.lines) > 1


def styles_of(response: Response, quantities: Sequence[Quantity], look: Look) -> dict[int, dict]:
    """The same line for the same order in all panels, the first colours for those that are named most often."""
    counts: dict[int, int] = {}
    for quantity in quantities:
        for place in named_lines(response, quantity, look):
            counts[place] = counts.get(place, 0) + 1
    ranked = sorted(counts, key=lambda place: (-counts[place], place))
    count = len(ORDER_COLOURS)
    return {
        place: {"color": ORDER_COLOURS[rank % count], "linestyle": DASHES[rank // count % len(DASHES)], "linewidth": 1.1}
        for rank, place in enumerate(ranked)
    }


def draw_quantity(axes: Axes, response: Response, quantity: Quantity, look: Look, styles: dict[int, dict]) -> None:
    """One panel, without the texts inside, whose places follow from its final scales."""
    named = named_lines(response, quantity, look)
    for place in range(len(response.lines) if _has_orders(response, quantity) else 0):
        style = {**styles[place], "zorder": 3} if place in named else {**OTHERS, "zorder": 2}
        axes.plot(*thin(response.speed, quantity.orders[:, place], PIXELS), **style)
    axes.plot(*thin(response.speed, quantity.half_range, PIXELS), zorder=4, **SYNTHESIS)
    if look.with_peak:
        for values, style in ((quantity.peak, PEAK), (quantity.mean, MEAN)):
            if values is not None:
                axes.plot(*thin(response.speed, np.abs(values), PIXELS), zorder=3, **style)
    axes.set_xlim(look.window)
    far = _set_scale(axes, response, quantity, look)
    for values, style in _limits(quantity, look):
        axes.plot(*thin(response.speed, values, PIXELS), zorder=5, **style)
    title = plain(quantity.column.title) + (f"   (limit, from {far:.4g} {quantity.unit} on, is above)" if far else "")
    axes.set_title(title, loc="left", pad=16 if response.barred_by(quantity) else 6)
    axes.set_ylabel(textwrap.fill(f"{quantity.column.caption} [{quantity.unit}]", LONGEST))
    if quantity.stress:
        _add_stress(axes, quantity.stress)


def _limits(quantity: Quantity, look: Look) -> list[tuple[np.ndarray, dict]]:
    """Curves and their styles; that of the largest magnitude where this is drawn too."""
    limits = [(quantity.limit, LIMIT), (quantity.transient_limit, TRANSIENT)]
    limits += [(quantity.peak_limit, PEAK_LIMIT)] * look.with_peak
    return [(values, style) for values, style in limits if values is not None]


def _set_scale(axes: Axes, response: Response, quantity: Quantity, look: Look) -> float:
    """Room for what is drawn and for limits that are not far above; the smallest limit, if that is far above, else 0."""
    inside = (response.speed >= look.window[0]) & (response.speed <= look.window[1])
    drawn = [quantity.half_range] + [quantity.peak] * (look.with_peak and quantity.peak is not None)
    values = np.concatenate([one[inside] for one in drawn])
    top = max(np.nanmax(values[np.isfinite(values)], initial=0.0), 1e-300)
    limits = [values[inside].min() for values, _ in _limits(quantity, look)]
    near = [limit for limit in limits if limit <= NEAR * top]
    largest = max([top, *near])
    if look.is_logarithmic:
        axes.set_yscale("log")
        axes.set_ylim(DECADES * largest, largest * DECADES ** -(HEADROOM - 1))
    else:
        axes.set_ylim(0.0, HEADROOM * largest)
    return 0.0 if near or not limits else min(limits)


def _add_stress(axes: Axes, stress: float) -> None:
    mega = 1e-6 * stress
    scale = axes.secondary_yaxis("right", functions=(lambda moment: moment * mega, lambda value: value / mega))
    scale.set_ylabel("stress [MPa]")
    scale.spines["right"].set_visible(True)


def name_orders(labels: Labels, response: Response, quantity: Quantity, look: Look, styles: dict[int, dict]) -> None:
    """Names of orders at their peaks, or where there is room on the curve, and not on the curve of all orders if possible."""
    inside = np.flatnonzero((response.speed >= look.window[0]) & (response.speed <= look.window[1]))
    x = share_of(labels.axes, response.speed[inside])
    half_range = quantity.half_range[inside]
    labels.avoid(x, height_of(labels.axes, half_range))
    for place in named_lines(response, quantity, look):
        values = np.nan_to_num(quantity.orders[inside, place])
        y = np.minimum(height_of(labels.axes, values), 0.93)
        spots, beside = [], []
        for peak in _peaks(values):
            share = values[peak] / half_range[peak]
            spots.append((x[peak], y[peak]))
            if share > (AT_END if peak in (0, len(inside) - 1) else MOST_OF):
                top = labels.top_of_curve(x[peak])
                spots.append((x[peak], top))
                beside += labels.beside(x[peak], top) if share > AT_END else []
        along = np.linspace(0, len(inside) - 1, SPOTS).round().astype(int)
        spots += beside + [(x[one], y[one]) for one in along[np.argsort(-values[along], kind="stable")]]
        labels.put_nearby(response.lines[place].name, spots, styles[place]["color"])


def _peaks(values: np.ndarray) -> list[int]:
    """Where the largest value is, and the largest of the other peaks."""
    peaks = np.flatnonzero((values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:])) + 1
    largest = [int(peak) for peak in peaks[np.argsort(-values[peaks], kind="stable")][:MOST_PEAKS]]
    return list(dict.fromkeys([int(values.argmax()), *largest]))


def draw_page(response: Response, page: Sequence[Quantity], look: Look, styles: dict[int, dict]) -> Figure:
    """Panels of one sort, in one unit."""
    across = 1 if len(page) == 1 else 2
    down = -(-len(page) // across)
    width, height = (WIDTH, 1.5 * PANEL) if across == 1 else (WIDE, PANEL)
    figure, grid = pyplot.subplots(down, across, squeeze=False, figsize=(width, height * down + 1.6))
    shades: list[Patch] = []
    for axes, quantity in zip(grid.flat, page):
        shades = shade_operation(axes, response.operation)
        draw_quantity(axes, response, quantity, look, styles)
        labels = Labels(axes, (AXES_SHARE * width / across - (0.6 if quantity.stress else 0.0), AXES_SHARE * height - 0.3))
        draw_barred(axes, labels, response.barred_by(quantity))
        mark_criticals(labels, response, quantity)
        name_orders(labels, response, quantity, look, styles)
    for axes in grid.flat[len(page) :]:
        axes.set_visible(False)
    for axes in grid.flat[max(len(page) - across, 0) : len(page)]:
        axes.set_xlabel(plain(f"{response.axis.label} [{response.axis.unit}]"))
    add_legend(figure, handles=_legend(response, page, look, shades), ncols=3 if across == 1 else 4, fontsize=8.5)
    add_title(figure, response.title, f"forced response: half range over the {response.axis.noun}")
    return figure


def _legend(response: Response, page: Sequence[Quantity], look: Look, shades: list[Patch]) -> list[Artist]:
    only = len(response.lines) == 1
    together = f"half range: {response.lines[0].title}" if only else "half range of all orders together"
    handles: list[Artist] = [Line2D([], [], label=together, **SYNTHESIS)]
    if any(_has_orders(response, quantity) for quantity in page):
        handles.append(Line2D([], [], color=ORDER_COLOURS[0], label="orders, named by number"))
        if any(len(named_lines(response, quantity, look)) < len(response.lines) for quantity in page):
            handles.append(Line2D([], [], label="other orders", **OTHERS))
    if look.with_peak:
        handles += [Line2D([], [], label="largest magnitude", **PEAK), Line2D([], [], label="magnitude of the mean", **MEAN)]
    if any(quantity.limit is not None for quantity in page):
        handles.append(Line2D([], [], label="limit in continuous operation", **LIMIT))
    if any(quantity.transient_limit is not None for quantity in page):
        handles.append(Line2D([], [], label="limit while passing through", **TRANSIENT))
    if look.with_peak and any(quantity.peak_limit is not None for quantity in page):
        handles.append(Line2D([], [], label="limit of the magnitude", **PEAK_LIMIT))
    bars = [one for quantity in page for one in response.barred_by(quantity)]
    if bars:
        handles.append(Patch(facecolor=BARRED[True], label=f"barred {response.axis.plural}"))
    if not all(one.can_be_passed for one in bars):
        handles.append(Patch(facecolor=BARRED[False], label="not to be passed through"))
    if response.criticals:
        named = "resonance: mode" if response.axis.is_frequency else "critical: mode/order"
        handles.append(Line2D([], [], color="0.35", marker=7, linestyle="", markersize=4, label=named))
    return handles + shades


def chosen(response: Response, patterns: Sequence[str] | None) -> list[Quantity]:
    """The quantities that patterns name."""
    if not patterns:
        return response.quantities
    labels: set[str] = set()
    for pattern in patterns:
        found = {one.label for one in response.quantities if matches(pattern, one.label)}
        if not found:
            there = ", ".join(one.label for one in response.quantities[:8])
            raise ChoiceError(f"{response.folder}: no quantity matches '{pattern}'; there are: {there}")
        labels |= found
    return [one for one in response.quantities if one.label in labels]


def figures_of(folder: Path, arguments: argparse.Namespace) -> Figures:
    """A figure, or several, for each kind of quantity."""
    response = read_response(folder)
    orders = [line.value for line in response.lines if line.is_order]
    for order in arguments.orders or ():
        if order not in orders:
            raise ChoiceError(f"{folder}: no order {order:g}; there are: {', '.join(f'{one:g}' for one in orders)}")
    look = Look(
        window_of(folder, response.speed, arguments, response.axis.unit), arguments.orders or (), arguments.peak, arguments.log
    )
    quantities = chosen(response, arguments.columns)
    styles = styles_of(response, quantities, look)
    of_columns = {quantity.column.label: quantity for quantity in quantities}
    pages: dict[str, int] = {}
    for columns in by_sort(quantity.column for quantity in quantities):
        members = [of_columns[column.label] for column in columns]
        largest = max(one.largest for one in members)
        members = [one.in_short(largest) for one in members]
        for first in range(0, len(members), MOST_PANELS):
            kind = columns[0].kind
            pages[kind] = pages.get(kind, 0) + 1
            name = kind if pages[kind] == 1 else f"{kind}_{pages[kind]}"
            yield name, draw_page(response, members[first : first + MOST_PANELS], look, styles)
    if not arguments.columns:
        yield from measured_figures(folder, "response.json", response.title).items()


def main() -> None:
    parser = figure_parser("nocdyn plot response", "response", __doc__)
    parser.usage = (
        "%(prog)s RESULTS ... [--columns PATTERN ...] [--orders ORDER ...] [--peak] [--log] [--from RPM] [--to RPM] "
        "[--format KINDS] [--out DIR]"
    )
    parser.add_argument(
        "--columns",
        nargs="+",
        metavar="PATTERN",
        help="draws these quantities only, e.g. 'total_moment_*' reaction_pinion; '*' stands for any text, '?' for a character",
    )
    parser.add_argument(
        "--orders",
        nargs="+",
        type=finite,
        metavar="ORDER",
        help=f"names these orders instead of the {NAMED} largest of each panel",
    )
    parser.add_argument("--peak", action="store_true", help="also the mean and the largest magnitude, the mean included")
    parser.add_argument("--log", action="store_true", help="logarithmic moments")
    arguments = arguments_of(parser)
    draw_folders(arguments, partial(figures_of, arguments=arguments))


if __name__ == "__main__":
    main()
