"""Published numbers, by every formulation and by methods of every kind at tight tolerances."""

from itertools import product

import pytest
from test_example_machines import PUBLISHED, Run, input_of

FORMULATIONS = ("reduced", "paper", "multiplier")
METHODS = ("rk45", "rk853", "rodas5p")

# Of the largest value in a column; the contact's numbers are published with eight digits.
ACCURACY = dict.fromkeys(PUBLISHED, 1e-8) | {"backlash": 1e-7}


def tightly(program, method, formulation):
    """The program with these settings in every run."""

    def run(*words):
        settings = (f"run.method={method}", f"run.formulation={formulation}", "run.rtol=1e-11", "run.atol=1e-12")
        return program(*words, *(word for setting in settings for word in ("--set", setting)))

    run.table, run.summary = program.table, program.summary
    return run


@pytest.mark.parametrize("name", PUBLISHED)
@pytest.mark.parametrize(("method", "formulation"), list(product(METHODS, FORMULATIONS)))
def test_every_formulation_and_kind_of_method_reaches_the_published_numbers(nocdyn, name, method, formulation):
    run = Run(tightly(nocdyn, method, formulation), name)
    for key, expected in PUBLISHED[name][1].items():
        assert run.value(key) == pytest.approx(expected, rel=0, abs=ACCURACY[name] * run.largest(key)), key


@pytest.mark.parametrize("name", ["three_rotors", "motor_coupling_gear"])
def test_taylor_series_reach_the_published_numbers(nocdyn, name):
    run = Run(tightly(nocdyn, "taylor", "reduced"), name)
    for key, expected in PUBLISHED[name][1].items():
        assert run.value(key) == pytest.approx(expected, rel=0, abs=1e-9 * run.largest(key)), key


# What the steps up to there leave of the reactions, of the largest in the run.
SAME = 1e-10


@pytest.mark.parametrize("formulation", FORMULATIONS[1:])
@pytest.mark.parametrize("name", ["three_rotors", "torque_split", "wind_turbine", "differential"])
def test_reactions_from_the_complement_are_the_multipliers(nocdyn, name, formulation):
    reactions = {}
    for which in ("reduced", formulation):
        settings = (f"run.formulation={which}", "run.method=rk853", "run.rtol=1e-13", "run.atol=1e-14")
        settings += ("run.t_end=0.02", "output.interval=0.004")
        outcome = nocdyn("run", input_of(name), "--out", which, "-q", *(word for s in settings for word in ("--set", s)))
        assert (outcome.returncode, outcome.stderr) == (0, "")
        header, rows = nocdyn.table(which)
        chosen = [column for column, label in enumerate(header) if label.startswith("reaction_")]
        reactions[which] = [row[column] for row in rows for column in chosen]
    largest = max(map(abs, reactions["reduced"]))
    assert largest > 0
    assert reactions["reduced"] == pytest.approx(reactions[formulation], rel=0, abs=SAME * largest)
