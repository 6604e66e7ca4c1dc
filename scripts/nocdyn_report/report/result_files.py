"""Where the results of each command are in a folder: in the folder itself, or in those of the load cases."""

import json
from dataclasses import dataclass
from pathlib import Path

MAIN_FILES = {  # what a command reports, of the machine or of one load case
    "equilibrium": "equilibrium.json",
    "modes": "modes.json",
    "holzer": "modes.json",  # the tables of Holzer are beside the modes
    "campbell": "campbell.json",
    "response": "response.json",
    "run": "summary.json",
    "transit": "transit.json",
    "orbit": "orbit.json",
    "fit": "fit.json",
}
CASES = {"run": "cases.json"} | {
    name: f"{name}_cases.json" for name in ("equilibrium", "modes", "campbell", "response", "transit", "orbit", "fit")
}
DONE = "done"


def case_of(folder: Path, command: str) -> str:
    """The load case whose results of a command are in a folder, by the report on all of them beside it; '' without."""
    cases = ResultFiles(folder.resolve().parent, True).cases(command)
    return next((one.name for one in cases if one.folder.name == folder.resolve().name), "")


@dataclass(frozen=True)
class CaseResult:
    """The results of a command for one load case, or why there are none; without load cases the name is ''."""

    name: str
    folder: Path
    status: str = DONE
    title: str = ""


class ResultFiles:
    """The results in a folder; those of load cases go before older ones of a machine without, unless it is known which count."""

    def __init__(self, folder: Path, has_cases: bool | None = None) -> None:
        self.folder, self.has_cases = folder, has_cases

    def cases(self, command: str) -> list[CaseResult]:
        """Those that a command has computed, or tried to, in the order of the input."""
        listed = self.report(command)
        if "load_cases" in listed:
            return [
                CaseResult(one["name"], self.folder / one["folder"], one["status"], one["title"]) for one in listed["load_cases"]
            ]
        return [CaseResult("", self.folder)] if (self.folder / MAIN_FILES[command]).is_file() else []

    def there(self, command: str) -> list[CaseResult]:
        """Those that have results; of a run also those that ended early."""
        shown = (DONE, "failed", "interrupted") if command == "run" else (DONE,)
        return [one for one in self.cases(command) if one.status in shown and (one.folder / MAIN_FILES[command]).is_file()]

    def report(self, command: str) -> dict:
        """The report on all load cases, else that of the machine; empty if there is none."""
        names = [CASES.get(command, CASES["modes"]), MAIN_FILES[command]]
        for name in names if self.has_cases is None else names[:1] if self.has_cases else names[1:]:
            try:
                return json.loads((self.folder / name).read_text(encoding="utf-8"))
            except (OSError, ValueError):
                continue
        return {}

    def read(self, one: CaseResult, command: str) -> dict:
        return json.loads((one.folder / MAIN_FILES[command]).read_text(encoding="utf-8"))
