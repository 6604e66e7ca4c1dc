"""&response signals: what a forced response writes of many moments and angles."""

import csv
import json

import pytest
from test_response import TURBINES

LIMIT = "&limit coupling = 'line_shaft' vibratory_moment = 4e5 /\n"


def with_signals(names):
    return TURBINES.replace("&response ", f"&response signals = {names} ")


def response(nocdyn, text, out):
    outcome = nocdyn("response", nocdyn.write(f"{out}.nml", text), "--out", out)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    tables = {}
    for name in ("response", "response_orders"):
        with open(nocdyn.folder / out / f"{name}.csv", newline="") as file:
            tables[name] = list(csv.DictReader(file))
    return tables, json.loads((nocdyn.folder / out / "response.json").read_text()), outcome.stdout


def test_what_is_chosen_is_as_it_is_among_all(nocdyn):
    every, whole, _ = response(nocdyn, TURBINES, "all")
    some, content, printed = response(nocdyn, with_signals("'*_lp_shaft', 'phi_propeller'"), "some")
    assert list(some["response"][0]) == [
        "omega_propeller [rad/s]",
        "drive [1]",
        "drive_torque [N m]",
        "mean_moment_lp_shaft [N m]",
        "half_range_moment_lp_shaft [N m]",
        "peak_moment_lp_shaft [N m]",
        "heat_lp_shaft [W]",
    ]
    assert list(some["response_orders"][0])[3:] == [
        "moment_lp_shaft [N m]",
        "phase_moment_lp_shaft [deg]",
        "phi_propeller [rad]",
        "phase_phi_propeller [deg]",
        "omega_amplitude_propeller [rad/s]",
    ]
    for name, table in some.items():
        assert table == [{label: row[label] for label in table[0]} for row in every[name]]
    assert content["largest"] == [one for one in whole["largest"] if one["quantity"] == "moment_lp_shaft"]
    assert content["critical_speeds"] == whole["critical_speeds"]
    assert "moment_lp_shaft [N m]" in printed and "moment_line_shaft [N m]" not in printed
    columns = json.loads((nocdyn.folder / "some/response_columns.json").read_text())["columns"]
    assert len(columns) == len(some["response"][0]) + len(some["response_orders"][0])


def test_a_limit_counts_where_its_moment_is_not_written(nocdyn):
    some, content, printed = response(nocdyn, with_signals("'phi_*'") + LIMIT, "some")
    assert content["largest"] == []
    assert content["limits_exceeded"] > 0 and len(content["barred_speed_ranges"]) > 0
    assert "barred by moment_line_shaft" in printed
    assert not any("limit" in label or "ratio" in label for label in some["response"][0])
    with_moment, _, _ = response(nocdyn, with_signals("'moment_line_shaft'") + LIMIT, "moment")
    assert {"limit_moment_line_shaft [N m]", "ratio_moment_line_shaft [1]"} <= set(with_moment["response"][0])


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (
            "'momnt_*'",
            "signals(1) = 'momnt_*' matches no column of response_orders.csv; did you mean 'moment_*'?",
        ),
        (
            "'phi_*', 'stress_*'",
            "signals(2) = 'stress_*' matches no column of response_orders.csv; allowed: 'moment_*', 'reaction_*', 'phi_*'",
        ),
    ],
)
def test_names_that_there_are_not_are_refused(nocdyn, names, message):
    outcome = nocdyn("response", nocdyn.write("m.nml", with_signals(names)), "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    line = 1 + with_signals(names)[: with_signals(names).index("&response")].count("\n")
    assert outcome.stderr == f"nocdyn: {nocdyn.folder}/m.nml:{line}: &response: {message}\n"
    assert not (nocdyn.folder / "out").exists()
