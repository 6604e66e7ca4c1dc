"""The forced response of every shipped machine that orders or harmonics shake is its settled transient."""

import cmath
import json
import re
from math import pi, radians

import numpy as np
import pytest
from conftest import SOURCE

# Machines with oscillations so small that they are linear: the motion at a turn of the crank is that of the next one.
# Of each: the factor of its amplitudes, the body of the response, how long the transient lasts [s], periods that are compared.
MACHINES = {
    "input/paper/case2.nml": (1e-4, "motor", 200.0, 60),
    "input/examples/three_rotors/three_rotors.nml": (1.0, "motor", 450.0, 100),
    "input/examples/ship_turbine/ship_turbine.nml": (1e-2, "propeller", 180.0, 40),
    "input/examples/wind_turbine/wind_turbine.nml": (1e-4, "rotor", 220.0, 30),
    "input/examples/engine/engine.nml": (4e-5, "flywheel", 36.0, 60),
    "docs/tutorial/pump.nml": (1e-3, "motor", 4.0, 60),
}
LINEAR = 1e-6  # relative to the largest amplitude of the order over all quantities of a kind
GROUP = re.compile(r"^&(?:engine|excitation)\b[^/]*/", re.MULTILINE)
AMPLITUDES = re.compile(r"\b(amplitudes?) *= *([-+0-9., eE]+)")
OTHER_KINDS = re.compile(r"kind *= *'(?!orders|harmonic)")
RUN = """\
&run t_end = {end!r} method = '{method}' rtol = 1e-11 atol = 1e-13 max_steps = 100000000 {start} /
&output interval = {step!r} /
"""


def shakes(group):
    """Whether a group &engine or &excitation makes oscillations that go on."""
    return AMPLITUDES.search(group) and not OTHER_KINDS.search(group)


def small(text, factor):
    """The machine without its run and what passes, with its oscillations by a factor."""

    def scaled(numbers):
        found = [repr(factor * float(number)) for number in re.split("[ ,]+", numbers[2].strip(" ,"))]
        return f"{numbers[1]} = {', '.join(found)} "

    def changed(group):
        if OTHER_KINDS.search(group[0]):
            return group[0] if "'ramp'" in group[0] else ""
        return AMPLITUDES.sub(scaled, group[0])

    return GROUP.sub(changed, re.sub(r"^&(run|output|response)\b[^/]*/", "", text, flags=re.MULTILINE))


def steady_speed(nocdyn, machine, body):
    outcome = nocdyn("equilibrium", nocdyn.write("steady.nml", machine + "&run t_end = 1 /\n"), "--out", "steady")
    assert outcome.returncode == 0, outcome.stderr
    steady = json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())
    stable = [state["values"] for state in steady["steady_states"] if state["stability"] == "stable"]
    return stable[0][f"omega_{body} [rad/s]"]


def settled_amplitudes(times, values, frequencies):
    """Least squares: constant and complex amplitudes of exp(i frequency t)."""
    waves = [f(w * times) for w in frequencies for f in (np.cos, np.sin)]
    found = np.linalg.lstsq(np.array([np.ones_like(times), *waves]).T, values, rcond=None)[0][1:]
    return found[::2] - 1j * found[1::2]


@pytest.mark.parametrize("path", MACHINES, ids=lambda path: path.rsplit("/", 1)[1][:-4])
def test_response_is_the_settled_transient(nocdyn, path):
    factor, body, settles, turns = MACHINES[path]
    machine = small((SOURCE / path).read_text(), factor)
    speed = steady_speed(nocdyn, machine, body)
    held = speed if speed else 10.0  # a machine at rest is turned: it is linear
    text = machine + f"&run t_end = 1 /\n&response body = '{body}' speed = {0.9 * held!r}, {1.1 * held!r} count = 3 /\n"
    outcome = nocdyn("response", nocdyn.write("response.nml", text), "--out", "out", "-q")
    assert outcome.returncode == 0, outcome.stderr
    response = nocdyn.values("out", "response_orders.csv").by_name()
    lines = np.flatnonzero(abs(response[f"omega_{body}"] - held) < 1e-9 * held)
    frequencies = response["frequency"][lines] * 2 * pi
    period = 2 * pi / float(min(frequencies))
    step = period / 50
    rows = round(settles / step) + 50 * turns
    start = "start = 'equilibrium'" if speed else ""
    text = machine + RUN.format(method="rk45" if "ship" in path else "taylor", end=rows * step, step=step, start=start)
    outcome = nocdyn("run", nocdyn.write("run.nml", text), "--out", "run", "-q")
    assert outcome.returncode == 0, outcome.stderr
    motion = {label: values[-50 * turns :] for label, values in nocdyn.values("run").by_name().items()}
    kinds = ("moment_", "total_moment_", "reaction_")
    quantities = [label for label in response if label.startswith(kinds) and f"phase_{label}" in response]
    assert quantities
    found, settled = [], []
    for label in quantities:
        found.append([response[label][i] * cmath.exp(1j * radians(response[f"phase_{label}"][i])) for i in lines])
        settled.append(settled_amplitudes(motion["t"], motion[label], frequencies))
    found, settled = np.array(found), np.array(settled)
    for k in range(len(lines)):
        largest = np.argmax(abs(settled[:, k]))
        turn = settled[largest, k] / found[largest, k]
        errors = abs(found[:, k] * turn / abs(turn) - settled[:, k])
        assert max(errors) <= LINEAR * abs(settled[largest, k])


def test_the_list_has_every_shipped_machine_with_oscillations():
    shipped = [*(SOURCE / "input").rglob("*.nml"), *(SOURCE / "docs/tutorial").glob("*.nml")]
    shaken = {str(p.relative_to(SOURCE)) for p in shipped if any(map(shakes, GROUP.findall(p.read_text())))}
    # the same machines with groups of a sweep; one without amplitude; one with hysteretic damping, which time does not have
    others = {"input/paper/case1.nml", "input/sweeps/resonance.nml", "input/sweeps/throughput.nml", "docs/tutorial/resonance.nml"}
    others |= {"input/examples/coupled_clutches/coupled_clutches.nml"}  # clutches lock, and have no response
    # hysteretic damping: test_example_load_cases.py
    others |= {f"input/examples/{name}/{name}.nml" for name in ("generator_set", "vfd_compressor")}
    others |= {"docs/tutorial/pump_set.nml"}  # hysteretic damping: test_sensitivity.py
    others |= {"docs/tutorial/damper.nml"}  # against closed forms: test_optimise.py
    others |= {"input/sweeps/coupling_tolerance.nml"}  # hysteretic damping: test_sweep_curves.py
    others |= {"docs/tutorial/hardening.nml"}  # jumps: test_orbit.py
    others |= {"docs/tutorial/signs.nml"}  # its compressor has a table of torques: test_engines.py
    assert shaken - others == set(MACHINES)
