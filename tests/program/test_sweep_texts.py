"""The threads of a sweep make texts at the same time only where no length of a text is in memory that they share.

gfortran keeps the lengths of allocatable texts that functions return in static memory of the caller. The symbols of an object
file name them: `slen.1` and so on.
"""

import os
import pathlib
import re
import subprocess

import pytest
from conftest import SOURCE

THREADS = "nocdyn_sweep"  # runs the threads
SERIAL = "nocdyn_serial_work"  # what one thread at a time does
EMBEDDED = {"nocdyn_live_machine", "nocdyn_c_interface"}  # likewise, of machines in the threads of another program

# Modules that threads could reach, by `use`, and that have such lengths: in procedures that threads do not call at the same time.
BEFORE_THREADS = {
    *("sweep_plan", "sweep_design", "input_text", "target_consistency", "table_file", "text_file", "posix", "posix_files"),
    *("recorded_analyses", "recorded_orbits", "target_patterns", "column_names", "output_units", "json", "name_checks"),
    *("namelist_values", "data_table", "unit_expressions", "measured_signals"),
}
VALUES_OF_A_VARIANT = {
    *("targets", "target_search", "key_path", "group_checks", "raw_group", "value_conversion", "schema_text", "schema_units"),
    "input",
}
NAMES_IN_FAILURES = {"solver_status", "formulation", "system"}
PROGRAMS = {"code_text", "law_code", "machine_code", "reduced", "series_code", "switch_code"}  # in the critical section
ANALYSES = {  # wrong limits and rules, which the base machine has too; modes at a time; reports
    *("limit_groups", "response_limits", "limit_rules", "rule_files", "rule_expressions", "solve", "margins"),
}
REPORTS = {  # of recorded paths, in the critical section
    *(
        "comparisons",
        "csv",
        "energy_balance",
        "hidden_file",
        "holzer",
        "holzer_report",
        "machine_report",
        "output_file",
        "table_text",
    ),
    *(f"{command}_{part}" for command in ("campbell", "response", "modes") for part in ("files", "report", "results")),
    *("equilibrium_report", "equilibrium_results", "report_openings", "response_verdict", "verdicts"),
}
ORBITS = {  # in the critical section, with their runs; without a journal
    "log_file",
    *(path.stem for path in (SOURCE / "src/analyse/orbit").rglob("*.f90")),
}
ALLOWED = REPORTS | ORBITS | BEFORE_THREADS | VALUES_OF_A_VARIANT | NAMES_IN_FAILURES | PROGRAMS | ANALYSES | {"serial_work"}

LENGTHS = re.compile(r"^(\S+):\S+ [bBdD] slen\.[0-9.]+$", re.MULTILINE)


def modules():
    """The source of each module, and the modules that it uses."""
    found = {}
    for path in (SOURCE / "src").rglob("*.f90"):
        text = path.read_text(encoding="utf-8")
        for name in re.findall(r"^module (\w+)", text, re.MULTILINE):
            found[name] = path, set(re.findall(r"^ *use (nocdyn_\w+)", text, re.MULTILINE))
    return found


def within_reach(first, found):
    """The modules that `first` uses, directly or by others."""
    reached, waiting = set(), [first]
    while waiting:
        name = waiting.pop()
        if name not in reached and name in found:
            reached.add(name)
            waiting.extend(found[name][1])
    return reached


def with_lengths(sources):
    """Those of the modules whose object files have static lengths."""
    folder = pathlib.Path(os.environ["NOCDYN_BUILD"]) / "src/CMakeFiles/nocdyn.dir"
    object_files = {str(folder / f"{source.relative_to(SOURCE / 'src')}.o"): source for source in sources}
    symbols = subprocess.run(["nm", "-A", *object_files], check=True, capture_output=True, text=True).stdout
    return {object_files[name] for name in LENGTHS.findall(symbols)}


def test_critical_sections_are_in_few_modules():
    critical = re.compile(r"^ *!\$omp critical", re.MULTILINE)
    sources = (SOURCE / "src").rglob("*.f90")
    assert {f"nocdyn_{path.stem}" for path in sources if critical.search(path.read_text(encoding="utf-8"))} == {SERIAL} | EMBEDDED


def test_what_threads_run_at_the_same_time_has_no_length_of_a_text_in_static_memory():
    found = modules()
    if not with_lengths([found[SERIAL][0]]):
        pytest.skip("this compiler has no static lengths by that name")
    reached = within_reach(THREADS, found)
    assert len(reached) > 100
    assert {source.stem for source in with_lengths([found[name][0] for name in reached])} <= ALLOWED
