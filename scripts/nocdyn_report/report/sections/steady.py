"""The steady state."""

from ..content import Heading, Section, Table, first, number, text
from ..numbers import name_and_unit, number_text, unit_text
from ..sources import Sources

MOST_ROWS = 160


def steady_section(sources: Sources) -> Section | None:
    if not sources.results.has("equilibrium"):
        return None
    section = Section("steady", "Steady state")
    states = sources.equilibrium["steady_states"]
    for i, state in enumerate(states, start=1):
        which = f" {i} of {len(states)}" if len(states) > 1 else ""
        if which:
            section.add(Heading(f"State{which}", f"state-{i}"))
        rows = []
        for label, value in state["values"].items():
            name, unit = name_and_unit(label)
            rows.append([text(name), number(value), text(unit_text(unit))])
        rows, more = first(rows, MOST_ROWS, "equilibrium.json")
        note = f"{stability_text(state)} {more}".strip()
        section.add(Table(f"Steady state{which}: speeds, twists, moments, torques", ["quantity", "value", "unit"], rows, note))
        section.add(_powers(state, which))
    return section


def stability_text(state: dict) -> str:
    """As 'Stable: disturbances decay with 0.98 1/s or faster.'"""
    growth = state.get("growth_rate_1_s")
    if state["stability"] == "stable" and growth is not None:
        return f"Stable: disturbances decay with {number_text(-growth)} 1/s or faster."
    if growth is not None and growth > 0:
        return f"{state['stability'].capitalize()}: disturbances grow with {number_text(growth)} 1/s."
    return f"Stability: {state['stability']}."


def _powers(state: dict, which: str) -> Table:
    rows = [[text(name), number(power)] for name, power in state["power_W"].items()]
    rows, more = first(rows, MOST_ROWS, "equilibrium.json")
    note = f"In all {number_text(state['power_put_in_W'])} W are put in; the sum of all is {number_text(state['power_residual_W'])} W."
    return Table(f"Steady state{which}: power into the machine", ["element", "power [W]"], rows, f"{note} {more}".strip())
