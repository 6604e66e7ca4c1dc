"""Random machines of two speeds with a slipping coupling, and their steady states, found by nothing of nocdyn.

usage: python steady_machines.py > data/steady_machines.json

An induction motor, a fluid coupling and a load that resists. With the speed of the motor fixed, the speed of the load is the only
root of a monotone function, found by bisection. The torque that is left over on the motor is scanned over its speed, densely
where the laws are curved, and every change of sign is bisected.
"""

import json
from dataclasses import asdict, dataclass

import numpy as np

BISECTIONS = 120


@dataclass
class Machine:
    """The laws of a machine; speeds in rad/s, torques in N m."""

    breakdown: float
    slip: float
    synchronous: float
    friction: float
    friction_speed: float
    damping: float
    constant: float
    constant_speed: float
    viscous: float
    quadratic: float
    table: list  # of speeds and torques, or empty

    def motor(self, speed):
        slip = 1 - speed / self.synchronous
        return 2 * self.breakdown * slip * self.slip / (slip**2 + self.slip**2)

    def coupling(self, rate):
        return self.friction * np.tanh(rate / self.friction_speed) + self.damping * rate

    def load(self, speed):
        torque = self.constant * np.tanh(speed / self.constant_speed) + self.viscous * speed + self.quadratic * abs(speed) * speed
        return torque + (np.interp(speed, *self.table) if self.table else 0)

    def load_speed(self, motor_speed):
        """The speed of the load that goes with that of the motor."""
        low, high = np.minimum(motor_speed, 0.0) - 1.0, np.maximum(motor_speed, 0.0) + 1.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            is_low = self.load(middle) < self.coupling(motor_speed - middle)
            low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
        return (low + high) / 2

    def left_over(self, motor_speed):
        return self.motor(motor_speed) - self.coupling(motor_speed - self.load_speed(motor_speed))

    def steady_states(self):
        """Pairs of the speeds of motor and load, ascending."""
        grid = self.grid()
        torque = self.left_over(grid)
        left = np.flatnonzero(torque[:-1] * torque[1:] <= 0)
        low, high, below = grid[left], grid[left + 1], torque[left]
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            is_low = self.left_over(middle) * below > 0
            low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
        roots = (low + high) / 2
        roots = roots[np.diff(roots, prepend=-np.inf) > 1e-9]
        return [(float(s), float(self.load_speed(s))) for s in roots]

    def grid(self):
        """Speeds of the motor, dense at rest, at the synchronous speed, and where the slip is that of the largest torque."""
        knees = [0.0, self.synchronous, self.synchronous * (1 - self.slip), self.synchronous * (1 + self.slip)]
        if self.table:
            knees += self.table[0]
        steps = np.geomspace(1e-6, 3e3, 220)
        points = np.concatenate([knee + sign * steps for knee in knees for sign in (1, -1)] + [np.array(knees)])
        return np.unique(np.concatenate([points, np.linspace(-500.0, 1500.0, 1001)]))

    def text(self):
        """The input of nocdyn."""
        damping = f" damping = {self.damping!r}" if self.damping else ""
        table = ""
        if self.table:
            speeds, torques = (", ".join(map(repr, column)) for column in self.table)
            table = f" table_speed = {speeds} table_torque = {torques} extrapolation = 'constant'"
        return f"""\
&body name = 'motor' inertia = 1.0 /
&body name = 'pump' inertia = 1.0 /
&body name = 'fan' inertia = 2.0 /
&coupling name = 'fluid' bodies = 'motor', 'pump' friction = {self.friction!r} friction_speed = {self.friction_speed!r}{damping} /
&coupling name = 'shaft' bodies = 'pump', 'fan' stiffness = 1e5 damping = 10.0 /
&motor name = 'mains' body = 'motor' kind = 'induction' breakdown_torque = {self.breakdown!r}
  breakdown_slip = {self.slip!r} synchronous_speed = {self.synchronous!r} /
&load name = 'work' body = 'fan' constant = {self.constant!r} constant_speed = {self.constant_speed!r}
  viscous = {self.viscous!r} quadratic = {self.quadratic!r}{table} /
&run t_end = 1.0 /
"""


def random_machine(stream, is_saturated):
    """A machine whose load is constant or, `is_saturated`, a table with flat regions."""

    def between(low, high):
        return float(f"{np.exp(stream.uniform(np.log(low), np.log(high))):.4g}")

    breakdown, synchronous = between(20, 500), between(50, 400)
    table = []
    if is_saturated:
        speeds = sorted({between(1, 500) for _ in range(5)})
        steps = [0.0 if stream.random() < 0.5 else between(0.05, 0.5) * breakdown for _ in speeds]
        table = [[0.0, *speeds], [0.0, *(float(torque) for torque in np.round(np.cumsum(steps), 3))]]
    return Machine(
        breakdown=breakdown,
        slip=between(0.005, 0.3),
        synchronous=synchronous,
        friction=between(0.2, 2.0) * breakdown,
        friction_speed=between(0.05, 20),
        damping=between(0.001, 1.0) if stream.random() < 0.3 else 0.0,
        constant=0.0 if is_saturated else between(0.05, 1.5) * breakdown,
        constant_speed=between(0.01, 1.0),
        viscous=between(0.001, 0.5) if stream.random() < 0.3 else 0.0,
        quadratic=between(1e-5, 1e-2) if stream.random() < 0.2 else 0.0,
        table=table,
    )


def random_machines(count, seed, is_saturated):
    """As many machines, the same ones for a seed."""
    stream = np.random.default_rng(seed)
    return [random_machine(stream, is_saturated) for _ in range(count)]


if __name__ == "__main__":
    kinds = {"constant loads": False, "loads with flat regions": True}
    machines = {kind: random_machines(60, 1, is_saturated) for kind, is_saturated in kinds.items()}
    states = {kind: [asdict(machine) | {"steady": machine.steady_states()} for machine in machines[kind]] for kind in kinds}
    lines = [f'"{kind}": [\n' + ",\n".join(map(json.dumps, states[kind])) + "\n]" for kind in kinds]
    print("{\n" + ",\n".join(lines) + "\n}")
