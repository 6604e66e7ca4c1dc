"""Damping of vibrations that takes no mean torque: of cylinders and propellers, in runs, responses, modes and sweeps."""

import csv
import json
from math import pi

import numpy as np
import pytest

SPEED, FREQUENCY, MEAN_TIME = 100.0, 600.0, 0.5
CRANK, PROPELLER, STIFFNESS = 0.3, 2.0, 1e5
CYLINDER, SCREW = 5.0, 4 * 200 / SPEED  # damping [N m s/rad]: given, and four times mean torque over mean speed
SLOPE = 2 * 200 / SPEED  # of the quadratic torque
TRAIN = f"""\
&body name = 'c' inertia = {CRANK} speed = {SPEED} /
&body name = 'p' inertia = {PROPELLER} /
&coupling name = 'k' bodies = 'c', 'p' stiffness = {STIFFNESS} /
&engine name = 'e' stroke = 2 cylinders = 'c' firing = 0 mean_torque = 200
        vibration_damping = {CYLINDER} mean_time = {MEAN_TIME} /
&load name = 'w' body = 'p' quadratic = 0.02 vibration_factor = 4 mean_time = {MEAN_TIME} /
"""
SHAKEN = TRAIN + f"&excitation name = 'x' body = 'c' amplitude = 1 frequency = {FREQUENCY} /\n"
RUN = "&run t_end = {} start = 'equilibrium' rtol = 1e-11 atol = 1e-13 method = 'rk853' /\n&output interval = 0.0005 /\n"
RESPONSE = "&run t_end = 1 /\n&response body = 'c' speed = 90, 110 count = 3 /\n"
LINEAR = 1e-6  # the load is quadratic, and the vibration is small


def moment(seen):
    """Complex moment in the coupling per torque on the crank if the damping acts on this part, and the mean on the rest."""
    damping = 1j * FREQUENCY * (seen * np.array([CYLINDER, SCREW]) + (1 - seen) * np.array([0, SLOPE]))
    matrix = STIFFNESS * np.array([[1, -1], [-1, 1]]) + np.diag(damping - FREQUENCY**2 * np.array([CRANK, PROPELLER]))
    crank, propeller = np.linalg.solve(matrix, [1, 0])
    return STIFFNESS * (propeller - crank)


def amplitude(times, values):
    """Of exp(i FREQUENCY t), beside a mean that drifts."""
    waves = [np.cos(FREQUENCY * times), np.sin(FREQUENCY * times), np.ones_like(times), times, times**2]
    cosine, sine, *_ = np.linalg.lstsq(np.array(waves).T, values, rcond=None)[0]
    return complex(cosine, -sine)


def test_a_run_damps_what_its_filter_lets_through_and_a_response_all(nocdyn):
    nocdyn.done(SHAKEN + RUN.format(30))
    table = nocdyn.values()
    last = table["t"] > 29
    found = amplitude(table["t"][last], table["moment_k"][last]) * 1j  # the shaker is a sine
    part = (1j * FREQUENCY * MEAN_TIME / (1 + 1j * FREQUENCY * MEAN_TIME)) ** 2
    assert abs(found - moment(part)) < LINEAR * abs(found)
    nocdyn.done(SHAKEN + RESPONSE, command="response")
    lines = nocdyn.values(name="response_orders.csv")
    at = int(np.argmin(abs(lines["omega_c"] - SPEED)))
    assert lines["omega_c"][at] == SPEED
    assert lines["moment_k"][at] == pytest.approx(abs(moment(1.0)), rel=1e-9)
    assert abs(found) == pytest.approx(abs(moment(1.0)), rel=3 / (FREQUENCY * MEAN_TIME))


def test_the_mean_torques_of_a_steady_state_are_those_without_the_damping(nocdyn):
    nocdyn.done(TRAIN + RESPONSE, command="equilibrium")
    steady = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"]
    assert len(steady) == 1
    assert steady[0]["values"]["omega_c [rad/s]"] == pytest.approx(SPEED, rel=1e-12)
    assert steady[0]["values"]["torque_e_damping_1 [N m]"] == 0
    nocdyn.done(TRAIN + RUN.format(1))
    table = nocdyn.values()
    assert table["omega_p"] == pytest.approx(SPEED, rel=1e-9)
    assert table["torque_e_damping_1"] == pytest.approx(0, abs=1e-6)


def test_an_even_run_up_is_braked_at_its_begin_only(nocdyn):
    """The filter takes up the acceleration a by the angle a T^2, to which the damping belongs once."""
    inertia, torque, damping, time = 2.0, 10.0, 50.0, 0.1
    text = f"&body name = 'd' inertia = {inertia} /\n&motor name = 'm' body = 'd' kind = 'constant' torque = {torque} /\n"
    text += f"&load name = 'l' body = 'd' vibration_damping = {damping} mean_time = {time} /\n"
    nocdyn.done(text + "&run t_end = 12 rtol = 1e-11 atol = 1e-12 /\n&output points = 101 /\n")
    table = nocdyn.values()
    late = table["t"] > 10  # the slower root of the filter with this load decays at 2.3 1/s
    expected = torque / inertia * (table["t"] - damping * time**2 / inertia)
    assert table["omega_d"][late] == pytest.approx(expected[late], abs=1e-7)
    assert table["torque_l"][late] == pytest.approx(0, abs=1e-6)


def test_modes_and_campbell_have_the_damping_and_rigid_motions_the_slope_of_the_mean_torque(nocdyn):
    nocdyn.done(TRAIN + RESPONSE, command="modes")
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    natural = np.sqrt(STIFFNESS * (1 / CRANK + 1 / PROPELLER))
    shape = np.array([1, -CRANK / PROPELLER])
    ratio = (shape**2 @ [CYLINDER, SCREW]) / (2 * natural * (shape**2 @ [CRANK, PROPELLER]))
    oscillating = [mode for mode in modes if mode.get("damping_ratio") is not None and mode["frequency_Hz"] > 1]
    assert len(modes) == 2 and len(oscillating) == 1
    assert oscillating[0]["damping_ratio"] == pytest.approx(ratio, rel=1e-3)
    nocdyn.done(TRAIN + RESPONSE, command="campbell")
    table = nocdyn.values(name="campbell.csv").by_name()
    ratios = next(values for name, values in table.items() if name.startswith("damping_ratio"))
    assert ratios[1] == pytest.approx(ratio, rel=1e-3)
    nocdyn.done(TRAIN + RESPONSE, command="equilibrium")
    steady = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"][0]
    assert steady["growth_rate_1_s"] == pytest.approx(-SLOPE / (CRANK + PROPELLER), rel=1e-3)


def test_a_mean_time_below_a_turn_is_noted(nocdyn):
    short = nocdyn.done(
        TRAIN.replace("vibration_factor = 4 mean_time = 0.5", "vibration_factor = 4 mean_time = 0.03") + RUN.format(0.1)
    )
    assert "note: mean_time of 'w' is 0.48 turns at the start speed: a run takes vibrations of so low orders" in short.stdout
    assert "note: mean_time" not in nocdyn.done(TRAIN + RUN.format(0.1)).stdout


def test_the_factor_two_is_the_slope_of_a_quadratic_torque(nocdyn):
    texts = (
        SHAKEN.replace("vibration_factor = 4", "vibration_factor = 2"),
        SHAKEN.replace("vibration_factor = 4 mean_time = 0.5", ""),
    )
    tables = []
    for text in texts:
        nocdyn.done(text + RESPONSE, command="response")
        tables.append(nocdyn.values(name="response_orders.csv"))
    assert tables[0]["moment_k"] == pytest.approx(tables[1]["moment_k"], rel=1e-12)


@pytest.mark.parametrize("damping", ["vibration_damping = 3", "vibration_factor = 3"])
def test_tables_of_loads_damp_vibrations_otherwise_than_the_mean_rotation(nocdyn, damping):
    table = "table_speed = 0, 50, 100, 150 table_torque = 0, 40, 200, 500"
    text = SHAKEN.replace("quadratic = 0.02 vibration_factor = 4", f"{table} interpolation = 'cubic' {damping}")
    nocdyn.done(text + RUN.format(20))
    run = nocdyn.values()
    last = run["t"] > 19
    found = amplitude(run["t"][last], run["moment_k"][last])
    nocdyn.done(text + RESPONSE, command="response")
    lines = nocdyn.values(name="response_orders.csv")
    at = int(np.argmin(abs(lines["omega_c"] - SPEED)))
    assert abs(found) == pytest.approx(lines["moment_k"][at], rel=3 / (FREQUENCY * MEAN_TIME))
    assert run["torque_w"][last].mean() == pytest.approx(-200, rel=1e-3)


ENGINE = "&engine name = 'e' stroke = 2 cylinders = 'c', 'c', 'p' firing_deg = 0, 90, 0 mean_torque = 200 {} /\n"


def test_a_magnifier_is_the_inertia_torque_over_the_damping_torque(nocdyn):
    """Cylinders on one crank share its inertia."""
    head, tail = TRAIN[: TRAIN.index("&engine")], TRAIN[TRAIN.index("&load") :]
    text = head + ENGINE.format("magnifier = 40 damping_frequency_hz = 90") + tail
    nocdyn.done(text + RUN.format(0.2) + "&excitation name = 'x' body = 'c' kind = 'step' time = 0.1 amplitude = 50 /\n")
    table = nocdyn.values()
    damping = 2 * pi * 90 / 40 * np.array([CRANK / 2, CRANK / 2, PROPELLER])
    after = (table["t"] > 0.1) & (table["t"] < 0.11)
    slip = np.array([table[f"omega_{body}"] - SPEED for body in "ccp"])
    for cylinder in range(3):
        found = table[f"torque_e_damping_{cylinder + 1}"][after]
        largest = max(abs(found))
        assert found == pytest.approx(-damping[cylinder] * slip[cylinder][after], abs=0.05 * largest)  # the mean moves a little


SWEEP = "&sweep design = 'grid' /\n&vary target = '{}' low = {} high = {} count = 3 /\n"
RECORD = "&record quantity = 'omega_c' statistic = 'final' /\n"


@pytest.mark.parametrize(
    "target, low, high",
    [
        ("engine.e.magnifier", 20, 60),
        ("body.c.inertia", 0.2, 0.4),
        ("body.p.inertia", 1, 3),
        ("body.p.entrained", 0, 0.5),
        ("load.w.vibration_factor", 1, 5),
        ("load.w.mean_time", 0.1, 0.7),
        ("load.w.quadratic", 0.01, 0.03),
    ],
)
def test_numbers_of_the_damping_vary_in_sweeps(nocdyn, target, low, high):
    head, tail = TRAIN[: TRAIN.index("&engine")], TRAIN[TRAIN.index("&load") :]
    text = head.replace("inertia = 2.0", "inertia = 2.0 entrained = 0.25") + ENGINE.format(
        "magnifier = 40 damping_frequency = 500"
    )
    text += tail + "&excitation name = 'x' body = 'c' amplitude = 90 frequency = 300 /\n"
    text += "&run t_end = 0.2 rtol = 1e-10 atol = 1e-12 /\n&output points = 3 /\n"
    nocdyn.write("machine.nml", text + SWEEP.format(target, low, high) + RECORD)
    outcome = nocdyn("sweep", "machine.nml", "--out", "sweep", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "sweep/sweep.csv", newline="", encoding="utf-8") as file:
        found = [next(float(value) for key, value in row.items() if "omega_c" in key) for row in csv.DictReader(file)]
    assert len(set(found)) == 3
    for value, final in zip((low, (low + high) / 2, high), found):
        nocdyn.done(text, "--set", f"{target}={value:g}")
        assert nocdyn.values()["omega_c"][-1] == pytest.approx(final, rel=1e-9)


@pytest.mark.parametrize(
    "group, complaint",
    [
        ("&load name = 'v' body = 'p' vibration_damping = 3 constant = 4 /", "vibration_damping and constant are both given"),
        ("&load name = 'v' body = 'p' vibration_damping = 3 vibration_factor = 4 /", "are both given; allowed: one of them"),
        ("&load name = 'v' body = 'p' viscous = 3 mean_time = 4 /", "mean_time needs vibration_damping or vibration_factor"),
        (ENGINE.format("magnifier = 40"), "magnifier needs damping_frequency"),
        (ENGINE.format("damping_frequency = 40"), "damping_frequency needs magnifier"),
        (ENGINE.format("magnifier = 4 damping_frequency = 9 vibration_damping = 3"), "are both given; allowed: one of them"),
        (ENGINE.format("mean_time = 1"), "mean_time needs vibration_damping or magnifier"),
        (
            ENGINE.format("vibration_damping = 3") + "&load name = 'e_damping_2' body = 'p' viscous = 3 /",
            "the name 'e_damping_2' of its cylinder 2 is taken by &load",
        ),
    ],
)
def test_damping_that_does_not_fit_is_refused(nocdyn, group, complaint):
    text = TRAIN.replace("name = 'e' ", "name = 'f' ") + group + "\n&run t_end = 1 /\n"
    outcome = nocdyn("check", nocdyn.write("machine.nml", text))
    assert outcome.returncode == 2
    assert complaint in outcome.stderr
