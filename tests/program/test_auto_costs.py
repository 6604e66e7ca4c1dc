"""The method auto costs at most 1.3 times as much as the best single method, counted in steps, on the shipped machines."""

import csv
import math

import pytest
from conftest import SOURCE
from sweep_inputs import needs_sweeps

LARGEST = 1.3
SLOW = {"engine", "chain_200"}  # seconds in a debug build
FILES = [
    path
    for folder in ("examples/*", "paper")
    for path in sorted((SOURCE / "input").glob(f"{folder}/*.nml"))
    if path.stem not in SLOW and "&load_case" not in path.read_text()
]
DEFAULTS = ("--set", "run.rtol=1e-6", "--set", "run.atol=1e-9")
TIGHT = [path for path in FILES if path.stem in {"three_rotors", "case1", "case2", "differential", "backlash", "wind_turbine"}]
METHODS = ("rk853", "rodas5p", "taylor")
# Of a step, measured on machines of a few bodies in runs that follow the extremes of all columns; of taylor for each order.
COSTS = {"rk853": 1.0, "rodas5p": 1.0, "taylor": 0.145}
EVALUATIONS = {"rk853": 15, "rodas5p": 8, "taylor": 1}


def counts_of(nocdyn, path, method, tolerances):
    outcome = nocdyn("run", path, "--quiet", "--out", "out", "--set", f"run.method={method}", *tolerances)
    if method == "taylor" and "no Taylor series" in outcome.stderr:
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


@needs_sweeps
def test_auto_does_not_slow_down_a_sweep_by_trials(nocdyn):
    """A trial of one variant makes all of its block wait."""
    engine = (SOURCE / "input/examples/engine/engine.nml").read_text(encoding="utf-8")
    groups = (
        "&sweep design = 'random' samples = 8 /\n&vary target = 'coupling.rubber.stiffness' low = 1.5e4 high = 2.5e4 /\n"
        "&record quantity = 'moment_crank_8' statistic = 'max_abs' /\n"
    )
    nocdyn.write("sweep.nml", engine + groups)
    steps = {}
    for method in ("taylor", "auto"):
        settings = (f"run.method={method}", "run.rtol=2e-5", "run.atol=2e-5", "run.t_end=0.1")
        options = [word for setting in settings for word in ("--set", setting)]
        assert nocdyn("sweep", "sweep.nml", "--out", "out", "--csv", "-q", *options).returncode == 0
        with open(nocdyn.folder / "out/sweep.csv", newline="", encoding="utf-8") as table:
            steps[method] = sum(int(row["steps"]) for row in csv.DictReader(table))
    assert steps["auto"] <= 1.05 * steps["taylor"]
