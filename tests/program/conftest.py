"""What the whole-program tests share: the executable, and a folder to run it in."""

import csv
import json
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

SOURCE = Path(os.environ["NOCDYN_SOURCE"])
DATA = Path(__file__).parent / "data"
BUILD_SETTINGS = (Path(os.environ["NOCDYN_BUILD"]) / "CMakeCache.txt").read_text()
TRAPS_EXCEPTIONS = "CMAKE_BUILD_TYPE:STRING=Debug" in BUILD_SETTINGS
IS_SANITIZED = "-fsanitize=address" in BUILD_SETTINGS  # takes terabytes of addresses, and memory of its own
IS_SLOW = TRAPS_EXCEPTIONS or IS_SANITIZED  # takes several times as long as release
FORTRAN_FLAGS = re.search(r"^CMAKE_Fortran_FLAGS:STRING=(.*)$", BUILD_SETTINGS, re.MULTILINE)[1]
CASE_1 = SOURCE / "input/paper/case1.nml"
CASE_2 = SOURCE / "input/paper/case2.nml"

# By how much a row may lie outside of the extremes, which are those of the polynomials that replace columns in the steps:
POLYNOMIALS = 1e-5  # of the range of the column
BALANCE = 1e-8  # of the energy balance, a small difference of energies, which themselves are replaced [J]


def first_case(path):
    """Options that choose the first load case of an input, if it has any."""
    found = re.search(r"^&load_case +name = '(\w+)'", path.read_text(), re.MULTILINE)
    return ("--case", found[1]) if found else ()


# For what a slow build shows no better, and other tests compute there too.
fast_only = pytest.mark.skipif(IS_SLOW, reason="takes long in a slow build")


def all_if_fast(*values):
    """Values of a parameter of tests; in a slow build the first one."""
    return values[:1] if IS_SLOW else values


# A run that no test waits for, with few rows.
ENDLESS = ("--set", "run.t_end=1e6", "--set", "run.max_steps=100000000", "--set", "output.interval=1")


class Values(dict):
    """The numbers of columns, by their labels or without the units."""

    def __missing__(self, name):
        return self.by_name()[name]

    def by_name(self):
        return {label.split(" [")[0]: values for label, values in self.items()}


class Program:
    """The executable, run in a folder of its own."""

    def __init__(self, folder):
        self.folder = folder
        self.executable = os.environ["NOCDYN"]

    def __call__(self, *words, **options):
        words = [self.executable, *map(str, words)]
        return subprocess.run(words, cwd=self.folder, check=False, capture_output=True, text=True, timeout=120, **options)

    def start(self, *words, **options):
        words = [self.executable, *map(str, words)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        return subprocess.Popen(words, cwd=self.folder, **(pipes | options))

    def start_endless(self, folder, *words, **options):
        """A run of case 2 that has begun to integrate."""
        process = self.start("run", CASE_2, "--out", folder, *words, *ENDLESS, **options)
        wait_for(lambda: list((self.folder / folder).glob(".trajectory.csv.*")))
        return process

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def files(self, folder):
        return sorted(path.name for path in (self.folder / folder).iterdir())

    def table(self, folder, name="trajectory.csv"):
        """Header and rows of numbers."""
        with open(self.folder / folder / name, newline="") as file:
            header, *rows = csv.reader(file)
        return header, [[float(cell) for cell in row] for row in rows]

    def values(self, folder="out", name="trajectory.csv"):
        """The columns of a table of numbers."""
        header, rows = self.table(folder, name)
        return Values(zip(header, np.array(rows).T, strict=True))

    def done(self, text, *words, command="run"):
        """A command that succeeds on an input with this text, its results in the folder `out`; what it printed."""
        outcome = self(command, self.write("machine.nml", text), "--out", "out", *words)
        assert outcome.returncode == 0, outcome.stderr
        return outcome

    def summary(self, folder):
        return json.loads((self.folder / folder / "summary.json").read_text())

    def columns(self, folder, name="columns.json"):
        """What the columns of a table of results are."""
        return json.loads((self.folder / folder / name).read_text())["columns"]


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


@pytest.fixture
def nocdyn(tmp_path_factory):
    return Program(tmp_path_factory.mktemp("run"))  # not tmp_path, whose long name messages would cut


@pytest.fixture(scope="module")
def shared_nocdyn(tmp_path_factory):
    return Program(tmp_path_factory.mktemp("run"))


# A machine without gears, for tests to which the physics does not matter.
SPINNER = """\
&body name = 'disc' inertia = 2.0 speed = 1.0 /
&load name = 'drag' body = 'disc' viscous = 0.5 /
&run t_end = 1.0 /
&output points = 11 /
"""


@pytest.fixture
def spinner(nocdyn):
    return nocdyn.write("spinner.nml", SPINNER)


def peak_memory(nocdyn, *words):
    """Of a run that succeeds [MB], and its output."""
    file = nocdyn.folder / "peak"
    limits = "import resource, subprocess, sys; out = subprocess.run(sys.argv[2:], capture_output=True, text=True, check=True)"
    script = (
        f"{limits}; open(sys.argv[1], 'w').write(str(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)); print(out.stdout)"
    )
    command = [sys.executable, "-c", script, file, nocdyn.executable, *words]
    output = subprocess.run(command, cwd=nocdyn.folder, check=True, capture_output=True, text=True).stdout
    return int(file.read_text()) / 1024, output
