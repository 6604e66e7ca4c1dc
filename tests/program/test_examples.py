"""The examples of the documentation: built as their reader would, they print what the pages quote."""

import os
import re
import subprocess

import pytest
from conftest import FORTRAN_FLAGS, SOURCE

PAGES = SOURCE / "docs" / "pages"
QUOTED = {
    name: output
    for page in sorted(PAGES.glob("*.md"))
    for name, output in re.findall(
        r"<!-- fill: run (\w+) -->\n\n```text\n\$ [^\n]*\n(.*?)```\n\n<!-- filled -->",
        page.read_text(encoding="utf-8"),
        re.DOTALL,
    )
}


def run(*words):
    outcome = subprocess.run(list(map(str, words)), check=False, capture_output=True, text=True, timeout=120)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    return outcome.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    prefix, build = tmp_path_factory.mktemp("installed"), tmp_path_factory.mktemp("build")
    run("cmake", "--install", os.environ["NOCDYN_BUILD"], "--prefix", prefix)
    run(
        "cmake",
        "-S",
        SOURCE / "docs/examples",
        "-B",
        build,
        f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_Fortran_COMPILER={os.environ.get('FC', 'gfortran')}",
        f"-DCMAKE_Fortran_FLAGS={FORTRAN_FLAGS}",  # instrumentation needs its libraries
    )
    run("cmake", "--build", build)
    return build


def test_every_example_is_quoted():
    programs = re.findall(r"add_executable\((\w+) ", (SOURCE / "docs/examples/CMakeLists.txt").read_text(encoding="utf-8"))
    assert sorted(programs) == sorted(QUOTED)


@pytest.mark.parametrize("example", QUOTED)
def test_an_example_prints_what_the_page_quotes(example, built):
    assert run(built / example) == QUOTED[example]
