"""Fatigue in runs: cycles against another program, closed forms of oscillations, sections of shafts, what is refused."""

import csv
import json
import math
import os
import random
import subprocess

import numpy as np
import pytest
import rainflow

SIGNALS = 20
RELEASED = (
    "&body name='a' inertia=2 angle=0.01 /\n"
    "&coupling name='c' bodies='a', 'ground' stiffness=5000 section_modulus=1e-5 /\n"
    "&run t_end={t_end} rtol=1e-10 atol=1e-12 /\n&output points=11 /\n"
)
MOMENT = 5000 * 0.01
STRESS = MOMENT / 1e-5
PERIOD = 2 * math.pi / math.sqrt(5000 / 2)
CURVE = "reference_stress=5e6 reference_cycles=1e6 slope=4"
ROUNDING = 1e-8  # of integrations at rtol = 1e-10
STARTED = (
    "&body name='motor' inertia=2 /\n&body name='fan' inertia=20 /\n"
    "&coupling name='c' bodies='motor', 'fan' stiffness=2e4 damping=5 diameter=0.05 /\n"
    "&motor name='drive' body='motor' kind='induction' breakdown_torque=800 breakdown_slip=0.15 synchronous_speed=157 /\n"
    "&load name='air' body='fan' quadratic=0.01 /\n"
    "&excitation name='mains' body='motor' amplitude=500 frequency_hz=50 /\n"
    "&run t_end=0.5 rtol=1e-9 atol=1e-12 /\n&output points=25001 /\n"
)


def fatigue_of(nocdyn, text, *words):
    nocdyn.write("machine.nml", text)
    done = nocdyn("run", "machine.nml", *words)
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads((nocdyn.folder / "results/machine/summary.json").read_text())["fatigue"]


def turning_points(count, seed):
    draw = random.Random(seed)
    return [(-1) ** i * draw.random() * 10 ** draw.uniform(-2, 1) for i in range(count)]


@pytest.mark.parametrize("seed", range(SIGNALS))
def test_cycles_are_those_of_another_program(seed):
    points = turning_points(200 + 50 * seed, seed)
    text = f"{len(points)}\n" + "\n".join(map(repr, points))
    done = subprocess.run([os.environ["NOCDYN_RAINFLOW"]], input=text, capture_output=True, text=True, check=True)
    found = sorted(tuple(map(float, line.split())) for line in done.stdout.splitlines())
    expected = sorted((r, m, c) for r, m, c, _, _ in rainflow.extract_cycles(points))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


def test_a_free_oscillation_has_a_cycle_for_each_period(nocdyn):
    text = RELEASED.format(t_end=100.5 * PERIOD) + f"&fatigue name='life' coupling='c' {CURVE} repeats=7 /\n"
    (life,) = fatigue_of(nocdyn, text)
    damage = 100.5 * (STRESS / 5e6) ** 4 / 1e6
    assert life["cycles"] == 100.5
    assert life["largest_range"] == pytest.approx(2 * STRESS, rel=ROUNDING)
    assert life["damage"] == pytest.approx(damage, rel=5 * ROUNDING)
    assert life["damage_of_repeats"] == pytest.approx(7 * damage, rel=5 * ROUNDING)
    assert life["repeats_to_failure"] == pytest.approx(1 / damage, rel=5 * ROUNDING)
    assert abs(life["mean_of_largest_range"]) < 1e-6 * STRESS
    with (nocdyn.folder / "results/machine/cycles.csv").open() as file:
        header, *rows = csv.reader(file)
    assert header == ["fatigue", "unit", "range", "mean", "cycles", "damage"]
    assert sum(float(row[4]) for row in rows) == 100.5
    assert sum(float(row[5]) for row in rows) == pytest.approx(damage, rel=5 * ROUNDING)


def test_moments_and_tables_give_the_same_life_as_stresses(nocdyn):
    text = RELEASED.format(t_end=10 * PERIOD) + (
        f"&fatigue name='stress' coupling='c' {CURVE} /\n"
        "&fatigue name='moment' coupling='c' reference_moment=50 reference_cycles=1e6 slope=4 /\n"
        "&fatigue name='table' coupling='c' table_moment=500, 50 table_cycles=1e2, 1e6 /\n"
    )
    lives = fatigue_of(nocdyn, text)
    assert [life["unit"] for life in lives] == ["Pa", "N m", "N m"]
    damages = [life["damage"] for life in lives]
    assert damages == pytest.approx([damages[0]] * 3, rel=1e-12)


def test_the_damage_is_that_of_the_sampled_stress_with_goodman_and_notch(nocdyn):
    (life,) = fatigue_of(
        nocdyn,
        STARTED + f"&fatigue name='life' coupling='c' {CURVE} notch_factor=1.5 mean_stress='goodman' ultimate_stress=3e8 /\n",
    )
    header, rows = nocdyn.table("results/machine")
    stress = [float(row[header.index("stress_c [Pa]")]) for row in rows]
    least = 1e-5 * max(map(abs, stress))
    cycles = [(r, m, c) for r, m, c, _, _ in rainflow.extract_cycles(stress) if r > least]
    damage = sum(c * (1.5 * r / 2 / (1 - abs(m) / 3e8) / 5e6) ** 4 / 1e6 for r, m, c in cycles)
    assert life["cycles"] == sum(c for _, _, c in cycles)
    assert life["damage"] == pytest.approx(damage, rel=1e-5)


SN_CYCLES, SN_STRESS = (2e3, 1e5, 3e6), (9e6, 4e6, 2.5e6)
SN_TABLE = "# cycles to failure, half range of the stress [Pa]\n" + "".join(f"{n}, {s}\n" for n, s in zip(SN_CYCLES, SN_STRESS))


def table_life(half_range, constant=False):
    """Cycles to failure, straight in logarithmic scales; below the last point none fail it if the curve is constant there."""
    cycles, stress = np.log(SN_CYCLES), np.log(SN_STRESS)
    if constant and half_range <= SN_STRESS[-1]:
        return math.inf
    i = 0 if half_range > SN_STRESS[1] else 1
    return math.exp(cycles[i] + (cycles[i + 1] - cycles[i]) / (stress[i + 1] - stress[i]) * (math.log(half_range) - stress[i]))


@pytest.mark.parametrize("constant", [False, True])
@pytest.mark.parametrize(
    ("mean", "level"),
    [
        ("", lambda mean: 1),
        ("mean_stress='goodman' ultimate_stress=8e7", lambda mean: 1 / (1 - abs(mean) / 8e7)),
        ("mean_stress='soderberg' yield_stress=5e7", lambda mean: 1 / (1 - abs(mean) / 5e7)),
        ("mean_stress='gerber' ultimate_stress=6e7", lambda mean: 1 / (1 - (mean / 6e7) ** 2)),
    ],
)
def test_the_table_of_a_file_counts_as_the_sampled_stress(nocdyn, constant, mean, level):
    nocdyn.write("curve.csv", SN_TABLE)
    keys = mean + (" extrapolation='constant'" if constant else "")
    lists = f"table_cycles={str(SN_CYCLES)[1:-1]} table_stress={str(SN_STRESS)[1:-1]}"
    text = STARTED + f"&fatigue name='life' coupling='c' stress_file='curve.csv' {keys} /\n"
    life, same = fatigue_of(nocdyn, text + f"&fatigue name='lists' coupling='c' {lists} {keys} /\n")
    assert same["damage"] == life["damage"]
    header, rows = nocdyn.table("results/machine")
    stress = [float(row[header.index("stress_c [Pa]")]) for row in rows]
    least = 1e-5 * max(map(abs, stress))
    cycles = [(r, m, c) for r, m, c, _, _ in rainflow.extract_cycles(stress) if r > least]
    levels = [r / 2 * level(m) for r, m, _ in cycles]
    assert any(one > SN_STRESS[0] for one in levels) and any(one < SN_STRESS[-1] for one in levels)
    assert life["damage"] == pytest.approx(sum(c / table_life(one, constant) for one, (_, _, c) in zip(levels, cycles)), rel=1e-5)


def test_the_thin_part_of_a_shaft_takes_the_damage(nocdyn):
    (life,) = fatigue_of(
        nocdyn,
        "&body name='a' inertia=2 speed=5 /\n&body name='b' inertia=3 /\n"
        "&shaft name='s' bodies='a', 'b' lengths=0.5, 0.2, 0.6 diameters=0.06, 0.03, 0.08 shear_modulus=8e10 density=7850 /\n"
        f"&fatigue name='life' shaft='s' {CURVE} /\n&run t_end=0.03 /\n",
    )
    assert 0.5 <= life["position"] <= 0.7
    columns = json.loads((nocdyn.folder / "results/machine/summary.json").read_text())["columns"]["stress_s [Pa]"]
    assert life["largest_range"] == pytest.approx(columns["max"] - columns["min"], rel=1e-3)


def test_forces_of_gears_and_meshes_are_counted(nocdyn):
    gears = (
        "&body name='a' inertia=1 /\n&body name='p' inertia=0.1 /\n&body name='w' inertia=0.3 /\n&body name='x' inertia=0.2 /\n"
        "&coupling name='c' bodies='a', 'p' stiffness=1e4 /\n&gear name='g' bodies='p', 'w' radii=0.1, 0.2 /\n"
        "&mesh name='m' bodies='w', 'x' radii=0.2, 0.1 stiffness=1e8 /\n"
        "&excitation name='e' body='a' amplitude=100 frequency=40 /\n&run t_end=1 /\n"
        "&fatigue name='gear' gear='g' reference_force=100 reference_cycles=1e6 slope=6 /\n"
        "&fatigue name='mesh' mesh='m' reference_force=100 reference_cycles=1e6 slope=6 /\n"
    )
    lives = fatigue_of(nocdyn, gears)
    columns = json.loads((nocdyn.folder / "results/machine/summary.json").read_text())["columns"]
    for life, column in zip(lives, ("reaction_g [N]", "force_m [N]"), strict=True):
        assert life["unit"] == "N"
        assert life["largest_range"] == pytest.approx(columns[column]["max"] - columns[column]["min"], rel=1e-6)
        assert life["damage"] > 0


def test_what_is_counted_begins_with_extremes_from(nocdyn):
    text = RELEASED.format(t_end=100.5 * PERIOD) + f"&fatigue name='life' coupling='c' {CURVE} /\n"
    (life,) = fatigue_of(nocdyn, text, "--set", f"output.extremes_from={50 * PERIOD}")
    assert life["cycles"] == pytest.approx(50.5, abs=0.5)


def test_without_the_group_there_is_no_file(nocdyn):
    text = RELEASED.format(t_end=PERIOD)
    fatigue_of(nocdyn, text + f"&fatigue name='life' coupling='c' {CURVE} /\n")
    assert "cycles.csv" in nocdyn.files("results/machine")
    nocdyn.write("machine.nml", text)
    assert nocdyn("run", "machine.nml").returncode == 0
    assert "cycles.csv" not in nocdyn.files("results/machine")


def test_cycles_of_a_run_that_fails_are_named_partial(nocdyn):
    nocdyn.write("machine.nml", RELEASED.format(t_end=PERIOD) + f"&fatigue name='life' coupling='c' {CURVE} /\n")
    whole = ["columns.json", "cycles.csv", "input.nml", "summary.json", "trajectory.csv"]
    for steps, code, files in (
        (100, 0, whole),
        (2, 1, ["columns.json", "cycles.partial.csv", "input.nml", "summary.json", "trajectory.partial.csv"]),
    ) * 2:
        assert nocdyn("run", "machine.nml", "--set", f"run.max_steps={steps}").returncode == code
        assert nocdyn.files("results/machine") == files


def test_the_printed_line_says_cycles_damage_and_life(nocdyn):
    nocdyn.write("m.nml", RELEASED.format(t_end=100 * PERIOD) + f"&fatigue name='life' coupling='c' {CURVE} repeats=500 /\n")
    text = nocdyn("run", "m.nml").stdout
    assert (
        "fatigue 'life': 100 cycles, range up to 10000000 Pa; damage 0.0001, the life is 10000 such runs; "
        "500 of them: damage 0.05"
    ) in text


BARE = RELEASED.replace(" section_modulus=1e-5", "").format(t_end=1)


@pytest.mark.parametrize(
    ("group", "message"),
    [
        (
            f"coupling='c' {CURVE}",
            ":5: &fatigue 'f': a stress needs a section, but coupling 'c' has none; required: section_modulus [m3] or "
            "diameter [m] of &coupling, or a moment in place of the stress",
        ),
        (f"coupling='d' {CURVE}", ":5: &fatigue 'f': there is no coupling 'd'; allowed: 'c'\n"),
        (f"shaft='shaft_1' {CURVE}", ":5: &fatigue 'f': there is no shaft 'shaft_1'"),
        ("coupling='c' reference_moment=1 slope=3", "reference_cycles"),
        ("coupling='c' reference_cycles=1 slope=3", "reference_stress"),
        ("coupling='c' reference_force=1 reference_cycles=1 slope=3", "reference_force"),
        ("coupling='c' slope=0 reference_moment=1 reference_cycles=1", "slope = 0"),
        ("coupling='c'", "slope"),
        (
            "coupling='c' table_moment=10, 5, 1 table_cycles=10, 100",
            ":5: &fatigue 'f': table_moment has 3 values and table_cycles has 2 values; needed: as many of each",
        ),
        (
            "coupling='c' table_moment=10, 11 table_cycles=10, 100",
            ":5: &fatigue 'f': table_moment(2) = 11 is not less than the value before, 10; needed: half ranges that descend",
        ),
        (
            "coupling='c' reference_moment=1 reference_cycles=1 slope=3 mean_stress='goodman'",
            ":5: &fatigue 'f': mean_stress = 'goodman' needs an S-N curve of stresses, reference_stress, table_stress or "
            "stress_file",
        ),
        (
            "coupling='c' reference_moment=1 reference_cycles=1 slope=3 yield_stress=1e8",
            ":5: &fatigue 'f': yield_stress has no effect with mean_stress = 'none'; allowed: goodman and gerber with "
            "ultimate_stress, soderberg with yield_stress",
        ),
    ],
)
def test_groups_that_do_not_fit_are_refused(nocdyn, group, message):
    nocdyn.write("bad.nml", BARE + f"&fatigue name='f' {group} /\n")
    for command in ("run", "check"):
        done = nocdyn(command, "bad.nml")
        assert done.returncode == 2
        assert message in done.stderr
        assert done.stderr.count("\n") <= 2


@pytest.mark.parametrize(
    ("keys", "rows", "message"),
    [
        ("", ["1e3 9e6"], "moment_file: curve.csv: 1 row; needed: at least 2\n"),
        ("", ["1e3 5", "1e2 4"], "moment_file: curve.csv:2: column 1, 100, must be greater than 1000 on line 1"),
        ("", ["1e3 5", "1e6 5"], "table_moment(2) = 5 is not less than the value before, 5; needed: half ranges that descend\n"),
        ("", ["1e3 5", "1e6 0"], "moment_file: curve.csv: table_moment = 0 in row 2 is out of range; allowed: > 0 [N m]\n"),
        (
            "slope=3 reference_moment=1 reference_cycles=1",
            ["1 2", "2 1"],
            "slope and moment_file are both given; allowed: one of them",
        ),
        ("table_cycles=1, 2", ["1 2", "2 1"], "table_cycles and moment_file are both given; allowed: one of them\n"),
        ("table_moment=2, 1", ["1 2", "2 1"], "table_moment and moment_file are both given; allowed: one of them\n"),
        ("stress_file='curve.csv'", ["1 2", "2 1"], "stress_file and moment_file are both given; allowed: one of them\n"),
        ("force_file='curve.csv'", ["1 2", "2 1"], "moment_file and force_file are both given; allowed: one of them\n"),
    ],
)
def test_tables_of_files_that_do_not_fit_are_refused(nocdyn, keys, rows, message):
    nocdyn.write("curve.csv", "\n".join(rows) + "\n")
    nocdyn.write("bad.nml", BARE + f"&fatigue name='f' coupling='c' moment_file='curve.csv' {keys} /\n")
    done = nocdyn("check", "bad.nml")
    assert done.returncode == 2
    assert f"bad.nml:5: &fatigue 'f': {message}" in done.stderr


def test_an_extrapolation_needs_a_table_and_a_table_its_half_ranges(nocdyn):
    for keys, message in (
        (f"{CURVE} extrapolation='constant'", "extrapolation needs table_cycles, stress_file, moment_file or force_file\n"),
        ("table_cycles=1, 2", "table_cycles needs table_stress, table_moment or table_force\n"),
    ):
        nocdyn.write("bad.nml", RELEASED.format(t_end=1) + f"&fatigue name='f' coupling='c' {keys} /\n")
        done = nocdyn("check", "bad.nml")
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert message in done.stderr


def test_a_mean_needs_its_strength_and_a_force_its_radii(nocdyn):
    nocdyn.write("mean.nml", RELEASED.format(t_end=1) + f"&fatigue name='f' coupling='c' {CURVE} mean_stress='soderberg' /\n")
    done = nocdyn("run", "mean.nml")
    assert done.returncode == 2
    assert "mean.nml:5: &fatigue 'f': mean_stress = 'soderberg' needs yield_stress [Pa]" in done.stderr
    nocdyn.write(
        "teeth.nml",
        "&body name='a' inertia=1 /\n&body name='b' inertia=1 /\n&gear name='g' bodies='a', 'b' teeth=20, 30 /\n&run t_end=1 /\n"
        "&fatigue name='f' gear='g' reference_force=1 reference_cycles=1 slope=3 /\n",
    )
    done = nocdyn("run", "teeth.nml")
    assert done.returncode == 2
    assert "teeth.nml:5: &fatigue 'f': a tooth force needs radii, but gear 'g' has none; required: radii [m]" in done.stderr
