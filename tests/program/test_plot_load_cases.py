"""nocdyn plot: of a folder with load cases, the figures of each are drawn beside its results, and bear its name."""

import json
import shutil
import subprocess

import pytest
from figure_files import NOCDYN
from nocdyn_report import plot

MACHINE = """&case title = 'Costs $5' /
&body name = 'motor' inertia = 2.0 speed = 30 /
&body name = 'pump' inertia = 1.0 speed = 30 /
&coupling name = 'shaft' bodies = 'motor', 'pump' stiffness = 1e4 damping = 1.0 /
&motor name = 'drive' body = 'motor' a = 100.0 b = 1.0 c = 0.0 /
&load name = 'work' body = 'pump' quadratic = 0.08 /
&excitation name = 'orders' body = 'motor' kind = 'orders' orders = 1, 2 amplitudes = 3.0, 5.0 /
&response body = 'motor' speed = 20, 90 count = 20 /
&load_case name = 'calm' /
&load_case name = 'rough' set = 'excitation.orders.amplitudes=6,9' /
&run t_end = 0.5 /
"""
COMMANDS = ("run", "modes", "campbell", "response")


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cases")
    (folder / "m.nml").write_text(MACHINE, encoding="utf-8")
    for command in COMMANDS:
        subprocess.run([NOCDYN, command, folder / "m.nml", "--out", folder / "r"], check=True, capture_output=True)
    return folder / "r"


def test_all_kinds_of_all_load_cases_are_drawn_and_name_their_case(results, capsys):
    assert plot.main([str(results), "--format", "svg"]) == 0
    told = [line.rsplit(" are in ")[1] for line in capsys.readouterr().out.splitlines() if " are in " in line]
    assert told == [str(results / case / "figures") for _ in COMMANDS for case in ("calm", "rough")]
    for case in ("calm", "rough"):
        figures = list((results / case / "figures").glob("*.svg"))
        assert {"modes.svg", "campbell.svg", "motion.svg", "torques.svg"} <= {one.name for one in figures}
        nameless = [one.name for one in figures if f"Costs $5: load case {case}" not in one.read_text(encoding="utf-8")]
        assert nameless == []


@pytest.mark.parametrize("kind", COMMANDS)
def test_one_kind_of_all_load_cases_is_drawn(results, kind, capsys):
    assert plot.main([kind, str(results), "--format", "svg"]) == 0
    out = capsys.readouterr().out
    assert out.count(" are in ") == 2 and f"{results / 'rough/figures'}" in out


@pytest.mark.parametrize("command", COMMANDS[1:])
def test_a_report_names_its_load_case(results, command):
    for case in ("calm", "rough"):
        assert json.loads((results / case / f"{command}.json").read_text())["load_case"] == case


@pytest.mark.parametrize(
    ("kind", "file", "change", "message"),
    [
        ("run", "trajectory.csv", lambda text: text[:-7], "is cut inside its last row"),
        ("modes", "modes.json", lambda text: text.replace('"frequency_Hz"', '"other"'), "compute them again"),
        ("response", "response.json", lambda text: text.replace('"mode"', '"other"'), "compute them again"),
    ],
)
def test_a_file_that_is_cut_or_lacks_what_is_inside_is_refused_in_one_line(
    results, tmp_path, capsys, kind, file, change, message
):
    folder = shutil.copytree(results / "calm", tmp_path / "r")
    (folder / file).write_text(change((folder / file).read_text()))
    assert plot.main([kind, str(folder)]) == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"nocdyn plot {kind}") and message in line


def test_a_word_that_is_no_kind_is_told_with_the_kinds(results, capsys):
    assert plot.main(["foo", str(results)]) == 2
    assert capsys.readouterr().err == (
        "nocdyn plot: 'foo' is no kind of results; there are: run, modes, campbell, response, orbit, transit, fit, sweep, paper\n"
    )


def test_figures_of_the_paper_have_the_formats_that_are_asked_for(tmp_path):
    assert plot.main(["paper", "--out", str(tmp_path), "--format", "svg"]) == 0
    assert {one.name for one in (tmp_path / "figures").iterdir()} == {f"figure{number}.svg" for number in (2, 3, 4, 5)}
