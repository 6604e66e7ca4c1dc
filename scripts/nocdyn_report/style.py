"""How all figures look, and how they are saved."""

import argparse
import textwrap
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib import colormaps, pyplot
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure

# Okabe and Ito's colours, told apart with any colour vision, without the yellow that white paper swallows.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
REFERENCE = {"color": "0.35", "linestyle": (0, (5, 3)), "linewidth": 0.9}
FORMATS = ("png", "svg", "pdf")
WIDTH = 8.0  # of a figure [in]
TITLE_LENGTH = 75  # characters that fit on a line of that width
MOST_TICKS = 8  # on the colour bar that stands for a legend of many lines

matplotlib.use("Agg")
matplotlib.rcParams.update(
    {
        "agg.path.chunksize": 20000,  # lines of any length
        "axes.axisbelow": True,
        "axes.formatter.limits": (-4, 5),
        "axes.formatter.use_mathtext": True,
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
        "savefig.dpi": 160,
        "svg.fonttype": "none",
        "svg.hashsalt": "nocdyn",  # the same picture gives the same file
    }
)


def plain(text: str) -> str:
    """Text of a user, without meaning for mathematics."""
    return text.replace("$", r"\$")


def add_title(figure: Figure, *lines: str) -> None:
    figure.suptitle(plain("\n".join(textwrap.fill(line, TITLE_LENGTH) for line in lines if line)))


def draw_lines(axes: Axes, names: Sequence[str], lines: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
    """Lines (x, y) with their names: in a legend if they are few, else on a colour bar."""
    few = len(lines) <= len(COLOURS)
    palette = COLOURS if few else colormaps["viridis"](np.linspace(0.0, 0.95, len(lines)))
    for name, (x, y), colour in zip(names, lines, palette):
        axes.plot(x, y, color=colour, label=plain(name), linewidth=1.3 if few else 0.8)
    if few:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    else:
        _add_colour_bar(axes, names, palette)


def _add_colour_bar(axes: Axes, names: Sequence[str], palette: np.ndarray) -> None:
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    ticks = np.unique(np.linspace(0, len(names) - 1, MOST_TICKS).round().astype(int))
    bar = axes.figure.colorbar(ScalarMappable(norm, ListedColormap(palette)), ax=axes, ticks=ticks)
    bar.ax.set_yticklabels([plain(names[tick]) for tick in ticks])
    bar.ax.tick_params(which="both", length=0)
    bar.ax.invert_yaxis()  # reads as the list of bodies does


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
    figure.get_layout_engine().execute(figure)
    figure.set_layout_engine("none")  # laid out once, not for each format again
    for kind in formats:
        undated = {"png": None, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[kind]
        figure.savefig(folder / f"{name}.{kind}", metadata=undated)
    pyplot.close(figure)
