"""Machines that drives turn at a given speed: steady states, modes and responses, for which a driven body is ground."""

import csv
import json
import random
from math import pi, sqrt

import numpy as np
import pytest
from conftest import fast_only

BODIES = """\
&body name = 'motor' inertia = 0.5 /
&body name = 'fan' inertia = 2 /
&coupling name = 'shaft' bodies = 'motor', 'fan' stiffness = 3000 damping = 1 /
&load name = 'air' body = 'fan' viscous = 0.3 /
"""
FAN = BODIES + "&drive name = 'held' body = 'motor' speed = 100 /\n"
RUN = "&run t_end = 1 /\n"
ORDERS = "&excitation name = 'blades' body = 'fan' kind = 'orders' orders = 0.5 amplitudes = 10 /\n"
RESPONSE = "&response body = 'motor' speed = 40, 140 count = 51 /\n"


def analysis(nocdyn, command, text, *options):
    """The content of its JSON file."""
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, ""), outcome.stderr
    return json.loads((nocdyn.folder / f"out/{command}.json").read_text())


def table_of(nocdyn, name):
    with open(nocdyn.folder / "out" / name) as file:
        rows = list(csv.DictReader(file))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def refusal(nocdyn, command, text, *options):
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert outcome.returncode != 0, outcome.stdout
    return outcome.stderr


def only_state(nocdyn, text):
    content = analysis(nocdyn, "equilibrium", text + RUN)
    assert len(content["steady_states"]) == 1
    return content["steady_states"][0]


def frequencies(nocdyn, text, kind="frequency_Hz"):
    modes = analysis(nocdyn, "modes", text + RUN)["modes"]
    return [mode[kind] for mode in modes if mode["kind"] == "oscillating"]


def test_a_drive_gives_its_body_the_torque_of_the_load(nocdyn):
    state = only_state(nocdyn, FAN)
    assert state["stability"] == "stable"
    values = state["values"]
    assert values["omega_motor [rad/s]"] == values["omega_fan [rad/s]"] == pytest.approx(100, rel=1e-15)
    assert values["moment_shaft [N m]"] == pytest.approx(-30, rel=1e-12)
    assert values["torque_held [N m]"] == pytest.approx(30, rel=1e-12)
    assert state["power_W"] == pytest.approx({"coupling shaft": 0, "load air": -3000, "drive held": 3000}, rel=1e-12)
    assert state["power_residual_W"] == pytest.approx(0, abs=1e-9)


def test_a_driven_body_is_ground_for_vibrations(nocdyn):
    assert frequencies(nocdyn, FAN, "undamped_frequency_Hz") == pytest.approx([sqrt(3000 / 2) / (2 * pi)], rel=1e-12)
    content = analysis(nocdyn, "modes", FAN + RUN)
    assert "turned at a given speed, without oscillations there: drive 'held'" in " ".join(content["notes"])
    # the same train with a very large inertia in place of the drive
    heavy = (
        BODIES.replace("inertia = 0.5", "inertia = 1e12") + "&motor name = 'm' body = 'motor' kind = 'constant' torque = 30 /\n"
    )
    assert frequencies(nocdyn, FAN) == pytest.approx(frequencies(nocdyn, heavy), rel=1e-9)


def amplitude_of(speed, order=0.5, torque=10.0):
    """Of the moment of the shaft [N m]."""
    w = order * speed
    return abs(torque * (3000 + 1j * w) / (3000 - 2 * w**2 + 1j * w * 1.3))


def test_a_response_has_its_speeds_in_place_of_the_one_of_the_drive(nocdyn):
    analysis(nocdyn, "response", FAN + ORDERS + RESPONSE + RUN)
    table = table_of(nocdyn, "response.csv")
    speed = table["omega_motor [rad/s]"]
    assert len(speed) > 51
    assert table["half_range_total_moment_shaft [N m]"] == pytest.approx(amplitude_of(speed), rel=1e-9)
    assert table["mean_total_moment_shaft [N m]"] == pytest.approx(-0.3 * speed, rel=1e-12)
    # the drive carries what the shaft does, as its body does not oscillate
    assert table["mean_torque_held [N m]"] == pytest.approx(0.3 * speed, rel=1e-12)
    assert table["half_range_torque_held [N m]"] == pytest.approx(amplitude_of(speed), rel=1e-9)
    orders = table_of(nocdyn, "response_orders.csv")
    assert all(orders["phi_motor [rad]"] == 0)
    assert max(orders["phi_fan [rad]"]) > 0
    critical = analysis(nocdyn, "campbell", FAN + ORDERS + RESPONSE + RUN)["crossings"]
    assert [one["speed_rad_s"] for one in critical] == pytest.approx([2 * sqrt(1500 - (1.3 / 4) ** 2)], rel=1e-6)


@pytest.mark.parametrize("ramp", ["table_time = 0, 5 table_speed = 0, 70", "table_time = 0, 5, 6 table_speed = 10, 70, 30"])
def test_a_drive_that_runs_up_has_responses_but_no_steady_state(nocdyn, ramp):
    ramped = FAN.replace("speed = 100", ramp)
    said = refusal(nocdyn, "equilibrium", ramped + RUN)
    assert "machine.nml:5: &drive 'held': nocdyn equilibrium is about a steady state, and the speed of this drive changes" in said
    assert "nocdyn response and nocdyn campbell set speeds in its place" in said
    tables = []
    for text in (FAN, ramped):
        analysis(nocdyn, "response", text + ORDERS + RESPONSE + RUN)
        tables.append((nocdyn.folder / "out/response.csv").read_text())
    assert tables[0] == tables[1]
    # that of a body which does not turn with the drive
    beside = "&body name = 'other' inertia = 1 /\n&motor name = 'm' body = 'other' a = 10 b = 0.1 c = 0 /\n"
    said = refusal(nocdyn, "response", ramped + beside + ORDERS + RESPONSE.replace("'motor'", "'other'") + RUN)
    assert "the speed of this drive changes, and 'other' of &response does not turn with it" in said


def test_a_drive_that_oscillates_has_no_steady_state(nocdyn):
    text = FAN.replace("speed = 100", "speed = 100 speed_amplitude = 1 frequency = 9")
    for command in ("equilibrium", "modes", "response"):
        said = refusal(nocdyn, command, text + ORDERS + RESPONSE + RUN)
        assert "the speed of this drive changes; allowed: a constant speed" in said
        assert "set speeds in its place" not in said


GEARED = FAN + "&body name = 'wheel' inertia = 3 /\n&gear name = 'g' bodies = 'fan', 'wheel' radii = 0.1, 0.2 /\n"


def test_drives_that_contradict_each_other_or_springs_are_refused(nocdyn):
    twice = GEARED + "&drive name = 'other' body = 'wheel' speed = {} /\n&body name = 'disc' inertia = 1 /\n"
    twice += "&coupling name = 'limb' bodies = 'wheel', 'disc' stiffness = 100 damping = 1 /\n"
    said = refusal(nocdyn, "equilibrium", twice.format(-51) + RUN)
    assert "&drive 'other': gears, elastic couplings or other drives do not let 'wheel' turn at -51 rad/s for good" in said
    state = only_state(nocdyn, twice.format(-50))["values"]
    assert state["omega_fan [rad/s]"] == pytest.approx(100, rel=1e-14)
    assert state["moment_shaft [N m]"] == pytest.approx(0, abs=1e-9)  # the start twist stays: the other drive carries the load
    assert state["torque_other [N m]"] == pytest.approx(-60, rel=1e-12)
    spring = "&coupling name = 'spring' bodies = 'ground', 'fan' stiffness = 10 /\n"
    said = refusal(nocdyn, "modes", FAN + spring + RUN)
    assert "do not let 'motor' turn at 100 rad/s for good: there is no steady state" in said


def test_drives_at_different_speeds_with_a_damper_between_are_steady(nocdyn):
    other = "&body name = 'brush' inertia = 1 /\n&drive name = 'slow' body = 'brush' speed = 60 /\n"
    other += "&coupling name = 'fluid' bodies = 'fan', 'brush' damping = 0.2 /\n"
    values = only_state(nocdyn, FAN + other)["values"]
    assert values["moment_shaft [N m]"] == pytest.approx(-30 - 0.2 * 40, rel=1e-12)
    assert values["torque_slow [N m]"] == pytest.approx(-0.2 * 40, rel=1e-12)
    # over the speeds of one drive the other one keeps its own
    analysis(nocdyn, "response", FAN + other + ORDERS + RESPONSE + RUN)
    table = table_of(nocdyn, "response.csv")
    speed = table["omega_motor [rad/s]"]
    assert table["mean_torque_slow [N m]"] == pytest.approx(0.2 * (60 - speed), abs=1e-10)


def test_a_drive_turns_a_train_that_another_one_holds_at_rest(nocdyn):
    text = """\
&body name = 'sun' inertia = 1 /
&body name = 'ring' inertia = 2 /
&body name = 'carrier' inertia = 3 /
&body name = 'out' inertia = 5 /
&planetary name = 'set' sun = 'sun' ring = 'ring' carrier = 'carrier' teeth = 30, 60 /
&coupling name = 'shaft' bodies = 'carrier', 'out' stiffness = 1000 damping = 1 /
&drive name = 'turn' body = 'sun' speed = 90 /
&drive name = 'hold' body = 'ring' speed = 0 /
&load name = 'l' body = 'out' viscous = 2 /
"""
    values = only_state(nocdyn, text)["values"]
    assert values["omega_out [rad/s]"] == pytest.approx(30, rel=1e-14)
    assert values["omega_ring [rad/s]"] == 0
    assert (values["torque_turn [N m]"], values["torque_hold [N m]"]) == pytest.approx((20, 40), rel=1e-12)
    assert frequencies(nocdyn, text, "undamped_frequency_Hz") == pytest.approx([sqrt(1000 / 5) / (2 * pi)], rel=1e-12)


def test_a_body_that_a_drive_turns_has_no_motion_about_a_time(nocdyn):
    assert "allowed: equilibrium or rest" in refusal(nocdyn, "modes", FAN + RUN, "--at", "0.5")
    about_rest = analysis(nocdyn, "modes", FAN + RUN, "--at", "rest")["modes"]
    assert about_rest[0]["undamped_frequency_Hz"] == pytest.approx(sqrt(1500) / (2 * pi), rel=1e-12)


def random_train(seed):
    """A driven body, a train behind it with gears, a slip coupling, motors and loads; bearings that hold or slip."""
    random.seed(seed)
    text = f"&body name = 'b0' inertia = {random.uniform(0.5, 2)} /\n"
    speed = random.choice([-1, 1]) * random.uniform(40, 120)
    text += f"&drive name = 'd' body = 'b0' speed = {speed} /\n"
    for i in range(1, 6):
        text += f"&body name = 'b{i}' inertia = {random.uniform(0.5, 2)} "
        text += f"bearing_friction = {random.uniform(0.1, 2)} /\n" if random.random() < 0.3 else "/\n"
        joint = random.choice(["gear", "spring", "spring", "fluid", "slip"]) if i > 1 else random.choice(["gear", "spring"])
        at = f"bodies = 'b{random.randrange(i)}', 'b{i}'"
        if joint == "gear":
            text += f"&gear name = 'g{i}' {at} teeth = {random.randint(20, 40)}, {random.randint(20, 40)} /\n"
        elif joint == "spring":
            text += f"&coupling name = 'c{i}' {at} stiffness = {random.uniform(500, 5000)} damping = {random.uniform(5, 20)} /\n"
        elif joint == "fluid":
            text += f"&coupling name = 'c{i}' {at} damping = {random.uniform(0.2, 2)} /\n"
        else:
            text += f"&coupling name = 'c{i}' {at} friction = {random.uniform(1, 20)} friction_speed = 2 damping = 0.1 /\n"
        if random.random() < 0.7:
            text += (
                f"&load name = 'l{i}' body = 'b{i}' viscous = {random.uniform(0.1, 1)} quadratic = {random.uniform(0, 0.01)} /\n"
            )
        if random.random() < 0.3:
            text += f"&motor name = 'm{i}' body = 'b{i}' a = {random.uniform(0, 30)} b = {random.uniform(0.1, 0.5)} c = 0 /\n"
    return text


@pytest.mark.parametrize("seed", range(12))
def test_the_steady_state_is_the_end_of_a_long_run(nocdyn, seed):
    text = random_train(seed)
    states = analysis(nocdyn, "equilibrium", text + RUN)["steady_states"]
    assert len(states) == 1
    run = "&run t_end = 150 rtol = 1e-10 atol = 1e-11 start = 'projected' /\n&output interval = 10 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text + run), "--out", "run", "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("run")
    last = dict(zip(header, rows[-1], strict=True))
    common = {key: value for key, value in states[0]["values"].items() if key in last and "friction" not in key}
    assert len(common) > 12
    for key, value in common.items():
        assert last[key] == pytest.approx(value, rel=1e-5, abs=1e-4), (seed, key)
    assert states[0]["power_residual_W"] == pytest.approx(0, abs=1e-8 * states[0]["power_put_in_W"])


@fast_only
@pytest.mark.parametrize("seed", [1, 4, 7])
def test_a_response_is_that_of_a_settled_run(nocdyn, seed):
    """With small oscillations, by a least squares fit over whole periods."""
    text = random_train(seed)
    text = "\n".join(line.split(" bearing_friction")[0] + " /" if "bearing" in line else line for line in text.splitlines())
    text += "\n&excitation name = 'e' body = 'b1' kind = 'orders' orders = 0.25 amplitudes = 1e-3 /\n"
    speed = next(float(line.split("speed = ")[1].split()[0]) for line in text.splitlines() if line.startswith("&drive"))
    analysis(nocdyn, "response", text + f"&response body = 'b0' speed = {speed!r} /\n" + RUN)
    table = table_of(nocdyn, "response.csv")
    frequency = float(table_of(nocdyn, "response_orders.csv")["frequency [Hz]"][0])
    run = f"&run t_end = {200 / frequency!r} start = 'equilibrium' method = 'rk853' rtol = 1e-11 atol = 1e-13 /\n"
    run += f"&output interval = {0.025 / frequency!r} /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text + run), "--out", "run", "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("run")
    rows = np.array(rows[-401:])
    angle = 2 * pi * frequency * rows[:, 0]
    moments = [key for key in table if key.startswith("half_range_") and "[N m]" in key]
    compared = 0
    for key in moments:
        column = key.removeprefix("half_range_")
        if column not in header:
            continue
        basis = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)], axis=1)
        mean, *parts = np.linalg.lstsq(basis, rows[:, header.index(column)], rcond=None)[0]
        assert table[key][0] == pytest.approx(np.hypot(*parts), rel=1e-5, abs=1e-9), key
        assert table["mean_" + column][0] == pytest.approx(mean, rel=1e-6, abs=1e-6), key
        compared += 1
    assert compared > 2


def test_a_run_may_start_in_the_steady_state_of_a_drive(nocdyn):
    run = "&run t_end = 0.5 start = 'equilibrium' rtol = 1e-9 /\n&output interval = 0.1 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", FAN + run), "--out", "out", "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    values = nocdyn.values()
    assert values["moment_shaft"] == pytest.approx(-30, rel=1e-9)
    assert values["omega_fan"] == pytest.approx(100, rel=1e-9)
