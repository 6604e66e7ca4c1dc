"""Where a branch of periodic motions begins: the largest motion at the first value, or the one of a file."""

import json

import numpy as np
import pytest

# Has two stable motions from 1.1157 to 1.2696 rad/s, with amplitudes of 2.545576701 and 0.417672949 rad at 1.2 rad/s.
DUFFING = """\
&body name = 'mass' inertia = 1.0 {} /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 1.2 /
&run t_end = 900.0 rtol = 1e-9 atol = 1e-11 /
&output interval = 0.05 /
"""
OVER = "&orbit over = 'excitation.shaker.frequency' range = 1.2, 1.5 start = '{}' tolerance = 1e-10 /\n"
HIGH, LOW = 2.545576701, 0.417672949
FOLD = 1.2696019555
PRINTED = 6e-10  # half of the last digit of these numbers, and a little

# An engine with two orders, free to turn.
TRAIN = """\
&body name = 'engine' inertia = 4.0 speed_rpm = 900 /
&body name = 'generator' inertia = 2.0 /
&coupling name = 'rubber' bodies = 'engine', 'generator' stiffness = 1e4 cubic_stiffness = 1e6 damping = 40.0 /
&motor name = 'mean' body = 'engine' kind = 'constant' torque = 200.0 /
&load name = 'grid' body = 'generator' viscous = 2.0 /
&excitation name = 'firing' body = 'engine' kind = 'orders' orders = 1.0, 2.0 amplitudes = 40.0, 200.0 /
&run t_end = 30.0 rtol = 1e-9 atol = 1e-11 /
&output interval = 0.001 /
"""
TRAIN_OVER = "&orbit over = 'motor.mean.torque' range = 200, 203 start = '{}' /\n"


def branch(nocdyn, text):
    outcome = nocdyn.done(text, command="orbit")
    report = json.loads((nocdyn.folder / "out/orbit.json").read_text())
    return nocdyn.values("out", "orbit.csv"), report, outcome.stdout


def run(nocdyn, text):
    """The name of trajectory.csv beside the input."""
    nocdyn.done(text)
    (nocdyn.folder / "out/trajectory.csv").rename(nocdyn.folder / "motion.csv")
    return "motion.csv"


def test_a_branch_can_begin_on_the_largest_motion_and_jumps_down(nocdyn):
    values, report, printed = branch(nocdyn, DUFFING.format("") + OVER.format("high"))
    assert values["largest_phi_mass"][0] == pytest.approx(HIGH, abs=PRINTED)
    assert report["special_points"][0]["value"] == pytest.approx(FOLD, abs=1e-8)
    assert "runs from scattered states" in printed


def test_a_low_start_has_the_small_motion(nocdyn):
    values, _, _ = branch(nocdyn, DUFFING.format("") + OVER.format("Low"))
    assert values["largest_phi_mass"][0] == pytest.approx(LOW, abs=PRINTED)


@pytest.mark.parametrize(("start", "amplitude"), [("speed = 2.0", HIGH), ("speed = -4.0", HIGH), ("", LOW)])
def test_a_branch_can_begin_on_the_motion_of_a_run(nocdyn, start, amplitude):
    file = run(nocdyn, DUFFING.format(start))
    values, _, _ = branch(nocdyn, DUFFING.format("") + OVER.format(file))
    settled = np.abs(nocdyn.values(".", file)["phi_mass"][-2000:]).max()
    assert abs(settled - amplitude) < 1e-3  # which motion the run has found
    assert values["largest_phi_mass"][0] == pytest.approx(amplitude, abs=PRINTED)


def test_a_run_of_a_free_train_in_units_of_the_field_gives_the_same_branch(nocdyn):
    expected, _, _ = branch(nocdyn, TRAIN + TRAIN_OVER.format("low"))
    units = TRAIN.replace("interval = 0.001", "interval = 0.001 units = 'deg', 'rpm'")
    values, report, _ = branch(nocdyn, TRAIN + TRAIN_OVER.format(run(nocdyn, units)))
    assert report["notes"] == []
    for label in ("half_range_total_moment_rubber", "mean_omega_engine"):
        assert values[label][0] == pytest.approx(expected[label][0], rel=1e-8)


def test_a_held_speed_can_begin_on_the_motion_of_a_run(nocdyn):
    held = "&orbit body = 'engine' speed = {}, 101.0 start = '{}' /\n"
    file = run(nocdyn, TRAIN)
    rows = nocdyn.values(".", file)
    mean = (rows["phi_engine"][-1] - rows["phi_engine"][-10001]) / 10.0
    values, _, _ = branch(nocdyn, TRAIN + held.format(repr(float(mean)), file))
    assert abs(values["torque_engine"][0]) < 0.1  # of 200 N m, the mean of a run over no whole number of periods


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("t [s],phi_mass [rad]\n0,1\n1,2\n", 2, "there is no column 'omega_mass [rad/s]'; needed: t, and the angles"),
        ("t [s],phi_mass [rad],omega_mass [rad/s]\n0,1,0\n1,2,0\n", 2, "its 1 s do not cover a period of the motion, 5.23599 s"),
        ("t [s],phi_mass [rad],omega_mass [rad/s]\n0,1,0\n9,2,0\n", 2, "its last period, 5.23599 s, has 1 rows; needed: 16"),
        ("t [s],phi_mass [rad],omega_mass [rad/s]\n0,1,0\n0,2,0\n", 2, "the time does not rise in row 2"),
        ("t [s],phi_mass [rad],omega_mass [rad/s]\n0,one,0\n", 2, "motion.csv:2: "),
        (None, 3, "motion.csv: cannot be read: there is no such file; allowed: low, high, settled_run or the name of a file"),
    ],
)
def test_a_file_that_is_no_motion_is_refused(nocdyn, text, code, message):
    if text is not None:
        nocdyn.write("motion.csv", text)
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", DUFFING.format("") + OVER.format("motion.csv")))
    assert outcome.returncode == code
    assert "machine.nml:6: &orbit: start = 'motion.csv': " in outcome.stderr
    assert message in outcome.stderr
    assert not (nocdyn.folder / "results").exists()


def test_a_held_speed_has_no_largest_motion(nocdyn):
    text = TRAIN + "&orbit body = 'engine' speed = 100, 101 start = 'high' /\n"
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", text))
    assert outcome.returncode == 2
    assert ": a run does not hold the mean speed of a body; allowed: over in place of body" in outcome.stderr
