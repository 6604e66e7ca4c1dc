"""The commands in Python: files and outputs that cannot be written are one line and exit code 3; an interruption is 1."""

import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import SOURCE

MACHINE = """
&body name = 'a' inertia = 1.0 speed = 1.0 /
&body name = 'b' inertia = 1.0 /
&coupling name = 's' bodies = 'a', 'b' stiffness = 100.0 damping = 0.1 /
&run t_end = 1.0 /
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("failures")
    (folder / "m.nml").write_text(MACHINE, encoding="utf-8")
    subprocess.run([os.environ["NOCDYN"], "run", "--quiet", "--out", folder / "r", folder / "m.nml"], check=True)
    subprocess.run([os.environ["NOCDYN"], "modes", "--out", folder / "r", folder / "m.nml"], check=True, capture_output=True)
    return folder / "r"


def start(*words, **options):
    environment = os.environ | {"PYTHONPATH": str(SOURCE / "scripts")}
    command = [sys.executable, "-m", "nocdyn_report", *map(str, words)]
    return subprocess.Popen(command, env=environment, text=True, stderr=subprocess.PIPE, **options)


def said_of(*words, **options):
    """Exit code and standard error."""
    started = start(*words, **options)
    return started.communicate(timeout=120)[1], started.returncode


@pytest.mark.parametrize("kind", ["run", "modes"])
def test_figures_that_cannot_be_written_are_one_line(results, kind, tmp_path):
    (tmp_path / "file").write_text("")
    for place in ("/proc/nocdyn", tmp_path / "file", tmp_path / "file/below"):
        said, code = said_of("plot", kind, results, "--out", place, "--format", "svg", stdout=subprocess.DEVNULL)
        assert code == 3 and said.startswith(f"nocdyn: {place}: ") and said.count("\n") == 1


def test_an_output_that_is_full_is_one_line(results, tmp_path):
    with open("/dev/full", "w") as full:
        for words in (["plot", "run", results, "--out", tmp_path / "f", "--format", "svg"], ["plot", "--help"]):
            assert said_of(*words, stdout=full) == ("nocdyn: standard output: No space left on device\n", 3)


def test_an_output_that_nobody_reads_is_no_traceback(results, tmp_path):
    started = start("plot", "run", results, "--out", tmp_path / "f", "--format", "svg", stdout=subprocess.PIPE)
    started.stdout.close()
    assert (started.wait(timeout=120), started.stderr.read()) == (3, "")


def test_an_interruption_has_the_exit_code_of_the_other_commands(results, tmp_path):
    started = start("plot", "run", results, "--out", tmp_path, stdout=subprocess.DEVNULL)
    while started.poll() is None and not list(tmp_path.iterdir()):
        time.sleep(0.01)
    started.send_signal(signal.SIGINT)
    assert (started.communicate(timeout=60)[1], started.returncode) == ("nocdyn plot: interrupted\n", 1)
