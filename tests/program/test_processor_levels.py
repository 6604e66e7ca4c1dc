"""Programs for levels of x86-64 beside the one for all processors: which one runs."""

import shutil
from pathlib import Path

import pytest
from conftest import Program

FLAGS = next((line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("flags")), "").split()
needs_v3 = pytest.mark.skipif(not {"avx2", "bmi2", "fma"} <= set(FLAGS), reason="the processor has not the level x86-64-v3")


@pytest.fixture
def moved(nocdyn):
    """The program in a folder of its own, with a name."""

    def moved(name="nocdyn"):
        (nocdyn.folder / "bin").mkdir(exist_ok=True)
        program = Program(nocdyn.folder)
        program.executable = shutil.copy(nocdyn.executable, nocdyn.folder / "bin" / name)
        return program

    return moved


def stand_in(nocdyn, name, text='#!/bin/sh\necho "$0" "$@"\n'):
    path = nocdyn.write(f"bin/{name}", text)
    path.chmod(0o755)
    return path


@needs_v3
def test_the_program_for_the_level_of_the_processor_runs_in_place_of_the_general_one(moved):
    general = moved()
    faster = stand_in(general, "nocdyn-x86-64-v3")
    assert general("run", "a b.nml").stdout == f"{faster} run a b.nml\n"


def test_a_level_that_the_processor_has_not_is_left_alone(moved):
    general = moved()
    stand_in(general, "nocdyn-x86-64-v5")
    assert general("--version").stdout.startswith("nocdyn ")


@needs_v3
def test_a_faster_program_that_cannot_be_started_is_done_without(moved):
    general = moved()
    stand_in(general, "nocdyn-x86-64-v3", "")
    assert general("--version").stdout.startswith("nocdyn ")


@needs_v3
def test_a_faster_program_looks_for_no_other(moved):
    faster = moved("nocdyn-x86-64-v2")
    stand_in(faster, "nocdyn-x86-64-v2-x86-64-v3")
    stand_in(faster, "nocdyn-x86-64-v3")
    assert faster("--version").stdout.startswith("nocdyn ")


def test_a_faster_program_starts_the_sweeps_of_its_level(moved):
    faster = moved("nocdyn-x86-64-v3")
    stand_in(faster, "nocdyn-sweep")
    companion = stand_in(faster, "nocdyn-sweep-x86-64-v3")
    assert faster("merge", "results").stdout == f"{companion} merge results\n"
