"""The threads of a sweep make texts in one module alone, which does it in a critical section.

gfortran keeps the lengths of texts that functions return in static memory. The symbols of an object file name them: `slen.1`
and so on.
"""

import os
import pathlib
import re
import subprocess

import pytest
from conftest import SOURCE

SERIAL = "serial_work"  # the module that makes texts for the threads
# What threads run in the engine and for the statistics. The procedures of other modules that make texts, e.g. the names of
# components, are called by `SERIAL` only.
RUN_BY_THREADS = [
    "sweep",
    "sweep_block",
    "variant_machines",
    "direct_parameters",
    "scheduler",
    "journal_scheduler",
    "linear_statistics",
    "linear_accumulators",
    "linear_columns",
    "step_strips",
    "sampled_statistics",
    "recorded_columns",
    "settling_time",
]
LENGTHS = re.compile(r" [bBdD] (slen\.[0-9.]+)$", re.MULTILINE)


def lengths_in(module):
    """The static lengths in the object file of a module."""
    [source] = (SOURCE / "src").rglob(f"{module}.f90")
    object_file = (
        pathlib.Path(os.environ["NOCDYN_BUILD"]) / "src/CMakeFiles/nocdyn.dir" / f"{source.relative_to(SOURCE / 'src')}.o"
    )
    return LENGTHS.findall(subprocess.run(["nm", object_file], check=True, capture_output=True, text=True).stdout)


def test_critical_sections_are_in_one_module():
    critical = re.compile(r"^ *!\$omp critical", re.MULTILINE)
    assert {path.stem for path in (SOURCE / "src").rglob("*.f90") if critical.search(path.read_text(encoding="utf-8"))} == {
        SERIAL
    }


def test_no_other_module_that_threads_run_has_the_length_of_a_text_in_static_memory():
    if not lengths_in(SERIAL):
        pytest.skip("this compiler has no static lengths by that name")
    assert {module: lengths_in(module) for module in RUN_BY_THREADS if lengths_in(module)} == {}
