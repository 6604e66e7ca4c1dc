"""Synchronous motors during their asynchronous start."""

import numpy as np
import pytest

TRAIN = """&body name = 'motor' inertia = 3 /
&body name = 'compressor' inertia = 2 /
&coupling name = 'coupling' bodies = 'motor', 'compressor' stiffness = 6.0e4 damping = 5.0 /
&motor name = 'start' body = 'motor' {motor} /
&load name = 'gas' body = 'compressor' quadratic = 5e-4 /
{rest}
&response body = 'motor' speed_rpm = 200, 1400 /
&run t_end = 20 {run} /
&output interval = 0.005 /
"""
AXES = """kind = 'synchronous' frequency_hz = 50 poles = 4
       slips = 0, 0.05, 0.5, 1 d_torques = 0, 90, 70, 60 q_torques = 0, 70, 40, 30"""
PARTS = """kind = 'synchronous' frequency_hz = 50 poles = 4
       slips = 0, 0.05, 0.5, 1 mean_torques = 0, 80, 55, 45 pulsations = 0, 10, 15, 15"""
PRECISE = "rtol = 1e-9 atol = 1e-10"


def run(nocdyn, motor, *settings, rest="", precision=PRECISE, command="run"):
    (nocdyn.folder / "machine.nml").write_text(TRAIN.format(motor=motor, rest=rest, run=precision))
    words = [word for s in settings for word in ("--set", s)]
    files = ("--out", "out") if command in ("run", "response") else ()
    outcome = nocdyn(command, "machine.nml", *files, *words)
    assert outcome.returncode == 0, outcome.stderr
    return outcome


def test_torques_of_both_axes_are_a_mean_and_a_pulsation(nocdyn):
    run(nocdyn, AXES, precision="")
    by_axes = nocdyn.values()
    run(nocdyn, PARTS, precision="")
    by_parts = nocdyn.values()
    for key, values in by_axes.items():
        assert np.abs(values - by_parts[key]).max() <= 1e-9 * max(1, np.abs(values).max())


def test_a_constant_pulsation_is_that_of_the_excitation(nocdyn):
    motor = PARTS.replace("pulsations = 0, 10, 15, 15", "pulsations = 12, 12, 12, 12 phase = 0.5")
    run(nocdyn, motor, "run.t_end=8")
    pulsating = nocdyn.values()
    table = "kind = 'table' table_speed_rpm = 0, 750, 1425, 1500 table_torque = 45, 55, 80, 0"
    excitation = (
        "&excitation name = 'beat' body = 'motor' kind = 'startup' amplitude = 12 frequency_hz = 50 pole_pairs = 2 phase = 0.5 /"
    )
    run(nocdyn, table, "run.t_end=8", rest=excitation)
    separate = nocdyn.values()
    for key in ("omega_motor", "moment_coupling"):
        assert np.abs(pulsating[key] - separate[key]).max() < 1e-4 * np.abs(separate[key]).max()


def test_a_start_passes_its_resonance_at_twice_the_slip_frequency(nocdyn):
    run(nocdyn, AXES)
    table = nocdyn.values()
    modes = run(nocdyn, AXES, command="modes").stdout
    frequency = next(float(line.split()[1]) for line in modes.splitlines() if line.split()[:1] == ["1"])
    critical = 1500 * (1 - frequency / 100)
    at = np.argmax(np.abs(table["moment_coupling"]))
    assert table["omega_motor"][at] * 30 / np.pi == pytest.approx(critical, rel=0.05)
    assert np.abs(table["energy_residual"]).max() < 1e-3
    text = run(nocdyn, AXES, command="response").stdout
    found = next(float(line.split()[3]) for line in text.splitlines() if line.split()[:1] == ["1"])
    assert found == pytest.approx(critical, rel=1e-3)


def test_the_steady_state_has_the_mean_torque(nocdyn):
    text = run(nocdyn, AXES, command="equilibrium").stdout
    values = {line.split()[0]: float(line.split()[-1]) for line in text.splitlines() if "[" in line and "[W]" not in line}
    slip = 1 - values["omega_motor"] / (50 * np.pi)
    assert values["torque_start"] == pytest.approx(80 * slip / 0.05, rel=1e-4)
    assert values["torque_start"] == pytest.approx(5e-4 * values["omega_motor"] ** 2, rel=1e-6)


def test_a_reversed_field_gives_the_mirror_image(nocdyn):
    run(nocdyn, AXES, precision="")
    forwards = nocdyn.values()
    run(nocdyn, AXES + " reversed = .true.", precision="")
    assert np.abs(forwards["omega_motor"] + nocdyn.values()["omega_motor"]).max() < 1e-5


@pytest.mark.parametrize("last", ["q_torque", "pulsation"])
def test_tables_may_be_in_a_file(nocdyn, last):
    first = {"q_torque": "d_torque", "pulsation": "mean_torque"}[last]
    rows = {"q_torque": [(0, 0), (90, 70), (70, 40), (60, 30)], "pulsation": [(0, 0), (80, 10), (55, 15), (45, 15)]}[last]
    lines = [f"slip, {first}, {last}", *(f"{slip}, {a}, {b}" for slip, (a, b) in zip((0, 0.05, 0.5, 1), rows, strict=True))]
    (nocdyn.folder / "start.csv").write_text("\n".join(lines) + "\n")
    run(nocdyn, "kind = 'synchronous' frequency_hz = 50 poles = 4 table_file = 'start.csv'", precision="")
    from_file = nocdyn.values()
    run(nocdyn, AXES if last == "q_torque" else PARTS, precision="")
    assert np.abs(from_file["omega_motor"] - nocdyn.values()["omega_motor"]).max() == 0


BOTH = "allowed over the slips: d_torques and q_torques, or mean_torques and pulsations"


@pytest.mark.parametrize(
    "keys, complaint",
    [
        ("slips = 0, 1 d_torques = 0, 1", BOTH),
        ("slips = 0, 1 mean_torques = 0, 1", BOTH),
        ("slips = 0, 1", BOTH),
        ("slips = 0, 1 d_torques = 0, 1 pulsations = 0, 1", "d_torques and pulsations are both given; allowed: one of them"),
        ("slips = 1, 0 d_torques = 0, 1 q_torques = 0, 1", "slips(2) = 0 must be greater than slips(1) = 1"),
        ("slips = 0, 1 d_torques = 0 q_torques = 0, 1", "d_torques has 1 value"),
        ("", "slips or table_file is missing; one of them is needed"),
        ("slips = 0, 1 d_torques = 0, 1 q_torques = 0, 1 table_file = 'a.csv'", "slips and table_file are both given"),
    ],
)
def test_tables_that_are_not_complete_are_refused(nocdyn, keys, complaint):
    motor = f"kind = 'synchronous' frequency_hz = 50 poles = 4 {keys}"
    (nocdyn.folder / "machine.nml").write_text(TRAIN.format(motor=motor, rest="", run=""))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert f"machine.nml:4: &motor 'start': {complaint}" in outcome.stderr


@pytest.mark.parametrize(
    "poles, complaint", [("poles = 5", "poles = 5; allowed: an even number"), ("", "frequency_hz needs poles")]
)
def test_poles_are_needed_and_even(nocdyn, poles, complaint):
    (nocdyn.folder / "machine.nml").write_text(TRAIN.format(motor=AXES.replace("poles = 4", poles), rest="", run=""))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert f"&motor 'start': {complaint}" in outcome.stderr


def test_a_file_of_one_curve_is_refused(nocdyn):
    (nocdyn.folder / "start.csv").write_text("slip, d_torque\n0, 0\n1, 60\n")
    motor = "kind = 'synchronous' frequency_hz = 50 poles = 4 table_file = 'start.csv'"
    (nocdyn.folder / "machine.nml").write_text(TRAIN.format(motor=motor, rest="", run=""))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == f"nocdyn: machine.nml:4: &motor 'start': {BOTH}\n"
