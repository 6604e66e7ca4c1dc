"""Floquet multipliers of random smooth machines beside those of the variational equations, integrated by SciPy."""

import random

import numpy as np
import pytest
from conftest import all_if_fast
from test_orbit import INTEGRATED, branch


class Machine:
    """A chain on the ground, or free to turn with orders of its speed, as an input and as equations."""

    def __init__(self, seed):
        chance = random.Random(f"multipliers {seed}")

        def some(low, high):
            return float(f"{chance.uniform(low, high):.4g}")

        self.is_free = seed % 3 == 2
        self.is_stiff = seed % 5 == 4
        count = 2 if self.is_stiff else chance.randint(2, 4)
        first = 1 if self.is_free else 0
        self.inertia = np.array([some(0.5, 3) for _ in range(count)])
        if self.is_stiff:
            self.inertia[-1] = 1e-3
        self.pairs = [(i - 1, i) for i in range(first, count)]  # -1: the ground
        stiffness = [some(200, 3000) for _ in self.pairs]
        self.laws = [(k, k * some(-0.5, 0.5), k * some(0.5, 4), 0.03 * k**0.5) for k in stiffness]
        if self.is_stiff:
            self.laws[-1] = (3e4, 0.0, 1e5, 5.0)
        self.amplitude, self.rate = some(20, 80), some(8, 40)
        self.speed, self.torque = some(20, 40), some(20, 40)
        self.load = self.torque / self.speed**2

    def text(self):
        speed = f" speed = {self.speed!r}" if self.is_free else ""
        text = "".join(f"&body name = 'b{i}' inertia = {j!r}{speed} /\n" for i, j in enumerate(self.inertia.tolist()))
        for (i, j), (k, k2, k3, c) in zip(self.pairs, self.laws, strict=True):
            one = "ground" if i < 0 else f"b{i}"
            text += f"&coupling name = 'c{j}' bodies = '{one}', 'b{j}' polynomial = {k!r}, {k2!r}, {k3!r} damping = {c!r} /\n"
        what = f"amplitude = {self.amplitude!r} frequency = {self.rate!r}"
        if self.is_free:
            text += f"&motor name = 'm' body = 'b0' kind = 'constant' torque = {self.torque!r} /\n"
            text += f"&load name = 'w' body = 'b{len(self.inertia) - 1}' quadratic = {self.load!r} /\n"
            what = f"kind = 'orders' orders = 1.0 amplitudes = {self.amplitude!r}"
        value, key = (self.amplitude, "amplitudes(1)") if self.is_free else (self.amplitude, "amplitude")
        orbit = f"&orbit over = 'excitation.e.{key}' range = {value!r}, {1.02 * value!r} tolerance = 1e-10 /\n"
        return text + f"&excitation name = 'e' body = 'b0' {what} /\n&run t_end = 1.0 /\n" + orbit

    def rates(self, t, z):
        """Of the state and its variations."""
        n = len(self.inertia)
        phi, omega, matrix = z[:n], z[n : 2 * n], z[2 * n :].reshape(2 * n, 2 * n)
        torque, by_phi, by_omega = np.zeros(n), np.zeros((n, n)), np.zeros((n, n))
        for (i, j), (k, k2, k3, c) in zip(self.pairs, self.laws, strict=True):
            row = np.zeros(n)
            row[j] = 1.0
            if i >= 0:
                row[i] = -1.0
            twist, rate = row @ phi, row @ omega
            torque -= row * (k * twist + k2 * twist**2 + k3 * twist**3 + c * rate)
            by_phi -= np.outer(row, row) * (k + 2 * k2 * twist + 3 * k3 * twist**2)
            by_omega -= np.outer(row, row) * c
        if self.is_free:
            torque[0] += self.torque + self.amplitude * np.cos(phi[0])
            by_phi[0, 0] -= self.amplitude * np.sin(phi[0])
            torque[-1] -= self.load * omega[-1] ** 2
            by_omega[-1, -1] -= 2 * self.load * omega[-1]
        else:
            torque[0] += self.amplitude * np.cos(self.rate * t)
        slopes = np.block([[np.zeros((n, n)), np.eye(n)], [(by_phi.T / self.inertia).T, (by_omega.T / self.inertia).T]])
        return np.concatenate([omega, torque / self.inertia, (slopes @ matrix).ravel()])

    def multipliers(self):
        """By shooting; of a free machine the period is unknown, and its shift in time is left out."""
        integrate = pytest.importorskip("scipy.integrate")
        n = len(self.inertia)
        state, period = np.zeros(2 * n), 2 * np.pi / (self.speed if self.is_free else self.rate)
        if self.is_free:
            state[n:] = self.speed
        turns = 2 * np.pi if self.is_free else 0.0
        for _ in range(12):
            begin = np.concatenate([state, np.eye(2 * n).ravel()])
            end = integrate.solve_ivp(self.rates, (0, period), begin, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
            matrix = end[2 * n :].reshape(2 * n, 2 * n)
            system, right = matrix - np.eye(2 * n), state - end[: 2 * n]
            right[:n] += turns
            if self.is_free:
                phase = np.zeros((1, 2 * n + 1))
                phase[0, 0] = 1.0
                system = np.vstack([np.column_stack([system, self.rates(period, end)[: 2 * n]]), phase])
                right = np.append(right, -state[0])
            change = np.linalg.solve(system, right)
            state = state + change[: 2 * n]
            period += change[2 * n] if self.is_free else 0.0
            if np.abs(change).max() < 1e-8:
                break
        values = np.linalg.eigvals(matrix)
        return np.delete(values, np.abs(values - 1).argmin()) if self.is_free else values


@pytest.mark.parametrize("seed", all_if_fast(1, 2, 4, 5))
def test_multipliers_of_random_machines_are_those_of_integrated_variations(nocdyn, seed):
    machine = Machine(seed)
    values, _ = branch(nocdyn, machine.text())
    expected = machine.multipliers()
    shown = min(6, len(expected))
    found = np.array(
        [values[f"multiplier_{i}_real"][0] + 1j * values[f"multiplier_{i}_imaginary"][0] for i in range(1, shown + 1)]
    )
    largest = sorted(np.abs(expected), reverse=True)[shown - 1]
    for multiplier in expected[np.abs(expected) > largest + INTEGRATED]:
        assert np.abs(found - multiplier).min() < INTEGRATED
