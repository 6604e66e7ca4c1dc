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
        "phi_rotor [rad]": 123.7928191783,
        "omega_rotor [rad/s]": 62.15585911718,
        "omega_throw_4 [rad/s]": 62.4019574544,
        "shaft_rubber [N m]": -12444.76545551,
        "shaft_crank_2 [N m]": 3045.043587831,
        "torque_mains [N m]": 13239.92213467,
        "max torque_mains [N m]": 77043.99943826,
        "min shaft_rubber [N m]": -44356.80282213,
        "max shaft_rubber [N m]": 3164.475440782,
        "min shaft_crank_2 [N m]": -22191.14623582,
        "damage life_of_rubber": 1.991889132668e-06,
        "damage life_of_crank": 5.342724291423e-12,
    },
    "generator_set": {
        "phi_rotor [rad]": 132.4243195485,
        "omega_ring [rad/s]": 86.32798988005,
        "omega_cylinder_1 [rad/s]": 86.19838333841,
        "omega_rotor [rad/s]": 86.79640770618,
        "omega_exciter [rad/s]": 86.74731948481,
        "shaft_rubber [N m]": 432.9987715089,
        "torque_fuel [N m]": 0,
        "min shaft_rubber [N m]": -17963.68912052,
        "max shaft_rubber [N m]": 3619.33575145,
        "min shaft_tail [N m]": -8227.273215452,
        "min shaft_crank_6 [N m]": -34534.7193525,
        "min torque_two_phase [N m]": -141931.264189,
        "damage life_of_shaft": 2.180652790106e-12,
        "damage life_of_tail": 1.428843018062e-05,
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
}
CASES = {"reciprocating_compressor": "reconnection", "generator_set": "two_phase", "ice_propeller": "case_2"}

# By the same program: natural frequencies without damping [Hz], the lowest first; of the propulsion line those that its orders reach,
FREQUENCIES = {
    "reciprocating_compressor": [11.71974967133, 83.66900520143, 223.1839256988, 363.4982225055, 426.9024171191],
    "generator_set": [4.510207144886, 63.54220816766, 119.5165927616, 167.5687315958, 208.1928974742, 266.3187920614, 350.9550201307, 415.7471469322, 456.3619599926, 587.7185774592],
    "ice_propeller": [4.287384633366],
}

# speeds at which the torques balance,
STEADY_SPEEDS = {
    "reciprocating_compressor": ("omega_flywheel [rad/s]", 62.00483495648),
}

# and amplitudes of moments [N m] by order and speed [rpm].
RESPONSES = {
    "generator_set": {
        (4.5, 840): {
            "moment_silicone": 1205.701946496,
            "moment_crank_0": 2356.029205237,
            "moment_crank_1": 8011.603985536,
            "moment_crank_2": 13392.77436903,
            "moment_crank_3": 17849.8504508,
            "moment_crank_4": 20853.58234296,
            "moment_crank_5": 22392.70982422,
            "moment_crank_6": 22349.34914834,
            "moment_rubber": 60.81918492845,
            "moment_shaft": 64.72803720659,
            "moment_tail": 2.326935474237,
        },
        (6, 630): {
            "moment_silicone": 1042.504853722,
            "moment_crank_0": 2037.130228668,
            "moment_crank_1": 6925.529593689,
            "moment_crank_2": 11533.62947453,
            "moment_crank_3": 15341.14015597,
            "moment_crank_4": 18057.86685703,
            "moment_crank_5": 19484.55541114,
            "moment_crank_6": 19517.6086391,
            "moment_rubber": 53.11318201276,
            "moment_shaft": 56.5267690701,
            "moment_tail": 2.032104631466,
        },
        (3, 150): {
            "moment_silicone": 342.0790288433,
            "moment_crank_0": 467.2359275084,
            "moment_crank_1": 691.9530686378,
            "moment_crank_2": 1825.907261043,
            "moment_crank_3": 2961.773616427,
            "moment_crank_4": 4095.260831736,
            "moment_crank_5": 5224.80184957,
            "moment_crank_6": 6349.128564024,
            "moment_rubber": 2047.426297878,
            "moment_shaft": 1979.4261638,
            "moment_tail": 51.61665903891,
        },
        (0.5, 545): {
            "moment_silicone": 2.483031663188,
            "moment_crank_0": 3.375302643355,
            "moment_crank_1": 2706.493661665,
            "moment_crank_2": 2704.854940221,
            "moment_crank_3": 10.2196722395,
            "moment_crank_4": 2705.699429019,
            "moment_crank_5": 2712.919248222,
            "moment_crank_6": 13.32248612054,
            "moment_rubber": 29.38330313637,
            "moment_shaft": 28.3837611451,
            "moment_tail": 0.7383052658061,
        },
    },
    "ice_propeller": {
        (4, 64): {
            "moment_intermediate_1": 59813.79010876,
            "moment_intermediate_2": 59774.98109196,
            "moment_tail_1": 59352.10142342,
            "moment_tail_2": 58761.37061371,
        },
        (8, 32): {
            "moment_intermediate_1": 4754.374940841,
            "moment_intermediate_2": 4751.290156937,
            "moment_tail_1": 4717.677030342,
            "moment_tail_2": 4670.722042982,
        },
        (4, 150): {
            "moment_intermediate_1": 3616.147341328,
            "moment_intermediate_2": 3538.87486795,
            "moment_tail_1": 3313.486192536,
            "moment_tail_2": 3029.0703998,
        },
    },
}

# Of the largest value in its column. The runs ask for 1e-9 or 1e-10 a step, a hundred times less is left at the end.
ACCURACY = 1e-7

# Of damage, which the reference counts on samples of the motion.
SAMPLED = 1e-4

# Of the energy that is turned over, at these tolerances.
BALANCE_ACCURACY = 1e-7

# Of the largest moment of an order. The nodes that a shaft has by itself serve frequencies; moments beside them take some more.
RESPONSE_ACCURACY = 1e-8
MORE_NODES = ("--set", "shaft.intermediate.nodes=7", "--set", "shaft.tail.nodes=7")


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
    modes = json.loads((nocdyn.folder / "out/campbell.json").read_text())["modes"]
    found = [mode["frequency_Hz"][0] for mode in modes]
    expected = FREQUENCIES[name]
    assert found[: len(expected)] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", STEADY_SPEEDS)
def test_the_torques_balance_at_the_steady_speed(nocdyn, name):
    assert nocdyn("equilibrium", input_of(name), "--out", "steady").returncode == 0
    states = json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())["steady_states"]
    column, speed = STEADY_SPEEDS[name]
    assert any(state["values"][column] == pytest.approx(speed, rel=1e-9) and state["stability"] == "stable" for state in states)


def rows_of_orders(nocdyn, name):
    """By order and speed [rpm]: the row of response_orders.csv."""
    words = MORE_NODES if name == "ice_propeller" else ()
    outcome = nocdyn("response", input_of(name), "--out", "out", "-q", *words)
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "out/response_orders.csv", newline="") as file:
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
