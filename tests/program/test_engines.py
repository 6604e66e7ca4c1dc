"""Engines and orders from the input file to the results: files, refusals, sweeps."""

import csv
import json
import re
from math import cos, exp, pi, radians, sin

import numpy as np
import pytest

MACHINE = """&body name = 'crank' inertia = 1.0e9 speed = 100.0 /
{}
&run t_end = 0.1 rtol = 1e-10 atol = 1e-10 /
&output points = 11 /
"""
FIRST = (
    "&engine name = 'e' stroke = 4 cylinders = 'crank', 'crank' firing_deg = 0, 360 "
    "orders = 0.5, 1 amplitudes = 100, 80 phases_deg = 30, 60 {} /"
)
PRESSURES = (
    "&engine name = 'e' stroke = 2 cylinders = 'crank' firing_deg = 90 pressure_file = 'p.csv' "
    "bore = 0.2 crank_radius = 0.1 rod_length = 0.4 {} /"
)
LABEL = "nocdyn: machine.nml:2: &engine 'e': "


def pressure_rows(low, high, step=2):
    return "".join(f"{angle}, {1e5 + 1e4 * cos(radians(angle))}\n" for angle in range(low, high + 1, step))


def run(nocdyn, engine, *words):
    nocdyn.done(MACHINE.format(engine), *words)
    return nocdyn.values()


def refusal(nocdyn, engine):
    nocdyn.write("machine.nml", MACHINE.format(engine))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    return outcome.stderr


def test_each_cylinder_has_its_harmonics_after_it_fires(nocdyn):
    table = run(nocdyn, FIRST.format("mean_torque = 20"))
    for name, firing in (("torque_e_1 [N m]", 0.0), ("torque_e_2 [N m]", 2 * pi)):
        expected = [
            10 + 100 * sin(0.5 * (phi - firing) + radians(30)) + 80 * sin(phi - firing + radians(60))
            for phi in table["phi_crank [rad]"]
        ]
        assert list(table[name]) == pytest.approx(expected, abs=1e-9)


def test_a_table_file_says_the_same_as_lists(nocdyn):
    nocdyn.write("t.csv", "phase_deg, order, amplitude\n30, 0.5, 100\n60, 1, 80\n0, 0, 10\n")
    inline = run(nocdyn, FIRST.format("mean_torque = 20"))
    engine = "&engine name = 'e' stroke = 4 cylinders = 'crank', 'crank' firing_deg = 0, 360 table_file = 't.csv' /"
    by_file = run(nocdyn, engine)
    assert by_file.keys() == inline.keys() and all((by_file[label] == values).all() for label, values in inline.items())
    assert nocdyn("run", "out/input.nml", "--out", "again").returncode == 0
    assert nocdyn.table("again") == nocdyn.table("out")


def test_amplitudes_follow_the_speed(nocdyn):
    rows = "1, 10, 90, 50\n1, 30, 90, 150\n2, 4, 0, 50\n2, 8, 90, 150\n"
    nocdyn.write("t.csv", "order, amplitude, phase_deg, speed\n" + rows)
    table = run(nocdyn, "&excitation name = 'x' body = 'crank' kind = 'orders' table_file = 't.csv' /")
    expected = [20 * cos(phi) + 2 * sin(2 * phi) + 4 * cos(2 * phi) for phi in table["phi_crank [rad]"]]
    assert list(table["torque_x [N m]"]) == pytest.approx(expected, abs=1e-5)  # the speed changes by 1e-8


def test_blades_have_a_share_of_the_load(nocdyn):
    load = "&load name = 'water' body = 'crank' quadratic = 0.02 /"
    blades = (
        "&excitation name = 'x' body = 'crank' kind = 'orders' orders = 4, 8 phases_deg = 0, 90 share_of_load = 0.1, 0.05 {} /"
    )
    table = run(nocdyn, load + blades.format(""))
    expected = [
        -load * (0.1 * sin(4 * phi) + 0.05 * cos(8 * phi))
        for load, phi in zip(table["torque_water [N m]"], table["phi_crank [rad]"])
    ]
    assert list(table["torque_x [N m]"]) == pytest.approx(expected, abs=1e-9)
    other = "&load name = 'air' body = 'crank' viscous = 1 /"
    assert run(nocdyn, load + other + blades.format("load = 'water'"))["torque_x [N m]"] == pytest.approx(expected, abs=1e-4)
    where = "nocdyn: machine.nml:2: &excitation 'x': "
    assert refusal(nocdyn, blades.format("")) == where + "share_of_load needs a &load on 'crank'\n"
    assert "share_of_load needs load, the name of one of the loads on 'crank': 'water', 'air'\n" in refusal(
        nocdyn, load + other + blades.format("")
    )
    assert "load = 'watr' is no &load on 'crank'; there: 'water'\n" in refusal(nocdyn, load + blades.format("load = 'watr'"))


def test_pressure_turns_the_crank(nocdyn):
    nocdyn.write("p.csv", "crank_angle_deg, pressure\n" + pressure_rows(-180, 180))
    table = run(nocdyn, PRESSURES.format("crankcase_pressure = 1e5"))
    for phi, torque in zip(table["phi_crank [rad]"], table["torque_e_1 [N m]"]):
        theta = phi - pi / 2
        lever = 0.1 * sin(theta) * (1 + 0.25 * cos(theta) / (1 - (0.25 * sin(theta)) ** 2) ** 0.5)
        assert torque == pytest.approx(1e4 * cos(theta) * 0.01 * pi * lever, abs=2e-2)  # the curve between the points


RADIUS, ROD, OFFSET = 0.1, 0.2145922746781116, 0.01  # m; lambda = 0.466
SLIDER_CRANK = f"crank_radius = {RADIUS} rod_length = {ROD} offset = {OFFSET}"


def motion(theta):
    """Slope and curvature of the position of a piston over the angle of its crank [m]."""
    p, slope = RADIUS * np.sin(theta) - OFFSET, RADIUS * np.cos(theta)
    reach = np.sqrt(ROD**2 - p**2)
    first = -RADIUS * np.sin(theta) - p * slope / reach
    return first, -slope - (slope**2 - p * RADIUS * np.sin(theta)) / reach - (p * slope) ** 2 / reach**3


def test_a_reciprocating_mass_has_all_orders_of_the_slider_crank(nocdyn):
    engine = f"&engine name = 'e' stroke = 2 cylinders = 'crank' firing_deg = 90 reciprocating_mass = 2 {SLIDER_CRANK} /"
    table = run(nocdyn, engine)
    first, second = motion(table["phi_crank [rad]"] - pi / 2)
    assert table["torque_e_1 [N m]"] == pytest.approx(-2 * first * second * table["omega_crank [rad/s]"] ** 2, abs=1e-8)


PARTS = """&body name = 'c' inertia = {} speed = 100 /
&body name = 'f' inertia = 2 /
&coupling name = 'k' bodies = 'c', 'f' stiffness = 1e5 damping = 5 /
&load name = 'l' body = 'f' viscous = 0.1 /
&run t_end = 0.1 /
&response body = 'c' speed = 50, 150 count = 5 /
"""


def orders_of(nocdyn, text):
    """Orders of a response and their complex moments in the coupling, and the number of crossings of a Campbell diagram."""
    nocdyn.done(text, command="response")
    table = nocdyn.values(name="response_orders.csv")
    moments = table["total_moment_k"] * np.exp(1j * np.radians(table["phase_total_moment_k"]))
    nocdyn("campbell", "machine.nml", "--out", "speeds")
    crossings = json.loads((nocdyn.folder / "speeds/campbell.json").read_text())["crossings"]
    return table["order"], moments, len(crossings)


def test_an_engine_has_the_response_and_the_orders_of_a_crank(nocdyn):
    """In a response a crank has its mean inertia, which the body of an engine has already, and its torques."""
    mean = float(np.mean(2 * motion(np.arange(720) * pi / 360)[0] ** 2))
    engine = f"&engine name = 'e' stroke = 2 cylinders = 'c' firing = 0 reciprocating_mass = 2 {SLIDER_CRANK} /\n"
    crank = f"&crank name = 'e' body = 'c' piston_mass = 2 {SLIDER_CRANK} /\n"
    orders, moments, crossings = orders_of(nocdyn, engine + PARTS.format(0.3 + mean))
    orders_of_crank, moments_of_crank, crossings_of_crank = orders_of(nocdyn, crank + PARTS.format(0.3))
    assert list(orders) == list(orders_of_crank) and max(orders) > 6 and crossings == crossings_of_crank > 6
    assert moments == pytest.approx(moments_of_crank, abs=1e-9 * max(abs(moments)))


EFFORT_ORDERS = {0: (200, 90), 0.5: (900, 17), 2: (500, 90), 12: (30, 0)}  # amplitude [N m], phase [deg]
EFFORT = "&engine name = 'e' stroke = 4 cylinders = 'c', 'c' firing_deg = 90, 450 {} /\n"


def effort(degrees):
    """A torque over the angle of a crank with these orders."""
    return sum(a * np.sin(np.radians(order * degrees + phase)) for order, (a, phase) in EFFORT_ORDERS.items())


def write_effort(nocdyn, degrees):
    rows = zip(map(float, degrees), map(float, effort(degrees)), strict=True)
    nocdyn.write("t.csv", "crank_angle_deg, torque\n" + "".join(f"{angle!r}, {torque!r}\n" for angle, torque in rows))


def by_orders():
    orders, pairs = list(EFFORT_ORDERS)[1:], list(EFFORT_ORDERS.values())[1:]
    amplitudes, phases = ([pair[i] for pair in pairs] for i in range(2))
    text = f"orders = {orders} amplitudes = {amplitudes} phases_deg = {phases} mean_torque = 400"
    return EFFORT.format(text.replace("[", "").replace("]", ""))


@pytest.mark.parametrize("degrees", [np.arange(0, 720, 5), np.arange(-360, 361, 10), 7.5 + np.arange(0, 720, 12)])
def test_an_engine_by_its_crank_effort_is_the_one_by_its_harmonics(nocdyn, degrees):
    write_effort(nocdyn, degrees)
    tables = []
    for engine in (EFFORT.format("torque_file = 't.csv'"), by_orders()):
        nocdyn.done(engine + PARTS.format(0.3))
        run_columns = nocdyn.values()
        orders, moments, _ = orders_of(nocdyn, engine + PARTS.format(0.3))
        speeds = nocdyn.values(name="response_orders.csv")["omega_c"]
        chosen = np.isin(orders, [2, 12]) & np.isin(speeds, [50, 75, 100, 125, 150])
        assert max(abs(moments[~np.isin(orders, [2, 12])])) < 1e-9 * max(abs(moments))
        tables.append((run_columns["torque_e_2"], run_columns["total_moment_k"], moments[chosen]))
    for of_table, of_orders in zip(*tables, strict=True):
        assert of_table == pytest.approx(of_orders, abs=1e-9 * max(abs(of_orders)))


def test_a_crank_effort_with_uneven_angles_is_a_cubic(nocdyn):
    degrees = np.delete(np.arange(0, 720, 1), [100, 250, 251])
    write_effort(nocdyn, degrees)
    table = run(nocdyn, EFFORT.format("torque_file = 't.csv'").replace("'c'", "'crank'"))
    expected = effort(np.degrees(table["phi_crank [rad]"]) - 90)
    assert table["torque_e_1 [N m]"] == pytest.approx(expected, abs=1)  # of the cubic, and of its orders above 24
    assert max(abs(table["torque_e_1 [N m]"] - expected)) > 1e-6


def test_pressures_and_their_crank_effort_are_the_same_engine(nocdyn):
    """A constant pressure has the torque of the lever, whose harmonics fall fast."""
    angles = np.arange(0, 360, 3)
    torques = ", ".join(repr(float(torque)) for torque in -1e5 * 0.01 * pi * motion(np.radians(angles))[0])
    degrees = f"crank_angles_deg = {', '.join(map(str, angles))} "
    engine = "&engine name = 'e' stroke = 2 cylinders = 'crank' firing_deg = 0 misfire = 0 "
    by_pressure = run(nocdyn, f"{engine} {degrees} pressures = {len(angles)}*1e5 bore = 0.2 {SLIDER_CRANK} /")
    by_effort = run(nocdyn, f"{engine} {degrees} torques = {torques} /")
    assert max(abs(by_pressure["torque_e_1"])) > 300
    assert by_effort["torque_e_1"] == pytest.approx(by_pressure["torque_e_1"], abs=1e-9)
    again = nocdyn("run", "out/input.nml", "--out", "again")
    assert again.returncode == 0 and nocdyn.table("again") == nocdyn.table("out")


def test_a_cylinder_that_does_not_fire_has_its_own_crank_effort(nocdyn):
    points = ", ".join(str(45 * i) for i in range(8))
    text = f"&engine name = 'e' stroke = 2 cylinders = 'crank' firing_deg = 0 crank_angles_deg = {points} torques = 8*50 {{}} /"
    assert run(nocdyn, text.format(""))["torque_e_1"] == pytest.approx(50)
    assert run(nocdyn, text.format("misfire = 1"))["torque_e_1"] == pytest.approx(0)
    assert run(nocdyn, text.format("misfire = 1 misfire_torques = 8*-4"))["torque_e_1"] == pytest.approx(-4)


RESISTING = (
    "mean_torque = 50 orders = 1, 2 amplitudes = 80, 30 phases_deg = 10, 20",
    "crank_angles_deg = 0, 45, 90, 135, 180, 225, 270, 315 torques = 0, 10, 40, 90, 60, 50, 40, 10",
)


@pytest.mark.parametrize("torque", RESISTING)
def test_the_torques_of_a_compressor_resist_and_its_inertia_torque_stays(nocdyn, torque):
    text = "&engine name = 'e' {} stroke = 2 cylinders = 'crank' firing_deg = 0 {} /"
    mass = f"reciprocating_mass = 0.5 {SLIDER_CRANK}"
    column = "torque_e_1 [N m]"
    engine, compressor = (run(nocdyn, text.format(works, torque))[column] for works in ("", "works = 'compressor'"))
    assert compressor == pytest.approx(-engine, abs=1e-6)  # the speed changes by 1e-9 of itself
    heavy = run(nocdyn, text.format("works = 'compressor'", torque + " " + mass))[column]
    assert heavy - compressor == pytest.approx(run(nocdyn, text.format("", mass))[column], abs=1e-5)


def test_the_pressures_of_a_compressor_have_the_sign_of_pressures(nocdyn):
    nocdyn.write("p.csv", "crank_angle_deg, pressure\n" + pressure_rows(-180, 180))
    engine = run(nocdyn, PRESSURES.format("crankcase_pressure = 1e5"))
    compressor = run(nocdyn, PRESSURES.format("crankcase_pressure = 1e5 works = 'compressor'"))
    assert all((values == compressor[label]).all() for label, values in engine.items())


TRAIN_OF_BOTH = """&body name = 'c' inertia = 3 speed = 100 /
&body name = 'f' inertia = 2 /
&coupling name = 'k' bodies = 'c', 'f' stiffness = 1e5 damping = 5 /
&engine name = 'gas' stroke = 4 cylinders = 'c' firing = 0 mean_torque = {} orders = 0.5 amplitudes = 9 /
&engine name = 'pump' works = 'compressor' stroke = 2 cylinders = 'f', 'f' firing_deg = 0, 180 mean_torque = {} /
&load name = 'l' body = 'f' viscous = 0.2 /
&run t_end = 0.1 /
&response body = 'c' speed = 50, 150 count = 3 /
"""


def notes_on_signs(outcome):
    return re.findall(r"note: (\w+ '\w+' (?:works|generates).*)", outcome.stdout)


def test_engines_hold_the_speed_of_a_response_and_compressors_do_not(nocdyn):
    outcome = nocdyn.done(TRAIN_OF_BOTH.format(100, 60), command="response")
    assert notes_on_signs(outcome) == []
    table = nocdyn.values(name="response.csv")
    assert table["drive"] == pytest.approx((60 + 0.2 * table["omega_c"]) / 100, rel=1e-9)


def test_power_of_the_other_sign_is_noted(nocdyn):
    motor = "&motor name = 'alternator' body = 'f' kind = 'constant' torque = {} /\n"
    assert notes_on_signs(nocdyn.done(TRAIN_OF_BOTH.format(100, 60), command="equilibrium")) == []
    for command in ("equilibrium", "modes"):
        text = motor.format(-20) + TRAIN_OF_BOTH.format(100, 60)
        assert notes_on_signs(nocdyn.done(text, command=command)) == ["motor 'alternator' generates: it takes 2000 W"]
    backwards = motor.format(90) + TRAIN_OF_BOTH.format(-10, -60)
    assert notes_on_signs(nocdyn.done(backwards, command="equilibrium")) == [
        "engine 'gas' works as a compressor: it takes 7000 W",
        "compressor 'pump' works as a motor: it gives 42000 W",
    ]
    for command in ("response", "campbell"):
        notes = notes_on_signs(nocdyn.done(backwards, command=command))
        assert [note.split(" up to")[0] for note in notes] == [
            "engine 'gas' works as a compressor: it takes",
            "compressor 'pump' works as a motor: it gives",
        ]
        assert re.search(r"gives up to 9000 W at (\d+) of \1 speeds", notes[1])
    in_run = notes_on_signs(nocdyn.done(backwards))
    assert re.match(r"engine 'gas' works as a compressor: it takes [0-9.]+ J in this run", in_run[0])
    assert notes_on_signs(nocdyn.done(TRAIN_OF_BOTH.format(100, 60))) == []


@pytest.mark.parametrize(
    "engine, complaint",
    [
        (
            FIRST.format("").replace("firing_deg = 0, 360", "firing_deg = 0, 721"),
            "firing_deg(2) = 721 is out of range; allowed: 0 to 720 with stroke = 4",
        ),
        (
            FIRST.format("").replace("firing_deg = 0, 360", "firing = 0, 7").replace("stroke = 4", "stroke = 2"),
            "firing(2) = 7 is out of range; allowed: 0 to 6.283185307179586 with stroke = 2",
        ),
        (
            FIRST.format("").replace("firing_deg = 0, 360", "firing_deg = 0"),
            "firing_deg has 1 value and cylinders has 2 values; needed: as many of each",
        ),
        (
            FIRST.format("").replace("stroke = 4", "stroke = 2"),
            "orders(1) = 0.5 is no order of its cycle; allowed: multiples of 1 with stroke = 2",
        ),
        (FIRST.format("").replace("stroke = 4", "stroke = 3"), "stroke = 3; allowed: 2 or 4"),
        (FIRST.format("").replace("orders = 0.5", "orders = -0.5"), "orders(1) = -0.5 is out of range; allowed: >= 0"),
        (FIRST.format("").replace("orders = 0.5", "orders = 1"), "order 1 has 2 rows; needed: one"),
        (
            FIRST.format("mean_torque = 9").replace("0.5, 1 ", "0, 1 ").replace("30, 60", "0, 0"),
            "mean_torque and the order 0 are both given; allowed: one of them",
        ),
        (
            FIRST.format("").replace("0.5, 1 ", "0, 1 "),
            "orders(1) = 0 is a mean, and phases_deg(1) = 30; needed: the phase 0",
        ),
        (FIRST.format("misfire = 3"), "misfire = 3; allowed: 0 to 2, the number of a cylinder"),
        (FIRST.format("cylinder_scatter = 0.1, 0, 0"), "cylinder_scatter has 3 values; needed: 1 or 2"),
        (
            FIRST.format("loads = 0.5, 1").replace("orders = 0.5", "orders = 1"),
            "load_share is missing; needed: the load of the engine, 0.5 to 1, the loads of the rows",
        ),
        (FIRST.format("load_share = 1"), "load_share needs loads or table_file"),
        (FIRST.format("speeds = 10, 20"), "order 1 has 0 rows at the speed 10 rad/s; needed: one at each speed"),
        (FIRST.format("speeds_rpm = 10, 20"), "order 1 has 0 rows at the speed 10 rpm; needed: one at each speed"),
        (FIRST.format("reciprocating_mass = 2"), "reciprocating_mass needs crank_radius"),
        (
            FIRST.format("reciprocating_mass = 2 crank_radius = 0.5 rod_length = 0.4"),
            "rod_length = 0.4 is out of range; allowed: > crank_radius = 0.5",
        ),
        (
            FIRST.format("reciprocating_mass = 2 crank_radius = 0.3 rod_length = 0.4 offset = -0.2"),
            "offset = -0.2 m: the rod of 0.4 m does not reach the piston at all angles; allowed: crank_radius + |offset| below",
        ),
        (FIRST.format("torque_file = 't.csv'"), "orders and torque_file are both given; allowed: one of them"),
        (
            "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 torques = 8*1 /",
            "crank_angles is missing; needed: 8 values, one for each of torques",
        ),
        (
            "&engine name = 'e' stroke = 2 cylinders = 'crank' firing_deg = 0 crank_angles = 0, 1, 2, 3, 4, 5, 5.5, 6 /",
            "crank_angles needs pressures or torques",
        ),
        (
            "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 torques = 7*1, 2 "
            "crank_angles = 0, 1, 2, 3, 4, 5, 5.5, 6 /",
            "crank_angles from 0 to 6 are not those of one cycle; needed: a range of",
        ),
        (FIRST.format("offset = 0.01"), "offset needs pressures, pressure_file or reciprocating_mass"),
        (FIRST.format("pressure_file = 'p.csv'"), "orders and pressure_file are both given; allowed: one of them"),
        (
            "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 /",
            "it has no torque; needed: orders, table_file, pressures, pressure_file, torques, torque_file, reciprocating_mass or",
        ),
        (
            FIRST.format("").replace("'crank', 'crank'", "'crank', 'cranc'"),
            "cylinders: there is no &body 'cranc'; did you mean 'crank'?",
        ),
        (
            "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 mean_torque = 1 / &load name='e_1' body='crank' /",
            "the name 'e_1' of its cylinder 1 is taken by &load",
        ),
    ],
)
def test_engines_that_do_not_fit_are_refused(nocdyn, engine, complaint):
    assert LABEL + complaint in refusal(nocdyn, engine)


@pytest.mark.parametrize(
    "text, complaint",
    [
        ("order, phase_deg\n1, 2\n", "t.csv:1: there is no column amplitude; needed: order, amplitude, phase_deg"),
        (
            "order, amplitude, phase_deg, power\n1, 2, 3, 4\n",
            "t.csv:1: 'power' is no column; allowed: order, amplitude, phase_deg, speed_rpm, load, "
            "misfire_amplitude, misfire_phase_deg",
        ),
        ("order, amplitude, phase_deg, phase\n1, 2, 3, 4\n", "t.csv:1: the column 'phase' is given twice"),
        ("order, amplitude, phase_deg\n1, 2, 3\n-1, 2, 3\n", "t.csv: order = -1 in row 2 is out of range; allowed: >= 0"),
        ("order, amplitude, phase_deg\n1, 2\n", "t.csv:2: 2 columns in '1, 2'; needed: 3, separated by blanks or a comma"),
    ],
)
def test_files_of_harmonics_that_do_not_fit_are_refused(nocdyn, text, complaint):
    nocdyn.write("t.csv", text)
    engine = "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 table_file = 't.csv' /"
    assert LABEL + "table_file: " + complaint in refusal(nocdyn, engine)


def test_tables_beyond_all_engines_are_refused(nocdyn):
    nocdyn.write("t.csv", "order, amplitude, phase_deg\n" + "".join(f"{i}, 1, 0\n" for i in range(201)))
    engine = "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 table_file = 't.csv' /"
    assert "201 orders at 1 speed; allowed: at most 200 orders, and 5000 orders times speeds" in refusal(nocdyn, engine)
    nocdyn.write("t.csv", "order, amplitude, phase_deg\n" + "1, 1, 0\n" * 20001)
    assert "20001 rows of orders; allowed: at most 20000" in refusal(nocdyn, engine)
    many = "&engine name = 'e' stroke = 4 cylinders = 101*'crank' firing_deg = 101*0 mean_torque = 1 /"
    assert "101 cylinders; allowed: at most 100" in refusal(nocdyn, many)


def test_a_file_of_harmonics_that_is_not_there_is_refused(nocdyn):
    nocdyn.write(
        "machine.nml", MACHINE.format("&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0 table_file = 'no.csv' /")
    )
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 3
    assert "table_file: no.csv: cannot be read: there is no such file" in outcome.stderr


@pytest.mark.parametrize(
    "rows, complaint",
    [
        (
            pressure_rows(0, 300),
            "crank_angles_deg from 0 to 300 are not those of one cycle; needed: a range of 360 with stroke",
        ),
        (
            pressure_rows(0, 720),
            "crank_angles_deg from 0 to 720 are not those of one cycle; needed: a range of 360 with stroke",
        ),
        (pressure_rows(0, 8), "pressure_file: p.csv: crank_angle_deg has 5 rows; needed: at least 8"),
        (
            "0, 1\n0, 2\n" + pressure_rows(10, 360),
            "pressure_file: p.csv: crank_angle_deg = 0 in row 2 is not greater than that in the row before",
        ),
    ],
)
def test_pressures_that_are_not_one_cycle_are_refused(nocdyn, rows, complaint):
    nocdyn.write("p.csv", "crank_angle_deg, pressure\n" + rows)
    assert LABEL + complaint in refusal(nocdyn, PRESSURES.format(""))


def test_harmonics_that_are_left_out_are_noted_in_runs_and_responses(nocdyn):
    rows = "".join(f"{angle}, {1e5 + 6e6 * exp(-(((angle - 10) / 12) ** 2))}\n" for angle in range(-180, 181, 2))
    nocdyn.write("p.csv", "crank_angle_deg, pressure\n" + rows)
    text = PRESSURES.format("crankcase_pressure = 1e5 KEY")
    shares = {}
    for orders in (4, 8, 24):
        nocdyn.write("m.nml", MACHINE.format(text.replace("KEY", f"harmonics_up_to = {orders}")))
        outcome = nocdyn("run", "m.nml", "--out", "out")
        assert outcome.returncode == 0, outcome.stderr
        found = re.findall(rf"engine 'e': harmonics_up_to = {orders} leaves out up to .* cylinder, (.*) % of its", outcome.stdout)
        shares[orders] = [float(share) for share in found]
    assert shares[24] == []
    assert shares[4][0] > 1.5 * shares[8][0] > 1
    degrees = ", ".join(str(10 * i) for i in range(36))
    effort = f"&engine name = 'e' stroke = 2 cylinders = 'crank' firing = 0 crank_angles_deg = {degrees} torques = 90, 35*0 "
    for key, noted in (("harmonics_up_to = 5 /", True), ("/", False)):
        outcome = nocdyn.done(MACHINE.format(effort + key))
        assert ("leaves out up to" in outcome.stdout) == noted
    shaft = "&body name = 'end' inertia = 2 /\n&coupling name = 'k' bodies = 'crank', 'end' stiffness = 1e5 damping = 10 /\n"
    shaft += "&response body = 'crank' speed = 5, 20 count = 3 /\n"
    nocdyn.write("r.nml", MACHINE.format(text.replace("KEY", "harmonics_up_to = 4")) + shaft)
    outcome = nocdyn("response", "r.nml", "--out", "response")
    assert "note: engine 'e': harmonics_up_to = 4 leaves out up to" in outcome.stdout, outcome.stderr


SWEEP = """&sweep design = 'grid' /
&vary target = '{}' low = {} high = {} count = 3 /
&record quantity = 'torque_e_1' statistic = 'final' /
"""


def final_torques(nocdyn, machine, target, low, high):
    """Of the first torque at three values of a number, after a comparison with single runs."""
    nocdyn.write("machine.nml", MACHINE.format(machine) + SWEEP.format(target, low, high))
    outcome = nocdyn("sweep", "machine.nml", "--out", "sweep", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "sweep/sweep.csv", newline="", encoding="utf-8") as file:
        found = [next(float(value) for key, value in row.items() if "torque_e_1" in key) for row in csv.DictReader(file)]
    for value, final in zip((low, (low + high) / 2, high), found):
        table = run(nocdyn, machine, "--set", f"{target}={value:g}")
        assert table["torque_e_1 [N m]"][-1] == pytest.approx(final, rel=1e-10, abs=1e-9)  # rtol of the runs
    return found


@pytest.mark.parametrize(
    "key, low, high",
    [
        ("amplitudes(2)", 80, 120),
        ("firing_deg(1)", 0, 180),
        ("misfire", 0, 2),
        ("reciprocating_mass", 0, 5),
        ("crank_radius", 0.04, 0.14),
        ("offset", -0.03, 0.03),
        ("mean_torque", 0, 50),
    ],
)
def test_keys_of_engines_vary_in_sweeps(nocdyn, key, low, high):
    engine = FIRST.format("reciprocating_mass = 2 crank_radius = 0.1 rod_length = 0.4 offset = 0.01")
    assert len(set(final_torques(nocdyn, engine, f"engine.e.{key}", low, high))) > 1


def test_crank_efforts_vary_in_sweeps(nocdyn):
    points = ", ".join(str(90 * i) for i in range(8))
    engine = "&engine name = 'e' stroke = 4 cylinders = 'crank' firing_deg = 0"
    engine += f" crank_angles_deg = {points} torques = 0, 9, 3, 1, 0, 0, 0, 0 /"
    assert len(set(final_torques(nocdyn, engine, "engine.e.torques(2)", 5, 13))) == 3


def test_the_share_of_a_load_follows_it_in_sweeps(nocdyn):
    load = "&load name = 'water' body = 'crank' quadratic = 0.02 /\n"
    blades = "&excitation name = 'e_1' body = 'crank' kind = 'orders' orders = 4 share_of_load = 0.1 /"
    first, second, third = final_torques(nocdyn, load + blades, "load.water.quadratic", 0.01, 0.03)
    assert second == pytest.approx(2 * first, rel=1e-6)
    assert third == pytest.approx(3 * first, rel=1e-6)
