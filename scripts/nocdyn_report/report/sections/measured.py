"""Measurements beside the computed values, a part of the sections on runs, responses and modes."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...comparisons import FREQUENCY, ORDER, PEAK, SERIES, Comparison, read_comparisons
from ...speed_results import Response
from ..content import Block, Cell, Figure, Heading, Panel, Table, by_columns, cut, number
from ..numbers import NONE, number_text
from ..readable import texts
from ..sources import Sources

MOST_ROWS = 60
MOST_DRAWN = 8  # measurements, in the order of the input
WIDTH = 200  # of a panel on paper [pixels]
DETAIL = 20  # turns of a signal about its largest difference
DIGITS = 4


def measured_blocks(sources: Sources, folder: Path, report: str, of: str = "", response: Response | None = None) -> list[Block]:
    """A heading, the statistics of all measurements, and curves; nothing without measurements. `of`: which load case."""
    found = read_comparisons(folder, report)
    if not found:
        return []
    blocks: list[Block] = [
        Heading(f"Measured and computed{of}", f"measured-{report.removesuffix('.json')}{'-'.join(of.split())}")
    ]
    blocks.extend(_modes(one) for one in found if one.kind == FREQUENCY)
    blocks.append(_statistics(sources, found, report, of))
    lines = [one for one in found if one.kind in (SERIES, ORDER) and len(one.measured) > 1]
    if drawn := [_panels(sources, one, response) for one in lines[:MOST_DRAWN]]:
        some = f": the first {MOST_DRAWN} of {len(lines)}" if len(lines) > MOST_DRAWN else ""
        what = "over the time" if lines[0].kind == SERIES else "over the speed"  # of a run, of a response
        caption = f"Measured and computed values {what}{of}, and their differences{some}"
        blocks.append(Figure(caption, [panel for row in drawn for panel in row], len(drawn[0])))
    if frequencies := [panel for one in found if one.kind == FREQUENCY for panel in _mode_panels(sources, one)]:
        caption = "Computed less measured natural frequencies; damping ratios over the measured and the computed frequencies"
        blocks.append(Figure(caption, frequencies, 2))
    return blocks


def _statistics(sources: Sources, found: Sequence[Comparison], report: str, of: str) -> Table:
    """Differences are computed less measured values, as the program prints them."""

    def amounts(key: str) -> list[Cell]:
        values = [None if key == "spread" and len(one.measured) < 2 else one.value(key) for one in found]
        shown = [sources.units.amount(value, one.unit, DIGITS) or NONE for one, value in zip(found, values)]
        return [Cell(word, _key(value), is_number=True) for word, value in zip(shown, values)]

    columns = [
        ("measurement", texts([one.name for one in found])),
        ("of", texts([one.subject for one in found])),
        ("values", [number(len(one.measured)) for one in found]),
        ("bias", amounts("bias")),
        ("spread", amounts("spread")),
        ("correlation", [number(one.facts.get("correlation"), DIGITS) for one in found]),
        ("largest difference", amounts("largest_difference")),
        ("at", texts([_place(sources, one) for one in found])),
    ]
    note = "Differences are computed less measured values; the bias is their mean, the spread their standard deviation about it."
    return cut(by_columns(f"Differences to what was measured{of}", columns, note), MOST_ROWS, report)


def _key(value: float | None) -> float:
    return float("inf") if value is None else value


def _place(sources: Sources, one: Comparison) -> str:
    """Where the largest difference is."""
    at = one.facts["largest_difference_at"]
    if one.kind == SERIES:
        return f"t = {number_text(at, DIGITS)} s"
    if one.kind == FREQUENCY:
        return f"mode {at:g}"
    is_of_run = one.kind == PEAK and one.table.columns[0].startswith("number")
    return "" if is_of_run else f"{number_text(sources.speed(at), DIGITS)} {sources.speed_unit}"


def _modes(one: Comparison) -> Table:
    """The frequencies of one measurement, mode by mode."""
    columns = [
        ("mode", [number(int(mode)) for mode in one.abscissa]),
        ("measured [Hz]", [number(value) for value in one.measured]),
        ("computed [Hz]", [number(value) for value in one.computed]),
        ("difference [%]", _relative(one.measured, one.computed)),
    ]
    if one.dampings:
        for word, values in zip(("measured", "computed"), one.dampings):
            columns.append((f"{word} damping ratio", [number(value, DIGITS) for value in values]))
        columns.append(("difference of damping [%]", _relative(*one.dampings)))
    return cut(by_columns(f"Measured natural frequencies: {one.name}", columns), MOST_ROWS, one.facts["file"])


def _relative(measured: np.ndarray, computed: np.ndarray) -> list[Cell]:
    return [number(100.0 * (other - value) / value if value else None, 3) for value, other in zip(measured, computed)]


def _mode_panels(sources: Sources, one: Comparison) -> list[Panel]:
    """Differences of the frequencies over the measured ones; damping ratios over both."""
    modes = [f"mode {mode:g}" for mode in one.abscissa]
    share = 100.0 * (one.computed - one.measured) / one.measured
    told = "; ".join(
        f"mode {mode:g}: measured {number_text(first)}, computed {number_text(second)} Hz"
        for mode, first, second in zip(one.abscissa.tolist(), one.measured.tolist(), one.computed.tolist())
    )

    def panel(label: str, unit: str, curves: list[dict], span: list[float] | None = None) -> Panel:
        room = 0.1 * float(np.ptp(both)) or 0.1 * float(both[0])
        x = {"label": "frequency", "unit": "Hz", "range": [max(0.0, float(both.min()) - room), float(both.max()) + room]}
        y = {"label": label, "unit": unit, **({"range": span} if span else {"zero": True})}
        spec = {"x": x, "y": y, "curves": curves, "nearest": True}
        return Panel(f"{one.name}: {label}", f"{label}: {told}.", spec)

    both = np.concatenate([one.measured, one.computed])
    points, short = sources.arrays.points, [f"{mode:g}" for mode in one.abscissa]
    span = [1.2 * min(0.0, float(share.min())), 1.2 * max(0.0, float(share.max()))]
    span = span if span[0] < span[1] else [-1.0, 1.0]
    panels = [panel("difference of the frequency", "%", [points("difference", one.measured, share, modes, names=short)], span)]
    if one.dampings:
        pairs = zip(("measured", "computed"), (one.measured, one.computed), one.dampings)
        panels.append(panel("damping ratio", "", [points(role, x, y, modes, role=role) for role, x, y in pairs]))
    return panels


def _curve(sources: Sources, one: Comparison, response: Response | None) -> tuple[np.ndarray, np.ndarray]:
    """Computed amplitudes of an order: at all speeds of the response if it has them, else at the measured ones."""
    for quantity in response.quantities if response else []:
        lines = [i for i, line in enumerate(response.lines) if line.is_order and line.value == one.facts["order"]]
        if quantity.label == one.facts["signal"] and quantity.orders is not None and lines:
            return np.array([sources.on_axis(response.axis, at) for at in response.speed]), quantity.orders[:, lines[0]]
    return np.array([sources.speed(float(value)) for value in one.abscissa]), one.computed


def _panels(sources: Sources, one: Comparison, response: Response | None) -> list[Panel]:
    """Both curves; of a series again about the largest difference, for they may fill their panel; the differences."""
    arrays, is_series = sources.arrays, one.kind == SERIES
    x = one.abscissa if is_series else np.array([sources.speed(float(value)) for value in one.abscissa])
    largest = max(np.abs(one.measured).max(), np.abs(one.computed).max())
    factor, unit = sources.units.shown(one.unit, float(largest))
    measured, computed = factor * one.measured, factor * one.computed
    axis = {"label": "time", "unit": "s"} if is_series else {"label": "speed", "unit": sources.speed_unit}
    title, told = f"{one.name}: {one.subject}", _told(sources, one)

    def panel(name: str, curves: list[dict], words: str) -> Panel:
        return Panel(name, words, {"x": axis, "y": {"label": "", "unit": unit}, "curves": curves})

    def both(part: slice) -> list[dict]:
        if not is_series:
            labels = [f"{number_text(float(at), DIGITS)} {sources.speed_unit}" for at in x]
            at, amplitudes = _curve(sources, one, response)
            curve = arrays.curve("computed", at, factor * amplitudes, role="computed")
            return [curve, arrays.points("measured", x, measured, labels, role="measured")]
        values = (("computed", computed), ("measured", measured))  # the first one is drawn on top
        return [arrays.curve(role, x[part], y[part], pixels=WIDTH, role=role) for role, y in values]

    curves = both(slice(None))
    panels = [panel(title, curves, f"Measured and computed values of {one.subject}; {told}.")]
    if is_series:
        part = _about(computed - measured)
        panels.append(panel("about the largest difference", both(part), f"The same about the largest difference; {told}."))
    difference = arrays.curve("difference", x, computed - measured, pixels=WIDTH, role="difference")
    return [*panels, panel("computed less measured", [difference], f"Differences of {one.subject}; {told}.")]


def _about(difference: np.ndarray) -> slice:
    """Some of its turns about the largest difference, at least a hundredth of all on both sides, for noise turns often."""
    turns = np.count_nonzero(np.diff(difference > difference.mean())) / 2
    half = int(max(DETAIL / 2 * len(difference) / max(1.0, turns), len(difference) / 100))
    centre = int(np.abs(difference).argmax())
    return slice(max(0, centre - half), centre + half + 1)


def _told(sources: Sources, one: Comparison) -> str:
    bias, spread = (sources.units.amount(one.value(key), one.unit, DIGITS) for key in ("bias", "spread"))
    return f"bias {bias}, spread {spread}"
