"""Stable motions of random machines with clutches, freewheels and gaps, by shooting, beside runs that have settled."""

import random

import numpy as np
import pytest
from conftest import all_if_fast
from test_orbit import branch

SETTLED = 1e-7  # of the half range
LEFT = 1e-9  # of a disturbance of the motion at the end of a run
JOINTS = ("brake", "clutch", "freewheel", "gap")


class Machine:
    """A chain with a joint that slips, opens or crosses its gap in each period, on the ground or free to turn."""

    def __init__(self, seed):
        self.chance = random.Random(f"joints {seed}")
        some = self.some
        self.joint = JOINTS[seed % 4]
        is_free = self.joint in ("clutch", "freewheel") or (self.joint == "gap" and self.chance.random() < 0.5)
        count = self.chance.randint(2, 3)
        speed, torque = some(20, 40), some(15, 30)
        start = f" speed = {speed!r}" if is_free else ""
        self.text = "".join(f"&body name = 'b{i}' inertia = {some(0.5, 3)!r}{start} /\n" for i in range(count))
        self.at = at = self.chance.randint(1, count - 1)  # the joint is between this body and the one before
        for i in range(int(is_free), count):
            bodies = f"bodies = '{f'b{i - 1}' if i else 'ground'}', 'b{i}'"
            k = some(300, 2000)
            law = f"stiffness = {k!r} damping = {some(0.02, 0.08) * k**0.5!r}"
            if i == at and self.joint == "gap":
                law += f" gap = {some(0.005, 0.02)!r}"
            if i == at and self.joint == "clutch":
                self.text += f"&clutch name = 'joint' {bodies} capacity = {some(1.02, 1.5) * torque!r} /\n"
            elif i == at and self.joint == "freewheel":
                self.text += f"&freewheel name = 'joint' {bodies} /\n"
            else:
                self.text += f"&coupling name = 'c{i}' {bodies} {law} /\n"
        if self.joint == "brake":
            self.text += f"&clutch name = 'joint' bodies = 'b{at}', 'ground' capacity = {some(5, 25)!r} /\n"
        last = count - 1
        self.amplitude, self.rate = some(40, 90), some(10, 40)
        if is_free:
            self.text += f"&motor name = 'm' body = 'b0' a = {3 * torque!r} b = {2 * torque / speed!r} c = 0.0 /\n"
            self.text += f"&load name = 'w' body = 'b{last}' quadratic = {torque / speed**2!r} /\n"
        else:
            self.text += f"&load name = 'w' body = 'b{last}' viscous = {some(0.5, 3)!r} /\n"
            self.text += f"&motor name = 'm' body = 'b0' kind = 'constant' torque = {some(-20, 20)!r} /\n"
        self.text += f"&excitation name = 'e' body = 'b0' amplitude = {self.amplitude!r} frequency = {self.rate!r} /\n"

    def some(self, low, high):
        return float(f"{self.chance.uniform(low, high):.4g}")

    def orbit(self):
        ends = f"{self.amplitude!r}, {1.001 * self.amplitude!r}"
        return f"{self.text}&orbit over = 'excitation.e.amplitude' range = {ends} method = 'shooting' start = 'settled_run' /\n"


def deviations(nocdyn, seed):
    """Of half ranges, as shares of them, by signals; and whether the joint slips, opens or crosses its gap."""
    machine = Machine(seed)
    values, _ = branch(nocdyn, machine.orbit() + "&run t_end = 1.0 /\n")
    assert values["stable"][0] == 1
    period = float(2 * np.pi / values["rate"][0])
    largest = abs(values["multiplier_1_real"][0] + 1j * values["multiplier_1_imaginary"][0])
    end = float((np.ceil(np.log(LEFT) / np.log(max(largest, 0.1))) + 3) * period)
    nocdyn.done(
        f"{machine.text}&run t_end = {end!r} rtol = 1e-10 atol = 1e-12 max_steps = 10000000 /\n"
        f"&output extremes_from = {end - 1.02 * period!r} points = 11 /\n"
    )
    columns = nocdyn.summary("out")["columns"]
    if machine.joint == "gap":  # there are moments of 0 in it, or of both signs
        crosses = columns[f"moment_c{machine.at} [N m]"]["max"] >= 0.0 >= columns[f"moment_c{machine.at} [N m]"]["min"]
    else:
        crosses = values["half_range_slip_joint"][0] > 1e-3
    found = {}
    for label, extremes in columns.items():
        half_range = values.get(f"half_range_{label}", [0.0])[0]
        if half_range > 1e-6 and not label.startswith("phi"):
            found[label] = abs((extremes["max"] - extremes["min"]) / 2 / half_range - 1)
    return found, crosses


@pytest.mark.parametrize("seed", all_if_fast(*range(12)))
def test_stable_motions_with_a_joint_are_those_of_settled_runs(nocdyn, seed):
    found, crosses = deviations(nocdyn, seed)
    assert crosses and len(found) > 4
    assert max(found.values()) < SETTLED
