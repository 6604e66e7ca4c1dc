"""Responses over the frequency of a shaker, of machines that are held or turn at one steady speed."""

import csv
import json
import os
import subprocess
import sys
from math import pi, sqrt

import numpy as np
import pytest
from conftest import SOURCE, fast_only
from sweep_inputs import needs_sweeps

DISC = """\
&body name = 'disc' inertia = 1 /
&coupling name = 'spring' bodies = 'ground', 'disc' stiffness = 1e4 damping = 4 /
&excitation name = 'shaker' body = 'disc' amplitude = 10 frequency_hz = 16 /
"""
OVER = "&response frequency_hz = 10, 20 /\n"
RUN = "&run t_end = 1 /\n"
TURN = 2 * pi


def analysis(nocdyn, command, text, *options):
    """The content of its JSON file."""
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, ""), outcome.stderr
    return json.loads((nocdyn.folder / f"out/{command}.json").read_text())


def table_of(nocdyn, name):
    with open(nocdyn.folder / "out" / name) as file:
        rows = list(csv.DictReader(file))
    return {key: np.array([float(row[key]) for row in rows]) for key in rows[0]}


def refusal(nocdyn, command, text):
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 2
    return outcome.stderr


def angle_of(w):
    """Of the disc: 10 / |k - W^2 + i c W| [rad]."""
    return 10 / np.sqrt((1e4 - w**2) ** 2 + (4 * w) ** 2)


def test_a_disc_on_a_spring_has_the_response_of_the_closed_form(nocdyn):
    report = analysis(nocdyn, "response", DISC + OVER + RUN)
    table, lines = table_of(nocdyn, "response.csv"), table_of(nocdyn, "response_orders.csv")
    assert list(table)[:2] == ["frequency [Hz]", "mean_total_moment_spring [N m]"]
    w = TURN * lines["frequency [Hz]"]
    assert len(w) > 201
    assert lines["phi_disc [rad]"] == pytest.approx(angle_of(w), rel=1e-11)
    assert lines["total_moment_spring [N m]"] == pytest.approx(abs(1e4 + 4j * w) * angle_of(w), rel=1e-11)
    assert table["half_range_total_moment_spring [N m]"] == pytest.approx(lines["total_moment_spring [N m]"], rel=1e-12)
    # the power of the shaker is the heat of the spring
    heat = 0.5 * 4 * w**2 * angle_of(w) ** 2
    assert table["heat_spring [W]"] == pytest.approx(heat, rel=1e-10)
    lag = np.radians(lines["phase_phi_disc [deg]"]) + pi / 2  # sin is cos - 90 degrees
    assert 0.5 * 10 * w * angle_of(w) * np.sin(-lag) == pytest.approx(heat, rel=1e-9)
    assert max(lines["phi_disc [rad]"]) == pytest.approx(0.025005, abs=1e-6)
    assert report["excitation"] == "shaker"
    assert report["frequency_Hz"] == pytest.approx([10, 20], rel=1e-6)
    (resonance,) = report["resonances"]
    assert resonance["frequency_Hz"] == pytest.approx(sqrt(1e4 - 2**2) / TURN, rel=1e-9)
    assert "speed_rad_s" not in resonance and "order" not in resonance
    assert "critical_speeds" not in report


def test_the_report_and_the_check_speak_of_frequencies(nocdyn):
    outcome = nocdyn("response", nocdyn.write("machine.nml", DISC + OVER + RUN), "--out", "out")
    assert "forced response from 10 to 20 Hz of excitation shaker" in outcome.stdout
    assert "  mode  resonance [Hz]  damping ratio  coupling" in outcome.stdout
    assert "at [Hz]" in outcome.stdout
    assert "rpm" not in outcome.stdout and "order" not in outcome.stdout.replace("response_orders.csv", "")
    assert "response: 201 frequencies of shaker from 10 to 20 Hz" in nocdyn("check", "machine.nml").stdout


ROTOR = """\
&body name = 'motor' inertia = 0.5 /
&body name = 'fan' inertia = 2 /
&coupling name = 'shaft' bodies = 'motor', 'fan' stiffness = 3000 damping = 1 /
&load name = 'air' body = 'fan' quadratic = 0.003 /
&excitation name = 'shaker' body = 'fan' amplitude = 0.1 frequency_hz = 5 phase_deg = 30 /
"""
DRIVEN = ROTOR + "&drive name = 'held' body = 'motor' speed = 100 /\n"
FREE = ROTOR + "&motor name = 'm' body = 'motor' a = 60 b = 0.3 c = 0 /\n"


@fast_only
@pytest.mark.parametrize("text", [DRIVEN, FREE], ids=["driven", "free"])
@pytest.mark.parametrize("frequency", [2.0, 6.0, 9.0])
def test_a_machine_that_turns_has_the_oscillations_of_settled_runs(nocdyn, text, frequency):
    text = text.replace("amplitude = 0.1 frequency_hz = 5", f"amplitude = 1e-3 frequency_hz = {frequency}")
    analysis(nocdyn, "response", text + f"&response frequency_hz = {frequency} /\n" + RUN)
    lines, table = table_of(nocdyn, "response_orders.csv"), table_of(nocdyn, "response.csv")
    run = "&run t_end = 80 start = 'equilibrium' method = 'rk853' rtol = 1e-11 atol = 1e-13 /\n"
    run += f"&output interval = {1 / (40 * frequency)!r} /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text + run), "--out", "run", "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("run")
    rows = np.array(rows[-401:-1])
    angle = TURN * frequency * rows[:, 0]
    basis = np.stack([np.ones_like(angle), np.cos(angle), -np.sin(angle)], axis=1)
    mean, real, imaginary = np.linalg.lstsq(basis, rows[:, header.index("total_moment_shaft [N m]")], rcond=None)[0]
    assert lines["total_moment_shaft [N m]"][0] == pytest.approx(np.hypot(real, imaginary), rel=1e-5)
    assert lines["phase_total_moment_shaft [deg]"][0] == pytest.approx(np.degrees(np.arctan2(imaginary, real)), abs=1e-3)
    assert table["mean_total_moment_shaft [N m]"][0] == pytest.approx(mean, rel=1e-6)


def test_other_excitations_are_left_out_with_a_note(nocdyn):
    orders = "&excitation name = 'blades' body = 'fan' kind = 'orders' orders = 3 amplitudes = 5 /\n"
    report = analysis(nocdyn, "response", DRIVEN + orders + OVER + RUN)
    note = "the response is the one of 'shaker' alone: the oscillations that other excitations add are left out"
    assert note in report["notes"]
    assert note not in analysis(nocdyn, "response", DRIVEN + OVER + RUN)["notes"]


def test_one_of_several_shakers_is_named(nocdyn):
    second = "&excitation name = 'second' body = 'disc' amplitude = 20 frequency_hz = 7 /\n"
    said = refusal(nocdyn, "response", DISC + second + OVER + RUN)
    assert "&response: several harmonic excitations may be the shaker; allowed: excitation = 'shaker', 'second'" in said
    over = OVER.replace("/", "excitation = 'second' /")
    analysis(nocdyn, "response", DISC + second + over + RUN)
    lines = table_of(nocdyn, "response_orders.csv")
    assert lines["phi_disc [rad]"] == pytest.approx(2 * angle_of(TURN * lines["frequency [Hz]"]), rel=1e-11)


@pytest.mark.parametrize(
    ("command", "text", "message"),
    [
        ("response", DISC.replace("&excitation", "&load name = 'l' body = 'disc' viscous = 1 /\n!") + OVER, "there is no shaker"),
        (
            "response",
            DISC + OVER.replace("/", "excitation = 'spring' /"),
            "'spring' is no harmonic excitation; allowed: excitation",
        ),
        ("response", DISC + "&response frequency_hz = 20, 10 /\n", "allowed: first the lower frequency, then the higher one"),
        (
            "response",
            DISC + "&response frequency_hz = 1, 2, 3 /\n",
            "3 frequencies; allowed: one, or the lowest and the highest one",
        ),
        ("response", DISC + OVER.replace("/", "speed_rpm = 3, 4 body = 'disc' /"), "speed_rpm and frequency_hz are both given"),
        ("response", DISC + "&response body = 'disc' /\n", "speed or frequency is missing; one of them is needed"),
        ("response", DISC + "&response speed = 3, 4 /\n", "speed needs body"),
        ("response", DISC + "&response body = 'disc' speed = 3, 4 excitation = 'shaker' /\n", "excitation needs frequency"),
        (
            "response",
            DISC
            + OVER
            + "&limit coupling = 'spring' rule = 'iacs_m68' diameter = 0.1 tensile_strength = 6e8 rated_speed = 9 /\n",
            "rule is for speeds, and &response is over the frequency of a shaker",
        ),
        ("campbell", DISC + OVER, "a Campbell diagram is over speeds"),
        (
            "response",
            DISC + OVER + "&fatigue name = 'f' coupling = 'spring' reference_moment = 1e3 reference_cycles = 1e6 slope = 5\n"
            "  profile_speeds = 9 profile_hours = 1 /\n",
            "profile_speeds are for speeds, and &response is over the frequency of a shaker",
        ),
    ],
)
def test_what_does_not_fit_is_refused(nocdyn, command, text, message):
    assert message in refusal(nocdyn, command, text + RUN)


def test_a_body_without_steady_speed_is_told_of_the_frequency(nocdyn):
    text = DISC + "&response body = 'disc' speed_rpm = 600, 1200 /\n" + RUN
    assert "allowed: a body that can turn on, or frequency in place of speed" in refusal(nocdyn, "response", text)


def test_a_drive_whose_speed_changes_has_no_response_over_the_frequency(nocdyn):
    text = DRIVEN.replace("speed = 100", "table_time = 0, 5 table_speed = 0, 100")
    assert "the speed of this drive changes; allowed: a constant speed" in refusal(nocdyn, "response", text + OVER + RUN)


def test_limits_hold_over_the_frequency(nocdyn):
    limit = "&limit coupling = 'spring' vibratory_moment = 100 /\n"
    report = analysis(nocdyn, "response", DISC + OVER + limit + RUN)
    (barred,) = report["barred_frequency_ranges"]
    line = report["verdict"]["lines"][0]
    # where |k + i c W| 10 / |k - W^2 + i c W| is 100
    w = np.sqrt(np.roots([1, 16 * (1 - 0.01) - 2e4, 1e8 * (1 - 0.01)]).real)
    expected = np.array(sorted(w)) / TURN
    assert [barred["from_Hz"], barred["to_Hz"]] == pytest.approx(list(expected), rel=1e-6)
    assert line["finding"] == "exceeded"
    assert line["frequencies_Hz"] == pytest.approx(list(expected), rel=1e-6)
    assert "speeds_rad_s" not in line
    outcome = nocdyn("response", "machine.nml", "--out", "again")
    assert f"exceeded at {expected[0]:.4g} to {expected[1]:.4g} Hz" in outcome.stdout


@needs_sweeps
def test_sweeps_record_the_peak_and_its_frequency(nocdyn):
    xarray = pytest.importorskip("xarray")
    sweep = "&sweep design = 'grid' /\n&vary target = 'body.disc.inertia' low = 0.8 high = 1.2 count = 3 /\n"
    record = "&record response = 'total_moment_spring' statistic = 'peak', 'peak_frequency' /\n"
    record += "&record path = 'response.resonances[1].frequency_Hz' /\n"
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", DISC + OVER + RUN + sweep + record), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    with xarray.open_dataset(nocdyn.folder / "out/sweep.nc") as data:
        assert data["total_moment_spring_peak_frequency"].attrs["units"] == "Hz"
        found = data["total_moment_spring_peak_frequency"].values
    assert found == pytest.approx(np.sqrt(1e4 / np.array([0.8, 1.0, 1.2])) / TURN, rel=1e-3)
    said = refusal(nocdyn, "sweep", DISC + OVER + RUN + sweep + record.replace("peak_frequency", "peak_speed"))
    assert "statistic = 'peak_speed': &response is over the frequency; allowed: 'peak_frequency'" in said
    said = refusal(nocdyn, "sweep", DISC + OVER + RUN + sweep + record.replace("statistic =", "order = 1 statistic =", 1))
    assert "the frequency of a shaker, which has no orders" in said


def test_figures_are_over_the_frequency(nocdyn, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(SOURCE / "scripts")
    from nocdyn_report.response_figures import Look, draw_page
    from nocdyn_report.speed_results import read_response

    analysis(nocdyn, "response", DISC + OVER + "&limit coupling = 'spring' vibratory_moment = 100 /\n" + RUN)
    response = read_response(nocdyn.folder / "out")
    assert (response.axis.label, response.axis.unit) == ("frequency of shaker", "Hz")
    assert [one.name for one in response.criticals] == ["I"]
    assert response.criticals[0].speed == pytest.approx(15.91, abs=0.01)
    assert response.barred[0].start < 15.91 < response.barred[0].end
    figure = draw_page(response, response.quantities, Look((10, 20)), {})
    assert figure.axes[0].get_xlabel() == "frequency of shaker [Hz]"
    (name,) = [text for text in figure.axes[0].texts if text.get_text() == "I"]
    assert name.get_rotation() == 0  # turned it would be a dash


def test_a_report_is_over_the_frequency(nocdyn):
    pytest.importorskip("jinja2")
    life = "&fatigue name = 'f' coupling = 'spring' reference_moment = 1000 reference_cycles = 1e6 slope = 5 /\n"
    nocdyn.write("machine.nml", DISC + OVER + "&limit coupling = 'spring' vibratory_moment = 100 /\n" + life + RUN)
    words = [sys.executable, "-m", "nocdyn_report", "report", "machine.nml", "--no-pdf", "--out", "out"]
    settings = {**os.environ, "PYTHONPATH": str(SOURCE / "scripts")}
    outcome = subprocess.run(words, cwd=nocdyn.folder, env=settings, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    assert "campbell     left out: &response is over the frequency of a shaker" in outcome.stdout
    page = (nocdyn.folder / "out/report.html").read_text()
    for text in ("frequencies of shaker from 10 to 20 Hz", "Barred ranges of frequency", "triangles: resonances",
                 "Damage of an hour over the frequency", "in which the shaker alone oscillates",
                 '"markName":"resonance, mode"', "no limit for passing is given"):  # fmt: skip
        assert text in page
    assert "triangles: critical speeds" not in page and "may be passed quickly" not in page
