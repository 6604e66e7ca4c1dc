"""nocdyn report: the page in headless Chromium, the PDF, what is computed again, what is refused."""

import base64
import html
import importlib
import json
import os
import re
import signal
import subprocess
import sys

import jinja2
import numpy as np
import pandas as pd
import pytest
from conftest import SOURCE
from report_browser import Browser, Reports, faults, require
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

require()
number_text = importlib.import_module("nocdyn_report.report.numbers").number_text

RPM = 30 / np.pi
NOTES = """# Purpose

The *yard* asked.

| a table | that is wide | where a page | of 400 px has no room | for all of its | columns |
| --- | --- | --- | --- | --- | --- |
| unbreakable_word | unbreakable_word | unbreakable_word | unbreakable_word | unbreakable_word | unbreakable_word |

<script>window.harmed = 1</script>

<img src=x onerror='window.harmed = 1'>
"""
PLANT = """&case title = 'Plant "</script><b>&amp;</b>'  author = 'A. Author'  customer = 'Yard <Sons>'
      revision = 'B'  notes_file = 'n.md' /
&body name = 'engine' inertia = 90.0 speed_rpm = 300 /
&body name = 'wheel' inertia = 40.0 speed_rpm = 300 /
&body name = 'pinion' inertia = 2.0 /
&body name = 'pump' inertia = 6.0 /
&coupling name = 'tyre' bodies = 'engine', 'wheel' stiffness = 4.0e5 damping = 300.0 section_modulus = 4.0e-4 /
&coupling name = 'quill' bodies = 'pinion', 'pump' stiffness = 2.0e5 damping = 20.0 /
&gear name = 'up' bodies = 'wheel', 'pinion' teeth = 60, 20 /
&motor name = 'drive' body = 'engine' a = 6000.0 b = 100.0 c = 0.0 /
&load name = 'work' body = 'pump' quadratic = 0.08 /
&excitation name = 'orders' body = 'engine' kind = 'orders' orders = 1, 2, 3 amplitudes = 300.0, 500.0, 200.0 /
&excitation name = 'blow' body = 'pump' kind = 'pulse' amplitude = -900.0 time = 0.3 duration = 0.05 /
&response body = 'engine' speed_rpm = 200, 900 count = 60 operating_rpm = 300, 500 margin = 0.1 /
&limit coupling = 'tyre' vibratory_moment = 1500.0 /
&fatigue name = 'life' coupling = 'tyre' reference_stress = 2.0e7 reference_cycles = 1.0e6 slope = 5 /
&load_case name = 'calm' title = 'Normal' repeats = 1000 without = 'blow' /
&load_case name = 'blow' title = 'A blow' repeats = 20 /
&run t_end = 0.6 start = 'projected' /
&output points = 601 units = 'rpm' /
"""
EXAMPLES = ["compressor", "ice_propeller", "hybrid", "winch", "coupled_clutches", "chain_200"]
WIDTHS = (400, 1600)


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    made = Reports(tmp_path_factory.mktemp("report"))
    made.write("n.md", NOTES)
    made.write("m.nml", PLANT)
    outcome = made("m.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout.splitlines()[-1] == "m.nml: results/m has report.html and report.pdf"
    return made


@pytest.fixture(scope="module")
def browser():
    opened = Browser()
    yield opened
    opened.quit()


@pytest.fixture
def fresh(tmp_path_factory):
    return Reports(tmp_path_factory.mktemp("report"))


@pytest.fixture
def opened(reports, browser):
    browser.open(reports.page())
    return browser


def without_notes(text):
    return text.replace("notes_file = 'n.md'", "")


def results(reports, name):
    return json.loads((reports.folder / "results/m" / name).read_text(encoding="utf-8"))


def column(browser, table, name):
    """The texts of a column of the table whose caption has a text."""
    return browser.ask(
        """const captions = [...document.querySelectorAll('caption')];
        const table = captions.find((one) => one.textContent.includes(arguments[0])).parentElement;
        const heads = [...table.tHead.rows[0].cells].map((head) => head.textContent.trim());
        const i = heads.findIndex((head) => head.startsWith(arguments[1]));
        return [...table.tBodies[0].rows].map((row) => row.cells[i].textContent);""",
        table,
        name,
    )


def plain(text):
    """The number that a text shows."""
    for one, other in (("\N{NARROW NO-BREAK SPACE}", ""), ("\N{MINUS SIGN}", "-"), ("\N{MULTIPLICATION SIGN}10", "e")):
        text = text.replace(one, other)
    return float(text.translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")))


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", WIDTHS)
def test_the_page_has_no_fault(reports, browser, width, theme):
    browser.open(reports.page(), width, theme)
    assert faults(browser) == []
    assert browser.ask("return document.querySelectorAll('[data-figure]').length") >= 10


def test_sections_that_apply_are_there_in_order(opened):
    found = opened.ask("return [...document.querySelectorAll('main > section')].map((one) => one.id)")
    parts = ["summary", "remarks", "machine", "steady", "mass-elastic", "modes", "campbell", "response", "motion", "fatigue"]
    assert found == [*parts, "details", "notes", "scope", "input"]
    assert opened.find("#energy").text.endswith("Energy account")
    pairs = (
        "return [...document.querySelectorAll('.cover dl > div')].map((one) => [...one.children].map((part) => part.textContent))"
    )
    facts = dict(opened.ask(pairs))
    assert [facts[name] for name in ("Customer", "Author", "Revision", "Input")] == ["Yard <Sons>", "A. Author", "B", "m.nml"]
    assert facts["Program"].startswith("nocdyn ")
    assert opened.find("h1").text == 'Plant "</script><b>&amp;</b>'


def test_scripts_in_notes_do_no_harm(opened):
    assert opened.ask("return window.harmed") is None
    text = opened.find(".prose").text
    assert "The yard asked." in text and "<script>window.harmed = 1</script>" in text
    assert opened.ask("return document.querySelectorAll('.prose script, .prose img').length") == 0
    assert faults(opened) == []


def test_every_number_of_the_bodies_is_that_of_check(reports, opened):
    data = results(reports, "../../results/m/calm/summary.json")
    assert data["load_case"] == "calm"
    assert column(opened, "Bodies with their inertias", "body") == ["engine", "wheel", "pinion", "pump"]
    assert [plain(one) for one in column(opened, "Bodies with their inertias", "inertia")] == [90.0, 40.0, 2.0, 6.0]
    stiffness = [plain(one) for one in column(opened, "Couplings, shafts and meshes", "stiffness")]
    assert stiffness == [400.0, 200.0]
    assert "[kN m/rad]" in opened.find("#mass-elastic").text
    assert plain(column(opened, "Gears and other rigid", "ratio")[0]) == -3.0


def test_findings_are_those_of_the_files(reports, opened):
    report, cases = results(reports, "calm/response.json"), results(reports, "cases.json")
    lines = [line for name in ("response_cases.json", "cases.json") for line in results(reports, name)["verdict"]["lines"]]
    exceeded = {line["assessment"] for line in lines if line["finding"] == "exceeded"}
    findings = column(opened, "Verdict on all limits", "finding")
    assert exceeded and findings[: len(exceeded)] == [line for line in findings if line.startswith("exceeded")]
    assert set(findings[: len(exceeded)]) == exceeded
    ratios = [
        plain(one.rstrip("% \N{NARROW NO-BREAK SPACE}"))
        for one in column(opened, "Verdict on all limits", "of limit")[: len(exceeded)]
        if one  # a critical speed in operation has none
    ]
    assert ratios == sorted(ratios, reverse=True) and ratios[-1] > 100
    assert opened.find("#summary p").text.startswith("exceeded: coupling 'tyre', ")
    shown = zip(column(opened, "Barred ranges", "from"), column(opened, "Barred ranges", "to"))
    ranges = [(one["from_rad_s"] * RPM, one["to_rad_s"] * RPM) for one in report["barred_speed_ranges"]]
    assert ranges and [tuple(map(plain, pair)) for pair in shown] == [pytest.approx(pair, rel=1e-4) for pair in ranges]
    peaks = {peak["column"]: abs(peak["largest"]) for peak in cases["peaks"]}
    for caption, prefix in (
        ("Largest magnitudes: elastic and damping moment", "total_moment_"),
        ("Largest magnitudes: speed", "omega_"),
    ):
        names, *values = [column(opened, caption, head) for head in ("of", "calm", "blow")]
        scale = 1e3 if f"{caption} kN m" in opened.find("#motion").text.replace("[", "") else 1.0
        for name, pair in zip(names, zip(*values)):
            assert scale * max(map(plain, pair)) == pytest.approx(peaks[prefix + name], rel=1e-4)
        assert {"tyre", "pump"} & set(names)
    assert plain(column(opened, "Damage of all load cases", "of all")[0]) == pytest.approx(
        cases["fatigue"][0]["damage"], rel=0.05
    )


def test_tables_sort_by_mouse_and_by_keyboard(opened):
    table = "Bodies with their inertias"
    given = column(opened, table, "inertia")
    head = opened.driver.find_element("xpath", f"//table[caption[contains(., '{table}')]]//th[contains(., 'inertia')]/button")
    opened.ask("arguments[0].scrollIntoView({block: 'center'})", head)
    head.click()
    numbers = [plain(one) for one in column(opened, table, "inertia")]
    assert numbers == sorted(numbers) and column(opened, table, "inertia") != given
    head.send_keys(Keys.ENTER)
    numbers = [plain(one) for one in column(opened, table, "inertia")]
    assert numbers == sorted(numbers, reverse=True)
    assert opened.ask("return arguments[0].parentElement.getAttribute('aria-sort')", head) == "descending"
    head.send_keys(Keys.SPACE)
    assert column(opened, table, "inertia") == given
    name = opened.driver.find_element("xpath", f"//table[caption[contains(., '{table}')]]//th[1]/button")
    name.send_keys(Keys.ENTER)
    names = column(opened, table, "body")
    assert names == sorted(names)


def chart(browser, words, title=""):
    """The number of the panel with a title in the figure whose caption has some words, scrolled into view, and its picture."""
    number = browser.ask(
        """return report.charts.findIndex((one) => one.figure.querySelector('figcaption').textContent.includes(arguments[0])
            && (!arguments[1] || one.panel.querySelector('.title').textContent === arguments[1]))""",
        words,
        title,
    )
    assert number >= 0
    picture = browser.ask("return report.charts[arguments[0]].picture", number)
    browser.ask("arguments[0].scrollIntoView({block: 'center'})", picture)
    return number, picture


def test_curves_show_their_values_under_the_pointer(reports, opened):
    number, picture = chart(opened, "Half ranges with limits over the speed")
    table = pd.read_csv(reports.folder / "results/m/calm/response.csv").sort_values("omega_engine [rpm]")
    row = table.iloc[(table["omega_engine [rpm]"] - 400).abs().argmin()]
    at = opened.ask("return report.charts[arguments[0]].x(arguments[1])", number, float(row["omega_engine [rpm]"]))
    size = picture.size
    ActionChains(opened.driver).move_to_element_with_offset(picture, round(at - size["width"] / 2), 0).perform()
    tip = opened.ask("return report.charts[arguments[0]].tip.innerText", number)
    assert not opened.ask("return report.charts[arguments[0]].tip.hidden", number)
    speed, *lines = tip.splitlines()
    assert plain(speed.split()[0]) == pytest.approx(row["omega_engine [rpm]"], abs=3)  # pixels are 1 rpm wide
    row = table.iloc[(table["omega_engine [rpm]"] - plain(speed.split()[0])).abs().argmin()]
    total = next(line for line in lines if "all orders" in line)
    assert plain(total.split(": ")[1].removesuffix(" N m")) == pytest.approx(row["half_range_total_moment_tyre [N m]"], rel=1e-4)
    limit = next(line for line in lines if "limit" in line)
    assert plain(limit.split(": ")[1].removesuffix(" N m")) == pytest.approx(1500.0)
    ActionChains(opened.driver).move_to_element(opened.find("h1")).perform()
    assert opened.ask("return report.charts[arguments[0]].tip.hidden", number)


def test_figures_zoom_by_mouse_and_return(opened):
    number, picture = chart(opened, "Half ranges with limits over the speed")
    window = "return report.charts[arguments[0]].window.x"
    whole = opened.ask(window, number)
    ActionChains(opened.driver).move_to_element_with_offset(picture, -100, 0).click_and_hold().move_by_offset(
        200, 5
    ).release().perform()
    zoomed = opened.ask(window, number)
    assert whole[0] < zoomed[0] < zoomed[1] < whole[1]
    opened.ask("report.charts[arguments[0]].figure.querySelector('[data-zoom=all]').click()", number)
    assert opened.ask(window, number) == whole
    opened.ask("report.charts[arguments[0]].figure.querySelector('[data-zoom=in]').click()", number)
    zoomed = opened.ask(window, number)
    assert zoomed[1] - zoomed[0] == pytest.approx((whole[1] - whole[0]) / 2)
    ActionChains(opened.driver).double_click(picture).perform()
    assert opened.ask(window, number) == whole
    assert faults(opened) == []


def test_figures_are_usable_by_keyboard(opened):
    number, picture = chart(opened, "Motion of load case blow", "speed")
    window, status = "return report.charts[arguments[0]].window.x", "return report.charts[arguments[0]].status.textContent"
    whole = opened.ask(window, number)
    picture.send_keys(Keys.ARROW_RIGHT)
    first = opened.ask(status, number)
    assert "pump" in first and first.endswith("rpm")
    picture.send_keys(Keys.ARROW_RIGHT)
    assert opened.ask(status, number) != first
    picture.send_keys("+")
    zoomed = opened.ask(window, number)
    assert zoomed[1] - zoomed[0] == pytest.approx((whole[1] - whole[0]) / 2)
    picture.send_keys(Keys.SHIFT + Keys.ARROW_RIGHT)
    assert opened.ask(window, number)[0] > zoomed[0]
    picture.send_keys("0")
    assert opened.ask(window, number) == whole
    picture.send_keys(Keys.HOME)
    assert opened.ask(status, number).startswith("0 s")
    legend = opened.ask("return report.charts[arguments[0]].figure.querySelector('.legend button')", number)
    curves = "return report.charts[arguments[0]].figure.querySelectorAll('.picture path.curve[d]').length"
    shown = opened.ask(curves, number)
    legend.send_keys(Keys.ENTER)
    assert opened.ask("return arguments[0].getAttribute('aria-pressed')", legend) == "false"
    assert opened.ask(curves, number) < shown


def test_every_figure_has_a_text_alternative(opened):
    texts = opened.ask("return [...document.querySelectorAll('figure .picture')].map((one) => one.getAttribute('aria-label'))")
    assert all(len(text) > 30 for text in texts) and len(set(texts)) == len(texts)


def test_colours_follow_the_reader_and_the_button(reports, browser):
    ground = "return getComputedStyle(document.body).backgroundColor"
    seen = {}
    for theme in ("light", "dark"):
        browser.open(reports.page(), theme=theme)
        seen[theme] = browser.ask(ground)
    assert seen["light"] != seen["dark"]
    browser.find("[data-theme-choice=light]").click()
    assert browser.ask(ground) == seen["light"]
    browser.find("[data-theme-choice=auto]").click()
    assert browser.ask(ground) == seen["dark"]
    browser.driver.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"media": "print", "features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    )
    assert browser.ask(ground) == seen["light"]
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})


def test_without_scripts_the_tables_are_there(reports):
    text = reports.page().read_text(encoding="utf-8")
    assert "<noscript>" in text and text.index("<table") < text.index('id="data"')
    assert len(text) < 5_000_000


def test_the_pdf_is_whole(reports):
    content = (reports.folder / "results/m/report.pdf").read_bytes()
    assert content.startswith(b"%PDF") and content.rstrip().endswith(b"%%EOF")
    assert len(content) > 100_000


def test_only_what_does_not_belong_to_the_input_is_computed_again(fresh):
    fresh.write("n.md", NOTES)
    fresh.write("m.nml", PLANT)

    def states():
        outcome = fresh("m.nml", "--no-pdf")
        assert (outcome.returncode, outcome.stderr) == (0, "")
        lines = [line for line in outcome.stdout.splitlines()[:-1] if "left out" not in line]
        return {line.split()[0]: line.split()[1].rstrip(":") for line in lines}

    commands = ("equilibrium", "modes", "holzer", "campbell", "response", "run")
    assert states() == dict.fromkeys(commands, "computed")
    assert states() == dict.fromkeys(commands, "reused")
    fresh.write("m.nml", PLANT.replace("revision = 'B'", "revision = 'C'"))
    assert states() == dict.fromkeys(commands, "reused")
    assert "<dd>C</dd>" in fresh.page().read_text(encoding="utf-8")
    fresh.write(
        "results/m/blow/response.json", (fresh.folder / "results/m/blow/response.json").read_text().replace("tyre", "tire")
    )
    assert states() == dict.fromkeys(commands, "reused") | {"response": "computed"}
    fresh.write("m.nml", PLANT.replace("inertia = 90.0", "inertia = 91.0"))
    assert states() == dict.fromkeys(commands, "computed")
    (fresh.folder / "results/m/blow/trajectory.csv").unlink()
    assert states() == dict.fromkeys(commands, "reused") | {"run": "computed"}
    for name in ("calm/summary.json", "blow/trajectory.csv"):  # a number by hand, a table that lost its end
        file = fresh.folder / "results/m" / name
        whole = file.read_text()
        file.write_text(whole.replace("5", "6", 1) if name.endswith("json") else whole[: len(whole) // 2])
        assert states() == dict.fromkeys(commands, "reused") | {"run": "computed"}
        assert states() == dict.fromkeys(commands, "reused")


def test_a_load_case_without_a_steady_state_leaves_the_sections_to_the_next(fresh, browser):
    case = "&load_case name = 'start' analyses = 'run' /\n&load_case name = 'calm'"
    fresh.write("m.nml", without_notes(PLANT).replace("&load_case name = 'calm'", case))
    outcome = fresh("m.nml", "--no-pdf")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert not (fresh.folder / "results/m/start/modes.json").exists()
    browser.open(fresh.page())
    assert faults(browser) == []
    found = browser.ask("return [...document.querySelectorAll('main > section')].map((one) => one.id)")
    assert {"steady", "modes", "campbell", "response", "motion"} <= set(found)


MEASURED = """&case title = 'Bench' /
&body name = 'a' inertia = 1.0 speed_rpm = 300 /
&body name = 'b' inertia = 2.0 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 1e4 damping = 4.0 /
&load name = 'l' body = 'b' quadratic = 0.05 /
&excitation name = 'e' body = 'a' kind = 'orders' orders = 1, 2 amplitudes = 10, 5 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 100 /
&response body = 'a' speed_rpm = 200, 1400 count = 40 /
&measurement name = 'gauge' signal = 'total_moment_c' times = 0, 0.1, 0.2, 0.3 values = 0, -60, -70, -65 /
&measurement name = 'line' kind = 'order' order = 2 signal = 'total_moment_c' speeds_rpm = 300, 600, 900 values = 4, 70, 5 /
&measurement name = 'peak' kind = 'peak' signal = 'total_moment_c' statistic = 'smallest' values = -120 /
&measurement name = 'impact' kind = 'frequency' frequency_hz = 19.2 relative_damping = 0.021 /
&run t_end = 0.5 /
"""


def test_measurements_stand_beside_what_was_computed(fresh, browser):
    fresh.write("m.nml", MEASURED)
    outcome = fresh("m.nml", "--no-pdf")
    assert outcome.returncode == 0, outcome.stderr
    browser.open(fresh.page())
    assert faults(browser) == []
    for part, name, names in (
        ("modes", "modes.json", ["impact"]),
        ("response", "response.json", ["line"]),
        ("summary", "summary.json", ["gauge", "peak"]),
    ):
        members = results(fresh, name)["measurements"]
        assert [one["name"] for one in members] == names and browser.find(f"#measured-{part}")
    shown = column(browser, "Differences to what was measured", "bias")  # the first: of the modes
    table = pd.read_csv(fresh.folder / "results/m/measured_impact.csv")
    hertz = table["difference [rad/s]"][0] / (2 * np.pi)
    assert plain(shown[0].split(" ")[0]) == pytest.approx(hertz, rel=1e-3)
    damping = column(browser, "Measured natural frequencies: impact", "computed damping")
    assert plain(damping[0]) == pytest.approx(table["computed_damping [1]"][0], rel=1e-3)
    places = browser.ask("""
        const figure = [...document.querySelectorAll('figure')].find((one) => one.textContent.includes('damping ratios over'));
        const at = (role, key) => Number(figure.querySelector(`.picture circle.role-${role}`).getAttribute(key));
        return ['cx', 'cy'].map((key) => at('computed', key) - at('measured', key));
    """)
    assert np.sign(places) == pytest.approx([np.sign(hertz), -np.sign(table["computed_damping [1]"][0] - 0.021)])
    curves = browser.ask("""
        return [...document.querySelectorAll('figure')].filter((one) => one.textContent.includes('Measured and computed values'))
          .map((one) => [one.querySelectorAll('.picture path.curve.role-computed').length,
            one.querySelectorAll('.picture path.role-measured, .picture circle.role-measured').length]);""")
    assert curves == [[1, 3], [2, 2]]  # the order over the speed; the torque over the time, also about its largest difference
    (fresh.folder / "results/m/measured_line.csv").unlink()
    lines = fresh("m.nml", "--no-pdf").stdout
    assert "response     computed" in lines and "modes        reused" in lines


def test_set_reaches_every_calculation(fresh):
    text = without_notes(PLANT)
    fresh.write("m.nml", text)
    outcome = fresh("m.nml", "--no-pdf", "--quiet", "--set", "body.engine.inertia=70", "--out", "there")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, "", "")
    page = (fresh.folder / "there/report.html").read_text(encoding="utf-8")
    assert "--set body.engine.inertia=70" in page
    assert json.loads((fresh.folder / "there/calm/modes.json").read_text())["inertia_kg_m2"][0] == 70
    assert not (fresh.folder / "there/report.pdf").exists()


@pytest.mark.parametrize("name", EXAMPLES)
def test_machines_of_all_sorts_have_a_report(fresh, browser, name):
    file = SOURCE / f"input/examples/{name}/{name}.nml"
    outcome = fresh(file, "--no-pdf", "--quiet", "--set", "run.t_end=0.02", "--out", "results/m")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    browser.open(fresh.page(), WIDTHS[0])
    assert faults(browser) == []
    for name in column(browser, "Calculations", "calculation"):
        assert name


def test_a_machine_that_a_command_refuses_is_told_in_its_own_words(fresh):
    fresh.write("m.nml", without_notes(PLANT).replace("b = 100.0", "b = 0.0").replace("quadratic = 0.08", "viscous = 0.0"))
    outcome = fresh("m.nml", "--no-pdf")
    refused = [line.split(":", 1)[1].strip() for line in outcome.stdout.splitlines() if " refused" in line or " failed" in line]
    page = fresh.page().read_text(encoding="utf-8")
    assert outcome.returncode == 0 and refused
    assert refused[0].split("'")[0] in page


def test_a_refused_input_has_no_report(fresh):
    fresh.write("m.nml", "&body name = 'a' inertia = -1 /\n&run t_end = 1 /\n")
    outcome = fresh("m.nml")
    assert outcome.returncode == 2 and outcome.stdout == ""
    assert outcome.stderr == "nocdyn: m.nml:1: &body 'a': inertia = -1 is out of range; allowed: >= 0 [kg m2]\n"
    assert not (fresh.folder / "results").exists()
    outcome = fresh("none.nml")
    assert outcome.returncode == 3 and outcome.stderr == "nocdyn: none.nml: cannot be read: there is no such file\n"


def test_a_run_that_fails_is_told_and_has_its_exit_code(fresh, browser):
    fresh.write("m.nml", without_notes(PLANT).replace("t_end = 0.6", "t_end = 0.6 max_steps = 5"))
    outcome = fresh("m.nml", "--no-pdf", "--quiet")
    assert outcome.returncode == 1 and outcome.stderr.startswith("nocdyn: m.nml: ")
    browser.open(fresh.page())
    assert faults(browser) == []
    assert "failed" in browser.find("#summary").text
    assert "Not all load cases were run to their ends" in browser.find("#fatigue").text


def test_pictures_of_notes_are_inside_and_others_refused(fresh, browser):
    fresh.write("m.nml", PLANT)
    fresh.write("n.md", "![A shaft](https://example.org/a.png)\n")
    outcome = fresh("m.nml", "--no-pdf")
    message = (
        "nocdyn: m.nml:2: &case: notes_file: picture 'https://example.org/a.png': allowed: a file PNG, JPEG, GIF, WebP or SVG\n"
    )
    assert (outcome.returncode, outcome.stderr) == (2, message)
    assert not fresh.page().exists()
    fresh.write(
        "a.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='20' height='20'><script>window.harmed = 1</script></svg>"
    )
    fresh.write("n.md", "![A shaft](a.svg)\n")
    assert fresh("m.nml", "--no-pdf").returncode == 0
    browser.open(fresh.page())
    assert browser.ask("return document.querySelector('.prose img').naturalWidth") == 20
    assert faults(browser) == []


@pytest.mark.parametrize("way", ["absolute", "up", "link", "picture", "picture link"])
def test_files_of_other_folders_are_in_a_report_only_if_allowed(fresh, way):
    secret = fresh.folder.parent / f"{fresh.folder.name}.md"
    secret.write_text("a *secret*\n")
    image = secret.with_suffix(".svg")
    image.write_text("<svg xmlns='http://www.w3.org/2000/svg'/>")
    (fresh.folder / "link.md").symlink_to(secret)
    (fresh.folder / "link.svg").symlink_to(image)
    name = {"absolute": str(secret), "up": f"../{secret.name}", "link": "link.md"}.get(way, "n.md")
    picture = {"picture": f"../{image.name}", "picture link": "link.svg"}.get(way)
    fresh.write("n.md", f"![A shaft]({picture})\n" if picture else "none\n")
    fresh.write("m.nml", PLANT.replace("notes_file = 'n.md'", f"notes_file = '{name}'"))
    outcome = fresh("m.nml", "--no-pdf", "--quiet")
    assert outcome.returncode == 2 and not fresh.page().exists()
    assert "m.nml:2: &case: notes_file: " in outcome.stderr and "is not in the folder of the input; allowed: " in outcome.stderr
    assert fresh("m.nml", "--no-pdf", "--quiet", "--allow-outside").returncode == 0
    assert ("data:image/svg" if picture else "<em>secret</em>") in fresh.page().read_text()


def test_a_table_of_another_folder_is_not_listed(fresh):
    (fresh.folder.parent / "secret.txt").write_text("0 1.25e-7 ! hidden words\n1 2\n")
    table = "&excitation name = 'x' body = 'engine' kind = 'table' table_file = '../secret.txt' /\n"
    fresh.write("m.nml", without_notes(PLANT) + table)
    for words, is_there in (((), False), (("--allow-outside",), True)):
        assert fresh("m.nml", "--no-pdf", "--quiet", *words).returncode == 0
        assert ("hidden words" in fresh.page().read_text()) == is_there


def test_without_a_browser_there_is_no_half_a_report(reports):
    before = reports.page().read_bytes()
    outcome = reports("m.nml", "--quiet", PATH="/nowhere")
    assert outcome.returncode == 3
    assert outcome.stderr == (
        "nocdyn report: there is no chromium, which prints the PDF: apt-get install chromium, or use --no-pdf\n"
    )
    assert reports.page().read_bytes() == before
    assert not list(reports.page().parent.glob(".*"))
    assert reports("m.nml", "--quiet", "--out", "nothing", PATH="/nowhere").returncode == 3
    assert not (reports.folder / "nothing").exists()  # told before anything is computed


def test_the_first_sentence_names_the_load_case_in_which_a_limit_is_exceeded():
    verdict = importlib.import_module("nocdyn_report.report.verdict")
    words = ("coupling 'tyre'", "moment, continuous", "", "", "exceeded", "exceeded in operation")
    told = [verdict.sentence([verdict.Line("response", cases, *words)])[0] for cases in (("blow",), ("",))]
    told_before = "exceeded: coupling 'tyre', moment, continuous, exceeded in operation"
    assert told == [f"{told_before} (load case blow).", f"{told_before}."]


def test_a_folder_is_no_input(fresh):
    outcome = fresh(".", "--no-pdf")
    assert (outcome.returncode, outcome.stderr) == (3, "nocdyn report: .: is no file; the report shows the text of the input\n")


def test_a_folder_with_a_sweep_is_refused(fresh):
    fresh.write("m.nml", without_notes(PLANT))
    (fresh.folder / "results/m").mkdir(parents=True)
    fresh.write("results/m/sweep.nc", "")
    outcome = fresh("m.nml", "--no-pdf")
    assert outcome.returncode == 2 and "holds the results of a sweep" in outcome.stderr
    assert not fresh.page().exists()


def test_names_of_files_are_no_markup(fresh, browser):
    name = "a&b 'c' <i>.nml"
    fresh.write(name, "&case author" + without_notes(PLANT).split("  author", 1)[1])
    outcome = fresh(name, "--no-pdf", "--out", "results/m")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    browser.open(fresh.page())
    assert browser.find("h1").text == name.removesuffix(".nml")
    assert faults(browser) == []


def test_a_machine_without_elasticity_has_a_report(fresh, browser):
    text = PLANT.split("&coupling", 1)[0] + "&gear name = 'up' bodies = 'wheel', 'pinion' teeth = 60, 20 /\n"
    text += "&response body = 'engine' speed_rpm = 200, 900 count = 9 /\n&motor name = 'm' body = 'wheel' a = 9 b = 1 c = 0 /\n"
    text += "&excitation name = 'o' body = 'wheel' kind = 'orders' orders = 1 amplitudes = 3 /\n"
    text += "&run t_end = 0.1 start = 'projected' /\n"
    fresh.write("m.nml", without_notes(text))
    outcome = fresh("m.nml", "--no-pdf", "--quiet")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    browser.open(fresh.page())
    assert faults(browser) == []
    states = dict(zip(column(browser, "Calculations", "calculation"), column(browser, "Calculations", "state")))
    assert states["Campbell diagram"] != "calculated" and states["Motion over the time"] == "calculated"


def test_the_text_of_the_input_and_of_its_tables_is_there(fresh):
    folder = SOURCE / "input/examples/compressor"
    for name in ("compressor.nml", "indicator.csv"):
        fresh.write(name, (folder / name).read_text(encoding="utf-8"))
    assert fresh("compressor.nml", "--no-pdf", "--quiet", "--set", "run.t_end=0.02").returncode == 0
    page = html.unescape(fresh.page("compressor").read_text(encoding="utf-8"))
    assert (folder / "compressor.nml").read_text(encoding="utf-8").strip() in page
    assert (folder / "indicator.csv").read_text(encoding="utf-8").strip() in page


def test_numbers_look_the_same_in_tables_and_under_the_pointer(opened):
    values = [
        0.0,
        1.0,
        -1.0,
        12345.678,
        99999.96,
        999999.0,
        1e6,
        -2.5e7,
        1.23456e-3,
        9.87654e-4,
        1e-30,
        0.1 + 0.2,
        45.5,
        4e5,
        -12000,
    ]
    shown = opened.ask("return arguments[0].map((value) => report.numberText(value))", values)
    blanks = str.maketrans({"\N{NARROW NO-BREAK SPACE}": " ", "\N{NO-BREAK SPACE}": " ", "\N{THIN SPACE}": " "})
    assert [one.translate(blanks) for one in shown] == [number_text(float(value)).translate(blanks) for value in values]


@pytest.fixture
def process(fresh):
    """Starts the script in a process of its own."""
    fresh.write("m.nml", without_notes(PLANT))
    words = [sys.executable, "-m", "nocdyn_report", "report", "m.nml", "--no-pdf"]
    environment = os.environ | {"PYTHONPATH": str(SOURCE / "scripts"), "PYTHONUNBUFFERED": "1"}
    return lambda: subprocess.Popen(words, cwd=fresh.folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_a_reader_that_leaves_is_no_mistake_of_the_script(process):
    started = process()
    started.stdout.close()
    assert (started.wait(timeout=60), started.stderr.read()) == (3, b"")


def test_an_interruption_leaves_no_report_and_one_sentence(fresh, process):
    started = process()
    assert started.stdout.readline() != b""  # it computes
    started.send_signal(signal.SIGINT)
    _, errors = started.communicate(timeout=60)
    assert (started.returncode, errors) == (1, b"nocdyn report: interrupted\n")
    assert not fresh.page().exists()


def test_ratios_at_the_edge_of_the_drawing_are_whole(fresh, browser):
    bodies = "".join(f"&body name = '{name}' inertia = 1.0 speed = 9.0 /\n" for name in ("motor", "pinion"))
    elements = "&coupling name = 'c' bodies = 'motor', 'pinion' stiffness = 1e4 damping = 1.0 /\n"
    elements += "&body name = 'wheel' inertia = 1.0 /\n&gear name = 'g' bodies = 'pinion', 'wheel' radii = 0.05, 0.15 /\n"
    fresh.write("m.nml", bodies + elements + "&run t_end = 0.1 /\n")
    assert fresh("m.nml", "--no-pdf").returncode == 0
    browser.open(fresh.page())
    assert faults(browser) == []


def test_a_response_that_fails_is_a_finding(fresh, browser):
    falling = (
        "&load name = 'falling' body = 'engine' table_speed = 0, 10, 100 table_torque = 0, 9e5, 10 extrapolation = 'constant' /\n"
    )
    plant = without_notes(PLANT).replace("speed_rpm = 200, 900", "speed_rpm = 700, 900")
    fresh.write("m.nml", plant + falling)
    fresh("m.nml", "--no-pdf", "--quiet")
    browser.open(fresh.page())
    assert faults(browser) == []
    assert "Forced response m.nml:" in browser.find("#summary").text
    assert "the steady state is unstable" in browser.find("#summary").text


def test_a_peak_beyond_its_limit_is_told_beside_a_larger_share_of_another(fresh, browser):
    limit = "vibratory_moment = 1500.0"
    assert limit in PLANT
    fresh.write("m.nml", without_notes(PLANT).replace(limit, "vibratory_moment = 100.0 moment = 1000.0"))
    assert fresh("m.nml", "--no-pdf", "--quiet").returncode == 0
    report = json.loads((fresh.folder / "results/m/calm/response.json").read_text())
    (one,) = [one for one in report["largest"] if "ratio_to_limit" in one]
    assert one["peak_ratio_to_limit"] == pytest.approx(one["peak"] / 1000.0, rel=1e-12)
    assert 1 < one["peak_ratio_to_limit"] < one["ratio_to_limit"]
    browser.open(fresh.page())
    criteria = column(browser, "Verdict on all limits", "criterion")
    findings = column(browser, "Verdict on all limits", "finding")
    assert {one for one, finding in zip(criteria, findings) if finding.startswith("exceeded")} >= {
        "total moment, continuous",
        "total moment, largest",
    }


def test_a_tooth_force_is_called_so(fresh, browser):
    """In findings, tables and figures."""
    text = "&body name = 'a' inertia = 1 /\n&body name = 'b' inertia = 2 /\n&load name = 'l' body = 'b' viscous = 1 /\n"
    text += "&mesh name = 'teeth' bodies = 'a', 'b' radii = 0.1, 0.2 stiffness = 1e6 damping = 1e2 /\n"
    text += "&motor name = 'm' body = 'a' a = 10 b = 1 c = 0 /\n&run t_end = 1 /\n"
    fresh.write("m.nml", text)
    assert fresh("m.nml", "--no-pdf", "--quiet").returncode == 0
    browser.open(fresh.page())
    assert "Peak: tooth force" in browser.find("#summary").text
    motion = browser.find("#motion").text
    assert "teeth: tooth force" in motion and "Peaks: tooth force" in motion
    heads = browser.find("#steady").text
    assert "tooth force" in heads and "deformation of the teeth" in heads


GEARED = """&body name = 'motor' inertia = 60 speed_rpm = 990 /
&body name = 'pinion' inertia = 4 speed_rpm = 990 /
&body name = 'wheel' inertia = 400 speed_rpm = -198 /
&body name = 'mill' inertia = 9000 speed_rpm = -198 /
&body name = 'held' inertia = 1 speed_rpm = -198 /
&coupling name = 'coupling' bodies = 'motor', 'pinion' stiffness = 6e5 damping = 300 /
&mesh name = 'teeth' bodies = 'pinion', 'wheel' radii = 0.15, 0.75 stiffness = 5e8 damping = 2e4
      transmission_error = 5e-6 error_orders = 20 /
&shaft name = 'line' bodies = 'wheel', 'mill' lengths = 1 diameters = 0.3 shear_modulus = 8e10 density = 7850 nodes = 2 /
&clutch name = 'grip' bodies = 'mill', 'held' capacity = 70 /
&motor name = 'drive' body = 'motor' kind = 'induction' breakdown_torque = 9000 breakdown_slip = 0.1
       synchronous_speed_rpm = 1000 /
&load name = 'grind' body = 'mill' constant = 12000 constant_speed = 0.5 /
&response body = 'motor' speed_rpm = 200, 1000 /
&limit mesh = 'teeth' vibratory_force = 12000 /
&run t_end = 0.1 start = 'equilibrium' /
"""


def test_marks_of_modes_units_of_forces_and_data_of_joints_are_told(fresh, browser):
    fresh.write("m.nml", GEARED)
    assert fresh("m.nml", "--no-pdf", "--quiet").returncode == 0
    browser.open(fresh.page())
    assert faults(browser) == []
    modes = json.loads((fresh.folder / "results/m/modes.json").read_text())["modes"]
    assert any(mode.get("error_by_shaft_nodes", 0.0) > 1e-3 for mode in modes)
    assert "nodes too few: error " in " ".join(column(browser, "Natural frequencies", "remark"))
    units = dict(zip(column(browser, "Critical speeds and", "most in"), column(browser, "Critical speeds and", "unit")))
    assert units["teeth"] == "N"
    assert any(cell != "\N{EN DASH}" for cell in column(browser, "Critical speeds and", "all orders, of the limit"))
    assert column(browser, "Joints without", "law") == ["friction, capacity 70 N m"]
    assert "* In the first" not in browser.find("#motion").text


def test_paper_tells_the_curves_that_are_left_out(opened):
    left_out = "return [...document.querySelectorAll('.left-out')].map((one) => one.textContent)"
    assert opened.ask(left_out)[0] == ""
    button = opened.find(".legend [aria-pressed=true]")
    name = button.text
    button.click()
    assert opened.ask(left_out)[0] == f"not drawn: {name}"
    button.click()


def test_names_in_a_campbell_diagram_are_whole_and_points_have_theirs(fresh, browser):
    fresh.write("m.nml", without_notes(PLANT).replace("orders = 1, 2, 3 ", "orders = 1, 0.666667, 1.333333 "))
    assert fresh("m.nml", "--no-pdf", "--quiet").returncode == 0
    browser.open(fresh.page())
    outside = """const svg = document.querySelector('#campbell .picture svg'), frame = svg.getBoundingClientRect();
    return [...svg.querySelectorAll('text')].filter((one) => one.getBoundingClientRect().right > frame.right + 0.5).length"""
    assert browser.ask(outside) == 0
    named = browser.ask("return [...document.querySelectorAll('#campbell .named')].map((one) => one.textContent)")
    assert named and set(named) <= set(column(browser, "Critical speeds", "mode/order"))


def test_a_very_large_machine_is_cut_and_the_report_says_so(fresh, browser):
    count = 300
    text = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(count))
    text += "".join(f"&coupling name = 's{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e4 /\n" for i in range(count - 1))
    fresh.write("m.nml", text + "&run t_end = 0.01 /\n")
    assert fresh("m.nml", "--no-pdf", "--quiet").returncode == 0
    browser.open(fresh.page())
    assert len(column(browser, "Bodies with", "body")) == 100
    machine = browser.find("#machine").text + browser.find("#mass-elastic").text
    assert "200 more rows are in the input." in machine and "The first 120 of 300 bodies are drawn." in machine
    assert "100 more lines are in the file" in browser.find("#input").text


def test_a_range_that_a_rule_does_not_allow_to_bar_is_the_verdict(fresh, browser):
    for name in ("ship_plant.nml", "diesel.csv"):
        fresh.write(name, (SOURCE / "docs/tutorial" / name).read_text(encoding="utf-8"))
    words = ("--no-pdf", "--quiet", "--set", "run.t_end=0.1", "--out", "results/m")
    assert fresh("ship_plant.nml", *words, "--set", "engine.diesel.misfire=1").returncode == 0
    browser.open(fresh.page())
    told = "exceeded at 106.8 to 107.1 rpm, lambda 0.84: not allowed by IACS UR M68"
    assert told in browser.find("#summary p").text
    assert column(browser, "Verdict on all limits", "finding")[0].startswith(told)
    criteria = column(browser, "Verdict on all limits", "criterion")
    assert not any("steady" in one for one in criteria)  # what the run leaves open, the response says
    assert len([one for one in criteria if one.startswith("distance")]) == 6  # campbell and response have the same ones
    page = browser.find("main").text
    assert "viscous at 5.34 Hz" in page and "stress_tail" not in page
    assert fresh("ship_plant.nml", "--no-pdf", "--quiet", "--set", "run.t_end=0.1").returncode == 0
    browser.open(fresh.page("ship_plant"))
    assert browser.find("#summary p").text.startswith("kept, ")


def test_other_load_cases_beyond_a_limit_have_their_curves(fresh, browser):
    case = "&load_case name = 'blow' title = 'A blow' repeats = 20 set = 'excitation.orders.amplitudes=900,1500,600' /"
    plant = without_notes(PLANT).replace("&load_case name = 'blow' title = 'A blow' repeats = 20 /", case)
    fresh.write("m.nml", plant.replace("vibratory_moment = 1500.0", "vibratory_moment = 6000.0"))
    assert fresh("m.nml", "--no-pdf", "--quiet").returncode == 0
    browser.open(fresh.page())
    assert faults(browser) == []
    assert "blow, tyre: elastic and damping moment" in browser.find("#response").text


def test_changes_since_another_revision_are_told(fresh, browser):
    fresh.write("m.nml", without_notes(PLANT))
    assert fresh("m.nml", "--no-pdf", "--quiet", "--out", "old").returncode == 0
    fresh.write("m.nml", without_notes(PLANT).replace("stiffness = 4.0e5", "stiffness = 5.0e5"))
    assert fresh("m.nml", "--no-pdf", "--quiet", "--against", "old").returncode == 0
    browser.open(fresh.page())
    assert faults(browser) == []
    modes = [json.loads((fresh.folder / name / "calm/modes.json").read_text())["modes"] for name in ("old", "results/m")]
    first = [next(one["frequency_Hz"] for one in those if one["kind"] == "oscillating") for those in modes]
    caption = "Numbers that are not the same [Hz]"
    assert column(browser, caption, "of")[0] == "mode I"
    assert [plain(column(browser, caption, head)[0]) for head in ("old", "new")] == pytest.approx(first, rel=1e-4)
    assert "of the verdict that are not the same" in browser.find("#changes").text
    assert "-  stiffness = 4" in browser.find("#details").text and "+  stiffness = 5" in browser.find("#details").text
    assert fresh("m.nml", "--no-pdf", "--quiet", "--against", "results/m").returncode == 2
    outcome = fresh("m.nml", "--no-pdf", "--quiet", "--against", "none")
    assert (outcome.returncode, outcome.stderr) == (2, "nocdyn report: --against none: has no results of nocdyn\n")
    assert fresh("m.nml", "--no-pdf", "--out", "new", "--against", "none").stdout == ""  # nothing was computed


def test_lines_that_fill_a_panel_are_bands():
    curves = importlib.import_module("nocdyn_report.report.curves")
    time = np.linspace(0, 1, 5000)
    arrays = curves.Arrays()
    slow, fast = (arrays.curve("a", time, np.sin(2 * np.pi * count * time)) for count in (20, 400))
    assert "low" not in slow and "low" in fast
    low, high = (np.frombuffer(base64.b64decode(arrays.texts[fast[key]]), "<f4") for key in ("low", "y"))
    assert low == pytest.approx(-1, abs=0.05) and high == pytest.approx(1, abs=0.05)  # of 12 points in an oscillation


def test_units_are_those_of_engineers():
    units = importlib.import_module("nocdyn_report.report.readable").Units("rpm")
    assert units.amount(22812803.0, "Pa") == "22.81 MPa"
    assert units.amount(6300.0, "N m", like=6300.0) == "6300 N m" and units.amount(7.5e4, "N m") == "75 kN m"
    assert units.amount(9.0, "rad/s") == "85.94 rpm"
    head, cells = units.column("twist", "rad", [0.1, 1e-12, None])
    assert head == "twist [deg]" and [cell.text for cell in cells] == ["5.7296", "0", "\N{EN DASH}"]
    life = importlib.import_module("nocdyn_report.report.readable").life
    assert life(1e-28).text == "< 10⁻¹²" and plain(life(7.4123e15).text) == 7.4e15


def test_the_state_that_a_machine_can_stay_in_is_its_operating_point():
    ordered = importlib.import_module("nocdyn_report.report.sections.steady").ordered_states
    states = [
        {"stability": "unstable", "values": {}},
        {"stability": "stable", "is_at_rest": True, "values": {}},
        {"stability": "stable", "is_at_rest": False, "values": {}},
    ]
    assert ordered({"steady_states": states}) == [states[2], states[1], states[0]]


def test_paper_says_that_a_table_has_more_columns():
    content = importlib.import_module("nocdyn_report.report.content")
    tables = [content.Table("", ["a_long_name_of_a_column"] * count, [[content.number(1.5)] * count]) for count in (20, 3)]
    assets = jinja2.FileSystemLoader(SOURCE / "scripts/nocdyn_report/report/assets")
    module = jinja2.Environment(loader=assets, autoescape=True).get_template("blocks.html.jinja").module
    assert ["wider than the page" in module.block_of(table) for table in tables] == [True, False]


def test_the_report_of_a_plant_has_few_pages(fresh):
    for name in ("ship_plant.nml", "diesel.csv"):
        fresh.write(name, (SOURCE / "docs/tutorial" / name).read_text(encoding="utf-8"))
    assert fresh("ship_plant.nml", "--quiet").returncode == 0
    content = (fresh.folder / "results/ship_plant/report.pdf").read_bytes()
    assert 5 < len(re.findall(rb"/Type */Page\b", content)) <= 10
    page = html.unescape(fresh.page("ship_plant").read_text(encoding="utf-8"))
    # tables of Holzer have a row for each node of a shaft: not more of them than rows for which there is room
    assert "Holzer table of undamped mode 1, 5.3447 Hz" in page and "Holzer table of undamped mode 2" not in page
    assert "frequency in modes.csv" not in page and "holzer.csv has the tables of all 37 modes" in page
    assert "Modes above 85.42 Hz: 31, in the appendix" in page and "31 more modes are in campbell.csv" in page
    assert "with tolerance" in page and page.count("may be passed quickly</td>") == 2
