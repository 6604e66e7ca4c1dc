"""Wall times of whole processes, taken in turns so that a busy moment of the machine hits all alike."""

import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import numpy as np


@dataclass
class Contestant:
    label: str
    command: Sequence[str | Path]
    trajectory: Path | None = None  # the CSV that the command writes, if its accuracy is of interest
    seconds: list[float] = field(default_factory=list)  # of each round

    @property
    def median(self) -> float:
        return median(self.seconds)


@dataclass(frozen=True)
class Workload:
    """Contestants that do the same; the first one is the measure of the others."""

    name: str
    title: str
    contestants: list[Contestant]
    reference: Path | None = None  # trajectory.csv of an accurate run
    rival: str = ""  # label of the contestant that the first one is to beat ...
    factor: float = 1.0  # ... by this much

    @property
    def target(self) -> str:
        """What is asked for and what was found, '' if nothing is asked for."""
        if not self.rival:
            return ""
        other = next(contestant for contestant in self.contestants if contestant.label == self.rival)
        found = other.median / self.contestants[0].median
        verdict = "reached" if found >= self.factor else "missed"
        return f"{self.rival} takes {found:.1f} times as long; at least {self.factor:g} times are wanted: {verdict}."


def measure(workload: Workload, rounds: int) -> None:
    """Runs every contestant once to warm up, then `rounds` times in turns."""
    for contestant in workload.contestants:
        _run(contestant)
        contestant.seconds.clear()
    for _ in range(rounds):
        for contestant in workload.contestants:
            _run(contestant)


def _run(contestant: Contestant) -> None:
    began = time.perf_counter()
    subprocess.run(contestant.command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, check=True)
    contestant.seconds.append(time.perf_counter() - began)


def largest_error(trajectory: Path, reference: Path) -> float:
    """Largest difference of an angle [rad] or a speed [rad/s] from the reference, over all rows."""
    labels = reference.read_text(encoding="utf-8").partition("\n")[0].split(",")
    states = [i for i, label in enumerate(labels) if label.startswith(("phi_", "omega_"))]
    found, expected = (np.loadtxt(file, delimiter=",", skiprows=1, usecols=states) for file in (trajectory, reference))
    return float(np.abs(found - expected).max())
