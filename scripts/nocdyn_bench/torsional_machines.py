"""Drivetrains that nocdyn and openTorsion can both describe, written once."""

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Shaft:
    """`first` is no other shaft's `first` and not the last body: openTorsion has a row of moments for each first node."""

    first: str
    second: str
    stiffness: float  # [N m/rad]
    damping: float = 0.0  # [N m s/rad]


@dataclass(frozen=True)
class Gear:
    first: str
    second: str
    radii: tuple[float, float]  # [m]


@dataclass(frozen=True)
class Torque:
    """On a body: the sum of amplitude sin(order phi + phase), phi the angle of the body."""

    body: str
    orders: tuple[float, ...]
    amplitudes: tuple[float, ...]  # [N m]
    phases: tuple[float, ...]  # [rad]


@dataclass(frozen=True)
class Machine:
    name: str
    title: str
    inertias: dict[str, float]  # of the bodies [kg m2]
    shafts: tuple[Shaft, ...]
    torques: tuple[Torque, ...]
    held: str  # the body whose speed is held
    speeds: tuple[float, float]  # lowest and highest one [rad/s]
    count: int = 101  # of speeds
    gears: tuple[Gear, ...] = ()
    viscous: dict[str, float] = field(default_factory=dict)  # dampers from bodies to the ground [N m s/rad]
    quadratic: dict[str, float] = field(default_factory=dict)  # loads by the propeller law [N m s2/rad2]

    @cached_property
    def bodies(self) -> list[str]:
        return list(self.inertias)

    def index(self, body: str) -> int:
        return self.bodies.index(body)

    def of_bodies(self, values: dict[str, float]) -> np.ndarray:
        return np.array([values.get(body, 0.0) for body in self.bodies])

    @cached_property
    def ratios(self) -> np.ndarray:
        """Speeds of all bodies for the speed 1 of the held one, which shafts and gears pass on."""
        links = [(shaft.first, shaft.second, 1.0) for shaft in self.shafts]
        links += [(gear.first, gear.second, -gear.radii[0] / gear.radii[1]) for gear in self.gears]
        found = {self.held: 1.0}
        while len(found) < len(self.inertias):
            for first, second, ratio in links:
                if first in found:
                    found.setdefault(second, found[first] * ratio)
                elif second in found:
                    found[first] = found[second] / ratio
        return self.of_bodies(found)

    @cached_property
    def orders(self) -> list[float]:
        """Of all torques, in oscillations per turn of the held body; ascending."""
        found = [order * abs(self.ratios[self.index(torque.body)]) for torque in self.torques for order in torque.orders]
        return sorted({float(f"{order:.12g}") for order in found})

    def damping(self, speed: float) -> np.ndarray:
        """Slopes of the loads over the speeds of their bodies [N m s/rad], at this speed of the held body [rad/s]."""
        return self.of_bodies(self.viscous) + 2.0 * self.of_bodies(self.quadratic) * np.abs(self.ratios * speed)

    def mean_torques(self, speed: float) -> np.ndarray:
        """Of the loads on the bodies [N m], at this speed of the held body [rad/s]."""
        speeds = self.ratios * speed
        return -(self.of_bodies(self.viscous) + self.of_bodies(self.quadratic) * np.abs(speeds)) * speeds

    def write_input(self, file: Path, has_torques: bool = True) -> None:
        """For nocdyn; the bodies start with the highest speed. `has_torques`: and a response to them is asked for."""
        lines = [f"&case title = '{self.title}' /"]
        for (body, inertia), ratio in zip(self.inertias.items(), self.ratios):
            lines.append(f"&body name = '{body}' inertia = {inertia!r} speed = {float(ratio * self.speeds[1])!r} /")
        for i, shaft in enumerate(self.shafts, 1):
            ends = f"bodies = '{shaft.first}', '{shaft.second}'"
            lines.append(f"&coupling name = 'shaft_{i}' {ends} stiffness = {shaft.stiffness!r} damping = {shaft.damping!r} /")
        for i, gear in enumerate(self.gears, 1):
            lines.append(f"&gear name = 'gear_{i}' bodies = '{gear.first}', '{gear.second}' radii = {_list(gear.radii)} /")
        for key, loads in (("viscous", self.viscous), ("quadratic", self.quadratic)):
            lines += [f"&load name = '{key}_{body}' body = '{body}' {key} = {value!r} /" for body, value in loads.items()]
        for i, torque in enumerate(self.torques if has_torques else (), 1):
            law = f"orders = {_list(torque.orders)} amplitudes = {_list(torque.amplitudes)} phases = {_list(torque.phases)}"
            lines.append(f"&excitation name = 'torque_{i}' body = '{torque.body}' kind = 'orders'\n {law} /")
        if has_torques:
            lines.append(f"&response body = '{self.held}' speed = {_list(self.speeds)} count = {self.count} /")
        file.write_text("\n".join([*lines, "&run t_end = 1.0 /"]) + "\n", encoding="utf-8")


def _list(values: tuple[float, ...]) -> str:
    return ", ".join(repr(float(value)) for value in values)


def line_of_shafts(bodies: list[str], stiffness: list[float], damping: float) -> tuple[Shaft, ...]:
    """`damping`: of each shaft, as a share of its stiffness [s]."""
    return tuple(Shaft(first, second, k, damping * k) for first, second, k in zip(bodies, bodies[1:], stiffness))


def cylinders(firing_deg: list[float], orders: list[float], amplitudes: list[float]) -> tuple[Torque, ...]:
    """Alike, on the bodies cylinder_1, cylinder_2, ..."""
    return tuple(
        Torque(f"cylinder_{i}", tuple(orders), tuple(amplitudes), tuple(-np.radians(firing) * order for order in orders))
        for i, firing in enumerate(firing_deg, 1)
    )


def three_rotors() -> Machine:
    bodies = ["motor", "coupling", "machine"]
    return Machine(
        "three_rotors",
        "Three rotors, free at both ends",
        dict(zip(bodies, [12.0, 3.0, 40.0])),
        line_of_shafts(bodies, [2.0e5, 5.0e5], 1e-5),
        (Torque("motor", (1.0, 2.0, 6.0), (100.0, 50.0, 20.0), (0.0, 0.3, -1.0)), Torque("machine", (3.0,), (80.0,), (0.5,))),
        "motor",
        (20.0, 300.0),
    )


def long_chain() -> Machine:
    bodies = [f"rotor_{i}" for i in range(1, 61)]
    return Machine(
        "long_chain",
        "Chain of 60 rotors",
        {body: 2.0 + 0.5 * (i % 3) for i, body in enumerate(bodies)},
        line_of_shafts(bodies, [1.0e6 * (1.0 + 0.2 * (i % 4)) for i in range(59)], 2e-5),
        (Torque("rotor_1", (1.0, 4.0), (100.0, 30.0), (0.0, 1.0)), Torque("rotor_30", (2.5,), (60.0,), (-0.7,))),
        "rotor_1",
        (10.0, 150.0),
    )


def geared_train() -> Machine:
    bodies = ["motor", "pinion", "wheel", "machine"]
    return Machine(
        "geared_train",
        "Motor and machine with a gear between them",
        dict(zip(bodies, [2.5, 0.2, 3.0, 60.0])),
        (Shaft("motor", "pinion", 9.0e4, 2.0), Shaft("wheel", "machine", 7.0e5, 15.0)),
        (Torque("motor", (1.0, 2.0), (40.0, 25.0), (0.2, 0.0)), Torque("machine", (3.0, 5.0), (200.0, 90.0), (0.0, 0.8))),
        "motor",
        (40.0, 400.0),
        gears=(Gear("pinion", "wheel", (0.1, 0.32)),),
        viscous={"machine": 30.0},
    )


def branched_gears() -> Machine:
    bodies = ["motor", "bull", "wheel_1", "wheel_2", "pinion_2", "wheel_3", "pump", "fan"]
    return Machine(
        "branched_gears",
        "A motor, a bull wheel and two branches, one of them with a second stage",
        dict(zip(bodies, [6.0, 1.5, 0.4, 0.9, 0.3, 2.2, 9.0, 70.0])),
        (
            Shaft("motor", "bull", 3.0e5, 4.0),
            Shaft("wheel_1", "pump", 6.0e4, 0.5),
            Shaft("wheel_2", "pinion_2", 2.0e5, 2.0),
            Shaft("wheel_3", "fan", 5.0e5, 8.0),
        ),
        (
            Torque("motor", (2.0,), (50.0,), (0.0,)),
            Torque("pump", (1.0, 6.0), (30.0, 20.0), (0.4, 0.0)),
            Torque("fan", (5.0,), (70.0,), (-1.1,)),
        ),
        "motor",
        (30.0, 250.0),
        gears=(
            Gear("bull", "wheel_1", (0.3, 0.13)),
            Gear("bull", "wheel_2", (0.3, 0.4)),
            Gear("pinion_2", "wheel_3", (0.15, 0.37)),
        ),
        viscous={"pump": 0.8},
        quadratic={"fan": 0.9},
    )


def damped_engine() -> Machine:
    bodies = ["pulley", *(f"cylinder_{i}" for i in range(1, 5)), "flywheel", "brake"]
    return Machine(
        "damped_engine",
        "Four-cylinder engine, viscous dampers from its cranks to the ground",
        dict(zip(bodies, [0.03, *[0.035] * 4, 0.5, 1.2])),
        line_of_shafts(bodies, [2.0e5, *[4.0e5] * 3, 6.0e5, 2.0e4], 0.0),
        cylinders([0.0, 540.0, 180.0, 360.0], [0.5, 1.0, 1.5, 2.0, 4.0, 6.0], [120.0, 150.0, 110.0, 90.0, 35.0, 12.0]),
        "flywheel",
        (80.0, 650.0),
        viscous={**{f"cylinder_{i}": 1.5 for i in range(1, 5)}, "pulley": 0.4, "brake": 0.9},
    )


SIX_CYLINDERS = [0.0, 240.0, 120.0, 180.0, 60.0, 300.0]  # two-stroke, firing order 1 5 3 4 2 6


def ship_plant() -> Machine:
    bodies = ["front", *(f"cylinder_{i}" for i in range(1, 7)), "flywheel", "flange", "propeller"]
    gas = cylinders(SIX_CYLINDERS, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0, 12.0], [3e5, 2.6e5, 2.1e5, 1.6e5, 1.2e5, 9e4, 4e4, 2e4])
    return Machine(
        "ship_plant",
        "Two-stroke engine with six cylinders, propeller law",
        dict(zip(bodies, [2200.0, *[4600.0] * 6, 6500.0, 450.0, 31000.0])),
        line_of_shafts(bodies, [9.0e8, *[6.4e8] * 5, 9.0e8, 3.1e7, 7.5e7], 4e-5),
        (*gas, Torque("propeller", (4.0, 8.0), (3.0e4, 8.0e3), (0.0, 0.4))),
        "propeller",
        (2.6, 14.7),
        quadratic={"propeller": 3647.0},
    )


def timed_plant() -> Machine:
    """The machine whose response is timed."""
    aft = ["flywheel", "clutch", "shaft_1", "shaft_2", "shaft_3", "flange", "hub", "propeller"]
    bodies = ["ring", "damper", *(f"cylinder_{i}" for i in range(1, 7)), *aft]
    orders = [float(order) for order in range(1, 13)]
    return Machine(
        "timed_plant",
        "Engine with six cylinders and a damper, line of shafts, propeller law",
        dict(zip(bodies, [900.0, 2200.0, *[4600.0] * 6, 6500.0, 800.0, 120.0, 120.0, 120.0, 450.0, 300.0, 31000.0])),
        line_of_shafts(bodies, [5.0e7, 9.0e8, *[6.4e8] * 5, 9.0e8, 2.0e8, *[1.5e8] * 3, 2.4e8, 3.0e8, 4.0e8], 4e-5),
        cylinders(SIX_CYLINDERS, orders, [3.2e5 / (1.0 + 0.1 * order**2) for order in orders]),
        "propeller",
        (2.6, 14.7),
        501,
        quadratic={"propeller": 3647.0},
    )


MACHINES = (three_rotors, long_chain, geared_train, branched_gears, damped_engine, ship_plant)
