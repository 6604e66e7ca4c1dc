"""The example machines with load cases do what an independent computation of one case of each says."""

import csv
import json
from math import pi

import pytest
from conftest import SOURCE

EXAMPLES = SOURCE / "input/examples"

# By load_case_references.py, which prints these tables. Values at the end of the load case unless said.
REFERENCE = {
    "reciprocating_compressor": {
        "phi_rotor [rad]": 123.7928097323,
        "omega_rotor [rad/s]": 62.15716353866,
        "omega_throw_4 [rad/s]": 62.40273872346,
        "total_moment_rubber [N m]": -12438.10080709,
        "total_moment_crank_2 [N m]": 3046.38934288,
        "torque_mains [N m]": 13236.17162284,
        "max torque_mains [N m]": 77044.54537147,
        "min total_moment_rubber [N m]": -44355.06329892,
        "max total_moment_rubber [N m]": 3182.090146454,
        "min total_moment_crank_2 [N m]": -22321.21317844,
        "damage life_of_rubber": 1.995045328043e-06,
        "damage life_of_crank": 5.634093036024e-12,
    },
    "generator_set": {
        "phi_rotor [rad]": 131.8521511382,
        "omega_ring [rad/s]": 86.89430439854,
        "omega_cylinder_1 [rad/s]": 86.35577012845,
        "omega_rotor [rad/s]": 86.79282208505,
        "omega_exciter [rad/s]": 86.7532760218,
        "total_moment_rubber [N m]": 365.3553861856,
        "torque_fuel [N m]": 0,
        "min total_moment_rubber [N m]": -19797.70498479,
        "max total_moment_rubber [N m]": 1777.562766507,
        "min total_moment_tail [N m]": -8246.129734743,
        "min total_moment_crank_6 [N m]": -33607.78551925,
        "min torque_two_phase [N m]": -169931.2955401,
        "damage life_of_shaft": 1.924456664471e-12,
        "damage life_of_tail": 2.011542586389e-05,
    },
    "ice_propeller": {
        "phi_motor [rad]": 42.19974981779,
        "omega_motor [rad/s]": 16.14179649066,
        "omega_flange [rad/s]": 16.10518917393,
        "omega_propeller [rad/s]": 16.09358894423,
        "twist_intermediate [rad]": -0.04459382324696,
        "twist_tail [rad]": -0.01454895945619,
        "torque_converter [N m]": 442800.7934316,
        "max twist_intermediate [rad]": -0.03152763884933,
        "min twist_intermediate [rad]": -0.07913403146802,
        "min twist_tail [rad]": -0.02588284943699,
        "max omega_motor [rad/s]": 16.14179649066,
        "min omega_motor [rad/s]": 10.79111555394,
        "damage life_of_intermediate": 6.196390365098e-10,
        "damage life_of_tail": 4.588526980259e-11,
    },
    "vfd_compressor": {
        "phi_motor [rad]": 376.9918015837,
        "omega_motor [rad/s]": 188.4870445449,
        "omega_wheel [rad/s]": 188.4958473579,
        "omega_compressor [rad/s]": -991.124507721,
        "total_moment_disc [N m]": -7545.809399958,
        "total_moment_quill_1 [N m]": 1435.150185805,
        "torque_drive [N m]": 7550.859710311,
        "min total_moment_disc [N m]": -7589.517230771,
        "max total_moment_quill_1 [N m]": 1442.296258656,
    },
}
CASES = {
    "reciprocating_compressor": "reconnection",
    "generator_set": "two_phase",
    "ice_propeller": "case_2",
    "vfd_compressor": "full_load",
}
FIRST = dict.fromkeys(CASES, "full_load") | {"ice_propeller": "open_water"}  # of steady speeds

# By the same program: natural frequencies without damping and motors [Hz], the lowest first; of the propulsion line the first,
FREQUENCIES = {
    "reciprocating_compressor": [11.71974967133, 83.66900520143, 223.1839256988, 363.4982225055, 426.9024171191],
    "generator_set": [
        4.510207144886,
        63.54220816766,
        119.5165927616,
        167.5687315958,
        208.1928974742,
        266.3187920614,
        350.9550201307,
        415.7471469322,
        456.3619599926,
        587.7185774592,
    ],
    "ice_propeller": [4.287384633366],
    "vfd_compressor": [34.28781824307, 229.6461282824],
}

# speeds at which the torques balance,
STEADY_SPEEDS = {
    "reciprocating_compressor": ("omega_flywheel [rad/s]", 62.00483495648),
}

# and amplitudes of moments [N m] by order and speed [rpm].
RESPONSES = {
    "reciprocating_compressor": {
        (1, 590): {
            "total_moment_rubber": 867.6725144364,
            "total_moment_shaft": 2383.643492147,
            "total_moment_crank_1": 1924.991685694,
            "total_moment_crank_2": 1801.156387416,
            "total_moment_crank_3": 899.8304022238,
        },
        (2, 590): {
            "total_moment_rubber": 55.79627686325,
            "total_moment_shaft": 241.4186094998,
            "total_moment_crank_1": 4553.163549751,
            "total_moment_crank_2": 8843.217313225,
            "total_moment_crank_3": 4440.51173573,
        },
        (4, 590): {
            "total_moment_rubber": 39.23958640589,
            "total_moment_shaft": 1037.152320058,
            "total_moment_crank_1": 803.6112327493,
            "total_moment_crank_2": 552.8619978858,
            "total_moment_crank_3": 278.0977425328,
        },
        (8, 590): {
            "total_moment_rubber": 24.95309635503,
            "total_moment_shaft": 2848.283365377,
            "total_moment_crank_1": 2496.182561785,
            "total_moment_crank_2": 1880.452594223,
            "total_moment_crank_3": 992.5828360122,
        },
        (3, 235): {
            "total_moment_rubber": 1125.270077825,
            "total_moment_shaft": 1603.692834197,
            "total_moment_crank_1": 1255.356181405,
            "total_moment_crank_2": 1133.653132981,
            "total_moment_crank_3": 564.1950952234,
        },
        (2, 350): {
            "total_moment_rubber": 50.51939758186,
            "total_moment_shaft": 74.47853937436,
            "total_moment_crank_1": 3612.438361647,
            "total_moment_crank_2": 7101.854112901,
            "total_moment_crank_3": 3534.536776656,
        },
        (9, 550): {
            "total_moment_rubber": 49.35279625025,
            "total_moment_shaft": 6209.38113427,
            "total_moment_crank_1": 5611.749701377,
            "total_moment_crank_2": 4364.675476628,
            "total_moment_crank_3": 2316.581020604,
        },
    },
    "generator_set": {
        (4.5, 840): {
            "total_moment_silicone": 1131.803753397,
            "total_moment_crank_0": 2211.626766756,
            "total_moment_crank_1": 7519.83854308,
            "total_moment_crank_2": 12577.46948942,
            "total_moment_crank_3": 16768.02545194,
            "total_moment_crank_4": 19578.39769068,
            "total_moment_crank_5": 21019.79404972,
            "total_moment_crank_6": 20980.5303689,
            "total_moment_rubber": 57.0861846508,
            "total_moment_shaft": 60.75511680083,
            "total_moment_tail": 2.1841112851,
        },
        (6, 630): {
            "total_moment_silicone": 978.782918449,
            "total_moment_crank_0": 1912.612937348,
            "total_moment_crank_1": 6498.204011696,
            "total_moment_crank_2": 10823.88628701,
            "total_moment_crank_3": 14398.62015805,
            "total_moment_crank_4": 16949.7256693,
            "total_moment_crank_5": 18290.04072581,
            "total_moment_crank_6": 18322.22397453,
            "total_moment_rubber": 49.85316589394,
            "total_moment_shaft": 53.05723154043,
            "total_moment_tail": 1.907376765376,
        },
        (3, 150): {
            "total_moment_silicone": 337.2520278197,
            "total_moment_crank_0": 460.6428653498,
            "total_moment_crank_1": 697.3605993906,
            "total_moment_crank_2": 1853.991131891,
            "total_moment_crank_3": 3008.836113121,
            "total_moment_crank_4": 4160.635688267,
            "total_moment_crank_5": 5308.20648831,
            "total_moment_crank_6": 6450.377344426,
            "total_moment_rubber": 2018.111937908,
            "total_moment_shaft": 1951.085406841,
            "total_moment_tail": 50.87762910407,
        },
        (0.5, 545): {
            "total_moment_silicone": 2.612373446457,
            "total_moment_crank_0": 3.551123060562,
            "total_moment_crank_1": 2706.770235342,
            "total_moment_crank_2": 2706.006188543,
            "total_moment_crank_3": 10.81455776124,
            "total_moment_crank_4": 2707.588991467,
            "total_moment_crank_5": 2713.576511787,
            "total_moment_crank_6": 13.75803053454,
            "total_moment_rubber": 21.45669399785,
            "total_moment_shaft": 20.72679421275,
            "total_moment_tail": 0.5391357837435,
        },
    },
    "ice_propeller": {
        (4, 64): {
            "total_moment_intermediate_1": 47807.12356395,
            "total_moment_intermediate_2": 47775.97324842,
            "total_moment_tail_1": 47437.80768786,
            "total_moment_tail_2": 46965.47503821,
        },
        (8, 32): {
            "total_moment_intermediate_1": 3424.754280034,
            "total_moment_intermediate_2": 3422.522767897,
            "total_moment_tail_1": 3398.297634391,
            "total_moment_tail_2": 3364.46118612,
        },
        (4, 150): {
            "total_moment_intermediate_1": 3616.024550114,
            "total_moment_intermediate_2": 3538.752938661,
            "total_moment_tail_1": 3313.36996459,
            "total_moment_tail_2": 3028.962445857,
        },
    },
    "vfd_compressor": {
        (2, 1030): {"total_moment_disc": 302.3712063691, "total_moment_quill_1": 46.63006479536},
        (4, 510): {"total_moment_disc": 89.76781206968, "total_moment_quill_1": 13.83716160754},
        (12, 170): {"total_moment_disc": 153.9590248115, "total_moment_quill_1": 23.73182948127},
        (12, 1150): {"total_moment_disc": 3.370523356117, "total_moment_quill_1": 13.78778105943},
        (24, 570): {"total_moment_disc": 0.181361269467, "total_moment_quill_1": 1.354619328441},
    },
}

# Of the largest value in its column. The runs ask for 1e-9 or 1e-10 a step, a hundred times less is left at the end.
ACCURACY = 1e-7

# Of damage, which the reference counts on samples of the motion.
SAMPLED = 1e-4

# Of the energy that is turned over, at these tolerances.
BALANCE_ACCURACY = 1e-7

# Of the largest moment of an order.
RESPONSE_ACCURACY = 1e-8


def input_of(name):
    return EXAMPLES / name / f"{name}.nml"


class Run:
    """One load case of an example."""

    def __init__(self, program, name):
        outcome = program("run", input_of(name), "--case", CASES[name], "--out", name, "-q")
        assert outcome.returncode == 0, outcome.stderr
        folder = f"{name}/{CASES[name]}"
        header, rows = program.table(folder)
        self.columns = dict(zip(header, zip(*rows)))
        self.summary = program.summary(folder)
        self.extremes = self.summary["columns"]

    def value(self, key):
        """Of 'COLUMN' at the end, 'max COLUMN', 'min COLUMN', 'damage FATIGUE'."""
        what, _, name = key.partition(" ")
        if what == "damage":
            return next(group["damage"] for group in self.summary["fatigue"] if group["name"] == name)
        return self.extremes[name][what] if what in ("max", "min") else self.columns[key][-1]

    def tolerance(self, key, expected):
        what, _, name = key.partition(" ")
        if what == "damage":
            return SAMPLED * expected
        extremes = self.extremes[name if what in ("max", "min") else key]
        return ACCURACY * max(abs(extremes["min"]), abs(extremes["max"]))


@pytest.fixture(scope="module")
def run_of(shared_nocdyn):
    runs = {}

    def run(name):
        if name not in runs:
            runs[name] = Run(shared_nocdyn, name)
        return runs[name]

    return run


def test_every_example_with_load_cases_has_a_reference():
    with_cases = {path.stem for path in EXAMPLES.glob("*/*.nml") if "&load_case" in path.read_text()}
    assert with_cases == set(REFERENCE) == set(CASES)


@pytest.mark.parametrize("name", REFERENCE)
def test_the_end_the_peaks_and_the_damage_are_those_of_the_reference(run_of, name):
    run = run_of(name)
    for key, expected in REFERENCE[name].items():
        assert run.value(key) == pytest.approx(expected, rel=0, abs=run.tolerance(key, expected)), key


@pytest.mark.parametrize("name", REFERENCE)
def test_no_energy_is_lost(run_of, name):
    columns = run_of(name).columns
    turned_over = max(max(map(abs, columns[key])) for key in ("kinetic_energy [J]", "work_in [J]", "work_out [J]"))
    assert max(map(abs, columns["energy_residual [J]"])) < BALANCE_ACCURACY * turned_over


@pytest.mark.parametrize("name", FREQUENCIES)
def test_the_natural_frequencies_are_those_of_the_reference(nocdyn, name):
    outcome = nocdyn("campbell", input_of(name), "--out", "out", "-q")
    assert outcome.returncode == 0, outcome.stderr
    modes = json.loads((nocdyn.folder / f"out/{FIRST[name]}/campbell.json").read_text())["modes"]
    found = [mode["undamped_frequency_Hz"][0] for mode in modes if "mostly" not in mode]
    found = [frequency for frequency in found if frequency > 0]
    expected = FREQUENCIES[name]
    assert found[: len(expected)] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", STEADY_SPEEDS)
def test_the_torques_balance_at_the_steady_speed(nocdyn, name):
    assert nocdyn("equilibrium", input_of(name), "--out", "steady").returncode == 0
    states = json.loads((nocdyn.folder / f"steady/{FIRST[name]}/equilibrium.json").read_text())["steady_states"]
    column, speed = STEADY_SPEEDS[name]
    assert any(state["values"][column] == pytest.approx(speed, rel=1e-9) and state["stability"] == "stable" for state in states)


def rows_of_orders(nocdyn, name):
    """By order and speed [rpm]: the row of response_orders.csv."""
    outcome = nocdyn("response", input_of(name), "--out", "out", "-q")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / f"out/{FIRST[name]}/response_orders.csv", newline="") as file:
        rows = [{label.split(" [")[0]: float(value) for label, value in row.items()} for row in csv.DictReader(file)]
    speed = next(iter(rows[0]))
    return {(round(row["order"], 9), round(row[speed] * 30 / pi, 9)): row for row in rows}


@pytest.mark.parametrize("name", RESPONSES)
def test_the_moments_of_the_response_are_those_of_dense_matrices(nocdyn, name):
    rows = rows_of_orders(nocdyn, name)
    for point, expected in RESPONSES[name].items():
        found = {label: rows[point][label] for label in expected}
        assert found == pytest.approx(expected, rel=0, abs=RESPONSE_ACCURACY * max(expected.values())), point


# --- with SciPy


def test_the_numbers_are_what_their_program_computes():
    pytest.importorskip("scipy")
    import load_case_references as references

    frequencies = references.frequencies()
    assert all(frequencies[name][: len(expected)] == pytest.approx(expected, rel=1e-11) for name, expected in FREQUENCIES.items())
    speeds = references.steady_speeds()
    assert {name: value for name, (_, value) in speeds.items()} == pytest.approx(
        {name: value for name, (_, value) in STEADY_SPEEDS.items()}, rel=1e-11
    )
    for name, points in references.responses().items():
        for point, amplitudes in points.items():
            assert amplitudes == pytest.approx(RESPONSES[name][point], rel=1e-10), point


def test_the_tables_of_the_ice_are_those_of_the_rule():
    pytest.importorskip("scipy")
    import load_case_references as references

    assert round(references.largest_ice_torque()) * 1e3 == references.Q_MAX
    for case in references.ICE:
        rows = [line.split(",") for line in (EXAMPLES / f"ice_propeller/{case}.csv").read_text().splitlines()[2:]]
        times, torques = references.ice_table(case)
        assert [float(time) for time, _ in rows] == pytest.approx(times, abs=1e-9)
        assert [float(torque) for _, torque in rows] == pytest.approx(torques, abs=1e-3)
