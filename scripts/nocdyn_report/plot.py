"""nocdyn plot: draws what a folder of results holds."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

from .failure import USAGE, ResultsError

# Kind of results -> the module that draws it, the names of its files.
KINDS = {
    "run": ("run_figures", "trajectory.*"),
    "modes": ("mode_figures", "modes.json"),
    "campbell": ("campbell_figures", "campbell.json"),
    "response": ("response_figures", "response.json"),
    "transit": ("transit_figures", "transit*.json"),
    "sweep": ("sweep_figures", "sweep.nc"),
}
PAPER = "paper"
SHARED = ("--out", "--format")  # options of every kind
HELP = f"""\
usage: nocdyn plot [KIND] RESULTS [OPTION]...

Draws the results in the folder RESULTS. KIND: {", ".join(KINDS)}; without it, all that RESULTS holds.
'nocdyn plot KIND --help' tells the options of a kind; --out DIR and --format KINDS are options of all.
'nocdyn plot {PAPER}' computes and draws figures 2 to 5 of the paper."""


def main(words: Sequence[str]) -> int:
    try:
        return _plot(words)
    except ResultsError as error:
        print(f"{sys.argv[0]}: {error}", file=sys.stderr)
        return error.code


def _plot(words: Sequence[str]) -> int:
    if not words or words[0] in ("--help", "-h"):
        print(HELP)
        return 0 if words else USAGE
    if words[0] == PAPER:
        return _draw("paper_cases", PAPER, words[1:])
    if words[0] in KINDS:
        return _draw(KINDS[words[0]][0], words[0], words[1:])
    kinds = kinds_in(Path(_folder(words)))
    others = [word for word in words if word.startswith("--") and word.split("=")[0] not in SHARED]
    if len(kinds) > 1 and others:
        ways = ", ".join(f"nocdyn plot {kind}" for kind in kinds)
        print(f"nocdyn plot: {others[0]} is for one kind of results, and there are several: {ways}", file=sys.stderr)
        return USAGE
    for kind in kinds or ["run"]:  # which tells what is missing
        _draw(KINDS[kind][0], kind, words)
    return 0


def kinds_in(folder: Path) -> list[str]:
    return [kind for kind, (_, pattern) in KINDS.items() if any(folder.glob(pattern))]


def _folder(words: Sequence[str]) -> str:
    """The first operand that is one under the options that every kind has."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for option in SHARED:
        parser.add_argument(option)
    rest = parser.parse_known_args(words)[1]
    return next((word for word in rest if not word.startswith("-")), "")


def _draw(module: str, kind: str, words: Sequence[str]) -> int:
    sys.argv = [f"nocdyn plot {kind}", *words]
    importlib.import_module(f"nocdyn_report.{module}").main()
    return 0
