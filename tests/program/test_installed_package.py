"""cmake --install, and a project that finds and calls what was installed."""

import json
import os
import re
import subprocess
import sys

import pytest
from conftest import CASE_1, SOURCE

# State of case 1 at t = 10 s, and the accuracy of the tolerances in spin_up.f90.
SPEEDS = [3.45430601101172, 3.45430595814429, -2.30287063876286]
ACCURACY = 1e-8


def run(*words):
    outcome = subprocess.run(list(map(str, words)), check=False, capture_output=True, text=True, timeout=120)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    return outcome.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    folder = tmp_path_factory.mktemp("installed")
    run("cmake", "--install", os.environ["NOCDYN_BUILD"], "--prefix", folder)
    return folder


def test_the_installed_program_runs(prefix):
    assert run(prefix / "bin/nocdyn", "--version").startswith("nocdyn ")


def test_the_installed_program_has_the_rules_and_shows_their_files(prefix, tmp_path):
    files = sorted((SOURCE / "src/analyse/rules").glob("*.rule"))
    installed = sorted((prefix / "share/nocdyn/rules").iterdir())
    assert [path.name for path in installed] == [path.name for path in files] != []
    assert [path.read_bytes() for path in installed] == [path.read_bytes() for path in files]
    (tmp_path / "machine.nml").write_text(
        "&body name = 'a' inertia = 1 /\n&body name = 'b' inertia = 2 /\n&run t_end = 1 /\n"
        "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 damping = 1 diameter = 0.1 /\n"
        "&response body = 'a' speed = 10, 20 orders = 1 /\n&excitation name = 'x' body = 'a' kind = 'orders' orders = 1 "
        "amplitudes = 1 /\n&limit coupling = 'k' rule = 'kr_generator' rated_speed = 18 /\n"
    )
    assert "KR generator shaft" in run(prefix / "bin/nocdyn", "response", tmp_path / "machine.nml", "--out", tmp_path / "out")


@pytest.fixture
def elsewhere(prefix, tmp_path, monkeypatch):
    """An empty folder, and the installed program, called there without the sources in sight."""
    monkeypatch.chdir(tmp_path)
    for name in ("NOCDYN", "NOCDYN_SOURCE", "NOCDYN_BUILD", "PYTHONPATH"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("NOCDYN_PYTHON", sys.executable)
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    return prefix / "bin/nocdyn"


def test_the_installed_program_writes_units_for_co_simulation(elsewhere, tmp_path, monkeypatch):
    monkeypatch.delenv("NOCDYN_LIBRARY", raising=False)
    assert run(elsewhere, "fmu", CASE_1) == "case1.fmu: FMI 2.0, co-simulation\n"
    assert (tmp_path / "case1.fmu").stat().st_size > 0


def test_the_installed_program_verifies_itself(elsewhere, prefix, tmp_path):
    assert run(elsewhere, "verify", "bodies", "sweeps").startswith("All ")
    outcome = json.loads((tmp_path / "results/verification.json").read_text())
    assert outcome["passes"] and {case["feature"] for case in outcome["cases"]} == {"bodies", "sweeps"}
    cases = [
        {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        for folder in (prefix / "share/nocdyn/verification", SOURCE / "verification")
    ]
    assert cases[0] == cases[1]


def test_the_installed_program_reports_and_plots(elsewhere, prefix, tmp_path):
    run(elsewhere, "new", "machine.nml")
    assert "report.html" in run(elsewhere, "report", "machine.nml", "--no-pdf")
    page = (tmp_path / "results/machine/report.html").read_text()
    assert (prefix / "share/nocdyn/d3.min.js").read_text() in page
    assert "figures" in run(elsewhere, "plot", "results/machine", "--format", "png")
    assert list((tmp_path / "results/machine/figures").glob("*.png"))


def test_the_installed_program_draws_the_figures_of_the_paper(elsewhere, tmp_path):
    run(elsewhere, "plot", "paper")
    assert (tmp_path / "results/figures/figure5.pdf").is_file()


@pytest.mark.parametrize(
    ("page", "words"),
    [
        ("man1/nocdyn.1", ["NAME", "nocdyn run FILE... [--out DIR]", "nocdyn plot KIND DIR", "EXIT STATUS"]),
        ("man5/nocdyn-input.5", ["&coupling", "stiffness (number", "nocdyn(1)", "moment of inertia about the axis"]),
    ],
)
def test_the_manual_pages_say_what_the_program_says(prefix, page, words):
    roff = (prefix / "share/man" / page).read_text()
    assert not [line for line in roff.splitlines() if line.startswith((".", "'")) and line.split()[0] not in REQUESTS]
    plain = re.sub(r"\\(&|f[BIR])", "", roff).replace("\\-", "-").replace("\\(aq", "'")
    assert all(word in plain for word in words)
    assert max(map(len, plain.splitlines())) < LONGEST_LINE


REQUESTS = {".TH", ".SH", ".SS", ".TP", ".P", ".RS", ".RE", ".nf", ".fi"}
LONGEST_LINE = 1000


@pytest.fixture(scope="module")
def consumer(prefix, tmp_path_factory):
    """The folder of the programs of another project."""
    build = tmp_path_factory.mktemp("consumer")
    compiler = os.environ.get("FC", "gfortran")
    run(
        "cmake",
        "-S",
        SOURCE / "tests/package",
        "-B",
        build,
        f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_Fortran_COMPILER={compiler}",
    )
    run("cmake", "--build", build)
    return build


def test_another_project_finds_the_package_and_integrates_with_it(consumer):
    rows, *speeds = run(consumer / "spin_up", CASE_1).split()
    assert rows == "3"
    assert list(map(float, speeds)) == pytest.approx(SPEEDS, rel=ACCURACY)


@pytest.mark.parametrize(
    ("mistake", "rule"),
    [
        ("states", "there is at least one state"),
        ("lanes", "there is at least one lane"),
        ("quadratures", "the number of quadratures is not negative"),
        ("equation", "every component has an equation"),
        ("kink", "a function in the formulas is not smooth, or is for elements of machines"),
        ("lane", "there is no such lane"),
        ("parameters", "the number of parameters stays the same"),
    ],
)
def test_wrong_formulas_end_with_the_rule(consumer, mistake, rule):
    outcome = subprocess.run([consumer / "wrong_formulas", mistake], check=False, capture_output=True, text=True)
    assert outcome.returncode != 0
    assert f"nocdyn_formula_system: {rule}" in outcome.stderr


def test_formulas_without_a_mistake_are_accepted(consumer):
    run(consumer / "wrong_formulas", "none")


def test_the_installed_package_can_be_moved(prefix, tmp_path):
    moved = prefix.rename(prefix.parent / "moved")
    try:
        run("cmake", "-S", SOURCE / "tests/package", "-B", tmp_path, f"-DCMAKE_PREFIX_PATH={moved}")
    finally:
        moved.rename(prefix)


def test_no_installed_text_names_the_folder_of_the_build(prefix):
    for path in prefix.rglob("*.cmake"):
        text = path.read_text()
        assert os.environ["NOCDYN_BUILD"] not in text and str(SOURCE) not in text, path


def test_the_package_adds_no_link_options(prefix):
    for path in prefix.rglob("*.cmake"):
        text = path.read_text()
        assert "wrap" not in text and "INTERFACE_LINK_OPTIONS" not in text, path


def test_a_version_that_does_not_fit_is_refused(prefix, tmp_path):
    project = (SOURCE / "tests/package/CMakeLists.txt").read_text().replace("nocdyn 0.2", "nocdyn 99")
    (tmp_path / "CMakeLists.txt").write_text(project)
    (tmp_path / "spin_up.f90").write_text("end\n")
    (tmp_path / "wrong_formulas.f90").write_text("end\n")
    words = ["cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={prefix}"]
    outcome = subprocess.run(words, check=False, capture_output=True, text=True)
    assert outcome.returncode != 0
    assert 'requested version "99"' in outcome.stderr
