"""Sweeps that record periodic motions: folds, jumps and peaks are those of `nocdyn orbit` of each variant."""

import csv
import json

import numpy as np
import pytest
from sweep_inputs import needs_sweeps

pytestmark = needs_sweeps

MACHINE = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 0.8 /
&run t_end = 10.0 /
&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 /
"""
GRID = """\
&sweep design = 'grid' /
&vary target = 'excitation.shaker.amplitude' low = 0.02 high = 0.18 count = 3 /
"""
RECORDS = """\
&record orbit = 'branch' statistic = 'folds', 'unstable_ranges' /
&record orbit = 'moment_spring' statistic = 'peak', 'peak_value' /
&record path = 'orbit.points', 'orbit.special_points[1].value' /
"""
JUMPS = """\
&record orbit = 'branch' statistic = 'jump_up', 'jump_down', 'fold' /
&record orbit = 'branch' number = 2 statistic = 'fold' /
&record orbit = 'phi_mass [deg]' statistic = 'peak' /
"""


def sweep(nocdyn, text, *words):
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", "swept", "--csv", "-q", *words)
    assert outcome.returncode == 0, outcome.stderr
    (path,) = (nocdyn.folder / "swept").rglob("sweep.csv")
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def alone(nocdyn, amplitude):
    outcome = nocdyn("orbit", "machine.nml", "--out", "alone", "--set", f"excitation.shaker.amplitude={amplitude}")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "alone/orbit.json").read_text()), outcome.stdout


def test_recorded_motions_are_those_of_the_machine_alone(nocdyn):
    found = sweep(nocdyn, MACHINE + GRID + JUMPS + RECORDS, "--threads", "2")
    assert [row["status"] for row in found] == ["failed", "done", "done"]  # the smallest amplitude has no fold
    assert found[0]["reason"] == "jump_up 1 is recorded, but the motions of this variant have 0 such points"
    for row in found[1:]:
        report, printed = alone(nocdyn, row["excitation.shaker.amplitude [N m]"])
        folds = [point["value"] for point in report["special_points"] if point["kind"] == "fold"]
        assert [float(row[f"orbit_fold_{k} [rad/s]"]) for k in (1, 2)] == folds
        assert float(row["orbit_jump_up_1 [rad/s]"]) == folds[0]
        assert float(row["orbit_jump_down_1 [rad/s]"]) == folds[1]
        assert f"at {folds[0]:.10g} rad/s: fold; a rising value jumps there" in printed
        peaks = {peak["quantity"]: peak for peak in report["peaks"]}
        assert float(row["moment_spring_orbit_peak [N m]"]) == peaks["moment_spring"]["half_range"]
        assert float(row["moment_spring_orbit_peak_value [rad/s]"]) == peaks["moment_spring"]["value"]
        degrees = np.degrees(peaks["phi_mass"]["half_range"])
        assert float(row["phi_mass_orbit_peak [deg]"]) == pytest.approx(degrees, rel=1e-15)
        assert (float(row["orbit_folds"]), float(row["orbit_unstable_ranges"])) == (2, 1)
        assert float(row["orbit.points"]) == report["points"]
        assert float(row["orbit.special_points[1].value"]) == report["special_points"][0]["value"]


def test_numbers_of_motions_without_folds_are_there(nocdyn):
    first, *_ = sweep(nocdyn, MACHINE + GRID + RECORDS.split("&record path")[0])
    assert first["status"] == "done"
    assert (float(first["orbit_folds"]), float(first["orbit_unstable_ranges"])) == (0, 0)
    assert 0 < float(first["moment_spring_orbit_peak [N m]"]) < 1


def test_the_sweep_of_a_load_case_has_its_motions(nocdyn):
    text = MACHINE + GRID.replace("excitation.shaker.amplitude' low = 0.02 high = 0.18", "body.mass.inertia' low = 1 high = 1.2")
    text += "&load_case name = 'soft' set = 'coupling.spring.stiffness = 0.8' /\n"
    record = "&record orbit = 'branch' statistic = 'jump_up' /\n"
    soft = sweep(nocdyn, text + record, "--case", "soft")
    outcome = nocdyn("orbit", "machine.nml", "--case", "soft", "--out", "alone", "--set", "body.mass.inertia=1.2")
    assert outcome.returncode == 0, outcome.stderr
    report = json.loads((nocdyn.folder / "alone/soft/orbit.json").read_text())
    assert float(soft[-1]["orbit_jump_up_1 [rad/s]"]) == report["special_points"][0]["value"]


def test_variants_without_a_branch_fail_and_say_why(nocdyn):
    grid = "&sweep design = 'grid' /\n&vary target = 'excitation.shaker.amplitude' low = 0 high = 0.18 count = 2 /\n"
    silent, loud = sweep(nocdyn, MACHINE + grid + "&record orbit = 'branch' statistic = 'folds' /\n")
    assert (silent["status"], loud["status"]) == ("failed", "done")
    assert "nothing oscillates at the first value" in silent["reason"]


def test_jumps_need_the_stability_of_the_motions(nocdyn):
    text = MACHINE.replace("&orbit", "&orbit stability = .false.") + GRID
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text + "&record orbit = 'branch' statistic = 'jump_up' /\n"))
    assert outcome.returncode == 1
    assert "jump_up needs the stability of the motions; required: stability = .true. in &orbit" in outcome.stderr
    assert float(sweep(nocdyn, text + "&record orbit = 'branch' statistic = 'folds' /\n")[2]["orbit_folds"]) == 2


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("'branch' statistic = 'folds'", "'branch' statistic = 'peak'", ["'peak'", "orbit = 'branch'", "'jump_down'"]),
        ("'branch' statistic = 'folds'", "'phi_mass' statistic = 'fold'", ["'fold'", "allowed: 'peak', 'peak_value'"]),
        ("'branch' statistic = 'folds'", "'phi_masse' statistic = 'peak'", ["'phi_masse'", "did you mean 'phi_mass'?"]),
        ("'branch' statistic = 'folds'", "'branch' statistic = 'folds', 'folds'", ["'orbit_folds' is recorded already"]),
        ("&orbit over", "&orbit signals = 'omega_*' over", ["orbit = 'phi_mass' is no signal of orbit.csv"]),
        ("excitation.shaker.frequency' range", "excitation.shaken.frequency' range", ["excitation.shaken.frequency"]),
        ("&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 /\n", "", ["there is no group &orbit"]),
        ("orbit = 'branch'", "order = 1 orbit = 'branch'", ["order"]),
    ],
)
def test_what_cannot_be_recorded_is_refused(nocdyn, old, new, words):
    text = MACHINE + GRID + "&record orbit = 'branch' statistic = 'folds' /\n&record orbit = 'phi_mass' statistic = 'peak' /\n"
    assert old in text
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text.replace(old, new, 1)))
    assert outcome.returncode == 2
    for word in words:
        assert word in outcome.stderr


def test_a_held_speed_has_folds_but_no_jumps(nocdyn):
    text = """\
&body name = 'engine' inertia = 4.0 speed_rpm = 600 /
&body name = 'generator' inertia = 2.0 /
&coupling name = 'rubber' bodies = 'engine', 'generator' stiffness = 1.0e4 cubic_stiffness = 5.0e6 damping = 3.0 /
&motor name = 'mean' body = 'engine' kind = 'constant' torque = 150.0 /
&load name = 'grid' body = 'generator' viscous = 2.0 /
&excitation name = 'firing' body = 'engine' kind = 'orders' orders = 1.0, 2.0 amplitudes = 40.0, 200.0 /
&run t_end = 20.0 /
&orbit body = 'engine' speed_rpm = 980, 1030 /
&sweep design = 'grid' /
&vary target = 'coupling.rubber.cubic_stiffness' low = 5e6 high = 5e6 count = 1 /
"""
    (one,) = sweep(nocdyn, text + "&record orbit = 'branch' statistic = 'fold' /\n")
    assert float(one["orbit_fold_1 [rad/s]"]) == pytest.approx(106.1549362, abs=1e-6)
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text + "&record orbit = 'branch' statistic = 'jump_up' /\n"))
    assert outcome.returncode == 2
    assert "&orbit holds the mean speed of a body, which does not jump; allowed: 'fold'" in outcome.stderr
