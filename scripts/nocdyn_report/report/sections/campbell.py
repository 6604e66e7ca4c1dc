"""Natural frequencies over the speed, and where the orders meet them."""

import numpy as np

from ...speed_results import Critical, roman
from ..content import Figure, Heading, Paragraph, Section, Table, first, number, share, text
from ..curves import band
from ..sources import Sources

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
    section = Section("campbell", "Campbell diagram and interference")
    section.add(_diagram(sources))
    section.add(Heading("Interference: critical speeds", "critical"))
    if campbell.crossings:
        section.add(_crossings(sources))
    else:
        section.add(Paragraph("No order meets a natural frequency in this range of speeds."))
    section.add(_modes(sources))
    return section


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
    return Figure(
        f"Campbell diagram over the speed of {campbell.body}. Points: mode and order meet, as II/6 where order 6 meets mode 2",
        f"Natural frequencies and orders over the speed. Critical speeds: {told or 'none'}.",
        spec,
    )


def _crossings(sources: Sources) -> Table:
    rows = []
    for one in sources.campbell.crossings:
        words, tone = verdict(one)
        distance = None if one.distance != one.distance else max(0.0, one.distance)
        rows.append(
            [
                text(one.name),
                number(one.mode),
                text(one.line.name),
                number(sources.of_rpm(one.speed)),
                number(one.frequency),
                share(distance),
                text(words, tone),
            ]
        )
    rows, more = first(rows, MOST_ROWS, "campbell.json")
    columns = ["mode/order", "mode", "order", f"critical speed [{sources.speed_unit}]", "frequency [Hz]"]
    return Table("Critical speeds", [*columns, "distance to operation [%]", "assessment"], rows, more)


def _modes(sources: Sources) -> Table:
    table = sources.table("campbell", "campbell.csv")
    rows = []
    for mode, frequency in sources.campbell.modes.items():
        damping = table[f"damping_ratio_{mode} [1]"]
        least, most = float(frequency.min()), float(frequency.max())
        rows.append([number(mode), number(least), number(most), number(float(damping.min()), 3), number(float(damping.max()), 3)])
    rows, more = first(rows, MOST_ROWS, "campbell.csv")
    columns = ["mode", "lowest frequency [Hz]", "highest frequency [Hz]", "least damping ratio", "largest damping ratio"]
    return Table("Natural frequencies within the range of speeds", columns, rows, more)
