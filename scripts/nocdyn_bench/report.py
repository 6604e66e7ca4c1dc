"""What was measured, for people (Markdown) and for programs (JSON)."""

import json
import os
import platform
from pathlib import Path

from .measure import Workload, largest_error


def markdown(workload: Workload) -> str:
    first = workload.contestants[0]
    lines = [
        f"## {workload.title}",
        "",
        f"| | median of {len(first.seconds)}, ms | fastest, ms | ratio | largest error |",
        "| --- | ---: | ---: | ---: | ---: |",
    ]
    for contestant in workload.contestants:
        error = _error(contestant.trajectory, workload.reference)
        lines.append(f"| {contestant.label} | {1e3 * contestant.median:.1f} | {1e3 * min(contestant.seconds):.1f} "
                     f"| {contestant.median / first.median:.2f} | {'' if error is None else f'{error:.1e}'} |")
    if workload.target:
        lines += ["", workload.target]
    return "\n".join(lines)


def write_report(workloads: list[Workload], folder: Path) -> None:
    """Leaves bench.md and bench.json in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    machine = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    text = "\n\n".join(["# Benchmarks", f"Measured on: {machine}. Ratios travel to other machines, milliseconds do not.",
                        *map(markdown, workloads)])
    (folder / "bench.md").write_text(text + "\n", encoding="utf-8")
    content = {"machine": machine, "workloads": {workload.name: _content(workload) for workload in workloads}}
    (folder / "bench.json").write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def _content(workload: Workload) -> dict:
    return {
        contestant.label: {"seconds": contestant.seconds, "largest_error": _error(contestant.trajectory, workload.reference)}
        for contestant in workload.contestants
    }


def _error(trajectory: Path | None, reference: Path | None) -> float | None:
    return largest_error(trajectory, reference) if trajectory and reference else None
