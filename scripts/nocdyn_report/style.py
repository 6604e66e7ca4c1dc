"""How all figures look, and how they are saved."""

import argparse
import importlib
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter

from .thinning import thin

# Okabe and Ito's colours, told apart with any colour vision; grey for the yellow that white paper swallows.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#999999", "#000000")
REFERENCE = {"color": "0.35", "linestyle": (0, (5, 3)), "linewidth": 0.9}
CANVASES = {"png": ("agg", "FigureCanvasAgg"), "svg": ("svg", "FigureCanvasSVG"), "pdf": ("pdf", "FigureCanvasPdf")}
FORMATS = tuple(CANVASES)
DPI = 160
WIDTH = 8.0  # of a figure [in]
TITLE_LENGTH = 75  # characters that fit on a line of that width
PIXELS = 1200  # that a line is wide

RAISED = str.maketrans("0123456789-\N{MINUS SIGN}", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")

matplotlib.use("Agg")
matplotlib.rcParams.update(
    {
        "agg.path.chunksize": 20000,  # lines of any length
        "axes.axisbelow": True,
        "axes.formatter.limits": (-4, 5),
        "axes.grid": True,
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlesize": 10,
        "figure.constrained_layout.use": True,
        "figure.titlesize": 12,
        "font.size": 10,
        "grid.color": "0.88",
        "grid.linewidth": 0.6,
        "legend.frameon": False,
        "lines.linewidth": 1.3,
        "pdf.fonttype": 42,  # fonts as TrueType, so that the text stays text
        "svg.fonttype": "none",
        "svg.hashsalt": "nocdyn",  # the same picture gives the same file
    }
)


class PlainFormatter(ScalarFormatter):
    """Numbers as text: to set each as mathematics takes 40 % of the time of a figure."""

    def get_offset(self) -> str:
        """A power of ten as 'times ten to the' instead of 'e'."""
        return re.sub(r"1e(\S+)", lambda match: f"\N{MULTIPLICATION SIGN}10{match[1].translate(RAISED)}", super().get_offset())


def plain(text: str) -> str:
    """Text of a user, without meaning for mathematics."""
    return text.replace("$", r"\$")


def add_title(figure: Figure, *lines: str) -> None:
    figure.suptitle(plain("\n".join(textwrap.fill(line, TITLE_LENGTH) for line in lines if line)))


def draw_lines(axes: Axes, names: Sequence[str], lines: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
    """Lines (x, y) over a rising x with their names, at most as many as there are colours."""
    for name, (x, y), colour in zip(names, lines, COLOURS, strict=False):
        axes.plot(*thin(x, y, PIXELS), color=colour, label=plain(name))
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def add_legend(figure: Figure, *entries: Sequence, place: str = "center", **look: object) -> None:
    """Below the axes; Matplotlib before 3.7, as in Debian 12, has no word for that."""
    if matplotlib.__version_info__ >= (3, 7):
        figure.legend(*entries, loc=f"outside lower {place}", **look)
        return
    legend = figure.legend(*entries, loc=f"lower {place}", **look)
    height = legend.get_window_extent().height / figure.bbox.height
    figure.get_layout_engine().set(rect=(0.0, height, 1.0, 1.0 - height))


def add_format_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--format",
        type=_formats,
        default=list(FORMATS),
        metavar="KINDS",
        help=f"of the figures, separated by commas: some of {','.join(FORMATS)} (all)",
    )


def _formats(text: str) -> list[str]:
    """The words given after --format."""
    kinds = text.lower().split(",")
    for kind in kinds:
        if kind not in FORMATS:
            raise argparse.ArgumentTypeError(f"'{kind}' is none of {', '.join(FORMATS)}")
    return kinds


def saved(names: Sequence[str], formats: Sequence[str], folder: Path) -> str:
    """A line that says which figures are where."""
    return f"{', '.join(names)} ({', '.join(kind.upper() for kind in formats)}) are in {folder}"


def save(figure: Figure, folder: Path, name: str, formats: Sequence[str] = FORMATS) -> None:
    """Writes FOLDER/NAME in each format and frees the figure."""
    folder.mkdir(parents=True, exist_ok=True)
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if type(axis.get_major_formatter()) is ScalarFormatter:
            axis.set_major_formatter(PlainFormatter())
    figure.set_dpi(DPI)
    figure.get_layout_engine().execute(figure)
    figure.set_layout_engine("none")  # laid out once, not for each format again
    for kind in formats:
        undated = {"png": None, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
        backend, canvas = CANVASES[kind]
        module = importlib.import_module(f"matplotlib.backends.backend_{backend}")  # the one of PDF takes half a second
        # savefig would draw each twice, first without a result
        getattr(getattr(module, canvas)(figure), f"print_{kind}")(folder / f"{name}.{kind}", metadata=undated)
    pyplot.close(figure)
