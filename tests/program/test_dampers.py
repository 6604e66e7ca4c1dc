"""Torsional vibration dampers by their data sheets: the machines that they stand for, the optimum of Houdaille's damper, heat."""

import csv
import json
import math
import re

import numpy as np
import pytest

# The untuned viscous damper: Automotive Chassis Engineering, section 5.9, eqs. (5.46), (5.47), after Den Hartog.
MU = 0.2
BEST_ZETA = 1 / math.sqrt(2 * (1 + MU) * (2 + MU))
BEST_AMPLIFICATION = (2 + MU) / MU

MACHINE = """\
&body name = 'engine' inertia = {engine!r} speed = 30 /
&body name = 'machine' inertia = 40.0 /
&coupling name = 'shaft' bodies = 'engine', 'machine' stiffness = 2.0e5 damping = 20.0 /
&load name = 'work' body = 'machine' viscous = 20.0 /
&motor name = 'drive' body = 'engine' a = 800.0 b = 5.0 c = 0.0 /
&excitation name = 'gas' body = 'engine' kind = 'orders' orders = 1, 2.5, 4 amplitudes = 300, 200, 100 phases = 1, 2, 3 /
{damper}
&response body = 'engine' speed = 10, 60 count = 11 /
&run t_end = 0.5 start = 'equilibrium' /
"""
RADII = {"outer": 0.3, "inner": 0.15, "width": 0.1, "gap": 8e-4, "side": 6e-4, "eta": 40.0}
GAP_DAMPING = (
    2
    * math.pi
    * RADII["eta"]
    * (
        RADII["width"] * (RADII["outer"] ** 3 + RADII["inner"] ** 3) / RADII["gap"]
        + (RADII["outer"] ** 4 - RADII["inner"] ** 4) / (2 * RADII["side"])
    )
)
TUNED = 2 * math.pi * 12.0
DAMPERS = {
    "damping = 50.0": "damping = 50.0",
    "viscosity = 40 outer_radius = 0.3 inner_radius = 0.15 width = 0.1 radial_gap = 8e-4 lateral_gap = 6e-4": (
        f"damping = {GAP_DAMPING!r}"
    ),
    "kind = 'rubber' stiffness = 9000.0 relative_damping = 1.1": (
        f"stiffness = 9000.0 relative_damping = 1.1 damping_frequency = {math.sqrt(9000.0 / 2.0)!r}"
    ),
    "kind = 'rubber' tuning_frequency_hz = 12.0 loss_factor = 0.2 damping_frequency = 60.0": (
        f"stiffness = {2.0 * TUNED**2!r} relative_damping = {2 * math.pi * 0.2!r} damping_frequency = 60.0"
    ),
    "kind = 'viscous_spring' tuning_frequency_hz = 12.0 damping_ratio = 0.15": (
        f"stiffness = {2.0 * TUNED**2!r} damping = {2.0 * 0.15 * 2.0 * TUNED!r}"
    ),
    "kind = 'viscous_spring' stiffness = 9000.0 damping = 40.0": "stiffness = 9000.0 damping = 40.0",
}


def numbers(path):
    return np.nan_to_num(np.genfromtxt(path, delimiter=",", skip_header=1))


@pytest.mark.parametrize("keys", DAMPERS)
@pytest.mark.parametrize("command", ["run", "response", "campbell", "modes"])
def test_a_damper_is_a_body_and_a_coupling(nocdyn, keys, command):
    damper = f"&damper name = 'ring' body = 'engine' ring_inertia = 2.0 housing_inertia = 0.5 {keys} /"
    by_hand = f"&body name = 'ring' inertia = 2.0 /\n&coupling name = 'ring' bodies = 'engine', 'ring' {DAMPERS[keys]} /"
    tables = []
    for engine, text in ((3.0, damper), (3.5, by_hand)):
        nocdyn.done(MACHINE.format(engine=engine, damper=text), command=command)
        tables.append({path.name: path for path in (nocdyn.folder / "out").glob("*.csv")})
        tables[-1] = {name: (path.read_text().splitlines()[0], numbers(path)) for name, path in tables[-1].items()}
    assert tables[0].keys() == tables[1].keys()
    assert tables[0]
    for name, (header, values) in tables[0].items():
        assert header == tables[1][name][0]
        assert values == pytest.approx(tables[1][name][1], rel=1e-9, abs=1e-11 * np.max(abs(values)))


@pytest.mark.parametrize("keys", DAMPERS)
def test_check_tells_what_a_damper_comes_to(nocdyn, keys):
    by_hand = dict(re.findall(r"(\w+) = (\S+)", DAMPERS[keys]))
    stiffness, damping, psi = (float(by_hand.get(key, 0)) for key in ("stiffness", "damping", "relative_damping"))
    if psi:
        damping = psi / (2 * math.pi) * stiffness / float(by_hand["damping_frequency"])
    text = f"&damper name = 'ring' body = 'engine' ring_inertia = 2.0 housing_inertia = 0.5 {keys} /\n"
    nocdyn.write("machine.nml", MACHINE.format(engine=3.0, damper=text + "&limit damper = 'ring' heat = 100 /"))
    printed = nocdyn("check", "machine.nml", "--out", "out").stdout
    (damper,) = json.loads((nocdyn.folder / "out/check.json").read_text())["dampers"]
    assert (damper["name"], damper["body"], damper["ring_inertia_kg_m2"], damper["housing_inertia_kg_m2"]) == (
        "ring",
        "engine",
        2,
        0.5,
    )
    wanted = [stiffness, damping, math.sqrt(stiffness / 2.0)]
    keys = ("stiffness_N_m_rad", "damping_N_m_s_rad", "tuning_frequency_rad_s")
    assert [damper[key] for key in keys] == pytest.approx(wanted, rel=1e-9)
    (line,) = [line.split() for line in printed.splitlines() if line.startswith("  ring, ")]
    assert [float(word) for word in line[2:]] == pytest.approx([2, *wanted[:2], wanted[2] / (2 * math.pi)], rel=1e-6)
    sheet = (nocdyn.folder / "out/mass_elastic.csv").read_text()  # a machine with its modes
    assert "not in this sheet: damper" not in sheet
    assert nocdyn("import", "out/mass_elastic.csv", "--out", "again.nml").returncode == 0
    modes = []
    for file in ("machine.nml", "again.nml"):
        assert nocdyn("modes", file, "--at", "rest", "--out", "out").returncode == 0
        modes.append(
            [one["undamped_frequency_Hz"] for one in json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]]
        )
    assert modes[0] == pytest.approx(modes[1], rel=1e-9, abs=1e-6)


def houdaille(zeta):
    """One inertia on a spring to the ground, with a ring in oil on it: c = 2 zeta J_ring omega_0."""
    return f"""\
&body name = 'disc' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'disc' stiffness = 1.0e4 /
&damper name = 'ring' body = 'disc' ring_inertia = {MU} damping = {2 * zeta * MU * 100.0!r} /
&excitation name = 'shaker' body = 'disc' amplitude = 10.0 frequency = 100.0 /
&response frequency = 50.0, 150.0 count = 401 /
&run t_end = 1.0 /
"""


def amplification(nocdyn, zeta):
    nocdyn.done(houdaille(zeta), command="response")
    return max(nocdyn.values(name="response.csv")["half_range_moment_spring"]) / 10.0


def test_houdailles_damper_has_den_hartogs_optimum(nocdyn):
    assert pytest.approx(0.4352, abs=1e-4) == BEST_ZETA
    best = amplification(nocdyn, BEST_ZETA)
    assert best == pytest.approx(BEST_AMPLIFICATION, rel=1e-6) == pytest.approx(11.0)
    assert min(amplification(nocdyn, BEST_ZETA * factor) for factor in (0.95, 1.05)) > best


def test_the_power_of_the_excitation_is_the_heat_of_the_damper(nocdyn):
    """The disc of Houdaille: what the shaker puts in, M omega |phi| sin / 2, is lost in the oil."""
    nocdyn.done(houdaille(0.3), command="response")
    table, lines = nocdyn.values(name="response.csv"), nocdyn.values(name="response_orders.csv")
    omega = 2 * math.pi * table["frequency"]
    x = lines["phi_disc"]
    c, ring = 2 * 0.3 * MU * 100.0, MU
    oil = 1j * omega * c * (-(omega**2) * ring) / (1j * omega * c - omega**2 * ring)
    assert table["heat_ring"] == pytest.approx(0.5 * omega * oil.imag * x**2, rel=1e-9)
    moment = np.abs(1e4 - omega**2 + oil) * x
    assert moment == pytest.approx(10.0, rel=1e-9)


DAMPER = "&damper name = 'ring' body = 'engine' ring_inertia = 2.0 {} /\n"


def test_a_load_case_may_leave_out_the_damper(nocdyn):
    cases = "&load_case name = 'with_damper' /\n&load_case name = 'without_damper' without = 'ring' /\n"
    limit = "&limit damper = 'ring' heat = 1e-3 /\n"
    text = MACHINE.format(engine=3.0, damper=DAMPER.format("damping = 50") + cases + limit)
    outcome = nocdyn("response", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode in (0, 1), outcome.stderr
    assert "heat_ring" in nocdyn.values("out/with_damper", "response.csv").by_name()
    assert "heat_ring" not in nocdyn.values("out/without_damper", "response.csv").by_name()
    report = (nocdyn.folder / "out/with_damper/response.json").read_text()
    assert '"exceeded"' in report
    nocdyn.done(MACHINE.format(engine=3.0, damper=""), command="response")
    plain = nocdyn.values(name="response.csv")
    assert plain["half_range_total_moment_shaft"] == pytest.approx(
        nocdyn.values("out/without_damper", "response.csv")["half_range_total_moment_shaft"]
    )


def test_numbers_of_dampers_vary_in_sweeps(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'damper.ring.viscosity' low = 20 high = 80 count = 3 /\n"
    record = "&record response = 'total_moment_shaft' statistic = 'peak' /\n"
    keys = "viscosity = 40 outer_radius = 0.3 inner_radius = 0.15 width = 0.1 radial_gap = 8e-4 lateral_gap = 6e-4"
    text = MACHINE.format(engine=3.0, damper=DAMPER.format(keys) + sweep + record)
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", "out", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "out/sweep.csv", newline="") as file:
        peaks = [float(row[next(label for label in row if "peak" in label)]) for row in csv.DictReader(file)]
    for viscosity, peak in zip((20, 50, 80), peaks, strict=True):
        one = MACHINE.format(engine=3.0, damper=DAMPER.format(keys))
        nocdyn.done(one, "--set", f"damper.ring.viscosity={viscosity}", command="response")
        assert max(nocdyn.values(name="response.csv")["half_range_total_moment_shaft"]) == pytest.approx(peak, rel=1e-9)


REFUSED = {
    "": "kind = 'viscous' needs damping [N m s/rad], or viscosity",
    "kind = 'viscous_spring' stiffness = 1": "kind = 'viscous_spring' needs damping [N m s/rad], damping_ratio or loss_factor",
    "kind = 'rubber' relative_damping = 1": "stiffness or tuning_frequency is missing",
    "kind = 'rubber' stiffness = 1": "relative_damping or loss_factor is missing",
    "kind = 'rubber' stiffness = 1 relative_damping = 1 damping = 1": "damping belongs to kind",
    "viscosity = 40": "viscosity needs outer_radius",
    "damping = 1 viscosity = 40": "are both given",
    "viscosity = 4 outer_radius = 0.1 inner_radius = 0.2 width = 0.1 radial_gap = 8e-4 lateral_gap = 6e-4": "outer_radius = 0.1",
    "damping = 1 body = 'none'": "body",
}


@pytest.mark.parametrize("keys", REFUSED)
def test_wrong_dampers_are_refused(nocdyn, keys):
    outcome = nocdyn("check", nocdyn.write("machine.nml", MACHINE.format(engine=3.0, damper=DAMPER.format(keys))))
    assert outcome.returncode == 2
    assert REFUSED[keys] in outcome.stderr
    assert "machine.nml:7: &damper 'ring'" in outcome.stderr


def test_names_of_dampers_are_those_of_bodies_and_couplings(nocdyn):
    for name, message in (("engine", "is taken by &body"), ("shaft", "is taken by &coupling on line 3")):
        damper = DAMPER.format("damping = 1").replace("'ring'", f"'{name}'")
        outcome = nocdyn("check", nocdyn.write("machine.nml", MACHINE.format(engine=3.0, damper=damper)))
        assert outcome.returncode == 2
        assert message in outcome.stderr
    limit = DAMPER.format("damping = 1") + "&limit damper = 'rings' heat = 1 /\n"
    outcome = nocdyn("check", nocdyn.write("machine.nml", MACHINE.format(engine=3.0, damper=limit)))
    assert (outcome.returncode, "there is no damper 'rings'; did you mean 'ring'?" in outcome.stderr) == (2, True)
    case = (
        DAMPER.format("damping = 1")
        + "&load name = 'drag' body = 'ring' viscous = 1 /\n&load_case name = 'a' without = 'ring' /\n"
    )
    outcome = nocdyn("check", nocdyn.write("machine.nml", MACHINE.format(engine=3.0, damper=case)))
    assert outcome.returncode == 2
    assert "there is no &body 'ring'" in outcome.stderr
    made = (
        DAMPER.format("damping = 1")
        + "&sweep design = 'grid' /\n&vary target = 'coupling.ring.damping' low = 1 high = 2 count = 2 /\n"
    )
    made += "&record response = 'total_moment_shaft' statistic = 'peak' /\n"
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", MACHINE.format(engine=3.0, damper=made)), "--out", "out")
    assert outcome.returncode == 2
    assert "there is no &coupling 'ring'" in outcome.stderr
