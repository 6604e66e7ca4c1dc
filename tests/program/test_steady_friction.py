"""Dry friction in analyses about a steady state: it holds, or it acts with its whole moment and damps nothing."""

import json
import math
import os
import random

import pytest

TRAINS = int(os.environ.get("NOCDYN_LOSSY_TRAINS", "8"))  # 80 of 80 have been found


def states(nocdyn, text):
    outcome = nocdyn("equilibrium", nocdyn.write("m.nml", text), "--out", "steady")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())


def modes(nocdyn, text):
    outcome = nocdyn("modes", nocdyn.write("m.nml", text), "--out", "modes")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "modes/modes.json").read_text())["modes"]


def run(nocdyn, text):
    outcome = nocdyn("run", nocdyn.write("m.nml", text), "--out", "run", "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("run")
    return [dict(zip(header, row, strict=True)) for row in rows]


HELD = """&body name = 'motor' inertia = 1 {friction} /
&body name = 'drum' inertia = 5 /
&coupling name = 's' bodies = 'motor', 'drum' stiffness = 1000 damping = 1 /
&motor name = 'weight' body = 'drum' kind = 'constant' torque = 60 /
{brake}
&run t_end = 1 start = 'equilibrium' /
"""


@pytest.mark.parametrize("by", ["bearing", "brake"])
def test_friction_that_holds_is_a_held_end(nocdyn, by):
    brake = "&clutch name = 'b' bodies = 'ground', 'motor' capacity = 100 /"
    text = HELD.format(friction="bearing_friction = 100", brake="")
    if by == "brake":
        text = HELD.format(friction="", brake=brake)
    state = states(nocdyn, text)["steady_states"][0]
    assert state["is_at_rest"] and state["stability"] == "stable"
    assert state["values"]["moment_s [N m]"] == pytest.approx(60, rel=1e-12)
    mode = modes(nocdyn, text)[0]
    assert mode["undamped_frequency_Hz"] == pytest.approx(math.sqrt(1000 / 5) / 2 / math.pi, rel=1e-12)
    assert mode["damping_ratio"] == pytest.approx(1 / (2 * math.sqrt(1000 * 5)), rel=1e-9)
    assert all(row["moment_s [N m]"] == pytest.approx(60, rel=1e-9) for row in run(nocdyn, text))


def test_friction_that_slips_acts_with_its_whole_moment_and_damps_nothing(nocdyn):
    text = """&body name = 'a' inertia = 10 /
&body name = 'b' inertia = 1 bearing_friction = 50 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 1e4 damping = 2 /
&motor name = 'm' body = 'a' a = 200 b = 100 c = 0 /
&excitation name = 'x' body = 'b' amplitude = 1 frequency = 100 /
&response body = 'a' speed = 1.5, 1.5001 count = 2 /
&run t_end = 60 /
"""
    state = states(nocdyn, text)["steady_states"][0]
    assert state["values"]["omega_a [rad/s]"] == pytest.approx(1.5, rel=1e-12)
    assert state["values"]["bearing_b [N m]"] == -50
    outcome = nocdyn("response", "m.nml", "--out", "response")
    assert outcome.returncode == 0, outcome.stderr
    # twist of two bodies at 100 rad/s, by the complex stiffness; the drag of the motor is 100 N m s/rad
    w, k = 100.0, 1e4 + 2j * 100
    a, b = -10 * w**2 + 100j * w + k, -1 * w**2 + k
    twist = (a - k) / (a * b - k**2)
    found = json.loads((nocdyn.folder / "response/response.json").read_text())
    assert "half_range" in json.dumps(found)
    assert f"{2 * abs(k * twist):.5g}"[:4] in outcome.stdout or f"{abs(k * twist):.5g}"[:4] in outcome.stdout


def test_teeth_hold_between_two_torques(nocdyn):
    text = """&body name = 'motor' inertia = 0.05 /
&body name = 'drum' inertia = 3 /
&gear name = 'box' bodies = 'motor', 'drum' teeth = 10, 100 internal = .true. efficiency = 0.9 /
&motor name = 'drive' body = 'motor' kind = 'constant' torque = {} /
&motor name = 'weight' body = 'drum' kind = 'constant' torque = -48 /
&run t_end = 1 /
"""
    for torque, holds in ((4.31, False), (4.33, True), (5, True), (5.32, True), (5.34, False)):
        if holds:
            state = states(nocdyn, text.format(torque))["steady_states"][0]
            assert state["is_at_rest"] and state["values"]["loss_box [N m]"] == pytest.approx(4.8 - torque, rel=1e-12)
        else:
            assert nocdyn("equilibrium", nocdyn.write("m.nml", text.format(torque))).returncode == 1


def test_losses_of_teeth_follow_their_torque_in_vibrations(nocdyn):
    text = """&body name = 'motor' inertia = 1 /
&body name = 'pinion' inertia = 0.2 /
&body name = 'wheel' inertia = 0.5 /
&body name = 'mill' inertia = 20 /
&coupling name = 'a' bodies = 'motor', 'pinion' stiffness = 1000 damping = 0.5 /
&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 40 internal = .true. efficiency = 0.6 /
&coupling name = 'b' bodies = 'wheel', 'mill' stiffness = 3000 damping = 0.5 /
&motor name = 'm' body = 'motor' a = 300 b = 2 c = 0 /
&load name = 'l' body = 'mill' viscous = 3 /
&run t_end = 4 start = 'equilibrium' rtol = 1e-10 atol = 1e-12 /
&output interval = 0.002 /
"""
    mode = next(mode for mode in modes(nocdyn, text) if mode["frequency_Hz"] > 0)
    blow = "&excitation name = 'e' body = 'motor' kind = 'pulse' amplitude = 0.5 time = 0 duration = 0.01 /\n"
    rows = run(nocdyn, text + blow)
    twist = [row["twist_a [rad]"] for row in rows[100:]]
    mean = sum(twist) / len(twist)
    times = []
    for i in range(1, len(twist)):
        one, two = twist[i - 1] - mean, twist[i] - mean
        if one < 0 <= two:
            times.append(0.002 * (i - one / (two - one)))
    period = (times[-1] - times[0]) / (len(times) - 1)
    assert len(times) > 5
    assert mode["frequency_Hz"] == pytest.approx(1 / period, rel=5e-3)


def test_discs_with_a_damper_between_them_keep_their_speed(nocdyn):
    text = """&body name = 'crank' inertia = 1 speed = 10 /
&body name = 'ring' inertia = 0.2 speed = 4 /
&coupling name = 'silicon' bodies = 'crank', 'ring' damping = 17.4 /
&run t_end = 10 /
"""
    found = states(nocdyn, text)
    assert found["notes"] == ["nothing drives or brakes 'crank', 'ring': any speed is steady, and the one of the start is kept"]
    assert [state["values"]["omega_ring [rad/s]"] for state in found["steady_states"]] == pytest.approx([9], rel=1e-12)


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        (
            "&drive name = 'j' body = 'm' table_time = 0, 1 table_speed = 0, 100 /\n",
            "is about a steady state, and the speed of this",
        ),
        ("&cardan name = 'j' bodies = 'm', 'n' angle = 0.3 /\n", "is for machines whose ratios are constant"),
    ],
)
def test_a_steady_start_with_joints_that_move_is_refused(nocdyn, joint, reason):
    text = "".join(f"&body name = '{name}' inertia = 1 /\n" for name in "mno") + joint
    text += "&coupling name = 'c' bodies = 'n', 'o' stiffness = 1000 damping = 1 /\n&load name = 'l' body = 'o' viscous = 0.5 /\n"
    outcome = nocdyn("run", nocdyn.write("m.nml", text + "&run t_end = 1 start = 'equilibrium' /\n"), "--out", "run")
    assert outcome.returncode == 2
    assert f"m.nml:4: {joint[: joint.index(' ')]} 'j': start = 'equilibrium' {reason}" in outcome.stderr


class Train:
    """A train of lossy gears between an induction motor and a load, and what is left over on the motor."""

    def __init__(self, seed):
        stream = random.Random(1000 + seed)
        uniform, bodies = stream.uniform, stream.randint(2, 4)
        self.stages = []
        self.text = "".join(f"&body name = 'b{i}' inertia = {uniform(0.2, 2):.4g} /\n" for i in range(bodies))
        for i in range(1, bodies):
            first, second, sign = stream.randint(10, 40), stream.randint(10, 60), stream.choice((1, -1))
            forward, backward = uniform(0.55, 0.98), uniform(-0.2, 0.95)
            self.stages.append((sign * first / second, forward, backward))
            self.text += f"&gear name = 'g{i}' bodies = 'b{i - 1}', 'b{i}' teeth = {first}, {second} efficiency = {forward!r}"
            self.text += f" reverse_efficiency = {backward!r} internal = .{str(sign > 0).lower()}. /\n"
        self.breakdown, self.slip, self.synchronous = uniform(50, 200), uniform(0.05, 0.4), uniform(40, 150)
        ratio = abs(math.prod(stage[0] for stage in self.stages))
        self.constant, self.speed = uniform(0.1, 0.95) * self.breakdown / ratio, uniform(0.05, 2) * ratio
        self.hoist = uniform(-0.6, 0.6) * self.breakdown / ratio if stream.random() < 0.4 else 0.0
        self.text += f"&motor name = 'M' body = 'b0' kind = 'induction' breakdown_torque = {self.breakdown!r}"
        self.text += f" breakdown_slip = {self.slip!r} synchronous_speed = {self.synchronous!r} /\n"
        self.text += f"&load name = 'L' body = 'b{bodies - 1}' constant = {self.constant!r} constant_speed = {self.speed!r} /\n"
        self.text += f"&motor name = 'H' body = 'b{bodies - 1}' kind = 'constant' torque = {self.hoist!r} /\n&run t_end = 60 /\n"

    def motor(self, speed):
        slip = 1 - speed / self.synchronous
        return 2 * self.breakdown * slip * self.slip / (slip**2 + self.slip**2)

    def left_over(self, speed):
        speeds = [speed]
        for ratio, _, _ in self.stages:
            speeds.append(speeds[-1] * ratio)
        torque = self.hoist - self.constant * math.tanh(speeds[-1] / self.speed)
        for (ratio, forward, backward), turning in zip(self.stages[::-1], speeds[-2::-1], strict=True):
            torque *= ratio  # of the teeth on the first wheel, without losses
            torque *= 1 / forward if torque * turning < 0 else backward
        return self.motor(speed) + torque

    def holds(self):
        ends = [self.hoist, self.hoist]
        for ratio, forward, backward in self.stages[::-1]:
            ends = [torque * ratio * share for torque in ends for share in (1 / forward, backward)]
            ends = [min(ends), max(ends)]
        return ends[0] <= -self.motor(0) <= ends[1]

    def steady_speeds(self):
        knees = [0, self.synchronous, self.synchronous * (1 - self.slip), self.synchronous * (1 + self.slip)]
        steps = [10 ** (i / 200) for i in range(-1400, 801)]
        grid = sorted({knee + sign * step for knee in knees for step in steps for sign in (1, -1)})
        values, roots = [self.left_over(speed) for speed in grid], [0.0] if self.holds() else []
        for low, high, one, two in zip(grid, grid[1:], values, values[1:], strict=False):
            if one * two > 0 or low * high < 0:
                continue
            for _ in range(100):
                middle = (low + high) / 2
                low, high = (middle, high) if self.left_over(middle) * one > 0 else (low, middle)
            roots.append((low + high) / 2)
        return sorted(roots)


@pytest.mark.parametrize("seed", range(TRAINS))
def test_random_trains_of_lossy_gears_have_the_states_of_a_dense_scan(nocdyn, seed):
    train = Train(seed)
    expected = train.steady_speeds()
    outcome = nocdyn("equilibrium", nocdyn.write("m.nml", train.text), "--out", "steady")
    assert outcome.returncode == (0 if expected else 1), outcome.stderr
    if expected:
        found = json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())["steady_states"]
        speeds = sorted(state["values"]["omega_b0 [rad/s]"] for state in found)
        assert speeds == pytest.approx(expected, rel=1e-6, abs=1e-6)
