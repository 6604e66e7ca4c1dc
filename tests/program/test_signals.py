"""One quantity in every command: the power through a shaft, and limits of any quantity of an element."""

import csv
import json

import pytest

MACHINE = """\
&body name = 'a' inertia = 1.0 speed = 100.0 /
&body name = 'b' inertia = 2.0 speed = 100.0 /
&shaft name = 's' bodies = {} lengths = 1.0 diameters = 0.05 shear_modulus = 8e10 density = 7850
       damping_ratio = 0.01 damping_frequency = 500 /
&motor name = 'm' body = 'a' a = 200.0 b = 1.0 c = 0.0 /
&load name = 'l' body = 'b' viscous = 1.0 /
&run t_end = 0.5 rtol = 1e-9 /
"""
SHAKEN = "&excitation name = 'x' body = 'a' kind = 'orders' orders = 2 amplitudes = 10.0 /\n"
SPEEDS = "&response body = 'a' speed = 99.0, 101.0 count = 3 /\n"
SWEEP = """\
&sweep design = 'grid' /
&vary target = 'load.l.viscous' low = 1.0 high = 1.1 count = 2 /
&record quantity = 'power_s' statistic = 'max', 'min', 'final' /
"""
SHAFT = MACHINE.format("'a', 'b'")


def test_the_power_is_the_moment_at_the_first_end_times_its_speed(nocdyn):
    nocdyn.write("m.nml", SHAFT + SHAKEN)
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    header, rows = nocdyn.table("out")
    moment, speed, power = (header.index(name) for name in ("total_moment_s_1 [N m]", "omega_a [rad/s]", "power_s [W]"))
    assert max(abs(row[power]) for row in rows) > 1000
    for row in rows:
        assert row[power] == pytest.approx(-row[moment] * row[speed], rel=1e-12)


def test_the_power_of_a_shaft_that_is_held_is_that_at_its_other_end(nocdyn):
    nocdyn.write("m.nml", MACHINE.format("'ground', 'b'").replace("speed = 100.0 /\n&shaft", "angle = 0.01 /\n&shaft") + SHAKEN)
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    header, rows = nocdyn.table("out")
    moment, speed, power = (header.index(name) for name in ("total_moment_s_2 [N m]", "omega_b [rad/s]", "power_s [W]"))
    assert all(row[power] == pytest.approx(-row[moment] * row[speed], rel=1e-12) for row in rows)


def test_the_power_is_one_in_steady_states_responses_sweeps_and_runs(nocdyn):
    nocdyn.write("m.nml", SHAFT + SHAKEN + SPEEDS + SWEEP)
    assert nocdyn("equilibrium", "m.nml", "--out", "steady").returncode == 0
    (state,) = json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())["steady_states"]
    assert state["values"]["power_s [W]"] == pytest.approx(1e4, rel=1e-9)  # 100 N m at 100 rad/s
    assert nocdyn("response", "m.nml", "--out", "speeds").returncode == 0
    header, rows = nocdyn.table("speeds", "response.csv")
    middle = next(row for row in rows if abs(row[0] - 100.0) < 1e-9)
    assert middle[header.index("mean_power_s [W]")] == pytest.approx(1e4, rel=1e-9)
    assert nocdyn("sweep", "m.nml", "--out", "sweep", "--csv").returncode == 0
    with open(nocdyn.folder / "sweep/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert nocdyn("run", "m.nml", "--out", "run", "--set", "load.l.viscous=1.1").returncode == 0
    column = json.loads((nocdyn.folder / "run/summary.json").read_text())["columns"]["power_s [W]"]
    for statistic, key in (("max", "max"), ("min", "min"), ("final", "last")):
        assert float(rows[1][f"power_s_{statistic} [W]"]) == pytest.approx(column[key], rel=1e-3)


def test_the_oscillation_of_a_power_is_that_of_a_settled_run(nocdyn):
    damped = SHAFT.replace("damping_ratio = 0.01 damping_frequency = 500", "damping_ratio = 0.2 damping_frequency = 200")
    nocdyn.write("m.nml", damped.replace("t_end = 0.5", "t_end = 12.0") + SHAKEN + SPEEDS)
    assert nocdyn("response", "m.nml", "--out", "speeds").returncode == 0
    header, rows = nocdyn.table("speeds", "response.csv")
    half_range = next(row for row in rows if abs(row[0] - 100.0) < 1e-9)[header.index("half_range_power_s [W]")]
    nocdyn("run", "m.nml", "--out", "run", "--set", "run.start='equilibrium'", "--set", "output.extremes_from=11.0")
    column = json.loads((nocdyn.folder / "run/summary.json").read_text())["columns"]["power_s [W]"]
    assert (column["max"] - column["min"]) / 2 == pytest.approx(half_range, rel=0.005)


@pytest.mark.parametrize(("largest", "exceeded"), [(5e3, True), (5e4, False)])
def test_a_limit_of_any_quantity_is_compared_in_runs_and_responses(nocdyn, largest, exceeded):
    nocdyn.write(
        "m.nml", SHAFT + SHAKEN + SPEEDS + f"&limit shaft = 's' quantity = 'power' largest = {largest} vibratory = 1e9 /\n"
    )
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    summary = json.loads((nocdyn.folder / "out/summary.json").read_text())
    (limit,) = [line for line in summary["verdict"]["lines"] if line["criterion"] == "power, largest"]
    assert (limit["quantity"], limit["unit"], limit["limit"]) == ("power_s", "W", largest)
    assert summary["limits_exceeded"] == exceeded
    assert nocdyn("response", "m.nml", "--out", "speeds").returncode == 0
    assert json.loads((nocdyn.folder / "speeds/response.json").read_text())["limits_exceeded"] == exceeded


@pytest.mark.parametrize("command", ["run", "check", "response", "sweep"])
def test_a_limit_of_a_quantity_that_there_is_not_is_refused(nocdyn, command):
    nocdyn.write("m.nml", SHAFT + SHAKEN + SPEEDS + SWEEP + "&limit shaft = 's' quantity = 'powr' largest = 1.0 /\n")
    outcome = nocdyn(command, "m.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == "nocdyn: m.nml:13: &limit: shaft 's' has no quantity 'powr'; allowed: 'twist', 'stress', 'power'\n"


def test_a_limit_of_a_quantity_has_a_number_and_no_other_limit(nocdyn):
    for keys in ("quantity = 'power'", "quantity = 'power' largest = 1.0 moment = 1.0", "largest = 1.0"):
        nocdyn.write("m.nml", SHAFT + f"&limit shaft = 's' {keys} /\n")
        outcome = nocdyn("check", "m.nml")
        assert outcome.returncode == 2 and outcome.stderr.startswith("nocdyn: m.nml:8: &limit:")


NAMESAKES = """\
&body name = 'm' inertia = 2.0 speed = 10.0 /
&body name = 'p' inertia = 0.5 speed = 10.0 /
&body name = 'w' inertia = 5.0 speed = -4.0 /
&body name = 'v' inertia = 5.0 speed = -4.0 /
&coupling name = 'c' bodies = 'm', 'p' stiffness = 1e4 damping = 5.0 /
&gear name = 'x' bodies = 'p', 'w' radii = 2.0, 5.0 /
&clutch name = '{}' bodies = 'w', 'v' capacity = 1e4 /
&motor name = 'd' body = 'm' a = 100.0 b = 5.0 c = 0.0 /
&load name = 'l' body = 'v' viscous = 10.0 /
&excitation name = 'e' body = 'm' kind = 'orders' orders = 2 amplitudes = 10.0 /
&fatigue name = 'f' gear = 'x' reference_force = 30.0 reference_cycles = 1e6 slope = 5 /
&run t_end = 0.5 rtol = 1e-9 /
&response body = 'm' speed = 5.0, 60.0 count = 12 /
"""


def test_the_damage_of_a_gear_is_not_of_a_clutch_with_its_name(nocdyn):
    damage = []
    for clutch in "yx":
        nocdyn.write("m.nml", NAMESAKES.format(clutch))
        assert nocdyn("response", "m.nml", "--out", "out").returncode == 0
        header, rows = nocdyn.table("out", "response.csv")
        damage.append([row[header.index("damage_per_hour_f [1/h]")] for row in rows])
    assert damage[0] == damage[1]
    assert max(damage[0]) > 0
