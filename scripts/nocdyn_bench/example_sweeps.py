"""What a sweep of each shipped example costs, with the default method and with the fastest one."""

from pathlib import Path

import numpy as np

from .contestant import ContestantError
from .nocdyn_sweep import Sweeper
from .shipped import Shipped
from .tables import rounded, table
from .variants import Errors, Family

RTOL, ATOL_OF_RTOL = 1e-6, 1e-3  # the defaults of &run
DEFAULT = "auto"
TIGHTER = 1e-4  # rtol of the reference, relative to RTOL
WANTED = Errors(np.inf, 1e-4)  # of the peaks
FEW = 32  # variants whose peaks are compared
LEAST, MOST = 64, 4096  # variants of a timed sweep; between them as many as take about SECONDS
SECONDS = 0.5
SLOW = 2.0  # a method that takes so many times as long as the fastest one is not timed
SPREAD = 0.1  # of the stiffness that is varied


def example_sweeps(folder: Path, scratch: Path, files: list[Path], methods: list[str], rounds: int) -> list[str]:
    """Lines of the table; `folder`: of the programs."""
    head = ["input", "bodies", "varied", f"`{DEFAULT}`, variants per second", "error of the peaks", "fastest method"]
    rows = [_row(folder, scratch, file, methods, rounds) for file in files]
    return [
        *table([*head, "variants per second", "error of the peaks"], rows),
        "",
        f"One thread, rtol = {RTOL:.0e}, atol = {ATOL_OF_RTOL * RTOL:.0e}, which are the defaults, not the tighter tolerances of "
        f"the inputs. Varied is a stiffness, at random by up to {SPREAD:.0%}; recorded is the largest elastic moment of that "
        f"coupling. The fastest method is that of {', '.join(f'`{method}`' for method in methods)} whose peaks have relative "
        f"errors below {WANTED.peak:.0e}, compared with `{DEFAULT}` at rtol = {TIGHTER * RTOL:.0e}. Rates are those of "
        "`summary.json`.",
    ]


def with_springs(files: list[Path]) -> list[Path]:
    """Those of the files that have a coupling with a stiffness, and no load cases."""
    machines = {file: Shipped(file, "") for file in files}
    return [
        file
        for file, machine in machines.items()
        if any("stiffness" in group for group in machine.of("coupling")) and not machine.of("load_case")
    ]


def family_of(file: Path) -> Family:
    """Variants of the first coupling that has a stiffness."""
    coupling = next(group for group in Shipped(file, "").of("coupling") if "stiffness" in group)
    name, stiffness = coupling["name"], coupling["stiffness"]
    limits = ((1.0 - SPREAD) * stiffness, (1.0 + SPREAD) * stiffness)
    return Family(Shipped(file, name), (f"coupling.{name}.stiffness",), (limits,), WANTED, compared=0, outputs=0)


def _row(folder: Path, scratch: Path, file: Path, methods: list[str], rounds: int) -> list[str]:
    family = family_of(file)
    sweepers = {method: Sweeper(folder, scratch, family, method, atol_of_rtol=ATOL_OF_RTOL) for method in methods}
    exact = sweepers[DEFAULT].solve(TIGHTER * RTOL, family.variants(FEW)).results[:, -1]
    seconds, errors = {}, {}
    for method, sweeper in sweepers.items():
        try:
            found = sweeper.solve(RTOL, family.variants(FEW))
        except ContestantError:
            continue  # this method is not for this machine
        error = float(np.abs(found.results[:, -1] / exact - 1.0).max())
        if method == DEFAULT or error < WANTED.peak:
            seconds[method], errors[method] = found.seconds, error
    timed = [method for method in seconds if method == DEFAULT or seconds[method] < SLOW * min(seconds.values())]
    rates = {method: _rate(sweepers[method], seconds[method], rounds) for method in timed}
    best = max(timed, key=lambda method: rates[method])
    row = [f"`{file.stem}`", str(family.problem.bodies), f"`{family.targets[0]}`"]
    for label, method in (([], DEFAULT), ([f"`{best}`"], best)):
        row += [*label, rounded(rates[method]), f"{errors[method]:.0e}"]
    return row


def _rate(sweeper: Sweeper, seconds: float, rounds: int) -> float:
    """Variants per second; `seconds`: of FEW."""
    count = int(np.clip(FEW * SECONDS / seconds, LEAST, MOST))
    return max(count / sweeper.seconds(RTOL, count) for _ in range(rounds))
