"""Induction machines with two cages: run-up, steady states, modes and circuits from name plates, against other computations."""

import csv
import json

import double_cage_references as reference
import numpy as np
import pytest
from sweep_inputs import needs_sweeps

PRECISE = "method = 'rk853' rtol = 1e-12 atol = 1e-13"
MACHINE = """&body name = 'rotor' inertia = 20 /
&motor name = 'mains' body = 'rotor' kind = 'induction_dq' voltage = 6600 frequency_hz = 50 poles = 4
  stator_resistance = 0.644 rotor_resistance = 0.457 outer_resistance = 5.13
  stator_reactance = 5.44 rotor_reactance = 7.776 outer_reactance = 5.44 mutual_reactance = 129.8 {keys} /
&load name = 'fan' body = 'rotor' quadratic = 0.166 /
{rest}
&run t_end = 2.0 {run} /
&output interval = 0.05 /
"""

# Time [s], speed [rad/s], torque [N m], current [A]: printed by double_cage_references.py.
MOTIONS = {
    "start": [
        (0.05, 10.67326242672, 3922.684730465, 485.6944017243),
        (0.2, 43.49655450628, 6997.750700663, 394.5439100601),
        (0.5, 114.7597590137, 5943.433810602, 332.9293171208),
        (1, 155.7782658248, 3938.362926578, 73.30525276135),
        (1.4, 155.9755164287, 4034.141500565, 68.2927442383),
        (1.45, 155.9715503205, 4039.984917281, 68.32719269481),
        (1.5, 155.9763594031, 4039.179267357, 68.29795673177),
        (1.55, 155.9745966168, 4037.427154235, 68.26147399272),
        (1.7, 155.9747349538, 4038.270046385, 68.257146287),
        (2, 155.97491279, 4038.4775837, 68.25607144615),
    ],
    "reconnection": [
        (0.05, 10.67326242672, 3922.684730465, 485.6944017243),
        (0.2, 43.49655450628, 6997.750700663, 394.5439100601),
        (0.5, 114.7597590137, 5943.433810602, 332.9293171208),
        (1, 155.7782658248, 3938.362926578, 73.30525276135),
        (1.4, 155.9755164287, 4034.141500565, 68.29274423831),
        (1.45, 146.6712228689, 0, 0),
        (1.5, 138.2557922311, 0, 0),
        (1.55, 115.1313838429, 3678.229542503, 452.7213833961),
        (1.7, 141.3175909854, 7097.830388104, 295.8848440125),
        (2, 156.1451979443, 3954.790628109, 78.37275626885),
    ],
}
KEYS = {"start": "", "reconnection": "supply_times = 0, 1.4, 1.5 supply_factors = 1, 0, 1"}
LARGEST = (157.0, 22446.0, 1063.0)  # speed, torque, current


def machine(keys="", rest="", run=PRECISE):
    return MACHINE.format(keys=keys, rest=rest, run=run)


def report(nocdyn, command, text):
    nocdyn.write("machine.nml", text)
    outcome = nocdyn(command, "machine.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "out" / f"{command}.json").read_text())


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize(
    "settings, precision",
    [
        (PRECISE, 1e-9),
        ("method = 'taylor' rtol = 1e-10 atol = 1e-10", 1e-7),
        ("method = 'rodas5p' rtol = 1e-9 atol = 1e-9 formulation = 'paper'", 1e-6),
        ("rtol = 1e-9 atol = 1e-9 formulation = 'multiplier'", 1e-6),
    ],
)
def test_motors_with_two_cages_move_as_in_another_frame_and_program(nocdyn, name, settings, precision):
    nocdyn.done(machine(KEYS[name], run=settings))
    table = nocdyn.values()
    for time, *expected in MOTIONS[name]:
        found = [table[key][round(time / 0.05)] for key in ("omega_rotor", "torque_mains", "current_mains")]
        assert np.abs((np.array(found) - expected) / LARGEST).max() < precision
    assert np.abs(table["energy_residual"]).max() < 1e-2


@pytest.mark.parametrize("load", [1.0, 10.0, 26.0, 60.0])
@pytest.mark.parametrize("way", [1, -1])
def test_the_torque_over_the_slip_is_that_of_the_circuit(nocdyn, load, way):
    keys = "reversed = .true." if way < 0 else ""
    text = machine(keys, run=PRECISE + " start = 'equilibrium'").replace("quadratic = 0.166", f"viscous = {load}")
    nocdyn.done(text, "--set", "run.t_end=0.05")
    table = nocdyn.values()
    speed = way * table["omega_rotor"][0]
    slip = 1 - reference.POLE_PAIRS * speed / reference.BASE
    assert way * table["torque_mains"][0] == pytest.approx(reference.steady_torque(slip), rel=1e-10)
    assert table["current_mains"][0] == pytest.approx(reference.steady_current(slip), rel=1e-10)
    for key in ("omega_rotor", "torque_mains", "current_mains"):
        assert np.ptp(table[key]) < 1e-9 * abs(table[key][0])


def test_steady_states_stand_on_both_sides_of_both_maxima_of_the_torque(nocdyn):
    """The torque of this circuit has a maximum of each cage, and a minimum between them."""
    text = machine().replace("rotor_resistance = 0.457 outer_resistance = 5.13", "rotor_resistance = 0.2 outer_resistance = 12")
    text = text.replace("rotor_reactance = 7.776 outer_reactance = 5.44", "rotor_reactance = 16 outer_reactance = 1")
    load = "table_speed = 0, 300 table_torque = 5200, 5200"
    text = text.replace("quadratic = 0.166", load)
    nocdyn.write("machine.nml", text)
    outcome = nocdyn("equilibrium", "machine.nml")
    assert outcome.returncode == 0, outcome.stderr
    speeds = [float(line.split()[-1]) for line in outcome.stdout.splitlines() if "omega_rotor" in line]
    slips = np.linspace(1e-4, 1, 20001)
    excess = np.array([reference.steady_torque(s, ((0.2, 16.0), (12.0, 1.0))) for s in slips]) - 5200
    crossings = slips[:-1][np.diff(np.sign(excess)) != 0]
    assert len(crossings) == 3
    expected = sorted(reference.BASE / 2 * (1 - crossings))
    assert sorted(speed for speed in speeds if speed > 0) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("resistance, kind", [("0", "neutral"), ("1e-9", "stable")])
def test_steady_states_are_found_without_losses_in_the_stator(nocdyn, resistance, kind):
    nocdyn.write("machine.nml", machine().replace("stator_resistance = 0.644", f"stator_resistance = {resistance}"))
    outcome = nocdyn("equilibrium", "machine.nml")
    assert outcome.returncode == 0, outcome.stderr
    assert f"steady state, {kind}" in outcome.stdout


TRAIN = """&body name = 'load' inertia = 30 /
&coupling name = 'shaft' bodies = 'rotor', 'load' stiffness = 2e5 damping = 100 /
"""


def train():
    return machine(rest=TRAIN).replace("body = 'rotor' quadratic", "body = 'load' quadratic")


def eigenvalues(slip_speed):
    """Of the equations of the reference in the frame of the mains, with the rotor, a shaft and a load, by complex steps."""
    base, pairs = reference.BASE, reference.POLE_PAIRS

    def rates(y):
        d, q, speed, twist, load = y[:3], y[3:6], y[6], y[7], y[8]
        i_d, i_q = reference.CURRENTS @ d, reference.CURRENTS @ q
        turn = np.array([base, base - pairs * speed, base - pairs * speed])
        rate_d = -reference.RESISTANCES * i_d + turn * q
        rate_q = -reference.RESISTANCES * i_q - turn * d
        moment = 2e5 * twist + 100 * (speed - load)
        torque = 1.5 * pairs * (d[0] * i_q[0] - q[0] * i_d[0])
        return np.array(
            [*rate_d, *rate_q, (torque - moment) / 20, speed - load, (moment - 0.166 * load**2) / 30],
        )

    slip = 1 - pairs * slip_speed / base
    turn = np.diag([1j * base, 1j * slip * base, 1j * slip * base])
    flux = np.linalg.solve(turn + reference.RESISTANCES[:, None] * reference.CURRENTS, [np.sqrt(2 / 3) * reference.VOLTAGE, 0, 0])
    state = [*flux.real, *flux.imag, slip_speed, 0.166 * slip_speed**2 / 2e5, slip_speed]
    step = 1e-30
    columns = [rates(np.array(state, complex) + 1j * step * np.eye(9)[k]).imag / step for k in range(9)]
    return np.linalg.eigvals(np.array(columns).T)


def test_modes_and_campbell_have_the_eigenvalues_of_the_equations(nocdyn):
    nocdyn.done(machine(run=PRECISE + " start = 'equilibrium'"), "--set", "run.t_end=0.05")
    speed = nocdyn.values()["omega_rotor"][0]
    expected = sorted(abs(value.imag) / (2 * np.pi) for value in eigenvalues(speed) if value.imag > 1e-6)
    modes = report(nocdyn, "modes", train())["modes"]
    found = sorted(mode["frequency_Hz"] for mode in modes if mode["kind"] == "oscillating")
    assert len(expected) == 4
    assert found == pytest.approx(expected, rel=1e-7)
    report(nocdyn, "campbell", train() + f"&response body = 'rotor' speed = {speed - 10}, {speed} count = 2 /\n")
    table = nocdyn.values("out", "campbell.csv")
    frequencies = [table[key][-1] for key in table if key.startswith("frequency_")]
    assert sorted(frequencies)[-4:] == pytest.approx(expected, rel=1e-5)


def test_a_response_and_a_run_agree(nocdyn):
    """Both have the moment that an excitation makes in the shaft, with the answer of both cages."""
    text = train() + "&excitation name = 'shaker' body = 'load' kind = 'orders' orders = 0.5 amplitudes = 1.0 /\n"
    text = text.replace(PRECISE, PRECISE + " start = 'equilibrium'").replace("interval = 0.05", "interval = 0.001")
    nocdyn.done(text, "--set", "run.t_end=3.0")
    table = nocdyn.values()
    moment, speed = table["total_moment_shaft"][2500:], table["omega_rotor"][-1]
    report(nocdyn, "response", text + f"&response body = 'rotor' speed = {speed - 1}, {speed} count = 2 /\n")
    response = nocdyn.values("out", "response.csv")
    assert response["half_range_total_moment_shaft"][-1] == pytest.approx(np.ptp(moment) / 2, rel=1e-3)


@needs_sweeps
def test_a_sweep_computes_what_single_runs_compute(nocdyn):
    variants = """
&sweep design = 'grid' /
&vary target = 'motor.mains.outer_resistance' low = 3.0 high = 9.0 count = 3 /
&vary target = 'motor.mains.outer_reactance' low = 4.0 high = 6.0 count = 2 /
&record quantity = 'torque_mains' statistic = 'max' /
&record quantity = 'current_mains' statistic = 'final' /
"""
    text = machine(run="rtol = 1e-9")
    nocdyn.write("machine.nml", text + variants)
    outcome = nocdyn("sweep", "machine.nml", "--out", "swept", "--csv", "--set", "run.t_end=0.3")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "swept/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    for row in rows:
        settings = [f"{key.split(' ')[0]}={float(row[key])}" for key in row if "mains.outer" in key]
        assert len(settings) == 2
        words = [word for setting in [*settings, "run.t_end=0.3"] for word in ("--set", setting)]
        nocdyn.done(text, *words)
        single = nocdyn.summary("out")["columns"]
        assert float(row["torque_mains_max [N m]"]) == pytest.approx(single["torque_mains [N m]"]["max"], rel=1e-7)
        assert float(row["current_mains_final [A]"]) == pytest.approx(single["current_mains [A]"]["last"], rel=1e-7)


RATED = """&body name = 'rotor' inertia = 20 /
&motor name = 'mains' body = 'rotor' kind = 'induction_dq' voltage = 6600 frequency_hz = 50 poles = 4
  rated_power = 630e3 rated_speed_rpm = 1489.5 efficiency = 0.959 power_factor = 0.83 breakdown_ratio = 2.55
  starting_torque = 1.22 starting_current = 5.9 cages = 2 {keys} /
&load name = 'fan' body = 'rotor' quadratic = 0.16601154 /
&run t_end = 1.0 rtol = 1e-9 /
&output interval = 0.001 /
"""
CIRCUIT = (
    "stator_resistance = 0.643653, rotor_resistance = 0.454648, outer_resistance = 5.13019, "
    "stator_reactance = outer_reactance = 5.43702, rotor_reactance = 7.77606, mutual_reactance = 129.834"
)


def test_a_circuit_with_two_cages_from_rated_values_is_noted_and_moves_so(nocdyn):
    nocdyn.done(RATED.format(keys=""))
    notes = nocdyn.summary("out")["machine"]["notes"]
    assert notes == [
        "motor 'mains' has from its rated and starting values, with 40 % of the losses outside of the rotor in the stator "
        f"winding and equal leakages of stator and outer cage: {CIRCUIT} Ohm; breakdown torque 2.55 and starting torque 1.22 of "
        "the rated torque, starting current 5.9 of the rated one, as given"
    ]
    table = nocdyn.values()
    rated = RATED[RATED.index("  rated_power") : RATED.index("{keys}")]
    circuit = CIRCUIT.replace("stator_reactance = outer", "stator_reactance = 5.43702, outer").replace(",", " ")
    nocdyn.done(RATED.replace(rated, circuit).format(keys=""))
    same = nocdyn.values()
    for key in ("omega_rotor", "torque_mains", "current_mains"):
        assert np.abs(table[key] - same[key]).max() < 1e-4 * np.abs(table[key]).max()


def test_a_motor_with_two_cages_turns_with_its_rated_speed_at_its_rated_torque(nocdyn):
    nocdyn.write("machine.nml", RATED.format(keys=""))
    text = nocdyn("equilibrium", "machine.nml").stdout
    speed = next(float(line.split()[-1]) for line in text.splitlines() if "omega_rotor" in line)
    assert speed * 30 / np.pi == pytest.approx(1489.5, rel=1e-6)


def test_values_that_two_cages_nearly_have_are_noted_with_the_difference(nocdyn):
    text = RATED.format(keys="").replace("starting_torque = 1.22", "starting_torque = 2.6")
    nocdyn.write("machine.nml", text)
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 0, outcome.stderr
    assert "% beside the given ones" in outcome.stdout


def test_one_cage_that_misses_the_starting_torque_tells_of_two(nocdyn):
    nocdyn.write("machine.nml", RATED.format(keys="").replace("cages = 2", ""))
    text = nocdyn("check", "machine.nml").stdout
    assert (
        "starting_torque = 1.22, but 0.189 with the circuit, which knows no skin effect in the bars; cages = 2 fits a second cage"
        in text
    )


@needs_sweeps
def test_a_sweep_over_rated_values_finds_a_circuit_with_two_cages_for_each(nocdyn):
    variants = """
&sweep design = 'grid' /
&vary target = 'motor.mains.starting_torque' low = 1.0 high = 1.6 count = 3 /
&record quantity = 'torque_mains' statistic = 'max' /
"""
    nocdyn.write("machine.nml", RATED.format(keys="") + variants)
    outcome = nocdyn("sweep", "machine.nml", "--out", "swept", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "swept/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for torque, row in zip((1.0, 1.3, 1.6), rows, strict=True):
        nocdyn.done(RATED.format(keys=""), "--set", f"motor.mains.starting_torque={torque}")
        largest = nocdyn.summary("out")["columns"]["torque_mains [N m]"]["max"]
        assert float(row["torque_mains_max [N m]"]) == pytest.approx(largest, rel=1e-7)


@pytest.mark.parametrize(
    "old, new, complaint",
    [
        ("starting_torque = 1.22", "", "cages = 2 needs starting_torque and starting_current"),
        ("starting_current = 5.9", "", "cages = 2 needs starting_torque and starting_current"),
        ("cages = 2", "cages = 3", "cages = 3 is out of range; allowed: 1 to 2"),
        (
            "starting_torque = 1.22",
            "starting_torque = 4",
            "no circuit with two cages has breakdown_ratio = 2.55, starting_torque = 4 and starting_current = 5.9 with these "
            "losses, slip and power factor; the nearest one: breakdown torque 2.969 and starting torque 2.969 of the rated "
            "torque, starting current 5.9 of the rated one",
        ),
        ("0.959", "0.995", "efficiency = 0.995; allowed: < 0.993, as the slip takes 0.007 of the power of the air gap"),
        ("= 0.83", "= 1", "power_factor = 1 leaves no reactive power to magnetise the motor; allowed: smaller values"),
        ("{keys}", "outer_resistance = 5", "outer_resistance needs rotor_resistance"),
    ],
)
def test_rated_values_without_a_circuit_with_two_cages_are_refused(nocdyn, old, new, complaint):
    nocdyn.write("machine.nml", RATED.replace(old, new).format(keys=""))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert complaint in outcome.stderr


@pytest.mark.parametrize(
    "old, new, complaint",
    [
        ("outer_resistance = 5.13", "", "outer_reactance needs outer_resistance"),
        ("outer_reactance = 5.44", "", "outer_resistance needs outer_leakage or outer_reactance"),
        ("outer_resistance = 5.13", "outer_resistance = 0", "outer_resistance = 0 is out of range; allowed: > 0 [Ohm]"),
        ("outer_reactance = 5.44", "outer_reactance = 0", "outer_reactance = 0 is out of range; allowed: > 0 [Ohm]"),
        ("{keys}", "outer_leakage = 0.01", "outer_leakage and outer_reactance are both given; allowed: one of them"),
        ("{keys}", "cages = 2", "cages needs rated_power"),
    ],
)
def test_circuits_with_half_a_cage_are_refused(nocdyn, old, new, complaint):
    nocdyn.write("machine.nml", MACHINE.replace(old, new).format(keys="", rest="", run=""))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert complaint in outcome.stderr
