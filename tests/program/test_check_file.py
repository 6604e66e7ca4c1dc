"""check.json of `nocdyn check --out`: the mass-elastic data of a machine."""

import json
import math

import f90nml
import pytest
from conftest import SOURCE

MACHINE = """&case title = 'Data' /
&body name = 'motor' inertia = 2.0 speed = 30.0 /
&body name = 'pinion' inertia = 0.5 /
&body name = 'wheel' inertia = 9.0 /
&body name = 'fan' inertia = 20.0 /
&coupling name = 'c' bodies = 'motor', 'pinion' stiffness = 5.0e3 damping = 3.0 cubic_stiffness = 10.0 /
&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 60 /
&shaft name = 's' bodies = 'wheel', 'fan' lengths = 0.4, 1.1 diameters = 0.09, 0.07 bores = 0.0, 0.02
       shear_modulus = 8.0e10 density = 7850.0 /
&run t_end = 0.1 start = 'projected' /
"""
ROUNDING = 1e-12


def check(nocdyn, text, *words):
    nocdyn.write("m.nml", text)
    outcome = nocdyn("check", "m.nml", "--out", "out", *words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return json.loads((nocdyn.folder / "out" / (words[1] if words else "") / "check.json").read_text())


def test_bodies_have_their_inertias_also_referred_to_the_independent_body(nocdyn):
    data = check(nocdyn, MACHINE)
    bodies = {body["name"]: body for body in data["bodies"]}
    assert list(bodies) == ["motor", "pinion", "wheel", "fan"]
    (independent,) = bodies["wheel"]["coordinates"]
    ratio = {"pinion": -1 / 3, "wheel": 1.0}[independent]
    assert bodies["wheel"]["ratios"] == pytest.approx([ratio], rel=ROUNDING)
    assert bodies["wheel"]["inertia_kg_m2"] == 9.0
    loaded = bodies["wheel"]["inertia_with_shafts_kg_m2"]
    assert loaded > 9.0
    assert bodies["wheel"]["referred_inertia_kg_m2"] == pytest.approx(ratio**2 * loaded, rel=ROUNDING)


def test_stiffnesses_are_tangents_at_the_start(nocdyn):
    data = check(nocdyn, MACHINE.replace("speed = 30.0", "speed = 30.0 angle = 0.1"))
    (coupling,) = [one for one in data["couplings"] if one["kind"] == "coupling"]
    assert coupling["bodies"] == ["motor", "pinion"]
    assert coupling["stiffness_N_m_rad"] == pytest.approx(5.0e3 + 3 * 10.0 * 0.1**2, rel=ROUNDING)
    assert coupling["damping_N_m_s_rad"] == pytest.approx(3.0, rel=ROUNDING)


def test_segments_of_a_shaft_are_in_series_and_have_all_of_its_inertia(nocdyn):
    data = check(nocdyn, MACHINE)
    (shaft,) = data["shafts"]
    moments = [math.pi / 32 * (d**4 - b**4) for d, b in zip(shaft["diameter_m"], shaft["bore_m"])]
    lengths = shaft["length_m"]
    assert shaft["stiffness_N_m_rad"] == pytest.approx([8e10 * i / x for i, x in zip(moments, lengths)], rel=ROUNDING)
    assert shaft["inertia_kg_m2"] == pytest.approx([7850 * i * x for i, x in zip(moments, lengths)], rel=ROUNDING)
    (whole,) = [one for one in data["couplings"] if one["kind"] == "shaft"]
    assert whole["bodies"] == ["wheel", "fan"]
    assert 1 / whole["stiffness_N_m_rad"] == pytest.approx(sum(1 / k for k in shaft["stiffness_N_m_rad"]), rel=1e-9)


def test_gears_have_the_ratio_of_their_speeds(nocdyn):
    (gear,) = check(nocdyn, MACHINE)["constraints"]
    assert (gear["name"], gear["kind"], gear["bodies"]) == ("g", "gear", ["pinion", "wheel"])
    assert gear["ratio"] == pytest.approx(-1 / 3, rel=ROUNDING)


def test_the_complete_input_is_that_of_a_run(nocdyn):
    cases = "&load_case name = 'slow' title = 'Slowly' repeats = 5 set = 'body.motor.speed=3' /\n"
    data = check(nocdyn, MACHINE + cases)
    assert data["load_cases"] == [{"name": "slow", "title": "Slowly", "repeats": 5}]
    of_case = check(nocdyn, MACHINE + cases, "--case", "slow")
    assert of_case["load_case"] == "slow"
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    assert (nocdyn.folder / "out/slow/input.nml").read_text() == of_case["complete_input"]
    assert f90nml.reads(of_case["complete_input"])["body"][0]["speed"] == 3
    assert f90nml.reads(data["complete_input"])["body"][0]["speed"] == 30


def test_every_example_has_mass_elastic_data(nocdyn):
    files = sorted((SOURCE / "input/examples").glob("*/*.nml"))
    outcome = nocdyn("check", *files, "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    for file in files:
        data = json.loads((nocdyn.folder / "out" / file.stem / "check.json").read_text())
        named = {body["name"] for body in data["bodies"]} | {"ground"}
        assert data["bodies"]
        for element in [*data["couplings"], *data["constraints"]]:
            assert set(element["bodies"]) <= named
        for body in data["bodies"]:
            assert len(body["coordinates"]) == len(body["ratios"])
