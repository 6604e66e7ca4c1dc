"""Modes and forced responses beside openTorsion: whether both agree, and how long a response takes."""

import json
import os
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

import numpy as np

from .peers import opentorsion
from .tables import table
from .torsional_machines import MACHINES, Machine, timed_plant
from .torsional_results import ROUNDING, difference, read_modes, read_response

LARGEST_DIFFERENCE = 1e-8
FACTOR = 20.0  # that openTorsion is to take longer
OURS, ALONE = "nocdyn, the computation", "nocdyn, the computation in one thread"
WHOLE = "nocdyn, whole process with its files"
THEIRS, STACKED = "openTorsion", "numpy, all equations stacked, matrices of openTorsion"


@dataclass(frozen=True)
class Agreement:
    """Largest relative differences of one machine."""

    machine: Machine
    undamped: float
    poles: float
    moments: float
    angles: float

    @property
    def largest(self) -> float:
        return max(self.undamped, self.poles, self.moments, self.angles)


@dataclass
class Torsional:
    name: str
    title: str
    nocdyn: Path
    scratch: Path
    agreements: list[Agreement] = field(default_factory=list)
    seconds: dict[str, list[float]] = field(default_factory=dict)  # of each round
    timed_differences: dict[str, float] = field(default_factory=dict)  # largest ones from nocdyn
    speeds: int = 0  # at which nocdyn computed the response that is timed

    def measure(self, rounds: int) -> None:
        self.agreements = [self._compare(machine()) for machine in MACHINES]
        self._time(timed_plant(), rounds)

    @property
    def ratio(self) -> float:
        """Of the shortest times."""
        return min(self.seconds[THEIRS]) / min(self.seconds[OURS])

    @property
    def disagreements(self) -> list[str]:
        found = {f"{one.machine.name}: nocdyn and openTorsion": one.largest for one in self.agreements}
        found |= {f"timed response: nocdyn and {label}": largest for label, largest in self.timed_differences.items()}
        return [
            f"{label} differ by {largest:.1e}, more than {LARGEST_DIFFERENCE:.0e}"
            for label, largest in found.items()
            if not largest <= LARGEST_DIFFERENCE
        ]

    @property
    def lines(self) -> list[str]:
        head = ["machine", "bodies", "undamped frequencies", "eigenvalues", "moments", "angles"]
        rows = [
            [one.machine.title, str(len(one.machine.inertias))]
            + [f"{number:.0e}" for number in (one.undamped, one.poles, one.moments, one.angles)]
            for one in self.agreements
        ]
        times = [
            [label, f"{1e3 * min(seconds):.3g}", f"{1e3 * median(seconds):.3g}", f"{min(seconds) / min(self.seconds[OURS]):.3g}"]
            for label, seconds in self.seconds.items()
        ]
        machine = self.agreements[-1].machine
        return [
            *table(head, rows),
            "",
            "Largest relative differences: frequencies and damped eigenvalues one by one, complex amplitudes of moments and "
            "angles in relation to the largest one of that shaft or body, at all speeds and orders that nocdyn wrote.",
            "",
            *table(["response", "shortest, ms", f"median of {len(self.seconds[OURS])}, ms", "ratio"], times),
            "",
            f"{machine.title}: {len(machine.inertias)} bodies, {len(machine.orders)} orders, {machine.count} speeds. nocdyn adds "
            f"the critical speeds and finds the peaks between, {self.speeds} speeds in all, and sums the orders in time; "
            "the others compute the complex moments of the shafts only. openTorsion: `ss_response` with all orders of a "
            "speed in one call.",
        ]

    def _run(self, machine: Machine, command: str, *options: str, **environment: str) -> Path:
        """The folder with the results of a command of nocdyn."""
        file, out = self.scratch / f"{machine.name}_{command}.nml", self.scratch / f"{machine.name}_{command}"
        machine.write_input(file, has_torques=command == "response")
        line = [self.nocdyn, command, *options, "--out", out, file]
        subprocess.run(line, env={**os.environ, **environment}, check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        return out

    def _compare(self, machine: Machine) -> Agreement:
        modes = read_modes(self._run(machine, "modes", "--at", "0"))
        found = read_response(machine, self._run(machine, "response", "--quiet"))
        expected = opentorsion.response(machine, found.speeds)
        return Agreement(machine, *modes.differences(opentorsion.modes(machine)), *found.differences(expected))

    def _time(self, machine: Machine, rounds: int) -> None:
        """In turns; what is timed is compared too."""
        self.agreements.append(self._compare(machine))
        speeds = np.linspace(*machine.speeds, machine.count)
        out = self._run(machine, "response", "--quiet")
        found = read_response(machine, out)
        self.speeds = len(found.speeds)
        on_grid = found.moments[[int(np.argmin(np.abs(found.speeds - speed))) for speed in speeds]]
        if not np.isclose(found.speeds[:, None], speeds, rtol=ROUNDING, atol=0.0).any(axis=0).all():
            raise ValueError(f"{machine.name}: nocdyn left out speeds of its grid")
        self.seconds = {label: [] for label in (OURS, ALONE, WHOLE, THEIRS, STACKED)}
        for _ in range(rounds):
            self.seconds[WHOLE].append(_seconds(lambda: self._run(machine, "response", "--quiet"))[0])
            self.seconds[OURS].append(_wall_time(out))
            self.seconds[ALONE].append(_wall_time(self._run(machine, "response", "--quiet", OMP_NUM_THREADS="1")))
            for label, compute in ((THEIRS, opentorsion.quick_moments), (STACKED, opentorsion.stacked_moments)):
                seconds, moments = _seconds(lambda compute=compute: compute(machine, speeds))
                self.seconds[label].append(seconds)
                self.timed_differences[label] = difference(moments, on_grid)


def _wall_time(folder: Path) -> float:
    """What nocdyn needed without reading and writing files [s]."""
    return json.loads((folder / "response.json").read_text(encoding="utf-8"))["wall_time_s"]


def _seconds(compute: Callable[[], object]) -> tuple[float, object]:
    began = time.perf_counter()
    found = compute()
    return time.perf_counter() - began, found
