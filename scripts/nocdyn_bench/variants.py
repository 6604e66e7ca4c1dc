"""Variants of case 2, and what takes part in integrating many of them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

TARGETS = ("load.work.viscous", "coupling.coupling.cubic_stiffness")
RANGES = ((50.0, 150.0), (0.0, 20.0))  # between which c and k1 are chosen


@dataclass
class Found:
    seconds: float  # for all variants, in process
    results: np.ndarray  # of each variant: omega_1, omega_2, phi_1, phi_2 at the end, largest |elastic moment| or nan


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


def variants(count: int) -> np.ndarray:
    """c and k1 of each, shape [count, 2]."""
    numbers = np.random.default_rng(1)
    return np.column_stack([numbers.uniform(low, high, count) for low, high in RANGES])


@dataclass(frozen=True)
class Errors:
    state: float  # largest absolute one at the end, of all variants and states [rad, rad/s]
    peak: float  # largest relative one, nan if no peak is asked for

    def are_below(self, most: float, has_peak: bool = True) -> bool:
        return self.state < most and (self.peak < most or not has_peak)


def errors_of(results: np.ndarray, exact: np.ndarray) -> Errors:
    state = float(np.abs(results[:, :4] - exact[:, :4]).max())
    return Errors(state if np.isfinite(state) else np.inf, float(np.abs(results[:, 4] / exact[:, 4] - 1).max()))
