"""A train with an electrical machine has the same frequencies in modes, Campbell diagrams, responses, sweeps and ring-downs."""

import csv
import json
from math import pi

import numpy as np
import pytest
from sweep_inputs import needs_sweeps

# A circuit of an induction motor that moves the mechanical mode of 11.7 Hz by more than a tenth.
TRAIN = """\
&body name = 'rotor' inertia = 165.0 speed_rpm = 590 /
&body name = 'flywheel' inertia = 290.0 /
&body name = 'machine' inertia = 45.0 /
&coupling name = 'rubber' bodies = 'rotor', 'flywheel' stiffness = 6.0e5 damping = 800.0 /
&coupling name = 'shaft' bodies = 'flywheel', 'machine' stiffness = 9.0e6 damping = 300.0 /
&motor name = 'mains' body = 'rotor' kind = 'induction_dq' voltage = 6600 frequency_hz = 50 poles = 10
  stator_resistance = 0.43 rotor_resistance = 0.60 stator_reactance = 4.2 rotor_reactance = 4.2 mutual_reactance = 90.0 /
&load name = 'work' body = 'machine' quadratic = 4.2 /
&excitation name = 'shaker' body = 'machine' kind = 'orders' orders = 1.25 amplitudes = 50.0 /
"""
PULSE = "&excitation name = 'pulse' body = 'machine' kind = 'pulse' amplitude = 20.0 time = 0.01 duration = 0.005 /\n"
SPEED = 588.5  # near the steady state [rpm]
RESPONSE = "&response body = 'machine' speed_rpm = {}, {} count = {} /\n"
RUN = "&run t_end = 0.8 start = 'equilibrium' method = 'rk853' rtol = 1e-12 atol = 1e-13 /\n&output interval = 0.002 /\n"
SAME = 0.005  # asked for; what the run is linearised about differs by the oscillation


def report(nocdyn, command, text, folder="out"):
    nocdyn.write("machine.nml", text)
    outcome = nocdyn(command, "machine.nml", "--out", folder)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / folder / f"{command}.json").read_text())


def mechanical_mode(nocdyn):
    """Frequency and damping ratio of the mode of the rubber, and the frequency without damping and motor [Hz]."""
    modes = [mode for mode in report(nocdyn, "modes", TRAIN + RUN)["modes"] if mode["kind"] == "oscillating"]
    return next((m["frequency_Hz"], m["damping_ratio"], m["undamped_frequency_Hz"]) for m in modes if 10 < m["frequency_Hz"] < 20)


def rings(samples, step):
    """The damped frequencies [Hz] in a sum of decaying oscillations, by a matrix pencil."""
    half = len(samples) // 2
    hankel = np.array([samples[i : i + half] for i in range(len(samples) - half)])
    _, sizes, right = np.linalg.svd(hankel, full_matrices=False)
    basis = right[sizes > 1e-6 * sizes[0]].T
    poles = np.linalg.eigvals(np.linalg.pinv(basis[:-1]) @ basis[1:])
    rates = np.log(poles.astype(complex)) / step
    return sorted((abs(rate.imag) / (2 * pi), -rate.real / abs(rate)) for rate in rates)


def test_a_ring_down_has_the_frequency_of_modes(nocdyn):
    frequency, damping, undamped = mechanical_mode(nocdyn)
    assert abs(frequency - undamped) > 0.1 * undamped  # the motor matters
    columns = []
    for text in (TRAIN, TRAIN + PULSE):
        nocdyn.write("machine.nml", text.replace("amplitudes = 50.0", "amplitudes = 1e-9") + RUN)
        assert nocdyn("run", "machine.nml", "--out", "out").returncode == 0
        values = nocdyn.values("out")
        columns.append(values["total_moment_rubber"])
    samples = (columns[1] - columns[0])[10:]
    found, ratio = min(rings(samples, 0.002), key=lambda ring: abs(ring[0] - frequency))
    assert found == pytest.approx(frequency, rel=SAME)
    assert ratio == pytest.approx(damping, rel=0.02)


def test_campbell_and_the_critical_speeds_of_a_response_have_the_frequency_of_modes(nocdyn):
    frequency, damping, _ = mechanical_mode(nocdyn)
    campbell = report(nocdyn, "campbell", TRAIN + RUN + RESPONSE.format(500, 650, 31))
    speeds = nocdyn.values("out", "campbell.csv")
    assert any(
        np.interp(SPEED * pi / 30, speeds["omega_machine"], speeds[f"frequency_{k}"]) == pytest.approx(frequency, rel=SAME)
        for k in range(1, len(campbell["modes"]) + 1)
    )
    # order 1.25 meets it at 13 Hz, and the largest response is there
    response = report(nocdyn, "response", TRAIN + RUN + RESPONSE.format(500, 750, 51))
    (critical,) = [
        one for one in response["critical_speeds"] if one["order"] == 1.25 and abs(one["frequency_Hz"] - frequency) < 2
    ]
    (crossing,) = [
        one
        for one in report(nocdyn, "campbell", TRAIN + RUN + RESPONSE.format(500, 750, 51))["crossings"]
        if abs(one["frequency_Hz"] - critical["frequency_Hz"]) < 1e-6
    ]
    assert critical["frequency_Hz"] == pytest.approx(frequency, rel=SAME)
    assert critical["speed_rad_s"] == pytest.approx(crossing["speed_rad_s"], rel=1e-9)
    assert critical["speed_rad_s"] * 1.25 == pytest.approx(2 * pi * critical["frequency_Hz"], rel=1e-6)
    assert critical["damping_ratio"] == pytest.approx(damping, rel=0.02)


@needs_sweeps
def test_a_sweep_has_the_crossing_of_campbell_and_it_moves_without_jumps(nocdyn):
    low, high, count = 5.5e5, 6.5e5, 21
    text = TRAIN + RUN + RESPONSE.format(500, 800, 13).replace("count", "operating_rpm = 560, 600 count")
    sweep = f"&sweep design = 'grid' /\n&vary target = 'coupling.rubber.stiffness' low = {low} high = {high} count = {count} /\n"
    modes = [mode for mode in report(nocdyn, "campbell", text)["modes"] if "mostly" not in mode]
    number = next(mode["mode"] for mode in modes if 10 < mode["frequency_Hz"][0] < 20)
    sweep += f"&record mode = {number} order = 1.25 statistic = 'crossing', 'crossing_margin' /\n"
    nocdyn.write("machine.nml", text + sweep)
    outcome = nocdyn("sweep", "machine.nml", "--csv", "--out", "swept")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "swept/sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    speeds = np.array([float(row[f"mode_{number}_order_1.25_crossing [rad/s]"]) for row in rows])
    margins = np.array([float(row[f"mode_{number}_order_1.25_crossing_margin"]) for row in rows])
    assert np.all(np.diff(speeds) > 0)
    assert np.max(np.abs(np.diff(speeds, 2))) < 0.02 * np.mean(np.diff(speeds))  # smooth: a grid would make steps
    for k in (0, count - 1):
        stiffness = low + (high - low) * k / (count - 1)
        crossings = report(nocdyn, "campbell", text.replace("stiffness = 6.0e5", f"stiffness = {stiffness!r}"))["crossings"]
        (one,) = [one for one in crossings if one["mode"] == number and one["order"] == 1.25]
        assert speeds[k] == pytest.approx(one["speed_rad_s"], rel=1e-9)
        assert margins[k] == pytest.approx(one["distance_to_operation"], rel=1e-9)


@needs_sweeps
@pytest.mark.parametrize(
    ("record", "message"),
    [
        ("mode = 1 statistic = 'crossing'", "statistic = 'crossing' is where an order meets the mode; needed: order"),
        ("mode = 1 order = 2 statistic = 'frequency'", "statistic = 'frequency' is of the mode alone; allowed: no order"),
        (
            "mode = 1 order = 2 statistic = 'crossing_margin'",
            "statistic = 'crossing_margin' is the distance to the speeds in operation; needed: operating of &response",
        ),
        ("order = 2 quantity = 'omega_rotor' statistic = 'max'", "order needs response or mode"),
    ],
)
def test_records_of_crossings_are_refused_with_what_they_need(nocdyn, record, message):
    sweep = "&sweep design = 'grid' /\n&vary target = 'coupling.rubber.stiffness' low = 1e5 high = 2e5 count = 2 /\n"
    nocdyn.write("machine.nml", TRAIN + RUN + RESPONSE.format(500, 800, 13) + sweep + f"&record {record} /\n")
    outcome = nocdyn("sweep", "machine.nml", "--out", "out")
    assert outcome.returncode == 2
    assert message in outcome.stderr
    without = TRAIN + RUN + sweep + "&record mode = 1 order = 2 statistic = 'crossing' /\n"
    nocdyn.write("machine.nml", without)
    assert "needs &response with its speeds" in nocdyn("sweep", "machine.nml", "--out", "out").stderr


@needs_sweeps
def test_an_order_that_does_not_meet_the_mode_fails_the_variant_with_the_reason(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'coupling.rubber.stiffness' low = 6e5 high = 6.1e5 count = 2 /\n"
    text = TRAIN + RUN + RESPONSE.format(500, 800, 13) + sweep + "&record mode = 2 order = 0.1 statistic = 'crossing' /\n"
    nocdyn.write("machine.nml", text)
    outcome = nocdyn("sweep", "machine.nml", "--csv", "--out", "out")
    assert outcome.returncode == 1
    assert "order 0.1 does not meet mode 2 in the speeds of &response" in (nocdyn.folder / "out/sweep.csv").read_text()
