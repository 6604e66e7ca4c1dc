"""Torsional vibration dampers by their data sheets: the machines that they stand for, the optimum of Houdaille's damper, heat."""

import math

import numpy as np
import pytest

# Den Hartog, Mechanical Vibrations, 4th edition, 3.3: the untuned viscous damper.
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
    assert BEST_ZETA == pytest.approx(0.4352, abs=1e-4)
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
