"""What two revisions of a machine differ in: the numbers that one looks for, and the verdict, read from their folders."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..columns import LOADS, RESPONSE_COLUMNS, read_column_list
from ..failure import ResultsError
from ..speed_results import Axis, read_critical, roman
from .failure import USAGE, ReportError
from .naming import is_end, name_of
from .result_files import ResultFiles
from .verdict import DISTANCE, FINDINGS, Line

SAME = 1e-4  # relative difference of numbers that are one, the digits of a report
Numbers = dict[tuple[str, str], tuple[float, str]]  # by sort and name, with their units


@dataclass(frozen=True)
class Change:
    """Of a number; None where a revision does not have it."""

    sort: str
    name: str
    unit: str
    old: float | None
    new: float | None

    @property
    def ratio(self) -> float | None:
        """Of the new number to the old one, less 1."""
        return None if self.old is None or self.new is None or not self.old else self.new / self.old - 1.0


def former(folder: Path, present: Path) -> ResultFiles:
    """The results of another revision."""
    if folder.resolve() == present.resolve():
        raise ReportError(f"--against {folder}: is the folder of this report; allowed: a copy of an earlier one", USAGE)
    return results_of_revision(folder)


def results_of_revision(folder: Path) -> ResultFiles:
    files = ResultFiles(folder)
    if not any(files.there(command) for command in ("modes", "campbell", "response", "run")):
        raise ReportError(f"--against {folder}: has no results of nocdyn", USAGE)
    return files


def key_numbers(files: ResultFiles) -> Numbers:
    found: Numbers = {}
    for read in (_frequencies, _criticals, _response, _runs):
        try:
            found |= dict(read(files))
        except (OSError, ValueError, KeyError, ResultsError) as error:
            raise ReportError(f"{files.folder}: its results cannot be read: {error}", USAGE) from None
    return found


def changes(old: Numbers, new: Numbers) -> list[Change]:
    """What is not the same, in the order of the new revision."""
    found = []
    for key in dict.fromkeys([*new, *old]):
        before, after = old.get(key, (None, "")), new.get(key, (None, ""))
        if before[0] is None or after[0] is None or abs(after[0] - before[0]) > SAME * abs(before[0]):
            found.append(Change(*key, after[1] or before[1], before[0], after[0]))
    return found


def verdict_changes(old: list[Line], new: list[Line]) -> list[tuple[Line | None, Line | None]]:
    """Criteria whose worst line has another finding or value; None where a revision does not have it. The worst first."""
    before, after = _worst(old), _worst(new)
    pairs = [(before.get(key), after.get(key)) for key in dict.fromkeys([*after, *before])]
    return [pair for pair in pairs if pair[0] is None or pair[1] is None or _differ(*pair)]


def _worst(lines: list[Line]) -> dict[tuple, Line]:
    """Of each criterion in each load case."""
    found: dict[tuple, Line] = {}
    for one in sorted(lines, key=lambda one: (FINDINGS.index(one.finding), -(one.ratio or 0.0))):
        for case in one.cases:
            found.setdefault(
                (case, one.element, one.named_criterion, one.detail if one.criterion.startswith(DISTANCE) else ""), one
            )
    return found


def _differ(old: Line, new: Line) -> bool:
    if old.finding != new.finding:
        return True
    pairs = ((old.value, new.value), (old.limit, new.limit))
    return any(a is not None and b is not None and abs(a - b) > SAME * abs(a) for a, b in pairs)


def _main(files: ResultFiles, command: str) -> Path | None:
    there = files.there(command)
    return there[0].folder if there else None


def _read(file: Path) -> dict:
    return json.loads(file.read_text(encoding="utf-8"))


def _frequencies(files: ResultFiles) -> Iterable[tuple]:
    if folder := _main(files, "modes"):
        for mode in _read(folder / "modes.json")["modes"]:
            if mode["kind"] == "oscillating":
                yield ("natural frequency", f"mode {roman(mode['mode'])}"), (mode["frequency_Hz"], "Hz")


def _criticals(files: ResultFiles) -> Iterable[tuple]:
    if folder := _main(files, "campbell"):
        report = _read(folder / "campbell.json")
        axis = Axis(report["body"])
        for one in report["crossings"]:
            yield ("critical speed", read_critical(one, axis).name), (one["speed_rad_s"], "rad/s")


def _response(files: ResultFiles) -> Iterable[tuple]:
    if folder := _main(files, "response"):
        loads = {one.name: one for one in read_column_list(folder, RESPONSE_COLUMNS) if one.rank in LOADS and not is_end(one)}
        report = _read(folder / "response.json")
        axis = Axis(report.get("excitation", report["body"]), "excitation" in report)
        for one in report["largest"]:
            if column := loads.get(one["quantity"]):
                yield (f"half range over the {axis.plural}: {column.caption}", name_of(column)), (one["half_range"], one["unit"])


def _runs(files: ResultFiles) -> Iterable[tuple]:
    found: dict[tuple[str, str], tuple[float, str]] = {}
    for case in files.there("run"):
        values = _read(case.folder / "summary.json").get("columns", {})
        for column in read_column_list(case.folder):
            if column.rank in LOADS and not is_end(column) and not column.is_inner and "max" in values.get(column.label, {}):
                key = (f"largest over the time: {column.caption}", name_of(column))
                value = max(abs(values[column.label][end]) for end in ("min", "max"))
                found[key] = max(found.get(key, (0.0, column.unit)), (value, column.unit))
    return found.items()
