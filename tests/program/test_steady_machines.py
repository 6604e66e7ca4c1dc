"""All steady states of random machines are found: two speeds that a slipping coupling joins."""

import json
from math import tanh

import pytest
from conftest import DATA
from steady_machines import Machine

STORED = json.loads((DATA / "steady_machines.json").read_text())
# Speeds are compared to what a bisection leaves; where a load creeps, to 1e-6 rad/s.
TOLERANCE = 1e-6


def machine_of(stored):
    return Machine(**{key: value for key, value in stored.items() if key != "steady"})


def speeds(values):
    return values["omega_motor [rad/s]"], values["omega_fan [rad/s]"]


@pytest.mark.parametrize("kind", STORED)
def test_the_stored_steady_states_are_those_of_the_machines(kind):
    stored = STORED[kind][0]
    for computed, kept in zip(machine_of(stored).steady_states(), stored["steady"], strict=True):
        assert computed == pytest.approx(kept, rel=1e-9)


@pytest.mark.parametrize("kind", STORED)
def test_no_steady_state_of_sixty_machines_is_missed_or_invented(nocdyn, kind):
    files = [nocdyn.write(f"m{i}.nml", machine_of(stored).text()) for i, stored in enumerate(STORED[kind])]
    outcome = nocdyn("equilibrium", *files, "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert len(files) == 60
    for i, stored in enumerate(STORED[kind]):
        states = json.loads((nocdyn.folder / f"out/m{i}/equilibrium.json").read_text())["steady_states"]
        found = sorted(speeds(state["values"]) for state in states)
        assert len(found) == len(stored["steady"]), f"machine {i}"
        for one, other in zip(found, sorted(map(tuple, stored["steady"])), strict=True):
            assert one == pytest.approx(other, rel=TOLERANCE, abs=TOLERANCE), f"machine {i}"


# Two induction motors of different speeds on one fan. Every branch of each motor's balance was followed over the speed of the
# fan, and the changes of sign of what is left over on the fan were bisected.
TWO_MOTORS = """\
&body name = 'm0' inertia = 1.0 /
&body name = 'm1' inertia = 1.0 /
&body name = 'fan' inertia = 2.0 /
&coupling name = 'c0' bodies = 'm0', 'fan' friction = 144.69805 friction_speed = 0.134 /
&coupling name = 'c1' bodies = 'm1', 'fan' friction = 13.562657 friction_speed = 0.1458 /
&motor name = 'd0' body = 'm0' kind = 'induction' breakdown_torque = 290.5 breakdown_slip = 0.01238 synchronous_speed = 278.3 /
&motor name = 'd1' body = 'm1' kind = 'induction' breakdown_torque = 66.91 breakdown_slip = 0.02937 synchronous_speed = 210.5 /
&load name = 'l' body = 'fan' constant = 18.2316334464 constant_speed = 0.06956 /
&run t_end = 1.0 /
"""


SEVEN = [  # of m0 and m1 [rad/s]
    (0.055982, 0.092793),
    (96.370967, 96.44747),
    (211.24908, 211.03735),
    (215.529671, 211.133157),
    (278.110891, 211.133157),
    (278.110891, 270.867189),
    (278.119182, 277.877624),
]


def test_two_motors_whose_speeds_differ_have_seven_steady_states(nocdyn):
    nocdyn("equilibrium", nocdyn.write("two.nml", TWO_MOTORS), "--out", "out")
    states = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"]
    found = sorted((state["values"]["omega_m0 [rad/s]"], state["values"]["omega_m1 [rad/s]"]) for state in states)
    assert [speed for pair in found for speed in pair] == pytest.approx([speed for pair in SEVEN for speed in pair], rel=1e-5)
    assert [state["stability"] for state in states].count("stable") == 4


GOVERNED = """\
&body name = 'engine' inertia = 3.0 /
&body name = 'wheel' inertia = 1.0 /
&body name = 'screw' inertia = 2.0 /
&coupling name = 'fluid' bodies = 'engine', 'wheel' friction = 40.0 friction_speed = 4.0 /
&coupling name = 'belt' bodies = 'wheel', 'screw' friction = 60.0 friction_speed = 2.0 damping = 0.1 /
&motor name = 'diesel' body = 'engine' kind = 'table' table_speed = 0.0, 60.0, 120.0, 200.0 table_torque = 20.0, 70.0, 65.0, 0.0
  governor_speed = 100.0 governor_gain = 0.05 governor_time = 1.0 /
&load name = 'mill' body = 'wheel' viscous = 0.05 /
&load name = 'water' body = 'screw' quadratic = {quadratic} /
&run t_end = 1.0 /
"""


@pytest.mark.parametrize(("quadratic", "is_held"), [(0.002, True), (0.004, True), (0.1, False)])
def test_the_balance_of_three_speeds_behind_a_governed_engine(nocdyn, quadratic, is_held):
    nocdyn("equilibrium", nocdyn.write("m.nml", GOVERNED.format(quadratic=quadratic)), "--out", "out")
    # the curve goes on below rest: there is an unstable state backwards
    backwards, state = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"]
    assert (backwards["stability"], state["stability"]) == ("unstable", "stable")
    engine, wheel, screw = (state["values"][f"omega_{name} [rad/s]"] for name in ("engine", "wheel", "screw"))
    belt = 60 * tanh((wheel - screw) / 2) + 0.1 * (wheel - screw)
    assert belt == pytest.approx(quadratic * screw**2, rel=1e-9)
    assert 40 * tanh((engine - wheel) / 4) == pytest.approx(belt + 0.05 * wheel, rel=1e-9)
    assert state["values"]["torque_diesel [N m]"] == pytest.approx(belt + 0.05 * wheel, rel=1e-9)
    if is_held:
        assert engine == pytest.approx(100, rel=1e-9)
        assert 0 < state["values"]["throttle_diesel [1]"] < 1
