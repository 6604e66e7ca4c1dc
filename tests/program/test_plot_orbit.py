"""nocdyn plot orbit: what is in the figures of periodic motions, and what is refused."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from figure_files import NOCDYN, assert_figures, call, refusal
from nocdyn_report import orbit_figures, plot
from nocdyn_report.orbit_results import read_orbits, read_settled

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit

SPRING = """&case title = 'Costs $5' /
&body name = 'mass $' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass $' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass $' amplitude = 0.18 frequency = 0.8 /
&run t_end = 10.0 /
&orbit over = 'excitation.shaker.frequency' range = 0.8, 1.6 motions = 1.2, 1.5 spectrum = .true. /
"""
CASES = "&load_case name = 'weak' set = 'excitation.shaker.amplitude=0.01' /\n&load_case name = 'strong' /\n"
FOLDS = (1.2696019555, 1.1157002518)


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """The results of the spring, and of two load cases of it."""
    folder = tmp_path_factory.mktemp("orbit")
    for name, text in (("one", SPRING), ("cases", SPRING + CASES)):
        (folder / f"{name}.nml").write_text(text, encoding="utf-8")
        subprocess.run([NOCDYN, "orbit", folder / f"{name}.nml", "--out", folder / name], check=True, capture_output=True)
    return folder


@pytest.fixture
def results(computed, tmp_path):
    """A copy that a test may change."""
    return shutil.copytree(computed / "one", tmp_path / "r")


def half_ranges(results, settled=None):
    orbits = read_orbits(results)
    return orbits, orbit_figures.draw_half_ranges(orbits, orbits.loads(), settled)


def test_the_stable_parts_are_solid_the_unstable_one_is_broken_and_they_meet(results):
    orbits, figure = half_ranges(results)
    curves = [line for line in figure.axes[0].get_lines() if line.get_marker() == "None"]
    assert [line.is_dashed() for line in curves] == [False, True, False]
    ends = [(line.get_xdata()[0], line.get_xdata()[-1]) for line in curves]
    assert np.ravel(ends)[1:-1] == pytest.approx([FOLDS[0], FOLDS[0], FOLDS[1], FOLDS[1]], abs=1e-8)
    assert sum(len(line.get_xdata()) for line in curves) == len(orbits.table) + 2


def test_folds_are_marked_with_their_values_and_jumps_are_arrows(results):
    _, figure = half_ranges(results)
    axes = figure.axes[0]
    marks = [line.get_xdata()[0] for line in axes.get_lines() if line.get_marker() == "o"]
    assert marks == pytest.approx(FOLDS, abs=1e-8)
    assert {"1.2696", "1.1157"} <= {text.get_text() for text in axes.texts}
    arrows = [text for text in axes.texts if text.arrow_patch is not None]
    assert len(arrows) == 2
    down, up = ((arrow.xyann[1], arrow.xy[1]) for arrow in arrows)
    assert down[0] > 5 > 1 > down[1]
    assert up[0] < up[1]


def test_settled_runs_are_dots(results, tmp_path, monkeypatch):
    table = tmp_path / "runs.csv"
    table.write_text("excitation.shaker.frequency [rad/s],half_range_total_moment_spring [N m]\n0.9,0.8\n1.5,0.15\n")
    orbits = read_orbits(results)
    settled = read_settled(table, orbits)
    _, figure = half_ranges(results, settled)
    (dots,) = [line for line in figure.axes[0].get_lines() if line.get_marker() == "."]
    assert list(dots.get_xdata()) == [0.9, 1.5]
    table.write_text("f,other\n1,2\n")
    assert "no column is a half range of orbit.csv" in refusal(monkeypatch, "orbit_figures", results, "--runs", table)
    assert "there is no such table" in refusal(monkeypatch, "orbit_figures", results, "--runs", tmp_path / "none.csv")


def test_a_motion_in_its_phase_plane_is_closed_and_has_its_speed(results):
    orbits = read_orbits(results)
    assert [one.value for one in orbits.motions] == [1.2, 1.2, 1.2, 1.5]
    for motion in orbits.motions:
        speed = motion.table["omega_mass $ [rad/s]"].to_numpy()
        assert motion.rate("phi_mass $ [rad]") == pytest.approx(speed, abs=1e-9)
        wave = motion.wave("twist_spring [rad]")
        assert wave[0] == pytest.approx(wave[-1], abs=1e-12)


def test_the_command_draws_all_kinds_of_figures_of_each_load_case(computed, tmp_path, capsys, monkeypatch):
    plot.main([str(computed / "cases"), "--format", "png"])
    told = capsys.readouterr().out
    for case in ("weak", "strong"):
        assert f"{case}/figures" in told
        assert (computed / "cases" / case / "figures/orbit_total_moment.png").exists()
        assert (computed / "cases" / case / "figures/orbit_phase_planes_1.png").exists()
    call(monkeypatch, "orbit_figures", computed / "one", "--out", tmp_path, "--columns", "phi_*")
    names = "orbit_phi", "orbit_phase_planes_1", "orbit_phase_planes_2", "orbit_harmonics_phi_mass $"
    assert_figures(tmp_path, *names)


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        ("orbit.csv", lambda text: text[: len(text) // 2], "orbit.csv"),
        ("orbit.csv", lambda text: text.rsplit("\n", 2)[0] + "\n", "its points are not all there"),
        ("orbit.json", lambda text: text.replace('"special_points"', '"other"'), "this is no orbit.json of nocdyn"),
        ("orbit.json", lambda text: text[:-5], "is no complete JSON"),
        ("motion_1.csv", lambda text: text.replace("t [s]", "time"), "is no complete motion"),
        ("orbit_harmonics.csv", lambda text: text.rsplit("\n", 2)[0].rsplit("\n", 9)[0] + "\n", "orbit_harmonics.csv"),
    ],
)
def test_files_that_do_not_fit_together_are_refused(results, file, change, message, monkeypatch):
    path = results / file
    path.write_text(change(path.read_text()))
    assert message in refusal(monkeypatch, "orbit_figures", results)


def test_what_is_not_there_is_said(results, monkeypatch):
    assert "no signal matches 'stress_*'" in refusal(monkeypatch, "orbit_figures", results, "--columns", "stress_*")
    content = json.loads((results / "orbit.json").read_text())
    (results / content["motions"][0]["file"]).unlink()
    assert "no motion_1.csv here" in refusal(monkeypatch, "orbit_figures", results)
    (results / "orbit.json").unlink()
    assert "nocdyn orbit FILE --out" in refusal(monkeypatch, "orbit_figures", results)
