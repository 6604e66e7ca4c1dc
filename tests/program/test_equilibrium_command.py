"""nocdyn equilibrium: the steady states of machines, what is said about them, and what is refused."""

import json
from math import sqrt, tanh

import pytest
from conftest import CASE_1, CASE_2, DATA, SPINNER

# What is printed has seven digits; what is written is exact to rounding.
PRINTED = 1e-6
EXACT = 1e-12

# Motor, coupling, pinion, ratio 4, wheel with a viscous load.
TRAIN = """\
&body name = 'motor' inertia = 0.5 /
&body name = 'pinion' inertia = 0.3 /
&body name = 'wheel' inertia = 4.0 /
&coupling name = 'shaft' bodies = 'motor', 'pinion' stiffness = 800.0 cubic_stiffness = 2e5 damping = 0.5 /
&gear name = 'mesh' bodies = 'pinion', 'wheel' teeth = 20, 80 /
&motor name = 'drive' body = 'motor' a = 30.0 b = 0.0 c = 0.0 /
&load name = 'mill' body = 'wheel' viscous = 0.8 /
&excitation name = 'shaker' body = 'motor' amplitude = 15.0 frequency = 25.0 /
&run t_end = 2.0 /
"""

# The uniform motion of the paper's machine: w^2 + (10 + 100 (2/3)^2) w - 200 = 0.
SLOPE = 10 + 100 * (2 / 3) ** 2
UNIFORM = [(-SLOPE - sqrt(SLOPE**2 + 800)) / 2, (-SLOPE + sqrt(SLOPE**2 + 800)) / 2]


def steady_states(nocdyn, folder="out"):
    return json.loads((nocdyn.folder / folder / "equilibrium.json").read_text())["steady_states"]


def analyse(nocdyn, text, *options):
    """The steady states of an input."""
    outcome = nocdyn("equilibrium", nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return steady_states(nocdyn)


def refusal(nocdyn, text, *options):
    outcome = nocdyn("equilibrium", nocdyn.write("machine.nml", text), *options)
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert outcome.stderr.count("\n") == 1
    return outcome.stderr


def test_a_train_runs_where_its_torques_balance(nocdyn):
    (state,) = analyse(nocdyn, TRAIN)
    values = state["values"]
    twist = -values["twist_shaft [rad]"]
    assert values["omega_motor [rad/s]"] == pytest.approx(30 / (0.8 / 16), rel=EXACT)
    assert values["omega_wheel [rad/s]"] == pytest.approx(-150, rel=EXACT)
    assert 800 * twist + 2e5 * twist**3 == pytest.approx(30, rel=EXACT)
    assert values["moment_shaft [N m]"] == pytest.approx(-30, rel=EXACT)
    assert values["reaction_mesh [N m]"] == pytest.approx(-30, rel=EXACT)
    assert values["torque_shaker [N m]"] == 0
    assert values["elastic_energy [J]"] == pytest.approx(400 * twist**2 + 5e4 * twist**4, rel=EXACT)
    assert state["power_W"]["motor drive"] == pytest.approx(18000, rel=EXACT)
    assert state["power_put_in_W"] == pytest.approx(18000, rel=EXACT)
    assert abs(state["power_residual_W"]) < 18000 * EXACT
    assert state["stability"] == "stable"


def test_both_solutions_of_the_paper_s_motor_curve_are_told_apart(nocdyn):
    outcome = nocdyn("equilibrium", CASE_1, "--out", "out")
    assert outcome.stdout.startswith(f"{CASE_1}: steady state 1 of 2, unstable: a disturbance grows with ")
    assert f"\n{CASE_1}: steady state 2 of 2, stable: disturbances decay at " in outcome.stdout
    states = steady_states(nocdyn)
    assert [state["values"]["omega_motor [rad/s]"] for state in states] == pytest.approx(UNIFORM, rel=EXACT)
    assert [state["stability"] for state in states] == ["unstable", "stable"]
    assert states[0]["growth_rate_1_s"] > 0 > states[1]["growth_rate_1_s"]


def test_a_run_ends_in_the_stable_steady_state(nocdyn):
    nocdyn("equilibrium", CASE_1, "--out", "out")
    nocdyn("run", CASE_1, "--out", "run", "--set", "run.t_end=40", "-q")
    header, rows = nocdyn.table("run")
    values = steady_states(nocdyn)[1]["values"]
    for label in ("omega_machine [rad/s]", "twist_coupling [rad]", "reaction_reducer [N]", "elastic_energy [J]"):
        assert rows[-1][header.index(label)] == pytest.approx(values[label], rel=1e-6)  # what the tolerances leave


def test_the_table_has_the_values_of_the_file(nocdyn):
    text = nocdyn("equilibrium", nocdyn.write("machine.nml", TRAIN), "--out", "out").stdout
    (state,) = steady_states(nocdyn)
    lines = text.splitlines()
    for label, value in state["values"].items():
        (line,) = (line for line in lines if line.startswith(f"  {label} "))
        assert float(line.split()[-1]) == pytest.approx(value, rel=PRINTED)
    assert next(line for line in lines if line.startswith("  motor drive ")).split()[-1] == "18000"


def test_excitations_count_with_their_mean(nocdyn):
    with_excitation, without = (nocdyn("equilibrium", case).stdout for case in (CASE_2, CASE_1))
    assert with_excitation.replace("case2", "case1") == without


def test_overrides_count(nocdyn):
    (state,) = analyse(nocdyn, TRAIN, "--set", "load.mill.viscous=1.6")
    assert state["values"]["omega_motor [rad/s]"] == pytest.approx(300, rel=EXACT)


def test_a_machine_on_a_spring_to_the_ground_rests(nocdyn):
    ground = "&coupling name = 'wall' bodies = 'ground', 'wheel' stiffness = 50.0 /\n"
    (state,) = analyse(nocdyn, TRAIN + ground)
    assert state["values"]["omega_motor [rad/s]"] == 0
    assert state["values"]["moment_wall [N m]"] == pytest.approx(-120, rel=EXACT)  # 30 N m, geared by 4
    assert state["values"]["twist_wall [rad]"] == pytest.approx(-2.4, rel=EXACT)


def test_a_coupling_that_slips_has_a_damping_moment_and_no_twist(nocdyn):
    slipping = TRAIN.replace("stiffness = 800.0 cubic_stiffness = 2e5 damping = 0.5", "damping = 0.5")
    (state,) = analyse(nocdyn, slipping)
    assert "twist_shaft [rad]" not in state["values"]
    assert state["values"]["omega_motor [rad/s]"] - state["values"]["omega_pinion [rad/s]"] == pytest.approx(60, rel=EXACT)
    assert state["power_W"]["coupling shaft"] == pytest.approx(-1800, rel=EXACT)


def test_parallel_shafts_share_the_torque_by_their_stiffness(nocdyn):
    parallel = "&coupling name = 'sleeve' bodies = 'motor', 'pinion' stiffness = 400.0 rest_twist = -0.005 /\n"
    (state,) = analyse(nocdyn, TRAIN.replace("cubic_stiffness = 2e5", "") + parallel)
    twist = (30 + 400 * 0.005) / 1200
    assert state["values"]["twist_shaft [rad]"] == pytest.approx(-twist, rel=EXACT)
    assert state["values"]["moment_sleeve [N m]"] == pytest.approx(-400 * (twist - 0.005), rel=1e-11)


def test_a_spring_without_linear_part_is_twisted_from_rest(nocdyn):
    (state,) = analyse(nocdyn, TRAIN.replace("stiffness = 800.0 cubic", "cubic"))
    assert state["values"]["twist_shaft [rad]"] == pytest.approx(-((30 / 2e5) ** (1 / 3)), rel=EXACT)


def test_what_nothing_drives_keeps_the_speed_of_its_start(nocdyn):
    free = "&body name = 'idler' inertia = 2.0 speed = 3.0 /\n&body name = 'disc' inertia = 1.0 speed = 0.0 /\n"
    joint = "&coupling name = 'joint' bodies = 'idler', 'disc' stiffness = 10.0 /\n"
    path = nocdyn.write("machine.nml", TRAIN + free + joint)
    outcome = nocdyn("equilibrium", path, "--out", "out")
    assert outcome.returncode == 0
    assert (
        "note: nothing drives or brakes 'idler', 'disc': any speed is steady, and the one of the start is kept" in outcome.stdout
    )
    (state,) = steady_states(nocdyn)
    assert state["values"]["omega_disc [rad/s]"] == pytest.approx(2, rel=EXACT)  # the angular momentum stays
    assert state["stability"] == "neutral"  # the joint has no damping


def test_a_free_body_beside_a_stable_machine_leaves_it_stable(nocdyn):
    (state,) = analyse(nocdyn, TRAIN + "&body name = 'idler' inertia = 2.0 /\n")
    assert state["stability"] == "stable"
    printed = nocdyn("equilibrium", nocdyn.write("free.nml", TRAIN + "&body name = 'idler' inertia = 2.0 /\n")).stdout
    assert "stable but for the speeds of the notes, which disturbances change for good: others decay at " in printed
    assert "steady state, stable: disturbances decay at " in nocdyn("equilibrium", nocdyn.write("held.nml", TRAIN)).stdout


def test_machines_side_by_side_have_every_combination(nocdyn):
    second = """\
&body name = 'fan' inertia = 1.0 /
&motor name = 'breeze' body = 'fan' a = 6.0 b = -5.0 c = -1.0 /
"""
    states = analyse(nocdyn, CASE_1.read_text() + second)  # 6 + 5 w + w^2 = 0
    speeds = [(state["values"]["omega_fan [rad/s]"], state["stability"]) for state in states]
    assert speeds == [
        (pytest.approx(-3), "unstable"),
        (pytest.approx(-3), "stable"),
        (pytest.approx(-2), "unstable"),
        (pytest.approx(-2), "unstable"),
    ]


def test_two_solutions_that_lie_close_together_are_found(nocdyn):
    # 1e-6 - (w - 7)^2 = 0: closer than the points of the scan
    states = analyse(
        nocdyn,
        "&body name = 'a' inertia = 1.0 /\n&motor name = 'm' body = 'a' a = -48.999999 b = -14.0 c = 1.0 /\n&run t_end = 1.0 /\n",
    )
    assert [state["values"]["omega_a [rad/s]"] for state in states] == pytest.approx([6.999, 7.001], abs=1e-9)
    assert [state["stability"] for state in states] == ["unstable", "stable"]


SHAFT = """\
&body name = 'rotor' inertia = 2.0 /
&body name = 'fan' inertia = 5.0 /
&coupling name = 'shaft' bodies = 'rotor', 'fan' stiffness = 1000.0 damping = 2.0 {shaft} /
&motor name = 'drive' body = 'rotor' {motor} /
&load name = 'air' body = 'fan' {load} /
&run t_end = 20.0 /
"""


def test_an_induction_motor_that_sticks_crawls_or_runs_has_three_solutions(nocdyn):
    motor = "kind = 'induction' breakdown_torque = 100.0 breakdown_slip = 0.05 synchronous_speed = 157.0"
    states = analyse(nocdyn, SHAFT.format(shaft="", motor=motor, load="quadratic = 0.0005 constant = 15.0 constant_speed = 0.1"))
    assert [state["stability"] for state in states] == ["stable", "unstable", "stable"]
    for state in states:
        speed = state["values"]["omega_fan [rad/s]"]
        slip = 1 - speed / 157
        assert 2 * 100 * slip * 0.05 / (slip**2 + 0.05**2) == pytest.approx(15 * tanh(speed / 0.1) + 0.0005 * speed**2, rel=1e-9)


def test_a_governor_holds_its_speed(nocdyn):
    motor = "kind = 'constant' torque = 50.0 governor_speed = 20.0 governor_gain = 0.1 governor_time = 2.0"
    (state,) = analyse(nocdyn, SHAFT.format(shaft="", motor=motor, load="viscous = 0.8"))
    assert state["values"]["omega_fan [rad/s]"] == pytest.approx(20, rel=EXACT)
    assert state["values"]["throttle_drive [1]"] == pytest.approx(0.8 * 20 / 50, rel=EXACT)


def test_a_governor_that_cannot_hold_its_speed_is_at_its_limit(nocdyn):
    motor = "kind = 'constant' torque = 50.0 governor_speed = 100.0 governor_gain = 0.1 governor_time = 2.0"
    (state,) = analyse(nocdyn, SHAFT.format(shaft="", motor=motor, load="viscous = 0.8"))
    assert state["values"]["omega_fan [rad/s]"] == pytest.approx(50 / 0.8, rel=EXACT)
    assert state["values"]["throttle_drive [1]"] == pytest.approx(1, rel=EXACT)


def test_a_slipping_clutch_leaves_two_speeds(nocdyn):
    text = SHAFT.format(shaft="friction = 5.0", motor="kind = 'constant' torque = 16.0", load="viscous = 0.8")
    text = text.replace("stiffness = 1000.0 damping = 2.0", "") + "&load name = 'oil' body = 'rotor' viscous = 0.1 /\n"
    (state,) = analyse(nocdyn, text)
    assert state["values"]["omega_rotor [rad/s]"] == pytest.approx(110, rel=1e-9)
    assert state["values"]["omega_fan [rad/s]"] == pytest.approx(6.25, rel=1e-9)
    assert state["power_W"]["coupling shaft"] == pytest.approx(-5 * (110 - 6.25), rel=1e-9)


def test_excitations_that_end_count_with_their_last_value(nocdyn):
    excitations = """\
&excitation name = 'step' body = 'fan' kind = 'step' amplitude = 1.0 time = 3.0 /
&excitation name = 'ramp' body = 'fan' kind = 'ramp' amplitude = 2.0 time = 3.0 duration = 1.0 /
&excitation name = 'pulse' body = 'fan' kind = 'pulse' amplitude = 4.0 time = 3.0 duration = 1.0 /
&excitation name = 'table' body = 'fan' kind = 'table' table_time = 0.0, 1.0 table_torque = 3.0, 8.0 /
&excitation name = 'orders' body = 'fan' kind = 'orders' orders = 1.0, 2.0 amplitudes = 3.0, 4.0 phases = 1.0, 1.0 /
&excitation name = 'startup' body = 'fan' kind = 'startup' amplitude = 9.0 frequency = 314.0 pole_pairs = 2 phase = 1.0 /
"""
    text = SHAFT.format(shaft="", motor="kind = 'constant' torque = 16.0", load="viscous = 0.9")
    (state,) = analyse(nocdyn, text + excitations)
    assert state["values"]["omega_fan [rad/s]"] == pytest.approx((16 + 1 + 2 + 8) / 0.9, rel=EXACT)
    torques = [state["values"][f"torque_{name} [N m]"] for name in ("step", "ramp", "pulse", "table", "orders", "startup")]
    assert torques == pytest.approx([1, 2, 0, 8, 0, 0])


def test_a_long_chain_is_solved_in_linear_time(nocdyn):
    count = 5000
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(count))
    shafts = "".join(
        f"&coupling name = 's{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 100.0 cubic_stiffness = 1e4 /\n"
        for i in range(count - 1)
    )
    ends = "&motor name = 'm' body = 'b0' a = 7.0 b = 0.0 c = 0.0 /\n&load name = 'l' body = 'b4999' viscous = 2.0 /\n"
    (state,) = analyse(nocdyn, bodies + shafts + ends + "&run t_end = 1.0 /\n")
    assert state["stability"] == "not determined"
    assert "growth_rate_1_s" not in state
    moments = [value for label, value in state["values"].items() if label.startswith("moment")]
    assert moments == pytest.approx([-7.0] * (count - 1), rel=1e-9)


def test_a_large_machine_s_table_stops_and_says_so(nocdyn):
    bodies = "".join(
        f"&body name = 'b{i}' inertia = 1.0 /\n&load name = 'l{i}' body = 'b{i}' viscous = 1.0 /\n" for i in range(70)
    )
    outcome = nocdyn("equilibrium", nocdyn.write("many.nml", bodies + "&run t_end = 1.0 /\n"))
    lines = outcome.stdout.splitlines()
    assert "  (82 more values in equilibrium.json)" in lines
    assert "  (10 more in equilibrium.json)" in lines


def test_without_out_nothing_is_written(nocdyn, spinner):
    assert nocdyn("equilibrium", spinner).returncode == 0
    assert nocdyn.files(".") == ["spinner.nml"]


def test_every_file_gets_its_own_folder_and_bad_ones_stop_nothing(nocdyn, spinner):
    bad = nocdyn.write("bad.nml", SPINNER.replace("inertia", "inertai"))
    lost = nocdyn.write("lost.nml", SPINNER.replace("&load", "&motor").replace("viscous = 0.5", "a = 1.0 b = 0.0 c = 0.0"))
    outcome = nocdyn("equilibrium", bad, lost, spinner, "--out", "out")
    assert outcome.returncode == 2
    assert nocdyn.files("out") == ["spinner"]
    assert nocdyn.files("out/spinner") == ["equilibrium.json"]
    assert "did you mean 'inertia'?" in outcome.stderr and "lost.nml: there is no steady state" in outcome.stderr
    assert nocdyn("equilibrium", lost, spinner).returncode == 1


def test_files_that_would_share_a_folder_are_refused(nocdyn):
    nocdyn.write("a/same.nml", SPINNER)
    nocdyn.write("b/same.nml", SPINNER)
    outcome = nocdyn("equilibrium", "a/same.nml", "b/same.nml", "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == "nocdyn: 'a/same.nml' and 'b/same.nml' would both write to 'out/same'; nothing was run\n"


def test_a_folder_that_cannot_be_made_is_an_error(nocdyn, spinner):
    outcome = nocdyn("equilibrium", spinner, "--out", "spinner.nml/out")
    assert outcome.returncode == 3
    assert "cannot write 'spinner.nml/out/equilibrium.json'" in outcome.stderr


def test_a_constant_torque_without_load_is_refused(nocdyn):
    text = TRAIN.replace("viscous = 0.8", "viscous = 0.0")
    assert refusal(nocdyn, text) == (
        f"nocdyn: {nocdyn.folder}/machine.nml: there is no steady state: nothing balances 30 N m on 'motor', 'pinion', 'wheel' "
        "at any speed; a load is missing, or a motor whose torque falls\n"
    )


def test_torques_that_never_balance_are_refused_with_what_is_left_over(nocdyn):
    text = "&body name = 'a' inertia = 1.0 /\n&motor name = 'm' body = 'a' a = -50.0 b = -14.0 c = 1.0 /\n&run t_end = 1.0 /\n"
    message = refusal(nocdyn, text)  # -1 - (w - 7)^2
    assert "nothing balances the torques on 'a' at any speed; at least -1 N m are left over, at 7 rad/s of 'a'\n" in message


def test_couplings_that_cannot_carry_the_torque_are_refused(nocdyn):
    soft = TRAIN.replace("cubic_stiffness = 2e5", "cubic_stiffness = -2e5")  # carries 19.5 N m at most
    message = refusal(nocdyn, soft)
    assert "no steady state was found: the torques balance at 600 rad/s of 'motor', but no twists of the couplings" in message


def test_a_machine_whose_stiffness_matrix_has_no_narrow_band_is_refused(nocdyn):
    count = 4000
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(count))
    spokes = "".join(f"&coupling name = 's{i}' bodies = 'b0', 'b{i}' stiffness = 9.0 /\n" for i in range(1, count))
    loads = "".join(f"&load name = 'l{i}' body = 'b{i}' viscous = 1.0 /\n" for i in range(10))
    hub = "&coupling name = 'wall' bodies = 'ground', 'b0' stiffness = 9.0 /\n"
    outcome = nocdyn("equilibrium", nocdyn.write("star.nml", bodies + spokes + hub + loads + "&run t_end = 1.0 /\n"))
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert "star.nml: the twists need a matrix of " in outcome.stderr
    assert "whose couplings leave no narrower band; at most 6000 x 6000 are allowed" in outcome.stderr


def test_five_bodies_are_named_and_the_others_counted(nocdyn):
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(8))
    shafts = "".join(f"&coupling name = 's{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 9.0 /\n" for i in range(7))
    text = bodies + shafts + "&motor name = 'm' body = 'b0' a = 1.0 b = 0.0 c = 0.0 /\n&run t_end = 1.0 /\n"
    assert "1 N m on 'b0', 'b1', 'b2', 'b3', 'b4' and 3 more at any speed" in refusal(nocdyn, text)


def test_a_speed_at_which_constant_torques_balance_is_not_determined_and_that_of_the_start_is_kept(nocdyn):
    text = """\
&body name = 'drum' inertia = 2.0 speed = {speed} /
&motor name = 'drive' body = 'drum' kind = 'constant' torque = 10.0 /
&load name = 'hoist' body = 'drum' constant = 10.0 /
&run t_end = 1.0 /
"""
    outcome = nocdyn("equilibrium", nocdyn.write("machine.nml", text.format(speed=20.0)), "--out", "out")
    assert (
        "note: the torques on 'drum' balance over a range of speeds: any of them is steady, and of those that were found the one "
        "nearest to the start is kept, 20 rad/s of 'drum'\n"
    ) in outcome.stdout
    (state,) = steady_states(nocdyn)
    assert (state["values"]["omega_drum [rad/s]"], state["stability"]) == (pytest.approx(20, rel=EXACT), "neutral")
    # at rest nothing brakes; the range begins where the hyperbolic tangent is 1 to rounding, tanh(18.4) = 1 - 2e-16
    (state,) = analyse(nocdyn, text.format(speed=0.0))
    assert 0.15 < state["values"]["omega_drum [rad/s]"] < 0.2


def test_a_clutch_that_slips_at_the_torque_of_its_motor_has_one_range_of_speeds(nocdyn):
    text = SHAFT.format(shaft="friction = 10.0", motor="kind = 'constant' torque = 10.0", load="viscous = 0.5")
    outcome = nocdyn(
        "equilibrium", nocdyn.write("machine.nml", text.replace("stiffness = 1000.0 damping = 2.0", "")), "--out", "out"
    )
    assert "the torques on 'rotor', 'fan' balance over a range of speeds" in outcome.stdout
    (state,) = steady_states(nocdyn)
    assert state["values"]["omega_fan [rad/s]"] == pytest.approx(20, rel=1e-9)


GAP = """\
&body name = 'rotor' inertia = 2.0 /
&body name = 'fan' inertia = 1.0 /
&coupling name = 'claw' bodies = 'rotor', 'fan' stiffness = 1e3 damping = 1.0 gap = 0.1 /
&motor name = 'drive' body = 'rotor' a = 10.0 b = 1.0 c = 0.0 /
&run t_end = 1.0 /
"""
ANY_TWIST = "inside an open gap, or where a law is level, any twist is steady: of 'claw' one near the start is kept"


def test_any_twist_inside_an_open_gap_is_steady_and_a_note_says_so(nocdyn):
    assert f"note: {ANY_TWIST}\n" in nocdyn("equilibrium", nocdyn.write("machine.nml", GAP)).stdout


@pytest.mark.parametrize(
    "beside",
    ["&load name = 'air' body = 'fan' viscous = 0.5 /", "&coupling name = 'spring' bodies = 'rotor', 'fan' stiffness = 9.0 /"],
)
def test_a_gap_that_a_torque_closes_or_a_spring_holds_has_one_twist(nocdyn, beside):
    outcome = nocdyn("equilibrium", nocdyn.write("machine.nml", GAP + beside + "\n"))
    assert outcome.returncode == 0 and ANY_TWIST not in outcome.stdout


def test_branches_without_load_keep_no_preloaded_loop_from_its_twists(nocdyn):
    assert nocdyn("equilibrium", DATA / "branches_without_load.nml", "--out", "out").returncode == 0
    (state,) = steady_states(nocdyn)
    moment = {label: value for label, value in state["values"].items() if label.startswith("moment")}
    motor = 74.31436267974439  # N m, through c3, c4 and c5 to the sun; carrier and ring have (z_s + z_r)/z_s and z_r/z_s of it
    assert [moment[f"moment_c{i} [N m]"] for i in (3, 4, 5)] == pytest.approx([-motor] * 3, rel=1e-11)
    assert moment["moment_c9 [N m]"] == pytest.approx(-motor * 98 / 29, rel=1e-11)
    assert [moment[f"moment_c{i} [N m]"] for i in (0, 1, 2, 10, 11)] == pytest.approx([0] * 5, abs=1e-10)
