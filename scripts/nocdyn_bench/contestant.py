"""What takes part in a workload."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


class ContestantError(Exception):
    """A contestant could not do what was asked; the message says why."""


@dataclass
class Run:
    seconds: list[float]  # of each repetition, in process
    states: np.ndarray  # shape [outputs, states]
    steps: int | None = None
    evaluations: int | None = None


# From the tolerance: integrates `repetitions` times with rtol and atol, preparation not counted.
Solve = Callable[[float, float, int], Run]


@dataclass
class Contestant:
    label: str
    note: str  # how it is used, for the report
    solve: Solve
    is_nocdyn: bool = False
    slowest_point: float = 2.0  # no tighter tolerance is tried once a run takes so long [s]
