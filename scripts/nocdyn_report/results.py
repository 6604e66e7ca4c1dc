"""The results of `nocdyn run`, read from their folder."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

import f90nml
import numpy as np
import pandas as pd

COLUMN = re.compile(
    r"(?P<quantity>phi|omega|twist|moment|damping|torque|throttle|current|reaction)_(?P<element>.+) "
    r"\[(?P<unit>[^]]+)\]"
)
TIME = "t [s]"


class ResultsError(Exception):
    """A folder whose results cannot be used; the message is one line for the person at the keyboard."""


@dataclass(frozen=True)
class Column:
    """A quantity of one element of the machine over time."""

    element: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Results:
    folder: Path
    table: pd.DataFrame  # columns and labels of trajectory.csv
    machine: f90nml.Namelist  # input.nml
    shortfall: str  # why the trajectory ends early, '' if it is complete

    @property
    def time(self) -> np.ndarray:
        return self.table[TIME].to_numpy()

    @property
    def title(self) -> str:
        return self.machine.get("case", {}).get("title") or self.folder.resolve().name

    def values(self, label: str) -> np.ndarray:
        """A column by its label in trajectory.csv."""
        if label not in self.table:
            raise ResultsError(f"{self.folder}: the trajectory has no column '{label}'")
        return self.table[label].to_numpy()

    def columns(self, quantity: str) -> list[Column]:
        """All columns of a quantity ('omega', 'twist', ...), in the order of the file."""
        matches = ((label, COLUMN.fullmatch(label)) for label in self.table)
        return [
            Column(match["element"], match["unit"], self.table[label].to_numpy())
            for label, match in matches
            if match and match["quantity"] == quantity
        ]

    def groups(self, kind: str) -> list[f90nml.Namelist]:
        """All groups of a kind ('body', 'coupling', ...) of the input."""
        groups = self.machine.get(kind, [])
        return groups if isinstance(groups, list) else [groups]

    def twist_rate(self, coupling: str) -> np.ndarray:
        """Speed of the second body of a coupling less that of its first [rad/s]."""
        first, second = next(group["bodies"] for group in self.groups("coupling") if group["name"] == coupling)
        return self._speed(second) - self._speed(first)

    def _speed(self, body: str) -> np.ndarray:
        return np.zeros(len(self.table)) if body.lower() == "ground" else self.values(f"omega_{body} [rad/s]")


def read_results(folder: Path) -> Results:
    """The results in a folder; of a run that failed, what it has."""
    if not folder.is_dir():
        raise ResultsError(f"{folder}: there is no such results folder")
    complete, partial = folder / "trajectory.csv", folder / "trajectory.partial.csv"
    if complete.is_file():
        return Results(folder, _read_table(complete), _read_machine(folder), "")
    if partial.is_file():
        table = _read_table(partial)
        return Results(folder, table, _read_machine(folder), _shortfall(folder, table))
    raise ResultsError(f"{folder}: no trajectory.csv here; is this the results folder of a 'nocdyn run'?")


def _read_table(file: Path) -> pd.DataFrame:
    try:
        table = pd.read_csv(file, dtype=float, index_col=False)
    except (ValueError, OSError) as error:  # pandas' own parser errors are ValueErrors
        raise ResultsError(f"{file}: not a table of numbers: {' '.join(str(error).split())}") from None
    if TIME not in table:
        raise ResultsError(f"{file}: not a trajectory of nocdyn: there is no column '{TIME}'")
    if len(table) < 2:
        raise ResultsError(f"{file}: nothing to draw: the trajectory has {len(table)} row(s)")
    return table


def _read_machine(folder: Path) -> f90nml.Namelist:
    file = folder / "input.nml"
    try:
        return f90nml.read(file)
    except FileNotFoundError:
        raise ResultsError(f"{file}: missing; the figures need the input of the run beside its trajectory") from None


def _shortfall(folder: Path, table: pd.DataFrame) -> str:
    remark = f"ends at t = {table[TIME].iloc[-1]:.6g} s"
    try:
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return remark
    return f"{summary['status']}, {remark}"
