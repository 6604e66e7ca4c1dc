"""An induction machine with two cages, computed a second time: in the stationary frame, with a matrix of inductances.

usage: python double_cage_references.py     prints the numbers that test_double_cages.py holds

The equations are those of MathWorks' block Asynchronous Machine (double squirrel cage), integrated with SciPy; nocdyn integrates
them in the frame that turns with the mains, without a matrix. The torque over the slip is that of the circuit by its impedances.
"""

import numpy as np

BASE = 100 * np.pi  # frequency of the mains [rad/s]
VOLTAGE, POLE_PAIRS = 6600.0, 2
INERTIA, FAN = 20.0, 0.166  # [kg m2], [N m s2]
ARC = 1e-3  # time constant of the currents in opening contacts [s]
STATOR, INNER, OUTER = (0.644, 5.44), (0.457, 7.776), (5.13, 5.44)  # resistance and leakage reactance [Ohm]
MAGNETISING = 129.8
# from when on which share of the voltage is applied; 0: disconnected
SUPPLIES = {"start": (2.0, [(0, 1)]), "reconnection": (2.0, [(0, 1), (1.4, 0), (1.5, 1)])}
TIMES = [0.05, 0.2, 0.5, 1.0, 1.4, 1.45, 1.5, 1.55, 1.7, 2.0]


def steady_torque(slip, rotor=(INNER, OUTER)):
    """Of the circuit [N m]."""
    cages = [r / slip + 1j * x for r, x in rotor]
    stator = STATOR[0] + 1j * STATOR[1]
    gap = 1 / (1 / (1j * MAGNETISING) + sum(1 / cage for cage in cages))
    voltage = VOLTAGE / np.sqrt(3) * gap / (stator + gap)
    power = 3 * sum(abs(voltage / cage) ** 2 * r / slip for cage, (r, _) in zip(cages, rotor, strict=True))
    return power * POLE_PAIRS / BASE


def steady_current(slip):
    """Of a line, rms [A]."""
    gap = 1 / (1 / (1j * MAGNETISING) + sum(1 / (r / slip + 1j * x) for r, x in (INNER, OUTER)))
    return VOLTAGE / np.sqrt(3) / abs(STATOR[0] + 1j * STATOR[1] + gap)


INDUCTANCES = (MAGNETISING + np.diag([STATOR[1], INNER[1], OUTER[1]])) / BASE
RESISTANCES = np.array([STATOR[0], INNER[0], OUTER[0]])
CURRENTS = np.linalg.inv(INDUCTANCES)
OPEN = np.linalg.inv(INDUCTANCES[1:, 1:]).T @ INDUCTANCES[0, 1:]  # of the fluxes of the cages that an open stator sees


def torque(flux, current):
    return 1.5 * POLE_PAIRS * np.imag(np.conj(flux[0]) * current[0])


def rates(t, y, share):
    flux, speed = y[:3] + 1j * y[3:6], y[6]
    current = CURRENTS @ flux
    rate = -RESISTANCES * current + [0, 1j * POLE_PAIRS * speed * flux[1], 1j * POLE_PAIRS * speed * flux[2]]
    rate[0] += share * np.sqrt(2 / 3) * VOLTAGE * np.exp(1j * BASE * t)
    if share == 0:
        rate[0] = OPEN @ rate[1:] + (1j * POLE_PAIRS * speed - 1 / ARC) * (flux[0] - OPEN @ flux[1:])
    return [*rate.real, *rate.imag, (torque(flux, current) - FAN * speed * abs(speed)) / INERTIA]


def main():
    from scipy.integrate import solve_ivp

    for name, (t_end, stages) in SUPPLIES.items():
        y = np.zeros(7)
        print(f'    "{name}": [')
        for (begin, share), end in zip(stages, [*(stage[0] for stage in stages[1:]), t_end], strict=True):
            run = solve_ivp(rates, (begin, end), y, "DOP853", rtol=1e-13, atol=1e-12, dense_output=True, args=(share,))
            y = run.y[:, -1]
            for time in TIMES:
                if begin < time <= end:
                    z = run.sol(time)
                    flux = z[:3] + 1j * z[3:6]
                    current = CURRENTS @ flux
                    row = (time, z[6], torque(flux, current), abs(current[0]) / np.sqrt(2))
                    print(f"        ({', '.join(f'{float(value):.13g}' for value in row)}),")
        print("    ],")


if __name__ == "__main__":
    main()
