"""The forced response with its limits and barred ranges."""

import numpy as np

from ...columns import FORCE, MOMENT
from ...speed_results import NEAR, Quantity
from ..content import Figure, Heading, Paragraph, Section, Table, first, number, share, text
from ..curves import band
from ..numbers import number_text, unit_text
from ..sources import Sources
from .campbell import operation_bands, verdict

MOST_FIGURES = 24
MOST_ROWS = 120


def response_section(sources: Sources) -> Section | None:
    if not sources.has("response"):
        return None
    section = Section("response", "Forced response")
    report = sources.response_report
    span = (
        f"from {_speed(sources, report['speed_rad_s'][0])} to {_speed(sources, report['speed_rad_s'][-1])} {sources.speed_unit}"
    )
    section.add(Paragraph(f"{len(report['lines'])} orders are computed at the speeds of {report['body']} {span}."))
    section.add(Heading("Limits and barred ranges of speed", "limits"), *_limits(sources))
    section.add(Heading("Resonances", "resonances"))
    section.add(_resonances(sources) if report["critical_speeds"] else Paragraph("No order meets a natural frequency."))
    section.add(Heading("Largest values", "largest"), _largest(sources))
    section.add(Heading("Curves over the speed", "curves"), *_curves(sources))
    return section


def _speed(sources: Sources, value: float) -> str:
    return number_text(sources.speed(value))


def limited(report: dict) -> list[dict]:
    """The quantities that have a limit."""
    return [one for one in report["largest"] if "ratio_to_limit" in one]


def shares_of_limits(report: dict) -> list[tuple[str, float, float]]:
    """Of each quantity with a limit the largest share, then that of its peak: what is shared, the share, the speed in rad/s."""
    found = []
    for one in limited(report):
        found.append((one["quantity"], one["ratio_to_limit"], one["ratio_speed_rad_s"]))
        peak = one.get("peak_ratio_to_limit", one["ratio_to_limit"])
        if peak != one["ratio_to_limit"]:
            found.append((f"{one['quantity']}, its peak,", peak, one["peak_speed_rad_s"]))
    return found


def passage(barred: dict) -> tuple[str, str]:
    """What a barred range means, and its tone. A rule may accept none, however small the stress."""
    if not barred.get("is_allowed", True):
        return "not allowed from 0.8 of the rated speed on", "bad"
    if barred["can_be_passed"]:
        return "may be passed quickly", "warn"
    return "limit for passing through exceeded too", "bad"


def ratio_tone(ratio: float) -> tuple[str, str]:
    return ("limit exceeded", "bad") if ratio > 1 else ("within the limit", "good")


def _limits(sources: Sources) -> list[Paragraph | Table]:
    report, unit = sources.response_report, sources.speed_unit
    if not limited(report):
        return [Paragraph("The input sets no limit for a quantity of the response.")]
    rows = []
    for name, ratio, speed in shares_of_limits(report):
        words, tone = ratio_tone(ratio)
        rows.append([text(name.rstrip(",")), share(ratio), number(sources.speed(speed)), text(words, tone)])
    columns = ["quantity", "largest share of its limit [%]", f"at [{unit}]", "assessment"]
    blocks: list[Paragraph | Table] = [Table("Limits", columns, rows)]
    barred = report["barred_speed_ranges"]
    if not barred:
        return [*blocks, Paragraph("No range of speeds is barred.", "good")]
    rows = []
    for one in barred:
        ends = sorted((sources.speed(one["from_rad_s"]), sources.speed(one["to_rad_s"])))
        passing = text(*passage(one))
        rows.append([text(one["quantity"]), *map(number, ends), passing, text(one["limit_at"])])
    columns = ["limit of", f"from [{unit}]", f"to [{unit}]", "passage", "set at"]
    return [*blocks, Table("Barred ranges of speed", columns, rows, "No continuous operation within these speeds.")]


def _resonances(sources: Sources) -> Table:
    units = {one.column.element: one.column.unit for one in sources.response.quantities if one.column.rank in (MOMENT, FORCE)}
    rows = []
    for one, critical in zip(sources.response_report["critical_speeds"], sources.response.criticals):
        words, tone = verdict(critical)
        ratio = one.get("ratio_to_limit")
        rows.append(
            [
                text(critical.name),
                number(sources.speed(one["speed_rad_s"])),
                number(one["frequency_Hz"]),
                number(one["damping_ratio"], 3),
                text(one.get("coupling", "")),
                text(unit_text(units.get(one.get("coupling", ""), ""))),
                number(one.get("moment_N_m")),
                number(one.get("half_range_N_m")),
                number(sources.speed(one["peak_speed_rad_s"]) if "peak_speed_rad_s" in one else None),
                number(one.get("stress_Pa")),
                share(ratio, 3, "bad" if ratio is not None and ratio > 1 else ""),
                text(words, tone),
            ]
        )
    rows, more = first(rows, MOST_ROWS, "response.json")
    unit = sources.speed_unit
    columns = [
        "mode/order",
        f"critical speed [{unit}]",
        "frequency [Hz]",
        "damping ratio",
        "largest in",
        "unit",
        "of the order",
    ]
    columns += ["half range of all orders", f"at [{unit}]", "stress [Pa]", "all orders, of the limit [%]", "operation"]
    note = "Half range and share of the limit are those of all orders together, there; the order may have a small part in them."
    return Table("Resonances and what they reach", columns, rows, f"{note} {more}".strip())


def _largest(sources: Sources) -> Table:
    rows = []
    for one in sources.response_report["largest"]:
        ratio = one.get("ratio_to_limit")
        strongest = sorted(zip(one["half_range_by_order"], sources.response.lines), key=lambda pair: -pair[0])[:3]
        orders = ", ".join(f"{line.name} ({number_text(value, 4)})" for value, line in strongest if value > 0)
        rows.append(
            [
                text(one["quantity"]),
                text(unit_text(one["unit"])),
                number(one["half_range"]),
                number(sources.speed(one["half_range_speed_rad_s"])),
                number(one["peak"]),
                number(sources.speed(one["peak_speed_rad_s"])),
                share(ratio, 3, "bad" if ratio is not None and ratio > 1 else ""),
                text(orders),
            ]
        )
    rows, more = first(rows, MOST_ROWS, "response.json")
    unit = sources.speed_unit
    columns = ["quantity", "unit", "half range", f"at [{unit}]", "peak", f"peak at [{unit}]", "of its limit [%]"]
    note = "Half range: of the oscillation of all orders together. Peak: the largest magnitude, with the mean."
    return Table("Largest values over the speeds", [*columns, "orders in the half range"], rows, f"{note} {more}".strip())


def _curves(sources: Sources) -> list[Paragraph | Figure]:
    response = sources.response
    ranked = sorted(response.quantities, key=lambda one: -np.nanmax(one.half_range, initial=0.0))[:MOST_FIGURES]
    chosen = [one for one in response.quantities if any(one is other for other in ranked)]
    blocks: list[Paragraph | Figure] = [_figure(sources, one) for one in chosen]
    if len(chosen) < len(response.quantities):
        blocks.append(
            Paragraph(f"Drawn are the {len(chosen)} largest of {len(response.quantities)} quantities; response.csv has all.")
        )
    return blocks


def _figure(sources: Sources, quantity: Quantity) -> Figure:
    response, arrays = sources.response, sources.arrays
    speed = np.array([sources.of_rpm(one) for one in response.speed])
    curves = [arrays.curve("all orders", speed, quantity.half_range, role="total")]
    curves += _orders(sources, quantity, speed)
    top = float(np.nanmax(quantity.half_range, initial=0.0))
    for name, values, role in (("limit", quantity.limit, "limit"), ("limit for passing", quantity.transient_limit, "passing")):
        if values is not None and np.isfinite(values).any():
            is_near = np.nanmin(values) <= NEAR * top
            curves.append(arrays.curve(name, speed, values, role=role, shown=bool(is_near)))
    spec = {
        "x": {"label": f"speed of {response.body}", "unit": sources.speed_unit},
        "y": {"label": f"half range of {quantity.label}", "unit": quantity.unit, "zero": True},
        "curves": curves,
        "bands": [*operation_bands(sources, response), *_barred(sources, quantity)],
        "marks": [[sources.of_rpm(one.speed), one.name] for one in response.criticals],
        "name": "order",
    }
    at = number_text(float(speed[np.nanargmax(quantity.half_range)]))
    return Figure(
        f"{quantity.label}, {quantity.column.caption}: half range over the speed, largest orders. Triangles: critical speeds",
        f"Half range of {quantity.label} over the speed of {response.body}; the largest is {number_text(top)} {quantity.unit} "
        f"at {at} {sources.speed_unit}.",
        spec,
    )


def _orders(sources: Sources, quantity: Quantity, speed: np.ndarray) -> list[dict]:
    """The largest, in the order of the file."""
    response = sources.response
    chosen = sorted(response.largest_lines(quantity))
    return [sources.arrays.curve(response.lines[i].title, speed, quantity.orders[:, i]) for i in chosen]


def _barred(sources: Sources, quantity: Quantity) -> list[dict]:
    bands = []
    for one in sources.response.barred_by(quantity):
        kind, label = ("passable", "barred") if one.can_be_passed else ("barred", "barred, also for passing")
        bands.append(band(sources.of_rpm(one.start), sources.of_rpm(one.end), kind, label))
    return bands
