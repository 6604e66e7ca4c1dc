"""SciPy with a right-hand side compiled by Numba."""

import time

import numpy as np
from scipy.integrate import ode, solve_ivp

from ..contestant import Contestant, ContestantError, Run, Solve
from ..problems import Chain, Problem
from .right_hand_sides import returning

NOTES = {
    "RK45": "solve_ivp, t_eval",
    "DOP853": "solve_ivp, t_eval",
    "LSODA": "solve_ivp, t_eval; lband and uband for the chain",
    "Radau": "solve_ivp, t_eval, Jacobian by differences",
    "ode DOP853": "the compiled DOP853 of scipy.integrate.ode, no dense output",
}
MOST_STEPS = 10**8


def contestants(problem: Problem, methods: list[str]) -> list[Contestant]:
    return [
        Contestant(
            f"SciPy {method}",
            f"{NOTES[method]}; right-hand side compiled by Numba",
            _compiled_dop853(problem) if method == "ode DOP853" else _solve(problem, method),
            slowest_point=8.0 if method == "Radau" else 2.0,
        )
        for method in methods
    ]


def _solve(problem: Problem, method: str) -> Solve:
    is_banded = isinstance(problem, Chain) and method == "LSODA"
    derivative = returning(problem, interleaved=is_banded)
    times = problem.times
    start = problem.start
    options = {"lband": 2, "uband": 3} if is_banded else {}
    derivative(0.0, start)  # compiles

    def solve(rtol: float, atol: float, repetitions: int) -> Run:
        seconds = []
        for _ in range(repetitions):
            began = time.perf_counter()
            found = solve_ivp(
                derivative, (times[0], times[-1]), start, method=method, t_eval=times, rtol=rtol, atol=atol, **options
            )
            seconds.append(time.perf_counter() - began)
            if not found.success:
                raise ContestantError(found.message)
        states = found.y.T
        if is_banded:
            states = np.hstack((states[:, 0::2], states[:, 1::2]))
        return Run(seconds, states, evaluations=int(found.nfev))

    return solve


def _compiled_dop853(problem: Problem) -> Solve:
    derivative, t_end, start = returning(problem), problem.times[-1], problem.start
    derivative(0.0, start)  # compiles

    def solve(rtol: float, atol: float, repetitions: int) -> Run:
        seconds = []
        for _ in range(repetitions):
            integrator = ode(derivative).set_integrator("dop853", rtol=rtol, atol=atol, nsteps=MOST_STEPS)
            integrator.set_initial_value(start, 0.0)
            began = time.perf_counter()
            end = integrator.integrate(t_end)
            seconds.append(time.perf_counter() - began)
            if not integrator.successful():
                raise ContestantError("the integration failed")
        return Run(seconds, np.array([start, end]))

    return solve
