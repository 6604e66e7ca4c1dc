"""The example machines do what an independent computation of each says, and reproduce published numbers."""

import json
import math

import pytest
from conftest import DATA, SOURCE

EXAMPLES = SOURCE / "input/examples"

# By example_references.py, which prints these tables. Values at the end of the run unless said.
# The examples with load cases are in test_example_load_cases.py.
REFERENCE = {
    "three_rotors": {
        "phi_gear [rad]": 0.1623282270274,
        "phi_load [rad]": 0.16286164288,
        "omega_gear [rad/s]": -0.1122493092032,
        "omega_load [rad/s]": -0.1381452799177,
        "reaction_reducer [N m]": 0.5380543014618,
    },
    "backlash": {
        "phi_loose [rad] at 0.1": 0.2498358550474,
        "phi_loose [rad] at 0.25": 0.5808155698516,
        "phi_loose [rad] at 0.5": -0.3099580354666,
        "phi_held [rad] at 0.1": 0.9541444032638,
        "phi_held [rad] at 0.25": -0.4513103198337,
        "phi_held [rad] at 0.5": 0.129290252861,
    },
    "fan_start": {
        "phi_rotor [rad]": 350.9346344273,
        "omega_rotor [rad/s]": 151.3262165225,
        "omega_fan [rad/s]": 151.3265482553,
        "max torque_motor [N m]": 190,
        "min moment_tyre [N m]": -184.5027984608,
    },
    "wind_turbine": {
        "phi_rotor [rad]": 6.073609021906,
        "omega_rotor [rad/s]": 1.02695293593,
        "omega_generator [rad/s]": 100.0035961343,
        "reaction_planets [N m]": 383218.6482257,
        "reaction_planets_ring [N m]": 1916093.241128,
        "reaction_planets_carrier [N m]": -2299311.889354,
        "min moment_main_shaft [N m]": -7350831.316929,
    },
    "ship_turbine": {
        "phi_propeller [rad]": 46.32834727241,
        "omega_propeller [rad/s]": 4.212568415112,
        "omega_hp_turbine [rad/s]": 331.3291036556,
        "omega_lp_turbine [rad/s]": 169.5602394827,
        "reaction_hp_first [N]": -46813.48375109,
        "max moment_line_shaft [N m]": 167281.0362294,
        "min moment_line_shaft [N m]": -1164150.581301,
    },
    "torque_split": {
        "omega_engine [rad/s]": 780.508895387,
        "omega_bull [rad/s]": 30.91342825645,
        "omega_rotor [rad/s]": 31.02229365637,
        "reaction_left_first [N]": -4835.889237747,
        "reaction_left_second [N]": 11170.94255098,
        "reaction_right_first [N]": -4835.889237747,
        "reaction_right_second [N]": 11170.94255098,
    },
    "rolling_mill": {
        "phi_motor [rad]": 3.646873545411,
        "phi_roll [rad]": 3.650135713356,
        "omega_motor [rad/s]": 6.302623756197,
        "omega_stand [rad/s]": 5.879987792802,
        "omega_roll [rad/s]": 5.766958891191,
        "min moment_shaft [N m]": -1237677.856179,
        "min moment_spindle [N m]": -920080.7611216,
    },
    "engine": {
        "omega_ring [rad/s]": 188.6124928622,
        "omega_hub [rad/s]": 188.6991786865,
        "omega_cylinder_6 [rad/s]": 188.4711445109,
        "omega_generator [rad/s]": 188.7559998666,
        "phi_flywheel [rad]": 94.42126426481,
        "max moment_crank_8 [N m]": 1290.243183637,
        "min moment_rubber [N m]": -742.5608305434,
    },
    "chain_200": {
        "phi_r001 [rad]": 0.0636619819447,
        "phi_r100 [rad]": 0.06480644424706,
        "phi_r200 [rad]": 0.1273389067638,
        "omega_r001 [rad/s]": -1.603936214215e-05,
        "omega_r100 [rad/s]": 0.4948078073467,
        "omega_r110 [rad/s]": 5.118565932326,
        "omega_r200 [rad/s]": -0.002552513032372,
    },
    "synchronous_start": {
        "phi_motor [rad]": 367.3301386586,
        "omega_motor [rad/s]": 156.8960371416,
        "omega_wheel [rad/s]": 156.896661207,
        "omega_compressor [rad/s]": -941.380535859,
        "min moment_low_speed [N m]": -81208.88517186,
        "max moment_low_speed [N m]": 29661.86790971,
    },
    "ieee_first_benchmark": {
        "omega_hp [rad/s]": 378.844121764,
        "omega_lpb [rad/s]": 379.9237223908,
        "omega_generator [rad/s]": 380.3543821094,
        "omega_exciter [rad/s]": 381.2184665565,
        "twist_hp_ip [rad]": -0.01307760169649,
        "twist_ip_lpa [rad]": -0.01390444748216,
        "twist_lpa_lpb [rad]": -0.01562930000298,
        "twist_lpb_generator [rad]": -0.01490779672866,
        "twist_generator_exciter [rad]": -0.001522691880496,
    },
    "dc_governed": {
        "phi_armature [rad]": 373.9895627233,
        "omega_armature [rad/s]": 150.1395641196,
        "omega_machine [rad/s]": 150.1270101754,
        "torque_drive [N m]": 17.97722973856,
        "max torque_drive [N m]": 96.9902184362,
        "min omega_machine [rad/s]": 144.181060016,
    },
    "differential": {
        "omega_engine [rad/s]": 302.2176101345,
        "omega_left [rad/s]": 9.896060031754,
        "omega_right [rad/s]": 37.22277629946,
        "omega_left_wheel [rad/s]": 9.898219635212,
        "omega_right_wheel [rad/s]": 37.22490696626,
        "omega_vehicle [rad/s]": 9.739918371296,
        "omega_case [rad/s]": 23.5594181656,
        "reaction_axle [N m]": 139.7703859316,
    },
    "coupled_clutches": {
        "omega_J1 [rad/s]": 3.247052939449,
        "omega_J2 [rad/s]": 2.463188944306,
        "omega_J3 [rad/s]": 2.463188944306,
        "omega_J4 [rad/s]": 2.463188944306,
        "phi_J1 [rad]": 7.48612314754,
        "phi_J2 [rad]": 4.107132449304,
        "phi_J3 [rad]": 2.710464858721,
        "phi_J4 [rad]": 1.173744373711,
    },
    "car_driveline": {
        "omega_engine [rad/s]": 301.1304294614,
        "omega_vehicle [rad/s]": 24.70653282391,
        "omega_shaft [rad/s]": -88.35306053199,
        "omega_axle [rad/s]": 24.80211016456,
        "torque_dry [N m]": 71.27053043138,
        "twist_half_shafts [rad]": -0.09234518630156,
        "max omega_vehicle [rad/s]": 24.70653282391,
    },
    "compressor": {
        "phi_flywheel [rad]": 50.9430692625,
        "omega_rotor [rad/s]": 74.65147273214,
        "omega_flywheel [rad/s]": 74.38649545888,
        "position_piston [m]": 0.2938993130021,
        "velocity_piston [m/s]": -3.327244362616,
        "gas_force_piston [N]": -334.2825889097,
        "force_piston [N]": -333.0922273642,
        "min moment_shaft [N m]": -343.6435319477,
    },
    "hybrid": {
        "omega_engine [rad/s]": 108.0115217429,
        "omega_motor [rad/s]": 56.09922673463,
        "omega_generator [rad/s]": 242.9834887645,
        "omega_vehicle [rad/s]": 14.3896046734,
        "phi_engine [rad]": 173.7317904505,
        "max omega_generator [rad/s]": 289.0991356051,
        "min torque_backstop [N m]": -117.6780076685,
    },
    "winch": {
        "phi_motor [rad]": 69.10943652354,
        "phi_load [rad]": 1.695035911651,
        "omega_load [rad/s]": 1.098700476553e-08,
        "reaction_worm [N m]": -18.39375076743,
        "max omega_motor [rad/s]": 113.942806202,
        "min omega_motor [rad/s]": -97.90514133125,
        "min moment_rope [N m]": -860.2101992471,
    },
    "motor_coupling_gear": {
        "phi_motor [rad]": 56.47598491122,
        "phi_wheel [rad]": 14.11521985167,
        "omega_motor [rad/s]": 54.56693223938,
        "omega_wheel [rad/s]": 13.59750467858,
        "reaction_reducer [N m]": -7.329820482306,
    },
    "kloss_run_up": {
        "omega_rotor [rad/s]": 149.2256510455,
    },
    "fan_law": {
        "omega_fan [rad/s]": 43.05285857903,
    },
}

# By the same program: natural frequencies without damping [Hz], the lowest first,
FREQUENCIES = {
    "two_discs": [176.0767467524],
    "ieee_first_benchmark": [15.71219212617, 20.21132828935, 25.54715197023, 32.28463140086, 47.45629855213],
    "ship_turbine": [2.961846308015, 3.669384655216, 21.366350657, 41.58988961127, 48.05418436386],
    "ship_turbine without pinions": [2.961852525508, 3.669604718084, 21.37640928287, 41.61445315161, 48.05637302425],
    "wind_turbine": [2.199402057523],
    "chain_200": [2.499974297984, 4.999794385778, 7.499306062703, 9.998355147105, 12.49678748587],
}

# and speeds at which the torques balance when all disturbances are over.
STEADY_SPEEDS = {
    "fan_start": ("omega_fan [rad/s]", 151.3421503929),
    "wind_turbine": ("omega_generator [rad/s]", 105.7214726181),
    "ship_turbine": ("omega_propeller [rad/s]", 4.712451544664),
    "torque_split": ("omega_rotor [rad/s]", 28.02286024247),
    "synchronous_start": ("omega_motor [rad/s]", 156.1683814302),
    "engine": ("omega_generator [rad/s]", 188.5014137606),
    "dc_governed": ("omega_machine [rad/s]", 150),
}

# Numbers from elsewhere, with the accuracy to which they are known.
PUBLISHED = {
    "three_rotors": (
        1e-9,
        {
            "phi_gear [rad]": 0.1623282270274,
            "phi_load [rad]": 0.1628616428800,
            "omega_gear [rad/s]": -0.1122493092032,
            "omega_load [rad/s]": -0.1381452799178,
            # the library counts the torque at a flange into the gear, here it is that on the motor
            "reaction_reducer [N m]": 0.538054301463,
        },
    ),
    "backlash": (
        1e-7,
        {
            "phi_loose [rad] at 0.1": 0.24983586,
            "phi_loose [rad] at 0.25": 0.58081557,
            "phi_loose [rad] at 0.5": -0.30995804,
        },
    ),
    "motor_coupling_gear": (
        1e-9,
        {
            "phi_motor [rad]": 56.47598491122,
            "phi_wheel [rad]": 14.11521985166,
            "omega_motor [rad/s]": 54.56693223929,
            "omega_wheel [rad/s]": 13.59750467860,
            "reaction_reducer [N m]": -7.329820484048,
        },
    ),
    "kloss_run_up": (1e-9, {"omega_rotor [rad/s]": 0.95 * 2 * math.pi * 25}),
    "fan_law": (1e-9, {"omega_fan [rad/s]": 43.052858579027}),
}
PUBLISHED_FREQUENCIES = {
    "two_discs": (1e-9, [176.0767467524]),
    "ieee_first_benchmark": (0.005, [15.71, 20.21, 25.55, 32.28, 47.46]),
    # E. J. Gunter, W. J. Chen, 2001, one decimal a minute
    "ship_turbine without pinions": (0.05 / 60, [177.7 / 60, 220.2 / 60, 1282.6 / 60]),
}

# About the steady state of the mean torque, and at rest [Hz].
MOTOR_COUPLING_GEAR = {"equilibrium": 11.4525188732, "rest": 8.7961662238}

# Of the largest value in its column. The runs ask for 1e-9 or 1e-10 a step, a hundred times less is left at the end.
ACCURACY = 1e-7

# Of the energy that is turned over, at these tolerances.
BALANCE_ACCURACY = 1e-7


def input_of(name):
    folder = EXAMPLES / name
    return folder / f"{name}.nml" if folder.exists() else DATA / f"{name}.nml"


class Run:
    def __init__(self, program, name):
        outcome = program("run", input_of(name), "--out", name, "-q")
        assert (outcome.returncode, outcome.stderr) == (0, "")
        self.header, rows = program.table(name)
        self.rows = rows
        self.columns = dict(zip(self.header, zip(*rows)))
        self.extremes = program.summary(name)["columns"]

    def value(self, key):
        """Of 'COLUMN', 'COLUMN at TIME', 'max COLUMN', 'min COLUMN'."""
        if key.startswith(("max ", "min ")):
            return self.extremes[key[4:]][key[:3]]
        column, _, time = key.partition(" at ")
        row = min(range(len(self.rows)), key=lambda i: abs(self.rows[i][0] - float(time))) if time else -1
        return self.columns[column][row]

    def largest(self, key):
        column = key.removeprefix("max ").removeprefix("min ").partition(" at ")[0]
        return max(abs(self.extremes[column]["min"]), abs(self.extremes[column]["max"]))


@pytest.fixture(scope="module")
def run_of(shared_nocdyn):
    runs = {}

    def run(name):
        if name not in runs:
            runs[name] = Run(shared_nocdyn, name)
        return runs[name]

    return run


def test_every_example_has_a_reference_and_three_lines_that_say_what_it_is():
    folders = sorted(path.name for path in EXAMPLES.iterdir())
    with_cases = {name for name in folders if "&load_case" in input_of(name).read_text()}
    assert set(folders) - with_cases <= set(REFERENCE)
    page = (SOURCE / "docs/pages/examples.md").read_text()
    for name in folders:
        lines = (EXAMPLES / name / "README.md").read_text().splitlines()
        assert len(lines) == 3 and lines[1].startswith("Numbers: ") and lines[2].startswith("Reference: "), name
        assert f"`input/examples/{name}/{name}.nml`" in page, name


@pytest.mark.parametrize("name", REFERENCE)
def test_the_end_and_the_peaks_are_those_of_the_reference(run_of, name):
    run = run_of(name)
    for key, expected in REFERENCE[name].items():
        assert run.value(key) == pytest.approx(expected, rel=0, abs=ACCURACY * run.largest(key)), key


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_numbers_are_reproduced(shared_nocdyn, name):
    accuracy, values = PUBLISHED[name]
    run = Run(shared_nocdyn, name)
    for key, expected in values.items():
        assert run.value(key) == pytest.approx(expected, rel=0, abs=accuracy * run.largest(key)), key


@pytest.mark.parametrize("name", REFERENCE)
def test_no_energy_is_lost(run_of, name):
    columns = run_of(name).columns
    turned_over = max(max(map(abs, columns[key])) for key in ("kinetic_energy [J]", "work_in [J]", "work_out [J]"))
    assert max(map(abs, columns["energy_residual [J]"])) < BALANCE_ACCURACY * turned_over


def test_two_equal_paths_share_the_torque(run_of):
    columns = run_of("torque_split").columns
    for stage in ("first", "second"):
        left, right = columns[f"reaction_left_{stage} [N]"], columns[f"reaction_right_{stage} [N]"]
        largest = max(map(abs, left))
        assert max(abs(a - b) for a, b in zip(left, right)) < 1e-10 * largest


def undamped_frequencies(program, name, point):
    outcome = program("modes", input_of(name), "--at", point, "--out", "modes")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    content = json.loads((program.folder / "modes/modes.json").read_text())
    return [mode["undamped_frequency_Hz"] for mode in content["modes"] if mode["kind"] == "oscillating"]


@pytest.mark.parametrize("name", [name for name in FREQUENCIES if " " not in name])
def test_the_modes_have_the_frequencies_of_the_reference(nocdyn, name):
    expected = FREQUENCIES[name]
    assert undamped_frequencies(nocdyn, name, "rest")[: len(expected)] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", PUBLISHED_FREQUENCIES)
def test_the_frequencies_are_the_published_ones(name):
    accuracy, expected = PUBLISHED_FREQUENCIES[name]
    assert FREQUENCIES[name][: len(expected)] == pytest.approx(expected, rel=0, abs=accuracy)


@pytest.mark.parametrize("point", MOTOR_COUPLING_GEAR)
def test_a_cubic_coupling_is_linearised_at_its_mean_twist(nocdyn, point):
    (frequency,) = undamped_frequencies(nocdyn, "motor_coupling_gear", point)
    assert frequency == pytest.approx(MOTOR_COUPLING_GEAR[point], rel=0, abs=1e-9)


@pytest.mark.parametrize("name", STEADY_SPEEDS)
def test_the_torques_balance_at_the_steady_speed(nocdyn, name):
    outcome = nocdyn("equilibrium", input_of(name), "--out", "steady")
    assert outcome.returncode == 0, outcome.stderr
    states = json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())["steady_states"]
    column, speed = STEADY_SPEEDS[name]
    assert any(state["values"][column] == pytest.approx(speed, rel=1e-9) and state["stability"] == "stable" for state in states)


# Those that take less than a second.
QUICK = ["three_rotors", "backlash", "torque_split", "chain_200", "ieee_first_benchmark", "kloss_run_up"]


@pytest.mark.parametrize("name", QUICK)
def test_the_reference_is_what_its_program_computes(name):
    pytest.importorskip("scipy")
    import example_references

    values = getattr(example_references, name)()
    assert values == pytest.approx(REFERENCE[name], rel=1e-10, abs=1e-11)
