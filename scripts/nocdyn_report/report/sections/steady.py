"""The steady state."""

from collections.abc import Iterable

from ..content import Heading, Section, Table, first, number, rounded, text
from ..numbers import name_and_unit, number_text, unit_text
from ..sources import Sources

MOST_ROWS = 160
GROUPS = {  # tables, and the quantities that are columns of each
    "Speeds": ("omega", "phi", "slip"),
    "Couplings and shafts": ("twist", "deformation", "moment", "force", "damping", "shaft", "stress"),
    "Torques and reactions": ("torque", "throttle", "current", "reaction", "loss", "bearing"),
}
ENDS = ("_1", "_2", "_max")  # of a shaft: its moments


def steady_section(sources: Sources) -> Section | None:
    if not sources.has("equilibrium"):
        return None
    section = Section("steady", "Steady state")
    states = sources.equilibrium["steady_states"]
    elastic = {one["name"] for one in sources.check["couplings"]}
    for i, state in enumerate(states, start=1):
        which = f" {i} of {len(states)}" if len(states) > 1 else ""
        if which:
            section.add(Heading(f"State{which}", f"state-{i}"))
        section.add(*_values(state, which, elastic), _powers(state, which))
    return section


def stability_text(state: dict) -> str:
    """As 'Stable: disturbances decay with 0.98 1/s or faster.'"""
    growth = state.get("growth_rate_1_s")
    if state["stability"] == "stable" and growth is not None:
        return f"Stable: disturbances decay with {number_text(-growth)} 1/s or faster."
    if growth is not None and growth > 0:
        return f"{state['stability'].capitalize()}: disturbances grow with {number_text(growth)} 1/s."
    return f"Stability: {state['stability']}."


def _values(state: dict, which: str, elastic: set[str]) -> Iterable[Table]:
    """A table for each group of quantities: a row for each element, a column for each quantity of it."""
    values = rounded(state["values"], {label: name_and_unit(label)[1] for label in state["values"]})
    tables: dict[str, dict[str, dict[str, float]]] = {title: {} for title in GROUPS}
    others = []
    for label, value in values.items():
        name, unit = name_and_unit(label)
        quantity, _, element = name.partition("_")
        title = next((title for title, kinds in GROUPS.items() if quantity in kinds), None)
        if title is None:
            others.append([text(name.replace("_", " ")), number(value), text(unit_text(unit))])
            continue
        end = next((end for end in ENDS if element.removesuffix(end) in elastic and element.endswith(end)), "")
        column = (
            f"{'speed' if quantity == 'omega' else 'angle' if quantity == 'phi' else quantity}{end.replace('_', ' ')} [{unit}]"
        )
        tables[title].setdefault(element.removesuffix(end), {})[column] = value
    for title, rows in tables.items():
        if rows:
            columns = list(dict.fromkeys(column for row in rows.values() for column in row))
            shown = [[text(element), *(number(row.get(column)) for column in columns)] for element, row in rows.items()]
            shown, more = first(shown, MOST_ROWS, "equilibrium.json")
            yield Table(f"Steady state{which}: {title.lower()}", ["element", *columns], shown, more)
    yield Table(f"Steady state{which}: energies", ["quantity", "value", "unit"], others, stability_text(state), is_sorted=False)


def _powers(state: dict, which: str) -> Table:
    powers = rounded(state["power_W"], dict.fromkeys(state["power_W"], "W"))
    rows, more = first([[text(name), number(power)] for name, power in powers.items()], MOST_ROWS, "equilibrium.json")
    residual = rounded({"sum": state["power_residual_W"], "in": state["power_put_in_W"]}, {"sum": "W", "in": "W"})["sum"]
    note = f"In all {number_text(state['power_put_in_W'])} W are put in; the sum of all is {number_text(residual)} W."
    return Table(f"Steady state{which}: power into the machine", ["element", "power [W]"], rows, f"{note} {more}".strip())
