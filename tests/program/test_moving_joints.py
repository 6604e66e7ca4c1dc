"""Cardan joints, slider-cranks, relations and drives: against closed forms and computations of their own."""

import csv
import json
import re
from math import asin, atan2, cos, pi, radians, sin, sqrt

import numpy as np
import pytest
from conftest import SOURCE, all_if_fast, fast_only
from verified import known

BODY = "&body name = '{}' inertia = {} speed = {} /\n"
FREE = "&body name = '{}' inertia = {} /\n"
TIGHT = "rtol = 1e-12 atol = 1e-13"
FORMULATIONS = ["reduced", "multiplier", "paper"]


def run(nocdyn, text, *words):
    nocdyn.done(text, *words)
    return nocdyn.values()


def refusal(nocdyn, text, command="run"):
    outcome = nocdyn(command, nocdyn.write("machine.nml", text))
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert not (nocdyn.folder / "results").exists()
    return outcome.stderr.replace(f"{nocdyn.folder}/", "")


def time_of_turn(speed, end=2 * pi):
    """Of a body that has a speed at each angle; Gauss points in small intervals."""
    points, weights = np.polynomial.legendre.leggauss(20)
    edges = np.linspace(0, end, 65)
    half = np.diff(edges)[:, None] / 2
    angles = edges[:-1, None] + half * (1 + points)
    return float(np.sum(half * weights / np.vectorize(speed)(angles)))


def integrate(slope, y, end, steps):
    """The classic method of Runge and Kutta."""
    h, t = end / steps, 0.0
    for _ in range(steps):
        a = slope(t, y)
        b = slope(t + h / 2, y + h / 2 * a)
        c = slope(t + h / 2, y + h / 2 * b)
        d = slope(t + h, y + h * c)
        y, t = y + h / 6 * (a + 2 * b + 2 * c + d), t + h
    return y


# A cardan joint: tan(phi_2) cos(angle) = tan(phi_1).


def cardan(angle, v):
    """phi_2, its derivatives by phi_1 = v."""
    c, s = cos(angle), sin(angle) ** 2
    d = 1 - s * cos(v) ** 2
    return v + atan2((1 - c) * sin(v) * cos(v), c + (1 - c) * sin(v) ** 2), c / d, -c * s * sin(2 * v) / d**2


PAIR = BODY.format("a", 1, 10) + FREE.format("b", 2) + "&cardan name = 'j' bodies = 'a', 'b' angle_deg = 30 /\n"
TURN = 0.56898708728104


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("method", all_if_fast("rk853", "rk45", "rodas5p", "auto"))
def test_a_cardan_joint_turns_freely_as_by_the_closed_form(nocdyn, formulation, method):
    end = f"&run t_end = {TURN} method = '{method}' formulation = '{formulation}' {TIGHT} /\n&output points = 5 /\n"
    table = run(nocdyn, PAIR + end)
    assert table["phi_a"][[1, 4]] == pytest.approx([pi / 2, 2 * pi], abs=1e-9)
    assert table["phi_b"][[1, 4]] == pytest.approx([pi / 2, 2 * pi], abs=1e-9)
    assert table["omega_a"][[1, 4]] == pytest.approx([12.110601416390, 10], abs=1e-9)
    assert table["omega_b"][[0, 1]] == pytest.approx(
        [known("joints_that_move.cardan_start"), known("joints_that_move.cardan_driven")], abs=1e-9
    )
    assert max(abs(table["energy_residual"])) < 1e-9


@fast_only
def test_a_cardan_joint_keeps_its_angles_over_many_turns(nocdyn):
    table = run(nocdyn, PAIR + "&run t_end = 600 /\n&output points = 101 /\n")
    turned = table["phi_a"]
    assert turned[-1] > 1000 * 2 * pi
    drift = [b - cardan(radians(30), a)[0] for a, b in zip(turned, table["phi_b"], strict=True)]
    assert max(map(abs, drift)) < 1e-10


def test_two_cardan_joints_of_equal_angles_turn_evenly(nocdyn):
    text = BODY.format("a", 1, 10) + FREE.format("shaft", 0.5) + FREE.format("b", 2)
    text += "&cardan name = 'first' bodies = 'a', 'shaft' angle_deg = 25 /\n"
    text += "&cardan name = 'second' bodies = 'shaft', 'b' angle_deg = 25 phase_deg = 90 /\n"
    table = run(nocdyn, text + f"&run t_end = 2 {TIGHT} /\n")
    assert table["omega_b"] == pytest.approx(table["omega_a"], rel=1e-11)
    assert table["phi_b"] == pytest.approx(table["phi_a"], abs=1e-10)
    assert np.ptp(table["omega_a"]) > 1e-2  # the shaft between them is shaken


def driveline(formulation, method):
    text = FREE.format("motor", 0.5) + FREE.format("fork", 0.1) + FREE.format("shaft", 0.4) + FREE.format("machine", 2.0)
    text += "&coupling name = 'k1' bodies = 'motor', 'fork' stiffness = 300 damping = 0.5 /\n"
    text += "&coupling name = 'k2' bodies = 'shaft', 'machine' stiffness = 500 damping = 0.3 /\n"
    text += "&cardan name = 'j' bodies = 'fork', 'shaft' angle_deg = 35 phase_deg = 20 /\n"
    text += "&motor name = 'm' body = 'motor' a = 60 b = 2 c = 0 /\n&load name = 'l' body = 'machine' viscous = 1.5 /\n"
    return text + f"&run t_end = 2 method = '{method}' formulation = '{formulation}' rtol = 1e-10 atol = 1e-11 /\n"


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("method", all_if_fast("rk853", "rodas5p"))
def test_a_driveline_with_a_cardan_joint_moves_as_by_its_own_equation(nocdyn, formulation, method):
    """One equation for the angle of the fork: (J_1 + J_2 g'^2) v'' + J_2 g' g'' v'^2 = T_1 + g' T_2."""
    table = run(nocdyn, driveline(formulation, method))
    angle, phase = radians(35), radians(20)
    start = cardan(angle, phase)[0]

    def slope(_, y):
        wm, wf, wl, m, v, load = y
        g = cardan(angle, v + phase)
        left = 300 * (m - v) + 0.5 * (wm - wf)
        right = 500 * (load - g[0] + start) + 0.3 * (wl - g[1] * wf)
        turn = (left + g[1] * right - 0.4 * g[1] * g[2] * wf**2) / (0.1 + 0.4 * g[1] ** 2)
        return np.array([(60 - 2 * wm - left) / 0.5, turn, (-right - 1.5 * wl) / 2, wm, wf, wl])

    end = integrate(slope, np.zeros(6), 2.0, 20_000)
    names = ["omega_motor", "omega_fork", "omega_machine", "phi_motor", "phi_fork", "phi_machine"]
    assert [table[name][-1] for name in names] == pytest.approx(end, rel=2e-8)
    shaft = cardan(angle, end[4] + phase)
    assert table["omega_shaft"][-1] == pytest.approx(shaft[1] * end[1], rel=2e-8)
    needed = 0.4 * (shaft[1] * slope(0, end)[1] + shaft[2] * end[1] ** 2)
    needed -= 500 * (end[5] - shaft[0] + start) + 0.3 * (end[2] - shaft[1] * end[1])
    assert table["torque_j"][-1] == pytest.approx(needed, rel=1e-6)
    assert max(abs(table["energy_residual"])) < 1e-6


def test_a_clutch_behind_a_cardan_joint_locks_when_the_speeds_meet(nocdyn):
    text = BODY.format("a", 1, 20) + FREE.format("b", 0.5) + FREE.format("c", 0.8)
    text += "&cardan name = 'j' bodies = 'a', 'b' angle_deg = 30 /\n"
    text += "&clutch name = 'k' bodies = 'b', 'c' capacity = 15 static_capacity = 1000 /\n"
    text += f"&run t_end = 2 {TIGHT} /\n&output points = 201 /\n"
    ends = {}
    for formulation in FORMULATIONS:
        table = run(nocdyn, text.replace("t_end", f"formulation = '{formulation}' t_end"))
        events = nocdyn.summary("out")["joint_events"]
        assert [event["to"] for event in events] == ["locked"]
        ends[formulation] = [events[0]["time"], table["omega_a"][-1], table["torque_k"][-1]]
        assert table["omega_c"][-1] == pytest.approx(table["omega_b"][-1], abs=1e-10)
    assert ends["multiplier"] == pytest.approx(ends["reduced"], rel=1e-9)
    assert ends["paper"] == pytest.approx(ends["reduced"], rel=1e-9)

    def slope(_, y):
        w, v = y[:2]
        g = cardan(radians(30), v)
        return np.array([(-15 * g[1] - 0.5 * g[1] * g[2] * w**2) / (1 + 0.5 * g[1] ** 2), w, 15 / 0.8])

    when = ends["reduced"][0]
    w, v, other = integrate(slope, np.array([20.0, 0.0, 0.0]), when, 20_000)
    assert other == pytest.approx(w * cardan(radians(30), v)[1], rel=1e-9)
    v_end = table["phi_a"][-1]
    energy = [speed**2 * (1 + 1.3 * cardan(radians(30), place)[1] ** 2) for speed, place in ((w, v), (ends["paper"][1], v_end))]
    assert energy[1] == pytest.approx(energy[0], rel=1e-9)  # locked, it loses nothing


# A slider-crank: crank r, rod l, offset e.


def piston(r, length, e, v):
    p = r * sin(v) - e
    return r * cos(v) + sqrt(length**2 - p**2)


def crank_inertia(v, crank, r, length, e, masses):
    """The inertia of all that moves, by differences of positions: piston, and a rod of mass, inertia and centre of mass."""
    mass, rod, inertia, center = masses
    h = 1e-4

    def places(x):
        p = r * sin(x) - e
        along = (1 - center / length) * r * cos(x) + center / length * piston(r, length, e, x)
        return np.array([piston(r, length, e, x), along, (1 - center / length) * p, asin(p / length)])

    rates = (8 * (places(v + h) - places(v - h)) - places(v + 2 * h) + places(v - 2 * h)) / (12 * h)
    return crank + mass * rates[0] ** 2 + rod * (rates[1] ** 2 + rates[2] ** 2) + inertia * rates[3] ** 2


SLIDER = BODY.format("a", 0.02, 100) + "&crank name = 'p' body = 'a' crank_radius = 0.05 rod_length = 0.2 piston_mass = 1 /\n"


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("method", all_if_fast("rk853", "rk45", "rodas5p", "auto"))
def test_a_slider_crank_turns_freely_as_by_the_closed_form(nocdyn, formulation, method):
    end = f"&run t_end = 0.064780516961413 method = '{method}' formulation = '{formulation}' {TIGHT} /\n&output points = 5 /\n"
    table = run(nocdyn, SLIDER + end)
    assert table["phi_a"][-1] == pytest.approx(2 * pi, abs=1e-9 * 100)
    assert table["position_p"][-1] == pytest.approx(0.25, abs=1e-11)

    def speed(v):
        return 100 * sqrt(0.02 / crank_inertia(v, 0.02, 0.05, 0.2, 0, (1, 0, 0, 0)))

    assert speed(pi / 2) == pytest.approx(94.280904158206, rel=1e-9)
    assert time_of_turn(speed) == pytest.approx(0.064780516961413, rel=1e-9)
    quarter = time_of_turn(speed, pi / 2)
    table = run(nocdyn, SLIDER + end.replace("0.064780516961413", repr(quarter)))
    assert table["omega_a"][-1] == pytest.approx(94.280904158206, abs=1e-7)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_heavy_rod_moves_with_crank_and_piston(nocdyn, formulation):
    text = BODY.format("a", 0.02, 50) + "&crank name = 'p' body = 'a' crank_radius = 0.05 rod_length = 0.2 offset = 0.02\n"
    text += "  phase_deg = 40 piston_mass = 0.6 rod_mass = 1.1 rod_center = 0.06 rod_inertia = 0.005 /\n"
    table = run(nocdyn, text + f"&run t_end = 0.3 formulation = '{formulation}' {TIGHT} /\n&output points = 61 /\n")
    energy = [
        w**2 * crank_inertia(v + radians(40), 0.02, 0.05, 0.2, 0.02, (0.6, 1.1, 0.005, 0.06))
        for v, w in zip(table["phi_a"], table["omega_a"], strict=True)
    ]
    assert energy == pytest.approx([energy[0]] * 61, rel=1e-9)
    places = [piston(0.05, 0.2, 0.02, v + radians(40)) for v in table["phi_a"]]
    assert table["position_p"] == pytest.approx(places, abs=1e-11)
    kinetic = table["kinetic_energy"]
    assert kinetic == pytest.approx(np.array(energy) / 2, rel=1e-9)


def test_a_rod_without_inertia_of_its_own_is_on_its_ends(nocdyn):
    rod = "rod_mass = 1.2 rod_center = 0.05"
    table = run(nocdyn, SLIDER.replace("/\n", rod + " /\n", 2).replace(rod, "", 1) + f"&run t_end = 0.1 {TIGHT} /\n")
    same = SLIDER.replace("0.02", repr(0.02 + 0.9 * 0.05**2)).replace("piston_mass = 1", "piston_mass = 1.3")
    other = run(nocdyn, same + f"&run t_end = 0.1 {TIGHT} /\n")
    assert table["omega_a"] == pytest.approx(other["omega_a"], rel=1e-11)


def test_the_force_on_the_piston_is_that_of_its_pin_however_the_rod_is_given(nocdyn):
    """At a speed that is held: two masses at its ends, and one body of the same masses with their inertia about its centre."""
    held = (
        FREE.format("a", 0.02) + "&drive name = 'd' body = 'a' speed = 100 /\n&crank name = 'p' body = 'a' crank_radius = 0.05\n"
    )
    held += (
        "  rod_length = 0.2 piston_mass = 1 rod_mass = 1 rod_center = 0.05 MORE /\n&run t_end = 0.1 /\n&output points = 101 /\n"
    )
    ends = run(nocdyn, held.replace("MORE", ""))
    body = run(nocdyn, held.replace("MORE", f"rod_inertia = {0.75 * 0.05**2 + 0.25 * 0.15**2!r}"))
    angle = ends["phi_a"]
    reach = np.sqrt(0.2**2 - (0.05 * np.sin(angle)) ** 2)
    rate = -(0.05**2) * np.sin(angle) * np.cos(angle) / reach
    bend = -(0.05**2 * np.cos(2 * angle) + rate**2) / reach
    expected = 100**2 * (bend - 0.05 * np.cos(angle))
    assert ends["force_p"] == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert min(ends["force_p"]) == pytest.approx(-625, abs=0.5)
    assert body["force_p"] == pytest.approx(expected, rel=1e-6, abs=1e-6)
    assert body["torque_p"] == pytest.approx(ends["torque_p"], abs=1e-6)


@pytest.mark.parametrize("stroke", [2, 4])
def test_the_force_on_the_piston_does_its_work(nocdyn, stroke):
    """A force of few harmonics, sampled: its work over the way of the piston is the change of the energy."""
    angles = np.arange(0, 180 * stroke, 10)

    def force(v):
        return 300 + 200 * cos(2 * v / stroke - 0.3) + 80 * sin(4 * v / stroke)

    lists = f"crank_angles_deg = {', '.join(map(str, angles))}\n"
    lists += f"  forces = {', '.join(repr(force(radians(v))) for v in angles)}\n  stroke = {stroke} harmonics_up_to = 4"
    text = SLIDER.replace("piston_mass = 1 /", f"piston_mass = 1\n  {lists} /")
    table = run(nocdyn, text + "&run t_end = 0.2 rtol = 1e-10 atol = 1e-11 /\n&output points = 401 /\n")
    turned, places = table["phi_a"], table["position_p"]
    applied = -np.array([force(v) for v in turned])
    assert table["gas_force_p"] == pytest.approx(applied, abs=0.2)  # cubic between the samples
    work = np.concatenate([[0], np.cumsum((applied[1:] + applied[:-1]) / 2 * np.diff(places))])
    kinetic = table["kinetic_energy"]
    assert kinetic - kinetic[0] == pytest.approx(work, abs=4e-2)
    assert max(abs(table["energy_residual"])) < 1e-6


def test_pressures_act_on_the_bore(nocdyn):
    angles = range(0, 360, 20)
    pressures = ", ".join(repr(2e5 + 1e5 * cos(radians(v))) for v in angles)
    keys = f"crank_angles_deg = {', '.join(map(str, angles))} pressures = {pressures} bore = 0.08 crankcase_pressure = 1e5"
    text = SLIDER.replace("piston_mass = 1 /", f"piston_mass = 1 {keys} /")
    table = run(nocdyn, text + "&run t_end = 0.01 /\n")
    assert table["gas_force_p"][0] == pytest.approx(-2e5 * pi / 4 * 0.08**2, rel=1e-4)
    lines = "\n".join(f"{v}, {2e5 + 1e5 * cos(radians(v))!r}" for v in angles)
    nocdyn.write("indicator.csv", "crank_angle_deg, pressure\n" + lines + "\n")
    keys = "pressure_file = 'indicator.csv' bore = 0.08 crankcase_pressure = 1e5"
    other = run(nocdyn, SLIDER.replace("piston_mass = 1 /", f"piston_mass = 1 {keys} /") + "&run t_end = 0.01 /\n")
    assert other["omega_a"][-1] == pytest.approx(table["omega_a"][-1], rel=1e-13)


def test_the_force_has_all_harmonics_that_a_crank_may_have(nocdyn):
    """64 orders of a cycle of two turns are 128 harmonics, the most that `harmonics_up_to` allows."""
    angles = np.arange(0, 720, 1)

    def force_at(angle):
        return 500 + 300 * np.cos(np.radians(angle / 2)) + 2000 * np.exp(-(((angle - 40) / 3) ** 2))

    forces = force_at(angles)
    keys = f"stroke = 4 harmonics_up_to = 64 crank_angles_deg = {', '.join(map(str, angles))} "
    keys += f"forces = {', '.join(map(str, forces))}"
    text = SLIDER.replace("piston_mass = 1 /", f"piston_mass = 1 {keys} /")
    table = run(nocdyn, text + "&run t_end = 0.2 /\n&output points = 401 /\n")
    samples = 4096
    spectrum = np.fft.rfft(force_at(np.arange(samples) * 720 / samples))[:129] / samples
    phase = 0.5 * table["phi_a"][:, None] * np.arange(129)
    expected = -(2 * np.real(spectrum * np.exp(1j * phase)).sum(axis=1) - spectrum[0].real)
    assert table["gas_force_p"] == pytest.approx(expected, abs=10)  # a cubic between the points
    for up_to in (16, 32, 33, 63.5):
        table = run(nocdyn, text.replace("up_to = 64", f"up_to = {up_to}") + "&run t_end = 0.01 /\n")
        force = 2 * spectrum[: int(2 * up_to) + 1].sum().real - spectrum[0].real
        assert table["gas_force_p"][0] == pytest.approx(-force, abs=10)


# Relations: tables of one angle over another.


def test_non_circular_gears_follow_their_table_and_keep_the_energy(nocdyn):
    places = np.radians(np.arange(0, 361, 10))
    driven = places + 0.2 * np.sin(places)
    text = BODY.format("a", 0.5, 10) + FREE.format("b", 0.8) + "&relation name = 'r' bodies = 'a', 'b' kind = 'gear'\n"
    text += f"  table_angle = {', '.join(map(repr, map(float, places)))}\n"
    text += f"  table_driven = {', '.join(map(repr, map(float, driven)))} /\n"
    table = run(nocdyn, text + "&run t_end = 5 rtol = 1e-9 atol = 1e-11 /\n&output points = 501 /\n")
    turned = table["phi_a"]
    assert turned[-1] > 6 * 2 * pi
    assert table["phi_b"] == pytest.approx(turned + 0.2 * np.sin(turned), abs=1e-5)  # the spline between the points
    assert table["omega_b"] == pytest.approx(table["omega_a"] * (1 + 0.2 * np.cos(turned)), rel=1e-4)
    assert max(abs(table["energy_residual"])) < 1e-6


def test_a_cam_returns_and_a_lever_goes_on_straight(nocdyn):
    text = BODY.format("a", 5, 10) + FREE.format("b", 0.1) + "&relation name = 'r' bodies = 'a', 'b' KEYS /\n&run t_end = 2 /\n"
    cam = "table_angle_deg = 0, 60, 120, 180, 240, 300, 360 table_driven_deg = 0, 5, 15, 20, 15, 5, 0"
    table = run(nocdyn, text.replace("KEYS", cam))
    assert np.degrees([min(table["phi_b"]), max(table["phi_b"])]) == pytest.approx([0, 20], abs=0.05)
    table = run(nocdyn, text.replace("KEYS", "kind = 'lever' table_angle = 0, 1, 2 table_driven = 0, 0.5, 1"))
    assert table["phi_b"][-1] == pytest.approx(table["phi_a"][-1] / 2, rel=1e-9)


DWELLS = "table_angle_deg = 0, 60, 90, 120, 150, 180, 210, 240, 270, 300, 330, 360 "
DWELLS += "table_driven_deg = 0, 0, 2.5, 10, 17.5, 20, 20, 20, 17.5, 10, 2.5, 0"


def cam(nocdyn, keys):
    """The rise of the cam over its angle at an even speed, in degrees, and the notes of the run."""
    text = FREE.format("a", 5) + FREE.format("b", 0.1) + "&drive name = 'd' body = 'a' speed_rpm = 60 /\n"
    text += f"&relation name = 'r' bodies = 'a', 'b' {keys} /\n&run t_end = 1 /\n&output points = 721 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    table = nocdyn.values()
    notes = [line for line in outcome.stdout.splitlines() if "note" in line]
    return np.degrees(table["phi_b"]), table["torque_d"], notes


def test_dwells_are_kept_on_request_and_the_size_of_the_overshoot_is_noted(nocdyn):
    rise, _, notes = cam(nocdyn, DWELLS)
    overshoot = max(max(abs(rise[:121])), max(rise) - 20)
    assert 0.1 < overshoot < 1
    (note,) = notes
    assert "relation 'r': the spline leaves equal values of table_driven by up to " in note
    assert float(re.search(r"up to ([\d.]+) degrees", note)[1]) == pytest.approx(overshoot, rel=0.03)
    assert float(re.search(r", ([\d.]+) % of", note)[1]) == pytest.approx(5 * overshoot, rel=0.03)
    for word in ("dwells", "cubic"):
        rise, _, notes = cam(nocdyn, f"{DWELLS} interpolation = '{word}'")
        assert notes == []
        assert max(abs(rise[:121])) < 1e-9
        assert max(rise) == pytest.approx(20, abs=1e-9)
        assert rise[[180, 240, 300]] == pytest.approx([2.5, 10, 17.5], abs=1e-9)


# Drives: prescribed motions.


HEIGHT = 0.05


@pytest.mark.parametrize("points", [10, 40])
@pytest.mark.parametrize("given", ["angle", "speed"])
def test_accelerations_through_a_table_are_those_of_its_motion(nocdyn, points, given):
    """0.05 (1 - cos(2 pi t)) needs 0.05 (2 pi)^2 cos(2 pi t) N m of 1 kg m2; the error of a spline is (2 pi h)^2 / 12 of that."""
    t = np.arange(points + 1) / points
    if given == "angle":
        values, keys = HEIGHT * (1 - np.cos(2 * pi * t)), "kind = 'angle' table_angle = "
    else:
        values, keys = 2 * pi * HEIGHT * np.sin(2 * pi * t), "interpolation = 'spline' table_speed = "
    text = FREE.format("a", 1) + f"&drive name = 'd' body = 'a' table_time = {', '.join(map(repr, map(float, t)))}\n"
    text += f"  {keys}{', '.join(map(repr, map(float, values)))} /\n&run t_end = 1 /\n&output points = 201 /\n"
    table = run(nocdyn, text)
    largest = HEIGHT * (2 * pi) ** 2
    bound = 1.1 * (2 * pi / points) ** 2 / 12 + 0.01 * (10 / points) ** 2
    expected = largest * np.cos(2 * pi * table["t"])
    assert table["torque_d"][:-1] == pytest.approx(expected[:-1], abs=bound * largest)
    extremes = nocdyn.summary("out")["columns"]["torque_d [N m]"]
    assert [extremes["min"], extremes["max"]] == pytest.approx([-largest, largest], rel=bound)
    assert table["phi_a"] == pytest.approx(HEIGHT * (1 - np.cos(2 * pi * table["t"])), abs=2e-3 * HEIGHT)


def test_an_angle_whose_table_ends_in_motion_goes_on_and_a_note_says_so(nocdyn):
    text = (
        FREE.format("a", 1) + "&drive name = 'd' body = 'a' kind = 'angle' table_time = 0, 1, 2, 3 table_angle = 0, 1, 4, 9 /\n"
    )
    outcome = nocdyn("run", nocdyn.write("m.nml", text + "&run t_end = 4 /\n&output points = 5 /\n"), "--out", "out")
    assert "m.nml: note: drive 'd': its table ends at t = 3 s in the run, and the angle goes on with the last speed, 6 rad/s" in (
        outcome.stdout
    )
    table = nocdyn.values()
    assert table["phi_a"] == pytest.approx([0, 1, 4, 9, 15], abs=1e-9)
    assert table["torque_d"][:3] == pytest.approx([2, 2, 2], abs=1e-9)
    outcome = nocdyn("run", nocdyn.write("m.nml", text + "&run t_end = 3 /\n"), "--out", "out")
    assert "note" not in outcome.stdout


def test_what_the_harmonics_leave_out_is_noted_with_its_size(nocdyn):
    angles = ", ".join(map(str, range(0, 720, 4)))
    forces = ", ".join(str(1000 + 5000 * np.exp(-((((v - 20 + 360) % 720 - 360) / 20) ** 2))) for v in range(0, 720, 4))
    text = SLIDER.replace(
        "piston_mass = 1 /", f"piston_mass = 1 stroke = 4 crank_angles_deg = {angles}\n forces = {forces} KEY /"
    )
    found = {}
    for orders in (4, 6, 64):
        outcome = nocdyn(
            "run", nocdyn.write("m.nml", text.replace("KEY", f"harmonics_up_to = {orders}") + "&run t_end = 0.01 /\n")
        )
        assert outcome.returncode == 0, outcome.stderr
        found[orders] = re.findall(r"note: (crank 'p': .*)", outcome.stdout)
    assert found[64] == []
    spectrum = np.fft.rfft([1000 + 5000 * np.exp(-(((v / 8) / 20) ** 2)) for v in range(-2880, 2880)]) / 5760
    for orders in (4, 6):
        left_out = 2 * np.abs(spectrum[2 * orders + 1 :]).sum()
        size, share = re.fullmatch(
            rf"crank 'p': harmonics_up_to = {orders} leaves out up to ([\d.]+) N of the force on the piston, ([\d.]+) % "
            "of its largest value",
            found[orders][0],
        ).groups()
        assert float(size) == pytest.approx(left_out, rel=0.05)
        assert float(share) == pytest.approx(100 * left_out / 6000, rel=0.06)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("method", all_if_fast("auto", "rk45", "rodas5p"))
def test_a_ramp_of_the_speed_needs_the_torque_of_the_inertia(nocdyn, formulation, method):
    text = FREE.format("a", 2) + "&drive name = 'd' body = 'a' table_time = 0, 2, 3 table_speed_rpm = 0, 600, 600 /\n"
    text += f"&run t_end = 4 method = '{method}' formulation = '{formulation}' /\n&output points = 9 /\n"
    table = run(nocdyn, text)
    speed = 600 * pi / 30
    assert table["torque_d"] == pytest.approx([speed] * 4 + [0] * 5, abs=1e-9)
    assert table["omega_a"] == pytest.approx(speed * np.minimum(table["t"] / 2, 1), abs=1e-9)
    assert table["phi_a"][-1] == pytest.approx(3 * speed, rel=1e-12)
    work = nocdyn.summary("out")["energy_account"]["work_in_J"]["drive d"]
    assert work == pytest.approx(speed**2, rel=1e-7)


def test_a_body_that_is_held_has_the_torque_of_its_load(nocdyn):
    text = FREE.format("a", 2) + FREE.format("b", 3) + "&gear name = 'g' bodies = 'a', 'b' radii = 1, 2 /\n"
    text += "&excitation name = 'x' body = 'b' amplitude = 30 frequency = 4 /\n&drive name = 'd' body = 'a' /\n"
    table = run(nocdyn, text + "&run t_end = 2 /\n")
    assert table["torque_d"] == pytest.approx(15 * np.sin(4 * table["t"]), abs=1e-9)
    assert table["reaction_g"] == pytest.approx(-table["torque_d"], abs=1e-9)
    assert max(abs(table["omega_b"])) < 1e-12


def test_a_shaken_body_shakes_what_is_coupled_to_it(nocdyn):
    """The steady amplitude of an oscillator whose foot moves: |1 / (1 - (w / w0)^2)| without damping, by superposition."""
    text = FREE.format("foot", 1) + FREE.format("mass", 2) + "&coupling name = 'k' bodies = 'foot', 'mass' stiffness = 200 /\n"
    text += "&drive name = 'd' body = 'foot' kind = 'angle' angle_amplitude = 0.01 frequency = 4 phase_deg = 90 /\n"
    table = run(nocdyn, text + f"&run t_end = 3 {TIGHT} /\n&output points = 101 /\n")
    t = table["t"]
    foot = 0.01 * (np.cos(4 * t) - 1)
    forced = 0.01 / (1 - 16 / 100) * np.cos(4 * t) - 0.01
    assert table["phi_foot"] == pytest.approx(foot, abs=1e-11)
    assert table["phi_mass"] == pytest.approx(forced - (forced[0]) * np.cos(10 * t), abs=1e-9)


def test_a_table_of_angles_is_followed_smoothly(nocdyn):
    text = BODY.format("a", 1, "SPEED").replace(" speed = SPEED", "") + FREE.format("b", 0.5)
    text += "&coupling name = 'k' bodies = 'a', 'b' stiffness = 500 damping = 1 /\n"
    text += "&drive name = 'd' body = 'a' kind = 'angle' table_file = 'motion.csv' /\n"
    nocdyn.write("motion.csv", "0, 0\n1, 0.5\n2, 2\n3, 2\n")
    table = run(nocdyn, text + "&run t_end = 3 rtol = 1e-9 atol = 1e-11 /\n&output points = 31 /\n")
    assert table["phi_a"][[0, 10, 20, 30]] == pytest.approx([0, 0.5, 2, 2], abs=1e-10)
    assert max(abs(table["energy_residual"])) < 1e-6


def test_a_drive_starts_bodies_that_are_geared_to_it(nocdyn):
    text = FREE.format("a", 2) + FREE.format("b", 3) + "&gear name = 'g' bodies = 'a', 'b' teeth = 10, 20 /\n"
    table = run(nocdyn, text + "&drive name = 'd' body = 'b' speed = 5 /\n&run t_end = 1 /\n")
    assert table["omega_a"][0] == pytest.approx(-10, rel=1e-14)


def test_sweeps_over_moving_joints_are_their_runs(nocdyn):
    text = FREE.format("a", 1) + FREE.format("b", 2) + FREE.format("c", 0.5)
    text += "&coupling name = 'k' bodies = 'b', 'c' stiffness = 100 damping = 0.5 /\n"
    text += "&cardan name = 'j' bodies = 'a', 'b' angle = 0.5 /\n"
    text += "&crank name = 'q' body = 'a' crank_radius = 0.1 rod_length = 0.4 piston_mass = 0.3 /\n"
    text += "&relation name = 'r' bodies = 'c', 'e' table_angle = 0, 2, 4, 6 table_driven = 0, 0.5, 0.1, 0 /\n" + FREE.format(
        "e", 0.1
    )
    text += "&drive name = 'd' body = 'c' speed = -5 speed_amplitude = 1 frequency = 3 phase_deg = 90 /\n&run t_end = 1 /\n"
    vary = [("cardan.j.angle", 0.6), ("crank.q.crank_radius", 0.2), ("drive.d.speed_amplitude", 2)]
    sweep = "&sweep design = 'grid' /\n" + "".join(f"&vary target = '{k}' low = {v} high = {v} count = 1 /\n" for k, v in vary)
    sweep += "".join(f"&record quantity = '{q}' statistic = 'final' /\n" for q in ("torque_j", "position_q", "omega_e"))
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", text + sweep), "--out", "swept", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "swept" / "sweep.csv", newline="") as file:
        *_, last = csv.reader(file)
    table = run(nocdyn, text, *(word for k, v in vary for word in ("--set", f"{k}={v}")))
    assert [float(cell) for cell in last[4:7]] == [table[name][-1] for name in ("torque_j", "position_q", "omega_e")]


@pytest.mark.parametrize(
    ("keys", "is_noted"),
    [
        ("", True),
        ("kind = 'angle'", True),
        ("speed = 0", False),
        ("speed_rpm = 0", False),
        ("table_time = 0, 1 table_speed = 0, 0", False),
        ("kind = 'angle' angle_amplitude = 1 frequency = 1", False),
    ],
)
def test_a_drive_without_a_motion_is_noted(nocdyn, keys, is_noted):
    run(nocdyn, FREE.format("a", 1) + f"&drive name = 'd' body = 'a' {keys} /\n&run t_end = 1 /\n")
    note = "drive 'd' has neither a speed, a table nor an amplitude: it holds its body still, as speed = 0 does"
    assert nocdyn.summary("out")["machine"]["notes"] == ([note] if is_noted else [])


def test_check_counts_joints_and_freedoms(nocdyn):
    outcome = nocdyn("check", nocdyn.write("machine.nml", PAIR + "&run t_end = 1 /\n"))
    assert "0 excitations, 1 cardan\n  1 degree of freedom\n" in outcome.stdout


# What is refused.

RUN = "&run t_end = 1 /\n"
CRANK = SLIDER.split("\n")[0] + "\n&crank name = 'p' body = 'a' crank_radius = 0.05 rod_length = 0.2 piston_mass = 1 {} /\n"
RELATION = BODY.format("a", 1, 0) + FREE.format("b", 1) + "&relation name = 'r' bodies = 'a', 'b' {} /\n"
DRIVE = FREE.format("a", 1) + "&drive name = 'd' body = 'a' {} /\n"
FORCES = "crank_angles_deg = 0, 30, 60, 90, 120, 150, 180, 210 forces = 1, 2, 3, 4, 5, 6, 7, 8"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (PAIR.replace("30", "90"), ":3: &cardan 'j': angle_deg = 90 is out of range; allowed: "),
        (PAIR.replace("'b' inertia = 2", "'b' inertia = 2 speed = 3"), ":3: &cardan 'j': the start speeds violate it: "),
        (
            CRANK.format("").replace("0.05", "0.3"),
            ":2: &crank 'p': rod_length = 0.2 is out of range; allowed: > crank_radius = 0.3",
        ),
        (CRANK.format("offset = 0.16"), ":2: &crank 'p': offset = 0.16 m: the rod of 0.2 m does not reach the piston at all"),
        (
            FREE.format("a", 1) + "&drive name = 'd' body = 'a' kind = 'angle' interpolation = 'linear' table_time = 0, 1\n"
            "  table_angle = 0, 1 /\n",
            ":2: &drive 'd': interpolation = 'linear' with kind = 'angle': the speed would jump at the points, which needs an "
            "infinite torque; allowed: spline, dwells, cubic",
        ),
        (CRANK.format("rod_mass = 1"), ":2: &crank 'p': rod_mass = 1 kg, but rod_center is missing"),
        (CRANK.format(FORCES), "crank_angles_deg from 0 to 210 are not those of one cycle; needed: a range of 360 with stroke"),
        (
            CRANK.format(FORCES.replace("_deg", "")),
            "from 0 to 210 are not those of one cycle; needed: a range of 6.283185307179586 [rad] with stroke = 2; in degrees "
            "they are crank_angles_deg",
        ),
        (CRANK.format(FORCES + " stroke = 3"), ":2: &crank 'p': stroke = 3; allowed: 2 or 4"),
        (
            RELATION.format("table_angle = 0, 1, 2 table_driven = 0, 1, 2"),
            ":3: &relation 'r': table_driven(3) = 2: a cam returns: ",
        ),
        (
            RELATION.format("table_angle_deg = 0, 90, 360 table_driven_deg = 5, 10, 30"),
            ": table_driven_deg(3) = 30: a cam returns: the last value must be the first, 5; kind = 'gear'",
        ),
        (
            RELATION.format("kind = 'gear' table_angle_deg = 0, 40, 90 table_driven_deg = 0, 50, 20"),
            ": table_driven_deg: non-circular gears turn in one direction, but the spline through the points turns back near "
            "table_angle_deg(2) = 40; kind = 'cam' may go to and fro",
        ),
        (
            RELATION.format("kind = 'gear' table_angle = 0, 1, 2 table_driven = 0, 5, 2"),
            "the spline through the points turns back",
        ),
        (
            RELATION.format("table_angle = 0, 2, 1 table_driven = 0, 1, 0"),
            "table_angle(3) = 1 must be greater than table_angle(2) = 2",
        ),
        (
            DRIVE.format("table_time = 0, 1, 1, 2 table_speed = 0, 0, 5, 5"),
            "table_time(3) = 1 must be greater than table_time(2) = 1 s: a jump needs an infinite torque; allowed: a ramp",
        ),
        (
            DRIVE.format("speed = 3").replace("inertia = 1", "inertia = 1 speed = 2"),
            "by -1 rad/s from those of the drive, 3 rad",
        ),
        (
            DRIVE.format("speed_rpm = 300").replace("inertia = 1", "inertia = 1 speed_rpm = 100"),
            "they differ by -200 rpm from those of the drive, 300 rpm; allowed: these, or a drive that begins with a ramp",
        ),
        (
            DRIVE.format("") + "&drive name = 'e' body = 'a' speed = 1 /\n",
            "other drives and joints already prescribe this motion",
        ),
        (DRIVE.format("speed_amplitude = 3"), ":2: &drive 'd': speed_amplitude needs frequency"),
    ],
)
def test_what_does_not_fit_is_refused_by_line_and_group(nocdyn, text, message):
    said = refusal(nocdyn, text + RUN)
    assert message in said
    assert said.startswith("nocdyn: machine.nml:")
    assert said.count("\n") == 1


@pytest.mark.parametrize("command", ["modes", "equilibrium", "response", "campbell", "matrices"])
def test_analyses_about_a_steady_state_refuse_what_has_no_mean_ratio(nocdyn, command):
    response = "&response body = 'a' speed_rpm = 100, 200 /\n"
    cam = RELATION.format("table_angle = 0, 1, 2 table_driven = 0, 1, 0")
    for text in [DRIVE.format("speed = 3"), PAIR, cam] if command == "matrices" else [cam]:
        said = refusal(nocdyn, text + RUN + response, command)
        allowed = "no cardans, cranks, relations, drives" if command == "matrices" else "no cams and no levers"
        assert f"nocdyn {command} is for machines whose ratios are constant; allowed: {allowed}" in said


# Means over a turn, where a steady state is looked at.


def without_notes(nocdyn, folder, name):
    """Results but for notes and what columns are, and for the reaction of a gear as the torque on its second wheel."""
    text = (nocdyn.folder / folder / name).read_text()
    if not name.endswith(".json"):
        return text
    results = json.loads(text)
    del results["notes"], results["columns"]
    for state in results["steady_states"]:
        if "reaction_j [N m]" in state["values"]:
            state["values"]["torque_j [N m]"] = -state["values"].pop("reaction_j [N m]")
    return results


def test_modes_and_steady_states_have_the_mean_ratio_of_a_cardan_joint(nocdyn):
    text = driveline("reduced", "auto")
    gear = "&gear name = 'j' bodies = 'fork', 'shaft' teeth = 1, 1 internal = .true. /\n"
    other = "".join(gear if line.startswith("&cardan") else line for line in text.splitlines(keepends=True))
    for command, name in (("modes", "modes.csv"), ("equilibrium", "equilibrium.json")):
        said = nocdyn(command, nocdyn.write("machine.nml", text), "--out", "means")
        assert said.returncode == 0, said.stderr
        assert "note: means over a turn stand for the ratios, inertias and torques of cardan 'j'" in said.stdout
        assert nocdyn(command, nocdyn.write("machine.nml", other), "--out", "gear").returncode == 0
        found, expected = (without_notes(nocdyn, folder, name) for folder in ("means", "gear"))
        assert found == expected


def test_start_speeds_that_fit_the_position_do_not_hinder_the_modes(nocdyn):
    text = PAIR.replace("'b' inertia = 2", f"'b' inertia = 2 speed = {10 / cos(radians(30))!r}")
    text += FREE.format("c", 1) + "&coupling name = 'k' bodies = 'b', 'c' stiffness = 100 /\n"
    outcome = nocdyn("modes", nocdyn.write("machine.nml", text + RUN), "--at", "rest", "--out", "modes")
    assert outcome.returncode == 0, outcome.stderr
    modes = json.loads((nocdyn.folder / "modes/modes.json").read_text())["modes"]
    frequency = sqrt(100 * (1 / 3 + 1 / 1)) / (2 * pi)
    assert [mode["undamped_frequency_Hz"] for mode in modes if mode["kind"] == "oscillating"] == pytest.approx([frequency])


@fast_only
def test_the_response_of_a_compressor_is_that_of_its_settled_motion(nocdyn):
    """Mean inertia and torque by orders against the motion with the crank; they differ by the square of the speed's ripple."""
    source = SOURCE / "input/examples/compressor"
    nocdyn.write("indicator.csv", (source / "indicator.csv").read_text())
    text = (source / "compressor.nml").read_text()
    table = run(nocdyn, text, "--set", "run.t_end=8", "--set", "run.rtol=1e-8")
    turned = table["phi_flywheel"]
    last = turned > turned[-1] - 4 * 2 * pi
    moment = (table["moment_shaft"] + table["damping_shaft"])[last]
    t = table["t"][last]
    speed = float((turned[-1] - turned[last][0]) / (t[-1] - t[0]))
    steady = nocdyn("equilibrium", nocdyn.write("machine.nml", text), "--out", "steady")
    assert steady.returncode == 0, steady.stderr
    values = json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())["steady_states"][0]["values"]
    assert values["omega_rotor [rad/s]"] == pytest.approx(speed, rel=1e-3)
    assert values["moment_shaft [N m]"] == pytest.approx(moment.mean(), rel=5e-3)
    asked = f"&response body = 'rotor' speed = {speed * 0.999!r}, {speed * 1.001!r} count = 3 /\n"
    outcome = nocdyn("response", nocdyn.write("machine.nml", text + asked), "--out", "response")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("response", "response.csv")
    half = next(i for i, name in enumerate(header) if name.startswith("half_range_total_moment_shaft"))
    assert rows[1][half] == pytest.approx(np.ptp(moment) / 2, rel=1e-2)


@fast_only
def test_a_crank_is_as_exact_after_a_thousand_turns(nocdyn):
    table = run(nocdyn, SLIDER + "&run t_end = 65 /\n&output points = 101 /\n")
    turned = table["phi_a"]
    assert turned[-1] > 1000 * 2 * pi
    drift = [x - piston(0.05, 0.2, 0, v) for v, x in zip(turned, table["position_p"], strict=True)]
    assert max(map(abs, drift)) < 1e-11


def test_a_dead_centre_ends_the_run_with_the_name_of_the_joint(nocdyn):
    text = FREE.format("a", 0.02) + FREE.format("b", 0.02) + "&relation name = 'p' bodies = 'a', 'b'\n"
    text += (
        "  table_angle_deg = 0, 45, 90, 135, 180, 225, 270, 315, 360 table_driven_deg = 0, 30, 45, 30, 0, -30, -45, -30, 0 /\n"
    )
    text += "&drive name = 'd' body = 'b' speed = 1 /\n" + RUN
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 1
    assert "drive 'd' contradicts relation 'p' there, or does not differ from them: a dead centre" in outcome.stderr
    assert "trajectory.partial.csv" in json.dumps(nocdyn.files("out"))


TURN_BACK = "table_time = 0, 1, 3 table_speed = 0, 5, -5"


@pytest.mark.parametrize(
    ("drive", "joint", "time", "names"),
    [
        (
            "speed = 5",
            "&clutch name = 'b' bodies = 'a', 'ground' kind = 'dog' times = 1 levels = 1 /\n",
            1,
            "clutch 'b' contradicts drive 'd' there",
        ),
        (
            TURN_BACK,
            "&freewheel name = 'f' bodies = 'a', 'ground' direction = 'backward' /\n",
            2,
            "drive 'd' contradicts freewheel 'f' there",
        ),
    ],
)
def test_a_lock_against_a_drive_ends_the_run_with_both_names(nocdyn, drive, joint, time, names):
    text = DRIVE.format(drive) + joint + "&run t_end = 3 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 1
    assert f"t = {time} s: {names}, or does not differ" in outcome.stderr
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "trajectory.partial.csv"]


@pytest.mark.parametrize("efficiency", ["", "efficiency = 0.9"])
def test_a_freewheel_that_a_drive_stops_behind_a_gear_is_named_with_it(nocdyn, efficiency):
    text = DRIVE.format(TURN_BACK) + FREE.format("b", 1) + f"&gear name = 'g' bodies = 'a', 'b' teeth = 1, 2 {efficiency} /\n"
    text += "&freewheel name = 'f' bodies = 'b', 'ground' /\n&run t_end = 3 /\n"
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 1
    names = {"drive 'd' contradicts freewheel 'f'", "freewheel 'f' contradicts drive 'd'"}
    assert any(f"t = 2 s: {name} there, or" in outcome.stderr for name in names)


def test_a_freewheel_lets_a_drive_start_in_its_direction(nocdyn):
    text = DRIVE.format("table_time = 0, 1, 2 table_speed = 0, 5, 1")
    text += "&freewheel name = 'f' bodies = 'a', 'ground' direction = 'backward' /\n"
    table = run(nocdyn, text + "&run t_end = 3 /\n&output points = 7 /\n")
    assert table["omega_a"] == pytest.approx([0, 2.5, 5, 3, 1, 1, 1], abs=1e-12)
    assert table["torque_d"] == pytest.approx([5, 5, -4, -4, 0, 0, 0], abs=1e-9)


def test_extremes_are_those_of_the_motion_where_a_ramp_ends(nocdyn):
    run(nocdyn, DRIVE.format("table_time = 2, 4 table_speed = 1, 3") + "&run t_start = 3 t_end = 5 /\n")
    columns = nocdyn.summary("out")["columns"]
    assert columns["omega_a [rad/s]"]["max"] == pytest.approx(3, abs=1e-12)
    assert columns["energy_residual [J]"]["max"] < 1e-9


def test_many_cranks_start_together(nocdyn):
    text = "".join(
        f"&body name = 'b{i}' inertia = 0.05 speed = 100 /\n&crank name = 'c{i}' body = 'b{i}' crank_radius = 0.05\n"
        f"  rod_length = 0.2 piston_mass = 1 rod_mass = 1 rod_center = 0.07 rod_inertia = 0.004 phase_deg = {i * 60} /\n"
        for i in range(6)
    )
    text += "".join(f"&coupling name = 'k{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e5 damping = 5 /\n" for i in range(5))
    table = run(nocdyn, text + "&run t_end = 0.1 /\n")
    assert max(abs(table["energy_residual"])) < 1e-5 * table["kinetic_energy"][0]


def test_start_speeds_can_be_projected_on_a_joint(nocdyn):
    text = PAIR.replace("'b' inertia = 2", "'b' inertia = 2 speed = 3") + "&run t_end = 1 start = 'projected' /\n"
    table = run(nocdyn, text)
    ratio = 1 / cos(radians(30))
    common = (10 + 2 * 3 * ratio) / (1 + 2 * ratio**2)  # keeps J_1 w_1 + ratio J_2 w_2
    assert table["omega_a"][0] == pytest.approx(common, rel=1e-12)
    assert table["omega_b"][0] == pytest.approx(common * ratio, rel=1e-12)
