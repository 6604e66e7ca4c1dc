"""nocdyn plot, report, fmu and verify: which Python they become, what they pass on, what is said where something is missing."""

import os
import shutil
import sys

import pytest
from conftest import SOURCE, SPINNER, Program
from figure_files import assert_figures

ECHO = '#!/bin/sh\nprintf "%s\\n" "NAME" "$NOCDYN" "$PYTHONPATH" "$@"\n'


def stand_in(path, name="stand-in"):
    """A Python that prints what it was given."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(ECHO.replace("NAME", name))
    path.chmod(0o755)
    return path


@pytest.fixture
def installed(nocdyn):
    """The program with the packages in a prefix, far from the sources."""
    prefix = nocdyn.folder / "prefix"
    (prefix / "bin").mkdir(parents=True)
    (prefix / "share/nocdyn").mkdir(parents=True)
    (prefix / "share/nocdyn/python").symlink_to(SOURCE / "scripts")
    program = Program(nocdyn.folder)
    program.executable = shutil.copy(nocdyn.executable, prefix / "bin/nocdyn")
    return program


def test_the_words_after_the_command_are_passed_on_unread(nocdyn):
    python = stand_in(nocdyn.folder / "python")
    outcome = nocdyn("plot", "--ouy", "-x=1", "two words", "", "--", env={"NOCDYN_PYTHON": str(python)})
    name, program, packages, *words = outcome.stdout.split("\n")[:-1]
    assert (name, words) == ("stand-in", ["-m", "nocdyn_report", "plot", "--ouy", "-x=1", "two words", "", "--"])
    assert os.path.samefile(program, nocdyn.executable)
    assert os.path.samefile(packages, SOURCE / "scripts")


def test_a_search_path_of_modules_is_kept(nocdyn):
    python = stand_in(nocdyn.folder / "python")
    outcome = nocdyn("verify", env={"NOCDYN_PYTHON": str(python), "PYTHONPATH": "/mine"})
    assert outcome.stdout.split("\n")[2].endswith(":/mine")


def test_python_is_the_named_one_else_beside_the_program_else_in_the_path(installed):
    folder = installed.folder
    path = f"{folder}/none::{folder}/other"
    stand_in(folder / "other/python3", "in PATH")
    assert installed("report", env={"PATH": path}).stdout.startswith("in PATH\n")
    stand_in(folder / "prefix/bin/python3", "beside")
    assert installed("report", env={"PATH": path}).stdout.startswith("beside\n")
    named = {"PATH": path, "NOCDYN_PYTHON": str(stand_in(folder / "named"))}
    assert installed("report", env=named).stdout.startswith("stand-in\n")


def refusal(program, *words, **environment):
    outcome = program(*words, env=environment)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr.count("\n") == 1 and outcome.stderr.startswith("nocdyn: ")
    return outcome.stderr


def test_without_python_the_message_says_so(installed):
    message = refusal(installed, "plot", "results", PATH=str(installed.folder))
    assert "nocdyn plot needs Python, and there is no python3 in the PATH; the environment variable NOCDYN_PYTHON" in message


def test_a_python_that_cannot_be_started_is_named(installed):
    message = refusal(installed, "report", "m.nml", NOCDYN_PYTHON="/none/python3")
    assert message == "nocdyn: '/none/python3', which nocdyn report needs, cannot be started: No such file or directory\n"


def test_without_the_packages_of_nocdyn_the_message_names_their_folder(installed):
    (installed.folder / "prefix/share/nocdyn/python").unlink()
    message = refusal(installed, "verify")
    assert "/prefix/bin/../share/nocdyn/python', which does not exist; cmake --install brings it" in message


@pytest.mark.parametrize(
    ("command", "words", "packages"),
    [
        ("plot", ["run", "results"], "matplotlib|numpy|pandas"),
        ("report", ["m.nml"], "f90nml|Jinja2|markdown-it-py|numpy|pandas"),
        ("verify", [], "matplotlib|numpy"),
    ],
)
def test_a_missing_package_is_named_with_what_brings_it(nocdyn, command, words, packages):
    bare = nocdyn.write("python", f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')  # without what is installed
    bare.chmod(0o755)
    message = refusal(nocdyn, command, *words, NOCDYN_PYTHON=str(bare))
    name = message.removeprefix(f"nocdyn: nocdyn {command} needs the Python package ").split(",")[0]
    assert name in packages.split("|")
    assert message.endswith(f" does not have: pip install {name}, or name another Python by NOCDYN_PYTHON\n")


def test_modules_in_the_folder_of_work_are_not_taken(nocdyn):
    nocdyn.write("argparse.py", "raise SystemExit('a file of the user')\n")
    assert nocdyn("verify", "--help", env=PYTHON).stdout.startswith("usage: nocdyn verify")


PYTHON = {"NOCDYN_PYTHON": sys.executable, "PATH": os.environ["PATH"]}


def test_an_old_python_is_refused(monkeypatch, capsys):
    monkeypatch.syspath_prepend(SOURCE / "scripts")
    from nocdyn_report import __main__ as commands

    monkeypatch.setattr(commands, "OLDEST", (3, 99))
    assert commands.main("plot", []) == 3
    assert "nocdyn plot needs Python 3.99 or newer, this is 3." in capsys.readouterr().err


SPEEDS = """\
&body name = 'a' inertia = 1.0 speed = 1.0 /
&body name = 'b' inertia = 2.0 speed = 1.0 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 100.0 damping = 1.0 /
&excitation name = 'x' body = 'a' kind = 'orders' orders = 1 amplitudes = 1.0 /
&load name = 'drag' body = 'b' viscous = 0.5 /
&response body = 'a' speed = 5.0, 20.0 count = 11 orders = 1 /
&run t_end = 1.0 /
"""


@pytest.fixture(scope="module")
def results(shared_nocdyn):
    """Of a run, a response and modes, in one folder."""
    machine = shared_nocdyn.write("machine.nml", SPEEDS)
    for command in ("run", "response", "modes"):
        outcome = shared_nocdyn(command, machine, "--out", "results")
        assert outcome.returncode == 0, outcome.stderr
    return shared_nocdyn.folder / "results"


def test_plot_draws_all_that_a_folder_holds(nocdyn, results):
    outcome = nocdyn("plot", results, "--out", "figures", "--format", "png", env=PYTHON)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout.count(" are in figures\n") == 3
    names = {path.stem for path in (nocdyn.folder / "figures").iterdir()}
    assert {"motion", "modes", "total_moment"} <= names


def test_plot_draws_one_kind_with_its_options(nocdyn, results):
    outcome = nocdyn("plot", "response", results, "--log", "--format=png", "--out", "figures", env=PYTHON)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert_figures(nocdyn.folder / "figures", "total_moment", formats=("png",))


def test_options_of_one_kind_need_the_kind_where_there_are_several(nocdyn, results):
    outcome = nocdyn("plot", results, "--log", env=PYTHON)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn plot: --log is for one kind of results, and there are several: "
        "nocdyn plot run, nocdyn plot modes, nocdyn plot response\n"
    )


def test_options_of_the_only_kind_need_no_kind(nocdyn):
    assert nocdyn.done(SPINNER).returncode == 0
    outcome = nocdyn("plot", "--format", "png", "out", "--rpm", env=PYTHON)
    assert outcome.returncode == 0, outcome.stderr
    assert (nocdyn.folder / "out/figures/motion.png").is_file()


def test_plot_of_a_folder_without_results_says_what_is_missing(nocdyn):
    outcome = nocdyn("plot", "none", env=PYTHON)
    assert outcome.returncode == 3
    assert outcome.stderr.startswith("nocdyn plot run: none: ")


def test_plot_without_a_folder_shows_its_usage(nocdyn):
    wrong, asked = nocdyn("plot", env=PYTHON), nocdyn("plot", "--help", env=PYTHON)
    assert (wrong.returncode, asked.returncode) == (2, 0)
    assert asked.stdout == wrong.stdout and asked.stdout.startswith("usage: nocdyn plot [KIND] RESULTS")


def test_plot_paper_computes_and_draws_the_cases_of_the_paper(nocdyn):
    outcome = nocdyn("plot", "paper", env=PYTHON)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "uniform motion" in outcome.stdout
    assert_figures(nocdyn.folder / "results/figures", "figure2", "figure3", "figure4", "figure5")


def test_verify_computes_with_this_program(nocdyn):
    outcome = nocdyn("verify", "modes.two_discs.f1", "--out", "out", env=PYTHON)
    assert outcome.returncode == 0, outcome.stderr
    assert nocdyn.files("out") == ["verification.html", "verification.json", "verification.pdf"]


@pytest.mark.parametrize("command", ["plot", "report", "fmu", "verify"])
def test_their_help_is_of_the_program_and_says_how_to_get_the_options(nocdyn, command):
    text = nocdyn("help", command).stdout
    assert text.startswith(f"nocdyn {command} ") and text.split("\n")[0].endswith(" [OPTION]...")
    assert f"\n  nocdyn {command}" in text and "--help" in text and "NOCDYN_PYTHON" in text
