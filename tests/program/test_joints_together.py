"""Joints of all kinds in one machine, through standstill and back: what one formulation finds the others find."""

import random

import numpy as np
import pytest
from conftest import IS_SLOW

T_END = 0.3 if IS_SLOW else 1

BETWEEN = {
    "cardan": "&cardan name = 'x' bodies = 'b1', 'b2' angle_deg = 20 /\n",
    "clutch": "&clutch name = 'x' bodies = 'b1', 'b2' capacity = 9 times = 0.1 levels = 1 /\n",
    "spring": "&coupling name = 'x' bodies = 'b1', 'b2' stiffness = 300 damping = 1 /\n",
    "freewheel": "&freewheel name = 'x' bodies = 'b1', 'b2' /\n",
}
BEHIND = {
    "clutch": "&clutch name = 'y' bodies = 'b3', 'b4' capacity = 12 /\n",
    "mesh": "&mesh name = 'y' bodies = 'b3', 'b4' radii = 0.1, 0.15 stiffness = 1e5 damping = 100 efficiency = 0.9 /\n",
    "spring": "&coupling name = 'y' bodies = 'b3', 'b4' stiffness = 300 damping = 1 /\n",
}


def machine(seed, between, behind, driven):
    chance = random.Random(seed)
    text = ""
    for i in range(6):
        friction = f"bearing_friction = {chance.uniform(0.2, 2)!r}" if chance.random() < 0.4 else ""
        text += f"&body name = 'b{i}' inertia = {chance.uniform(0.5, 3)!r} {friction} /\n"
    for g in range(2):
        text += f"&gear name = 'g{g}' bodies = 'b{2 * g}', 'b{2 * g + 1}' radii = 1.0, {chance.uniform(0.8, 2)!r}\n"
        text += f"  efficiency = {chance.uniform(0.6, 0.97)!r} reverse_efficiency = {chance.choice([-0.03, 0.4, 0.8])!r} /\n"
    text += BETWEEN[between] + BEHIND[behind] + "&coupling name = 'z' bodies = 'b4', 'b5' stiffness = 200 damping = 0.5 /\n"
    if driven:
        text += f"&drive name = 'd' body = 'b0' speed_amplitude = {chance.uniform(1, 5)!r} frequency = 13 /\n"
    for i in (0, 3, 5):
        amplitude, frequency, phase = chance.uniform(3, 30), chance.uniform(3, 30), chance.uniform(0, 6)
        text += (
            f"&excitation name = 'e{i}' body = 'b{i}' amplitude = {amplitude!r} frequency = {frequency!r} phase = {phase!r} /\n"
        )
    return text + f"&run t_end = {T_END} rtol = 1e-10 atol = 1e-12 METHOD /\n&output points = 21 /\n"


@pytest.mark.parametrize("driven", [False, True])
@pytest.mark.parametrize("behind", BEHIND)
@pytest.mark.parametrize("between", BETWEEN)
def test_formulations_agree_and_keep_the_energy(nocdyn, between, behind, driven):
    text = machine(f"{between} {behind} {driven}", between, behind, driven)
    found = []
    for method, formulation in (("auto", "reduced"), ("rk45", "multiplier"), ("rodas5p", "paper")):
        keys = f"method = '{method}' formulation = '{formulation}'"
        nocdyn.done(text.replace("METHOD", keys))
        table = nocdyn.values()
        found.append(np.array([table[f"omega_b{i}"] for i in range(6)]))
        assert abs(table["energy_residual"]).max() < 1e-7 * (1 + table["work_in"].max())
    assert found[1] == pytest.approx(found[0], abs=1e-6)
    assert found[2] == pytest.approx(found[0], abs=1e-6)


def test_a_drive_takes_a_self_locking_gear_through_standstill(nocdyn):
    # the second wheel has -a / 2 = 12 + 2 T; the first one needs a - T / 0.5 where it drives, and a + 0.2 T where it does not
    text = "&body name = 'one' inertia = 1 speed = 10 /\n&body name = 'two' inertia = 1 speed = -5 /\n"
    text += "&gear name = 'g' bodies = 'one', 'two' teeth = 20, 40 efficiency = 0.5 reverse_efficiency = -0.2 /\n"
    text += "&drive name = 'd' body = 'one' table_time = 0, 1, 3, 4 table_speed = 10, 10, -10, -10 /\n"
    text += "&excitation name = 'e' body = 'two' kind = 'step' amplitude = 12 time = -1 /\n"
    text += "&run t_end = 4 /\n&output interval = 0.25 /\n"
    nocdyn.done(text)
    table = nocdyn.values()
    assert table["omega_one"] == pytest.approx(np.interp(table["t"], [0, 1, 3, 4], [10, 10, -10, -10]), abs=1e-9)
    for t, torque in zip(table["t"], table["torque_d"], strict=True):
        if min(abs(t - edge) for edge in (1, 2, 3)) < 1e-9:
            continue
        acceleration = -10.0 if 1 < t < 3 else 0.0
        teeth = -(12 + acceleration / 2) / 2
        power = teeth * (10 if t < 2 else -10)
        factor = 1 / 0.5 if power < 0 else -0.2
        assert torque == pytest.approx(acceleration - factor * teeth, rel=1e-9), t
