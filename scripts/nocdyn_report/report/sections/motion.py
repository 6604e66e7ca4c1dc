"""Runs over the time: peaks with their times, the load cases, curves."""

import re

from ...columns import DETAIL, LOADS, LOSS, MOMENT, SLIP, SPEED, TORQUE, TWIST, Column, by_sort
from ...results import TIME
from ...selection import widest
from ..content import (
    Block,
    Cell,
    Figure,
    Heading,
    Panel,
    Paragraph,
    Section,
    Table,
    by_columns,
    cut,
    first,
    number,
    panels_beside,
    text,
)
from ..naming import WHOLE, is_end, name_of
from ..numbers import number_text
from ..readable import texts
from ..sources import Run, Sources
from .measured import measured_blocks

CYLINDER = re.compile(r"_\d+(_\d+)?$")  # that a torque of an engine ends with
MOST_CURVES = 3  # of a panel of speeds or torques
MOST_PANELS = 6  # of loads, of one of several load cases
MOST_OF_ONE = 6  # likewise, of a single run
PANEL = 180  # width of a panel on paper [pixels]
MOST_ROWS = 60


def motion_section(sources: Sources) -> Section | None:
    if not sources.runs:
        return None
    section = Section("motion", "Load cases over the time" if sources.results.cases else "Motion over the time")
    if sources.results.cases:
        section.add(_cases(sources), *_peaks(sources))
    for run in sources.runs:
        if run.name:
            section.add(Heading(f"Load case {run.name}", anchor(run.name)))
        section.add(*_of_run(sources, run), *measured_blocks(sources, run.folder, "summary.json", _of(run)))
        section.add_details(*_extremes(sources, run, is_main=False))
    return section


def _of_run(sources: Sources, run: Run) -> list[Block]:
    settings, counts = run.summary["settings"], run.summary.get("counts", {})
    end = run.summary.get("time_reached", settings["t_end"])
    told = f"{number_text(settings['t_start'])} to {number_text(end)} s by {settings['method']}, "
    told += f"rtol {settings['rtol']:g}, atol {settings['atol']:g}; {counts.get('accepted_steps', 0)} steps."
    blocks: list[Block] = [Paragraph(f"{run.title}: {told}" if run.title else told)]
    if run.summary["status"] != "done":
        blocks.append(Paragraph(f"The run {run.summary['status']}: {run.summary.get('message', '')}", "bad"))
    if not run.name:
        blocks += _extremes(sources, run, is_main=True)
    if run.summary.get("joint_events"):
        blocks.append(_events(run))
    if run.file:
        blocks += _figures(sources, run)
    return blocks


def _cases(sources: Sources) -> Table:
    rows = []
    for case in sources.cases["load_cases"]:
        tone = "good" if case["status"] == "done" else "bad"
        link = f"#{anchor(case['name'])}"
        rows.append(
            [text(case["name"], "", link), text(case["title"]), number(float(case["repeats"]), 3), text(case["status"], tone)]
        )
    return Table("Load cases", ["name", "title", "repeats in the life", "run"], rows)


def _peaks(sources: Sources) -> list[Table]:
    """The largest magnitude of each load in each case: a table for each sort."""
    tables = []
    columns = {column.label: column for run in reversed(sources.runs) for column in run.column_list.values()}
    for sort in by_sort(one for one in columns.values() if _is_told(one) and not is_end(one) and one.rank in (*LOADS, SPEED)):
        chosen = [one for one in sort if any("max" in run.columns.get(one.label, {}) for run in sources.runs)]
        magnitudes = [[_magnitude(run, one) for one in chosen] for run in sources.runs]
        head, cells = sources.units.column("", sort[0].unit, [value for values in magnitudes for value in values])
        content = [("of", texts([name_of(one) for one in chosen]))]
        for i, run in enumerate(sources.runs):
            content.append((run.name, _marked(sources, run, chosen, cells[i * len(chosen) : (i + 1) * len(chosen)])))
        if chosen:
            unit = head.strip()
            tables.append(
                cut(by_columns(f"Largest magnitudes: {sort[0].caption} {unit}".rstrip(), content), MOST_ROWS, "cases.csv")
            )
    return tables


def _magnitude(run: Run, column: Column) -> float | None:
    found = run.columns.get(column.label, {})
    return max(abs(found["min"]), abs(found["max"])) if "max" in found else None


def _marked(sources: Sources, run: Run, columns: list[Column], cells: list[Cell]) -> list[Cell]:
    """In the case in which a load is largest, its number stands out."""
    marked = []
    for column, cell in zip(columns, cells):
        mine = _magnitude(run, column)
        is_largest = len(sources.runs) > 1 and mine and mine >= max(_magnitude(other, column) or 0.0 for other in sources.runs)
        marked.append(Cell(cell.text, cell.key, "", "most" if is_largest else "", True))
    return marked


def anchor(case: str) -> str:
    """The id of the part on a load case."""
    return "case-" + "-".join(case.split())


def _is_told(column: Column) -> bool:
    """Whether a table of peaks has it."""
    return column.rank < DETAIL and not column.is_inner


def _is_main(column: Column) -> bool:
    """Whether the section has it: loads and speeds; the rest is in the appendix."""
    return column.rank in (*LOADS, SPEED) and (column.rank != MOMENT or column.point in WHOLE)


def _extremes(sources: Sources, run: Run, is_main: bool) -> list[Table]:
    transient = run.summary.get("start_transient", {})
    starred = {*transient.get("has_min_of", []), *transient.get("has_max_of", [])}
    chosen = [
        one
        for label, one in run.column_list.items()
        if _is_told(one) and "max" in run.columns.get(label, {}) and (_is_main(one) and not run.name) == is_main
        if not run.name or one.rank in (*LOADS, TORQUE)
    ]
    tables = []
    for sort in by_sort(chosen):
        found = [run.columns[one.label] for one in sort]
        names = [name_of(one) + ("*" if one.label in starred else "") for one in sort]
        head, cells = sources.units.column("", sort[0].unit, [entry[key] for key in ("min", "max", "last") for entry in found])
        content = [("of", texts(names)), (f"smallest{head}", cells[: len(sort)])]
        content.append(("at t [s]", [number(entry["time_of_min"], 4) for entry in found]))
        content.append((f"largest{head}", cells[len(sort) : 2 * len(sort)]))
        content.append(("largest at t [s]", [number(entry["time_of_max"], 4) for entry in found]))
        content.append((f"last{head}", cells[2 * len(sort) :]))
        note = ""
        if any(one.label in starred for one in sort):
            note = f"* In the first fast transient of a start out of balance, up to {number_text(transient['until'], 4)} s."
        tables.append(cut(by_columns(f"Peaks{_of(run)}: {sort[0].caption}", content, note), MOST_ROWS, "summary.json"))
    if tables and "extremes_from" in run.summary:
        tables[-1].note = f"{tables[-1].note} Extremes are taken from {number_text(run.summary['extremes_from'])} s on.".strip()
    return tables


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
    """Panels: the loads that vary most, one each; then speeds and torques."""
    drawn = [one for one in run.drawn() if one.rank not in (LOSS, TWIST, SLIP)]
    most = MOST_PANELS - 2 if run.name else MOST_OF_ONE
    loads = [one for one in drawn if one.rank in LOADS and (one.rank != MOMENT or one.point in WHOLE)]
    moments = [one for one in loads if one.rank == MOMENT] or loads
    chosen = [[one] for one in _of_interest(sources, run, moments)[:most]]
    for rank in (TORQUE, SPEED):
        for sort in by_sort(one for one in drawn if one.rank == rank and one.unit != "W"):
            labels = widest([one.label for one in _of_each_engine(sources, run, sort)], run.ranges, MOST_CURVES)
            chosen.append(sorted((run.column_list[label] for label in labels), key=lambda one: -run.ranges.get(one.label, 0.0)))
    labels = [one.label for part in chosen for one in part]
    table = run.values([TIME, *labels]) if labels else ()
    if len(table) < 2:
        return []
    panels = [_panel(sources, run, table, part) for part in chosen]
    some = f": {most} of {len(moments)} moments, those with limits first" if len(moments) > most else ""
    has_bands = any("low" in curve for panel in panels for curve in panel.spec["curves"])
    bands = "; filled: between the smallest and the largest value" if has_bands else ""
    return [Figure(f"Motion{_of(run)} over the time{some}{bands}", panels, panels_beside(len(panels)))]


def _of_each_engine(sources: Sources, run: Run, columns: list[Column]) -> list[Column]:
    """Of the torques of the cylinders of an engine, which are alike, the one that varies most."""
    engines = {str(group.get("name", "")).lower() for group in sources.groups("engine")}
    chosen: dict[str, Column] = {}
    for one in sorted(columns, key=lambda one: -run.ranges.get(one.label, 0.0)):
        engine = CYLINDER.sub("", one.element.lower())
        chosen.setdefault(engine if engine in engines else one.label, one)
    return list(chosen.values())


def _of_interest(sources: Sources, run: Run, moments: list[Column]) -> list[Column]:
    """Those of elements with a limit or a fatigue strength, then those that vary most."""
    groups = [group for kind in ("limit", "fatigue") for group in sources.groups(kind)]
    judged = {str(group[kind]).lower() for group in groups for kind in ("coupling", "shaft", "mesh", "gear") if kind in group}
    return sorted(moments, key=lambda one: (one.element.lower() not in judged, -run.ranges.get(one.label, 0.0)))


def _panel(sources: Sources, run: Run, table: object, columns: list[Column]) -> Panel:
    time, one = table[TIME].to_numpy(), columns[0]
    largest = max(_magnitude(run, column) or 0.0 for column in columns)
    factor, unit = sources.units.shown(one.unit, largest)
    is_one = len(columns) == 1
    curves = []
    for column in columns:
        style = {"role": "load"} if is_one and column.rank in LOADS else {}
        name = "load" if style else f"{one.caption}: {column.title}"
        curve = sources.arrays.curve(name, time, factor * table[column.label].to_numpy(), pixels=PANEL, **style)
        if "low" not in curve or not any("low" in other for other in curves):  # envelopes would cover one another
            curves.append(curve)
    spec = {"x": {"label": "time", "unit": "s"}, "y": {"label": "", "unit": unit}, "curves": curves, "name": one.kind}
    told = "; ".join(_range(column, run.columns[column.label]) for column in columns if column.label in run.ranges)
    title = f"{name_of(one)}: {one.caption}" if is_one and one.element else one.caption
    return Panel(title, f"Curves over the time{_of(run)}: {told}.", spec)


def _range(column: Column, found: dict) -> str:
    return f"{column.name} from {number_text(found['min'])} to {number_text(found['max'])} {column.unit}"
