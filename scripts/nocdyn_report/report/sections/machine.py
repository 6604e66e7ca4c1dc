"""The machine: its drawing and the mass-elastic table."""

from ..content import Cell, Heading, Section, Table, first, number, text
from ..numbers import number_text, unit_text
from ..sources import Sources
from ..train_svg import train_drawing

MOST_ROWS = 100
ACTING = ("motor", "load", "excitation", "drive", "engine")


def machine_section(sources: Sources) -> Section:
    section = Section("machine", "Machine")
    section.add(train_drawing(sources.check, sources.groups))
    section.add(Heading("Bodies", "bodies"), _cut(_bodies(sources)))
    if sources.check["couplings"]:
        section.add(Heading("Couplings and shafts", "couplings"), _cut(_couplings(sources)))
    if sources.check["shafts"]:
        section.add(_cut(_segments(sources)))
    if sources.check["constraints"]:
        section.add(Heading("Gears and other rigid relations", "gears"), _cut(_constraints(sources)))
    joints = _joints(sources)
    if joints.rows:
        section.add(_cut(joints))
    torques = _torques(sources)
    if torques.rows:
        section.add(Heading("Torques", "torques"), _cut(torques))
    return section


def _cut(table: Table) -> Table:
    """Its first rows."""
    table.rows, more = first(table.rows, MOST_ROWS, "the input")
    table.note = f"{table.note} {more}".strip()
    return table


def _bodies(sources: Sources) -> Table:
    bodies = sources.check["bodies"]
    has_shafts = any(body["inertia_kg_m2"] != body["inertia_with_shafts_kg_m2"] for body in bodies)
    has_ratios = any(body["coordinates"] != [body["name"]] for body in bodies)
    columns = ["body", "inertia [kg m2]"]
    columns += ["with ends of shafts [kg m2]"] if has_shafts else []
    columns += ["speed as", "referred inertia [kg m2]"] if has_ratios else []
    columns += [f"speed at the start [{sources.speed_unit}]"]
    rows = []
    for body in bodies:
        row = [text(body["name"]), number(body["inertia_kg_m2"])]
        row += [number(body["inertia_with_shafts_kg_m2"])] if has_shafts else []
        row += [text(_relation(body)), number(body.get("referred_inertia_kg_m2"))] if has_ratios else []
        rows.append([*row, number(sources.speed(body["start_speed_rad_s"]))])
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
    rows = []
    for one in sources.check["couplings"]:
        is_mesh = one["kind"] == "mesh"
        stiffness = one["stiffness_N_m" if is_mesh else "stiffness_N_m_rad"]
        damping = one["damping_N_s_m" if is_mesh else "damping_N_m_s_rad"]
        group = given.get(one["name"].lower(), {})
        given_damping = {key: value for key, value in group.items() if key != "damping"}  # in a column of its own
        rows.append(
            [
                text(one["name"]),
                text(one["kind"]),
                text(" \N{EN DASH} ".join(one["bodies"])),
                number(stiffness),
                number(damping),
                text("N/m, N s/m" if is_mesh else "N m/rad, N m s/rad"),
                text(_law(given_damping)),
            ]
        )
    columns = ["name", "kind", "between", "stiffness", "damping", "units", "law and damping as given"]
    note = "Stiffness and damping are the tangents at the start of a run."
    return Table("Couplings, shafts and meshes", columns, rows, note)


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


def _given(group: dict) -> str:
    """What tells a joint."""
    parts = [str(group[key]) for key in ("kind", "direction") if key in group]
    for key, (word, unit) in JOINT_KEYS.items():
        value = group.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value != 0:
            parts.append(f"{word} {number_text(value)} {unit_text(unit)}".rstrip())
    return ", ".join(parts) or NO_KIND


def _law(group: dict) -> str:
    parts = []
    for key, (word, unit) in LAW_KEYS.items():
        value = group.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value != 0:
            parts.append(f"{word} {number_text(value)} {unit_text(unit)}".rstrip())
        elif isinstance(value, list):
            parts.append(f"{word} by table")
    return ", ".join(parts) or "linear"


def _segments(sources: Sources) -> Table:
    rows = []
    for shaft in sources.check["shafts"]:
        keys = ("length_m", "diameter_m", "bore_m", "stiffness_N_m_rad", "inertia_kg_m2")
        for i, values in enumerate(zip(*(shaft[key] for key in keys)), start=1):
            rows.append([text(shaft["name"]), number(i), *map(number, values)])
    columns = ["shaft", "segment", "length [m]", "diameter [m]", "bore [m]", "stiffness [N m/rad]", "inertia [kg m2]"]
    return Table("Segments of the shafts", columns, rows)


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
            law = _law(group) if kind == "coupling" else _given(group)
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
