"""The results of `nocdyn run`, read from their folder."""

import json
import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import f90nml
import numpy as np
import pandas as pd

from .trajectory_files import ResultsError, labels_of, read_columns

COLUMN = re.compile(
    r"(?P<quantity>phi|omega|twist|moment|damping|shaft|torque|throttle|current|reaction)_(?P<element>.+) "
    r"\[(?P<unit>[^]]+)\]"
)
TIME = "t [s]"
FILES = ("trajectory.csv", "trajectory.nc", "trajectory.partial.csv", "trajectory.partial.nc")
RPM = {"rad/s": 30.0 / math.pi, "Hz": 60.0}


@dataclass(frozen=True)
class Column:
    """A quantity over time: of one element of the machine, or an energy of all."""

    quantity: str
    element: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Header:
    """The columns of a trajectory, before their values are read."""

    folder: Path
    labels: list[str]
    ranges: dict[str, float]  # largest less smallest value of the labels, as far as summary.json has them
    machine: f90nml.Namelist  # input.nml

    def of(self, quantity: str) -> list[str]:
        return [label for label in self.labels if quantity_of(label) == quantity]

    def speeds_about(self, twist: str) -> list[str]:
        """Of the bodies of the coupling with this twist."""
        names = {body.lower() for body in bodies_of(self.machine, COLUMN.fullmatch(twist)["element"])}
        return [label for label in self.of("omega") if COLUMN.fullmatch(label)["element"].lower() in names]


@dataclass(frozen=True)
class Results:
    folder: Path
    header: Header
    table: pd.DataFrame  # labels of trajectory.csv, all or those that were asked for
    shortfall: str  # why the trajectory ends early, '' if it is complete
    rpm: bool = False  # whether columns give speeds in rpm, whatever the file has

    @property
    def time(self) -> np.ndarray:
        return self.table[TIME].to_numpy()

    @property
    def title(self) -> str:
        return self.header.machine.get("case", {}).get("title") or self.folder.resolve().name

    def values(self, label: str) -> np.ndarray:
        """A column by its label in trajectory.csv."""
        if label not in self.table:
            raise ResultsError(f"{self.folder}: the trajectory has no column '{label}'")
        return self.table[label].to_numpy()

    def column(self, label: str) -> Column:
        match = COLUMN.fullmatch(label)
        unit = label.rsplit(" [", 1)[-1].removesuffix("]")
        others = "residual" if "residual" in label else "energy"
        quantity, element = (match["quantity"], match["element"]) if match else (others, name_of(label))
        if self.rpm and quantity == "omega" and unit in RPM:
            return Column(quantity, element, "rpm", self.values(label) * RPM[unit])
        return Column(quantity, element, unit, self.values(label))

    def columns(self, quantity: str) -> list[Column]:
        """All columns of a quantity ('omega', 'twist', ...), in the order of the file."""
        return [self.column(label) for label in self.table if quantity_of(label) == quantity]

    def speed(self, body: str) -> Column | None:
        """The speed of a body by its name in any case; None if the trajectory does not have it."""
        labels = (label for label in self.table if quantity_of(label) == "omega")
        return next((self.column(label) for label in labels if name_of(label).lower() == f"omega_{body.lower()}"), None)

    def between(self, start: float, end: float) -> "Results":
        """The rows from one time to another."""
        inside = self.table[(self.time >= start) & (self.time <= end)]
        if len(inside) < 2:
            raise ResultsError(
                f"{self.folder}: nothing to draw: {len(inside)} row(s) in the chosen time; "
                f"the trajectory goes from {self.time[0]:g} to {self.time[-1]:g} s"
            )
        return replace(self, table=inside)

    def groups(self, kind: str) -> list[f90nml.Namelist]:
        """All groups of a kind ('body', 'coupling', ...) of the input."""
        return groups_of(self.header.machine, kind)

    def twist_rate(self, coupling: str) -> Column | None:
        """Speed of the second body of a coupling less that of its first; None if the trajectory has not both."""
        bodies = bodies_of(self.header.machine, coupling)
        speeds = {body: self.speed(body) for body in bodies if body.lower() != "ground"}
        if None in speeds.values():
            return None
        first, second = (speeds[body].values if body in speeds else 0.0 for body in bodies)
        return Column("", coupling, next(iter(speeds.values())).unit, second - first)


def name_of(label: str) -> str:
    """The name without the unit."""
    return label.rsplit(" [", 1)[0]


def quantity_of(label: str) -> str:
    match = COLUMN.fullmatch(label)
    return match["quantity"] if match else ""


def groups_of(machine: f90nml.Namelist, kind: str) -> list[f90nml.Namelist]:
    groups = machine.get(kind, [])
    return groups if isinstance(groups, list) else [groups]


def bodies_of(machine: f90nml.Namelist, coupling: str) -> list[str]:
    couplings = groups_of(machine, "coupling")
    return next((group["bodies"] for group in couplings if group["name"].lower() == coupling.lower()), [])


def read_results(folder: Path, choose: Callable[[Header], Iterable[str]] | None = None, rpm: bool = False) -> Results:
    """The results in a folder; of a run that failed, what it has. `choose` gives the labels that are needed besides the time."""
    if not folder.is_dir():
        raise ResultsError(f"{folder}: there is no such results folder")
    file = next((folder / name for name in FILES if (folder / name).is_file()), None)
    if file is None:
        raise ResultsError(f"{folder}: no trajectory.csv here; is this the results folder of a 'nocdyn run'?")
    labels = labels_of(file)
    if TIME not in labels:
        raise ResultsError(f"{file}: not a trajectory of nocdyn: there is no column '{TIME}'")
    summary, machine = _read_summary(folder), folder / "input.nml"
    header = Header(folder, labels, _ranges(summary), f90nml.read(machine) if machine.is_file() else f90nml.Namelist())
    table = read_columns(file, {TIME, *choose(header)} if choose else set(labels))
    if len(table) < 2:
        raise ResultsError(f"{file}: nothing to draw: the trajectory has {len(table)} row(s)")
    if not machine.is_file():
        raise ResultsError(f"{machine}: missing; the figures need the input of the run beside its trajectory")
    return Results(folder, header, table, _shortfall(summary, table) if ".partial" in file.suffixes else "", rpm)


def _ranges(summary: dict) -> dict[str, float]:
    columns = summary.get("columns", {})
    return {label: column["max"] - column["min"] for label, column in columns.items() if "max" in column}


def _read_summary(folder: Path) -> dict:
    try:
        return json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def _shortfall(summary: dict, table: pd.DataFrame) -> str:
    remark = f"ends at t = {table[TIME].iloc[-1]:.6g} s"
    return f"{summary['status']}, {remark}" if "status" in summary else remark
