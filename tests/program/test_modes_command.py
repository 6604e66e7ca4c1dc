"""nocdyn modes: natural frequencies, damping, shapes and energies, and what is refused."""

import csv
import json
import re
from math import pi, sin, sqrt

import pytest
from conftest import CASE_1, SPINNER
from test_equilibrium_command import TRAIN

EXACT = 1e-11

# J [kg m2] and k [N m/rad] of two rotors, and their frequency [Hz] to ten decimals.
TWO_ROTORS = """\
&body name = 'big' inertia = 211.4 /
&body name = 'small' inertia = 8.3 /
&coupling name = 'shaft' bodies = 'big', 'small' stiffness = 9.775e6 /
&run t_end = 1.0 /
"""
TWO_ROTORS_FREQUENCY = 176.0767467524


def modes_of(nocdyn, text, *options):
    """The content of modes.json."""
    outcome = nocdyn("modes", nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return json.loads((nocdyn.folder / "out/modes.json").read_text())


def oscillations(content, key="frequency_Hz"):
    return [mode[key] for mode in content["modes"] if mode["kind"] == "oscillating"]


def of_kind(content, kind):
    return [mode for mode in content["modes"] if mode["kind"] == kind]


def test_two_rotors_swing_at_their_frequency(nocdyn):
    content = modes_of(nocdyn, TWO_ROTORS)
    rigid, mode = content["modes"]
    assert mode["frequency_Hz"] == pytest.approx(TWO_ROTORS_FREQUENCY, abs=1e-10)
    assert mode["undamped_frequency_Hz"] == pytest.approx(TWO_ROTORS_FREQUENCY, abs=1e-10)
    assert (mode["damping_ratio"], "time_constant_s" in mode) == (0, False)
    assert mode["shape"] == pytest.approx([8.3 / 211.4, 1], rel=EXACT)
    assert [abs(phase) for phase in mode["phase_deg"]] == pytest.approx([180, 0], abs=1e-6)
    assert mode["kinetic_share"] == pytest.approx([8.3 / 219.7, 211.4 / 219.7], rel=EXACT)
    assert mode["potential_share"] == [pytest.approx(1)]
    assert (rigid["kind"], rigid["frequency_Hz"], rigid["shape"]) == ("rigid body", 0, pytest.approx([1, 1]))


def test_rounding_of_a_shape_is_printed_and_written_as_zero(nocdyn):
    bodies = "".join(f"&body name = '{name}' inertia = 1.0 /\n" for name in "abc")
    shafts = "".join(f"&coupling name = '{a + b}' bodies = '{a}', '{b}' stiffness = 100.0 /\n" for a, b in ["ab", "bc"])
    path = nocdyn.write("chain.nml", bodies + shafts + "&run t_end = 1.0 /\n")
    outcome = nocdyn("modes", path, "--out", "out")
    assert re.search(r"^  b  +0  +1$", outcome.stdout, re.MULTILINE), outcome.stdout
    _, first, _ = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    assert (first["shape"][1], first["phase_deg"][1], first["kinetic_share"][1]) == (0, 0, 0)


def test_a_uniform_chain_has_the_frequencies_of_its_closed_form(nocdyn):
    count = 200
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(count))
    shafts = "".join(f"&coupling name = 's{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e4 /\n" for i in range(count - 1))
    content = modes_of(nocdyn, bodies + shafts + "&run t_end = 1.0 /\n")
    expected = [100 * sin(k * pi / (2 * count)) / pi for k in range(1, count)]
    assert oscillations(content) == pytest.approx(expected, rel=EXACT)
    text = nocdyn("modes", nocdyn.folder / "machine.nml").stdout
    assert "  (159 more in modes.csv)\n" in text and "shape of mode" not in text


def test_a_softer_shaft_between_gears_counts_with_the_square_of_the_ratio(nocdyn):
    # at the steady state the tangent stiffness is 800 + 6e5 u^2; the wheel counts as 4 / 16
    at_steady_state = modes_of(nocdyn, TRAIN)
    assert oscillations(at_steady_state, "undamped_frequency_Hz") == [pytest.approx(11.4525188732, abs=1e-10)]
    at_rest = modes_of(nocdyn, TRAIN, "--at", "rest")
    assert oscillations(at_rest, "undamped_frequency_Hz") == [
        pytest.approx(sqrt(800 * (1 / 0.5 + 1 / 0.55)) / (2 * pi), rel=EXACT)
    ]


def test_at_rest_the_speeds_of_the_start_do_not_count(nocdyn):
    text = """\
&body name = 'disc' inertia = 2.0 speed = 5.0 /
&motor name = 'm' body = 'disc' a = 10.0 b = 1.0 c = 3.0 /
&run t_end = 1.0 /
"""
    rest, start = (modes_of(nocdyn, text, "--at", at) for at in ("rest", "0"))
    assert (rest["speed_rad_s"], start["speed_rad_s"]) == ([0], [pytest.approx(5)])
    assert rest["modes"][0]["time_constant_s"] == pytest.approx(2 / 1, rel=EXACT)
    assert start["modes"][0]["time_constant_s"] == pytest.approx(2 / (1 + 2 * 3 * 5), rel=EXACT)


def test_the_start_of_a_run_is_rest_if_it_starts_at_rest(nocdyn):
    frequencies = [oscillations(modes_of(nocdyn, TRAIN, "--at", at)) for at in ("rest", "0")]
    assert frequencies[0] == frequencies[1]


def test_a_time_of_a_run_has_the_stiffness_of_the_twist_there(nocdyn):
    content = modes_of(nocdyn, TRAIN, "--at", "1.5", "--set", "run.rtol=1e-10")
    nocdyn("run", "machine.nml", "--out", "run", "-q", "--set", "run.rtol=1e-10", "--set", "output.points=5")
    header, rows = nocdyn.table("run")
    twist = rows[3][header.index("twist_shaft [rad]")]
    assert (content["about"], content["time_s"]) == ("t = 1.5 s", 1.5)
    assert content["couplings"][0]["stiffness_N_m_rad"] == pytest.approx(800 + 6e5 * twist**2, rel=1e-6)
    assert content["speed_rad_s"] == pytest.approx(rows[3][4:7], rel=1e-6)


@pytest.mark.parametrize("inductance", [1e-3, 0.4])
def test_the_decay_of_a_current_is_not_that_of_a_rigid_body(nocdyn, inductance):
    # L s^2 + (R + d L / J) s + (R d + k^2) / J = 0; the mode that is nearer to R / L is that of the current
    text = f"""\
&body name = 'disc' inertia = 2.0 /
&motor name = 'drive' body = 'disc' kind = 'dc' voltage = 10.0 resistance = 1.0 flux_constant = 0.5 inductance = {inductance} /
&load name = 'drag' body = 'disc' viscous = 0.1 /
&run t_end = 1.0 /
"""
    content = modes_of(nocdyn, text)
    middle, product = (1 + 0.05 * inductance) / (2 * inductance), (0.1 + 0.25) / (2 * inductance)
    root = sqrt(middle**2 - product)
    (rigid,), (current,) = of_kind(content, "rigid body"), of_kind(content, "internal state")
    assert rigid["time_constant_s"] == pytest.approx(1 / (middle - root), rel=1e-9)
    assert current["time_constant_s"] == pytest.approx(1 / (middle + root), rel=1e-9)
    assert current["state"] == "armature current of motor 'drive'" and "state" not in rigid
    lines = nocdyn("modes", "machine.nml").stdout.splitlines()
    assert any(line.startswith("  armature current of motor 'drive': decays with time constant ") for line in lines)


def test_the_decay_of_a_governor_is_not_that_of_a_rigid_body(nocdyn):
    # J s^2 + M g s + M g / T = 0 with T = 100 s: the integral is slow, the speed fast
    text = """\
&body name = 'disc' inertia = 2.0 /
&motor name = 'drive' body = 'disc' kind = 'constant' torque = 40.0
       governor_speed = 10.0 governor_gain = 0.05 governor_time = 100.0 /
&load name = 'drag' body = 'disc' constant = 10.0 constant_speed = 0.1 /
&run t_end = 1.0 /
"""
    content = modes_of(nocdyn, text)
    (rigid,), (governor,) = of_kind(content, "rigid body"), of_kind(content, "internal state")
    root = sqrt(0.25 - 1 / 100)
    assert rigid["time_constant_s"] == pytest.approx(1 / (0.5 + root), rel=1e-6)
    assert governor["time_constant_s"] == pytest.approx(1 / (0.5 - root), rel=1e-6)
    assert governor["state"] == "governor integral of motor 'drive'"


def test_an_overdamped_oscillator_has_two_time_constants(nocdyn):
    text = """\
&body name = 'disc' inertia = 2.0 /
&coupling name = 'wall' bodies = 'ground', 'disc' stiffness = 50.0 damping = 25.0 /
&run t_end = 1.0 /
"""
    content = modes_of(nocdyn, text)
    slow, fast = of_kind(content, "overdamped")
    assert [mode["time_constant_s"] for mode in (slow, fast)] == pytest.approx([1 / 2.5, 1 / 10], rel=EXACT)
    assert slow["damping_ratio"] == 1
    assert "overdamped: decays with time constant 0.4 s; kinetic energy in disc 100 %" in nocdyn("modes", "machine.nml").stdout


def test_the_run_up_of_a_machine_is_its_rigid_body_mode(nocdyn):
    (rigid,) = of_kind(modes_of(nocdyn, TRAIN), "rigid body")
    assert rigid["time_constant_s"] == pytest.approx((0.5 + 0.3 + 4 / 16) / (0.8 / 16), rel=1e-4)  # of a rigid shaft
    assert rigid["shape"] == pytest.approx([1, 1, 0.25], rel=1e-2)
    assert rigid["kinetic_share"] == pytest.approx([0.5 / 1.05, 0.3 / 1.05, 0.25 / 1.05], rel=1e-2)


def test_the_current_of_a_dc_motor_is_a_state_more(nocdyn):
    text = """\
&body name = 'rotor' inertia = 2.0 /
&motor name = 'drive' body = 'rotor' kind = 'dc' voltage = 100.0 resistance = 0.5 flux_constant = 1.2 inductance = 0.1 /
&load name = 'air' body = 'rotor' viscous = 0.4 /
&run t_end = 1.0 /
"""
    content = modes_of(nocdyn, text)
    # J w' = k i - c w, L i' = U - R i - k w
    trace, determinant = -(0.4 / 2 + 0.5 / 0.1), (0.4 * 0.5 + 1.2**2) / (2 * 0.1)
    (mode,) = content["modes"]
    assert mode["eigenvalue_1_s"] == pytest.approx([trace / 2, sqrt(determinant - trace**2 / 4)], rel=EXACT)


def test_a_wind_turbine_train_swings_as_its_planetary_set_couples_it(nocdyn):
    text = """\
&body name = 'rotor' inertia = 5000.0 /
&body name = 'carrier' inertia = 0.001 /
&body name = 'sun' inertia = 1e-6 /
&body name = 'generator' inertia = 60.0 /
&coupling name = 'main' bodies = 'rotor', 'carrier' stiffness = 1e7 /
&coupling name = 'high' bodies = 'sun', 'generator' stiffness = 1e5 /
&planetary name = 'set' sun = 'sun' ring = 'ground' carrier = 'carrier' teeth = 20, 80 /
&run t_end = 1.0 /
"""
    # the sun turns five times as fast: two masses and two springs in series, seen from the generator
    stiffness = 1 / (25 / 1e7 + 1 / 1e5)
    lowest = sqrt(stiffness * (25 / 5000 + 1 / 60)) / (2 * pi)
    assert oscillations(modes_of(nocdyn, text))[0] == pytest.approx(lowest, rel=1e-5)  # the light bodies count little


def test_a_gap_that_is_open_has_no_stiffness_and_a_closed_one_has(nocdyn):
    gap = TWO_ROTORS.replace("stiffness", "gap = 0.1 stiffness")
    assert oscillations(modes_of(nocdyn, gap, "--at", "rest")) == []
    closed = gap.replace("inertia = 8.3", "inertia = 8.3 angle = 0.06")
    assert oscillations(modes_of(nocdyn, closed, "--at", "rest")) == [pytest.approx(TWO_ROTORS_FREQUENCY, abs=1e-9)]


def test_unstable_modes_are_told(nocdyn):
    rising = TRAIN.replace("a = 30.0 b = 0.0", "a = 0.0 b = -2.0").replace("viscous = 0.8", "viscous = 0.0")
    content = modes_of(nocdyn, rising, "--at", "rest")
    (rigid,), (mode,) = of_kind(content, "rigid body"), of_kind(content, "oscillating")
    assert rigid["time_constant_s"] < 0 and mode["damping_ratio"] < 0
    text = nocdyn("modes", "machine.nml", "--at", "rest").stdout
    assert ", unstable\n" in text and "rigid body: unstable, grows e-fold in " in text


def test_a_softened_spring_makes_a_diverging_mode(nocdyn):
    text = """\
&body name = 'disc' inertia = 2.0 angle = 1.0 /
&coupling name = 'wall' bodies = 'ground', 'disc' stiffness = 50.0 cubic_stiffness = -40.0 /
&run t_end = 1.0 /
"""
    content = modes_of(nocdyn, text, "--at", "rest")  # tangent stiffness 50 - 120
    (decaying,), (growing,) = of_kind(content, "overdamped"), of_kind(content, "diverging")
    assert growing["eigenvalue_1_s"] == [pytest.approx(sqrt(35), rel=EXACT), 0]
    assert decaying["eigenvalue_1_s"] == [pytest.approx(-sqrt(35), rel=EXACT), 0]
    assert growing["potential_share"] == [-1]
    assert "diverging: unstable, grows e-fold in 0.169031 s" in nocdyn("modes", "machine.nml", "--at", "rest").stdout


TORQUE_SPLIT = """\
&body name = 'motor' inertia = 3.0 /
&body name = 'sun' inertia = 0.2 /
&body name = 'left' inertia = 0.5 /
&body name = 'right' inertia = 0.5 /
&body name = 'wheel' inertia = 4.0 /
&body name = 'mill' inertia = 9.0 /
&coupling name = 'input' bodies = 'motor', 'sun' stiffness = 2e4 damping = 3.0 /
&coupling name = 'output' bodies = 'wheel', 'mill' stiffness = 6e4 /
&gear name = 'g1' bodies = 'sun', 'left' teeth = 20, 40 /
&gear name = 'g2' bodies = 'sun', 'right' teeth = 20, 40 /
&gear name = 'g3' bodies = 'left', 'wheel' teeth = 25, 75 /
{redundant}
&motor name = 'm' body = 'motor' a = 50.0 b = 1.0 c = 0.0 /
&load name = 'l' body = 'mill' viscous = 2.0 /
&run t_end = 1.0 /
"""


def test_a_redundant_mesh_changes_no_mode(nocdyn):
    without = modes_of(nocdyn, TORQUE_SPLIT.format(redundant=""))
    split = modes_of(nocdyn, TORQUE_SPLIT.format(redundant="&gear name = 'g4' bodies = 'right', 'wheel' teeth = 25, 75 /"))
    assert len(oscillations(without)) == 2 and len(split["gears"]) == 4
    for key in ("frequency_Hz", "damping_ratio", "undamped_frequency_Hz"):
        assert oscillations(split, key) == pytest.approx(oscillations(without, key), rel=EXACT)
    for one, other in zip(split["modes"], without["modes"]):
        assert one["kinetic_share"] == pytest.approx(other["kinetic_share"], abs=EXACT)
        assert one["potential_share"] == pytest.approx(other["potential_share"], abs=EXACT)


def test_the_paper_s_machine_has_the_modes_of_a_hand_calculation(nocdyn):
    # J1 = 10; pinion and wheel together 5 + 5 (2/3)^2; linearised at the root of w^2 + (10 + 100 (2/3)^2) w - 200
    content = json.loads(run_case_1(nocdyn))
    slope = 10 + 100 * (2 / 3) ** 2
    speed = (-slope + sqrt(slope**2 + 800)) / 2
    motor, load = 10 + 2 * speed, 100 * (2 / 3) ** 2
    torque = load * speed
    twist = next_root(lambda u: 100 * u + 10 * u**3 - torque)
    stiffness = 100 + 30 * twist**2
    inertia = [10, 5 + 5 * (2 / 3) ** 2]
    # states: both speeds and the twist; the characteristic polynomial s^3 + p s^2 + q s + r
    a, b = motor / inertia[0], load / inertia[1]
    p, q = a + b, a * b + stiffness * (1 / inertia[0] + 1 / inertia[1])
    r = stiffness / (inertia[0] * inertia[1]) * (motor + load)
    for mode in content["modes"]:
        s = complex(*mode["eigenvalue_1_s"])
        assert abs(s**3 + p * s**2 + q * s + r) < 1e-9 * abs(r)
    assert content["couplings"][0]["stiffness_N_m_rad"] == pytest.approx(stiffness, rel=EXACT)
    assert [mode["kind"] for mode in content["modes"]] == ["rigid body", "oscillating"]
    assert content["gears"] == [{"name": "reducer", "bodies": [2, 3], "ratio": pytest.approx(-2 / 3)}]


def run_case_1(nocdyn):
    outcome = nocdyn("modes", CASE_1, "--out", "out")
    assert "note: there are 2 steady states, 1 of them stable; this is the stable one nearest to the start" in outcome.stdout
    return (nocdyn.folder / "out/modes.json").read_text()


def next_root(function, low=0.0, high=10.0):
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (low, middle) if function(middle) > 0 else (middle, high)
    return low


def test_the_table_has_a_row_for_every_mode(nocdyn):
    content = modes_of(nocdyn, TRAIN)
    with open(nocdyn.folder / "out/modes.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["kind"] for row in rows] == [mode["kind"] for mode in content["modes"]] == ["rigid body", "oscillating"]
    assert [row["mode"] for row in rows] == ["", "1"]
    mode = content["modes"][1]
    assert float(rows[1]["frequency [Hz]"]) == mode["frequency_Hz"]
    assert float(rows[1]["damping_ratio"]) == mode["damping_ratio"]
    assert float(rows[1]["time_constant [s]"]) == mode["time_constant_s"]
    for b, name in enumerate(content["bodies"]):
        assert float(rows[1][f"shape_{name} [1]"]) == mode["shape"][b]
        assert float(rows[1][f"phase_{name} [deg]"]) == mode["phase_deg"][b]
        assert float(rows[1][f"kinetic_{name} [1]"]) == mode["kinetic_share"][b]
    assert float(rows[1]["potential_shaft [1]"]) == mode["potential_share"][0]


def test_modes_that_do_not_decay_have_no_time_constant_in_the_table(nocdyn):
    modes_of(nocdyn, TWO_ROTORS)
    with open(nocdyn.folder / "out/modes.csv", newline="") as file:
        assert [row["time_constant [s]"] for row in csv.DictReader(file)] == ["", ""]


def test_a_small_machine_has_its_shapes_printed(nocdyn):
    lines = nocdyn("modes", nocdyn.write("machine.nml", TWO_ROTORS)).stdout.splitlines()
    assert lines[-3].split() == ["shape", "of", "mode", "1"]
    assert lines[-2].split() == ["big", "-0.039262"]
    assert lines[-1].split() == ["small", "1"]


def test_overrides_count(nocdyn):
    content = modes_of(nocdyn, TWO_ROTORS, "--set", "coupling.shaft.stiffness=3.91e7")
    assert oscillations(content) == [pytest.approx(2 * TWO_ROTORS_FREQUENCY, rel=EXACT)]


def test_without_out_nothing_is_written(nocdyn, spinner):
    assert nocdyn("modes", spinner).returncode == 0
    assert nocdyn.files(".") == ["spinner.nml"]


def test_every_file_gets_its_own_folder_and_bad_ones_stop_nothing(nocdyn, spinner):
    bad = nocdyn.write("bad.nml", SPINNER.replace("inertia", "inertai"))
    outcome = nocdyn("modes", bad, "absent.nml", spinner, "--out", "out")
    assert outcome.returncode == 3
    assert nocdyn.files("out") == ["spinner"]
    assert nocdyn.files("out/spinner") == ["modes.csv", "modes.json"]
    assert "did you mean 'inertia'?" in outcome.stderr and "absent.nml: cannot be read" in outcome.stderr


def test_files_that_would_share_a_folder_are_refused(nocdyn):
    nocdyn.write("a/same.nml", SPINNER)
    nocdyn.write("b/same.nml", SPINNER)
    outcome = nocdyn("modes", "a/same.nml", "b/same.nml", "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == "nocdyn: 'a/same.nml' and 'b/same.nml' would both write to 'out/same'; nothing was run\n"


def test_a_folder_that_cannot_be_made_is_an_error(nocdyn, spinner):
    outcome = nocdyn("modes", spinner, "--out", "spinner.nml/out")
    assert outcome.returncode == 3
    assert "cannot write 'spinner.nml/out/modes.csv'" in outcome.stderr


@pytest.mark.parametrize(
    ("at", "complaint"),
    [
        ("noon", "--at noon: allowed: equilibrium, rest or a time of the run [s]\n"),
        ("nan", "--at nan: allowed: equilibrium, rest or a time of the run [s]\n"),
        ("2.5", "machine.nml: --at 2.5 is no time of the run; allowed: 0 to 2 s\n"),
        ("-1", "machine.nml: --at -1 is no time of the run; allowed: 0 to 2 s\n"),
    ],
)
def test_a_wrong_operating_point_is_refused(nocdyn, at, complaint):
    outcome = nocdyn("modes", nocdyn.write("machine.nml", TRAIN), "--at", at)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith("nocdyn: ") and outcome.stderr.endswith(complaint)


def test_a_run_that_fails_before_the_time_is_told(nocdyn):
    outcome = nocdyn("modes", nocdyn.write("machine.nml", TRAIN), "--at", "1", "--set", "run.max_steps=3")
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert "machine.nml: the integration stopped at " in outcome.stderr


def test_a_machine_without_steady_state_is_refused_but_not_at_rest(nocdyn):
    path = nocdyn.write("machine.nml", TRAIN)
    outcome = nocdyn("modes", path, "--set", "load.mill.viscous=0")
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert "there is no steady state: nothing balances 30 N m" in outcome.stderr
    assert nocdyn("modes", path, "--set", "load.mill.viscous=0", "--at", "rest").returncode == 0


def test_a_large_machine_that_needs_dense_matrices_is_refused(nocdyn):
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(1501))
    outcome = nocdyn("modes", nocdyn.write("many.nml", bodies + "&run t_end = 1.0 /\n"), "--at", "0")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert (
        "many.nml: the modes of this machine need dense matrices, because nothing of it is elastic, and are found so for at most "
        "1500 degrees of freedom; it has 1501" in outcome.stderr
    )


def test_the_files_of_a_large_machine_have_the_shapes_of_its_first_modes(nocdyn):
    # trains of four geared bodies each, whose motions are rigid
    count = 1240
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(count))
    rails = "".join(f"&gear name = 'g{i}' bodies = 'b{i}', 'b{i + 1}' teeth = 1, 1 /\n" for i in range(count - 1) if i % 4)
    path = nocdyn.write("large.nml", bodies + rails + "&run t_end = 1.0 /\n")
    outcome = nocdyn("modes", path, "--at", "rest", "--out", "out")
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    told = 1000000 // (3 * count)
    assert (
        f"note: of the {len(modes)} modes, modes.csv and modes.json have the shapes and energies of the first {told}\n"
        in outcome.stdout
    )
    assert ["shape" in mode for mode in modes] == [True] * told + [False] * (len(modes) - told)
    rows = list(csv.reader((nocdyn.folder / "out/modes.csv").read_text().splitlines()))
    assert {len(row) for row in rows} == {8 + 3 * count}
    assert rows[told][8] != "" and set(rows[told + 1][8:]) == {""}


@pytest.mark.parametrize("stiffness", ["1e18", "1e26", "1e30", "1e40"])
def test_a_stiffness_that_stands_for_a_rigid_coupling_takes_no_mode_from_the_others(nocdyn, stiffness):
    text = """\
&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 2 /
&body name = 'c' inertia = 3 /
&body name = 'd' inertia = 1 /
{}
&coupling name = 'k1' bodies = 'b', 'c' stiffness = 1e4 damping = {} /
&coupling name = 'k2' bodies = 'c', 'd' stiffness = 2e3 damping = {} /
&run t_end = 1 /
"""
    stiff = f"&coupling name = 'rigid' bodies = 'a', 'b' stiffness = {stiffness} /"
    for damping in [(0, 0)] + [(20, 3)] * (float(stiffness) < 1e31):
        wanted = modes_of(
            nocdyn, text.format("&gear name = 'rigid' bodies = 'a', 'b' teeth = 1, 1 internal = .true. /", *damping)
        )
        found = modes_of(nocdyn, text.format(stiff, *damping))
        assert "-0," not in re.sub(r"\s", "", (nocdyn.folder / "out/modes.json").read_text())
        assert [mode["kind"] for mode in found["modes"]] == ["rigid body"] + 3 * ["oscillating"]
        for one, same in zip(found["modes"][1:3], wanted["modes"][1:3]):
            assert one["frequency_Hz"] == pytest.approx(same["frequency_Hz"], rel=1e-9 if damping == (0, 0) else 1e-3)
            assert one["damping_ratio"] == pytest.approx(same["damping_ratio"], rel=1e-2)
