"""`nocdyn verify`: all cases pass, and whatever is wrong with one is told."""

import csv
import json
import os
import shutil
import subprocess
import sys

import pytest
from conftest import SOURCE
from verified import cases, known

CASES = SOURCE / "verification"
LEAST, LEAST_BY_HAND = 120, 40
TWO_DISCS = known("modes.two_discs.f1")


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

    def write(*words, **changes):
        with (folder / "modes/cases.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, row.keys())
            writer.writeheader()
            writer.writerow({**row, **changes})
        return verify(tmp_path, "--cases", folder, *words)

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
    assert len({case["feature"] for case in result["cases"]}) == 17
    page = (tmp_path / "out/verification.html").read_text()
    assert f"All {len(origins)} cases pass." in page and result["installation"]["program"] in page
    text = page.replace("<wbr>", "")
    assert all(case["id"] in text for case in result["cases"])
    assert (tmp_path / "out/verification.pdf").read_bytes().startswith(b"%PDF-")
    assert not list((tmp_path / "out").glob("*.part"))


def test_the_picture_is_inside_of_the_first_page_on_paper(monkeypatch):
    monkeypatch.syspath_prepend(SOURCE / "scripts")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from nocdyn_verify.cases import read_cases
    from nocdyn_verify.outcomes import Installation, Outcome
    from nocdyn_verify.paper import first_page

    outcomes = [Outcome(case, case.expected, "", None) for case in read_cases(CASES)]
    figure = first_page(Installation(*["text"] * 7), outcomes, "")
    (axes,) = figure.axes
    drawn = axes.get_tightbbox(FigureCanvasAgg(figure).get_renderer())
    assert 0 < drawn.x0 < drawn.x1 < figure.bbox.width and 0 < drawn.y0 < drawn.y1 < figure.bbox.height


def test_a_row_of_the_guide_has_a_cell_for_each_heading(monkeypatch):
    monkeypatch.syspath_prepend(SOURCE / "docs")
    import verification_pages as pages
    from nocdyn_verify.cases import read_cases

    for case in read_cases(CASES):
        assert pages.row({**vars(case), "computed": 1.0, "difference": 0.0}).count("|") == pages.HEADING.count("|"), case.id


def test_every_feature_says_what_is_not_verified():
    for folder in {path.parent for path in CASES.glob("*/cases.csv")}:
        assert "## What is not verified\n" in (folder / "about.md").read_text(), folder.name


def test_every_folder_of_a_case_is_used():
    for table in CASES.glob("*/cases.csv"):
        with table.open(newline="") as file:
            used = {row["folder"] for row in csv.DictReader(file)}
        assert used == {path.parent.name for path in table.parent.glob("*/case.nml")}, table


def test_a_release_keeps_its_values_for_the_next_one(own):
    assert own().returncode == 0
    assert report(own.folder)["cases"][0]["released"] is None
    released = own.folder / "cases/released.csv"
    outcome = own("--keep")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    version = report(own.folder)["installation"]["version"]
    assert outcome.stdout.endswith(f"released.csv has the values of {version}.\n")
    value = report(own.folder)["cases"][0]["computed"]
    assert released.read_text() == f"id,version,value\nmodes.two_discs.f1,{version},{value!r}\n"
    released.write_text(released.read_text().replace(version, "0.0.9"))
    own()
    (case,) = report(own.folder)["cases"]
    assert (case["released"], case["change"], case["has_changed"]) == (value, 0, False)
    page = (own.folder / "out/verification.html").read_text()
    assert "0.0.9 computed 1 of these values where it was made; none differs by more than 0.1 of its tolerance" in page


def test_a_value_that_differs_from_the_release_by_a_part_of_its_tolerance_is_marked(own):
    for share, is_marked in ((0.09, False), (0.5, True)):
        value = TWO_DISCS * (1 + share * 1e-6)
        (own.folder / "cases/released.csv").write_text(f"id,version,value\nmodes.two_discs.f1,0.0.9,{value!r}\n")
        assert own(tolerance="1e-6").returncode == 0
        (case,) = report(own.folder)["cases"]
        assert case["change"] == pytest.approx(share, rel=1e-6) and case["has_changed"] == is_marked
        page = (own.folder / "out/verification.html").read_text()
        assert ('<td class="number changed">7.957751133 (0.5 tol.)</td>' in page) == is_marked
        assert ("by more than 0.1 of the tolerance differ 1: modes.two_discs.f1" in page) == is_marked


def test_the_values_of_a_case_that_fails_are_not_kept(own):
    assert own("--keep", expected="7.9").returncode == 1
    assert not (own.folder / "cases/released.csv").exists()


def test_the_values_of_chosen_cases_are_not_kept(own):
    outcome = own("--keep", "modes")
    assert outcome.returncode == 2 and "--keep keeps the values of all cases" in outcome.stderr


@pytest.mark.parametrize("text", ["", "id,value\n", "id,version,value\nmodes.two_discs.f1,0.0.9,seven\n", "id,version\na,b\n"])
def test_values_of_a_release_that_cannot_be_read_are_refused(own, text):
    (own.folder / "cases/released.csv").write_text(text)
    outcome = own()
    assert outcome.returncode == 2
    assert "released.csv: needed: id, version, value in each row, as nocdyn verify --keep writes them" in outcome.stderr


def test_the_released_values_are_of_these_cases():
    with (CASES / "released.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len({row["version"] for row in rows}) == 1
    names = {f"{table.parent.name}.{name}" for table in CASES.glob("*/cases.csv") for name in cases(table.parent.name)}
    assert {row["id"] for row in rows} <= names


def test_a_folder_that_cannot_be_written_is_told_before_anything_is_computed(own):
    (own.folder / "out").write_text("a file")
    outcome = own(command="none")
    assert (outcome.returncode, outcome.stderr) == (3, "nocdyn: verify: out: cannot be written: File exists\n")


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
    assert verify(tmp_path, "modes.two_discs.f1").stdout.startswith("The case passes. ")
    verify(tmp_path, "campbell", "modes.two_discs.f1")
    assert {case["feature"] for case in report(tmp_path)["cases"]} == {"campbell", "modes"}
    verify(tmp_path, "joints_that_lock.held_torque", "steady_states")
    assert {case["feature"] for case in report(tmp_path)["cases"]} == {"joints that lock", "steady states"}


@pytest.mark.parametrize(
    ("word", "hint"),
    [
        ("sails", "allowed: a name as in the table, or a feature: bodies, couplings, shafts, "),
        ("mode", "did you mean 'modes'?"),
        ("modes.two_disc.f1", "did you mean 'modes.two_discs.f1'?"),
    ],
)
def test_an_unknown_name_is_refused_with_a_hint(tmp_path, word, hint):
    outcome = verify(tmp_path, word)
    assert outcome.returncode == 2 and f"there is no case or feature {word!r}; {hint}" in outcome.stderr


def test_a_folder_without_cases_is_refused(tmp_path):
    outcome = verify(tmp_path, "--cases", tmp_path)
    assert outcome.returncode == 3
    assert "there is no folder of a feature with cases.csv" in outcome.stderr
    assert verify(tmp_path, "--cases", tmp_path / "none").returncode == 3
