"""The machines of the workloads, as numbers for the peers and as input files for nocdyn."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .shipped import Shipped


@dataclass(frozen=True)
class Case2:
    """The paper's machine in its reduced form; states omega_1, omega_2, phi_1, phi_2 at 1001 times of 0..10 s."""

    stiffness: float = 100.0
    cubic_stiffness: float = 10.0
    inertia_3: float = 5.0

    states = 4
    inertia_1, inertia_2 = 10.0, 5.0
    ratio = 2.0 / 3.0  # R1 / R2 of the gear
    motor_a, motor_b, motor_c = 200.0, 10.0, 1.0
    viscous = 100.0
    amplitude, frequency = 20.0, 5.0
    t_end = 10.0  # [s]
    moment_of = "coupling"
    watched = (0, 1)  # the bodies whose twist is looked at
    state_names = ("omega_motor", "omega_pinion", "phi_motor", "phi_pinion")

    @property
    def start(self) -> np.ndarray:
        return np.zeros(self.states)

    @property
    def inertia_23(self) -> float:
        """Of bodies 2 and 3, about the axis of body 2."""
        return self.inertia_2 + self.ratio**2 * self.inertia_3

    @property
    def times(self) -> np.ndarray:
        return np.linspace(0.0, self.t_end, 1001)

    @property
    def words(self) -> list[str]:
        """What the program for SUNDIALS wants to know."""
        return ["case2", repr(self.stiffness), repr(self.cubic_stiffness), repr(self.inertia_3)]

    def numbers(self, targets: tuple[str, ...] = (), parameters: np.ndarray | None = None) -> np.ndarray:
        """Viscous load and cubic stiffness of each variant, which are the parameters if there are some."""
        return np.array([[self.viscous, self.cubic_stiffness]]) if parameters is None else parameters

    def moments(self, twists: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Elastic moments [N m]."""
        return (self.stiffness + numbers[:, 1] * twists**2) * twists

    def moment(self, states: np.ndarray) -> np.ndarray:
        return self.moments(states[:, 3] - states[:, 2], self.numbers())

    def select(self, bodies: np.ndarray) -> np.ndarray:
        """The four states from omega and phi of the three bodies."""
        return bodies[:, [0, 1, 3, 4]]

    def write_input(self, file: Path) -> None:
        file.write_text(f"""\
&body       name = 'motor'    inertia = {self.inertia_1} /
&body       name = 'pinion'   inertia = {self.inertia_2} /
&body       name = 'machine'  inertia = {self.inertia_3} /
&coupling   name = 'coupling' bodies = 'motor', 'pinion'   stiffness = {self.stiffness}
            cubic_stiffness = {self.cubic_stiffness} /
&gear       name = 'reducer'  bodies = 'pinion', 'machine' radii = 2.0, 3.0 /
&motor      name = 'drive'    body = 'motor'    a = {self.motor_a}  b = {self.motor_b}  c = {self.motor_c} /
&load       name = 'work'     body = 'machine'  viscous = {self.viscous} /
&excitation name = 'shaker'   body = 'motor'    amplitude = {self.amplitude}  frequency = {self.frequency} /
&run        t_end = 10.0 /
&output     points = 1001 /
""")


@dataclass(frozen=True)
class Chain:
    """Equal rotors in a row, the first one driven; states omega of all, then phi of all, at the start and the end."""

    bodies: int
    stiffness: float = 1.0e4
    cubic_stiffness: float = 1.0e5
    t_end: float = 1.0

    damping = 1.0
    torque = 100.0  # on the first
    viscous = 10.0  # on the last

    @property
    def states(self) -> int:
        return 2 * self.bodies

    @property
    def start(self) -> np.ndarray:
        return np.zeros(self.states)

    @property
    def times(self) -> np.ndarray:
        return np.array([0.0, self.t_end])

    @property
    def words(self) -> list[str]:
        return ["chain", repr(self.stiffness), repr(self.cubic_stiffness), str(self.bodies), repr(self.t_end)]

    def select(self, bodies: np.ndarray) -> np.ndarray:
        return bodies

    def write_input(self, file: Path) -> None:
        lines = [f"&body name = 'r{i}' inertia = 1.0 /" for i in range(self.bodies)]
        lines += [
            f"&coupling name = 'c{i}' bodies = 'r{i}', 'r{i + 1}' stiffness = {self.stiffness} "
            f"cubic_stiffness = {self.cubic_stiffness} damping = {self.damping} /"
            for i in range(self.bodies - 1)
        ]
        lines += [
            f"&motor name = 'drive' body = 'r0' a = {self.torque} b = 0.0 c = 0.0 /",
            f"&load name = 'work' body = 'r{self.bodies - 1}' viscous = {self.viscous} /",
            f"&run t_end = {self.t_end} /",
            "&output points = 2 /",
        ]
        file.write_text("\n".join(lines) + "\n")


Problem = Case2 | Chain | Shipped
