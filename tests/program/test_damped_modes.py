"""Damped frequencies over the speed: the same in all commands, and each followed as one branch, whatever the grid is."""

import json
import os
import random
import re
from math import pi, sqrt

import pytest
from verified import known

MACHINES = int(os.environ.get("NOCDYN_RANDOM_MACHINES", "12"))

# A reciprocating compressor on an induction motor, whose field is a spring between the motor and the mains.
COMPRESSOR = """\
&body name='rotor' inertia=28.0 /
&body name='pinion' inertia=0.9 /
&body name='wheel' inertia=14.0 /
&body name='flywheel' inertia=208.5 /
&coupling name='hs_disc' bodies='rotor','pinion' stiffness=1.4e6 damping=1000 /
&gear name='box' bodies='pinion','wheel' teeth=24,60 internal=.true. /
&coupling name='rubber' bodies='wheel','flywheel' stiffness=3.0e5 damping=600 /
&engine name='gas' stroke=2 cylinders='flywheel' firing_deg=0 orders=1,2 amplitudes=900,4200 mean_torque=-6800 /
&motor name='mains' body='rotor' kind='induction_dq' voltage=6000 frequency_hz=50 poles=4
   rated_power=450e3 rated_speed_rpm=1486 efficiency=0.955 power_factor=0.86 breakdown_ratio=2.5 /
&response body='flywheel' speed_rpm=300,720 count=22 operating_rpm=590,600 margin=0.1 /
&run t_end=2.0 start='equilibrium' /
"""

# Two branches that do not know of each other: one keeps its frequency, the other one crosses it.
CROSSING = """\
&body name = 'hub' inertia = 1e6 /
&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 1 /
&coupling name = 'sa' bodies = 'hub', 'a' stiffness = 1e4 /
&coupling name = 'sb' bodies = 'hub', 'b' stiffness = 2500 cubic_stiffness = 2.5e5 /
&load name = 'fan' body = 'b' quadratic = 0.05 /
&response body = 'hub' speed = 10, 200 count = {} orders = 2 /
&run t_end = 1 /
"""

# A damper so strong that it binds its ring to the crank: (crank + ring) (i w)^2 + ... has the root -1.3634 + 91.485 i.
RING = """\
&body name = 'flywheel' inertia = 1e6 /
&body name = 'crank' inertia = 1 /
&body name = 'ring' inertia = 0.2 /
&coupling name = 'shaft' bodies = 'flywheel', 'crank' stiffness = 1e4 /
&coupling name = 'silicon' bodies = 'crank', 'ring' damping = 100 /
&excitation name = 'gas' body = 'crank' kind = 'orders' orders = 1 amplitudes = 1 /
&response body = 'flywheel' speed = 50, 150 /
&run t_end = 1 /
"""


def result(nocdyn, command, text):
    nocdyn.write("machine.nml", text)
    outcome = nocdyn(command, "machine.nml", "--out", "out")
    notes = [line for line in outcome.stderr.splitlines() if "modes change places over the speeds" not in line]
    assert (outcome.returncode, notes) == (0, [])
    return json.loads((nocdyn.folder / f"out/{command}.json").read_text())


RELATIVE = COMPRESSOR.replace("damping=1000", "relative_damping=0.06 damping_frequency_hz=15").replace(
    "damping=600", "relative_damping=0.8 damping_frequency_hz=15"
)


@pytest.mark.parametrize("text", [COMPRESSOR, RELATIVE, RELATIVE.replace("damping_frequency_hz=15", "")])
def test_all_commands_have_the_frequency_with_the_field_of_the_motor(nocdyn, text):
    modes = result(nocdyn, "modes", text)
    (wanted,) = [one for one in modes["modes"] if 8.5 < one.get("frequency_Hz", 0) < 12]
    ours = {}
    for command, key in (("campbell", "crossings"), ("response", "critical_speeds")):
        report = result(nocdyn, command, text)
        (ours[command],) = [
            one for one in report[key] if round(one["order"], 9) == 1 and 500 < one["speed_rad_s"] * 30 / pi < 620
        ]
        assert ours[command]["frequency_Hz"] == pytest.approx(wanted["frequency_Hz"], rel=1e-9)
        assert ours[command]["damping_ratio"] == pytest.approx(wanted["damping_ratio"], rel=1e-8)
        assert ours[command]["speed_rad_s"] == pytest.approx(2 * pi * wanted["frequency_Hz"], rel=1e-9)
        assert any("supplies of the induction motors are taken to follow" in note for note in report["notes"])
    undamped = columns_of_mode(nocdyn, ours["campbell"]["mode"])
    assert undamped[0] == pytest.approx(wanted["undamped_frequency_Hz"], rel=1e-9)
    assert ours["campbell"]["is_too_near"]


def columns_of_mode(nocdyn, mode):
    return nocdyn.values(name="campbell.csv")[f"undamped_frequency_{mode}"]


def test_an_electrical_mode_has_no_margin_and_no_undamped_frequency(nocdyn):
    text = COMPRESSOR.replace("orders=1,2 amplitudes=900,4200", "orders=1,2,5 amplitudes=900,4200,100")
    for command, key in (("campbell", "crossings"), ("response", "critical_speeds")):
        ours = [one for one in result(nocdyn, command, text)[key] if "mostly" in one]
        assert [one["order"] for one in ours] == pytest.approx([5])
        assert ours[0]["mostly"] == "stator flux d of motor 'mains'" and ours[0]["is_electrical"]
        assert not {"is_too_near", "distance_to_operation"} & set(ours[0])
        assert "  electrical mode  mostly stator flux d of motor 'mains'\n" in nocdyn(command, "machine.nml").stdout
    numbers = {label[-1] for label in nocdyn.values(name="campbell.csv").by_name() if label.startswith("undamped_")}
    assert numbers == {str(one["mode"]) for one in json.loads((nocdyn.folder / "out/campbell.json").read_text())["modes"]} - {
        str(ours[0]["mode"])
    }
    modes = result(nocdyn, "modes", text)["modes"]
    assert [("state" in one) for one in modes] == [("undamped_frequency_Hz" not in one) for one in modes]
    rows = (nocdyn.folder / "out/modes.csv").read_text().splitlines()[1:]
    assert [row.split(",")[3] == "" for row in rows] == [("state" in one) for one in modes]


@pytest.mark.parametrize("count", [20, 190, 191])
def test_branches_cross_without_changing_places(nocdyn, count):
    report = result(nocdyn, "campbell", CROSSING.format(count))
    assert [one["undamped_frequency_Hz"] for one in report["modes"]] == [
        pytest.approx([known(f"campbell.crossing_branches.moving_{end}") for end in ("low", "high")], rel=1e-6),
        pytest.approx([50 / pi, 50 / pi], rel=1e-6),
    ]
    table = nocdyn.values(name="campbell.csv")
    assert max(map(abs, table["damping_ratio_2"])) < 1e-9 and min(table["damping_ratio_1"]) > 0.009
    assert list(table["frequency_1"]) == sorted(table["frequency_1"])


@pytest.mark.parametrize("torque", [1000, 3600])  # balances the fan at 73 and 186 rad/s, below and above the crossing
def test_modes_that_change_places_have_the_numbers_of_the_steady_state(nocdyn, torque):
    text = CROSSING.format(20) + f"&motor name = 'drive' body = 'hub' a = {torque} b = 10 c = 0 /\n"
    speed = (sqrt(100 + 0.2 * torque) - 10) / 0.1
    steady = [one for one in result(nocdyn, "modes", text)["modes"] if one["kind"] == "oscillating"]
    report = result(nocdyn, "campbell", text)
    assert report["modes_numbered_at_rad_s"] == pytest.approx(speed, rel=1e-9)
    table = nocdyn.values(name="campbell.csv")
    row = min(range(len(table["omega_hub"])), key=lambda i: abs(table["omega_hub"][i] - speed))
    for mode in steady:
        assert table[f"frequency_{mode['mode']}"][row] == pytest.approx(mode["frequency_Hz"], rel=1e-8)
    constant = 1 if torque > 2000 else 2  # the mode of the linear spring
    assert report["modes"][constant - 1]["frequency_Hz"] == pytest.approx([50 / pi] * 2, rel=1e-6)
    shaken = text + "&excitation name = 'gas' body = 'a' kind = 'orders' orders = 2 amplitudes = 1 /\n"
    criticals = result(nocdyn, "response", shaken)["critical_speeds"]
    assert sorted((one["mode"], one["frequency_Hz"]) for one in criticals) == [
        (mode, pytest.approx(frequency, rel=1e-6))
        for mode, frequency in sorted((one["mode"], one["frequency_Hz"]) for one in report["crossings"])
    ]


def test_a_damper_that_binds_its_ring_is_no_damping(nocdyn):
    report = result(nocdyn, "campbell", RING)
    (crossing,) = report["crossings"]
    assert crossing["frequency_Hz"] == pytest.approx(known("campbell.bound_ring.speed") / (2 * pi), rel=1e-9)
    assert crossing["damping_ratio"] == pytest.approx(known("campbell.bound_ring.ratio"), rel=1e-8)
    (critical,) = result(nocdyn, "response", RING)["critical_speeds"]
    assert critical["speed_rad_s"] == pytest.approx(known("campbell.bound_ring.speed"), rel=1e-8)
    assert critical["peak_speed_rad_s"] == pytest.approx(critical["speed_rad_s"], rel=2e-4)


def random_machine(seed):
    """A chain with a branch, with springs that stiffen under the load, and dampers."""
    dice = random.Random(seed)
    bodies = dice.randint(3, 7)
    text = "".join(f"&body name='b{i}' inertia={10 ** dice.uniform(-1, 1):.6g} /\n" for i in range(bodies))
    for i in range(1, bodies):
        other = i - 1 if dice.random() < 0.7 else dice.randrange(i)
        law = f"stiffness={10 ** dice.uniform(3, 5):.6g}"
        if dice.random() < 0.7:
            law += f" cubic_stiffness={10 ** dice.uniform(5, 8):.6g}"
        if dice.random() < 0.6:
            law += f" damping={10 ** dice.uniform(-1, 1.5):.6g}"
        text += f"&coupling name='c{i}' bodies='b{other}','b{i}' {law} /\n"
    text += f"&load name='fan' body='b{bodies - 1}' quadratic={10 ** dice.uniform(-2, -0.5):.6g} /\n"
    return text + "&response body='b0' speed=10,200 count={} orders=1 /\n&run t_end=1 /\n"


@pytest.mark.parametrize("seed", range(MACHINES))
def test_branches_do_not_depend_on_the_grid(nocdyn, seed):
    ends = []
    for count in (3, 17, 65):
        report = result(nocdyn, "campbell", random_machine(seed).format(count))
        table = nocdyn.values(name="campbell.csv")
        ends.append(
            [
                (table[f"frequency_{one['mode']}"][i], table[f"damping_ratio_{one['mode']}"][i])
                for one in report["modes"]
                for i in (0, -1)
            ]
        )
    for other in ends[1:]:
        assert len(other) == len(ends[0])
        for one, same in zip(ends[0], other):
            assert one == pytest.approx(same, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("seed", range(MACHINES))
def test_peaks_do_not_depend_on_the_grid_where_modes_move(nocdyn, seed):
    text = random_machine(seed).replace("orders=1", "")
    text = re.sub(r"(&coupling (?:(?!damping).)*?) /\n", r"\1 damping=3 /\n", text)
    text += "&excitation name='gas' body='b1' kind='orders' orders=1 amplitudes=1 /\n"
    peaks = []
    for count in (20, 1901):
        nocdyn.write("machine.nml", text.format(count))
        outcome = nocdyn("response", "machine.nml", "--out", "out")
        assert outcome.returncode == 0, outcome.stderr
        largest = json.loads((nocdyn.folder / "out/response.json").read_text())["largest"]
        peaks.append([one["half_range"] for one in largest])
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-4)  # refinement ends at 1e-5 of the square


def test_an_unstable_speed_does_not_stop_the_others(nocdyn):
    """Beyond 125 rad/s the torque of the load falls, and the oscillation of a light damping grows."""
    text = """\
&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 2 /
&coupling name = 's' bodies = 'a', 'b' stiffness = 4000 damping = 0.05 /
&load name = 'l' body = 'b' table_speed = 0, 125, 165, 1000 table_torque = 0, 125, 45, 400 extrapolation = 'constant' /
&excitation name = 'o' body = 'a' kind = 'orders' orders = 0.5 amplitudes = 1 /
&response body = 'a' speed = 100, 200 count = 11 /
&run t_end = 1 /
"""
    report = result(nocdyn, "response", text)
    (note,) = [note for note in report["notes"] if "is unstable" in note]
    assert note.startswith("the steady state is unstable at 4 speeds from 1241.41 to 1527.89 rpm: an oscillation with")
    assert report["unstable_speeds_rad_s"] == pytest.approx([130, 140, 150, 160])
    speeds = nocdyn.values(name="response.csv")["omega_a"]
    assert not [speed for speed in speeds if 126 < speed < 164]
    assert {100.0, 110.0, 120.0, 170.0, 200.0} <= {round(speed, 9) for speed in speeds}
    report = result(nocdyn, "campbell", text)
    assert {130, 140, 150, 160} <= {round(speed, 9) for speed in report["unstable_speeds_rad_s"]}
    table = nocdyn.values(name="campbell.csv")
    assert all((ratio < 0) == (126 < speed < 164) for speed, ratio in zip(table["omega_a"], table["damping_ratio_1"]))


def test_a_drive_that_is_too_weak_is_noted(nocdyn):
    text = """\
&body name='m' inertia=1 speed=100 /
&body name='g' inertia=2 /
&coupling name='k' bodies='m','g' stiffness=1000 damping=1 /
&engine name='e' stroke=2 cylinders='m' firing_deg=0 orders=1,2 amplitudes=50,20 mean_torque=100 /
&load name='l' body='g' quadratic=0.01 /
&response body='m' speed=50,200 count=4 /
&run t_end=1 /
"""
    (note,) = [note for note in result(nocdyn, "response", text)["notes"] if "too weak" in note]
    assert "the load there needs up to 4 times its torque" in note


def test_a_limit_of_a_shaft_holds_inside_too(nocdyn):
    """A long shaft whose second mode has its largest moment in the middle, hardly any at the ends."""
    text = """\
&body name = 'a' inertia = 1e-3 /
&body name = 'b' inertia = 1e-3 /
&shaft name = 's' bodies = 'a', 'b' lengths = 10.0 diameters = 0.1 shear_modulus = 8e10 density = 7850 relative_damping = 0.1 /
&excitation name = 'x' body = 'a' kind = 'orders' orders = 10 amplitudes = 1 /
&limit shaft = 's' moment = 15 /
&response body = 'a' speed = 80, 110 count = 31 /
&run t_end = 1 /
"""
    report = result(nocdyn, "response", text)
    table = nocdyn.values(name="response.csv")
    inside, ends = max(table["peak_total_moment_s_max"]), max(table["peak_total_moment_s_1"] + table["peak_total_moment_s_2"])
    assert inside > 15 > ends
    assert report["limits_exceeded"]
    (one,) = [one for one in report["largest"] if "peak_ratio_to_limit" in one]
    assert one["quantity"] == "total_moment_s_max" and one["peak_ratio_to_limit"] == pytest.approx(inside / 15, rel=1e-12)


@pytest.mark.parametrize(("crankcase", "is_noted"), [("0", True), ("1e5", False)])
def test_absolute_pressures_need_that_of_the_crankcase(nocdyn, crankcase, is_noted):
    nocdyn.write(
        "machine.nml",
        f"""\
&body name = 'crank' inertia = 1 speed = 50 /
&engine name = 'e' stroke = 2 cylinders = 'crank' firing_deg = 0 bore = 0.1 crank_radius = 0.05 rod_length = 0.2
   crank_angles_deg = 0, 45, 90, 135, 180, 225, 270, 315 pressures = 5e6, 2e6, 4e5, 2e5, 1e5, 1e5, 2e5, 1e6
   crankcase_pressure = {crankcase} harmonics_up_to = 4 /
&run t_end = 0.1 /
""",
    )
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 0, outcome.stderr
    assert ("the piston has a vacuum below it" in outcome.stdout) == is_noted


MOTORS = {
    "quadratic": "a=300 b=2 c=0.001",
    "induction": "kind='induction' breakdown_torque=400 breakdown_slip=0.1 synchronous_speed=105",
    "induction_dq": "kind='induction_dq' voltage=400 frequency_hz=50 poles=6 rated_power=22e3 rated_speed_rpm=975 efficiency=0.93"
    " power_factor=0.83 breakdown_ratio=2.6",
    "dc": "kind='dc' voltage=400 resistance=0.5 flux_constant=3.5 inductance=0.01",
    "governed": "a=600 b=2 c=0 governor_speed=100 governor_gain=0.05 governor_time=0.5",
    "inverter": "kind='inverter' torque_limit=400 governor_speed=100 governor_gain=0.02 governor_time=0.4",
}


@pytest.mark.parametrize("damping", ["damping=2", "relative_damping=1.5", "relative_damping=1.5 damping_frequency=20"])
@pytest.mark.parametrize("motor", MOTORS)
def test_at_the_steady_state_campbell_has_the_modes(nocdyn, motor, damping):
    text = f"""\
&body name='m' inertia=0.8 speed=100 /
&body name='g' inertia=0.5 /
&body name='f' inertia=6 /
&coupling name='k' bodies='m','g' stiffness=3000 cubic_stiffness=1e5 damping=3 /
&coupling name='n' bodies='g','f' stiffness=9000 {damping} /
&motor name='d' body='m' {MOTORS[motor]} /
&load name='l' body='f' quadratic=0.02 /
&run t_end=1 /
"""
    modes = [one for one in result(nocdyn, "modes", text)["modes"] if one["kind"] == "oscillating"]
    nocdyn("equilibrium", "machine.nml", "--out", "out")
    states = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"]
    speeds = [one["values"]["omega_m [rad/s]"] for one in states if one["stability"] == "stable"]
    speed = min(speeds, key=lambda speed: abs(speed - 100))
    result(nocdyn, "campbell", text + f"&response body='m' speed={speed!r},{1.1 * speed!r} count=3 orders=1 /\n")
    table = nocdyn.values(name="campbell.csv")
    ours = sorted((table[f"frequency_{k + 1}"][0], table[f"damping_ratio_{k + 1}"][0]) for k in range(len(modes)))
    theirs = sorted((one["frequency_Hz"], one["damping_ratio"]) for one in modes)
    assert len(ours) >= 2
    for one, same in zip(ours, theirs, strict=True):
        assert one == pytest.approx(same, rel=1e-6)


def lossy_machine(seed):
    """A tree of springs with relative damping, up to such that hardly oscillates; some have two branches alike."""
    dice = random.Random(seed)
    bodies = dice.randint(2, 9)
    text = "".join(f"&body name='b{i}' inertia={10 ** dice.uniform(-1, 1):.6g} /\n" for i in range(bodies))
    largest = dice.choice([0.01, 0.3, 1.5])
    for i in range(1, bodies):
        other = i - 1 if dice.random() < 0.6 else dice.randrange(i)
        text += f"&coupling name='k{i}' bodies='b{other}','b{i}' stiffness={10 ** dice.uniform(3, 5):.6g} "
        is_lossy = dice.random() < 0.8
        text += f"relative_damping={largest * dice.uniform(0.2, 4):.4g} /\n" if is_lossy else ""
        text += "" if is_lossy else f"damping={10 ** dice.uniform(-1, 1.5):.4g} /\n"
    for name in "pq" if dice.random() < 0.4 else "":
        text += f"&body name='{name}' inertia=0.7 /\n"
        text += f"&coupling name='t{name}' bodies='b0','{name}' stiffness=2e4 relative_damping={largest} /\n"
    return text + "&response body='b0' speed=10,20 count=2 orders=1 /\n&run t_end=1 /\n"


@pytest.mark.parametrize("seed", [24, 29, 103, 112, *range(MACHINES)])
def test_modes_campbell_and_equilibrium_agree_on_relative_damping(nocdyn, seed):
    all_modes = result(nocdyn, "modes", lossy_machine(seed))["modes"]
    modes = [one for one in all_modes if one["kind"] == "oscillating"]
    found = result(nocdyn, "campbell", lossy_machine(seed))["modes"]
    table = nocdyn.values(name="campbell.csv")
    ours = sorted((table[f"frequency_{one['mode']}"][0], table[f"damping_ratio_{one['mode']}"][0]) for one in found)
    for one, same in zip(ours, sorted((one["frequency_Hz"], one["damping_ratio"]) for one in modes), strict=True):
        assert one == pytest.approx(same, rel=1e-9)
    nocdyn("equilibrium", "machine.nml", "--out", "out")
    (state,) = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"]
    slowest = max(one["eigenvalue_1_s"][0] for one in all_modes if one["kind"] != "rigid body")
    assert state["growth_rate_1_s"] == pytest.approx(slowest, rel=1e-8)


RUBBER = """\
&body name = 'a' inertia = 2 speed_rpm = 1500 /
&body name = 'b' inertia = 3 speed_rpm = 1500 /
&coupling name = 'rubber' bodies = 'a', 'b' stiffness = 5e3 relative_damping = 1.13 damping_frequency_hz = {} /
&motor name = 'm' body = 'a' kind = 'constant' torque = 75 /
&load name = 'l' body = 'b' quadratic = 0.003 /
&excitation name = 'e' body = 'b' kind = 'orders' orders = 0.4 amplitudes = 10 /
&response body = 'a' speed_rpm = 1000, 2000 count = 3 /
&run t_end = 0.1 start = 'equilibrium' /
"""


@pytest.mark.parametrize("command", ["run", "modes", "response", "campbell"])
def test_a_stand_in_of_relative_damping_far_from_the_mode_is_noted(nocdyn, command):
    frequency = sqrt(5e3 * (1 / 2 + 1 / 3)) / (2 * pi)
    lossy = 1.13 / (4 * pi)  # psi / (4 pi), as a share of critical damping
    for factor in (0.3, 3.0):
        text = nocdyn(command, nocdyn.write("m.nml", RUBBER.format(frequency * factor)), "--out", "out").stdout
        (note,) = [line for line in text.splitlines() if "the viscous damping that stands for the relative one" in line]
        found = [float(word) for word in re.findall(r"(?:at|Hz:|place of) ([0-9.]+)", note.partition("coupling 'rubber'")[2])]
        expected = [frequency * factor, frequency, lossy / factor, lossy]
        assert found == pytest.approx(expected, rel=0.01, abs=0.005)
    for factor in (0.8, 1.0, 1.3):
        text = nocdyn(command, nocdyn.write("m.nml", RUBBER.format(frequency * factor)), "--out", "out").stdout
        assert "stands for" not in text


LOSSY_BRAKE = """\
&body name = 'a' inertia = 10 speed = 100 /
&body name = 'b' inertia = 1 speed = 100 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 4000 relative_damping = {} /
&motor name = 'm' body = 'a' kind = 'quadratic' a = 100 b = 0.5 c = 0 /
&load name = 'l' body = 'b' table_speed = 0, 50, 150, 1000 table_torque = 0, 65, 35, 2000 extrapolation = 'constant' /
&response body = 'a' speed = 100, 101 count = 2 orders = 1 /
&run t_end = 1 /
"""


@pytest.mark.parametrize(("damping", "is_stable"), [("0.05", True), ("0.05 damping_frequency_hz = 1000", True), ("0.005", False)])
def test_stability_is_one_with_relative_damping(nocdyn, damping, is_stable):
    text = LOSSY_BRAKE.format(damping)
    (state,) = result(nocdyn, "equilibrium", text)["steady_states"]
    assert state["stability"] == ("stable" if is_stable else "unstable")
    (mode,) = [mode for mode in result(nocdyn, "modes", text)["modes"] if mode["kind"] == "oscillating"]
    assert (mode["damping_ratio"] > 0) == is_stable
    if not is_stable:
        assert state["growth_rate_1_s"] == pytest.approx(mode["eigenvalue_1_s"][0], rel=1e-9)
