"""The results of `nocdyn transit`, read from their folder."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd

from .failure import ResultsError
from .json_files import read_json, with_case
from .results import RPM, TIME
from .speed_results import SPEED, rpm
from .trajectory_files import labels_of, need_folder, read_columns

REPORT, TABLE = "transit.json", "transit.csv"
PASSAGE = "passage"
NEAR = 4.0  # times what is reached: limits beyond are not in the picture
TRANSIENT = "transient"  # the last word of criteria on half ranges


@dataclass(frozen=True)
class Limited:
    """A quantity with a limit, as stress_tail, and what its curve is called."""

    name: str
    unit: str
    element: str  # "shaft 'tail'"
    caption: str  # 'stress'
    largest_limit: float | None  # of its magnitude

    @property
    def label(self) -> str:
        """Of its column in transit.csv."""
        return f"{self.name} [{self.unit}]"


@dataclass(frozen=True)
class Passage:
    """A stay in a range: its entry in transit.json, and its rows in transit.csv."""

    number: int
    entry: dict
    range: dict
    table: pd.DataFrame

    @property
    def ends(self) -> tuple[float, float]:
        """The range [rpm], from the slower to the faster speed."""
        first, last = (rpm(one) for one in self.range["speeds_rad_s"])
        return (first, last) if abs(first) <= abs(last) else (last, first)

    @property
    def time(self) -> np.ndarray:
        return self.table[TIME].to_numpy()

    @property
    def mean_speed(self) -> np.ndarray:
        """[rpm]"""
        return self._speed(2)

    @property
    def speed(self) -> np.ndarray:
        """[rpm]"""
        return self._speed(3)

    def _speed(self, column: int) -> np.ndarray:
        label = self.table.columns[column]
        return self.table[label].to_numpy() * RPM.get(SPEED.search(label)["unit"], 1.0)

    def values(self, quantity: Limited) -> np.ndarray:
        return self.table[quantity.label].to_numpy()

    def peak(self, quantity: Limited) -> dict:
        return next(one for one in self.entry["peaks"] if one["quantity"] == quantity.name)

    def centre(self, quantity: Limited, turns: int) -> float:
        """The middle between the largest and the smallest value in the turn of the half range."""
        time, at = self.time, self.peak(quantity)["half_range_time"]
        half_turn = 0.5 * turns * 60.0 / abs(float(np.interp(at, time, self.mean_speed)))
        inside = self.values(quantity)[np.abs(time - at) <= half_turn]
        return float(inside.max() + inside.min()) / 2


@dataclass(frozen=True)
class Transit:
    folder: Path
    report: dict  # transit.json
    table: pd.DataFrame  # transit.csv

    @property
    def title(self) -> str:
        return with_case(self.report.get("title") or Path(self.report["input"]).stem, self.case)

    @property
    def case(self) -> str:
        return self.report.get("load_case", "")

    @property
    def body(self) -> str:
        return self.report["body"]

    @property
    def turns(self) -> int:
        """Of a mean speed."""
        return self.report["turns_of_mean"]

    @cached_property
    def passages(self) -> list[Passage]:
        ranges, numbers = self.report["ranges"], self.table[PASSAGE].to_numpy()
        entries = enumerate(self.report["passages"], start=1)
        return [Passage(i, one, ranges[one["range"] - 1], self.table[numbers == i]) for i, one in entries]

    @cached_property
    def quantities(self) -> list[Limited]:
        """In the order of the table."""
        peaks = self.report["passages"][0]["peaks"] if self.report["passages"] else []
        return [self._limited(one["quantity"], one["unit"]) for one in peaks]

    def _limited(self, name: str, unit: str) -> Limited:
        lines = [one for one in self.report["verdict"]["lines"] if one.get("quantity") == name]
        element, criterion = (lines[0]["element"], lines[0]["criterion"]) if lines else (name, "")
        limits = [one["limit"] for one in lines if not one["criterion"].endswith(TRANSIENT) and "limit" in one]
        return Limited(name, unit, element, criterion.rpartition(", ")[0] or name, min(limits, default=None))


def read_transit(folder: Path) -> Transit:
    need_folder(folder)
    for name in (REPORT, TABLE):
        if not (folder / name).is_file():
            raise ResultsError(f"{folder}: no {name} here; 'nocdyn transit FILE --out {folder}' writes it")
    report = read_json(folder / REPORT, ["passages"])
    table = read_columns(folder / TABLE, labels_of(folder / TABLE))
    found = Transit(folder, report, table)
    missing = [name for name in (PASSAGE, TIME, *(one.label for one in found.quantities)) if name not in table]
    if missing:
        raise ResultsError(f"{folder / TABLE}: there is no column '{missing[0]}'; it must be of the same run as {REPORT}")
    if report["passages"] and set(table[PASSAGE]) != set(range(1, len(report["passages"]) + 1)):
        raise ResultsError(f"{folder / TABLE}: its passages are not those of {REPORT}; both must be of the same run")
    return found
