"""nocdyn matrices: every matrix of the paper, with its number, in closed form for the paper's machine."""

import re
from math import sin

import pytest
from conftest import CASE_2, DATA

# A state at which nothing is zero by chance: twist -0.5 rad, speeds that fit the gear.
STATE = [
    "body.motor.angle=1.0",
    "body.pinion.angle=0.5",
    "body.machine.angle=-0.25",
    "body.motor.speed=1.0",
    "body.pinion.speed=3.0",
    "body.machine.speed=-2.0",
    "run.t_start=0.3",
]

SECANT = 100 + 10 * 0.5**2  # K1 + k1 twist^2
TANGENT = 100 + 3 * 10 * 0.5**2  # K1 + 3 k1 twist^2
MOTOR = 200 - 10 * 1.0 - 1.0**2
SHAKER = 20 * sin(5 * 0.3)
RATIO = 2 / 3

ZERO = [[0, 0, 0]] * 3
ONE = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
K = [[-SECANT, SECANT, 0], [SECANT, -SECANT, 0], [0, 0, 0]]
K_4 = [[-TANGENT, TANGENT, 0], [TANGENT, -TANGENT, 0], [0, 0, 0]]
J_1 = [[10, 0, 0], [0, 5, -5 * RATIO], [0, 2, 3]]
C_1 = [[0, 0, 0], [0, 0, 100 * RATIO], [0, 0, 0]]
K_1 = [K[0], K[1], [0, 0, 0]]
Q_1 = [MOTOR + SHAKER, 0, 0]

OMEGA = [1, 3, -2]
PHI = [1, 0.5, -0.25]
F = [-SECANT * 0.5, SECANT * 0.5, 0]
F_RATE = [TANGENT * 2, -TANGENT * 2, 0]
# the pinion and the wheel together: J2 + J3 (R1/R2)^2 turned by F2 and by the load, geared up
PINION_RATE = (F[1] + RATIO * -100 * 2) / (5 + 5 * RATIO**2)
OMEGA_RATE = [(MOTOR + SHAKER + F[0]) / 10, PINION_RATE, -RATIO * PINION_RATE]


def blocks(*rows):
    """A matrix of 3 x 3 blocks."""
    return [[number for block in row for number in block[i]] for row in rows for i in range(3)]


EXPECTED = {
    "13": [[10, 0, 0], [0, 5, 0], [0, 0, 5]],
    "14": [OMEGA_RATE],
    "15": [OMEGA],
    "16": [[MOTOR + SHAKER, 0, 0]],
    "17": [[SHAKER, 0, 0]],
    "18": [[MOTOR, 0, 0]],
    "19": [PHI],
    "21": K,
    "22": [[0, 0, 0], [0, 0, 0], [0, 0, -100]],
    "23": [[0, 2, 3]],
    "25": J_1,
    "26": [Q_1],
    "27": [[SHAKER, 0, 0]],
    "28": [[MOTOR, 0, 0]],
    "29": C_1,
    "30": K_1,
    "31": [[1, 0], [0, 1], [0, -RATIO]],
    "33": [OMEGA],
    "35": blocks([J_1, ZERO], [ZERO, ONE]),
    "36": ONE,
    "37": ZERO,
    "38": blocks([C_1, ZERO], [ZERO, ZERO]),
    "39": blocks([ZERO, K_1], [ONE, ZERO]),
    "40": [[*Q_1, 0, 0, 0]],
    "41": [OMEGA_RATE + OMEGA],
    "42": [OMEGA + PHI],
    "44": blocks([J_1, ZERO, ZERO], [ZERO, ONE, ZERO], [ZERO, ZERO, ONE]),
    "45": [OMEGA_RATE + OMEGA + F_RATE],
    "46": [OMEGA + PHI + F],
    "47": [F_RATE],
    "48": [F],
    "58": [Q_1 + [0] * 6],
    "60": blocks([C_1, ZERO, ZERO], [ZERO, ZERO, ZERO], [ZERO, ZERO, ZERO]),
    "61": blocks([ZERO, K_1, ZERO], [ONE, ZERO, ZERO], [K_4, ZERO, ZERO]),
    "62": K_4,
    "77": [[1, 3]],
    "78": [[1, 0, 0], [0, 1, 0], [0, 2, 3]],
    "79": [[1, 0], [0, 1], [0, 0]],
}


def sections(text):
    """Label and rows of numbers of every matrix."""
    for section in text.split("\n\n")[1:]:
        label, *rows = section.strip("\n").split("\n")
        yield label, [[float(number) for number in row.split()] for row in rows]


def print_matrices(nocdyn, *overrides):
    outcome = nocdyn("matrices", CASE_2, *(word for override in overrides for word in ("--set", override)))
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return {re.match(r"\((\d+)\)", label).group(1): rows for label, rows in sections(outcome.stdout) if label.startswith("(")}


@pytest.mark.parametrize("number", EXPECTED)
def test_the_matrix_has_its_closed_form(nocdyn, number):
    # seven digits are printed
    printed = print_matrices(nocdyn, *STATE)[number]
    assert [pytest.approx(row, rel=1e-6, abs=1e-12) for row in EXPECTED[number]] == printed


@pytest.mark.parametrize(
    ("complement", "expected"), [("scaled", [[1, 0], [0, 3], [0, -2]]), ("negated", [[1, 0], [0, -3], [0, 2]])]
)
def test_the_complements_of_section_6_are_printed(nocdyn, complement, expected):
    assert print_matrices(nocdyn, f"run.complement={complement}")["31"] == expected


def test_every_matrix_is_printed_with_its_shape(nocdyn):
    text = nocdyn("matrices", CASE_2).stdout
    for label, rows in sections(text):
        assert label.endswith(f"({len(rows)} x {len(rows[0])})")


def test_bodies_and_coordinates_head_the_report(nocdyn):
    lines = nocdyn("matrices", CASE_2, *("--set", "run.independent='machine','motor'")).stdout.splitlines()
    assert lines[0] == "Bodies 1 to 3: 'motor', 'pinion', 'machine'"
    assert lines[1] == "Coordinates: 'machine', 'motor'"


def test_a_machine_of_any_kind_has_its_matrices_printed(nocdyn):
    outcome = nocdyn("matrices", DATA / "full_machine.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "(44) J_3 (15 x 15)" in outcome.stdout


def test_a_machine_without_gears_has_no_rows_of_the_constraint(nocdyn, spinner):
    outcome = nocdyn("matrices", spinner)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "L_lambda, independent rows (0 x 1)" in outcome.stdout
