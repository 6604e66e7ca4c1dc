"""&run start = 'equilibrium': runs, modes and sweeps begin in the steady state."""

import csv
import json

import pytest
from sweep_inputs import needs_sweeps

# What steps with the tolerances of DRIVE leave of a motion that does not change.
STEADY = 1e-6

MOTOR = "kind = 'induction' breakdown_torque = 100.0 breakdown_slip = 0.05 synchronous_speed = 157.0"
DC = "kind = 'dc' voltage = 100.0 resistance = 0.5 flux_constant = 1.2 inductance = 0.01"
GOVERNED = "kind = 'constant' torque = 50.0 governor_speed = 20.0 governor_gain = 0.1 governor_time = 2.0"

# Three steady states: stalled, unstable, running.
DRIVE = """\
&body name = 'rotor' inertia = 1.0 {speed} /
&body name = 'pump' inertia = 1.0 /
&body name = 'fan' inertia = 2.0 angle = 3.0 /
&coupling name = 'fluid' bodies = 'rotor', 'pump' friction = 80.0 friction_speed = 3.0 /
&coupling name = 'shaft' bodies = 'pump', 'fan' stiffness = 1e4 damping = 10.0 /
&motor name = 'mains' body = 'rotor' {motor} /
&load name = 'work' body = 'fan' constant = 30.0 constant_speed = 0.1 /
&run t_end = 2.0 rtol = 1e-11 atol = 1e-11 start = 'equilibrium' /
"""


def drive(speed="", motor=MOTOR):
    return DRIVE.format(speed=speed, motor=motor)


def run(nocdyn, text, *options):
    """The header, the rows and the notes of a run."""
    outcome = nocdyn("run", nocdyn.write("m.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    header, rows = nocdyn.table("out")
    notes = [line.split(": note: ")[1] for line in outcome.stdout.splitlines() if ": note: " in line]
    assert nocdyn.summary("out")["machine"]["notes"] == notes[: len(nocdyn.summary("out")["machine"]["notes"])]
    return header, rows, notes


def assert_steady(header, rows):
    for column, label in enumerate(header):
        if label.startswith(("omega", "moment", "torque", "current", "throttle", "twist_shaft")):
            for row in rows:
                assert row[column] == pytest.approx(rows[0][column], rel=STEADY, abs=STEADY), label


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_a_run_stays_where_it_starts(nocdyn, formulation):
    header, rows, notes = run(nocdyn, drive(), "--set", f"run.formulation={formulation}")
    assert_steady(header, rows)
    assert 155 < rows[0][header.index("omega_rotor [rad/s]")] < 157
    assert rows[0][header.index("moment_shaft [N m]")] == pytest.approx(-30, rel=1e-9)
    assert notes[0].startswith(
        "the start is steady state 3 of 3, of 2 stable ones the fastest, as no speed is given, at 155.795 rad/s of 'rotor', 154.6"
    )


@pytest.mark.parametrize(("speed", "state"), [("speed = 1.0", 1), ("speed = 70.0", 1), ("speed = 90.0", 3), ("speed = 155.0", 3)])
def test_the_stable_state_nearest_to_the_given_speeds_is_taken(nocdyn, speed, state):
    header, rows, notes = run(nocdyn, drive(speed))
    assert notes[0].startswith(f"the start is steady state {state} of 3, of 2 stable ones the nearest to the given speeds, at ")
    assert_steady(header, rows)


@pytest.mark.parametrize("motor", [DC, GOVERNED])
def test_inner_states_start_where_they_stay(nocdyn, motor):
    header, rows, notes = run(nocdyn, drive(motor=motor).replace("constant = 30.0 constant_speed = 0.1", "viscous = 1.5"))
    assert_steady(header, rows)
    assert notes[0].startswith("the start is the steady state, which is stable, at ")
    if motor == GOVERNED:
        assert rows[0][header.index("omega_rotor [rad/s]")] == pytest.approx(20, rel=1e-9)
        assert rows[0][header.index("throttle_mains [1]")] == pytest.approx(
            1.5 * rows[0][header.index("omega_fan [rad/s]")] / 50, rel=1e-7
        )


def test_what_happens_later_does_not_count_at_the_start(nocdyn):
    blow = "&excitation name = 'blow' body = 'fan' kind = 'step' amplitude = -5.0 time = 1.0 /\n"
    header, rows, _ = run(nocdyn, drive() + blow)
    fan = header.index("omega_fan [rad/s]")
    before = [row[fan] for row in rows if row[0] < 1]
    assert before == pytest.approx([before[0]] * len(before), rel=STEADY)
    assert rows[-1][fan] < before[0] - 0.1


def test_modes_and_check_know_the_start(nocdyn):
    nocdyn.write("m.nml", drive("speed = 1.0"))
    assert "note: the start is steady state 1 of 3" in nocdyn("check", "m.nml").stdout
    slow = nocdyn("modes", "m.nml").stdout
    nocdyn.write("m.nml", drive("speed = 150.0"))
    assert slow != nocdyn("modes", "m.nml").stdout


def test_a_machine_without_steady_state_is_refused(nocdyn):
    text = drive(motor="kind = 'constant' torque = 50.0")
    for command in ("run", "check", "modes"):
        outcome = nocdyn(command, nocdyn.write("m.nml", text), *(("--out", "out") if command == "run" else ()))
        assert (outcome.returncode, outcome.stdout) == (1, "")
        where = (
            f"{nocdyn.folder}/m.nml:8: &run: start = 'equilibrium': there is no steady state: nothing balances the torques on "
        )
        assert outcome.stderr.startswith(
            f"nocdyn: {where}'rotor', 'pump', 'fan' at any speed; at least 20 N m are left over, at "
        )
        assert outcome.stderr.endswith(" rad/s of 'rotor'; start = 'given' starts with the speeds of the bodies\n")


@needs_sweeps
def test_every_variant_of_a_sweep_starts_in_its_own_steady_state(nocdyn):
    sweep = """\
&sweep design = 'grid' /
&vary target = 'load.work.constant' low = 10.0 high = 50.0 count = 5 /
&record quantity = 'omega_fan' statistic = 'min', 'max', 'final' /
"""
    nocdyn.write("s.nml", drive("speed = 150.0") + sweep)
    outcome = nocdyn("sweep", "s.nml", "--out", "out", "--csv")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    with open(nocdyn.folder / "out/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 5
    for row in rows:
        lowest, highest, final = (float(row[f"omega_fan_{which} [rad/s]"]) for which in ("min", "max", "final"))
        constant = float(row["load.work.constant [N m]"])
        assert lowest == pytest.approx(highest, rel=STEADY)
        nocdyn.write("one.nml", drive("speed = 150.0").replace("constant = 30.0", f"constant = {constant}"))
        nocdyn("equilibrium", "one.nml", "--out", "one")
        states = json.loads((nocdyn.folder / "one/equilibrium.json").read_text())["steady_states"]
        assert final == pytest.approx(states[-1]["values"]["omega_fan [rad/s]"], rel=STEADY)


MISSED = (
    "the machine ends in the steady state at 0.411677 rad/s of 'rotor', 0.0346617 rad/s of 'pump'; it could run at "
    "155.795 rad/s of 'rotor', 154.612 rad/s of 'pump', where &run start = 'equilibrium' starts it"
)


@pytest.mark.parametrize(("speed", "notes"), [("", [MISSED]), ("speed = 155.0", [MISSED]), ("speed = 0.4", [MISSED])])
def test_a_motor_that_does_not_start_its_load_is_told_how_it_could_run(nocdyn, speed, notes):
    # the locked rotor has 10 N m, the load 30 N m; the breakdown torque is 100 N m
    text = drive(speed).replace("start = 'equilibrium'", "").replace("t_end = 2.0 rtol = 1e-11 atol = 1e-11", "t_end = 60.0")
    if speed == "speed = 155.0":  # with its load it goes on
        text = text.replace("name = 'pump' inertia = 1.0", "name = 'pump' inertia = 1.0 speed = 155.0")
        text = text.replace("name = 'fan' inertia = 2.0", "name = 'fan' inertia = 2.0 speed = 155.0")
        notes = []
    _, _, seen = run(nocdyn, text)
    assert seen == notes
    assert nocdyn.summary("out")["machine"]["notes"] == notes


def test_a_slow_start_that_was_wanted_is_not_told(nocdyn):
    _, _, notes = run(nocdyn, drive("speed = 1.0"))
    assert len(notes) == 1 and notes[0].startswith("the start is steady state 1 of 3")


def test_what_was_tried_is_told_where_it_is_not_known_that_there_is_none(nocdyn):
    motor = "kind = 'table' table_speed = 0.0, 100.0 table_torque = 10.0, {}"
    text = f"""\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 1.0 /
&coupling name = 'c' bodies = 'a', 'b' friction = 5.0 /
&motor name = 'one' body = 'a' {motor.format(20.0)} extrapolation = 'constant' /
&motor name = 'two' body = 'b' {motor.format(30.0)} extrapolation = 'constant' /
&run t_end = 1.0 start = 'equilibrium' /
"""
    outcome = nocdyn("run", nocdyn.write("m.nml", text), "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert outcome.stderr == (
        f"nocdyn: {nocdyn.folder}/m.nml:6: &run: start = 'equilibrium': no steady state was found: nothing was found that "
        "balances the torques on 'a', 'b'; tried: a scan over one speed with the others following it, Newton's method from 36 "
        "combinations of rest, synchronous speeds and knees of the curves, and the motion from the start; start = 'given' "
        "starts with the speeds of the bodies\n"
    )
