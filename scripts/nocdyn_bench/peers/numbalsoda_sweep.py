"""numbalsoda on variants of case 2: the loop over the variants is compiled by Numba as well."""

import time

import numba
import numpy as np
from numbalsoda import lsoda, lsoda_sig, solve_ivp

from ..problems import Case2
from ..variants import Found, SolveAll, SweepContestant
from .right_hand_sides import CASE2_END, variant_derivative

OUTPUTS = 201  # close enough for a polynomial of degree 5 between two of them
MOST_STEPS = 10**6
NOTE = (
    "{}, {} outputs, peaks from the polynomial of degree 5 through twist, rate and acceleration at two of them; "
    "all compiled by Numba"
)


def contestants() -> list[SweepContestant]:
    return [
        SweepContestant(f"numbalsoda {method}", NOTE.format(call, OUTPUTS), _solve(method), share=0.1)
        for method, call in (("DOP853", "solve_ivp"), ("LSODA", "lsoda"))
    ]


def _solve(method: str) -> SolveAll:
    fill, times, is_lsoda = variant_derivative(Case2()), np.linspace(0.0, CASE2_END, OUTPUTS), method == "LSODA"
    stiffness, span = Case2.stiffness, np.array([0.0, CASE2_END])

    @numba.cfunc(lsoda_sig)
    def callback(t, y, dydt, data):
        variant = numba.carray(data, (2,))
        fill(t, numba.carray(y, (4,)), numba.carray(dydt, (4,)), variant[0], variant[1])

    address = callback.address

    @numba.njit
    def integrate(parameters, tolerance, found):
        start, dydt = np.zeros(4), np.zeros(4)
        for i in range(len(parameters)):
            variant = parameters[i]
            if is_lsoda:
                y, is_done = lsoda(address, start, times, data=variant, rtol=tolerance, atol=tolerance, mxstep=MOST_STEPS)
            else:
                outcome = solve_ivp(address, span, start, times, data=variant.ctypes.data, rtol=tolerance, atol=tolerance)
                y, is_done = outcome.y, outcome.success
            if not is_done:
                continue
            largest, acceleration = 0.0, 0.0
            for k in range(len(times)):
                fill(times[k], y[k], dydt, variant[0], variant[1])
                before, acceleration = acceleration, dydt[1] - dydt[0]
                if k > 0 and (y[k - 1, 1] - y[k - 1, 0]) * (y[k, 1] - y[k, 0]) < 0.0:
                    largest = max(largest, abs(_extreme_twist(times[k] - times[k - 1], y[k - 1], y[k], before, acceleration)))
            largest = max(largest, abs(y[-1, 3] - y[-1, 2]))
            found[i, :4] = y[-1]
            found[i, 4] = (stiffness + variant[1] * largest**2) * largest

    integrate(np.array([[100.0, 10.0]]), 1e-6, np.empty((1, 5)))  # compiles

    def solve(tolerance: float, parameters: np.ndarray) -> Found:
        found = np.full((len(parameters), 5), np.nan)
        began = time.perf_counter()
        integrate(parameters, tolerance, found)
        return Found(time.perf_counter() - began, found)

    return solve


@numba.njit
def _extreme_twist(h, left, right, left_acceleration, right_acceleration):
    """Of Hermite's polynomial in powers of (t - t_left) / h, where its rate is zero."""
    twist, rise = left[3] - left[2], right[3] - right[2] - left[3] + left[2]
    v_0, v_1 = h * (left[1] - left[0]), h * (right[1] - right[0])
    a_0, a_1 = h * h * left_acceleration, h * h * right_acceleration
    c3 = 10 * rise - 6 * v_0 - 4 * v_1 - 1.5 * a_0 + 0.5 * a_1
    c4 = -15 * rise + 8 * v_0 + 7 * v_1 + 1.5 * a_0 - a_1
    c5 = 6 * rise - 3 * (v_0 + v_1) - 0.5 * (a_0 - a_1)
    low, high, x = 0.0, 1.0, v_0 / (v_0 - v_1)
    for _ in range(20):
        value = v_0 + x * (a_0 + x * (3 * c3 + x * (4 * c4 + x * 5 * c5)))
        slope = a_0 + x * (6 * c3 + x * (12 * c4 + x * 20 * c5))
        if value * v_0 > 0.0:
            low = x
        else:
            high = x
        change = value / slope
        x -= change
        if abs(change) < 1e-5:
            break
        if x <= low or x >= high:
            x = 0.5 * (low + high)
    return twist + x * (v_0 + x * (0.5 * a_0 + x * (c3 + x * (c4 + x * c5))))
