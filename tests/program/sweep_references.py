"""Variants of the shipped sweeps, computed a second time: equations of motion written down by hand, integrated with SciPy.

usage: python sweep_references.py NAME SWEEP_CSV VARIANT...     prints what test_shipped_sweeps.py holds of them

SWEEP_CSV is what `nocdyn sweep` has left; only the values of the varied keys are taken from it.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from example_references import Machine, motion_of, rolling_mill_motion

SWEEPS = Path(__file__).parents[2] / "input/sweeps"
RATIO = 2.0 / 3.0  # of the radii of case 2


def variant_of(name, values):
    """The machine of a sweep with `values`, numbers by target."""
    machine = Machine(SWEEPS / f"{name}.nml")
    for target, value in values.items():
        group, element, key = target.split(".")
        machine.kinds[group][element][key] = value
    return machine


def case2_motion(m):
    """omega and phi of motor and pinion; the elastic moment as a function of (t, y, mode)."""
    c, drive, shake, load = m.coupling["coupling"], m.motor["drive"], m.excitation["shaker"], m.load["work"]
    motor, pinion, machine = m.inertia("motor", "pinion", "machine")

    def moment(t, y, *_):
        twist = y[3] - y[2]
        return c["stiffness"] * twist + c["cubic_stiffness"] * twist**3

    def rate(t, y, *_):
        torque = drive["a"] - drive["b"] * y[0] - drive["c"] * y[0] ** 2 + shake["amplitude"] * np.sin(shake["frequency"] * t)
        resistance = moment(t, y) + RATIO**2 * load["viscous"] * y[1]
        return [(torque + moment(t, y)) / motor, -resistance / (pinion + RATIO**2 * machine), y[0], y[1]]

    return motion_of(rate, np.zeros(4), m.end()), moment


def largest_after(motion, value, begin, sign=1):
    """Of a motion in one piece, from `begin` to its end: the highest of all maxima."""
    ((_, end, _, solution),) = motion.pieces
    t = np.linspace(begin, end, 20001)
    values = sign * value(t, solution(t))
    i = int(np.argmax(values))
    if i in (0, len(t) - 1):
        return sign * values[i]
    before, middle, after = values[i - 1 : i + 2]
    return sign * (middle + (after - before) ** 2 / (8 * (2 * middle - before - after)))  # vertex of the parabola


def throughput(values):
    m = variant_of("throughput", values)
    motion, moment = case2_motion(m)
    omega_motor, omega_pinion, phi_motor, phi_pinion = motion.at(m.end())
    return {
        "phi_motor_final": phi_motor,
        "phi_pinion_final": phi_pinion,
        "phi_machine_final": -RATIO * phi_pinion,
        "omega_motor_final": omega_motor,
        "omega_pinion_final": omega_pinion,
        "omega_machine_final": -RATIO * omega_pinion,
        "moment_coupling_max_abs": max(sign * largest_after(motion, moment, 0.0, sign) for sign in (1, -1)),
    }


def resonance(values, begin=12.0):
    motion, moment = case2_motion(variant_of("resonance", values))
    high, low = (largest_after(motion, moment, begin, sign) for sign in (1, -1))
    return {
        "moment_coupling_max_abs_from_12": max(high, -low),
        "moment_coupling_max_from_12": high,
        "moment_coupling_min_from_12": low,
    }


def tolerance(values):
    motion, shaft, spindle = rolling_mill_motion(variant_of("tolerance", values))
    return {
        "moment_shaft_max_abs": max(sign * motion.largest(shaft, sign) for sign in (1, -1)),
        "moment_spindle_max_abs": max(sign * motion.largest(spindle, sign) for sign in (1, -1)),
        "moment_spindle_max": motion.largest(spindle),
        "omega_roll_min": motion.largest(lambda t, y, mode: y[5], sign=-1),
    }


POINTS = (1, 81, 155)  # of a curve, from 1


def coupling_tolerance(values):
    """Amplitudes and half ranges of the rubber coupling: a linear system at each order of each speed, and a sum of sines."""
    m = Machine(SWEEPS / "coupling_tolerance.nml")
    for target, factor in values.items():
        group, element, key = target.split(".")
        m.kinds[group][element][key] *= factor
    gas = m.excitation["gas"]
    first, last = m.response[""]["speed"]
    found = {}
    for point in POINTS:
        speed = first + (last - first) * (point - 1) / (m.response[""]["count"] - 1)
        moments = [rubber_moment(m, order * speed, torque) for order, torque in zip(gas["orders"], gas["amplitudes"])]
        turns = np.linspace(0, 4 * np.pi, 40001)  # the order 0.5 repeats after two turns
        moment = sum((one * np.exp(1j * order * turns)).imag for order, one in zip(gas["orders"], moments))
        found[f"total_moment_rubber_curve_{point}"] = np.ptp(moment) / 2
        found[f"total_moment_rubber_order_0.5_curve_{point}"] = abs(moments[0])
    return found


def rubber_moment(m, omega, torque):
    """Its complex amplitude, of a torque on the engine with this frequency."""
    bodies = ["engine", "flywheel", "hub", "rotor"]
    matrix = np.diag([-(omega**2) * m.inertia(body) + 0j for body in bodies])
    matrix[3, 3] += 1j * omega * m.load["grid"]["viscous"]
    rubber = m.coupling["rubber"]
    stiffness = {
        "rubber": rubber["stiffness"] * (1 + 1j * rubber["relative_damping"] / (2 * np.pi)),
        **{name: m.coupling[name]["stiffness"] + 1j * omega * m.coupling[name]["damping"] for name in ("crank", "shaft")},
    }
    for name, value in stiffness.items():
        a, b = (bodies.index(body) for body in m.coupling[name]["bodies"])
        matrix[np.ix_([a, b], [a, b])] += value * np.array([[1, -1], [-1, 1]])
    phi = np.linalg.solve(matrix, [torque, 0, 0, 0])
    return stiffness["rubber"] * (phi[1] - phi[2])


def results(name, values):
    """By label."""
    programs = {
        "throughput": throughput,
        "resonance": resonance,
        "tolerance": tolerance,
        "coupling_tolerance": coupling_tolerance,
    }
    return programs[name](values)


def without_units(row):
    return {label.partition(" [")[0]: text for label, text in row.items()}


def main(name, table, *variants):
    with open(table, newline="", encoding="utf-8") as file:
        rows = {row["variant"]: row for row in map(without_units, csv.DictReader(file))}
    for variant in variants:
        values = {target: float(text) for target, text in rows[variant].items() if target.count(".") == 2}
        print(f"        {variant}: ({{")
        for target, value in values.items():
            print(f'            "{target}": {value!r},')
        print("        }, {")
        for label, value in results(name, values).items():
            print(f'            "{label}": {value:.13g},')
        print("        }),", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
