"""Couplings with Maxwell branches: springs in series with dampers, beside the spring."""

import csv
import itertools
import json

import numpy as np
import pytest

STIFFNESS, BRANCHES, TIMES = 100.0, (50.0, 30.0), (0.1, 0.01)
INERTIA = (1.0, 2.0)
MACHINE = """&body name = 'a' inertia = 1.0 {start} /
&body name = 'b' inertia = 2.0 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 100.0 maxwell_stiffness = 50.0, 30.0 maxwell_time = 0.1, 0.01 /
&run t_end = 2.0 rtol = 1e-9 atol = 1e-11 /
"""


def motion() -> np.ndarray:
    """The matrix of the angles, the speeds and the moments of the branches."""
    matrix = np.zeros((6, 6))
    matrix[0, 2] = matrix[1, 3] = 1.0
    for body, sign in ((0, 1.0), (1, -1.0)):
        matrix[2 + body, :2] = sign * STIFFNESS / INERTIA[body] * np.array([-1.0, 1.0])
        matrix[2 + body, 4:] = sign / INERTIA[body]
    for branch in (0, 1):
        matrix[4 + branch, 2:4] = BRANCHES[branch] * np.array([-1.0, 1.0])
        matrix[4 + branch, 4 + branch] = -1.0 / TIMES[branch]
    return matrix


@pytest.mark.parametrize("method", ["auto", "rk45", "rodas5p", "taylor"])
def test_a_run_follows_the_exact_motion_and_keeps_the_energy(nocdyn, method):
    nocdyn.write("m.nml", MACHINE.format(start="angle = 0.1"))
    assert nocdyn("run", "m.nml", "--quiet", "--set", f"run.method={method}").returncode == 0
    values, vectors = np.linalg.eig(motion())
    parts = np.linalg.solve(vectors, np.array([0.1, 0, 0, 0, 0, 0], dtype=complex))
    with (nocdyn.folder / "results/m/trajectory.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row in rows[::100]:
        state = (vectors @ (parts * np.exp(values * float(row["t [s]"])))).real
        total = STIFFNESS * (state[1] - state[0]) + state[4] + state[5]
        assert float(row["phi_a [rad]"]) == pytest.approx(state[0], abs=1e-8)
        assert float(row["total_moment_k [N m]"]) == pytest.approx(total, abs=1e-5)
        elastic = STIFFNESS * (state[1] - state[0]) ** 2 / 2 + sum(state[4:] ** 2 / (2 * np.array(BRANCHES)))
        assert float(row["elastic_energy [J]"]) == pytest.approx(elastic, abs=1e-8)
        assert abs(float(row["energy_residual [J]"])) < 1e-8
    summary = json.loads((nocdyn.folder / "results/m/summary.json").read_text())
    lost = [float(row["work_out [J]"]) for row in rows]
    assert all(after >= before - 1e-9 for before, after in itertools.pairwise(lost))  # the dampers only lose
    assert summary["energy_account"]["work_in_J"]["coupling k"] == pytest.approx(-lost[-1], abs=1e-9)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("maxwell_stiffness = 1.0", "maxwell_stiffness needs maxwell_time"),
        ("maxwell_stiffness = 1.0, 2.0 maxwell_time = 0.1", "maxwell_time"),
        ("maxwell_stiffness = 1.0 maxwell_time = 0.1 gap = 0.1", "gap"),
        ("maxwell_stiffness = 1.0 maxwell_time = 0.0", "> 0"),
    ],
)
def test_branches_that_cannot_be_are_refused(nocdyn, keys, message):
    text = MACHINE.format(start="").replace("maxwell_stiffness = 50.0, 30.0 maxwell_time = 0.1, 0.01", keys)
    nocdyn.write("m.nml", text)
    result = nocdyn("check", "m.nml")
    assert result.returncode == 2
    assert "m.nml:3: &coupling 'k'" in result.stderr
    assert message in result.stderr
