"""The method auto costs at most 1.3 times as much as the best single method, counted in steps, on the shipped machines."""

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
# Of a step at rtol = 1e-6, measured on machines of a few bodies in runs that follow the extremes of all columns.
COSTS = {"rk853": 1.0, "rodas5p": 1.0, "taylor": 1.9}
EVALUATIONS = {"rk853": 15, "rodas5p": 8, "taylor": 1}


def counts_of(nocdyn, path, method):
    words = ("--quiet", "--out", "out", "--set", f"run.method={method}", "--set", "run.rtol=1e-6", "--set", "run.atol=1e-9")
    outcome = nocdyn("run", path, *words)
    if method == "taylor" and "has no Taylor series" in outcome.stderr:
        return None
    assert outcome.returncode == 0, outcome.stderr
    summary = nocdyn.summary("out")
    counts = summary["counts"]
    return counts["accepted_steps"] + counts["rejected_steps"], counts["evaluations"], counts["factorisations"]


def cost_of_auto(attempts, evaluations, implicit, has_series):
    """Of the attempts that are not implicit, the evaluations tell which are explicit."""
    others = attempts - implicit
    if not has_series:
        return others * COSTS["rk853"] + implicit * COSTS["rodas5p"]
    left = evaluations - EVALUATIONS["rodas5p"] * implicit - others
    explicit = min(max(left / (EVALUATIONS["rk853"] - 1), 0), others)
    return explicit * COSTS["rk853"] + (others - explicit) * COSTS["taylor"] + implicit * COSTS["rodas5p"]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_auto_is_worth_being_the_default(nocdyn, path):
    single = {method: counts_of(nocdyn, path, method) for method in COSTS}
    best = min(counts[0] * COSTS[method] for method, counts in single.items() if counts)
    attempts, evaluations, implicit = counts_of(nocdyn, path, "auto")
    assert cost_of_auto(attempts, evaluations, implicit, single["taylor"] is not None) <= LARGEST * best
