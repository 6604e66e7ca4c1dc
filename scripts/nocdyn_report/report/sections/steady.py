"""The steady state."""

from collections.abc import Iterable

from ...columns import SLIP, SPEED, Column
from ..content import Heading, Section, Table, first, number, rounded, text
from ..numbers import number_text, unit_text
from ..sources import Sources

MOST_ROWS = 100
ELASTIC = ("coupling", "shaft", "mesh")
TORQUES = ("Couplings and shafts", "Torques and reactions")


def steady_section(sources: Sources) -> Section | None:
    if not sources.has("equilibrium"):
        return None
    section = Section("steady", "Steady state")
    states = sources.equilibrium["steady_states"]
    for i, state in enumerate(states, start=1):
        which = f" {i} of {len(states)}" if len(states) > 1 else ""
        if which:
            section.add(Heading(f"State{which}", f"state-{i}"))
        section.add(*_values(state, which, sources.steady_columns), _powers(state, which))
    return section


def stability_text(state: dict) -> str:
    """As 'Stable: disturbances decay at 0.98 1/s or faster.'"""
    growth = state.get("growth_rate_1_s")
    if state["stability"] == "stable" and growth is not None:
        return f"Stable: disturbances decay at {number_text(-growth)} 1/s or faster."
    if growth is not None and growth > 0:
        return f"{state['stability'].capitalize()}: disturbances grow with {number_text(growth)} 1/s."
    return f"Stability: {state['stability']}."


def _values(state: dict, which: str, columns: dict[str, Column]) -> Iterable[Table]:
    """A table for each group of quantities: a row for each element, a column for each quantity of it."""
    values = rounded(state["values"], {label: columns[label].unit for label in state["values"]})
    tables: dict[str, dict[str, dict[str, float]]] = {title: {} for title in ("Speeds", *TORQUES)}
    others = []
    for label, value in values.items():
        one = columns[label]
        if not one.element:
            others.append([text(one.caption), number(value), text(unit_text(one.unit))])
            continue
        title = "Speeds" if one.rank in (SPEED, SLIP) else TORQUES[one.element_kind not in ELASTIC]
        head = f"{one.caption} {one.point}".rstrip() + f" [{one.unit}]"
        tables[title].setdefault(one.element, {})[head] = value
    for title, rows in tables.items():
        if rows:
            heads = list(dict.fromkeys(head for row in rows.values() for head in row))
            shown = [[text(element), *(number(row.get(head)) for head in heads)] for element, row in rows.items()]
            shown, more = first(shown, MOST_ROWS, "equilibrium.json")
            yield Table(f"Steady state{which}: {title.lower()}", ["element", *heads], shown, more)
    yield Table(f"Steady state{which}: energies", ["quantity", "value", "unit"], others, stability_text(state), is_sorted=False)


def _powers(state: dict, which: str) -> Table:
    powers = rounded(state["power_W"], dict.fromkeys(state["power_W"], "W"))
    rows, more = first([[text(name), number(power)] for name, power in powers.items()], MOST_ROWS, "equilibrium.json")
    residual = rounded({"sum": state["power_residual_W"], "in": state["power_put_in_W"]}, {"sum": "W", "in": "W"})["sum"]
    note = f"In all {number_text(state['power_put_in_W'])} W are put in; the sum of all is {number_text(residual)} W."
    return Table(f"Steady state{which}: power into the machine", ["element", "power [W]"], rows, f"{note} {more}".strip())
