"""What a run of each shipped example costs, and which part of it takes how much."""

import os
import re
import shutil
import subprocess
from pathlib import Path

from .tables import table

# procedures whose instructions, with those of all they call, are the parts of a run; one procedure each, found by its name
STEPS = "nocdyn_integration_MOD_integrate"
PARTS = {
    "rows": "nocdyn_after_step_MOD_output_until",
    "extremes by samples": "nocdyn_extremes_MOD_update_extremes",
    "extremes by polynomials": "nocdyn_statistics_observer_MOD_on_steps",
}
SEARCH = "nocdyn_missed_states_MOD_note_missed_state"
LINE = re.compile(r"^\s*([\d,]+) \([ \d.]+%\)\s+\S*?:__(\w+_MOD_\w+?)(?:\.\w+)* \[")
TOTAL = re.compile(r"^\s*([\d,]+) \([ \d.]+%\)\s+PROGRAM TOTALS", re.MULTILINE)


def example_runs(program: Path, plain: Path, scratch: Path, files: list[Path], rounds: int) -> list[str]:
    """Lines of the table; `plain`: the program for a processor whose instructions valgrind knows."""
    seconds: dict[Path, list[float]] = {file: [] for file in files}
    for _ in range(rounds):
        for file in files:
            seconds[file].append(_processor_seconds([program, *_words(file, scratch)], scratch))
    rows = []
    for file in files:
        shares = _shares(plain, file, scratch)
        rows.append([f"`{file.stem}`", f"{1e3 * min(seconds[file]):.1f}", *(f"{share:.0%}" for share in shares.values())])
    head = ["input", "ms", *shares]
    return [
        *table(head, rows),
        "",
        "Processor time of the whole process with its files, the least of all rounds, in turns. Shares are those of the "
        "instructions, counted by valgrind in a program for AVX2: the steps of the method, the rows and their text, extremes of "
        "columns that are sampled and of those that are polynomials of the step, the search of steady states after the run; the "
        "rest is reading, assembly and the summary.",
    ]


def _words(file: Path, scratch: Path) -> list[str | Path]:
    return ["run", file, "--quiet", "--out", scratch / "example"]


def _processor_seconds(command: list, scratch: Path) -> float:
    """Of the process and what it starts."""
    shutil.rmtree(scratch / "example", ignore_errors=True)
    process = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    return usage.ru_utime + usage.ru_stime


def _shares(plain: Path, file: Path, scratch: Path) -> dict[str, float]:
    """Of the instructions of a run, by the names of the parts; they add up to 1."""
    shutil.rmtree(scratch / "example", ignore_errors=True)
    counts = scratch / "callgrind.out"
    quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    counter = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}", plain]
    subprocess.run(list(map(str, [*counter, *_words(file, scratch)])), check=True, **quiet)
    annotate = ["callgrind_annotate", "--inclusive=yes", "--threshold=100", str(counts)]
    text = subprocess.run(annotate, check=True, capture_output=True, text=True).stdout
    return shares_of(text)


def shares_of(text: str) -> dict[str, float]:
    """From the table that callgrind_annotate prints with inclusive counts."""
    counts = {}
    for line in text.splitlines():
        if found := LINE.match(line):
            counts.setdefault(found[2], _number(found[1]))
    total = _number(TOTAL.search(text)[1])
    parts = {name: counts.get(procedure, 0) / total for name, procedure in PARTS.items()}
    steps = counts.get(STEPS, 0) / total
    search = counts.get(SEARCH, 0) / total
    return {"steps": steps - sum(parts.values()), **parts, "steady states": search, "rest": 1.0 - steps - search}


def _number(text: str) -> int:
    return int(text.replace(",", ""))
