"""Clutches, brakes and freewheels: when they lock and slip, their torques and heat, against other computations."""

import csv
from itertools import product
from math import pi, sin

import pytest
from conftest import all_if_fast
from impulse_references import BODY, SEEDS, STEP, Train


def run(nocdyn, text, *words):
    nocdyn.done(text, *words)
    return nocdyn.values(), nocdyn.summary("out")["joint_events"]


def changes(events):
    return [(event["joint"].split()[1], event["to"]) for event in events]


# CoupledClutches of the Modelica Standard Library: four inertias of 1, clutches of 10 N m sliding and 11 N m at rest.
KINK = 1.25  # where the first clutch opens


def coupled_clutches():
    times = sorted([1.5 * i / 3000 for i in range(3001)] + [KINK - 1e-6])
    levels = [max(0.0, sin(0.4 * pi * t + pi / 2)) if t < KINK else 0.0 for t in times]
    clutch = "&clutch name = 'clutch{}' bodies = 'J{}', 'J{}' capacity = 10 static_capacity = 11\n  {} /\n"
    table = "interpolation = 'cubic'"
    for key, values in (("table_time", times), ("table_level", levels)):
        lines = [", ".join(map(repr, values[i : i + 5])) for i in range(0, len(values), 5)]
        table += f"\n  {key} = " + ",\n    ".join(lines)
    text = "".join(BODY.format(f"J{i}", 1, 10 if i == 1 else 0) for i in range(1, 5))
    text += clutch.format(1, 1, 2, table) + clutch.format(2, 2, 3, "times = 0.4 levels = 1")
    text += clutch.format(3, 3, 4, "times = 0.9 levels = 1")
    text += f"&excitation name = 'torque' body = 'J1' amplitude = 10 frequency = {10 * pi!r} /\n"
    return text + "&run t_end = 1.5 method = 'METHOD' rtol = 1e-12 atol = 1e-13 /\n&output interval = 0.1 /\n"


@pytest.mark.parametrize(
    ("method", "formulation"),
    [("taylor", "reduced"), *product(all_if_fast("auto", "rk45", "rk853", "rodas5p"), ["reduced", "multiplier", "paper"])],
)
def test_coupled_clutches_lock_and_slip_when_those_of_modelica_do(nocdyn, method, formulation):
    text = coupled_clutches().replace("METHOD", method).replace("rtol", f"formulation = '{formulation}' rtol")
    table, events = run(nocdyn, text)
    assert changes(events) == [
        ("clutch2", "locked"),
        ("clutch1", "locked"),
        ("clutch1", "slips ahead"),
        ("clutch1", "locked"),
        ("clutch1", "slips ahead"),
        ("clutch3", "locked"),
    ]
    expected = [0.709621474694, 0.791662359155, 0.831108506138, 0.906850192798, 1.000295859895, 1.143967492473]
    assert [event["time"] for event in events] == pytest.approx(expected, abs=1e-9)
    speeds = [3.247058272419] + [2.463187166650] * 3
    angles = [7.486119099114, 4.107137416329, 2.710464436231, 1.173743877601]
    for i in range(4):
        assert table[f"omega_J{i + 1} [rad/s]"][-1] == pytest.approx(speeds[i], abs=1e-8)
        assert table[f"phi_J{i + 1} [rad]"][-1] == pytest.approx(angles[i], abs=1e-8)
    assert max(map(abs, table["energy_residual [J]"])) < 1e-9 * 50


# Two inertias at 30 and 10 rad/s: the clutch brings them to 20 rad/s within J_1 * 10 rad/s / capacity.
PAIR = BODY.format("one", 2.0, 30) + BODY.format("two", 2.0, 10)
PAIR += "&clutch name = 'c' bodies = 'one', 'two' capacity = 40 KEYS /\n"


@pytest.mark.parametrize("method", ["auto", "rk45", "rodas4", "taylor"])
def test_a_clutch_locks_after_the_time_of_the_closed_form_and_keeps_the_heat(nocdyn, method):
    table, events = run(nocdyn, PAIR.replace("KEYS", "") + f"&run t_end = 1 method = '{method}' /\n")
    assert changes(events) == [("c", "locked")]
    assert events[0]["time"] == pytest.approx(0.5, abs=1e-12)
    assert table["omega_one [rad/s]"][-1] == pytest.approx(20, abs=1e-12)
    assert table["slip_c [rad/s]"][-1] == pytest.approx(0, abs=1e-12)
    assert (table["torque_c [N m]"][10], table["torque_c [N m]"][-1]) == (40, 0)
    heat = 2 * (30**2 + 10**2 - 2 * 20**2) / 2
    assert nocdyn.summary("out")["energy_account"]["work_in_J"]["clutch c"] == pytest.approx(-heat, rel=1e-12)


@pytest.mark.parametrize(("direction", "first", "second"), [("forward", "one", "two"), ("backward", "two", "one")])
def test_a_freewheel_drives_in_one_direction_and_overruns_in_the_other(nocdyn, direction, first, second):
    """The motor drives both for half a second; then it is braked, and the load runs on until the motor has caught up."""
    text = BODY.format("one", 1.0, 0) + BODY.format("two", 3.0, 0)
    text += f"&freewheel name = 'f' bodies = '{first}', '{second}' direction = '{direction}' /\n"
    text += "&excitation name = 'motor' body = 'one' kind = 'table' table_time = 0, 0.5, 0.500000000001, 1, 1.000000000001, 9\n"
    text += "  table_torque = 8, 8, -2, -2, 8, 8 /\n"
    table, events = run(nocdyn, text + "&run t_end = 2 rtol = 1e-10 atol = 1e-12 /\n&output interval = 0.05 /\n")
    assert [event["to"] == "locked" for event in events] == [False, True]
    assert [event["time"] for event in events] == pytest.approx([0.5, 1.125], abs=1e-9)  # 8 * 0.125 makes up for 2 * 0.5
    assert table["omega_two [rad/s]"][10] == pytest.approx(1.0, rel=1e-9)
    assert table["omega_one [rad/s]"][20] == pytest.approx(0.0, abs=1e-9)
    assert abs(table["torque_f [N m]"][5]) == pytest.approx(6.0, rel=1e-9)
    assert table["omega_one [rad/s]"][-1] == pytest.approx(1.0 + 2.0 * 0.875, rel=1e-9)


def test_a_dog_clutch_locks_by_an_impact_and_lets_go(nocdyn):
    """Momentum stays, the energy of the impact is lost in the clutch; a friction clutch beside it has no time to act."""
    text = PAIR.replace("capacity = 40 KEYS", "kind = 'dog' times = 0.2, 0.6 levels = 1, 0") + BODY.format("three", 1.0, 10)
    text += "&clutch name = 'slow' bodies = 'two', 'three' capacity = 5 /\n"
    text += "&excitation name = 'pull' body = 'one' kind = 'step' amplitude = 6 time = 0.4 /\n"
    table, events = run(nocdyn, text + "&run t_end = 1 rtol = 1e-10 /\n&output interval = 0.05 /\n")
    struck = next(event for event in events if event["joint"] == "clutch c")
    assert (struck["to"], struck["time"]) == ("locked", pytest.approx(0.2, abs=1e-12))
    assert struck["impulse_N_m_s"] == pytest.approx(20.0, rel=1e-12)  # 2 kg m2 from 30 to 20 rad/s
    assert table["omega_one [rad/s]"][5] == pytest.approx(20 - 5 * 0.05 / 4, rel=1e-9)
    assert table["slip_c [rad/s]"][10] == pytest.approx(0, abs=1e-12)
    freed = next(event for event in events if event["from"] == "locked" and event["joint"] == "clutch c")
    assert freed["time"] == pytest.approx(0.6, abs=1e-12)
    assert nocdyn.summary("out")["energy_account"]["work_in_J"]["clutch c"] == pytest.approx(-200, rel=1e-12)
    assert max(map(abs, table["energy_residual [J]"])) < 1e-9 * 1000


def test_a_dog_clutch_beside_a_gear_of_another_ratio_ends_the_run_with_its_name(nocdyn):
    text = BODY.format("one", 1, 10) + BODY.format("two", 1, 5) + BODY.format("three", 1, 3)
    text += "&gear name = 'g' bodies = 'one', 'two' teeth = 20, 40 internal = .true. /\n&run t_end = 2 /\n"
    dog = "&clutch name = 'd' kind = 'dog' bodies = 'one', '{}' times = 1 levels = 1 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text + dog.format("two")), "--out", "out")
    assert outcome.returncode == 1
    assert "t = 1 s: clutch 'd' contradicts the gears between its bodies: locked, it stops both" in outcome.stderr
    _, events = run(nocdyn, text + dog.format("three"))
    assert changes(events) == [("d", "locked")]


@pytest.mark.parametrize(
    ("keys", "engages"),
    [
        ("", True),
        ("times = 0, 2 levels = 0, 1", False),
        ("times = 0, 1.9 levels = 0, 1", True),
        ("times = -1, 1 levels = 1, 0", False),
        ("times = -1, 1.1 levels = 1, 0", True),
        ("table_time = 0, 1 table_level = 1, 0", False),
        ("table_time = 0, 1.5 table_level = 1, 0", True),
        ("table_time = 2, 3 table_level = 0, 1", False),
        ("table_time = 1.9, 3 table_level = 0, 1", True),
        ("table_time = 3, 4 table_level = 0.5, 1", True),
        ("kind = 'dog' times = 3 levels = 1", False),
    ],
)
def test_a_clutch_that_never_engages_in_the_run_is_noted(nocdyn, keys, engages):
    capacity = "" if "dog" in keys else "capacity = 1"
    text = BODY.format("a", 1, 1) + f"&clutch name = 'c' bodies = 'a', 'ground' {capacity} {keys} /\n"
    text = nocdyn.write("machine.nml", text + "&run t_start = 1 t_end = 2 /\n")
    note = "clutch 'c' does not engage in the run: its engagement is 0 from t = 1 to 2 s"
    outcome = nocdyn("run", text, "--out", "out")
    assert nocdyn.summary("out")["machine"]["notes"] == ([] if engages else [note])
    assert (f": note: {note}\n" in outcome.stdout) is not engages
    assert (f"\n  note: {note}\n" in nocdyn("check", text).stdout) is not engages


# Speeds at the end of random trains, printed by impulse_references.py.
STEPPED = [
    [-0.152569, 0.000137, 0.000137, -0.218452],
    [-0.126531, -0.126531, -0.126531],
    [1.373497, 1.383275, 0.862994],
    [-0.096437, -0.096437, -0.096437],
    [-3.991207, 0.0, 0.981071],
    [0.052004, 0.052004, 1.500120, 0.052004, 0.052004],
]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_trains_move_as_time_stepping_with_impulses_says(nocdyn, seed):
    train = Train(seed)
    table, events = run(nocdyn, train.text())
    assert events
    speeds = [table[f"omega_b{i} [rad/s]"][-1] for i in range(train.bodies)]
    assert speeds == pytest.approx(STEPPED[seed], abs=40 * STEP * max(t[0] / j for t, j in zip(train.torque, train.inertia)))
    assert max(map(abs, table["energy_residual [J]"])) < 1e-6


def test_a_sweep_over_capacities_is_its_variants_alone(nocdyn):
    text = PAIR.replace("KEYS", "") + "&excitation name = 'e' body = 'one' amplitude = 90 frequency = 20 /\n&run t_end = 1 /\n"
    text += "&sweep design = 'random' samples = 24 /\n&vary target = 'clutch.c.capacity' low = 20 high = 80 /\n"
    for quantity, statistic in (("torque_c", "max"), ("omega_two", "final"), ("work_out", "final")):
        text += f"&record quantity = '{quantity}' statistic = '{statistic}' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", text), "--out", "all", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "all/sweep.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert len(rows) == 24
    for row in rows[:6]:
        capacity = float(next(value for name, value in row.items() if "capacity" in name))
        table, _ = run(nocdyn, text, "--set", f"clutch.c.capacity={capacity}", "--set", "output.points=2")
        most = nocdyn.summary("out")["columns"]["torque_c [N m]"]["max"]
        found = {name.split(" [")[0]: value for name, value in row.items()}
        assert float(next(v for n, v in found.items() if n.startswith("omega_two"))) == pytest.approx(
            table["omega_two [rad/s]"][-1], rel=1e-5
        )
        assert float(next(v for n, v in found.items() if n.startswith("torque_c"))) == pytest.approx(most, rel=1e-5)


def test_a_sweep_whose_first_variant_is_refused_computes_the_others(nocdyn):
    nocdyn.write("list.csv", "clutch.c.capacity\n60\n40\n20\n")
    text = PAIR.replace("KEYS", "static_capacity = 50") + "&run t_end = 2 /\n&sweep design = 'list' file = 'list.csv' /\n"
    text += "&record quantity = 'work_out' statistic = 'final' /\n"
    assert nocdyn("sweep", nocdyn.write("sweep.nml", text), "--out", "all", "--csv").returncode == 0
    with open(nocdyn.folder / "all/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["refused", "done", "done"]
    assert "static_capacity = 50" in rows[0]["reason"]
    assert [float(row["work_out_final [J]"]) for row in rows[1:]] == pytest.approx([200, 200], rel=1e-9)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ("capacity = -1", "capacity = -1 is out of range; allowed: >= 0 [N m]"),
        ("capacity = 5 static_capacity = 4", "static_capacity = 4 is below capacity = 5; allowed: at least that of slip"),
        ("capacity = 5 times = 1, 0.5 levels = 1, 0", "times(2) = 0.5"),
        ("capacity = 5 times = 1 levels = 1.5", "levels(1) = 1.5 is out of range"),
        ("capacity = 5 times = 1, 2 levels = 1", "levels has 1 value and times has 2 values"),
        (
            "capacity = 5 times = 1 levels = 1 table_time = 0, 1 table_level = 0, 1",
            "times and table_time are both given; allowed: one of them",
        ),
        ("", "capacity or table_slip is missing"),
    ],
)
def test_bad_clutches_are_refused(nocdyn, keys, words):
    text = BODY.format("one", 1, 0) + BODY.format("two", 1, 0)
    text += f"&clutch name = 'c' bodies = 'one', 'two' {keys} /\n&run t_end = 1 /\n"
    outcome = nocdyn("check", nocdyn.write("bad.nml", text))
    assert outcome.returncode == 2
    assert "bad.nml:3: &clutch" in outcome.stderr and words in outcome.stderr


@pytest.mark.parametrize(
    ("command", "change", "words"),
    [
        ("modes", "at", "which joints, bearings and teeth are locked at a time of the run is not known here"),
        ("matrices", "", "nocdyn matrices does not know which joints are locked; allowed: no clutches and freewheels"),
    ],
)
def test_what_does_not_know_the_joints_refuses_them(nocdyn, command, change, words):
    path = nocdyn.write("machine.nml", PAIR.replace("KEYS", "") + "&run t_end = 1 /\n")
    options = ["--at", "0.5"] if change == "at" else ["--set", change] if change else []
    outcome = nocdyn(command, path, *options)
    assert outcome.returncode == 2 and words in outcome.stderr


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_joints_that_share_what_they_hold_are_named(nocdyn, formulation):
    text = BODY.format("a", 1, 10) + BODY.format("b", 1, 0) + BODY.format("c", 1, 0)
    text += "&clutch name = 'one' bodies = 'a', 'b' capacity = 20 /\n&clutch name = 'two' bodies = 'a', 'b' capacity = 10 /\n"
    text += "&clutch name = 'three' bodies = 'b', 'c' capacity = 10 /\n&load name = 'l' body = 'c' viscous = 1 /\n"
    path = nocdyn.write("shared.nml", text + f"&run t_end = 3 formulation = '{formulation}' /\n")
    outcome = nocdyn("run", path, "--out", "shared")
    assert outcome.returncode == 0, outcome.stderr
    assert "note: clutch 'one', clutch 'two' are redundant where they are locked together" in outcome.stdout
    header, rows = nocdyn.table("shared")
    last = dict(zip(header, rows[-1], strict=True))
    assert last["torque_one [N m]"] == pytest.approx(last["torque_two [N m]"], rel=1e-9)
    outcome = nocdyn("run", path, "--set", "clutch.two.capacity=0", "--set", "clutch.two.static_capacity=0", "--out", "one")
    assert outcome.returncode == 0 and "redundant" not in outcome.stdout


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("brake", "did you mean 'clutch' with 'ground' as one of its bodies?"),
        ("dog_clutch", "did you mean 'clutch' with kind = 'dog'?"),
        ("cam", "did you mean 'relation' with kind = 'cam'?"),
        ("clutsh", "did you mean 'clutch'?"),
    ],
)
def test_words_of_the_field_lead_to_their_groups(nocdyn, word, hint):
    text = BODY.format("one", 1, 0) + f"&{word} name = 'c' bodies = 'one', 'ground' /\n&run t_end = 1 /\n"
    outcome = nocdyn("check", nocdyn.write("bad.nml", text))
    assert outcome.returncode == 2
    assert f"bad.nml:2: &{word}: there is no such group; {hint}" in outcome.stderr


def test_the_printed_energies_have_no_rounding(nocdyn):
    text = BODY.format("a", 1, 10) + BODY.format("b", 1, 0) + "&load name = 'l' body = 'b' viscous = 1 /\n"
    text += "&coupling name = 'k' bodies = 'a', 'b' stiffness = 1000 damping = 1 /\n&run t_end = 40 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert "kinetic energy" in outcome.stdout and "stored in k" not in outcome.stdout
    account = nocdyn.summary("out")["energy_account"]
    assert 0 < account["stored_J"]["k"][1] < 1e-12
