"""Floquet multipliers of random machines beside those of the variational equations, integrated by SciPy."""

import random

import numpy as np
import pytest
from conftest import all_if_fast
from test_orbit import INTEGRATED, branch

FRAMES = ("ground", "orders", "frequency")  # what holds the machine: the ground; free to turn, excited over its angle or the time
LAWS = ("cubic", "progressive", "saturating", "maxwell", "table")
PERIODIC = 1e-8  # change of a state by Newton's method that ends it
MOTION = 1e-8  # of the largest number of a state: where a motion of 1e-10 begins


class Coupling:
    """Moment and slope of an elastic law, with a viscous damping and a Maxwell branch that may be 0."""

    def __init__(self, law, k, damping, some):
        self.law, self.k, self.damping, self.branch = law, k, damping, (0.0, 1.0)
        self.text = f"stiffness = {k!r}"
        if law == "cubic":
            self.powers = (0.0, some(0.2, 4) * k)
            self.text += f" cubic_stiffness = {self.powers[1]!r}"
        elif law == "progressive":
            self.powers = (some(-0.5, 0.5) * k, some(0.5, 4) * k)
            self.text = f"polynomial = {k!r}, {self.powers[0]!r}, {self.powers[1]!r}"
        elif law == "saturating":
            self.most = some(0.5, 2) * k
            self.text += f" saturation = {self.most!r}"
        elif law == "maxwell":
            self.powers, self.branch = (0.0, k), (some(0.1, 0.5) * k, some(0.005, 0.05))
            self.text += f" cubic_stiffness = {k!r} maxwell_stiffness = {self.branch[0]!r} maxwell_time = {self.branch[1]!r}"
        elif law == "table":
            edge = some(0.01, 0.04)
            self.edges = np.array([-2 * edge, -edge, edge, 2 * edge])
            self.moments = np.array([-3.5, -1.0, 1.0, 3.0]) * edge * k
            self.text = f"table_twist = {', '.join(map(repr, self.edges.tolist()))}"
            self.text += f" table_moment = {', '.join(map(repr, self.moments.tolist()))}"
        self.text += f" damping = {damping!r}"

    def moment(self, u):
        """And its slope."""
        if self.law == "table":
            i = min(max(np.searchsorted(self.edges, u), 1), 3)
            slope = (self.moments[i] - self.moments[i - 1]) / (self.edges[i] - self.edges[i - 1])
            return self.moments[i] + slope * (u - self.edges[i]), slope
        if self.law == "saturating":
            share = np.tanh(self.k * u / self.most)
            return self.most * share, self.k * (1 - share**2)
        two, three = self.powers
        return u * (self.k + u * (two + u * three)), self.k + u * (2 * two + 3 * three * u)


class Machine:
    """A chain on the ground, or free to turn, as an input and as equations."""

    def __init__(self, seed):
        chance = random.Random(f"multipliers {seed}")

        def some(low, high):
            return float(f"{chance.uniform(low, high):.4g}")

        self.frame = FRAMES[seed % 3]
        self.is_free = self.frame != "ground"
        is_stiff, is_undamped = seed % 5 == 4, seed % 5 == 3
        count = 2 if is_stiff else chance.randint(2, 4)
        self.inertia = np.array([some(0.5, 3) for _ in range(count)])
        if is_stiff:
            self.inertia[-1] = 1e-3
        pairs = [(i - 1, i) for i in range(int(self.is_free), count)]  # -1: the ground
        self.couplings = []
        for _ in pairs:
            k = some(200, 3000)
            self.couplings.append(Coupling(chance.choice(LAWS), k, 0.0 if is_undamped else 0.03 * k**0.5, some))
        if is_stiff:
            self.couplings[-1] = Coupling("cubic", 3e4, 5.0, some)
        self.twists = np.zeros((len(pairs), count))
        for row, (i, j) in zip(self.twists, pairs, strict=True):
            row[j] = 1.0
            if i >= 0:
                row[i] = -1.0
        self.damping = np.array([c.damping for c in self.couplings])
        self.branches = np.array([c.branch for c in self.couplings]).T
        self.inner = np.flatnonzero(self.branches[0])  # couplings that have an internal state
        self.amplitude, self.rate = some(20, 80), some(8, 40)
        self.speed, self.torque = some(20, 40), some(20, 40)
        self.load = self.torque / self.speed**2 if self.is_free else 0.0

    def text(self):
        speed = f" speed = {self.speed!r}" if self.is_free else ""
        text = "".join(f"&body name = 'b{i}' inertia = {j!r}{speed} /\n" for i, j in enumerate(self.inertia.tolist()))
        for coupling, row in zip(self.couplings, self.twists, strict=True):
            ends = ", ".join(["'ground'", *(f"'b{i}'" for i in np.flatnonzero(row))][-2:])
            text += f"&coupling name = 'c{np.argmax(row)}' bodies = {ends} {coupling.text} /\n"
        text += f"&motor name = 'm' body = 'b0' kind = 'constant' torque = {self.torque!r} /\n"
        text += f"&load name = 'w' body = 'b{len(self.inertia) - 1}' quadratic = {self.load!r} /\n"
        what, key = f"amplitude = {self.amplitude!r} frequency = {self.rate!r}", "amplitude"
        if self.frame == "orders":
            what, key = f"kind = 'orders' orders = 1.0 amplitudes = {self.amplitude!r}", "amplitudes(1)"
        ends = f"{self.amplitude!r}, {1.02 * self.amplitude!r}"
        orbit = f"&orbit over = 'excitation.e.{key}' range = {ends} tolerance = 1e-10 motions = {self.amplitude!r} /\n"
        return text + f"&excitation name = 'e' body = 'b0' {what} /\n&run t_end = 1.0 /\n" + orbit

    def steady(self):
        """The state at rest, or turning evenly, with linear springs."""
        carry = 1.0 if self.is_free else np.arange(len(self.couplings)) == 0
        twists = (-self.torque if self.is_free else self.torque) * carry / np.array([c.k for c in self.couplings])
        phi = np.cumsum(twists)
        if self.is_free:
            phi = np.append(0.0, phi)
        return np.concatenate([phi, np.full(len(phi), self.speed if self.is_free else 0.0)])

    def slopes(self, t, state):
        """Rates of the state and their Jacobian."""
        n, size = len(self.inertia), len(state)
        phi, omega, inner = state[:n], state[n : 2 * n], state[2 * n :]
        moments, stiffness = np.array([c.moment(u) for c, u in zip(self.couplings, self.twists @ phi, strict=True)]).T
        rate = self.twists @ omega
        moments = moments + self.damping * rate
        moments[self.inner] += inner
        torque = -self.twists.T @ moments
        jacobian = np.zeros((size, size))
        jacobian[:n, n : 2 * n] = np.eye(n)
        below = jacobian[n : 2 * n]
        below[:, :n] = -self.twists.T @ (stiffness[:, None] * self.twists)
        below[:, n : 2 * n] = -self.twists.T @ (self.damping[:, None] * self.twists)
        below[:, 2 * n :] = -self.twists[self.inner].T
        angle = phi[0] if self.frame == "orders" else self.rate * t
        torque[0] += self.torque + self.amplitude * np.sin(angle)
        if self.frame == "orders":
            below[0, 0] += self.amplitude * np.cos(angle)
        torque[-1] -= self.load * abs(omega[-1]) * omega[-1]
        below[-1, 2 * n - 1] -= 2 * self.load * abs(omega[-1])
        below /= self.inertia[:, None]
        k, tau = self.branches[:, self.inner]
        jacobian[2 * n :, n : 2 * n] = k[:, None] * self.twists[self.inner]
        jacobian[2 * n :, 2 * n :] = np.diag(-1 / tau)
        return np.concatenate([omega, torque / self.inertia, k * rate[self.inner] - inner / tau]), jacobian

    def rates(self, t, z, size):
        """Of the state and its variations."""
        rates, jacobian = self.slopes(t, z[:size])
        return np.concatenate([rates, (jacobian @ z[size:].reshape(size, size)).ravel()])

    def multipliers(self, state, period):
        """By shooting from a state: how far it moves, and the multipliers.

        Of a free machine with orders the period is unknown and the time can be shifted, of one with a frequency the mean speed is
        unknown and the angles can be; this multiplier of 1 is left out.
        """
        integrate = pytest.importorskip("scipy.integrate")
        n, size = len(self.inertia), 2 * len(self.inertia) + len(self.inner)
        first = state = np.concatenate([state, np.zeros(len(self.inner))])
        turn = 2 * np.pi if self.frame == "orders" else 0.0
        for _ in range(8):
            begin = np.concatenate([state, np.eye(size).ravel()])
            motion = integrate.solve_ivp(self.rates, (0, period), begin, args=(size,), method="DOP853", rtol=1e-11, atol=1e-12)
            end = motion.y[:size, -1]
            matrix = motion.y[size:, -1].reshape(size, size)
            system, right = matrix - np.eye(size), state - end
            right[:n] += turn
            if self.is_free:
                unknown = self.slopes(period, end)[0] if self.frame == "orders" else -np.repeat((1.0, 0.0), (n, size - n))
                phase = np.eye(1, size + 1)
                system, right = np.vstack([np.column_stack([system, unknown]), phase]), np.append(right, 0.0)
            change = np.linalg.solve(system, right)
            state = state + change[:size]
            if self.frame == "orders":
                period += change[size]
            elif self.is_free:
                turn += change[size]
            if np.abs(change[:size]).max() < PERIODIC * np.abs(state).max():
                break
        else:
            raise AssertionError("Newton's method does not converge")
        values = np.linalg.eigvals(matrix)
        moved = np.abs(state - first)[: 2 * n].max() / np.abs(state).max()
        return moved, np.delete(values, np.abs(values - 1).argmin()) if self.is_free else values


def deviations(nocdyn, seed):
    """How far the integrated motion begins from the one that is written, if one is, and the error of the multipliers."""
    machine = Machine(seed)
    values, _ = branch(nocdyn, machine.text())
    begin, is_written = machine.steady(), (values["harmonics"] > 0).all()  # not by shooting
    if is_written:
        motion = nocdyn.values("out", "motion_1.csv")
        names = [f"{kind}_b{i}" for kind in ("phi", "omega") for i in range(len(machine.inertia))]
        begin = np.array([motion[name][0] for name in names])
    moved, expected = machine.multipliers(begin, 2 * np.pi / values["rate"][0])
    shown = min(6, len(expected))
    found = [values[f"multiplier_{i}_real"][0] + 1j * values[f"multiplier_{i}_imaginary"][0] for i in range(1, shown + 1)]
    distance = np.abs(np.array(found)[:, None] - expected)
    sizes = np.abs(expected)
    must = sizes > np.sort(sizes)[-shown] + INTEGRATED  # of the smallest ones that are shown there may be more
    return moved if is_written else 0.0, max(distance.min(axis=1).max(), distance[:, must].min(axis=0).max(initial=0.0))


@pytest.mark.parametrize("seed", all_if_fast(0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 13))
def test_multipliers_of_random_machines_are_those_of_integrated_variations(nocdyn, seed):
    moved, deviation = deviations(nocdyn, seed)
    assert moved < MOTION
    assert deviation < INTEGRATED
