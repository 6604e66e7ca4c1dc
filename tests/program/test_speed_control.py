"""Motors on inverters, and governors whose set speed follows the time."""

import numpy as np
import pytest

LIMIT, GAIN, TIME, INERTIA, VISCOUS = 600.0, 0.1, 0.5, 10.0, 2.0

DRIVE = f"""&body name = 'rotor' inertia = {INERTIA} /
&motor name = 'drive' body = 'rotor' kind = 'inverter' torque_limit = {LIMIT} governor_gain = {GAIN}
       governor_time = {TIME} {{keys}} /
&load name = 'work' body = 'rotor' viscous = {VISCOUS} /
&run t_end = 8.0 rtol = 1e-10 atol = 1e-11 /
&output points = 81 /
"""
RAMP = "set_times = 1, 3, 4 set_speeds = 0, 150, 100"
RIPPLE = "poles = 4 harmonics = 6 harmonic_shares = 0.1 harmonic_phases = 0.3"


def run(nocdyn, text, *settings, command="run"):
    (nocdyn.folder / "machine.nml").write_text(text)
    words = [word for s in settings for word in ("--set", s)]
    files = ("--out", "out") if command in ("run", "response") else ()
    outcome = nocdyn(command, "machine.nml", *files, *words)
    assert outcome.returncode == 0, outcome.stderr
    return outcome


def set_speed(t):
    return np.interp(t, [1, 3, 4], [0, 150, 100])


def rates(t, y):
    """Of the speed, the integral and the angle."""
    free = y[1] + GAIN * (set_speed(t) - y[0])
    throttle = min(max(free, -1.0), 1.0)
    torque = LIMIT * throttle * (1 + 0.1 * np.sin(12 * y[2] + 0.3))
    return np.array([(torque - VISCOUS * y[0]) / INERTIA, (throttle - y[1]) / TIME, y[0]])


def integrate(t_end, steps):
    """By the classic Runge-Kutta method: speeds at ten times."""
    y, h, speeds = np.zeros(3), t_end / steps, []
    for i in range(steps):
        t = i * h
        a = rates(t, y)
        b = rates(t + h / 2, y + h / 2 * a)
        c = rates(t + h / 2, y + h / 2 * b)
        d = rates(t + h, y + h * c)
        y = y + h / 6 * (a + 2 * b + 2 * c + d)
        if (i + 1) % (steps // 10) == 0:
            speeds.append(y[0])
    return np.array(speeds)


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
@pytest.mark.parametrize("method", ["auto", "rodas5p"])
def test_a_drive_follows_its_ramp_within_the_torque_limit(nocdyn, method, formulation):
    run(
        nocdyn,
        DRIVE.format(keys=f"{RAMP} {RIPPLE}"),
        f"run.method={method}",
        f"run.formulation={formulation}",
        "output.points=11",
    )
    table = nocdyn.values()
    assert np.abs(table["omega_rotor"][1:] - integrate(8.0, 40000)).max() < 1e-5
    assert np.abs(table["throttle_drive"]).max() <= 1 + 1e-9
    assert np.abs(table["energy_residual"]).max() < 1e-4


def test_the_lag_behind_a_ramp_is_that_of_a_pi_controller(nocdyn):
    run(nocdyn, DRIVE.format(keys="set_times = 0, 100 set_speeds = 0, 1000"), "run.t_end=20")
    table = nocdyn.values()
    lag = VISCOUS * 10.0 * TIME / (LIMIT * GAIN)
    assert table["omega_rotor"][-1] == pytest.approx(200 - lag, rel=1e-9)
    assert table["torque_drive"][-1] == pytest.approx(INERTIA * 10 + VISCOUS * table["omega_rotor"][-1], rel=1e-8)


def test_a_limited_drive_does_not_overshoot_by_its_integral(nocdyn):
    run(nocdyn, DRIVE.format(keys="governor_speed = 100"), "motor.drive.torque_limit=300")
    table = nocdyn.values()
    assert table["throttle_drive"][15] == pytest.approx(1.0, abs=1e-9)
    assert table["omega_rotor"].max() < 103
    assert table["omega_rotor"][-1] == pytest.approx(100, rel=1e-2)


def test_a_governor_of_another_motor_follows_the_same_points(nocdyn):
    constant = DRIVE.replace("'inverter' torque_limit", "'constant' torque").format(keys=RAMP)
    run(nocdyn, constant.replace("governor_gain", "governor_start = 0 governor_gain"), "run.t_end=2.5")
    governed = nocdyn.values()
    run(nocdyn, DRIVE.format(keys=RAMP), "run.t_end=2.5")
    drive = nocdyn.values()
    assert governed["throttle_drive"].min() >= 0
    assert np.abs(governed["omega_rotor"] - drive["omega_rotor"]).max() < 1e-6


def test_points_with_one_speed_are_a_constant_set_speed(nocdyn):
    run(nocdyn, DRIVE.format(keys="set_times = 1, 3 set_speeds_rpm = 600, 600"))
    points = nocdyn.values()
    run(nocdyn, DRIVE.format(keys="governor_speed_rpm = 600"))
    constant = nocdyn.values()
    assert np.abs(points["omega_rotor"] - constant["omega_rotor"]).max() < 1e-7


def test_steady_states_have_the_set_speed_of_their_time(nocdyn):
    text = run(nocdyn, DRIVE.format(keys=f"{RAMP} {RIPPLE}"), command="equilibrium").stdout
    values = {line.split()[0]: line.split()[-1] for line in text.splitlines() if "[" in line}
    assert (values["omega_rotor"], values["torque_drive"]) == ("100", "200")
    keys = "set_times = 1, 3, 4 set_speeds = 0, 150, 100"
    run(nocdyn, DRIVE.format(keys=keys), "run.start=equilibrium", "run.t_start=2")
    table = nocdyn.values()
    assert table["omega_rotor"][0] == pytest.approx(75, rel=1e-9)
    assert table["torque_drive"][0] == pytest.approx(150, rel=1e-9)


def test_harmonics_excite_the_forced_response_as_orders_do(nocdyn):
    text = """&body name = 'motor' inertia = 1.0 /
&body name = 'fan' inertia = 10.0 /
&coupling name = 'coupling' bodies = 'motor', 'fan' stiffness = 2.0e4 damping = 10.0 /
&motor name = 'drive' body = 'motor' kind = 'inverter' torque_limit = 600 governor_speed = 100 governor_gain = 0.01
       governor_time = 0.5 poles = 4 harmonics = 6 {keys} /
&load name = 'air' body = 'fan' quadratic = 0.02 /
{rest}
&response body = 'motor' speed_rpm = 100, 300 /
&run t_end = 1 /
"""
    orders = "&excitation name = 'ripple' body = 'motor' kind = 'orders' orders = 12 amplitudes = 5 /"
    run(nocdyn, text.format(keys="harmonic_torques = 5", rest=""), command="response")
    header, rows = nocdyn.table("out", "response.csv")
    run(nocdyn, text.format(keys="harmonic_torques = 1e-9", rest=orders), command="response")
    _, same = nocdyn.table("out", "response.csv")
    column = next(i for i, name in enumerate(header) if name.startswith("half_range_total_moment"))
    largest = max(row[column] for row in rows)
    assert largest == pytest.approx(max(row[column] for row in same), rel=1e-6)
    run(nocdyn, text.format(keys="harmonic_shares = 0.5", rest=""), command="response")
    _, shares = nocdyn.table("out", "response.csv")
    pairs = [(row, share) for row, share in zip(rows, shares, strict=True) if row[0] == share[0]]  # all but the peaks
    assert len(pairs) > 190
    for row, share in pairs:
        assert share[column] == pytest.approx(row[column] / 5 * 0.5 * 0.02 * row[0] ** 2, rel=1e-9)


@pytest.mark.parametrize(
    "keys, complaint",
    [
        (f"{RAMP} governor_speed = 100", "governor_speed and set_times are both given; allowed: one of them"),
        ("", "governor_gain needs governor_speed or set_times"),
        (None, "kind = 'inverter' needs a set speed; required: governor_speed [rad/s], or set_times and set_speeds"),
        ("set_times = 1, 2", "set_speeds is missing; needed: 2 values, one for each of set_times\n"),
        ("set_times = 2, 1 set_speeds = 0, 1", "set_times(2) = 1 must be greater than set_times(1) = 2"),
        ("set_times = 1, 2 set_speeds = 0, 1, 2", "set_speeds has 3 values and set_times has 2 values; needed: as many of each"),
        ("governor_speed = 1 harmonics = 6 harmonic_shares = 1", "harmonics needs poles"),
        ("governor_speed = 1 poles = 4 harmonics = 6", "harmonic_shares or harmonic_torques is missing; one of them is needed\n"),
        ("governor_speed = 1 poles = 3", "poles = 3; allowed: an even number, twice the pole pairs"),
        ("governor_speed = 1 governor_start = 0.5", "governor_start belongs to kind = 'quadratic', 'constant'"),
    ],
)
def test_keys_that_do_not_fit_are_refused(nocdyn, keys, complaint):
    text = DRIVE.format(keys=keys)
    if keys is None:
        text = DRIVE.replace(f"governor_gain = {GAIN}", "").replace(f"governor_time = {TIME} {{keys}}", "")
    (nocdyn.folder / "machine.nml").write_text(text)
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert f"&motor 'drive': {complaint}" in outcome.stderr


def test_a_gain_that_turns_away_from_the_set_speed_is_refused(nocdyn):
    (nocdyn.folder / "machine.nml").write_text(DRIVE.format(keys="governor_speed = 1").replace("gain = 0.1", "gain = -0.1"))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert "&motor 'drive': governor_gain = -0.1; allowed with kind = 'inverter': > 0 [s/rad]" in outcome.stderr


TWO_MASSES = """&body name = 'motor' inertia = 12 speed = 80 /
&body name = 'fly' inertia = 30 speed = 80 /
&coupling name = 'rubber' bodies = 'motor', 'fly' stiffness = 6e4 damping = 20 /
&excitation name = 'e' body = 'fly' kind = 'orders' orders = 1 amplitudes = 3 /
&load name = 'l' body = 'fly' constant = 900 constant_speed = 1 /
&response body = 'fly' speed = 40, 140 count = 11 /
&output extremes_from = 17 /
"""
RUN = "&run t_end = 20 start = 'equilibrium' rtol = 1e-10 atol = 1e-11 /\n"
GOVERNED = "governor_gain = 0.4 governor_time = 1"
# keys of the motor, and its torque with an open throttle at a speed
GOVERNED_MOTORS = {
    "inverter": ("kind = 'inverter' torque_limit = 2500", lambda omega: 2500.0),
    "quadratic": ("a = 3000 b = 4 c = 0.02", lambda omega: 3000 - 4 * omega - 0.02 * omega**2),
    "dc": ("kind = 'dc' voltage = 800 resistance = 0.5 flux_constant = 3", lambda omega: 3 * (800 - 3 * omega) / 0.5),
}


def moment_amplitude(omega, slope, by_throttle):
    """Of the coupling at order 1, with the slope of the motor's torque over its speed and its derivative by the throttle."""
    s = 1j * omega
    control = 0.4 * (1 + 1 / s)  # throttle for a speed that is too low, integral time 1 s
    shaft = 6e4 + 20 * s
    torque = -slope + by_throttle * control
    matrix = [[12 * s**2 + torque * s + shaft, -shaft], [-shaft, 30 * s**2 + shaft]]
    angles = np.linalg.solve(matrix, [0, 3])
    return abs(shaft * (angles[1] - angles[0]))


@pytest.mark.parametrize("kind", GOVERNED_MOTORS)
def test_governors_take_part_in_forced_oscillations(nocdyn, kind):
    """In closed form at all speeds, and at one of them as the settled motion of a run."""
    keys, torque = GOVERNED_MOTORS[kind]
    text = TWO_MASSES + f"&motor name = 'drive' body = 'motor' {keys} governor_speed = 80 {GOVERNED} /\n"
    run(nocdyn, text + RUN, command="response")
    header, rows = nocdyn.table("out", "response.csv")
    speeds, found = (
        np.array([row[header.index(label)] for row in rows])
        for label in ("omega_fly [rad/s]", "half_range_total_moment_rubber [N m]")
    )
    for omega, half_range in zip(speeds, found):
        if kind == "dc":
            slope, by_throttle = -9 / 0.5, 3 * 800 / 0.5
        else:
            throttle = 900 / torque(omega)
            slope = throttle * (torque(omega + 1) - torque(omega - 1)) / 2
            by_throttle = torque(omega)
        assert half_range == pytest.approx(moment_amplitude(omega, slope, by_throttle), rel=1e-9)
    run(nocdyn, text + RUN)
    extremes = nocdyn.summary("out")["columns"]["total_moment_rubber [N m]"]
    settled = 0.5 * (extremes["max"] - extremes["min"])
    assert found[speeds == 80] == pytest.approx(settled, rel=1e-4)


def test_a_governor_at_its_limit_leaves_its_throttle_there(nocdyn):
    """The load is as large as the torque: whatever the speed is, the throttle is open."""
    motor = f"&motor name = 'drive' body = 'motor' kind = 'inverter' torque_limit = 900 governor_speed = 80 {GOVERNED} /\n"
    run(nocdyn, TWO_MASSES + motor + RUN.replace("start = 'equilibrium'", ""), command="response")
    header, rows = nocdyn.table("out", "response.csv")
    for row in rows:
        expected = moment_amplitude(row[0], 0.0, 0.0)
        assert row[header.index("half_range_total_moment_rubber [N m]")] == pytest.approx(expected, rel=1e-9)
