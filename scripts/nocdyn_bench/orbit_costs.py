"""What branches of periodic motions cost: `nocdyn orbit` beside harmonic balance written for the machine with NumPy."""

import json
import subprocess
import time
from pathlib import Path
from statistics import median

from .harmonic_balance import HarmonicBalance
from .tables import table

BODIES, HARMONICS = 20, 7
STIFFNESS, CUBIC, DAMPING, FORCE = 1.0, 0.1, 0.2, 0.01
FROM, TO = 0.065, 0.09  # rad/s, about the first resonance
SCALE, LONGEST = 10.0, 0.06  # a motion in rad; steps of the same length as those of nocdyn
SAME_FOLDS = 1e-5  # relative: NumPy interpolates between points


def chain() -> str:
    """The input of the chain."""
    names = ["ground", *(f"b{i}" for i in range(1, BODIES + 1))]
    law = f"stiffness = {STIFFNESS} cubic_stiffness = {CUBIC} damping = {DAMPING}"
    text = "".join(f"&body name = '{name}' inertia = 1.0 /\n" for name in names[1:])
    for i in range(BODIES):
        text += f"&coupling name = 'c{i + 1}' bodies = '{names[i]}', '{names[i + 1]}' {law} /\n"
    text += f"&excitation name = 'shaker' body = '{names[-1]}' amplitude = {FORCE} frequency = {FROM} /\n&run t_end = 1.0 /\n"
    over = f"over = 'excitation.shaker.frequency' range = {FROM}, {TO}"
    return f"{text}&orbit {over} harmonics = {HARMONICS} stability = .false. signals = 'phi_{names[-1]}' /\n"


SPEEDS = 152  # that the engine is asked for; the branch has points of its own between them
ENGINE = f"&orbit body = 'flywheel' speed_rpm = 600, 2500 subharmonic = 2 harmonics = 48 count = {SPEEDS} /\n"
PROGRESSIVE = "coupling.rubber.cubic_stiffness=2.0e6"  # N m/rad^3


def engine_costs(nocdyn: Path, example: Path, scratch: Path, rounds: int) -> list[str]:
    """Lines of a table: a six-cylinder engine with a progressive rubber coupling, with and without multipliers."""
    rows = []
    for words, added in (("with multipliers", ""), ("without multipliers", "stability = .false. ")):
        text = example.read_text() + ENGINE.replace("&orbit ", f"&orbit {added}")
        file, out = scratch / "engine.nml", scratch / "engine"
        file.write_text(text)
        times = []
        for _ in range(rounds):
            began = time.perf_counter()
            subprocess.run([nocdyn, "orbit", file, "--set", PROGRESSIVE, "--out", out], check=True, capture_output=True)
            times.append(time.perf_counter() - began)
        points = len((out / "orbit.csv").read_text().splitlines()) - 1
        rows.append([words, f"{median(times):.3g}", str(points), f"{1e3 * median(times) / points:.3g}"])
    return [
        *table(["six-cylinder engine, 600 to 2500 rpm", "s", "points", "ms a point"], rows),
        "",
        f"`{example.name}` with a progressive rubber coupling: 11 bodies, 48 harmonics of four turns, all signals, "
        f"median of {rounds}.",
    ]


def orbit_costs(nocdyn: Path, example: Path, scratch: Path, rounds: int) -> list[str]:
    """Lines of two tables."""
    file, out = scratch / "chain.nml", scratch / "chain"
    file.write_text(chain())
    ours, theirs = [], []
    for _ in range(rounds):
        began = time.perf_counter()
        subprocess.run([nocdyn, "orbit", file, "--out", out], check=True, capture_output=True)
        ours.append(time.perf_counter() - began)
        began = time.perf_counter()
        peer = HarmonicBalance(BODIES, STIFFNESS, CUBIC, DAMPING, FORCE, HARMONICS)
        peer.follow(FROM, TO, SCALE, LONGEST)
        theirs.append(time.perf_counter() - began)
    special = json.loads((out / "orbit.json").read_text())["special_points"]
    folds = [point["value"] for point in special if point["kind"] == "fold"]
    points = len((out / "orbit.csv").read_text().splitlines()) - 1
    pairs = zip(folds, peer.folds(), strict=True)
    if any(abs(one - other) > SAME_FOLDS * one for one, other in pairs):
        raise RuntimeError(f"the folds differ: {folds}, {peer.folds()}")
    fast = median(ours)
    rows = [
        ["`nocdyn orbit`", f"{fast:.3g}", str(points), "1"],
        ["NumPy, for this machine", f"{median(theirs):.3g}", str(len(peer.points)), f"{median(theirs) / fast:.3g}"],
    ]
    return [
        *table(["branch through two folds", "s", "points", "time"], rows),
        "",
        f"Chain of {BODIES} bodies with cubic springs, {HARMONICS} harmonics, no multipliers, median of {rounds}. `nocdyn orbit` "
        "starts, reads the input, locates the folds, estimates the error of each point and writes its files in this time; NumPy "
        "does none of that.",
        "",
        *engine_costs(nocdyn, example, scratch, rounds),
    ]
