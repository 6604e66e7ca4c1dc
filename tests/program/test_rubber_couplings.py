"""Rubber couplings by their data sheets, against iterations with numpy that know nothing of the program."""

import csv
import os
import random

import numpy as np
import pytest

MACHINES = int(os.environ.get("NOCDYN_RANDOM_MACHINES", "4"))
EXACT = 1e-9  # of the fixed points, relative
AMBIENT = 30.0

MACHINE = """\
&body name = 'engine' inertia = {inertias[0]!r} speed = 30 /
&body name = 'gear' inertia = {inertias[1]!r} /
&body name = 'propeller' inertia = {inertias[2]!r} /
&coupling name = 'rubber' bodies = 'engine', 'gear' stiffness = {stiffness!r} relative_damping = {psi!r} {rubber} /
&coupling name = 'shaft' bodies = 'gear', 'propeller' stiffness = {shaft!r} damping = {damping!r} /
&load name = 'water' body = 'propeller' viscous = {load!r} /
&excitation name = 'gas' body = 'engine' kind = 'orders' orders = {orders} amplitudes = {amplitudes} phases = {phases} /
&response body = 'engine' speed = 10, 60 count = 11 /
&run t_end = 1 /
"""
TABLES = {
    "torque": ([0.0, 1000.0, 3000.0], [1.0, 1.3, 2.1], [1.0, 0.95, 0.9]),
    "amplitude": ([0.0, 100.0, 1000.0], [1.1, 1.0, 0.8], [0.9, 1.0, 1.15]),
    "frequency": ([0.0, 60.0, 600.0], [0.95, 1.0, 1.2], [1.05, 1.0, 0.9]),
    "temperature": ([0.0, 30.0, 60.0, 100.0], [1.1, 1.0, 0.86, 0.72], [1.1, 1.0, 0.85, 0.7]),
}


def random_machine(dice):
    return {
        "inertias": [10 ** dice.uniform(0.5, 1.5) for _ in range(3)],
        "stiffness": 10 ** dice.uniform(3.5, 4.5),
        "psi": dice.uniform(0.6, 1.4),
        "shaft": 10 ** dice.uniform(5, 6),
        "damping": dice.uniform(0, 100),
        "load": dice.uniform(10, 40),
        "amplitudes": [dice.uniform(200, 900) for _ in range(3)],
        "orders": [0.5, 1.0, 3.0],
        "phases": [dice.uniform(0, 6) for _ in range(3)],
    }


def text_of(machine, rubber):
    lists = {key: ", ".join(map(repr, machine[key])) for key in ("orders", "amplitudes", "phases")}
    return MACHINE.format(**(machine | lists), rubber=rubber)


def table_keys(*names):
    return " ".join(
        f"table_{name} = {', '.join(map(repr, TABLES[name][0]))} {name}_stiffness = {', '.join(map(repr, TABLES[name][1]))} "
        f"{name}_damping = {', '.join(map(repr, TABLES[name][2]))}\n"
        for name in names
    )


def factors(names, name, x):
    return [np.interp(x, TABLES[name][0], y) if name in names else 1.0 for y in TABLES[name][1:]]


def torque_stiffness(names, stiffness, torque):
    """Straight over the twist between the points: its square is straight over the torque."""
    if "torque" not in names:
        return stiffness
    return stiffness * np.sqrt(np.interp(torque, TABLES["torque"][0], np.square(TABLES["torque"][1])))


def lines_at(machine, names, speed, temperature, amplitude):
    """Amplitudes of the moment of the rubber coupling by order, and the power that it loses."""
    mean = machine["load"] * speed
    moments, power = [], 0.0
    for order, torque in zip(machine["orders"], machine["amplitudes"], strict=True):
        omega = order * speed
        by = [
            factors(names, "temperature", temperature),
            factors(names, "amplitude", amplitude),
            factors(names, "frequency", omega),
        ]
        k = torque_stiffness(names, machine["stiffness"], mean) * np.prod([one[0] for one in by])
        psi = machine["psi"] * factors(names, "torque", mean)[1] * np.prod([one[1] for one in by])
        rubber = k * (1 + 1j * psi / (2 * np.pi))
        shaft = machine["shaft"] + 1j * omega * machine["damping"]
        load = 1j * omega * machine["load"]
        matrix = np.array([[rubber, -rubber, 0], [-rubber, rubber + shaft, -shaft], [0, -shaft, shaft + load]])
        x = np.linalg.solve(matrix - omega**2 * np.diag(machine["inertias"]), [torque, 0, 0])
        moments.append(abs(rubber * (x[1] - x[0])))
        power += 0.5 * omega * rubber.imag * abs(x[1] - x[0]) ** 2
    return np.array(moments), power


def settled(machine, names, speed, resistance):
    """The condition that a cold coupling reaches, by small steps."""
    temperature, amplitude = AMBIENT, 0.0
    for _ in range(4000):
        moments, power = lines_at(machine, names, speed, temperature, amplitude)
        change = [AMBIENT + resistance * power - temperature, np.sqrt(sum(moments**2)) - amplitude]
        temperature += 0.3 * change[0]
        amplitude += 0.3 * change[1]
        if abs(change[0]) < 1e-11 and abs(change[1]) < 1e-10 * max(1, amplitude):
            break
    return temperature, *lines_at(machine, names, speed, temperature, amplitude)


def respond(nocdyn, text):
    outcome = nocdyn.done(text, "-q", command="response")
    assert outcome.stderr == ""
    return nocdyn.values(name="response.csv"), nocdyn.values(name="response_orders.csv")


@pytest.mark.parametrize("seed", range(MACHINES))
@pytest.mark.parametrize("names", [(), ("torque",), ("amplitude",), ("frequency",), tuple(TABLES)])
def test_stiffness_and_damping_are_those_of_the_tables(nocdyn, seed, names):
    machine = random_machine(random.Random(seed))
    rubber = f"kind = 'rubber' {table_keys(*names)}"
    if "temperature" in names:
        rubber += f"ambient_temperature = {AMBIENT}"
    table, orders = respond(nocdyn, text_of(machine, rubber))
    for i, speed in enumerate(table["omega_engine"]):
        _, moments, power = settled(machine, names, speed, 0.0)
        assert orders["moment_rubber"][3 * i : 3 * i + 3] == pytest.approx(moments, rel=EXACT)
        assert table["heat_rubber"][i] == pytest.approx(power, rel=EXACT)


@pytest.mark.parametrize("seed", range(MACHINES))
@pytest.mark.parametrize("names", [("temperature",), tuple(TABLES)])
def test_the_temperature_is_the_fixed_point_of_heat_and_stiffness(nocdyn, seed, names):
    machine = random_machine(random.Random(seed))
    rubber = f"kind = 'rubber' {table_keys(*names)} ambient_temperature = {AMBIENT} power_loss = 500 power_loss_rise = 70"
    table, orders = respond(nocdyn, text_of(machine, rubber))
    assert max(table["temperature_rubber"]) > AMBIENT + 5
    for i, speed in enumerate(table["omega_engine"]):
        temperature, moments, power = settled(machine, names, speed, 70 / 500)
        assert table["temperature_rubber"][i] == pytest.approx(temperature, rel=EXACT)
        assert table["heat_rubber"][i] == pytest.approx(power, rel=EXACT)
        assert table["heat_rubber"][i] * 70 / 500 == pytest.approx(table["temperature_rubber"][i] - AMBIENT, rel=1e-8)
        assert orders["moment_rubber"][3 * i : 3 * i + 3] == pytest.approx(moments, rel=EXACT)


@pytest.mark.parametrize("command", ["response", "campbell", "modes"])
def test_without_tables_rubber_is_the_coupling_of_its_numbers(nocdyn, command):
    machine = random_machine(random.Random(3))
    results = []
    for kind in ("", "kind = 'rubber'", "kind = 'rubber' table_torque = 0, 10 torque_stiffness = 1, 1"):
        nocdyn.done(text_of(machine, f"damping_frequency = 20 {kind}"), command=command)
        results.append({path.name: path.read_text() for path in (nocdyn.folder / "out").glob("*.csv")})
    assert results[0]
    assert results[1] == results[0]
    for name in results[0]:
        first, last = (np.genfromtxt(one[name].splitlines(), delimiter=",", skip_header=1) for one in (results[0], results[2]))
        assert np.nan_to_num(last) == pytest.approx(np.nan_to_num(first), rel=1e-9, abs=1e-9 * np.nanmax(abs(first)))


RUN = """\
&body name = 'engine' inertia = 5.0 speed = 20 /
&body name = 'machine' inertia = 8.0 /
&coupling name = 'rubber' bodies = 'engine', 'machine' kind = 'rubber' stiffness = 4000 relative_damping = 1.0
  damping_frequency = 40 {tables} /
&load name = 'work' body = 'machine' constant = 1500 viscous = 20 /
&motor name = 'drive' body = 'engine' a = 1900 b = 0 c = 0 /
&excitation name = 'gas' body = 'engine' kind = 'orders' orders = 2 amplitudes = 2.0 phases = 0.3 /
&response body = 'engine' speed = 20 /
&run t_end = 60 start = 'equilibrium' rtol = 1e-9 atol = 1e-11 /
&output points = 60001 columns = 'total_moment_rubber' /
"""


def test_a_run_has_the_stiffness_and_damping_of_its_mean_torque(nocdyn):
    """At 20 rad/s order 2 has the frequency of the damping; the torque is 1900 N m, the vibration small."""
    text = RUN.format(tables=table_keys("torque").replace("0.95, 0.9\n", "1.0, 1.0\n"))
    nocdyn.done(text)
    moment = nocdyn.values()["total_moment_rubber"][50000:]
    swing = (max(moment) - min(moment)) / 2
    nocdyn.done(text, command="response")
    table = nocdyn.values(name="response.csv")
    assert np.mean(moment) == pytest.approx(table["mean_total_moment_rubber"][0], rel=1e-5)
    assert swing == pytest.approx(table["half_range_total_moment_rubber"][0], rel=1e-4)


def test_a_run_says_what_it_leaves_out_with_its_size(nocdyn):
    tables = table_keys("amplitude", "temperature") + f"ambient_temperature = {AMBIENT} thermal_resistance = 0.1"
    outcome = nocdyn("check", nocdyn.write("machine.nml", RUN.format(tables=tables)))
    assert outcome.returncode == 0
    assert "by its temperature its stiffness may be 72 to 110 % of this, its relative damping 70 to 110 %" in outcome.stdout
    assert "by its amplitude its stiffness may be 80 to 110 % of this, its relative damping 90 to 115 %" in outcome.stdout


def test_temperatures_beyond_the_table_are_announced(nocdyn):
    machine = random_machine(random.Random(1))
    rubber = f"kind = 'rubber' {table_keys('temperature')} ambient_temperature = {AMBIENT} thermal_resistance = 1"
    outcome = nocdyn("response", nocdyn.write("machine.nml", text_of(machine, rubber)), "--out", "out")
    assert "is heated by its losses from 30 to " in outcome.stdout
    assert (
        "its stiffness is 72 % of the cold one, and its relative damping 70 %, as at 100 degC, where its table ends"
        in outcome.stdout
    )


def test_the_stiffness_of_rubber_varies_in_sweeps(nocdyn):
    machine = random_machine(random.Random(2))
    text = text_of(machine, f"kind = 'rubber' {table_keys('torque')} ambient_temperature = {AMBIENT} thermal_resistance = 0.1")
    values = [machine["stiffness"] * factor for factor in (0.8, 1.0, 1.2)]
    vary = f"&vary target = 'coupling.rubber.stiffness' low = {values[0]!r} high = {values[2]!r} count = 3 /\n"
    sweep = f"&sweep design = 'grid' /\n{vary}"
    sweep += "&record response = 'moment_rubber' statistic = 'peak' /\n"
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text + sweep), "--out", "out", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "out/sweep.csv", newline="") as file:
        peaks = [float(row[next(label for label in row if "peak" in label)]) for row in csv.DictReader(file)]
    for value, peak in zip(values, peaks, strict=True):
        nocdyn.done(text, "--set", f"coupling.rubber.stiffness={value!r}", command="response")
        assert max(nocdyn.values(name="response.csv")["half_range_moment_rubber"]) == pytest.approx(peak, rel=1e-6)
