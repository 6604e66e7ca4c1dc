"""nocdyn response and nocdyn campbell: against transients, closed forms and published numbers; what is refused."""

import cmath
import json
from math import log, pi, radians, sqrt

import numpy as np
import pytest
from conftest import fast_only

# A geared train in balance at SPEED of its first body, with the small moment of a shaker.
SPEED, AMPLITUDE = 41.226108832735, 0.01
TRAIN = f"""\
&body name = 'a' inertia = 2.0 speed = {SPEED} /
&body name = 'b' inertia = 1.0 /
&body name = 'p' inertia = 0.5 /
&body name = 'w' inertia = 3.0 /
&body name = 'f' inertia = 4.0 /
&coupling name = 'c1' bodies = 'a', 'b' stiffness = 4000 damping = 60 /
&coupling name = 'c2' bodies = 'b', 'p' stiffness = 7000 damping = 50 /
&coupling name = 'c3' bodies = 'w', 'f' stiffness = 9000 cubic_stiffness = 2e4 damping = 200 /
&gear name = 'g' bodies = 'p', 'w' radii = 0.1, 0.25 /
&motor name = 'm' body = 'a' a = 300 b = 2 c = 0 /
&load name = 'l' body = 'f' quadratic = 2.0 /
&output interval = 0.005 /
"""
RUN = "&run t_end = {} start = 'equilibrium' rtol = 1e-11 atol = 1e-13 method = 'rk853' /\n"
AT_SPEED = f"&response body = 'a' speed = {0.9 * SPEED!r}, {1.1 * SPEED!r} count = 3 /\n"


def analysis(nocdyn, command, text, *options):
    """The content of its JSON file."""
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, ""), outcome.stderr
    return json.loads((nocdyn.folder / f"out/{command}.json").read_text())


def refusal(nocdyn, command, text):
    outcome = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out")
    assert not (nocdyn.folder / "out").exists()
    return outcome.returncode, outcome.stderr


def line_fit(times, values, frequency):
    """Amplitude of exp(i frequency t) in equidistant values, with a window that suppresses everything else."""
    count = len(values)
    mean = sum(values) / count
    window = [1 - 1.93 * cmath.cos(x).real + 1.29 * cmath.cos(2 * x).real - 0.388 * cmath.cos(3 * x).real
              + 0.028 * cmath.cos(4 * x).real for x in (2 * pi * k / count for k in range(count))]  # fmt: skip
    total = sum(w * (v - mean) * cmath.exp(-1j * frequency * t) for w, v, t in zip(window, values, times, strict=True))
    return 2 * total / sum(window)


def test_response_to_a_harmonic_is_the_settled_transient(nocdyn):
    """Amplitudes and phases of moments, reaction and speed about a loaded state with a nonlinear coupling."""
    frequency = 60.0
    machine = TRAIN + f"&excitation name = 'x' body = 'b' amplitude = {AMPLITUDE} frequency = {frequency} phase = 0.3 /\n"
    outcome = nocdyn("run", nocdyn.write("run.nml", machine + RUN.format(16)), "--out", "run")
    assert outcome.returncode == 0, outcome.stderr
    motion = nocdyn.values("run", "trajectory.csv")
    analysis(nocdyn, "response", machine + RUN.format(1) + AT_SPEED)
    response, table = nocdyn.values(name="response_orders.csv"), nocdyn.values(name="response.csv")
    assert table["drive"][1] == pytest.approx(1, abs=1e-9)
    first = next(i for i, t in enumerate(motion["t"]) if t > 10)
    for column in ("total_moment_c1", "total_moment_c2", "total_moment_c3", "reaction_g", "phi_f"):
        values = motion[column][first:]
        if column == "phi_f":
            values = [v / (1j * frequency) for v in motion["omega_f"][first:]]
        settled = line_fit(motion["t"][first:], values, frequency)
        found = response[column][1] * cmath.exp(1j * radians(response["phase_" + column][1]))
        assert abs(found - settled) < 1e-6 * abs(settled), column
        if column.startswith("total_moment"):
            mean = sum(motion[column][first:]) / len(motion[column][first:])
            assert table["mean_" + column][1] == pytest.approx(mean, rel=1e-5)


@fast_only
def test_response_to_orders_is_the_settled_transient(nocdyn):
    """Orders of two bodies that a gear joins: their phases follow the angles of both."""
    amplitudes = [1e-2 * AMPLITUDE, 4e-3 * AMPLITUDE, 1e-2 * AMPLITUDE]
    machine = TRAIN + (
        f"&excitation name = 'x' body = 'b' kind = 'orders' orders = 1.5, 3 amplitudes = {amplitudes[0]}, {amplitudes[1]}\n"
        f"  phases = 0.3, 1.1 /\n&excitation name = 'y' body = 'f' kind = 'orders' orders = 5 amplitudes = {amplitudes[2]} /\n"
    )
    outcome = nocdyn("run", nocdyn.write("run.nml", machine + RUN.format(20)), "--out", "run")
    assert outcome.returncode == 0, outcome.stderr
    motion = nocdyn.values("run", "trajectory.csv")
    content = analysis(nocdyn, "response", machine + RUN.format(1) + AT_SPEED)
    assert [line["order"] for line in content["lines"]] == pytest.approx([1.5, 2.0, 3.0])
    response = nocdyn.values(name="response_orders.csv")
    first = next(i for i, t in enumerate(motion["t"]) if t > 10)
    times = motion["t"][first:]
    speed = (motion["phi_a"][-1] - motion["phi_a"][first]) / (times[-1] - times[0])
    start = motion["phi_a"][first] - speed * times[0]
    for line, order in enumerate([line["order"] for line in content["lines"]]):
        for column in ("total_moment_c1", "total_moment_c3", "reaction_g"):
            settled = line_fit(times, motion[column][first:], order * speed) * cmath.exp(-1j * order * start)
            found = response[column][3 + line] * cmath.exp(1j * radians(response["phase_" + column][3 + line]))
            assert abs(found - settled) < 1e-5 * abs(settled), (column, order)


# Two discs J_1, J_2 between which a shaft with the loss factor eta transmits the moment k (1 + i eta) u, shaken on the first one.
J_1, J_2, STIFFNESS, LOSS, SHAKER = 3.0, 2.0, 5.0e4, 0.02, 7.0
DISCS = f"""\
&body name = 'one' inertia = {J_1} /
&body name = 'two' inertia = {J_2} /
&coupling name = 'shaft' bodies = 'one', 'two' stiffness = {STIFFNESS} magnifier = {1 / LOSS} diameter = 0.1 bore = 0.04 /
&excitation name = 'x' body = 'one' kind = 'orders' orders = 2 amplitudes = {SHAKER} /
&run t_end = 1 /
&response body = 'one' speed_rpm = 300, 1500 count = 13 /
"""
NATURAL = sqrt(STIFFNESS * (1 / J_1 + 1 / J_2))


def disc_moment(speed):
    twist = SHAKER / J_1 / (NATURAL**2 * (1 + 1j * LOSS) - (2 * speed) ** 2)
    return abs(STIFFNESS * (1 + 1j * LOSS) * twist)


def damped_share(loss):
    """w / w0 of w^2 = w0^2 - (c / 2)^2 with the viscous damping c = loss w0^2 / w of the loss at the frequency w itself."""
    return sqrt((1 + sqrt(1 - loss**2)) / 2)


def test_two_discs_with_hysteretic_damping_have_the_closed_form(nocdyn):
    content = analysis(nocdyn, "response", DISCS)
    table = nocdyn.values(name="response.csv")
    for speed, moment in zip(table["omega_one"], table["half_range_moment_shaft"], strict=True):
        assert moment == pytest.approx(disc_moment(speed), rel=1e-10)
    damped = damped_share(LOSS)
    assert content["critical_speeds"][0]["speed_rad_s"] == pytest.approx(NATURAL / 2 * damped, rel=1e-12)
    assert content["critical_speeds"][0]["damping_ratio"] == pytest.approx(sqrt(1 - damped**2), rel=1e-10)
    shaft = content["largest"][0]
    assert shaft["half_range"] == pytest.approx(disc_moment(NATURAL / 2), rel=1e-6)  # a peak between the speeds of the grid
    modulus = pi / 16 * (0.1**4 - 0.04**4) / 0.1
    stress = content["largest"][1]
    assert stress["quantity"] == "stress_shaft"
    assert stress["half_range"] == pytest.approx(shaft["half_range"] / modulus, rel=1e-12)
    peak = np.argmax(table["heat_shaft"])
    heat = table["heat_shaft"][peak]  # force times rate of twist of the loss
    twist = table["half_range_moment_shaft"][peak] / abs(STIFFNESS * (1 + 1j * LOSS))
    assert heat == pytest.approx(0.5 * 2 * table["omega_one"][peak] * STIFFNESS * LOSS * twist**2, rel=1e-10)


def test_a_loaded_cubic_coupling_resonates_by_its_tangent_stiffness(nocdyn):
    """Motor, coupling k u + c u^3 and gear at a mean moment: k + 3 c u^2 between the motor and what the gear carries."""
    stiffness, twist, mean, inertia, ratio = 500.0, 0.04, 30.0, (0.4, 0.05, 2.25), 3.0
    cubic = (mean / twist - stiffness) / twist**2
    tangent = stiffness + 3 * cubic * twist**2
    assert tangent == pytest.approx(2.5 * stiffness)
    natural = sqrt(tangent * (1 / inertia[0] + 1 / (inertia[1] + inertia[2] / ratio**2))) / (2 * pi)
    machine = f"""\
&body name = 'motor' inertia = {inertia[0]} /
&body name = 'pinion' inertia = {inertia[1]} /
&body name = 'wheel' inertia = {inertia[2]} /
&coupling name = 'c' bodies = 'motor', 'pinion' stiffness = {stiffness} cubic_stiffness = {cubic} magnifier = 1e3 /
&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 60 /
&motor name = 'm' body = 'motor' kind = 'constant' torque = 1.0 /
&load name = 'l' body = 'wheel' constant = {mean * ratio} constant_speed = 1e-3 /
&excitation name = 'x' body = 'motor' kind = 'orders' orders = 1 amplitudes = 0.01 /
&run t_end = 1 /
&response body = 'motor' speed = {0.9 * 2 * pi * natural!r}, {1.1 * 2 * pi * natural!r} count = 21 /
"""
    content = analysis(nocdyn, "response", machine)
    means = nocdyn.values(name="response.csv")["mean_moment_c"]
    assert means == pytest.approx([-mean] * len(means), rel=1e-9)
    critical = content["critical_speeds"][0]
    assert critical["frequency_Hz"] == pytest.approx(natural * damped_share(1e-3), rel=1e-10)
    assert critical["peak_speed_rad_s"] == pytest.approx(2 * pi * natural, rel=1e-5)


@pytest.mark.parametrize("rest_twist", [0.0, 0.01])
def test_a_coupling_in_its_gap_or_at_the_edge_of_it_is_told(nocdyn, rest_twist):
    loose = "&body name = 'three' inertia = 1 /\n&coupling name = 'claw' bodies = 'two', 'three' stiffness = 1e4 gap = 0.02"
    loose += f" rest_twist = {rest_twist} /\n"
    for command in ("response", "campbell"):
        content = analysis(nocdyn, command, DISCS + loose)
        assert content["notes"][0].startswith("'claw' has no stiffness at ")
        assert content["notes"][0].endswith(
            " speeds: it is inside its gap, whose edge counts as inside, or its law is level there"
        )
    assert analysis(nocdyn, "response", DISCS)["notes"] == []


def test_a_gap_that_opens_is_told(nocdyn):
    """A coupling with play that a mean moment holds in contact, until the oscillation is larger than it."""
    text = DISCS.replace("magnifier = 50.0 diameter = 0.1 bore = 0.04", "gap = 0.01")
    assert text != DISCS
    text += "&motor name = 'm' body = 'one' kind = 'constant' torque = 40 /\n&load name = 'l' body = 'two' constant = 20 /\n"
    (note,) = [note for note in analysis(nocdyn, "response", text)["notes"] if "contact" in note]
    table = nocdyn.values(name="response.csv")
    pairs = zip(table["half_range_moment_shaft"], table["mean_moment_shaft"], strict=True)
    opened = sum(half > abs(mean) for half, mean in pairs)
    assert 0 < opened < len(table["mean_moment_shaft"])
    assert note.startswith(f"'shaft' oscillates by more than its mean at {opened} of {len(table['mean_moment_shaft'])} speeds")


def test_notes_tell_of_speeds_that_are_not_driven(nocdyn):
    falling = "&load name = 'l' body = 'two' table_speed = 0, 100, 200 table_torque = 5, 0, -5 /\n"
    driven = DISCS + "&motor name = 'm' body = 'one' kind = 'constant' torque = 5 /\n" + falling
    (note,) = analysis(nocdyn, "response", driven)["notes"]
    assert note.startswith("the motors or engines do not drive at ")
    rule = "&limit coupling = 'shaft' rule = 'iacs_m68' tensile_strength = 600e6 rated_speed_rpm = 200 /\n"
    (note,) = analysis(nocdyn, "response", DISCS + rule)["notes"]
    assert note.endswith("the rated speed of 200 rpm is that of the body of &response, which turns with 300 to 1500 rpm")


GEARED = """\
&body name = 'rotor' inertia = 2 /
&body name = 'pinion' inertia = 0.1 /
&body name = 'wheel' inertia = 1 /
&body name = 'fan' inertia = 30 /
&coupling name = 'fast' bodies = 'rotor', 'pinion' stiffness = 4000 damping = 4 /
&coupling name = 'slow' bodies = 'wheel', 'fan' stiffness = 9000 damping = 9 /
&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 60 /
&load name = 'l' body = 'fan' quadratic = 0.2 /
&excitation name = 'x' body = 'fan' kind = 'orders' orders = 2 amplitudes = 10 /
&run t_end = 1 /
&response body = 'fan' speed_rpm = 60, 450 count = 5 /
"""


@pytest.mark.parametrize("command", ["response", "campbell"])
@pytest.mark.parametrize(
    "drive",
    [
        "&motor name = 'm' body = 'rotor' kind = 'constant' torque = 160",
        "&motor name = 'm' body = 'rotor' kind = 'induction' breakdown_torque = 500 breakdown_slip = 0.1 "
        "synchronous_speed_rpm = 1500",
        "&motor name = 'm' body = 'rotor' kind = 'induction_dq' voltage = 400 frequency_hz = 50 poles = 4 rated_power = 45e3 "
        "rated_speed_rpm = 1475 efficiency = 0.94 power_factor = 0.86 breakdown_ratio = 2.6",
        "&engine name = 'm' stroke = 4 cylinders = 'rotor' firing = 0 orders = 0.5 amplitudes = 10 mean_torque = 160",
    ],
)
def test_speeds_against_the_drive_are_refused_with_the_steady_one(nocdyn, command, drive):
    text = GEARED + drive + " /\n"
    path = nocdyn.write("machine.nml", text)
    report = nocdyn("equilibrium", path, "--set", "output.units=rpm").stdout
    steady = next(line.split()[-1] for line in report.splitlines() if "omega_fan [rpm]" in line)
    code, error = refusal(nocdyn, command, text)
    assert code == 2
    assert "machine.nml:11: &response: speed_rpm: the motors or engines turn 'fan'" in error and error.count("\n") == 1
    assert float(error.split("its steady speed is ")[1].split(" rpm")[0]) == pytest.approx(float(steady), rel=1e-5)
    assert "allowed: speeds of the other sign, e.g. speed_rpm = -60, -450" in error
    content = analysis(nocdyn, command, text.replace("60, 450", "-60, -450"))
    assert not any("do not drive" in note for note in content["notes"])


def test_every_command_refuses_speeds_in_the_wrong_order(nocdyn):
    path = nocdyn.write("machine.nml", DISCS.replace("300, 1500", "1500, 300").replace("magnifier = 50.0", ""))
    for command in ("run", "check", "modes", "response"):
        outcome = nocdyn(command, path)
        assert outcome.returncode == 2
        assert "allowed: first the slower speed, then the faster one" in outcome.stderr


def test_limits_bar_the_speeds_where_the_closed_form_exceeds_them(nocdyn):
    limit = 40.0
    content = analysis(nocdyn, "response", DISCS + f"&limit coupling = 'shaft' vibratory_moment = {limit} /\n")
    assert content["limits_exceeded"]
    (barred,) = content["barred_speed_ranges"]
    assert not barred["can_be_passed"]  # there is no limit for passing
    for end in ("from_rad_s", "to_rad_s"):
        assert disc_moment(barred[end]) == pytest.approx(limit, rel=1e-4)
    assert content["largest"][0]["ratio_to_limit"] == pytest.approx(disc_moment(NATURAL / 2) / limit, rel=1e-6)
    content = analysis(nocdyn, "response", DISCS + "&limit coupling = 'shaft' vibratory_moment = 1e4 moment = 1e4 /\n")
    assert not content["limits_exceeded"]
    assert content["barred_speed_ranges"] == []
    table = nocdyn.values(name="response.csv")
    assert set(table["limit_moment_shaft"]) == set(table["peak_limit_moment_shaft"]) == {1e4}


def test_iacs_rule_has_its_formula(nocdyn):
    """UR M68: tau_C = (sigma_B + 160) / 18 c_K c_D (3 - 2 lambda^2), or 1.38 from lambda = 0.9 on."""
    c_k, strength, rated, diameter = 0.8, 600, 1200, 100
    limit = (
        f"&limit coupling = 'shaft' rule = 'iacs_m68' tensile_strength = {strength}e6 c_k = {c_k} rated_speed_rpm = {rated} /\n"
    )
    analysis(nocdyn, "response", DISCS + limit)
    table = nocdyn.values(name="response.csv")
    for speed, found, passing in zip(
        table["omega_one"], table["limit_stress_shaft"], table["transient_limit_stress_shaft"], strict=True
    ):
        share = speed * 30 / pi / rated
        shape = 3 - 2 * share**2 if share < 0.9 else 1.38
        stress = (strength + 160) / 18 * c_k * (0.35 + 0.93 * diameter**-0.2) * shape
        assert found == pytest.approx(1e6 * stress, rel=1e-12)
        assert passing == pytest.approx(1.7 * found / sqrt(c_k) if share < 0.8 else found, rel=1e-12)


def test_the_iacs_rule_accepts_no_barred_range_near_the_rated_speed(nocdyn):
    """From lambda = 0.8 on; the peak of the discs is at 974.6 rpm."""
    limit = "&limit coupling = 'shaft' rule = 'iacs_m68' tensile_strength = 4e8 c_k = 0.1 rated_speed_rpm = {} /\n"
    strong = DISCS.replace("amplitudes = 7.0", "amplitudes = {}")
    for rated, is_allowed in ((1300, True), (1100, False)):
        nocdyn.write("machine.nml", strong.format(70) + limit.format(rated))
        printed = nocdyn("response", "machine.nml", "--out", "out").stdout
        (barred,) = json.loads((nocdyn.folder / "out/response.json").read_text())["barred_speed_ranges"]
        assert barred["is_allowed"] == is_allowed
        assert ("not allowed by IACS UR M68 from lambda 0.8 on" in printed) != is_allowed
        assert is_allowed or not barred["can_be_passed"]


def test_half_range_is_that_of_the_sum_over_time(nocdyn):
    orders, phases = [1, 2.5, 4], [20, -75, 140]
    text = DISCS.replace("orders = 2 amplitudes = 7.0", "orders = 1, 2.5, 4 amplitudes = 7, 5, 6 phases_deg = 20, -75, 140")
    analysis(nocdyn, "response", text)
    response, table = nocdyn.values(name="response_orders.csv"), nocdyn.values(name="response.csv")
    assert len(phases) == len(orders)
    for row in (0, len(table["omega_one"]) // 2):
        terms = [
            response["moment_shaft"][3 * row + k] * cmath.exp(1j * radians(response["phase_moment_shaft"][3 * row + k]))
            for k in range(3)
        ]
        count = 40000  # samples of two turns
        values = [
            sum((a * cmath.exp(1j * n * 4 * pi * i / count)).real for a, n in zip(terms, orders, strict=True))
            for i in range(count)
        ]
        assert table["half_range_moment_shaft"][row] == pytest.approx((max(values) - min(values)) / 2, rel=1e-6)


def test_frequencies_of_a_loaded_cubic_coupling_move_with_the_speed(nocdyn):
    """K = k + 3 k3 w^2 with k w + k3 w^3 = the torque of a fan, c omega^2."""
    k, k3, fan = 100.0, 10.0, 0.05
    text = f"""\
&body name = 'motor' inertia = 2 /
&body name = 'fan' inertia = 3 /
&coupling name = 'shaft' bodies = 'motor', 'fan' stiffness = {k} cubic_stiffness = {k3} damping = 0.1 /
&motor name = 'm' body = 'motor' kind = 'constant' torque = 10 /
&load name = 'l' body = 'fan' quadratic = {fan} /
&run t_end = 1 /
&response body = 'motor' speed = 10, 60 count = 26 orders = 0.5 /
"""

    def natural(speed):
        twist = 1.0
        for _ in range(50):
            twist -= (k * twist + k3 * twist**3 - fan * speed**2) / (k + 3 * k3 * twist**2)
        return sqrt((k + 3 * k3 * twist**2) * (1 / 2 + 1 / 3))

    content = analysis(nocdyn, "campbell", text)
    table = nocdyn.values(name="campbell.csv")
    for speed, frequency in zip(table["omega_motor"], table["undamped_frequency_1"], strict=True):
        assert 2 * pi * frequency == pytest.approx(natural(speed), rel=1e-9)
    for crossing in content["crossings"]:
        damped = natural(crossing["speed_rad_s"]) * sqrt(1 - crossing["damping_ratio"] ** 2)
        assert 0.5 * crossing["speed_rad_s"] == pytest.approx(damped, rel=2e-3)  # the damping is not modal
        assert 2 * pi * crossing["frequency_Hz"] == pytest.approx(0.5 * crossing["speed_rad_s"], rel=1e-8)
    assert len(content["crossings"]) == 1


SHAKEN = "&excitation name = 'x' body = 'one' kind = 'orders' orders = 2 amplitudes = 7.0 /"
HELD = "&coupling name = 'g' bodies = 'ground', 'two' stiffness = 1 /\n&run"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("&response body = 'one' speed_rpm = 300, 1500 count = 13 /", "", "machine.nml: there is no group &response; required"),
        (
            "speed_rpm = 300, 1500",
            "speed = 90, 30",
            "machine.nml:6: &response: speed = 90, 30 rad/s, which is 859.437, 286.479 rpm; allowed: first the slower speed",
        ),
        ("speed_rpm = 300, 1500", "speed = -10, 30", "both with one sign"),
        ("speed_rpm = 300, 1500", "speed_rpm = -900, -300", "&response: speed_rpm = -900, -300; allowed: first the slower"),
        ("count = 13", "orders = 3", "no excitation has the order 3 of 'one'; the orders of the excitations are 2"),
        (SHAKEN, "", "nothing excites this machine"),
        ("&run", "&limit coupling = 'shaft' /\n&run", "&limit: nothing is limited; needed: vibratory_moment, moment, stress"),
        ("13 /", "13 /\n&limit coupling = 'shift' moment = 1 /", "there is no coupling 'shift'; did you mean 'shaft'?"),
        ("magnifier = 50.0", "magnifier = 50 relative_damping = 0.1", "relative_damping"),
        ("diameter = 0.1 bore = 0.04", "diameter = 0.04 bore = 0.1", "bore"),
        (
            "diameter = 0.1 bore = 0.04 /",
            "/\n&limit coupling = 'shaft' stress = 1e7 /",
            "stress limits a stress, but 'shaft' has none",
        ),
        ("&run", HELD, "'one' is held by couplings or joints: it has no steady speed but 0"),
    ],
)
def test_responses_that_cannot_be_are_refused(nocdyn, old, new, message):
    assert old in DISCS
    text = DISCS.replace(old, new)
    code, error = refusal(nocdyn, "response", text)
    assert message in error
    assert code == 2


def test_unstable_steady_states_are_refused_with_their_speed(nocdyn):
    falling = "&load name = 'l' body = 'one' table_speed = 0, 10, 1000 table_torque = 0, 10, 9 extrapolation = 'constant' /\n"
    text = DISCS.replace("magnifier = 50.0", "damping = 1e-6").replace("&run", falling + "&run")
    code, error = refusal(nocdyn, "response", text)
    assert "machine.nml:7: &response: at 300 rpm (31.4159 rad/s): the steady state is unstable: an oscillation with" in error
    assert code == 1


def test_relative_damping_needs_a_frequency_over_the_time(nocdyn):
    """A run refuses it; with damping_frequency it is viscous, and the response at this frequency stays."""
    code, error = refusal(nocdyn, "run", DISCS)
    assert "machine.nml:3: &coupling 'shaft': its relative damping has no meaning over the time; required: damping_freq" in error
    assert code == 2
    outcome = nocdyn("check", nocdyn.folder / "machine.nml")
    assert "note: nocdyn run refuses it: " in outcome.stdout
    assert "response: 13 speeds of one from 300 to 1500 rpm" in outcome.stdout
    assert (outcome.returncode, outcome.stderr) == (0, "")
    viscous = DISCS.replace("magnifier = 50.0", f"magnifier = 50.0 damping_frequency = {NATURAL!r}")
    content = analysis(nocdyn, "response", viscous)
    assert content["largest"][0]["half_range"] == pytest.approx(disc_moment(NATURAL / 2), rel=1e-6)
    outcome = nocdyn("modes", nocdyn.write("viscous.nml", viscous), "--out", "modes")
    (mode,) = (m for m in json.loads((nocdyn.folder / "modes/modes.json").read_text())["modes"] if m["kind"] == "oscillating")
    ratio = sqrt((1 - sqrt(1 - LOSS**2)) / 2)  # the loss is that at the damped frequency
    assert mode["damping_ratio"] == pytest.approx(ratio, rel=1e-9)


def test_a_run_compares_its_moments_with_their_limits(nocdyn):
    text = (
        DISCS.replace("magnifier = 50.0", "damping = 1").replace("3.0 /", "3.0 speed = 5 /")
        + "&limit coupling = 'shaft' moment = {} /\n"
    )
    outcome = nocdyn("run", nocdyn.write("machine.nml", text.format(0.5)), "--out", "out")
    summary = nocdyn.summary("out")
    assert summary["limits_exceeded"]
    (line,) = summary["verdict"]["lines"]
    column = summary["columns"]["total_moment_shaft [N m]"]
    assert (line["element"], line["quantity"], line["unit"]) == ("coupling 'shaft'", "total_moment_shaft", "N m")
    assert line["value"] == max(abs(column["min"]), abs(column["max"]))
    assert "verdict: exceeded (1 exceeded)" in outcome.stdout
    outcome = nocdyn("run", nocdyn.write("machine.nml", text.format(1e6)), "--out", "out")
    assert not nocdyn.summary("out")["limits_exceeded"]
    assert "verdict: kept (1 kept)" in outcome.stdout


def test_undamped_resonance_is_called_unbounded(nocdyn):
    outcome = nocdyn("response", nocdyn.write("machine.nml", DISCS.replace("magnifier = 50.0", "")), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert "unbounded" in outcome.stdout
    content = json.loads((nocdyn.folder / "out/response.json").read_text())
    assert "moment_N_m" not in content["critical_speeds"][0]
    assert log(content["largest"][0]["half_range"]) < log(1e6)


def test_a_chain_of_bodies_needs_no_dense_matrix(nocdyn):
    count = 3000
    text = "".join(f"&body name = 'b{i}' inertia = 1 /\n" for i in range(count))
    text += "".join(
        f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e6 damping = 10 /\n" for i in range(count - 1)
    )
    text += "&excitation name = 'x' body = 'b0' kind = 'orders' orders = 1 amplitudes = 1 /\n&run t_end = 1 /\n"
    text += "&response body = 'b0' speed = 10, 20 count = 10 /\n"
    content = analysis(nocdyn, "response", text)
    assert "neither critical speeds nor peaks between the speeds of the grid are found for more than 600" in content["notes"][0]


def test_a_peak_beyond_its_limit_is_told_beside_a_barred_range(nocdyn):
    text = DISCS.replace("&run", "&limit coupling = 'shaft' vibratory_moment = 1e-3 moment = 1e-2 /\n&run")
    nocdyn.write("machine.nml", text)
    printed = nocdyn("response", "machine.nml", "--out", "out").stdout
    report = json.loads((nocdyn.folder / "out/response.json").read_text())
    (one,) = [one for one in report["largest"] if "peak_ratio_to_limit" in one]
    assert one["peak_ratio_to_limit"] == pytest.approx(one["peak"] / 1e-2, rel=1e-12)
    assert one["ratio_to_limit"] > one["peak_ratio_to_limit"] > 1
    assert "verdict: exceeded (2 exceeded)" in printed
    assert " moment, continuous " in printed and " moment, largest " in printed


def test_columns_of_the_printed_table_are_apart(nocdyn):
    text = GEARED + "&motor name = 'm' body = 'rotor' kind = 'constant' torque = 160 /\n"
    text = text.replace("body = 'fan' speed_rpm = 60, 450", "body = 'rotor' speed_rpm = 180, 1350")
    lines = nocdyn("response", nocdyn.write("machine.nml", text)).stdout.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("  mode "))
    row = lines[first + 1].split()
    assert row[2] == "0.666667"
    assert lines[first].index("order") + len("order") == lines[first + 1].index(row[2]) + len(row[2])
