"""scripts/report on periodic motions: figure, special points, unstable ranges, limits."""

import json

import pytest
from report_browser import Browser, Reports, faults, require
from test_transit_report import tables

require()
SPRING = """&case title = 'Hardening spring' /
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 0.8 /
&limit coupling = 'spring' vibratory_moment = 2.0 /
&fatigue name = 'life' coupling = 'spring' reference_moment = 2.0 reference_cycles = 1.0e6 slope = 5.0 /
&run t_end = 10.0 /
&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 /
"""


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    made = Reports(tmp_path_factory.mktemp("report"))
    made.write("m.nml", SPRING)
    outcome = made("m.nml", "--no-pdf")
    assert outcome.returncode == 0 and "orbit        computed" in outcome.stdout
    return made


@pytest.fixture(scope="module")
def opened(reports):
    browser = Browser()
    browser.open(reports.page())
    yield browser
    browser.quit()


def test_the_chapter_tells_of_folds_jumps_unstable_ranges_and_peaks(reports, opened):
    assert faults(opened) == []
    report = json.loads((reports.folder / "results/m/orbit.json").read_text())
    words = opened.find("#orbit").text
    assert "on which the machine does not stay: excitation.shaker.frequency from 1.1157003 to 1.269602 rad/s" in words
    (special,) = tables(opened, "Special points")
    assert special["point"] == ["fold", "fold"] and special["at"] == ["1.269602", "1.1157003"]
    after = [one["lands_on"][0]["half_ranges"]["total_moment_spring"] for one in report["special_points"]]
    assert [float(one.split()[0]) for one in special["after a jump"]] == pytest.approx(after, rel=1e-3)
    (peaks,) = tables(opened, "Largest half ranges")
    assert peaks["motion"] == ["stable"]
    (damage,) = tables(opened, "Damage of stable motions")
    assert damage["name"] == ["life"]


def test_the_figure_has_a_curve_for_each_part(opened):
    specs = opened.ask("return report.charts.filter((one) => one.figure.closest('#orbit')).map((one) => one.spec)")
    (spec,) = specs
    names = [one["name"] for one in spec["curves"]]
    assert names == ["motions, stable", "motions, unstable", "motions, stable", "special points"]


def test_verdict_and_key_results_tell_of_periodic_motions(opened):
    (verdict,) = tables(opened, "Verdict on all limits")
    (found,) = [finding for finding in verdict["finding"] if finding.startswith("exceeded")]
    assert found.startswith("exceeded at 1.043 to 1.27 rad/s")
    (key,) = tables(opened, "Key results")
    at = key["subject"].index("Periodic motions")
    assert key["finding"][at].startswith("folds at excitation.shaker.frequency 1.2696, 1.1157 rad/s")
    assert key["assessment"][at] == "some unstable"


def test_a_report_without_orbits_has_no_word_of_them(reports, opened):
    reports.write("m2.nml", "\n".join(line for line in SPRING.splitlines() if "&orbit" not in line))
    outcome = reports("m2.nml", "--no-pdf")
    assert "orbit" not in outcome.stdout
    opened.open(reports.page("m2"))
    assert "eriodic motions" not in opened.ask("return document.body.textContent")
