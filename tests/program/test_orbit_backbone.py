"""Nonlinear normal modes: closed forms, integrated motions, forced peaks; quasi-linear frequencies by describing functions."""

import json

import numpy as np
import pytest

STIFFNESS, CUBIC = 1.0, 0.1
DUFFING = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = {} /
&excitation name = 'shaker' body = 'mass' amplitude = {} frequency = 1.0 /
&run t_end = 10.0 /
"""
MODE = "&orbit mode = {} amplitude = {}, {} {} /\n"

# Two equal masses, each on a spring to the ground and with one between them; one of the springs hardens.
TWO_MASSES = """\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 1.0 /
&coupling name = 'ground_a' bodies = 'ground', 'a' stiffness = 1.0 cubic_stiffness = 0.5 damping = 0.01 /
&coupling name = 'between' bodies = 'a', 'b' stiffness = 1.0 damping = 0.01 /
&coupling name = 'ground_b' bodies = 'ground', 'b' stiffness = 1.0 /
&run t_end = 10.0 /
"""

# An engine and a generator with a mean torque of 150 N m in the coupling between them.
TRAIN = """\
&body name = 'engine' inertia = 4.0 speed_rpm = 600 /
&body name = 'generator' inertia = 2.0 /
&coupling name = 'rubber' bodies = 'engine', 'generator' stiffness = 1e4 cubic_stiffness = 5e6 damping = 3.0 /
&motor name = 'mean' body = 'engine' kind = 'constant' torque = 150.0 /
&load name = 'grid' body = 'generator' viscous = 2.0 /
&excitation name = 'firing' body = 'engine' kind = 'orders' orders = 1.0, 2.0 amplitudes = 40.0, 200.0 /
&run t_end = 20.0 /
"""


def backbone(nocdyn, text):
    outcome = nocdyn.done(text, command="orbit")
    return nocdyn.values("out", "orbit.csv"), json.loads((nocdyn.folder / "out/orbit.json").read_text()), outcome.stdout


def duffing_rate(amplitude):
    """The exact frequency of x'' + k x + k3 x^3 = 0 [rad/s]."""
    ellipk = pytest.importorskip("scipy.special").ellipk
    square = STIFFNESS + CUBIC * amplitude**2
    return np.pi * np.sqrt(square) / (2 * ellipk(0.5 * CUBIC * amplitude**2 / square))


def test_a_hardening_spring_has_the_exact_and_the_quasi_linear_frequency(nocdyn):
    values, report, printed = backbone(nocdyn, DUFFING.format(0.05, 0.18) + MODE.format(1, 0.001, 5.0, "tolerance = 1e-10"))
    amplitude = values["amplitude_phi_mass"]
    assert values["rate"] == pytest.approx(duffing_rate(amplitude), rel=1e-10)
    assert values["half_range_phi_mass"] == pytest.approx(amplitude, rel=1e-9)
    quasi_linear = np.sqrt(STIFFNESS + 0.75 * CUBIC * amplitude**2)
    assert values["quasi_linear_frequency"] * 2 * np.pi == pytest.approx(quasi_linear, rel=1e-9)
    assert report["backbone"]["largest_damping"] < 1e-12
    assert "mode 1: 0.159155 Hz at 0.001 rad, 0.267427 Hz at 5 rad (hardening)" in printed
    assert "left out of the conservative machine: damping, excitation 'shaker'" in printed


def test_the_second_mode_of_two_masses_returns_to_where_it_began(nocdyn):
    integrate = pytest.importorskip("scipy.integrate")

    def motion(t, y):
        a, b = y[:2]
        return [y[2], y[3], -a - 0.5 * a**3 - (a - b), -b - (b - a)]

    values, _, _ = backbone(nocdyn, TWO_MASSES + MODE.format(2, 0.01, 3.0, "tolerance = 1e-11"))
    for row in (0, 40, 80, -1):
        begin = [values["amplitude_phi_a"][row], -values["largest_phi_b"][row], 0.0, 0.0]
        period = 2 * np.pi / values["rate"][row]
        end = integrate.solve_ivp(motion, (0, period), begin, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        assert np.abs(end - begin).max() < 1e-8 * begin[0]


def test_a_mode_of_small_amplitude_is_the_linear_one(nocdyn):
    values, report, _ = backbone(nocdyn, TWO_MASSES + MODE.format(2, 1e-5, 2e-5, ""))
    nocdyn.done(TWO_MASSES, command="modes")
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    assert values["frequency"][0] == pytest.approx(modes[1]["undamped_frequency_Hz"], rel=1e-9)
    assert report["backbone"]["linear_frequency_hz"] == pytest.approx(np.sqrt(3.0) / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize("damping", [0.02, 0.005])
def test_the_forced_motion_of_least_damping_peaks_on_the_backbone(nocdyn, damping):
    over = "&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 /\n"
    values, _, _ = backbone(nocdyn, DUFFING.format(damping, 3 * damping) + over)
    peak = values["half_range_phi_mass"].argmax()
    exact = duffing_rate(values["half_range_phi_mass"][peak])
    assert values["rate"][peak] == pytest.approx(exact, abs=2 * damping**2)


def test_a_train_keeps_its_mean_torque(nocdyn):
    values, _, _ = backbone(nocdyn, TRAIN + MODE.format(1, 0.001, 0.05, ""))
    twist = values["half_range_twist_rubber"] * 1.0
    assert values["mean_moment_rubber"] == pytest.approx(-150.0, rel=1e-9)
    # The mean twist b and the quasi-linear stiffness with a twist b + a cos(w t); a belongs to one harmonic only.
    amplitude = values["amplitude_phi_generator"] * 1.5
    assert twist == pytest.approx(amplitude, rel=1e-3)
    for a, frequency in zip(amplitude, values["quasi_linear_frequency"], strict=True):
        roots = np.roots([5e6, 0.0, 1e4 + 1.5 * 5e6 * a**2, -150.0])
        b = float(roots[np.abs(roots.imag) < 1e-9][0].real)
        stiffness = 1e4 + 5e6 * (3 * b**2 + 0.75 * a**2)
        assert frequency == pytest.approx(np.sqrt(stiffness * (1 / 4.0 + 1 / 2.0)) / (2 * np.pi), rel=1e-9)


REFUSED = [
    (TWO_MASSES + MODE.format(3, 0.1, 1.0, ""), 1, "mode = 3 in &orbit: the conservative machine has 2 modes that oscillate"),
    (TWO_MASSES + MODE.format(1, 0.1, 0.1, ""), 2, "the two numbers are the same; required: a range"),
    (TWO_MASSES + MODE.format(1, 0.1, 1.0, "start = 'high'"), 2, "start"),
    (TWO_MASSES + "&orbit mode = 1 /\n", 2, "amplitude"),
    (
        TWO_MASSES.replace("damping = 0.01 /", "damping = 0.01 maxwell_stiffness = 1.0 maxwell_time = 1.0 /", 1)
        + MODE.format(1, 0.1, 1.0, ""),
        1,
        "a machine with internal states has no nonlinear normal modes: ",
    ),
]


@pytest.mark.parametrize(("text", "code", "message"), REFUSED)
def test_a_mode_that_is_not_there_is_refused(nocdyn, text, code, message):
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", text))
    assert outcome.returncode == code, outcome.stdout + outcome.stderr
    assert message in outcome.stderr


def test_an_energy_in_place_of_the_amplitude_gives_the_same_backbone(nocdyn):
    values, _, _ = backbone(nocdyn, DUFFING.format(0.05, 0.18) + MODE.format(1, 0.1, 3.0, "count = 3"))
    amplitude = values["amplitude_phi_mass"]
    expected = 0.5 * STIFFNESS * amplitude**2 + 0.25 * CUBIC * amplitude**4
    assert values["energy"] == pytest.approx(expected, rel=1e-10)
    over_energy = "&orbit mode = 1 energy = 0.01, 5.0 tolerance = 1e-10 /\n"
    values, _, printed = backbone(nocdyn, DUFFING.format(0.05, 0.18) + over_energy)
    amplitude = values["half_range_phi_mass"]
    assert values["energy"] == pytest.approx(0.5 * STIFFNESS * amplitude**2 + 0.25 * CUBIC * amplitude**4, rel=1e-9)
    assert values["rate"] == pytest.approx(duffing_rate(amplitude), rel=1e-9)
    assert "Hz at 0.01 J, " in printed


def test_the_energy_of_a_train_is_above_the_one_of_its_steady_twist(nocdyn):
    values, _, _ = backbone(nocdyn, TRAIN + MODE.format(1, 0.001, 0.05, ""))
    ends = [float(energy) for energy in values["energy"][[0, -1]]]
    over_energy, _, _ = backbone(nocdyn, TRAIN + f"&orbit mode = 1 energy = {ends[0]!r}, {ends[1]!r} /\n")
    assert over_energy["rate"][[0, -1]] == pytest.approx(values["rate"][[0, -1]], rel=1e-7)
    largest, half_range = values["largest_twist_rubber"], values["half_range_twist_rubber"]
    steady = np.roots([5e6, 0.0, 1e4, -150.0])
    steady = steady[np.abs(steady.imag) < 1e-9][0].real
    for twist in (largest, largest - 2 * half_range):  # both turning points
        above = 5e3 * (twist**2 - steady**2) + 1.25e6 * (twist**4 - steady**4) - 150.0 * (twist - steady)
        assert values["energy"] == pytest.approx(above, rel=1e-6)


def test_a_coupling_has_its_describing_function_along_a_forced_branch(nocdyn):
    over = "&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 harmonics = {} /\n"
    values, report, _ = backbone(nocdyn, DUFFING.format(0.05, 0.18) + over.format(1))
    (coupling,) = report["couplings"]
    twist = np.array(coupling["twist"])
    assert coupling["coupling"] == "spring"
    assert twist == pytest.approx(values["half_range_twist_spring"], rel=1e-9)
    assert coupling["equivalent_stiffness"] == pytest.approx(STIFFNESS + 0.75 * CUBIC * twist**2, rel=1e-9)
    assert coupling["equivalent_damping"] == pytest.approx(np.full(twist.size, 0.05), rel=1e-9)
    # With all harmonics: the balance of the first one, P = (k - w^2 J + i w c) u.
    values, report, _ = backbone(nocdyn, DUFFING.format(0.05, 0.18) + over.format(15))
    (coupling,) = report["couplings"]
    rate = values["rate"]
    impedance = np.array(coupling["equivalent_stiffness"]) - rate**2 + 1j * rate * np.array(coupling["equivalent_damping"])
    assert np.abs(impedance) * coupling["twist"] == pytest.approx(np.full(rate.size, 0.18), rel=1e-9)


def test_linear_couplings_have_no_describing_functions(nocdyn):
    over = "&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 /\n"
    linear = DUFFING.format(0.05, 0.18).replace("cubic_stiffness = 0.1", "")
    assert backbone(nocdyn, linear + over)[1]["couplings"] == []
