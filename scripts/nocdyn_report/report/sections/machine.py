"""The machine: its drawing and the mass-elastic table."""

import math

from ..content import Cell, Section, Table, by_columns, cut, number, text
from ..numbers import number_text, unit_text
from ..readable import texts
from ..sources import Sources
from ..train_svg import train_drawing

MOST_ROWS = 100
ACTING = ("motor", "load", "excitation", "drive", "engine")


def machine_section(sources: Sources) -> Section:
    return Section("machine", "Machine", [train_drawing(sources.check, sources.groups)])


def data_section(sources: Sources) -> Section:
    section = Section("mass-elastic", "Mass-elastic data")
    tables = [
        _bodies(sources),
        _couplings(sources),
        _segments(sources),
        _constraints(sources),
        _joints(sources),
        _torques(sources),
    ]
    return section.add(*(cut(table, MOST_ROWS, "the input") for table in tables if table.rows))


def _bodies(sources: Sources) -> Table:
    bodies = sources.check["bodies"]
    has_shafts = any(body["inertia_kg_m2"] != body["inertia_with_shafts_kg_m2"] for body in bodies)
    has_ratios = any(body["coordinates"] != [body["name"]] for body in bodies)
    columns = ["body", "inertia [kg m2]"]
    columns += ["with ends of shafts [kg m2]"] if has_shafts else []
    columns += ["speed as", "referred inertia [kg m2]"] if has_ratios else []
    rows = []
    starts = {body["start_speed_rad_s"] for body in bodies}
    columns += [f"speed at the start [{sources.speed_unit}]"] if len(starts) > 1 else []
    for body in bodies:
        row = [text(body["name"]), number(body["inertia_kg_m2"])]
        row += [number(body["inertia_with_shafts_kg_m2"])] if has_shafts else []
        row += [text(_relation(body)), number(body.get("referred_inertia_kg_m2"))] if has_ratios else []
        row += [number(sources.speed(body["start_speed_rad_s"]))] if len(starts) > 1 else []
        rows.append(row)
    notes = []
    if has_shafts:
        notes.append("The ends of a shaft have a part of its inertia; the rest is in its inner nodes.")
    if has_ratios:
        notes.append("Referred inertia: times the square of the ratio of speeds, at the speed of the body that is named.")
    return Table("Bodies with their inertias", columns, rows, " ".join(notes))


def _relation(body: dict) -> str:
    """'-0.333 x pinion'."""
    if body["coordinates"] == [body["name"]]:
        return "own"
    times = "\N{NARROW NO-BREAK SPACE}\N{MULTIPLICATION SIGN}\N{NARROW NO-BREAK SPACE}"
    terms = [f"{number_text(ratio)}{times}{name}" for ratio, name in zip(body["ratios"], body["coordinates"])]
    return " + ".join(terms) or "held"


def _couplings(sources: Sources) -> Table:
    given = {group["name"].lower(): group for kind in ("coupling", "shaft", "mesh") for group in sources.groups(kind)}
    found = sources.check["couplings"]
    laws = []
    for one in found:
        group = given.get(one["name"].lower(), {})
        laws.append(_law({key: value for key, value in group.items() if key != "damping"}, sources))  # in a column of its own
    columns = [
        ("name", texts([one["name"] for one in found])),
        ("kind", texts([one["kind"] for one in found])),
        ("between", texts([" \N{EN DASH} ".join(one["bodies"]) for one in found])),
    ]
    for key, head, unit in TANGENTS:
        columns.append(sources.units.column(head, unit, [one.get(key) for one in found]))
    note = "Stiffness and damping are the tangents at the start of a run."
    return by_columns("Couplings, shafts and meshes", [*columns, ("law and damping as given", texts(laws))], note)


TANGENTS = (
    ("stiffness_N_m_rad", "stiffness", "N m/rad"),
    ("damping_N_m_s_rad", "damping", "N m s/rad"),
    ("stiffness_N_m", "stiffness of teeth", "N/m"),
    ("damping_N_s_m", "damping of teeth", "N s/m"),
)
LAW_KEYS = {  # of the input, as the table calls them, with their units
    "cubic_stiffness": ("cubic", "N m/rad3"),
    "polynomial": ("polynomial", ""),
    "gap": ("gap", "rad"),
    "friction": ("friction", "N m"),
    "rest_twist": ("rest twist", "rad"),
    "magnifier": ("magnifier", ""),
    "relative_damping": ("relative damping", ""),
    "damping_ratio": ("damping ratio", ""),
    "damping_frequency": ("viscous at", "rad/s"),
    "damping": ("damping", "N m s/rad"),
    "saturation": ("saturation", "N m"),
}


JOINT_KEYS = {  # likewise, of joints
    "capacity": ("capacity", "N m"),
    "static_capacity": ("static capacity", "N m"),
    "angle": ("angle", "rad"),
    "crank_radius": ("crank radius", "m"),
    "rod_length": ("rod length", "m"),
    "piston_mass": ("piston", "kg"),
    "rod_mass": ("rod", "kg"),
}


def _given(group: dict, sources: Sources) -> str:
    """What tells a joint."""
    parts = [str(group[key]) for key in ("kind", "direction") if key in group]
    return (
        ", ".join(parts + [_value(key, group[key], JOINT_KEYS[key], sources) for key in JOINT_KEYS if _is_told(group.get(key))])
        or NO_KIND
    )


def _law(group: dict, sources: Sources) -> str:
    parts = []
    for key, (word, unit) in LAW_KEYS.items():
        value = group.get(key)
        if _is_told(value):
            parts.append(_value(key, value, (word, unit), sources))
        elif isinstance(value, list):
            parts.append(f"{word} by table")
    return ", ".join(parts) or "linear"


def _is_told(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and value != 0


FROM_SI = {"Hz": 0.5 / math.pi, "rpm": 30.0 / math.pi, "deg": 180.0 / math.pi}


def _value(key: str, value: float, told: tuple[str, str], sources: Sources) -> str:
    """A number in the unit in which the input gives it."""
    word, unit = told
    given = sources.given_unit(key, unit)
    value = float(f"{value * FROM_SI[given]:.10g}") if given != unit else value
    return f"{word} {number_text(value)} {unit_text(given)}".rstrip()


def _segments(sources: Sources) -> Table:
    names, values = [], []
    keys = ("length_m", "diameter_m", "bore_m", "stiffness_N_m_rad", "inertia_kg_m2")
    for shaft in sources.check["shafts"]:
        parts = list(zip(*(shaft[key] for key in keys)))
        names += [(shaft["name"], i) for i in range(1, len(parts) + 1)]
        values += parts
    columns = [("shaft", texts([name for name, _ in names])), ("segment", [number(i) for _, i in names])]
    heads = (("length", "m"), ("diameter", "m"), ("bore", "m"), ("stiffness", "N m/rad"), ("inertia", "kg m2"))
    columns += [sources.units.column(head, unit, [row[i] for row in values]) for i, (head, unit) in enumerate(heads)]
    return by_columns("Segments of the shafts", columns)


def _constraints(sources: Sources) -> Table:
    teeth = {group["name"].lower(): group for kind in ("gear", "planetary") for group in sources.groups(kind)}
    rows = []
    for one in sources.check["constraints"]:
        group = teeth.get(one["name"].lower(), {})
        given = next(
            (f"{key} {', '.join(map(number_text, _listed(group[key])))}" for key in ("teeth", "radii") if key in group), ""
        )
        terms = [f"{number_text(c)} ω({body})" for c, body in zip(one["coefficients"], one["bodies"])]
        relation = " + ".join(terms).replace("+ \N{MINUS SIGN}", "\N{MINUS SIGN} ") + " = 0"
        rows.append([text(one["name"]), text(one["kind"]), text(relation), number(one.get("ratio")), text(given)])
    columns = ["name", "kind", "relation of speeds", "ratio of speeds, second to first", "as given"]
    return Table("Gears and other rigid relations", columns, rows)


def _listed(value: object) -> list:
    return value if isinstance(value, list) else [value]


def _joints(sources: Sources) -> Table:
    """What has neither a stiffness nor a row that is always there."""
    elastic = {one["name"].lower() for one in sources.check["couplings"]}
    rows: list[list[Cell]] = []
    for kind in ("coupling", "clutch", "freewheel", "cardan", "crank", "relation"):
        for group in sources.groups(kind):
            if kind == "coupling" and group["name"].lower() in elastic:
                continue
            bodies = group.get("bodies", group.get("body", []))
            law = _law(group, sources) if kind == "coupling" else _given(group, sources)
            rows.append(
                [text(group.get("name", "")), text(kind), text(" \N{EN DASH} ".join(map(str, _listed(bodies)))), text(law)]
            )
    return Table("Joints without elasticity", ["name", "kind", "bodies", "law"], rows)


def _torques(sources: Sources) -> Table:
    rows = []
    for kind in ACTING:
        for group in sources.groups(kind):
            bodies = _listed(group.get("body", group.get("cylinders", [])))
            words = [str(group["kind"])] if isinstance(group.get("kind"), str) else []
            rows.append(
                [text(group.get("name", "")), text(kind), text(", ".join(map(str, bodies))), text(", ".join(words) or NO_KIND)]
            )
    return Table("Motors, loads, excitations", ["name", "group", "acts on", "kind"], rows, "Their data are in the input.")


NO_KIND = "\N{EN DASH}"
