"""Natural frequencies over the speed, and where the orders meet them."""

import math

import numpy as np

from ...columns import FORCE, MOMENT
from ...speed_results import Critical, roman
from ..content import Figure, Heading, Panel, Paragraph, Section, Table, by_columns, cut, first, number, share, text
from ..curves import band
from ..numbers import unit_text
from ..readable import texts
from ..sources import Sources
from .modes import LEAST_MODES, of_interest

MOST_MODES = 24
MOST_ROWS = 120
ROOM = 1.15  # above the highest crossing
VERDICTS = {"inside": ("in operation", "bad"), "margin": ("within the margin", "warn"), "clear": ("clear", "good")}
# what points are called and how they look, by their places
POINTS = {
    "clear": ("clear of operation", "far"),
    "": ("critical speed", "far"),
    "margin": ("within the margin", "margin"),
    "inside": ("in operation", "inside"),
}


def campbell_section(sources: Sources) -> Section | None:
    if not sources.has("campbell"):
        return None
    campbell = sources.campbell
    section = Section("campbell", f"Campbell diagram and critical speeds{sources.main('campbell')}")
    section.add(_diagram(sources))
    section.add(Heading("Critical speeds", "critical"))
    if campbell.crossings:
        section.add(_crossings(sources))
    else:
        section.add(Paragraph("No order meets a natural frequency in this range of speeds."))
    return section.add_details(_modes(sources))


def operation_bands(sources: Sources, report: object) -> list[dict]:
    """Speeds in operation and their margins."""
    if report.operation is None:
        return []
    bands = []
    for start, end, is_margin in report.operation.spans:
        kind, label = ("margin", "margin of operation") if is_margin else ("operation", "in operation")
        bands.append(band(sources.of_rpm(start), sources.of_rpm(end), kind, label))
    return bands


def verdict(critical: Critical) -> tuple[str, str]:
    """A critical speed and operation, in words and a tone."""
    return VERDICTS.get(critical.place) or ("electrical mode" if critical.is_electrical else "", "")


def _diagram(sources: Sources) -> Figure:
    campbell, arrays = sources.campbell, sources.arrays
    speed = np.array([sources.of_rpm(one) for one in campbell.speed])
    curves = []
    highest = max((one.frequency for one in campbell.crossings), default=0.0)
    top = ROOM * highest if highest else ROOM * min(frequency.max() for frequency in campbell.modes.values())
    for line, frequency in campbell.lines:
        curves.append(arrays.curve(line.title, speed, frequency, role="order", end=line.name))
    for mode, frequency in list(campbell.modes.items())[:MOST_MODES]:
        curves.append(arrays.curve(f"mode {roman(mode)}", speed, frequency, role="mode", end=roman(mode)))
    for place, (name, role) in POINTS.items():
        name = "electrical mode" if not place and campbell.operation else name  # nothing else has no distance to operation
        if chosen := [one for one in campbell.crossings if one.place == place]:
            places = [sources.of_rpm(one.speed) for one in chosen], [one.frequency for one in chosen]
            labels = [sources.named(one) for one in chosen]
            curves.append(arrays.points(name, *places, labels, role=role, names=[one.name for one in chosen]))
    spec = {
        "x": {"label": f"speed of {campbell.body}", "unit": sources.speed_unit},
        "y": {"label": "frequency", "unit": "Hz", "range": [0.0, float(top)]},
        "curves": curves,
        "bands": operation_bands(sources, campbell),
        "nearest": True,
        "name": "line",
    }
    told = "; ".join(map(sources.named, campbell.crossings[:20]))
    caption = (
        f"Campbell diagram over the speed of {campbell.body}. Points: mode and order meet, as II/6 where order 6 meets mode 2"
    )
    return Figure(
        caption, [Panel("", f"Natural frequencies and orders over the speed. Critical speeds: {told or 'none'}.", spec)]
    )


def _crossings(sources: Sources) -> Table:
    found = sources.campbell.crossings
    reached = _reached(sources)
    verdicts = [verdict(one) for one in found]
    distances = [None if math.isnan(one.distance) else max(0.0, one.distance) for one in found]
    columns = [
        ("mode/order", texts([one.name for one in found])),
        (f"critical speed [{sources.speed_unit}]", [number(sources.of_rpm(one.speed)) for one in found]),
        ("frequency [Hz]", [number(one.frequency) for one in found]),
        ("distance to operation [%]", [share(one) for one in distances]),
        ("operation", [text(words, tone) for words, tone in verdicts]),
    ]
    entries = [reached.get((one.name, round(one.speed, 3)), {}) for one in found]
    columns.append(("most in", texts([one.get("coupling", "") for one in entries])))
    units = _units(sources) if reached else {}
    unit = "N m" if FORCE not in units.values() else ""  # moments and forces share a column where there are both
    if not unit:
        names = {FORCE: "N", MOMENT: unit_text("N m")}
        columns.append(("unit", texts([names.get(units.get(one.get("coupling", "")), "") for one in entries])))
    columns.append(sources.units.column("of the order", unit, [one.get("moment_N_m") for one in entries], 4))
    columns.append(sources.units.column("all orders", unit, [one.get("half_range_N_m") for one in entries], 4))
    columns.append(sources.units.column("stress", "Pa", [one.get("stress_Pa") for one in entries], 4))
    shares = [one.get("ratio_to_limit") for one in entries]
    columns.append(
        ("all orders, of the limit [%]", [share(one, 3, "bad" if one is not None and one > 1 else "") for one in shares])
    )
    note = "Half ranges, the largest near the critical speed; of all orders together, the order of the line may be a small part."
    table = by_columns("Critical speeds and what they reach", columns, note if reached else "")
    return cut(table, MOST_ROWS, "campbell.json")


def _reached(sources: Sources) -> dict[tuple[str, float], dict]:
    """What the forced response says of critical speeds, by name and speed."""
    if not sources.has("response"):
        return {}
    entries = zip(sources.response.criticals, sources.response_report["critical_speeds"])
    return {(one.name, round(one.speed, 3)): entry for one, entry in entries}


def _units(sources: Sources) -> dict[str, int]:
    """Whether an element has moments or forces, by the ranks of its columns."""
    return {one.column.element: one.column.rank for one in sources.response.quantities if one.column.rank in (MOMENT, FORCE)}


def _modes(sources: Sources) -> Table:
    table = sources.table("campbell", "campbell.csv")
    rows = []
    modes = list(sources.campbell.modes.items())
    count = max(LEAST_MODES, sum(frequency.min() <= of_interest(sources) for _, frequency in modes))
    for mode, frequency in modes[:count]:
        damping = table[f"damping_ratio_{mode} [1]"]
        least, most = float(frequency.min()), float(frequency.max())
        rows.append([number(mode), number(least), number(most), number(float(damping.min()), 3), number(float(damping.max()), 3)])
    rows, more = first(rows, MOST_ROWS, "campbell.csv")
    more = more or (f"{len(modes) - count} more modes are in campbell.csv." if len(modes) > count else "")
    columns = ["mode", "lowest frequency [Hz]", "highest frequency [Hz]", "least damping ratio", "largest damping ratio"]
    return Table("Natural frequencies within the range of speeds", columns, rows, more)
