"""The modes that 'nocdyn modes --out' wrote, read from their folder."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from .failure import ResultsError
from .json_files import read_json
from .train_layout import GROUND, Train, lay_out
from .trajectory_files import labels_of

TOO_FEW = 1.0e-3  # relative error of a frequency, by the nodes of shafts, from which on the program marks it
VAGUE = 0.03  # from which on it is not known better


@dataclass(frozen=True)
class Modes:
    folder: Path
    content: dict  # of modes.json

    @property
    def bodies(self) -> list[str]:
        return self.content["bodies"]

    @property
    def couplings(self) -> list[str]:
        return [one["name"] for one in self.content["couplings"]]

    @property
    def oscillating(self) -> list[dict]:
        return [mode for mode in self.content["modes"] if mode["kind"] == "oscillating"]

    @property
    def shaped(self) -> list[dict]:
        """Those that oscillate and can be drawn; of large machines the file has the shapes of the first modes only."""
        return [mode for mode in self.oscillating if "shape" in mode]

    def pairs(self, kind: str) -> list[list[int]]:
        """The bodies of couplings or gears, from 0 on, GROUND for the ground."""
        return [[body - 1 if body else GROUND for body in joint["bodies"]] for joint in self.content[kind]]

    @cached_property
    def shafts_with_inertia(self) -> list[int]:
        """Which couplings have shares in the kinetic energy, after the bodies, by the columns of modes.csv."""
        file = self.folder / "modes.csv"
        parts = [label for label in labels_of(file) if label.startswith("kinetic_")] if file.is_file() else []
        shafts = [label.removeprefix("kinetic_").rsplit(" [", 1)[0] for label in parts[len(self.bodies) :]]
        return [self.couplings.index(shaft) for shaft in shafts if shaft in self.couplings]

    @property
    def kinetic_names(self) -> list[str]:
        """What has the shares in the kinetic energy."""
        return self.bodies + [self.couplings[place] for place in self.shafts_with_inertia]

    @cached_property
    def train(self) -> Train:
        return lay_out(len(self.bodies), [pair for pair in self.pairs("couplings") if len(pair) == 2], self.pairs("gears"))


def motion_of(mode: dict) -> np.ndarray:
    """What moves in phase with the largest motion."""
    return np.array(mode["shape"]) * np.cos(np.radians(mode["phase_deg"]))


def marks_of(mode: dict) -> list[str]:
    """What a mode is besides an oscillation of the bodies, in words."""
    marks = [f"mostly {mode['state']}"] if mode.get("state") else []
    error = mode.get("error_by_shaft_nodes", 0.0)
    size = f"more than {100.0 * VAGUE:.2g}" if error > VAGUE else f"about {100.0 * error:.1g}"
    return [*marks, f"nodes too few: error {size} %"] if error > TOO_FEW else marks


def read_modes(folder: Path) -> Modes:
    file = folder / "modes.json"
    if not file.is_file():
        raise ResultsError(f"{folder}: no modes.json here; 'nocdyn modes FILE --out {folder}' writes it")
    return Modes(folder, read_json(file, ("bodies", "couplings", "gears", "modes", "about")))
