"""The forced response with its limits and barred ranges."""

from collections.abc import Sequence

import numpy as np

from ...columns import LOADS, MOMENT, Column
from ...speed_results import NEAR, Quantity, Response, barred_in
from ..content import Figure, Heading, Panel, Paragraph, Section, Table, by_columns, cut, number, panels_beside, share, text
from ..curves import band
from ..naming import WHOLE, name_of
from ..numbers import number_text
from ..readable import texts
from ..sources import Sources
from .campbell import operation_bands
from .measured import measured_blocks

MOST_PANELS = 24
MOST_ROWS = 60
BIG = 2  # panels beside one another


def response_section(sources: Sources) -> Section | None:
    if not sources.has("response"):
        return None
    section = Section("response", f"Forced response{sources.main('response')}")
    report = sources.response_report
    axis = sources.response.axis
    ends = [number_text(sources.on_axis(axis, one)) for one in (sources.response.speed[0], sources.response.speed[-1])]
    span = f"{axis.plural} of {axis.of} from {ends[0]} to {ends[1]} {sources.axis_unit(axis)}"
    told = f"{len(report['lines'])} orders are computed at {span}. Half range: of the oscillation of all orders together."
    section.add(Paragraph(f"The response is computed at {span}." if axis.is_frequency else told))
    section.add(Heading(f"Limits and barred ranges of {axis.noun}", "limits"), *_limits(sources))
    section.add(Heading("Largest values", "largest"), *_largest(sources, whole=True))
    section.add_details(*_largest(sources, whole=False))
    if others := [one for one in told_quantities(sources.response) if not has_limit(one)]:
        section.add(*_small(sources, others))
    for case, response in sources.responses():
        of = f" of load case {case}" if case else ""
        section.add(*measured_blocks(sources, response.folder, "response.json", of, response))
    return section


def told_quantities(response: Response) -> list[Quantity]:
    """Loads, of an element the one that tells all of it: not the moments at the ends of a shaft."""
    loads = [one for one in response.quantities if one.column.rank in LOADS]
    whole = {(one.column.kind, one.column.element_kind, one.column.element) for one in loads if one.column.point in WHOLE}
    of = [(one.column.kind, one.column.element_kind, one.column.element) for one in loads]
    return [one for one, key in zip(loads, of) if one.column.point in WHOLE or key not in whole]


def has_limit(quantity: Quantity) -> bool:
    limits = (quantity.limit, quantity.transient_limit, quantity.peak_limit)
    return any(values is not None and np.isfinite(values).any() for values in limits)


def passage(barred: dict, has_passing_limit: bool) -> tuple[str, str]:
    """What a barred range means, and its tone. A rule may accept none, however small the stress."""
    if not barred.get("is_allowed", True):
        return "not allowed from 0.8 of the rated speed on", "bad"
    if not has_passing_limit:
        return "no limit for passing is given", "warn"
    return ("may be passed quickly", "warn") if barred["can_be_passed"] else ("limit for passing exceeded too", "bad")


def ratio_tone(ratio: float) -> tuple[str, str]:
    return ("limit exceeded", "bad") if ratio > 1 else ("within the limit", "good")


def _limits(sources: Sources) -> list[Paragraph | Table | Figure]:
    limited = [one for one in told_quantities(sources.response) if has_limit(one)]
    if not limited:
        return [Paragraph("The input sets no limit for a quantity of the response.")]
    blocks: list[Paragraph | Table | Figure] = _barred_ranges(sources)
    colours = _colours(limited, sources.response)
    panels = [_panel(sources, sources.response, one.in_short(), colours) for one in limited]
    axis = sources.response.axis
    marks = "resonances" if axis.is_frequency else "critical speeds"
    blocks.append(Figure(f"Half ranges with limits over the {axis.noun}; triangles: {marks}", panels, min(BIG, len(panels))))
    if others := _other_cases(sources):
        blocks.append(Figure("Other load cases: half ranges beyond their limits", others, min(BIG, len(others))))
    return blocks


def _other_cases(sources: Sources) -> list[Panel]:
    """Curves of the load cases that the section does not show, where a limit is not kept."""
    panels = []
    for case, response in sources.responses()[1:]:
        broken = {
            one.element
            for one in sources.verdict
            if one.finding in ("exceeded", "restricted") and case in one.cases and one.limit_at
        }
        chosen = [
            one
            for one in told_quantities(response)
            if has_limit(one) and f"{one.column.element_kind} '{one.column.element}'" in broken
        ]
        panels += [_panel(sources, response, one.in_short(), _colours(chosen, response), f"{case}, ") for one in chosen]
    return panels


def _barred_ranges(sources: Sources) -> list[Paragraph | Table | Figure]:
    barred, axis = barred_in(sources.response_report), sources.response.axis
    if not barred:
        return [Paragraph(f"No range of {axis.plural} is barred.", "good")]
    columns = {one.name: one for one in sources.response.columns}
    has_passing_limit = {one.name for one in sources.response.columns if one.statistic == "transient_limit"}
    has_tolerance = any("with_tolerance_rad_s" in one for one in barred)
    rows = []
    for one in barred:
        ends = sorted(sources.on_axis(axis, end) for end in axis.span(one))
        column = columns.get(one["quantity"])
        named = f"{name_of(column)}: {column.caption}" if column else one["quantity"]
        cells = [text(named), *map(number, ends)]
        if has_tolerance:
            cells += [
                number(sources.speed(one["with_tolerance_rad_s"][end])) if "with_tolerance_rad_s" in one else number(None)
                for end in (0, 1)
            ]
        rows.append([*cells, text(*passage(one, one["quantity"] in has_passing_limit)), text(one["limit_at"])])
    unit = sources.axis_unit(axis)
    columns = ["limit of", f"from [{unit}]", f"to [{unit}]", "passage", "set at"]
    if has_tolerance:
        columns[3:3] = [f"with tolerance from [{unit}]", f"with tolerance to [{unit}]"]
    return [Table(f"Barred ranges of {axis.noun}", columns, rows, f"No continuous operation within these {axis.plural}.")]


def _largest(sources: Sources, whole: bool) -> list[Table]:
    """A table for each unit; `whole`: of what the section shows, else of the rest."""
    columns = {one.name: one for one in sources.response.columns if one.statistic == "half_range"}
    told = {one.label for one in told_quantities(sources.response)}
    told |= {one.name for one in columns.values() if one.rank in LOADS and one.rank != MOMENT}
    entries = [
        one for one in sources.response_report["largest"] if one["quantity"] in columns and (one["quantity"] in told) == whole
    ]
    sorts = dict.fromkeys((columns[one["quantity"]].kind, one["unit"]) for one in entries)
    chosen = [[one for one in entries if (columns[one["quantity"]].kind, one["unit"]) == sort] for sort in sorts]
    return [_largest_of(sources, part, columns) for part in chosen]


def _largest_of(sources: Sources, entries: Sequence[dict], columns: dict[str, Column]) -> Table:
    axis = sources.response.axis
    unit, speed = entries[0]["unit"], sources.axis_unit(axis)
    factor, _ = sources.units.shown(unit, max(max(one["half_range"], one["peak"]) for one in entries))
    like = max(max(one["half_range"], one["peak"]) for one in entries)
    orders = []
    for one in entries:
        strongest = sorted(zip(one.get("half_range_by_order", []), sources.response.lines), key=lambda pair: -pair[0])[:3]
        orders.append(
            ", ".join(f"{line.name} ({number_text(factor * value, 3)})" for value, line in strongest if value > 1e-6 * like)
        )
    head, values = sources.units.column("", unit, [one["half_range"] for one in entries] + [one["peak"] for one in entries])
    shares = [one.get("ratio_to_limit") for one in entries]
    content = [
        ("of", texts([name_of(columns[one["quantity"]]) for one in entries])),
        (f"half range{head}", values[: len(entries)]),
        (f"at [{speed}]", [number(sources.on_axis(axis, axis.point(one, "half_range_"))) for one in entries]),
        (f"largest magnitude{head}", values[len(entries) :]),
        (f"largest at [{speed}]", [number(sources.on_axis(axis, axis.point(one, "peak_"))) for one in entries]),
        ("of its limit [%]", [share(one, 3, "bad" if one is not None and one > 1 else "") for one in shares]),
        (f"largest orders{head}", texts(orders)),
    ]
    caption = columns[entries[0]["quantity"]].caption
    content = content[:-1] if axis.is_frequency else content
    return cut(by_columns(f"Largest over the {axis.plural}: {caption}", content), MOST_ROWS, "response.json")


def _small(sources: Sources, quantities: list[Quantity]) -> list[Figure | Paragraph]:
    """A figure for each sort, of one scale for all of its panels."""
    blocks: list[Figure | Paragraph] = []
    ranked = sorted(quantities, key=lambda one: -one.largest)[:MOST_PANELS]
    chosen = [one for one in quantities if any(one is other for other in ranked)]
    for kind, unit in dict.fromkeys((one.column.kind, one.unit) for one in chosen):
        part = [one for one in chosen if (one.column.kind, one.unit) == (kind, unit)]
        largest = max(one.largest for one in part)
        colours = _colours(part, sources.response)
        panels = [_panel(sources, sources.response, one.in_short(largest), colours, is_small=True) for one in part]
        caption = part[0].column.caption if len({one.column.caption for one in part}) == 1 else kind.replace("_", " ")
        blocks.append(
            Figure(
                f"{caption[0].upper()}{caption[1:]}: half ranges over the {sources.response.axis.noun}",
                panels,
                max(BIG, panels_beside(len(panels))),
            )
        )
    if len(chosen) < len(quantities):
        blocks.append(Paragraph(f"Drawn are the {len(chosen)} largest of {len(quantities)} quantities; response.csv has all."))
    return blocks


def _colours(quantities: list[Quantity], response: Response) -> dict[int, int]:
    """An order has one colour in all panels of a figure."""
    lines = sorted({line for one in quantities for line in response.largest_lines(one)})
    return {line: place for place, line in enumerate(lines)}


def _panel(
    sources: Sources, response: Response, quantity: Quantity, colours: dict[int, int], before: str = "", is_small: bool = False
) -> Panel:
    arrays, column = sources.arrays, quantity.column
    axis = response.axis
    speed = np.array([sources.on_axis(axis, one) for one in response.speed])
    curves = [arrays.curve(axis.of if axis.is_frequency else "all orders", speed, quantity.half_range, role="total")]
    for line in sorted([] if axis.is_frequency else response.largest_lines(quantity)):
        curves.append(arrays.curve(response.lines[line].title, speed, quantity.orders[:, line], colour=colours[line]))
    top = quantity.largest
    for name, values, role in (("limit", quantity.limit, "limit"), ("limit for passing", quantity.transient_limit, "passing")):
        if values is not None and np.isfinite(values).any():
            is_near = np.nanmin(values) <= NEAR * top
            told = (
                name
                if is_near
                else f"{name} of {before}{name_of(column)}: {number_text(float(np.nanmin(values)), 4)} {quantity.unit} and more"
            )
            curves.append(arrays.curve(told, speed, values, role=role, shown=bool(is_near)))
    spec = {
        "x": {"label": axis.label, "unit": sources.axis_unit(axis)},
        "y": {"label": "" if is_small else "half range", "unit": quantity.unit, "zero": True},
        "curves": curves,
        "bands": [*operation_bands(sources, response), *_barred(sources, response, quantity)],
        "marks": [] if is_small else [[sources.on_axis(axis, one.speed), one.name] for one in response.criticals],
        "markName": "resonance, mode" if axis.is_frequency else "critical speed, mode/order",
        "name": "order",
    }
    at = number_text(float(speed[np.nanargmax(quantity.half_range)]))
    title = name_of(column) if is_small else f"{before}{name_of(column)}: {column.caption}"
    largest = f"the largest is {number_text(top)} {quantity.unit} at {at} {sources.axis_unit(axis)}"
    return Panel(title, f"Half range of {quantity.label} over the {axis.label}; {largest}.", spec)


def _barred(sources: Sources, response: Response, quantity: Quantity) -> list[dict]:
    bands = []
    for one in response.barred_by(quantity):
        kind, label = ("passable", "barred") if one.can_be_passed else ("barred", "barred, also for passing")
        ends = [sources.on_axis(response.axis, end) for end in (one.start, one.end)]
        bands.append(band(*ends, kind, label))
    return bands
