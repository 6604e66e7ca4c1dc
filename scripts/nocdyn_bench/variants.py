"""Variants of a machine, and what takes part in integrating many of them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .problems import Case2
from .shipped import Shipped


@dataclass(frozen=True)
class Errors:
    state: float  # largest absolute one at the end, of all variants and states [rad, rad/s]
    peak: float  # largest relative one, nan if no peak is asked for

    def __str__(self) -> str:
        return f"{self.state:.0e}" if self.state == self.peak else f"{self.state:.0e} (peak: {self.peak:.0e})"

    def are_below(self, most: "Errors", has_peak: bool = True) -> bool:
        return self.state < most.state and (self.peak < most.peak or not has_peak)


@dataclass(frozen=True)
class Family:
    """Variants of one machine; of each are asked states at the end and the largest |elastic moment| of a coupling."""

    problem: Case2 | Shipped
    targets: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]  # between which the values of the targets are chosen
    wanted: Errors
    compared: int  # states that are asked for, the first ones: speeds, then angles
    outputs: int  # close enough for a polynomial of degree 5 of the twist between two of them

    def variants(self, count: int) -> np.ndarray:
        """Values of the targets, shape [count, targets]."""
        numbers = np.random.default_rng(1)
        return np.column_stack([numbers.uniform(low, high, count) for low, high in self.ranges])

    def numbers(self, parameters: np.ndarray) -> np.ndarray:
        """What the right-hand side wants to know of each variant."""
        return np.ascontiguousarray(self.problem.numbers(self.targets, parameters))

    def results(self, states: np.ndarray, twists: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """From states at the end and largest |twists|."""
        peaks = self.problem.moments(twists, self.problem.numbers(self.targets, parameters))
        return np.column_stack((states[:, : self.compared], peaks))

    @cached_property
    def records(self) -> dict[str, str]:
        """Quantities and statistics that are asked of nocdyn."""
        names = self.problem.state_names[: self.compared]
        return {**dict.fromkeys(names, "final"), f"moment_{self.problem.moment_of}": "max_abs"}


CASE2 = Family(
    Case2(),
    ("load.work.viscous", "coupling.coupling.cubic_stiffness"),
    ((50.0, 150.0), (0.0, 20.0)),
    Errors(1e-6, 1e-6),
    compared=4,
    outputs=201,
)


@dataclass
class Found:
    seconds: float  # for all variants, in process
    results: np.ndarray  # of each variant: the states asked for at the end, largest |elastic moment| or nan


# From the tolerance (rtol = atol where there are two) and the parameters.
SolveAll = Callable[[float, np.ndarray], Found]


@dataclass
class SweepContestant:
    label: str
    note: str  # how it is used, for the report
    solve: SolveAll
    has_peak: bool = True
    share: float = 1.0  # of the variants that it integrates
    timed: Callable[[float, int], float] | None = None  # seconds for so many random variants, where `solve` does not tell

    def time(self, tolerance: float, parameters: np.ndarray) -> float:
        """Seconds for all variants."""
        return self.timed(tolerance, len(parameters)) if self.timed else self.solve(tolerance, parameters).seconds


def errors_of(results: np.ndarray, exact: np.ndarray) -> Errors:
    state = float(np.abs(results[:, :-1] - exact[:, :-1]).max())
    return Errors(state if np.isfinite(state) else np.inf, float(np.abs(results[:, -1] / exact[:, -1] - 1).max()))
