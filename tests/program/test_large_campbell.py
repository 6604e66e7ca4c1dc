"""nocdyn campbell of machines with many bodies: closed forms, all modes of smaller ones, and what is refused."""

import json
import random
from math import pi, sin, sqrt

import pytest
from conftest import TRAPS_EXCEPTIONS, fast_only

EXACT = 1e-10
STIFFNESS, DAMPING = 1e4, 1.0
without_checks = pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build checks every index")


def chain(count, law=f"damping = {DAMPING}", extra="", asked="count = 5 orders = 1, 2"):
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(count)]
    lines += [f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = {STIFFNESS} {law} /" for i in range(count - 1)]
    return "\n".join([*lines, extra, f"&response body = 'b0' speed = 1, 3 {asked} /", "&run t_end = 1.0 /"]) + "\n"


def damped(count, number):
    """Frequency [Hz] and damping ratio of a mode of the chain."""
    natural = 2 * sqrt(STIFFNESS) * sin(pi * number / (2 * count))
    ratio = DAMPING / STIFFNESS * natural / 2
    return natural * sqrt(1 - ratio**2) / (2 * pi), ratio


def campbell(nocdyn, text, *options):
    outcome = nocdyn("campbell", nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return json.loads((nocdyn.folder / "out/campbell.json").read_text()), nocdyn.values(name="campbell.csv").by_name()


@pytest.mark.parametrize("count", [30, pytest.param(610, marks=without_checks)])
def test_the_lowest_modes_are_those_of_the_chain_at_every_speed(nocdyn, count):
    content, table = campbell(nocdyn, chain(count), "--modes", "6")
    assert len(content["modes"]) == 6 and "frequency_7" not in table
    for number in range(1, 7):
        frequency, ratio = damped(count, number)
        assert table[f"frequency_{number}"] == pytest.approx([frequency] * len(table["omega_b0"]), rel=EXACT)
        assert table[f"damping_ratio_{number}"] == pytest.approx([ratio] * len(table["omega_b0"]), rel=EXACT)
    (note,) = (note for note in content["notes"] if "followed" in note)
    assert note.startswith(f"6 modes are followed over the speed, of the lowest frequencies at the first speed, of {count} ")


@without_checks
def test_orders_meet_the_modes_of_a_large_machine(nocdyn):
    content, _ = campbell(nocdyn, chain(610), "--modes", "8")
    expected = sorted(2 * pi * damped(610, number)[0] / order for order in (1, 2) for number in range(1, 9))
    found = sorted(crossing["speed_rad_s"] for crossing in content["crossings"])
    assert found == pytest.approx([speed for speed in expected if 1 < speed < 3], rel=1e-6)


@without_checks
def test_a_machine_of_more_than_600_degrees_of_freedom_has_its_100_lowest_modes(nocdyn):
    content, table = campbell(nocdyn, chain(610, asked="count = 2 orders = 1"))
    assert len(content["modes"]) == 100
    assert table["frequency_100"][0] == pytest.approx(damped(610, 100)[0], rel=EXACT)
    assert any(note.startswith("100 modes are followed over the speed") for note in content["notes"])


LOADED = """\
&motor name = 'm' body = 'b0' kind = 'constant' torque = 5 /
&load name = 'l' body = 'b209' quadratic = 0.5 /
"""


def grid_rows(table):
    return [list(table["omega_b0"]).index(speed) for speed in (1.0, 1.5, 2.0, 2.5, 3.0)]


@pytest.mark.parametrize("options", [("--modes", "9"), ("--range_hz", "1.5,3")])
def test_chosen_modes_keep_their_numbers_and_move_as_all_do(nocdyn, options):
    """Springs stiffen with the load, which grows with the speed; bands follow the modes of 210 bodies."""
    text = chain(210, law=f"cubic_stiffness = 3e9 damping = {DAMPING}", extra=LOADED)
    _, every = campbell(nocdyn, text)
    content, some = campbell(nocdyn, text, *options)
    numbers = [int(label.removeprefix("frequency_")) for label in some if label.startswith("frequency_")]
    lowest = {int(label.removeprefix("frequency_")): every[label][0] for label in every if label.startswith("frequency_")}
    wanted = [k for k in lowest if 1.5 <= lowest[k] <= 3] if options[0] == "--range_hz" else list(range(1, 10))
    assert numbers == [mode["mode"] for mode in content["modes"]] == wanted
    speeds = grid_rows(every)
    among = grid_rows(some)
    for mode in numbers:
        for column in ("frequency", "damping_ratio", "undamped_frequency"):
            all_values, values = every[f"{column}_{mode}"], some[f"{column}_{mode}"]
            assert [values[i] for i in among] == pytest.approx([all_values[i] for i in speeds], rel=EXACT)
        frequency = some[f"frequency_{mode}"]
        assert frequency[among[4]] > 1.05 * frequency[among[0]]


def electrical_machine(seed):
    """A tree of more bodies than modes are computed of, with fluxes of motors and with Maxwell couplings."""
    dice = random.Random(seed)
    bodies = 130
    lines = [f"&body name='b{i}' inertia={10 ** dice.uniform(-1, 0.5):.6g} speed_rpm=1000 /" for i in range(bodies)]
    for i in range(1, bodies):
        other = i - 1 if dice.random() < 0.8 else dice.randrange(i)
        law = "damping=0.5"
        if dice.random() < 0.1:
            law = f"maxwell_stiffness={10 ** dice.uniform(3, 5):.6g} maxwell_time={10 ** dice.uniform(-4, -1):.4g}"
        lines.append(f"&coupling name='k{i}' bodies='b{other}','b{i}' stiffness={10 ** dice.uniform(4, 6):.6g} {law} /")
    motor = "kind='induction_dq' voltage=400 frequency_hz=50 poles=6 rated_power=22e3 rated_speed_rpm=975 efficiency=0.93"
    for i in range(2):
        body = dice.randrange(bodies)
        lines.append(f"&motor name='m{i}' body='b{body}' {motor} power_factor=0.84 breakdown_ratio=2.5 /")
    lines.append(f"&load name='l' body='b{dice.randrange(bodies)}' quadratic=0.02 /")
    return "\n".join([*lines, "&run t_end=1 /"]) + "\n"


@fast_only
@pytest.mark.parametrize("seed", [0, 2])
def test_modes_of_fluxes_and_maxwell_couplings_are_exact(nocdyn, seed):
    """Frequencies and damping ratios of `nocdyn modes`, also where the highest modes are left out."""
    text = electrical_machine(seed)
    for command in ("equilibrium", "modes"):
        assert nocdyn(command, nocdyn.write("machine.nml", text), "--out", "out").returncode == 0
    states = json.loads((nocdyn.folder / "out/equilibrium.json").read_text())["steady_states"]
    speeds = [state["values"]["omega_b0 [rad/s]"] for state in states if state["stability"] == "stable"]
    speed = min(speeds, key=lambda speed: abs(speed - 2 * pi * 50 / 3))
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    exact = [complex(mode["frequency_Hz"], mode["damping_ratio"]) for mode in modes if mode["kind"] == "oscillating"]
    _, table = campbell(nocdyn, text + f"&response body='b0' speed={speed!r},{1.1 * speed!r} count=2 orders=1 /\n")
    numbers = range(1, 1 + sum(label.startswith("frequency_") for label in table))
    found = [complex(table[f"frequency_{k}"][0], table[f"damping_ratio_{k}"][0]) for k in numbers]
    found = [value for value in found if value.real > 0]  # others begin at a higher speed
    assert len(found) >= 100
    for value in found:
        assert min(abs(value - other) / abs(other) for other in exact) < 1e-9


@without_checks
@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        (
            chain(5001, asked="count = 2 orders = 1"),
            ("--modes", "1001"),
            "--modes 1001: these are 1002 undamped modes; at most 999 are allowed for this machine of 5001 degrees of freedom",
        ),
        (
            chain(610, extra="&load name = 'l' body = 'b300' viscous = 200 /"),
            ("--modes", "20"),
            "the modes of this machine need dense matrices, because damping",
        ),
    ],
)
def test_what_bands_do_not_find_is_refused(nocdyn, text, options, message):
    outcome = nocdyn("campbell", nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert f": &response: {message}" in outcome.stderr
    assert not (nocdyn.folder / "out").exists()
