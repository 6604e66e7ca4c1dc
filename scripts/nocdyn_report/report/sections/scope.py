"""What was calculated, by which program, of which input; and why what is missing is missing."""

from ..content import Cell, Section, Table, text
from ..numbers import number_text
from ..sources import Sources

TITLES = {
    "equilibrium": ("Steady state", "steady", "equilibrium.json"),
    "modes": ("Natural frequencies and modes", "modes", "modes.json, modes.csv"),
    "holzer": ("Holzer tables", "holzer", "holzer.csv"),
    "campbell": ("Campbell diagram", "campbell", "campbell.json, campbell.csv"),
    "response": ("Forced response", "response", "response.json, response.csv, response_orders.csv"),
    "transit": ("Passage of barred ranges", "transit", "transit.json, transit.csv"),
    "orbit": ("Periodic motions", "orbit", "orbit.json, orbit.csv"),
    "run": ("Motion over the time", "motion", "trajectory.csv, summary.json"),
}


def scope_section(sources: Sources, sections: list[Section]) -> Section:
    section = Section("scope", "Scope", is_appendix=True)
    there = {one.id for one in sections}
    rows: list[list[Cell]] = []
    for command, (title, target, files) in TITLES.items():
        if command not in sources.results.of:  # periodic motions, which few inputs ask for
            continue
        calculation = sources.results.of[command]
        link = f"#{target}" if target in there or (command == "holzer" and "modes" in there) else ""
        if reason := sources.missing(command):
            rows.append([text(title), text("nothing to show", "warn"), text(reason)])
        elif calculation.is_there:
            rows.append([text(title, "", link), text("calculated", "good"), text(files)])
        else:
            words = {"left out": "left out", "refused": "not available", "failed": "no result"}[calculation.state]
            rows.append([text(title, "", link), text(words, "warn"), text(calculation.message)])
    rows += _without_command(sources, there)
    section.add(_identity(sources))
    section.add(Table("Calculations", ["calculation", "state", "results, or why there are none"], rows, is_sorted=False))
    return section


def _identity(sources: Sources) -> Table:
    check = sources.check
    rows = [
        [text("program"), text(f"{check['program']} {check['version']}, compiled by {check['compiler']}")],
        [text("input"), text(check["input"], "", "#input")],
        [text("bodies"), text(len(check["bodies"]))],
        [text("degrees of freedom"), text(check["degrees_of_freedom"])],
        [text("independent coordinates"), text(_listed(check["independent"]))],
    ]
    return Table("Program and input", ["what", "value"], rows, is_sorted=False)


def _listed(names: list[str], most: int = 24) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def _without_command(sources: Sources, there: set[str]) -> list[list[Cell]]:
    """Sections that are parts of a calculation."""
    cases = len(sources.results.cases)
    energy = "energy" in there
    rows = [
        [
            text("Load cases", "", "#motion" if cases and "motion" in there else ""),
            text("calculated", "good") if cases and "motion" in there else text("left out", "warn"),
            text(f"{number_text(cases)} load cases: cases.json, cases.csv" if cases else "the input has no &load_case"),
        ],
        [
            text("Energy account", "", "#energy" if energy else ""),
            text("calculated", "good") if energy else text("left out", "warn"),
            text("summary.json" if energy else "there is no run"),
        ],
    ]
    fatigue = "fatigue" in there
    reason = (
        "summary.json, cycles.csv" if fatigue else "there is no run" if sources.groups("fatigue") else "the input has no &fatigue"
    )
    state = text("calculated", "good") if fatigue else text("left out", "warn")
    rows.append([text("Fatigue", "", "#fatigue" if fatigue else ""), state, text(reason)])
    if sources.groups("vary"):
        rows.append(
            [text("Sweep"), text("left out", "warn"), text("the variants of &sweep are no part of a report: nocdyn sweep")]
        )
    return rows
