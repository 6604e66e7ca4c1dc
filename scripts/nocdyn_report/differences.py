"""Compares the trajectories of two programs, for instance of two compilers."""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

# Of the largest value in a column: a hundred times what the shipped inputs ask of a step, as in the tests of the examples.
ACCURACY = 1e-7


def trajectories(program: Path, file: Path, folder: Path) -> list[pd.DataFrame]:
    """Of a file, or of each of its load cases."""
    subprocess.run([program, "run", "--quiet", "--out", folder, file], check=True)
    return [pd.read_csv(path) for path in sorted(folder.rglob("trajectory.csv"))]


def largest_difference(one: pd.DataFrame, other: pd.DataFrame) -> tuple[float, str]:
    """Relative to the largest value in its column, and the column; that of the energy balance relative to the energies."""
    if list(one.columns) != list(other.columns) or len(one) != len(other):
        return np.inf, "rows and columns"
    scale = one.abs().max()
    energies = [column for column in one.columns if column.endswith("[J]")]
    scale["energy_residual [J]"] = scale[energies].max()
    differences = (one - other).abs().max(skipna=False) / scale.where(scale > 0.0, 1.0)
    return (np.inf, "numbers that are not finite") if differences.isna().any() else (differences.max(), differences.idxmax())


def main() -> None:
    parser = argparse.ArgumentParser(prog="differences", description=__doc__)
    parser.add_argument("--exactly", action="store_true", help="allow no difference")
    parser.add_argument("programs", nargs=2, type=Path, metavar="NOCDYN", help="the two programs")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="input files")
    arguments = parser.parse_args()
    programs = [program.resolve() for program in arguments.programs]
    allowed = 0.0 if arguments.exactly else ACCURACY
    different = 0
    with tempfile.TemporaryDirectory() as folder:
        for file in arguments.files:
            pairs = zip(*(trajectories(programs[i], file, Path(folder) / str(i) / file.stem) for i in range(2)), strict=True)
            difference, column = max(largest_difference(one, other) for one, other in pairs)
            different += difference > allowed
            print(f"{file.stem:24} " + ("same numbers" if difference == 0.0 else f"differs by {difference:.1e} in {column}"))
    if different:
        sys.exit(f"{different} of {len(arguments.files)} results differ by more than {allowed:g}")


if __name__ == "__main__":
    main()
