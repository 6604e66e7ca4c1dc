"""Draws the pictures of the page on signs from docs/tutorial/signs.nml, in docs/media.

usage: sign_figures.py NOCDYN
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from matplotlib import pyplot  # noqa: E402
from nocdyn_report.style import COLOURS, WIDTH, save  # noqa: E402

MACHINE = ROOT / "docs/tutorial/signs.nml"
MEDIA = ROOT / "docs/media"
ELEMENTS = {  # place on the shaft, what it is, the columns of its torques
    "&engine, works = 'engine'": (1.0, ("torque_gas_1", "torque_gas_2", "torque_gas_3", "torque_gas_4")),
    "&engine, works = 'compressor'": (4.0, ("torque_piston_1", "torque_piston_2")),
    "&load": (6.4, ("torque_fan",)),
}


def without_units(row):
    return {label.split(" [")[0]: float(value) for label, value in row.items()}


def results_of(nocdyn):
    """The steady state, and the rows of a run."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([nocdyn, "equilibrium", MACHINE, "--out", f"{folder}/steady"], check=True, capture_output=True)
        steady = json.loads(Path(folder, "steady/equilibrium.json").read_text(encoding="utf-8"))["steady_states"][0]["values"]
        options = ["--set", "run.t_end=0.13", "--set", "output.points=2001"]
        subprocess.run([nocdyn, "run", MACHINE, "--out", f"{folder}/run", *options], check=True, capture_output=True)
        with open(f"{folder}/run/trajectory.csv", newline="", encoding="utf-8") as file:
            return without_units(steady), [without_units(row) for row in csv.DictReader(file)]


def draw_train(steady):
    """The shaft with an arrow for each torque: with the rotation upwards, against it downwards."""
    figure, axes = pyplot.subplots(figsize=(WIDTH, 3.6))
    axes.set_axis_off()
    axes.plot([0, 7.4], [0, 0], color="0.4", linewidth=5, solid_capstyle="butt", zorder=1)
    for x, height in ((1.0, 0.42), (4.0, 0.36)):
        axes.add_patch(pyplot.Rectangle((x - 0.35, -height), 0.7, 2 * height, facecolor="0.85", edgecolor="0.3", zorder=2))
    rotation = {"arrowstyle": "-|>", "connectionstyle": "arc3,rad=-0.5", "color": "0.2", "linewidth": 1.4}
    axes.annotate("", xy=(-0.1, 0.32), xytext=(-0.1, -0.32), arrowprops=rotation)
    axes.text(-0.25, -0.45, f"rotation\n$\\omega$ = {steady['omega_crankshaft']:.4g} rad/s", ha="left", va="top")
    for colour, (label, (x, columns)) in zip(COLOURS, ELEMENTS.items(), strict=False):
        torque = sum(steady[column] for column in columns)
        direction = 1 if torque > 0 else -1
        axes.annotate(
            "",
            xy=(x, direction * 1.05),
            xytext=(x, direction * 0.42),
            arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 2.5, "mutation_scale": 18},
        )
        verb = "drives" if torque > 0 else "resists"
        text = f"{label}\n{verb}: {torque:+.4g} N m\npower {torque * steady['omega_crankshaft'] / 1e3:+.3g} kW"
        side = -1 if x > 2 and x < 5 else 1
        axes.text(x + 0.15 * side, direction * 1.1, text, color=colour, ha="left" if side > 0 else "right", va="center")
    axes.set_xlim(-0.5, 8.4)
    axes.set_ylim(-1.6, 1.6)
    return figure


def draw_cycle(rows):
    """The torque of one cylinder of each over two turns, as the columns have it."""
    figure, axes = pyplot.subplots(figsize=(WIDTH, 3.4))
    angles = [row["phi_crankshaft"] * 180 / 3.141592653589793 for row in rows]
    last = max(i for i, angle in enumerate(angles) if angle <= 720)
    axes.axhline(0, color="0.3", linewidth=0.8)
    for colour, column, name in zip(COLOURS, ("torque_gas_1", "torque_piston_1"), ("engine", "compressor"), strict=False):
        values = [row[column] for row in rows[: last + 1]]
        axes.plot(angles[: last + 1], values, color=colour, label=f"{name}: {column}")
    axes.set_xlim(0, 720)
    axes.set_xticks(range(0, 721, 90))
    axes.set_xlabel("angle of the crankshaft after the start [deg]")
    axes.set_ylabel("torque on the shaft [N m]")
    axes.legend(loc="upper right")
    return figure


def main(nocdyn):
    steady, rows = results_of(nocdyn)
    save(draw_train(steady), MEDIA, "signs", ("png",))
    save(draw_cycle(rows), MEDIA, "signs_cycle", ("png",))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(str(Path(sys.argv[1]).resolve()))
