"""The operating point, and other steady states."""

from collections.abc import Iterable

from ...columns import DETAIL, LOSS, SLIP, SPEED, Column
from ..content import Block, Heading, Paragraph, Section, Table, by_columns, cut, text
from ..naming import WHOLE
from ..numbers import number_text
from ..readable import texts
from ..sources import Sources

MOST_ROWS = 100
EQUAL = 1e-6  # relative difference of speeds that are one
SHORT = {"total_moment": "moment", "stress": "shear stress"}  # heads of kinds that elements of several sorts have
ELASTIC = ("coupling", "shaft", "mesh")


def steady_section(sources: Sources) -> Section | None:
    if not sources.has("equilibrium"):
        return None
    states = ordered_states(sources.equilibrium)
    section = Section("steady", f"Operating point{sources.main('equilibrium')}")
    section.add(*_of_state(sources, states[0], ""))
    if len(states) > 1:
        section.add(Paragraph(f"Other steady states: {len(states) - 1}, in the appendix."))
        for i, state in enumerate(states[1:], start=2):
            section.add_details(
                Heading(f"Steady state {i} of {len(states)}", f"state-{i}"), *_of_state(sources, state, f", state {i}")
            )
    return section


def ordered_states(equilibrium: dict) -> list[dict]:
    """Those in which the machine can stay first; of these, the ones in which it moves, then the ones nearest to its start."""
    return sorted(
        equilibrium["steady_states"], key=lambda state: (state["stability"] != "stable", state.get("is_at_rest", False))
    )


def stability_text(state: dict) -> str:
    """As 'Stable: disturbances decay at 0.98 1/s or faster.'"""
    growth = state.get("growth_rate_1_s")
    if state["stability"] == "stable" and growth is not None:
        return f"Stable: disturbances decay at {number_text(-growth, 4)} 1/s or faster."
    if growth is not None and growth > 0:
        return f"{state['stability'].capitalize()}: disturbances grow at {number_text(growth, 4)} 1/s."
    return f"Stability: {state['stability']}."


def _of_state(sources: Sources, state: dict, which: str) -> list[Block]:
    columns = sources.steady_columns
    shown = [(columns[label], value) for label, value in state["values"].items() if columns[label].element]
    powers = {name.lower(): value for name, value in state["power_W"].items()}
    power = sources.units.amount(state["power_put_in_W"], "W")
    told = f"{stability_text(state)} {power} are put in. Torques that keep changing enter with their means."
    blocks: list[Block] = [Paragraph(told), *_speeds(sources, shown, which)]
    for title, is_elastic in (("moments of couplings and shafts", True), ("torques, reactions and powers", False)):
        chosen = [
            (one, value)
            for one, value in shown
            if one.rank not in (SPEED, SLIP, DETAIL) and not one.is_inner and (one.element_kind in ELASTIC) == is_elastic
        ]
        table = _table(sources, f"Steady state{which}: {title}", chosen, {} if is_elastic else powers)
        if table.rows:
            blocks.append(cut(table, MOST_ROWS, "equilibrium.json"))
    return blocks


def _speeds(sources: Sources, shown: list[tuple[Column, float]], which: str) -> Iterable[Block]:
    """Bodies of one speed are one row."""
    groups: list[tuple[Column, float, list[str]]] = []
    for one, value in shown:
        if one.rank not in (SPEED, SLIP) or one.is_inner:
            continue
        same = next(
            (group for group in groups if group[0].sort == one.sort and abs(group[1] - value) <= EQUAL * abs(value)), None
        )
        if same:
            same[2].append(one.title)
        else:
            groups.append((one, value, [one.title]))
    for sort in dict.fromkeys(group[0].sort for group in groups):
        mine = [group for group in groups if group[0].sort == sort]
        cells = [text(_listed(names)) for _, _, names in mine]
        head, values = sources.units.column(sort[1], sort[2], [value for _, value, _ in mine])
        yield cut(by_columns(f"Steady state{which}: {sort[1]}", [("of", cells), (head, values)]), MOST_ROWS, "equilibrium.json")


def _listed(names: list[str]) -> str:
    return ", ".join(names) if len(names) <= 12 else f"{', '.join(names[:8])} and {len(names) - 8} more"


def _table(sources: Sources, caption: str, shown: list[tuple[Column, float]], powers: dict[str, float]) -> Table:
    """A row for each element, a column for each quantity of it."""
    rows: dict[tuple[str, str], dict[str, float]] = {}
    units: dict[str, str] = {}
    whole = {(one.kind, one.element_kind, one.element) for one, _ in shown if one.point in WHOLE}
    for one, value in shown:
        is_part = one.point not in WHOLE and (one.kind, one.element_kind, one.element) in whole
        if is_part or (one.rank == LOSS and not value):
            continue
        head = SHORT.get(one.kind) or f"{one.caption} {one.point}".rstrip()
        units[head] = one.unit
        rows.setdefault((one.element_kind, one.element), {})[head] = value
    columns = [("element", texts([f"{kind} {element}" if powers else element for kind, element in rows]))]
    columns += [sources.units.column(head, unit, [row.get(head) for row in rows.values()]) for head, unit in units.items()]
    if powers:
        columns.append(sources.units.column("power", "W", [powers.get(f"{kind} {element}".lower()) for kind, element in rows]))
    return by_columns(caption, columns)
