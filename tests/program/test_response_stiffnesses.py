"""nocdyn response of machines whose stiffnesses differ by many orders of magnitude, against solutions with exact numbers."""

import json
import os
import random
from fractions import Fraction

import pytest

MACHINES = int(os.environ.get("NOCDYN_RANDOM_MACHINES", "6"))
ORDERS = {1: 10.0, 2.5: 7.0, 4: 3.0}
RIGID = """\
&body name = 'a' inertia = 10 speed = 10 /
&body name = 'b' inertia = 10 /
&body name = 'c' inertia = 10 /
&body name = 'd' inertia = 10 /
&coupling name = 'rigid' bodies = 'a', 'b' stiffness = {!r} relative_damping = 0.1 damping_frequency = 10 /
&coupling name = 'k1' bodies = 'b', 'c' stiffness = 1e6 relative_damping = 0.1 damping_frequency = 10 /
&coupling name = 'k2' bodies = 'c', 'd' stiffness = 1e6 relative_damping = 0.1 damping_frequency = 10 /
&load name = 'l' body = 'd' quadratic = 1 /
&excitation name = 'e' body = 'a' kind = 'orders' orders = 1, 2, 3, 4, 5, 6 amplitudes = 10, 9, 8, 7, 6, 5
  phases = 1, 2, 3, 4, 5, 6 /
&response body = 'a' speed = 10, 200 count = 100 /
&run t_end = 1 /
"""


def response(nocdyn, text):
    outcome = nocdyn("response", nocdyn.write("machine.nml", text), "--out", "out", "-q")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    tables = []
    for name in ("response.csv", "response_orders.csv"):
        header, rows = nocdyn.table("out", name)
        tables.append({label.split(" [")[0]: list(v) for label, v in zip(header, zip(*rows, strict=True), strict=True)})
    return tables


@pytest.mark.parametrize("stiffness", [1e16, 1e18, 1e20, 1e25])
def test_a_rigid_coupling_has_no_noise(nocdyn, stiffness):
    expected, _ = response(nocdyn, RIGID.format(1e14))
    critical = json.loads((nocdyn.folder / "out/response.json").read_text())["critical_speeds"][1]["speed_rad_s"]
    table, _ = response(nocdyn, RIGID.format(stiffness))
    assert len(table["omega_a"]) == len(expected["omega_a"]) < 200
    for label, values in expected.items():
        if label != "heat_rigid":
            assert table[label] == pytest.approx(values, rel=1e-6, abs=1e-7 * max(map(abs, values))), label
    content = json.loads((nocdyn.folder / "out/response.json").read_text())
    assert content["critical_speeds"][1]["speed_rad_s"] == pytest.approx(critical, rel=1e-6)
    assert critical == pytest.approx(89.394, rel=1e-3)  # without damping


def tree(dice, bodies):
    """Inertias, and couplings (first body, second body, stiffness, damping) of a random tree with a ring, not all of it rigid."""
    inertias = [10 ** dice.uniform(-1, 1) for _ in range(bodies)]
    pairs = [(dice.randrange(i), i) for i in range(1, bodies)]
    couplings = [(a, b, 10 ** dice.choice([4, 5, 6, 13, 16, 19]), 10 ** dice.uniform(0, 2)) for a, b in pairs]
    return inertias, [*couplings, (0, bodies - 1, 1e5, 10)]


def exact_solution(matrix, force):
    """Gauss's elimination with pairs of fractions as complex numbers, by the real system of twice the size."""
    n = len(force)
    rows = [[*(z[0] for z in row), *(-z[1] for z in row)] for row in matrix]
    rows += [[*(z[1] for z in row), *(z[0] for z in row)] for row in matrix]
    rows = [[*row, f] for row, f in zip(rows, [*force, *([Fraction(0)] * n)], strict=True)]
    for i in range(2 * n):
        pivot = max(range(i, 2 * n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(i + 1, 2 * n):
            factor = rows[k][i] / rows[i][i]
            rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i], strict=True)] if factor else rows[k]
    x = [Fraction(0)] * (2 * n)
    for i in reversed(range(2 * n)):
        x[i] = (rows[i][-1] - sum(a * b for a, b in zip(rows[i][i + 1 : -1], x[i + 1 :], strict=True))) / rows[i][i]
    return list(zip(x[:n], x[n:], strict=True))


def moment_amplitudes(inertias, couplings, frequency, force):
    """Of all couplings; the frequency and all numbers as they are, without rounding."""
    w = Fraction(frequency)
    n = len(inertias)
    matrix = [[[Fraction(0), Fraction(0)] for _ in range(n)] for _ in range(n)]
    for i, inertia in enumerate(inertias):
        matrix[i][i][0] -= w * w * Fraction(inertia)
    for a, b, stiffness, damping in couplings:
        for i, k, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
            matrix[i][k][0] += sign * Fraction(stiffness)
            matrix[i][k][1] += sign * w * Fraction(damping)
    x = exact_solution(matrix, [Fraction(force), *([Fraction(0)] * (n - 1))])
    found = []
    for a, b, stiffness, damping in couplings:
        u = x[b][0] - x[a][0], x[b][1] - x[a][1]
        k, c = Fraction(stiffness), w * Fraction(damping)
        found.append(abs(complex(k * u[0] - c * u[1], k * u[1] + c * u[0])))
    return found


@pytest.mark.parametrize("seed", range(MACHINES))
def test_moments_of_random_machines_are_those_of_exact_elimination(nocdyn, seed):
    dice = random.Random(seed)
    inertias, couplings = tree(dice, 6)
    text = "".join(f"&body name = 'b{i}' inertia = {inertia!r} /\n" for i, inertia in enumerate(inertias))
    for i, (a, b, stiffness, damping) in enumerate(couplings):
        text += f"&coupling name = 'k{i}' bodies = 'b{a}', 'b{b}' stiffness = {stiffness!r} damping = {damping!r} /\n"
    orders, amplitudes = ", ".join(map(str, ORDERS)), ", ".join(map(str, ORDERS.values()))
    text += f"&excitation name = 'x' body = 'b0' kind = 'orders' orders = {orders} amplitudes = {amplitudes} /\n"
    text += "&response body = 'b0' speed = 5, 40 count = 4 /\n&run t_end = 1 /\n"
    _, table = response(nocdyn, text)
    grid = [i for i, speed in enumerate(table["omega_b0"]) if min(abs(speed - s) for s in (5, 40)) < 1e-9]
    for i in grid:
        exact = moment_amplitudes(inertias, couplings, table["order"][i] * table["omega_b0"][i], ORDERS[table["order"][i]])
        names = [f"moment_k{k}" for k in range(len(couplings))]
        found = [table[f"total_{name}" if f"total_{name}" in table else name][i] for name in names]
        assert found == pytest.approx(exact, rel=1e-6, abs=1e-9 * max(exact)), (seed, i)
