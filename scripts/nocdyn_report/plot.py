"""nocdyn plot: draws what a folder of results holds."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

from .failure import FILES, USAGE, ChoiceError, ResultsError
from .report.result_files import MAIN_FILES, ResultFiles

# Kind of results -> the module that draws it, the names of its files.
KINDS = {
    "run": ("run_figures", "trajectory.*"),
    "modes": ("mode_figures", "modes.json"),
    "campbell": ("campbell_figures", "campbell.json"),
    "response": ("response_figures", "response.json"),
    "orbit": ("orbit_figures", "orbit.json"),
    "transit": ("transit_figures", "transit.json"),
    "fit": ("fit_figures", "fit.json"),
    "sweep": ("sweep_figures", "sweep.nc"),
}
PAPER = "paper"
SHARED = ("--out", "--format")  # options of every kind
HELP = f"""\
usage: nocdyn plot [KIND] RESULTS [OPTION]...

Draws the results in the folder RESULTS. KIND: {", ".join(KINDS)}; without it, all that RESULTS
holds; of load cases, those of each.
'nocdyn plot KIND --help' tells the options of a kind; --out DIR and --format KINDS are options of all.
'nocdyn plot {PAPER}' computes and draws figures 2 to 5 of the paper."""


def main(words: Sequence[str]) -> int:
    try:
        sys.argv = ["nocdyn plot"]
        return _plot(words)
    except ResultsError as error:
        print(f"{sys.argv[0]}: {error}", file=sys.stderr)
        return error.code
    except (AttributeError, IndexError, KeyError, TypeError) as error:  # of files of JSON that lack what is inside
        place = error.__traceback__
        while place.tb_next:
            place = place.tb_next
        where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}"
        what = f"what was read lacks {error}" if isinstance(error, KeyError) else f"{type(error).__name__}: {error}"
        print(f"{sys.argv[0]}: these results cannot be drawn ({what}, {where}); compute them again", file=sys.stderr)
        return FILES


def _plot(words: Sequence[str]) -> int:
    if not words or words[0] in ("--help", "-h"):
        print(HELP)
        return 0 if words else USAGE
    if words[0] == PAPER:
        return _draw("paper_cases", PAPER, words[1:])
    if words[0] in KINDS:
        return _draw_each(words[0], words[1:])
    operands = _operands(words)
    if len(operands) > 1 and not Path(operands[0]).exists():
        raise ChoiceError(f"'{operands[0]}' is no kind of results; there are: {', '.join(KINDS)}, {PAPER}")
    kinds = kinds_in(Path(operands[0] if operands else ""))
    others = [word for word in words if word.startswith("--") and word.split("=")[0] not in SHARED]
    if len(kinds) > 1 and others:
        ways = ", ".join(f"nocdyn plot {kind}" for kind in kinds)
        print(f"nocdyn plot: {others[0]} is for one kind of results, and there are several: {ways}", file=sys.stderr)
        return USAGE
    for kind in kinds or ["run"]:  # which tells what is missing
        _draw_each(kind, words)
    return 0


def kinds_in(folder: Path) -> list[str]:
    return [kind for kind in KINDS if places_of(kind, folder)]


def places_of(kind: str, folder: Path) -> list[Path]:
    """Where the results of a kind are: in a folder, else in those of its load cases."""
    if any(folder.glob(KINDS[kind][1])):
        return [folder]
    cases = ResultFiles(folder).there(kind) if kind in MAIN_FILES else []
    return [case.folder for case in cases if case.name]  # a sweep has a summary.json too


def _draw_each(kind: str, words: Sequence[str]) -> int:
    """Once, or for each load case in the folders among the words."""
    sys.argv = [f"nocdyn plot {kind}"]
    folders = [at for at, word in enumerate(words) if Path(word).is_dir() and "--out" not in words[max(at - 1, 0) : at]]
    places = [place for at in folders for place in places_of(kind, Path(words[at])) or [Path(words[at])]]
    if places == [Path(words[at]) for at in folders]:
        return _draw(KINDS[kind][0], kind, words)
    options = [word for at, word in enumerate(words) if at not in folders]
    if len(places) > 1 and any(word.split("=")[0] == "--out" for word in options):
        raise ChoiceError(f"--out is for one folder of results; there are: {', '.join(map(str, places))}")
    for place in places:
        _draw(KINDS[kind][0], kind, [str(place), *options])
    return 0


def _operands(words: Sequence[str]) -> list[str]:
    """Those under the options that every kind has."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for option in SHARED:
        parser.add_argument(option)
    rest = parser.parse_known_args(words)[1]
    return [word for word in rest if not word.startswith("-")]


def _draw(module: str, kind: str, words: Sequence[str]) -> int:
    sys.argv = [f"nocdyn plot {kind}", *words]
    importlib.import_module(f"nocdyn_report.{module}").main()
    return 0
