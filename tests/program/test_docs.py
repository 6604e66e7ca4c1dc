"""What the documentation claims about the program, its sources and its tests."""

import csv
import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import SOURCE, TRAPS_EXCEPTIONS

PAGES = SOURCE / "docs" / "pages"
TOP_PAGES = [SOURCE / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
DOCUMENTS = [page for page in [*sorted(PAGES.glob("*.md")), *TOP_PAGES] if page.exists()]

UNIT = re.compile(
    r"^\s*(?:(?:pure|elemental|recursive|integer|logical|real\(wp\))\s+)*"
    r"(?:module(?!\s+procedure)|program|subroutine|function|type\b[^:!]*::)\s+(\w+)",
    re.MULTILINE,
)
COMMENTED_UNIT = re.compile(r"((?:^[ \t]*!>.*\n)+)" + UNIT.pattern, re.MULTILINE)


def name_of(path):
    return path.relative_to(SOURCE).as_posix()


def module_text(module):
    paths = list((SOURCE / "src").rglob(f"{module.removeprefix('nocdyn_')}.f90"))
    assert paths, f"there is no module {module}"
    return paths[0].read_text()


def slug(heading):
    """As FORD's Markdown makes them."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


def headings(text):
    text = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    return {slug(heading) for heading in re.findall(r"^#+ +(.*)$", text, re.MULTILINE)}


@pytest.mark.parametrize("page", DOCUMENTS, ids=name_of)
def test_relative_links_lead_to_files_and_headings(page, staged):
    """A page has the headings too that it gets when the site is built."""
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"\\\(.*?\\\)", "", page.read_text())):
        if re.match(r"[a-z]+:", target):
            continue
        file, _, anchor = target.partition("#")
        linked = page.parent / file if file else page
        assert linked.exists(), f"{target}: no such file"
        if anchor:
            made = staged[linked.name] if linked.parent == PAGES else ""
            assert anchor in headings(linked.read_text() + made), f"{target}: no such heading"


@pytest.mark.parametrize("page", DOCUMENTS, ids=name_of)
def test_modules_and_procedures_that_pages_link_to_exist(page):
    for module, kind, unit in re.findall(r"\[\[(\w+)(\(module\))?(?::(\w+))?\]\]", page.read_text()):
        assert kind or unit, f"[[{module}]] says neither module nor unit"
        text = module_text(module)
        if unit:
            assert unit in UNIT.findall(text), f"{unit} is not in {module}"


@pytest.mark.parametrize("page", DOCUMENTS, ids=name_of)
def test_tests_that_pages_name_exist(page):
    for file, test in re.findall(r"`(test_\w+): (\w+)`", page.read_text()):
        paths = [path for path in (SOURCE / "tests").rglob(f"{file}.*") if path.suffix in (".pf", ".py")]
        assert paths, f"there is no {file}"
        assert re.search(rf"(subroutine|def) {test}\b", paths[0].read_text()), f"{test} is not in {file}"


@pytest.mark.parametrize("page", DOCUMENTS, ids=name_of)
def test_files_that_pages_name_exist(page):
    for path in re.findall(r"`((?:src|docs|tests|scripts|input)/[\w./]+)`", page.read_text()):
        assert path == "docs/site" or (SOURCE / path).exists(), f"there is no {path}"  # scripts/docs makes docs/site


def script_of_docs(name):
    """docs/NAME.py as a module."""
    description = importlib.util.spec_from_file_location(name, SOURCE / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(description)
    description.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def fill_pages():
    return script_of_docs("fill_pages")


@pytest.mark.parametrize("page", DOCUMENTS, ids=name_of)
def test_pages_quote_files_as_they_are(page, fill_pages):
    text = page.read_text(encoding="utf-8")
    assert fill_pages.filled(text) == text, "scripts/docs --refresh puts the files into the pages"


def test_every_file_of_the_examples_is_quoted():
    quoted = {
        name for page in PAGES.glob("*.md") for name in re.findall(r"<!-- fill: file (\S+) -->", page.read_text(encoding="utf-8"))
    }
    files = {name_of(path) for path in (SOURCE / "docs" / "examples").iterdir()}
    assert files == {name for name in quoted if name.startswith("docs/examples/")}


def test_every_place_of_a_page_is_filled():
    for page in PAGES.glob("*.md"):
        for what, content in re.findall(
            r"<!-- fill: (.*?) -->\n(.*?)<!-- filled -->", page.read_text(encoding="utf-8"), re.DOTALL
        ):
            assert content.strip(), f"{page.name}: nothing at {what}"


def test_tables_pictures_and_sections_go_to_their_places(fill_pages, tmp_path, monkeypatch):
    monkeypatch.setattr(fill_pages, "ROOT", tmp_path)
    (tmp_path / "docs" / "media").mkdir(parents=True)
    (tmp_path / "curve.svg").write_text("<svg/>")
    (tmp_path / "bench.md").write_text(
        "# Title\n\n- processor: fast\n\n## W3: chain\n\n| a |\n\nW3: wanted 1: **missed**.\n\n## W4: x\n\ny\n"
    )
    (tmp_path / "digits.md").write_text("digits\n\n| 1 |\n| - |\n\nprices\n\n| 2 |\n| - |\n")
    places = ["table digits 2", "bench", "bench W3:", "picture curve", "run nothing"]
    page = "\n".join(f"<!-- fill: {place} -->\nold\n<!-- filled -->" for place in places)
    contents = ["| 2 |\n| - |", "- processor: fast", "*W3: chain*\n\n| a |", "![curve](../media/curve.svg)"]
    expected = [f"<!-- fill: {place} -->\n\n{content}\n\n<!-- filled -->" for place, content in zip(places, contents)]
    new = fill_pages.filled(page, tables=tmp_path, bench=tmp_path)
    assert new == "\n".join([*expected, "<!-- fill: run nothing -->\nold\n<!-- filled -->"])
    assert fill_pages.filled(new, tables=tmp_path, bench=tmp_path) == new
    assert (tmp_path / "docs" / "media" / "curve.svg").exists()
    with pytest.raises(fill_pages.MissingError, match="table 3"):
        fill_pages.filled("<!-- fill: table digits 3 -->\n<!-- filled -->", tables=tmp_path)


def equations(text):
    """The numbers in '(16), (47), (52)-(56)'."""
    numbers = set()
    for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", text):
        numbers |= set(range(int(first), int(last or first) + 1))
    return numbers


def equation_rows():
    table = (PAGES / "theory.md").read_text().split("## Equations and procedures")[1]
    rows = re.findall(r"^\| (\(\d+\)[^|]*)\|[^|]*\| \[\[(\w+)(?:\(module\))?(?::(\w+))?\]\] \|$", table, re.MULTILINE)
    return [(equation.strip(), module, unit or module) for equation, module, unit in rows]


def test_the_theory_page_has_its_table_of_equations():
    assert len(equation_rows()) >= 25


@pytest.mark.parametrize(("equation", "module", "unit"), equation_rows())
def test_doc_comment_of_the_unit_carries_the_equation_number(equation, module, unit):
    comments = {name: comment for comment, name in COMMENTED_UNIT.findall(module_text(module))}
    missing = equations(equation) - equations(comments[unit])
    assert not missing, f"({missing}) is not in the comment of {unit}: {comments[unit]}"


def test_every_equation_from_1_to_109_is_accounted_for():
    section = (PAGES / "theory.md").read_text().split("## Equations and procedures")[1]
    text = section.split("## References")[0].replace(") to (", ")-(")
    assert equations(text) == set(range(1, 110))


@pytest.fixture(scope="module")
def reference():
    """The page that scripts/docs makes from the schema."""
    build = os.environ["NOCDYN_BUILD"]
    subprocess.run(["cmake", "--build", build, "--target", "nocdyn_input_reference"], check=True, capture_output=True)
    return subprocess.run([f"{build}/bin/nocdyn_input_reference"], check=True, capture_output=True, text=True).stdout


def keys_of_help(text):
    """Group -> {(key, default)} as `nocdyn help input all` prints them."""
    groups = {}
    one_line_each = re.sub(r"\n {20,}", " ", text.split("\nExample")[0])
    for line in one_line_each.splitlines():
        if group := re.match(r"&(\w+), ", line):
            keys = groups.setdefault(group[1], set())
        elif key := re.match(r" {4}(\w+) .*?\s((?:required|default|optional|this or|this,).*)$", line):
            keys.add((key[1], key[2]))
    return groups


def test_input_reference_has_the_groups_keys_and_defaults_of_the_help(nocdyn, reference):
    groups = {}
    for section in re.split(r"^### `&", reference, flags=re.MULTILINE)[1:]:
        rows = re.findall(r"^\| `(\w+)` \|([^|]*)\|([^|]*)\|([^|]*)\|([^|]*)\|$", section, re.MULTILINE)
        groups[section.split("`")[0]] = {(row[0], row[2].strip()) for row in rows}
    assert groups == keys_of_help(nocdyn("help", "input", "all").stdout)
    assert len(groups) >= 9 and all(groups.values())


def test_input_reference_has_the_topics_and_groups_of_the_help_in_their_order(nocdyn, reference):
    headings = re.findall(r"^(?:## (.*)|### `&(\w+)`)$", reference, re.MULTILINE)
    overview = nocdyn("help", "input").stdout
    lines = re.findall(r"^(?:(\w+: .*)|  &(\w+) .*)$", overview, re.MULTILINE)
    assert [(topic[:1].lower() + topic[1:], group) for topic, group in headings] == lines


@pytest.fixture(scope="module")
def schema(reference):
    """What `nocdyn help input --json` says of the groups."""
    said = subprocess.run([os.environ["NOCDYN"], "help", "input", "--json"], check=True, capture_output=True, text=True).stdout
    return json.loads(said)["properties"]


@pytest.fixture(scope="module")
def staged(reference, schema):
    """The pages as scripts/docs makes them for FORD."""
    return script_of_docs("stage_pages").staged_pages(reference, schema)


def test_index_of_keys_has_every_key_of_every_group_once(staged, schema):
    rows = re.findall(r"^\| (`[^|]*`) \| \[`&(\w+)`\]", staged["keys.md"], re.MULTILINE)
    listed = [(group, key) for keys, group in rows for key in re.findall(r"`(\w+)`", keys)]
    groups = {group: (rule if "properties" in rule else rule["items"])["properties"] for group, rule in schema.items()}
    assert sorted(listed) == sorted((group, key) for group, keys in groups.items() for key in keys)


def test_index_of_keys_tells_group_kinds_unit_default_and_meaning(staged):
    assert (
        "| `breakdown_torque` | [`&motor`](./reference.html#motor): induction | N m |  "
        "| T_k, the largest torque; it has the sign of synchronous_speed |" in staged["keys.md"]
    )
    assert "| `angle`, `angle_deg` | [`&body`](./reference.html#body) | rad, deg | 0 | angle at the start |" in staged["keys.md"]
    assert "| `inertia` | [`&body`](./reference.html#body) | kg m2 | required |" in staged["keys.md"]


def test_links_to_groups_and_sections_of_the_former_page_on_inputs_lead_on(staged, schema):
    anchors = set(re.findall(r'<span id="([\w-]+)">', staged["input.md"]))
    moved = script_of_docs("stage_pages").MOVED
    assert anchors == {*schema, *(anchor for part in moved.values() for anchor in part)}
    for page, sections in moved.items():
        assert headings(staged[f"{page}.md"]) >= set(sections)


def test_a_page_of_several_sections_begins_with_its_contents(staged):
    contents = "\n\n[TOC]\n\n"
    for name, text in staged.items():
        sections = len(re.findall(r"^#{2,3} ", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE))
        assert text.count(contents) == (sections >= 3), name


def test_tables_of_the_site_scroll_in_boxes_and_keep_words_together():
    wide_tables = script_of_docs("wide_tables")
    sentence = "a sentence that is longer than sixty characters, so that its column is wide"
    table = (
        '<table>\n<tr>\n<th>key</th>\n<th>what</th>\n<th style="text-align: right;">a head of many words</th>\n</tr>\n'
        f'<tr>\n<td><code>a_key</code></td>\n<td>{sentence}</td>\n<td style="text-align: right;">1</td>\n</tr>\n</table>'
    )
    boxed = wide_tables.boxed(table)
    wide = "".join(f"<tr>{'<td>1</td>' * wide_tables.MANY}</tr>" for _ in range(2))
    assert wide_tables.boxed(f"<table>{wide}</table>").startswith('<div class="table-box many" tabindex="0"><table>')
    assert boxed.startswith('<div class="table-box few" tabindex="0"><table>') and boxed.endswith("</table></div>")
    assert f'<td class="long">{sentence}</td>' in boxed
    assert boxed.count('class="short"') == 4 and '<td style="text-align: right;" class="short">1</td>' in boxed


@pytest.fixture(scope="module")
def index(staged):
    """A function that finds words in the guide as the search of the site does."""
    search_index = script_of_docs("search_index")
    documents = [section for name, text in staged.items() for section in search_index.sections_of(name, text)]
    serialized = search_index.index_of(documents).serialize()
    return lambda words: [document["url"] for document in search_index.search(serialized, documents, words)]


@pytest.mark.parametrize(
    ("words", "first"),
    [
        ("planetary", "page/reference.html#planetary"),
        ("planet", "page/reference.html#planetary"),
        ("&gear", "page/reference.html#gear"),
        ("share_of_load", "page/reference.html#excitation"),
        ("damping_frequency_hz", "page/reference.html#coupling"),
        ("tolerances", "page/choosing-a-method.html#tolerances"),
        ("natural orthogonal complement", "page/theory.html#the-natural-orthogonal-complement-73-to-82"),
    ],
)
def test_search_finds_the_section_about_a_word_first(index, words, first):
    assert index(words)[0] == first


def test_search_takes_signs_for_no_operators(index):
    assert index("planetary~ -gear: +(x^2*)") and index("?!") == []


def test_site_gets_search_and_scripts_that_need_no_network(tmp_path):
    """On a page as FORD writes it; the libraries are empty files here."""
    search_index, self_contained = script_of_docs("search_index"), script_of_docs("self_contained")
    self_contained.INSTALLED = tmp_path / "javascript"
    for part in self_contained.COPIES:
        (self_contained.INSTALLED / part).parent.mkdir(parents=True, exist_ok=True)
        (self_contained.INSTALLED / part).write_text("")
    site, pages = tmp_path / "site", tmp_path / "pages"
    page = (
        '<html><link href="https://cdn.test/bootstrap.min.css" rel="stylesheet"\n integrity="sha384-x" crossorigin="anonymous">'
        '<script src="https://cdn.test/MathJax.js?config=TeX-AMS-MML_HTMLorMML" async></script>'
        '<div></div><!--/.nav-collapse --><h2 id="gaps">Gaps</h2></body></html>'
    )
    row = (
        "<tr>\n<td><a href='../proc/find_gap.html'>find_gap</a></td>\n<td>x</td>\n"
        "<td><p>Where a <em>gap</em> opens.</p></td>\n</tr>"
    )
    for name, text in {"page/a.html": page, "search.html": page, "lists/procedures.html": row}.items():
        (site / name).parent.mkdir(parents=True, exist_ok=True)
        (site / name).write_text(text)
    pages.mkdir()
    (pages / "a.md").write_text("title: A\n\nOne.\n\n## Gaps\n\n```\n## no heading\n```\nTwo.\n")
    search_index.main(site, pages)
    self_contained.main(site)
    linked = (site / "page" / "a.html").read_text()
    assert (
        "https://" not in linked
        and 'href="../lib/bootstrap5/css/bootstrap.min.css"' in linked
        and 'action="../search.html"' in linked
    )
    for script in re.findall(r'src="([^"?]+)', (site / "search.html").read_text()):
        assert (site / script).exists(), script
    data = (site / "search" / "index.js").read_text()
    assert '"url":"page/a.html#gaps"' in data and "no heading Two." in data and '"text":"Where a gap opens."' in data


PAGES_WITH_SESSIONS = [
    SOURCE / "README.md",
    *(
        PAGES / f"{name}.md"
        for name in (
            "tutorial",
            "modelling",
            "input",
            "editors",
            "signs",
            "equilibrium-and-modes",
            "orbits",
            "report",
            "results",
            "sweeps",
        )
    ),
]


@pytest.fixture(scope="module")
def sessions():
    return script_of_docs("sessions")


@pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the sweeps take minutes in debug")
@pytest.mark.skipif(not (Path(os.environ["NOCDYN"]).parent / "nocdyn-sweep").exists(), reason="built without sweeps")
@pytest.mark.parametrize("page", PAGES_WITH_SESSIONS, ids=name_of)
def test_commands_of_a_page_print_what_it_shows(page, sessions, tmp_path):
    environment = sessions.make_folder(tmp_path, os.environ["NOCDYN"])
    commands = sessions.sessions_of(page)
    assert commands
    for command, shown in commands:
        seen = sessions.output_of(command, tmp_path, environment)
        assert sessions.is_same(shown, seen), f"$ {command}\n{seen}"


@pytest.mark.skipif(not (Path(os.environ["NOCDYN"]).parent / "nocdyn-sweep").exists(), reason="built without sweeps")
def test_python_of_the_page_on_sweeps_reads_a_sweep(nocdyn):
    nocdyn("sweep", SOURCE / "input/sweeps/throughput.nml", "--set", "sweep.samples=20", "--quiet", "--out", "results/throughput")
    page = (PAGES / "sweeps.md").read_text(encoding="utf-8")
    code = "".join(re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL))
    seen = subprocess.run([sys.executable, "-c", code], cwd=nocdyn.folder, capture_output=True, text=True, check=True).stdout
    assert "N m" in seen and "count     20" in seen


def test_outputs_differ_in_words_and_numbers_but_not_in_times_and_rounding(sessions):
    shown = "pump: done, speed 147.6823 rad/s, rest 2.9e-11 J, 25.6 ms (1660 per second)\n"
    assert sessions.is_same(shown, "pump: done, speed  147.6824 rad/s, rest -1.1e-12 J, 1.2 ms (9 per second)\n")
    assert not sessions.is_same(shown, shown.replace("147.6823", "147.7823"))
    assert not sessions.is_same(shown, shown.replace("done", "failed"))


def test_sessions_are_read_with_long_commands_and_outputs(sessions, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "```\n$ nocdyn run \\\n  a.nml\none\ntwo\n$ ls\n```\n```\nnocdyn new a.nml\n```\n```text\n$ cat a\nthree\n```\n"
    )
    assert sessions.sessions_of(page) == [("nocdyn run \\\n  a.nml", "one\ntwo\n"), ("ls", ""), ("cat a", "three\n")]


FORD_METADATA = re.compile(r" {0,3}[\w-]+:")


def test_no_doc_comment_begins_with_a_word_and_a_colon():
    """FORD takes such a beginning for metadata of the unit and drops the line."""
    found = []
    for path in sorted((SOURCE / "src").rglob("*.f90")):
        above = False
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            comment = re.search(r"(?:^|\s)![!>](.*)", line)
            whole_line = comment is not None and line.lstrip().startswith("!")
            if comment and not (above and whole_line) and FORD_METADATA.match(comment[1]):
                found.append(f"{name_of(path)}:{number}: {line.strip()}")
            above = comment is not None
    assert not found


PAPER = SOURCE / "docs" / "paper"
PAPER_WORDS = range(750, 1751)  # of the Journal of Open Source Software


def test_the_paper_has_the_length_and_sections_of_its_journal():
    _, head, text = (PAPER / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    assert len(text.split()) in PAPER_WORDS
    sections = [
        "Summary",
        "Statement of need",
        "State of the field",
        "Software design",
        "Research impact statement",
        "References",
    ]
    assert re.findall(r"^# (.*)$", text, re.MULTILINE) == sections
    assert "The nocdyn authors" in head and "The nocdyn authors" in (SOURCE / "CITATION.cff").read_text()


def test_the_paper_cites_all_of_its_bibliography_and_nothing_else():
    cited = set(re.findall(r"(?<!\w)@(\w+)", (PAPER / "paper.md").read_text(encoding="utf-8")))
    assert cited == set(re.findall(r"^@\w+{(\w+),$", (PAPER / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE))


def test_the_paper_counts_the_cases_of_the_verification():
    origins = [row["origin"] for file in (SOURCE / "verification").glob("*/cases.csv") for row in csv.DictReader(file.open())]
    assert len(origins) > 450 and origins.count("closed form") > len(origins) / 2
    assert "more than 450 cases" in (PAPER / "paper.md").read_text(encoding="utf-8")
