"""heyoka: Taylor series, compiled by LLVM for each system and tolerance."""

import time

import heyoka
import numpy as np

from ..contestant import Contestant, ContestantError, Run, Solve
from ..problems import Case2, Problem
from ..shipped import Shipped
from .heyoka_models import Model

NEAR = 1e-9  # [s]: an output time that is the end of a piece


def contestants(problem: Problem) -> list[Contestant]:
    """heyoka has one tolerance; it is given rtol."""
    note = "compiled once, propagate_grid, high_accuracy off"
    if isinstance(problem, Shipped) and problem.tables:
        note += "; gaps: terminal events, tables: piece by piece"
    return [Contestant("heyoka", note, _solve(problem))]


def accurate_states(problem: Case2 | Shipped) -> np.ndarray:
    """With 80-bit numbers and their full accuracy, rounded to doubles."""
    model = Model(problem, np.longdouble)
    integrator = model.integrator(1e-19)
    _start(model, integrator)
    return _states(model, integrator, _grids(model))[0].astype(float)


def _solve(problem: Problem) -> Solve:
    model, integrators = Model(problem), {}
    grids = _grids(model)

    def solve(rtol: float, atol: float, repetitions: int) -> Run:
        if rtol not in integrators:
            integrators[rtol] = model.integrator(rtol)
        integrator = integrators[rtol]
        seconds = []
        for _ in range(repetitions):
            _start(model, integrator)
            began = time.perf_counter()
            states, steps = _states(model, integrator, grids)
            seconds.append(time.perf_counter() - began)
        return Run(seconds, states, steps=steps)

    return solve


def _start(model: Model, integrator: "heyoka.taylor_adaptive") -> None:
    integrator.time, integrator.state[:] = model.real(0), model.problem.start
    integrator.pars[:] = model.start_pars(np.zeros((1, 0)))[0]


def _grids(model: Model) -> list[tuple[np.ndarray, np.ndarray]]:
    """Of each piece: its times, ends included; which of them are output times that no piece before it has."""
    outputs = model.problem.times
    times = np.arange(len(outputs)) * (model.real(outputs[-1]) / (len(outputs) - 1))
    found, since = [], times[0]
    for until, _ in model.pieces:
        nearest = times[np.abs(times - until).argmin()]
        until = nearest if abs(nearest - until) < NEAR else model.real(until)
        grid = np.unique([since, *times[(since <= times) & (times <= until)], until])
        found.append((grid, np.isin(grid, times) & ((grid > since) | (since == times[0]))))
        since = until
    return found


def _states(model: Model, integrator: "heyoka.taylor_adaptive", grids: list) -> tuple[np.ndarray, int]:
    """At the output times, and the number of steps."""
    found, steps = [], 0
    for (_, lines), (grid, is_output) in zip(model.pieces, grids):
        integrator.pars[model.piece_pars] = lines
        outcome, *_, taken, _, states = integrator.propagate_grid(grid)
        if outcome != heyoka.taylor_outcome.time_limit:
            raise ContestantError(str(outcome))
        found.append(states[is_output])
        steps += int(taken)
    return np.concatenate(found), steps
