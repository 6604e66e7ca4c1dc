"""columns.json and response_columns.json: what every column is, in words, with a unit; their labels are those of the tables."""

import csv
import json
import re

import pytest
from conftest import SOURCE, first_case
from sweep_inputs import SWEEP_PROGRAM
from test_labels import BODIES, ELEMENTS

INPUTS = sorted((SOURCE / "input").rglob("*.nml"))
LOOSE = ("--set", "run.rtol=1e-2", "--set", "run.atol=1e-3", "--set", "output.points=2")
KEYS = {"label", "name", "kind", "element_kind", "element", "point", "unit", "caption", "positive", "rank"}
RANKS = re.compile(r"rank_(\w+) = (\d+)")


def check(columns, input_text):
    """Whether every column says what it is, and of which group of the input."""
    groups = set(re.findall(r"&(\w+)", input_text)) | {""}
    if "engine" in groups:
        groups.add("excitation")  # of each of its cylinders
    for column in columns:
        assert column.keys() - {"file", "statistic"} == KEYS, column
        assert column["caption"] and column["unit"] and column["name"], column
        assert column["element_kind"] in groups and bool(column["element"]) == bool(column["element_kind"]), column
        assert column["label"].endswith(f"{column['name']} [{column['unit']}]") or column.get("statistic"), column
        assert column["label"].startswith(column.get("statistic", column["name"])), column
        assert column["name"].startswith(column["kind"]) and column["element"] in column["name"], column
        assert len(f"{column['caption']} [{column['unit']}]") <= 60, "too long for an axis"


def labels(columns, file):
    return [column["label"] for column in columns if column.get("file") == file]


def header(nocdyn, path):
    with open(nocdyn.folder / path, newline="", encoding="utf-8") as file:
        return next(csv.reader(file))


def forces_are_called_forces(columns):
    for column in columns:
        words = column["caption"]
        if column["kind"] == "force" and column["element_kind"] == "mesh":
            assert words == "tooth force" and column["unit"] == "N"
        assert ("force" in words) <= (column["unit"] == "N") and ("stress" in words) <= (column["unit"] == "Pa"), column
        assert ("moment" in words or "torque" in words) <= (column["unit"] == "N m"), column


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: path.stem)
def test_every_signal_of_a_shipped_machine_has_a_caption_and_a_unit(nocdyn, path):
    case = first_case(path)
    outcome = nocdyn("run", path, "--out", "out", "-q", *LOOSE, *case)
    assert outcome.returncode == 0, outcome.stderr
    folder = "/".join(("out", *case[1:]))
    columns = nocdyn.columns(folder)
    check(columns, (nocdyn.folder / folder / "input.nml").read_text())
    assert labels(columns, "trajectory.csv") == header(nocdyn, f"{folder}/trajectory.csv")
    assert [column["label"] for column in columns][1:] == list(nocdyn.summary(folder)["columns"]) or len(columns) > 1
    forces_are_called_forces(columns)


@pytest.mark.parametrize("kind", ELEMENTS)
def test_every_kind_of_element_names_its_signals(nocdyn, kind):
    nocdyn.write("m.nml", BODIES + ELEMENTS[kind].format("x") + "\n&output columns = '*', '*[*]*' points = 2 /\n")
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    columns = nocdyn.columns("out")
    check(columns, (nocdyn.folder / "out/input.nml").read_text())
    assert labels(columns, "trajectory.csv") == header(nocdyn, "out/trajectory.csv")
    assert {column["element_kind"] for column in columns} <= {"", "body", kind, *(["excitation"] * (kind == "engine"))}
    assert any(column["element_kind"] == kind for column in columns) or kind == "engine"
    forces_are_called_forces(columns)


def test_columns_of_field_units_have_them(nocdyn):
    nocdyn.write(
        "m.nml", BODIES + ELEMENTS["coupling"].format("x") + "\n&output units = 'rpm', 'deg' columns = 't', 'omega_*' /\n"
    )
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    columns = nocdyn.columns("out")
    assert labels(columns, "trajectory.csv") == header(nocdyn, "out/trajectory.csv")
    speeds = [column for column in columns if column["kind"] == "omega"]
    assert {(column["unit"], column["file"]) for column in speeds} == {("rpm", "trajectory.csv")}
    assert {column["unit"] for column in columns if column["kind"] == "phi"} == {"deg"}
    assert {column.get("file") for column in columns if column["kind"] == "phi"} == {None}  # only summary.json has them


RESPONSES = ["torque_split", "ice_propeller", "reciprocating_compressor", "wind_turbine", "three_rotors"]


@pytest.mark.parametrize("name", RESPONSES)
def test_the_columns_of_a_response_are_those_of_its_tables(nocdyn, name):
    path = SOURCE / f"input/examples/{name}/{name}.nml"
    nocdyn.write("m.nml", path.read_text())
    for file in path.parent.iterdir():
        if file.suffix != ".nml" and file.is_file():
            nocdyn.write(file.name, file.read_text())
    if "&response" not in path.read_text():
        body = re.search(r"&body +name *= *'([^']+)'", path.read_text())[1]
        added = f"&response body = '{body}' speed = 5, 9 count = 3 /\n"
        added += f"&excitation name = 'shaker' body = '{body}' kind = 'orders' orders = 2 amplitudes = 1.0 /\n"
        nocdyn.write("m.nml", path.read_text() + added)
    case = first_case(path)
    outcome = nocdyn("response", "m.nml", "--out", "out", "-q", *case)
    assert outcome.returncode == 0, outcome.stderr
    folder = "/".join(("out", *case[1:]))
    columns = nocdyn.columns(folder, "response_columns.json")
    check(columns, path.read_text() + "&body &excitation")
    for table in ("response.csv", "response_orders.csv"):
        assert labels(columns, table) == header(nocdyn, f"{folder}/{table}")


def test_the_columns_of_steady_states_are_those_of_their_values(nocdyn):
    assert nocdyn("equilibrium", SOURCE / "input/examples/winch/winch.nml", "--out", "out").returncode == 0
    content = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())
    for state in content["steady_states"]:
        assert [column["label"] for column in content["columns"]] == list(state["values"])
    forces_are_called_forces(content["columns"])


@pytest.mark.skipif(not SWEEP_PROGRAM.exists(), reason="nocdyn-sweep is not built")
def test_the_columns_of_a_sweep_are_those_of_its_results(nocdyn):
    text = (BODIES + ELEMENTS["mesh"].format("x")).replace("efficiency = 0.9", "").replace("bearing_friction = 1e-3", "")
    text += "\n&sweep design = 'grid' /\n"
    text += "&vary target = 'body.a.inertia' low = 1 high = 2 count = 2 /\n"
    text += "&record quantity = 'force_x' statistic = 'max', 'min', 'time_of_max' /\n&record mode = 1 statistic = 'frequency' /\n"
    nocdyn.write("m.nml", text)
    outcome = nocdyn("sweep", "m.nml", "--out", "out", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    columns = nocdyn.columns("out")
    first = header(nocdyn, "out/sweep.csv")
    assert [column["label"] for column in columns] == first[2 : first.index("status")]
    assert [column["statistic"] for column in columns] == ["max", "min", "time_of_max", "frequency"]
    assert [column["caption"] for column in columns[:3]] == ["tooth force"] * 3


def test_the_figures_know_the_ranks():
    """scripts/nocdyn_report/columns.py names the ranks of src/model/elements/quantities.f90."""
    source = (SOURCE / "src/model/elements/quantities.f90").read_text()
    ranks = {name: int(number) for name, number in RANKS.findall(source)}
    names = re.search(r"^([A-Z, ]+) = range\(1, (\d+)\)", (SOURCE / "scripts/nocdyn_report/columns.py").read_text(), re.MULTILINE)
    assert {name.lower(): rank for rank, name in enumerate(names[1].split(", "), start=1)} == ranks
    assert int(names[2]) == len(ranks) + 1
