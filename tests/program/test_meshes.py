"""Elastic meshes: forces, deformations, backlash, modes, sweeps, refusals."""

import cmath
import csv
import json
import re
from functools import cache
from math import cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from conftest import all_if_fast

MACHINE = """&body name = 'm' inertia = 2.0 speed = 10.0 /
&body name = 'p' inertia = 0.5 speed = 10.0 /
&body name = 'w' inertia = 5.0 speed = {speed} /
&coupling name = 'c' bodies = 'm', 'p' stiffness = 1e4 damping = 5.0 /
{joint}
&motor name = 'd' body = 'm' a = 100.0 b = 5.0 c = 0.0 /
&load name = 'l' body = 'w' viscous = 10.0 /
&run t_end = 1.0 rtol = 1e-9 /
&output points = 101 /
"""
MESH = "&mesh name = 'teeth' bodies = 'p', 'w' {} stiffness = 1e8 damping = 1e3 {} /"
GEAR = "&gear name = 'teeth' bodies = 'p', 'w' {} /"


def run(nocdyn, joint, *words, speed=-4.0):
    outcome = nocdyn("run", nocdyn.write("machine.nml", MACHINE.format(joint=joint, speed=speed)), "--out", "out", *words)
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("out")
    return dict(zip(header, zip(*rows)))


@pytest.mark.parametrize(("keys", "speed"), [("radii = 0.2, 0.5", -4.0), ("radii = 0.2, 0.5 internal = .true.", 4.0)])
def test_the_steady_force_is_that_of_a_gear(nocdyn, keys, speed):
    steady = ("--set", "run.start=equilibrium")
    force = run(nocdyn, MESH.format(keys, ""), *steady, speed=speed)["force_teeth [N]"]
    deformation = run(nocdyn, MESH.format(keys, ""), *steady, speed=speed)["deformation_teeth [m]"]
    gear = run(nocdyn, GEAR.format(keys), *steady, speed=speed)["reaction_teeth [N]"]
    assert force == pytest.approx(gear, rel=1e-6)
    assert deformation == pytest.approx([-each / 1e8 for each in force], rel=1e-6)


def test_teeth_and_module_give_the_radii(nocdyn):
    by_radii = run(nocdyn, MESH.format("radii = 0.2, 0.5", ""))
    assert run(nocdyn, MESH.format("teeth = 40, 100 module = 0.01 pressure_angle = 0", "")) == by_radii


@pytest.mark.parametrize(("keys", "angle"), [("", 20), ("pressure_angle_deg = 25", 25), ("pressure_angle = 0", 0)])
def test_teeth_and_module_act_on_the_base_circles(nocdyn, keys, angle):
    text = "&body name = 'a' inertia = 0.5 /\n&body name = 'b' inertia = 8 /\n&run t_end = 1 /\n"
    text += f"&mesh name = 'z' bodies = 'a', 'b' teeth = 20, 60 module = 0.005 stiffness = 4e8 damping = 1e3 {keys} /\n"
    outcome = nocdyn("modes", nocdyn.write("m.nml", text), "--out", "out")
    radii = [0.5 * 0.005 * teeth * cos(radians(angle)) for teeth in (20, 60)]
    squared = 4e8 * (radii[0] ** 2 / 0.5 + radii[1] ** 2 / 8)
    frequency = float(re.search(r"^ +1 +\S+ +(\S+)", outcome.stdout, re.MULTILINE)[1])
    assert frequency == pytest.approx(sqrt(squared) / (2 * pi), rel=1e-6)
    if not keys:
        assert frequency == pytest.approx(264.4, abs=0.05)


def test_the_frequency_is_that_of_the_line_of_action(nocdyn):
    text = "&body name = 'p' inertia = 0.5 /\n&body name = 'w' inertia = 5.0 /\n&run t_end = 1 /\n"
    text += MESH.format("radii = 0.2, 0.5", "") + "\n"
    assert nocdyn("modes", nocdyn.write("machine.nml", text), "--out", "out").returncode == 0
    content = json.loads((nocdyn.folder / "out/modes.json").read_text())
    frequency = sqrt(1e8 * (0.2**2 / 0.5 + 0.5**2 / 5.0)) / (2 * pi)
    assert [m["undamped_frequency_Hz"] for m in content["modes"] if m["kind"] == "oscillating"] == [pytest.approx(frequency)]
    assert content["couplings"][0]["stiffness_N_m"] == 1e8


@pytest.mark.parametrize("formulation", ["paper", "multiplier"])
def test_formulations_agree_through_the_backlash(nocdyn, formulation):
    mesh = MESH.format("radii = 0.2, 0.5", "backlash = 1e-4")
    table = run(nocdyn, mesh, "--set", "run.t_end=0.05")
    other = run(nocdyn, mesh, "--set", "run.t_end=0.05", "--set", f"run.formulation={formulation}")
    assert any(force == 0 for force in table["force_teeth [N]"]) and any(force != 0 for force in table["force_teeth [N]"])
    assert other["omega_w [rad/s]"] == pytest.approx(table["omega_w [rad/s]"], rel=1e-6)
    assert max(map(abs, table["energy_residual [J]"])) < 1e-4


def test_a_sweep_of_keys_is_its_variants_alone(nocdyn):
    text = MACHINE.format(joint=MESH.format("radii = 0.2, 0.5", "backlash = 1e-4"), speed=-4.0)
    text += "&sweep design = 'grid' /\n&vary target = 'mesh.teeth.backlash' low = 1e-4 high = 3e-4 count = 3 /\n"
    text += "&record quantity = 'force_teeth' statistic = 'max' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", text), "--out", "all", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "all/sweep.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for row in rows:
        backlash = next(value for name, value in row.items() if "backlash" in name)
        run(nocdyn, MESH.format("radii = 0.2, 0.5", f"backlash = {backlash}"))
        summary = json.loads((nocdyn.folder / "out/summary.json").read_text())
        largest = next(float(value) for name, value in row.items() if "force_teeth" in name)
        assert largest == pytest.approx(summary["columns"]["force_teeth [N]"]["max"], rel=1e-3)


REFUSALS = [
    ("stiffness = 1e8", "radii"),
    ("radii = 0.2, 0.5 teeth = 20, 50 module = 0.02 stiffness = 1e8", "radii"),
    ("teeth = 20, 50 stiffness = 1e8", "module"),
    ("radii = 0.2, 0.5 stiffness = 0.0", "stiffness = 0"),
    ("radii = 0.2, 0.5 stiffness = 1e8 backlash = -1e-4", "backlash = -1e-4"),
]


@pytest.mark.parametrize(("keys", "words"), REFUSALS)
def test_bad_meshes_are_refused(nocdyn, keys, words):
    outcome = nocdyn(
        "check", nocdyn.write("bad.nml", MACHINE.format(joint=f"&mesh name = 't' bodies = 'p', 'w' {keys} /", speed=0))
    )
    assert outcome.returncode == 2
    assert "bad.nml:5: &mesh 't': " in outcome.stderr and words in outcome.stderr


# Two wheels on their own shafts, which any speed suits: the deformation x = R_1 phi_1 + R_2 phi_2 has the mass
# 1 / (R_1^2 / J_1 + R_2^2 / J_2), and D (x - e) with D = k + i Omega c acts on it.
RADII, INERTIAS, STIFFNESS, DAMPING = (0.05, 0.1), (0.02, 0.08), 2e8, 500.0
ERRORS = ((20, 1e-6, 0.0), (40, 2e-7, 0.7))
WHEELS = f"""\
&body name = 'one' inertia = {INERTIAS[0]} speed_rpm = 3000 /
&body name = 'two' inertia = {INERTIAS[1]} speed_rpm = INTERNAL1500 /
&mesh name = 'teeth' bodies = 'one', 'two' teeth = 20, 40 module = 0.005 pressure_angle = 0
  stiffness = {STIFFNESS} damping = {DAMPING} transmission_error = 1e-6, 2e-7 error_phases = 0, 0.7 /
&run t_end = 1 /
&response body = 'one' speed_rpm = 500, 8000 count = 16 /
"""
EXTERNAL = WHEELS.replace("INTERNAL", "-")


def deformed(speed, order, amplitude, phase):
    """Complex force on the teeth for sin(order phi + phase) = Re(-i exp(i (order phi + phase)))."""
    mass = 1 / sum(radius**2 / inertia for radius, inertia in zip(RADII, INERTIAS, strict=True))
    frequency = order * speed
    stiffness = STIFFNESS + 1j * frequency * DAMPING
    error = -1j * amplitude * cmath.exp(1j * phase)
    return stiffness * error * mass * frequency**2 / (mass * frequency**2 - stiffness)


def respond(nocdyn, text, *words):
    outcome = nocdyn("response", nocdyn.write("machine.nml", text), "--out", "out", *words)
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("out", "response_orders.csv")
    return [dict(zip([label.split(" [")[0] for label in header], row, strict=True)) for row in rows]


@pytest.mark.parametrize("text", [EXTERNAL, WHEELS.replace("INTERNAL", "").replace("teeth = 20", "internal = .true. teeth = 20")])
def test_the_force_of_a_transmission_error_has_the_closed_form(nocdyn, text):
    for row in respond(nocdyn, text):
        order, amplitude, phase = next(error for error in ERRORS if error[0] == round(row["order"]))
        force = row["force_teeth"] * cmath.exp(1j * radians(row["phase_force_teeth"]))
        expected = deformed(row["omega_one"], order, amplitude, phase)
        assert abs(force - expected) < 1e-9 * abs(expected)


def test_orders_of_a_transmission_error_may_be_given(nocdyn):
    by_teeth = respond(nocdyn, EXTERNAL)
    given = EXTERNAL.replace("teeth = 20, 40 module = 0.005 pressure_angle = 0", "radii = 0.05, 0.1").replace(
        "error_phases", "error_orders = 20, 40 error_phases"
    )
    assert respond(nocdyn, given) == by_teeth
    turned = respond(nocdyn, EXTERNAL.replace("error_phases = 0, 0.7", "error_phases_deg = 0, 40.107045659157627"))
    assert [row["phase_force_teeth"] for row in turned] == pytest.approx([row["phase_force_teeth"] for row in by_teeth])


def test_modes_do_not_have_the_transmission_error(nocdyn):
    path = nocdyn.write("machine.nml", EXTERNAL)
    plain = nocdyn.write("plain.nml", EXTERNAL.replace("transmission_error = 1e-6, 2e-7 error_phases = 0, 0.7", ""))
    modes = [nocdyn("modes", each).stdout.split("steady state")[1] for each in (path, plain)]
    assert modes[0] == modes[1]


# A loaded pair of wheels with errors of two orders, which the load presses together.
TORQUE, VISCOUS = 40.0, 0.3
LOADED = f"""{EXTERNAL.split("&run")[0].replace("1e-6, 2e-7", "AMPLITUDES")}\
&motor name = 'drive' body = 'one' kind = 'constant' torque = {TORQUE} /
&load name = 'brake' body = 'two' viscous = {VISCOUS} /
"""


STEPS = 20000


@cache
def integrated(amplitudes, end):
    """Angles and speeds at the end by an independent program: both wheels, with the gradient of x - e(phi_1) as lever arms."""
    orders, phases = (20, 40), (0, 0.7)

    def slope(y):
        angles = [(a, n, n * y[0] + phase) for a, n, phase in zip(amplitudes, orders, phases, strict=True)]
        error = sum(a * sin(angle) for a, _, angle in angles)
        arms = (RADII[0] - sum(a * n * cos(angle) for a, n, angle in angles), RADII[1])
        rate = arms[0] * y[2] + arms[1] * y[3]
        force = -STIFFNESS * (RADII[0] * y[0] + RADII[1] * y[1] - error) - DAMPING * rate
        torques = (arms[0] * force + TORQUE, arms[1] * force - VISCOUS * y[3])
        return [y[2], y[3], *(torque / inertia for torque, inertia in zip(torques, INERTIAS, strict=True))]

    y = [0.0, 0.0, 3000 * pi / 30, -1500 * pi / 30]
    h = end / STEPS
    for _ in range(STEPS):  # the classical method of fourth order
        k1 = slope(y)
        k2 = slope([a + h / 2 * b for a, b in zip(y, k1, strict=True)])
        k3 = slope([a + h / 2 * b for a, b in zip(y, k2, strict=True)])
        k4 = slope([a + h * b for a, b in zip(y, k3, strict=True)])
        y = [a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(y, k1, k2, k3, k4, strict=True)]
    return y


@pytest.mark.parametrize("method", all_if_fast("rk853", "rk45", "rodas5p", "taylor"))
@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_the_motion_with_a_transmission_error_is_that_of_another_program(nocdyn, formulation, method):
    if method == "taylor" and formulation != "reduced":
        pytest.skip("only the reduced formulation has series")
    text = LOADED.replace("AMPLITUDES", "2e-5, 5e-6")
    text += f"&run t_end = 0.05 method = '{method}' formulation = '{formulation}' rtol = 1e-10 atol = 1e-12 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("out")
    end = dict(zip(header, rows[-1], strict=True))
    found = [end[label] for label in ("phi_one [rad]", "phi_two [rad]", "omega_one [rad/s]", "omega_two [rad/s]")]
    assert found == pytest.approx(integrated((2e-5, 5e-6), 0.05), rel=2e-8)


@pytest.mark.parametrize("backlash", ["", "backlash = 4e-5"])
def test_no_energy_comes_from_a_transmission_error(nocdyn, backlash):
    """Without damping, motor and load the energy stays, though the teeth move to and fro and part."""
    text = EXTERNAL.split("&run")[0].replace("1e-6, 2e-7", "4e-5, 1e-5").replace(f"damping = {DAMPING}", backlash)
    text += "&run t_end = 0.1 rtol = 1e-11 atol = 1e-13 /\n&output interval = 0.0005 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("out")
    table = dict(zip(header, zip(*rows, strict=True), strict=True))
    energies = [k + e for k, e in zip(table["kinetic_energy [J]"], table["elastic_energy [J]"], strict=True)]
    assert max(energies) - min(energies) < 1e-8 * energies[0]
    assert max(table["elastic_energy [J]"]) > 1e-4 * energies[0]
    assert not backlash or any(force == 0 for force in table["force_teeth [N]"])


@pytest.mark.parametrize(("key", "low", "high"), [("damping", 100, 900), ("transmission_error(1)", 1e-5, 6e-5)])
@pytest.mark.parametrize("backlash", all_if_fast("backlash = 4e-5", ""))
def test_a_sweep_with_a_transmission_error_is_its_variants_alone(nocdyn, backlash, key, low, high):
    text = LOADED.replace("AMPLITUDES", "2e-5, 5e-6").replace(" transmission", f" {backlash} transmission")
    if "error" in key:
        text = text.replace("2e-5, 5e-6", "2e-5").replace("error_phases = 0, 0.7", "")
    text += "&run t_end = 0.02 /\n&sweep design = 'random' samples = 12 /\n"
    text += f"&vary target = 'mesh.teeth.{key}' low = {low} high = {high} /\n"
    text += "&record quantity = 'force_teeth' statistic = 'max' /\n&record quantity = 'omega_two' statistic = 'final' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", text), "--out", "all", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "all/sweep.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert len(rows) == 12
    for row in rows[:5]:
        value = next(value for name, value in row.items() if key in name)
        outcome = nocdyn("run", "sweep.nml", "--out", "one", "--set", f"mesh.teeth.{key}={value}", "--set", "output.points=2")
        assert outcome.returncode == 0, outcome.stderr
        header, table = nocdyn.table("one")
        end = next(value for name, value in row.items() if name.startswith("omega_two"))
        assert float(end) == pytest.approx(table[-1][header.index("omega_two [rad/s]")], rel=1e-6)


def test_the_response_to_a_transmission_error_is_the_settled_motion_of_a_loaded_mesh(nocdyn):
    """The error turns the load back and forth as well: its slope times the mean force is a torque on the first wheel."""
    text = LOADED.replace("AMPLITUDES", "2e-9, 5e-10")
    steady = TORQUE * 2 / VISCOUS * 2  # speed of wheel one, where the torque and the load are in balance
    text += f"&run t_end = 1 /\n&response body = 'one' speed = {steady}, {1.01 * steady} count = 2 /\n"
    force = [row["force_teeth"] * cmath.exp(1j * radians(row["phase_force_teeth"])) for row in respond(nocdyn, text)[:2]]
    step = 2 * pi / (20 * steady) / 20
    run = f"&run t_end = {12000 * step} start = 'equilibrium' method = 'taylor' rtol = 1e-12 atol = 1e-15 /\n"
    run += f"&output interval = {step} /\n"
    machine = (
        text.split("&run")[0]
        .replace("speed_rpm = 3000", f"speed = {steady}")
        .replace("speed_rpm = -1500", f"speed = {-steady / 2}")
    )
    outcome = nocdyn("run", nocdyn.write("run.nml", machine + run), "--out", "run")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("run")
    times, angles, forces = (
        np.array([row[header.index(label)] for row in rows[-400:]]) for label in ("t [s]", "phi_one [rad]", "force_teeth [N]")
    )
    waves = np.array([f(n * steady * times) for n in (20, 40) for f in (np.cos, np.sin)] + [np.ones_like(times)])
    parts = np.linalg.lstsq(waves.T, forces, rcond=None)[0]
    turned = angles[0] - steady * times[0]
    for k, n in enumerate((20, 40)):
        settled = (parts[2 * k] - 1j * parts[2 * k + 1]) * cmath.exp(-1j * n * turned)
        assert abs(settled - force[k]) < 1e-6 * abs(force[k])


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("phases = 0, 0.7", "phases = 0", "error_phases has 1 and transmission_error 2 values; needed: as many of each"),
        ("error_phases", "error_orders = 1, 2, 3 error_phases", "error_orders has 3 and transmission_error 2 values"),
        (
            "teeth = 20, 40 module = 0.005 pressure_angle = 0",
            "radii = 1, 2",
            "error_orders is missing; needed where radii stand for the teeth",
        ),
        ("error = 1e-6", "error = -1e-6", "transmission_error(1) = -1e-6 is out of range; allowed: >= 0 [m]"),
        ("error_phases", "error_orders = 0, 1 error_phases", "error_orders(1) = 0 is out of range; allowed: > 0"),
        ("transmission_error = 1e-6, 2e-7", "", "error_phases needs transmission_error"),
    ],
)
def test_bad_transmission_errors_are_refused(nocdyn, old, new, complaint):
    outcome = nocdyn("response", nocdyn.write("machine.nml", EXTERNAL.replace(old, new)), "--out", "out")
    assert outcome.returncode == 2
    assert f"&mesh 'teeth': {complaint}" in outcome.stderr or f"&mesh: {complaint}" in outcome.stderr
    assert "machine.nml:4" in outcome.stderr
