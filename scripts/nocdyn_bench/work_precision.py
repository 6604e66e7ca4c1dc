"""Time against error: what a contestant needs for a given error."""

import math
from dataclasses import dataclass, field

import numpy as np

from .contestant import Contestant
from .problems import Case2
from .references import Reference, accurate_reference
from .rounds import Point, measure_in_turns, try_out
from .shipped import Shipped


@dataclass
class WorkPrecision:
    """A workload of one run; `time_at` reads its points."""

    name: str
    title: str
    problem: Case2 | Shipped
    contestants: list[Contestant]
    errors_wanted: list[float]
    tolerances_wanted: list[float] = field(default_factory=list)
    moments_wanted: list[float] = field(default_factory=list)  # errors relative to the largest; empty: absolute, as the others
    points: list[Point] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    reference: Reference | None = None

    def measure(self, tolerances: list[float], rounds: int) -> None:
        self.reference = accurate_reference(self.problem)
        exact, moment = self.reference.states, self.problem.moment(self.reference.states)
        unit = largest(moment) if self.moments_wanted else 1.0

        def judge(states: np.ndarray) -> dict[str, float]:
            return {"states": largest(states - exact), "moment": largest(self.problem.moment(states) - moment) / unit}

        self.points, self.failures = try_out(self.contestants, [(tolerance, tolerance) for tolerance in tolerances], judge)
        measure_in_turns(self.points, rounds)

    @property
    def columns(self) -> list[tuple[str, float]]:
        """Kinds and sizes of the errors whose times are told."""
        moments = self.moments_wanted or self.errors_wanted
        return [*(("states", error) for error in self.errors_wanted), *(("moment", error) for error in moments)]

    def points_of(self, contestant: Contestant) -> list[Point]:
        """From the loosest to the tightest tolerance."""
        return sorted((point for point in self.points if point.contestant is contestant), key=lambda point: -point.rtol)

    def time_at(self, contestant: Contestant, error: float, kind: str = "states") -> float | None:
        """Seconds for this error, None if it is not reached."""
        return interpolated_time([(point.errors[kind], point.seconds) for point in self.points_of(contestant)], error)

    def point_at(self, contestant: Contestant, tolerance: float) -> Point | None:
        return next((point for point in self.points_of(contestant) if math.isclose(point.rtol, tolerance)), None)


def largest(differences: np.ndarray) -> float:
    found = float(np.abs(differences).max())
    return found if math.isfinite(found) else math.inf


def interpolated_time(points: list[tuple[float, float]], error: float) -> float | None:
    """Seconds at `error` from points (error, seconds) in the order of their tolerances.

    Between the first point that reaches the error and the one before it, linear in the logarithms; if already the
    first point is better than asked for, its time.
    """
    for i, (reached, seconds) in enumerate(points):
        if reached > error:
            continue
        if i == 0:
            return seconds
        worse, before = points[i - 1]
        if not math.isfinite(worse):
            return seconds
        share = math.log(worse / error) / math.log(worse / max(reached, 1e-300))
        return math.exp(math.log(before) + share * (math.log(seconds) - math.log(before)))
    return None
