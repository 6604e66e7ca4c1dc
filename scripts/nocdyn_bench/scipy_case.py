"""The paper's machine with SciPy: what nocdyn does with input/paper/case2.nml, as one would write it for this machine alone.

Reduced form, states omega_1, omega_2, phi_1, phi_2 and the work of motor, load and excitation. Writes the columns of
nocdyn's trajectory.csv. Only what it needs is imported, for start-up counts here.
"""

import argparse
import math
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

J1, J2, J3 = 10.0, 5.0, 5.0
K1, CUBIC = 100.0, 10.0
R1, R2 = 2.0, 3.0
A, B, C = 200.0, 10.0, 1.0
VISCOUS = 100.0
M0, OMEGA_P = 20.0, 5.0
RATIO = R1 / R2
J23 = J2 + RATIO**2 * J3  # of bodies 2 and 3, about the axis of body 2

LABELS = (
    "t [s]",
    "phi_motor [rad]",
    "phi_pinion [rad]",
    "phi_machine [rad]",
    "omega_motor [rad/s]",
    "omega_pinion [rad/s]",
    "omega_machine [rad/s]",
    "twist_coupling [rad]",
    "moment_coupling [N m]",
    "torque_drive [N m]",
    "torque_work [N m]",
    "torque_shaker [N m]",
    "reaction_reducer [N]",
    "kinetic_energy [J]",
    "elastic_energy [J]",
    "work_in [J]",
    "work_out [J]",
    "energy_residual [J]",
)


def torques(omega_1, omega_2, twist) -> tuple:
    """Elastic moment F1, motor, load (on body 3), of numbers or of arrays."""
    return (K1 + CUBIC * twist * twist) * twist, A - (B + C * omega_1) * omega_1, VISCOUS * RATIO * omega_2


def derivative(t: float, y: np.ndarray) -> tuple[float, ...]:
    omega_1, omega_2, phi_1, phi_2 = y[:4].tolist()  # Python's own numbers are faster than NumPy's, one by one
    elastic, motor, load = torques(omega_1, omega_2, phi_2 - phi_1)
    excitation = M0 * math.sin(OMEGA_P * t)
    return (
        (motor + excitation + elastic) / J1,
        (-elastic - RATIO * load) / J23,
        omega_1,
        omega_2,
        motor * omega_1,
        RATIO * load * omega_2,
        excitation * omega_1,
    )


def table(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The columns of trajectory.csv, shape [len(t), len(LABELS)]."""
    omega_1, omega_2, phi_1, phi_2, motor_work, load_work, excitation_work = y
    twist = phi_2 - phi_1
    elastic, motor, load = torques(omega_1, omega_2, twist)
    excitation = M0 * np.sin(OMEGA_P * t)
    omega_3 = -RATIO * omega_2
    omega_dot_3 = -RATIO * (-elastic - RATIO * load) / J23
    kinetic = 0.5 * (J1 * omega_1**2 + J2 * omega_2**2 + J3 * omega_3**2)
    stored = 0.5 * K1 * twist**2 + 0.25 * CUBIC * twist**4
    work_in = motor_work + excitation_work
    return np.column_stack(
        (
            t,
            phi_1,
            phi_2,
            -RATIO * phi_2,
            omega_1,
            omega_2,
            omega_3,
            twist,
            elastic,
            motor,
            load,
            excitation,
            (J3 * omega_dot_3 - load) / R2,
            kinetic,
            stored,
            work_in,
            load_work,
            kinetic + stored - work_in + load_work,
        )
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("output", type=Path, help="the table to write")
    parser.add_argument("--method", default="LSODA", help="of solve_ivp (%(default)s)")
    parser.add_argument("--rtol", type=float, default=1e-9)
    parser.add_argument("--atol", type=float, default=1e-9)
    arguments = parser.parse_args()
    times = np.arange(1001) * 0.01
    solution = solve_ivp(
        derivative, (0.0, 10.0), np.zeros(7), method=arguments.method, t_eval=times, rtol=arguments.rtol, atol=arguments.atol
    )
    if not solution.success:
        raise SystemExit(f"SciPy: {solution.message}")
    rows = (",".join(map(repr, row)) for row in table(solution.t, solution.y).tolist())
    arguments.output.write_text("\n".join((",".join(LABELS), *rows)) + "\n")


if __name__ == "__main__":
    main()
