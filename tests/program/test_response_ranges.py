"""nocdyn response tells where its oscillations leave the range in which the laws of the machine are linear, and by how much."""

import re
from math import cos, pi, tanh

import pytest

DUFFING = """\
&body name = 'hub' inertia = 1e9 speed = 1 /
&body name = 'mass' inertia = 1 /
&coupling name = 'spring' bodies = 'hub', 'mass' {} damping = 0.05 /
&excitation name = 'force' body = 'mass' kind = 'orders' orders = 1 amplitudes = {!r} /
&load name = 'brake' body = 'mass' constant = {} constant_speed = 0.01 /
&response body = 'hub' speed = 0.99, 1.01 count = 3 /
&run t_end = 1 /
"""
NOTE = re.compile(
    r"over the vibration of 'spring' at (\S+) rpm its stiffness is on average (\S+) % (above|below) that at its mean"
)
SAMPLES = 4000


def notes(nocdyn, text):
    outcome = nocdyn("response", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    return [line for line in outcome.stdout.splitlines() if "note: " in line]


def equivalent(law, mean, amplitude):
    """The first harmonic of a law over its argument, as a slope."""
    angles = [2 * pi * (i + 0.5) / SAMPLES for i in range(SAMPLES)]
    return 2 * sum(law(mean + amplitude * cos(x)) * cos(x) for x in angles) / (SAMPLES * amplitude)


def gap(u):
    return 0 if abs(u) <= 0.05 else (abs(u) - 0.05) * (1 if u > 0 else -1)


def table(u):
    return u + 2 * max(0, abs(u) - 0.3) * (1 if u > 0 else -1)


SPRINGS = {  # keys, law, static torque of the brake
    "cubic": ("stiffness = 1 cubic_stiffness = 0.1", lambda u: u + 0.1 * u**3, 0),
    "gap": ("stiffness = 1 gap = 0.1", gap, 0.4),
    "table": ("table_twist = -2.3, -0.3, 0.3, 2.3 table_moment = -6.3, -0.3, 0.3, 6.3", table, 0),
}


@pytest.mark.parametrize("name", SPRINGS)
def test_the_change_of_stiffness_is_that_of_the_first_harmonic(nocdyn, name):
    keys, law, torque = SPRINGS[name]
    found = [NOTE.search(note) for note in notes(nocdyn, DUFFING.format(keys, 0.08, torque))]
    assert sum(map(bool, found)) == 1
    found = next(filter(None, found))
    motion = nocdyn.values(name="response_orders.csv")
    hub, mass = motion["phi_hub"], motion["phi_mass"]
    assert max(hub) < 1e-6 * max(mass)
    mean = torque + 0.05 if torque else 0
    slope = (law(mean + 1e-6) - law(mean - 1e-6)) / 2e-6
    change = max((equivalent(law, mean, amplitude) / slope - 1 for amplitude in mass), key=abs)
    assert float(found[2]) == pytest.approx(100 * abs(change), rel=0.02)
    assert found[3] == ("above" if change > 0 else "below")
    assert not any(map(NOTE.search, notes(nocdyn, DUFFING.format(keys, 1e-4, torque))))


def test_the_duffing_oscillator_at_resonance_is_told(nocdyn):
    """Its run settles at a half range of 1.539 N m, the linear response has 3.606 N m."""
    text = DUFFING.format("stiffness = 1 cubic_stiffness = 0.1", 0.18, 0)
    found = next(filter(None, map(NOTE.search, notes(nocdyn, text))))
    amplitude = max(nocdyn.values(name="response_orders.csv")["phi_mass"])
    assert float(found[2]) == pytest.approx(100 * 0.75 * 0.1 * amplitude**2, rel=0.02)
    assert nocdyn.values(name="response.csv")["half_range_total_moment_spring"][1] == pytest.approx(3.6056, rel=1e-3)


BRAKE = """\
&body name = 'a' inertia = 1 speed = 1 /
&body name = 'b' inertia = 1 speed = 1 /
&coupling name = 'spring' bodies = 'a', 'b' stiffness = 1 damping = 0.1 /
&load name = 'brake' body = 'b' constant = 0.5 constant_speed = 1 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 0.5 /
&excitation name = 'x' body = 'b' kind = 'orders' orders = 2 amplitudes = 2 /
&response body = 'a' speed = 0.9, 1 count = 2 /
&run t_end = 1 /
"""


def test_a_load_whose_speed_swings_beyond_its_law_is_told(nocdyn):
    """Smooth friction about a small speed: its slope there is not that over the swing."""
    (note,) = (n for n in notes(nocdyn, BRAKE) if "'brake'" in n)
    found = re.search(r"at (\S+) rpm its slope over the speed is on average (\S+) % (above|below)", note)
    speed = nocdyn.values(name="response.csv")["omega_a"]
    swing = nocdyn.values(name="response_orders.csv")["omega_amplitude_b"]
    changes = []
    for mean, amplitude in zip(speed, swing, strict=True):
        slope = 0.5 * (1 - tanh(mean) ** 2)
        changes.append(100 * (equivalent(lambda v: 0.5 * tanh(v), mean, amplitude) / slope - 1))
    assert any(float(found[2]) == pytest.approx(abs(change), rel=0.02) for change in changes)


SHAKEN = """\
&body name = 'c' inertia = 1 speed = 1 /
&coupling name = 'soft' bodies = 'a', 'c' stiffness = 1 damping = 0.1 /
&excitation name = 'y' body = 'c' kind = 'orders' orders = 50 amplitudes = 1e6 /
"""


@pytest.mark.parametrize("more", ["", SHAKEN])
def test_a_swing_is_compared_with_moments_that_are_not_written(nocdyn, more):
    text = BRAKE + more
    every = notes(nocdyn, text)
    assert any("'brake'" in note for note in every) == (more == "")
    assert notes(nocdyn, text.replace("&response", "&response signals = 'phi_a'")) == every


CLUTCH = """\
&body name = 'm' inertia = 1 speed = 100 /
&body name = 'g' inertia = 2 speed = 100 /
&body name = 'h' inertia = 2 speed = 100 /
&clutch name = 'dry' bodies = 'm', 'g' capacity = {!r} /
&coupling name = 'k' bodies = 'g', 'h' stiffness = 1e5 damping = 10 /
&motor name = 'd' body = 'm' a = 200 b = 1 c = 0 /
&load name = 'l' body = 'h' viscous = 0.3 /
&excitation name = 'o' body = 'm' kind = 'orders' orders = 1 amplitudes = 50 /
&response body = 'm' speed = 90, 300 count = 30 /
&run t_end = 1 /
"""


def test_a_clutch_that_would_slip_is_told_with_its_torque(nocdyn):
    assert not any("does not hold" in note for note in notes(nocdyn, CLUTCH.format(400.0)))
    peaks = nocdyn.values(name="response.csv")["peak_torque_dry"]
    (note,) = (n for n in notes(nocdyn, CLUTCH.format(200.0)) if "does not hold" in n)
    assert f"clutch 'dry' does not hold at {sum(p > 200 for p in peaks)} of {len(peaks)} speeds" in note
    assert float(re.search(r"up to (\S+) N m at", note)[1]) == pytest.approx(max(peaks), rel=1e-3)
    assert "rpm; allowed: -200 to 200 N m;" in note
    assert note in notes(nocdyn, CLUTCH.format(200.0).replace("&response", "&response signals = 'phi_m'"))
