"""numbalsoda on variants: the loop over the variants is compiled by Numba as well."""

import time

import numba
import numpy as np
from numbalsoda import lsoda, lsoda_sig, solve_ivp

from ..variants import Family, Found, SolveAll, SweepContestant
from .right_hand_sides import variant_derivative

MOST_STEPS = 10**6
NOTE = (
    "{}, {} outputs, peaks from the polynomial of degree 5 through twist, rate and acceleration at two of them; "
    "all compiled by Numba"
)


def contestants(family: Family, share: float = 0.1) -> list[SweepContestant]:
    return [
        SweepContestant(f"numbalsoda {method}", NOTE.format(call, family.outputs), _solve(family, method), share=share)
        for method, call in (("DOP853", "solve_ivp"), ("LSODA", "lsoda"))
    ]


def _solve(family: Family, method: str) -> SolveAll:
    problem, is_lsoda = family.problem, method == "LSODA"
    fill, start, times = variant_derivative(problem), problem.start, np.linspace(0.0, problem.t_end, family.outputs)
    (i, j), n, count, span = problem.watched, problem.states // 2, problem.numbers().size, times[[0, -1]]

    @numba.cfunc(lsoda_sig)
    def callback(t, y, dydt, data):
        fill(t, numba.carray(y, (2 * n,)), numba.carray(dydt, (2 * n,)), numba.carray(data, (count,)))

    address = callback.address

    @numba.njit
    def integrate(numbers, tolerance, states, twists):
        dydt = np.zeros(2 * n)
        for v in range(len(numbers)):
            variant = numbers[v]
            if is_lsoda:
                y, is_done = lsoda(address, start, times, data=variant, rtol=tolerance, atol=tolerance, mxstep=MOST_STEPS)
            else:
                outcome = solve_ivp(address, span, start, times, data=variant.ctypes.data, rtol=tolerance, atol=tolerance)
                y, is_done = outcome.y, outcome.success
            if not is_done:
                continue
            largest, acceleration, last_twist, last_rate = 0.0, 0.0, 0.0, 0.0
            for k in range(len(times)):
                fill(times[k], y[k], dydt, variant)
                before, acceleration = acceleration, dydt[j] - dydt[i]
                twist, rate = y[k, n + j] - y[k, n + i], y[k, j] - y[k, i]
                if k > 0 and last_rate * rate < 0.0:
                    h = times[k] - times[k - 1]
                    largest = max(
                        largest, abs(_extreme(last_twist, twist, h * last_rate, h * rate, h * h * before, h * h * acceleration))
                    )
                last_twist, last_rate = twist, rate
            states[v], twists[v] = y[-1], max(largest, abs(last_twist))

    def solve(tolerance: float, parameters: np.ndarray) -> Found:
        states, twists = np.full((len(parameters), 2 * n), np.nan), np.full(len(parameters), np.nan)
        began = time.perf_counter()
        integrate(family.numbers(parameters), tolerance, states, twists)
        return Found(time.perf_counter() - began, family.results(states, twists, parameters))

    solve(1e-6, family.variants(1))  # compiles
    return solve


@numba.njit
def _extreme(left, right, v_0, v_1, a_0, a_1):
    """Of Hermite's polynomial in powers of (t - t_left) / h, where its rate is zero."""
    rise = right - left
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
    return left + x * (v_0 + x * (0.5 * a_0 + x * (c3 + x * (c4 + x * c5))))
