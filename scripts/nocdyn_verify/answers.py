"""What the program computes for a case: the command is run once for all cases of one input."""

import csv
import json
import re
import shlex
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .cases import INPUT, Case

TABLES = {  # of several the first one that has the column
    "run": ("trajectory.csv",),
    "modes": ("modes.csv",),
    "campbell": ("campbell.csv",),
    "response": ("response.csv", "response_orders.csv"),
    "orbit": ("orbit.csv",),
    "sweep": ("sweep.csv",),
}
EXTREMES = {"maximum": "max", "minimum": "min", "end": "last"}
SAME = 1e-9  # relative: places that are equal
LONGEST = 60.0  # seconds of one command


class NoAnswerError(Exception):
    """Why there is no value."""


@dataclass
class Answers:
    """The results of commands, in a folder of their own."""

    program: Path
    cases: Path  # folder of the table
    results: Path  # folder for the results
    folders: dict[tuple[str, str], Path | str] = field(default_factory=dict)  # or why there are none

    def value(self, case: Case) -> float:
        """What is computed for a case."""
        folder = self.folder_of(case)
        command = shlex.split(case.command)[0]
        if case.at in EXTREMES:
            return column(read_json(folder / "summary.json")["columns"], case.signal)[EXTREMES[case.at]]
        for table in TABLES.get(command, ()):
            found = in_table(folder / table, case) if (folder / table).is_file() else None
            if found is not None:
                return found
        report = {"run": "summary", "sweep": "summary"}.get(command, command)
        return in_report(read_json(folder / f"{report}.json"), case)

    def folder_of(self, case: Case) -> Path:
        """The results of the command of a case."""
        key = (case.folder, case.command)
        if key not in self.folders:
            self.folders[key] = self.compute(case, len(self.folders) + 1)
        found = self.folders[key]
        if isinstance(found, str):
            raise NoAnswerError(found)
        return found

    def compute(self, case: Case, number: int) -> Path | str:
        folder = self.results / f"{number:03}_{Path(case.folder).name}"
        command, *options = shlex.split(case.command)
        words = [command, INPUT, "--out", str(folder), *options]
        if command == "sweep":
            words.append("--csv")
        try:
            done = subprocess.run(
                [self.program, *words],
                cwd=self.cases / case.folder,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                check=False,
                timeout=LONGEST,
            )
        except subprocess.TimeoutExpired:
            return f"nocdyn {case.command} takes more than {LONGEST:g} s"
        except OSError as error:
            return f"{self.program} cannot be started: {error.strerror}"
        if done.returncode != 0:
            return (done.stderr.strip() or f"exit code {done.returncode}").splitlines()[-1]
        return folder


def read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        raise NoAnswerError(f"there is no {path.name}") from None


def column(columns: dict[str, Any], name: str) -> Any:
    """The column with a name, whatever its unit."""
    for label, content in columns.items():
        if label == name or label.partition(" [")[0] == name:
            return content
    raise NoAnswerError(f"there is no column {name}")


def conditions(at: str) -> dict[str, str]:
    """'mode = 2, order = 1' as a dictionary."""
    parts = [part.partition("=") for part in at.split(",") if part.strip()]
    return {name.strip(): value.strip() for name, _, value in parts}


def fits(content: Any, wanted: str) -> bool:
    """Whether a value is the wanted one, of numbers as far as they are printed."""
    if isinstance(content, str) and not re.fullmatch(r"[-+0-9.eE]+", content):
        return content == wanted
    try:
        number = float(content)
        return abs(number - float(wanted)) <= SAME * max(abs(number), 1.0)
    except (TypeError, ValueError):
        return str(content) == wanted


def in_table(path: Path, case: Case) -> float | None:
    """The value in the row with these values of other columns; nothing if there is no such table or column."""
    if not path.is_file():
        return None
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.reader(line for line in file if not line.startswith("#"))
        names = [label.partition(" [")[0] for label in next(reader)]
        if case.signal not in names:
            return None
        wanted = [(names.index(name), value) for name, value in conditions(case.at).items() if name in names]
        rows = [row for row in reader if all(fits(row[place], value) for place, value in wanted)]
    if len(rows) != 1:
        raise NoAnswerError(f"{len(rows)} rows of {path.name} have {case.at}")
    return float(rows[0][names.index(case.signal)])


def in_report(content: Any, case: Case) -> float:
    """The value at a path of keys; of lists the element that meets the conditions."""
    wanted = conditions(case.at)
    for key in case.signal.split("."):
        content = element(content, wanted, case)
        if not isinstance(content, dict):
            raise NoAnswerError(f"there is no {key}")
        content = content[key] if key in content else column(content, key)
    content = element(content, wanted, case)
    if isinstance(content, bool) or not isinstance(content, int | float):
        raise NoAnswerError(f"{case.signal} is {content!r}, no number")
    return float(content)


def element(content: Any, wanted: dict[str, str], case: Case) -> Any:
    """Of a list the element that is meant; anything else itself."""
    if not isinstance(content, list):
        return content
    if content and isinstance(content[0], dict):
        keys = set().union(*content)
        for name, value in wanted.items():
            if name in keys:
                content = [one for one in content if name in one and fits(one[name], value)]
    if len(content) > 1 and "item" in wanted:
        content = content[int(wanted["item"]) - 1 : int(wanted["item"])]
    if len(content) != 1:
        raise NoAnswerError(f"{len(content)} elements of the report have {case.at!r}")
    return content[0]
