"""What the counting of cycles costs: in a sweep of starts, and alone beside the package rainflow."""

import json
import subprocess
import time
from pathlib import Path
from statistics import median

import numpy as np
import rainflow

from .tables import rounded, table

STARTS = """&body name = 'motor' inertia = 2.0 /
&body name = 'fan' inertia = 25.0 /
&motor name = 'drive' body = 'motor' kind = 'induction' breakdown_torque = 800 breakdown_slip = 0.15 synchronous_speed = 157 /
&load name = 'air' body = 'fan' quadratic = 0.012 /
&excitation name = 'mains' body = 'motor' amplitude = 300 frequency_hz = 50 decay = 0.3 /
&coupling name = 'c' bodies = 'motor', 'fan' stiffness = 6.0e3 damping = 6.0 diameter = 0.06 /
&fatigue name = 'life' coupling = 'c' reference_stress = 4.0e7 reference_cycles = 1.0e6 slope = 5 /
&run t_end = 8.0 /
&sweep design = 'random' samples = 10000 seed = 3 /
&vary target = 'coupling.c.stiffness' low = 4.0e3 high = 9.0e3 /
&vary target = 'coupling.c.damping' low = 4.0 high = 9.0 /
&record quantity = 'total_moment_c' statistic = 'max_abs' /
&record quantity = 'omega_fan' statistic = 'final' /
"""
DAMAGE = "&record fatigue = 'life' statistic = 'damage', 'cycles' /\n"
VARIANTS = 10000
FACTOR = 1.3  # that a sweep with damage may take
POINTS = 100_000  # that the package counts


def fatigue_costs(nocdyn: Path, programs: Path, scratch: Path, rounds: int) -> list[str]:
    """Lines of two tables."""
    texts = {"peak moment and last speed": STARTS, "the same, damage and cycles": STARTS + DAMAGE}
    seconds = {label: [] for label in texts}
    for _ in range(rounds):
        for label, text in texts.items():
            seconds[label].append(_sweep(nocdyn, scratch, text))
    plain, counted = (median(found) for found in seconds.values())
    verdict = "reached" if counted <= FACTOR * plain else "missed"
    rows = [[label, rounded(VARIANTS / median(found)), f"{median(found) / plain:.3g}"] for label, found in seconds.items()]
    own = json.loads(subprocess.run([programs / "rainflow_costs"], check=True, capture_output=True, text=True).stdout)
    began = time.perf_counter()
    points = np.random.default_rng(1).random(POINTS) * np.tile([1.0, -1.0], POINTS // 2)
    list(rainflow.extract_cycles(points))
    theirs = (time.perf_counter() - began) / POINTS
    alone = own["seconds"] / own["points"]
    counters = [
        ["nocdyn, with the damage", f"{1e9 * alone:.3g}", "1"],
        ["rainflow (Python)", f"{1e9 * theirs:.3g}", f"{theirs / alone:.3g}"],
    ]
    return [
        *table(["recorded", "variants per second", "time"], rows),
        "",
        f"{rounded(VARIANTS)} starts of a fan through the pulsation of its motor, 8 s each, stiffness and damping at random, all "
        f"threads, median of {rounds}. At most {FACTOR} times the time is wanted: **{verdict}**.",
        "",
        *table(["counting of random turning points", "ns for a point", "time"], counters),
        "",
        f"{rounded(own['points'])} points take nocdyn {own['seconds']:.3g} s.",
    ]


def _sweep(nocdyn: Path, scratch: Path, text: str) -> float:
    """Seconds of the computation."""
    file, out = scratch / "starts.nml", scratch / "starts"
    file.write_text(text, encoding="utf-8")
    subprocess.run([nocdyn, "sweep", "--quiet", "--out", out, file], check=True, stdin=subprocess.DEVNULL)
    return VARIANTS / json.loads((out / "summary.json").read_text(encoding="utf-8"))["variants_per_second"]
