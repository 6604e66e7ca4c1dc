"""SciPy on variants of case 2, right-hand side compiled by Numba, peaks as events."""

import time

import numba
import numpy as np
from scipy.integrate import solve_ivp

from ..problems import Case2
from ..variants import Found, SolveAll, SweepContestant
from .right_hand_sides import CASE2_END, variant_derivative

SHARE = 0.002  # of the variants


def contestants(methods: list[str]) -> list[SweepContestant]:
    return [
        SweepContestant(
            f"SciPy {method}",
            "solve_ivp, the rate of the twist an event; right-hand side compiled by Numba",
            _solve(method),
            share=SHARE,
        )
        for method in methods
    ]


def _solve(method: str) -> SolveAll:
    fill, start = variant_derivative(Case2()), np.zeros(4)

    @numba.njit
    def derivative(t, y, viscous, cubic_stiffness):
        dydt = np.empty_like(y)
        fill(t, y, dydt, viscous, cubic_stiffness)
        return dydt

    def twist_rate(t, y, viscous, cubic_stiffness):
        return y[1] - y[0]

    derivative(0.0, start, 100.0, 10.0)  # compiles

    def solve(tolerance: float, parameters: np.ndarray) -> Found:
        found = np.full((len(parameters), 5), np.nan)
        began = time.perf_counter()
        for row, variant in zip(found, parameters):
            motion = solve_ivp(
                derivative,
                (0.0, CASE2_END),
                start,
                method=method,
                t_eval=[CASE2_END],
                args=tuple(variant),
                events=twist_rate,
                rtol=tolerance,
                atol=tolerance,
            )
            row[:4] = motion.y[:, -1]
            states = np.vstack((motion.y_events[0], row[:4]))
            largest = np.abs(states[:, 3] - states[:, 2]).max()
            row[4] = (Case2.stiffness + variant[1] * largest**2) * largest
        return Found(time.perf_counter() - began, found)

    return solve
