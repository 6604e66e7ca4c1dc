"""Measurements beside runs, responses and modes; torques and speeds that were measured."""

import csv
import json
import math

import f90nml
import numpy as np
import pytest

MACHINE = """&body name = 'a' inertia = 1.0 speed = 10.0 /
&body name = 'b' inertia = 1.0 speed = 11.0 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 100.0 cubic_stiffness = 500.0 damping = 0.3 /
&excitation name = 'e' body = 'a' amplitude = 5.0 frequency_hz = 3.0 /
&run t_end = 3.0 rtol = 1e-9 atol = 1e-10 /
&output points = 301 /
"""
FORCED = """&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 2.0 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 1e4 damping = 4.0 /
&load name = 'l' body = 'b' quadratic = 0.001 /
&excitation name = 'e' body = 'a' kind = 'orders' orders = 1, 2 amplitudes = 10, 5 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 100 /
&run t_end = 1.0 /
&response body = 'a' speed = 20, 150 count = 14 orders = 1, 2 /
"""


def columns(path):
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return rows[0], np.array([[float(cell) for cell in row] for row in rows[1:]])


def column(path, name):
    labels, rows = columns(path)
    return rows[:, [label.partition(" [")[0] for label in labels].index(name)]


@pytest.fixture
def record(nocdyn):
    """The trajectory of the machine, whose torque and speed are records."""
    nocdyn.write("ref.nml", MACHINE)
    assert nocdyn("run", "ref.nml", "--out", "ref", "-q").returncode == 0
    return nocdyn.folder / "ref/trajectory.csv"


def run(nocdyn, groups, code=0, machine=MACHINE):
    nocdyn.write("m.nml", machine + groups)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert outcome.returncode == code, outcome.stderr
    return outcome


def test_the_record_of_a_run_differs_from_it_by_nothing_and_changes_nothing(nocdyn, record):
    outcome = run(
        nocdyn, "&measurement name = 'g' signal = 'total_moment_c' file = 'ref/trajectory.csv' column = 'total_moment_c' /\n"
    )
    (one,) = nocdyn.summary("out")["measurements"]
    assert (one["values"], one["bias"], one["spread"], one["largest_difference"]) == (301, 0, 0, 0)
    assert "measured g total_moment_c: 301 values, bias 0, spread 0 N m, correlation 1" in outcome.stdout
    assert (nocdyn.folder / "out/trajectory.csv").read_bytes() == record.read_bytes()


def test_differences_are_those_of_numpy(nocdyn, record):
    time, torque = column(record, "t"), column(record, "total_moment_c")
    random = np.random.default_rng(1)
    measured = (torque + random.normal(0.3, 0.2, len(torque))) / 1e3
    rows = "".join(f"{1e3 * t!r};{value!r}\n".replace(".", ",") for t, value in zip(time.tolist(), measured.tolist()))
    nocdyn.write("log.csv", "Recorder 7; x\nTime [ms];Torque #1 [kN m]\n" + rows)
    groups = "&measurement name = 'g' signal = 'total_moment_c' file = 'log.csv' column = 'torque #1' from = 0.5 until = 2.5 /\n"
    run(nocdyn, groups)
    (one,) = nocdyn.summary("out")["measurements"]
    inside = (time >= 0.5) & (time <= 2.5)
    difference = torque[inside] - 1e3 * measured[inside]
    close = {"rel": 1e-9, "abs": 1e-12}
    assert one["values"] == inside.sum() and one["outside"] == (~inside).sum()
    assert one["bias"] == pytest.approx(difference.mean(), **close)
    assert one["spread"] == pytest.approx(difference.std(ddof=1), **close)
    assert one["correlation"] == pytest.approx(np.corrcoef(torque[inside], measured[inside])[0, 1], **close)
    assert one["largest_difference"] == pytest.approx(difference[abs(difference).argmax()], **close)
    labels, rows = columns(nocdyn.folder / "out/measured_g.csv")
    assert labels == ["t [s]", "measured [N m]", "computed [N m]", "difference [N m]"]
    assert rows[:, 3] == pytest.approx(difference, **close)
    copy = f90nml.read(nocdyn.folder / "out/input.nml")["measurement"]
    assert "file" not in copy and copy["unit"] == "kN m" and copy["times"][1] == pytest.approx(time[1])
    assert nocdyn("run", "out/input.nml", "--out", "again", "-q").returncode == 0
    assert (nocdyn.folder / "again/measured_g.csv").read_bytes() == (nocdyn.folder / "out/measured_g.csv").read_bytes()


def test_clocks_are_aligned_and_gaps_counted(nocdyn, record):
    time, speed = column(record, "t"), column(record, "omega_a")
    inside = (time > 0.8) & (time < 2.2)
    rows = [f"{t - 0.3333:.9f}\t{n * 30 / math.pi:.12f}\n" for t, n in zip(time[inside], speed[inside])]
    rows[20] = rows[20].partition("\t")[0] + "\t\n"
    rows[30] = rows[30].partition("\t")[0] + "\tNaN\n"
    nocdyn.write("log.csv", "t\tn [rpm]\n" + "".join(rows))
    groups = "&measurement name = 'n' signal = 'omega_a' file = 'log.csv' delay = 0.2 alignment = 'found' largest_shift = 0.5 /\n"
    outcome = run(nocdyn, groups)
    (one,) = nocdyn.summary("out")["measurements"]
    assert one["gaps"] == 2 and "2 gaps of the file" in outcome.stdout
    assert one["delay_s"] == pytest.approx(0.3333, abs=1e-4)  # a hundredth of a row
    assert one["spread"] < 1e-3 * one["half_range_measured"]
    assert "delay = 0.333" in outcome.stdout


def test_a_clock_that_drifts_is_followed(nocdyn, record):
    time, torque = column(record, "t"), column(record, "total_moment_c")
    rows = "".join(f"{t + 0.01 * math.sin(t):.9f},{m:.12g}\n" for t, m in zip(time, torque))
    nocdyn.write("log.csv", rows)
    group = "&measurement name = 'g' signal = 'total_moment_c' file = 'log.csv' alignment = '{}' {} /\n"
    spreads = []
    for word, more in (("found", ""), ("drifting", "drift_interval = 0.5")):
        run(nocdyn, group.format(word, more))
        (one,) = nocdyn.summary("out")["measurements"]
        spreads.append(one["spread"])
    assert spreads[1] < 0.3 * spreads[0]
    assert -0.02 < one["drift_s"][0] < 0 < one["drift_s"][1] < 0.02


def test_a_band_is_that_of_scipy(nocdyn, record):
    signal = pytest.importorskip("scipy.signal")
    time, torque = column(record, "t"), column(record, "total_moment_c")
    measured = torque + 2 * np.sin(2 * np.pi * 30 * time) + 0.5 * time
    nocdyn.write("log.csv", "".join(f"{t!r},{value!r}\n" for t, value in zip(time.tolist(), measured.tolist())))
    run(nocdyn, "&measurement name = 'g' signal = 'total_moment_c' file = 'log.csv' frequency_band_hz = 1, 10 /\n")
    _, rows = columns(nocdyn.folder / "out/measured_g.csv")
    high, low = (signal.butter(2, f, kind, fs=100, output="sos") for f, kind in ((1, "highpass"), (10, "lowpass")))
    length = {"padtype": "odd", "padlen": len(time) - 1}
    for place, values in ((1, measured), (2, torque)):
        expected = signal.sosfiltfilt(low, signal.sosfiltfilt(high, values, **length), **length)
        assert rows[:, place] == pytest.approx(expected, abs=1e-9)


def test_peaks_are_compared_with_continuous_time(nocdyn, record):
    outcome = run(nocdyn, "&measurement name = 'p' kind = 'peak' signal = 'total_moment_c' values = 5.0 from = 1.0 /\n")
    (one,) = nocdyn.summary("out")["measurements"]
    torque = column(record, "total_moment_c")[100:]
    assert 0 <= one["bias"] - (np.ptp(torque) / 2 - 5) < 0.02  # the rows miss the peaks by this
    assert "measured p, half_range of total_moment_c: computed 5.0" in outcome.stdout


def test_orders_are_those_of_the_response(nocdyn):
    nocdyn.write("f.nml", FORCED)
    assert nocdyn("response", "f.nml", "--out", "f", "-q").returncode == 0
    labels, rows = columns(nocdyn.folder / "f/response_orders.csv")
    first = rows[rows[:, labels.index("order [1]")] == 1][:, [0, labels.index("total_moment_c [N m]")]]
    speeds, values = first[::-1].T  # in any order
    lists = [", ".join(map(repr, numbers.tolist())) for numbers in (speeds, values)]
    groups = "&measurement name = 'o' kind = 'order' signal = 'total_moment_c' order = 1 speeds = {} values = {} /\n".format(
        *lists
    )
    groups += "&measurement name = 'p' kind = 'peak' signal = 'total_moment_c' speed = 60 values = 50 /\n"
    nocdyn.write("m.nml", FORCED + groups)
    assert nocdyn("response", "m.nml", "--out", "out", "-q").returncode == 0
    orders, peak = json.loads((nocdyn.folder / "out/response.json").read_text())["measurements"]
    assert abs(orders["largest_difference"]) <= 1e-9 * values.max() and orders["values"] == len(speeds)
    assert peak["largest_difference_at"] == 60 and abs(peak["bias"]) > 1


def test_frequencies_are_paired_with_the_nearest_modes(nocdyn):
    nocdyn.write("m.nml", FORCED + "&measurement name = 'f' kind = 'frequency' frequency_hz = 19.4 relative_damping = 0.02 /\n")
    outcome = nocdyn("modes", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    labels, rows = columns(nocdyn.folder / "out/measured_f.csv")
    with (nocdyn.folder / "out/modes.csv").open(encoding="utf-8") as file:
        mode = next(row for row in csv.DictReader(file) if row["kind"] == "oscillating")
    assert rows[0, 0] == 1 and rows[0, 2] == pytest.approx(2 * math.pi * float(mode["frequency [Hz]"]))
    assert rows[0, labels.index("computed_damping [1]")] == pytest.approx(float(mode["damping_ratio"]))
    assert "measured f: computed 19.48" in outcome.stdout
    damping = float(mode["damping_ratio"])
    assert f"measured f, damping ratios: computed {damping:.6g}"[:48] in outcome.stdout
    (one,) = json.loads((nocdyn.folder / "out/modes.json").read_text())["measurements"]
    assert one["damping_bias"] == pytest.approx(damping - 0.02)


def test_a_response_over_the_frequency_says_what_it_does_not_compare(nocdyn):
    shaker = "&excitation name = 's' body = 'a' amplitude = 1 frequency_hz = 5 /\n"
    groups = "&measurement name = 'o' kind = 'order' order = 1 signal = 'total_moment_c' speeds = 50 values = 1 /\n"
    groups += "&measurement name = 'p' kind = 'peak' signal = 'total_moment_c' values = 1 /\n"  # of a run
    machine = "".join(line for line in FORCED.splitlines(keepends=True) if not line.startswith(("&response", "&excitation")))
    nocdyn.write("m.nml", machine + shaker + "&response body = 'a' frequency_hz = 5, 40 count = 9 /\n" + groups)
    outcome = nocdyn("response", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert "the measurement 'o' at speeds is compared with nothing" in outcome.stdout and "'p'" not in outcome.stdout


@pytest.mark.parametrize("has_pulses", [False, True])
def test_orders_are_found_in_the_record_of_a_run_up(nocdyn, has_pulses):
    """Orders 1, 2 and 2.5 of a sweep from 300 to 1500 rpm; the amplitude of order 2 is in proportion to the speed."""
    time = np.arange(0, 20, 5e-4)
    speed = 2 * np.pi / 60 * (300 + 1200 * time / 20)
    angle = 2 * np.pi / 60 * (300 * time + 1200 * time**2 / 40)
    values = 3 + 5 * np.sin(angle) + 0.1 * speed * np.sin(2 * angle + 1) + 2 * np.cos(2.5 * angle)
    last = np.sin(4 * angle) if has_pulses else speed
    nocdyn.write("log.csv", "t,M,n\n" + "".join(f"{t:.6f},{m:.15g},{n:.15g}\n" for t, m, n in zip(time, values, last)))
    source = "pulse_column = 'n' pulses_per_turn = 4" if has_pulses else "time_column = 't' speed_column = 'n'"
    groups = "".join(
        f"&measurement name = 'o{i}' kind = 'order' signal = 'total_moment_c' order = {order} file = 'log.csv' column = 'M' "
        f"{source} /\n"
        for i, order in enumerate((1, 2))
    )
    nocdyn.write("m.nml", FORCED + groups)
    outcome = nocdyn("response", "m.nml", "--out", "out", "-q")
    assert outcome.returncode == 0, outcome.stderr
    for i in range(2):
        _, rows = columns(nocdyn.folder / f"out/measured_o{i}.csv")
        assert len(rows) > 20 and rows[0, 0] < 40 and rows[-1, 0] > 140
        expected = (5 + 0 * rows[:, 0], 0.1 * rows[:, 0])[i]
        assert rows[:, 1] == pytest.approx(expected, rel=5e-3 if has_pulses else 1e-3)


def test_a_measured_torque_drives_a_run_as_its_table_does(nocdyn):
    rows = [(0.01 * i, math.sin(0.3 * i)) for i in range(300)]
    nocdyn.write("log.csv", "x;Time [ms];M [kN m]\n" + "".join(f"a;{1e3 * t!r};{m / 2e3!r}\n" for t, m in rows))
    table = f"table_time = {', '.join(repr(1e3 * t / 1e3 + 0.1) for t, _ in rows)}\n"
    table += f"table_torque = {', '.join(repr(1e3 * (2 * (m / 2e3) + 1e-3)) for _, m in rows)}"
    group = "&excitation name = 't' body = 'b' kind = 'table' {} /\n"
    run(nocdyn, group.format(table))
    expected = column(nocdyn.folder / "out/trajectory.csv", "omega_b")
    record = "&measurement name = 'M' file = 'log.csv' time_column = 'time' column = 'm' scale = 2 offset = 1e-3 delay = 0.1 /\n"
    run(nocdyn, group.format("measurement = 'M'") + record)
    assert column(nocdyn.folder / "out/trajectory.csv", "omega_b") == pytest.approx(expected, rel=1e-9)
    assert nocdyn("run", "out/input.nml", "--out", "again", "-q").returncode == 0


def test_a_measured_speed_drives_a_body(nocdyn):
    nocdyn.write("log.csv", "t;n [rpm]\n0;100\n1;200\n3;200\n")
    run(
        nocdyn,
        "&measurement name = 'n' file = 'log.csv' /\n&drive name = 'd' body = 'a' measurement = 'n' /\n",
        machine=MACHINE.replace("speed = 10.0", f"speed = {100 * math.pi / 30!r}"),
    )
    assert column(nocdyn.folder / "out/trajectory.csv", "omega_a")[50] == pytest.approx(math.pi * 150 / 30)


SERIES = "&measurement name = 'g' signal = 'total_moment_c' times = 0, 1 values = 1, 2 {} /\n"


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        (SERIES.replace("total_moment_c", "total_moment_d"), "signal: there is no signal 'total_moment_d'"),
        (SERIES.format("unit = 'kg'"), "unit: 'kg' is a unit of mass; needed: one of "),
        (SERIES.format("frequency_band_hz = 5, 1"), "frequency_band: the second frequency must be greater than the first"),
        (SERIES.format("from = 2 until = 1"), "until = 1 is out of range; allowed: > from = 2"),
        (SERIES.format("largest_drift = 1"), "largest_drift needs alignment = 'drifting'"),
        (
            SERIES.format("alignment = 'drifting' largest_drift = 1"),
            "largest_drift must be less than half of drift_interval, 1 s",
        ),
        ("&measurement name = 'g' signal = 'omega_a' /\n", "times or file is missing; one of them is needed"),
        ("&measurement name = 'g' signal = 'omega_a' times = 0, 1 values = 1 /\n", "needed: as many of each"),
        (
            "&measurement name = 'g' signal = 'omega_a' file = 'log.csv' column = 'x' /\n",
            "there is no single column 'x' in log.csv:1",
        ),
        ("&measurement name = 'g' signal = 'omega_a' file = 'log.csv' time_unit = 'm' /\n", "time_unit: 'm' is a unit of length"),
        ("&measurement name = 'g' signal = 'omega_a' file = 'no.csv' /\n", "file: no.csv: cannot be read"),
        (
            "&measurement name = 'g' signal = 'omega_a' file = 'back.csv' /\n",
            "back.csv:3: the time, column 1, 1, must be greater than 2",
        ),
        ("&measurement name = 'g' signal = 'omega_a' file = 'bad.csv' /\n", "bad.csv:3: column 2, 'x', is not a number"),
        (
            "&measurement name = 'p' kind = 'peak' signal = 'omega_a' values = 1, 2 /\n",
            "values: 2 numbers; needed: one, the peak",
        ),
        ("&measurement name = 'p' kind = 'peak' signal = 'omega_a' values = 1 from = 9 /\n", "is not before the end of the run"),
        ("&measurement name = 'p' kind = 'peak' values = 1 /\n", "signal is missing; needed: the name of a column"),
        ("&measurement name = 'p' kind = 'peak' signal = 'omega_a' /\n", "values is missing; needed: measured values"),
        (
            "&excitation name = 'x' body = 'a' kind = 'table' measurement = 'h' /\n" + SERIES,
            "measurement: there is no &measurement 'h'",
        ),
        (
            "&excitation name = 'x' body = 'a' kind = 'table' measurement = 'g' /\n" + SERIES.format("alignment = 'found'"),
            "the delay of 'g' is found by a run, which it cannot drive",
        ),
        (
            "&excitation name = 'x' body = 'a' kind = 'table' measurement = 'g' /\n" + SERIES.format("unit = 'rpm'"),
            "unit of 'g': 'rpm' is a unit of",
        ),
        (
            "&excitation name = 'x' body = 'a' kind = 'table' measurement = 'p' /\n"
            "&measurement name = 'p' kind = 'peak' signal = 'omega_a' values = 1 /\n",
            "'p' is of kind 'peak'; needed: 'series'",
        ),
        (
            "&measurement name = 'g' kind = 'seris' signal = 'omega_a' file = 'log.csv' /\n",
            "kind = 'seris' is not known; allowed: 'series', 'order', 'frequency', 'peak'; did you mean 'series'?",
        ),
        (
            "&measurement name = 'g' signal = 'omega_a' file = 'first.csv' column = 'n' /\n",
            "there is no column 'n' in first.csv: line 1 looks like headings, but line 2 is no row of numbers: '5x'",
        ),
        ("&measurement name = 'g' signal = 'omega_a' file = 'none.csv' column = 'n' /\n", "none.csv has no row of numbers"),
        ("&measurement name = 'g' kind = 3 signal = 'omega_a' file = 'log.csv' /\n", "kind = 3 is not a text"),
    ]
    + [
        (f"{SERIES.format(key)}&excitation name = 'x' body = 'a' kind = 'table' measurement = 'g' /\n", words)
        for key, words in (
            ("kind = 'seris'", "kind = 'seris' is not known"),
            ("alignment = 'fund'", "alignment = 'fund' is not known"),
            ("delay = x", "delay = x is not a number"),
            ("scale = 'a'", "scale = 'a' is a text"),
            ("offset = 'a'", "offset = 'a' is a text"),
        )
    ],
)
def test_what_is_wrong_with_a_measurement_is_named(nocdyn, groups, words):
    nocdyn.write("log.csv", "t;n\n0;1\n1;2\n")
    nocdyn.write("first.csv", "t;n\n0;5x\n1;1\n2;2\n3;3\n4;4\n")
    nocdyn.write("none.csv", "t;n\n")
    nocdyn.write("back.csv", "t;n\n2;1\n1;2\n")
    nocdyn.write("bad.csv", "t;n\n0;1\n1;x\n2;2\n3;2\n")
    outcome = run(nocdyn, groups.replace(" {} /", " /"), 3 if "no.csv" in groups else 2)
    assert words in outcome.stderr and "m.nml:7: &" in outcome.stderr
    assert not (nocdyn.folder / "out").exists()


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ("signal = 'total_moment_c' order = 3 speeds = 50 values = 1", "order = 3: nothing excites this order"),
        ("signal = 'total_moment_c' order = 1 speeds = -50, 50 values = 1, 1", "speeds of both signs, or 0; needed: one sign"),
        ("signal = 'kinetic_energy' order = 1 speeds = 50 values = 1", "is not among the quantities of a response"),
        ("signal = 'total_moment_c' order = 1 values = 1, 2", "speeds is missing; needed: one for each amplitude"),
        ("signal = 'total_moment_c' order = 1 times = 0, 1 values = 1, 2", "speeds or pulses is missing beside times"),
        ("signal = 'total_moment_c' order = 1 times = 0, 1 speeds = 9, 9 values = 1, 2", "turns; needed: 8 at least, by turns"),
        ("signal = 'total_moment_c' order = 1 times = 0, 1 speeds = -9, 9 values = 1, 2", "the speed changes its sign"),
        ("signal = 'total_moment_c' speeds = 50 values = 1", "order is missing"),
    ],
)
def test_what_is_wrong_with_an_order_is_named(nocdyn, groups, words):
    nocdyn.write("m.nml", FORCED + f"&measurement name = 'o' kind = 'order' {groups} /\n")
    outcome = nocdyn("response", "m.nml", "--out", "out")
    assert outcome.returncode == 2
    assert words in outcome.stderr and "m.nml:9: &measurement 'o'" in outcome.stderr


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ("frequency_hz = 19, 40 relative_damping = 0.1", "relative_damping has 1 values and frequency has 2"),
        ("frequency_hz = 19 modes = 3", "modes: there is no oscillating mode 3; allowed: 1 to 1"),
        ("relative_damping = 0.1", "frequency is missing"),
        ("frequency_hz = 19 damping_deviation = 0.01", "damping_deviation needs relative_damping"),
    ],
)
def test_what_is_wrong_with_frequencies_is_named(nocdyn, groups, words):
    nocdyn.write("m.nml", FORCED + f"&measurement name = 'f' kind = 'frequency' {groups} /\n")
    outcome = nocdyn("modes", "m.nml", "--out", "out")
    assert outcome.returncode == 2
    assert words in outcome.stderr and "m.nml:9: &measurement 'f'" in outcome.stderr
