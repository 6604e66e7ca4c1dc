"""The equations of motion as a program in C: it moves the machine as a run does, by itself."""

import shutil
import subprocess

import pytest

# Orders of an engine, a cubic spring, quadratic laws, a motor with a current, torques over the time.
MACHINE = """\
&body name = 'crank' inertia = 0.4 speed = 100.0 /
&body name = 'wheel' inertia = 2.0 speed = 100.0 /
&body name = 'rotor' inertia = 1.5 speed = 100.0 /
&coupling name = 'shaft' bodies = 'crank', 'wheel' stiffness = 4e4 damping = 3.0 /
&coupling name = 'rubber' bodies = 'wheel', 'rotor' stiffness = 8e3 cubic_stiffness = 5e4 damping = 40.0 /
&engine name = 'gas' stroke = 4 cylinders = 'crank' firing_deg = 0 orders = 0.5, 1, 2.5 amplitudes = 40, 60, 25 /
&motor name = 'dc' body = 'rotor' kind = 'dc' voltage = 100.0 resistance = 0.5 inductance = 0.02 flux_constant = 1.0 /
&load name = 'fan' body = 'rotor' quadratic = 0.003 /
&excitation name = 'pulse' body = 'rotor' amplitude = 5.0 frequency_hz = 20.0 /
&run t_end = 0.4 rtol = 1e-11 atol = 1e-11 /
&output points = 3 /
"""
TEETH = """\
&body name = 'out' inertia = 1.0 /
&gear name = 'teeth' bodies = 'rotor', 'out' radii = 0.1, 0.2 efficiency = 0.9 /
"""


def test_a_program_moves_the_machine_as_a_run_does(nocdyn):
    printed = nocdyn("matrices", "--code", nocdyn.write("machine.nml", MACHINE))
    assert printed.returncode == 0, printed.stderr
    nocdyn.write("machine.c", printed.stdout)
    words = [shutil.which("cc"), "-O1", "-ffp-contract=off", "-w", "-DMACHINE_MAIN", "machine.c", "-lm", "-o", "machine"]
    subprocess.run(words, cwd=nocdyn.folder, check=True)
    moved = subprocess.run(["./machine", "4000", "1e-4"], cwd=nocdyn.folder, check=True, capture_output=True, text=True)
    states = {name: float(value) for name, value in (line.rsplit(" ", 1) for line in moved.stdout.splitlines())}
    nocdyn.done(MACHINE)
    columns = nocdyn.values()
    for body in ("crank", "wheel", "rotor"):
        assert states[f"speed of '{body}'"] == pytest.approx(columns[f"omega_{body}"][-1], rel=1e-9)
        assert states[f"angle of '{body}'"] == pytest.approx(columns[f"phi_{body}"][-1], rel=1e-9)
    assert states["t [s]"] == pytest.approx(0.4, rel=1e-12)


def test_boundaries_that_a_program_does_not_follow_are_named(nocdyn):
    printed = nocdyn("matrices", "--code", nocdyn.write("machine.nml", MACHINE))
    assert "the program does not follow these boundaries.\n   - standstill of load 'fan' */\n" in printed.stdout


def test_teeth_with_losses_have_no_code(nocdyn):
    file = nocdyn.write("machine.nml", MACHINE + TEETH)
    outcome = nocdyn("matrices", "--code", file)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"nocdyn: {file}: joints that lock or move, and teeth with losses, have no code\n"
