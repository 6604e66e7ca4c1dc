"""Induction machines with electrical transients: run-up, steady states and supply, against other computations."""

import csv
import re

import numpy as np
import pytest
from verified import known

ROTOR = {"3 hp": 0.089, "500 hp": 11.06}
CIRCUIT = {
    "3 hp": "voltage = 220 stator_resistance = 0.435 rotor_resistance = 0.816 "
    "stator_reactance = 0.754 rotor_reactance = 0.754 mutual_reactance = 26.13",
    "500 hp": "voltage = 2300 stator_resistance = 0.262 rotor_resistance = 0.187 "
    "stator_reactance = 1.206 rotor_reactance = 1.206 mutual_reactance = 54.02",
}

# Time [s], speed [rad/s], torque [N m], current [A]: printed by motor_references.py, Krause's equations in the stationary frame
# with the method DOP853 of SciPy and rtol 1e-13.
RUN_UP = {
    "3 hp": [
        (0.05, 30.48704218605, 42.78839477517, 62.54622425921),
        (
            0.1,
            known("electrical_machines.krause_3hp.speed_0.1"),
            known("electrical_machines.krause_3hp.torque"),
            known("electrical_machines.krause_3hp.current"),
        ),
        (0.2, known("electrical_machines.krause_3hp.speed_0.2"), 57.56365122311, 40.35110245582),
        (0.3, 171.508555455, 25.16469587605, 14.90996173167),
        (0.5, 188.096783437, 0.6906951327254, 4.742229149502),
    ],
    "500 hp": [
        (0.05, 5.583051034396, 607.2068007175, 528.1051212145),
        (0.1, 8.345839653235, 2090.529209757, 533.2954568086),
        (0.2, 12.3503832161, 3913.980697941, 491.1034427583),
        (0.3, 17.43187454889, 12.87088535036, 551.823952432),
        (0.5, 33.98266852153, 878.9117323683, 543.6159131986),
        (1.0, 90.68951755155, known("electrical_machines.krause_500hp.torque"), 538.4841034468),
        (1.449, 191.7353829799, 31.17206534879, 81.75918407095),
        (2.0, 188.4950523812, 0.6456266626967, 24.04182340982),
    ],
}
LARGEST = {"3 hp": (188.5, 132.06, 74.2), "500 hp": (191.7, 5066.4, 570.0)}  # speed, torque, current
PRECISE = "method = 'rk853' rtol = 1e-12 atol = 1e-13"


def machine(name, keys="", run=PRECISE, rest=""):
    return f"""&body name = 'rotor' inertia = {ROTOR[name]} /
&motor name = 'mains' body = 'rotor' kind = 'induction_dq' frequency_hz = 60 poles = 4 {CIRCUIT[name]} {keys} /
{rest}
&run t_end = 2.0 {run} /
&output interval = 0.001 /
"""


def run(nocdyn, text, *settings, command="run"):
    (nocdyn.folder / "machine.nml").write_text(text)
    words = [word for s in settings for word in ("--set", s)]
    files = {"run": ("--out", "out"), "sweep": ("--out", "swept", "--csv")}.get(command, ())
    outcome = nocdyn(command, "machine.nml", *files, *words)
    assert outcome.returncode == 0, outcome.stderr
    return outcome


@pytest.mark.parametrize("name", RUN_UP)
def test_machines_run_up_as_in_another_frame_and_program(nocdyn, name):
    run(nocdyn, machine(name))
    table = nocdyn.values()
    for time, *expected in RUN_UP[name]:
        at = round(time / 0.001)
        found = [table[key][at] for key in ("omega_rotor", "torque_mains", "current_mains")]
        assert np.abs((np.array(found) - expected) / LARGEST[name]).max() < 1e-8
    assert np.abs(table["energy_residual"]).max() < 1e-6


@pytest.mark.parametrize("method", ["auto", "rk45", "rodas5p"])
@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_every_formulation_and_kind_of_method_computes_the_same_run_up(nocdyn, method, formulation):
    if formulation == "reduced" and method == "auto":
        method = "taylor"
    settings = f"method = '{method}' formulation = '{formulation}' rtol = 1e-8 atol = 1e-8"
    run(nocdyn, machine("3 hp", run=settings), "run.t_end=0.3")
    table = nocdyn.values()
    for time, *expected in RUN_UP["3 hp"][:4]:
        found = [table[key][round(time / 0.001)] for key in ("omega_rotor", "torque_mains", "current_mains")]
        assert np.abs((np.array(found) - expected) / LARGEST["3 hp"]).max() < 1e-5


def test_a_reversed_field_gives_the_mirror_image(nocdyn):
    run(nocdyn, machine("3 hp"), "run.t_end=0.2")
    forwards = nocdyn.values()
    run(nocdyn, machine("3 hp", "reversed = .true."), "run.t_end=0.2")
    backwards = nocdyn.values()
    assert np.abs(forwards["torque_mains"] + backwards["torque_mains"]).max() == 0
    assert np.abs(forwards["omega_rotor"] + backwards["omega_rotor"]).max() == 0
    assert np.abs(forwards["current_mains"] - backwards["current_mains"]).max() == 0


def test_a_start_in_the_steady_state_stays_there(nocdyn):
    load = "&load name = 'fan' body = 'rotor' quadratic = 4e-4 /"
    run(nocdyn, machine("3 hp", run=PRECISE + " start = 'equilibrium'", rest=load))
    table = nocdyn.values()
    for key in ("omega_rotor", "torque_mains", "current_mains"):
        assert np.ptp(table[key]) < 1e-9 * table[key][0]
    assert table["torque_mains"][0] == pytest.approx(4e-4 * table["omega_rotor"][0] ** 2, rel=1e-9)


def test_steady_states_are_on_both_sides_of_the_breakdown_torque(nocdyn):
    load = "&load name = 'press' body = 'rotor' table_speed = 0, 300 table_torque = 57, 57 /"
    text = run(nocdyn, machine("3 hp", rest=load), command="equilibrium").stdout
    assert "steady state 1 of 2, unstable" in text and "steady state 2 of 2, stable" in text


@pytest.mark.parametrize("resistance", ["0", "1e-9", "1e-4"])
def test_steady_states_are_found_without_losses_in_the_stator(nocdyn, resistance):
    load = "&load name = 'fan' body = 'rotor' quadratic = 4e-4 /"
    text = machine("3 hp", rest=load).replace("stator_resistance = 0.435", f"stator_resistance = {resistance}")
    text = run(nocdyn, text, command="equilibrium").stdout
    speed = next(float(line.split()[-1]) for line in text.splitlines() if "omega_rotor" in line)
    assert speed == pytest.approx(180.20595, rel=1e-6)


def test_a_sweep_computes_what_single_runs_compute(nocdyn):
    variants = """
&sweep design = 'grid' /
&vary target = 'motor.mains.rotor_resistance' low = 0.5 high = 1.2 count = 3 /
&vary target = 'motor.mains.frequency_hz' low = 50 high = 60 count = 2 /
&vary target = 'motor.mains.poles' low = 2 high = 4 count = 2 /
&record quantity = 'torque_mains' statistic = 'max' /
&record quantity = 'current_mains' statistic = 'final' /
"""
    text = machine("3 hp", run="rtol = 1e-8") + variants
    run(nocdyn, text, "run.t_end=0.2", command="sweep")
    with open(nocdyn.folder / "swept/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    for row in rows:
        values = {key: float(value) for key, value in row.items() if "mains" in key}
        targets = ("rotor_resistance", "frequency_hz", "poles")
        settings = [f"{key.split(' ')[0]}={values[key]:g}" for key in values if any(f"mains.{name}" in key for name in targets)]
        run(nocdyn, machine("3 hp", run="rtol = 1e-8"), *settings, "run.t_end=0.2")
        single = nocdyn.summary("out")["columns"]
        assert len(settings) == 3
        assert values["torque_mains_max [N m]"] == pytest.approx(single["torque_mains [N m]"]["max"], rel=1e-6)
        assert values["current_mains_final [A]"] == pytest.approx(single["current_mains [A]"]["last"], rel=1e-6)


# Load [N m s2], end [s], keys; then the rows that motor_references.py prints, as above.
SUPPLIES = {
    "star and delta": ("3 hp", 4e-4, 1.0, "supply_times = 0, 0.6, 0.63 supply_factors = 0.57735, 0, 1"),
    "soft start": ("3 hp", 4e-4, 1.0, "supply_times = 0.05, 0.6 supply_factors = 0.8, 1 supply_ramps = 0.4, 0.2"),
    "reconnection": ("500 hp", 0.055, 3.1, "supply_times = 0, 2.8, 2.926 supply_factors = 1, 0, 1"),
}
SUPPLIED = {
    "star and delta": [
        (0.1, 19.9552436867, 17.91214939834, 36.05984071158),
        (0.2, 39.10794066828, 24.75338108515, 33.21241368974),
        (0.3, 59.91198533696, 18.68947892992, 34.45659564886),
        (0.4, 80.416299744, 20.3720747158, 31.2032079796),
        (0.5, known("electrical_machines.star_delta.star"), 20.46244152337, 28.14134879669),
        (0.6, 117.1504022134, 19.72596847651, 24.82952678778),
        (0.7, 140.216176584, known("electrical_machines.star_delta.delta"), 32.25689756931),
        (0.8, 171.019732585, 25.18292365988, 14.82167321064),
        (0.9, 178.3939397279, 15.12919545078, 9.395262657815),
        (1, 179.6237488811, 13.2806683895, 8.501082719807),
    ],
    "soft start": [
        (0.1, 0.09294266669714, 0.5304159379555, 6.406037442506),
        (0.2, 2.618053843045, 4.770627914878, 19.47730431465),
        (0.3, 12.35580725144, 13.55381250529, 32.07809576044),
        (0.4, 34.7205704027, 27.83171870221, 43.11814828706),
        (0.5, known("electrical_machines.soft_start.speed"), 39.06092068813, 44.30410001666),
        (0.6, 113.2886215852, 38.24286342905, 35.6156202657),
        (0.7, 148.9271116776, known("electrical_machines.soft_start.torque"), 25.83721938863),
        (0.8, 171.691849002, 24.10582352758, 14.38519479352),
        (0.9, 178.5054771482, 14.96373421013, 9.313604129687),
        (1, 179.6411543294, 13.25414815054, 8.488560850381),
    ],
    "reconnection": [
        (0.31, 18.98173698031, 477.2518639039, 570.0162934247),
        (0.62, 43.77921025983, 1105.976624118, 543.7043189247),
        (0.93, 72.65151657938, 1358.848262827, 541.6861697323),
        (1.24, 104.3899638386, 1824.435864004, 535.1011058837),
        (1.55, 145.9669133815, 3133.665541882, 503.0375506775),
        (1.86, 185.5124646558, 1986.727042528, 104.9979398304),
        (2.17, 185.8238260914, 1900.018158356, 99.97582186607),
        (2.48, 185.8253043468, 1899.213708698, 99.93923210524),
        (2.79, 185.8253095687, 1899.207550552, 99.93894201955),
        (3.1, 181.3190752982, 3939.359670905, 293.416595341),
    ],
}


def supplied(name, run=PRECISE):
    size, load, _, keys = SUPPLIES[name]
    return machine(size, keys, run, rest=f"&load name = 'fan' body = 'rotor' quadratic = {load} /")


@pytest.mark.parametrize("name", SUPPLIES)
@pytest.mark.parametrize("method, precision", [(PRECISE, 1e-8), ("method = 'rodas5p' rtol = 1e-9 atol = 1e-9", 1e-6)])
def test_motors_on_a_changing_supply_move_as_in_another_program(nocdyn, name, method, precision):
    size, _, t_end, _ = SUPPLIES[name]
    run(nocdyn, supplied(name, method), f"run.t_end={t_end}", f"output.interval={t_end / 10}")
    table = nocdyn.values()
    for row, (_, *expected) in enumerate(SUPPLIED[name], start=1):
        found = [table[key][row] for key in ("omega_rotor", "torque_mains", "current_mains")]
        assert np.abs((np.array(found) - expected) / LARGEST[size]).max() < precision


def test_a_reconnection_in_phase_opposition_gives_ten_times_the_rated_torque(nocdyn):
    run(nocdyn, supplied("reconnection"), "run.t_end=3.1")
    torque = nocdyn.summary("out")["columns"]["torque_mains [N m]"]
    assert torque["min"] == pytest.approx(-18837.66295, rel=1e-6)
    assert torque["time_of_min"] == pytest.approx(2.93186, abs=1e-5)


def test_a_disconnected_motor_keeps_its_rotor_flux_but_no_current(nocdyn):
    run(nocdyn, supplied("reconnection"), "run.t_end=2.92", "output.interval=0.01")
    table = nocdyn.values()
    assert table["current_mains"][281] < 0.03 and table["current_mains"][291] < 1e-6
    assert np.abs(table["torque_mains"][284:]).max() < 1e-6


def test_a_start_in_the_steady_state_takes_the_share_of_the_supply_at_its_time(nocdyn):
    text = supplied("soft start", PRECISE + " t_start = 0.5 start = 'equilibrium'").replace("t_end = 2.0", "t_end = 0.6")
    run(nocdyn, text)
    table = nocdyn.values()
    assert np.ptp(table["omega_rotor"]) < 1e-9 * table["omega_rotor"][0]
    run(nocdyn, text, "run.t_start=0.25", "run.t_end=0.251")
    on_the_ramp = nocdyn.values()
    constant = machine(
        "3 hp", run=PRECISE + " start = 'equilibrium'", rest="&load name = 'fan' body = 'rotor' quadratic = 4e-4 /"
    )
    run(nocdyn, constant, "motor.mains.voltage=88", "run.t_end=0.001")
    table = nocdyn.values()
    for key in ("omega_rotor", "torque_mains", "current_mains"):
        assert on_the_ramp[key][0] == pytest.approx(table[key][0], rel=1e-9)


@pytest.mark.parametrize(
    "keys, complaint",
    [
        ("poles = 3", "poles = 3; allowed: an even number, twice the pole pairs"),
        ("voltage = -220", "voltage = -220; allowed: > 0 [V]"),
        (
            "governor_speed = 100",
            "governor_speed belongs to kind = 'quadratic', 'constant', 'table', 'induction', 'dc' or 'inverter'",
        ),
        ("frequency = -377", "frequency = -377 is out of range; allowed: > 0 [rad/s]"),
        (
            "supply_times = 1, 2 supply_factors = 0, 1",
            "supply_factors(1) = 0; allowed: > 0, as the motor is disconnected before supply_times(1) = 1",
        ),
        (
            "supply_times = 1, 2 supply_factors = 0.5, 1 supply_ramps = 3, 0",
            "supply_ramps(1) = 3 from supply_times(1) = 1 ends after supply_times(2) = 2; allowed: ramps that end before",
        ),
        ("supply_times = 1, 2", "supply_factors is missing; needed: 2 values, one for each of supply_times\n"),
        ("supply_ramps = 1, 2", "supply_ramps needs supply_times"),
        (
            "supply_times = 1, 2 supply_factors = 1",
            "supply_factors has 1 value and supply_times has 2 values; needed: as many of each",
        ),
        ("stator_leakage = 0.002", "stator_leakage and stator_reactance are both given; allowed: one of them\n"),
    ],
)
def test_values_that_do_not_fit_are_refused(nocdyn, keys, complaint):
    text = machine("3 hp")
    name = keys.split(" ")[0]
    for given in ("poles = 4", "voltage = 220", "frequency_hz = 60"):
        if given.startswith(name):
            text = text.replace(given, "")
    (nocdyn.folder / "machine.nml").write_text(text.replace("kind = 'induction_dq'", f"kind = 'induction_dq' {keys}"))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert f"machine.nml:2: &motor 'mains': {complaint}" in outcome.stderr


RATED = """&body name = 'rotor' inertia = 20 /
&motor name = 'mains' body = 'rotor' kind = 'induction_dq' voltage = 6600 frequency_hz = 50 poles = 4
  rated_power = 630e3 rated_speed_rpm = 1489.5 efficiency = 0.959 power_factor = 0.83 breakdown_ratio = 2.55 {keys} /
&load name = 'fan' body = 'rotor' quadratic = 0.16601154 /
&run t_end = 2.0 rtol = 1e-9 /
&output interval = 0.01 /
"""


def test_a_circuit_from_rated_values_is_noted(nocdyn):
    run(nocdyn, RATED.format(keys="starting_torque = 1.22 starting_current = 5"), "output.interval=0.001")
    notes = nocdyn.summary("out")["machine"]["notes"]
    assert notes == [
        "motor 'mains' has from its rated values, with 40 % of the losses outside of the rotor in the stator winding and equal "
        "leakages: stator_resistance = 0.643653, rotor_resistance = 0.414587, stator_reactance = rotor_reactance = 5.97825, "
        "mutual_reactance = 129.174 Ohm; its starting torque is 0.189 of the rated one, its starting current 4.69",
        "motor 'mains': starting_torque = 1.22, but 0.189 with the circuit, which knows no skin effect in the bars; "
        "cages = 2 fits a second cage",
    ]
    text = run(nocdyn, RATED.format(keys=""), command="check").stdout
    assert text.count("note: ") == 1 and f"  note: {notes[0]}\n" in text


def test_the_circuit_of_a_note_gives_the_motion_of_the_rated_values(nocdyn):
    run(nocdyn, RATED.format(keys=""))
    table = nocdyn.values()
    rated = RATED[RATED.index("  rated_power") : RATED.index("{keys}")]
    circuit = (
        "stator_resistance = 0.643653 rotor_resistance = 0.414587 "
        "stator_reactance = 5.97825 rotor_reactance = 5.97825 mutual_reactance = 129.174 "
    )
    run(nocdyn, RATED.replace(rated, circuit).format(keys=""))
    same = nocdyn.values()
    for key in ("omega_rotor", "torque_mains", "current_mains"):
        assert np.abs(table[key] - same[key]).max() < 1e-4 * np.abs(table[key]).max()


def test_a_motor_turns_with_its_rated_speed_at_its_rated_torque(nocdyn):
    text = run(nocdyn, RATED.format(keys=""), command="equilibrium").stdout
    speed = next(float(line.split()[-1]) for line in text.splitlines() if "omega_rotor" in line)
    assert speed * 30 / np.pi == pytest.approx(1489.5, rel=1e-6)


def test_a_sweep_over_rated_values_finds_a_circuit_for_each(nocdyn):
    text = (
        RATED.format(keys="")
        + """
&sweep design = 'grid' /
&vary target = 'motor.mains.breakdown_ratio' low = 2.0 high = 3.0 count = 3 /
&record quantity = 'torque_mains' statistic = 'max' /
"""
    )
    run(nocdyn, text, command="sweep")
    with open(nocdyn.folder / "swept/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for ratio, row in zip((2.0, 2.5, 3.0), rows, strict=True):
        run(nocdyn, RATED.format(keys=""), f"motor.mains.breakdown_ratio={ratio}")
        largest = nocdyn.summary("out")["columns"]["torque_mains [N m]"]["max"]
        assert float(row["torque_mains_max [N m]"]) == pytest.approx(largest, rel=1e-7)


@pytest.mark.parametrize(
    "setting, complaint",
    [
        ("efficiency=0.995", "efficiency = 0.995; allowed: < 0.993, as the slip takes 0.007 of the power of the air gap"),
        ("breakdown_ratio=80", "breakdown_ratio = 80; allowed: <= 26.6673 with these losses, slip and power factor"),
        ("breakdown_ratio=1.05", "breakdown_ratio = 1.05; allowed: >= 1.0763 with these losses, slip and power factor"),
        ("breakdown_ratio=1", "breakdown_ratio = 1 is out of range; allowed: > 1"),
        ("power_factor=1", "power_factor = 1 leaves no reactive power to magnetise the motor; allowed: smaller values"),
        ("power_factor=1.1", "power_factor = 1.1 is out of range; allowed: > 0 to 1"),
        (
            "rated_speed_rpm=1500",
            "rated_speed_rpm = 1500; allowed: below 1500 and above 750 [rpm], the synchronous speed with poles = 4 and half "
            "of it",
        ),
    ],
)
def test_rated_values_without_a_circuit_are_refused(nocdyn, setting, complaint):
    name, value = setting.split("=")
    text = re.sub(rf"{name} = [0-9.]+", f"{name} = {value}", RATED.format(keys=""))
    (nocdyn.folder / "machine.nml").write_text(text)
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == f"nocdyn: machine.nml:3: &motor 'mains': {complaint}\n"


def test_poles_that_do_not_fit_the_rated_speed_are_refused(nocdyn):
    (nocdyn.folder / "machine.nml").write_text(RATED.format(keys="").replace("poles = 4", "poles = 6"))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert "rated_speed_rpm = 1489.5; allowed: below 1000 and above 500 [rpm]" in outcome.stderr


def test_a_circuit_and_rated_values_exclude_each_other(nocdyn):
    (nocdyn.folder / "machine.nml").write_text(RATED.format(keys="rotor_resistance = 0.4"))
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert "rotor_resistance and rated_power are both given; allowed: one of them" in outcome.stderr


def test_automatic_rows_show_the_swings_with_the_mains_after_switching_on(nocdyn):
    text = machine("3 hp", run="", rest="").replace("t_end = 2.0", "t_end = 20").replace("&output interval = 0.001 /\n", "")
    outcome = run(nocdyn, text)
    assert "note: 12001 rows for motor 'mains' with 60 Hz, as &output gives no interval" in outcome.stdout
    torque = nocdyn.values()["torque_mains"]
    assert torque.max() == pytest.approx(LARGEST["3 hp"][1], rel=0.05)
    outcome = run(nocdyn, text, "run.start=equilibrium", "motor.mains.frequency_hz=60")
    assert ", 1001 rows, " in outcome.stdout  # nothing swings
    outcome = run(nocdyn, text, "output.interval=0.02")
    assert "do not show the vibration by motor 'mains', up to 60 Hz" in outcome.stdout
