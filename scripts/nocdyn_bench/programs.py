"""Contestants that are compiled programs: nocdyn, the loop written by hand, SUNDIALS. See bench/."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np

from .contestant import Contestant, Run, Solve, report_of
from .problems import Case2, Problem
from .variants import Found, SolveAll, SweepContestant


class Programs:
    """The programs of one build and a folder for their files."""

    def __init__(self, folder: Path, scratch: Path) -> None:
        self.folder = folder
        self.scratch = scratch
        self.inputs: dict[Problem, Path] = {}

    def has(self, name: str) -> bool:
        return (self.folder / name).exists()

    def methods(self) -> list[str]:
        """The methods of nocdyn, each by one name."""
        found = subprocess.run([self.folder / "nocdyn_workloads", "methods"], check=True, capture_output=True, text=True)
        return [name for name in found.stdout.split() if name != "rosenbrock"]

    def nocdyn(self, problem: Problem, methods: list[str]) -> list[Contestant]:
        if problem not in self.inputs:
            self.inputs[problem] = self.scratch / f"machine_{len(self.inputs)}.nml"
            problem.write_input(self.inputs[problem])
        known = self.methods()
        return [
            Contestant(
                f"nocdyn {method}",
                "the machine from its input file, reduced formulation, energy balance off",
                self._solve(problem, ["nocdyn_workloads", self.inputs[problem], method], []),
                is_nocdyn=True,
            )
            for method in methods
            if method in known
        ]

    def handwritten(self) -> Contestant:
        return Contestant(
            "hand-written loop",
            "Dormand-Prince 5(4) for this machine alone, bench/handwritten.f90",
            self._solve(Case2(), ["handwritten"], [], selects=False),
        )

    def sundials(self, problem: Problem, solvers: list[str]) -> list[Contestant]:
        notes = {
            "adams": ("CVODE Adams", "fixed-point iteration, output by CVodeGetDky"),
            "bdf": ("CVODE BDF", "Newton with the analytic Jacobian (dense; banded for the chain), output by CVodeGetDky"),
            "bdf2": ("CVODE BDF, order <= 2", "the same with CVodeSetMaxOrd(2)"),
            "erk5": ("ARKODE ERK 5(4)", "Dormand-Prince, output by ERKStepGetDky of degree 5"),
            "erk8": ("ARKODE ERK 8(7)", "Fehlberg"),
        }
        if not self.has("sundials_workloads"):
            return []
        return [
            Contestant(*notes[solver], self._solve(problem, ["sundials_workloads", solver], problem.words, selects=False))
            for solver in solvers
        ]

    def handwritten_sweep(self) -> SweepContestant:
        return SweepContestant(
            "hand-written loop",
            "Dormand-Prince 5(4) for this machine alone, one variant after the other, peaks "
            "from its dense output, bench/handwritten_sweep.f90",
            self._solve_all(["handwritten_sweep"], [], []),
        )

    def sundials_sweep(self, solvers: list[str]) -> list[SweepContestant]:
        notes = {
            "adams": ("CVODE Adams", "fixed-point iteration, peaks by CVodeRootInit"),
            "erk5": ("ARKODE ERK 5(4)", "Dormand-Prince, peaks by ERKStepRootInit"),
        }
        if not self.has("sundials_workloads"):
            return []
        return [
            SweepContestant(*notes[solver], self._solve_all(["sundials_workloads", solver], ["1"], ["sweep"]), share=0.02)
            for solver in solvers
        ]

    def _solve_all(self, head: list, before: list[str], after: list[str]) -> SolveAll:
        """`before` and `after` the name of the file with the results; that with the parameters comes last."""
        parameters_file, results_file = self.scratch / "parameters.bin", self.scratch / "results.bin"

        def solve(tolerance: float, parameters: np.ndarray) -> Found:
            parameters.tofile(parameters_file)
            command = [
                self.folder / head[0],
                *head[1:],
                repr(tolerance),
                repr(tolerance),
                *before,
                results_file,
                *after,
                parameters_file,
            ]
            report = report_of(command, env={**os.environ, "OMP_NUM_THREADS": "1"})
            return Found(json.loads(report)["seconds"][0], np.fromfile(results_file).reshape(-1, 5))

        return solve

    def _solve(self, problem: Problem, head: list, tail: list[str], selects: bool = True) -> Solve:
        states = self.scratch / "states.bin"

        def solve(rtol: float, atol: float, repetitions: int) -> Run:
            command = [self.folder / head[0], *head[1:], repr(rtol), repr(atol), str(repetitions), states, *tail]
            report = json.loads(report_of(command))
            found = np.fromfile(states).reshape(len(problem.times), -1)
            return Run(report["seconds"], problem.select(found) if selects else found, report["steps"], report["evaluations"])

        return solve
