"""Runs over the time: peaks with their times, the load cases, curves."""

from ...columns import DETAIL, LOSS, TWIST, Column, by_sort
from ...results import TIME
from ...selection import widest
from ..content import Cell, Figure, Heading, Paragraph, Section, Table, first, number, rounded, share, text
from ..numbers import number_text, unit_text
from ..sources import Run, Sources
from .response import ratio_tone

NO_FIGURE = (LOSS, TWIST)  # only their extremes are told
MOST_CURVES = 10  # of a figure
SHOWN_CURVES = 5  # at first
MOST_ROWS = 120


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
    columns = {column.name: column for run in sources.runs for column in run.column_list.values()}
    peaks = [peak for peak in sources.cases["peaks"] if _is_shown(columns[peak["column"]])]
    for peak in sorted(peaks, key=lambda one: columns[one["column"]].rank):
        values = [text(peak["column"]), number(peak["largest"]), text(unit_text(peak["unit"])), number(peak["time"])]
        rows.append([*values, text(peak["load_case"], "", f"#{anchor(peak['load_case'])}")])
    rows, more = first(rows, MOST_ROWS, "cases.csv")
    columns = ["quantity", "value of largest magnitude", "unit", "at t [s]", "load case"]
    return Table("Peaks of all load cases", columns, rows, more)


def anchor(case: str) -> str:
    """The id of the part on a load case."""
    return "case-" + "-".join(case.split())


def _is_shown(column: Column) -> bool:
    """Whether a table of peaks has it."""
    return column.rank < DETAIL and not column.is_inner


def _limits(run: Run) -> Table:
    rows = []
    for one in run.summary["limits"]:
        words, tone = ratio_tone(one["ratio"])
        rows.append([text(one["column"]), number(one["limit"]), number(one["largest"]), share(one["ratio"]), text(words, tone)])
    return Table("Limits over the time", ["quantity", "limit", "largest", "share of the limit [%]", "assessment"], rows)


def _extremes(run: Run) -> Table:
    transient = run.summary.get("start_transient", {})
    starred = {*transient.get("has_min_of", []), *transient.get("has_max_of", [])}
    rows: list[list[Cell]] = []
    shown_labels: list[str] = []
    for label, signal in run.column_list.items():
        column = run.columns.get(label, {})
        name, unit = signal.name, signal.unit
        if "min" not in column or not _is_shown(signal):
            continue
        star = "*" if label in starred else ""
        shown_labels.append(label)
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
    shown_labels = shown_labels[: len(rows)]
    notes = [f"The extremes are those {run.summary.get('extremes', 'of the motion')}."]
    if "extremes_from" in run.summary:
        notes.append(f"They are taken from {number_text(run.summary['extremes_from'])} s on.")
    notes.append("Angles, parts of moments, energies and inner nodes of shafts are in summary.json.")
    if any(label in starred for label in shown_labels):
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
    """A figure for each sort of columns, with those that vary most."""
    sorts = by_sort(column for column in run.drawn() if column.rank not in NO_FIGURE)
    chosen = [widest([column.label for column in columns], run.ranges, MOST_CURVES) for columns in sorts]
    needed = [label for labels in chosen for label in labels]
    if not needed:
        return []
    table = run.values([TIME, *needed])
    if len(table) < 2:
        return []
    return [_figure(sources, run, table, labels, len(all_of)) for labels, all_of in zip(chosen, sorts)]


def _figure(sources: Sources, run: Run, table: object, labels: list[str], count: int) -> Figure:
    columns = [run.column_list[label] for label in labels]
    time, one = table[TIME].to_numpy(), columns[0]
    shown = widest(labels, run.ranges, SHOWN_CURVES)
    curves = [
        sources.arrays.curve(column.title, time, table[column.label].to_numpy(), shown=column.label in shown)
        for column in columns
    ]
    spec = {
        "x": {"label": "time", "unit": "s"},
        "y": {"label": one.caption, "unit": one.unit},
        "curves": curves,
        "name": one.kind,
    }
    some = f", the {len(columns)} of {count} that vary most" if len(columns) < count else ""
    told = "; ".join(_range(column, run.columns[column.label]) for column in columns if column.label in run.ranges)
    caption = one.caption[0].upper() + one.caption[1:]
    return Figure(f"{caption}{_of(run)} over the time{some}", f"Curves over the time: {told}.", spec)


def _range(column: Column, found: dict) -> str:
    return f"{column.name} from {number_text(found['min'])} to {number_text(found['max'])} {column.unit}"
