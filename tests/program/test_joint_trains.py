"""Runs of random trains of joints that lock, lose, move and hold go to their end, and so do those of parts without a load."""

import os

import pytest
from conftest import TRAPS_EXCEPTIONS
from random_trains import random_train

TRAINS = int(os.environ.get("NOCDYN_RANDOM_TRAINS", "20"))
HARD = [118, 740, 926]  # joints without a load beside small slips
HARD += [327]  # few of many combinations of modes fit
HARD += [889, 1158, 1369]  # teeth that jam by what others do
if not TRAPS_EXCEPTIONS:  # which a rejected step raises, whose powers overflow
    HARD += [653]  # joints without a load beside small slips


@pytest.mark.parametrize("seed", sorted({*range(TRAINS), *HARD}))
def test_runs_of_random_trains_go_to_their_end(nocdyn, seed):
    outcome = nocdyn("run", nocdyn.write("train.nml", random_train(seed)), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr


def run(nocdyn, text):
    nocdyn.done(text)
    return nocdyn.values()


def test_brakes_at_both_ends_of_a_cardan_joint_carry_nothing_at_rest(nocdyn):
    # At most other numbers the brakes stay with opposite moments: rounding decides between both where they stop together.
    text = "&body name = 'a' inertia = 1 speed = 5 /\n&body name = 'b' inertia = 1 /\n"
    text += "&cardan name = 'j' bodies = 'a', 'b' angle_deg = 10 /\n&clutch name = 'k1' bodies = 'a', 'ground' capacity = 20 /\n"
    table = run(nocdyn, text + "&clutch name = 'k2' bodies = 'b', 'ground' capacity = 20 /\n&run t_end = 2 /\n")
    at_rest = table["t"] > 0.6
    for name in ("torque_k1", "torque_k2", "torque_j"):
        assert abs(table[name][at_rest]).max() < 1e-9


def test_a_backstop_behind_a_cardan_joint_opens(nocdyn):
    text = "&body name = 'b0' inertia = 2 /\n&excitation name = 'osc' body = 'b0' amplitude = 90 frequency = 15 /\n"
    text += "&body name = 'b1' inertia = 1 bearing_friction = 1 /\n&coupling name = 's1' bodies = 'b0', 'b1' stiffness = 2400 /\n"
    text += "&body name = 'b2' inertia = 2 /\n&cardan name = 'k2' bodies = 'b1', 'b2' angle_deg = 10 /\n"
    run(nocdyn, text + "&freewheel name = 'bs' bodies = 'b2', 'ground' /\n&run t_end = 10 /\n")
    events = nocdyn.summary("out")["joint_events"]
    assert any(event["time"] == pytest.approx(0.19532, abs=1e-5) for event in events)


def test_parts_without_a_load_stay_where_they_are(nocdyn):
    text = "&body name = 'b0' inertia = 1.491 /\n&motor name = 'mot' body = 'b0' kind = 'constant' torque = 10 /\n"
    text += "&body name = 'b1' inertia = 0.774 /\n&clutch name = 'c1' bodies = 'b0', 'b1' capacity = 39 /\n"
    text += "&body name = 'b4' inertia = 0.822 bearing_friction = 1 /\n&body name = 'b5' inertia = 2.87 /\n"
    text += "&clutch name = 'c5' bodies = 'b4', 'b5' capacity = 70 times = 0.5 levels = 1 /\n&body name = 'b6' inertia = 1.5 /\n"
    table = run(nocdyn, text + "&freewheel name = 'f6' bodies = 'b5', 'b6' direction = 'backward' /\n&run t_end = 2 /\n")
    assert table["omega_b0"][-1] == pytest.approx(10 * 2 / (1.491 + 0.774))
    for body in ("b4", "b5", "b6"):
        assert abs(table[f"omega_{body}"]).max() < 1e-12


def test_parts_that_have_stopped_do_not_jam(nocdyn):
    text = "&body name = 'b2' inertia = 2.671 speed = 37.9 /\n&body name = 'b3' inertia = 0.147 /\n"
    text += "&freewheel name = 'f3' bodies = 'b2', 'b3' /\n&body name = 'b4' inertia = 0.999 /\n"
    text += "&clutch name = 'c4' bodies = 'b3', 'b4' capacity = 102.562 /\n&body name = 'b5' inertia = 0.366 /\n"
    text += "&gear name = 'g5' bodies = 'b4', 'b5' radii = 2.9, 1.3 /\n&body name = 'b6' inertia = 0.796 speed = 2.5 /\n"
    text += "&clutch name = 'd6' bodies = 'b5', 'b6' kind = 'dog' times = 0.692 levels = 1.0 /\n"
    text += "&body name = 'b7' inertia = 2.333 speed = 10.5 /\n"
    text += "&clutch name = 'd7' bodies = 'b6', 'b7' kind = 'dog' times = 0.842 levels = 1.0 /\n"
    text += "&load name = 'ld' body = 'b7' viscous = 0.692 quadratic = 0.0007 constant = 7.455 constant_speed = 1.934 /\n"
    text += "&clutch name = 'brk' bodies = 'b7', 'ground' capacity = 38.835 times = 1.885 levels = 1.0 /\n&run t_end = 3.378 /\n"
    table = run(nocdyn, text)
    assert abs(table["omega_b7"][table["t"] > 2.5]).max() < 1e-9
