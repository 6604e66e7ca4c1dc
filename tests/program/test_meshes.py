"""Elastic meshes: forces, deformations, backlash, modes, sweeps, refusals."""

import csv
import json
from math import pi, sqrt

import pytest

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
    assert run(nocdyn, MESH.format("teeth = 40, 100 module = 0.01", "")) == by_radii


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
