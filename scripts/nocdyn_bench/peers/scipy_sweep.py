"""SciPy on variants, right-hand side compiled by Numba, peaks as events."""

import time

import numba
import numpy as np
from scipy.integrate import solve_ivp

from ..variants import Family, Found, SolveAll, SweepContestant
from .right_hand_sides import variant_derivative

SHARE = 0.002  # of the variants


def contestants(family: Family, methods: list[str]) -> list[SweepContestant]:
    return [
        SweepContestant(
            f"SciPy {method}",
            "solve_ivp, the rate of the twist an event; right-hand side compiled by Numba",
            _solve(family, method),
            share=SHARE,
        )
        for method in methods
    ]


def _solve(family: Family, method: str) -> SolveAll:
    problem = family.problem
    fill, start, (first, second), bodies = variant_derivative(problem), problem.start, problem.watched, problem.states // 2

    @numba.njit
    def derivative(t, y, numbers):
        dydt = np.empty_like(y)
        fill(t, y, dydt, numbers)
        return dydt

    def twist_rate(t, y, numbers):
        return y[second] - y[first]

    derivative(0.0, start, problem.numbers()[0])  # compiles

    def solve(tolerance: float, parameters: np.ndarray) -> Found:
        states, twists = np.full((len(parameters), problem.states), np.nan), np.full(len(parameters), np.nan)
        began = time.perf_counter()
        for i, numbers in enumerate(family.numbers(parameters)):
            motion = solve_ivp(
                derivative,
                (0.0, problem.t_end),
                start,
                method=method,
                t_eval=[problem.t_end],
                args=(numbers,),
                events=twist_rate,
                rtol=tolerance,
                atol=tolerance,
            )
            states[i] = motion.y[:, -1]
            reached = np.array([*motion.y_events[0], states[i]])
            twists[i] = np.abs(reached[:, bodies + second] - reached[:, bodies + first]).max()
        return Found(time.perf_counter() - began, family.results(states, twists, parameters))

    return solve
