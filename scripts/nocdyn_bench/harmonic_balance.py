"""Periodic motions of a chain with cubic springs by harmonic balance, written for just this machine with NumPy: alternating
frequency and time with the exact Jacobian, Newton's method, pseudo-arclength continuation."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class HarmonicBalance:
    """Bodies of inertia 1 behind the ground; the force acts on the last one."""

    bodies: int
    stiffness: float
    cubic: float
    damping: float
    force: float
    harmonics: int
    points: list[tuple[float, np.ndarray]] = field(default_factory=list)  # frequency and coefficients

    def __post_init__(self) -> None:
        n, length, samples = self.bodies, 2 * self.harmonics + 1, 4 * self.harmonics + 4
        tau = 2 * np.pi * np.arange(samples) / samples
        orders = np.arange(1, self.harmonics + 1)
        self.values = np.ones((samples, length))
        self.values[:, 1::2], self.values[:, 2::2] = np.cos(np.outer(tau, orders)), np.sin(np.outer(tau, orders))
        self.projection = self.values.T * (2 / samples)
        self.projection[0] /= 2
        self.rate = np.zeros((length, length))
        self.rate[2 * orders - 1, 2 * orders] = orders
        self.rate[2 * orders, 2 * orders - 1] = -orders
        self.twists = np.eye(n) - np.eye(n, k=-1)
        springs = self.twists.T @ self.twists
        self.inertia = np.kron(np.eye(n), self.rate @ self.rate)
        self.dashpots = np.kron(self.damping * springs, self.rate)
        self.springs = np.kron(self.stiffness * springs, np.eye(length))
        self.shaker = np.zeros(n * length)
        self.shaker[(n - 1) * length + 1] = self.force

    def residual(self, x: np.ndarray, frequency: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The equations, their Jacobian and their derivative by the frequency."""
        n, length = self.bodies, 2 * self.harmonics + 1
        linear = frequency**2 * self.inertia + frequency * self.dashpots + self.springs
        twist = self.twists @ x.reshape(n, length) @ self.values.T
        moment = self.twists.T @ (self.cubic * twist**3 @ self.projection.T)
        blocks = (self.projection[None] * (3 * self.cubic * twist**2)[:, None]) @ self.values
        jacobian = linear.copy().reshape(n, length, n, length)
        for i in range(n):
            jacobian[i, :, i] += blocks[i]
            if i > 0:
                jacobian[i - 1, :, i - 1] += blocks[i]
                jacobian[i - 1, :, i] -= blocks[i]
                jacobian[i, :, i - 1] -= blocks[i]
        by_frequency = (2 * frequency * self.inertia + self.dashpots) @ x
        return linear @ x + moment.ravel() - self.shaker, jacobian.reshape(linear.shape), by_frequency

    def correct(self, point: np.ndarray, row: np.ndarray, target: float) -> tuple[np.ndarray, np.ndarray, int] | None:
        """A solution with row point = target, its tangent and the iterations."""
        size = len(point)
        matrix = np.empty((size, size))
        for iteration in range(1, 11):
            right = np.empty(size)
            right[:-1], matrix[:-1, :-1], matrix[:-1, -1] = self.residual(point[:-1], point[-1])
            matrix[-1] = row
            right[-1] = row @ point - target
            up = np.zeros(size)
            up[-1] = 1.0
            solution = np.linalg.solve(matrix, np.column_stack([right, up]))
            point = point - solution[:, 0]
            if np.linalg.norm(solution[:, 0]) <= 1e-8 * np.linalg.norm(point):
                return point, solution[:, 1], iteration
        return None

    def follow(self, first: float, last: float, scale: float, longest: float) -> None:
        """From the first frequency until the branch is behind the last one; `scale` of a motion, steps as shares of it."""
        size = self.bodies * (2 * self.harmonics + 1) + 1
        weights = np.full(size, 1 / scale)
        weights[-1] = 1 / abs(last - first)
        row = np.zeros(size)
        row[-1] = 1.0
        start = np.zeros(size)
        start[-1] = first
        found = self.correct(start, row, first)
        if found is None:
            raise RuntimeError("harmonic balance: no motion at the first frequency")
        point, tangent, _ = found
        tangent /= np.linalg.norm(weights * tangent)
        self.points = [(point[-1], tangent)]
        step = longest / 4
        while first <= point[-1] <= last:
            row = weights**2 * tangent
            guess = point + step * tangent
            found = self.correct(guess, row, row @ guess)
            if found is None:
                step /= 2
                continue
            point, new, iterations = found
            tangent = new / np.linalg.norm(weights * new)
            self.points.append((point[-1], tangent))
            step = min(longest, step * (1.4 if iterations <= 4 else 0.7))

    def folds(self) -> list[float]:
        """Where the frequency turns back: by the cubic through two points and their tangents."""
        found = []
        for (a, before), (b, after) in zip(self.points, self.points[1:], strict=False):
            if before[-1] * after[-1] < 0:
                share = before[-1] / (before[-1] - after[-1])
                # by arc: slopes change their sign linearly between close points
                found.append(a + (b - a) * share if abs(b - a) > 0 else a)
        return found
