"""Branches that begin at period doublings and branch points of others."""

import json

import numpy as np
import pytest

DOUBLING = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' cubic_stiffness = 1.0 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 7.5 frequency = 1.0 /
&motor name = 'bias' body = 'mass' kind = 'constant' torque = {} /
"""
ORBIT = "&run t_end = 10.0 /\n&orbit over = 'excitation.shaker.frequency' range = {}, {} switch_branches = .true. {} /\n"
SETTLED = 1e-7  # of the half range, asked for


def branches(nocdyn, text):
    """The columns of orbit.csv, the report and what was printed."""
    printed = nocdyn.done(text, command="orbit").stdout
    return nocdyn.values("out", "orbit.csv"), json.loads((nocdyn.folder / "out/orbit.json").read_text()), printed


def settled(nocdyn, text, period, periods):
    """The half range of the angle in the last periods of a run."""
    end = periods * period
    nocdyn.done(
        f"{text}&run t_end = {end!r} method = 'rk853' rtol = 1e-12 atol = 1e-13 max_steps = 10000000 /\n"
        f"&output extremes_from = {end - 1.02 * period!r} points = 11 /\n"
    )
    extremes = nocdyn.summary("out")["columns"]["phi_mass"]
    return (extremes["max"] - extremes["min"]) / 2


def test_motions_of_twice_the_period_begin_at_a_period_doubling(nocdyn):
    values, report, printed = branches(nocdyn, DOUBLING.format(0.5) + ORBIT.format(6.0, 2.7, ""))
    first = next(point for point in report["special_points"] if point["kind"] == "period_doubling")
    number = first["leads_to"]
    assert number == 2
    assert f"a motion of twice the period branches off: branch {number}" in printed
    rows = values["branch"] == number
    assert values["rate"][rows] == pytest.approx(values["excitation.shaker.frequency"][rows] / 2)
    assert values["excitation.shaker.frequency"][rows][0] == pytest.approx(first["value"], abs=1e-2)


@pytest.mark.parametrize("frequency", [3.1, 3.2])
def test_a_run_from_rest_settles_on_the_motion_of_twice_the_period(nocdyn, frequency):
    text = DOUBLING.format(0.5)
    orbit = ORBIT.format(6.0, 2.8, "tolerance = 1e-9 count = 33")  # with points at 3.1 and 3.2
    values, _, _ = branches(nocdyn, text + orbit)
    rows = (values["branch"] == 2) & (np.abs(values["excitation.shaker.frequency"] - frequency) < 1e-12) & (values["stable"] == 1)
    assert rows.sum() == 1
    half_range = values["half_range_phi_mass"][rows][0]
    found = settled(nocdyn, text.replace("frequency = 1.0", f"frequency = {frequency}"), 4 * np.pi / frequency, 400)
    assert found == pytest.approx(half_range, abs=SETTLED * half_range)


def test_a_cascade_of_period_doublings_is_followed_up_to_eight_periods(nocdyn):
    values, report, _ = branches(nocdyn, DOUBLING.format(0.5) + ORBIT.format(6.0, 2.7, "signals = 'phi_mass'"))
    doublings = [point for point in report["special_points"] if point["kind"] == "period_doubling"]
    cascade = [point for point in doublings if point["value"] > 3.5]
    assert [point.get("subharmonic", 1) for point in cascade] == [2, 4, 8]
    assert [point.get("leads_to") for point in cascade] == [3, 4, None]
    first, second, third = (point["value"] for point in cascade)
    assert 3.5 < (first - second) / (second - third) < 9.5  # it tends to 4.669
    for number, periods in ((2, 2), (3, 4), (4, 8)):
        rows = values["branch"] == number
        assert values["rate"][rows] == pytest.approx(values["excitation.shaker.frequency"][rows] / periods)
    ends = [point for point in doublings if point["value"] < 2.8]
    assert [point.get("leads_to") for point in ends] == [3, 4, None]  # where these branches end


SYMMETRIC = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 0.2 cubic_stiffness = 1.0 damping = 0.1 /
&excitation name = 'shaker' body = 'mass' amplitude = 1.0 frequency = 1.0 /
&run t_end = 10.0 /
&orbit over = 'excitation.shaker.amplitude' range = 0.1, 4.0 switch_branches = .true. count = 40 /
"""


def test_a_symmetric_motion_loses_its_symmetry_to_both_sides(nocdyn):
    values, report, printed = branches(nocdyn, SYMMETRIC)
    (point,) = (point for point in report["special_points"] if point["kind"] == "branch_point")
    assert point["leads_to"] == 2
    assert "another motion of the same period branches off: branch 2" in printed
    amplitudes, means = values["excitation.shaker.amplitude"], values["mean_phi_mass"]
    one = values["branch"] == 1
    assert np.abs(means[one]).max() < 1e-6
    assert (values["stable"][one & (amplitudes > point["value"] + 1e-6)] == 0).all()
    rows = (values["branch"] == 2) & (np.abs(amplitudes - 2.6) < 1e-12)
    assert sorted(np.sign(means[rows])) == [-1, 1]
    assert np.ptp(np.abs(means[rows])) < 1e-7
    half_range = values["half_range_phi_mass"][rows][0]
    machine = SYMMETRIC.split("&run")[0].replace("amplitude = 1.0", "amplitude = 2.6")
    found = settled(nocdyn, machine, 2 * np.pi, 150)
    assert found == pytest.approx(half_range, abs=SETTLED * half_range)
