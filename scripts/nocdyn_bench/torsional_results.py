"""Modes and forced responses of drivetrains, and how well two programs agree in them."""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .torsional_machines import Machine

ROUNDING = 1e-9  # relative difference of orders and speeds that are the same ones


@dataclass(frozen=True)
class Modes:
    """Of the oscillations, ascending."""

    undamped: np.ndarray  # natural frequencies [rad/s]
    poles: np.ndarray  # eigenvalues with a positive imaginary part [1/s]

    def differences(self, others: "Modes") -> tuple[float, float]:
        """Largest relative ones of the undamped natural frequencies and of the eigenvalues; inf if their numbers differ."""
        pairs = ((self.undamped, others.undamped), (self.poles, others.poles))
        return tuple(_largest(np.abs(a - b) / np.abs(b)) if a.shape == b.shape else np.inf for a, b in pairs)


@dataclass(frozen=True)
class Response:
    """Complex amplitudes of exp(i order speed t)."""

    speeds: np.ndarray  # of the held body [rad/s]
    orders: np.ndarray
    moments: np.ndarray  # [N m], shape [speeds, shafts, orders]
    angles: np.ndarray  # [rad], shape [speeds, bodies, orders]

    def differences(self, other: "Response") -> tuple[float, float]:
        """Largest ones of moments and angles, each relative to the largest amplitude of that shaft or body."""
        return difference(self.moments, other.moments), difference(self.angles, other.angles)


def difference(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest one, relative to the largest amplitude; shapes [speeds, shafts or bodies, orders]."""
    if found.shape != expected.shape:
        return np.inf
    return _largest(np.abs(found - expected).max(axis=(0, 2)) / np.abs(expected).max(axis=(0, 2)))


def _largest(values: np.ndarray) -> float:
    """Not a number counts as infinitely large."""
    return float(np.nan_to_num(values, nan=np.inf).max())


def read_modes(folder: Path) -> Modes:
    """Of modes.csv."""
    names, rows = _table(folder / "modes.csv", lambda row: row["kind"] == "oscillating")
    undamped = 2.0 * np.pi * rows[:, names.index("undamped_frequency")]
    poles = rows[:, names.index("real")] + 1j * rows[:, names.index("imaginary")]
    return Modes(np.sort(undamped), poles[np.argsort(np.abs(poles))])


def read_response(machine: Machine, folder: Path) -> Response:
    """Of response_orders.csv, which has a row for every speed and order."""
    names, rows = _table(folder / "response_orders.csv")
    speeds = np.unique(rows[:, names.index(f"omega_{machine.held}")])
    rows = rows.reshape(len(speeds), -1, len(names))
    orders = rows[:, :, names.index("order")]
    if not (orders.shape[1] == len(machine.orders) and np.allclose(orders, machine.orders, rtol=ROUNDING, atol=0.0)):
        raise ValueError(f"{machine.name}: nocdyn has other orders than {machine.orders}")

    def amplitudes(columns: list[str]) -> np.ndarray:
        sizes = rows[:, :, [names.index(column) for column in columns]]
        phases = rows[:, :, [names.index(f"phase_{column}") for column in columns]]
        return (sizes * np.exp(1j * np.radians(phases))).transpose(0, 2, 1)

    shafts = [f"moment_shaft_{i}" for i in range(1, len(machine.shafts) + 1)]
    moments = amplitudes([f"total_{name}" if f"total_{name}" in names else name for name in shafts])  # with damping
    return Response(speeds, np.array(machine.orders), moments, amplitudes([f"phi_{body}" for body in machine.bodies]))


def _table(file: Path, wanted: Callable[[dict], bool] = lambda row: True) -> tuple[list[str], np.ndarray]:
    """Names of the columns without their units, and the numbers of the rows that are wanted; nan for words."""
    with file.open(encoding="utf-8", newline="") as stream:
        head, *lines = csv.reader(stream)
    names = [column.partition(" [")[0] for column in head]
    chosen = [line for line in lines if wanted(dict(zip(names, line)))]
    return names, np.array([[_number(cell) for cell in line] for line in chosen]).reshape(len(chosen), len(names))


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan
