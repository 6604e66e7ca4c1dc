"""The results of `nocdyn orbit`, read from their folder."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from .columns import LOADS, Column, read_column_list
from .failure import ChoiceError, ResultsError
from .json_files import read_json, with_case
from .results import RPM, TIME
from .trajectory_files import labels_of, need_folder, need_whole, read_columns

REPORT, TABLE, COLUMNS, HARMONICS = "orbit.json", "orbit.csv", "orbit_columns.json", "orbit_harmonics.csv"
HALF_RANGE = "half_range"
JUMPS = {"fold": "fold", "period_doubling": "period doubling", "neimark_sacker": "Neimark-Sacker point"} | {
    "branch_point": "branch point",
    "torque_fold": "holding torque turns back",
}
KEYS = ("parameter", "unit", "range", "special_points", "parts", "peaks", "points")


@dataclass(frozen=True)
class Special:
    """A special point of a branch."""

    kind: str
    row: int  # in orbit.csv
    value: float  # of the parameter, in the unit of the axis
    lands_on: tuple[dict[str, float], ...]  # half ranges of the stable motions there, by names of signals, in SI units

    @property
    def name(self) -> str:
        return JUMPS.get(self.kind, self.kind.replace("_", " "))


@dataclass(frozen=True)
class Stretch:
    """Rows of one branch with one stability."""

    branch: int
    is_stable: bool
    rows: np.ndarray


@dataclass(frozen=True)
class Motion:
    """A motion over one period: its entry in orbit.json, and its file."""

    entry: dict
    value: float  # of the parameter, in the unit of the axis
    table: pd.DataFrame

    @property
    def name(self) -> str:
        words = {True: ", stable", False: ", unstable"}
        return f"branch {self.entry['branch']}{words.get(self.entry.get('stable'), '')}"

    @property
    def time(self) -> np.ndarray:
        return self.table[TIME].to_numpy()

    def wave(self, label: str) -> np.ndarray:
        """A column without its mean rotation; the first row is the last one too."""
        values = self.table[label].to_numpy()
        return values - (values[-1] - values[0]) * self.time / self.time[-1]

    def rate(self, label: str) -> np.ndarray:
        """Its derivative by the time: exact for the harmonics that the rows have."""
        values = self.wave(label)[:-1]
        order = np.fft.rfftfreq(len(values), 1.0 / len(values))
        spectrum = np.fft.rfft(values) * (2j * math.pi / self.time[-1]) * order
        if len(values) % 2 == 0:
            spectrum[-1] = 0.0
        rate = np.fft.irfft(spectrum, len(values))
        return np.append(rate, rate[0])


@dataclass(frozen=True)
class Orbits:
    folder: Path
    report: dict  # orbit.json
    table: pd.DataFrame  # orbit.csv
    columns: list[Column]  # of half ranges

    @property
    def title(self) -> str:
        return with_case(self.report.get("title") or Path(self.report.get("input") or self.folder.resolve()).stem, self.case)

    @property
    def case(self) -> str:
        return self.report.get("load_case", "")

    @property
    def is_speed(self) -> bool:
        """Whether the parameter is a mean speed, which is shown in rpm."""
        return self.report["parameter"].startswith("mean_speed_")

    @property
    def factor(self) -> float:
        """From the unit of the files to that of the axis."""
        return RPM["rad/s"] if self.is_speed else 1.0

    @property
    def unit(self) -> str:
        return "rpm" if self.is_speed else self.report["unit"]

    @property
    def parameter(self) -> str:
        return self.report["parameter"]

    @property
    def axis_name(self) -> str:
        return f"mean speed of {self.parameter.removeprefix('mean_speed_')}" if self.is_speed else self.parameter

    @property
    def axis_label(self) -> str:
        return f"{self.axis_name} [{self.unit}]" if self.unit else self.axis_name

    @property
    def window(self) -> tuple[float, float]:
        """The range of the parameter, on the axis."""
        low, high = sorted(self.factor * one for one in self.report["range"])
        return low, high

    @cached_property
    def value(self) -> np.ndarray:
        """Of the parameter, of all points, on the axis."""
        label = f"{self.parameter} [{self.report['unit']}]" if self.report["unit"] else self.parameter
        return self.factor * self.table[label].to_numpy()

    @property
    def has_stability(self) -> bool:
        return "stable" in self.table

    @property
    def branches(self) -> list[int]:
        return sorted({int(one) for one in self.table["branch"]})

    @cached_property
    def stretches(self) -> list[Stretch]:
        """Curves from special point to special point: each begins where the one before ends."""
        found: list[Stretch] = []
        branch, special = self.table["branch"].to_numpy().astype(int), self.table["special"].to_numpy()
        stable = self.table["stable"].to_numpy() == 1 if self.has_stability else np.ones(len(branch), bool)
        begin = 0
        for row in range(1, len(branch) + 1):
            if row < len(branch) and branch[row] == branch[begin] and (special[row] == 0 or row == begin):
                continue
            is_end = row == len(branch) or branch[row] != branch[begin]
            rows = np.arange(begin, row if is_end else row + 1)
            inner = rows[special[rows] == 0]
            found.append(Stretch(branch[begin], bool(stable[inner if len(inner) else rows].all()), rows))
            begin = row
        return [one for one in found if len(one.rows) > 1]

    @cached_property
    def specials(self) -> list[Special]:
        return [
            Special(
                one["kind"],
                one["point"] - 1,
                self.factor * one["value"],
                tuple(landing["half_ranges"] for landing in one.get("lands_on", ())),
            )
            for one in self.report["special_points"]
        ]

    def half_range(self, column: Column) -> np.ndarray:
        return self.table[column.label].to_numpy()

    def landings(self, special: Special, column: Column) -> list[float]:
        """Half ranges on which a jump from there ends, in the unit of the column; as the table tells this unit."""
        ours = self.half_range(column)[special.row]
        entry = next(one for one in self.report["special_points"] if one["point"] - 1 == special.row)
        own = entry.get("half_ranges", {}).get(column.name)
        return [one[column.name] * (ours / own) for one in special.lands_on if own]

    @cached_property
    def motions(self) -> list[Motion]:
        return list(self._motions())

    def _motions(self) -> Iterator[Motion]:
        for entry in self.report.get("motions", []):
            file = self.folder / entry["file"]
            if not file.is_file():
                raise ResultsError(f"{self.folder}: no {entry['file']} here, which {REPORT} has; compute the results again")
            need_whole(file)
            table = read_columns(file, labels_of(file))
            if TIME not in table or len(table) < 3:
                raise ResultsError(f"{file}: is no complete motion: compute the results again")
            yield Motion(entry, self.factor * entry["value"], table)

    def harmonics(self) -> pd.DataFrame | None:
        """orbit_harmonics.csv, if the input has asked for it."""
        file = self.folder / HARMONICS
        if not file.is_file():
            return None
        need_whole(file)
        table = read_columns(file, labels_of(file))
        if not {"point", "branch", "harmonic"} <= set(table) or table["point"].max() != len(self.table):
            raise ResultsError(f"{file}: its points are not those of {TABLE}; both must be of the same analysis")
        return table

    def loads(self) -> list[Column]:
        """Half ranges of loads; of all signals if there are none."""
        shown = [one for one in self.columns if not one.is_inner]
        return [one for one in shown if one.rank in LOADS] or shown


def read_orbits(folder: Path) -> Orbits:
    need_folder(folder)
    for name in (REPORT, TABLE, COLUMNS):
        if not (folder / name).is_file():
            raise ResultsError(f"{folder}: no {name} here; 'nocdyn orbit FILE --out {folder}' writes it")
    report = read_json(folder / REPORT, KEYS)
    columns = [one for one in read_column_list(folder, COLUMNS) if one.statistic == HALF_RANGE]
    need_whole(folder / TABLE)
    table = read_columns(folder / TABLE, labels_of(folder / TABLE))
    found = Orbits(folder, report, table, columns)
    try:
        needed = ["branch", "special", *(one.label for one in columns)]
        missing = [name for name in needed if name not in table]
        if missing or len(table) != report["points"] or len(found.value) < 1 or table[needed].isna().any(axis=None):
            what = f"there is no column '{missing[0]}'" if missing else "its points are not all there"
            raise ResultsError(f"{folder / TABLE}: {what}; it must be of the same analysis as {REPORT}")
        if any(not 0 <= one.row < len(table) for one in found.specials):
            raise ResultsError(f"{folder / TABLE}: its points are not those of {REPORT}; both must be of the same analysis")
    except (KeyError, TypeError, AttributeError):
        raise ResultsError(f"{folder / REPORT}: this is no {REPORT} of nocdyn") from None
    return found


@dataclass(frozen=True)
class Settled:
    """Points of runs that have settled, to lay over the branches: a table with the parameter and half ranges."""

    file: Path
    value: np.ndarray
    table: pd.DataFrame

    def half_range(self, column: Column) -> np.ndarray | None:
        """By the label of orbit.csv, with or without the unit, or by the name of the signal."""
        for label in self.table:
            if label in (column.label, f"{HALF_RANGE}_{column.name}", column.name, f"{column.name} [{column.unit}]"):
                return self.table[label].to_numpy()
        return None


def read_settled(file: Path, orbits: Orbits) -> Settled:
    """The first column is the parameter, in the unit of orbit.csv unless it is named in rpm."""
    if not file.is_file():
        raise ChoiceError(f"{file}: there is no such table of runs")
    labels = labels_of(file)
    table = read_columns(file, labels)
    if len(labels) < 2:
        raise ResultsError(f"{file}: no table of runs: it needs a column with {orbits.parameter} and one with half ranges")
    factor = 1.0 if labels[0].endswith("[rpm]") else orbits.factor
    found = Settled(file, factor * table[labels[0]].to_numpy(), table[labels[1:]])
    if all(found.half_range(one) is None for one in orbits.columns):
        there = ", ".join(one.label for one in orbits.loads()[:4])
        raise ResultsError(f"{file}: no column is a half range of orbit.csv; needed: one of {there}, ...")
    return found
