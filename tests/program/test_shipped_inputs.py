"""The inputs stay real namelists: Fortran's own read, f90nml and nocdyn find the same values in them."""

import math
import os
import shutil
import subprocess

import f90nml
import pytest
from conftest import DATA, SOURCE, first_case

INPUTS = sorted((SOURCE / "input").rglob("*.nml")) + sorted(DATA.glob("*.nml"))
WITHOUT_TABLE_FILES = [path for path in INPUTS if "table_file" not in path.read_text()]
# the reader lacks the keys of the one, and a run of a load case leaves groups out of the others
READ_BY_FORTRAN = [path for path in WITHOUT_TABLE_FILES if path.stem != "electrical_kinds" and not first_case(path)]


UNITS = {"_rpm": math.pi / 30, "_hz": 2 * math.pi, "_deg": math.pi / 180}


def unit_of(key):
    """The ending of a key that is not in SI."""
    return next((unit for unit in UNITS if key.endswith(unit)), "")


def in_si(value, unit):
    return [one * unit for one in value] if isinstance(value, list) else value * unit


def names(path):
    return path.stem


@pytest.fixture(scope="module")
def fortran_reader(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reader")
    reader = folder / "read_namelists"
    compiler = os.environ.get("FC", "gfortran")
    subprocess.run([compiler, "-o", reader, DATA / "read_namelists.f90"], cwd=folder, check=True)

    def read(path):
        return subprocess.run([reader, path], capture_output=True, text=True, check=True).stdout.splitlines()

    return read


def used_input(nocdyn, path):
    """input.nml of a run of this file, or of its first load case."""
    case = first_case(path)
    assert nocdyn("run", path, "--out", "out", *case).returncode == 0
    return nocdyn.folder / "/".join(("out", *case[1:], "input.nml"))


def groups(namelist):
    """Pairs of group name and values, one for each group of the file."""
    for kind, value in namelist.items():
        for group in value if isinstance(value, list) else [value]:
            yield kind, dict(group)


def is_of_other_cases(cases, kind, values):
    """Whether the first of the load cases leaves a group out."""
    named = [element for case in cases[1:] for element in as_list(case.get("with", []))]
    return kind == "load_case" or "load_case" in values or (kind == "excitation" and values["name"] in named)


def as_list(value):
    return value if isinstance(value, list) else [value]


def test_there_are_inputs():
    assert len(INPUTS) >= 4


@pytest.mark.parametrize("path", READ_BY_FORTRAN, ids=names)
def test_fortran_reads_the_same_values(nocdyn, fortran_reader, path):
    # Fortran's read takes file names of limited length only
    shutil.copy(path, nocdyn.folder / "given.nml")
    assert fortran_reader(nocdyn.folder / "given.nml") == fortran_reader(used_input(nocdyn, path))


@pytest.mark.parametrize("path", INPUTS, ids=names)
def test_f90nml_reads_the_same_values(nocdyn, path):
    all_given = list(groups(f90nml.read(path)))
    cases = [values for kind, values in all_given if kind == "load_case"]
    given = [pair for pair in all_given if not is_of_other_cases(cases, *pair)]
    used = list(groups(f90nml.read(used_input(nocdyn, path))))
    # groups that the file lacks stand at the end
    assert [kind for kind, _ in given] == [kind for kind, _ in used][: len(given)]
    for (_, values), (_, all_values) in zip(given, used):
        # in place of a table's file stand its values
        values = {key: value for key, value in values.items() if not key.endswith("_file")}
        # in place of a number in a unit of the field stands that in SI
        values = {
            key.removesuffix(unit_of(key)): in_si(value, UNITS[unit_of(key)]) for key, value in values.items() if unit_of(key)
        } | {key: value for key, value in values.items() if not unit_of(key)}
        assert values == {key: all_values[key] for key in values}


@pytest.mark.parametrize("path", INPUTS, ids=names)
def test_check_finds_no_fault(nocdyn, path):
    outcome = nocdyn("check", path)
    assert (outcome.returncode, outcome.stderr) == (0, "")
