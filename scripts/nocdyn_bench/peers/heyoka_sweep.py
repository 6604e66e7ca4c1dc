"""heyoka on variants of case 2: a batch of machines in the lanes of the processor's registers."""

import time

import heyoka
import numba
import numpy as np

from ..problems import Case2
from ..variants import Found, SweepContestant
from .right_hand_sides import CASE2_END

# Lanes, the fastest of 8, 16, 32 ... 256: many of them make the way through Python cheap where every step takes it.
LANES, STEPPED_LANES = 16, 256
STIFFNESS = Case2.stiffness


def contestants() -> list[SweepContestant]:
    return [
        SweepContestant(
            "heyoka with the peak",
            f"{STEPPED_LANES} lanes, each refilled when it ends; peaks from the Taylor "
            "coefficients of each step, by a function compiled by Numba",
            _Peaks(STEPPED_LANES).solve,
        ),
        SweepContestant("heyoka, final state only", f"{LANES} lanes, propagate_until", _Ends(LANES).solve, has_peak=False),
    ]


def accurate_results(parameters: np.ndarray) -> np.ndarray:
    """States at the end and largest |moment| of each variant, with 80-bit numbers and heyoka's event detection."""
    real, twist = np.longdouble, [0.0]

    def keep(integrator, t, sign):
        integrator.update_d_output(t)
        state = integrator.d_output
        twist[0] = max(twist[0], abs(state[3] - state[2]))

    equations = _equations(real)
    extreme = heyoka.nt_event(equations[3][1] - equations[2][1], keep, fp_type=real)
    integrator = heyoka.taylor_adaptive(
        equations, np.zeros(4, dtype=real), tol=real(1e-18), fp_type=real, pars=np.zeros(2, dtype=real), nt_events=[extreme]
    )
    found = np.empty((len(parameters), 5))
    for row, variant in zip(found, parameters):
        integrator.time, twist[0] = real(0), real(0)
        integrator.state[:], integrator.pars[:] = 0, variant
        integrator.propagate_until(real(CASE2_END))
        largest = max(twist[0], abs(integrator.state[3] - integrator.state[2]))
        row[:4], row[4] = integrator.state, (real(Case2.stiffness) + real(variant[1]) * largest**2) * largest
    return found


def _equations(real: type) -> list:
    """par[0] is the viscous load c, par[1] the cubic stiffness k1."""
    omega_1, omega_2, phi_1, phi_2 = heyoka.make_vars("omega_1", "omega_2", "phi_1", "phi_2")
    ratio2 = (real(2) / real(3)) ** 2
    inertia_23 = real(Case2.inertia_2) + ratio2 * real(Case2.inertia_3)
    twist = phi_2 - phi_1
    moment = (real(Case2.stiffness) + heyoka.par[1] * twist * twist) * twist
    motor = real(Case2.motor_a) - (real(Case2.motor_b) + real(Case2.motor_c) * omega_1) * omega_1
    excitation = real(Case2.amplitude) * heyoka.sin(real(Case2.frequency) * heyoka.time)
    return [
        (omega_1, (motor + excitation + moment) / real(Case2.inertia_1)),
        (omega_2, -(moment + ratio2 * heyoka.par[0] * omega_2) / inertia_23),
        (phi_1, omega_1),
        (phi_2, omega_2),
    ]


class _Batches:
    """The integrators of the tolerances asked for so far: compiling is not counted."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        self.integrators: dict[float, heyoka.taylor_adaptive_batch] = {}

    def integrator(self, tolerance: float) -> "heyoka.taylor_adaptive_batch":
        if tolerance not in self.integrators:
            self.integrators[tolerance] = heyoka.taylor_adaptive_batch(
                _equations(float), np.zeros((4, self.lanes)), tol=tolerance, pars=np.zeros((2, self.lanes)), force_avx512=True
            )
        integrator = self.integrators[tolerance]
        integrator.set_time(0.0)
        integrator.state[:] = 0.0
        return integrator


class _Ends(_Batches):
    def solve(self, tolerance: float, parameters: np.ndarray) -> Found:
        integrator = self.integrator(tolerance)
        found = np.full((len(parameters), 5), np.nan)
        began = time.perf_counter()
        for first in range(0, len(parameters), self.lanes):
            some = parameters[first : first + self.lanes]
            integrator.set_time(0.0)
            integrator.state[:] = 0.0
            integrator.pars[:, : len(some)] = some.T
            integrator.propagate_until(CASE2_END)
            found[first : first + self.lanes, :4] = integrator.state.T[: len(some)]
        return Found(time.perf_counter() - began, found)


class _Peaks(_Batches):
    def solve(self, tolerance: float, parameters: np.ndarray) -> Found:
        integrator = self.integrator(tolerance)
        lanes = _Lanes(integrator, parameters)
        lanes.go_on()  # compiles
        lanes = _Lanes(integrator, parameters)
        began = time.perf_counter()
        while lanes.are_busy:
            integrator.step(lanes.left, write_tc=True)
            if lanes.go_on():
                integrator.set_time(lanes.t)
        return Found(time.perf_counter() - began, lanes.found)


class _Lanes:
    """Which variant is in which lane, its time, the time left, and its largest |twist| so far."""

    def __init__(self, integrator: "heyoka.taylor_adaptive_batch", parameters: np.ndarray) -> None:
        self.integrator, self.parameters = integrator, parameters
        self.found = np.full((len(parameters), 5), np.nan)
        lanes = integrator.batch_size
        self.variant = np.full(lanes, -1)
        self.t, self.left, self.twist = np.full(lanes, CASE2_END), np.zeros(lanes), np.zeros(lanes)
        self.next = np.zeros(1, dtype=int)
        _refill(
            np.arange(lanes),
            self.next,
            parameters,
            self.variant,
            self.t,
            self.left,
            self.twist,
            integrator.state,
            integrator.pars,
        )
        integrator.set_time(self.t)

    @property
    def are_busy(self) -> bool:
        return bool((self.variant >= 0).any())

    def go_on(self) -> bool:
        """After a step; true if a lane has got another variant."""
        return _go_on(
            self.integrator.tc,
            self.integrator.last_h,
            self.integrator.state,
            self.integrator.pars,
            self.parameters,
            self.found,
            self.next,
            self.variant,
            self.t,
            self.left,
            self.twist,
        )


@numba.njit
def _refill(lanes, following, parameters, variant, t, left, twist, state, pars):
    for lane in lanes:
        state[:, lane], twist[lane] = 0.0, 0.0
        if following[0] < len(parameters):
            variant[lane], t[lane], left[lane] = following[0], 0.0, CASE2_END
            pars[:, lane] = parameters[following[0]]
            following[0] += 1
        else:
            variant[lane], t[lane], left[lane] = -1, CASE2_END, 0.0


@numba.njit
def _go_on(tc, last_h, state, pars, parameters, found, following, variant, t, left, twist):
    is_refilled = False
    for lane in range(len(variant)):
        i = variant[lane]
        if i < 0:
            continue
        h = last_h[lane]
        before, after = tc[1, 0, lane] - tc[0, 0, lane], state[1, lane] - state[0, lane]
        if before * after < 0.0:
            twist[lane] = max(twist[lane], abs(_extreme_twist(tc, lane, h, before, after)))
        if h < left[lane]:
            t[lane] += h
            left[lane] = CASE2_END - t[lane]
            continue
        found[i, :4] = state[:, lane]
        largest = max(twist[lane], abs(state[3, lane] - state[2, lane]))
        found[i, 4] = (STIFFNESS + parameters[i, 1] * largest**2) * largest
        _refill(np.array([lane]), following, parameters, variant, t, left, twist, state, pars)
        is_refilled = True
    return is_refilled


@numba.njit
def _extreme_twist(tc, lane, h, before, after):
    """Where the rate of the twist is zero: Newton's method, kept in the interval by bisection."""
    order, low, high = tc.shape[1] - 1, 0.0, h
    t = h * before / (before - after)
    for _ in range(20):
        value, slope = tc[1, order, lane] - tc[0, order, lane], 0.0
        for k in range(order - 1, -1, -1):
            slope = slope * t + value
            value = value * t + tc[1, k, lane] - tc[0, k, lane]
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
    twist = 0.0
    for k in range(order, -1, -1):
        twist = twist * t + tc[3, k, lane] - tc[2, k, lane]
    return twist
