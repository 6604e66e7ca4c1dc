"""The method auto costs at most 1.3 times as much as the best single method, counted in steps, on the shipped machines."""

import math

import pytest
from conftest import SOURCE

LARGEST = 1.3
SLOW = {"engine", "chain_200"}  # seconds in a debug build
FILES = [
    path
    for folder in ("examples/*", "paper")
    for path in sorted((SOURCE / "input").glob(f"{folder}/*.nml"))
    if path.stem not in SLOW
]
DEFAULTS = ("--set", "run.rtol=1e-6", "--set", "run.atol=1e-9")
TIGHT = [path for path in FILES if path.stem in {"three_rotors", "case1", "case2", "differential", "backlash", "wind_turbine"}]
METHODS = ("rk853", "rodas5p", "taylor")
# Of a step, measured on machines of a few bodies in runs that follow the extremes of all columns; of taylor for each order.
COSTS = {"rk853": 1.0, "rodas5p": 1.0, "taylor": 0.145}
EVALUATIONS = {"rk853": 15, "rodas5p": 8, "taylor": 1}


def counts_of(nocdyn, path, method, tolerances):
    outcome = nocdyn("run", path, "--quiet", "--out", "out", "--set", f"run.method={method}", *tolerances)
    if method == "taylor" and "has no Taylor series" in outcome.stderr:
        return None
    assert outcome.returncode == 0, outcome.stderr
    return nocdyn.summary("out")


def attempts_of(summary):
    return summary["counts"]["accepted_steps"] + summary["counts"]["rejected_steps"]


def cost_of_step(method, summary):
    order = math.ceil(3 - 0.7 * math.log(summary["settings"]["rtol"]))
    return COSTS[method] * (order if method == "taylor" else 1)


def cost_of_auto(summary, has_series):
    """Of the attempts that are not implicit, the evaluations tell which are explicit."""
    implicit = summary["counts"]["factorisations"]
    others = attempts_of(summary) - implicit
    left = summary["counts"]["evaluations"] - EVALUATIONS["rodas5p"] * implicit - others
    explicit = min(max(left / (EVALUATIONS["rk853"] - 1), 0), others) if has_series else others
    numbers = {"rk853": explicit, "rodas5p": implicit, "taylor": others - explicit}
    return sum(number * cost_of_step(method, summary) for method, number in numbers.items())


@pytest.mark.parametrize(
    ("path", "tolerances"),
    [*((path, DEFAULTS) for path in FILES), *((path, ()) for path in TIGHT)],
    ids=lambda value: value.stem if hasattr(value, "stem") else "defaults" if value else "input",
)
def test_auto_is_worth_being_the_default(nocdyn, path, tolerances):
    single = {method: counts_of(nocdyn, path, method, tolerances) for method in METHODS}
    best = min(attempts_of(summary) * cost_of_step(method, summary) for method, summary in single.items() if summary)
    assert cost_of_auto(counts_of(nocdyn, path, "auto", tolerances), single["taylor"] is not None) <= LARGEST * best
