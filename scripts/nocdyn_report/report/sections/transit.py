"""Passages of barred ranges: times in the range, largest values, damage, curves."""

import numpy as np

from ...transit_results import NEAR, Limited, Passage, Transit
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
    number,
    panels_beside,
    share,
    text,
)
from ..curves import band
from ..numbers import number_text
from ..readable import life, texts
from ..sources import Sources

MOST_ROWS = 60
MOST_PASSAGES = 4  # that are drawn, of a load case
MOST_QUANTITIES = 5  # that are drawn


def transit_section(sources: Sources) -> Section | None:
    if not sources.has("transit"):
        return None
    section = Section("transit", "Passage of barred ranges")
    for transit in sources.transits:
        if transit.case:
            section.add(Heading(f"Load case {transit.case}", "transit-" + "-".join(transit.case.split())))
        section.add(*_of_case(sources, transit))
    return section


def _of_case(sources: Sources, transit: Transit) -> list[Block]:
    if not transit.report["ranges"]:
        return [Paragraph("No limit bars a range of speeds: there is none to pass.", "good")]
    turns = "one turn" if transit.turns == 1 else f"{transit.turns} turns"
    ends = [number_text(sources.speed(one), 4) for one in transit.report["mean_speeds_rad_s"]]
    told = f"The mean speed of {transit.body}, over {turns}, goes from {ends[0]} to {ends[1]} {sources.speed_unit}"
    if not transit.passages:
        return [Paragraph(f"{told}: it is never in the range.", "warn")]
    blocks: list[Block] = [Paragraph(f"{told}."), _passages(sources, transit)]
    if transit.quantities:
        blocks.append(_peaks(sources, transit))
    if transit.report["fatigue"]:
        blocks.append(_damage(transit))
    return [*blocks, _figure(sources, transit)]


def _passages(sources: Sources, transit: Transit) -> Table:
    passages, unit = transit.passages, sources.speed_unit
    entries = [one.entry for one in passages]
    columns = [
        ("passage", [number(one.number) for one in passages]),
        (f"range [{unit}]", texts([_range(sources, one) for one in passages])),
        ("direction", [text(one["direction"], "" if one["passes"] else "warn") for one in entries]),
        ("enters at [s]", [number(one["enters"]) for one in entries]),
        ("time in range [s]", [number(one["time_in_range"]) for one in entries]),
        ("turns", [number(one["turns"], 4) for one in entries]),
        ("order", [number(one.range.get("order"), 4) for one in passages]),
        ("cycles of order", [number(one.get("cycles_of_order"), 4) for one in entries]),
    ]
    return by_columns("Passages of barred ranges", columns)


def _range(sources: Sources, passage: Passage) -> str:
    return " to ".join(number_text(sources.of_rpm(one), 4) for one in passage.ends)


def _peaks(sources: Sources, transit: Transit) -> Table:
    """Largest magnitudes and half ranges, with the limits of both."""
    rows = [(passage, quantity, passage.peak(quantity)) for quantity in transit.quantities for passage in transit.passages]
    of_half = [one.get("half_range_limit") for _, _, one in rows]
    of_largest = [quantity.largest_limit for _, quantity, _ in rows]
    columns = [
        ("of", texts([f"{one.element}, {one.caption}" for _, one, _ in rows])),
        ("passage", [number(one.number) for one, _, _ in rows]),
        ("largest", [_amount(sources, one["largest"], one["unit"]) for *_, one in rows]),
        ("largest at [s]", [number(one["time"]) for *_, one in rows]),
        ("its limit", [_amount(sources, limit, one["unit"]) for limit, (*_, one) in zip(of_largest, rows)]),
        ("of its limit [%]", [_ratio(one["largest"], limit) for limit, (*_, one) in zip(of_largest, rows)]),
        ("half range", [_amount(sources, one["half_range"], one["unit"]) for *_, one in rows]),
        ("half range at [s]", [number(one["half_range_time"]) for *_, one in rows]),
        (f"at [{sources.speed_unit}]", [number(sources.speed(one["half_range_speed_rad_s"])) for *_, one in rows]),
        ("limit for passing", [_amount(sources, limit, one["unit"]) for limit, (*_, one) in zip(of_half, rows)]),
        ("of limit for passing [%]", [_ratio(one["half_range"], limit) for limit, (*_, one) in zip(of_half, rows)]),
    ]
    note = "Half range: in the turn of the passage in which it is nearest to its limit."
    return cut(by_columns("Largest values in the passages", columns, note), MOST_ROWS, "transit.json")


def _amount(sources: Sources, value: float | None, unit: str) -> Cell:
    return Cell(sources.units.amount(value, unit), float("inf") if value is None else value, "", "", True)


def _ratio(value: float, limit: float | None) -> Cell:
    return share(None if limit is None else value / limit, 4, "bad" if limit is not None and value > limit else "")


def _damage(transit: Transit) -> Table:
    lives = transit.report["fatigue"]
    each = [{one["name"]: one for one in passage.entry["fatigue"]} for passage in transit.passages]
    columns = [
        ("name", texts([one["name"] for one in lives])),
        ("element", texts([one["element"] for one in lives])),
        ("position [m]", [number(one.get("position")) for one in lives]),
    ]
    for passage, found in zip(transit.passages, each):
        columns.append((f"cycles of {passage.number}", [number(found[one["name"]]["cycles"]) for one in lives]))
        columns.append((f"damage of {passage.number}", [life(found[one["name"]]["damage"]) for one in lives]))
    columns += [
        ("times in the life", [number(float(one["passages"])) for one in lives]),
        ("damage of all", [life(one["damage"], "bad" if one["damage"] > 1 else "") for one in lives]),
        ("times to failure", [life(one.get("passages_to_failure")) for one in lives]),
        ("mean of a cycle", [_strength(one) for one in lives]),
    ]
    note = "Cycles by rainflow counting, damage by Miner; failure is expected at 1."
    return by_columns("Damage of the passages", columns, note)


def _strength(one: dict) -> Cell:
    exceeds = one["mean_exceeds_strength"]
    return text("exceeds the strength", "bad") if exceeds else text("below the strength")


def _figure(sources: Sources, transit: Transit) -> Figure:
    """A row of panels for each passage: the speed, then the quantities."""
    passages, quantities = transit.passages[:MOST_PASSAGES], transit.quantities[:MOST_QUANTITIES]
    panels = []
    for passage in passages:
        panels.append(_speed_panel(sources, transit, passage))
        panels += [_load_panel(sources, transit, passage, one) for one in quantities]
    caption = f"Passages of barred ranges{_of(transit)} over the time"
    left_out = len(transit.passages) - len(passages), len(transit.quantities) - len(quantities)
    if any(left_out):
        caption += f"; {left_out[0]} more passages and {left_out[1]} more quantities are in transit.csv"
    return Figure(caption, panels, panels_beside(1 + len(quantities)))


def _of(transit: Transit) -> str:
    return f" of load case {transit.case}" if transit.case else ""


def _panel(sources: Sources, passage: Passage, title: str, told: str, curves: list[dict], unit: str) -> Panel:
    spec = {
        "x": {"label": "time", "unit": "s"},
        "y": {"label": "", "unit": unit},
        "curves": curves,
        "bands": [band(passage.entry["enters"], passage.entry["leaves"], "passable", "time in the range")],
        "name": "time",
    }
    return Panel(f"{passage.number}, {passage.entry['direction']}: {title}", told, spec)


def _across(sources: Sources, passage: Passage, name: str, value: float, role: str) -> dict:
    return sources.arrays.curve(name, passage.time[[0, -1]], np.array([value, value]), role=role)


def _speed_panel(sources: Sources, transit: Transit, passage: Passage) -> Panel:
    curve = sources.arrays.curve
    curves = [
        curve("mean speed", passage.time, sources.of_rpm(passage.mean_speed), role="total"),
        *(_across(sources, passage, "ends of the range", sources.of_rpm(one), "passing") for one in passage.ends),
        curve("speed", passage.time, sources.of_rpm(passage.speed), role="load"),
    ]
    entry = passage.entry
    told = f"Speed of {transit.body} over the time, passage {passage.number}{_of(transit)}: in {_range(sources, passage)} "
    told += f"{sources.speed_unit} from {number_text(entry['enters'])} to {number_text(entry['leaves'])} s."
    return _panel(sources, passage, f"speed of {transit.body}", told, curves, sources.speed_unit)


def _load_panel(sources: Sources, transit: Transit, passage: Passage, quantity: Limited) -> Panel:
    peak = passage.peak(quantity)
    factor, unit = sources.units.shown(quantity.unit, peak["largest"])
    middle, at = passage.centre(quantity, transit.turns), peak["half_range_time"]
    ends = np.array([middle - peak["half_range"], middle + peak["half_range"]])
    limits = [("limit for passing", middle, peak.get("half_range_limit"), peak["half_range"], "passing")]
    limits.append(("limit of the magnitude", 0.0, quantity.largest_limit, peak["largest"], "limit"))
    curves = [
        sources.arrays.curve("half range of the worst turn", np.array([at, at]), factor * ends, colour=1)
    ]  # above the others
    for name, about, limit, reached, role in limits:
        if limit is None:
            continue
        is_near = limit <= NEAR * reached
        told = (
            f"{name} of {passage.number}, {quantity.element}: {sources.units.amount(limit, quantity.unit, like=peak['largest'])}"
        )
        sides = (-1, 1) if is_near else (1,)
        curves += [
            {**_across(sources, passage, name if is_near else told, factor * (about + side * limit), role), "shown": is_near}
            for side in sides
        ]
    curves.append(sources.arrays.curve("load", passage.time, factor * passage.values(quantity), role="load"))
    told = f"{quantity.element}, {quantity.caption} over the time, passage {passage.number}{_of(transit)}: largest "
    told += f"{sources.units.amount(peak['largest'], quantity.unit)}, half range "
    told += f"{sources.units.amount(peak['half_range'], quantity.unit, like=peak['largest'])}."
    return _panel(sources, passage, f"{quantity.element}, {quantity.caption}", told, curves, unit)
