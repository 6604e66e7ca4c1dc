"""Machines that stand still, or hardly move: break-aways, extremes, cycles and rows are those of the torques."""

import csv
import os
import random

import numpy as np
import pytest
from sweep_inputs import needs_sweeps

METHODS = ("auto", "rk45", "rk853", "rodas4", "rodas5p")
BRAKES = int(os.environ.get("NOCDYN_BRAKES", "10"))

HELD = """\
&body name = 'a' inertia = 1.25 /
&clutch name = 'k' bodies = 'a', 'ground' capacity = 100 /
&excitation name = 'x' body = 'a' amplitude = 20 frequency = 50 /
&run t_end = 1 /
"""

GEARED = """\
&body name = 'a' inertia = 1.25 /
&body name = 'b' inertia = 1 /
&gear name = 'g' bodies = 'a', 'b' radii = 0.1, 0.2 /
&clutch name = 'k' bodies = 'b', 'ground' capacity = 100 /
&excitation name = 'x' body = 'a' amplitude = 20 frequency = 50 /
&excitation name = 'y' body = 'b' amplitude = 7 frequency = 311 phase = 0.4 /
&fatigue name = 'teeth' gear = 'g' reference_force = 500 reference_cycles = 1e6 slope = 5 /
&run t_end = 8 /
"""


def run(nocdyn, text, *words):
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "out", *words)
    assert outcome.returncode == 0, outcome.stderr
    return outcome.stdout, nocdyn.summary("out")


def break_aways(summary):
    return [event["time"] for event in summary["joint_events"] if event["from"] == "locked"]


class Brake:
    """A drum that a brake holds against torques, and the times at which it breaks away, by steps of 20 us."""

    def __init__(self, seed):
        rng = random.Random(seed)
        self.inertia, self.capacity = 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(1, 3)
        self.t_end = rng.choice([1.0, 3.0])
        self.mean = self.capacity * rng.uniform(-0.9, 0.9)
        self.left = self.capacity - abs(self.mean)
        self.parts, self.groups = [], []
        slow = 10 ** rng.uniform(0.5, 2.3)
        kind = ("beat", "two", "table", "fault", "pulses")[seed % 5]
        if kind == "beat":
            size = self.left * rng.uniform(0.4, 0.65)
            self.sine(size, slow, rng.uniform(0, 6))
            self.sine(-size, slow * rng.uniform(1.01, 1.2), rng.uniform(0, 6))
        elif kind == "two":
            self.sine(self.left * rng.uniform(0.3, 0.9), slow, rng.uniform(0, 6))
            self.sine(self.left * rng.uniform(0.1, 0.9), slow * rng.uniform(2, 9), rng.uniform(0, 6))
        elif kind == "table":
            times = sorted(rng.uniform(0.1, self.t_end) for _ in range(rng.randint(4, 12)))
            torques = [0.0] + [self.left * rng.uniform(-1.3, 1.3) * (rng.random() < 0.5) for _ in times[1:]]
            self.groups.append(f"kind = 'table' table_time = {numbers(times)} table_torque = {numbers(torques)}")
            self.parts.append(lambda t: np.interp(t, times, torques))
            self.sine(self.left * 0.2, slow, 0.3)
        elif kind == "fault":
            self.fault(rng)
        else:
            for _ in range(3):
                self.pulse(self.left * rng.uniform(-1.5, 1.5), rng.uniform(0, self.t_end), 10 ** rng.uniform(-3, -1))
            self.sine(self.left * rng.uniform(0.1, 0.7), slow, 0.0)

    def sine(self, size, rate, phase):
        self.groups.append(f"amplitude = {size!r} frequency = {rate!r} phase = {phase!r}")
        self.parts.append(lambda t: size * np.sin(rate * t + phase))

    def pulse(self, size, begin, duration):
        self.groups.append(f"kind = 'pulse' amplitude = {size!r} time = {begin!r} duration = {duration!r}")
        self.parts.append(
            lambda t: np.where((t >= begin) & (t <= begin + duration), size * np.sin(np.pi * (t - begin) / duration), 0.0)
        )

    def fault(self, rng):
        begin, rate = rng.uniform(0.1, 0.9) * self.t_end, 314.0
        sizes = [self.left * rng.uniform(0.5, 2), self.left * rng.uniform(-1, 1)]
        decay = [rng.uniform(0.05, 0.5), rng.uniform(0.05, 0.5)]
        self.groups.append(
            f"kind = 'fault' term_amplitudes = {numbers(sizes)} term_multiples = 1, 2 term_times = {numbers(decay)} "
            f"frequency = {rate} time = {begin!r}"
        )

        def torque(t):
            x = np.clip(t - begin, 0, None)
            return sum(a * np.exp(-x / d) * np.sin(n * rate * x) for a, d, n in zip(sizes, decay, (1, 2), strict=True))

        self.parts.append(torque)

    def text(self):
        text = f"&body name = 'drum' inertia = {self.inertia!r} /\n"
        text += f"&motor name = 'load' body = 'drum' kind = 'constant' torque = {self.mean!r} /\n"
        text += f"&clutch name = 'brake' bodies = 'drum', 'ground' capacity = {self.capacity!r} /\n"
        for i, group in enumerate(self.groups):
            text += f"&excitation name = 'x{i}' body = 'drum' {group} /\n"
        return text + f"&run t_end = {self.t_end} /\n&output points = 11 /\n"

    def torque(self, t):
        return self.mean + sum(part(t) for part in self.parts)

    def break_aways(self):
        """While it slips, the slip is the sum of the torque over the time, less that of the capacity."""
        steps = round(self.t_end / 2e-5)
        t = np.linspace(0, self.t_end, steps + 1)
        torque = self.torque(t)
        middle = self.torque(0.5 * (t[1:] + t[:-1]))
        pushed = np.concatenate([[0], np.cumsum((torque[:-1] + 4 * middle + torque[1:]) / 6 * t[1])])
        times, i = [], 0
        while True:
            over = np.flatnonzero(np.abs(torque[i:]) > self.capacity)
            if len(over) == 0:
                return times
            i += over[0]
            way = np.sign(torque[i])
            times.append(self.root(t[i - 1], t[i], way))
            slip = way * (pushed[i:] - pushed[i]) - self.capacity * (t[i:] - t[i])
            stop = np.flatnonzero(slip[1:] <= 0)
            if len(stop) == 0:
                return times
            i += 1 + stop[0]

    def root(self, low, high, way):
        for _ in range(60):
            middle = 0.5 * (low + high)
            if way * self.torque(middle) > self.capacity:
                high = middle
            else:
                low = middle
        return high


def numbers(values):
    return ", ".join(map(repr, values))


@pytest.mark.parametrize("seed", range(BRAKES))
def test_a_brake_breaks_away_whenever_the_torques_exceed_its_capacity(nocdyn, seed):
    brake = Brake(seed)
    _, summary = run(nocdyn, brake.text(), "--set", f"run.method={METHODS[seed // 2 % 5]}")
    # a slip of less than a few steps of the reference is none for it
    assert break_aways(summary) == pytest.approx(brake.break_aways(), abs=1e-6)


@pytest.mark.parametrize("amplitude", [100.0001, 103, 110])
def test_every_peak_above_the_capacity_breaks_the_brake_away(nocdyn, amplitude):
    _, summary = run(nocdyn, HELD, "--set", f"excitation.x.amplitude={amplitude}")
    assert len(summary["joint_events"]) == 32


@pytest.mark.parametrize("method", METHODS)
def test_extremes_of_what_a_brake_holds_are_those_of_the_torque(nocdyn, method):
    _, summary = run(nocdyn, HELD, "--set", f"run.method={method}")
    for column in ("torque_k [N m]", "torque_x [N m]"):
        extremes = summary["columns"][column]
        assert [extremes["min"], extremes["max"]] == pytest.approx([-20, 20], rel=2e-6)


@pytest.mark.parametrize("method", METHODS)
def test_teeth_that_hold_still_count_the_cycles_of_their_force(nocdyn, method):
    only_x = ("--set", "excitation.y.amplitude=0", "--set", "excitation.y.frequency=1")
    _, summary = run(nocdyn, GEARED, "--set", f"run.method={method}", *only_x)
    assert summary["fatigue"][0]["cycles"] == pytest.approx(8 * 50 / (2 * np.pi), abs=0.6)
    assert summary["fatigue"][0]["largest_range"] == pytest.approx(400, rel=2e-6)
    assert summary["columns"]["reaction_g [N]"]["max"] == pytest.approx(200, rel=2e-6)


@needs_sweeps
def test_a_sweep_finds_the_extremes_of_what_is_held(nocdyn):
    sweep = GEARED + "&sweep design = 'grid' /\n&vary target = 'excitation.x.amplitude' low = 20 high = 22 count = 2 /\n"
    for statistic in ("max", "min", "rms"):
        sweep += f"&record quantity = 'torque_k' statistic = '{statistic}' /\n"
    sweep += "&record fatigue = 'teeth' statistic = 'cycles' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", sweep), "--csv", "--out", "sweep")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "sweep" / "sweep.csv", newline="") as file:
        variants = list(csv.DictReader(file))
    t = np.linspace(0, 8, 400001)
    for variant, amplitude in zip(variants, (20, 22), strict=True):
        torque = -2 * amplitude * np.sin(50 * t) + 7 * np.sin(311 * t + 0.4)
        found = [float(variant[f"torque_k_{name} [N m]"]) for name in ("max", "min", "rms")]
        assert found == pytest.approx([max(torque), min(torque), np.sqrt(np.mean(torque**2))], rel=2e-5)
        _, summary = run(nocdyn, GEARED, "--set", f"excitation.x.amplitude={amplitude}")
        extremes = summary["columns"]["torque_k [N m]"]
        assert [extremes["max"], extremes["min"]] == pytest.approx(found[:2], rel=1e-5)  # of polynomials of another degree
        assert float(variant["teeth_cycles"]) == pytest.approx(summary["fatigue"][0]["cycles"], abs=1)  # equal peaks close others


def test_friction_never_exceeds_its_capacity(nocdyn):
    text = """\
&body name = 'a' inertia = 1 speed = 3 /
&body name = 'b' inertia = 0.3 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 1000 damping = 0.1 /
&load name = 'rub' body = 'a' constant = 2 constant_speed = 0.01 /
&excitation name = 'x' body = 'b' amplitude = 4 frequency = 11 /
&run t_end = 5 /
"""
    _, summary = run(nocdyn, text, "--set", "run.method=rodas5p")
    extremes = summary["columns"]["torque_rub [N m]"]
    assert extremes["min"] >= -2 * (1 + 1e-4) and extremes["max"] <= 2 * (1 + 1e-4)
    assert extremes["min"] == pytest.approx(-2, rel=1e-4)


def test_a_heavy_rotor_does_not_hide_what_drives_it(nocdyn):
    text = """\
&body name = 'a' inertia = 1e8 speed = 30 /
&excitation name = 'x' body = 'a' amplitude = 10 frequency = 700 /
&excitation name = 'o' body = 'a' kind = 'orders' orders = 2, 6 amplitudes = 5, 3 /
&run t_end = 4 /
"""
    _, summary = run(nocdyn, text)
    angle = np.linspace(0, 2 * np.pi, 100001)
    orders = 5 * np.sin(2 * angle) + 3 * np.sin(6 * angle)
    for column, exact in (("torque_x [N m]", [-10, 10]), ("torque_o [N m]", [min(orders), max(orders)])):
        extremes = summary["columns"][column]
        assert [extremes["min"], extremes["max"]] == pytest.approx(exact, rel=1e-5)


def test_the_row_at_a_torque_step_shows_a_clutch_that_slips(nocdyn):
    text = """\
&body name = 'motor' inertia = 1 /
&body name = 'pinion' inertia = 1 /
&body name = 'wheel' inertia = 8 /
&gear name = 'g' bodies = 'pinion', 'wheel' radii = 0.1, 0.1 internal = .true. /
&clutch name = 'k' bodies = 'motor', 'pinion' capacity = 50 static_capacity = 60 /
&excitation name = 'short' body = 'motor' kind = 'step' amplitude = 1000 time = 2 /
"""
    for t_end in (4, 2):  # the last row too
        stdout, summary = run(nocdyn, text + f"&run t_end = {t_end} /\n&output points = 1001 /\n")
        header, rows = nocdyn.table("out")
        row = next(row for row in rows if row[0] == 2)
        assert row[header.index("torque_k [N m]")] == pytest.approx(50, rel=1e-12)
        assert row[header.index("reaction_g [N]")] == pytest.approx(-4000 / 9, rel=1e-12)
        assert summary["columns"]["torque_k [N m]"]["max"] == pytest.approx(50, rel=1e-12)
        assert next(line for line in stdout.splitlines() if line.startswith("torque_k")).split()[-2:] == ["50", "2"]


VIBRATING = """\
&body name = 'a' inertia = 1 speed = {speed} /
&body name = 'b' inertia = 1 speed = {speed} /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 1e5 damping = 0.5 /
&excitation name = 'x' body = 'a' {excitation} /
&run t_end = 2 /
&output interval = {interval} /
"""


@pytest.mark.parametrize(
    "speed, excitation, frequency",
    [(0, "amplitude = 10 frequency_hz = 50", 50), (100, "kind = 'orders' orders = 1, 3 amplitudes = 9, 3", 47.8)],
)
def test_rows_that_hide_a_vibration_are_noted(nocdyn, speed, excitation, frequency):
    for interval, is_noted in ((0.3 / frequency, True), (0.2 / frequency, False)):
        stdout, _ = run(nocdyn, VIBRATING.format(speed=speed, excitation=excitation, interval=interval))
        note = [line for line in stdout.splitlines() if "do not show the vibration" in line]
        assert len(note) == is_noted
        if is_noted:
            assert f"by excitation 'x', up to {frequency} Hz" in note[0]


AT_REST = """\
&body name = 'motor' inertia = 0.3 /
&body name = 'drum' inertia = 2 /
&gear name = 'box' bodies = 'motor', 'drum' teeth = 1, 3 internal = .true. efficiency = 0.95 /
&motor name = 'drive' body = 'motor' kind = 'constant' torque = 2.1 /
&motor name = 'weight' body = 'drum' kind = 'constant' torque = -6.3 /
&run t_end = 1 /
"""


@pytest.mark.parametrize("text", [HELD, AT_REST])
def test_a_machine_at_rest_has_no_energy_that_is_wrong(nocdyn, text):
    stdout, _ = run(nocdyn, text)
    assert "energy balance error:" not in stdout and "tighten" not in stdout
