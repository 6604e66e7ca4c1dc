"""What was measured, for people (Markdown) and for programs (JSON)."""

import json
import math
import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from . import targets
from .chains import Scaling
from .costs import Costs
from .rounds import Point
from .tables import rounded, table
from .throughput import SLOW_SAMPLE, Rate, Throughput
from .torsional import Torsional
from .whole_process import Workload, largest_error
from .work_precision import WorkPrecision

COLUMNS = {"states": "error", "moment": "moment"}  # kinds of errors, as heads of tables name them
PEERS = ("heyoka", "numbalsoda", "numba", "scipy", "numpy", "opentorsion", "rainflow")
VERDICTS = {
    "W1": targets.case2_verdicts,
    **dict.fromkeys(("W2", "W5_sweep", "W6_sweep"), targets.throughput_verdicts),
    "W4": targets.stiff_case2_verdicts,
    "W3": targets.chain_verdicts,
    "W3_stiff": targets.stiff_chain_verdicts,
    "opentorsion": targets.torsional_verdicts,
}


Measured = Workload | WorkPrecision | Scaling | Throughput | Costs | Torsional


def verdicts(workload: Measured) -> list[targets.Verdict]:
    return VERDICTS[workload.name](workload) if workload.name in VERDICTS else []


def markdown(workload: Measured) -> str:
    """One section."""
    if isinstance(workload, WorkPrecision):
        lines = _work_precision(workload)
    elif isinstance(workload, Scaling):
        lines = _scaling(workload)
    elif isinstance(workload, Throughput):
        lines = _throughput(workload)
    elif isinstance(workload, Costs | Torsional):
        lines = workload.lines
    else:
        lines = _whole_process(workload)
    return "\n".join([f"## {workload.title}", "", *lines, *(f"\n{verdict}." for verdict in verdicts(workload))])


def write_report(measured: list, folder: Path, build: Path) -> None:
    """Leaves bench.md and bench.json in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    machine = describe_machine(build)
    sections = [
        "# Benchmarks",
        "\n".join(f"- {name}: {text}" for name, text in machine.items()),
        "Times are the shortest of all rounds, measured in turns, in process unless the title says otherwise. Start-up and "
        "compilation are not included, nor is nocdyn's energy balance, because the others have none. Ratios "
        "are similar on other computers, milliseconds are not.",
    ]
    reached = [f"- {verdict}" for workload in measured for verdict in verdicts(workload)]
    if reached:
        sections.append("## Targets\n\n" + "\n".join(reached))
    ratios = ratio_table(measured)
    if ratios:
        sections.append(
            "## Ratios\n\nTime as a multiple of the fastest method of nocdyn; below 1 is faster than nocdyn.\n\n" + ratios
        )
    sections += map(markdown, measured)
    (folder / "bench.md").write_text("\n\n".join(sections) + "\n", encoding="utf-8")
    content = {
        "machine": machine,
        "workloads": {workload.name: _content(workload) for workload in measured},
        "targets": [
            {"sentence": verdict.sentence, "reached": verdict.is_reached}
            for workload in measured
            for verdict in verdicts(workload)
        ],
    }
    (folder / "bench.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def describe_machine(build: Path) -> dict[str, str]:
    """Processor, compiler flags, and the versions of what took part."""
    return {
        "processor": f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        "compiler": _first_line(["gfortran", "--version"]),
        "flags": _cached(build, "CMAKE_Fortran_FLAGS") + _release_flags(build),
        "SUNDIALS": _sundials_version(build),
        "Python": platform.python_version(),
        **{name: _package_version(name) for name in PEERS},
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.processor())


def _first_line(command: list[str]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.partition("\n")[0]
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def _cached(build: Path, name: str) -> str:
    cache = build / "CMakeCache.txt"
    lines = cache.read_text(encoding="utf-8").splitlines() if cache.exists() else []
    return next((line.partition("=")[2] for line in lines if line.startswith(name + ":")), "")


def _release_flags(build: Path) -> str:
    """The flags that Ninja compiles the library with."""
    ninja = build / "build.ninja"
    if not ninja.exists():
        return "unknown"
    text = ninja.read_text(encoding="utf-8")
    place = text.find("build src/CMakeFiles/nocdyn.dir/integrate/driver/integration.f90.o:")
    return next((line.partition("=")[2].strip() for line in text[place:].splitlines() if line.startswith("  FLAGS =")), "unknown")


def _sundials_version(build: Path) -> str:
    header = Path(_cached(build, "SUNDIALS_INCLUDE_DIR")) / "sundials" / "sundials_config.h"
    if not header.exists():
        return "not there"
    lines = header.read_text(encoding="utf-8").splitlines()
    return next((line.split('"')[1] for line in lines if line.startswith("#define SUNDIALS_VERSION ")), "unknown")


def _package_version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not there"


def ratio_table(measured: list) -> str:
    """All in-process workloads side by side, '' if there is none."""
    columns = {}
    for workload in measured:
        if isinstance(workload, WorkPrecision):
            for kind, error in workload.columns:
                if kind == "states" or workload.moments_wanted:
                    columns[f"{workload.name}, {COLUMNS[kind]} {error:.0e}"] = {
                        contestant.label: workload.time_at(contestant, error, kind) for contestant in workload.contestants
                    }
        elif isinstance(workload, Scaling):
            for chain in workload.chains:
                columns[f"{workload.name}, N = {chain.bodies}"] = {
                    point.contestant.label: point.seconds for point in workload.points[chain]
                }
        elif isinstance(workload, Throughput):
            columns[f"{workload.name}, error {workload.family.wanted}"] = {
                rate.contestant.label: 1.0 / rate.best for rate in workload.rates if rate.contestant.has_peak
            }
    labels = list(dict.fromkeys(label for column in columns.values() for label in column))
    rows = [[label] for label in labels]
    for column in columns.values():
        own = min((seconds for label, seconds in column.items() if label.startswith("nocdyn") and seconds), default=None)
        for row in rows:
            seconds = column.get(row[0])
            row.append(f"{seconds / own:.3g}" if own and seconds else "-")
    return "\n".join(table(["", *columns], rows)) if columns else ""


def _milliseconds(seconds: float | None) -> str:
    return "-" if seconds is None else f"{1e3 * seconds:.3g}"


def _work_precision(workload: WorkPrecision) -> list[str]:
    head = [
        "time, ms",
        *(f"{COLUMNS[kind]} {error:.0e}" for kind, error in workload.columns),
        *(f"tol {tolerance:.0e} (error)" for tolerance in workload.tolerances_wanted),
    ]
    rows = []
    measured = [contestant for contestant in workload.contestants if workload.points_of(contestant)]
    for contestant in measured:
        row = [contestant.label, *(_milliseconds(workload.time_at(contestant, error, kind)) for kind, error in workload.columns)]
        for tolerance in workload.tolerances_wanted:
            point = workload.point_at(contestant, tolerance)
            row.append(f"{_milliseconds(point.seconds)} ({point.errors['states']:.0e})" if point else "-")
        rows.append(row)
    unit = "relative to its largest value" if workload.moments_wanted else "[N m]"
    return [
        *table(head, rows),
        "",
        f"Errors are the largest absolute ones, of all states [rad, rad/s] or of the elastic moment {unit}, over all outputs; "
        "times between two tolerances are interpolated, linear in the logarithms; - : not reached before the sweep "
        "ends, at the first run slower than 2 s (SciPy Radau: 8 s) or the tightest tolerance. rtol = atol.",
        "",
        f"Reference: {workload.reference.note}; they differ by {workload.reference.distance:.1e}.",
        "",
        *_notes(measured, workload.failures),
    ]


def _scaling(workload: Scaling) -> list[str]:
    rows = []
    for label in workload.labels:
        found = [workload.point(chain, label) for chain in workload.chains]
        rows.append(
            [
                label,
                *(_milliseconds(point.seconds) if point else "-" for point in found),
                *(f"{1e6 * point.seconds / chain.bodies:.3g}" if point else "-" for chain, point in zip(workload.chains, found)),
                *(f"{point.errors['states']:.0e}" if point else "-" for point in found),
                *(_count(point) for point in found),
            ]
        )
    lengths = [str(chain.bodies) for chain in workload.chains]
    head = [
        "N =",
        *(f"{text}, ms" for text in lengths),
        *(f"{text}, us/N" for text in lengths),
        *(f"{text}, error" for text in lengths),
        *(f"{text}, steps" for text in lengths),
    ]
    references = [f"{chain.bodies}: {reference.distance:.0e}" for chain, reference in workload.references.items()]
    contestants = {contestant.label: contestant for chain in workload.chains for contestant in workload.contestants[chain]}
    return [
        *table(head, rows),
        "",
        "Errors are the largest absolute ones of the states at the end [rad, rad/s].",
        "",
        f"Reference: {next(iter(workload.references.values())).note}; they differ by, at N = {', '.join(references)}.",
        "",
        *_notes(list(contestants.values()), workload.failures),
    ]


def _throughput(workload: Throughput) -> list[str]:
    *states, moment = workload.family.records
    rivals = [rate for label in ("hand-written loop", "heyoka with the peak") if (rate := workload.rate(label))]
    rows = []
    for rate in workload.rates:
        whole = workload.whole_rate(rate)
        rows.append(
            [
                rate.contestant.label,
                rounded(rate.best),
                *(f"{rate.best / rival.best:.3g}" for rival in rivals),
                rounded(whole) if whole else "-",
                f"{rate.tolerance:.1e}",
                f"{rate.errors.state:.0e}",
                f"{rate.errors.peak:.0e}" if rate.contestant.has_peak else "-",
                rounded(rate.variants),
            ]
        )
    head = [
        "",
        "variants per second",
        *(f"{rival.contestant.label} = 1" for rival in rivals),
        "whole process",
        "tolerance",
        "error of the state",
        "error of the peak",
        "variants",
    ]
    return [
        *table(head, rows),
        "",
        "Each contestant has the loosest tolerance, in tenths of a decade, with which its errors are below "
        f"{workload.family.wanted}: the largest absolute one of {states[0]} to {states[-1]} at the end [rad, rad/s], and the "
        f"largest relative one of the peak of {moment}, of the first {rounded(workload.sample)} variants, at most {SLOW_SAMPLE} "
        f"of those that integrate a part of the {rounded(workload.count)} variants. One thread where nothing else is said. "
        "Whole process: from its start until the files are written.",
        "",
        f"Reference: heyoka with 80-bit numbers at tolerance 1e-18; SciPy DOP853 at 1e-13 differs by "
        f"{workload.distance.state:.1e} and {workload.distance.peak:.1e}.",
        "",
        *_memory_lines(workload),
        *_notes([rate.contestant for rate in workload.rates], workload.failures),
    ]


def _memory_lines(workload: Throughput) -> list[str]:
    sizes = "; ".join(f"{rounded(count)} variants {megabytes:.0f} MB" for count, megabytes in workload.memory.items())
    return [f"Largest memory of the process: {sizes}.", ""] if sizes else []


def _rate(workload: Throughput, rate: Rate) -> dict:
    return {
        "contestant": rate.contestant.label,
        "variants_per_second": rate.best,
        "median_variants_per_second": rate.median,
        "rounds": len(rate.rounds),
        "variants": rate.variants,
        "tolerance": rate.tolerance,
        "whole_process_variants_per_second": workload.whole_rate(rate),
        "errors": {"state": rate.errors.state, "peak": rate.errors.peak if math.isfinite(rate.errors.peak) else None},
    }


def _count(point: Point | None) -> str:
    return "-" if point is None or point.steps is None else str(point.steps)


def _notes(contestants: list, failures: list[str]) -> list[str]:
    alike: dict[str, list[str]] = {}
    for contestant in contestants:
        alike.setdefault(contestant.note, []).append(contestant.label)
    return [*(f"- {'; '.join(labels)}: {note}" for note, labels in alike.items()), *(f"- {failure}" for failure in failures)]


def _whole_process(workload: Workload) -> list[str]:
    first = workload.contestants[0]
    lines = [
        f"| | median of {len(first.seconds)}, ms | fastest, ms | ratio | largest error |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for contestant in workload.contestants:
        error = _error(contestant.trajectory, workload.reference)
        lines.append(
            f"| {contestant.label} | {1e3 * contestant.median:.1f} | {1e3 * min(contestant.seconds):.1f} "
            f"| {contestant.median / first.median:.2f} | {'' if error is None else f'{error:.1e}'} |"
        )
    if workload.target:
        lines += ["", workload.target]
    return lines


def _error(trajectory: Path | None, reference: Path | None) -> float | None:
    return largest_error(trajectory, reference) if trajectory and reference else None


def _content(workload: Measured) -> dict | list:
    if isinstance(workload, WorkPrecision):
        return [_point(point) for point in workload.points]
    if isinstance(workload, Scaling):
        return [{"rotors": chain.bodies, **_point(point)} for chain in workload.chains for point in workload.points[chain]]
    if isinstance(workload, Costs):
        return workload.lines
    if isinstance(workload, Torsional):
        return {
            "largest_differences": {one.machine.name: one.largest for one in workload.agreements},
            "seconds": workload.seconds,
        }
    if isinstance(workload, Throughput):
        return {
            "variants": workload.count,
            "memory_MB": workload.memory,
            "rates": [_rate(workload, rate) for rate in workload.rates],
        }
    return {
        contestant.label: {"seconds": contestant.seconds, "largest_error": _error(contestant.trajectory, workload.reference)}
        for contestant in workload.contestants
    }


def _point(point: Point) -> dict:
    return {
        "contestant": point.contestant.label,
        "rtol": point.rtol,
        "atol": point.atol,
        "seconds": point.seconds,
        "median_seconds": point.median,
        "rounds": len(point.rounds),
        "steps": point.steps,
        "evaluations": point.evaluations,
        "errors": {kind: error if math.isfinite(error) else None for kind, error in point.errors.items()},
    }
