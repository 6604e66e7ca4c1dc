"""Periodic motions of a nonlinear machine: half ranges over the parameter, jumps, unstable ranges, largest values."""

from collections.abc import Sequence

import numpy as np

from ...columns import Column
from ...orbit_results import Orbits
from ..content import Block, Cell, Figure, Heading, Panel, Paragraph, Section, Table, by_columns, cut, number, panels_beside, text
from ..curves import COLOURS
from ..naming import name_of
from ..numbers import number_text
from ..readable import life, texts
from ..sources import Sources

MOST_PANELS = 12
MOST_ROWS = 60
DIGITS = 8  # of special values


def orbit_section(sources: Sources) -> Section | None:
    if not sources.has("orbit"):
        return None
    section = Section("orbit", "Periodic motions")
    for orbits in sources.orbits:
        if orbits.case:
            section.add(Heading(f"Load case {orbits.case}", "orbit-" + "-".join(orbits.case.split())))
        section.add(*_of_case(sources, orbits))
    return section


def parameter_of(sources: Sources, orbits: Orbits) -> tuple[str, str, float]:
    """What changes, its unit, and the factor from the axis of `orbits` to that."""
    if orbits.is_speed:
        return orbits.axis_name, sources.speed_unit, sources.of_rpm(1.0)
    return orbits.axis_name, orbits.unit, 1.0


def unstable_ranges(orbits: Orbits) -> list[tuple[int, float, float]]:
    """Branch and ends of unstable stretches that follow one another, on the axis of `orbits`."""
    found: list[tuple[int, float, float]] = []
    last = None
    for one in orbits.stretches:
        if one.is_stable:
            continue
        low, high = orbits.value[one.rows].min(), orbits.value[one.rows].max()
        if last is not None and last.branch == one.branch and last.rows[-1] == one.rows[0]:
            _, former_low, former_high = found.pop()
            low, high = min(low, former_low), max(high, former_high)
        found.append((one.branch, float(low), float(high)))
        last = one
    return found


def _of_case(sources: Sources, orbits: Orbits) -> list[Block]:
    named, unit, factor = parameter_of(sources, orbits)
    ends = [number_text(factor * orbits.factor * one, 6) for one in orbits.report["range"]]
    told = f"{orbits.report['points']} periodic motions are computed over {named} from {ends[0]} to {ends[1]} {unit}".rstrip()
    error = number_text(orbits.report["largest_error"], 2)
    blocks: list[Block] = [Paragraph(f"{told}; the largest error is {error} of a motion.")]
    if ending := orbits.report.get("ends"):
        blocks.append(Paragraph(f"The branch ends {ending}.", "warn"))
    blocks.append(_stability(orbits, named, unit, factor))
    if orbits.specials:
        blocks.append(_specials(sources, orbits, unit, factor))
    blocks.append(_largest(sources, orbits, unit, factor))
    if orbits.report.get("fatigue"):
        blocks.append(_damage(orbits, unit, factor))
    return [*blocks, *_figures(sources, orbits, named, unit, factor)]


def _stability(orbits: Orbits, named: str, unit: str, factor: float) -> Paragraph:
    """The unstable ranges in words."""
    if not orbits.has_stability:
        return Paragraph("The stability of the motions is not determined.", "warn")
    held = " with a constant holding torque" if orbits.is_speed else ""
    ranges = unstable_ranges(orbits)
    if not ranges:
        return Paragraph(f"All of them are stable{held}.", "good")
    words = []
    for branch, low, high in ranges:
        of = f" (branch {branch})" if len(orbits.branches) > 1 else ""
        words.append(f"from {number_text(factor * low, DIGITS)} to {number_text(factor * high, DIGITS)} {unit}".rstrip() + of)
    told = "; ".join(words)
    return Paragraph(f"Motions that are unstable{held}, on which the machine does not stay: {named} {told}.", "warn")


def _specials(sources: Sources, orbits: Orbits, unit: str, factor: float) -> Table:
    loads = orbits.loads()[:1]
    rows = []
    for one in orbits.specials:
        before = [orbits.half_range(column)[one.row] for column in loads]
        after = [", ".join(_amount(sources, value, column) for value in orbits.landings(one, column)) for column in loads]
        cells = [text(one.name), number(factor * one.value, DIGITS), number(int(orbits.table["branch"].iloc[one.row]))]
        cells += [Cell(_amount(sources, value, column), value, "", "", True) for value, column in zip(before, loads)]
        rows.append([*cells, *texts(after)])
    of = [f"{name_of(column)}: {column.caption}" for column in loads]
    heads = ["point", f"at [{unit}]" if unit else "at", "branch", *(f"half range of {one}" for one in of)]
    note = "At a fold the parameter turns back: where a stable motion ends, the machine jumps to another one."
    return cut(Table("Special points", [*heads, *("after a jump" for _ in of)], rows, note), MOST_ROWS, "orbit.json")


def _amount(sources: Sources, value: float, column: Column) -> str:
    return sources.units.amount(float(value), column.unit)


def _largest(sources: Sources, orbits: Orbits, unit: str, factor: float) -> Table:
    peaks = {one["quantity"]: one for one in orbits.report["peaks"]}
    chosen = [(one, peaks[one.name]) for one in orbits.loads() if one.name in peaks]
    stable = {True: ("stable", ""), False: ("unstable", "warn")}
    columns = [
        ("of", texts([f"{name_of(one)}: {one.caption}" for one, _ in chosen])),
        ("half range", _amounts(sources, [(peak["half_range"], peak["unit"]) for _, peak in chosen])),
        (f"at [{unit}]" if unit else "at", [number(factor * orbits.factor * peak["value"], 6) for _, peak in chosen]),
        ("largest magnitude there", _amounts(sources, [(peak["largest"], peak["unit"]) for _, peak in chosen])),
        ("mean there", _amounts(sources, [(peak["mean"], peak["unit"]) for _, peak in chosen])),
        ("motion", [text(*stable.get(peak.get("stable"), ("", ""))) for _, peak in chosen]),
    ]
    return cut(by_columns("Largest half ranges of all motions", columns), MOST_ROWS, "orbit.json")


def _amounts(sources: Sources, values: Sequence[tuple[float, str]]) -> list[Cell]:
    return [Cell(sources.units.amount(value, unit), value, "", "", True) for value, unit in values]


def _damage(orbits: Orbits, unit: str, factor: float) -> Table:
    entries = orbits.report["fatigue"]
    columns = [
        ("name", texts([one["name"] for one in entries])),
        ("element", texts([one["element"] for one in entries])),
        ("largest damage per hour", [life(one.get("largest_damage_per_hour")) for one in entries]),
        (f"at [{unit}]" if unit else "at", [number(_at(orbits, one, factor), 6) for one in entries]),
    ]
    return by_columns("Damage of stable motions", columns, "Cycles of one period by rainflow counting, damage by Miner.")


def _at(orbits: Orbits, entry: dict, factor: float) -> float | None:
    return None if "value" not in entry else factor * orbits.factor * entry["value"]


def _figures(sources: Sources, orbits: Orbits, named: str, unit: str, factor: float) -> list[Block]:
    columns = orbits.loads()
    panels = [_panel(sources, orbits, one, named, unit, factor) for one in columns[:MOST_PANELS]]
    case = f" of load case {orbits.case}" if orbits.case else ""
    caption = f"Half ranges{case} over the {named}; broken lines: unstable motions; points: folds and other special points"
    blocks: list[Block] = [Figure(caption, panels, min(2, panels_beside(len(panels))))]
    if len(columns) > MOST_PANELS:
        blocks.append(Paragraph(f"Drawn are {MOST_PANELS} of {len(columns)} quantities; orbit.csv has all."))
    return blocks


def _panel(sources: Sources, orbits: Orbits, column: Column, named: str, unit: str, factor: float) -> Panel:
    values = orbits.half_range(column)
    scale, shown = sources.units.shown(column.unit, float(values.max()))
    curves = []
    for one in orbits.stretches:
        rows = one.rows[np.argsort(orbits.value[one.rows], kind="stable")]
        branch = f"branch {one.branch}" if len(orbits.branches) > 1 else "motions"
        words = {True: ", stable", False: ", unstable"}[one.is_stable] if orbits.has_stability else ""
        colour = orbits.branches.index(one.branch) % COLOURS + (0 if one.is_stable else COLOURS)
        curve = sources.arrays.curve(f"{branch}{words}", factor * orbits.value[rows], scale * values[rows], colour=colour)
        curves.append(curve)
    if orbits.specials:
        x = [factor * one.value for one in orbits.specials]
        y = [scale * values[one.row] for one in orbits.specials]
        labels = [f"{one.name}: {number_text(factor * one.value, DIGITS)} {unit}".rstrip() for one in orbits.specials]
        curves.append(sources.arrays.points("special points", x, y, labels, role="far"))
    spec = {
        "x": {"label": named, "unit": unit},
        "y": {"label": "", "unit": shown},
        "curves": curves,
        "bands": [],
        "name": named,
    }
    largest = _amount(sources, values.max(), column)
    told = f"Half range of {name_of(column)}, {column.caption}, over the {named}: largest {largest}."
    return Panel(f"{name_of(column)}: {column.caption}", told, spec)
