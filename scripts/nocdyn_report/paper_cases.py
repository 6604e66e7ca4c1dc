"""Computes the paper's two cases and draws its figures 2 to 5."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

from . import paper_figures, paper_numbers
from .style import add_format_option

CASES = ("case1", "case2")
INPUTS = Path(__file__).resolve().parents[2] / "input/paper"  # of the sources, or of what is installed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results"), metavar="DIR", help="write to DIR (%(default)s)")
    add_format_option(parser)
    arguments = parser.parse_args()
    program = os.environ.get("NOCDYN", "nocdyn")
    inputs = [INPUTS / f"{name}.nml" for name in CASES]
    done = subprocess.run([program, "run", "--quiet", "--out", arguments.out, *inputs], check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)
    folders = [str(arguments.out / name) for name in CASES]
    options = ["--out", str(arguments.out / "figures"), "--format", ",".join(arguments.format)]
    for module, words in ((paper_figures, options), (paper_numbers, [])):
        sys.argv = [sys.argv[0], *folders, *words]
        module.main()
