"""nocdyn's own sweeps: `nocdyn sweep` with threads, nocdyn-mpi with ranks."""

import csv
import json
import shutil
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .contestant import report_of
from .scale import WITH_MEMORY
from .variants import CASE2, Family, Found, SweepContestant

MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe", "--bind-to", "none"]


@dataclass
class Sweeper:
    """One way to run sweeps: a method, threads and ranks, a program for the series or none."""

    folder: Path  # of the programs
    scratch: Path
    family: Family
    method: str
    threads: int = 1
    ranks: int = 0  # 0: without MPI
    atol_of_rtol: float = 1.0
    compiles: bool = False  # once: later sweeps find the program in the cache
    whole: list[float] = field(default_factory=list)  # seconds of each whole process, the files written

    @property
    def label(self) -> str:
        of = f", {self.ranks} rank{'s' * (self.ranks > 1)}" if self.ranks else f", {self.threads} threads" * (self.threads > 1)
        program = ", compiled" if self.compiles else ""
        return f"{'nocdyn-mpi' if self.ranks else 'nocdyn'} {self.method}{program}{of}"

    def contestant(self) -> SweepContestant:
        program = "nocdyn-mpi sweep" if self.ranks else "nocdyn sweep"
        return SweepContestant(self.label, f"{program}, variants_per_second of summary.json", self.solve, timed=self.seconds)

    def solve(self, tolerance: float, parameters: np.ndarray) -> Found:
        """Of a list of variants, for their errors."""
        rows = self.scratch / "variants.csv"
        np.savetxt(rows, parameters, fmt="%.17g", delimiter=",", header=",".join(self.family.targets), comments="")
        out = self._run(tolerance, [f"&sweep design = 'list' file = '{rows}' /"], "--csv")
        with open(out / "sweep.csv", encoding="utf-8") as file:
            table = [{name.partition(" [")[0]: text for name, text in row.items()} for row in csv.DictReader(file)]
        columns = [f"{quantity}_{statistic}" for quantity, statistic in self.family.records.items()]
        found = np.array([[float(row[column]) for column in columns] for row in table])
        return Found(len(parameters) / _rate(out), found)

    def seconds(self, tolerance: float, count: int) -> float:
        """For a random design of so many variants."""
        began = time.perf_counter()
        out = self._run(tolerance, random_design(self.family, count))
        self.whole.append(time.perf_counter() - began)
        return count / _rate(out)

    def memory(self, tolerance: float, count: int) -> float:
        """Largest one of the process [MB], for a random design of so many variants."""
        said = self._command(tolerance, random_design(self.family, count), before=(sys.executable, "-c", WITH_MEMORY))[1]
        return int(said.split()[-1]) * 1024 / 1e6

    def _run(self, tolerance: float, design: list[str], *options: str) -> Path:
        return self._command(tolerance, design, *options)[0]

    def _command(self, tolerance: float, design: list[str], *options: str, before: tuple[str, ...] = ()) -> tuple[Path, str]:
        file, out = self.scratch / "sweep.nml", self.scratch / "sweep"
        shutil.rmtree(out, ignore_errors=True)
        write_input(self.family, file, design)
        program = [*MPIRUN, "-n", str(self.ranks), self.folder / "nocdyn-mpi"] if self.ranks else [self.folder / "nocdyn"]
        settings = [
            word
            for name, value in (("method", self.method), ("rtol", repr(tolerance)), ("atol", repr(self.atol_of_rtol * tolerance)))
            for word in ("--set", f"run.{name}={value}")
        ]
        choice = ["--compile", "always" if self.compiles else "never"]
        words = ["--out", out, "--threads", self.threads, "--quiet", *choice, *settings, *options]
        command = [*before, *program, "sweep", file, *words]
        return out, report_of(command)


def random_design(family: Family, count: int) -> list[str]:
    return [
        f"&sweep design = 'random' samples = {count} seed = 1 /",
        *(f"&vary target = '{target}' low = {low} high = {high} /" for target, (low, high) in zip(family.targets, family.ranges)),
    ]


def write_input(family: Family, file: Path, design: list[str], settings: str = "") -> None:
    """`settings` goes to &run."""
    family.problem.write_input(file)
    records = [f"&record quantity = '{quantity}' statistic = '{statistic}' /" for quantity, statistic in family.records.items()]
    file.write_text("\n".join([file.read_text().replace("&run ", f"&run {settings} "), *design, *records]) + "\n")


def write_sweep(file: Path, count: int, settings: str) -> None:
    """Of so many random variants of case 2."""
    write_input(CASE2, file, random_design(CASE2, count), settings)


def _rate(out: Path) -> float:
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))["variants_per_second"]


def sweepers(folder: Path, scratch: Path, family: Family, methods: list[str], most: int = 1) -> list[Sweeper]:
    """All ways that there are programs for; with more than one thread also those of up to so many threads and ranks."""
    found, workers = [], range(1, most + 1)
    if (folder / "nocdyn-sweep").exists():
        found += [Sweeper(folder, scratch, family, method, threads) for threads in workers for method in methods]
        if "taylor" in methods:
            found += [Sweeper(folder, scratch, family, "taylor", threads, compiles=True) for threads in workers]
    if (folder / "nocdyn-mpi").exists() and most > 1:
        found += [Sweeper(folder, scratch, family, method, ranks=ranks) for ranks in workers for method in methods]
    return found
