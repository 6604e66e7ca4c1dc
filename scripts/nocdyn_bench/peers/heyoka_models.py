"""The machines as heyoka takes them: expressions, parameters, and events at which parameters change."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import heyoka
import numpy as np

from ..problems import Case2, Chain, Problem
from ..shipped import COUPLING_KEYS, Shipped

COMPACT_ABOVE = 20  # bodies: from there on, code that is compiled in reasonable time


@dataclass(frozen=True)
class Gap:
    """A coupling with a gap: its moment is p0 twist + p1 rate + p2, with other p on every branch of its law.

    The branch on a side s = 1 or -1 follows from the signs of three indicators: the penetration x = s twist - gap / 2, and the
    damping moment s d rate less and plus the elastic moment k x, whose size it does not exceed. Both are divided by k: heyoka
    ignores an event for a while after it happened, the longer the larger the numbers of all events are.
    """

    par: int  # the first of its three parameters
    first: int  # the bodies that it joins
    second: int
    values: list[int | float]  # stiffness, damping, gap: the number of a target, or the value itself

    def indicators(self, omega, phi, stiffness, damping, gap) -> list:
        twist, rate = phi[self.second] - phi[self.first], omega[self.second] - omega[self.first]
        found = []
        for side in (1.0, -1.0):
            depth = side * twist - 0.5 * gap
            viscous = side * damping / stiffness * rate
            found += [depth, viscous - depth, viscous + depth]
        return found

    def law(self, indicators: list, stiffness, damping, gap) -> tuple:
        for side, (depth, above, below) in ((1.0, indicators[:3]), (-1.0, indicators[3:])):
            if depth > 0.0 and above > 0.0:
                return 2.0 * stiffness, 0.0, -side * stiffness * gap
            if depth > 0.0 and below > 0.0:
                return stiffness, damping, -0.5 * side * stiffness * gap
        return 0.0, 0.0, 0.0


@dataclass
class Model:
    """Of a problem, with numbers of the kind `real`; the first parameters are the targets."""

    problem: Problem
    real: type = float
    targets: tuple[str, ...] = ()
    gaps: list[Gap] = field(default_factory=list)
    tables: list[np.ndarray] = field(default_factory=list)  # each has two parameters, the last ones

    def __post_init__(self) -> None:
        self.variables = heyoka.make_vars(*(f"y_{i}" for i in range(self.problem.states)))
        self.pars = len(self.targets)
        omega, phi = self._halves(self.variables)
        make = {Case2: self._case2, Chain: self._chain, Shipped: self._shipped}[type(self.problem)]
        self.equations = list(zip(self.variables, [*make(omega, phi), *omega]))

    def integrator(self, tolerance: float, events: tuple = ()) -> "heyoka.taylor_adaptive":
        """`events`: non-terminal ones."""
        return heyoka.taylor_adaptive(
            self.equations,
            self.problem.start.astype(self.real),
            tol=self.real(tolerance),
            fp_type=self.real,
            pars=np.zeros(self.pars, dtype=self.real),
            t_events=self._switches(heyoka.t_event, fp_type=self.real),
            nt_events=list(events),
            compact_mode=self._is_compact,
        )

    def batch(self, tolerance: float, lanes: int) -> "heyoka.taylor_adaptive_batch":
        return heyoka.taylor_adaptive_batch(
            self.equations,
            np.tile(self.problem.start[:, None], lanes),
            tol=tolerance,
            pars=np.zeros((self.pars, lanes)),
            t_events=self._switches(heyoka.t_event_batch),
            force_avx512=True,
            compact_mode=self._is_compact,
        )

    @property
    def _is_compact(self) -> bool:
        return self.problem.states > 2 * COMPACT_ABOVE

    @cached_property
    def pieces(self) -> list[tuple[float, np.ndarray]]:
        """Until when the tables are linear, and their lines: value at time 0 and slope. The last piece ends with the motion."""
        end = self.problem.times[-1]
        times = sorted({end, *(t for table in self.tables for t in table[:, 0] if 0.0 < t < end)})
        return [
            (until, np.ravel([_line(table, since, until) for table in self.tables]))
            for since, until in itertools.pairwise([0.0, *times])
        ]

    @property
    def piece_pars(self) -> slice:
        """Which parameters those of the pieces are."""
        return slice(self.pars - 2 * len(self.tables), self.pars)

    def start_pars(self, parameters: np.ndarray) -> np.ndarray:
        """At time 0, in the middle of all gaps; shape [variants, pars]."""
        found = np.zeros((len(parameters), self.pars))
        found[:, : len(self.targets)] = parameters
        found[:, self.piece_pars] = self.pieces[0][1]
        return found

    def _switches(self, event: type, **options) -> list:
        found = []
        for gap in self.gaps:
            indicators = gap.indicators(*self._halves(self.variables), *self._expressions(gap.values))
            found += [event(one, callback=self._switch(gap, i), **options) for i, one in enumerate(indicators)]
        return found

    def _switch(self, gap: Gap, number: int) -> Callable:
        """What happens where an indicator becomes zero: the parameters are those of the branch beyond."""

        def act(integrator, sign, *lane) -> bool:
            pars = integrator.pars[:, *lane]
            values = [pars[value] if isinstance(value, int) else value for value in gap.values]
            indicators = gap.indicators(*self._halves(integrator.state[:, *lane]), *values)
            indicators[number] = sign
            pars[gap.par : gap.par + 3] = gap.law(indicators, *values)
            return True

        return act

    def twist(self, states: Sequence) -> tuple:
        """Of the coupling that is looked at, and its rate."""
        (first, second), (omega, phi) = self.problem.watched, self._halves(states)
        return phi[second] - phi[first], omega[second] - omega[first]

    def _halves(self, states: Sequence) -> tuple[Sequence, Sequence]:
        """omega and phi."""
        return states[: len(states) // 2], states[len(states) // 2 :]

    def _expressions(self, values: list[int | float]) -> list:
        return [heyoka.par[value] if isinstance(value, int) else self.real(value) for value in values]

    def _case2(self, omega: list, phi: list) -> list:
        problem, real = self.problem, self.real
        viscous, cubic = (
            (heyoka.par[0], heyoka.par[1]) if self.targets else (real(problem.viscous), real(problem.cubic_stiffness))
        )
        ratio2 = (real(2) / real(3)) ** 2
        inertia_23 = real(problem.inertia_2) + ratio2 * real(problem.inertia_3)
        twist = phi[1] - phi[0]
        moment = (real(problem.stiffness) + cubic * twist * twist) * twist
        motor = real(problem.motor_a) - (real(problem.motor_b) + real(problem.motor_c) * omega[0]) * omega[0]
        excitation = real(problem.amplitude) * heyoka.sin(real(problem.frequency) * heyoka.time)
        return [(motor + excitation + moment) / real(problem.inertia_1), -(moment + ratio2 * viscous * omega[1]) / inertia_23]

    def _chain(self, omega: list, phi: list) -> list:
        problem, moments = self.problem, []
        for i in range(problem.bodies - 1):
            twist = phi[i + 1] - phi[i]
            law = (problem.stiffness + problem.cubic_stiffness * twist * twist) * twist
            moments.append(law + problem.damping * (omega[i + 1] - omega[i]))
        rates = [after - before for before, after in itertools.pairwise(moments)]
        return [problem.torque + moments[0], *rates, -moments[-1] - problem.viscous * omega[-1]]

    def _shipped(self, omega: list, phi: list) -> list:
        problem, real = self.problem, self.real
        torques = [[real(a) - (real(b) + real(c) * speed) * speed] for (a, b, c), speed in zip(problem.motor, omega)]
        for values, (first, second) in zip(self._coupling_values(), problem.ends):
            stiffness, damping, _ = self._expressions(values)
            constant = real(0)
            if values[2] != 0.0:
                self.gaps.append(Gap(self.pars, first, second, values))
                stiffness, damping, constant = (heyoka.par[self.pars + i] for i in range(3))
                self.pars += 3
            moment = stiffness * (phi[second] - phi[first]) + damping * (omega[second] - omega[first]) + constant
            torques[first].append(moment)
            torques[second].append(-moment)
        for body, harmonics in problem.orders:
            torques[body] += [real(size) * heyoka.sin(real(order) * phi[body] + real(phase)) for order, size, phase in harmonics]
        for body, table in problem.tables:
            torques[body].append(heyoka.par[self.pars] + heyoka.par[self.pars + 1] * heyoka.time)
            self.tables.append(table)
            self.pars += 2
        return [sum(some[1:], some[0]) / real(inertia) for some, inertia in zip(torques, problem.values("body", "inertia"))]

    def _coupling_values(self) -> list[list[int | float]]:
        """Of each coupling what is of each gap."""
        found = self.problem.numbers().reshape(len(COUPLING_KEYS), -1).T.tolist()
        for i, target in enumerate(self.targets):
            key, coupling = self.problem.place(target)
            found[coupling][key] = i
        return found


def _line(table: np.ndarray, since: float, until: float) -> tuple[float, float]:
    """Value at time 0 and slope where the table is linear."""
    before, after = np.interp([since, until], *table.T)
    slope = (after - before) / (until - since)
    return before - slope * since, slope
