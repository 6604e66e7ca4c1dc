"""scripts/report on passages of barred ranges, and the verdict of several analyses as one list."""

import importlib
import json

import pytest
from report_browser import Browser, Reports, faults, require

require()
DISCS = """&case title = 'Two discs' /
&body name = 'a' inertia = 2.0 speed_rpm = 300 /
&body name = 'b' inertia = 3.0 speed_rpm = 300 /
&coupling name = 'shaft' bodies = 'a', 'b' stiffness = 1.2e4 damping = 2.4 section_modulus = 1e-6 /
&motor name = 'a' body = 'a' kind = 'constant' torque = 40 /
&motor name = 'b' body = 'b' kind = 'constant' torque = 60 /
&excitation name = 'back_a' body = 'a' kind = 'step' time = 2 amplitude = -80 /
&excitation name = 'back_b' body = 'b' kind = 'step' time = 2 amplitude = -120 /
&excitation name = 'shake' body = 'a' kind = 'orders' orders = 2 amplitudes = 5 /
&limit coupling = 'shaft' moment = 60.0 /
&limit coupling = 'shaft' stress = 1e6 stress_transient = 50e6 /
&transit body = 'a' range_rpm = 430, 525 order = 2 direction = 'both' passages = 2000 time_limit = 0.45 /
&fatigue name = 'life' coupling = 'shaft' reference_moment = 50 reference_cycles = 1e6 slope = 8 /
&load_case name = 'weak' set = 'excitation.shake.amplitudes=1' /
&load_case name = 'strong' /
&run t_end = 4 /
"""


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    made = Reports(tmp_path_factory.mktemp("report"))
    made.write("m.nml", DISCS)
    outcome = made("m.nml", "--no-pdf")
    assert outcome.returncode == 0 and "transit      computed" in outcome.stdout
    return made


@pytest.fixture(scope="module")
def opened(reports):
    browser = Browser()
    browser.open(reports.page())
    yield browser
    browser.quit()


def transit(reports, case):
    return json.loads((reports.folder / f"results/m/{case}/transit.json").read_text())


def tables(browser, caption):
    """The texts of the columns of all tables whose captions have some words, by their heads."""
    return browser.ask(
        """return [...document.querySelectorAll('table')].filter((one) => one.caption.textContent.includes(arguments[0])).map(
          (table) => [...table.tHead.rows[0].cells].reduce((columns, head, i) => ({...columns,
            [head.textContent.trim().split(' [')[0]]:
              [...table.tBodies[0].rows].map((row) => row.cells[i].textContent)}), {}))""",
        caption,
    )


def test_passages_of_all_load_cases_are_told_with_times_peaks_and_damage(reports, opened):
    assert faults(opened) == []
    assert [one.text.split(maxsplit=1)[1] for one in opened.driver.find_elements("css selector", "#transit h3")] == [
        "Load case weak",
        "Load case strong",
    ]
    found = zip(
        *(tables(opened, words) for words in ("Passages of barred", "Largest values in the passages", "Damage of the passages"))
    )
    for case, (passages, peaks, damage) in zip(("weak", "strong"), found, strict=True):
        report = transit(reports, case)
        entries = report["passages"]
        assert passages["direction"] == ["up", "down"] and passages["range"] == ["430 to 525"] * 2
        times = [one["time_in_range"] for one in entries]
        assert list(map(float, passages["time in range"])) == pytest.approx(times, rel=1e-4)
        assert list(map(float, passages["cycles of order"])) == pytest.approx(
            [one["cycles_of_order"] for one in entries], rel=1e-3
        )
        assert peaks["of"] == ["coupling 'shaft', moment"] * 2 + ["coupling 'shaft', stress"] * 2
        moment, stress = entries[0]["peaks"]
        assert peaks["largest"][0] == f"{moment['largest']:.4g} N m"
        assert peaks["its limit"] == ["60 N m", "60 N m", "", ""]
        assert peaks["half range"][2] == f"{stress['half_range'] / 1e6:.4g} MPa"
        assert peaks["limit for passing"] == ["", "", "50 MPa", "50 MPa"]
        assert float(peaks["of limit for passing"][2]) == pytest.approx(2e-6 * stress["half_range"], rel=1e-3)
        assert float(peaks["of its limit"][0]) == pytest.approx(moment["largest"] / 0.6, rel=1e-3)
        (life,) = report["fatigue"]
        assert damage["times in the life"] == ["2000"] and damage["name"] == ["life"]
        assert (life["damage"] < 1e-12) == (damage["damage of all"] == ["< 10⁻¹²"])
    assert "reused" in reports("m.nml", "--no-pdf").stdout.split("transit")[1].split("\n")[0]


def test_figures_of_passages_have_a_row_of_panels_for_each(reports, opened):
    titles = opened.ask("return [...document.querySelectorAll('#transit .panel .title')].map((one) => one.textContent)")
    one = ["speed of a", "coupling 'shaft', moment", "coupling 'shaft', stress"]
    assert titles == 2 * [f"{passage}: {what}" for passage in ("1, up", "2, down") for what in one]
    assert opened.ask("return document.querySelector('#transit figure').dataset.columns") == "3"
    specs = opened.ask("return report.charts.filter((one) => one.figure.closest('#transit')).map((one) => one.spec)")
    entries = transit(reports, "weak")["passages"] + transit(reports, "strong")["passages"]
    for i, spec in enumerate(specs):
        (band,) = spec["bands"]
        assert [band["from"], band["to"]] == [entries[i // 3]["enters"], entries[i // 3]["leaves"]]
    strong = specs[-1]["curves"]
    assert [one["name"] for one in strong] == ["half range of the worst turn", "limit for passing", "limit for passing", "load"]
    weak = specs[2]["curves"]  # whose limit is far outside
    assert [one["name"] for one in weak if not one["shown"]] == ["limit for passing of 1, coupling 'shaft': 50 MPa"]


def test_verdict_key_results_and_scope_tell_of_passages(opened):
    (verdict,) = tables(opened, "Verdict on all limits")
    rows = list(zip(verdict["load case"], verdict["criterion"], verdict["finding"]))
    times = [row for row in rows if row[1] == "time in 430 to 525 rpm"]
    assert times and all(finding.startswith("exceeded") for *_, finding in times)
    # of the two passages of a load case the one that is nearest to the limit; of the load cases likewise
    kept = [case for case, criterion, finding in rows if criterion == "moment, largest" and finding.startswith("kept")]
    assert kept and all(case in ("weak (largest of 2 load cases)", "strong (largest of 2 load cases)") for case in kept)
    (key,) = tables(opened, "Key results")
    assert key["subject"].count("Passages of barred ranges") == 2
    told = key["finding"][key["subject"].index("Passages of barred ranges")]
    assert told.startswith("up: 0.49") and told.endswith(", weak")
    (scope,) = tables(opened, "Calculations")
    assert dict(zip(scope["calculation"], scope["state"]))["Passage of barred ranges"] == "calculated"
    assert "the mean speed, over whole turns" in opened.find("#notes").text


def test_a_range_that_is_never_entered_is_said(reports, opened):
    text = DISCS.replace("430, 525", "2000, 2100").replace("&load_case", "!")
    reports.write("m2.nml", text)
    assert reports("m2.nml", "--no-pdf", "--quiet").returncode == 0
    opened.open(reports.page("m2"))
    assert "it is never in the range" in opened.find("#transit").text
    (key,) = tables(opened, "Key results")
    assert key["assessment"][key["subject"].index("Passages of barred ranges")] == "not passed"


def test_inputs_without_transit_say_so(reports):
    reports.write("m3.nml", "\n".join(line for line in DISCS.splitlines() if "&transit" not in line and "&load" not in line))
    assert "transit      left out: the input has no &transit" in reports("m3.nml", "--no-pdf").stdout


def line(analysis, finding, criterion="distance of a critical speed, at least", case="", limit_at="", **more):
    verdict = importlib.import_module("nocdyn_report.report.verdict")
    more = {"detail": "order 12"} | more
    return verdict.Line(analysis, (case,), "mode 2", criterion, "", limit_at, finding, f"{finding} by {analysis}", **more)


def test_a_distance_that_two_analyses_find_exceeded_is_one_line():
    answered = importlib.import_module("nocdyn_report.report.verdict")._answered
    response, campbell = line("response", "exceeded"), line("campbell", "exceeded")
    assert answered([response, campbell]) == [response]
    other = line("campbell", "exceeded", detail="order 6")
    assert answered([response, campbell, other]) == [response, other]
    worse = line("response", "restricted")
    assert answered([worse, campbell]) == [worse, campbell]


def test_passages_of_one_load_case_do_not_count_as_other_load_cases():
    one_for_each = importlib.import_module("nocdyn_report.report.verdict").one_for_each_criterion
    entries = [("weak", 0.9), ("weak", 0.8), ("strong", 0.7), ("strong", 0.6)]
    lines = [line("transit", "kept", "time", case, limit_at="m.nml:1", ratio=ratio) for case, ratio in entries]
    (kept,) = one_for_each(lines)
    assert kept.ratio == 0.9 and kept.lower == {"strong"}
