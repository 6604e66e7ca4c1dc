"""The energy account of runs."""

from ..content import Heading, Section, Table, first, number, rounded, text
from ..numbers import number_text
from ..sources import Run, Sources
from .motion import anchor

MOST_ROWS = 120


def energy_section(sources: Sources) -> Section | None:
    runs = [run for run in sources.runs if "energy_account" in run.summary]
    if not runs:
        return None
    section = Section("energy", "Energy account")
    for run in runs:
        if run.name:
            section.add(Heading(f"Load case {run.name}", f"energy-{anchor(run.name)}"))
        section.add(_work(run), _stored(run))
    return section


def _which(run: Run) -> str:
    return f" of load case {run.name}" if run.name else ""


def _work(run: Run) -> Table:
    account = run.summary["energy_account"]
    work = rounded(account["work_in_J"], dict.fromkeys(account["work_in_J"], "J"))
    rows = [[text(name), number(amount)] for name, amount in sorted(work.items(), key=lambda item: -item[1])]
    rows, more = first(rows, MOST_ROWS, "summary.json")
    note = (
        f"The balance error is {number_text(account['residual_J'])} J. Negative work was taken out of the machine. {more}".strip()
    )
    return Table(f"Work into the machine{_which(run)}", ["element", "work [J]"], rows, note)


def _stored(run: Run) -> Table:
    account = run.summary["energy_account"]
    rows = [[text(name), number(start), number(end)] for name, (start, end) in account["stored_J"].items()]
    rows, more = first(rows, MOST_ROWS, "summary.json")
    rows.insert(0, [text("all bodies, kinetic energy"), *map(number, account["kinetic_J"])])
    return Table(f"Stored energy{_which(run)}", ["where", "at the start [J]", "at the end [J]"], rows, more)
