"""The results of `nocdyn response` and `nocdyn campbell`, read from their folders."""

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from .columns import MOMENT, RESPONSE_COLUMNS, STRESS, Column, read_column_list
from .failure import ResultsError
from .json_files import read_json, with_case
from .report.result_files import case_of
from .results import RPM
from .trajectory_files import labels_of, need_folder, read_columns

SPEED = re.compile(r"omega_(?P<body>.+) \[(?P<unit>rad/s|rpm|Hz)\]")
SHAKEN = "frequency [Hz]"
FREQUENCY = re.compile(r"frequency_(?P<mode>\d+) \[Hz\]")
LINE = re.compile(r"(order|line)_.+ \[Hz\]")
TABLE, ORDERS = "response.csv", "response_orders.csv"
LIMITS = ("limit", "transient_limit", "peak_limit")
STATISTICS = ("half_range", "mean", "peak", *LIMITS)
NAMED = 4  # orders that are named beside the curve of all
PREFIXED = ("N", "Pa", "W", "J")  # beginnings of units that take a prefix
NEAR = 2.5  # times what is drawn: limits above are not in the picture


def rpm(speed: float) -> float:
    """A speed in rad/s in rpm."""
    return speed * RPM["rad/s"]


def short_unit(unit: str, largest: float) -> tuple[float, str]:
    """What numbers up to the largest are divided by, and their unit then: kN m, MN m or MPa if they are large."""
    if re.split("[ /]", unit)[0] not in PREFIXED:
        return 1.0, unit
    steps = ((1e6, "M", 1e4),) if unit == "Pa" else ((1e6, "M", 1e7), (1e3, "k", 1e4))
    factor, prefix = next(((f, p) for f, p, least in steps if least <= largest < np.inf), (1.0, ""))
    return factor, prefix + unit


@dataclass(frozen=True)
class Axis:
    """What a response is over: the speed of a body [rpm], or the frequency of a shaker [Hz]."""

    of: str
    is_frequency: bool = False

    @property
    def noun(self) -> str:
        return "frequency" if self.is_frequency else "speed"

    @property
    def plural(self) -> str:
        return "frequencies" if self.is_frequency else "speeds"

    @property
    def label(self) -> str:
        return f"{self.noun} of {self.of}"

    @property
    def unit(self) -> str:
        return "Hz" if self.is_frequency else "rpm"

    def point(self, entry: dict, before: str = "") -> float:
        """Where a number of a report is."""
        return entry[f"{before}frequency_Hz"] if self.is_frequency else rpm(entry[f"{before}speed_rad_s"])

    def span(self, entry: dict) -> tuple[float, float]:
        """The lower and the upper end of a range in a report."""
        if self.is_frequency:
            return entry["from_Hz"], entry["to_Hz"]
        low, high = sorted((rpm(entry["from_rad_s"]), rpm(entry["to_rad_s"])))
        return low, high


@dataclass(frozen=True)
class Line:
    """An excitation: oscillations per turn of the body; a frequency [Hz] at the first speed, with its name; or a shaker."""

    value: float
    is_order: bool
    word: str = "fixed"
    shaker: str = ""

    @property
    def name(self) -> str:
        if self.shaker:
            return self.shaker
        if self.is_order:
            return f"{self.value:.6g}"
        return f"{self.value:.5g} Hz" if self.word == "fixed" else self.word

    @property
    def title(self) -> str:
        return f"order {self.name}" if self.is_order and not self.shaker else self.name


@dataclass(frozen=True)
class Operation:
    """The speeds in operation [rpm], from the slower to the faster one, and the margin around them, a share of each."""

    slow: float
    fast: float
    margin: float

    @property
    def spans(self) -> list[tuple[float, float, bool]]:
        """From, to, and whether that is a margin."""
        ends = [self.slow * (1 - self.margin), self.slow, self.fast, self.fast * (1 + self.margin)]
        parts = zip(ends, ends[1:], (True, False, True))
        return [(min(a, b), max(a, b), is_margin) for a, b, is_margin in parts if a != b]


@dataclass(frozen=True)
class Critical:
    """A speed [rpm] at which a line meets a natural frequency [Hz]; the distance to operation is a share, NaN without one."""

    mode: int
    line: Line
    speed: float
    frequency: float
    distance: float
    is_too_near: bool
    is_electrical: bool = False

    @property
    def name(self) -> str:
        """As 'II/4.5': mode and order; the mode alone where a shaker meets it."""
        return roman(self.mode) if self.line.shaker else f"{roman(self.mode)}/{self.line.name}"

    @property
    def place(self) -> str:
        """Where it is, as seen from the speeds in operation: 'inside', 'margin', 'clear'; '' if nothing is said of it."""
        if self.is_electrical or math.isnan(self.distance):
            return ""
        if self.distance <= 0:
            return "inside"
        return "margin" if self.is_too_near else "clear"


@dataclass(frozen=True)
class Barred:
    """A range of the axis in which a limit is exceeded."""

    quantity: str
    start: float
    end: float
    can_be_passed: bool


@dataclass(frozen=True)
class Quantity:
    """A moment, force or reaction over the speed; what the file does not have is None."""

    column: Column
    unit: str
    half_range: np.ndarray  # [points]
    mean: np.ndarray | None
    peak: np.ndarray | None
    limit: np.ndarray | None
    transient_limit: np.ndarray | None
    peak_limit: np.ndarray | None
    orders: np.ndarray | None  # amplitudes, [points, lines]
    stress: float | None  # per unit of the quantity [Pa]

    @property
    def label(self) -> str:
        """Its name, by which response.json has it."""
        return self.column.name

    def sorted_by(self, rows: np.ndarray) -> "Quantity":
        """Its points in another order."""
        return replace(self, **{name: values[rows] for name, values in self._values().items()})

    def _values(self) -> dict[str, np.ndarray]:
        return {name: getattr(self, name) for name in (*STATISTICS, "orders") if getattr(self, name) is not None}

    @property
    def largest(self) -> float:
        """Of the half range."""
        return float(np.nanmax(self.half_range, initial=0.0))

    def in_short(self, largest: float | None = None) -> "Quantity":
        """In kN m, MN m or MPa, if the numbers, or the largest of a figure, are large."""
        largest = self.largest if largest is None else largest
        factor, unit = short_unit(self.unit, largest)
        scaled = {name: values / factor for name, values in self._values().items()}
        return replace(self, unit=unit, stress=self.stress and self.stress * factor, **scaled)


@dataclass(frozen=True)
class Response:
    folder: Path
    title: str
    axis: Axis
    speed: np.ndarray  # rising, in the unit of the axis
    columns: list[Column]
    lines: list[Line]
    quantities: list[Quantity]
    criticals: list[Critical]
    barred: list[Barred]
    operation: Operation | None

    def barred_by(self, quantity: Quantity) -> list[Barred]:
        """Ranges of its own limits, and of limits of the whole element, as of a stress."""
        column = quantity.column
        names = {one.name for one in self.columns if one.point in ("", "max") and one.is_of(column)} | {quantity.label}
        return [one for one in self.barred if one.quantity in names]

    def largest_lines(self, quantity: Quantity, rows: slice | np.ndarray = slice(None), least: float = 0.0) -> list[int]:
        """Places of the lines that are named, the largest first, each above a share of the largest half range; in some rows."""
        if quantity.orders is None:
            return []
        largest = np.nan_to_num(quantity.orders[rows]).max(axis=0)
        least *= np.nan_to_num(quantity.half_range[rows]).max()
        return [int(place) for place in np.argsort(-largest, kind="stable")[:NAMED] if largest[place] > least]


@dataclass(frozen=True)
class Campbell:
    folder: Path
    title: str
    body: str
    speed: np.ndarray  # rising [rpm]
    modes: dict[int, np.ndarray]  # natural frequencies [Hz]
    lines: list[tuple[Line, np.ndarray]]  # and their frequencies [Hz]
    crossings: list[Critical]
    operation: Operation | None


def roman(number: int) -> str:
    """As torsional analyses count the modes."""
    text = ""
    for value, letters in ((100, "C"), (90, "XC"), (50, "L"), (40, "XL"), (10, "X"), (9, "IX"), (5, "V"), (4, "IV"), (1, "I")):
        text += letters * (number // value)
        number %= value
    return text


def read_response(folder: Path) -> Response:
    report = _read_report(folder, "response", (TABLE, ORDERS), ("body",))
    axis = Axis(report.get("excitation", report["body"]), "excitation" in report)
    columns = read_column_list(folder, RESPONSE_COLUMNS)
    table, speed, rising = read_speeds(folder / TABLE)
    order_table, order_speed, _ = read_speeds(folder / ORDERS, rises=False)
    for file, there in ((TABLE, table), (ORDERS, order_table)):
        missing = [column.label for column in columns if column.file == file and column.label not in there]
        if missing:
            raise ResultsError(f"{folder / file}: there is no column '{missing[0]}', which {RESPONSE_COLUMNS} has")
    count = len(order_table) // len(table)
    if count == 0 or len(order_table) != count * len(table) or (speed != order_speed.reshape(-1, count).T).any():
        raise ResultsError(f"{folder / ORDERS}: its speeds are not those of response.csv; both must be of the same run")
    shape = (len(table), count)
    by_kind = {column.kind: column.label for column in columns if column.file == ORDERS and not column.element}
    frequencies = order_table[by_kind["frequency"]].to_numpy().reshape(shape)
    quantities = [one.sorted_by(rising) for one in _quantities(table, order_table, columns, shape)]
    if not quantities:
        raise ResultsError(f"{folder / TABLE}: nothing to draw: there is no half range")
    if axis.is_frequency:
        lines = [Line(1.0, True, shaker=axis.of)]
    else:
        lines = [_line(entry, frequency) for entry, frequency in zip(report["lines"], frequencies[0])]
    return Response(
        folder,
        _title(report, folder, "response"),
        axis,
        speed[rising],
        columns,
        lines,
        quantities,
        [read_critical(entry, axis) for entry in report["resonances" if axis.is_frequency else "critical_speeds"]],
        [_barred(entry, axis) for entry in barred_in(report)],
        operation_of(report),
    )


def read_campbell(folder: Path) -> Campbell:
    report = _read_report(folder, "campbell", ("campbell.csv",), ("body", "lines", "crossings"))
    table, speed, rising = read_speeds(folder / "campbell.csv")
    modes = {int(match["mode"]): label for label in table if (match := FREQUENCY.fullmatch(label))}
    if not modes:
        raise ResultsError(f"{folder / 'campbell.csv'}: nothing to draw: there is no column 'frequency_1 [Hz]'")
    lines = []
    for entry, label in zip(report["lines"], filter(LINE.fullmatch, table)):
        frequency = table[label].to_numpy()
        lines.append((_line(entry, frequency[0]), frequency[rising]))
    return Campbell(
        folder,
        _title(report, folder, "campbell"),
        report["body"],
        speed[rising],
        {mode: table[label].to_numpy()[rising] for mode, label in modes.items()},
        lines,
        [read_critical(entry, Axis(report["body"])) for entry in report["crossings"]],
        operation_of(report),
    )


def _read_report(folder: Path, command: str, tables: tuple[str, ...], keys: tuple[str, ...]) -> dict:
    """COMMAND.json, if all files of the command are there."""
    need_folder(folder)
    for name in (*tables, f"{command}.json"):
        if not (folder / name).is_file():
            raise ResultsError(f"{folder}: no {name} here; 'nocdyn {command} FILE --out {folder}' writes it")
    return read_json(folder / f"{command}.json", keys)


def read_speeds(file: Path, rises: bool = True) -> tuple[pd.DataFrame, np.ndarray, np.ndarray]:
    """A table whose first column is a speed, that in rpm, or the frequency of a shaker; the order of rows in which it rises."""
    labels = labels_of(file)
    match = SPEED.fullmatch(labels[0]) if labels else None
    if match is None and labels[:1] != [SHAKEN]:
        raise ResultsError(f"{file}: the first column must be a speed, as 'omega_motor [rad/s]'")
    table = read_columns(file, labels)
    if len(table) < 2 and rises:
        raise ResultsError(f"{file}: nothing to draw: the table has {len(table)} row(s)")
    speed = table[labels[0]].to_numpy() * (RPM.get(match["unit"], 1.0) if match else 1.0)
    return table, speed, np.argsort(speed, kind="stable")


def _quantities(table: pd.DataFrame, orders: pd.DataFrame, columns: list[Column], shape: tuple[int, int]) -> list[Quantity]:
    """Those of a half range; the stress of a moment is a second scale of this, and has its limits there."""
    signals = [column for column in columns if column.file == TABLE and column.statistic == "half_range"]
    of_orders = {column.name: column.label for column in columns if column.file == ORDERS and not column.statistic}
    stresses = {(one.element_kind, one.element): one for one in signals if one.rank == STRESS}
    found = []
    for signal in signals:
        moments = [one for one in signals if one.rank == MOMENT and not one.point and one.is_of(signal)]
        if signal.rank == STRESS and moments:
            continue
        values = _statistics(table, columns, signal)
        stress = stresses.get((signal.element_kind, signal.element)) if signal in moments else None
        ratio = None
        if stress and values["half_range"].max() > 0:
            ratio = table[stress.label].max() / values["half_range"].max()
            of_stress = _statistics(table, columns, stress)
            for name in LIMITS:
                values[name] = _lower(values[name], of_stress[name], ratio)
        amplitudes = orders[of_orders[signal.name]].to_numpy().reshape(shape) if signal.name in of_orders else None
        found.append(Quantity(signal, signal.unit, **values, orders=amplitudes, stress=ratio))
    return found


def _statistics(table: pd.DataFrame, columns: list[Column], signal: Column) -> dict[str, np.ndarray | None]:
    labels = {one.statistic: one.label for one in columns if one.file == TABLE and one.name == signal.name}
    return {name: table[labels[name]].to_numpy() if name in labels else None for name in STATISTICS}


def _lower(limit: np.ndarray | None, of_stress: np.ndarray | None, ratio: float) -> np.ndarray | None:
    """The limit that is met first, of a moment and of its stress, which is so many times the moment."""
    if of_stress is None:
        return limit
    return of_stress / ratio if limit is None else np.fmin(limit, of_stress / ratio)


def _line(entry: dict, frequency: float) -> Line:
    return Line(entry["order"], True) if "order" in entry else Line(frequency, False, entry["line_name"])


def barred_in(report: dict) -> list[dict]:
    """The ranges of a response.json in which a limit is exceeded."""
    return report.get("barred_speed_ranges", report.get("barred_frequency_ranges", []))


def read_critical(entry: dict, axis: Axis) -> Critical:
    """One of the crossings of campbell.json or of the critical speeds of response.json."""
    distance = entry.get("distance_to_operation", math.nan)
    line = Line(1.0, True, shaker=axis.of) if axis.is_frequency else _line(entry, entry["frequency_Hz"])
    speed = axis.point(entry)
    judged = entry.get("is_too_near", False), entry.get("is_electrical", False)
    return Critical(entry["mode"], line, speed, entry["frequency_Hz"], distance, *judged)


def _barred(entry: dict, axis: Axis) -> Barred:
    return Barred(entry["quantity"], *axis.span(entry), entry["can_be_passed"])


def operation_of(report: dict) -> Operation | None:
    if "operating_rad_s" not in report:
        return None
    slow, fast = sorted(map(rpm, report["operating_rad_s"]), key=abs)
    return Operation(slow, fast, report.get("margin", 0.0))


def _title(report: dict, folder: Path, command: str) -> str:
    return with_case(report.get("title") or Path(report.get("input") or folder.resolve()).name, case_of(folder, command))
