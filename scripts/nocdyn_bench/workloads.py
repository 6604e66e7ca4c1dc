"""What is measured. A new workload is one more function in WORKLOADS."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import whole_process
from .chains import Scaling
from .costs import Case, Costs, Sweeping, chunk_costs, hand_out_costs, step_costs
from .example_runs import example_runs
from .example_sweeps import example_sweeps, with_springs
from .fatigue import fatigue_costs
from .nocdyn_sweep import sweepers
from .orbit_costs import orbit_costs
from .peers import heyoka, heyoka_sweep, numbalsoda, numbalsoda_sweep, scipy, scipy_sweep
from .problems import Case2, Chain
from .programs import Programs
from .report_costs import report_costs
from .shipped import Shipped
from .throughput import Throughput
from .torsional import Torsional
from .variants import CASE2, Errors, Family
from .work_precision import WorkPrecision

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "input" / "examples"
SCIPY_CASE = Path(__file__).with_name("scipy_case.py")
CASE2_INPUT = ROOT / "input" / "paper" / "case2.nml"
REFERENCE_TOLERANCES = ("--set", "run.rtol=1e-13", "--set", "run.atol=1e-13")


# Of W2: tolerances with which the errors are below 1e-6.
SWEEP_CASES = [Case("taylor", 5.0e-7), Case("rk45", 7.0e-8)]

EXPLICIT = ["rk45", "rk853", "taylor", "auto"]  # methods; one that cannot be used for a machine drops out with its reason
SHIPPED_SAMPLE = 50  # variants of W5 and W6 with an accurate solution
ENGINE = Family(
    Shipped(EXAMPLES / "engine" / "engine.nml", "crank_8"),
    ("coupling.rubber.stiffness", "coupling.rubber.damping", "coupling.oil.damping"),
    ((1.5e4, 2.5e4), (30.0, 90.0), (8.0, 16.0)),
    Errors(2e-5, 2e-5),
    compared=22,
    outputs=2501,
)
MILL = Family(
    Shipped(EXAMPLES / "rolling_mill" / "rolling_mill.nml", "shaft"),
    (
        "coupling.shaft.stiffness",
        "coupling.spindle.stiffness",
        "coupling.shaft.damping",
        "coupling.spindle.damping",
        "coupling.spindle.gap",
    ),
    ((4.8e7, 7.2e7), (3.6e7, 5.4e7), (4e4, 6e4), (3.2e4, 4.8e4), (0.016, 0.024)),
    Errors(1e-3, 1e-5),
    compared=3,
    outputs=301,
)


@dataclass(frozen=True)
class Bench:
    """What all workloads get to know."""

    nocdyn: Path  # the command
    programs: Programs  # those of bench/
    plain: Path  # those for processors with AVX2
    scratch: Path
    is_quick: bool


Workload = whole_process.Workload | WorkPrecision | Scaling | Throughput | Costs | Torsional


def start_up(bench: Bench) -> whole_process.Workload:
    return whole_process.Workload(
        "start_up",
        "Start-up",
        [
            whole_process.Contestant("nocdyn --version", [bench.nocdyn, "--version"]),
            whole_process.Contestant("Python", [sys.executable, "-c", "pass"]),
            whole_process.Contestant("Python and scipy.integrate", [sys.executable, "-c", "import scipy.integrate"]),
        ],
    )


def case2(bench: Bench) -> whole_process.Workload:
    """The paper's case 2 as a whole process, 1001 rows written, at the tolerances of its input (1e-9)."""

    def run(label: str, *settings: str) -> whole_process.Contestant:
        folder = bench.scratch / "_".join(("nocdyn", *settings))
        options = [option for setting in settings for option in ("--set", f"run.{setting}")]
        return whole_process.Contestant(
            label, [bench.nocdyn, "run", "--quiet", "--out", folder, *options, CASE2_INPUT], folder / "trajectory.csv"
        )

    def scipy_process(method: str) -> whole_process.Contestant:
        file = bench.scratch / f"scipy_{method}.csv"
        return whole_process.Contestant(f"SciPy {method}", [sys.executable, SCIPY_CASE, "--method", method, file], file)

    reference = bench.scratch / "reference"
    subprocess.run([bench.nocdyn, "run", "--quiet", "--out", reference, *REFERENCE_TOLERANCES, CASE2_INPUT], check=True)
    return whole_process.Workload(
        "case2",
        "Paper, case 2, whole process",
        [
            run("nocdyn"),
            run("nocdyn, formulation paper", "formulation=paper"),
            run("nocdyn, formulation multiplier", "formulation=multiplier"),
            run("nocdyn, method rosenbrock", "method=rosenbrock"),
            scipy_process("LSODA"),
            scipy_process("DOP853"),
            scipy_process("RK45"),
        ],
        reference / "trajectory.csv",
        rival="SciPy LSODA",
        factor=20.0,
    )


def w1(bench: Bench) -> WorkPrecision:
    problem = Case2()
    return WorkPrecision(
        "W1",
        "W1: case 2, 1001 outputs, in process",
        problem,
        [
            *bench.programs.nocdyn(problem, ["rk45", "rk853", "taylor", "auto", "rodas4", "rodas5p"]),
            bench.programs.handwritten(),
            *heyoka.contestants(problem),
            *numbalsoda.contestants(problem, ["DOP853, dense", "LSODA"]),
            *bench.programs.sundials(problem, ["adams", "bdf", "bdf2", "erk5"]),
            *scipy.contestants(problem, ["DOP853"] if bench.is_quick else ["RK45", "DOP853", "LSODA"]),
        ],
        errors_wanted=[1e-6, 1e-9, 1e-12],
    )


def w2(bench: Bench) -> Throughput:
    own = sweepers(bench.nocdyn.parent, bench.scratch, CASE2, ["taylor", "rk45"], most=2)
    count, memory = (10_000, [10_000]) if bench.is_quick else (100_000, [100_000, 1_000_000])
    return Throughput(
        "W2",
        "W2: variants of case 2, final state and largest elastic moment",
        CASE2,
        count,
        5000,
        [
            *(sweeper.contestant() for sweeper in own),
            bench.programs.handwritten_sweep(),
            *heyoka_sweep.contestants(CASE2, 16, 256),  # the fastest of 8, 16, 32 ... 256
            *numbalsoda_sweep.contestants(CASE2),
            *bench.programs.sundials_sweep(["erk5", "adams"]),
            *scipy_sweep.contestants(CASE2, ["DOP853"] if bench.is_quick else ["DOP853", "LSODA", "RK45"]),
        ],
        own,
        counts=memory,
    )


def steps(bench: Bench) -> Costs:
    sweeping = Sweeping(bench.programs.folder, bench.scratch)
    return Costs(
        "step_costs", "Step costs in sweeps of case 2", lambda rounds: step_costs(sweeping, bench.plain, SWEEP_CASES, rounds)
    )


def chunks(bench: Bench) -> Costs:
    sweeping = Sweeping(bench.programs.folder, bench.scratch)
    return Costs("chunk_costs", "Chunk costs in sweeps of case 2", lambda rounds: chunk_costs(sweeping, SWEEP_CASES[0], rounds))


def hand_out(bench: Bench) -> Costs:
    sweeping = Sweeping(bench.programs.folder, bench.scratch)
    return Costs("hand_out", "Hand-out to many ranks", lambda rounds: hand_out_costs(sweeping, SWEEP_CASES[0], rounds))


def w3(bench: Bench) -> Scaling:
    chains = [Chain(bodies) for bodies in (10, 100, 1000, 10000)]
    return Scaling(
        "W3",
        "W3: chain of N rotors, rtol 1e-6, atol 1e-8",
        chains,
        {
            chain: [
                *bench.programs.nocdyn(chain, ["rk45", "rk853", "taylor", "auto"]),
                *numbalsoda.contestants(chain, ["DOP853"]),
                *(numbalsoda.contestants(chain, ["LSODA"]) if chain.bodies <= 100 else []),  # its Jacobian is dense
                *heyoka.contestants(chain),
                *bench.programs.sundials(chain, ["adams", "bdf", "erk5", "erk8"]),
                *scipy.contestants(chain, ["ode DOP853", "LSODA"]),
            ]
            for chain in chains
        },
        reference_tolerance=1e-12,
    )


def w3_stiff(bench: Bench) -> Scaling:
    chains = [Chain(bodies, 1.0e8, 1.0e9, t_end=0.01) for bodies in (10, 100, 1000, 10000)]
    return Scaling(
        "W3_stiff",
        "W3, implicit: the chain with stiffnesses 1e8 and 1e9, to 0.01 s",
        chains,
        {
            chain: [
                *bench.programs.nocdyn(chain, ["rodas4", "rodas5p", "auto"]),
                *bench.programs.sundials(chain, ["bdf", "bdf2"]),
            ]
            for chain in chains
        },
        reference_tolerance=1e-12,
    )


def w4(bench: Bench) -> WorkPrecision:
    problem = Case2(1.0e8, 1.0e9, 1.0e-4)
    return WorkPrecision(
        "W4",
        "W4: case 2 with K1 = 1e8, k1 = 1e9, J3 = 1e-4, 1001 outputs, in process",
        problem,
        [
            *bench.programs.nocdyn(problem, ["rodas4", "rodas5p", "auto", "rk45", "rk853", "taylor"]),
            *heyoka.contestants(problem),
            *numbalsoda.contestants(problem, ["DOP853", "LSODA"]),
            *bench.programs.sundials(problem, ["bdf2", "bdf"]),
            *scipy.contestants(problem, [] if bench.is_quick else ["Radau"]),
        ],
        errors_wanted=[1e-4, 1e-6],
        tolerances_wanted=[1e-6],
    )


def shipped_run(bench: Bench, name: str, title: str, family: Family) -> WorkPrecision:
    """One run of the machine."""
    return WorkPrecision(
        name,
        f"{name}: {title}, {len(family.problem.times)} outputs, in process",
        family.problem,
        [
            *bench.programs.nocdyn(family.problem, EXPLICIT),
            *heyoka.contestants(family.problem),
            *numbalsoda.contestants(family.problem, ["DOP853, dense", "LSODA"]),
        ],
        errors_wanted=[family.wanted.state],
        moments_wanted=[family.wanted.peak],
    )


def shipped_sweep(bench: Bench, name: str, title: str, family: Family, count: int, stepped_lanes: int) -> Throughput:
    own = sweepers(bench.nocdyn.parent, bench.scratch, family, EXPLICIT)
    count = count // 4 if bench.is_quick else count
    return Throughput(
        f"{name}_sweep",
        f"{name}_sweep: {count} variants of {title}, in one thread",
        family,
        count,
        SHIPPED_SAMPLE,
        [
            *(sweeper.contestant() for sweeper in own),
            *heyoka_sweep.contestants(family, 8, stepped_lanes),
            *numbalsoda_sweep.contestants(family),
        ],
        own,
    )


def w5(bench: Bench) -> WorkPrecision:
    return shipped_run(bench, "W5", "the six-cylinder engine", ENGINE)


def w5_sweep(bench: Bench) -> Throughput:
    return shipped_sweep(bench, "W5", "the six-cylinder engine", ENGINE, 256, stepped_lanes=16)


def w6(bench: Bench) -> WorkPrecision:
    return shipped_run(bench, "W6", "the rolling mill with its gap", MILL)


def w6_sweep(bench: Bench) -> Throughput:
    return shipped_sweep(bench, "W6", "the rolling mill with its gap", MILL, 500, stepped_lanes=64)


def runs(bench: Bench) -> Costs:
    files = [file for file in sorted(EXAMPLES.glob("*/*.nml")) if "&sweep" not in file.read_text(encoding="utf-8")]
    plain = bench.plain.parent / "bin" / "nocdyn"
    return Costs(
        "example_runs",
        "What a run of each shipped example costs",
        lambda rounds: example_runs(bench.nocdyn, plain, bench.scratch, files, rounds),
    )


def examples(bench: Bench) -> Costs:
    files = with_springs(sorted(EXAMPLES.glob("*/*.nml")))
    return Costs(
        "example_sweeps",
        "What a sweep of each shipped example costs",
        lambda rounds: example_sweeps(bench.nocdyn.parent, bench.scratch, files, bench.programs.methods(), rounds),
    )


def opentorsion(bench: Bench) -> Torsional:
    return Torsional("opentorsion", "openTorsion: modes and forced responses", bench.nocdyn, bench.scratch)


def fatigue(bench: Bench) -> Costs:
    programs, scratch = bench.programs.folder, bench.scratch
    return Costs("fatigue", "Fatigue", lambda rounds: fatigue_costs(bench.nocdyn, programs, scratch, rounds))


def report(bench: Bench) -> Costs:
    return Costs("report", "Report", lambda rounds: report_costs(ROOT, bench.scratch, rounds))


def orbits(bench: Bench) -> Costs:
    engine = EXAMPLES / "engine" / "engine.nml"
    return Costs("orbit_costs", "Periodic motions", lambda rounds: orbit_costs(bench.nocdyn, engine, bench.scratch, rounds))


WORKLOADS: dict[str, Callable[[Bench], Workload]] = {
    "start_up": start_up,
    "case2": case2,
    "W1": w1,
    "W2": w2,
    "W3": w3,
    "W3_stiff": w3_stiff,
    "W4": w4,
    "W5": w5,
    "W5_sweep": w5_sweep,
    "W6": w6,
    "W6_sweep": w6_sweep,
    "example_runs": runs,
    "example_sweeps": examples,
    "opentorsion": opentorsion,
    "fatigue": fatigue,
    "orbit_costs": orbits,
    "report": report,
    "step_costs": steps,
    "chunk_costs": chunks,
    "hand_out": hand_out,
}
