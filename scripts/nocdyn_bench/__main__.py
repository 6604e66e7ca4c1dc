"""Measures nocdyn beside other software that computes the same."""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from .measure import measure
from .report import markdown, write_report
from .workloads import ROOT, WORKLOADS


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/bench", description=__doc__)
    parser.add_argument("workloads", nargs="*", metavar="WORKLOAD", help=f"{', '.join(WORKLOADS)} (all of them)")
    parser.add_argument("--rounds", type=int, default=15, help="how often each contestant runs (%(default)s)")
    parser.add_argument("--nocdyn", type=Path, default=ROOT / "build" / "release" / "bin" / "nocdyn", metavar="PROGRAM",
                        help="the program to measure (%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "bench", metavar="DIR",
                        help="where bench.md and bench.json go (%(default)s)")
    arguments = parser.parse_args()
    names = arguments.workloads or list(WORKLOADS)
    unknown = [name for name in names if name not in WORKLOADS]
    if unknown:
        parser.error(f"there is no workload '{unknown[0]}'; there are {', '.join(WORKLOADS)}")
    if arguments.rounds < 1:
        parser.error("--rounds must be at least 1")

    measured = []
    with tempfile.TemporaryDirectory() as scratch:
        try:
            for name in names:
                measured.append(WORKLOADS[name](arguments.nocdyn, Path(scratch)))
                measure(measured[-1], arguments.rounds)
                print(markdown(measured[-1]), end="\n\n", flush=True)
        except (OSError, subprocess.CalledProcessError) as error:
            sys.exit(f"{parser.prog}: {error}")
        write_report(measured, arguments.out)
    print(f"bench.md and bench.json are in {arguments.out}")


if __name__ == "__main__":
    main()
