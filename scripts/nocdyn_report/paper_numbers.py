"""Prints the end of the paper's cases beside the closed-form uniform motion."""

import argparse
import math
import sys
from pathlib import Path

import numpy as np

from .failure import ResultsError
from .paper_machine import steady_state
from .results import Results, read_results


def last_period(results: Results) -> np.ndarray:
    """The rows within the last period of the excitation; the last row alone without one."""
    frequencies = [group["frequency"] for group in results.groups("excitation") if group["amplitude"] != 0.0]
    period = 2.0 * math.pi / min(frequencies) if frequencies else 0.0
    return results.time >= results.time[-1] - period


def table(results: Results) -> str:
    """A row for each speed, the elastic moment and the tooth force."""
    rows = last_period(results)
    excited = rows.sum() > 1
    lines = [
        results.title,
        f"  {'':24}{f't = {results.time[-1]:g} s':>15}{'uniform motion':>17}"
        + (f"{'range in the last period':>29}" if excited else f"{'difference':>13}"),
    ]
    for label, steady in steady_state(results).values.items():
        values = results.values(label)
        spread = f"{values[rows].min():14.6f} ..{values[rows].max():12.6f}" if excited else f"{values[-1] - steady:13.1e}"
        lines.append(f"  {label:24}{values[-1]:15.8f}{steady:17.8f}{spread}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(prog="nocdyn plot paper", description=__doc__)
    parser.add_argument("results", nargs="+", type=Path, metavar="RESULTS", help="results folder of a case of the paper")
    arguments = parser.parse_args()
    try:
        print("\n\n".join(table(read_results(folder)) for folder in arguments.results))
    except ResultsError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        sys.exit(error.code)


if __name__ == "__main__":
    main()
