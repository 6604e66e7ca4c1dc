"""Natural frequencies, modes, and the tables of Holzer."""

import math

from ...modes_results import Modes, marks_of, motion_of
from ...results import RPM
from ...speed_results import roman
from ...train_layout import Train
from ..content import Figure, Heading, Panel, Paragraph, Section, Table, by_columns, cut, first, number, text
from ..numbers import name_and_unit, number_text, percent
from ..readable import texts
from ..sources import Sources
from .measured import measured_blocks

MOST_ROWS = 60
MOST_FURTHER = 12  # modes above those of the section
MOST_SHAPES = 8  # that are drawn
SHOWN_SHAPES = 3  # at first
MOST_TABLES = 4  # of Holzer
MOST_BODIES = 60  # of all of these tables
LEAST_MODES = 6  # that the section has
BEYOND = 1.5  # times the highest frequency of an order: modes above are no part of the section
LUMPED = "frequency in modes.csv [Hz]"  # in tables of machines whose shafts have inertia
SHARES, SMALLEST_SHARE = 3, 0.02  # of energies that are named


def modes_section(sources: Sources) -> Section | None:
    if not sources.has("modes"):
        return None
    section = Section("modes", f"Natural frequencies and modes{sources.main('modes')}")
    modes = sources.modes
    section.add(Paragraph(f"The machine is linearised about {modes.content['about']}."))
    if modes.oscillating:
        count = max(LEAST_MODES, sum(mode["frequency_Hz"] <= of_interest(sources) for mode in modes.oscillating))
        section.add(_frequencies(modes, modes.oscillating[:count], "Natural frequencies"))
        if further := modes.oscillating[count:]:
            told = (
                f"Modes above {number_text(modes.oscillating[count - 1]['frequency_Hz'], 4)} Hz: {len(further)}, in the appendix."
            )
            section.add(Paragraph(told))
            section.add_details(_frequencies(modes, further, "Further natural frequencies", MOST_FURTHER))
        if modes.shaped and len(modes.bodies) > 1:
            section.add(_shapes(sources, modes.shaped[:MOST_SHAPES]))
    else:
        section.add(Paragraph("Nothing oscillates: there is no mode with a frequency."))
    section.add(*measured_blocks(sources, sources.folder("modes"), "modes.json"))
    if others := [mode for mode in modes.content["modes"] if mode["kind"] != "oscillating"]:
        section.add_details(_others(others, modes))
    return section.add_details(Heading("Holzer tables", "holzer"), *_holzer(sources))


def of_interest(sources: Sources) -> float:
    """A frequency [Hz] above all that excite the machine; without a Campbell diagram all modes are of interest."""
    if not sources.has("campbell") or not sources.campbell.lines:
        return math.inf
    return BEYOND * max(float(frequency.max()) for _, frequency in sources.campbell.lines)


def _shares(values: list[float], names: list[str]) -> str:
    """As 'pump 48 %, motor 42 %'."""
    ranked = sorted(zip(values, names), reverse=True)[:SHARES]
    return ", ".join(f"{name} {percent(value, 2)}" for value, name in ranked if value >= SMALLEST_SHARE)


def _frequencies(modes: Modes, shown: list[dict], caption: str, most: int = MOST_ROWS) -> Table:
    damping = [number(mode["damping_ratio"], 3, "bad" if mode["damping_ratio"] < 0 else "") for mode in shown]
    marks = [", ".join(marks_of(mode)) for mode in shown]
    columns = [
        ("mode", [number(mode["mode"]) for mode in shown]),
        ("frequency [Hz]", [number(mode["frequency_Hz"]) for mode in shown]),
        ("frequency [1/min]", [number(RPM["Hz"] * mode["frequency_Hz"]) for mode in shown]),
        ("damping ratio", damping),
        ("kinetic energy in", texts([_shares(mode.get("kinetic_share", []), modes.kinetic_names) for mode in shown])),
        ("potential energy in", texts([_shares(mode.get("potential_share", []), modes.couplings) for mode in shown])),
        ("remark", [text(mark, "warn" if mark else "") for mark in marks]),
    ]
    grows = any(mode["damping_ratio"] < 0 for mode in shown)
    return cut(by_columns(caption, columns, "Negative damping: the mode grows." if grows else ""), most, "modes.csv")


def _others(others: list[dict], modes: Modes) -> Table:
    rows = []
    for mode in others:
        where = mode.get("state") or _shares(mode.get("kinetic_share", []), modes.kinetic_names)
        rows.append([text(mode["kind"]), number(mode["eigenvalue_1_s"][0]), number(mode.get("time_constant_s")), text(where)])
    rows, more = first(rows, MOST_ROWS, "modes.csv")
    columns = ["kind", "rate [1/s]", "time constant [s]", "kinetic energy in, or state"]
    return Table("Motions that do not oscillate", columns, rows, f"A negative rate decays. {more}".strip())


def _shapes(sources: Sources, shaped: list[dict]) -> Figure:
    """What moves in phase with the largest motion, along the shaft lines, one beside the other."""
    modes = sources.modes
    places, order = _abscissas(modes.train)
    curves = []
    for i, mode in enumerate(shaped):
        motion = motion_of(mode)
        x, y, labels = [], [], []
        for body in order:
            if body is None:
                x, y, labels = [*x, x[-1] + 0.5], [*y, math.nan], [*labels, ""]
            else:
                x, y, labels = [*x, places[body]], [*y, motion[body]], [*labels, modes.bodies[body]]
        name = f"{roman(mode['mode'])}: {number_text(mode['frequency_Hz'])} Hz"
        curve = {"name": name, "x": sources.arrays.put(x), "y": sources.arrays.put(y), "labels": labels}
        curves.append({**curve, "shown": i < SHOWN_SHAPES, "dots": True})
    ticks = [[places[body], modes.bodies[body]] for body in range(len(places))]
    spec = {
        "x": {"label": "", "unit": "", "ticks": ticks, "range": [min(places) - 0.5, max(places) + 0.5]},
        "y": {"label": "relative amplitude", "unit": "", "range": [-1.1, 1.1]},
        "curves": curves,
        "name": "mode",
    }
    told = "; ".join(f"mode {mode['mode']} at {number_text(mode['frequency_Hz'])} Hz" for mode in shaped)
    lines = " Shaft lines stand one beside the other." if modes.train.lines > 1 else ""
    panel = Panel("", f"Curves of the relative amplitudes of the bodies: {told}.", spec)
    return Figure(f"Shapes of the modes along the train.{lines}", [panel])


def _abscissas(train: Train) -> tuple[list[float], list[int | None]]:
    """Where the bodies stand on one axis, and their order with gaps between the shaft lines."""
    places = [0.0] * len(train.place)
    order: list[int | None] = []
    x = 0.0
    for line in range(train.lines):
        members = sorted((b for b in range(len(places)) if train.line[b] == line), key=lambda b: train.place[b])
        if order:
            order.append(None)
            x += 0.5
        for body in members:
            places[body] = x
            order.append(body)
            x += 1.0
    return places, order


def _holzer(sources: Sources) -> list[Paragraph | Table]:
    if not sources.has("holzer"):
        return [Paragraph(sources.results.of["holzer"].message)]
    table = sources.table("holzer", "holzer.csv")
    if not len(table):
        return [Paragraph("No mode oscillates: there is no table.")]
    blocks: list[Paragraph | Table] = []
    frequencies = dict(zip(table["mode"], table["frequency [Hz]"].astype(float)))
    limit = of_interest(sources)
    rows = len(table) // len(frequencies)  # of a table: many if shafts have nodes
    most = max(1, min(MOST_TABLES, MOST_BODIES // rows))
    shown = [mode for mode, frequency in frequencies.items() if frequency <= limit][:most] or list(frequencies)[:1]
    columns = [name for name in table.columns if name not in ("mode", "frequency [Hz]", LUMPED)]
    for mode in shown:
        part = table[table["mode"] == mode]
        caption = f"Holzer table of undamped mode {mode}, {number_text(frequencies[mode])} Hz"
        if LUMPED in part and (other := number_text(float(part[LUMPED].iloc[0]))) != number_text(frequencies[mode]):
            caption += f"; the modes have {other} Hz"
        content = []
        for name in columns:
            head, unit = name_and_unit(name.replace("omega^2", "ω²").replace("theta", "θ"))
            if _is_text(name):
                content.append((name, texts(["" if value != value else value for value in part[name]])))
            else:
                content.append(sources.units.column(head, unit if unit != "rad" else "1", list(map(_finite, part[name])), 4))
        blocks.append(cut(by_columns(caption, content, is_sorted=False), MOST_BODIES, "holzer.csv"))
    if len(shown) < len(frequencies):
        blocks.append(Paragraph(f"holzer.csv has the tables of all {len(frequencies)} modes."))
    return blocks


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _is_text(column: str) -> bool:
    return column in ("body", "to", "by")
