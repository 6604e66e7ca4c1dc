"""Speeds of random trains of clutches and freewheels by time stepping with impulses, for test_locking_joints.py:

PYTHONPATH=tests/program .venv/bin/python tests/program/clutch_references.py

v_1 = v_0 + J^-1 (h T + B p), each |p| at most h times its capacity.
"""

import random
from math import sin

import numpy as np

BODY = "&body name = '{}' inertia = {} speed = {} /\n"
STEP, END = 2e-5, 0.5
SEEDS = range(6)


class Train:
    def __init__(self, seed):
        chance = random.Random(seed)
        self.bodies = chance.randint(3, 5)
        self.inertia = [chance.uniform(0.5, 3) for _ in range(self.bodies)]
        self.speed = [chance.uniform(-5, 5) for _ in range(self.bodies)]
        self.torque = [(chance.uniform(5, 30), chance.uniform(5, 40)) for _ in range(self.bodies)]
        self.joints = []
        for i in range(chance.randint(3, 6)):
            pair = chance.sample(range(-1, self.bodies), 2)
            least = -chance.uniform(3, 25)
            self.joints.append((pair, least, 0.0 if i == 2 else -least))  # the third is a freewheel that slips

    def text(self):
        """The input of a run."""
        names = [*(f"b{i}" for i in range(self.bodies)), "ground"]
        text = "".join(BODY.format(names[i], self.inertia[i], self.speed[i]) for i in range(self.bodies))
        for i, (amplitude, frequency) in enumerate(self.torque):
            text += f"&excitation name = 'e{i}' body = 'b{i}' amplitude = {amplitude} frequency = {frequency} /\n"
        for i, ((one, two), least, most) in enumerate(self.joints):
            kind = "clutch" if most else "freewheel direction = 'backward'"
            text += f"&{kind.split()[0]} name = 'j{i}' bodies = '{names[one]}', '{names[two]}' capacity = {-least} "
            text += kind.partition(" ")[2] + " /\n"
        return text + f"&run t_end = {END} rtol = 1e-9 atol = 1e-11 /\n&output points = 11 /\n"

    def stepped(self):
        rows = np.zeros((len(self.joints), self.bodies))
        for i, ((one, two), _, _) in enumerate(self.joints):
            if one >= 0:
                rows[i, one] -= 1
            if two >= 0:
                rows[i, two] += 1
        weight = rows / self.inertia @ rows.T
        least = [STEP * joint[1] for joint in self.joints]
        most = [STEP * joint[2] for joint in self.joints]
        speed, impulse = np.array(self.speed), np.zeros(len(self.joints))
        free = np.array([[amplitude * sin(frequency * STEP * (k + 0.5)) for amplitude, frequency in self.torque]
                         for k in range(round(END / STEP))]) * STEP / self.inertia  # fmt: skip
        for push in free:
            speed = speed + push
            slips = rows @ speed
            for _ in range(40):
                before = impulse.copy()
                for i in range(len(impulse)):
                    wanted = impulse[i] - (slips[i] + weight[i] @ impulse) / weight[i, i]
                    impulse[i] = min(max(wanted, least[i]), most[i])
                if abs(impulse - before).max() < 1e-12:
                    break
            speed = speed + rows.T @ impulse / self.inertia
        return speed


if __name__ == "__main__":
    for seed in SEEDS:
        print(f"    {list(map(float, Train(seed).stepped()))},")
