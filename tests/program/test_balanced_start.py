"""A start in equilibrium at a given speed: by a number of the input that is found, or by a torque that is added."""

import csv
from math import pi

import pytest

SPEED = 1500 * pi / 30  # of the motor [rad/s]; the fan has a third of it
EXACT = 1e-9
STEADY = 1e-5  # of the tolerance of a run, for what stays as it is
TRAIN = """\
&body name = 'motor' inertia = 2 angle = 0.5 /
&body name = 'pinion' inertia = 1 angle = 0.5 /
&body name = 'fan' inertia = 30 /
&coupling name = 'k' bodies = 'motor', 'pinion' stiffness = 2e4 damping = 5 /
&gear name = 'g' bodies = 'pinion', 'fan' teeth = 20, 60 internal = .true. /
&motor name = 'drive' body = 'motor' kind = 'constant' torque = 100 /
&load name = 'air' body = 'fan' constant = 50 /
"""
RUN = "&run t_end = 2 start = 'equilibrium' start_body = 'motor' start_speed_rpm = 1500 KEYS /\n"


def run(nocdyn, text, keys="", *options):
    nocdyn.write("m.nml", text + RUN.replace("KEYS", keys))
    outcome = nocdyn("run", "m.nml", "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return outcome.stdout


def refusal(nocdyn, text, keys="", code=2):
    nocdyn.write("m.nml", text + RUN.replace("KEYS", keys))
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (code, "")
    return outcome.stderr


def all_stay(nocdyn, *names):
    columns = nocdyn.summary("out")["columns"]
    for name in names:
        column = columns[name]
        assert column["max"] - column["min"] <= STEADY * abs(column["last"])
    return columns


@pytest.mark.parametrize(
    ("free", "value", "given", "moment"),
    [
        ("load.air.quadratic", (300 - 50) / (SPEED / 3) ** 2, 0, 100),
        ("load.air.viscous", (300 - 50) / (SPEED / 3), 0, 100),
        ("load.air.constant", 300, 50, 100),
        ("motor.drive.torque", 50 / 3, 100, 50 / 3),
    ],
)
def test_a_number_is_found_with_which_a_preloaded_train_turns_on(nocdyn, free, value, given, moment):
    text = run(nocdyn, TRAIN, f"free = '{free}'")
    assert f"note: the start is in equilibrium at 1500 rpm of 'motor' with {free} = {value:.7g}, not {given}\n" in text
    columns = all_stay(nocdyn, "omega_motor [rad/s]", "omega_fan [rad/s]", "moment_k [N m]", "reaction_g [N m]")
    assert columns["omega_motor [rad/s]"]["last"] == pytest.approx(SPEED, rel=EXACT)
    assert abs(columns["moment_k [N m]"]["last"]) == pytest.approx(moment, rel=STEADY)
    header, rows = nocdyn.table("out")
    assert rows[0][header.index("phi_motor [rad]")] == pytest.approx(0.5, rel=EXACT)


def test_without_a_free_number_a_constant_torque_balances(nocdyn):
    text = run(nocdyn, TRAIN)
    assert "note: the start is in equilibrium at 1500 rpm of 'motor' by a constant torque of -83.33333 N m on it" in text
    columns = all_stay(nocdyn, "omega_motor [rad/s]", "moment_k [N m]")
    assert columns["torque_balance [N m]"]["last"] == pytest.approx(50 / 3 - 100, rel=EXACT)


def test_the_torque_has_a_name_of_its_own(nocdyn):
    run(nocdyn, TRAIN + "&excitation name = 'balance' body = 'fan' amplitude = 0 frequency = 1 /\n")
    assert {"torque_balance [N m]", "torque_balance_ [N m]"} <= set(nocdyn.summary("out")["columns"])


def test_a_motor_whose_torque_is_no_multiple_of_the_number_is_found(nocdyn):
    curve = TRAIN.replace("kind = 'constant' torque = 100", "kind = 'induction' breakdown_torque = 100 breakdown_slip = 0.2 "
                          "synchronous_speed_rpm = 1560")  # fmt: skip
    run(nocdyn, curve, "free = 'motor.drive.breakdown_slip'")
    columns = all_stay(nocdyn, "omega_motor [rad/s]", "moment_k [N m]")
    assert columns["omega_motor [rad/s]"]["last"] == pytest.approx(SPEED, rel=EXACT)
    assert columns["torque_drive [N m]"]["last"] == pytest.approx(50 / 3, rel=EXACT)


def test_parts_that_slip_find_their_own_speeds(nocdyn):
    slipping = TRAIN.replace("stiffness = 2e4 damping = 5", "damping = 5")
    run(nocdyn, slipping, "free = 'load.air.viscous'")
    columns = all_stay(nocdyn, "omega_motor [rad/s]", "omega_fan [rad/s]")
    assert columns["omega_motor [rad/s]"]["last"] == pytest.approx(SPEED, rel=EXACT)
    assert columns["omega_pinion [rad/s]"]["last"] == pytest.approx(SPEED - 100 / 5, rel=EXACT)


def test_every_variant_of_a_sweep_finds_its_number(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'motor.drive.torque' low = 60 high = 120 count = 4 /\n"
    sweep += "".join(f"&record quantity = '{name}' statistic = 'max', 'min' /\n" for name in ("omega_motor", "moment_k"))
    nocdyn.write("m.nml", TRAIN + RUN.replace("KEYS", "free = 'load.air.quadratic'") + sweep)
    assert nocdyn("sweep", "m.nml", "--out", "all", "--csv", "--threads", 2).returncode == 0
    with open(nocdyn.folder / "all/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 4
    for row, torque in zip(rows, (60, 80, 100, 120)):
        for statistic in ("min", "max"):
            assert float(row[f"omega_motor_{statistic} [rad/s]"]) == pytest.approx(SPEED, rel=STEADY)
            assert abs(float(row[f"moment_k_{statistic} [N m]"])) == pytest.approx(torque, rel=STEADY)


def test_the_speed_of_a_start_varies_in_a_sweep(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'run.start_speed_rpm' low = 900 high = 1500 count = 3 /\n"
    sweep += "&record quantity = 'omega_motor' statistic = 'max', 'min' /\n"
    nocdyn.write("m.nml", TRAIN + RUN.replace("KEYS", "") + sweep)
    assert nocdyn("sweep", "m.nml", "--out", "all", "--csv").returncode == 0
    with open(nocdyn.folder / "all/sweep.csv", newline="") as file:
        for row, rpm in zip(csv.DictReader(file), (900, 1200, 1500), strict=True):
            for statistic in ("min", "max"):
                assert float(row[f"omega_motor_{statistic} [rad/s]"]) == pytest.approx(rpm * pi / 30, rel=STEADY)


def test_the_input_that_a_run_leaves_starts_like_the_run(nocdyn):
    run(nocdyn, TRAIN, "free = 'load.air.quadratic'")
    assert nocdyn("run", "out/input.nml", "--out", "again").returncode == 0
    assert nocdyn.table("again") == nocdyn.table("out")


def test_analyses_about_a_steady_state_do_not_ask_for_the_speed_of_the_run(nocdyn):
    braked = TRAIN.replace("constant = 50", "viscous = 4")
    nocdyn.write("m.nml", braked + RUN.replace("KEYS", ""))
    modes = nocdyn("modes", "m.nml")
    assert modes.returncode == 0
    nocdyn.write("m.nml", braked + "&run t_end = 2 /\n")
    assert nocdyn("modes", "m.nml").stdout == modes.stdout


def test_numbers_that_cannot_balance_are_refused(nocdyn):
    weak = TRAIN.replace("torque = 100", "torque = 10")
    message = refusal(nocdyn, weak, "free = 'load.air.viscous'", 1)
    assert "no allowed value of load.air.viscous balances the torques at that speed: at " in message
    assert message.endswith(" N m is missing on 'motor'\n")
    message = refusal(nocdyn, TRAIN, "free = 'body.fan.inertia'", 1)
    assert "the torques balance at that speed at no value of body.fan.inertia, which does not change them\n" in message


@pytest.mark.parametrize("free", ["load.air.torque", "load.water.quadratic", "quadratic", "load.air.table_speed", "gear.g.teeth"])
def test_what_is_no_number_of_the_machine_is_refused(nocdyn, free):
    message = refusal(nocdyn, TRAIN, f"free = '{free}'")
    assert f"m.nml:8: &run: free = '{free}' is no number of this machine; allowed: GROUP.NAME.KEY of a single number" in message


@pytest.mark.parametrize(
    ("text", "keys", "message"),
    [
        (TRAIN, "start_body = ''", "start_body"),
        (
            TRAIN + "&freewheel name = 'f' bodies = 'fan', 'ground' /\n",
            "",
            "start_speed is for machines without clutches, freewheels",
        ),
        (TRAIN.replace("internal", "efficiency = 0.9 internal"), "", "start_speed is for machines without clutches"),
    ],
)
def test_what_does_not_go_with_a_speed_is_refused(nocdyn, text, keys, message):
    assert message in refusal(nocdyn, text, keys)


def test_a_speed_needs_a_start_in_equilibrium_and_a_body(nocdyn):
    nocdyn.write("m.nml", TRAIN + "&run t_end = 1 start_speed = 5 start_body = 'fan' /\n")
    assert "start_speed is for start = 'equilibrium'" in nocdyn("check", "m.nml").stderr
    nocdyn.write("m.nml", TRAIN + "&run t_end = 1 start_speed = 5 start = 'equilibrium' /\n")
    assert "start_body" in nocdyn("check", "m.nml").stderr
    nocdyn.write("m.nml", TRAIN + "&run t_end = 1 free = 'load.air.viscous' start = 'equilibrium' /\n")
    assert "start_speed" in nocdyn("check", "m.nml").stderr
