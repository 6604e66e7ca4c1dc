"""Speeds of random trains by small steps with impulses, for test_locking_joints.py and test_losses.py, printed by

PYTHONPATH=tests/program .venv/bin/python tests/program/impulse_references.py

v_1 = v_0 + J^-1 (h T + B p), each |p| at most h times its capacity.
"""

import random
from math import sin

import numpy as np

BODY = "&body name = '{}' inertia = {} speed = {} /\n"
STEP, END, LOSSY_END = 2e-5, 0.5, 0.6  # [s]
SEEDS, LOSSY_SEEDS = range(6), range(4)


class Train:
    """Random bodies with clutches and freewheels."""

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


class LossyTrain:
    """Random bodies with lossy gears, clutches, bearings and torques, and their motion by small steps with impulses."""

    def __init__(self, seed):
        chance = random.Random(1000 + seed)
        self.inertia = [chance.uniform(0.5, 3) for _ in range(5)]
        self.ratio = [chance.uniform(0.5, 2) for _ in range(2)]  # of the gears 0-1 and 2-3
        self.efficiency = [(chance.uniform(0.6, 0.95), chance.uniform(0.3, 0.9)) for _ in range(2)]
        first, third = chance.uniform(-5, 5), chance.uniform(-5, 5)
        self.speed = [first, -first / self.ratio[0], third, -third / self.ratio[1], chance.uniform(-5, 5)]
        self.torque = [(chance.uniform(5, 30), chance.uniform(5, 40)) for _ in range(5)]
        self.clutches = [((1, 2), chance.uniform(3, 25)), ((3, 4), chance.uniform(3, 25)), ((4, -1), chance.uniform(1, 5))]

    def text(self):
        """The input of a run."""
        text = "".join(BODY.format(f"b{i}", j, v) for i, (j, v) in enumerate(zip(self.inertia, self.speed, strict=True)))
        for i, (ratio, (forward, reverse)) in enumerate(zip(self.ratio, self.efficiency, strict=True)):
            text += f"&gear name = 'g{i}' bodies = 'b{2 * i}', 'b{2 * i + 1}' radii = 1.0, {ratio!r}\n"
            text += f"  efficiency = {forward!r} reverse_efficiency = {reverse!r} /\n"
        for i, ((one, two), most) in enumerate(self.clutches):
            other = f"b{two}" if two >= 0 else "ground"
            text += f"&clutch name = 'c{i}' bodies = 'b{one}', '{other}' capacity = {most!r} /\n"
        for i, (amplitude, frequency) in enumerate(self.torque):
            text += f"&excitation name = 'e{i}' body = 'b{i}' amplitude = {amplitude!r} frequency = {frequency!r} /\n"
        return text + f"&run t_end = {LOSSY_END} rtol = 1e-9 atol = 1e-11 /\n&output points = 11 /\n"

    def stepped(self):
        # rows of gears, of losses on their first wheels, and of clutches
        rows = np.zeros((7, 5))
        for i in range(2):
            rows[i, 2 * i], rows[i, 2 * i + 1], rows[2 + i, 2 * i] = 1, self.ratio[i], 1
        for i, ((one, two), _) in enumerate(self.clutches):
            rows[4 + i, one] = -1
            if two >= 0:
                rows[4 + i, two] = 1
        weight = rows / self.inertia @ rows.T
        least = np.array([-np.inf] * 2 + [0.0] * 2 + [-STEP * most for _, most in self.clutches])
        most = -least
        shares = [(1 - 1 / forward, 1 - reverse) for forward, reverse in self.efficiency]
        speed, impulse = np.array(self.speed), np.zeros(7)
        for k in range(round(LOSSY_END / STEP)):
            t = STEP * (k + 0.5)
            push = np.array([amplitude * sin(frequency * t) for amplitude, frequency in self.torque])
            speed = speed + STEP * push / self.inertia
            slips = rows @ speed
            for _ in range(300):
                before = impulse.copy()
                for i in range(7):
                    wanted = impulse[i] - (slips[i] + weight[i] @ impulse) / weight[i, i]
                    if i in (2, 3):  # -s T, with the share s between those of both directions of the power
                        bounds = [-share * impulse[i - 2] for share in shares[i - 2]]
                        least[i], most[i] = min(bounds), max(bounds)
                    impulse[i] = min(max(wanted, least[i]), most[i])
                if abs(impulse - before).max() < 1e-11:
                    break
            speed = speed + rows.T @ impulse / self.inertia
        return speed


if __name__ == "__main__":
    for train in [*map(Train, SEEDS), *map(LossyTrain, LOSSY_SEEDS)]:
        print(f"    {[round(float(speed), 8) for speed in train.stepped()]},", flush=True)
