"""Damage per hour of forced oscillations: closed forms, another counting of cycles, and the settled motion of a run."""

import csv
import json
import math

import pytest
import rainflow

BODIES = "&body name = 'engine' inertia = 2.0 speed = 100 /\n&body name = 'fan' inertia = 5.0 speed = 100 /\n"
COUPLING = "&coupling name = 'c' bodies = 'engine', 'fan' stiffness = 4.0e4 damping = 30 diameter = 0.06 /\n"
TORQUES = (
    "&motor name = 'drive' body = 'engine' kind = 'constant' torque = 200 /\n&load name = 'air' body = 'fan' quadratic = 0.02 /\n"
)
ORDER = "&excitation name = 'order' body = 'engine' kind = 'orders' orders = 2 amplitudes = 150 /\n"
ORDERS = (
    "&excitation name = 'orders' body = 'engine' kind = 'orders' orders = 1, 2, 4.5 amplitudes = 60, 150, 80 phases = 0, 1, 2 /\n"
)
RESPONSE = "&response body = 'engine' speed = 40, 160 count = 13 /\n&run t_end = 1 /\n"
MOMENT = "&fatigue name = 'life' coupling = 'c' reference_moment = 500 reference_cycles = 1.0e6 slope = 5 /\n"
STRESS = "&fatigue name = 'life' coupling = 'c' reference_stress = 5.0e6 reference_cycles = 1.0e6 slope = 5 /\n"
MACHINE = BODIES + COUPLING + TORQUES + RESPONSE


def respond(nocdyn, text, *words):
    """The rows of response.csv and of response_orders.csv, and what response.json says of the damage."""
    nocdyn.write("m.nml", text)
    outcome = nocdyn("response", "m.nml", "--out", "out", *words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    tables = []
    for name in ("response.csv", "response_orders.csv"):
        with open(nocdyn.folder / "out" / name, newline="") as file:
            tables.append([{key: float(cell) for key, cell in row.items()} for row in csv.DictReader(file)])
    return *tables, json.loads((nocdyn.folder / "out/response.json").read_text())["fatigue"], outcome.stdout


def damage_of(values, reference, slope=5, cycles=1.0e6, strength=math.inf):
    """Of one period, from its largest value on: by the package rainflow."""
    first = max(range(len(values)), key=values.__getitem__)
    values = [*values[first:], *values[: first + 1]]
    return sum(
        count * (span / 2 / (1 - abs(mean) / strength) / reference) ** slope / cycles
        for span, mean, count, _, _ in rainflow.extract_cycles(values)
    )


def synthesis(rows, column, speed, mean, turns, samples):
    """The sum of the lines of a speed over some turns of the engine."""
    lines = [row for row in rows if row["omega_engine [rad/s]"] == speed]
    unit = column.split(" ", 1)[0]
    times = [i * turns * 2 * math.pi / speed / samples for i in range(samples)]
    return [
        mean
        + sum(
            row[column] * math.cos(2 * math.pi * row["frequency [Hz]"] * t + math.radians(row[f"phase_{unit} [deg]"]))
            for row in lines
        )
        for t in times
    ]


def test_one_order_has_one_cycle_in_each_of_its_periods(nocdyn):
    rows, _, (item,), text = respond(nocdyn, MACHINE + ORDER + MOMENT)
    for row in rows:
        per_hour = 3600 * 2 * row["omega_engine [rad/s]"] / (2 * math.pi)
        expected = per_hour * (row["half_range_total_moment_c [N m]"] / 500) ** 5 / 1.0e6
        assert row["damage_per_hour_life [1/h]"] == pytest.approx(expected, rel=1e-9)
    worst = max(rows, key=lambda row: row["damage_per_hour_life [1/h]"])
    assert item["largest_damage_per_hour"] == worst["damage_per_hour_life [1/h]"] > 0
    assert item["speed_rad_s"] == worst["omega_engine [rad/s]"]
    assert item["quantity"] == "total_moment_c [N m]"
    assert "damage_of_profile" not in item
    assert f"fatigue 'life': damage per hour up to {item['largest_damage_per_hour']:.4g}" in text


@pytest.mark.parametrize("mean_stress", [False, True])
def test_several_orders_have_the_cycles_of_their_synthesis(nocdyn, mean_stress):
    fatigue = STRESS.replace("slope", "mean_stress = 'goodman' ultimate_stress = 2.0e7 slope") if mean_stress else STRESS
    rows, orders, _, _ = respond(nocdyn, MACHINE + ORDERS + fatigue)
    modulus = math.pi * 0.06**3 / 16
    for row in rows[::4]:
        speed = row["omega_engine [rad/s]"]
        mean = row["mean_total_moment_c [N m]"] / modulus
        values = synthesis(orders, "stress_c [Pa]", speed, mean, turns=2, samples=20000)
        damage = damage_of(values, 5.0e6, strength=2.0e7 if mean_stress else math.inf)
        expected = damage * 3600 * speed / (2 * 2 * math.pi)
        assert row["damage_per_hour_life [1/h]"] == pytest.approx(expected, rel=1e-5)


def test_the_table_of_a_file_counts_in_a_response(nocdyn):
    nocdyn.write("curve.txt", "1e4 400\n1e6 120\n1e8 60\n")
    fatigue = "&fatigue name = 'life' coupling = 'c' moment_file = 'curve.txt' extrapolation = 'constant' /\n"
    rows, _, _, _ = respond(nocdyn, MACHINE + ORDER + fatigue)
    cycles, half_ranges = [1e4, 1e6, 1e8], [400, 120, 60]
    found = set()
    for row in rows:
        level = row["half_range_total_moment_c [N m]"]
        i = 0 if level > 120 else 1
        slope = math.log(cycles[i] / cycles[i + 1]) / math.log(half_ranges[i] / half_ranges[i + 1])
        life = cycles[i] * (level / half_ranges[i]) ** slope if level > 60 else math.inf
        per_hour = 3600 * 2 * row["omega_engine [rad/s]"] / (2 * math.pi)
        assert row["damage_per_hour_life [1/h]"] == pytest.approx(per_hour / life, rel=1e-9)
        found.add("above" if level > 400 else "below" if level <= 60 else "between")
    assert found == {"above", "below", "between"}


def test_lines_without_a_common_period(nocdyn):
    """The mean over many periods: 1000 of the slower line here, as many in the reference."""
    mains = "&excitation name = 'mains' body = 'fan' amplitude = 400 frequency_hz = 23.4567 /\n"
    rows, orders, _, _ = respond(nocdyn, MACHINE + ORDER + mains + MOMENT.replace("slope = 5", "slope = 3"))
    for row in rows[::6]:
        speed = row["omega_engine [rad/s]"]
        turns = 500
        values = synthesis(orders, "total_moment_c [N m]", speed, row["mean_total_moment_c [N m]"], turns, samples=256 * turns)
        expected = damage_of(values, 500, slope=3) * 3600 * speed / (turns * 2 * math.pi)
        assert row["damage_per_hour_life [1/h]"] == pytest.approx(expected, rel=0.01)


def test_the_settled_motion_of_a_run_has_the_damage_of_the_response(nocdyn):
    """Amplitudes so small that the orders do not modulate each other; the run counts half cycles at its ends."""
    machine = MACHINE + ORDERS.replace("60, 150, 80", "0.6, 1.5, 0.8") + MOMENT.replace("500", "5")
    run = nocdyn.write("run.nml", machine.replace("t_end = 1 ", "t_end = 33 rtol = 1e-9 atol = 1e-11 start = 'equilibrium' "))
    settings = ["--set", "output.extremes_from=13"]
    assert nocdyn("run", run, "--out", "run", "--quiet", *settings).returncode == 0
    damage = nocdyn.summary("run")["fatigue"][0]["damage"]
    rows, _, _, _ = respond(nocdyn, machine.replace("speed = 40, 160 count = 13", "speed = 99, 101 count = 3"))
    (row,) = [row for row in rows if row["omega_engine [rad/s]"] == 100]
    assert damage * 3600 / 20 == pytest.approx(row["damage_per_hour_life [1/h]"], rel=0.02)


def test_a_profile_of_speeds_and_hours(nocdyn):
    profile = "profile_speeds_rpm = 700, 1033, 850.5 profile_hours = 100, 40, 2000 slope"
    rows, _, (item,), text = respond(nocdyn, MACHINE + ORDERS + MOMENT.replace("slope", profile))
    rates = {round(row["omega_engine [rad/s]"] * 30 / math.pi, 9): row["damage_per_hour_life [1/h]"] for row in rows}
    assert item["profile_damage_per_hour"] == [rates[700], rates[1033], rates[850.5]]
    damage = 100 * rates[700] + 40 * rates[1033] + 2000 * rates[850.5]
    assert item["damage_of_profile"] == pytest.approx(damage, rel=1e-12)
    assert item["hours_to_failure"] == pytest.approx(2140 / damage, rel=1e-12)
    assert f"damage of the profile of 2140 h: {damage:.4g}, the life is" in text


def test_the_signals_of_shafts_meshes_and_gears(nocdyn):
    wheel = BODIES + "&body name = 'wheel' inertia = 0.5 /\n" + TORQUES + ORDER + RESPONSE
    shaft = "&shaft name = 'c' bodies = 'engine', 'wheel' lengths = 0.6, 0.4 diameters = 0.06, 0.05\n"
    shaft += "shear_modulus = 8.0e10 nodes = 4 density = 7850 damping_ratio = 0.02 damping_frequency_hz = 20 /\n"
    teeth = {
        "gear": ("&gear name = 'g' bodies = 'wheel', 'fan' radii = 0.1, 0.2 /\n", "reaction_g [N]"),
        "mesh": (
            "&mesh name = 'g' bodies = 'wheel', 'fan' radii = 0.1, 0.2 stiffness = 1.0e8 damping = 1.0e4 /\n",
            "force_g [N]",
        ),
    }
    for kind, (group, column) in teeth.items():
        fatigue = f"&fatigue name = 'teeth' {kind} = 'g' reference_force = 9.0e3 reference_cycles = 1.0e6 slope = 5 /\n"
        fatigue += STRESS.replace("coupling", "shaft") + MOMENT.replace("coupling", "shaft").replace("life", "moment")
        machine = wheel.replace("'fan' inertia = 5.0 speed = 100", "'fan' inertia = 5.0") + shaft + group + fatigue
        rows, _, items, _ = respond(nocdyn, machine)
        assert [item["quantity"] for item in items] == [column, "stress_c [Pa]", "total_moment_c_1 [N m]"]
        for row in rows:
            per_hour = 3600 * 2 * row["omega_engine [rad/s]"] / (2 * math.pi) / 1.0e6
            moment = max(row["half_range_total_moment_c_1 [N m]"], row["half_range_total_moment_c_2 [N m]"])
            half_ranges = [row[f"half_range_{column}"] / 9.0e3, row["half_range_stress_c [Pa]"] / 5.0e6, moment / 500]
            for name, ratio in zip(["teeth", "life", "moment"], half_ranges):
                assert row[f"damage_per_hour_{name} [1/h]"] == pytest.approx(per_hour * ratio**5, rel=1e-9)


def test_no_damage_below_the_endurance_limit_and_means_beyond_the_strength(nocdyn):
    rows, _, (item,), text = respond(nocdyn, MACHINE + ORDER + MOMENT.replace("slope", "endurance_limit = 1e6 slope"))
    assert all(row["damage_per_hour_life [1/h]"] == 0 for row in rows)
    assert "fatigue 'life': no damage at any speed\n" in text
    weak = STRESS.replace("slope", "mean_stress = 'soderberg' yield_stress = 1.0e5 slope")
    _, _, (item,), text = respond(nocdyn, MACHINE + ORDER + weak)
    assert item["mean_exceeds_strength"] and "; the mean exceeds the strength\n" in text


@pytest.mark.parametrize(
    "keys, message",
    [
        (
            "profile_speeds = 100 profile_hours = 1, 2",
            "profile_hours has 2 values and profile_speeds has 1 value; needed: as many of each",
        ),
        ("profile_speeds = 100", "profile_hours is missing; needed: 1 value, one for each of profile_speeds"),
        ("profile_hours = 100", "profile_speeds is missing; needed: 1 value, one for each of profile_hours"),
        ("profile_speeds = 100 profile_hours = -1", "profile_hours(1) = -1 is out of range; allowed: > 0 [h]"),
        (
            "profile_speeds_rpm = 600, 1600 profile_hours = 1, 2",
            "profile_speeds_rpm(2) = 1600 is outside of the speeds of &response; "
            "allowed: 381.97186342055 to 1527.8874536822 [rpm]",
        ),
    ],
)
def test_wrong_profiles_are_refused(nocdyn, keys, message):
    text = MACHINE + ORDER + MOMENT.replace("slope", f"{keys} slope")
    nocdyn.write("m.nml", text)
    for command in ("response", "check", "run"):
        outcome = nocdyn(command, "m.nml")
        assert outcome.returncode == 2
        assert outcome.stderr == f"nocdyn: m.nml:{text.count(chr(10))}: &fatigue 'life': {message}\n"


def test_a_profile_without_a_response_is_refused(nocdyn):
    text = BODIES + COUPLING + TORQUES + MOMENT.replace("slope", "profile_speeds = 100 profile_hours = 1 slope")
    nocdyn.write("m.nml", text + "&run t_end = 1 /\n")
    outcome = nocdyn("run", "m.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == (
        "nocdyn: m.nml:6: &fatigue 'life': profile_speeds are those of the body of &response; required: a group &response\n"
    )
