"""Modes and forced responses of drivetrains by openTorsion."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import opentorsion as ot

from ..torsional_machines import Machine
from ..torsional_results import Modes, Response


@dataclass(frozen=True)
class Train:
    """The assembly of a machine at a speed of its held body [rad/s]; the coordinates q are those that the gears leave."""

    machine: Machine
    speed: float

    @cached_property
    def assembly(self) -> ot.Assembly:
        machine = self.machine
        damping = machine.damping(self.speed)
        shafts = sorted(machine.shafts, key=lambda shaft: machine.index(shaft.first))
        gears = []
        for gear in machine.gears:  # the inertia of a wheel is that of its disk
            parent = ot.Gear(machine.index(gear.first), 0.0, gear.radii[0])
            gears += [parent, ot.Gear(machine.index(gear.second), 0.0, gear.radii[1], parent=parent)]
        return ot.Assembly(
            [ot.Shaft(machine.index(one.first), machine.index(one.second), k=one.stiffness, c=one.damping) for one in shafts],
            [ot.Disk(i, inertia, damping[i]) for i, inertia in enumerate(machine.inertias.values())],
            gears or None,
        )

    @cached_property
    def to_bodies(self) -> np.ndarray:
        """The angles of all bodies from q, shape [bodies, coordinates]."""
        has_gears = self.assembly.gear_elements is not None
        return self.assembly.T(self.assembly.E()) if has_gears else np.eye(len(self.machine.inertias))

    def moments(self, elastic: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Of the shafts in the order of the machine, from elastic parts and rates of q; a positive twist has a positive one."""
        sorted_by = np.argsort([self.machine.index(shaft.first) for shaft in self.machine.shafts])
        found = np.empty((len(sorted_by), *rates.shape[1:]), dtype=complex)
        found[sorted_by] = -(elastic + np.tensordot(self.assembly.D, rates, 1))
        return found

    def excitations(self, speeds: np.ndarray) -> np.ndarray:
        """Complex amplitudes of exp(i order speed t) on q, shape [coordinates, speeds, orders]."""
        machine = self.machine
        angles, orders = self.mean_angles(speeds), np.array(machine.orders)
        found = np.zeros((len(machine.inertias), len(speeds), len(orders)), dtype=complex)
        for torque in machine.torques:
            body = machine.index(torque.body)
            ratio = machine.ratios[body]
            lines = [int(np.argmin(np.abs(orders - order * abs(ratio)))) for order in torque.orders]
            turns = np.exp(1j * (np.outer(angles[body], torque.orders) + np.array(torque.phases)))
            values = -1j * np.array(torque.amplitudes) * turns
            found[body][:, lines] += values if ratio > 0.0 else values.conj()
        return np.tensordot(self.to_bodies.T, found, 1)

    def mean_angles(self, speeds: np.ndarray) -> np.ndarray:
        """Of the bodies, shape [bodies, speeds], by the loads and the torque that holds the speed; 0 of the held body [rad]."""
        held = self.to_bodies[self.machine.index(self.machine.held)]
        torques = self.to_bodies.T @ np.array([self.machine.mean_torques(speed) for speed in speeds]).T
        matrix = np.block([[self.assembly.K, -held[:, None]], [held, np.zeros(1)]])
        return self.to_bodies @ np.linalg.solve(matrix, np.vstack([torques, np.zeros(len(speeds))]))[:-1]


def modes(machine: Machine) -> Modes:
    """At the highest speed, without the motion of the whole machine."""
    assembly = Train(machine, machine.speeds[1]).assembly
    squares, _ = assembly.undamped_modal_analysis()
    magnitudes, imaginary, ratios = assembly.modal_analysis()
    count = len(squares) - 1
    poles = -ratios * magnitudes + 1j * imaginary
    upper = poles[imaginary > 0.0]
    return Modes(np.sqrt(np.sort(squares.real)[1:]), upper[np.argsort(np.abs(upper))][-count:])


def response(machine: Machine, speeds: np.ndarray) -> Response:
    """At these speeds [rad/s], with all orders of the torques."""
    moments, angles = [], []
    orders = np.array(machine.orders)
    for speed in speeds:
        train = Train(machine, speed)
        omegas = orders * speed
        excitation = ot.PeriodicExcitation(len(train.assembly.M), omegas)
        excitation.U = train.excitations(np.array([speed]))[:, 0]
        elastic, _ = train.assembly.vibratory_torque(excitation)
        positions, rates = train.assembly.ss_response(excitation.U, omegas)
        moments.append(train.moments(elastic, rates))
        angles.append(train.to_bodies @ positions)
    return Response(speeds, orders, np.array(moments), np.array(angles))


def quick_moments(machine: Machine, speeds: np.ndarray) -> np.ndarray:
    """Moments of the shafts as in `response`, in as little time as the functions of openTorsion let it take.

    One assembly, whose damping changes with the speed; a call for all orders of a speed, as in its tutorial.
    """
    train = Train(machine, 0.0)
    assembly, to_bodies = train.assembly, train.to_bodies
    orders = np.array(machine.orders)
    shape = (len(assembly.M), len(speeds), len(orders))
    positions, rates = np.empty(shape, dtype=complex), np.empty(shape, dtype=complex)
    torques = train.excitations(speeds)
    for i, speed in enumerate(speeds):
        damping = assembly.C + to_bodies.T @ (machine.damping(speed)[:, None] * to_bodies)
        positions[:, i], rates[:, i] = assembly.ss_response(torques[:, i], orders * speed, C=damping)
    return train.moments(np.tensordot(assembly.S, positions, 1), rates).transpose(1, 0, 2)


def stacked_moments(machine: Machine, speeds: np.ndarray) -> np.ndarray:
    """The same from the matrices of openTorsion alone: numpy solves the equations of all speeds and orders in one call."""
    train = Train(machine, 0.0)
    assembly, to_bodies = train.assembly, train.to_bodies
    omegas = speeds[:, None] * np.array(machine.orders)
    slopes = np.array([machine.damping(speed) for speed in speeds])
    damping = assembly.C + to_bodies.T @ (slopes[:, :, None] * to_bodies)
    square = omegas[:, :, None, None]
    matrices = assembly.K - square**2 * assembly.M + 1j * square * damping[:, None]
    positions = np.linalg.solve(matrices, train.excitations(speeds).transpose(1, 2, 0)[..., None])[..., 0].transpose(2, 0, 1)
    return train.moments(np.tensordot(assembly.S, positions, 1), 1j * omegas * positions).transpose(1, 0, 2)
