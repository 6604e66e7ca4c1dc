"""Draws figures 2 to 5 of the paper from the results of its two cases."""

import argparse
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from matplotlib import pyplot
from matplotlib.figure import Figure

from .failure import ResultsError
from .paper_machine import steady_state
from .phase_planes import draw_phase_planes
from .results import Results, read_results
from .style import FORMATS, REFERENCE, WIDTH, add_format_option, add_title, draw_lines, save, saved

ROOT = Path(__file__).resolve().parents[2]
MEDIA = ROOT / "docs" / "media"


def draw_elastic_moments(results: Results) -> Figure:
    """F1 and F2 = -F1 over time, with their steady values."""
    figure, axes = pyplot.subplots(figsize=(WIDTH, 4.2))
    moment = results.values(results.columns("moment")[0].label)
    steady = steady_state(results).moment
    axes.axhline(steady, label="uniform\nmotion", **REFERENCE)
    axes.axhline(-steady, **REFERENCE)
    draw_lines(axes, ["F₁", "F₂"], [(results.time, moment), (results.time, -moment)])
    axes.set_xlim(results.time[0], results.time[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("elastic moment [N m]")
    return figure


def draw_paper_figures(case1: Results, case2: Results, folder: Path, formats: Sequence[str] = FORMATS) -> list[str]:
    """Saves the figures and gives their names."""
    drawn = []
    for number, results in ((2, case1), (4, case2)):
        planes, moments = draw_phase_planes(results), draw_elastic_moments(results)
        add_title(planes, f"Figure {number}. Phase planes. {results.title}")
        add_title(moments, f"Figure {number + 1}. Elastic moments. {results.title}")
        for offset, figure in enumerate((planes, moments)):
            drawn.append(f"figure{number + offset}")
            save(figure, folder, drawn[-1], formats)
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/figures", description=__doc__)
    parser.add_argument("results", nargs=2, type=Path, metavar="RESULTS", help="results folders of case 1 and of case 2")
    parser.add_argument(
        "--out",
        type=Path,
        default=ROOT / "results" / "figures",
        metavar="DIR",
        help="where figure2 ... figure5 go, as PNG, SVG and PDF (%(default)s)",
    )
    add_format_option(parser)
    parser.add_argument("--media", action="store_true", help="also copy the PNG files to docs/media, for the README")
    arguments = parser.parse_args()
    try:
        names = draw_paper_figures(*map(read_results, arguments.results), arguments.out, arguments.format)
    except ResultsError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        sys.exit(error.code)
    if arguments.media:
        MEDIA.mkdir(parents=True, exist_ok=True)
        for name in names:
            shutil.copy(arguments.out / f"{name}.png", MEDIA)
    print(saved(names, arguments.format, arguments.out))


if __name__ == "__main__":
    main()
