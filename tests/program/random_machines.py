"""Random machines of all elements, and numbers of them that may vary. A seed gives the same machine everywhere."""

import random

CONNECTIONS = (
    "coupling",
    "gap",
    "table",
    "shaft",
    "mesh",
    "gear",
    "clutch",
    "dog",
    "freewheel",
    "cardan",
    "relation",
    "planetary",
)
JOINTS = frozenset(("clutch", "dog", "freewheel", "cardan", "relation"))  # besides losses, bearings, brakes, cranks and drives
ALONE = frozenset(("cardan", "relation", "crank", "drive", "losses"))  # machines with these do not share a block of a sweep


class RandomMachine:
    """`text` is an input without &run, `targets` has the numbers that may vary, as paths of --set, with their values."""

    def __init__(self, seed):
        self.chance = random.Random(f"machine {seed}")
        self.text = ""
        self.targets = {}
        self.kinds = set()  # what the machine has
        self.has_joints = False
        count = self.chance.randint(2, 5)
        self.bodies = [f"b{i}" for i in range(count)]
        self.is_driven = self.chance.random() < 0.12
        self.connections = [self.chance.choice(CONNECTIONS) for _ in self.bodies[1:]]
        for i in range(count):
            self.add_body(i)
        for i, kind in enumerate(self.connections):
            self.kinds.add(kind)
            self.has_joints |= kind in JOINTS
            getattr(self, f"add_{kind}")(f"c{i}", self.bodies[i], self.bodies[i + 1])
        self.add_torques()
        self.add_to_bodies()

    @property
    def shares_lanes(self):
        return not self.kinds & ALONE

    def some(self, low, high):
        return float(f"{self.chance.uniform(low, high):.3g}")

    def add(self, group, name, *keys, **numbers):
        """A group with a name. Each of the numbers may vary."""
        self.kinds.add(group)
        words = [f"{key} = {value!r}" for key, value in numbers.items()]
        self.text += f"&{group} name = '{name}' {' '.join([*keys, *words])} /\n"
        self.targets |= {f"{group}.{name}.{key}": value for key, value in numbers.items() if value != 0}

    def joined(self, one, two):
        return f"bodies = '{one}', '{two}'"

    def add_body(self, i):
        rigid = i > 0 and self.connections[i - 1] in ("gear", "cardan", "relation", "planetary")
        numbers = {"inertia": self.some(0.3, 3)}
        if self.chance.random() < 0.2:
            numbers["bearing_friction"] = self.some(0.1, 2)
            self.has_joints = True
            self.kinds.add("bearing")
        speed = "" if rigid or (self.is_driven and i == 0) or self.chance.random() < 0.4 else f"speed = {self.some(-20, 20)!r}"
        self.add("body", self.bodies[i], speed, **numbers)

    def add_coupling(self, name, one, two):
        numbers = {"stiffness": self.some(50, 2000), "damping": self.some(0.1, 3)}
        extra = self.chance.choice(("", "cubic_stiffness", "friction", "saturation"))
        if extra:
            numbers[extra] = self.some(5, 50)
        self.add("coupling", name, self.joined(one, two), **numbers)

    def add_gap(self, name, one, two):
        numbers = {"stiffness": self.some(50, 2000), "damping": self.some(0.1, 3), "gap": self.some(0.005, 0.1)}
        self.add("coupling", name, self.joined(one, two), **numbers)

    def add_table(self, name, one, two):
        table = "table_twist = -0.2, -0.05, 0.05, 0.2 table_moment = -60, -5, 5, 60"
        self.add("coupling", name, self.joined(one, two), table, damping=self.some(0.1, 3))

    def add_shaft(self, name, one, two):
        keys = (
            f"lengths = 0.5, 0.7 diameters = 0.03, 0.025 shear_modulus = 8e10 density = 7850 nodes = {self.chance.randint(1, 2)}"
        )
        self.add(
            "shaft", name, self.joined(one, two), keys, damping_ratio=self.some(0.01, 0.05), damping_frequency=self.some(50, 90)
        )

    def losses(self, chance_of_losses=0.4):
        if self.chance.random() > chance_of_losses:
            return {}
        self.has_joints = True
        self.kinds.add("losses")
        return {"efficiency": self.some(0.6, 0.98), "reverse_efficiency": self.chance.choice((0.3, 0.8, 0.9))}

    def add_mesh(self, name, one, two):
        numbers = {"stiffness": self.some(1e4, 1e5), "damping": self.some(5, 50)} | self.losses()
        if self.chance.random() < 0.4:
            numbers["backlash"] = self.some(1e-4, 1e-3)
        self.add("mesh", name, self.joined(one, two), f"radii = 0.1, {self.some(0.08, 0.2)}", **numbers)

    def add_gear(self, name, one, two):
        self.add("gear", name, self.joined(one, two), f"radii = 1.0, {self.some(0.5, 2)}", **self.losses())

    def add_planetary(self, name, one, two):
        self.add("planetary", name, f"sun = '{one}' ring = 'ground' carrier = '{two}' teeth = 20, 50", **self.losses())

    def engagement(self):
        return self.chance.choice(
            (
                "",
                f"times = {self.some(0.05, 0.3)!r} levels = 1",
                "table_time = 0.1, 0.3 table_level = 0, 1",
                "times = 0, 0.3 levels = 1, 0.2",
            )
        )

    def add_clutch(self, name, one, two):
        numbers = {"capacity": self.some(3, 60)}
        if self.chance.random() < 0.3:
            numbers["static_capacity"] = numbers["capacity"] * 1.25
        self.add("clutch", name, self.joined(one, two), self.engagement(), **numbers)

    def add_dog(self, name, one, two):
        levels = self.chance.choice(
            ("times = 0, 0.3 levels = 1, 0", "times = 0.25 levels = 1", "times = 0.1, 0.3, 0.4 levels = 1, 0, 1")
        )
        self.add("clutch", name, self.joined(one, two), "kind = 'dog'", levels)

    def add_freewheel(self, name, one, two):
        numbers = {"capacity": self.some(5, 60)} if self.chance.random() < 0.5 else {}
        direction = self.chance.choice(("forward", "backward"))
        self.add("freewheel", name, self.joined(one, two), f"direction = '{direction}'", **numbers)

    def add_cardan(self, name, one, two):
        self.add("cardan", name, self.joined(one, two), angle_deg=self.some(5, 35), phase_deg=self.some(0, 90))

    def add_relation(self, name, one, two):
        angles = "table_angle_deg = 0, 90, 180, 270, 360 table_driven_deg = 0, 100, 180, 265, 360"
        self.add("relation", name, self.joined(one, two), "kind = 'gear'", angles)

    def add_torques(self):
        first, last = self.bodies[0], self.bodies[-1]
        kind = self.chance.choice(("", "constant", "quadratic", "induction", "governed", "dc"))
        if kind == "constant":
            self.add("motor", "m", f"body = '{first}' kind = 'constant'", torque=self.some(5, 40))
        elif kind == "quadratic":
            self.add("motor", "m", f"body = '{first}'", a=self.some(5, 40), b=self.some(0.1, 2), c=self.some(0.001, 0.01))
        elif kind == "induction":
            speed = f"body = '{first}' kind = 'induction' synchronous_speed = 30"
            self.add("motor", "m", speed, breakdown_torque=self.some(20, 60), breakdown_slip=self.some(0.1, 0.4))
        elif kind == "governed":
            governor = "governor_gain = 0.2 governor_time = 0.3"
            self.add(
                "motor",
                "m",
                f"body = '{first}' kind = 'constant' {governor}",
                torque=self.some(20, 60),
                governor_speed=self.some(5, 20),
            )
        elif kind == "dc":
            numbers = {"voltage": self.some(10, 40), "resistance": self.some(0.3, 1), "flux_constant": self.some(0.3, 1)}
            self.add("motor", "m", f"body = '{first}' kind = 'dc' inductance = 0.05", **numbers)
        load = self.chance.choice(("viscous", "quadratic", "constant", "both"))
        numbers = {"viscous": self.some(0.1, 2)} if load in ("viscous", "both") else {}
        if load == "quadratic":
            numbers["quadratic"] = self.some(0.001, 0.05)
        if load in ("constant", "both"):
            numbers |= {"constant": self.some(1, 8), "constant_speed": self.some(0.1, 0.5)}
        self.add("load", "l", f"body = '{last}'", **numbers)
        self.add_excitation(self.chance.choice(self.bodies))

    def add_excitation(self, body):
        kind = self.chance.choice(("", "harmonic", "step", "pulse", "orders", "table"))
        here = f"body = '{body}' kind = '{kind}'"
        if kind == "harmonic":
            self.add("excitation", "e", here, amplitude=self.some(5, 60), frequency=self.some(3, 30), phase=self.some(0, 6))
        elif kind == "step":
            self.add("excitation", "e", here, amplitude=self.some(-60, 60), time=self.some(0.1, 0.4))
        elif kind == "pulse":
            self.add(
                "excitation", "e", here, amplitude=self.some(-90, 90), time=self.some(0.1, 0.4), duration=self.some(0.05, 0.3)
            )
        elif kind == "orders":
            self.add("excitation", "e", here, "orders = 1, 2 amplitudes = 20, 8 phases = 0, 1")
        elif kind == "table":
            self.add("excitation", "e", here, "table_time = 0, 0.2, 0.3, 0.5 table_torque = 0, 30, -40, 10")

    def add_to_bodies(self):
        """What hangs on single bodies: a brake, a backstop, a crank, a drive."""
        if self.is_driven:
            self.has_joints = True
            self.add(
                "drive",
                "d",
                f"body = '{self.bodies[0]}'",
                speed=self.some(-10, 10),
                speed_amplitude=self.some(1, 5),
                frequency=self.some(5, 20),
            )
        if self.chance.random() < 0.2:
            self.has_joints = True
            self.add(
                "clutch",
                "brake",
                self.joined(self.chance.choice(self.bodies), "ground"),
                self.engagement(),
                capacity=self.some(3, 60),
            )
        if self.chance.random() < 0.1:
            self.has_joints = True
            self.add("freewheel", "stop", self.joined(self.bodies[-1], "ground"), capacity=self.some(10, 60))
        if self.chance.random() < 0.12:
            self.has_joints = True
            keys = f"body = '{self.chance.choice(self.bodies)}' rod_length = 0.3"
            self.add("crank", "p", keys, crank_radius=self.some(0.05, 0.1), piston_mass=self.some(0.5, 3))
