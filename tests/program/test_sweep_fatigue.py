"""Damage in sweeps: each variant has that of a run of its own, whatever the element and whatever varies."""

import csv
import os
import shutil
import subprocess

import pytest
from conftest import DATA

TOLERANCE = 1e-4  # ranges below 1e-5 of the signal are not counted, and the steps end elsewhere
RUN = "&run t_end = 1.0 rtol = 1.0e-9 atol = 1.0e-9 /\n&output points = 11 /\n"
BODIES = "&body name = 'motor' inertia = 2.0 /\n&body name = 'fan' inertia = 25.0 /\n"
TORQUES = (
    "&motor name = 'drive' body = 'motor' kind = 'induction'\n"
    "breakdown_torque = 800 breakdown_slip = 0.15 synchronous_speed = 157 /\n"
    "&load name = 'air' body = 'fan' quadratic = 0.012 /\n"
    "&excitation name = 'mains' body = 'motor' amplitude = 300 frequency_hz = 50 decay = 0.3 /\n"
)
MACHINE = BODIES + TORQUES + RUN
COUPLING = "&coupling name = 'c' bodies = 'motor', 'fan' stiffness = 6.0e3 damping = 6.0 diameter = 0.06 /\n"
STRESS = "&fatigue name = 'life' coupling = 'c' reference_stress = 4.0e7 reference_cycles = 1.0e6 slope = 5 /\n"
MOMENT = "&fatigue name = 'life' coupling = 'c' reference_moment = 800 reference_cycles = 1.0e6 slope = 5 /\n"
FROM_FILE = "&fatigue name = 'life' coupling = 'c' stress_file = 'curve.csv' mean_stress = 'gerber' ultimate_stress = 2.0e8 /\n"
VARIED = "&vary target = 'coupling.c.stiffness' low = 4.0e3 high = 9.0e3 count = 4 /\n"
RECORD = "&sweep design = 'grid' /\n&record fatigue = 'life' statistic = 'damage', 'cycles' /\n"
SWEEP = RECORD + "&record trajectories = 1, 2, 3, 4 /\n"

ELEMENTS = {
    "stress": COUPLING + STRESS,
    "moment without damping": COUPLING.replace("damping = 6.0", "") + MOMENT,
    "moment with damping": COUPLING + MOMENT,
    "cubic": COUPLING.replace("damping", "cubic_stiffness = 4.0e5 damping") + MOMENT,
    "goodman": COUPLING + STRESS.replace("slope", "mean_stress = 'goodman' ultimate_stress = 2.0e8 slope"),
    "table of a file": COUPLING + FROM_FILE,
    "gap": COUPLING.replace("damping", "gap = 0.002 damping") + MOMENT,
}


def results_of(nocdyn, text, *words):
    nocdyn.write("m.nml", text)
    outcome = nocdyn("sweep", "m.nml", "--out", "out", "--csv", *words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    with open(nocdyn.folder / "out/sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def compare_with_runs(nocdyn, text, number=0):
    """The results of the variants whose trajectories are written are those of their runs."""
    rows = results_of(nocdyn, text)
    for row in rows:
        assert row["status"] == "done", row
        run = nocdyn.summary(f"out/variant-{row['variant']}")["fatigue"][number]
        assert run["damage"] > 0
        assert float(row["life_damage"]) == pytest.approx(run["damage"], rel=TOLERANCE)
        assert float(row["life_cycles"]) == run["cycles"]
    damages = [float(row["life_damage"]) for row in rows]
    assert max(damages) > 1.01 * min(damages)
    return damages


@pytest.mark.parametrize("element", ELEMENTS)
def test_each_variant_has_the_damage_of_its_run(nocdyn, element):
    nocdyn.write("curve.csv", "1e4, 8e7\n1e6, 3e7\n1e8, 1e7\n")
    compare_with_runs(nocdyn, MACHINE + ELEMENTS[element] + SWEEP + VARIED)


def test_the_points_of_a_shaft_are_counted_each(nocdyn):
    shaft = "&shaft name = 's' bodies = 'motor', 'fan' lengths = 0.4, 0.6 diameters = 0.06, 0.05\n"
    shaft += "shear_modulus = 8.0e10 nodes = 5 /\n"
    fatigue = STRESS.replace("coupling = 'c'", "shaft = 's'")
    varied = "&vary target = 'shaft.s.diameters(2)' low = 0.04 high = 0.06 count = 4 /\n"
    compare_with_runs(nocdyn, MACHINE + shaft + fatigue + SWEEP + varied)


def test_forces_of_gears_and_meshes(nocdyn):
    train = BODIES + "&body name = 'wheel' inertia = 1.0 /\n" + TORQUES + RUN
    train += COUPLING.replace("'fan'", "'wheel'")
    gear = "&gear name = 'g' bodies = 'wheel', 'fan' radii = 0.1, 0.2 /\n"
    force = "&fatigue name = 'life' gear = 'g' reference_force = 1.0e4 reference_cycles = 1.0e6 slope = 5 /\n"
    compare_with_runs(nocdyn, train + gear + force + SWEEP + VARIED)
    mesh = "&mesh name = 'g' bodies = 'wheel', 'fan' radii = 0.1, 0.2 stiffness = 1.0e7 damping = 1.0e3 /\n"
    compare_with_runs(nocdyn, train + mesh + force.replace("gear", "mesh") + SWEEP + VARIED)


def test_cubic_stiffness_that_varies_from_zero_on(nocdyn):
    varied = "&vary target = 'coupling.c.cubic_stiffness' low = 0 high = 4.0e5 count = 4 /\n"
    compare_with_runs(nocdyn, MACHINE + COUPLING + MOMENT + SWEEP + varied)


def test_damping_that_varies_from_zero_on(nocdyn):
    varied = "&vary target = 'coupling.c.damping' low = 0 high = 20 count = 4 /\n"
    compare_with_runs(nocdyn, MACHINE + COUPLING + MOMENT + SWEEP + varied)


def test_numbers_of_the_s_n_curve_may_vary(nocdyn):
    varied = "&vary target = 'fatigue.life.reference_stress' low = 2.0e7 high = 8.0e7 count = 4 /\n"
    damages = compare_with_runs(nocdyn, MACHINE + COUPLING + STRESS + SWEEP + varied)
    levels = [2.0e7, 4.0e7, 6.0e7, 8.0e7]
    for level, damage in zip(levels, damages):
        assert damage * level**5 == pytest.approx(damages[0] * levels[0] ** 5, rel=1e-9)


def test_the_count_begins_at_extremes_from(nocdyn):
    whole = compare_with_runs(nocdyn, MACHINE + COUPLING + STRESS + SWEEP + VARIED)
    part = compare_with_runs(
        nocdyn, MACHINE.replace("points = 11", "points = 11 extremes_from = 0.6") + COUPLING + STRESS + SWEEP + VARIED
    )
    assert all(0 < late < 0.5 * all_of_it for late, all_of_it in zip(part, whole))


def test_a_closed_form(nocdyn):
    """An undamped oscillator has one cycle of the amplitude A in each period: damage = cycles (A / reference)^5 / its cycles."""
    machine = "&body name = 'disc' inertia = 1.0 angle = 0.01 /\n"
    machine += "&coupling name = 'c' bodies = 'disc', 'ground' stiffness = 1.0e4 /\n"
    machine += "&run t_end = 6.2831853071795864 rtol = 1e-11 atol = 1e-13 /\n&output points = 2 /\n"
    varied = "&vary target = 'body.disc.angle' low = 0.01 high = 0.04 count = 4 /\n"
    rows = results_of(nocdyn, machine + MOMENT + RECORD + varied)
    for row in rows:
        amplitude = 1.0e4 * float(row["body.disc.angle [rad]"])
        assert float(row["life_cycles"]) == 100
        assert float(row["life_damage"]) == pytest.approx(100 * (amplitude / 800) ** 5 / 1e6, rel=1e-7)


def test_threads_and_lanes_do_not_change_a_bit(nocdyn):
    text = MACHINE + COUPLING + STRESS + "&sweep design = 'random' samples = 50 seed = 1 /\n" + VARIED.replace("count = 4", "")
    text += "&record fatigue = 'life' statistic = 'damage' /\n"
    one = results_of(nocdyn, text, "--threads", "1")
    assert results_of(nocdyn, text, "--threads", "2") == one
    assert len({row["life_damage"] for row in one}) == 50


@pytest.mark.skipif(shutil.which("cc") is None, reason="no compiler for the counter")
def test_nothing_is_allocated_per_step(nocdyn):
    library = nocdyn.folder / "count_allocations.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", library, DATA / "count_allocations.c"], check=True)
    nocdyn.write("m.nml", MACHINE + COUPLING + STRESS + RECORD + VARIED)
    sweeper = os.path.join(os.path.dirname(nocdyn.executable), "nocdyn-sweep")
    counts = []
    for t_end in (1.0, 8.0):
        file = nocdyn.folder / "allocations"
        shutil.rmtree(nocdyn.folder / "out", ignore_errors=True)
        environment = os.environ | {"LD_PRELOAD": str(library), "ALLOCATIONS": str(file)}
        words = ["sweep", "m.nml", "--out", "out", "--quiet", "--threads", "1", "--set", f"run.t_end={t_end}"]
        subprocess.run([sweeper, *words], cwd=nocdyn.folder, env=environment, check=True)
        counts.append(int(file.read_text()))
    assert counts[0] > 1000
    assert abs(counts[1] - counts[0]) <= 20  # numbers of other lengths in texts


@pytest.mark.parametrize(
    "record, message",
    [
        ("fatigue = 'lief' statistic = 'damage'", "fatigue: there is no &fatigue 'lief'; did you mean 'life'?"),
        ("fatigue = 'life' statistic = 'max'", "statistic = 'max' does not belong to fatigue; allowed: 'damage', 'cycles'"),
        ("quantity = 'omega_fan' statistic = 'damage'", "statistic = 'damage' does not belong to quantity; needed: fatigue"),
        ("fatigue = 'life' statistic = 'damage', 'damage'", "'life_damage' is recorded already; allowed: once"),
        (
            "fatigue = 'life' quantity = 'omega_fan' statistic = 'max'",
            "quantity and fatigue are both given; allowed: one of them",
        ),
        ("fatigue = 'life' statistic = 'damage' from = 0.5", "from needs quantity"),
    ],
)
def test_wrong_records_are_refused(nocdyn, record, message):
    nocdyn.write("m.nml", MACHINE + COUPLING + STRESS + f"&sweep design = 'grid' /\n{VARIED}&record {record} /\n")
    outcome = nocdyn("sweep", "m.nml", "--out", "out")
    assert outcome.returncode == 2
    assert outcome.stderr == f"nocdyn: m.nml:13: &record: {message}\n"
    assert not (nocdyn.folder / "out").exists()
