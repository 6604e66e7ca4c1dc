"""Losses of teeth and bearings, and friction over the slip, against closed forms and other computations."""

import json
from math import exp, sin

import numpy as np
import pytest
from conftest import all_if_fast
from impulse_references import LOSSY_SEEDS, STEP, LossyTrain
from verified import known

FORMULATIONS = ("reduced", "multiplier", "paper")


def run(nocdyn, text, *words):
    nocdyn.done(text, *words)
    return nocdyn.values(), nocdyn.summary("out").get("joint_events", [])


LOAD = "&load name = 'l' body = 'two' viscous = 2 /\n"


def work(nocdyn, element):
    return nocdyn.summary("out")["energy_account"]["work_in_J"][element]


def body(name, inertia, speed=0.0, keys=""):
    return f"&body name = '{name}' inertia = {inertia} speed = {speed} {keys} /\n"


# Examples of the Modelica Standard Library, and values of the reference results that the Modelica Association publishes for them
# (modelica/MAP-LIB_ReferenceResults): a column, the range of its values, and values at some times.
LOSSY = body("one", 1) + body("two", 1.5)
LOSSY += "&gear name = 'g' bodies = 'one', 'two' teeth = 20, 40 internal = .true. efficiency = 0.5 /\n"
LOSSY += "&excitation name = 'drive' body = 'one' amplitude = 10 frequency_hz = 1 /\n"
LOSSY += "&excitation name = 'load' body = 'two' kind = 'table' table_time = 0, 2 table_torque = -10, -5 /\n"
BEARING = "&clutch name = 'bearing' bodies = 'one', 'ground' table_slip = 0, 1 table_capacity = 0.5, 1 /\n"
STOPPING = "".join(body(name, 0.001, 10, "bearing_friction = 0.5") for name in ("one", "two"))
STOPPING += "&gear name = 'g' bodies = 'one', 'two' teeth = 20, 20 internal = .true. efficiency = 0.25 /\n"
STOPPING += "&excitation name = 'load' body = 'two' kind = 'step' amplitude = 1 time = 0.5 /\n"
ONE_WAY = body("one", 1, -0.5) + body("two", 1)
ONE_WAY += "&clutch name = 'c' bodies = 'one', 'two' capacity = 1.5 static_capacity = 37.5\n"
ONE_WAY += "  times = 0.3, 0.95, 1.6 levels = 1, 0, 1 /\n&freewheel name = 'f' bodies = 'one', 'two' /\n"
ONE_WAY += "&excitation name = 'drive' body = 'one' amplitude = 10 frequency_hz = 3 /\n"
TIMES = [0.0005 * i for i in range(1001)]
FRICTION = body("one", 1, 100) + body("two", 0.05, 90) + body("three", 1, 90)
FRICTION += "&clutch name = 'c' bodies = 'one', 'two' capacity = 80 /\n"
FRICTION += "&coupling name = 'spring' bodies = 'two', 'three' stiffness = 160 damping = 1 /\n"
FRICTION += "&clutch name = 'brake' bodies = 'three', 'ground' capacity = 800 times = 0.5 levels = 1 /\n"
FRICTION += "&excitation name = 'drive' body = 'one' kind = 'table' interpolation = 'cubic' table_file = 'drive.csv' /\n"
EXAMPLES = {
    "LossyGearDemo1": (LOSSY, 0.5, 0.0345436, [("omega_two", t, v) for t, v in (
        (0.05, known("losses.modelica_0_05")), (0.15, 0.0), (0.19, 0.0), (0.25, known("losses.modelica_0_25")),
        (0.3, 0.013181180167), (0.35, 0.008695024997), (0.4, 0.0), (0.5, known("losses.modelica_0_5")))]),
    "LossyGearDemo2": (LOSSY + BEARING, 0.5, 0.0145020, [("omega_two", t, v) for t, v in (
        (0.03, -0.013166462625), (0.06, -0.002760770102), (0.15, 0.0), (0.25, 0.000420504274), (0.28, 0.001298683914),
        (0.3, 0.000746185083), (0.4, 0.0), (0.5, -0.009624278093))]),
    "LossyGearDemo3": (STOPPING, 1.0, 10.0, [("omega_two", t, v) for t, v in (
        (0.005, 7.5), (0.01, 5.0), (0.015, 2.5), (0.5, 0.0), (1.0, 0.0))]),
    "OneWayClutch": (ONE_WAY, 2.0, 1.0610301, [("omega_one", t, v) for t, v in (
        (0.05, -0.281313847701), (0.1, 0.097226621512), (0.2, 0.179201486136), (0.35, known("joints_that_lock.modelica_0_35")),
        (0.4, -0.263936877505), (0.6, -0.066703846843), (0.9, 0.097237703769), (1.2, 0.179211003301),
        (1.4, known("joints_that_lock.modelica_1_4")), (1.7, -0.529186127377),
        (2.0, known("joints_that_lock.modelica_2_0")))]),
    "Friction": (FRICTION, 3.0, 108.2986946, [("omega_one", t, v) for t, v in (
        (0.05, 98.653133337), (0.2, 91.698091322), (0.4, 99.331948222), (0.6, 85.091243121), (0.8, 69.091243121),
        (1.2, 37.091243121), (2.0, 4.449327642), (3.0, 2.289890999))]),
}  # fmt: skip


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("example", EXAMPLES)
def test_examples_of_modelica_move_as_published(nocdyn, example, formulation):
    text, end, width, values = EXAMPLES[example]
    rows = "\n".join(f"{t!r}, {200 * sin(100 * t)!r}" for t in TIMES)
    nocdyn.write("drive.csv", rows + "\n0.500000001, 0\n")
    text += f"&run t_end = {end} formulation = '{formulation}' rtol = 1e-8 atol = 1e-10 /\n&output interval = 0.005 /\n"
    table, _ = run(nocdyn, text)
    times = np.array(table["t [s]"])
    for name, t, value in values:
        assert table[name][np.argmin(abs(times - t))] == pytest.approx(value, abs=1e-3 * width), (name, t)
    assert abs(table["energy_residual"]).max() < 1e-5 * max(1.0, *table["work_out"])


def gear_pair(drive, keys, method="auto", formulation="reduced"):
    text = body("one", 0.2) + body("two", 3.0) + f"&gear name = 'g' bodies = 'one', 'two' radii = 0.1, 0.3 {keys} /\n"
    text += "".join(
        f"&excitation name = 'e{b}' body = '{b}' kind = 'step' amplitude = {m} time = -1 /\n" for b, m in drive.items()
    )
    return text + f"&run t_end = 2 method = '{method}' formulation = '{formulation}' rtol = 1e-9 atol = 1e-11 /\n"


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("method", all_if_fast("auto", "rk853", "rodas5p", "rodas4"))
def test_the_driving_wheel_pays_for_the_loss(nocdyn, method, formulation):
    # T = 0.1 F on the first wheel; it needs T / efficiency where it drives: 0.2 a = 6 - T / 0.8, 3 a / 3 = 3 T - 9 sign
    text = gear_pair({"one": 6.0}, "efficiency = 0.8 reverse_efficiency = 0.6", method, formulation)
    table, _ = run(nocdyn, text)
    acceleration = 6.0 / (0.2 + 3.0 / 9.0 / 0.8)
    assert table["omega_one"][-1] == pytest.approx(2 * acceleration, rel=1e-9)
    # where the second wheel drives the first one gets 0.6 of it: 0.2 a = 0.6 T, 3 a / 9 = 6 - T
    table, _ = run(nocdyn, gear_pair({"two": 18.0}, "efficiency = 0.8 reverse_efficiency = 0.6", method, formulation))
    acceleration = 6.0 / (3.0 / 9.0 + 0.2 / 0.6)
    assert table["omega_one"][-1] == pytest.approx(-2 * acceleration, rel=1e-9)
    assert abs(table["energy_residual"]).max() < 1e-6 * table["work_in"][-1]
    lost = (1 / 0.6 - 1) * 0.5 * 0.2 * (2 * acceleration) ** 2
    assert work(nocdyn, "loss g") == pytest.approx(-lost, rel=1e-6)


def test_a_self_locking_gear_holds_what_its_second_wheel_bears(nocdyn):
    table, events = run(nocdyn, gear_pair({"two": 18.0}, "efficiency = 0.4 reverse_efficiency = -0.1"))
    assert max(abs(table["omega_two"])) == 0.0 and events == []
    assert table["loss_g"][-1] == pytest.approx(6.0) and table["reaction_g"][-1] == pytest.approx(-60.0)
    notes = nocdyn.summary("out")["machine"]["notes"]
    assert notes == ["the teeth of 'g' are self-locking: their second wheel cannot drive"]
    # driven downwards by its first wheel, it brakes the second one: it gets -0.1 T: 0.2 a = 1 - 0.1 T, 3 a / 9 = 6 - T
    table, events = run(nocdyn, gear_pair({"one": -1.0, "two": 18.0}, "efficiency = 0.4 reverse_efficiency = -0.1"))
    acceleration = (1.0 - 0.1 * 6.0) / (0.2 - 0.1 * 3.0 / 9.0)
    assert table["omega_one"][-1] == pytest.approx(-2 * acceleration, rel=1e-9)
    assert [event["to"] for event in events] in ([], ["slips behind"])


def test_a_brake_that_closes_at_rest_shares_what_a_worm_holds(nocdyn):
    text = gear_pair({"two": 18.0}, "efficiency = 0.4 reverse_efficiency = -0.1")
    text += "&clutch name = 'brake' bodies = 'one', 'ground' capacity = 20 times = 1 levels = 1 /\n&output interval = 0.25 /\n"
    table, events = run(nocdyn, text)
    torque, times = table["torque_brake"], np.array(table["t [s]"])
    assert not any(torque[times < 1]) and torque[-1] == pytest.approx(-3.0) and min(torque) == pytest.approx(-3.0)
    assert [(event["joint"], event["from"], event["to"]) for event in events] == [("clutch brake", "open", "locked")]


SELF_LOCKING = """\
&body name = 'm' inertia = 1e-5 speed = -100 /
&body name = 'w' inertia = 10 /
&gear name = 'worm' bodies = 'm', 'w' teeth = 1, 40 internal = .true. efficiency = 0.4 reverse_efficiency = -0.5 /
&motor name = 'T' body = 'w' kind = 'constant' torque = -60 /
&motor name = 'D' body = 'm' kind = 'constant' torque = -3 /
&run t_end = 0.3 /
"""


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_of_two_motions_the_limit_of_elastic_teeth_is_taken(nocdyn, formulation):
    # 1e-5 * 40 a = -3 - T / 0.4 and 10 a = -60 + 40 T
    table, events = run(nocdyn, SELF_LOCKING, "--set", f"run.formulation={formulation}")
    acceleration = (-60 - 40 * 3 * 0.4) / (10 + 40 * 40 * 1e-5 * 0.4)
    assert table["omega_m"][-1] == pytest.approx(-100 + 0.3 * 40 * acceleration, rel=1e-9)
    assert events == []


def test_teeth_without_a_load_behind_a_crank_are_no_obstacle(nocdyn):
    text = "&body name = 'b2' inertia = 0.25 speed = 20 /\n&body name = 'b3' inertia = 0.5 /\n"
    text += "&gear name = 'g3' bodies = 'b2', 'b3' radii = 1, 1 internal = .true. efficiency = 0.9 reverse_efficiency = 0.5 /\n"
    text += "&body name = 'b4' inertia = 2 speed = 20 /\n&clutch name = 'c4' bodies = 'b3', 'b4' capacity = 25 /\n"
    text += (
        "&crank name = 'cr' body = 'b4' crank_radius = 0.05 rod_length = 0.2 piston_mass = 1.9 phase = 1.8 /\n&run t_end = 2 /\n"
    )
    table, _ = run(nocdyn, text)
    assert table["omega_b4"][-1] == pytest.approx(19.98462, abs=1e-5)


@pytest.mark.parametrize(("drive", "speed"), [("sun", 0.25 * (1 + 3 * 0.9)), ("carrier", 0.25 * (1 + 3 / 0.8))])
def test_a_planetary_set_loses_by_the_motion_against_its_carrier(nocdyn, drive, speed):
    # the torques on sun and carrier are 1 : 1 + 3 * 0.9 where the sun drives, 1 : 1 + 3 / 0.8 where the ring does
    text = body("sun", 0.1) + body("carrier", 0.5)
    text += "&planetary name = 'p' sun = 'sun' ring = 'ground' carrier = 'carrier' teeth = 20, 60\n"
    text += "  efficiency = 0.9 reverse_efficiency = 0.8 /\n"
    text += f"&excitation name = 'e' body = '{drive}' kind = 'step' amplitude = 10 time = 0 /\n"
    text += f"&load name = 'l' body = '{'carrier' if drive == 'sun' else 'sun'}' viscous = 0.5 /\n&run t_end = 400 /\n"
    table, _ = run(nocdyn, text, "--set", "output.interval=10")
    # balance of the load and what arrives of 10 N m
    arrives = 10 * 4 * speed if drive == "sun" else 10 / (4 * speed)
    loaded = "carrier" if drive == "sun" else "sun"
    assert table[f"omega_{loaded}"][-1] == pytest.approx(arrives / 0.5, rel=1e-6)


def test_losses_follow_their_table_over_the_speed(nocdyn):
    text = body("one", 0.2) + body("two", 3.0) + "&gear name = 'g' bodies = 'one', 'two' radii = 0.1, 0.3\n"
    text += "  table_speed = 0, 20, 100 table_efficiency = 0.7, 0.9, 0.98 /\n"
    text += "&excitation name = 'e' body = 'one' kind = 'step' amplitude = 6 time = 0 /\n" + LOAD
    text += "&run t_end = 60 METHOD rtol = 1e-9 atol = 1e-10 /\n&output interval = 0.1 /\n"
    speeds = []
    for method in ("rk853", "rodas5p"):
        table, _ = run(nocdyn, text.replace("METHOD", f"method = '{method}'"))
        speed, loss = table["omega_one"], table["loss_g"]
        arrives = -(3.0 * np.gradient(table["omega_two"], 0.1) + 2 * table["omega_two"]) / 3
        efficiency = np.interp(speed, [0, 20, 100], [0.7, 0.9, 0.98])
        assert loss[5:-5] == pytest.approx((-arrives * (1 / efficiency - 1))[5:-5], rel=1e-2)
        assert 18 * efficiency[-1] / 2 == pytest.approx(-table["omega_two"][-1], rel=1e-6)
        speeds.append(speed)
    assert speeds[0] == pytest.approx(speeds[1], abs=1e-6)


def test_an_elastic_mesh_loses_as_a_gear_does(nocdyn):
    load = LOAD + "&excitation name = 'e' body = 'one' kind = 'ramp' amplitude = 6 time = 0 duration = 1 /\n"
    found = []
    for group in ("gear name = 'g' radii = 0.1, 0.3", "mesh name = 'g' radii = 0.1, 0.3 stiffness = 1e8 damping = 1e5"):
        text = body("one", 0.2) + body("two", 3.0) + f"&{group} bodies = 'one', 'two' efficiency = 0.9 /\n" + load
        table, _ = run(nocdyn, text + "&run t_end = 5 rtol = 1e-8 atol = 1e-9 /\n&output interval = 0.5 /\n")
        found.append((table["omega_two"], work(nocdyn, "loss g")))
    assert found[0][0] == pytest.approx(found[1][0], rel=1e-4, abs=1e-4)
    assert found[0][1] == pytest.approx(found[1][1], rel=1e-3)


@pytest.mark.parametrize("method", ["auto", "rodas5p"])
def test_the_capacity_follows_its_table_over_the_slip(nocdyn, method):
    # 2 slip' = -(10 + 5 slip) below 2 rad/s and -20 above: the slip is constant - 10 t, then goes to -2 by exp(-2.5 t)
    text = body("one", 1, 12) + body("two", 1)
    text += "&clutch name = 'c' bodies = 'one', 'two' table_slip = 0, 2 table_capacity = 10, 20 static_capacity = 15 /\n"
    table, events = run(
        nocdyn, text + f"&run t_end = 2 method = '{method}' rtol = 1e-10 atol = 1e-12 /\n&output interval = 0.05 /\n"
    )
    times, slip = np.array(table["t [s]"]), table["slip_c"]
    kink = 10 / 40
    expected = [12 - 40 * t if t < kink else max(0.0, 4 * exp(-10 * (t - kink)) - 2) for t in times]
    assert slip == pytest.approx(expected, abs=1e-8)
    assert events[0]["time"] == pytest.approx(kink + np.log(2) / 10, abs=1e-9)


# Speeds at the end of random trains with losses, printed by impulse_references.py.
STEPPED = [
    [-1.30274838, 1.00055511, 0.57921187, -0.29439522, -0.29439522],
    [-0.08272308, 0.044625, 0.0209477, -0.01247746, -0.01247746],
    [1.00615827, -0.69914175, -0.70097732, 0.48961777, 0.48961777],
    [0.10326849, -0.19163237, -0.23740127, 0.23684437, 0.23684437],
]


@pytest.mark.parametrize("seed", LOSSY_SEEDS)
def test_random_trains_with_losses_move_as_small_steps_say(nocdyn, seed):
    train = LossyTrain(seed)
    table, events = run(nocdyn, train.text())
    assert events
    speeds = [table[f"omega_b{i}"][-1] for i in range(5)]
    assert speeds == pytest.approx(STEPPED[seed], abs=100 * STEP * max(t[0] / j for t, j in zip(train.torque, train.inertia)))
    assert max(abs(table["energy_residual"])) < 1e-6
    for formulation in FORMULATIONS[1:]:
        table, _ = run(nocdyn, train.text(), "--set", f"run.formulation={formulation}")
        assert [table[f"omega_b{i}"][-1] for i in range(5)] == pytest.approx(speeds, abs=1e-7)


@pytest.mark.parametrize("base", ["efficiency = 0.9", ""])
def test_a_sweep_over_the_efficiency_is_its_runs(nocdyn, base):
    text = gear_pair({"one": 6.0}, base) + "&load name = 'l' body = 'two' viscous = 2 /\n"
    text += "&sweep design = 'grid' /\n&vary target = 'gear.g.efficiency' low = 0.8 high = 1 count = 3 /\n"
    text += "&record quantity = 'omega_two' statistic = 'final' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", text), "--out", "all", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    lines = [line.split(",") for line in (nocdyn.folder / "all/sweep.csv").read_text().splitlines() if line[:1].isdigit()]
    assert len(lines) == 3
    for line in lines:
        table, _ = run(nocdyn, text, "--set", f"gear.g.efficiency={line[1]}")
        assert float(line[2]) == pytest.approx(table["omega_two"][-1], rel=1e-8)


def test_reversals_of_joints_beside_lossy_teeth_are_events(nocdyn):
    text = body("one", 1, 0, "bearing_friction = 0.5") + body("two", 1) + GEAR.format("efficiency = 0.9")
    text += "&excitation name = 'e' body = 'one' amplitude = 20 frequency = 5 /\n&run t_end = 3 /\n&output interval = 0.001 /\n"
    table, events = run(nocdyn, text)
    speed = table["omega_one"]
    reversals = np.count_nonzero(np.diff(np.sign(speed[np.abs(speed) > 1e-6])))
    assert reversals >= 2
    for joint in ("bearing one", "loss g"):
        words = [event["to"] for event in events if event["joint"] == joint and event["to"] != "locked"]
        assert np.count_nonzero(np.array(words[1:]) != np.array(words[:-1])) == reversals, joint
        assert words[0] == "slips ahead"  # it begins to turn forward


GEAR = "&gear name = 'g' bodies = 'one', 'two' teeth = 20, 40 {} /\n"


@pytest.mark.parametrize(
    ("group", "words"),
    [
        (GEAR.format("efficiency = 1.1"), "efficiency = 1.1 is out of range; allowed: > 0 to 1"),
        (GEAR.format("efficiency = 0"), "efficiency = 0 is out of range"),
        (GEAR.format("reverse_efficiency = 0.5"), "reverse_efficiency needs efficiency"),
        (GEAR.format("efficiency = 0.9 table_speed = 0, 1 table_efficiency = 1, 1"), "efficiency and table_speed are both given"),
        (GEAR.format("table_speed = 1, 2 table_efficiency = 0.9, 1"), "table_speed(1) = 1; allowed: 0 first, then the speeds in"),
        (GEAR.format("table_speed_rpm = 100, 200 table_efficiency = 0.9, 1"), ": table_speed_rpm(1) = 100; allowed: 0 first"),
        (
            GEAR.format("table_speed = 0, 2 table_efficiency = 0.9, 1 table_reverse = 0.5, 0.6, 0.7"),
            "table_reverse has 3 values; needed: 2, as table_speed",
        ),
        (GEAR.replace("'one', 'two'", "'ground', 'two'").format("efficiency = 0.9"), "'ground' is the first wheel"),
        (
            "&clutch name = 'c' bodies = 'one', 'two' table_slip = 1, 2 table_capacity = 3, 4 /\n",
            "table_slip(1) = 1; allowed: 0 first, then the slips in either direction",
        ),
        (
            "&clutch name = 'c' bodies = 'one', 'two' capacity = 4 interpolation = 'cubic' /\n",
            "interpolation needs table_time or table_slip",
        ),
        (
            "&body name = 'three' inertia = 1 bearing_friction = -1 /\n",
            "bearing_friction = -1 is out of range; allowed: >= 0 [N m]",
        ),
    ],
)
def test_bad_losses_are_refused(nocdyn, group, words):
    text = body("one", 1) + body("two", 1) + group + "&run t_end = 1 /\n"
    outcome = nocdyn("check", nocdyn.write("bad.nml", text))
    assert outcome.returncode == 2
    assert "bad.nml:3: &" in outcome.stderr and words in outcome.stderr


def test_forced_vibrations_leave_losses_out_and_say_so(nocdyn):
    text = body("one", 0.2) + body("two", 3.0, 0, "bearing_friction = 1") + GEAR.format("efficiency = 0.9")
    text += "&excitation name = 'e' body = 'one' kind = 'step' amplitude = 6 time = 0 /\n" + LOAD
    text += "&response body = 'one' speed = 10, 20 /\n&excitation name = 'v' body = 'one' amplitude = 1 frequency = 9 /\n"
    path = nocdyn.write("steady.nml", text + "&run t_end = 1 /\n")
    for command in ("response", "campbell"):
        outcome = nocdyn(command, path, "--out", "out")
        assert outcome.returncode == 0, outcome.stderr
        (note,) = [note for note in json.loads((nocdyn.folder / f"out/{command}.json").read_text())["notes"] if "losses" in note]
        assert f"note: {note}\n" in outcome.stdout
        torque = (2 * 10 + 1) * 0.5 * (1 / 0.9 - 1)  # at 20 rad/s: the load and the friction of the bearing
        words = f"up to {torque:.4g} N m on the first wheel of 'g' at 190.986 rpm"
        assert note == f"the losses of 'g' are left out, at the mean torques {words}"


def test_the_note_on_redundant_gears_says_that_their_losses_count(nocdyn):
    gears = "".join(f"&gear name = '{name}' bodies = 'one', 'two' teeth = 20, 30 {{}} /\n" for name in ("first", "second"))
    for losses, words in (
        ("efficiency = 0.9", "share is reported, and its losses are in the motion\n"),
        ("", "share is reported\n"),
    ):
        text = body("one", 1) + body("two", 1) + gears.format(losses, "") + "&run t_end = 1 /\n"
        outcome = nocdyn("check", nocdyn.write("pair.nml", text))
        assert outcome.returncode == 0, outcome.stderr
        assert words in outcome.stdout
