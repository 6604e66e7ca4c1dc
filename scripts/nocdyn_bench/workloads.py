"""What is measured. A new workload is one more function in WORKLOADS."""

import subprocess
import sys
from pathlib import Path

from .measure import Contestant, Workload

ROOT = Path(__file__).resolve().parents[2]
SCIPY_CASE = Path(__file__).with_name("scipy_case.py")
CASE2 = ROOT / "input" / "paper" / "case2.nml"
REFERENCE_TOLERANCES = ("--set", "run.rtol=1e-13", "--set", "run.atol=1e-13")


def start_up(nocdyn: Path, scratch: Path) -> Workload:
    return Workload("start_up", "Start-up", [
        Contestant("nocdyn --version", [nocdyn, "--version"]),
        Contestant("Python", [sys.executable, "-c", "pass"]),
        Contestant("Python and scipy.integrate", [sys.executable, "-c", "import scipy.integrate"]),
    ])


def case2(nocdyn: Path, scratch: Path) -> Workload:
    """The paper's case 2 as a whole process, 1001 rows written, at the tolerances of its input (1e-9)."""
    def run(label: str, *settings: str) -> Contestant:
        folder = scratch / "_".join(("nocdyn", *settings))
        options = [option for setting in settings for option in ("--set", f"run.{setting}")]
        return Contestant(label, [nocdyn, "run", "--quiet", "--out", folder, *options, CASE2], folder / "trajectory.csv")

    def scipy(method: str) -> Contestant:
        file = scratch / f"scipy_{method}.csv"
        return Contestant(f"SciPy {method}", [sys.executable, SCIPY_CASE, "--method", method, file], file)

    reference = scratch / "reference"
    subprocess.run([nocdyn, "run", "--quiet", "--out", reference, *REFERENCE_TOLERANCES, CASE2], check=True)
    return Workload("case2", "Paper, case 2, whole process", [
        run("nocdyn"),
        run("nocdyn, formulation paper", "formulation=paper"),
        run("nocdyn, formulation multiplier", "formulation=multiplier"),
        run("nocdyn, method rosenbrock", "method=rosenbrock"),
        scipy("LSODA"),
        scipy("DOP853"),
        scipy("RK45"),
    ], reference / "trajectory.csv", rival="SciPy LSODA", factor=20.0)


WORKLOADS = {"start_up": start_up, "case2": case2}
