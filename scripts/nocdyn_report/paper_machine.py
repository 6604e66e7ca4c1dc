"""The paper's machine in closed form."""

import math
from dataclasses import dataclass

from .failure import ResultsError
from .results import Results


@dataclass(frozen=True)
class SteadyState:
    """The uniform motion without excitation, by the labels of trajectory.csv."""

    values: dict[str, float]
    moment: float  # F1 [N m]


def steady_state(results: Results) -> SteadyState:
    """The root of C w^2 + (B + c (R1/R2)^2) w - A = 0, and what follows from it."""
    bodies, couplings, gears = (results.groups(kind) for kind in ("body", "coupling", "gear"))
    motors, loads = results.groups("motor"), results.groups("load")
    if [len(groups) for groups in (bodies, couplings, gears, motors, loads)] != [3, 1, 1, 1, 1]:
        raise ResultsError(f"{results.folder}: not the paper's machine of three bodies, a coupling and a gear")
    r1, r2 = gears[0]["radii"]
    a, b, c = (motors[0][key] for key in ("a", "b", "c"))
    viscous = loads[0]["viscous"]
    omega = _positive_root(c, b + viscous * (r1 / r2) ** 2, -a)
    moment = -viscous * (r1 / r2) ** 2 * omega
    speeds = (omega, omega, -r1 / r2 * omega)
    values = {f"omega_{body['name']} [rad/s]": speed for body, speed in zip(bodies, speeds)}
    values[f"moment_{couplings[0]['name']} [N m]"] = moment
    values[f"reaction_{gears[0]['name']} [N]"] = viscous * speeds[2] / r2
    return SteadyState(values, moment)


def _positive_root(a: float, b: float, c: float) -> float:
    """Of a x^2 + b x + c for b > 0 > c; without cancellation, and for a = 0 too."""
    return -2.0 * c / (b + math.sqrt(b * b - 4.0 * a * c))
