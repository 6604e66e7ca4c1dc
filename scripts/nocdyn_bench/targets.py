"""What is asked of nocdyn, and whether the measurements reach it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from .chains import Scaling
from .contestant import Contestant
from .throughput import Throughput
from .torsional import FACTOR, Torsional
from .work_precision import WorkPrecision

GROWTH = 1.1  # largest exponent of N in the time of one step that still counts as linear
IMPLICIT = ("nocdyn rodas4", "nocdyn rodas5p")


@dataclass(frozen=True)
class Verdict:
    sentence: str
    is_reached: bool | None  # None: not measured

    def __str__(self) -> str:
        return f"{self.sentence}: **{ {True: 'reached', False: 'missed', None: 'not measured'}[self.is_reached] }**"


def fastest(workload: WorkPrecision, contestants: list[Contestant], error: float) -> tuple[Contestant, float] | None:
    """Who needs the least time for an error, and that time."""
    times = [(workload.time_at(contestant, error), contestant) for contestant in contestants]
    reached = [(seconds, contestant) for seconds, contestant in times if seconds is not None]
    if not reached:
        return None
    seconds, contestant = min(reached, key=lambda pair: pair[0])
    return contestant, seconds


def end_of_sweep(workload: WorkPrecision) -> Callable[[Contestant], str]:
    """What a contestant's tightest run took and achieved: a sweep ends after the first run slower than `slowest_point`."""

    def describe(contestant: Contestant) -> str:
        points = workload.points_of(contestant)
        return f"{1e3 * points[-1].seconds:.3g} ms for {points[-1].errors['states']:.1e}" if points else "no run"

    return describe


def at_error(workload: WorkPrecision, error: float, own: list[Contestant], rivals: list[Contestant], most: float) -> Verdict:
    """The fastest of `own` takes at most `most` times as long as the fastest of `rivals`."""
    ours, theirs = fastest(workload, own, error), fastest(workload, rivals, error)
    place = f"{workload.name} at error {error:.0e}"
    if ours is None:
        return Verdict(f"{place}, at most {most:g} times: no method reaches the error", False if own and rivals else None)
    if theirs is None:
        names = " or ".join(rival.label for rival in rivals)
        return Verdict(
            f"{place}: {ours[0].label} takes {1e3 * ours[1]:.3g} ms; {names or 'the rival'} does not "
            f"reach the error before the sweep ends ({' or '.join(map(end_of_sweep(workload), rivals))})",
            True if rivals else None,
        )
    factor = ours[1] / theirs[1]
    return Verdict(
        f"{place}: {ours[0].label} takes {factor:.2f} times as long as {theirs[0].label} "
        f"({1e3 * ours[1]:.3g} and {1e3 * theirs[1]:.3g} ms); wanted at most {most:g}",
        factor <= most,
    )


def case2_verdicts(workload: WorkPrecision) -> list[Verdict]:
    own = [contestant for contestant in workload.contestants if contestant.is_nocdyn]
    peers = [contestant for contestant in workload.contestants if not contestant.is_nocdyn]
    hand = [contestant for contestant in peers if contestant.label == "hand-written loop"]
    series = [contestant for contestant in peers if contestant.label.startswith("heyoka")]
    return [
        at_error(workload, 1e-6, own, hand, 1.5),
        at_error(workload, 1e-9, own, peers, 1.5),
        at_error(workload, 1e-12, own, series, 1.2),
    ]


def stiff_case2_verdicts(workload: WorkPrecision) -> list[Verdict]:
    own = [contestant for contestant in workload.contestants if contestant.label in IMPLICIT]
    rival = [contestant for contestant in workload.contestants if contestant.label == "CVODE BDF, order <= 2"]
    return [at_error(workload, error, own, rival, 0.5) for error in workload.errors_wanted]


def chain_verdicts(workload: Scaling) -> list[Verdict]:
    longest = workload.chains[-1]
    own = workload.point(longest, "nocdyn rk853")
    rivals = [point for point in workload.points[longest] if point.contestant.label.endswith("DOP853")]
    rival = min(rivals, key=lambda point: point.seconds, default=None)
    place = f"{workload.name}, N = {longest.bodies}"
    if own and rival:
        factor = own.seconds / rival.seconds
        against = Verdict(
            f"{place}: nocdyn rk853 takes {factor:.2f} times as long as {rival.contestant.label} "
            f"({1e3 * own.seconds:.3g} and {1e3 * rival.seconds:.3g} ms); wanted at most 1.5",
            factor <= 1.5,
        )
    else:
        against = Verdict(f"{place}: nocdyn rk853 beside a DOP853", None)
    return [against, growth(workload, "nocdyn rk853")]


def stiff_chain_verdicts(workload: Scaling) -> list[Verdict]:
    return [growth(workload, label) for label in IMPLICIT]


def growth(workload: Scaling, label: str) -> Verdict:
    """Between the two longest chains; per step, for the number of steps is the solution's affair."""
    sentence = f"{workload.name}: the time of a step of {label} grows with"
    if len(workload.chains) < 2:
        return Verdict(f"{sentence} N", None)
    shorter, longer = workload.chains[-2:]
    first, last = workload.point(shorter, label), workload.point(longer, label)
    if not (first and last):
        return Verdict(f"{sentence} N", None)
    exponent = (math.log(last.seconds / last.steps) - math.log(first.seconds / first.steps)) / math.log(
        longer.bodies / shorter.bodies
    )
    return Verdict(
        f"{sentence} N^{exponent:.2f} from {shorter.bodies} to {longer.bodies} rotors; wanted linear (at most N^{GROWTH})",
        exponent <= GROWTH,
    )


def throughput_verdicts(workload: Throughput) -> list[Verdict]:
    rules = {
        "W2": [
            ("nocdyn rk45", "hand-written loop", 6.0),
            ("nocdyn taylor, compiled", "hand-written loop", 15.0),
            ("nocdyn taylor, compiled", "heyoka with the peak", 6.0),
            ("nocdyn taylor, compiled, 2 threads", "nocdyn taylor, compiled", 1.95),
        ],
        "W5_sweep": [
            ("nocdyn taylor, compiled", "heyoka with the peak", 5.0),
            ("nocdyn taylor, compiled", "heyoka, final state only", 3.0),
        ],
        "W6_sweep": [("nocdyn taylor, compiled", "heyoka with the peak", 12.0)],
    }
    memory = [little_memory(workload)] if workload.counts else []
    return [*(faster(workload, *rule) for rule in rules[workload.name]), *memory]


def faster(workload: Throughput, own: str, rival: str, least: float) -> Verdict:
    ours, theirs = workload.rate(own), workload.rate(rival)
    if not (ours and theirs):
        return Verdict(f"{workload.name}: {own} beside {rival}, wanted {least:g} times as many variants per second", None)
    factor = ours.best / theirs.best
    return Verdict(
        f"{workload.name}: {own} makes {ours.best:.4g} variants per second, {factor:.2f} times as many as {rival} "
        f"({theirs.best:.4g}); wanted {least:g} times",
        factor >= least,
    )


def little_memory(workload: Throughput, most: float = 500.0) -> Verdict:
    largest = max(workload.memory.values(), default=None)
    if largest is None:
        return Verdict(f"{workload.name}: memory below {most:g} MB", None)
    sizes = ", ".join(f"{megabytes:.0f} MB for {count} variants" for count, megabytes in workload.memory.items())
    return Verdict(f"{workload.name}: the process needs {sizes}; wanted below {most:g} MB", largest < most)


def torsional_verdicts(workload: Torsional) -> list[Verdict]:
    sentence = f"A response of 16 bodies: openTorsion takes {workload.ratio:.3g} times as long, at least {FACTOR:g} times wanted"
    return [Verdict(sentence, workload.ratio >= FACTOR)]
