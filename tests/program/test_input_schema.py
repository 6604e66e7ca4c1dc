"""The JSON Schema of inputs: the inputs of the project are valid by it, and what the program refuses is not."""

import json

import f90nml
import pytest
from conftest import SOURCE
from jsonschema import Draft202012Validator

INPUTS = sorted(
    [*SOURCE.glob("input/**/*.nml"), *SOURCE.glob("verification/*/*/case.nml"), *SOURCE.glob("src/app/commands/templates/*.nml")]
)
LEAST = 200
MACHINE = """\
&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 2 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 10 /
&run t_end = 1 /
"""


def plain(content):
    """What f90nml has read, as a program would write it."""
    if isinstance(content, dict):
        return {key: plain(value) for key, value in content.items() if key != "_start_index"}
    if isinstance(content, list):
        return [plain(value) for value in content]
    return content


def document(text, schema):
    """Groups by their names; those that may repeat are lists."""
    namelist = f90nml.reads(text)
    groups = {}
    for name in dict.fromkeys(namelist):
        content = namelist[name]
        groups[name] = [plain(one.todict()) for one in (content if isinstance(content, list) else [content])]
    single = {name for name, rule in schema["properties"].items() if rule["type"] == "object"}
    return {name: found[0] if name in single and len(found) == 1 else found for name, found in groups.items()}


@pytest.fixture
def schema(nocdyn):
    outcome = nocdyn("help", "input", "--json")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    content = json.loads(outcome.stdout)
    Draft202012Validator.check_schema(content)
    return content


def test_inputs_of_the_project_are_valid(schema):
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
        ("inertia = 1", "mass = 1"),
        ("t_end = 1", "t_end = 1 method = 'euler'"),
        ("stiffness = 10", "stiffness = 10, 20"),
        ("&coupling", "&spring"),
        ("&run t_end = 1 /", ""),
        ("bodies = 'a', 'b'", "bodies = 'a', 'b', 'a'"),
    ],
)
def test_what_the_program_refuses_is_not_valid(nocdyn, schema, old, new):
    assert not list(Draft202012Validator(schema).iter_errors(document(MACHINE, schema)))
    text = MACHINE.replace(old, new, 1)
    assert text != MACHINE
    assert list(Draft202012Validator(schema).iter_errors(document(text, schema)))
    assert nocdyn("check", nocdyn.write("m.nml", text)).returncode == 2


def test_keys_have_their_units_and_defaults(schema):
    body = schema["properties"]["body"]["items"]["properties"]
    assert body["inertia"]["x-unit"] == "kg m2" and body["speed_rpm"]["x-unit"] == "rpm"
    assert schema["properties"]["run"]["properties"]["rtol"]["x-default"] == "1e-6"
    assert schema["required"] == ["body", "run"]


def test_json_is_of_all_groups(nocdyn):
    for words in (("help", "--json"), ("help", "run", "--json"), ("help", "input", "body", "--json")):
        outcome = nocdyn(*words)
        assert outcome.returncode == 2
        assert "--json is for nocdyn help input" in outcome.stderr
