"""Machines of input files, as numbers for the peers."""

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import f90nml
import numpy as np

# The groups and keys whose laws the peers know.
KNOWN = {
    "case": {"title"},
    "body": {"name", "inertia", "speed"},
    "coupling": {"name", "bodies", "stiffness", "damping", "gap"},
    "motor": {"name", "body", "kind", "torque", "a", "b", "c"},
    "load": {"name", "body", "viscous"},
    "excitation": {"name", "body", "kind", "table_file"},
    "engine": {"name", "cylinders", "stroke", "firing_deg", "orders", "amplitudes"},
    "run": {"t_end", "method", "rtol", "atol"},
    "output": {"interval"},
}
COUPLING_KEYS = ("stiffness", "damping", "gap")
WITHOUT_MOTION = {"response", "limit"}  # groups of other commands than run and sweep


@dataclass(frozen=True)
class Shipped:
    """A machine without gears; states omega of all bodies, then phi of all."""

    file: Path
    moment_of: str  # the coupling whose elastic moment is looked at; it has no gap

    @cached_property
    def groups(self) -> dict[str, list[dict]]:
        found = {}
        for name, groups in f90nml.read(self.file).items():
            found.setdefault(name, []).extend(groups if isinstance(groups, list) else [groups])
        return found

    def check(self) -> None:
        """ValueError if a key has a law that is not known here."""
        for name, groups in self.groups.items():
            if name in WITHOUT_MOTION:
                continue
            strange = {key for group in groups for key in group} - KNOWN.get(name, set())
            if name not in KNOWN or strange:
                raise ValueError(f"{self.file.name}: the peers do not know &{name} {' '.join(sorted(strange))}".rstrip())

    def of(self, group: str) -> list[dict]:
        return self.groups.get(group, [])

    def values(self, group: str, key: str) -> np.ndarray:
        return np.array([float(one.get(key, 0.0)) for one in self.of(group)])

    def body(self, name: str) -> int:
        return [body["name"] for body in self.of("body")].index(name)

    @property
    def bodies(self) -> int:
        return len(self.of("body"))

    @property
    def states(self) -> int:
        return 2 * self.bodies

    @property
    def state_names(self) -> list[str]:
        return [f"{quantity}_{body['name']}" for quantity in ("omega", "phi") for body in self.of("body")]

    @property
    def start(self) -> np.ndarray:
        return np.concatenate([self.values("body", "speed"), np.zeros(self.bodies)])

    @property
    def t_end(self) -> float:
        return float(self.of("run")[0]["t_end"])

    @property
    def times(self) -> np.ndarray:
        interval = float(self.of("output")[0]["interval"])
        return interval * np.arange(round(self.t_end / interval) + 1)

    @property
    def ends(self) -> np.ndarray:
        """Of the bodies of each coupling, shape [couplings, 2]."""
        return np.array([[self.body(name) for name in coupling["bodies"]] for coupling in self.of("coupling")])

    @property
    def watched(self) -> tuple[int, int]:
        """The bodies whose twist is looked at."""
        return tuple(self.ends[self._coupling(self.moment_of)])

    def _coupling(self, name: str) -> int:
        return [coupling["name"] for coupling in self.of("coupling")].index(name)

    def place(self, target: str) -> tuple[int, int]:
        """Key and coupling of a number that is varied."""
        group, name, key = target.split(".")
        if group != "coupling":
            raise ValueError(f"only keys of couplings can be varied here, not {target}")
        return COUPLING_KEYS.index(key), self._coupling(name)

    def numbers(self, targets: tuple[str, ...] = (), parameters: np.ndarray | None = None) -> np.ndarray:
        """Stiffness, damping and gap of all couplings, for each variant; shape [variants, keys * couplings]."""
        self.check()
        values = np.array([self.values("coupling", key) for key in COUPLING_KEYS])
        found = np.tile(values, (1 if parameters is None else len(parameters), 1, 1))
        for i, target in enumerate(targets):
            found[:, *self.place(target)] = parameters[:, i]
        return found.reshape(len(found), -1)

    def moments(self, twists: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Elastic moments [N m] of the coupling that is looked at."""
        return numbers[:, self._coupling(self.moment_of)] * twists

    def moment(self, states: np.ndarray) -> np.ndarray:
        first, second = self.watched
        return self.moments(states[:, self.bodies + second] - states[:, self.bodies + first], self.numbers())

    @property
    def motor(self) -> np.ndarray:
        """a, b, c of torques a - b omega - c omega**2 on the bodies, shape [bodies, 3]; those of the loads too."""
        found = np.zeros((self.bodies, 3))
        for motor in self.of("motor"):
            kind = motor.get("kind", "quadratic")
            if kind not in ("quadratic", "constant"):
                raise ValueError(f"{self.file.name}: the peers do not know motors of kind {kind}")
            law = [motor["torque"], 0.0, 0.0] if kind == "constant" else [motor[key] for key in "abc"]
            found[self.body(motor["body"])] += law
        for load in self.of("load"):
            found[self.body(load["body"]), 1] += load["viscous"]
        return found

    @property
    def orders(self) -> list[tuple[int, np.ndarray]]:
        """Body; order, amplitude [N m] and phase [rad] of each harmonic of its angle."""
        found = []
        for engine in self.of("engine"):
            orders, amplitudes = (np.array(engine[key], dtype=float) for key in ("orders", "amplitudes"))
            for body, firing in zip(engine["cylinders"], np.radians(engine["firing_deg"])):
                found.append((self.body(body), np.array([orders, amplitudes, -orders * firing]).T))
        return found

    @property
    def tables(self) -> list[tuple[int, np.ndarray]]:
        """Body; time [s] and torque [N m] of each point. Before the first and after the last one the torque is constant."""
        files = [group for group in self.of("excitation") if group["kind"] == "table"]
        return [(self.body(group["body"]), np.loadtxt(self.file.parent / group["table_file"], delimiter=",")) for group in files]

    def select(self, bodies: np.ndarray) -> np.ndarray:
        return bodies

    def write_input(self, file: Path) -> None:
        """With the tables where they are."""
        text = self.file.read_text(encoding="utf-8")
        file.write_text(re.sub(r"((?:table|pressure)_file = ')", rf"\1{self.file.resolve().parent}/", text), encoding="utf-8")
