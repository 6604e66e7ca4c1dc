"""Time against the number of rotors."""

from dataclasses import dataclass, field

from .contestant import Contestant
from .problems import Chain
from .references import Reference, chain_reference
from .rounds import Point, measure_in_turns, try_out
from .work_precision import largest

RTOL, ATOL = 1e-6, 1e-8


@dataclass
class Scaling:
    """Chains of growing length; the contestants of each length are its own."""

    name: str
    title: str
    chains: list[Chain]
    contestants: dict[Chain, list[Contestant]]
    reference_tolerance: float
    points: dict[Chain, list[Point]] = field(default_factory=dict)
    references: dict[Chain, Reference] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)

    def measure(self, rounds: int) -> None:
        for chain in self.chains:
            reference = chain_reference(chain, self.reference_tolerance)
            self.references[chain] = reference

            def judge(states, exact=reference.states):
                return {"states": largest(states[-1] - exact[-1])}

            self.points[chain], failures = try_out(self.contestants[chain], [(RTOL, ATOL)], judge)
            self.failures += [f"{chain.bodies} rotors: {failure}" for failure in failures]
            measure_in_turns(self.points[chain], rounds)

    @property
    def labels(self) -> list[str]:
        """Of all contestants, in the order of their first appearance."""
        return list(dict.fromkeys(point.contestant.label for points in self.points.values() for point in points))

    def point(self, chain: Chain, label: str) -> Point | None:
        return next((point for point in self.points[chain] if point.contestant.label == label), None)
