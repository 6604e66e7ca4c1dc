"""What takes part in a workload."""

import subprocess
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

MOST_WORDS = 40  # of the message of a program that fails


class ContestantError(Exception):
    """A contestant could not do what was asked; the message says why."""


def report_of(command: list, **options) -> str:
    """What a program prints; ContestantError with its message, without the backtrace, if it fails."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, stdin=subprocess.DEVNULL, **options)
    if done.returncode != 0:
        raise ContestantError(" ".join(done.stderr.partition("ERROR STOP")[0].split()[:MOST_WORDS]))
    return done.stdout


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
