"""heyoka on variants: a batch of machines in the lanes of the processor's registers."""

import time

import heyoka
import numba
import numpy as np

from ..variants import Family, Found, SweepContestant
from .heyoka_models import Model


def contestants(family: Family, lanes: int, stepped_lanes: int) -> list[SweepContestant]:
    """`stepped_lanes`: of that with the peak."""
    return [
        SweepContestant(
            "heyoka with the peak",
            f"{stepped_lanes} lanes, each refilled when it ends; peaks from the Taylor "
            "coefficients of each step, by a function compiled by Numba",
            _Peaks(family, stepped_lanes).solve,
        ),
        SweepContestant(
            "heyoka, final state only", f"{lanes} lanes, propagate_until", _Ends(family, lanes).solve, has_peak=False
        ),
    ]


def accurate_results(family: Family, parameters: np.ndarray) -> np.ndarray:
    """With 80-bit numbers and heyoka's event detection."""
    model, twists = Model(family.problem, np.longdouble, family.targets), np.zeros(len(parameters))

    def keep(integrator, t, sign):
        integrator.update_d_output(t)
        twists[i] = max(twists[i], abs(model.twist(integrator.d_output)[0]))

    integrator = model.integrator(1e-18, [heyoka.nt_event(model.twist(model.variables)[1], keep, fp_type=model.real)])
    states, start_pars = np.empty((len(parameters), family.problem.states)), model.start_pars(parameters)
    for i in range(len(parameters)):
        integrator.time = model.real(0)
        integrator.state[:], integrator.pars[:] = family.problem.start, start_pars[i]
        for until, lines in model.pieces:
            integrator.pars[model.piece_pars] = lines
            integrator.propagate_until(model.real(until))
        states[i], twists[i] = integrator.state, max(twists[i], abs(model.twist(integrator.state)[0]))
    return family.results(states, twists, parameters)


class _Batches:
    """The integrators of the tolerances asked for so far: compiling is not counted."""

    def __init__(self, family: Family, lanes: int) -> None:
        self.family, self.lanes = family, lanes
        self.model = Model(family.problem, targets=family.targets)
        self.integrators: dict[float, heyoka.taylor_adaptive_batch] = {}

    def integrator(self, tolerance: float) -> "heyoka.taylor_adaptive_batch":
        if tolerance not in self.integrators:
            self.integrators[tolerance] = self.model.batch(tolerance, self.lanes)
        return self.integrators[tolerance]


class _Ends(_Batches):
    def solve(self, tolerance: float, parameters: np.ndarray) -> Found:
        integrator, model = self.integrator(tolerance), self.model
        states, start, start_pars = [], self.family.problem.start[:, None], model.start_pars(parameters).T
        began = time.perf_counter()
        for first in range(0, len(parameters), self.lanes):
            some = start_pars[:, first : first + self.lanes]
            integrator.set_time(0.0)
            integrator.state[:] = start
            integrator.pars[:, : some.shape[1]] = some
            for until, lines in model.pieces:
                integrator.pars[model.piece_pars] = lines[:, None]
                integrator.propagate_until(until)
            states.append(integrator.state.T[: some.shape[1]].copy())
        seconds = time.perf_counter() - began
        return Found(seconds, self.family.results(np.concatenate(states), np.full(len(parameters), np.nan), parameters))


class _Peaks(_Batches):
    def solve(self, tolerance: float, parameters: np.ndarray) -> Found:
        integrator = self.integrator(tolerance)
        lanes = _Lanes(self.model, integrator, parameters)
        lanes.go_on()  # compiles
        lanes = _Lanes(self.model, integrator, parameters)
        began = time.perf_counter()
        while lanes.are_busy:
            integrator.step(lanes.left, write_tc=True)
            if lanes.go_on():
                integrator.set_time(lanes.t)
        return Found(time.perf_counter() - began, self.family.results(lanes.ends, lanes.peaks, parameters))


class _Lanes:
    """Which variant is in which lane, its piece and time, the time left of the piece, and its largest |twist| so far."""

    def __init__(self, model: Model, integrator: "heyoka.taylor_adaptive_batch", parameters: np.ndarray) -> None:
        self.integrator = integrator
        self.ends, self.peaks = np.full((len(parameters), model.problem.states), np.nan), np.full(len(parameters), np.nan)
        lanes, slots = integrator.batch_size, model.piece_pars
        self.variant, self.piece = np.full(lanes, -1), np.zeros(lanes, dtype=int)
        self.t, self.left, self.twist = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
        self.following = np.zeros(1, dtype=int)
        until, lines = np.array([piece[0] for piece in model.pieces]), np.array([piece[1] for piece in model.pieces])
        self.pieces = (until, lines, slots.start)
        self.starts = (model.problem.start, model.start_pars(parameters))
        self.filling = (self.variant, self.piece, self.t, self.left, self.twist, self.following)
        _refill(np.arange(lanes), until[0], self.starts, self.filling, integrator.state, integrator.pars)
        integrator.set_time(self.t)
        self.watched = model.problem.watched

    @property
    def are_busy(self) -> bool:
        return bool((self.variant >= 0).any())

    def go_on(self) -> bool:
        """After a step; true if a lane has got another variant."""
        integrator = self.integrator
        return _go_on(
            integrator.tc,
            integrator.last_h,
            integrator.state,
            integrator.pars,
            self.watched,
            self.pieces,
            self.starts,
            self.filling,
            self.ends,
            self.peaks,
        )


@numba.njit
def _refill(lanes, until, starts, filling, state, pars):
    (variant, piece, t, left, twist, following), (start, start_pars) = filling, starts
    for lane in lanes:
        state[:, lane], twist[lane], piece[lane], t[lane] = start, 0.0, 0, 0.0
        if following[0] < len(start_pars):
            variant[lane], left[lane] = following[0], until
            pars[:, lane] = start_pars[following[0]]
            following[0] += 1
        else:
            variant[lane], left[lane] = -1, 0.0


@numba.njit
def _go_on(tc, last_h, state, pars, watched, pieces, starts, filling, ends, peaks):
    is_refilled, (i, j), n = False, watched, len(state) // 2
    (variant, piece, t, left, twist, _), (until, lines, slot) = filling, pieces
    for lane in range(len(variant)):
        v = variant[lane]
        if v < 0:
            continue
        h = last_h[lane]
        before, after = tc[j, 0, lane] - tc[i, 0, lane], state[j, lane] - state[i, lane]
        if before * after < 0.0:
            twist[lane] = max(twist[lane], abs(_extreme_twist(tc, i, j, lane, h, before, after)))
        if h < left[lane]:
            t[lane] += h
            left[lane] = until[piece[lane]] - t[lane]
            continue
        t[lane] = until[piece[lane]]
        piece[lane] += 1
        if piece[lane] < len(until):
            left[lane] = until[piece[lane]] - t[lane]
            for k in range(lines.shape[1]):
                pars[slot + k, lane] = lines[piece[lane], k]
            continue
        ends[v], peaks[v] = state[:, lane], max(twist[lane], abs(state[n + j, lane] - state[n + i, lane]))
        _refill(np.array([lane]), until[0], starts, filling, state, pars)
        is_refilled = True
    return is_refilled


@numba.njit
def _extreme_twist(tc, i, j, lane, h, before, after):
    """Where the rate of the twist is zero: Newton's method, kept in the interval by bisection."""
    order, low, high = tc.shape[1] - 1, 0.0, h
    t = h * before / (before - after)
    for _ in range(20):
        value, slope = tc[j, order, lane] - tc[i, order, lane], 0.0
        for k in range(order - 1, -1, -1):
            slope = slope * t + value
            value = value * t + tc[j, k, lane] - tc[i, k, lane]
        if value * before > 0.0:
            low = t
        else:
            high = t
        change = value / slope
        t -= change
        if abs(change) < 1e-5 * h:
            break
        if t <= low or t >= high:
            t = 0.5 * (low + high)
    twist, n = 0.0, tc.shape[0] // 2
    for k in range(order, -1, -1):
        twist = twist * t + tc[n + j, k, lane] - tc[n + i, k, lane]
    return twist
