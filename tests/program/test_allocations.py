"""No memory is allocated per step or per row: the number of allocations does not depend on how many there are."""

import os
import shutil
import subprocess
from itertools import product

import pytest
from conftest import CASE_2, DATA, SOURCE

# The buffer of summary.json grows by doubling: another length of its numbers may be one doubling more or less.
DOUBLINGS = 1

# Where a summary has many numbers, some of other lengths may need another piece of memory each.
NUMBERS = 5

EXAMPLES = SOURCE / "input/examples"


@pytest.fixture(scope="module")
def counter(tmp_path_factory):
    library = tmp_path_factory.mktemp("counter") / "count_allocations.so"
    compiler = os.environ.get("CC", "cc")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, DATA / "count_allocations.c"], check=True)
    return library


def allocations(nocdyn, counter, path, *overrides):
    file = nocdyn.folder / "allocations"
    shutil.rmtree(nocdyn.folder / "out", ignore_errors=True)  # names that are there are read
    words = [word for override in overrides for word in ("--set", override)]
    environment = os.environ | {"LD_PRELOAD": str(counter), "ALLOCATIONS": str(file)}
    assert nocdyn("run", path, "--quiet", "--out", "out", *words, env=environment).returncode == 0
    return int(file.read_text())


@pytest.mark.parametrize(
    ("formulation", "method"),
    [*product(["reduced", "paper", "multiplier"], ["auto", "rk45", "rk853", "rodas4", "rodas5p"]), ("reduced", "taylor")],
)
def test_nothing_is_allocated_in_the_time_loop(nocdyn, counter, formulation, method):
    common = [f"run.formulation={formulation}", f"run.method={method}"]
    loose = ("run.rtol=1e-4", "run.atol=1e-4", "run.t_end=10.0")
    few = allocations(nocdyn, counter, CASE_2, *common, "output.points=101", *loose)
    summary = nocdyn.summary("out")
    assert summary["extremes"] == "of the motion"  # so that following the columns is counted too
    tight = ("run.rtol=1e-9", "run.atol=1e-9", "run.t_end=20.0")
    many = allocations(nocdyn, counter, CASE_2, *common, "output.points=901", *tight)
    assert nocdyn.summary("out")["counts"]["accepted_steps"] > 2 * summary["counts"]["accepted_steps"]
    assert few > 1000  # the counter counts
    assert abs(many - few) <= DOUBLINGS


def test_nothing_is_allocated_when_auto_switches(nocdyn, counter):
    common = ["run.method=auto", "coupling.coupling.damping=1e4"]
    few = allocations(nocdyn, counter, CASE_2, *common, "run.rtol=1e-5")
    steps = nocdyn.summary("out")["method"]
    many = allocations(nocdyn, counter, CASE_2, *common, "run.rtol=1e-7")
    more_steps = nocdyn.summary("out")["method"]
    assert steps["switches"] == more_steps["switches"] == 1  # the summary names each switch
    assert more_steps["implicit_steps"] > 2 * steps["implicit_steps"] > 0
    assert abs(many - few) <= DOUBLINGS


@pytest.mark.parametrize(("kinds", "end"), [("every_kind.nml", 3), ("electrical_kinds.nml", 11)])
@pytest.mark.parametrize("method", ["auto", "rk45", "rodas5p"])
@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_nothing_is_allocated_by_elements_of_every_kind(nocdyn, counter, kinds, end, formulation, method):
    common = [f"run.formulation={formulation}", f"run.method={method}", "run.rtol=1e-6", "run.atol=1e-6"]
    common += [f"output.extremes_from={0.4 * end}"]  # the summary lists those in the transient of the start
    few = allocations(nocdyn, counter, DATA / kinds, *common, f"run.t_end={end}")
    steps = nocdyn.summary("out")["counts"]["accepted_steps"]
    many = allocations(nocdyn, counter, DATA / kinds, *common, f"run.t_end={2 * end}")
    assert nocdyn.summary("out")["counts"]["accepted_steps"] > steps + 100
    assert abs(many - few) <= NUMBERS


# Clutches that lock and slip, also beside cardan joints, which move, and teeth that lose.
@pytest.mark.parametrize("example", ["coupled_clutches", "car_driveline", "winch", "hybrid"])
@pytest.mark.parametrize("method", ["rk853", "rodas5p"])
def test_nothing_is_allocated_per_step_where_joints_lock(nocdyn, counter, example, method):
    path = EXAMPLES / example / f"{example}.nml"
    few = allocations(nocdyn, counter, path, f"run.method={method}", "run.rtol=1e-6")
    before = nocdyn.summary("out")
    many = allocations(nocdyn, counter, path, f"run.method={method}", "run.rtol=1e-8")
    after = nocdyn.summary("out")
    assert after["counts"]["accepted_steps"] > 1.3 * before["counts"]["accepted_steps"]
    assert len(after["joint_events"]) == len(before["joint_events"])  # which decide the modes anew, in work space of their own
    assert many - few <= NUMBERS
