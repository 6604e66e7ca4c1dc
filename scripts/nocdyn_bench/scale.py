"""Time and memory for machines of growing size: what a step costs for each body, and reading, checking and setting up."""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RTOL, ATOL = 1e-6, 1e-8
METHODS = ("rk45", "rk853", "auto", "rodas4", "rodas5p")
SIZES = (1000, 2000, 4000, 8000)

# Runs a command and prints its largest memory [KiB]; a small process of its own, since a child begins with its parent's.
WITH_MEMORY = """
import resource, subprocess, sys
code = subprocess.run(sys.argv[1:]).returncode
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
sys.exit(code)
"""


def _body(name: str) -> str:
    return f"&body name = '{name}' inertia = 1.0 /"


def _coupling(i: int, bodies: tuple[str, str], law: str = "") -> str:
    return f"&coupling name = 'c{i}' bodies = '{bodies[0]}', '{bodies[1]}' stiffness = 1e4 damping = 1.0 {law} /"


def _gear(i: int, bodies: tuple[str, str]) -> str:
    return f"&gear name = 'g{i}' bodies = '{bodies[0]}', '{bodies[1]}' teeth = {20 + i % 3}, {21 - i % 2} /"


def _driven(first: str, last: str) -> list[str]:
    return [
        f"&motor name = 'drive' body = '{first}' a = 100.0 b = 0.0 c = 0.0 /",
        f"&load name = 'work' body = '{last}' viscous = 10.0 /",
    ]


def chain(n: int, law: str = "") -> list[str]:
    return [
        *(_body(f"b{i}") for i in range(n)),
        *(_coupling(i, (f"b{i}", f"b{i + 1}"), law) for i in range(n - 1)),
        *_driven("b0", f"b{n - 1}"),
    ]


def train(n: int) -> list[str]:
    return [*(_body(f"b{i}") for i in range(n)), *(_gear(i, (f"b{i}", f"b{i + 1}")) for i in range(n - 1)), *_driven("b0", "b0")]


def pairs(n: int) -> list[str]:
    names = [(f"a{i}", f"b{i}") for i in range(n // 2)]
    return [
        *(_body(name) for pair in names for name in pair),
        *(_gear(i, pair) for i, pair in enumerate(names)),
        *(_coupling(i, (f"b{i}", f"a{i + 1}")) for i in range(n // 2 - 1)),
        *_driven("a0", names[-1][1]),
    ]


@dataclass(frozen=True)
class Kind:
    title: str
    lines: Callable[[int], list[str]]
    t_end: float


KINDS = {
    "chain": Kind("bodies in a row, joined by couplings", chain, 0.2),
    "gaps": Kind("the same with gaps in the couplings", lambda n: chain(n, "gap = 0.001"), 0.2),
    "train": Kind("wheels in one rigid train", train, 1.0),
    "pairs": Kind("geared pairs, joined by couplings", pairs, 0.2),
}


def run(nocdyn: Path, kind: Kind, n: int, method: str, folder: Path, rounds: int) -> tuple[dict, float, float]:
    """The counts, the shortest time of the integration [s] and the largest memory [MB]."""
    file = folder / "machine.nml"
    file.write_text(
        "\n".join(
            [
                *kind.lines(n),
                f"&run t_end = {kind.t_end} method = '{method}' rtol = {RTOL} atol = {ATOL} /",
                "&output points = 2 /",
            ]
        )
        + "\n"
    )
    times, memory = [], []
    for _ in range(rounds):
        process = [sys.executable, "-c", WITH_MEMORY, nocdyn, "run", "--quiet", "--out", folder / "out", file]
        output = subprocess.run(process, check=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True).stdout
        summary = json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))
        times.append(summary["wall_time_s"])
        memory.append(int(output) / 1024)
    return summary["counts"], min(times), max(memory)


def row(nocdyn: Path, name: str, method: str, sizes: list[int], folder: Path, rounds: int) -> str:
    cells = []
    for n in sizes:
        counts, seconds, megabytes = run(nocdyn, KINDS[name], n, method, folder, rounds)
        attempts = counts["accepted_steps"] + counts["rejected_steps"]
        cells.append(f"{1e6 * seconds / attempts / n:.2f} ({attempts}, {megabytes:.0f})")
    return f"| {name} | {method} | " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/scale", description=__doc__)
    parser.add_argument(
        "kinds",
        nargs="*",
        metavar="KIND",
        help="; ".join(f"{name}: {kind.title}" for name, kind in KINDS.items()) + " (all of them)",
    )
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS, metavar="METHOD", help="(%(default)s)")
    parser.add_argument("--sizes", nargs="+", type=int, default=SIZES, metavar="N", help="numbers of bodies (%(default)s)")
    parser.add_argument("--rounds", type=int, default=3, metavar="N", help="of which the shortest time counts (%(default)s)")
    parser.add_argument(
        "--nocdyn",
        type=Path,
        default=ROOT / "build" / "release" / "bin" / "nocdyn",
        metavar="PATH",
        help="the program (%(default)s)",
    )
    arguments = parser.parse_args()
    unknown = [name for name in arguments.kinds if name not in KINDS]
    if unknown:
        parser.error(f"there is no kind '{unknown[0]}'; there are {', '.join(KINDS)}")
    if min(arguments.sizes) < 4 or arguments.rounds < 1:
        parser.error("--sizes must be at least 4, --rounds at least 1")
    print(f"Time in us for a step and body (steps, memory in MB) at rtol {RTOL:g}, atol {ATOL:g}\n")
    print("| machine | method | " + " | ".join(f"{n}" for n in arguments.sizes) + " |")
    print("| --- | --- |" + " ---: |" * len(arguments.sizes), flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.kinds or KINDS:
            for method in arguments.methods:
                try:
                    print(row(arguments.nocdyn, name, method, arguments.sizes, Path(folder), arguments.rounds), flush=True)
                except (OSError, subprocess.CalledProcessError) as error:
                    sys.exit(f"{parser.prog}: {error}")


if __name__ == "__main__":
    main()
