"""No memory is allocated per step or per row: the number of allocations does not depend on how many there are."""

import os
import subprocess

import pytest
from conftest import CASE_2, DATA


@pytest.fixture(scope="module")
def counter(tmp_path_factory):
    library = tmp_path_factory.mktemp("counter") / "count_allocations.so"
    compiler = os.environ.get("CC", "cc")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", library, DATA / "count_allocations.c"], check=True)
    return library


def allocations(nocdyn, counter, *overrides):
    file = nocdyn.folder / "allocations"
    words = [word for override in overrides for word in ("--set", override)]
    environment = os.environ | {"LD_PRELOAD": str(counter), "ALLOCATIONS": str(file)}
    assert nocdyn("run", CASE_2, "--quiet", "--out", "out", *words, env=environment).returncode == 0
    return int(file.read_text())


@pytest.mark.parametrize("method", ["rk45", "rosenbrock"])
@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_nothing_is_allocated_in_the_time_loop(nocdyn, counter, formulation, method):
    common = [f"run.formulation={formulation}", f"run.method={method}"]
    few = allocations(nocdyn, counter, *common, "output.points=101", "run.rtol=1e-4")
    steps = nocdyn.summary("out")["counts"]["accepted_steps"]
    many = allocations(nocdyn, counter, *common, "output.points=901", "run.rtol=1e-9")
    assert nocdyn.summary("out")["counts"]["accepted_steps"] > 2 * steps
    assert few > 1000  # the counter counts
    assert many == few
