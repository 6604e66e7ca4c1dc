"""Runs the commands whose results are missing or belong to another input."""

import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import f90nml

from .failure import ReportError
from .program import Answer, Program, option_words
from .result_files import ResultFiles
from .stamps import Stamps, is_run_of, without_case

FAILED = 1  # exit code of a computation that failed
REFUSED = 2  # that of a machine, or a file, for which a command has no answer
FILES = {
    "equilibrium": ["equilibrium.json"],
    "modes": ["modes.json", "modes.csv"],
    "response": ["response.json", "response.csv", "response_orders.csv"],
    "campbell": ["campbell.json", "campbell.csv"],
    "transit": ["transit.json", "transit.csv"],
    "orbit": ["orbit.json", "orbit.csv", "orbit_columns.json"],
}
HOLZER = ["holzer.csv"]
RUN = ["summary.json", "input.nml", "columns.json", "trajectory.csv", "trajectory.nc", "cycles.csv"]  # those that are there
SWEEP = "sweep.nc"


@dataclass(frozen=True)
class Calculation:
    """A command, or why it has no results."""

    command: str
    state: str  # 'computed', 'reused', 'refused', 'failed', 'left out'
    message: str = ""
    seconds: float = 0.0

    @property
    def is_there(self) -> bool:
        return self.state in ("computed", "reused")


@dataclass
class Calculations:
    """Those of one input; its results are in a folder."""

    file: str
    folder: Path
    check: dict  # check.json
    of: dict[str, Calculation] = field(default_factory=dict)
    case_checks: dict[str, dict] = field(default_factory=dict)  # check.json of each load case

    @property
    def cases(self) -> list[dict]:
        return self.check.get("load_cases", [])

    @property
    def files(self) -> ResultFiles:
        return ResultFiles(self.folder, bool(self.cases))

    def has(self, command: str) -> bool:
        """Whether a command has results, at least of one load case."""
        if command not in self.of or self.of[command].state in ("refused", "left out"):
            return False
        return bool(self.files.there(command)) and (self.of[command].is_there or bool(self.cases))


def calculate(
    program: Program, file: str, out: Path | None, overrides: Sequence[str], tell: Callable[[str], None]
) -> Calculations:
    """All calculations that the input asks for. The results go to `out`, else to where `nocdyn run` writes its own."""
    given = [file, *option_words(overrides)]
    check = _check(program, given)
    folder = out or _folder(file, check)
    words = [*given, "--out", str(folder)]
    results = Calculations(file, folder, check)
    for case in results.cases:
        results.case_checks[case["name"]] = _check(program, [*given, "--case", case["name"]], case["name"])
    stamps = Stamps(folder, program, check)
    results.of["equilibrium"] = _analyse(program, "equilibrium", words, stamps)
    results.of["modes"], results.of["holzer"] = _modes(program, words, stamps)
    for command in ("campbell", "response"):
        if "\n&response\n" in check["complete_input"]:
            if command == "campbell" and "frequency" in f90nml.reads(check["complete_input"])["response"]:
                results.of[command] = Calculation(command, "left out", "&response is over the frequency of a shaker")
                continue
            in_csv = ["--set", "response.format=csv"] if _writes_netcdf(check) else []
            results.of[command] = _analyse(program, command, [*words, *in_csv], stamps)
        else:
            results.of[command] = Calculation(command, "left out", "the input has no &response")
    if "\n&transit\n" in check["complete_input"]:
        results.of["transit"] = _analyse(program, "transit", words, stamps)
    else:
        results.of["transit"] = Calculation("transit", "left out", "the input has no &transit")
    if "\n&orbit\n" in check["complete_input"]:
        results.of["orbit"] = _analyse(program, "orbit", words, stamps)
    results.of["run"] = _run(program, results, words, stamps)
    for calculation in results.of.values():
        tell(_line(calculation))
    stamps.write()
    return results


def _line(calculation: Calculation) -> str:
    """What the terminal shows of it."""
    reason = calculation.message.splitlines()[0] if calculation.message else f"in {calculation.seconds:.2f} s"
    return f"{calculation.command:12} {calculation.state}" + ("" if calculation.state == "reused" else f": {reason}")


def _check(program: Program, words: Sequence[str], case: str = "") -> dict:
    """Reads the file; its mistakes end the report before there is a folder."""
    with tempfile.TemporaryDirectory() as folder:
        answer = program("check", *words, "--out", folder)
        if answer.code:
            raise ReportError(answer.message, answer.code)
        return json.loads((Path(folder) / case / "check.json").read_text(encoding="utf-8"))


def _folder(file: str, check: dict) -> Path:
    output = f90nml.reads(check["complete_input"]).get("output", {})
    return Path(output.get("directory") or Path("results") / Path(file).stem)


def _writes_netcdf(check: dict) -> bool:
    """Whether a response is asked for in a form that reports do not read."""
    return f90nml.reads(check["complete_input"])["response"].get("format") == "netcdf"


def _analyse(program: Program, command: str, words: Sequence[str], stamps: Stamps) -> Calculation:
    if stamps.holds(command, FILES[command]):
        return Calculation(command, "reused")
    answer = program(command, *words)
    if answer.code == 0:
        stamps.put(command, FILES[command])
        return Calculation(command, "computed", seconds=answer.seconds)
    return _refusal(command, answer)


def _refusal(command: str, answer: Answer) -> Calculation:
    """A command that does not answer; a file that cannot be written, a signal or a crash end the report."""
    if answer.code not in (FAILED, REFUSED):
        raise ReportError(answer.message, answer.code)
    return Calculation(command, "failed" if answer.code == FAILED else "refused", answer.sentence, answer.seconds)


def _modes(program: Program, words: Sequence[str], stamps: Stamps) -> tuple[Calculation, Calculation]:
    """With the tables of Holzer; not every machine that has modes has these."""
    if stamps.holds("modes", FILES["modes"]) and stamps.holds("holzer", HOLZER):
        return Calculation("modes", "reused"), Calculation("holzer", "reused")
    answer = program("modes", "--holzer", *words)
    if answer.code == 0:
        stamps.put("modes", FILES["modes"])
        stamps.put("holzer", HOLZER)
        return Calculation("modes", "computed", seconds=answer.seconds), Calculation("holzer", "computed", seconds=answer.seconds)
    modes = _analyse(program, "modes", words, stamps)
    return modes, _refusal("holzer", answer) if modes.is_there else Calculation("holzer", "left out", "there are no modes")


def _run(program: Program, results: Calculations, words: Sequence[str], stamps: Stamps) -> Calculation:
    """The run or the runs of all load cases, also those of 'nocdyn run' itself. A sweep in the folder is in the way."""
    checks = {results.folder / name: check for name, check in results.case_checks.items()} or {results.folder: results.check}
    is_told = not results.cases or _tells_of(results)
    is_there = is_told and all(is_run_of(folder, check, program) for folder, check in checks.items())
    if is_there and not stamps.differs("run", RUN):
        stamps.put("run", RUN)
        return Calculation("run", "reused")
    answer = program("run", "--quiet", *words)
    if answer.code == REFUSED and (results.folder / SWEEP).is_file():
        raise ReportError(answer.message, answer.code)
    if answer.code:
        return _refusal("run", answer)
    stamps.put("run", RUN)
    return Calculation("run", "computed", seconds=answer.seconds)


def _tells_of(results: Calculations) -> bool:
    """Whether cases.json tells of all load cases of this input."""
    try:
        content = json.loads((results.folder / "cases.json").read_text(encoding="utf-8"))
        told = [{key: case[key] for key in ("name", "title", "repeats")} for case in content["load_cases"]]
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return told == results.cases and without_case(results.check["complete_input"]) != ""
