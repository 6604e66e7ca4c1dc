"""The equations of the workloads, compiled by Numba for SciPy and numbalsoda."""

from collections.abc import Callable
from math import sin

import numba
import numpy as np

from ..problems import Case2, Chain, Problem
from ..shipped import Shipped


def derivative(problem: Problem, interleaved: bool = False) -> Callable:
    """f(t, y, dydt), compiled. `interleaved`: a chain's states omega_1, phi_1, omega_2 ..., which makes a narrow band."""
    if not isinstance(problem, Chain):
        return _with_own_numbers(problem)
    return _interleaved_chain(problem) if interleaved else _chain(problem)


def variant_derivative(problem: Case2 | Shipped) -> Callable:
    """f(t, y, dydt, p), compiled; p is a row of the problem's `numbers`."""
    return _case2(problem) if isinstance(problem, Case2) else _shipped(problem)


def _with_own_numbers(problem: Case2 | Shipped) -> Callable:
    fill, numbers = variant_derivative(problem), problem.numbers()[0]

    @numba.njit
    def compiled(t, y, dydt):
        fill(t, y, dydt, numbers)

    return compiled


def _case2(problem: Case2) -> Callable:
    stiffness, ratio2 = problem.stiffness, problem.ratio**2
    over_1, over_23 = 1.0 / problem.inertia_1, 1.0 / problem.inertia_23
    a, b, c = problem.motor_a, problem.motor_b, problem.motor_c
    amplitude, frequency = problem.amplitude, problem.frequency

    @numba.njit
    def compiled(t, y, dydt, p):
        twist = y[3] - y[2]
        moment = (stiffness + p[1] * twist * twist) * twist
        dydt[0] = (a - (b + c * y[0]) * y[0] + amplitude * sin(frequency * t) + moment) * over_1
        dydt[1] = -(moment + ratio2 * p[0] * y[1]) * over_23
        dydt[2] = y[0]
        dydt[3] = y[1]

    return compiled


def _shipped(problem: Shipped) -> Callable:
    """Kinks of the laws are inside of the right-hand side."""
    n, couplings, ends, inertia, motor = (
        problem.bodies,
        len(problem.ends),
        problem.ends,
        problem.values("body", "inertia"),
        problem.motor,
    )
    shakes = [(body, *harmonic) for body, harmonics in problem.orders for harmonic in harmonics]
    bodies = np.array([shake[0] for shake in shakes], dtype=np.int64)
    order, amplitude, phase = np.array([shake[1:] for shake in shakes]).reshape(-1, 3).T.copy()
    on_tables = np.array([body for body, _ in problem.tables], dtype=np.int64)
    times, torques = np.concatenate([np.empty((0, 2)), *(points for _, points in problem.tables)]).T.copy()
    ends_of_tables = np.cumsum([0, *(len(points) for _, points in problem.tables)])

    @numba.njit
    def compiled(t, y, dydt, p):
        for i in range(n):
            dydt[i] = motor[i, 0] - (motor[i, 1] + motor[i, 2] * y[i]) * y[i]
            dydt[n + i] = y[i]
        for c in range(couplings):
            first, second = ends[c]
            moment = _moment(y[n + second] - y[n + first], y[second] - y[first], p[c], p[couplings + c], p[2 * couplings + c])
            dydt[first] += moment
            dydt[second] -= moment
        for k in range(len(bodies)):
            dydt[bodies[k]] += amplitude[k] * sin(order[k] * y[n + bodies[k]] + phase[k])
        for k in range(len(on_tables)):
            some = slice(ends_of_tables[k], ends_of_tables[k + 1])
            dydt[on_tables[k]] += np.interp(t, times[some], torques[some])
        for i in range(n):
            dydt[i] /= inertia[i]

    return compiled


@numba.njit
def _moment(twist, rate, stiffness, damping, gap):
    """In contact with the edge of a gap, the damping moment is limited to the size of the elastic one."""
    if gap == 0.0:
        return stiffness * twist + damping * rate
    if abs(twist) <= 0.5 * gap:
        return 0.0
    elastic = stiffness * (twist - 0.5 * np.sign(twist) * gap)
    return elastic + max(-abs(elastic), min(damping * rate, abs(elastic)))


def _chain(problem: Chain) -> Callable:
    n, stiffness, cubic, damping = problem.bodies, problem.stiffness, problem.cubic_stiffness, problem.damping
    torque, viscous = problem.torque, problem.viscous

    @numba.njit
    def compiled(t, y, dydt):
        before = torque
        for i in range(n - 1):
            twist = y[n + i + 1] - y[n + i]
            after = (stiffness + cubic * twist * twist) * twist + damping * (y[i + 1] - y[i])
            dydt[i] = before + after
            dydt[n + i] = y[i]
            before = -after
        dydt[n - 1] = before - viscous * y[n - 1]
        dydt[2 * n - 1] = y[n - 1]

    return compiled


def _interleaved_chain(problem: Chain) -> Callable:
    last, stiffness, cubic, damping = 2 * problem.bodies - 2, problem.stiffness, problem.cubic_stiffness, problem.damping
    torque, viscous = problem.torque, problem.viscous

    @numba.njit
    def compiled(t, y, dydt):
        before = torque
        for i in range(0, last, 2):
            twist = y[i + 3] - y[i + 1]
            after = (stiffness + cubic * twist * twist) * twist + damping * (y[i + 2] - y[i])
            dydt[i] = before + after
            dydt[i + 1] = y[i]
            before = -after
        dydt[last] = before - viscous * y[last]
        dydt[last + 1] = y[last]

    return compiled


def returning(problem: Problem, interleaved: bool = False) -> Callable:
    """f(t, y) for SciPy."""
    fill = derivative(problem, interleaved)

    @numba.njit
    def compiled(t, y):
        dydt = np.empty_like(y)
        fill(t, y, dydt)
        return dydt

    return compiled
