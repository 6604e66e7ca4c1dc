"""numbalsoda: LSODA in C++ and Hairer's DOP853 in Fortran, with a right-hand side compiled by Numba."""

import time

import numba
import numpy as np
from numbalsoda import dop853, lsoda, lsoda_sig, solve_ivp

from ..contestant import Contestant, ContestantError, Run, Solve
from ..problems import Problem
from .right_hand_sides import derivative

MOST_STEPS = 10**8
NOTES = {
    "DOP853": "dop853 with t_eval",
    "DOP853, dense": "solve_ivp with dense output at t_eval",
    "LSODA": "lsoda with t_eval",
}


def contestants(problem: Problem, methods: list[str]) -> list[Contestant]:
    """Of the two ways to DOP853, solve_ivp is the faster one for 1001 outputs, dop853 for two; solve_ivp fails on W4."""
    return [
        Contestant(
            f"numbalsoda {method.removesuffix(', dense')}",
            f"{NOTES[method]}; right-hand side a Numba cfunc",
            _solve(problem, method),
        )
        for method in methods
    ]


def _solve(problem: Problem, method: str) -> Solve:
    fill, states = derivative(problem), problem.states

    @numba.cfunc(lsoda_sig)
    def callback(t, y, dydt, data):
        fill(t, numba.carray(y, (states,)), numba.carray(dydt, (states,)))

    address, start, times = callback.address, problem.start, problem.times
    span = times[[0, -1]]

    def integrate(rtol: float, atol: float) -> tuple[np.ndarray, bool, int | None]:
        if method == "DOP853, dense":
            found = solve_ivp(address, span, start, times, rtol=rtol, atol=atol)
            return found.y, found.success, int(found.nfev)
        solver = {"LSODA": lsoda, "DOP853": dop853}[method]
        return *solver(address, start, times, rtol=rtol, atol=atol, mxstep=MOST_STEPS), None

    integrate(1e-3, 1e-3)  # compiles

    def solve(rtol: float, atol: float, repetitions: int) -> Run:
        seconds = []
        for _ in range(repetitions):
            began = time.perf_counter()
            found, succeeded, evaluations = integrate(rtol, atol)
            seconds.append(time.perf_counter() - began)
            if not succeeded:
                raise ContestantError("the integration failed")
        return Run(seconds, found, evaluations=evaluations)

    return solve
