"""Machines of openTorsion as JSON, in its format TORS.

What its parser reads (opentorsion/parser.py, openTorsion 0.3.2): `components` with `elements` in a row, and `structure`, pairs
of an element and the component that begins there. Nodes lie between shafts; a gear with a parent begins a new one. Lengths and
diameters of shafts are in mm, the rest in SI; R1 w1 + R2 w2 = 0 at gears (opentorsion/assembly.py, E).
"""

import json

from nocdyn_import.machine import FILES, Machine, Quantity, SourceError

SHEAR_MODULUS, DENSITY = 80e9, 8000.0  # [Pa], [kg/m3], of openTorsion
KNOWN = {
    "Disk": {"inertia", "damping"},
    "ShaftDiscrete": {"stiffness", "damping"},
    "ShaftContinuous": {"length", "outerDiameter", "innerDiameter", "density", "damping"},
    "GearElement": {"inertia", "damping", "teeth", "diameter", "parent"},
}
NEEDED = {
    "Disk": ["inertia"],
    "ShaftDiscrete": ["stiffness"],
    "ShaftContinuous": ["length", "outerDiameter"],
    "GearElement": ["inertia"],
}
COMMON = {"name", "type", "excitation", "id"}


def read_tors(source):
    try:
        data = json.loads(source.read_text(encoding="utf-8-sig"))
    except json.JSONDecodeError as error:
        raise SourceError([f"{source}:{error.lineno}: not JSON: {error.msg} in column {error.colno}"]) from None
    except UnicodeDecodeError:
        raise SourceError([f"{source}: not a text in UTF-8"], FILES) from None
    return Train(source, data).machine


class Train:
    """The components, joined as `structure` says."""

    def __init__(self, source, data):
        self.source, self.wrong = source, []
        components = data.get("components") if isinstance(data, dict) else None
        if not isinstance(components, list) or not components:
            raise SourceError([f"{source}: no machine of openTorsion; needed: an object with components and structure"])
        self.components = {}
        for component in components:
            self.check(component)
        self.joins = self.joints(data.get("structure", []))
        self.stop_if_wrong()
        self.machine = Machine(source, str(data.get("name", "")))
        self.nodes = []  # [inertia, damping, name]
        self.taken, self.groups, self.gears = set(), [], {}
        ends = {end.split(".")[0] for end in self.joins.values()}
        starts = [name for name in self.components if name not in ends]
        if len(starts) != 1:
            found = ", ".join(starts) or "none"
            raise SourceError([f"{source}: structure: components at which no other one ends: {found}; needed: exactly one"])
        self.placed = set()
        self.place(starts[0], self.new_node())
        left = [name for name in self.components if name not in self.placed]
        if left:
            raise SourceError([f"{source}: structure: not connected to the others: {', '.join(left)}"])
        self.write()

    def fail(self, where, text):
        self.wrong.append(f"{self.source}: {where}: {text}")

    def stop_if_wrong(self):
        if self.wrong:
            raise SourceError(self.wrong)

    def check(self, component):
        name = component.get("name") if isinstance(component, dict) else None
        elements = component.get("elements") if name else None
        if not isinstance(name, str) or not isinstance(elements, list):
            self.fail("components", "needed: objects with name and elements")
            return
        if name in self.components:
            self.fail(name, "the name of two components")
        self.components[name] = component
        for element in elements:
            if not isinstance(element, dict) or not isinstance(element.get("name"), str):
                self.fail(name, f"element {element!r}; needed: objects with name and type"[:200])
                continue
            kind = element.get("type")
            where = f"{name}.{element.get('name')}"
            if kind not in KNOWN:
                self.fail(where, f"type = {kind!r} is not known; allowed: {', '.join(KNOWN)}")
                continue
            for key in NEEDED[kind]:
                if key not in element:
                    self.fail(where, f"{key} is missing")
            if kind == "GearElement" and not {"teeth", "diameter"} & element.keys():
                self.fail(where, "teeth or diameter is missing")
            for key in KNOWN[kind] - {"parent"}:
                value = element.get(key, 0)
                if isinstance(value, bool) or not isinstance(value, int | float):
                    self.fail(where, f"{key} = {value!r} is not a number")

    def joints(self, structure):
        joins = {}
        for pair in structure if isinstance(structure, list) else []:
            if not (isinstance(pair, list) and len(pair) == 2 and all(isinstance(end, str) and "." in end for end in pair)):
                self.fail("structure", f"{pair!r}; needed: pairs 'COMPONENT.ELEMENT'")
                continue
            for end in pair:
                component, element = end.split(".", 1)
                elements = self.components.get(component, {}).get("elements", [])
                if element not in [one.get("name") for one in elements]:
                    self.fail("structure", f"there is no element {end!r}")
            joins[pair[0]] = pair[1]
        return joins

    def new_node(self):
        self.nodes.append([0.0, 0.0, None])
        return len(self.nodes) - 1

    def place(self, name, node):
        """Places the elements of a component, the first one at a node, and what is connected to them."""
        if name in self.placed:
            raise SourceError([f"{self.source}: structure: {name} is reached twice; allowed: trees of components"])
        self.placed.add(name)
        for element in self.components[name]["elements"]:
            where = f"{name}.{element['name']}"
            kind = element["type"]
            if kind == "GearElement" and f"{name}.{element.get('parent')}" in self.gears:
                node = self.new_node()
            if kind in ("Disk", "GearElement"):
                self.nodes[node][0] += element["inertia"]
                self.nodes[node][1] += element.get("damping", 0)
                self.nodes[node][2] = self.nodes[node][2] or where
            if kind == "GearElement":
                self.add_gear(where, name, element, node)
            elif kind != "Disk":
                far = self.new_node()
                self.groups.append((where, kind, element, node, far))
                node = far
            self.tell_rest(where, element)
            if where in self.joins:
                self.place(self.joins[where].split(".", 1)[0], node)

    def add_gear(self, where, component, element, node):
        size = element.get("teeth", element.get("diameter"))
        parent = self.gears.get(f"{component}.{element.get('parent')}")
        self.gears[where] = (node, size, "teeth" in element)
        if parent:
            self.groups.append((where, "gear", (parent[1], size, parent[2] and "teeth" in element), parent[0], node))
        elif "parent" in element:
            self.machine.note(f"{where}: its parent {element['parent']!r} comes later or is missing; the gear is an inertia only")

    def tell_rest(self, where, element):
        if "excitation" in element:
            self.machine.note(f"{where}: its excitation is not imported; &engine or &excitation describe one")
        rest = sorted(element.keys() - COMMON - KNOWN[element["type"]])
        if rest:
            self.machine.note(f"{where}: not imported: {', '.join(rest)}")

    def write(self):
        names = []
        for number, (inertia, damping, where) in enumerate(self.nodes, 1):
            place = f"{self.source}: {where or f'node {number}, without a disk'}"
            names.append(self.machine.own_name(where or f"node {number}", self.taken, f"node {number}"))
            self.machine.add(place, "body", {}, name=names[-1], inertia=float(inertia))
            if damping:
                self.machine.add(place, "load", {}, name=f"damping of {names[-1]}"[:63], body=names[-1], viscous=float(damping))
        for where, kind, element, first, last in self.groups:
            place = f"{self.source}: {where}"
            ends = {"name": self.machine.own_name(where, self.taken, kind), "bodies": [names[first], names[last]]}
            if kind == "ShaftDiscrete":
                stiffness, damping = float(element["stiffness"]), float(element.get("damping", 0))
                self.machine.add(place, "coupling", {}, **ends, stiffness=stiffness, damping=damping or None)
            elif kind == "gear":
                size = "teeth" if element[2] and all(float(teeth).is_integer() for teeth in element[:2]) else "radii"
                values = [int(one) if size == "teeth" else float(one) / 2 for one in element[:2]]
                self.machine.add(place, "gear", {}, **ends, **{size: values})
            else:
                self.add_continuous(place, element, ends)

    def add_continuous(self, place, element, ends):
        self.machine.note(
            f"{ends['name']}: a shaft with distributed inertia, by the wave equation; openTorsion has one finite element"
        )
        self.machine.note(f"{ends['name']}: shear modulus {SHEAR_MODULUS:g} Pa, which openTorsion takes for all shafts")
        self.machine.note(f"{ends['name']}: length and diameters are taken in mm, as openTorsion takes them")
        if "density" not in element:
            self.machine.note(f"{ends['name']}: density is not given; {DENSITY:g} kg/m3, as openTorsion takes it")
        if element.get("damping"):
            self.machine.note(f"{ends['name']}: not imported: damping, which openTorsion ignores in continuous shafts")
        self.machine.add(
            place,
            "shaft",
            {},
            **ends,
            lengths=Quantity(f"{element['length']!r} mm"),
            diameters=Quantity(f"{element['outerDiameter']!r} mm"),
            bores=Quantity(f"{element.get('innerDiameter', 0)!r} mm"),
            shear_modulus=SHEAR_MODULUS,
            density=float(element.get("density", DENSITY)),
        )
