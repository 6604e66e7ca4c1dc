"""Speeds in rpm, frequencies in Hz and angles in degrees: in inputs, results and reports."""

import csv
import math

import f90nml
import pytest
from sweep_inputs import SWEEP_PROGRAM, needs_sweeps

RPM, HZ, DEG = math.pi / 30, 2 * math.pi, math.pi / 180

# The same machine in units of the field and, by Python's conversion, in SI.
MACHINE = """\
&body       name = 'rotor' inertia = 1.0 {speed[0]} {angle} /
&body       name = 'fan'   inertia = 2.0 {speed[1]} /
&coupling   name = 'shaft' bodies = 'rotor', 'fan' stiffness = 1e4 damping = 2.0 {gap} {rest} /
&motor      name = 'mains' body = 'rotor' kind = 'induction' breakdown_torque = 100.0 breakdown_slip = 0.2 {synchronous} /
&load       name = 'air'   body = 'fan' {table} table_torque = 0, 20, 80 /
&excitation name = 'shaker' body = 'fan' amplitude = 5.0 {frequency} {phase} /
&excitation name = 'strokes' body = 'rotor' kind = 'orders' orders = 1, 2 amplitudes = 5.0, 3.0 {phases} /
&run        t_end = 0.1  method = 'rk853' /
&output     points = 11 /
"""
FIELD = {
    "speed": ("speed_rpm = 1000.0", "speed_rpm = 1000.0"),
    "angle": "angle_deg = 1.5",
    "gap": "gap_deg = 0.5",
    "rest": "rest_twist_deg = -1.0",
    "synchronous": "synchronous_speed_rpm = 1500.0",
    "table": "table_speed_rpm = 0, 1000, 2000",
    "frequency": "frequency_hz = 25.0",
    "phase": "phase_deg = 90.0",
    "phases": "phases_deg = 30.0, -45.0",
}
SI = {
    "speed": (f"speed = {1000 * RPM!r}", f"speed = {1000 * RPM!r}"),
    "angle": f"angle = {1.5 * DEG!r}",
    "gap": f"gap = {0.5 * DEG!r}",
    "rest": f"rest_twist = {-1.0 * DEG!r}",
    "synchronous": f"synchronous_speed = {1500 * RPM!r}",
    "table": f"table_speed = 0, {1000 * RPM!r}, {2000 * RPM!r}",
    "frequency": f"frequency = {25 * HZ!r}",
    "phase": f"phase = {90 * DEG!r}",
    "phases": f"phases = {30 * DEG!r}, {-45 * DEG!r}",
}
ROUNDING = 1e-14  # of one conversion there and back, relative


@pytest.fixture
def machine(nocdyn):
    return nocdyn.write("field.nml", MACHINE.format(**FIELD))


def trajectory(nocdyn, folder):
    return (nocdyn.folder / folder / "trajectory.csv").read_bytes()


def refusal(nocdyn, *words):
    outcome = nocdyn(*words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    return outcome.stderr.replace(str(nocdyn.folder) + "/", "")


def test_a_machine_in_units_of_the_field_moves_as_that_in_si_bit_by_bit(nocdyn, machine):
    si = nocdyn.write("si.nml", MACHINE.format(**SI))
    for file, folder in ((machine, "field"), (si, "si"), (nocdyn.folder / "field/input.nml", "again")):
        assert nocdyn("run", file, "--out", folder, "-q").stderr == ""
    assert trajectory(nocdyn, "field") == trajectory(nocdyn, "si") == trajectory(nocdyn, "again")
    inputs = [(nocdyn.folder / folder / "input.nml").read_bytes() for folder in ("field", "si", "again")]
    assert inputs[0] == inputs[1] == inputs[2]
    assert f90nml.read(nocdyn.folder / "field/input.nml")["motor"]["synchronous_speed"] == 1500 * RPM


def test_an_override_in_one_unit_replaces_the_other_of_the_file(nocdyn, machine):
    words = ("--set", "body.rotor.speed=50", "--set", "body.fan.speed_rpm=600", "--set", "excitation.shaker.frequency=3")
    assert nocdyn("run", machine, "--out", "out", "-q", *words).stderr == ""
    used = f90nml.read(nocdyn.folder / "out/input.nml")
    assert [body["speed"] for body in used["body"]] == [50, 600 * RPM]
    assert used["excitation"][0]["frequency"] == 3


def test_both_units_of_a_key_are_refused(nocdyn):
    file = nocdyn.write("both.nml", "&body name = 'a' inertia = 1.0\n  speed_rpm = 10.0\n  speed = 1.0 /\n&run t_end = 1.0 /\n")
    assert refusal(nocdyn, "check", file) == (
        "nocdyn: both.nml:3: &body 'a': speed_rpm on line 2 and speed on line 3 are both given; allowed: one of them\n"
    )


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("output.units=kW", "units(1) = kW is not known; allowed: 'rpm', 'Hz', 'deg'"),
        ("output.units='rpm','degree'", "units(2) = 'degree' is not known; allowed: 'rpm', 'Hz', 'deg'"),
        ("body.fan.speed_hz=10", "speed_hz is not a key of &body; did you mean 'speed_rpm'?"),
        ("coupling.shaft.gap_deg=-1", "gap_deg = -1 is out of range; allowed: >= 0 [deg]"),
    ],
)
def test_units_that_do_not_fit_are_refused(nocdyn, machine, override, message):
    assert refusal(nocdyn, "run", machine, "--out", "out", "--set", override) == f"nocdyn: --set {override}: {message}\n"


def test_columns_are_written_in_the_units_of_output(nocdyn, machine):
    nocdyn("run", machine, "--out", "si", "-q")
    outcome = nocdyn("run", machine, "--out", "field", "--set", "output.units='rpm','deg','Hz'")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    labels, rows = nocdyn.table("field")
    si_labels, si_rows = nocdyn.table("si")
    names = {"rad/s": "rpm", "rad": "deg"}
    factors = {"rad/s": RPM, "rad": DEG}
    units = [label[label.rindex("[") + 1 : -1] for label in si_labels]
    assert labels == [label.replace(f"[{unit}]", f"[{names.get(unit, unit)}]") for label, unit in zip(si_labels, units)]
    assert "omega_fan [rpm]" in labels
    assert "twist_shaft [deg]" in labels
    for row, si_row in zip(rows, si_rows, strict=True):
        assert row == pytest.approx([x / factors.get(unit, 1) for x, unit in zip(si_row, units)], rel=ROUNDING)
    columns, si_columns = (nocdyn.summary(folder)["columns"] for folder in ("field", "si"))
    assert columns["omega_fan [rpm]"]["max"] == pytest.approx(si_columns["omega_fan [rad/s]"]["max"] / RPM, rel=ROUNDING)
    assert columns["twist_shaft [deg]"]["min"] == pytest.approx(si_columns["twist_shaft [rad]"]["min"] / DEG, rel=ROUNDING)
    assert columns["moment_shaft [N m]"] == si_columns["moment_shaft [N m]"]
    assert "\nomega_fan [rpm] " in outcome.stdout
    assert "[rad" not in outcome.stdout


def test_speeds_are_written_in_hz_if_there_is_no_rpm(nocdyn, machine):
    nocdyn("run", machine, "--out", "out", "-q", "--set", "output.units=hz")
    labels, rows = nocdyn.table("out")
    assert rows[0][labels.index("omega_fan [Hz]")] == pytest.approx(1000 / 60, rel=ROUNDING)
    assert "phi_fan [rad]" in labels


def test_steady_states_and_modes_are_printed_in_the_units_of_output(nocdyn, machine):
    words = ("--set", "output.units='rpm','deg'")
    report = nocdyn("equilibrium", machine, "--out", "out", *words).stdout
    speeds = [float(line.split()[-1]) for line in report.splitlines() if line.startswith("  omega_")]
    assert 1400 < speeds[0] == speeds[1] < 1500
    assert "  twist_shaft [deg] " in report
    assert "omega_fan [rpm]" in (nocdyn.folder / "out/equilibrium.json").read_text()
    head, first, *_ = nocdyn("modes", machine, *words).stdout.split("\n", 1)[1].splitlines()
    assert head.startswith("  mode frequency [Hz]          [rpm]  undamped [Hz]")
    number, hz, rpm, *_ = first.split()
    assert (number, float(rpm)) == ("1", pytest.approx(60 * float(hz), rel=1e-6))
    assert "[rpm]" not in nocdyn("modes", machine).stdout


def test_the_twist_of_a_slipping_clutch_is_no_number_of_a_steady_state_in_degrees_either(nocdyn):
    file = nocdyn.write(
        "clutch.nml",
        "&body name = 'a' inertia = 1.0 /\n&body name = 'b' inertia = 1.0 /\n"
        "&coupling name = 'c' bodies = 'a', 'b' friction = 5.0 /\n"
        "&motor name = 'm' body = 'a' a = 20.0 b = 1.0 c = 0.0 /\n"
        "&load name = 'l' body = 'b' viscous = 1.0 /\n"
        "&run t_end = 1.0 /\n",
    )
    outcome = nocdyn("equilibrium", file, "--set", "output.units=deg")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "moment" in outcome.stdout or "damping_c" in outcome.stdout
    assert "twist_c" not in outcome.stdout


def test_check_prints_speeds_and_frequencies_in_rpm_and_hz(nocdyn, machine):
    lines = nocdyn("check", machine).stdout.splitlines()
    table = lines[lines.index("  speeds at the start, and those given        [rad/s]          [rpm]           [Hz]") + 1 :]
    cells = {" ".join(line.split()[:-3]): [float(cell) for cell in line.split()[-3:]] for line in table}
    assert cells == {
        "rotor": [104.7198, 1000, 16.66667],
        "fan": [104.7198, 1000, 16.66667],
        "mains synchronous_speed": [157.0796, 1500, 25],
        "air table_speed(3)": [209.4395, 2000, 33.33333],
        "shaker frequency": [157.0796, 1500, 25],
    }
    rest = nocdyn.write("rest.nml", "&body name = 'a' inertia = 1.0 /\n&run t_end = 1.0 /\n")
    assert "[rpm]" not in nocdyn("check", rest).stdout


SWEEP = """\
&sweep  design = 'random' samples = 4 seed = 2 /
&vary   target = 'motor.mains.synchronous_speed_rpm' low = 1000 high = 2000 /
&record quantity = 'omega_fan [rpm]' statistic = 'final', 'max', 'time_of_max' /
&record quantity = 'twist_shaft' statistic = 'min' /
&record trajectories = 3 /
"""
# With the first of these, variants are written into lanes; with the others, they are assembled.
DIRECT = """\
&vary   target = 'excitation.shaker.frequency_hz' distribution = 'lognormal' median = 25 log_deviation = 0.5 /
"""
ASSEMBLED = """\
&vary   target = 'body.rotor.angle_deg' distribution = 'normal' mean = 1.5 deviation = 0.1 /
&vary   target = 'excitation.strokes.phases_deg(2)' low = -90 high = 90 /
"""


@needs_sweeps
@pytest.mark.parametrize(
    ("others", "labels"),
    [
        (DIRECT, ["excitation.shaker.frequency_hz [Hz]"]),
        (ASSEMBLED, ["body.rotor.angle_deg [deg]", "excitation.strokes.phases_deg(2) [deg]"]),
    ],
)
def test_a_sweep_varies_and_records_in_units_of_the_field(nocdyn, others, labels):
    run, nocdyn.executable = nocdyn.executable, SWEEP_PROGRAM
    file = nocdyn.write("sweep.nml", MACHINE.format(**FIELD) + SWEEP + others)
    outcome = nocdyn("sweep", file, "--out", "out", "--csv", "-q", "--set", "output.units='deg'")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    with open(nocdyn.folder / "out/sweep.csv", newline="") as table:
        variants = list(csv.DictReader(table))
    labels = ["motor.mains.synchronous_speed_rpm [rpm]", *labels]
    assert list(variants[0])[1 : 1 + len(labels)] == labels
    assert all(1000 <= float(variant[labels[0]]) <= 2000 for variant in variants)
    nocdyn.executable = run
    for variant in variants:
        words = [f"{label.split()[0]}={variant[label]}" for label in labels]
        nocdyn("run", file, "--out", "one", "-q", *(word for pair in words for word in ("--set", pair)))
        columns = nocdyn.summary("one")["columns"]
        assert float(variant["omega_fan_final [rpm]"]) == columns["omega_fan [rad/s]"]["last"] / RPM
        assert float(variant["omega_fan_max [rpm]"]) == pytest.approx(columns["omega_fan [rad/s]"]["max"] / RPM, rel=1e-9)
        assert float(variant["twist_shaft_min [deg]"]) == pytest.approx(columns["twist_shaft [rad]"]["min"] / DEG, rel=1e-9)
        assert "omega_fan_time_of_max [s]" in variant
    assert "phi_fan [deg]" in nocdyn.table("out/variant-3")[0]
    nocdyn("run", nocdyn.folder / "out/variant-3/input.nml", "--out", "again", "-q")
    assert trajectory(nocdyn, "again") == trajectory(nocdyn, "out/variant-3")


@needs_sweeps
def test_a_list_of_variants_has_columns_in_units_of_the_field(nocdyn):
    nocdyn.executable = SWEEP_PROGRAM
    machine = MACHINE.format(**FIELD) + "&record quantity = 'omega_fan' statistic = 'final' /\n"
    file = nocdyn.write("list.nml", machine + "&sweep design = 'list' file = 'list.csv' /\n")
    nocdyn.write("list.csv", "body.fan.speed_rpm [rpm],body.rotor.speed_rpm\n990,1000\n980,1000\n")
    assert nocdyn("sweep", file, "--out", "out", "--csv", "-q").stderr == ""
    labels = (nocdyn.folder / "out/sweep.csv").read_text().split("\n", 1)[0].split(",")
    assert labels[1:3] == ["body.fan.speed_rpm [rpm]", "body.rotor.speed_rpm [rpm]"]
    nocdyn.write("list.csv", "body.fan.speed_rpm [rad/s]\n990\n980\n")
    number = len(file.read_text().splitlines())
    assert refusal(nocdyn, "sweep", file, "--out", "out") == (
        f"nocdyn: list.nml:{number}: &sweep: file: list.csv:1: column 1, 'body.fan.speed_rpm [rad/s]': another unit; "
        "needed: body.fan.speed_rpm [rpm]\n"
    )


@needs_sweeps
def test_an_override_in_another_unit_of_a_number_that_varies_is_refused(nocdyn):
    nocdyn.executable = SWEEP_PROGRAM
    file = nocdyn.write("sweep.nml", MACHINE.format(**FIELD) + SWEEP)
    assert "motor.mains.synchronous_speed=150: has no effect on a sweep: the &vary on line 11 gives this number its values" in (
        refusal(nocdyn, "sweep", file, "--out", "out", "--set", "motor.mains.synchronous_speed=150")
    )


@needs_sweeps
@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "&record quantity = 'omega_fan [deg]' statistic = 'max' /",
            "&record: quantity = 'omega_fan [deg]' is no column of trajectory.csv; did you mean 'omega_fan [rad/s]'?",
        ),
        (
            "&vary target = 'motor.mains.synchronous_speed_rmp' low = 1 high = 2 /",
            "&vary: target = 'motor.mains.synchronous_speed_rmp': synchronous_speed_rmp is not a key of &motor; "
            "did you mean 'synchronous_speed_rpm'?",
        ),
        (
            "&vary target = 'motor.mains.synchronous_speed' low = 1 high = 2 /",
            "&vary: target = 'motor.mains.synchronous_speed': varies already, as number 1; allowed: once",
        ),
    ],
)
def test_sweeps_refuse_units_that_do_not_fit(nocdyn, line, message):
    nocdyn.executable = SWEEP_PROGRAM
    file = nocdyn.write("sweep.nml", MACHINE.format(**FIELD) + SWEEP + line + "\n")
    number = len(file.read_text().splitlines())
    assert refusal(nocdyn, "sweep", file, "--out", "out") == f"nocdyn: sweep.nml:{number}: {message}\n"
