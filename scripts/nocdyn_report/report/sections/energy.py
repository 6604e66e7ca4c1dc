"""The energy account of runs."""

from ..content import Heading, Section, Table, by_columns, cut
from ..numbers import number_text
from ..readable import texts
from ..sources import Run, Sources

MOST_ROWS = 60


def energy_section(sources: Sources) -> Section | None:
    runs = [run for run in sources.runs if "energy_account" in run.summary]
    if not runs:
        return None
    section = Section("energy", "Energy account")
    return section.add_details(
        Heading("Energy account", "energy"), *(_work(sources, run) for run in runs[:1]), _stored(sources, runs[0])
    )


def _which(run: Run) -> str:
    return f" of load case {run.name}" if run.name else ""


def _work(sources: Sources, run: Run) -> Table:
    account = run.summary["energy_account"]
    work = sorted(account["work_in_J"].items(), key=lambda item: -item[1])
    columns = [("element", texts([name for name, _ in work])), sources.units.column("work", "J", [amount for _, amount in work])]
    largest = max((abs(amount) for _, amount in work), default=0.0)
    residual = abs(account["residual_J"])
    note = f"The balance error is {sources.units.amount(residual, 'J', 3)}"
    note += f", {number_text(residual / largest, 1)} of the largest work. Negative work was taken out." if largest else "."
    return cut(by_columns(f"Work into the machine{_which(run)}", columns, note), MOST_ROWS, "summary.json")


def _stored(sources: Sources, run: Run) -> Table:
    account = run.summary["energy_account"]
    stored = {"all bodies, kinetic energy": account["kinetic_J"], **account["stored_J"]}
    both = [value for values in stored.values() for value in values]
    head, cells = sources.units.column("", "J", both)
    columns = [("where", texts(stored)), (f"at the start{head}", cells[::2]), (f"at the end{head}", cells[1::2])]
    return cut(by_columns(f"Stored energy{_which(run)}", columns), MOST_ROWS, "summary.json")
