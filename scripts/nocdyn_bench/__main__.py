"""Measures nocdyn beside other software that computes the same."""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from .chains import Scaling
from .costs import Costs
from .figures import draw_scaling, draw_work_precision
from .peer_output import divert_to
from .programs import Programs
from .report import markdown, write_report
from .throughput import Throughput
from .torsional import Torsional
from .whole_process import measure
from .work_precision import WorkPrecision
from .workloads import ROOT, WORKLOADS, Bench, Workload

FULL = np.arange(3.0, 13.1, 0.5)  # decades of the tolerances
QUICK = np.arange(3.0, 13.1, 1.0)
MOST_SWEEPS = 5  # rounds where a contestant takes seconds


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/bench", description=__doc__)
    parser.add_argument("workloads", nargs="*", metavar="WORKLOAD", help=f"{', '.join(WORKLOADS)} (all of them)")
    parser.add_argument("--rounds", type=int, metavar="N", help="how often each contestant takes its turn (15, quick: 3)")
    parser.add_argument("--quick", action="store_true", help="fewer rounds, tolerances and slow peers")
    parser.add_argument(
        "--build",
        type=Path,
        default=ROOT / "build" / "release",
        metavar="DIR",
        help="where the programs were built (%(default)s)",
    )
    parser.add_argument(
        "--plain",
        type=Path,
        default=ROOT / "build" / "plain" / "bench",
        metavar="DIR",
        help="programs for processors with AVX2, whose instructions are counted (%(default)s)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=ROOT / "results" / "bench",
        metavar="DIR",
        help="where bench.md, bench.json, peers.log and the figures go (%(default)s)",
    )
    arguments = parser.parse_args()
    names = arguments.workloads or list(WORKLOADS)
    unknown = [name for name in names if name not in WORKLOADS]
    if unknown:
        parser.error(f"there is no workload '{unknown[0]}'; there are {', '.join(WORKLOADS)}")
    rounds = arguments.rounds if arguments.rounds is not None else 3 if arguments.quick else 15
    if rounds < 1:
        parser.error("--rounds must be at least 1")

    measured = []
    divert_to(arguments.out / "peers.log")
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        bench = Bench(
            arguments.build / "bin" / "nocdyn",
            Programs(arguments.build / "bench", scratch),
            arguments.plain,
            scratch,
            arguments.quick,
        )
        try:
            for name in names:
                measured.append(WORKLOADS[name](bench))
                _measure(measured[-1], rounds, arguments.quick, arguments.out)
                print(markdown(measured[-1]), end="\n\n", flush=True)
        except (OSError, subprocess.CalledProcessError) as error:
            sys.exit(f"{parser.prog}: {error}")
        write_report(measured, arguments.out, arguments.build)
    print(f"bench.md, bench.json and the figures are in {arguments.out}; what the peers printed is in peers.log there")
    disagreements = [sentence for workload in measured if isinstance(workload, Torsional) for sentence in workload.disagreements]
    if disagreements:
        sys.exit("\n".join(f"{parser.prog}: {sentence}" for sentence in disagreements))


def _measure(workload: Workload, rounds: int, is_quick: bool, out: Path) -> None:
    if isinstance(workload, WorkPrecision):
        workload.measure((10.0 ** -(QUICK if is_quick else FULL)).tolist(), rounds)
        draw_work_precision(workload, out)
    elif isinstance(workload, Scaling):
        workload.measure(rounds)
        draw_scaling(workload, out)
    elif isinstance(workload, Torsional):
        workload.measure(rounds)
    elif isinstance(workload, Throughput | Costs):
        workload.measure(min(rounds, MOST_SWEEPS))
    else:
        measure(workload, rounds)


if __name__ == "__main__":
    main()
