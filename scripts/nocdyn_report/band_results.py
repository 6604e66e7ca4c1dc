"""The bands of a sweep: quantiles of its curves over the speed, read from its folder."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .columns import Column, read_column_list
from .failure import ResultsError
from .json_files import read_json
from .speed_results import LINE, Axis, Campbell, Line, Operation, operation_of, read_speeds, short_unit
from .sweep_results import BANDS, Sweep

ORDER = re.compile(r".+_order_(?P<order>[\d.eE+-]+)_curve")
CROSSING = re.compile(r"mode_(?P<mode>\d+)_order_(?P<order>[\d.eE+-]+)_crossing")
RANGES = (("min", "max"), ("p5", "p95"), ("p25", "p75"))  # the widest first
CRITICAL = (0.0, 0.05, 0.5, 0.95, 1.0)  # shares of variants below the critical speeds that are told


@dataclass(frozen=True)
class Curve:
    """A curve over the speed: over all variants, and that of the machine of the input; what the table lacks is None."""

    column: Column
    unit: str
    order: float | None  # None: all together
    statistics: dict[str, np.ndarray]  # 'p5', 'median' ... [points]
    share_above: float  # of the variants that exceed the limit at one of the points, NaN without a limit

    @property
    def is_mode(self) -> bool:
        return self.column.element_kind == "mode"

    @property
    def mode(self) -> int:
        return int(self.column.element)

    def has(self, word: str) -> bool:
        return word in self.statistics

    @property
    def middle(self) -> np.ndarray:
        """That of the machine of the input, or the median if that has none."""
        return self.statistics.get("nominal", self.statistics["median"])

    @property
    def title(self) -> str:
        of = "half range" if self.order is None else f"amplitude of order {self.order:.6g}"
        return f"{self.column.title}: {of}"

    @property
    def largest(self) -> float:
        return float(np.nanmax(self.statistics["max"], initial=0.0))

    def in_short(self, largest: float) -> "Curve":
        """In kN m, MN m or MPa, if the largest number of a figure is large."""
        factor, unit = short_unit(self.unit, largest)
        scaled = {word: values / factor for word, values in self.statistics.items()}
        return Curve(self.column, unit, self.order, scaled, self.share_above)


@dataclass(frozen=True)
class CriticalBand:
    """Where the variants have a critical speed [rpm]."""

    mode: int
    order: float
    speeds: tuple[float, ...]  # by `CRITICAL`


@dataclass(frozen=True)
class Bands:
    folder: Path
    axis: Axis
    speed: np.ndarray  # rising, in the unit of the axis
    curves: list[Curve]
    lines: list[tuple[Line, np.ndarray]]  # of a Campbell diagram, and their frequencies [Hz]
    criticals: list[CriticalBand]
    operation: Operation | None

    def campbell(self, title: str) -> Campbell:
        """The diagram of the machine of the input."""
        modes = {curve.mode: curve.middle for curve in self.curves if curve.is_mode}
        return Campbell(self.folder, title, self.axis.of, self.speed, modes, self.lines, [], self.operation)


def read_bands(folder: Path, sweep: Sweep) -> Bands | None:
    """None of a sweep that keeps no curves."""
    if not sweep.curves:
        return None
    if not (folder / BANDS).is_file():
        raise ResultsError(f"{folder}: no {BANDS} here, which 'nocdyn sweep' writes beside the curves; compute the results again")
    table, speed, rising = read_speeds(folder / BANDS)
    columns = [column for column in read_column_list(folder) if column.file == BANDS]
    statistics: dict[str, dict[str, np.ndarray]] = {}
    for column in columns:
        statistics.setdefault(column.name, {})[column.statistic] = table[column.label].to_numpy()[rising]
    units = {column.name: column for column in columns if column.statistic == "median"}
    curves = []
    for variable in sweep.curves:
        if column := units.get(variable.name):
            match = ORDER.fullmatch(variable.name)
            found = statistics[variable.name]
            order = float(match["order"]) if match else None
            above = _share_above(sweep, variable.values[:, rising], found.get("limit"))
            curves.append(Curve(column, column.unit, order, found, above))
    lines = []
    for column in columns:
        if column.statistic == "line" and LINE.fullmatch(column.label):
            frequency = table[column.label].to_numpy()[rising]
            kind, value = column.name.split("_", 1)
            lines.append((Line(float(value), True) if kind == "order" else Line(float(frequency[0]), False), frequency))
    first = next(iter(table))
    name = first.split(" [")[0]
    axis = Axis("the shaker", True) if name == "frequency" else Axis(name.removeprefix("omega_"))
    report = read_json(folder / "summary.json", ["bands"])["bands"]
    return Bands(folder, axis, speed[rising], curves, lines, _criticals(sweep), operation_of(report))


def _share_above(sweep: Sweep, values: np.ndarray, limit: np.ndarray | None) -> float:
    """Of the variants that were done, those that exceed a limit at one of the points."""
    known = np.isfinite(values).any(axis=1)
    if limit is None or not known.any():
        return np.nan
    return float((values[known] > limit).any(axis=1).mean())


def _criticals(sweep: Sweep) -> list[CriticalBand]:
    """The critical speeds that the sweep keeps."""
    found = []
    for result in sweep.results:
        match = CROSSING.fullmatch(result.name)
        if match is None or not sweep.known(result).size:
            continue
        speeds = np.quantile(result.values[sweep.known(result)], CRITICAL) * (1.0 if result.unit == "rpm" else 30.0 / np.pi)
        found.append(CriticalBand(int(match["mode"]), float(match["order"]), tuple(float(speed) for speed in speeds)))
    return found
