"""Numbers beyond what can be computed with: refused, or a failure that says where; never a success."""

import random

import pytest
from conftest import CASE_2, SOURCE, SPINNER, TRAPS_EXCEPTIONS
from sweep_inputs import needs_sweeps

FAN = SOURCE / "input/examples/fan_start/fan_start.nml"
SPLIT = SOURCE / "input/examples/torque_split/torque_split.nml"
BEYOND = "is out of range; allowed:"
LARGEST = "at most 1e50 in size"
SMALLEST = "at least 1e-50 in size"

only_without_traps = pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build traps the overflow")


@pytest.mark.parametrize(
    ("command", "file", "override", "complaint"),
    [
        ("equilibrium", FAN, "coupling.tyre.damping=1.7e308", f"damping = 1.7e308 {BEYOND} >= 0 [N m s/rad], {LARGEST}"),
        ("equilibrium", CASE_2, "motor.drive.c=-1.7e308", f"c = -1.7e308 {BEYOND} any value [N m s2/rad2], {LARGEST}"),
        ("run", SPLIT, "body.pinion.inertia=1.7e308", f"inertia = 1.7e308 {BEYOND} >= 0 [kg m2], {LARGEST}"),
        ("run", CASE_2, "run.t_end=1.7e308", f"t_end = 1.7e308 {BEYOND} any value [s], {LARGEST}"),
        ("check", CASE_2, "coupling.coupling.gap=1e200", f"gap = 1e200 {BEYOND} >= 0 [rad], {LARGEST}"),
        ("check", CASE_2, "coupling.coupling.gap=1e-200", f"gap = 1e-200 {BEYOND} >= 0 [rad], {SMALLEST} unless 0"),
        ("check", CASE_2, "body.motor.inertia=1e-310", f"inertia = 1e-310 {BEYOND} >= 0 [kg m2], {SMALLEST} unless 0"),
    ],
)
def test_numbers_beyond_the_range_are_refused(nocdyn, command, file, override, complaint):
    outcome = nocdyn(command, file, "--set", override)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"nocdyn: --set {override}: {complaint}\n"
    assert list(nocdyn.folder.iterdir()) == []


def test_numbers_of_a_table_file_have_the_same_range(nocdyn):
    nocdyn.write("moment.csv", "0 1e300\n1e-300 1\n")
    nocdyn.write("m.nml", SPINNER + "&motor name = 'm' body = 'disc' kind = 'table' table_file = 'moment.csv' /\n")
    outcome = nocdyn("check", "m.nml")
    assert outcome.returncode == 2
    assert f"moment.csv:1: column 2, '1e300', {BEYOND} {LARGEST}\n" in outcome.stderr
    assert f"moment.csv:2: column 1, '1e-300', {BEYOND} {SMALLEST} unless 0\n" in outcome.stderr


@pytest.mark.parametrize("value", ["1e50", "1e-50"])
def test_the_ends_of_the_range_are_allowed(nocdyn, value):
    for key in ("body.motor.inertia", "coupling.coupling.gap", "coupling.coupling.stiffness", "load.work.viscous"):
        assert nocdyn("check", CASE_2, "--set", f"{key}={value}").returncode == 0


def test_a_gap_whose_power_leaves_all_numbers_is_refused(nocdyn):
    nocdyn.write(
        "gap.nml",
        "&body name = 'a' inertia = 1.0 /\n"
        "&coupling name = 'c' bodies = 'ground', 'a' gap = 1e-50 polynomial = 0, 0, 0, 0, 0, 0, 10 /\n"
        "&run t_end = 1.0 /\n&output points = 2 /\n",
    )
    outcome = nocdyn("check", "gap.nml")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: gap.nml:2: &coupling 'c': gap = 1e-50 gives its edges a stiffness of about 1e-299 N m/rad; "
        "allowed: with cubic_stiffness or polynomial, one from 1e-200 to 1e200\n"
    )


def test_a_last_row_within_rounding_of_the_end_is_at_the_end(nocdyn, spinner):
    # 9 intervals end 27 s after the start, which rounding makes the end; no method has steps so short
    times = ["--set", "run.t_start=1e16", "--set", "run.t_end=10000000000000028", "--set", "output.interval=3"]
    outcome = nocdyn("run", spinner, "--out", "out", *times)
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert "the step size became too small at t = 1e+16 s" in outcome.stderr


# The energy of the shaft, 1e350 J, is infinite, and nothing that the motion depends on.
STORED = """\
&body name = 'disc' inertia = 1e50 angle = 1e50 /
&coupling name = 'shaft' bodies = 'ground', 'disc' polynomial = 0, 0, 0, 0, 1e50 /
&run t_end = 1e-300 /
&output points = 2 /
"""


@only_without_traps
def test_a_row_that_is_not_finite_fails_the_run(nocdyn):
    nocdyn.write("stored.nml", STORED)
    outcome = nocdyn("run", "stored.nml", "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert outcome.stderr.startswith("nocdyn: stored.nml: elastic_energy [J] is not a finite number at t = 0 s")
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "trajectory.partial.csv"]
    assert nocdyn.summary("out")["status"] == "failed"
    assert nocdyn.table("out", "trajectory.partial.csv")[1] == []


@only_without_traps
@pytest.mark.parametrize(
    ("command", "complaint"),
    [
        (
            ["matrices"],
            "K12 * rest twist of the couplings, a further term of Q [N m], transposed has an element that is not a finite number",
        ),
        (["modes", "--at", "rest"], "the moment, stiffness or damping of 'shaft' in this state is not a finite number"),
    ],
)
def test_an_analysis_of_numbers_that_are_not_finite_fails(nocdyn, command, complaint):
    nocdyn.write("stiff.nml", STORED.replace("1e50 /\n&run", "0, 0, 0, 1e50 /\n&run"))
    outcome = (
        nocdyn(command[0], "stiff.nml", *command[1:], "--out", "out") if len(command) > 1 else nocdyn(command[0], "stiff.nml")
    )
    assert outcome.returncode == 1
    assert outcome.stderr == f"nocdyn: stiff.nml: {complaint}\n"


SWEEP = """\
&sweep design = 'list' file = 'variants.csv' /
&record quantity = 'omega_disc' statistic = 'final' /
"""


@needs_sweeps
def test_variants_beyond_the_range_are_refused_and_the_others_computed(nocdyn):
    gap = SPINNER + "&coupling name = 'c' bodies = 'ground', 'disc' gap = 1.0 cubic_stiffness = 10 /\n"
    nocdyn.write("m.nml", gap + SWEEP)
    nocdyn.write("variants.csv", "coupling.c.gap,body.disc.inertia\n1,1\n1e-200,1\n1,1e300\n1,1e-60\n1e-50,1\n2,2\n")
    outcome = nocdyn("sweep", "m.nml", "--out", "out", "--csv", "-q")
    assert outcome.returncode in (0, 1), outcome.stderr
    header, *rows = (nocdyn.folder / "out/sweep.csv").read_text().splitlines()
    reasons = [row.split(",", header.count(","))[-1].strip('"') for row in rows]
    assert reasons[:4] == [
        "",
        f"coupling.c.gap = 1e-200 {BEYOND} >= 0 [rad], {SMALLEST} unless 0",
        f"body.disc.inertia = 1e+300 {BEYOND} >= 0 [kg m2], {LARGEST}",
        f"body.disc.inertia = 1e-60 {BEYOND} >= 0 [kg m2], {SMALLEST} unless 0",
    ]
    assert reasons[5] == ""


@needs_sweeps
def test_a_variant_between_others_is_refused_if_it_is_too_near_to_zero(nocdyn):
    nocdyn.write("m.nml", SPINNER + "&coupling name = 'c' bodies = 'ground', 'disc' stiffness = 1.0 /\n" + SWEEP)
    nocdyn.write("variants.csv", "coupling.c.stiffness\n1\n0\n2\n0.5\n1e-60\n1e-50\n")
    assert nocdyn("sweep", "m.nml", "--out", "out", "--csv", "-q", "--threads", "1").returncode == 0
    rows = (nocdyn.folder / "out/sweep.csv").read_text().splitlines()[1:]
    assert [f"1e-60 {BEYOND}" in row for row in rows] == [False, False, False, False, True, False], rows
    assert [",done," in row for row in rows] == [True, True, True, True, False, True], rows


@needs_sweeps
def test_a_trajectory_with_too_many_rows_does_not_end_a_sweep(nocdyn):
    nocdyn.write("m.nml", SPINNER.replace("points = 11", "interval = 0.1") + SWEEP + "&record trajectories = 1, 2 /\n")
    nocdyn.write("variants.csv", "run.t_end\n1\n1e7\n")
    outcome = nocdyn("sweep", "m.nml", "--out", "out", "-q")
    assert (nocdyn.folder / "out/sweep.nc").exists(), outcome.stderr
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc", "variant-1"]


@needs_sweeps
@only_without_traps
def test_a_result_that_is_not_finite_is_a_failed_variant(nocdyn):
    record = "&record quantity = 'elastic_energy' statistic = 'final' /\n"
    nocdyn.write("m.nml", STORED.replace("angle = 1e50", "angle = 1") + SWEEP + record)
    nocdyn.write("variants.csv", "body.disc.angle\n1\n1e50\n")
    nocdyn("sweep", "m.nml", "--out", "out", "--csv", "-q")
    rows = (nocdyn.folder / "out/sweep.csv").read_text().splitlines()[1:]
    assert not rows[0].endswith("finite number") and rows[1].endswith(
        'failed,1,"the result elastic_energy_final is not a finite number"'
    ), rows


@needs_sweeps
def test_check_refuses_the_method_that_a_sweep_refuses(nocdyn):
    nocdyn.write("m.nml", SPINNER + "&coupling name = 'c' bodies = 'ground', 'disc' stiffness = 10 /\n" + SWEEP)
    nocdyn.write("variants.csv", "coupling.c.stiffness\n1\n")
    refused = ("--set", "run.method=taylor", "--set", "run.formulation=paper")
    outcomes = [nocdyn(command, "m.nml", *refused) for command in ("check", "sweep", "run")]
    assert [outcome.returncode for outcome in outcomes] == [2, 2, 2]
    assert outcomes[0].stderr == outcomes[1].stderr == outcomes[2].stderr


def test_thousands_of_redundant_gears_are_refused_at_once(nocdyn):
    draw = random.Random(1)
    teeth = [draw.randint(10, 40) for _ in range(2000)]
    pairs = [(i - 1, i) for i in range(1, 2000)] + [draw.sample(range(2000), 2) for _ in range(18000)]
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(2000)]
    lines += [
        f"&gear name = 'g{k}' bodies = 'b{a}', 'b{b}' radii = {teeth[a]}, {teeth[b]} internal = .true. /"
        for k, (a, b) in enumerate(pairs)
    ]
    nocdyn.write("m.nml", "\n".join([*lines, "&run t_end = 1.0 /", "&output points = 3 /\n"]))
    outcome = nocdyn("check", "m.nml")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: m.nml:5000: &gear 'g2999': the row is redundant, as are 1000 others that share its loads by common rows; "
        "allowed: 1000\n"
    )
