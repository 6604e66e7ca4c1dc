"""The paper's two cases: published precision in every formulation, complement and method, at every time."""

from itertools import product

import pytest
from conftest import CASE_1, CASE_2

TIGHT = ("--set", "run.rtol=1e-11", "--set", "run.atol=1e-12")

# State at t = 10 s, from independent integrations at far tighter tolerances.
COLUMNS = [
    "omega_motor [rad/s]",
    "omega_pinion [rad/s]",
    "omega_machine [rad/s]",
    "moment_coupling [N m]",
    "reaction_reducer [N]",
]
REFERENCE = {
    CASE_1: [3.45430601101172, 3.45430595814429, -2.30287063876286, -153.524710255310, -76.7623547799598],
    CASE_2: [3.13779610486375, 3.23069881486632, -2.15379920991088, -135.130778740050, -70.4924092656434],
}

# Accuracy asked of each method at these tolerances, relative to the largest value of the column.
ACCURACY = {"rk45": 1e-8, "rosenbrock": 1e-6}

FORMULATIONS = ("reduced", "paper", "multiplier")
COMPLEMENTS = ("natural", "scaled", "negated")
STEM = {CASE_1: "case1", CASE_2: "case2"}


@pytest.fixture(scope="module")
def runs(shared_nocdyn):
    """Tables by case, method, formulation and complement."""
    tables = {}
    for path, method, formulation in product(REFERENCE, ACCURACY, FORMULATIONS):
        for complement in COMPLEMENTS:
            words = ("--set", f"run.method={method}", "--set", f"run.formulation={formulation}")
            outcome = shared_nocdyn("run", path, "--out", "out", "-q", *TIGHT, *words, "--set", f"run.complement={complement}")
            assert (outcome.returncode, outcome.stderr) == (0, "")
            header, rows = shared_nocdyn.table("out")
            tables[path, method, formulation, complement] = dict(zip(header, zip(*rows)))
    return tables


@pytest.mark.parametrize("path", REFERENCE, ids=STEM.get)
@pytest.mark.parametrize("method", ACCURACY)
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_the_state_at_the_end_is_the_reference(runs, path, method, formulation, complement):
    table = runs[path, method, formulation, complement]
    assert [table[name][-1] for name in COLUMNS] == pytest.approx(REFERENCE[path], rel=ACCURACY[method])


@pytest.mark.parametrize("path", REFERENCE, ids=STEM.get)
@pytest.mark.parametrize("complement", COMPLEMENTS)
def test_taylor_series_lead_to_the_reference(runs, shared_nocdyn, path, complement):
    words = ("--set", "run.method=taylor", "--set", f"run.complement={complement}")
    assert shared_nocdyn("run", path, "--out", "out", "-q", *TIGHT, *words).returncode == 0
    header, rows = shared_nocdyn.table("out")
    table = dict(zip(header, zip(*rows)))
    assert [table[name][-1] for name in COLUMNS] == pytest.approx(REFERENCE[path], rel=1e-11)
    expected = runs[path, "rk45", "reduced", complement]
    for name in COLUMNS:
        largest = max(map(abs, expected[name]))
        assert max(abs(a - b) for a, b in zip(table[name], expected[name])) < ACCURACY["rk45"] * largest
    assert max(map(abs, table["energy_residual [J]"])) < 1e-10 * table["work_in [J]"][-1]


def test_extremes_are_those_of_another_method(shared_nocdyn):
    extremes = {}
    for method in ("taylor", "rk853"):
        shared_nocdyn("run", CASE_2, "--out", "out", "-q", *TIGHT, "--set", f"run.method={method}")
        extremes[method] = shared_nocdyn.summary("out")["columns"]
    for name, other in extremes["rk853"].items():
        if name != "energy_residual [J]":
            found = extremes["taylor"][name]
            assert [found[key] for key in ("min", "max")] == pytest.approx([other["min"], other["max"]], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("path", REFERENCE, ids=STEM.get)
def test_all_runs_agree_at_every_time(runs, path):
    expected = runs[path, "rk45", "reduced", "natural"]
    for (other, method, _, _), table in runs.items():
        if other != path:
            continue
        for name in COLUMNS:
            largest = max(map(abs, expected[name]))
            assert max(abs(a - b) for a, b in zip(table[name], expected[name])) < ACCURACY[method] * largest


def test_the_energy_residual_is_small_beside_the_work(runs):
    for table in runs.values():
        largest = max(map(abs, table["energy_residual [J]"]))
        assert largest < 1e-8 * table["work_in [J]"][-1]


def test_case_1_settles_at_the_closed_form(runs):
    # root of C w^2 + (B + c (R1/R2)^2) w - A = 0
    b = 10 + 100 * (2 / 3) ** 2
    omega = (-b + (b * b + 4 * 200) ** 0.5) / 2
    table = runs[CASE_1, "rk45", "reduced", "natural"]
    # what is left of the start after 10 s
    assert table["omega_motor [rad/s]"][-1] == pytest.approx(omega, abs=1e-6)
    assert table["moment_coupling [N m]"][-1] == pytest.approx(-100 * (2 / 3) ** 2 * omega, abs=1e-4)
