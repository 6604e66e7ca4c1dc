"""Computed values beside the expected ones."""

import hashlib
import json
import platform
import subprocess
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path

from .answers import Answers, NoAnswerError
from .cases import INPUT, Case
from .failure import VerificationError

NOTABLE = 0.1  # share of the tolerance by which a value differs from that of the latest release and is marked


@dataclass(frozen=True)
class Outcome:
    case: Case
    computed: float | None
    problem: str  # why there is none, '' if there is one
    released: float | None  # of the latest release

    @property
    def difference(self) -> float | None:
        return None if self.computed is None else self.case.difference(self.computed)

    @property
    def passes(self) -> bool:
        return self.difference is not None and abs(self.difference) <= self.case.tolerance

    @property
    def share(self) -> float | None:
        """The difference as a share of the tolerance."""
        return None if self.difference is None else abs(self.difference) / self.case.tolerance

    @property
    def change(self) -> float | None:
        """How far the value is from that of the latest release, as a share of the tolerance."""
        if self.computed is None or self.released is None:
            return None
        return abs(self.case.difference(self.computed) - self.case.difference(self.released)) / self.case.tolerance

    @property
    def has_changed(self) -> bool:
        return self.change is not None and not self.change <= NOTABLE


@dataclass(frozen=True)
class Installation:
    """What was verified, where and when."""

    version: str
    compiler: str
    program: str  # checksum
    cases: str  # checksum of the table and the inputs
    processor: str
    system: str
    date: str


def verify(program: Path, folder: Path, cases: Sequence[Case], released: dict[str, float], threads: int) -> list[Outcome]:
    """The outcomes of the cases, in their order."""

    def key(case: Case) -> tuple[str, str]:
        return case.folder, case.command

    with tempfile.TemporaryDirectory(prefix="nocdyn_verify_") as results, ThreadPoolExecutor(threads) as pool:
        groups = [list(group) for _, group in groupby(sorted(cases, key=key), key)]

        def work(numbered: tuple[int, list[Case]]) -> list[Outcome]:
            number, group = numbered
            answers = Answers(program, folder, Path(results) / str(number))
            return [outcome(answers, case, released.get(case.id)) for case in group]

        found = {one.case.id: one for group in pool.map(work, enumerate(groups)) for one in group}
    return [found[case.id] for case in cases]


def outcome(answers: Answers, case: Case, released: float | None) -> Outcome:
    try:
        return Outcome(case, answers.value(case), "", released)
    except NoAnswerError as reason:
        return Outcome(case, None, str(reason), released)


def installation(program: Path, folder: Path, cases: Sequence[Case]) -> Installation:
    try:
        done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
        contents = program.read_bytes()
    except OSError as error:
        raise VerificationError(f"{program}: cannot be started: {error.strerror}") from None
    version, _, compiler = done.stdout.strip().removesuffix(")").partition(" (")
    inputs = sorted({folder / case.folder / INPUT for case in cases})
    rows = "\n".join(repr(case) for case in cases).encode()
    return Installation(
        version=version.removeprefix("nocdyn "),
        compiler=compiler.strip(),
        program=hashlib.sha256(contents).hexdigest(),
        cases=hashlib.sha256(rows + b"".join(path.read_bytes() for path in inputs)).hexdigest(),
        processor=processor(),
        system=f"{platform.system()} {platform.release()}, {platform.machine()}",
        date=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith(("model name", "Processor", "cpu model"))]
    return names[0] if names else platform.processor() or platform.machine()


def write_json(path: Path, machine: Installation, outcomes: Sequence[Outcome]) -> None:
    """Everything, for scripts."""
    rows = [
        {
            **vars(one.case),
            "computed": one.computed,
            "difference": one.difference,
            "passes": one.passes,
            "problem": one.problem,
            "released": one.released,
            "change": one.change,
            "has_changed": one.has_changed,
        }
        for one in outcomes
    ]
    content = {"installation": vars(machine), "passes": all(one.passes for one in outcomes), "cases": rows}
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
