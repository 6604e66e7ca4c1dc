"""The results of `nocdyn run`, read from their folder."""

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import f90nml
import numpy as np
import pandas as pd

from .columns import COLUMNS, Column, read_column_list
from .failure import ChoiceError, ResultsError
from .json_files import with_case
from .trajectory_files import labels_of, need_folder, need_whole, read_columns

TIME = "t [s]"
FILES = ("trajectory.csv", "trajectory.nc", "trajectory.partial.csv", "trajectory.partial.nc")
RPM = {"rad/s": 30.0 / math.pi, "Hz": 60.0}


@dataclass(frozen=True)
class Series:
    """The values of a column over time."""

    name: str  # in a legend
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Header:
    """The columns of a trajectory, before their values are read."""

    folder: Path
    columns: dict[str, Column]  # by their labels, all but the time
    ranges: dict[str, float] = field(default_factory=dict)  # largest less smallest value, as far as summary.json has them
    machine: f90nml.Namelist = field(default_factory=f90nml.Namelist)  # input.nml
    case: str = ""  # load case

    def of(self, *kinds: str) -> list[str]:
        """Labels."""
        return [label for label, column in self.columns.items() if column.kind in kinds]

    def speeds_about(self, twist: str) -> list[str]:
        """Of the bodies of the coupling or shaft with this twist."""
        names = {body.lower() for body in bodies_of(self.machine, self.columns[twist])}
        return [label for label in self.of("omega") if self.columns[label].title.lower() in names]


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
        return with_case(self.header.machine.get("case", {}).get("title") or self.folder.resolve().name, self.header.case)

    def values(self, label: str) -> np.ndarray:
        """A column by its label in trajectory.csv."""
        if label not in self.table:
            raise ResultsError(f"{self.folder}: the trajectory has no column '{label}'")
        return self.table[label].to_numpy()

    def series(self, label: str) -> Series:
        column = self.header.columns[label]
        if self.rpm and column.unit in RPM:
            return Series(column.title, "rpm", self.values(label) * RPM[column.unit])
        return Series(column.title, column.unit, self.values(label))

    def columns(self, *kinds: str) -> list[Column]:
        """Those that were read of some kinds ('omega', 'twist', ...), in the order of the file."""
        return [self.header.columns[label] for label in self.header.of(*kinds) if label in self.table]

    def speed(self, body: str) -> Series | None:
        """The speed of a body by its name in any case; None if the trajectory does not have it."""
        found = (one.label for one in self.columns("omega") if one.title.lower() == body.lower())
        label = next(found, None)
        return None if label is None else self.series(label)

    def between(self, start: float, end: float) -> "Results":
        """The rows from one time to another."""
        inside = self.table[(self.time >= start) & (self.time <= end)]
        if len(inside) < 2:
            raise ChoiceError(
                f"{self.folder}: nothing to draw: {len(inside)} row(s) in the chosen time; "
                f"the trajectory goes from {self.time[0]:g} to {self.time[-1]:g} s"
            )
        return replace(self, table=inside)

    def groups(self, kind: str) -> list[f90nml.Namelist]:
        """All groups of a kind ('body', 'coupling', ...) of the input."""
        return groups_of(self.header.machine, kind)

    def twist_rate(self, twist: Column) -> Series | None:
        """Speed of the second body of a coupling or shaft less that of its first; None if the trajectory has not both."""
        bodies = bodies_of(self.header.machine, twist)
        speeds = {body: self.speed(body) for body in bodies if body.lower() != "ground"}
        if not speeds or None in speeds.values():
            return None
        first, second = (speeds[body].values if body in speeds else 0.0 for body in bodies)
        return Series(twist.title, next(iter(speeds.values())).unit, second - first)


def groups_of(machine: f90nml.Namelist, kind: str) -> list[f90nml.Namelist]:
    groups = machine.get(kind, [])
    return groups if isinstance(groups, list) else [groups]


def bodies_of(machine: f90nml.Namelist, column: Column) -> list[str]:
    """Those that the element of a column joins."""
    groups = groups_of(machine, column.element_kind)
    return next((group["bodies"] for group in groups if group["name"].lower() == column.element.lower()), [])


def read_results(folder: Path, choose: Callable[[Header], Iterable[str]] | None = None, rpm: bool = False) -> Results:
    """The results in a folder; of a run that failed, what it has. `choose` gives the labels that are needed besides the time."""
    need_folder(folder)
    file = trajectory_in(folder)
    if file is None:
        raise ResultsError(f"{folder}: no trajectory.csv here; {_elsewhere(folder)}")
    need_whole(file)
    labels = labels_of(file)
    if TIME not in labels:
        raise ResultsError(f"{file}: not a trajectory of nocdyn: there is no column '{TIME}'")
    summary, machine = _read_summary(folder), folder / "input.nml"
    groups = f90nml.read(machine) if machine.is_file() else f90nml.Namelist()
    header = Header(folder, _columns(folder, labels), ranges_of(summary), groups, summary.get("load_case", ""))
    table = read_columns(file, {TIME, *choose(header)} if choose else set(labels))
    if len(table) < 2:
        raise ResultsError(f"{file}: nothing to draw: the trajectory has {len(table)} row(s)")
    if not machine.is_file():
        raise ResultsError(f"{machine}: missing; the figures need the input of the run beside its trajectory")
    return Results(folder, header, table, _shortfall(summary, table) if ".partial" in file.suffixes else "", rpm)


def trajectory_in(folder: Path) -> Path | None:
    """The trajectory of a run, also of one that failed."""
    return next((folder / name for name in FILES if (folder / name).is_file()), None)


def _elsewhere(folder: Path) -> str:
    """Where trajectories are, as those of load cases, which have a folder each."""
    cases = sorted(str(one) for one in folder.iterdir() if trajectory_in(one))
    return f"draw one of its load cases: {', '.join(cases)}" if cases else "is this the results folder of a 'nocdyn run'?"


def _columns(folder: Path, labels: list[str]) -> dict[str, Column]:
    known = {column.label: column for column in read_column_list(folder)}
    for label in labels:
        if label not in known:
            raise ResultsError(f"{folder / COLUMNS}: has no column '{label}'; it must be of the same run as the trajectory")
    return {label: known[label] for label in labels if label != TIME}


def ranges_of(summary: dict) -> dict[str, float]:
    """Largest less smallest value of columns, as far as summary.json has them."""
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
