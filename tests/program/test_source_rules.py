"""Rules for the Fortran sources that CONTRIBUTING.md states: their length, their arguments, their comments."""

import functools
import re
from collections import Counter
from pathlib import Path

import pytest
from conftest import SOURCE
from fortran_sources import read_source

LEAST_SOURCES, LEAST_PROCEDURES, LEAST_LINKS = 200, 1500, 100  # fewer in src were not found where they are
MOST_LINES_OF_A_FILE = 500
MOST_LINES_OF_A_PROCEDURE = 80
USUAL_LINES_OF_A_PROCEDURE = 40  # of nine procedures in ten
MOST_ARGUMENTS = 8
LINK = re.compile(r"\[\[(nocdyn_\w+)(?:\(module\))?:?(\w*)(?:\(\w+\))?\]\]")
FOLDERS = ("src", "tests", "bench", "docs/examples")  # files .f90; those of the tests, .pf, may be longer

# arrays are arguments of their own, so that the compiler knows that they are contiguous and do not overlap
KERNEL = "kernel"

# Procedures with more arguments, by file, and why.
MANY_ARGUMENTS = {
    "src/analyse/statistics/linear_statistics.f90": (KERNEL, "bound_excess"),
    "src/analyse/statistics/range_filter.f90": (KERNEL, "bound_components"),
    "src/analyse/statistics/step_strips.f90": (
        KERNEL,
        "add_integrals",
        "add_pair",
        "exclude_by_hull",
        "expand",
        "expand_single",
        "set_pair",
    ),
    "src/integrate/core/stage_sums.f90": (KERNEL, "sum_few_terms", "sum_many_terms"),
    "src/integrate/dense_output/extremes.f90": (KERNEL, "find_states"),
    "src/model/constraints/coordinates.f90": (
        "constructor: what the analysis of the constraints has found, and the bodies that the user wants",
        "build_coordinates",
    ),
    "src/model/elements/polynomial_laws.f90": (KERNEL, "moments"),
    "src/model/formulations/kernels/reduced_series.f90": (KERNEL, "expand"),
    "src/model/formulations/kernels/series_kernel.inc": (KERNEL, "accelerate", "begin_motion", "find_moments", "find_values"),
    "src/base/formulas/law_harmonics.inc": (KERNEL, "harmonic_sum"),
    "src/base/contract/sparse_map.f90": (
        KERNEL,
        "multiply_lanes",
        "multiply_rows",
        "pair_of_band",
        "pair_of_chain",
        "pair_of_rows",
        "pair_of_toeplitz",
        "pair_on_lanes",
    ),
}

# Longer procedures, by file, and why.
LONG_PROCEDURES: dict[str, tuple[str, ...]] = {}

# Arguments in src/model that need no comment: src/base/contract says what they are.
ARGUMENTS_OF_THE_CONTRACT = {"t", "y", "dydt", "dfdy", "dfdt"}


@functools.cache
def sources(folder):
    """Path from the project's folder -> what the file holds."""
    return {
        path.relative_to(SOURCE).as_posix(): read_source(path)
        for path in sorted((SOURCE / folder).rglob("*"))
        if path.suffix in (".f90", ".inc")
    }


def procedures(folder):
    """(path, source, procedure) of all procedures that are not those of an interface."""
    for path, source in sources(folder).items():
        for procedure in source.procedures:
            if not procedure.is_interface:
                yield path, source, procedure


def exceptions(table, folder):
    """(path, name) of the procedures of a folder that the table excepts."""
    return {(path, name) for path, (_, *names) in table.items() for name in names if path.startswith(folder + "/")}


def test_the_test_sees_the_sources():
    assert len(sources("src")) >= LEAST_SOURCES
    assert len(list(procedures("src"))) >= LEAST_PROCEDURES


@pytest.mark.parametrize("folder", FOLDERS)
def test_procedures_with_many_arguments_are_exceptions_with_a_reason(folder):
    many = {(path, p.name) for path, _, p in procedures(folder) if len(p.arguments) > MOST_ARGUMENTS}
    allowed = exceptions(MANY_ARGUMENTS, folder)
    assert sorted(many - allowed) == [], "too many arguments"
    assert sorted(allowed - many) == [], "these need no exception"


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_file_is_too_long(folder):
    lengths = {path: len(source.lines) for path, source in sources(folder).items()}
    assert {path: length for path, length in lengths.items() if length > MOST_LINES_OF_A_FILE} == {}


@pytest.mark.parametrize("folder", FOLDERS)
def test_long_procedures_are_exceptions_with_a_reason(folder):
    long = {(path, p.name) for path, _, p in procedures(folder) if p.lines > MOST_LINES_OF_A_PROCEDURE}
    allowed = exceptions(LONG_PROCEDURES, folder)
    assert sorted(long - allowed) == [], "too long"
    assert sorted(allowed - long) == [], "these need no exception"


def test_most_procedures_are_short():
    lengths = [procedure.lines for _, _, procedure in procedures("src")]
    longer = sum(length > USUAL_LINES_OF_A_PROCEDURE for length in lengths)
    assert longer <= 0.1 * len(lengths)


def test_a_type_has_a_name_of_its_own():
    places = {}
    for path in sorted((SOURCE / "src").rglob("*.f90")):
        for name in re.findall(r"^  type\b(?!\()[^!\n]*?\b(\w+_t)\s*$", path.read_text(encoding="utf-8"), re.MULTILINE):
            places.setdefault(name.lower(), []).append(path.name)
    assert len(places) > 300
    assert {name: files for name, files in places.items() if len(files) > 1} == {}


def test_public_procedures_have_a_doc_comment():
    bare = [
        f"{path}: {procedure.name}"
        for path, source, procedure in procedures("src")
        if procedure.host is None and procedure.name.lower() in source.public and not procedure.doc
    ]
    assert not bare, "\n".join(bare)


def test_links_of_the_pages_lead_to_public_names():
    """[[module:name]] and [[module(module)]] of pages and doc comments."""
    public = {f"nocdyn_{Path(path).stem}": source.public for path, source in sources("src").items()}
    paths = [*(SOURCE / "docs/pages").glob("*.md"), *(SOURCE / "src").rglob("*.f90")]
    links = [(path.name, link) for path in paths for link in LINK.findall(path.read_text(encoding="utf-8"))]
    assert len(links) >= LEAST_LINKS
    lost = [
        f"{name}: [[{module}:{item}]]"
        for name, (module, item) in links
        if module not in public or (item and item.lower() not in public[module])
    ]
    assert not lost, "\n".join(lost)


def test_real_arguments_in_model_have_a_comment():
    """Those of public procedures, of interfaces, and of bindings that no other type has, which is no override."""
    bindings = Counter(binding for source in sources("src").values() for binding in source.bindings.values())
    bare = []
    for path, source in sources("src/model").items():
        for procedure in source.procedures:
            name = procedure.name.lower()
            is_own = name in source.bindings and bindings[source.bindings[name]] == 1
            if procedure.host is None and (procedure.is_interface or name in source.public or is_own):
                bare += [
                    f"{path}: {name}: {a.name}"
                    for a in procedure.arguments
                    if a.is_real and not a.comment and a.name not in ARGUMENTS_OF_THE_CONTRACT
                ]
    assert not bare, "\n".join(bare)
