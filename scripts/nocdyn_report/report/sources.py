"""The files of the results, read when a section needs them."""

import json
import re
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import f90nml
import pandas as pd

from ..columns import DETAIL, Column, columns_of, read_column_list
from ..failure import ResultsError
from ..modes_results import Modes, read_modes
from ..orbit_results import Orbits, read_orbits
from ..results import RPM, groups_of, ranges_of, trajectory_in
from ..speed_results import Axis, Campbell, Critical, Response, read_campbell, read_response, rpm
from ..trajectory_files import labels_of, read_columns
from ..transit_results import Transit, read_transit
from .calculations import Calculations
from .curves import Arrays
from .failure import FILES, ReportError
from .numbers import number_text
from .readable import Units
from .result_files import CaseResult
from .verdict import ANALYSES, Line, failure_line, verdict_lines, worst_first

NOTES_FILE = re.compile(
    r"""^[^!\n]*\bnotes_file\s*=\s*(?:'(?P<one>(?:[^'\n]|'')*)'|"(?P<other>[^"\n]*)")""", re.MULTILINE | re.IGNORECASE
)

READERS = {"campbell": read_campbell, "response": read_response}


class Sources:
    """What was calculated, for the sections."""

    def __init__(self, results: Calculations, text: str, overrides: Sequence[str] = ()) -> None:
        self.results = results
        self.text = text  # of the input file
        self.overrides = overrides  # PATH=VALUE of --set
        self.arrays = Arrays()
        self._read: dict[tuple[str, str], Campbell | Response | str] = {}

    @property
    def check(self) -> dict:
        return self.results.check

    @cached_property
    def machine(self) -> f90nml.Namelist:
        """The complete input, by groups."""
        return f90nml.reads(self.check["complete_input"])

    def has(self, command: str) -> bool:
        """Whether a command has results that can be shown: a machine without elasticity has no Campbell diagram."""
        return self.results.has(command) and not self.missing(command)

    def missing(self, command: str) -> str:
        """Why results that are there have nothing to show."""
        if command not in READERS or not self.results.has(command):
            return ""
        found = self._try(command, self.cases_of(command)[0])
        return found if isinstance(found, str) else ""

    def _try(self, command: str, case: CaseResult) -> Campbell | Response | str:
        """The results of a load case, or why they cannot be shown."""
        if (command, case.name) not in self._read:
            try:
                self._read[command, case.name] = READERS[command](case.folder)
            except ResultsError as error:
                self._read[command, case.name] = str(error)
        return self._read[command, case.name]

    def cases_of(self, command: str) -> list[CaseResult]:
        """The load cases for which a command has results, '' without load cases; sections show the first one."""
        return self.results.files.there(command)

    def main(self, command: str) -> str:
        """As ' of load case full': whose results the section of a command shows; '' without load cases."""
        name = self.cases_of(command)[0].name
        return f" of load case {name}" if name else ""

    def folder(self, command: str) -> Path:
        return self.cases_of(command)[0].folder

    def responses(self) -> list[tuple[str, Response]]:
        """Of all load cases, that of the section first."""
        found = [(case.name, self._try("response", case)) for case in self.cases_of("response")]
        return [(name, one) for name, one in found if not isinstance(one, str)]

    def groups(self, kind: str) -> list[f90nml.Namelist]:
        return groups_of(self.machine, kind)

    @property
    def case(self) -> f90nml.Namelist:
        """&case."""
        return self.groups("case")[0]

    @property
    def notes_file(self) -> str:
        """As the file or --set gives it; the complete input, which is for other folders, does not name it."""
        overrides = [one for one in self.overrides if one.lower().replace(" ", "").startswith("case.notes_file=")]
        if overrides:
            return overrides[-1].split("=", 1)[1].strip().strip("'\"")
        found = NOTES_FILE.search(self.text)
        return (found["one"] or found["other"] or "").replace("''", "'") if found else ""

    @cached_property
    def equilibrium(self) -> dict:
        return self.read_json(self.folder("equilibrium") / "equilibrium.json")

    @cached_property
    def steady_columns(self) -> dict[str, Column]:
        """What the values of steady states are, by their labels."""
        return {column.label: column for column in columns_of(self.equilibrium["columns"])}

    @cached_property
    def modes(self) -> Modes:
        return _told(read_modes, self.folder("modes"))

    @cached_property
    def response_report(self) -> dict:
        return self.read_json(self.folder("response") / "response.json")

    @property
    def response(self) -> Response:
        return self._shown("response")

    @cached_property
    def campbell_report(self) -> dict:
        return self.read_json(self.folder("campbell") / "campbell.json")

    @property
    def campbell(self) -> Campbell:
        return self._shown("campbell")

    @cached_property
    def transits(self) -> list[Transit]:
        """Of all load cases."""
        return [_told(read_transit, case.folder) for case in self.cases_of("transit")]

    @cached_property
    def orbits(self) -> list[Orbits]:
        """Of all load cases."""
        return [_told(read_orbits, case.folder) for case in self.cases_of("orbit")]

    @cached_property
    def cases(self) -> dict:
        return self.read_json("cases.json")

    @cached_property
    def runs(self) -> list["Run"]:
        """The run, or that of each load case; also those that ended early."""
        if self.results.of["run"].state == "refused":
            return []
        return [Run(one.name, one.folder, self.read_json(one.folder / "summary.json"), one.title) for one in self.cases_of("run")]

    def read_json(self, name: str | Path) -> dict:
        file = self.results.folder / name if isinstance(name, str) else name
        try:
            return json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            raise ReportError(f"{file}: cannot be read: {error}", FILES) from None

    def table(self, command: str, name: str) -> pd.DataFrame:
        file = self.folder(command) / name
        try:
            return pd.read_csv(file)
        except (OSError, ValueError) as error:
            raise ReportError(f"{file}: cannot be read: {error}", FILES) from None

    def _shown(self, command: str) -> Campbell | Response:
        if reason := self.missing(command):
            raise ReportError(reason, FILES)
        return self._try(command, self.cases_of(command)[0])

    @cached_property
    def speed_unit(self) -> str:
        """That of speeds which the files have in rad/s: as the input gives and asks for them."""
        units = self.groups("output")[0].get("units", []) if self.groups("output") else []
        units = [units] if isinstance(units, str) else units
        named = next((unit for unit in units if unit in RPM or unit == "rpm"), None)
        given = {"_rpm": "rpm", "_hz": "Hz"} if re.search(r"speed\w*_(rpm|hz)\b", self.text, re.IGNORECASE) else {}
        found = re.search(r"speed\w*(_rpm|_hz)\b", self.text, re.IGNORECASE)
        return named or (given[found[1].lower()] if found else "rad/s")

    @cached_property
    def units(self) -> Units:
        return Units(self.speed_unit)

    @cached_property
    def verdict(self) -> list[Line]:
        """The lines of all analyses and load cases; one that was asked for and gave nothing has a line too."""
        asked = [name for name in ANALYSES if name in self.results.of]
        there = [name for name in asked if self.results.has(name)]
        lines = verdict_lines(self.results.files, there)
        failed = [self.results.of[name] for name in asked if self.results.of[name].state in ("failed", "refused")]
        told = [failure_line(one.command, one.message.splitlines()[0]) for one in failed if one.command not in there]
        return worst_first([*lines, *told])

    def given_unit(self, key: str, unit: str) -> str:
        """The unit in which the input gives a key that has another one in the complete input: its own words."""
        for ending, other in (("_hz", "Hz"), ("_rpm", "rpm"), ("_deg", "deg")):
            if re.search(rf"\b{key}{ending}\b", self.text, re.IGNORECASE):
                return other
        return unit

    def speed(self, value: float) -> float:
        """A speed [rad/s] in that unit."""
        return value if self.speed_unit == "rad/s" else self.of_rpm(rpm(value))

    def on_axis(self, axis: Axis, value: float) -> float:
        """A point of a response, from rpm or Hz, in `axis_unit`."""
        return value if axis.is_frequency else self.of_rpm(value)

    def axis_unit(self, axis: Axis) -> str:
        return axis.unit if axis.is_frequency else self.speed_unit

    def of_rpm(self, value: float) -> float:
        return value / RPM.get(self.speed_unit, 1.0)

    def named(self, critical: Critical) -> str:
        """As 'II/4.5 at 312 rpm'."""
        return f"{critical.name} at {number_text(self.of_rpm(critical.speed))} {self.speed_unit}"


class Run:
    """A run over the time."""

    def __init__(self, name: str, folder: Path, summary: dict, title: str = "") -> None:
        self.name, self.folder, self.summary, self.title = name, folder, summary, title

    @property
    def columns(self) -> dict[str, dict]:
        return self.summary.get("columns", {})

    @property
    def file(self) -> Path | None:
        return trajectory_in(self.folder)

    @property
    def ranges(self) -> dict[str, float]:
        return ranges_of(self.summary)

    @cached_property
    def column_list(self) -> dict[str, Column]:
        """What the columns are, by their labels; what one looks for first, first."""
        columns = _told(read_column_list, self.folder)
        return {column.label: column for column in sorted(columns, key=lambda one: one.rank)}

    def drawn(self) -> list[Column]:
        """The columns of the trajectory that figures show."""
        labels = set(_told(labels_of, self.file)) if self.file else set()
        return [one for one in self.column_list.values() if one.label in labels and one.rank < DETAIL and not one.is_inner]

    def values(self, labels: list[str]) -> pd.DataFrame:
        return _told(read_columns, self.file, labels)


def _told(read: object, *arguments: object) -> object:
    try:
        return read(*arguments)
    except ResultsError as error:
        raise ReportError(str(error), FILES) from None
