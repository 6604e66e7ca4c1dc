"""The mean torques in nocdyn response, campbell, modes and equilibrium: which count, and what their slopes over the speed do."""

import json
from math import pi, sqrt

import pytest

RPM = pi / 30
ENGINE = """\
&body name = 'e' inertia = 1.0 speed_rpm = 1000 /
&body name = 'g' inertia = 2.0 speed_rpm = 1000 /
&coupling name = 'c' bodies = 'e', 'g' stiffness = 2.0e4 damping = 20 /
&load name = 'l' body = 'g' viscous = 2.0 /
&response body = 'g' speed_rpm = 1200, 1500 count = 2 /
&run t_end = 1 /
"""
FIRED = "&engine name = 'd' stroke = 4 cylinders = 'e' firing = 0 orders = 0, 2, 0, 2 amplitudes = {}, 50, 400, 50 "
FIRED += "speeds_rpm = {}, {}, 1500, 1500 /\n"
STEPS = """\
&body name = 'm' inertia = 1 speed = 100 /
&body name = 'g' inertia = 2 /
&coupling name = 'k' bodies = 'm', 'g' stiffness = 1000 cubic_stiffness = 1e5 damping = 1 /
&motor name = 'd' body = 'm' a = 200 b = 1 c = 0 /
&load name = 'l' body = 'g' viscous = 0.5 /
&excitation name = 'o' body = 'm' kind = 'orders' orders = 1 amplitudes = 5 /
&response body = 'm' speed = 90, 110 count = 3 /
&run t_end = 1 /
"""
LASTING = {
    "step": "&excitation name = 's' body = 'g' kind = 'step' amplitude = -50 time = 0 /\n",
    "ramp": "&excitation name = 's' body = 'g' kind = 'ramp' amplitude = -50 time = 0 duration = 2 /\n",
    "table": "&excitation name = 's' body = 'g' kind = 'table' table_time = 0, 1, 2 table_torque = 0, 9, -50 /\n",
    "constant": "&excitation name = 's' body = 'g' kind = 'harmonic' amplitude = -50 frequency = 0 phase_deg = 90 /\n",
}
# A cylinder on a large flywheel: the mean torque falls or rises over the speed.
CYLINDER = """\
&body name = 'crank' inertia = 0.3 speed = 100 /
&body name = 'flywheel' inertia = 1e6 speed = 100 /
&coupling name = 'shaft' bodies = 'crank', 'flywheel' stiffness = 1e5 relative_damping = 0.1 damping_frequency = 577.3503 /
&load name = 'gen' body = 'flywheel' viscous = 4 /
&response body = 'flywheel' speed_rpm = 900, 1000 count = 101 /
&run t_end = 1 /
"""
GAS = "&engine name = 'gas' stroke = 4 cylinders = 'crank' firing_deg = 0 orders = 0, 6, 0, 6 "
GAS += "amplitudes = {}, 100, {}, 100 phases = 4*0 speeds_rpm = 900, 900, 1000, 1000 /\n"
ETA = 0.1 / (2 * pi)


def analysis(nocdyn, command, text):
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / f"out/{command}.json").read_text()), outcome.stdout


@pytest.mark.parametrize("first, at", [(0, 600), (0, 0.001), (400, 600)])
def test_an_engine_whose_means_begin_with_zero_holds_the_speed(nocdyn, first, at):
    analysis(nocdyn, "response", ENGINE + FIRED.format(first, at, at))
    table = nocdyn.values(name="response.csv")
    mean = first + (400 - first) * (1200 - at) / (1500 - at)
    assert table["drive"] == pytest.approx([2 * 1200 * RPM / mean, 2 * 1500 * RPM / 400])
    assert table["mean_total_moment_c"] == pytest.approx([-2 * 1200 * RPM, -2 * 1500 * RPM])
    assert table["half_range_total_moment_c"][0] == pytest.approx(30.2993, rel=1e-5)
    assert table["peak_total_moment_c"][0] == pytest.approx(2 * 1200 * RPM + 30.2993, rel=1e-5)
    assert list(table["drive_torque"]) == [0, 0]


@pytest.mark.parametrize("excitation", LASTING.values(), ids=LASTING)
def test_torques_that_last_count_as_in_a_steady_state(nocdyn, excitation):
    modes, _ = analysis(nocdyn, "modes", STEPS + excitation)
    analysis(nocdyn, "campbell", STEPS + excitation)
    campbell = nocdyn.values(name="campbell.csv")
    analysis(nocdyn, "response", STEPS + excitation)
    table = nocdyn.values(name="response.csv")
    assert table["mean_total_moment_k"] == pytest.approx([-95, -100, -105])
    assert table["drive"] == pytest.approx([95 / 110, 1, 105 / 90])
    assert table["half_range_total_moment_k"][1] == pytest.approx(1.87141, rel=1e-5)
    for label in ("frequency", "undamped_frequency"):
        assert campbell[f"{label}_1"][1] == pytest.approx(modes["modes"][1][f"{label}_Hz"], rel=1e-9)
    assert campbell["undamped_frequency_1"][1] == pytest.approx(9.542756, rel=1e-6)


@pytest.mark.parametrize("first, last", [(500, 300), (300, 500), (400, 400)])
def test_a_mean_over_the_speed_neither_damps_nor_drives_an_oscillation(nocdyn, first, last):
    text = CYLINDER + GAS.format(first, last)
    response, notes = analysis(nocdyn, "response", text)
    assert ("'gas_1' changes over the speed" in notes) == (first != last)
    assert response["largest"][0]["half_range"] == pytest.approx(100 / ETA * sqrt(1 + ETA**2), rel=1e-4)
    assert response["largest"][0]["half_range_speed_rad_s"] == pytest.approx(918.882 * RPM, rel=1e-4)
    campbell, notes = analysis(nocdyn, "campbell", text)
    assert ("'gas_1' changes over the speed" in notes) == (first != last)
    assert campbell["crossings"][0]["damping_ratio"] == pytest.approx(ETA / 2, rel=1e-4)
    assert nocdyn.values(name="campbell.csv")["damping_ratio_1"] == pytest.approx([ETA / 2] * 101, rel=1e-4)
    modes, notes = analysis(nocdyn, "modes", text)
    assert ("'gas_1' changes over the speed" in notes) == (first > last)  # the rising mean is level where it is stable
    assert modes["modes"][1]["damping_ratio"] == pytest.approx(ETA / 2, rel=1e-4)


def test_a_mean_over_the_speed_acts_on_the_mean_rotation(nocdyn):
    """A rising mean is unstable where it is steeper than the load, and gives the rigid mode its rate."""
    text = CYLINDER.replace("1e6", "10").replace("viscous = 4", "viscous = 4 constant = 0") + GAS.format(500, 300)
    modes, _ = analysis(nocdyn, "modes", text)
    slope = -200 / (100 * RPM)
    assert 1 / modes["modes"][0]["time_constant_s"] == pytest.approx((4 - slope) / 10.3, rel=1e-5)
    state, _ = analysis(nocdyn, "equilibrium", text)
    assert state["steady_states"][0]["stability"] == "stable"
    text = text.replace("amplitudes = 500, 100, 300", "amplitudes = 300, 100, 500")
    state, _ = analysis(nocdyn, "equilibrium", text)
    assert "unstable" in [one["stability"] for one in state["steady_states"]]


SHAKER = "&excitation name = 'h' body = 'e' amplitude = 20 frequency = 251.32741228718345 /\n"  # order 2 at 1200 rpm


@pytest.mark.parametrize("speed", ["1200", "1200, 1200"])
def test_one_speed_has_the_numbers_that_it_has_among_others(nocdyn, speed):
    """An order and a frequency that are equal at this speed are still two lines, which may have any phase."""
    text = ENGINE.replace("speed_rpm = 1200, 1500", "speed_rpm = {}") + FIRED.format(0, 600, 600) + SHAKER
    analysis(nocdyn, "response", text.format("1200, 1500"))
    among = {label: values[0] for label, values in nocdyn.values(name="response.csv").items()}
    content, report = analysis(nocdyn, "response", text.format(speed))
    assert "forced response at 1200 rpm of g, 2 orders" in report
    table = nocdyn.values(name="response.csv")
    assert {label: len(values) for label, values in table.items()} == dict.fromkeys(among, 1)
    assert {label: values[0] for label, values in table.items()} == pytest.approx(among)
    assert content["speed_rad_s"] == pytest.approx([1200 * RPM] * 2)
    analysis(nocdyn, "campbell", text.format(speed))
    assert nocdyn.values(name="campbell.csv")["undamped_frequency_1"] == pytest.approx([27.56644], rel=1e-6)


def test_three_speeds_are_refused(nocdyn):
    path = nocdyn.write("machine.nml", ENGINE.replace("1200, 1500", "1200, 1500, 1600") + FIRED.format(0, 600, 600))
    outcome = nocdyn("response", path)
    assert outcome.returncode == 2
    assert "3 speeds; allowed: one, or the slowest and the fastest one" in outcome.stderr
