"""The commands of the program."""

import json
import os
import re
import subprocess
import tempfile
from pathlib import Path

from nocdyn import _find
from nocdyn._errors import raise_error
from nocdyn._input import as_input
from nocdyn._results import Result, SweepResult

_FILES = {  # the report of each command, and its tables
    "run": ("summary.json", ("trajectory", "cycles")),
    "equilibrium": ("equilibrium.json", ()),
    "modes": ("modes.json", ("modes", "holzer")),
    "campbell": ("campbell.json", ("campbell",)),
    "response": ("response.json", ("response", "response_orders")),
    "orbit": ("orbit.json", ("orbit",)),
    "transit": ("transit.json", ("transit",)),
}
_DONE = re.compile(rb"(\d+) of (\d+) variants")


def run(given, set=None, case=None, out=None):  # noqa: A002, the word of the command line
    """Integrates a machine: a Result, or, of all load cases of an input, a dictionary of them by name.

    `given` is a path, the text of an input or an `Input`; `set` has settings, {'run.t_end': 2}; `case` is a load case; the files
    stay in `out`, if that is given. The other commands take the same.
    """
    return _compute("run", given, set, case, out, ("--set", "output.format=csv"))


def equilibrium(given, set=None, case=None, out=None):  # noqa: A002
    """The steady states: a row of the table for each."""
    return _compute("equilibrium", given, set, case, out)


def modes(given, set=None, case=None, out=None):  # noqa: A002
    """Natural frequencies, damping and shapes."""
    return _compute("modes", given, set, case, out)


def campbell(given, set=None, case=None, out=None):  # noqa: A002
    """Natural frequencies over the speed."""
    return _compute("campbell", given, set, case, out)


def response(given, set=None, case=None, out=None):  # noqa: A002
    """The forced response over the speed; the table `response_orders` has its orders."""
    return _compute("response", given, set, case, out)


def orbit(given, set=None, case=None, out=None):  # noqa: A002
    """Periodic motions of a nonlinear machine; the table has a row for each."""
    return _compute("orbit", given, set, case, out)


def transit(given, set=None, case=None, out=None):  # noqa: A002
    """Passages of barred ranges of speed."""
    return _compute("transit", given, set, case, out)


def sweep(given, set=None, case=None, out=None, threads=None, progress=True):  # noqa: A002
    """A sweep: a Result whose `dataset` is that of sweep.nc. A bar shows the progress if there is tqdm and it takes time."""
    options = ("--threads", str(threads)) if threads else ()
    return _compute("sweep", given, set, case, out, options, progress)


def _compute(command, given, settings, case, out, options=(), progress=False):
    source = as_input(given, settings)
    words = [word for text in source.overrides() for word in ("--set", text)]
    if case:
        words += ["--case", case]
    with tempfile.TemporaryDirectory(prefix="nocdyn_") as scratch, source.file() as (folder, file):
        results = Path(out).resolve() if out else Path(scratch) / "results"
        _execute([_find.program(), command, file, "--out", str(results), *words, *options], folder, progress)
        return _results(command, results, case)


def _results(command, folder, case):
    """The result of a folder, or those of the load cases in it."""
    if command == "sweep":
        found = next(folder.rglob("sweep.nc")).parent
        return SweepResult(found, "summary.json")
    report, tables = _FILES[command]
    if (folder / report).exists():
        return Result(folder, report, tables)
    cases = {name: Result(folder / name, report, tables) for name in _case_names(command, folder, report)}
    return cases[case] if case else cases


def _case_names(command, folder, report):
    """Of the load cases that have results, in the order of the input where there is a report on all of them."""
    names = sorted(path.parent.name for path in folder.glob(f"*/{report}"))
    index = folder / ("cases.json" if command == "run" else f"{command}_cases.json")
    if not index.exists():
        return names
    listed = [one["folder"] for one in json.loads(index.read_text(encoding="utf-8"))["load_cases"]]
    return sorted(names, key=lambda name: listed.index(name) if name in listed else len(listed))


def _execute(words, folder, progress):
    """Runs the program; exceptions have its messages."""
    process = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        written = _follow(process, progress)
    except BaseException:
        process.terminate()
        process.wait()
        raise
    if process.wait():
        raise_error(process.returncode, _messages(written))


def _follow(process, progress):
    """What the program writes until its end, with a bar for the variants that are done."""
    bar, written = None, b""
    try:
        while piece := os.read(process.stderr.fileno(), 65536):
            written += piece
            done = _DONE.findall(piece) if progress else ()
            if not done:
                continue
            if bar is None:
                bar = _new_bar(int(done[-1][1]))
            if bar is not None:
                bar.update(int(done[-1][0]) - bar.n)
        if bar is not None:
            bar.update(bar.total - bar.n)
    finally:
        process.stderr.close()
        if bar is not None:
            bar.close()
    return written


def _new_bar(total):
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm(total=total, unit="variant")


def _messages(written):
    """The lines of errors, without the name of the program and without progress."""
    lines = written.decode(errors="replace").splitlines()
    return "\n".join(line.removeprefix("nocdyn: ").removeprefix("nocdyn-sweep: ") for line in lines if " variants, " not in line)
