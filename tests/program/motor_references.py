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


ARC = 1e-3  # time constant of the currents in opening contacts [s]

# Load [N m s2] times the square of the speed, end [s], and from when on which share of the voltage is applied, and what it gains
# in a second; a negative share: disconnected.
SUPPLIES = {
    "star and delta": ("3 hp", 4e-4, 1.0, [(0, 0.57735, 0), (0.6, -1, 0), (0.63, 1, 0)]),
    "soft start": ("3 hp", 4e-4, 1.0, [(0, -1, 0), (0.05, 0, 2), (0.45, 0.8, 0), (0.6, 0.8, 1), (0.8, 1, 0)]),
    "reconnection": ("500 hp", 0.055, 3.1, [(0, 1, 0), (2.8, -1, 0), (2.926, 1, 0)]),
}


class Machine:
    """A machine with a load that grows with the square of the speed, on a supply that may change."""

    def __init__(self, name, load=0.0):
        self.load, self.share, self.is_off = load, lambda t: 1.0, False
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
        rate_s = BASE * (self.share(t) * np.sqrt(2 / 3) * self.voltage * np.exp(1j * BASE * t) - self.r_s * i_s)
        rate_r = 2j * speed * psi_r - BASE * self.r_r * i_r
        if self.is_off:
            part = self.x_m / (self.x_m + self.x_lr)  # of the rotor flux that the open stator sees
            difference = psi_s - part * psi_r
            rate_s = part * rate_r + (2j * speed - 1 / ARC) * difference
        acceleration = (self.torque(psi_s, psi_r) - self.load * speed * abs(speed)) / self.inertia
        return [rate_s.real, rate_s.imag, rate_r.real, rate_r.imag, acceleration]

    def run(self, t_end):
        return self.integrate((0, t_end), np.zeros(5))

    def integrate(self, ends, y):
        return solve_ivp(self.rates, ends, y, "DOP853", rtol=1e-13, atol=1e-12, dense_output=True)

    def run_stages(self, t_end, stages):
        """The solution on each stage, from its begin."""
        y, runs = np.zeros(5), []
        for (begin, share, slope), end in zip(stages, [*(stage[0] for stage in stages[1:]), t_end]):
            self.is_off = share < 0
            self.share = lambda t, begin=begin, share=share, slope=slope: share + slope * (t - begin)
            run = self.integrate((begin, end), y)
            y = run.y[:, -1]
            runs.append((begin, run.sol))
        return runs


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
    for name, (machine_name, load, t_end, stages) in SUPPLIES.items():
        machine = Machine(machine_name, load)
        runs = machine.run_stages(t_end, stages)
        print(f'    "{name}": [')
        for time in np.linspace(0, t_end, 11)[1:]:
            states = [solution for begin, solution in runs if begin <= time][-1](time)
            current = abs(machine.currents(states[0] + 1j * states[1], states[2] + 1j * states[3])[0]) / np.sqrt(2)
            print(f"        ({time:g}, {states[4]:.13g}, {torques(machine, states):.13g}, {current:.13g}),")
        print("    ],")
        fine = np.linspace(runs[-1][0], t_end, 200001)
        values = torques(machine, runs[-1][1](fine))
        print(f"{name}: torque on the last stage from {min(values):.10g} at {fine[np.argmin(values)]:.6g} to {max(values):.10g}")
        if name == "reconnection":
            begin, solution = runs[-1]
            flux = solution(begin)
            flux = (flux[2] + 1j * flux[3]) * np.exp(-1j * BASE * begin)
            before = runs[0][1](stages[1][0])
            before = (before[2] + 1j * before[3]) * np.exp(-1j * BASE * stages[1][0])
            print("rotor flux of that before the opening:", abs(flux / before), "turned by", np.angle(flux / before, deg=True))
    run = Machine("3 hp").run(0.5).sol
    print("3 hp: 95 % of the synchronous speed at", brentq(lambda t: run(t)[4] - 0.95 * BASE / 2, 0.2, 0.5))


if __name__ == "__main__":
    main()
