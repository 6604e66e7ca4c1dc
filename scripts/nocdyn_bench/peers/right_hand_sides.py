"""The equations of the workloads, compiled by Numba for SciPy and numbalsoda."""

from collections.abc import Callable
from math import sin

import numba
import numpy as np

from ..problems import Case2, Chain, Problem

CASE2_END = 10.0  # [s]


def derivative(problem: Problem, interleaved: bool = False) -> Callable:
    """f(t, y, dydt), compiled. `interleaved`: a chain's states omega_1, phi_1, omega_2 ..., which makes a narrow band."""
    if isinstance(problem, Case2):
        return _case2(problem)
    return _interleaved_chain(problem) if interleaved else _chain(problem)


def variant_derivative(problem: Case2) -> Callable:
    """f(t, y, dydt, viscous, cubic_stiffness), compiled."""
    stiffness, ratio2 = problem.stiffness, problem.ratio**2
    over_1, over_23 = 1.0 / problem.inertia_1, 1.0 / problem.inertia_23
    a, b, c = problem.motor_a, problem.motor_b, problem.motor_c
    amplitude, frequency = problem.amplitude, problem.frequency

    @numba.njit
    def compiled(t, y, dydt, viscous, cubic):
        twist = y[3] - y[2]
        moment = (stiffness + cubic * twist * twist) * twist
        dydt[0] = (a - (b + c * y[0]) * y[0] + amplitude * sin(frequency * t) + moment) * over_1
        dydt[1] = -(moment + ratio2 * viscous * y[1]) * over_23
        dydt[2] = y[0]
        dydt[3] = y[1]

    return compiled


def _case2(problem: Case2) -> Callable:
    fill, viscous, cubic = variant_derivative(problem), problem.viscous, problem.cubic_stiffness

    @numba.njit
    def compiled(t, y, dydt):
        fill(t, y, dydt, viscous, cubic)

    return compiled


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
