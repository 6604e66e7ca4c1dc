"""Periodic motions by shooting: with gaps and friction, whose events are located, against independent integrations."""

import json

import numpy as np
import pytest
from conftest import Values

OVER = "&orbit over = 'excitation.shaker.frequency' range = {}, {} {} /\n"
DUFFING = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 0.8 /
&run t_end = 10.0 /
"""
FOLDS = (1.2696019555, 1.1157002518)

# A gear pair with play: x'' + 2 zeta x' + f(x) = F_m + F_ah w^2 sin w t, f = 0 for |x| < 1, else x -+ 1; zeta 0.05, F_m 0.1,
# F_ah 0.05: A. Kahraman, R. Singh, Non-linear dynamics of a spur gear pair, J. Sound Vib. 142 (1990), pages 49 to 75.
ZETA, MEAN, EXCITATION = 0.05, 0.1, 0.05
PLAY = """\
&body name = 'x' inertia = 1.0 angle = 1.1 /
&coupling name = 'mesh' bodies = 'ground', 'x' stiffness = 1.0 gap = 2.0 /
&load name = 'damper' body = 'x' viscous = {} /
&motor name = 'mean' body = 'x' kind = 'constant' torque = {} /
&excitation name = 'shaker' body = 'x' amplitude = {!r} frequency = {!r} /
&run t_end = 10.0 /
"""
ASKED = 1e-6  # of the half range, and of multipliers

BRAKE = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 /
&clutch name = 'brake' bodies = 'mass', 'ground' capacity = {!r} /
&excitation name = 'shaker' body = 'mass' amplitude = 1.0 frequency = 0.5 /
&run t_end = 10.0 /
"""


def branch(nocdyn, text):
    """The columns of orbit.csv, the report and what is printed."""
    outcome = nocdyn.done(text, command="orbit")
    report = json.loads((nocdyn.folder / "out/orbit.json").read_text())
    return nocdyn.values("out", "orbit.csv"), report, outcome.stdout


def at(values, parameter, value):
    """The rows at a value of the parameter."""
    rows = np.abs(values[parameter] - value) < 1e-12
    return Values({label: column[rows] for label, column in values.items()})


def life(label):
    return f"&fatigue name = 'life' coupling = 'spring' reference_moment = {label} reference_cycles = 1.0e6 slope = 5.0 /\n"


def specials(report, kind):
    return [point["value"] for point in report["special_points"] if point["kind"] == kind]


def in_order(multipliers):
    return np.array(sorted(multipliers, key=lambda value: (round(value.real, 5), value.imag)))


def multipliers(values, row):
    count = sum(label.startswith("multiplier") for label in values) // 2
    found = [values[f"multiplier_{i}_real"][row] + 1j * values[f"multiplier_{i}_imaginary"][row] for i in range(1, count + 1)]
    return in_order(found)


def test_a_smooth_machine_has_the_same_branch_by_both_methods(nocdyn):
    by_shooting, report, printed = branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "count = 5 method = 'shooting'"))
    assert "by shooting" in printed
    assert specials(report, "fold") == pytest.approx(FOLDS, abs=1e-8)
    by_harmonics, _, _ = branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "count = 5 tolerance = 1e-10"))
    for frequency in (0.8, 1.0, 1.2, 1.4):
        one, other = (at(values, "excitation.shaker.frequency", frequency) for values in (by_shooting, by_harmonics))
        for label in ("half_range_phi_mass", "largest_total_moment_spring"):
            assert one[label] == pytest.approx(other[label], rel=1e-9)
        for row in range(len(one["stable"])):
            assert multipliers(one, row) == pytest.approx(multipliers(other, row), abs=ASKED)


def play_over(t_end, start, amplitude, rate):
    """The end of a motion with play, and its least and largest x, integrated from edge to edge."""
    integrate = pytest.importorskip("scipy.integrate")
    t, y, least, largest = 0.0, np.array(start), np.inf, -np.inf
    while t < t_end:
        x = y[0] + 1e-9 * np.sign(y[1])
        edge = np.sign(x) if abs(x) > 1.0 else 0.0

        def rates(t, y, edge=edge):
            force = y[0] - edge if edge else 0.0
            return [y[1], MEAN + amplitude * np.sin(rate * t) - 2 * ZETA * y[1] - force]

        def leaves(t, y, edge=edge):
            return 1.0 - abs(y[0]) if not edge else edge * y[0] - 1.0

        def turns(t, y):
            return y[1]

        leaves.terminal, leaves.direction = True, -1
        motion = integrate.solve_ivp(rates, (t, t_end), y, method="DOP853", rtol=1e-12, atol=1e-13, events=(leaves, turns))
        places = np.concatenate([motion.y[0], [p[0] for p in motion.y_events[1]]])
        least, largest = min(least, places.min()), max(largest, places.max())
        t, y = motion.t[-1], motion.y[:, -1]
    return y, least, largest


def monodromy(start, period, amplitude, rate):
    """Derivatives of the end of a period by its begin, by central differences."""
    matrix = np.empty((2, 2))
    for i in range(2):
        step = 1e-5 * np.eye(2)[i]
        ends = [play_over(period, start + sign * step, amplitude, rate)[0] for sign in (-1, 1)]
        matrix[:, i] = (ends[1] - ends[0]) / 2e-5
    return matrix


def settled_play(start, period, amplitude, rate):
    """Half range and multipliers of the periodic motion on which one with play settles, at last by Newton's method."""
    start = play_over(40 * period, start, amplitude, rate)[0]
    for _ in range(6):
        end, least, largest = play_over(period, start, amplitude, rate)
        matrix = monodromy(start, period, amplitude, rate)
        change = np.linalg.solve(matrix - np.eye(2), start - end)
        start = start + change
        if np.abs(change).max() < 1e-10:
            break
    return start, 0.5 * (largest - least), in_order(np.linalg.eigvals(matrix))


def test_both_methods_find_the_same_harmonics_and_damage(nocdyn):
    text = DUFFING + life(2.0) + OVER.format(0.8, 1.2, "count = 5 motions = 1.0 spectrum = .true. {}")
    found = []
    for method in ("harmonic_balance", "shooting"):
        values, _, printed = branch(nocdyn, text.format(f"method = '{method}'"))
        assert "left out" not in printed
        chosen = at(values, "excitation.shaker.frequency", 1.0)
        motion, harmonics = (nocdyn.values("out", file) for file in ("motion_1.csv", "motion_harmonics.csv"))
        own = harmonics["harmonic"] <= 10
        found.append((chosen["damage_per_hour_life"][0], harmonics["amplitude_phi_mass [rad]"][own], motion))
    (damage, amplitudes, motion), (other_damage, other_amplitudes, other) = found
    assert other_damage == pytest.approx(damage, rel=2e-4)  # the highest of samples
    assert other_amplitudes == pytest.approx(amplitudes, abs=1e-8)
    phi = np.interp(motion["t [s]"], other["t [s]"], other["phi_mass [rad]"])
    assert phi == pytest.approx(motion["phi_mass [rad]"], abs=1e-5)


def test_motions_that_stick_have_harmonics_and_damage(nocdyn):
    text = BRAKE.format(0.8) + life(1.0) + OVER.format(0.2, 0.4, "count = 3 motions = 0.3 spectrum = .true.")
    values, report, _ = branch(nocdyn, text)
    motion, harmonics = (nocdyn.values("out", file) for file in ("motion_1.csv", "motion_harmonics.csv"))
    sticks = np.abs(motion["omega_mass [rad/s]"]) < 1e-12
    assert 0.1 < sticks.mean() < 0.9
    t = motion["t [s]"]
    force = np.where(sticks, np.nan, np.gradient(motion["omega_mass [rad/s]"], t, edge_order=2))
    expected = np.sin(0.3 * t) - motion["phi_mass [rad]"] - 0.8 * np.sign(motion["omega_mass [rad/s]"])
    inside = np.convolve(sticks, np.ones(5), "same") == 0  # no change of the branch beside it
    assert force[inside] == pytest.approx(expected[inside], abs=1e-4)
    (first,) = harmonics["amplitude_phi_mass [rad]"][harmonics["harmonic"] == 1]
    wave = 2 * np.mean(motion["phi_mass [rad]"][:-1] * np.exp(-0.3j * t[:-1]))
    assert first == pytest.approx(abs(wave), rel=1e-9)
    cycles = 1e6 * values["half_range_moment_spring"] ** -5.0
    assert values["damage_per_hour_life"] == pytest.approx(3600.0 * values["rate"] / (2 * np.pi) / cycles, rel=1e-3)
    assert report["fatigue"][0]["largest_damage_per_hour"] > 0


@pytest.mark.parametrize("rate", [0.9, 1.1])
def test_play_between_wheels_has_the_motion_and_the_multipliers_of_an_integration(nocdyn, rate):
    amplitude = EXCITATION * rate**2
    text = PLAY.format(2 * ZETA, MEAN, amplitude, rate)
    text += f"&orbit over = 'excitation.shaker.amplitude' range = {amplitude!r}, {1.01 * amplitude!r} start = 'settled_run' /\n"
    values, _, _ = branch(nocdyn, text)
    _, half_range, expected = settled_play((1.1, 0.0), 2 * np.pi / rate, amplitude, rate)
    assert values["half_range_phi_x"][0] == pytest.approx(half_range, rel=ASKED)
    assert multipliers(values, 0) == pytest.approx(expected, abs=ASKED)


def test_play_softens_and_jumps_and_the_report_says_which_method_found_it(nocdyn):
    values, report, printed = branch(nocdyn, PLAY.format(2 * ZETA, MEAN, 0.05, 0.4) + OVER.format(0.4, 1.3, ""))
    assert "note: method = shooting, as motions cross the edge of the gap of coupling 'mesh'" in printed
    up, down = specials(report, "fold")
    assert down < up < 1.0  # contact alone has its resonance at 1 rad/s
    assert (values["harmonics"] == 0).all()
    assert report["largest_error"] < 1e-8


def test_a_motion_with_play_of_twice_the_period_is_that_of_an_integration(nocdyn):
    rate = 1.7
    amplitude = EXCITATION * rate**2
    text = PLAY.format(2 * ZETA, MEAN, amplitude, rate).replace("angle = 1.1", "angle = 1.1 speed = 0.3")
    text += "&output interval = 0.02 /\n"
    nocdyn.done(text.replace("t_end = 10.0", f"t_end = {200 * np.pi / rate!r} rtol = 1e-9 atol = 1e-11"))
    (nocdyn.folder / "out/trajectory.csv").rename(nocdyn.folder / "motion.csv")
    text += f"&orbit over = 'excitation.shaker.amplitude' range = {amplitude!r}, {1.01 * amplitude!r} subharmonic = 2"
    values, _, _ = branch(nocdyn, text + " method = 'shooting' start = 'motion.csv' /\n")
    start, half_range, expected = settled_play((1.1, 0.3), 4 * np.pi / rate, amplitude, rate)
    assert np.abs(play_over(2 * np.pi / rate, start, amplitude, rate)[0] - start).max() > 0.01  # not of one period
    assert values["half_range_phi_x"][0] == pytest.approx(half_range, rel=ASKED)
    assert multipliers(values, 0) == pytest.approx(expected, abs=ASKED)


def den_hartog(friction, ratio):
    """The largest deflection of a mass with dry friction and no stops, for a static one of 1: J. P. Den Hartog, Forced Vibrations
    with Combined Coulomb and Viscous Friction, Trans. ASME 53 (1931), pages 107 to 115."""
    gain = 1.0 / (1.0 - ratio**2)
    drag = np.sin(np.pi / ratio) / (ratio * (1.0 + np.cos(np.pi / ratio)))
    return np.sqrt(gain**2 - (friction * drag) ** 2)


@pytest.mark.parametrize("ratio", [0.6, 0.7, 0.8])
def test_dry_friction_has_the_amplitude_of_den_hartog(nocdyn, ratio):
    friction = 0.2
    values, _, _ = branch(nocdyn, BRAKE.format(friction) + OVER.format(0.55, 0.85, "count = 7"))
    rows = at(values, "excitation.shaker.frequency", ratio)
    assert rows["half_range_phi_mass"] == pytest.approx(den_hartog(friction, ratio), rel=1e-9)


def test_a_brake_that_sticks_has_the_motion_of_a_settled_run(nocdyn):
    text = BRAKE.format(0.8)  # it sticks twice a period
    values, _, _ = branch(nocdyn, text + OVER.format(0.5, 0.55, ""))
    assert abs(multipliers(values, 0)).min() < 1e-9  # what was before a stop is forgotten
    period = 4 * np.pi
    run = text.replace("t_end = 10.0", f"t_end = {20 * period!r} rtol = 1e-11 atol = 1e-13")
    nocdyn.done(run + f"&output interval = {period / 2000!r} /\n")
    phi = nocdyn.values("out", "trajectory.csv")["phi_mass"][-2001:]
    assert values["half_range_phi_mass"][0] == pytest.approx(0.5 * (phi.max() - phi.min()), rel=1e-6)


REFUSED = [
    (BRAKE.format(0.8) + OVER.format(0.5, 0.55, "method = 'harmonic_balance'"), "does not know which joints are locked"),
    (
        BRAKE.format(0.8) + "&drive name = 'd' body = 'mass' speed = 1.0 /\n" + OVER.format(0.5, 0.55, ""),
        "takes no prescribed motions",
    ),
]


@pytest.mark.parametrize(("text", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_neither_method_follows_is_refused(nocdyn, text, message):
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", text))
    assert outcome.returncode == 2, outcome.stdout + outcome.stderr
    assert message in outcome.stderr


# Newton's method converges from the steady state to a motion that the integration does not confirm.
FALSE_START = """\
&body name = 'b0' inertia = 2.086 /
&body name = 'b1' inertia = 0.5757 /
&body name = 'b2' inertia = 1.936 /
&coupling name = 'c0' bodies = 'ground', 'b0' table_twist = -0.0722, -0.0361, 0.0361, 0.0722
          table_moment = -96.0, -27.4, 27.4, 82.3 damping = 0.83 /
&coupling name = 'c1' bodies = 'b0', 'b1' stiffness = 820.7 cubic_stiffness = 1659.0 damping = 0.86 /
&coupling name = 'c2' bodies = 'b1', 'b2' stiffness = 2157.0 cubic_stiffness = 1342.0 damping = 1.39 /
&motor name = 'm' body = 'b0' kind = 'constant' torque = 39.31 /
&excitation name = 'e' body = 'b0' amplitude = 46.77 frequency = 10.83 /
&run t_end = 1.0 /
&orbit over = 'excitation.e.amplitude' range = 46.77, 47.7 method = 'shooting' {} /
"""


def test_a_first_motion_that_is_none_is_replaced_by_the_settled_one(nocdyn):
    values, _, printed = branch(nocdyn, FALSE_START.format(""))
    assert "the first motion is the one on which a run settles" in printed
    settled, _, _ = branch(nocdyn, FALSE_START.format("start = 'settled_run'"))
    assert values["half_range_phi_b2"][0] == pytest.approx(settled["half_range_phi_b2"][0], rel=1e-9)
    assert values["error"].max() < 1e-9
