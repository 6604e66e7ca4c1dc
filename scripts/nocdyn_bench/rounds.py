"""Contestants measured in turns, so that a busy moment of the machine hits all alike."""

from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from .contestant import Contestant, ContestantError, Run

SHARE = 0.03  # of a second: what one contestant repeats for at one tolerance in one round
MOST_REPETITIONS = 1000
MOST_SECONDS = 3.0  # that one point of a work-precision diagram may take altogether


@dataclass
class Point:
    """One contestant at one tolerance."""

    contestant: Contestant
    rtol: float
    atol: float
    errors: dict[str, float]
    steps: int | None
    evaluations: int | None
    rounds: list[float] = field(default_factory=list)  # shortest time of each round [s]
    first: float = 0.0  # of the trial run [s]

    @property
    def seconds(self) -> float:
        return min(self.rounds, default=self.first)

    @property
    def median(self) -> float:
        return median(self.rounds) if self.rounds else self.first


Judge = Callable[[np.ndarray], dict[str, float]]  # states -> errors by name


def try_out(contestants: list[Contestant], tolerances: list[tuple[float, float]], judge: Judge) -> tuple[list[Point], list[str]]:
    """Every contestant once at every tolerance (rtol, atol), loosest first; and a sentence for each that failed somewhere.

    A contestant stops at its first run that is slower than its `slowest_point`.
    """
    points, sentences = [], []
    for contestant in contestants:
        failures = {}
        for rtol, atol in tolerances:
            try:
                run = contestant.solve(rtol, atol, 1)
            except ContestantError as error:
                failures[f"{rtol:.0e}"] = str(error)
                continue
            points.append(_point(contestant, rtol, atol, run, judge))
            if min(run.seconds) > contestant.slowest_point:
                break
        if failures:
            where = f" at rtol {', '.join(failures)}" if len(failures) < len(tolerances) else ""
            sentences.append(f"{contestant.label} fails{where}: {next(iter(failures.values()))}")
    return points, sentences


def _point(contestant: Contestant, rtol: float, atol: float, run: Run, judge: Judge) -> Point:
    return Point(contestant, rtol, atol, judge(run.states), run.steps, run.evaluations, first=min(run.seconds))


def measure_in_turns(points: list[Point], rounds: int) -> None:
    """Tolerance by tolerance, so that neighbours in time are those that are compared; slow points in fewer rounds."""
    ordered = sorted(points, key=lambda point: -point.rtol)
    for number in range(rounds):
        for point in ordered:
            if number * point.first < MOST_SECONDS or number == 0:
                _measure(point)


def _measure(point: Point) -> None:
    repetitions = int(np.clip(SHARE / max(point.seconds, 1e-9), 1, MOST_REPETITIONS))
    run = point.contestant.solve(point.rtol, point.atol, repetitions)
    point.rounds.append(min(run.seconds))
