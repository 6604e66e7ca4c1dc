"""Periodic motions of nonlinear machines: known folds and amplitudes, runs that have settled, multipliers by integration."""

import json

import numpy as np
import pytest
from conftest import Values

# Numbers of an independent program for m 1, c 0.05, k 1, k3 0.1, P 0.18.
DUFFING = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 0.8 /
&run t_end = 10.0 /
"""
OVER = "&orbit over = 'excitation.shaker.frequency' range = {}, {} {} /\n"
FOLDS = (1.2696019555, 1.1157002518)
LARGEST = {0.8: [0.475438776], 1.0: [1.312562602], 1.2: [2.545576701, 0.417672949]}  # of stable motions
PRINTED = 6e-10  # half of the last digit of these numbers, and a little

# m 1, 0.05; k 1, 0.0453; c 0.002, 0.013; k3 1, 0.0042
TWO_MASSES = """\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 0.05 /
&coupling name = 'spring' bodies = 'ground', 'a' stiffness = 1.0 cubic_stiffness = 1.0 damping = 0.002 /
&coupling name = 'absorber' bodies = 'a', 'b' stiffness = 0.0453 cubic_stiffness = 0.0042 damping = 0.013 /
&excitation name = 'shaker' body = 'a' amplitude = 0.11 frequency = 0.8 /
&run t_end = 10.0 /
"""
NEIMARK_SACKER = (1.1127, 1.1957)

SPECIAL = {"fold": 1, "period_doubling": 2, "neimark_sacker": 3, "branch_point": 4}


def branch(nocdyn, text, *words):
    """The columns of orbit.csv and the report."""
    nocdyn.done(text, *words, command="orbit")
    return nocdyn.values("out", "orbit.csv"), json.loads((nocdyn.folder / "out/orbit.json").read_text())


def refused(nocdyn, text, *words, code=1):
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", text), *words)
    assert outcome.returncode == code, outcome.stdout + outcome.stderr
    return outcome.stderr


def specials(report, kind):
    return [point["value"] for point in report["special_points"] if point["kind"] == kind]


def at(values, parameter, value):
    """The rows at a value of the parameter."""
    rows = np.abs(values[parameter] - value) < 1e-12
    return Values({label: column[rows] for label, column in values.items()})


def test_a_hardening_spring_has_the_known_folds_and_amplitudes(nocdyn):
    values, report = branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "count = 5 tolerance = 1e-10"))
    assert specials(report, "fold") == pytest.approx(FOLDS, abs=1e-8)
    for frequency, expected in LARGEST.items():
        rows = at(values, "excitation.shaker.frequency", frequency)
        largest = rows["largest_phi_mass"][rows["stable"] == 1]
        assert largest == pytest.approx(expected, abs=PRINTED)
    assert report["largest_error"] < report["tolerance"]


def test_the_motion_between_the_folds_is_unstable_and_the_report_says_where_it_jumps(nocdyn):
    outcome = nocdyn.done(DUFFING + OVER.format(0.8, 1.6, ""), command="orbit")
    assert "at 1.269601956 rad/s: fold; a rising value jumps there" in outcome.stdout
    assert "at 1.115700252 rad/s: fold; a falling value jumps there" in outcome.stdout
    assert "unstable from 1.2696 rad/s to 1.1157 rad/s" in outcome.stdout


def test_a_branch_from_the_other_end_has_the_same_folds(nocdyn):
    _, report = branch(nocdyn, DUFFING + OVER.format(1.6, 0.8, ""))
    assert specials(report, "fold") == pytest.approx(FOLDS[::-1], abs=1e-8)


def test_two_masses_have_the_known_folds_and_an_interval_of_two_frequencies(nocdyn):
    _, report = branch(nocdyn, TWO_MASSES + OVER.format(0.8, 1.4, ""))
    assert len(specials(report, "fold")) == 2
    assert specials(report, "neimark_sacker") == pytest.approx(NEIMARK_SACKER, abs=6e-5)
    unstable = [(part["from"], part["to"]) for part in report["parts"] if not part["stable"]]
    assert len(unstable) == 2
