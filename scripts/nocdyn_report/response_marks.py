"""Critical speeds and barred speed ranges in a panel of a forced response."""

import numpy as np
from matplotlib.axes import Axes

from .speed_panels import DANGER, HALO, SMALL, Labels, above, share_of
from .speed_results import Barred, Critical, Quantity, Response

SHARE = 0.03  # of the largest half range that an order has at a critical speed that is named
STRIP = 0.025  # height of the strip above barred speeds, of the panel
BARRED = {True: "#F7DADC", False: "#EBA9AF"}
TURNED = 1.4 * SMALL / 72  # width of a text that is turned [in]


def draw_barred(axes: Axes, labels: Labels, ranges: list[Barred]) -> None:
    """Shades the ranges, with a strip and the speeds above the panel; the widest are named first."""
    low, high = sorted(axes.get_xlim())
    above_panel = Labels(axes, labels.size)
    seen = [one for one in ranges if one.start < high and one.end > low]
    for one in sorted(seen, key=lambda one: one.start - one.end):
        start, end = max(one.start, low), min(one.end, high)
        axes.axvspan(start, end, facecolor=BARRED[one.can_be_passed], linewidth=0, zorder=0.5)
        axes.fill_between(
            [start, end], 1.0, 1.0 + STRIP, color=DANGER, linewidth=0.8, transform=above(axes), clip_on=False, zorder=1
        )
        text = f"{one.start:.4g}\N{EN DASH}{one.end:.4g}"
        middle = share_of(axes, (start + end) / 2)
        width = (0.56 * len(text) + 0.6) * SMALL / 72
        if above_panel.is_free(middle, 0.0, width, 0.1):
            style = {"fontsize": SMALL, "color": DANGER, "ha": "center", "va": "bottom"}
            axes.text((start + end) / 2, 1.0 + 1.4 * STRIP, text, transform=above(axes), **style)


def mark_criticals(labels: Labels, response: Response, quantity: Quantity) -> None:
    """Triangles along the upper edge; names of those whose order is large, the largest first."""
    axes = labels.axes
    low, high = sorted(axes.get_xlim())
    inside = [one for one in response.criticals if low <= one.speed <= high]
    if not inside:
        return
    axes.plot([one.speed for one in inside], np.full(len(inside), 0.985), marker=7, linestyle="", color="0.35", markersize=4,
              transform=above(axes), zorder=5)  # fmt: skip
    turned = not response.axis.is_frequency  # the names of resonances are short
    sizes = {id(one): _amplitude(one, response, quantity) for one in inside}
    smallest = SHARE * np.nan_to_num(quantity.half_range).max()
    for one in sorted(inside, key=lambda one: -sizes[id(one)]):
        height = (0.6 * len(one.name) + 0.3) * SMALL / 72 if turned else TURNED
        top = 1.0 - 0.08 / labels.size[1]
        if sizes[id(one)] < smallest:
            break
        if labels.is_free(share_of(axes, one.speed), top - height / 2 / labels.size[1], TURNED, height):
            axes.axvline(one.speed, color="0.55", linewidth=0.5, zorder=1)
            style = {
                "fontsize": SMALL,
                "color": "0.2",
                "ha": "center",
                "va": "top",
                "rotation": 90 if turned else 0,
                "bbox": HALO,
                "zorder": 5,
            }
            axes.text(one.speed, top, one.name, transform=above(axes), **style)


def _amplitude(critical: Critical, response: Response, quantity: Quantity) -> float:
    """Of the order at its critical speed."""
    if quantity.orders is None:
        return 0.0
    places = [place for place, line in enumerate(response.lines) if line.is_order and line.value == critical.line.value]
    return max((float(np.interp(critical.speed, response.speed, quantity.orders[:, place])) for place in places), default=0.0)
