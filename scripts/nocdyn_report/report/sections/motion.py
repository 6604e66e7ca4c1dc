"""Runs over the time: peaks with their times, the load cases, curves."""

import re

from ..content import Cell, Figure, Heading, Paragraph, Section, Table, first, number, rounded, share, text
from ..numbers import name_and_unit, number_text, unit_text
from ..sources import Run, Sources
from .response import ratio_tone

TIME = "t [s]"
FIGURES = {  # quantities that get a figure of their own, in this order, with what the axis says
    "omega": "speed",
    "shaft": "moment of the shaft, elastic and damping",
    "moment": "elastic moment",
    "reaction": "reaction",
    "force": "force",
    "stress": "stress",
    "torque": "torque",
    "slip": "slip",
    "current": "current",
}
RANKS = [
    "shaft",
    "moment",
    "reaction",
    "force",
    "stress",
    "torque",
    "loss",
    "bearing",
    "omega",
    "slip",
    "twist",
    "deformation",
    "damping",
]
MOST_CURVES = 10  # of a figure
SHOWN_CURVES = 5  # at first
MOST_ROWS = 200
INNER = re.compile(r"\[\d+\]$")  # of the names of inner nodes of shafts
WHOLE = "_max"  # of the largest moment along a shaft
LEFT_OUT = re.compile(r"(phi|damping|work)_|.*_energy$|energy_residual$")  # of the tables of peaks


def motion_section(sources: Sources) -> Section | None:
    if not sources.runs:
        return None
    section = Section("motion", "Load cases" if sources.results.cases else "Motion over the time")
    if sources.results.cases:
        section.add(_cases(sources), _peaks(sources))
    for run in sources.runs:
        if run.name:
            section.add(Heading(f"Load case {run.name}", anchor(run.name)))
        if run.summary["status"] != "done":
            message = run.summary.get("message", "")
            section.add(Paragraph(f"The run {run.summary['status']}: {message}", "bad"))
        section.add(*_of_run(sources, run))
    return section


def _of_run(sources: Sources, run: Run) -> list[Paragraph | Table | Figure]:
    settings, counts = run.summary["settings"], run.summary.get("counts", {})
    end = run.summary.get("time_reached", settings["t_end"])
    told = f"From {number_text(settings['t_start'])} to {number_text(end)} s by the method {settings['method']}, "
    told += f"rtol = {settings['rtol']:g}, atol = {settings['atol']:g}; {counts.get('accepted_steps', 0)} steps."
    blocks: list[Paragraph | Table | Figure] = [Paragraph(told)]
    if run.summary.get("limits"):
        blocks.append(_limits(run))
    blocks.append(_extremes(run))
    if run.summary.get("joint_events"):
        blocks.append(_events(run))
    if run.file:
        blocks += _figures(sources, run)
    return blocks


def _cases(sources: Sources) -> Table:
    rows = []
    for case in sources.cases["load_cases"]:
        tone = "good" if case["status"] == "done" else "bad"
        rows.append(
            [
                text(case["name"], "", f"#{anchor(case['name'])}"),
                text(case["title"]),
                number(case["repeats"]),
                text(case["status"], tone),
            ]
        )
    return Table("Load cases", ["name", "title", "repeats in the life", "run"], rows)


def _peaks(sources: Sources) -> Table:
    rows = []
    peaks = [peak for peak in sources.cases["peaks"] if not INNER.search(peak["column"]) and not LEFT_OUT.match(peak["column"])]
    for peak in sorted(peaks, key=lambda one: rank(one["column"])):
        values = [text(peak["column"]), number(peak["largest"]), text(unit_text(peak["unit"])), number(peak["time"])]
        rows.append([*values, text(peak["load_case"], "", f"#{anchor(peak['load_case'])}")])
    rows, more = first(rows, MOST_ROWS, "cases.csv")
    columns = ["quantity", "value of largest magnitude", "unit", "at t [s]", "load case"]
    return Table("Peaks of all load cases", columns, rows, more)


def anchor(case: str) -> str:
    """The id of the part on a load case."""
    return "case-" + "-".join(case.split())


def rank(name: str) -> int:
    """What one looks for first comes first."""
    kind = name.split("_", 1)[0]
    return RANKS.index(kind) if kind in RANKS else len(RANKS)


def _limits(run: Run) -> Table:
    rows = []
    for one in run.summary["limits"]:
        words, tone = ratio_tone(one["ratio"])
        rows.append([text(one["column"]), number(one["limit"]), number(one["largest"]), share(one["ratio"]), text(words, tone)])
    return Table("Limits over the time", ["quantity", "limit", "largest", "share of the limit [%]", "assessment"], rows)


def _extremes(run: Run) -> Table:
    transient = run.summary.get("start_transient", {})
    rows: list[list[Cell]] = []
    for label in sorted(run.columns, key=rank):
        column = run.columns[label]
        name, unit = name_and_unit(label)
        if "min" not in column or INNER.search(name) or LEFT_OUT.match(name):
            continue
        star = "*" if label in [*transient.get("has_min_of", []), *transient.get("has_max_of", [])] else ""
        shown = rounded({key: column[key] for key in ("min", "max", "last")}, dict.fromkeys(("min", "max", "last"), unit))
        row = [
            text(name + star),
            text(unit_text(unit)),
            number(shown["min"]),
            number(column["time_of_min"]),
            number(shown["max"]),
        ]
        rows.append([*row, number(column["time_of_max"]), number(shown["last"])])
    rows, more = first(rows, MOST_ROWS, "summary.json")
    notes = [f"The extremes are those {run.summary.get('extremes', 'of the motion')}."]
    if "extremes_from" in run.summary:
        notes.append(f"They are taken from {number_text(run.summary['extremes_from'])} s on.")
    notes.append("Angles, damping moments, energies and inner nodes of shafts are in summary.json.")
    if transient:
        notes.append(f"* In the first fast transient of a start out of balance, up to {number_text(transient['until'])} s.")
    columns = ["quantity", "unit", "smallest", "at t [s]", "largest", "largest at t [s]", "last"]
    return Table(f"Peaks{_of(run)} and their times", columns, rows, " ".join([*notes, more]).strip())


def _of(run: Run) -> str:
    return f" of load case {run.name}" if run.name else ""


def _events(run: Run) -> Table:
    rows = []
    for one in run.summary["joint_events"]:
        values = number(one["slip_rad_s"]), number(one["torque_N_m"]), number(one.get("impulse_N_m_s"))
        rows.append([number(one["time"]), text(one["joint"]), text(one["from"]), text(one["to"]), *values])
    rows, more = first(rows, MOST_ROWS, "summary.json")
    columns = ["t [s]", "joint", "from", "to", "slip before [rad/s]", "torque after [N m]", "impulse [N m s]"]
    return Table("Events of clutches, freewheels and friction", columns, rows, more)


def _figures(sources: Sources, run: Run) -> list[Figure]:
    chosen: dict[tuple[str, str], list[str]] = {}
    labels = run.labels()
    shafts = {name_and_unit(label)[0].split("_", 1)[-1] for label in labels if label.startswith("shaft_")}
    for label in labels:
        name, unit = name_and_unit(label)
        kind, _, element = name.partition("_")
        is_told = (kind == "moment" and (element in shafts or element.endswith(WHOLE))) or INNER.search(name)
        if kind in FIGURES and not is_told:
            chosen.setdefault((kind, unit), []).append(label)
    ranges = {label: column["max"] - column["min"] for label, column in run.columns.items() if "max" in column}
    counts = {key: len(members) for key, members in chosen.items()}
    for key, members in chosen.items():
        kept = set(sorted(members, key=lambda label: -ranges.get(label, 0.0))[:MOST_CURVES])
        chosen[key] = [label for label in members if label in kept]
    keys = sorted(chosen, key=lambda key: list(FIGURES).index(key[0]))
    needed = list(dict.fromkeys(label for key in keys for label in chosen[key]))
    if not needed:
        return []
    table = run.values([TIME, *needed])
    if len(table) < 2:
        return []
    return [_figure(sources, run, table, key, chosen[key], counts[key], ranges) for key in keys]


def _figure(
    sources: Sources, run: Run, table: object, key: tuple, labels: list[str], count: int, ranges: dict[str, float]
) -> Figure:
    kind, unit = key
    time = table[TIME].to_numpy()
    shown = set(sorted(labels, key=lambda label: -ranges.get(label, 0.0))[:SHOWN_CURVES])
    curves = []
    for label in labels:
        name = name_and_unit(label)[0].split("_", 1)[-1]
        curves.append(sources.arrays.curve(name, time, table[label].to_numpy(), shown=label in shown))
    spec = {
        "x": {"label": "time", "unit": "s"},
        "y": {"label": FIGURES[kind], "unit": unit},
        "curves": curves,
        "name": kind,
    }
    some = f", the {len(labels)} of {count} that vary most" if len(labels) < count else ""
    told = "; ".join(_range(label, run.columns[label], unit) for label in labels if "max" in run.columns.get(label, {}))
    return Figure(f"{FIGURES[kind].capitalize()}{_of(run)} over the time{some}", f"Curves over the time: {told}.", spec)


def _range(label: str, column: dict, unit: str) -> str:
    return f"{name_and_unit(label)[0]} from {number_text(column['min'])} to {number_text(column['max'])} {unit}"
