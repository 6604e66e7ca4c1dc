"""Limit cycles of machines that nothing excites: Hopf points by closed forms, cycles by averaging, integration and runs."""

import json

import numpy as np
import pytest

INERTIA, STIFFNESS, DAMPING = 1.0, 100.0, 0.2
MASS = f"""\
&body name = 'mass' inertia = {INERTIA} /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = {STIFFNESS} damping = {DAMPING} /
&motor name = 'push' body = 'mass' a = 0.0 b = 0.0 c = 0.0 /
&load name = 'drag' body = 'mass' {{}} /
&run t_end = 10.0 /
&orbit over = 'motor.push.b' range = {{}}, {{}} {{}} /
"""
QUADRATIC = 0.2
FRICTION, FRICTION_SPEED = 1.0, 2.0
LOCATED = 1e-8  # of the range, asked for
SETTLED = 1e-7  # of the half range, asked for


def branches(nocdyn, text):
    """The columns of orbit.csv and the report."""
    nocdyn.done(text, command="orbit")
    return nocdyn.values("out", "orbit.csv"), json.loads((nocdyn.folder / "out/orbit.json").read_text())


def hopf_points(report):
    return [point for point in report["special_points"] if point["kind"] == "hopf"]


def refused(nocdyn, text):
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", text))
    assert outcome.returncode in (1, 2), outcome.stdout + outcome.stderr
    return outcome.stderr


def cycle(rates, start, section, time):
    """Period and extremes of the limit cycle on which an integration settles; a function of the state passes 0 upwards once."""
    integrate = pytest.importorskip("scipy.integrate")
    passes = lambda t, y: section(y)  # noqa: E731
    passes.direction = 1
    settled = integrate.solve_ivp(rates, (0, time), start, method="DOP853", rtol=1e-12, atol=1e-13, events=passes)
    period = settled.t_events[0][-1] - settled.t_events[0][-2]
    begin = settled.y_events[0][-1]
    dense = integrate.solve_ivp(rates, (0, period), begin, method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    states = dense.sol(np.linspace(0, period, 20001))
    return period, states.min(axis=1), states.max(axis=1)


def settling_time(values, row):
    """After which a disturbance of a cycle is 1e-11 of itself."""
    largest = abs(values["multiplier_1_real"][row] + 1j * values["multiplier_1_imaginary"][row])
    return float((np.log(1e-11) / np.log(largest) + 5) * 2 * np.pi / values["rate"][row])


def compare_with_run(nocdyn, machine, values, row, labels):
    """Half ranges of a stable cycle beside those of a run that has settled; the extremes of this."""
    end, period = settling_time(values, row), 2 * np.pi / values["rate"][row]
    nocdyn.done(
        machine
        + f"&run t_end = {end!r} method = 'rk853' rtol = 1e-12 atol = 1e-13 max_steps = 10000000 /\n"
        + f"&output extremes_from = {float(end - 1.02 * period)!r} points = 11 /\n"
    )
    columns = {label.split(" [")[0]: extremes for label, extremes in nocdyn.summary("out")["columns"].items()}
    for label in labels:
        half_range = values[f"half_range_{label}"][row]
        found = (columns[label]["max"] - columns[label]["min"]) / 2
        assert found == pytest.approx(half_range, abs=SETTLED * half_range), label
    return columns


def test_a_hopf_point_is_where_damping_vanishes_and_the_cycle_is_found_by_averaging(nocdyn):
    values, report = branches(nocdyn, MASS.format(f"quadratic = {QUADRATIC}", 0.0, -2.0, ""))
    (point,) = hopf_points(report)
    assert point["value"] == pytest.approx(-DAMPING, abs=2.0 * LOCATED)
    assert point["frequency_hz"] == pytest.approx(np.sqrt(STIFFNESS / INERTIA) / (2 * np.pi), rel=1e-9)
    assert point["supercritical"]
    assert point["leads_to"] == 2
    rows = values["branch"] == 2
    assert (values["stable"][rows] == 1).all()
    negative = -values["motor.push.b"][rows][0] - DAMPING  # small: the power of the damping vanishes over a period
    expected = 3 * np.pi * negative / (8 * QUADRATIC * np.sqrt(STIFFNESS / INERTIA))
    assert values["half_range_phi_mass"][rows][0] == pytest.approx(expected, rel=1e-4)
    steady = values["branch"] == 1
    assert (values["stable"][steady] == (values["motor.push.b"][steady] > -DAMPING)).sum() >= np.count_nonzero(steady) - 1
    assert (values["half_range_phi_mass"][steady] == 0).all()


def test_a_limit_cycle_is_the_one_of_an_integration(nocdyn):
    values, _ = branches(nocdyn, MASS.format(f"quadratic = {QUADRATIC}", 0.0, -1.0, "tolerance = 1e-9"))
    push = -values["motor.push.b"][-1]
    assert push == 1.0

    def rates(_, y):
        return [y[1], (-STIFFNESS * y[0] + (push - DAMPING) * y[1] - QUADRATIC * abs(y[1]) * y[1]) / INERTIA]

    period, low, high = cycle(rates, [0.5, 0.0], lambda y: y[1], settling_time(values, -1))
    assert values["rate"][-1] == pytest.approx(2 * np.pi / period, rel=SETTLED)
    assert values["half_range_phi_mass"][-1] == pytest.approx((high[0] - low[0]) / 2, rel=SETTLED)
    assert values["half_range_omega_mass"][-1] == pytest.approx((high[1] - low[1]) / 2, rel=SETTLED)


def test_falling_friction_begins_unstable_cycles_that_grow_without_bound(nocdyn):
    values, report = branches(nocdyn, MASS.format(f"constant = {FRICTION} constant_speed = {FRICTION_SPEED}", -0.4, -1.0, ""))
    (point,) = hopf_points(report)
    begin = DAMPING + FRICTION / FRICTION_SPEED
    assert point["value"] == pytest.approx(-begin, abs=0.6 * LOCATED)
    assert not point["supercritical"]
    rows = values["branch"] == 2
    assert (values["stable"][rows] == 0).all()
    missing = begin + values["motor.push.b"][rows][0]
    expected = np.sqrt(4 * FRICTION_SPEED**3 * missing / (FRICTION * STIFFNESS / INERTIA))
    assert values["half_range_phi_mass"][rows][0] == pytest.approx(expected, rel=1e-3)


DRILL = """\
&body name = 'table' inertia = 2000.0 speed = 10.0 /
&body name = 'bit' inertia = 400.0 speed = 10.0 /
&coupling name = 'string' bodies = 'table', 'bit' stiffness = 500.0 damping = 20.0 /
&motor name = 'top' body = 'table' a = 40000.0 b = 4000.0 c = 0.0 /
&load name = 'rock' body = 'bit' constant = 3000.0 constant_speed = 1.5 quadratic = 6.0 /
&motor name = 'falling' body = 'bit' a = 0.0 b = -150.0 c = 0.0 /
"""
DRILLING = DRILL + "&run t_end = 100.0 /\n&orbit over = 'motor.top.a' range = {}, {} {} /\n"


def drill(torque):
    """The rates of the twist and of both speeds."""

    def rates(_, y):
        moment = 500.0 * y[0] + 20.0 * (y[1] - y[2])
        return [
            y[1] - y[2],
            (torque - 4000.0 * y[1] - moment) / 2000.0,
            (moment - 3000.0 * np.tanh(y[2] / 1.5) + 150.0 * y[2] - 6.0 * abs(y[2]) * y[2]) / 400.0,
        ]

    return rates


def eigenvalues(torque):
    """Those of the drill string in its steady state, by its equations."""
    optimize = pytest.importorskip("scipy.optimize")
    balance = lambda s: torque - 4000.0 * s - 3000.0 * np.tanh(s / 1.5) + 150.0 * s - 6.0 * s**2  # noqa: E731
    speed = optimize.brentq(balance, 1.0, 20.0, xtol=1e-14)
    slope = 3000.0 / 1.5 / np.cosh(speed / 1.5) ** 2 - 150.0 + 12.0 * speed
    return np.linalg.eigvals(
        [
            [0, 1, -1],
            [-500 / 2000, -(4000 + 20) / 2000, 20 / 2000],
            [500 / 400, 20 / 400, -(20 + slope) / 400],
        ]
    )


def test_a_drill_string_loses_its_stability_where_its_friction_falls(nocdyn):
    optimize = pytest.importorskip("scipy.optimize")
    values, report = branches(nocdyn, DRILLING.format(40000.0, 10000.0, ""))
    point, last = hopf_points(report)
    growth = lambda torque: max(eigenvalues(torque), key=lambda value: (value.imag > 0, value.real)).real  # noqa: E731
    expected = optimize.brentq(growth, 25000.0, 40000.0, xtol=1e-9)
    assert point["value"] == pytest.approx(expected, abs=30000.0 * LOCATED)
    assert 2 * np.pi * point["frequency_hz"] == pytest.approx(max(eigenvalues(expected).imag), rel=1e-8)
    rows = values["branch"] == point["leads_to"]
    assert last["leads_to"] == point["leads_to"] == 2  # they end where the friction does not fall any more
    assert rows.sum() > 10
    assert values["mean_omega_bit"][rows] == pytest.approx(values["mean_omega_table"][rows], rel=1e-9)


def test_stable_cycles_of_a_turning_machine_are_those_of_settled_runs(nocdyn):
    values, _ = branches(nocdyn, DRILLING.format(40000.0, 10000.0, "tolerance = 1e-9"))
    rows = np.flatnonzero((values["branch"] == 2) & (values["stable"] == 1))
    row = rows[np.argmax(values["half_range_twist_string"][rows])]
    end = settling_time(values, row)
    torque = float(values["motor.top.a"][row])
    period, low, high = cycle(drill(torque), [1.0, torque / 4000.0, 5.0], lambda y: y[1] - y[2], end)
    assert values["rate"][row] == pytest.approx(2 * np.pi / period, rel=SETTLED)
    half = (high - low) / 2
    for label, expected in zip(("twist_string", "omega_table", "omega_bit"), half, strict=True):
        assert values[f"half_range_{label}"][row] == pytest.approx(expected, abs=SETTLED * expected), label
    machine = DRILL.replace("a = 40000.0", f"a = {torque!r}")
    compare_with_run(nocdyn, machine, values, row, ("twist_string", "omega_bit", "total_moment_string"))


RESISTANCE, INDUCTANCE, FLUX, VOLTAGE, ROTOR, FAN, SET, GAIN = 0.5, 0.05, 1.5, 400.0, 0.5, 0.003, 100.0, 0.02
GOVERNOR = f"""\
&body name = 'rotor' inertia = {ROTOR} speed = {SET} /
&motor name = 'dc' body = 'rotor' kind = 'dc' voltage = {VOLTAGE} resistance = {RESISTANCE} flux_constant = {FLUX}
  inductance = {INDUCTANCE} governor_speed = {SET} governor_gain = {GAIN} governor_time = 0.1 /
&load name = 'fan' body = 'rotor' quadratic = {FAN} /
&run t_end = 10.0 /
&orbit over = 'motor.dc.governor_time' range = 0.15, 0.06 /
"""


def test_a_governor_hunts_where_the_criterion_of_hurwitz_says(nocdyn):
    _, report = branches(nocdyn, GOVERNOR)
    (point,) = hopf_points(report)
    drag = 2 * FAN * SET
    loop = RESISTANCE * drag + FLUX**2 + FLUX * VOLTAGE * GAIN
    damped = RESISTANCE * ROTOR + INDUCTANCE * drag
    expected = INDUCTANCE * ROTOR * FLUX * VOLTAGE * GAIN / (damped * loop)  # of L J s^3 + damped s^2 + loop s + k V g / T
    assert point["value"] == pytest.approx(expected, abs=0.09 * LOCATED)
    assert point["frequency_hz"] == pytest.approx(np.sqrt(loop / (INDUCTANCE * ROTOR)) / (2 * np.pi), rel=1e-8)


def test_without_a_hopf_point_the_cycle_is_the_one_on_which_a_run_settles(nocdyn):
    values, report = branches(nocdyn, MASS.format(f"quadratic = {QUADRATIC}", -1.0, -2.0, ""))
    assert hopf_points(report) == []
    assert (values["stable"][values["branch"] == 1] == 0).all()
    rows = values["branch"] == 2
    whole, _ = branches(nocdyn, MASS.format(f"quadratic = {QUADRATIC}", 0.0, -2.0, ""))
    assert values["half_range_phi_mass"][rows][-1] == pytest.approx(whole["half_range_phi_mass"][-1], rel=1e-7)
    assert values["rate"][rows][-1] == pytest.approx(whole["rate"][-1], rel=1e-7)


def test_both_methods_find_the_same_cycles(nocdyn):
    text = MASS.replace("'mass' inertia", "'mass' angle = 0.5 inertia")
    text = text.format(f"quadratic = {QUADRATIC}", -1.0, -2.0, "count = 3 tolerance = 1e-9 {}")
    found = []
    for method in ("harmonic_balance", "shooting"):
        values, _ = branches(nocdyn, text.format(f"method = '{method}'"))
        rows = (values["branch"] == values["branch"].max()) & np.isclose(values["motor.push.b"], -1.5, rtol=1e-12)
        found.append([values[label][rows][0] for label in ("rate", "half_range_phi_mass", "multiplier_1_real")])
    assert found[1] == pytest.approx(found[0], rel=1e-6)


BELT = """\
&body name = 'belt' inertia = 1.0e7 speed = 0.5 /
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 /
&clutch name = 'friction' bodies = 'belt', 'mass' capacity = 1.0 static_capacity = {} /
&run t_end = {} /
&orbit body = 'belt' speed = 0.5, 2.0 count = 4 {} /
"""


def test_a_mass_on_a_belt_sticks_and_slips_as_in_closed_form(nocdyn):
    """It slips from a beside the middle with the speed v of the belt until it has this speed again, and sticks over 2 a."""
    outcome = nocdyn.done(BELT.format(2.0, 60.0, ""), command="orbit")
    assert "stable" in outcome.stdout and "steady state" not in outcome.stdout
    values = nocdyn.values("out", "orbit.csv")
    speed, offset = values["mean_speed_belt"], 1.0
    period = np.pi + 2 * np.arctan(speed / offset) + 2 * offset / speed
    assert speed.min() == 0.5 and speed.max() == 2.0
    assert 2 * np.pi / values["rate"] == pytest.approx(period, rel=2e-8)  # the belt is not quite at one speed
    assert values["half_range_phi_mass"] == pytest.approx(np.hypot(offset, speed), rel=1e-7)
    assert values["multiplier_1_real"] == pytest.approx(1.0, abs=1e-6)  # of the speed of the belt
    assert np.abs(values["multiplier_2_real"]).max() < 1e-6  # a state that sticks forgets
    nocdyn.done(BELT.format(2.0, 60.0, ""), "--resume", command="orbit")


STUCK = """\
&body name = 'table' inertia = 2122.0 speed = 6.0 /
&body name = 'bit' inertia = 374.0 speed = 6.0 /
&coupling name = 'string' bodies = 'table', 'bit' stiffness = 473.0 damping = 23.2 /
&clutch name = 'rock' bodies = 'bit', 'ground' table_slip = 0, 1, 3, 6, 12 table_capacity = 8000, 5500, 4500, 4000, 3900 /
&motor name = 'drive' body = 'table' kind = 'constant' torque = {!r} /
&load name = 'top' body = 'table' viscous = 200.0 /
"""


def test_a_bit_that_sticks_has_the_motion_of_a_settled_run(nocdyn):
    over = "&run t_end = 60.0 /\n&orbit over = 'motor.drive.torque' range = 5000.0, 7000.0 count = 5 /\n"
    values, _ = branches(nocdyn, STUCK.format(5000.0) + over)
    (row,) = np.flatnonzero(np.isclose(values["motor.drive.torque"], 6000.0, rtol=1e-12))
    columns = compare_with_run(nocdyn, STUCK.format(6000.0), values, row, ("twist_string", "omega_bit", "omega_table"))
    assert columns["omega_bit"]["min"] == pytest.approx(0.0, abs=1e-9)  # it sticks


REFUSED = [
    (BELT.format(1.0, 0.5, ""), "its run settles on no oscillation at the first value", "a longer &run t_end"),
    (MASS.format("quadratic = 1.0", 0.1, 0.4, ""), "does not excite itself", "has the real part -0.15 1/s"),
    (MASS.format("quadratic = 1.0", 0.0, -1.0, "subharmonic = 2"), "subharmonic: nothing excites this machine", ""),
    (MASS.format("quadratic = 1.0", 0.0, -1.0, "starts = 4"), "starts: nothing excites this machine", ""),
    (MASS.format("quadratic = 1.0", 0.0, -1.0, "start = 'high'"), "start: nothing excites this machine", ""),
    (
        MASS.format("quadratic = 1.0", 0.0, -1.0, "")
        + "&excitation name = 'knock' body = 'mass' kind = 'pulse' amplitude = 1.0 time = 1.0 duration = 5.0 /\n",
        "do not repeat themselves",
        "",
    ),
]


@pytest.mark.parametrize(("text", "message", "detail"), REFUSED, ids=[message for _, message, _ in REFUSED])
def test_what_does_not_excite_itself_is_refused(nocdyn, text, message, detail):
    printed = refused(nocdyn, text)
    assert message in printed
    assert detail in printed
