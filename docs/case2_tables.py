"""Prints, in Markdown, what the methods do with the paper's second case: one table over damping, one over tolerances.

usage: case2_tables.py NOCDYN
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

INPUT = Path(__file__).resolve().parents[1] / "input" / "paper" / "case2.nml"
METHODS = ["rk45", "rk853", "rodas4", "rodas5p", "auto"]
SPEED, MOMENT = 3.13779610486375, -135.130778740050  # at t = 10 s: of the motor [rad/s], in the coupling [N m]


def run(nocdyn, **settings):
    """Counts, summary and last row of a run."""
    with tempfile.TemporaryDirectory() as folder:
        words = [word for path, value in settings.items() for word in ("--set", f"{path.replace('__', '.')}={value}")]
        subprocess.run([nocdyn, "run", INPUT, "--quiet", "--out", folder, *words], check=True)
        with open(Path(folder) / "trajectory.csv", encoding="utf-8") as file:
            last = list(csv.DictReader(file))[-1]
        return json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))["counts"], last


def print_table(head, rows):
    for cells in (head, ["---", *["---:"] * (len(head) - 1)], *rows):
        print(f"| {' | '.join(map(str, cells))} |")
    print()


def damping_rows(nocdyn):
    for damping in ("1e2", "1e4", "1e6"):
        row = [damping]
        for method in METHODS:
            counts, _ = run(
                nocdyn,
                run__method=method,
                run__rtol="1e-6",
                run__atol="1e-9",
                run__max_steps=10000000,
                coupling__coupling__damping=damping,
            )
            row.append(counts["accepted_steps"])
        yield row


def tolerance_rows(nocdyn):
    for tolerance in ("1e-3", "1e-6", "1e-9", "1e-12"):
        for method in METHODS:
            counts, last = run(nocdyn, run__method=method, run__rtol=tolerance, run__atol=tolerance)
            yield [
                tolerance,
                f"`{method}`",
                f"{counts['accepted_steps']} / {counts['rejected_steps']}",
                counts["evaluations"],
                f"{float(last['omega_motor [rad/s]']) - SPEED:.1e}",
                f"{float(last['moment_coupling [N m]']) - MOMENT:.1e}",
                f"{float(last['energy_residual [J]']):.1e}",
            ]


def main(nocdyn):
    print_table(["damping [N m s/rad]", *(f"`{method}`" for method in METHODS)], damping_rows(nocdyn))
    print_table(
        [
            "`rtol`, `atol`",
            "method",
            "accepted / rejected",
            "evaluations",
            "error of the speed [rad/s]",
            "error of the moment [N m]",
            "`energy_residual` [J]",
        ],
        tolerance_rows(nocdyn),
    )


if __name__ == "__main__":
    main(sys.argv[1])
