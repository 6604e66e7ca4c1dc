"""Periodic motions of nonlinear machines: known folds and amplitudes, runs that have settled, multipliers by integration."""

import json
import random

import numpy as np
import pytest
from conftest import SOURCE, Values, all_if_fast
from verified import known

DUFFING = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' stiffness = 1.0 cubic_stiffness = 0.1 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 0.8 /
&run t_end = 10.0 /
"""
OVER = "&orbit over = 'excitation.shaker.frequency' range = {}, {} {} /\n"
FOLDS = (known("orbit.fold_up"), known("orbit.fold_down"))
LARGEST = {  # of stable motions
    0.8: [known("orbit.before")],
    1.0: [known("orbit.on_the_way")],
    1.2: [known("orbit.upper"), known("orbit.lower")],
}
PRINTED = 6e-10  # half of the last digit of these numbers, and a little

# m 1, 0.05; k 1, 0.0453; c 0.002, 0.013; k3 1, 0.0042
TWO_MASSES = """\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 0.05 /
&coupling name = 'spring' bodies = 'ground', 'a' stiffness = 1.0 cubic_stiffness = 1.0 damping = 0.002 /
&coupling name = 'absorber' bodies = 'a', 'b' stiffness = 0.0453 cubic_stiffness = 0.0042 damping = 0.013 /
&excitation name = 'shaker' body = 'a' amplitude = 0.11 frequency = 0.8 /
&run t_end = 10.0 /
"""
NEIMARK_SACKER = (known("orbit.second_frequency_begins"), known("orbit.second_frequency_ends"))

SPECIAL = {"fold": 1, "period_doubling": 2, "neimark_sacker": 3, "branch_point": 4, "torque_fold": 5}


def branch(nocdyn, text, *words):
    """The columns of orbit.csv and the report."""
    nocdyn.done(text, *words, command="orbit")
    return nocdyn.values("out", "orbit.csv"), json.loads((nocdyn.folder / "out/orbit.json").read_text())


def refused(nocdyn, text, *words):
    outcome = nocdyn("orbit", nocdyn.write("machine.nml", text), *words)
    assert outcome.returncode in (1, 2), outcome.stdout + outcome.stderr
    return outcome.stderr


def specials(report, kind):
    return [point["value"] for point in report["special_points"] if point["kind"] == kind]


def at(values, parameter, value):
    """The rows at a value of the parameter."""
    rows = np.abs(values[parameter] - value) < 1e-12
    return Values({label: column[rows] for label, column in values.items()})


def test_a_hardening_spring_has_the_known_folds_and_amplitudes(nocdyn):
    values, report = branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "count = 5 tolerance = 1e-10"))
    assert specials(report, "fold") == pytest.approx(FOLDS, abs=1e-8)
    for frequency, expected in LARGEST.items():
        rows = at(values, "excitation.shaker.frequency", frequency)
        largest = rows["largest_phi_mass"][rows["stable"] == 1]
        assert largest == pytest.approx(expected, abs=PRINTED)
    assert report["largest_error"] < report["tolerance"]


def test_a_jump_is_told_alike_where_points_are_next_to_the_fold(nocdyn):
    more = "count = 5001 most_points = 20000 harmonics = 5 stability = .true."
    outcome = nocdyn.done(DUFFING + OVER.format(1.2, 1.1, more), command="orbit")
    assert "at 1.115700252 rad/s: fold; a falling value jumps there" in outcome.stdout


def test_the_motion_between_the_folds_is_unstable_and_the_report_says_where_it_jumps(nocdyn):
    outcome = nocdyn.done(DUFFING + OVER.format(0.8, 1.6, ""), command="orbit")
    assert "at 1.269601956 rad/s: fold; a rising value jumps there" in outcome.stdout
    assert "at 1.115700252 rad/s: fold; a falling value jumps there" in outcome.stdout
    assert "unstable from 1.269601956 rad/s to 1.115700252 rad/s" in outcome.stdout


def test_a_branch_from_the_other_end_has_the_same_folds(nocdyn):
    _, report = branch(nocdyn, DUFFING + OVER.format(1.6, 0.8, ""))
    assert specials(report, "fold") == pytest.approx(FOLDS[::-1], abs=1e-8)


def test_two_masses_have_the_known_folds_and_an_interval_of_two_frequencies(nocdyn):
    _, report = branch(nocdyn, TWO_MASSES + OVER.format(0.8, 1.4, ""))
    assert len(specials(report, "fold")) == 2
    assert specials(report, "neimark_sacker") == pytest.approx(NEIMARK_SACKER, abs=6e-5)
    unstable = [(part["from"], part["to"]) for part in report["parts"] if not part["stable"]]
    assert len(unstable) == 2


def test_a_branch_can_begin_where_nothing_oscillates(nocdyn):
    text = DUFFING.replace("damping = 0.05", "damping = 0.1").replace("frequency = 0.8", "frequency = 1.2")
    _, report = branch(nocdyn, text + "&orbit over = 'excitation.shaker.amplitude' range = 0.0, 0.5 /\n")
    rising, falling = specials(report, "fold")
    for amplitude in (rising, falling):  # the same folds over the frequency, at these amplitudes
        other = text.replace("amplitude = 0.18", f"amplitude = {amplitude!r}") + OVER.format(0.6, 1.6, "")
        _, over_frequency = branch(nocdyn, other)
        assert min(abs(fold - 1.2) for fold in specials(over_frequency, "fold")) < 1e-8


# The same equations once more, for references by shooting: integration with the variational equations, and Newton's method.
MASS, STIFFNESS, CUBIC = np.diag((1.0, 0.05)), (1.0, 0.0453), (1.0, 0.0042)
DAMPING, FORCE = (0.002, 0.013), 0.11
INTEGRATED = 1e-6  # of multipliers, asked for


def two_masses(t, z, rate):
    y, matrix = z[:4], z[4:].reshape(4, 4)
    twists = np.array([[1.0, 0.0], [-1.0, 1.0]])
    u, v = twists @ y[:2], twists @ y[2:]
    moments = [-k * w - k3 * w**3 - c * s for k, k3, c, w, s in zip(STIFFNESS, CUBIC, DAMPING, u, v, strict=True)]
    slopes = np.diag([-k - 3 * k3 * w**2 for k, k3, w in zip(STIFFNESS, CUBIC, u, strict=True)])
    inverse = np.linalg.inv(MASS)
    force = np.array([FORCE * np.cos(rate * t), 0.0])
    acceleration = inverse @ (twists.T @ moments + force)
    jacobian = np.zeros((4, 4))
    jacobian[:2, 2:] = np.eye(2)
    jacobian[2:, :2] = inverse @ twists.T @ slopes @ twists
    jacobian[2:, 2:] = -inverse @ twists.T @ np.diag(DAMPING) @ twists
    return np.concatenate([y[2:], acceleration, (jacobian @ matrix).ravel()])


def shot(start, rate):
    """The state at the begin of the periodic motion near a state, and its multipliers."""
    integrate = pytest.importorskip("scipy.integrate")
    for _ in range(12):
        begin = np.concatenate([start, np.eye(4).ravel()])
        end = integrate.solve_ivp(
            two_masses, (0, 2 * np.pi / rate), begin, args=(rate,), method="DOP853", rtol=1e-12, atol=1e-13
        ).y[:, -1]
        matrix = end[4:].reshape(4, 4)
        change = np.linalg.solve(matrix - np.eye(4), start - end[:4])
        start = start + change
        if np.abs(change).max() < 1e-10:
            break
    return start, np.linalg.eigvals(matrix)


def test_multipliers_are_those_of_the_integrated_variational_equations(nocdyn):
    values, _ = branch(nocdyn, TWO_MASSES + OVER.format(0.8, 1.2, "count = 5"))
    start = np.zeros(4)
    for rate in np.linspace(0.8, 1.2, 41):
        start, expected = shot(start, rate)
        rows = at(values, "excitation.shaker.frequency", round(rate, 10))
        if rows["stable"].size == 0:
            continue
        found = [rows[f"multiplier_{i}_real"][0] + 1j * rows[f"multiplier_{i}_imaginary"][0] for i in range(1, 5)]
        for multiplier in expected:
            assert min(abs(multiplier - other) for other in found) < INTEGRATED
    assert rows["stable"][0] == 1  # behind the interval in which it is not
    assert at(values, "excitation.shaker.frequency", 1.1)["stable"][0] == 1


def random_machine(seed):
    """A smooth machine on the ground or free to turn, with what is varied and its value."""
    chance = random.Random(f"orbit {seed}")

    def some(low, high):
        return float(f"{chance.uniform(low, high):.4g}")

    count, is_free = chance.randint(2, 4), seed % 2 == 0
    speed = some(40, 90)
    text = "".join(f"&body name = 'b{i}' inertia = {some(0.5, 3)} /\n" for i in range(count))
    if is_free:
        text = text.replace(" /\n", f" speed = {speed} /\n")
    for i in range(1 if is_free else 0, count):
        k = some(200, 3000)
        law = chance.choice(
            (
                f"cubic_stiffness = {some(0.2, 3) * k}",
                f"polynomial = 0.0, {some(-0.5, 0.5) * k}, {some(0.5, 4) * k}",
                f"saturation = {some(0.5, 2) * k}",
                f"cubic_stiffness = {k} maxwell_stiffness = {some(0.1, 0.5) * k} maxwell_time = {some(0.005, 0.05)}",
            )
        )
        first = f"b{i - 1}" if i else "ground"
        text += f"&coupling name = 'c{i}' bodies = '{first}', 'b{i}' stiffness = {k} damping = {0.05 * k**0.5} {law} /\n"
    amplitude, rate = some(20, 100), some(8, 60)
    if is_free:
        text += (
            f"&motor name = 'm' body = 'b0' kind = 'dc' voltage = {2.2 * speed} resistance = 0.6 flux_constant = 2.0"
            f" inductance = 0.02 /\n&load name = 'w' body = 'b{count - 1}' quadratic = {40 / speed**2} /\n"
            f"&excitation name = 'e' body = 'b0' kind = 'orders' orders = 0.5, 1.0 amplitudes = {amplitude}, {0.4 * amplitude}"
            " phases = 0.0, 0.7 /\n"
        )
        return text, "excitation.e.amplitudes(1)", amplitude
    text += f"&excitation name = 'e' body = 'b{count - 1}' amplitude = {amplitude} frequency = {rate} /\n"
    return text, "excitation.e.frequency", rate


SETTLED = 1e-7  # of the half range, asked for


@pytest.mark.parametrize("seed", all_if_fast(0, 1, 2, 3, 5, 8))
def test_stable_motions_are_those_of_settled_runs(nocdyn, seed):
    text, over, value = random_machine(seed)
    orbit = f"&orbit over = '{over}' range = {value!r}, {1.01 * value!r} tolerance = 1e-9 /\n"
    values, _ = branch(nocdyn, text + orbit + "&run t_end = 1.0 /\n")
    assert values["stable"][0] == 1
    period = float(2 * np.pi / values["rate"][0])
    largest = abs(values["multiplier_1_real"][0] + 1j * values["multiplier_1_imaginary"][0])
    end = float((np.log(1e-10) / np.log(largest) + 3) * period)
    nocdyn.done(
        f"{text}&run t_end = {end!r} start = 'equilibrium' method = 'rk853' rtol = 1e-12 atol = 1e-13 max_steps = 10000000 /\n"
        f"&output extremes_from = {end - 1.02 * period!r} points = 11 /\n"
    )
    columns = nocdyn.summary("out")["columns"]
    compared = 0
    for label, extremes in columns.items():
        if f"half_range_{label}" not in values or (label.startswith("phi") and "kind = 'dc'" in text):
            continue
        half_range = values[f"half_range_{label}"][0]
        assert (extremes["max"] - extremes["min"]) / 2 == pytest.approx(half_range, abs=SETTLED * half_range), label
        compared += 1
    assert compared > 8


def test_the_mean_speed_of_a_free_train_is_found_and_can_be_held(nocdyn):
    text, over, amplitude = random_machine(0)
    text += "&run t_end = 1.0 /\n"
    free, _ = branch(nocdyn, text + f"&orbit over = '{over}' range = {amplitude!r}, {1.1 * amplitude!r} /\n")
    speed = float(free["mean_omega_b0"][0])
    held, _ = branch(nocdyn, text + f"&orbit body = 'b0' speed = {speed!r}, {1.1 * speed!r} /\n")
    assert abs(held["torque_b0"][0]) < 1e-6 * abs(free["mean_torque_m"][0])
    for label in ("half_range_omega_b0", "half_range_twist_c1"):
        assert held[label][0] == pytest.approx(free[label][0], rel=1e-7)
    assert held["mean_omega_b0"] == pytest.approx(held["mean_speed_b0"])
    assert held["torque_b0"][-1] > 0  # the load grows with the speed, the torque of the motor falls


def test_a_held_speed_has_folds_of_its_own_and_multipliers_at_constant_torque(nocdyn):
    text = (SOURCE / "docs/tutorial/hardening.nml").read_text()
    values, report = branch(nocdyn, text)
    speeds, torques = values["mean_speed_engine"], values["torque_engine"]
    assert len(specials(report, "fold")) == len(specials(report, "torque_fold")) == 4
    for row in np.flatnonzero(values["special"]):
        turns = speeds if values["special"][row] == SPECIAL["fold"] else torques
        before, after = turns[row] - turns[row - 1], turns[row + 1] - turns[row]
        assert before * after < 0  # it turns back exactly there
    rows = values["special"] == SPECIAL["torque_fold"]
    assert values["multiplier_1_real"][rows] == pytest.approx(1, abs=1e-8)
    free = text.replace("body = 'engine'  speed_rpm = 600, 1400", "over = 'motor.mean.torque' range = 210.0, 225.0")
    assert free != text
    _, over_torque = branch(nocdyn, free)
    assert specials(over_torque, "fold") == pytest.approx(150 + torques[rows], rel=1e-7)


PERIOD_DOUBLING = """\
&body name = 'mass' inertia = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'mass' cubic_stiffness = 1.0 damping = 0.05 /
&excitation name = 'shaker' body = 'mass' amplitude = 7.5 frequency = 1.0 /
&motor name = 'bias' body = 'mass' kind = 'constant' torque = 0.5 /
&run t_end = 10.0 /
"""


def test_a_period_doubling_has_a_multiplier_of_minus_one(nocdyn):
    values, report = branch(nocdyn, PERIOD_DOUBLING + OVER.format(6.0, 2.7, ""))
    assert len(specials(report, "period_doubling")) == 1
    row = list(values["special"]).index(SPECIAL["period_doubling"])
    assert values["multiplier_1_real"][row] == pytest.approx(-1, abs=1e-8)


def test_a_subharmonic_of_two_has_the_squares_of_the_multipliers(nocdyn):
    one, _ = branch(nocdyn, DUFFING + OVER.format(0.8, 0.81, ""))
    two, _ = branch(nocdyn, DUFFING + OVER.format(0.8, 0.81, "subharmonic = 2"))
    assert two["rate"][0] == pytest.approx(0.4)
    assert two["largest_phi_mass"][0] == pytest.approx(one["largest_phi_mass"][0], rel=1e-9)
    first, second = (x["multiplier_1_real"][0] + 1j * x["multiplier_1_imaginary"][0] for x in (one, two))
    assert min(abs(first**2 - second), abs(first**2 - second.conjugate())) < 1e-9


def test_too_few_harmonics_are_marked_by_the_error(nocdyn):
    outcome = nocdyn.done(DUFFING + OVER.format(0.9, 0.95, "harmonics = 3"), command="orbit")
    values = nocdyn.values("out", "orbit.csv")
    exact, _ = branch(nocdyn, DUFFING + OVER.format(0.9, 0.95, "tolerance = 1e-11"))
    error = abs(values["half_range_phi_mass"][0] / exact["half_range_phi_mass"][0] - 1)
    assert error / 2 < values["error"][0] < 100 * error
    assert "an error above the tolerance, 1e-08" in outcome.stdout


def test_a_chain_of_two_hundred_bodies_goes_through_the_banded_equations(nocdyn):
    def chain(count):
        names = ["ground", *(f"b{i}" for i in range(1, count + 1))]
        bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(1, count + 1))
        springs = "".join(
            f"&coupling name = 'c{i}' bodies = '{names[i - 1]}', 'b{i}' stiffness = 1e6 cubic_stiffness = 2e9 damping = 30.0 /\n"
            for i in range(1, count + 1)
        )
        shaker = f"&excitation name = 'shaker' body = 'b{count}' amplitude = 300.0 frequency = 12.0 /\n"
        return bodies + springs + shaker + "&run t_end = 1.0 /\n"

    orbit = OVER.format(12.0, 12.2, "harmonics = 3 signals = 'twist_c1'")
    outcome = nocdyn.done(chain(200) + orbit, command="orbit")
    assert "the stability is not determined" in outcome.stdout
    values = nocdyn.values("out", "orbit.csv")
    assert "stable" not in values.by_name()
    assert (values["error"] < 1e-6).all()
    small, _ = branch(nocdyn, chain(4) + orbit)
    assert "stable" in small.by_name()


def test_stiff_parts_change_no_multipliers(nocdyn):
    text = DUFFING + OVER.format(0.8, 0.81, "count = 2")
    stiff = text.replace(
        "&run",
        "&body name = 'tip' inertia = 1e-6 /\n&coupling name = 'tip' bodies = 'mass', 'tip' stiffness = 1e4 damping = {} /\n&run",
    )
    soft, _ = branch(nocdyn, text)
    values, _ = branch(nocdyn, stiff.format(1.0))
    assert values["largest_phi_mass"][0] == pytest.approx(soft["largest_phi_mass"][0], rel=1e-4)
    for label in ("multiplier_1_real", "multiplier_1_imaginary", "multiplier_2_real", "multiplier_2_imaginary"):
        assert values[label][0] == pytest.approx(soft[label][0], abs=1e-4)
    assert max(abs(values["multiplier_3_real"])) < 1e-6
    undamped, _ = branch(nocdyn, stiff.format(1e-7).replace("1e4", "1e9"))  # of many oscillations in a period
    assert "stable" in values.by_name() and "stable" not in undamped.by_name()


def test_load_cases_have_branches_of_their_own(nocdyn):
    cases = (
        "&load_case name = 'weak' set = 'excitation.shaker.amplitude=0.05' /\n&load_case name = 'strong' analyses = 'orbit' /\n"
    )
    nocdyn.done(DUFFING + cases + OVER.format(0.8, 1.6, ""), command="orbit")
    folds = [specials(json.loads((nocdyn.folder / f"out/{case}/orbit.json").read_text()), "fold") for case in ("weak", "strong")]
    assert [len(found) for found in folds] == [0, 2]


ISOLATED = (1.37013788, 1.38623761)  # largest angles of both motions at 1.6 rad/s with P 0.15, by another harmonic balance


def test_scattered_starts_find_an_isolated_branch(nocdyn):
    text = TWO_MASSES.replace("amplitude = 0.11", "amplitude = 0.15") + OVER.format(1.9, 0.8, "starts = 64 count = 12")
    outcome = nocdyn.done(text, command="orbit")
    assert "64 scattered starts" in outcome.stdout and "branch 2 is isolated: from 1.574" in outcome.stdout
    report = json.loads((nocdyn.folder / "out/orbit.json").read_text())
    assert report["starts"]["isolated_branches"] == 1
    rows = at(nocdyn.values("out", "orbit.csv"), "excitation.shaker.frequency", 1.6)
    assert rows["branch"].tolist() == [1, 2, 2]
    assert sorted(rows["largest_phi_a"][1:]) == pytest.approx(ISOLATED, abs=1e-8)
    assert rows["stable"].tolist() == [1, 0, 0]
    assert [point["branch"] for point in report["special_points"] if point["value"] > 1.5] == [2, 2]


def test_scattered_starts_find_no_branch_twice(nocdyn):
    _, report = branch(nocdyn, DUFFING + OVER.format(0.8, 1.6, "starts = 16"))
    assert (report["starts"]["tried"], report["starts"]["isolated_branches"]) == (16, 0)
    assert report["starts"]["periodic"] > 8


PLAY = """\
&body name = 'a' inertia = 1.0 /
&coupling name = 'play' bodies = 'ground', 'a' stiffness = 100.0 damping = 0.5 gap = 0.02 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 1.0 /
&excitation name = 'shaker' body = 'a' amplitude = 0.6 frequency = 7.0 /
&run t_end = 10.0 /
"""


def test_a_branch_can_begin_on_the_motion_of_a_settled_run(nocdyn):
    frequency = 1.22  # between the folds: a run from rest settles on the lower motion
    _, report = branch(nocdyn, DUFFING + OVER.format(frequency, 1.6, "start = 'settled_run'"))
    assert specials(report, "fold") == []
    outcome = nocdyn.done(DUFFING + OVER.format(1.1, 1.6, "harmonics = 3"), command="orbit")
    assert "note: the first motion is the one on which a run settles" in outcome.stdout  # Newton's method finds none from rest
    assert len(specials(json.loads((nocdyn.folder / "out/orbit.json").read_text()), "fold")) == 2


def test_a_settled_run_of_a_free_train_gives_the_same_branch(nocdyn):
    text, over, amplitude = random_machine(2)
    text += f"&run t_end = 1.0 /\n&orbit over = '{over}' range = {amplitude!r}, {1.05 * amplitude!r}"
    low, _ = branch(nocdyn, text + " /\n")
    settled, _ = branch(nocdyn, text + " start = 'settled_run' /\n")
    for label in ("rate", "half_range_twist_c1", "mean_twist_c1", "multiplier_1_real"):
        assert settled[label][0] == pytest.approx(low[label][0], rel=1e-8)


REFUSED = [
    (DUFFING, "there is no group &orbit"),
    (DUFFING + "&orbit over = 'excitation.shaker.frequenzy' range = 1, 2 /\n", "frequenzy"),
    (DUFFING + "&orbit over = 'run.rtol' range = 1e-9, 1e-8 /\n", "is no number of the machine"),
    (DUFFING + "&orbit over = 'excitation.shaker.frequency' range = 1, 1 /\n", "the two numbers are the same"),
    (DUFFING + "&orbit over = 'excitation.shaker.frequency' /\n", "range"),
    (DUFFING + "&orbit body = 'mass' speed = 1, 2 /\n", "'mass' does not turn freely"),
    (DUFFING + "&orbit body = 'mass' speed = 1, 2 start = 'settled_run' /\n", "a run does not hold the mean speed"),
    (DUFFING + OVER.format(0.8, 1.6, "signals = 'phi_mas'"), "matches no column of orbit.csv; did you mean 'phi_mass'?"),
    (DUFFING.replace("amplitude = 0.18", "amplitude = 0.0") + OVER.format(0.8, 1.6, ""), "nothing oscillates"),
    (
        DUFFING.replace("&excitation name = 'shaker' body = 'mass' amplitude = 0.18 frequency = 0.8 /\n", "")
        + "&orbit over = 'coupling.spring.damping' range = 0.1, 0.2 /\n",
        "nothing excites the machine periodically",
    ),
    (
        DUFFING
        + "&excitation name = 'other' body = 'mass' amplitude = 0.1 frequency = 1.1313708 /\n"
        + "&orbit over = 'excitation.shaker.amplitude' range = 0.1, 0.2 /\n",
        "'other' with 1.1313708 rad/s and 'shaker' with 0.8 rad/s are not commensurate",
    ),
    (
        DUFFING + "&excitation name = 'other' body = 'mass' amplitude = 0.1 frequency = 1.6 /\n" + OVER.format(0.8, 1.6, ""),
        "change their ratio",
    ),
    (
        DUFFING
        + "&excitation name = 'knock' body = 'mass' kind = 'pulse' amplitude = 1.0 time = 1.0 duration = 0.5 /\n"
        + OVER.format(0.8, 1.6, ""),
        "do not repeat themselves",
    ),
    (PLAY + OVER.format(6.4, 14.0, "method = 'harmonic_balance'"), "the motion crosses the edge of the gap of coupling 'play'"),
    (
        DUFFING.replace("inertia = 1.0", "inertia = 1.0 bearing_friction = 0.1")
        + OVER.format(0.8, 1.6, "method = 'harmonic_balance'"),
        "does not know whether bearings slip",
    ),
]


@pytest.mark.parametrize(("text", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_what_has_no_branch_is_refused(nocdyn, text, message):
    assert message in refused(nocdyn, text)


def test_a_branch_ends_where_its_motion_reaches_a_kink(nocdyn):
    outcome = nocdyn.done(PLAY + OVER.format(5.0, 14.0, "method = 'harmonic_balance'"), command="orbit")
    assert "the branch ends at 6.1" in outcome.stdout
    assert "the motion crosses the edge of the gap of coupling 'play'" in outcome.stdout
    values = nocdyn.values("out", "orbit.csv")
    assert (values["largest_total_moment_play"] < 2.0).all()  # always in contact: the moment does not change its sign
