"""What `nocdyn orbit` says of its motions: limits, damage, jumps, chosen motions and their harmonics."""

import json
import re

import numpy as np
import pytest
from conftest import SOURCE
from test_orbit import DUFFING, OVER, TWO_MASSES, branch, refused, specials

FREQUENCY = "excitation.shaker.frequency"
SPRING = "&limit coupling = 'spring' {} /\n"
SOLVED = 1e-6  # of what linear interpolation in steps of a table would miss by far


def motion_files(nocdyn, report):
    return [nocdyn.values("out", one["file"]) for one in report["motions"]]


def rate_of(wave, period):
    """The derivative of samples of one period, without the last row, which is the first one again."""
    order = np.fft.fftfreq(len(wave), 1.0 / len(wave))
    return np.fft.ifft(np.fft.fft(wave) * 2j * np.pi * order / period).real


def test_chosen_motions_fulfil_the_equation_of_motion(nocdyn):
    _, report = branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "motions = 1.2"))
    assert [one["stable"] for one in report["motions"]] == [True, False, True]
    for entry, motion in zip(report["motions"], motion_files(nocdyn, report), strict=True):
        t, phi = motion["t [s]"], motion["phi_mass [rad]"]
        assert t[-1] == pytest.approx(2 * np.pi / 1.2, rel=1e-12)
        assert t[-1] == pytest.approx(entry["period"], rel=1e-12)
        assert phi[-1] == pytest.approx(phi[0], abs=1e-12)
        x, v = phi[:-1], motion["omega_mass [rad/s]"][:-1]
        assert rate_of(x, t[-1]) == pytest.approx(v, abs=1e-8)
        force = rate_of(v, t[-1]) + 0.05 * v + x + 0.1 * x**3
        assert force == pytest.approx(0.18 * np.sin(1.2 * t[:-1]), abs=1e-6)


def test_the_harmonics_of_a_motion_add_up_to_it(nocdyn):
    text = DUFFING + OVER.format(0.8, 1.6, "motions = 1.1, 1.3 spectrum = .true.")
    values, report = branch(nocdyn, text)
    harmonics = nocdyn.values("out", "motion_harmonics.csv")
    for number, motion in enumerate(motion_files(nocdyn, report), start=1):
        own = harmonics["motion"] == number
        t = motion["t [s]"]
        waves = np.cos(np.outer(t, harmonics["frequency [rad/s]"][own]) + np.radians(harmonics["phase_phi_mass [deg]"][own]))
        assert waves @ harmonics["amplitude_phi_mass [rad]"][own] == pytest.approx(motion["phi_mass [rad]"], abs=1e-9)
    spectrum = nocdyn.values("out", "orbit_harmonics.csv")
    first = spectrum["phi_mass [rad]"][spectrum["harmonic"] == 1]
    third = spectrum["phi_mass [rad]"][spectrum["harmonic"] == 3]
    assert len(first) == len(values["error"])
    assert (np.abs(first - values["half_range_phi_mass"]) <= 2 * third + 1e-9).all()


def test_motions_of_an_earlier_analysis_do_not_stay(nocdyn):
    branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "motions = 1.2 spectrum = .true."))
    assert (nocdyn.folder / "out/motion_3.csv").exists()
    branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "motions = 0.9"))
    left = {path.name for path in (nocdyn.folder / "out").iterdir()}
    assert "motion_1.csv" in left
    assert not left & {"motion_2.csv", "motion_3.csv", "orbit_harmonics.csv"}


def test_a_limit_is_exceeded_by_stable_motions_only_and_its_edge_is_solved(nocdyn):
    text = DUFFING + SPRING.format("vibratory_moment = 2.0 moment = 1.0e3") + OVER.format(0.8, 1.6, "motions = {}")
    _, report = branch(nocdyn, text.replace("motions = {}", ""))
    exceeded, kept = report["verdict"]["lines"]
    assert (exceeded["finding"], kept["finding"]) == ("exceeded", "kept")
    assert report["limits_exceeded"] is True
    low, high = exceeded["parameter_values"]
    assert high == pytest.approx(specials(report, "fold")[0], abs=1e-8)  # there the branch loses its stability
    assert exceeded["value"] > 2.0
    _, report = branch(nocdyn, text.replace("{}", repr(low)))
    moments = [one["total_moment_spring [N m]"] for one in motion_files(nocdyn, report)]
    assert np.ptp(moments[0]) / 2 == pytest.approx(2.0, rel=1e-3)  # of rows, which miss the extremes by little
    harmonics = nocdyn.values("out", "motion_harmonics.csv")
    tau = np.linspace(0, 2 * np.pi, 200001)
    wave = sum(
        a * np.cos(h * tau + np.radians(p))
        for h, a, p in zip(
            harmonics["harmonic"], harmonics["amplitude_total_moment_spring [N m]"], harmonics["phase_total_moment_spring [deg]"]
        )
        if h <= 40
    )
    assert np.ptp(wave) / 2 == pytest.approx(2.0, rel=SOLVED)


def test_strict_fails_on_a_limit_that_is_exceeded(nocdyn):
    text = DUFFING + SPRING.format("vibratory_moment = 2.0") + OVER.format(0.8, 1.6, "")
    name = nocdyn.write("machine.nml", text)
    assert nocdyn("orbit", name).returncode == 0
    outcome = nocdyn("orbit", name, "--strict")
    assert outcome.returncode == 1
    assert "1 line of the verdict is exceeded" in outcome.stderr
    assert "exceeded at" in outcome.stdout
    assert f"rad/s of {FREQUENCY}" in outcome.stdout


def test_without_limits_there_is_no_verdict(nocdyn):
    outcome = nocdyn.done(DUFFING + OVER.format(0.8, 1.0, ""), command="orbit")
    assert "verdict" not in outcome.stdout
    assert "verdict" not in json.loads((nocdyn.folder / "out/orbit.json").read_text())


def test_where_no_motion_is_stable_limits_are_not_assessed(nocdyn):
    text = TWO_MASSES + SPRING.format("moment = 1.0e3 heat = 5.0") + OVER.format(0.8, 1.4, "")
    _, report = branch(nocdyn, text)
    lines = report["verdict"]["lines"]
    (gap,) = [one for one in lines if one["criterion"] == "stable periodic motion"]
    assert gap["finding"] == "not assessed"
    assert gap["parameter_values"] == pytest.approx(specials(report, "neimark_sacker"), abs=1e-9)
    (heat,) = [one for one in lines if one["criterion"] == "heat"]
    assert heat["finding"] == "not assessed"
    assert "nocdyn response" in heat["assessment"]


def test_damage_per_hour_is_that_of_one_cycle_each_period(nocdyn):
    life = "&fatigue name = 'life' coupling = 'spring' reference_moment = 2.0 reference_cycles = 1.0e6 slope = 5.0 /\n"
    values, report = branch(nocdyn, DUFFING + life + OVER.format(0.8, 1.6, ""))
    cycles = 1e6 * (values["half_range_total_moment_spring"] / 2.0) ** -5.0
    expected = 3600.0 * values["rate"] / (2 * np.pi) / cycles
    assert values["damage_per_hour_life"] == pytest.approx(expected, rel=1e-8)
    (entry,) = report["fatigue"]
    stable = values["stable"] == 1
    assert entry["largest_damage_per_hour"] == pytest.approx(values["damage_per_hour_life"][stable].max(), rel=1e-12)


def test_a_jump_ends_on_the_other_stable_motion(nocdyn):
    text = DUFFING + OVER.format(0.8, 1.6, "signals = 'phi_*'")
    outcome = nocdyn.done(text, command="orbit")
    jumps = re.findall(r"fold; a (\w+) value jumps there, half range of phi_mass from ([\d.]+) to ([\d.]+) rad", outcome.stdout)
    assert [one[0] for one in jumps] == ["rising", "falling"]
    report = json.loads((nocdyn.folder / "out/orbit.json").read_text())
    for fold, (_, before, after) in zip(specials(report, "fold"), jumps, strict=True):
        values, _ = branch(nocdyn, DUFFING + OVER.format(fold, 1.6 if fold > 1.2 else 0.8, "start = 'low'"))
        found = values["half_range_phi_mass"][0]
        assert min(abs(found - float(one)) for one in (before, after)) < 1e-4 * found


def test_a_held_speed_is_told_in_the_unit_of_the_input(nocdyn):
    text = (SOURCE / "docs/tutorial/hardening.nml").read_text().replace("600, 1400", "900, 1100")
    text += "&limit coupling = 'rubber' vibratory_moment = 420.0 /\n"
    outcome = nocdyn.done(text.replace("&orbit ", "&orbit motion_speeds_rpm = 1000 "), command="orbit")
    assert re.search(r"exceeded at \d+ to \d+(\.\d+)? rpm", outcome.stdout)
    assert re.search(r"unstable from 106\.15\d+ rad/s \(1013\.\d+ rpm\) to 105\.8\d+ rad/s \(1010\.\d+ rpm\)", outcome.stdout)
    report = json.loads((nocdyn.folder / "out/orbit.json").read_text())
    (motion,) = report["motions"]
    (table,) = motion_files(nocdyn, report)
    turn = table["phi_engine [rad]"][-1] - table["phi_engine [rad]"][0]
    assert turn / table["t [s]"][-1] == pytest.approx(1000 * np.pi / 30, rel=1e-10)
    assert motion["value"] == pytest.approx(1000 * np.pi / 30, rel=1e-12)


SHAFT = """\
&body name = 'wheel' inertia = 2.0 /
&body name = 'rotor' inertia = 3.0 /
&coupling name = 'mount' bodies = 'ground', 'wheel' stiffness = 2.0e4 damping = 20.0 /
&shaft name = 'long' bodies = 'wheel', 'rotor' diameters = 0.05 lengths = 2.0 shear_modulus = 8.0e10 density = 7850.0
       nodes = 6 /
&excitation name = 'shaker' body = 'rotor' amplitude = 5.0 frequency = 60.0 /
&run t_end = 1.0 /
"""


def test_a_linear_machine_has_the_half_ranges_of_its_response(nocdyn):
    text = SHAFT + "&response frequency = 40.0, 80.0 count = 5 /\n"
    text += OVER.format(40.0, 80.0, "count = 5 tolerance = 1e-10 stability = .false.")
    values, _ = branch(nocdyn, text)
    nocdyn.done(text, command="response")
    expected = nocdyn.values("out", "response.csv")
    compared = 0
    for label in (one for one in values if one.startswith("half_range_") and one in expected and "power" not in one):
        for frequency, half_range in zip(expected["frequency"], expected[label], strict=True):
            rows = np.isclose(values[FREQUENCY], 2 * np.pi * frequency, rtol=1e-12)
            if rows.any():
                assert values[label][rows] == pytest.approx(half_range, rel=1e-6), label
                compared += 1
    assert compared >= 25  # five frequencies


def test_values_outside_of_the_range_are_refused(nocdyn):
    message = refused(nocdyn, DUFFING + OVER.format(0.8, 1.6, "motions = 1.2, 1.7"))
    assert "machine.nml:5: &orbit: motions(2) = 1.7 is outside of the range; allowed: 0.8 to 1.6" in message
    text = (SOURCE / "docs/tutorial/hardening.nml").read_text()
    message = refused(nocdyn, text.replace("&orbit ", "&orbit motion_speeds_rpm = 1500 "))
    assert "motion_speeds_rpm(1) = 1500 is outside of the speeds; allowed: 600 to 1400 [rpm]" in message
    message = refused(nocdyn, DUFFING + OVER.format(0.8, 1.6, "motion_speeds = 1.2"))
    assert "motion_speeds" in message and "body" in message
