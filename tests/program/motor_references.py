"""Krause's induction machines, computed a second time: his equations in the stationary frame, integrated with SciPy.

usage: python motor_references.py     prints the numbers that test_induction_machines.py holds

The states are Krause's flux linkages per second [V] and the mechanical speed; nocdyn integrates flux linkages in the frame that
turns with the mains. (P. C. Krause, Analysis of Electric Machinery, 1986, chapter 4; the data are those of table 4.10-1.)
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar

BASE = 120 * np.pi  # frequency of the mains [rad/s]

# voltage [V], r_s, X_ls, X_M, X_lr, r_r [Ohm], inertia [kg m2]; four poles
MACHINES = {
    "3 hp": (220.0, 0.435, 0.754, 26.13, 0.754, 0.816, 0.089),
    "500 hp": (2300.0, 0.262, 1.206, 54.02, 1.206, 0.187, 11.06),
}
TIMES = {"3 hp": [0.05, 0.1, 0.2, 0.3, 0.5], "500 hp": [0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 1.449, 2.0]}


class Machine:
    """A machine without load on a supply that never changes."""

    def __init__(self, name):
        self.voltage, self.r_s, self.x_ls, self.x_m, self.x_lr, self.r_r, self.inertia = MACHINES[name]
        self.x_aq = 1 / (1 / self.x_m + 1 / self.x_ls + 1 / self.x_lr)

    def currents(self, psi_s, psi_r):
        magnetising = self.x_aq * (psi_s / self.x_ls + psi_r / self.x_lr)
        return (psi_s - magnetising) / self.x_ls, (psi_r - magnetising) / self.x_lr

    def torque(self, psi_s, psi_r):
        return 3 / BASE * np.imag(np.conj(psi_s) * self.currents(psi_s, psi_r)[0])

    def rates(self, t, y):
        psi_s, psi_r, speed = y[0] + 1j * y[1], y[2] + 1j * y[3], y[4]
        i_s, i_r = self.currents(psi_s, psi_r)
        rate_s = BASE * (np.sqrt(2 / 3) * self.voltage * np.exp(1j * BASE * t) - self.r_s * i_s)
        rate_r = 2j * speed * psi_r - BASE * self.r_r * i_r
        return [rate_s.real, rate_s.imag, rate_r.real, rate_r.imag, self.torque(psi_s, psi_r) / self.inertia]

    def run(self, t_end):
        return solve_ivp(self.rates, (0, t_end), np.zeros(5), "DOP853", rtol=1e-13, atol=1e-12, dense_output=True)


def torques(machine, states):
    return machine.torque(states[0] + 1j * states[1], states[2] + 1j * states[3])


def speeds(_, states):
    return states[4] * 30 / np.pi


def largest(machine, quantity, t_end):
    """The largest value, and its time."""
    run = machine.run(t_end).sol
    times = np.linspace(0, t_end, 20001)
    near = times[np.argmax(quantity(machine, run(times)))]
    ends = (max(0, near - times[1]), min(t_end, near + times[1]))
    peak = minimize_scalar(lambda t: -quantity(machine, run(t)), ends, bounds=ends, method="bounded", options={"xatol": 1e-12})
    return f"{-peak.fun:.12g} at {peak.x:.10g} s"


def main():
    for name, times in TIMES.items():
        machine = Machine(name)
        states = machine.run(times[-1]).sol(times)
        current = abs(machine.currents(states[0] + 1j * states[1], states[2] + 1j * states[3])[0]) / np.sqrt(2)
        print(f'    "{name}": [')
        for row in zip(times, states[4], torques(machine, states), current):
            print(f"        ({', '.join(f'{float(value):.13g}' for value in row)}),")
        print("    ],")
    for name in MACHINES:
        print(f"{name}: largest torque {largest(Machine(name), torques, 0.1)}, speed {largest(Machine(name), speeds, 2.0)}")
    run = Machine("3 hp").run(0.5).sol
    print("3 hp: 95 % of the synchronous speed at", brentq(lambda t: run(t)[4] - 0.95 * BASE / 2, 0.2, 0.5))


if __name__ == "__main__":
    main()
