"""The input.nml of a run is an input: a run of it writes the same bytes, for every kind of group and every word of a key."""

import re

import pytest
from conftest import DATA

BASE = """&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 2 /
&body name = 'c' inertia = 3 /
&run t_end = 1e-3 {run} /
&output points = 2 {output} /
{element}
"""
SINE = "kind = 'startup' frequency = 30 pole_pairs = 2 amplitude = 1"
FAULT = "&excitation name = 'x' body = 'a' kind = 'fault' time = 0 frequency = 300"
TABLE = "table_speed = 0, 5, 20 table_torque = 1, 2, 3"
RUBBER = (
    "table_torque = 0, 1 torque_stiffness = 1, 2 table_temperature = 20, 90 temperature_stiffness = 1, 0.5 "
    "ambient_temperature = 20 warm_temperature = 90 power_loss = 1 power_loss_rise = 70"
)
DQ = "kind = 'induction_dq' voltage = 40 frequency = 20 poles = 2"
VARY = "&vary target = 'body.a.inertia' low = 1 high = 2"
RECORD = "&record quantity = 'omega_a' statistic = 'final'"

# One small input each; the elements that the shipped machines of the tests have in all their forms are not repeated.
SERIES = "&measurement name = 'm' kind = 'series' signal = 'omega_a' times = 0, 4e-4, 1e-3 values = 0, 1, 2"
PEAK = "&measurement name = 'm' kind = 'peak' signal = 'omega_a' values = 1"
ELEMENTS = {
    "measured": SERIES + " unit = 'rpm' scale = 2 offset = 1 deviation = 3 alignment = 'given' /",
    "measured band": SERIES + " alignment = 'found' largest_shift = 1e-4 frequency_band_hz = 0, 400 from = 0 until = 1e-3 /",
    "measured drift": SERIES + " alignment = 'drifting' largest_drift = 1e-4 drift_interval = 1e-3 /",
    "measured order": "&measurement name = 'm' kind = 'order' order = 1 signal = 'omega_a' speeds_rpm = 5, 9 values = 1, 2 /",
    "measured peaks": PEAK + " statistic = 'largest' / " + PEAK.replace("'m'", "'n'") + " statistic = 'smallest' /",
    "measured mean": PEAK + " statistic = 'mean' / " + PEAK.replace("'m'", "'n'") + " statistic = 'half_range' /",
    "measured modes": "&measurement name = 'm' kind = 'frequency' frequency_hz = 5, 9 relative_damping = 0.1, 0.2 modes = 1, 2 /",
    "measured torque": "&excitation name = 'x' body = 'a' kind = 'table' measurement = 'm' / "
    "&measurement name = 'm' signal = 'torque_x' times = 0, 1e-3 values = 1, 2 unit = 'kN m' /",
    "friction": "&clutch name = 'k' bodies = 'a', 'b' kind = 'friction' capacity = 3 /",
    "friction table": "&clutch name = 'k' bodies = 'a', 'b' table_slip = 0, 9 table_capacity = 3, 2 interpolation = 'cubic' /",
    "levels": "&clutch name = 'k' bodies = 'a', 'b' capacity = 3 table_time = 0, 1 table_level = 0, 1 /",
    "dog": "&clutch name = 'k' bodies = 'a', 'ground' kind = 'dog' times = 0.5 levels = 1 /",
    "backward": "&freewheel name = 'f' bodies = 'a', 'ground' direction = 'backward' /",
    "forward": "&freewheel name = 'f' bodies = 'a', 'b' direction = 'forward' /",
    "lossy gear": "&gear name = 'g' bodies = 'a', 'b' teeth = 10, 20 efficiency = 0.9 /",
    "gear with tables": "&gear name = 'g' bodies = 'a', 'b' teeth = 10, 20 table_speed = 0, 9 table_efficiency = 0.8, 0.9 /",
    "planetary": "&planetary name = 'p' sun = 'a' ring = 'b' carrier = 'c' teeth = 20, 70 efficiency = 0.98 /",
    "cardan": "&cardan name = 'j' bodies = 'a', 'b' angle_deg = 20 phase_deg = 10 /",
    "crank": "&crank name = 'p' body = 'a' crank_radius = 0.05 rod_length = 0.2 piston_mass = 1 /",
    "crank with forces": "&crank name = 'p' body = 'a' crank_radius = 0.05 rod_length = 0.2 piston_mass = 1 stroke = 2 "
    "crank_angles_deg = 0, 45, 90, 135, 180, 225, 270, 360 forces = 9, 7, 5, 1, 2, 3, 6, 9 /",
    "cam": "&relation name = 'r' bodies = 'a', 'b' kind = 'cam' table_angle = 0, 2, 4, 6.283185307179586 "
    "table_driven = 0, 0.1, 0.1, 0 /",
    "gear table": "&relation name = 'r' bodies = 'a', 'b' kind = 'gear' table_angle_deg = 0, 120, 240, 360 "
    "table_driven_deg = 0, 110, 250, 360 /",
    "lever": "&relation name = 'r' bodies = 'a', 'b' kind = 'lever' table_angle = 0, 1, 2, 3 table_driven = 0, 0.9, 2, 3 /",
    "speed": "&drive name = 'd' body = 'a' kind = 'speed' speed = 0 speed_amplitude = 1 frequency = 9 /",
    "speed table": "&drive name = 'd' body = 'a' table_time = 0, 1 table_speed = 0, 5 interpolation = 'linear' /",
    "cubic speed table": "&drive name = 'd' body = 'a' table_time = 0, 1, 2 table_speed = 0, 5, 6 interpolation = 'cubic' /",
    **{
        f"angle by {word}": "&drive name = 'd' body = 'a' kind = 'angle' table_time = 0, 1, 2, 3 table_angle = 0, 0, 0, 0 "
        f"interpolation = '{word}' /"
        for word in ("spline", "dwells", "cubic")
    },
    "coupling table": "&coupling name = 'k' bodies = 'a', 'b' table_twist = 0, 1, 2 table_moment = 0, 2, 3 "
    "interpolation = 'linear' extrapolation = 'linear' /",
    "elastic": "&coupling name = 'k' bodies = 'a', 'b' kind = 'elastic' stiffness = 1 /",
    **{
        f"{word} rubber": f"&coupling name = 'k' bodies = 'a', 'b' kind = 'rubber' stiffness = 1 relative_damping = 1 {RUBBER} "
        f"damping_frequency = 9 condition = '{word}' /"
        for word in ("cold", "warm", "steady")
    },
    "rubber load case": f"&coupling name = 'k' bodies = 'a', 'b' kind = 'rubber' stiffness = 1 {RUBBER} limits = .true. /\n"
    "&limit coupling = 'k' largest_temperature = 90 /",
    "viscous": "&damper name = 'd' body = 'a' kind = 'viscous' ring_inertia = 1 damping = 1 /\n&limit damper = 'd' heat = 1 /",
    "rubber": "&damper name = 'd' body = 'a' kind = 'rubber' ring_inertia = 1 stiffness = 1 loss_factor = 0.1 /",
    "viscous_spring": "&damper name = 'd' body = 'a' kind = 'viscous_spring' ring_inertia = 1 tuning_frequency_hz = 1 "
    "damping_ratio = 0.1 /",
    "shaft": "&shaft name = 's' bodies = 'a', 'b' lengths = 1 diameters = 0.1 shear_modulus = 8e10 density = 7850 /",
    "mesh": "&mesh name = 'z' bodies = 'a', 'b' teeth = 20, 60 module = 0.005 stiffness = 4e8 damping = 1e3 /",
    "quadratic": "&motor name = 'm' body = 'a' kind = 'quadratic' a = 1 b = 2 c = 3 /",
    "table, motor": f"&motor name = 'm' body = 'a' kind = 'table' {TABLE} interpolation = 'linear' extrapolation = 'linear' /",
    "cubic table, motor": f"&motor name = 'm' body = 'a' kind = 'table' {TABLE} interpolation = 'cubic' /",
    "induction_dq": f"&motor name = 'm' body = 'a' {DQ} stator_reactance = 1 rotor_reactance = 1 mutual_reactance = 30 "
    "stator_resistance = 1 rotor_resistance = 1 /",
    "dc": "&motor name = 'm' body = 'a' kind = 'dc' voltage = 24 resistance = 0.5 flux_constant = 0.8 /",
    "inverter": "&motor name = 'm' body = 'a' kind = 'inverter' torque_limit = 20 governor_speed = 5 "
    "governor_gain = 1 governor_time = 1 /",
    "load tables": f"&load name = 'l' body = 'a' {TABLE} interpolation = 'linear' extrapolation = 'constant' /",
    "straight load": f"&load name = 'l' body = 'a' {TABLE} interpolation = 'cubic' extrapolation = 'linear' /",
    "cubic history": "&excitation name = 'x' body = 'a' kind = 'table' table_time = 0, 1, 2 table_torque = 0, 1, 0 "
    "interpolation = 'cubic' /",
    "history": "&excitation name = 'x' body = 'a' kind = 'table' table_time = 0, 1 table_torque = 0, 1 "
    "interpolation = 'linear' /",
    "three_phase": f"{FAULT} fault = 'three_phase' rated_torque = 1 subtransient_reactance = 0.2 /",
    "two_phase": f"{FAULT} fault = 'two_phase' rated_torque = 1 subtransient_reactance = 0.2 transient_reactance = 0.3 /",
    "resynchronisation": f"{FAULT} fault = 'resynchronisation' rated_torque = 1 subtransient_reactance = 0.2 /",
    "angle of a resynchronisation": f"{FAULT} fault = 'resynchronisation' rated_torque = 1 subtransient_reactance = 0.2 "
    "angle = 3 /",
    "terms": f"{FAULT} term_amplitudes = 1, 2 term_multiples = 0, 1 /",
    "terms in time": f"{FAULT} term_amplitudes = 1, 2 term_multiples = 0, 1 term_times = 0.1, 0.2 term_phases = 1, 2 /",
    "startup": f"&excitation name = 'x' body = 'a' {SINE} /",
    "response": "&response body = 'a' speed_rpm = 100, 200 orders = 1 /",
    "operation": "&response body = 'a' speed = 10, 20 operating = 12, 18 margin = 0.2 /",
    "m68": "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 diameter = 0.1 /\n"
    "&response body = 'a' speed = 10, 20 /\n"
    "&limit coupling = 'k' rule = 'iacs_m68' tensile_strength = 6e8 rated_speed = 18 /",
    **{
        f"rule {word}": "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 diameter = 0.1 /\n"
        "&response body = 'a' speed = 10, 20 operating = 12, 18 margin_rule = 'api_617' /\n"
        f"&limit coupling = 'k' rule = '{word}' rated_speed = 18 {more} /"
        for word, more in (
            ("kr_generator", ""),
            ("kr_crankshaft", "choices = 'other' rule_symbols = 'yield_stress' rule_values = 300"),
            (
                "iacs_m53",
                "tensile_strength = 6e8 choices = 'free_form' rule_symbols = 'E', 'R_H', 'W', 'B', 'bending_stress' "
                "rule_values = 90, 8, 40, 150, 50",
            ),
        )
    },
    **{
        f"mean stress {word}": "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 diameter = 0.1 /\n"
        f"&fatigue name = 'f' coupling = 'k' reference_stress = 1e6 reference_cycles = 1e6 slope = 5 "
        f"mean_stress = '{word}' {more} /"
        for word, more in (
            ("none", ""),
            ("goodman", "ultimate_stress = 1e9"),
            ("gerber", "ultimate_stress = 1e9"),
            ("soderberg", "yield_stress = 1e9"),
        )
    },
    **{
        f"design {word}": f"&sweep design = '{word}' {more} /\n{VARY} {'count = 3' if word == 'grid' else ''} /\n{RECORD} /"
        for word, more in (("grid", ""), ("random", "samples = 4"), ("latin", "samples = 4"), ("sobol", "samples = 4"))
    },
    "list": f"&sweep design = 'list' file = 'list.csv' /\n{RECORD} /",
    **{
        f"distribution {word}": f"&sweep design = 'random' samples = 4 /\n&vary target = 'body.a.inertia' {keys} /\n{RECORD} /"
        for word, keys in (
            ("uniform", "low = 1 high = 2 scale = 'absolute' distribution = 'uniform'"),
            ("normal", "mean = 2 deviation = 0.1 low = 1 distribution = 'normal' scale = 'relative'"),
            ("lognormal", "median = 2 log_deviation = 0.1 high = 9 distribution = 'lognormal'"),
        )
    },
    "best choice": "&objective goal = 'maximise' quantity = 'omega_a' statistic = 'final' /\n"
    "&objective goal = 'minimise' quantity = 'omega_b' statistic = 'max' scale = 2 /\n"
    "&design target = 'body.a.inertia' low = 1 high = 2 step = 0.5 /\n&design target = 'body.b.inertia' values = 1, 2 /",
    "statistics": f"&sweep design = 'grid' /\n{VARY} count = 3 /\n&record quantity = 'omega_a' statistic = 'final', 'max', "
    "'min', 'max_abs', 'mean', 'rms', 'time_of_max', 'time_of_min', 'time_of_max_abs', 'settling_time' /",
    "modes": f"&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 /\n&sweep design = 'grid' /\n{VARY} count = 3 /\n"
    "&record mode = 1 statistic = 'frequency', 'damping_ratio' /",
    "responses": "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 damping = 1 /\n"
    f"&sweep design = 'grid' /\n{VARY} count = 3 /\n"
    "&excitation name = 'x' body = 'a' kind = 'orders' orders = 1 amplitudes = 2 /\n"
    "&response body = 'a' speed = 10, 20 operating = 12, 18 /\n&limit coupling = 'k' moment = 100 /\n"
    "&record response = 'moment_k' statistic = 'peak', 'peak_speed', 'margin', 'ratio', 'curve' /\n"
    "&record mode = 1 order = 1 statistic = 'crossing', 'crossing_margin' /",
    "shaker": "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 damping = 1 /\n"
    f"&sweep design = 'grid' /\n{VARY} count = 3 /\n"
    "&excitation name = 'x' body = 'a' amplitude = 2 frequency_hz = 3 /\n"
    "&response frequency_hz = 1, 2 excitation = 'x' /\n&record response = 'moment_k' statistic = 'peak_frequency' /",
    "lives": f"&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 /\n&sweep design = 'grid' /\n{VARY} count = 3 /\n"
    "&fatigue name = 'f' coupling = 'k' reference_moment = 1e6 reference_cycles = 1e6 slope = 5 /\n"
    "&record fatigue = 'f' statistic = 'damage', 'cycles' /",
    "any passage": "&transit body = 'a' range = 1, 2 direction = 'any' /",
    "both passages": "&transit body = 'a' range = 1, 2 direction = 'both' ramp_times = 0, 1, 2 ramp_speeds = 0.5, 3, 0.5 /",
    "passage up": "&transit body = 'a' range_rpm = 10, 20 direction = 'up' passages = 9 time_limit = 3 /",
    "low orbit": "&orbit over = 'body.a.inertia' range = 1, 2 start = 'low' starts = 4 harmonics = 9 stability = .true. "
    "motions = 1.2, 1.5 spectrum = .true. /",
    "settled orbit": "&orbit body = 'a' speed_rpm = 10, 20 start = 'settled_run' subharmonic = 2 signals = 'phi_*' count = 5 "
    "motion_speeds_rpm = 15 /",
    "orbits in harmonics": "&orbit over = 'body.a.inertia' range = 1, 2 method = 'harmonic_balance' /",
    "orbits by shooting": "&orbit over = 'body.a.inertia' range = 1, 2 method = 'shooting' /",
    "orbits": "&coupling name = 'k' bodies = 'a', 'b' stiffness = 100 /\n&orbit over = 'body.a.inertia' range = 1, 2 /\n"
    f"&sweep design = 'grid' /\n{VARY} count = 3 /\n&record orbit = 'phi_a' statistic = 'peak', 'peak_value' /\n"
    "&record orbit = 'branch' number = 2 statistic = 'fold', 'jump_up', 'jump_down', 'folds', 'unstable_ranges' /",
    "passage down": "&transit body = 'a' range = -1, -2 direction = 'down' order = 3 turns = 2 /",
}
RUN_WORDS = {
    "method": ("auto", "rk45", "rk853", "rosenbrock", "rodas4", "rodas5p", "taylor"),
    "formulation": ("reduced", "paper", "multiplier"),
    "complement": ("natural", "scaled", "negated"),
    "start": ("given", "projected", "equilibrium"),
}
RUNS = [f"{key} = '{word}'" for key, words in RUN_WORDS.items() for word in words]
FORMATS = ["format = 'csv'", "format = 'netcdf'"]
MACHINES = [path for path in sorted(DATA.glob("*.nml")) if "&run" in path.read_text().lower()]


def assert_same_again(nocdyn, name):
    for source, folder in ((name, "out"), ("out/input.nml", "again")):
        outcome = nocdyn("run", source, "--out", folder, "--quiet")
        assert outcome.returncode == 0, outcome.stderr
    assert (nocdyn.folder / "again/input.nml").read_bytes() == (nocdyn.folder / "out/input.nml").read_bytes()


@pytest.mark.parametrize("element", ELEMENTS.values(), ids=list(ELEMENTS))
def test_every_kind_of_group_is_read_again_as_it_was_written(nocdyn, element):
    nocdyn.write("list.csv", "body.a.inertia\n1\n2\n")
    nocdyn.write("out/list.csv", "body.a.inertia\n1\n2\n")
    nocdyn.write("machine.nml", BASE.format(run="", output="", element=element))
    assert_same_again(nocdyn, "machine.nml")


@pytest.mark.parametrize("words", RUNS)
def test_every_word_of_run_is_read_again_as_it_was_written(nocdyn, words):
    nocdyn.write("machine.nml", BASE.format(run=words, output="", element="&load name = 'l' body = 'a' viscous = 1 /"))
    assert_same_again(nocdyn, "machine.nml")


@pytest.mark.parametrize("path", MACHINES, ids=lambda path: path.stem)
def test_machines_of_the_tests_are_read_again_as_they_were_written(nocdyn, path):
    assert_same_again(nocdyn, path)


def test_every_kind_and_word_of_the_help_is_read_again(nocdyn):
    seen = BASE + "\n".join(ELEMENTS.values()) + "\n".join(RUNS + FORMATS) + "\n".join(path.read_text() for path in MACHINES)
    groups = re.findall(r"^  &(\w+)", nocdyn("help", "input").stdout, re.MULTILINE)
    assert len(groups) > 25
    words = set()
    for group in groups:
        text = nocdyn("help", "input", group).stdout
        words |= set(re.findall(r"^  \w+ = ('\w+'):", text, re.MULTILINE))
        for line in re.findall(r"^    \w+ +((?:'\w+', )+'\w+')", text, re.MULTILINE):
            words |= set(line.split(", "))
    assert len(words) > 60
    missing = {word for word in words if word not in seen}
    defaults = {"'harmonic'"}  # the kind of an excitation that names none, as in full_machine
    assert missing - defaults == set()


def test_a_word_of_another_kind_of_fault_is_refused(nocdyn):
    nocdyn.write("machine.nml", BASE.format(run="", output="", element=ELEMENTS["two_phase"]))
    outcome = nocdyn("check", "machine.nml", "--set", "excitation.x.angle=1")
    assert outcome.returncode == 2
    assert "angle needs fault = 'resynchronisation'" in outcome.stderr
