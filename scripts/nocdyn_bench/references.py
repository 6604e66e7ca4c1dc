"""Accurate solutions, each with the distance from a second, independent one."""

from dataclasses import dataclass

import numpy as np

from .peers import heyoka, numbalsoda, scipy
from .problems import Case2, Chain
from .shipped import Shipped


@dataclass(frozen=True)
class Reference:
    states: np.ndarray  # shape [outputs, states]
    distance: float  # of the second solution, largest over all states and outputs
    note: str


def accurate_reference(problem: Case2 | Shipped) -> Reference:
    states = heyoka.accurate_states(problem)
    other = numbalsoda.contestants(problem, ["DOP853"])[0].solve(1e-13, 1e-13, 1).states
    return Reference(
        states,
        float(np.abs(states - other).max()),
        "heyoka with 80-bit numbers at tolerance 1e-19, beside numbalsoda DOP853 at 1e-13",
    )


def chain_reference(problem: Chain, tolerance: float) -> Reference:
    states = numbalsoda.contestants(problem, ["DOP853"])[0].solve(tolerance, tolerance, 1).states
    other = scipy.contestants(problem, ["DOP853"])[0].solve(10 * tolerance, 10 * tolerance, 1).states
    return Reference(
        states,
        float(np.abs(states - other).max()),
        f"numbalsoda DOP853 at {tolerance:.0e}, beside SciPy DOP853 at {10 * tolerance:.0e}",
    )
