"""The bundled runner on .pf files that must fail, each in its own way."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

RUNNER = Path(__file__).parent
COMPILE = [
    os.environ.get("FC", "gfortran"),
    "-std=f2018",
    "-Wall",
    "-Wextra",
    "-pedantic",
    "-Werror",
    "-g",
    "-fcheck=all",
    "-ffpe-trap=invalid,zero,overflow",
    "-ffree-line-length-none",
]
LIBRARY = ["funit_failures", "funit_numbers", "funit", "funit_runner"]

# Each statement with the line that it must print, or None where it must pass.
ASSERTIONS = [
    ("@assertEqual(1, 1)", None),
    ("@assertEqual(1, 2)", "expected 1, found 2"),
    ("@assertEqual(1, 2, message='why')", "why: expected 1, found 2"),
    ("@assertEqual([1, 2], [1, 3])", "expected 2, found 3, element [2]"),
    ("@assertEqual(4, reshape([4, 4, 4, 5], [2, 2]))", "expected 4, found 5, element [2, 2]"),
    ("@assertEqual([1, 2], [1, 2, 3])", "expected the shape [2], found [3]"),
    ("@assertEqual([integer ::], [integer ::])", None),
    ("@assertEqual([1], [integer ::])", "expected the shape [1], found [0]"),
    ("@assertEqual(reshape([1, 2], [2, 0]), reshape([1, 2], [2, 0]))", None),
    ("@assertEqual(reshape([1, 2], [1, 2]), reshape([1, 2], [2, 1]))", "expected the shape [1, 2], found [2, 1]"),
    ("@assertEqual(reshape([1, 2], [1, 1, 2]), reshape([1, 3], [1, 1, 2]))", "expected 2, found 3, element [1, 1, 2]"),
    ("@assertEqual(0.5_wp, 0.5_wp)", None),
    ("@assertEqual(1, 1.0_wp)", None),
    ("@assertEqual(0.5_wp, 0.75_wp, tolerance=0.25_wp)", None),
    (
        "@assertEqual(0.0_wp, spread([0.25_wp, 0.5_wp], 1, 2), tolerance=0.25_wp)",
        "expected 0.0000000000000000, found 0.50000000000000000, difference 0.50000000000000000, "
        "tolerance 0.25000000000000000, element [1, 2]",
    ),
    ("@assertEqual(nan, nan)", "expected NaN, found NaN"),
    ("@assertEqual([1.0_wp, nan], [1.0_wp, nan])", "expected NaN, found NaN, element [2]"),
    (
        "@assertEqual(1.0_wp, nan, tolerance=huge(1.0_wp))",
        "expected 1.0000000000000000, found NaN, difference NaN, tolerance 0.17976931348623157E+309",
    ),
    ("@assertEqual(infinity, infinity)", None),
    (
        "@assertEqual(infinity, -infinity, tolerance=1.0_wp)",
        "expected Inf, found -Inf, difference -Inf, tolerance 1.0000000000000000",
    ),
    ("@assertEqual('a b', ' a b  ')", None),
    ("@assertEqual('', '   ')", None),
    ("@assertEqual('a b', 'a  b')", "expected 'a b', found 'a  b'"),
    ("@assertEqual('ab', 'a')", "expected 'ab', found 'a'"),
    ("@assertEqual(.true., .false.)", "expected .true., found .false."),
    ("@assertNotEqual(1, 2)", None),
    ("@assertNotEqual(1, [2, 1])", "1 is not /= 1, element [2]"),
    ("@assertNotEqual(1.0_wp, nan)", "1.0000000000000000 is not /= NaN"),
    ("@assertNotEqual(infinity, infinity)", "Inf is not /= Inf"),
    ("@assertTrue(.true.)", None),
    ("@assertTrue(.false.)", "expected .true., found .false."),
    ("@assertTrue([.true., .false.])", "expected all .true., found .false."),
    ("@assertFalse(.false.)", None),
    ("@assertFalse([.false., .true.])", "expected all .false., found .true."),
    ("@assertLessThan(1, 2)", None),
    ("@assertLessThan(2, 2)", "2 is not < 2"),
    ("@assertLessThanOrEqual(2, [2, 1])", "2 is not <= 1, element [2]"),
    ("@assertGreaterThan(2.0_wp, 1.0_wp)", None),
    ("@assertGreaterThan(2.0_wp, nan)", "2.0000000000000000 is not > NaN"),
    ("@assertGreaterThanOrEqual(1, 2)", "1 is not >= 2"),
    ("@assertRelativelyEqual(100.0_wp, 101.0_wp, 0.01_wp)", None),
    (
        "@assertRelativelyEqual(0.0_wp, 0.0_wp, 0.5_wp)",
        "expected 0.0000000000000000, found 0.0000000000000000, difference 0.0000000000000000, "
        "tolerance 0.50000000000000000 of the expected value, which may not be 0",
    ),
    ("@assertIsFinite(1.0_wp)", None),
    ("@assertIsFinite(nan)", "expected a finite number, found an infinity or NaN"),
]


@pytest.fixture(scope="session")
def library(tmp_path_factory):
    folder = tmp_path_factory.mktemp("library")
    subprocess.run([*COMPILE, "-c", *(RUNNER / f"{name}.f90" for name in LIBRARY)], cwd=folder, check=True)
    return folder


def translate(folder, text, name="test_sample"):
    source = folder / f"{name}.pf"
    source.write_text(text)
    command = [sys.executable, RUNNER / "translate.py", source, folder / f"{name}.f90"]
    return subprocess.run(command, capture_output=True, text=True)


def build(folder, library, text):
    translation = translate(folder, text)
    assert translation.returncode == 0, translation.stderr
    objects = [library / f"{name}.o" for name in LIBRARY]
    subprocess.run([*COMPILE, f"-I{library}", "test_sample.f90", *objects, "-o", "sample"], cwd=folder, check=True)
    return lambda *options: subprocess.run([folder / "sample", *options], capture_output=True, text=True)


def sample(body, declarations=""):
    return f"module test_sample\n  use funit\n  implicit none\n{declarations}contains\n{body}end module test_sample\n"


def test_every_assertion_passes_and_fails_as_it_should(tmp_path, library):
    declarations = "integer, parameter :: wp = kind(1.0d0)\nreal(wp), volatile :: nan, infinity\n"
    body = (
        "@before\nsubroutine set()\nuse, intrinsic :: ieee_arithmetic\n"
        "nan = ieee_value(nan, ieee_quiet_nan)\ninfinity = ieee_value(nan, ieee_positive_inf)\nend subroutine\n"
    )
    first_line = 4 + (declarations + body).count("\n") + 2
    for i, (statement, _) in enumerate(ASSERTIONS):
        body += f"@test\nsubroutine t{i}()\n{statement}\nend subroutine\n"
    run = build(tmp_path, library, sample(body, declarations))()
    expected = [f"test_sample.pf:{first_line + 1 + 4 * i}: t{i}: {report}" for i, (_, report) in enumerate(ASSERTIONS) if report]
    assert run.stdout.splitlines() == [*expected, f"{len(ASSERTIONS)} tests, {len(expected)} failed"]
    assert run.returncode == 1


THREE_TESTS = sample("""
  @before
  subroutine prepare()
    print '(a)', 'prepare'
  end subroutine prepare
  @after
  subroutine clear()
    print '(a)', 'clear'
  end subroutine clear
  @test
  subroutine asserts_nothing()
  end subroutine asserts_nothing
  @TEST
  ! a comment may stand between
  subroutine stops_at_its_first_failure
    @asserttrue(.false.)
    @assertTrue(.false.)
    print '(a)', 'not reached'
  end subroutine stops_at_its_first_failure
  @test
  subroutine passes() ! as it should
    @assertTrue(.true.)
  end subroutine passes
""")


def test_fixtures_surround_every_test_and_a_failure_ends_only_its_own(tmp_path, library):
    run = build(tmp_path, library, THREE_TESTS)("--verbose")
    assert run.stdout.splitlines() == [
        "asserts_nothing",
        "prepare",
        "clear",
        "stops_at_its_first_failure",
        "prepare",
        "test_sample.pf:20: stops_at_its_first_failure: expected .true., found .false.",
        "clear",
        "passes",
        "prepare",
        "clear",
        "3 tests, 1 failed",
    ]
    assert (run.returncode, run.stderr) == (1, "")


def test_filter_and_exit_codes(tmp_path, library):
    sample_program = build(tmp_path, library, THREE_TESTS)
    run = sample_program("-f", "asse")
    assert run.stdout.splitlines()[-1] == "2 tests, 0 failed"
    assert run.returncode == 0
    run = sample_program("--filter", "nothing like it")
    assert (run.returncode, run.stderr) == (2, "no test has a name with 'nothing like it' in it\n")
    run = sample_program("--fliter")
    assert run.returncode == 2
    assert "unknown option '--fliter'" in run.stderr


def test_compiler_names_the_line_of_the_pf_file(tmp_path, library):
    source = sample("@test\nsubroutine proves()\n@assertTrue(.true.)\n@assertTrue(unknown)\nend subroutine\n")
    assert translate(tmp_path, source).returncode == 0
    compilation = subprocess.run(
        [*COMPILE, f"-I{library}", "-c", "test_sample.f90"], cwd=tmp_path, capture_output=True, text=True
    )
    assert f"{tmp_path / 'test_sample.pf'}:8:" in compilation.stderr


@pytest.mark.parametrize(
    "body, line, mistake",
    [
        ("@test\nsubroutine proves()\n@assertEquals(1, 1)\nend subroutine\n", 7, "unknown annotation @assertEquals: did you"),
        ("@test\nsubroutine proves()\n@assertTrue(.true.) ! so\nend subroutine\n", 7, "all on its line and nothing after"),
        ("@test\nsubroutine proves()\n@assertTrue( &\n.true.)\nend subroutine\n", 7, "all on its line"),
        ("@test(ifdef=X)\nsubroutine proves()\nend subroutine\n", 5, "@test stands alone"),
        ("@test\nsubroutine proves(this)\nend subroutine\n", 6, "expected 'subroutine NAME()' after @test"),
        ("@test\ninteger function proves()\nend function\n", 6, "expected 'subroutine NAME()' after @test"),
        ("subroutine proves()\nend subroutine\n", 1, "no @test in this file"),
        ("pure integer function run()\nend function\n", 5, "run is a name of pFUnit's; call it something else"),
        ("subroutine Near()\nend subroutine\n", 5, "Near is a name of pFUnit's"),
        ("subroutine t()\nend subroutine\n", 5, "t is a name of pFUnit's"),
        (
            "@before\nsubroutine a()\nend subroutine\n@before\nsubroutine b()\nend subroutine\n@test\nsubroutine c()\n"
            "end subroutine\n",
            1,
            "more than one @before",
        ),
    ],
)
def test_mistakes_are_refused_with_file_and_line(tmp_path, body, line, mistake):
    translation = translate(tmp_path, sample(body))
    assert translation.returncode == 1
    assert f"test_sample.pf:{line}: error: " in translation.stderr
    assert mistake in translation.stderr
    assert not (tmp_path / "test_sample.f90").exists()


@pytest.mark.parametrize(
    "declarations, line, name",
    [
        ("integer, parameter :: many = 3, run = 4\n", 4, "run"),
        ("character(len=*), parameter :: text = 'a, run', &\n  Every = 'b'\n", 5, "Every"),
        ("use other, only: all_of => none, some\n", 4, "all_of"),
        ("use other, only: unheard_of, finalize\n", 4, "finalize"),
        ("type :: predicate\ninteger :: i\nend type predicate\n", 4, "predicate"),
        ("interface is\nmodule procedure is_so\nend interface is\n", 4, "is"),
        ("type :: own\ninteger :: near\ncontains\nprocedure :: run\nend type own\nreal :: t\n", 9, "t"),
    ],
)
def test_names_of_pfunit_are_refused_where_a_module_declares_them(tmp_path, declarations, line, name):
    translation = translate(tmp_path, sample("@test\nsubroutine proves()\ninteger :: t\nend subroutine\n", declarations))
    place = f"{tmp_path / 'test_sample.pf'}:{line}"
    assert translation.stderr == f"{place}: error: {name} is a name of pFUnit's; call it something else\n"


def test_module_must_be_named_as_its_file(tmp_path):
    translation = translate(tmp_path, sample("@test\nsubroutine proves()\nend subroutine\n"), name="test_other")
    assert translation.returncode == 1
    assert "the file must hold 'module test_other'" in translation.stderr
