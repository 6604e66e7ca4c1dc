"""Variants in a second, every contestant at the loosest tolerance with which its errors are below the wanted one."""

from bisect import bisect_left
from dataclasses import dataclass, field
from functools import cache
from statistics import median

import numpy as np

from .contestant import ContestantError
from .nocdyn_sweep import Sweeper
from .peers import heyoka_sweep, scipy_sweep
from .variants import Errors, Family, SweepContestant, errors_of

TOLERANCES = 10.0 ** -np.arange(4.0, 12.01, 0.1)
SLOW_SAMPLE = 100  # most variants whose errors are looked at, of contestants that do not integrate all
SECOND_SAMPLE = 10  # of the reference, computed a second time


@dataclass
class Rate:
    """One contestant at its tolerance."""

    contestant: SweepContestant
    tolerance: float
    errors: Errors
    variants: int  # integrated in one round
    rounds: list[float] = field(default_factory=list)  # variants per second

    @property
    def best(self) -> float:
        return max(self.rounds)

    @property
    def median(self) -> float:
        return median(self.rounds)


@dataclass
class Throughput:
    """A workload of variants of one machine."""

    name: str
    title: str
    family: Family
    count: int  # of variants
    sample: int  # most variants whose errors are looked at
    contestants: list[SweepContestant]
    sweepers: list[Sweeper]  # nocdyn's, all of whom are contestants too
    counts: list[int] = field(default_factory=list)  # of variants for which the memory is looked at
    memory: dict[int, float] = field(default_factory=dict)  # of the first sweeper [MB]
    rates: list[Rate] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    distance: Errors | None = None  # of the reference from a second one

    def measure(self, rounds: int) -> None:
        parameters = self.family.variants(self.count)
        exact = heyoka_sweep.accurate_results(self.family, parameters[: self.sample])
        other = scipy_sweep.contestants(self.family, ["DOP853"])[0].solve(1e-13, parameters[:SECOND_SAMPLE]).results
        self.distance = errors_of(other, exact[:SECOND_SAMPLE])
        for contestant in self.contestants:
            try:
                self.rates.append(self._chosen(contestant, parameters, exact))
            except ContestantError as error:
                self.failures.append(f"{contestant.label} fails: {error}")
        for sweeper in self.sweepers[:1]:
            for count in self.counts:
                self.memory[count] = sweeper.memory(self.rate(sweeper.label).tolerance, count)
        for _ in range(rounds):
            for rate in self.rates:
                seconds = rate.contestant.time(rate.tolerance, parameters[: rate.variants])
                rate.rounds.append(rate.variants / seconds)

    def _chosen(self, contestant: SweepContestant, parameters: np.ndarray, exact: np.ndarray) -> Rate:
        count = round(contestant.share * self.count)
        sample = min(count, self.sample, self.sample if contestant.share == 1.0 else SLOW_SAMPLE)

        @cache
        def errors_at(tolerance: float) -> Errors:
            return errors_of(contestant.solve(tolerance, parameters[:sample]).results, exact[:sample])

        def is_tight_enough(place: int) -> bool:
            return errors_at(float(TOLERANCES[place])).are_below(self.family.wanted, contestant.has_peak)

        if contestant.share == 1.0:  # a method of another order at a looser tolerance may have smaller errors
            tight = next(filter(is_tight_enough, range(len(TOLERANCES))), len(TOLERANCES))
        else:  # slow ones, whose errors are taken for monotonic
            tight = bisect_left(range(len(TOLERANCES)), True, key=is_tight_enough)
        if tight == len(TOLERANCES):
            raise ContestantError(f"its errors are not below {self.family.wanted} at any tolerance")
        tolerance = float(TOLERANCES[tight])
        return Rate(contestant, tolerance, errors_at(tolerance), count)

    def whole_rate(self, rate: Rate) -> float | None:
        """Variants per second of the whole process, the files written."""
        sweeper = next((sweeper for sweeper in self.sweepers if sweeper.label == rate.contestant.label), None)
        return rate.variants / min(sweeper.whole) if sweeper and sweeper.whole else None

    def rate(self, label: str) -> Rate | None:
        return next((rate for rate in self.rates if rate.contestant.label == label), None)
