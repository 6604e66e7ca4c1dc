"""nocdyn new --kind: inputs of kinds of machines, which run, are steady and say what is to be said."""

import json
import re

import pytest
from conftest import SOURCE, all_if_fast

FOLDER = SOURCE / "src/app/commands/templates"
KINDS = sorted(path.stem for path in FOLDER.glob("*.nml"))


@pytest.fixture
def template(nocdyn):
    def new(kind):
        assert nocdyn("new", "--kind", kind, "machine.nml").returncode == 0
        return nocdyn.folder / "machine.nml"

    return new


def test_the_kinds_are_those_of_the_help(nocdyn):
    assert KINDS == ["car", "compressor", "genset", "mill", "motor_fan", "ship", "wind"]
    assert ", ".join(KINDS) in " ".join(nocdyn("help", "new").stdout.split())


@pytest.mark.parametrize("kind", KINDS)
def test_a_template_is_the_file_of_the_sources(template, kind):
    assert template(kind).read_text() == (FOLDER / f"{kind}.nml").read_text()


@pytest.mark.parametrize("kind", all_if_fast(*KINDS))
def test_every_command_computes_a_template(nocdyn, template, kind):
    text = template(kind).read_text()
    commands = ["check", "run", "equilibrium", "modes"] + (["response", "campbell"] if "&response" in text else [])
    for command in commands:
        outcome = nocdyn(command, "machine.nml", "--out", "out")
        assert (outcome.returncode, outcome.stderr) == (0, ""), (command, outcome.stderr)
    # what the machine is for is kept in normal operation
    first = re.search(r"^&load_case +name = '(\w+)'", text, re.MULTILINE)
    name = "summary.json" if kind in ("car", "mill") else "response.json"
    report = json.loads((nocdyn.folder / "out" / (first[1] if first else "") / name).read_text())
    assert not report.get("limits_exceeded", False)
    assert kind == "car" or report["verdict"]["lines"]


def test_the_ship_of_the_template_may_not_run_with_a_misfire_near_its_rated_speed(nocdyn, template):
    template("ship")
    outcome = nocdyn("response", "machine.nml", "--out", "out", "--strict")
    assert outcome.returncode == 1
    worst = json.loads((nocdyn.folder / "out/response_cases.json").read_text())["verdict"]["lines"][0]
    assert worst["load_case"] == "misfire" and "not allowed by IACS UR M68" in worst["assessment"]


def test_an_unknown_kind_and_a_file_that_exists_are_refused(nocdyn, template):
    outcome = nocdyn("new", "--kind", "shipp", "other.nml")
    assert outcome.returncode == 2 and not (nocdyn.folder / "other.nml").exists()
    assert outcome.stderr == (
        "nocdyn: --kind: 'shipp' is no kind of machine; did you mean 'ship'?; allowed: "
        "'car', 'compressor', 'genset', 'mill', 'motor_fan', 'ship', 'wind'\n"
    )
    outcome = nocdyn("new", "--kind", "boat", "other.nml")
    assert outcome.stderr.count("allowed") == 1
    path = template("mill")
    outcome = nocdyn("new", "--kind", "car", "machine.nml")
    assert outcome.returncode == 3 and "exists and was not changed" in outcome.stderr
    assert "Rolling mill" in path.read_text()
