"""The JSON Schema of inputs: the inputs of the project are valid by it, and what the program refuses is not."""

import doctest
import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import SOURCE
from jsonschema import Draft202012Validator

INPUTS = sorted(
    [*SOURCE.glob("input/**/*.nml"), *SOURCE.glob("verification/*/*/case.nml"), *SOURCE.glob("src/app/commands/templates/*.nml")]
)
LEAST = 200
EDITORS = SOURCE / "docs/editors"
MACHINE = """\
&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 2 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 10 /
&run t_end = 1 /
"""


@pytest.fixture
def documents(monkeypatch):
    """The script of the page on editors, as a module."""
    monkeypatch.syspath_prepend(EDITORS)
    return importlib.import_module("input_documents")


@pytest.fixture
def document(documents):
    return documents.namelist_document


def run_script(folder, *words):
    """A script of the page on editors, with the program on the path."""
    environment = os.environ | {"PATH": f"{Path(os.environ['NOCDYN']).parent}:{os.environ['PATH']}"}
    command = [sys.executable, EDITORS / words[0], *words[1:]]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture
def schema(nocdyn):
    outcome = nocdyn("help", "input", "--json")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    content = json.loads(outcome.stdout)
    Draft202012Validator.check_schema(content)
    return content


def test_inputs_of_the_project_are_valid(schema, document):
    validator = Draft202012Validator(schema)
    assert len(INPUTS) >= LEAST
    for path in INPUTS:
        errors = [
            (list(error.absolute_path), error.message)
            for error in validator.iter_errors(document(path.read_text(encoding="utf-8"), schema))
        ]
        assert not errors, path


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("inertia = 1", "inertia = -1"),
        ("inertia = 1", "inertia = 'heavy'"),
        ("inertia = 1", "inertia = '1'"),
        ("inertia = 1", "inertia = 1 speed_rpm = '20 Hz'"),
        ("inertia = 1", "mass = 1"),
        ("t_end = 1", "t_end = 1 method = 'euler'"),
        ("stiffness = 10", "stiffness = 10, 20"),
        ("&coupling", "&spring"),
        ("&run t_end = 1 /", ""),
        ("bodies = 'a', 'b'", "bodies = 'a', 'b', 'a'"),
    ],
)
def test_what_the_program_refuses_is_not_valid(nocdyn, schema, document, old, new):
    assert not list(Draft202012Validator(schema).iter_errors(document(MACHINE, schema)))
    text = MACHINE.replace(old, new, 1)
    assert text != MACHINE
    assert list(Draft202012Validator(schema).iter_errors(document(text, schema)))
    assert nocdyn("check", nocdyn.write("m.nml", text)).returncode == 2


@pytest.mark.parametrize("quantity", ["'12 kN m/rad'", "'4.4e6lbf-ft/rad'", "'.5 N m/deg'"])
def test_numbers_with_a_unit_are_valid(nocdyn, schema, document, quantity):
    text = MACHINE.replace("stiffness = 10", f"stiffness = {quantity}")
    assert not list(Draft202012Validator(schema).iter_errors(document(text, schema)))
    assert nocdyn("check", nocdyn.write("m.nml", text)).returncode == 0


def test_keys_have_their_units_and_defaults(schema):
    body = schema["properties"]["body"]["items"]["properties"]
    assert body["inertia"]["x-unit"] == "kg m2" and body["speed_rpm"]["x-unit"] == "rpm"
    assert body["speed_rpm"]["description"].endswith(" [rpm]") and not body["name"]["description"].endswith("]")
    assert schema["properties"]["run"]["properties"]["rtol"]["x-default"] == "1e-6"
    assert schema["required"] == ["body", "run"]


def test_json_is_of_all_groups(nocdyn):
    for words in (("help", "--json"), ("help", "run", "--json"), ("help", "input", "body", "--json")):
        outcome = nocdyn(*words)
        assert outcome.returncode == 2
        assert "--json is for nocdyn help input" in outcome.stderr


def test_mistakes_name_group_element_and_key(documents, schema):
    text = MACHINE.replace("'b' inertia = 2", "'b' inertai = 2").replace("t_end = 1", "t_end = 1 rtol = 2")
    assert list(documents.mistakes(documents.namelist_document(text, schema), schema)) == [
        "&body 'b': Additional properties are not allowed ('inertai' was unexpected)",
        "&body 'b': 'inertia' is a required property",
        "&run rtol: 2 is greater than the maximum of 0.1",
    ]


@pytest.mark.parametrize("name", ["docs/tutorial/pump.nml", "input/examples/engine/engine.nml", "input/sweeps/tolerance.nml"])
def test_an_input_is_the_same_after_json_and_back(documents, schema, tmp_path, name):
    there = run_script(tmp_path, "input_documents.py", "json", SOURCE / name)
    (tmp_path / "machine.json").write_text(there.stdout)
    back = run_script(tmp_path, "input_documents.py", "namelist", "machine.json")
    first = documents.namelist_document((SOURCE / name).read_text(encoding="utf-8"), schema)
    assert documents.namelist_document(back.stdout, schema) == first and first["body"]


def test_checking_files_ends_with_1_if_one_is_not_valid(tmp_path):
    (tmp_path / "good.nml").write_text(MACHINE)
    (tmp_path / "bad.nml").write_text(MACHINE.replace("inertia = 1", "inertia = -1"))
    assert run_script(tmp_path, "input_documents.py", "check", "good.nml").returncode == 0
    outcome = run_script(tmp_path, "input_documents.py", "check", "good.nml", "bad.nml")
    assert outcome.returncode == 1
    assert outcome.stdout == "good.nml: valid\nbad.nml: &body 'a' inertia: -1 is less than the minimum of 0\n"


def test_completions_have_every_group_with_the_keys_it_must_have(tmp_path, schema):
    snippets = json.loads(run_script(tmp_path, "completions.py", "vscode").stdout)
    assert {f"&{name}" for name in schema["properties"]} == set(snippets)
    assert snippets["&body"]["body"] == "&body name = '$1' inertia = $2 $0 /"
    assert "design = '${1|grid,random,latin,sobol,list|}'" in snippets["&sweep"]["body"]
    words = run_script(tmp_path, "completions.py", "vim").stdout.split()
    assert {"&coupling", "stiffness", "speed_rpm"} <= set(words)


def test_python_of_the_page_prints_what_it_shows(documents, monkeypatch):
    monkeypatch.setenv("PATH", f"{Path(os.environ['NOCDYN']).parent}:{os.environ['PATH']}")
    failed, count = doctest.testfile(str(SOURCE / "docs/pages/editors.md"), module_relative=False, encoding="utf-8")
    assert failed == 0 and count > 5
