"""Compares the torques measured on the test bench of Aalto University with those that nocdyn computes.

usage: compare.py DATA

DATA has the records of three tests, NAME_motor.csv and NAME_sensor.csv for ice_2000, sin and step, as published with the software
of M. Manngard et al. (GitHub: urho-h/torque_estimation_masters). They carry no licence, so that they are not part of nocdyn.
Motor and propeller torque, as the drives measured them, are the input; a constant torque is added to that of the motor, so that
the means balance at the measured speed with the viscous losses of the parameters. The torques of both shafts are compared, from
0.5 to 120 Hz. The clocks of the two recorders drift: the record is cut into pieces of 1 s, each moved by up to 0.06 s about the
common lag to where the propeller torques agree most.
"""

import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import butter, correlate, sosfiltfilt

HERE = Path(__file__).resolve().parent
TESTS = {"ice_2000": "ice", "sin": "sine, 32 Hz", "step": "steps"}
SHAFTS = {"total_moment_s8": ("motor shaft", 3), "total_moment_s18": ("propeller shaft", 4)}  # column of the sensors
SPEED = 209.859  # of the motor, measured [rad/s]
RATIOS = 3.0, 12.0
STEP = 1e-3  # [s]
BAND = 0.5, 120.0  # [Hz]
PIECE, MOST_LAG, MOST_DRIFT, MARGIN = 1000, 3000, 60, 300  # [steps]
MOTOR = 2, 4  # columns: torques of motor and propeller


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        return np.array([[float(cell) for cell in row] for row in csv.reader(file)])


def filtered(values):
    return sosfiltfilt(butter(4, BAND, "bandpass", fs=1 / STEP, output="sos"), values)


def losses():
    """Torque of the viscous losses at the motor [N m]: loads of case.nml at the measured speed."""
    vertical, propeller = SPEED / RATIOS[0], SPEED / RATIOS[1]
    return (0.003 + 0.0042) * SPEED + 2 * 0.0042 * vertical / RATIOS[0] + (0.0042 + 0.24) * propeller / RATIOS[1]


def write_input(folder, name, motor):
    """The machine with the torques of the record."""
    time = motor[:, 0]
    torques = {"motor": ("d0", motor[:, MOTOR[0]]), "propeller": ("d21", -motor[:, MOTOR[1]])}
    lines = []
    for key, (body, values) in torques.items():
        mean = values.mean()
        rows = [(-1, mean), (-STEP, mean), *zip(time, values)]
        (folder / f"{name}_{key}.csv").write_text("".join(f"{t:.9g},{value:.9g}\n" for t, value in rows), encoding="utf-8")
        lines.append(f"&excitation name = '{key}' body = '{body}' kind = 'table' table_file = '{name}_{key}.csv' /")
    missing = losses() - torques["propeller"][1].mean() / RATIOS[1] - torques["motor"][1].mean()
    lines.append(f"&motor name = 'balance' body = 'd0' kind = 'constant' torque = {missing:.9g} /")
    lines.append(f"&run t_start = -1 t_end = {time[-1]:.9g} start = 'equilibrium' rtol = 1e-7 atol = 1e-9 /")
    lines.append(f"&output interval = {STEP} /")
    machine = (HERE / "case.nml").read_text(encoding="utf-8").partition("&run")[0]
    (folder / f"{name}.nml").write_text(machine + "\n".join(lines) + "\n", encoding="utf-8")
    return missing


def run(folder, name):
    program = os.environ.get("NOCDYN", "nocdyn")
    subprocess.run([program, "run", f"{name}.nml", "--out", name, "--quiet"], cwd=folder, check=True)
    with (folder / name / "trajectory.csv").open(newline="", encoding="utf-8") as file:
        reader = csv.reader(file)
        labels = [label.partition(" [")[0] for label in next(reader)]
        table = np.array([[float(cell) for cell in row] for row in reader])
    return {label: table[:, place] for place, label in enumerate(labels)}


def pieces(computed, measured):
    """Pairs of the begins of pieces."""
    correlation = correlate(computed, measured, "full")
    lags = np.arange(1 - len(measured), len(computed))
    near = abs(lags) < MOST_LAG
    common = lags[near][np.argmax(correlation[near])]
    for begin in range(MARGIN, len(measured) - PIECE - MARGIN, PIECE):
        piece = measured[begin : begin + PIECE]
        starts = [
            start
            for start in range(begin + common - MOST_DRIFT, begin + common + MOST_DRIFT + 1)
            if MARGIN <= start <= len(computed) - PIECE - MARGIN
        ]
        if starts:
            yield max(starts, key=lambda start: computed[start : start + PIECE] @ piece), begin


def compare(folder, data, name):
    """Rows: shaft, and for computed and measured torque the mean, half range, root mean square; correlation."""
    sensor = read(data / f"{name}_sensor.csv")
    motor = read(data / f"{name}_motor.csv")
    added = write_input(folder, name, motor[np.r_[True, np.diff(motor[:, 0]) > 0]])
    print(f"{TESTS[name]}: {added:.3f} N m are added to the motor", file=sys.stderr)
    results = run(folder, name)
    time = np.arange(0, min(results["t"][-1], sensor[-1, 0]), STEP)
    torques = {
        shaft: (-np.interp(time, results["t"], results[column]), np.interp(time, sensor[:, 0], sensor[:, place]))
        for column, (shaft, place) in SHAFTS.items()
    }
    pairs = list(pieces(*map(filtered, torques["propeller shaft"])))
    for shaft, both in torques.items():
        waves = [np.concatenate([wave[k : k + PIECE] for k in begins]) for wave, begins in zip(map(filtered, both), zip(*pairs))]
        halves, sizes = [np.ptp(wave) / 2 for wave in waves], [wave.std() for wave in waves]
        yield shaft, [torque.mean() for torque in both], halves, sizes, np.corrcoef(*waves)[0, 1]


def main(words):
    if len(words) != 1 or not Path(words[0]).is_dir():
        print(__doc__, file=sys.stderr)
        return 2
    ratios = {"half range": [], "root mean square": []}
    print("| test | shaft | mean, computed / measured [N m] | half range | root mean square | correlation |")
    print("| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for name, title in TESTS.items():
            for shaft, means, halves, sizes, correlation in compare(Path(folder), Path(words[0]), name):
                cells = [f"{computed:.2f} / {measured:.2f}" for computed, measured in (means, halves, sizes)]
                print(f"| {title} | {shaft} | {' | '.join(cells)} | {correlation:.2f} |")
                ratios["half range"].append(np.log(halves[0] / halves[1]))
                ratios["root mean square"].append(np.log(sizes[0] / sizes[1]))
    for quantity, values in ratios.items():
        bias, spread = np.exp(np.mean(values)), np.std(values, ddof=1)
        print(f"{quantity}: computed over measured {bias:.2f} (bias {100 * (bias - 1):+.0f} %), spread {100 * spread:.0f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
