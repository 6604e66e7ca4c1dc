"""Which results in a folder belong to an input: strict, for a report must not show those of another."""

import hashlib
import json
import re
from collections.abc import Sequence
from pathlib import Path

from .program import Program
from .result_files import CASES, CaseResult, ResultFiles
from .writing import write_whole

NAME = "report.json"
CASE = re.compile(r"^&case\n(?:  .*\n)*/\n", re.MULTILINE)  # who, for whom, title: no number depends on it


def without_case(text: str) -> str:
    """The complete input without &case."""
    return CASE.sub("", text)


def is_run_of(folder: Path, check: dict, program: Program) -> bool:
    """Whether a folder has the finished run of an input by this program: `nocdyn run` leaves the complete input beside it."""
    summary_file = folder / "summary.json"
    try:
        summary = json.loads(summary_file.read_text(encoding="utf-8"))
        text = (folder / "input.nml").read_text(encoding="utf-8")
        is_newer = summary_file.stat().st_mtime_ns > program.path.stat().st_mtime_ns
    except (OSError, ValueError):
        return False
    has_rows = any((folder / name).is_file() for name in ("trajectory.csv", "trajectory.nc"))
    same = all(summary.get(key) == check[key] for key in ("program", "version", "compiler", "input"))
    is_same_input = without_case(text) == without_case(check["complete_input"])
    return is_newer and has_rows and same and is_same_input and summary.get("status") == "done"


class Stamps:
    """What this script computed before, in a file beside the results: the input, the program, and the files as they were."""

    def __init__(self, folder: Path, program: Program, check: dict) -> None:
        self.results = ResultFiles(folder, bool(check.get("load_cases")))
        self.folder = folder
        text = without_case(check["complete_input"]) + "\n".join(str(check[key]) for key in ("version", "compiler", "input"))
        self.key = hashlib.sha256((text + program.identity).encode()).hexdigest()
        try:
            content = json.loads((folder / NAME).read_text(encoding="utf-8"))
            self.files = content["files"] if content["key"] == self.key else {}
        except (OSError, ValueError, KeyError, TypeError):
            self.files = {}

    def holds(self, command: str, names: Sequence[str]) -> bool:
        """Whether the files of a command are those that were written for this input."""
        known = self.files.get(command)
        return isinstance(known, dict) and bool(known) and known == self._digests(command, names)

    def differs(self, command: str, names: Sequence[str]) -> bool:
        """Whether the files of a command are not those that a report used before."""
        return command in self.files and not self.holds(command, names)

    def put(self, command: str, names: Sequence[str]) -> None:
        self.files[command] = self._digests(command, names)

    def write(self) -> None:
        write_whole(self.folder / NAME, json.dumps({"key": self.key, "files": self.files}, indent=2) + "\n")

    def _digests(self, command: str, names: Sequence[str]) -> dict[str, str | None]:
        """Of the files of the machine, or of all load cases and of the report on them."""
        cases = self.results.cases(command)
        files = [one.folder / name for one in cases for name in [*names, *self._measured(one, command)]]
        if any(one.name for one in cases):
            files.append(self.folder / CASES.get(command, CASES["modes"]))
        return {str(file.relative_to(self.folder)): _digest(file) for file in files}

    def _measured(self, case: CaseResult, command: str) -> list[str]:
        """The files of measurements, which the report of a command names."""
        try:
            return [one["file"] for one in self.results.read(case, command).get("measurements", [])]
        except (OSError, ValueError):
            return []


def _digest(file: Path) -> str | None:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError:
        return None
