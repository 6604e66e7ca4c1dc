"""&response signals: what a forced response writes of many moments and angles."""

import csv
import json

import pytest
from conftest import SOURCE

# Two turbines, two stages of gears and a propeller.
TURBINES = (SOURCE / "verification/response/marine_turbines/case.nml").read_text()
TURBINES = TURBINES.replace("speed_rpm = 30, 41  count = 12", "speed_rpm = 20, 60  count = 41  operating_rpm = 38, 45")

REFINED = 1e-5  # of a peak between the speeds of the grid
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
    """The tables have the speeds of the grid in common; peaks between them are sought of what is chosen."""
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
        rows = [{label: row[label] for label in table[0]} for row in every[name]]
        assert sum(row in rows for row in table) >= 41
    (largest,) = content["largest"]
    (among_all,) = (one for one in whole["largest"] if one["quantity"] == "moment_lp_shaft")
    for key in ("half_range", "peak"):
        assert largest[key] == pytest.approx(among_all[key], rel=REFINED)
    for one, other in zip(content["critical_speeds"], whole["critical_speeds"], strict=True):
        for key in ("coupling", "order", "speed_rad_s", "frequency_Hz"):
            assert one[key] == other[key]
        assert one["moment_N_m"] == pytest.approx(other["moment_N_m"], rel=REFINED)
    assert "moment_lp_shaft [N m]" in printed and "moment_line_shaft [N m]" not in printed
    columns = json.loads((nocdyn.folder / "some/response_columns.json").read_text())["columns"]
    assert len(columns) == len(some["response"][0]) + len(some["response_orders"][0])


def test_a_limit_counts_where_its_moment_is_not_written(nocdyn):
    some, content, printed = response(nocdyn, with_signals("'phi_*'") + LIMIT, "some")
    assert content["largest"] == []
    assert content["verdict"]["largest_ratio"] > 1 and len(content["barred_speed_ranges"]) > 0
    assert "coupling 'line_shaft'  moment, continuous " in printed
    assert not any("limit" in label or "ratio" in label for label in some["response"][0])
    with_moment, _, _ = response(nocdyn, with_signals("'moment_line_shaft'") + LIMIT, "moment")
    assert {"limit_moment_line_shaft [N m]", "ratio_moment_line_shaft [1]"} <= set(with_moment["response"][0])


def chain(bodies, names=""):
    """A chain that 40 orders excite at 800 speeds."""
    orders = ", ".join(map(str, range(1, 41)))
    lines = [f"&body name = 'b{i}' inertia = 1 /" for i in range(bodies)]
    lines += [f"&coupling name = 'c{i}' bodies = 'b{i - 1}', 'b{i}' stiffness = 1e7 /" for i in range(1, bodies)]
    excited = f"&excitation name = 'e' body = 'b0' kind = 'orders' orders = {orders} amplitudes = {', '.join(['1'] * 40)} /"
    asked = f"&response body = 'b0' speed = 10, 20 count = 800 {names} /"
    return "\n".join([*lines, excited, "&load name = 'l' body = 'b0' viscous = 1 /", asked, "&run t_end = 1 /"]) + "\n"


def test_a_choice_is_not_refused_for_numbers_that_nobody_wants(nocdyn):
    file = nocdyn.write("all.nml", chain(620))
    outcome = nocdyn("response", file, "--out", "all")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert "allowed: at most count = " in outcome.stderr and ", fewer orders or fewer signals\n" in outcome.stderr
    outcome = nocdyn("response", nocdyn.write("some.nml", chain(620, "signals = '*_c3'")), "--out", "some")
    assert outcome.returncode == 0
    with open(nocdyn.folder / "some/response.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == 800


def gap_and_damage(nocdyn, names):
    """Notes and damage of a response."""
    text = TURBINES.replace("name = 'lp_shaft'", "name = 'lp_shaft' gap = 1e-6")
    text = text.replace("name = 'line_shaft'", "name = 'line_shaft' diameter = 0.5")
    text += "&fatigue name = 'line' coupling = 'line_shaft' reference_stress = 1e7 reference_cycles = 1e6 slope = 5 /\n"
    if names:
        text = text.replace("&response ", f"&response signals = {names} ")
    outcome = nocdyn("response", nocdyn.write("m.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    content = json.loads((nocdyn.folder / "out/response.json").read_text())
    return content["notes"], content["fatigue"]


def test_notes_and_damage_do_not_depend_on_what_is_written(nocdyn):
    notes, (damage,) = gap_and_damage(nocdyn, "")
    noted, (damaged,) = gap_and_damage(nocdyn, "'phi_*'")
    assert any("leaves contact" in note for note in notes)
    assert noted == notes
    assert damaged["largest_damage_per_hour"] == pytest.approx(damage["largest_damage_per_hour"], rel=5 * REFINED)  # slope 5


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
