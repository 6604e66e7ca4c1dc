"""`nocdyn verify`: all cases pass, and whatever is wrong with one is told."""

import csv
import json
import os
import shutil
import subprocess
import sys

import pytest
from conftest import SOURCE

CASES = SOURCE / "verification"
LEAST, LEAST_BY_HAND = 120, 40


def verify(folder, *words):
    return subprocess.run(
        [sys.executable, "-m", "nocdyn_verify", "--out", "out", *map(str, words)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(SOURCE / "scripts"), "NOCDYN": os.environ["NOCDYN"]},
        capture_output=True,
        text=True,
        check=False,
    )


def report(folder):
    return json.loads((folder / "out/verification.json").read_text())


@pytest.fixture
def own(tmp_path):
    """Cases of one's own: one of two discs."""
    folder = tmp_path / "cases"
    shutil.copytree(CASES / "modes/two_discs", folder / "modes/two_discs")
    with (CASES / "modes/cases.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    row = next(row for row in rows if row["id"] == "two_discs.f1")

    def write(**changes):
        with (folder / "modes/cases.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, row.keys())
            writer.writeheader()
            writer.writerow({**row, **changes})
        return verify(tmp_path, "--cases", folder)

    write.folder = tmp_path
    write.input = folder / "modes/two_discs/case.nml"
    return write


def test_all_cases_pass(tmp_path):
    outcome = verify(tmp_path)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    result = report(tmp_path)
    assert result["passes"] and len(result["cases"]) >= LEAST
    origins = [case["origin"] for case in result["cases"]]
    assert origins.count("closed form") + origins.count("published") >= LEAST_BY_HAND
    assert len({case["feature"] for case in result["cases"]}) == 15
    page = (tmp_path / "out/verification.html").read_text()
    assert f"All {len(origins)} cases pass." in page and result["installation"]["program"] in page
    assert all(case["id"] in page for case in result["cases"])
    assert (tmp_path / "out/verification.pdf").read_bytes().startswith(b"%PDF-")
    assert not list((tmp_path / "out").glob("*.part"))


def test_every_feature_says_what_is_not_verified():
    for folder in {path.parent for path in CASES.glob("*/cases.csv")}:
        assert "## What is not verified\n" in (folder / "about.md").read_text(), folder.name


def test_every_folder_of_a_case_is_used():
    for table in CASES.glob("*/cases.csv"):
        with table.open(newline="") as file:
            used = {row["folder"] for row in csv.DictReader(file)}
        assert used == {path.parent.name for path in table.parent.glob("*/case.nml")}, table


def test_another_machine_fails(own):
    text = own.input.read_text()
    own.input.write_text(text.replace("stiffness = 3000", "stiffness = 3000.001"))
    assert own.input.read_text() != text
    outcome = own()
    assert outcome.returncode == 1
    assert "modes.two_discs.f1: natural frequency: 7.95774" in outcome.stderr and "expected 7.95774" in outcome.stderr
    assert "1 of 1 cases fail: modes.two_discs.f1." in (own.folder / "out/verification.html").read_text()
    assert not report(own.folder)["passes"]


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"at": "mode = 7"}, "0 rows of modes.csv have mode = 7"),
        ({"signal": "no_column"}, "there is no column no_column"),
        ({"command": "modes --range_hz 1"}, "--range_hz"),
    ],
)
def test_a_case_without_a_value_fails_with_the_reason(own, changes, problem):
    outcome = own(**changes)
    assert outcome.returncode == 1
    assert problem in outcome.stderr
    assert "FAIL" in (own.folder / "out/verification.html").read_text()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"expected": "seven"}, "cases.csv:2: expected = 'seven'; allowed: a number"),
        ({"tolerance": "0"}, "cases.csv:2: tolerance = '0'; allowed: a number above 0"),
        ({"error": "both"}, "cases.csv:2: error = 'both'; allowed: relative, absolute"),
        ({"expected": "0"}, "cases.csv:2: error = 'relative'; allowed: absolute, as 0 is expected"),
        ({"origin": "nocdyn"}, "cases.csv:2: origin = 'nocdyn'; allowed: closed form, published"),
        ({"folder": "nowhere"}, "cases.csv:2: folder = 'nowhere'; allowed: a folder beside the table with case.nml"),
    ],
)
def test_tables_are_refused_with_their_line(own, changes, message):
    outcome = own(**changes)
    assert outcome.returncode == 2
    assert message in outcome.stderr
    assert not (own.folder / "out").exists()


def test_features_and_cases_are_chosen_by_name(tmp_path):
    assert verify(tmp_path, "campbell", "modes.two_discs.f1", "--quiet").stdout == ""
    assert {case["feature"] for case in report(tmp_path)["cases"]} == {"campbell", "modes"}
    outcome = verify(tmp_path, "sails")
    assert outcome.returncode == 2 and "there is no case or feature 'sails'; allowed: " in outcome.stderr


def test_a_folder_without_cases_is_refused(tmp_path):
    outcome = verify(tmp_path, "--cases", tmp_path)
    assert outcome.returncode == 3
    assert "there is no folder of a feature with cases.csv" in outcome.stderr
    assert verify(tmp_path, "--cases", tmp_path / "none").returncode == 3
