"""heyoka: Taylor series, compiled by LLVM for each system and tolerance."""

import itertools
import time

import heyoka
import numpy as np

from ..contestant import Contestant, ContestantError, Run, Solve
from ..problems import Case2, Chain, Problem

COMPACT_ABOVE = 20  # bodies: from there on, code that is compiled in reasonable time


def contestants(problem: Problem) -> list[Contestant]:
    """heyoka has one tolerance; it is given rtol."""
    return [Contestant("heyoka", "compiled once, propagate_grid, high_accuracy off", _solve(problem))]


def accurate_states(problem: Case2) -> np.ndarray:
    """With 80-bit numbers and their full accuracy, rounded to doubles."""
    real = np.longdouble
    integrator = _integrator(problem, real, real(1e-19))
    grid = np.arange(len(problem.times)) * (real(10) / 1000)
    integrator.state[:] = 0
    return integrator.propagate_grid(grid)[-1].astype(float)


def _solve(problem: Problem) -> Solve:
    integrators = {}
    times = problem.times

    def solve(rtol: float, atol: float, repetitions: int) -> Run:
        if rtol not in integrators:
            integrators[rtol] = _integrator(problem, float, rtol)
        integrator = integrators[rtol]
        seconds = []
        for _ in range(repetitions):
            integrator.time = 0.0
            integrator.state[:] = 0.0
            began = time.perf_counter()
            found = integrator.propagate_grid(times)
            seconds.append(time.perf_counter() - began)
            if found[0] != heyoka.taylor_outcome.time_limit:
                raise ContestantError(str(found[0]))
        return Run(seconds, found[-1], steps=int(found[3]))

    return solve


def _integrator(problem: Problem, real: type, tolerance: float) -> "heyoka.taylor_adaptive":
    equations = _case2(problem, real) if isinstance(problem, Case2) else _chain(problem)
    is_compact = isinstance(problem, Chain) and problem.bodies > COMPACT_ABOVE
    return heyoka.taylor_adaptive(
        equations, np.zeros(problem.states, dtype=real), tol=tolerance, fp_type=real, compact_mode=is_compact
    )


def _case2(problem: Case2, real: type) -> list:
    omega_1, omega_2, phi_1, phi_2 = heyoka.make_vars("omega_1", "omega_2", "phi_1", "phi_2")
    ratio2 = (real(2) / real(3)) ** 2
    inertia_23 = real(problem.inertia_2) + ratio2 * real(problem.inertia_3)
    twist = phi_2 - phi_1
    moment = (real(problem.stiffness) + real(problem.cubic_stiffness) * twist * twist) * twist
    motor = real(problem.motor_a) - (real(problem.motor_b) + real(problem.motor_c) * omega_1) * omega_1
    excitation = real(problem.amplitude) * heyoka.sin(real(problem.frequency) * heyoka.time)
    return [
        (omega_1, (motor + excitation + moment) / real(problem.inertia_1)),
        (omega_2, -(moment + ratio2 * real(problem.viscous) * omega_2) / inertia_23),
        (phi_1, omega_1),
        (phi_2, omega_2),
    ]


def _chain(problem: Chain) -> list:
    n = problem.bodies
    variables = heyoka.make_vars(*(f"omega_{i}" for i in range(n)), *(f"phi_{i}" for i in range(n)))
    omega, phi = variables[:n], variables[n:]
    moments = []
    for i in range(n - 1):
        twist = phi[i + 1] - phi[i]
        moments.append(
            (problem.stiffness + problem.cubic_stiffness * twist * twist) * twist + problem.damping * (omega[i + 1] - omega[i])
        )
    rates = [after - before for before, after in itertools.pairwise(moments)]
    equations = [(omega[0], problem.torque + moments[0])]
    equations += list(zip(omega[1:-1], rates))
    equations += [(omega[-1], -moments[-1] - problem.viscous * omega[-1])]
    return equations + list(zip(phi, omega))
