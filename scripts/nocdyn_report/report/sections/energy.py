"""The energy account of runs."""

from ..content import Heading, Section, Table, first, number, text
from ..numbers import number_text
from ..sources import Run, Sources

MOST_ROWS = 120


def energy_section(sources: Sources) -> Section | None:
    runs = [run for run in sources.runs if "energy_account" in run.summary]
    if not runs:
        return None
    section = Section("energy", "Energy account")
    for run in runs:
        if run.name:
            section.add(Heading(f"Load case {run.name}", f"energy-{run.name}"))
        section.add(_account(run))
    return section


def _account(run: Run) -> Table:
    account = run.summary["energy_account"]
    rows = [[text(name), text("work into the machine"), number(work)] for name, work in account["work_in_J"].items()]
    rows.append([text("all bodies"), text("kinetic energy at the start"), number(account["kinetic_J"][0])])
    rows.append([text("all bodies"), text("kinetic energy at the end"), number(account["kinetic_J"][1])])
    for name, (start, end) in account["stored_J"].items():
        rows.append([text(name), text("stored at the start"), number(start)])
        rows.append([text(name), text("stored at the end"), number(end)])
    rows, more = first(rows, MOST_ROWS, "summary.json")
    note = f"The balance error is {number_text(account['residual_J'])} J. Negative work was taken out of the machine. {more}".strip()
    which = f" of load case {run.name}" if run.name else ""
    return Table(f"Energy account{which}", ["element", "energy", "amount [J]"], rows, note)
