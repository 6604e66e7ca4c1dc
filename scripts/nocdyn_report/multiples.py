"""Small panels, one for each of many series."""

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from .results import Series
from .style import COLOURS, plain
from .thinning import thin

MOST_PANELS = 24  # of a figure
PIXELS = 500  # of a panel
ACROSS = 4
PANEL = (2.75, 1.25)  # width and height [in]
LONGEST_NAME = 30  # characters that fit above a panel
COMPARABLE = 0.2  # ratio of ranges from which on series share a scale


def draw_multiples(time: np.ndarray, columns: list[Series], caption: str) -> Figure:
    """Series over time, on one scale if their ranges are comparable."""
    down = -(-len(columns) // ACROSS)
    ranges = [np.ptp(column.values) for column in columns]
    shared = min(ranges) >= COMPARABLE * (max(c.values.max() for c in columns) - min(c.values.min() for c in columns))
    figure, grid = pyplot.subplots(
        down, ACROSS, squeeze=False, sharex=True, sharey=shared, figsize=(PANEL[0] * ACROSS, PANEL[1] * down + 1.2)
    )
    for axes, column in zip(grid.flat, columns):
        axes.plot(*thin(time, column.values, PIXELS), color=COLOURS[0], linewidth=0.8)
        axes.set_title(plain(_shortened(column.name)), fontsize=9, pad=3)
        axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
        axes.tick_params(labelsize=8)
        axes.yaxis.get_offset_text().set_fontsize(8)
    for axes in grid.flat[len(columns) :]:
        axes.set_visible(False)
    for axes in grid.flat[max(len(columns) - ACROSS, 0) : len(columns)]:  # the lowest of each column
        axes.tick_params(labelbottom=True)
    grid[0, 0].set_xlim(time[0], time[-1])
    grid[0, 0].xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    figure.supxlabel("time [s]", fontsize=10)
    figure.supylabel(f"{caption} [{columns[0].unit}]", fontsize=10)
    return figure


def _shortened(name: str) -> str:
    return name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…"
