"""The drawing of the train as SVG: bodies as discs, shafts, gears, branches, torques."""

from collections.abc import Callable
from html import escape

from ..train_layout import GROUND, Train, lay_out
from .content import Drawing
from .numbers import number_text

STEP, ROW = 74.0, 150.0  # between two bodies of a shaft line, and between two lines [px]
TALLEST, SMALLEST = 92.0, 5.0  # heights of discs [px]
THICK = 13.0  # of a disc
MOST_NAMES = 40  # of bodies
MOST_BODIES = 120  # that are drawn; discs of more are thinner than a line on paper
LONGEST = 11  # characters of a name that stands upright
MARKS = {"motor": "M", "engine": "E", "load": "L", "excitation": "~", "drive": "D"}
PAD = 46.0
COLOURS = 7
LETTER = 6.5  # width of one in names and ratios
LEAST = 600.0  # width on a screen [px]


def train_drawing(check: dict, groups: Callable[[str], list[dict]]) -> Drawing:
    """Of a large machine the first bodies, with what joins them."""
    names, total = [body["name"] for body in check["bodies"][:MOST_BODIES]], len(check["bodies"])
    index = {name.lower(): i for i, name in enumerate(names)} | {"ground": GROUND}
    check = check | {"bodies": check["bodies"][:MOST_BODIES]}
    for kind in ("couplings", "constraints"):
        check[kind] = [one for one in check[kind] if _is_known(one["bodies"], index)]
    couplings = [(one, [index[name.lower()] for name in one["bodies"]]) for one in check["couplings"]]
    elastic = {one["name"].lower() for one in check["couplings"]}
    loose = [one for one in _joints(groups) if one["name"].lower() not in elastic and _is_known(one.get("bodies"), index)]
    joints = [(group, [index[str(name).lower()] for name in group["bodies"]]) for group in loose]
    meshes = [(one, [index[name.lower()] for name in one["bodies"]]) for one in check["constraints"]]
    pairs = [pair for one, bodies in couplings + joints for pair in _pairs(bodies)]
    train = lay_out(len(names), pairs, [pair for _, bodies in meshes for pair in _pairs(bodies)])
    picture = _Picture(names, check, train, dense=len(names) > MOST_NAMES)
    for one, bodies in couplings:
        picture.add_shaft(one, bodies)
    for group, bodies in joints:
        picture.add_shaft({"name": group["name"], "kind": "joint"}, bodies)
    for one, bodies in meshes:
        picture.add_mesh(one, bodies)
    picture.add_discs(_marks(groups, index))
    some = f" The first {len(names)} of {total} bodies are drawn." if total > len(names) else ""
    return Drawing(
        f"The train.{some} Heights of the discs: the fourth root of the inertia, as of discs of one thickness and one material",
        _description(names, check),
        picture.svg(),
    )


def _is_known(bodies: list[str] | None, index: dict[str, int]) -> bool:
    """Whether all bodies that something joins are drawn."""
    return bodies is not None and all(str(name).lower() in index for name in bodies)


def _pairs(bodies: list[int]) -> list[tuple[int, int]]:
    return [(bodies[0], other) for other in bodies[1:]]


def _joints(groups: Callable[[str], list[dict]]) -> list[dict]:
    """Also couplings without elasticity, that is of friction or damping only."""
    return [group for kind in ("coupling", "clutch", "freewheel", "cardan", "relation") for group in groups(kind)]


def _marks(groups: Callable[[str], list[dict]], index: dict[str, int]) -> dict[int, list[tuple[str, str]]]:
    """Signs of the torques on each body, with their names."""
    marks: dict[int, list[tuple[str, str]]] = {}
    for kind, sign in MARKS.items():
        for group in groups(kind):
            bodies = group.get("body", group.get("cylinders", []))
            for body in bodies if isinstance(bodies, list) else [bodies]:
                marks.setdefault(index.get(str(body).lower(), GROUND), []).append((sign, f"{kind} {group.get('name', '')}"))
    return marks


def _description(names: list[str], check: dict) -> str:
    joined = [f"{one['name']} between {' and '.join(one['bodies'])}" for one in check["couplings"]]
    geared = [f"{one['name']} of {', '.join(one['bodies'])}" for one in check["constraints"]]
    parts = [f"Drawing of a train of {len(names)} bodies: {', '.join(names[:MOST_NAMES])}"]
    if len(names) <= MOST_NAMES:
        parts += [f"Elastic: {'; '.join(joined)}"] if joined else []
        parts += [f"Rigid: {'; '.join(geared)}"] if geared else []
    return ". ".join(parts) + "."


class _Picture:
    def __init__(self, names: list[str], check: dict, train: Train, dense: bool) -> None:
        self.names, self.check, self.train, self.dense = names, check, train, dense
        self.step = 16.0 if dense else STEP
        rows = train.row
        self.top = max(rows, default=0)
        self.x = [PAD + self.step * place for place in train.place]
        self.y = [PAD + TALLEST / 2 + 24 + ROW * (self.top - row) for row in rows]
        largest = max((body["inertia_kg_m2"] for body in check["bodies"]), default=0.0) or 1.0
        self.height = [max(SMALLEST, TALLEST * (body["inertia_kg_m2"] / largest) ** 0.25) for body in check["bodies"]]
        self.slanted = max((len(name) for name in names), default=0) > LONGEST
        self.parts: list[str] = []
        self.right = max(self.x, default=0.0) + PAD
        self.upper = min((y - h / 2 for y, h in zip(self.y, self.height)), default=0.0) - 8.0

    def _line(self, a: tuple[float, float], b: tuple[float, float], name: str, title: str = "", colour: str = "") -> None:
        ends = f'x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}"'
        told = f"<title>{escape(title)}</title>" if title else ""
        self.parts.append(f'<line class="{name}{colour}" {ends}>{told}</line>')

    def _colour(self, body: int) -> str:
        return f" c{self.train.line[body] % COLOURS + 1}"

    def add_shaft(self, one: dict, bodies: list[int]) -> None:
        title = f"{one['kind']} {one['name']}"
        key = next((key for key in ("stiffness_N_m_rad", "stiffness_N_m") if key in one), None)
        if key:
            title += f": {number_text(one[key])} {'N m/rad' if key.endswith('rad') else 'N/m'}"
        real = [body for body in bodies if body != GROUND]
        name = {"shaft": "shaft", "joint": "joint", "mesh": "joint"}.get(one["kind"], "coupling")
        if len(real) < len(bodies) and real:
            self._ground(real[0], name, title)
            return
        for a, b in _pairs(real):
            self._line((self.x[a], self.y[a]), (self.x[b], self.y[b]), name, title, self._colour(b))
            if one["kind"] == "coupling" and not self.dense and self.y[a] == self.y[b]:
                middle = (self.x[a] + self.x[b]) / 2
                zigzag = f"M{middle - 12:.1f} {self.y[a]:.1f}l4 -6l5 12l6 -12l5 12l4 -6"
                self.parts.append(f'<path class="spring{self._colour(b)}" d="{zigzag}"><title>{escape(title)}</title></path>')

    def _ground(self, body: int, name: str, title: str) -> None:
        has_left = any(
            place == self.train.place[body] - 1 and row == self.train.row[body]
            for place, row in zip(self.train.place, self.train.row)
        )
        side = 1 if has_left else -1
        end = self.x[body] + side * min(34.0, 0.8 * self.step)
        self._line((self.x[body], self.y[body]), (end, self.y[body]), name, title, self._colour(body))
        self._line((end, self.y[body] - 16), (end, self.y[body] + 16), "ground", "ground")
        self.right = max(self.right, end + 12)

    def add_mesh(self, one: dict, bodies: list[int]) -> None:
        for a, b in _pairs([body for body in bodies if body != GROUND]):
            self._line((self.x[a], self.y[a]), (self.x[b], self.y[b]), "gear", f"{one['kind']} {one['name']}")
        if "ratio" in one and not self.dense and GROUND not in bodies:
            a, b = bodies
            along = 0.5 if self.x[a] == self.x[b] else 0.68  # beside lines that cross
            x, y = (one[a] + along * (one[b] - one[a]) for one in (self.x, self.y))
            place = f'x="{x + 6:.1f}" y="{y + 4:.1f}"'
            ratio = f"1 : {number_text(one['ratio'], 4)}"
            self.right = max(self.right, x + 12 + LETTER * len(ratio))
            self.parts.append(f'<text class="ratio" {place}>{ratio}</text>')

    def add_discs(self, marks: dict[int, list[tuple[str, str]]]) -> None:
        thick = 5.0 if self.dense else THICK
        for body, name in enumerate(self.names):
            x, y, height = self.x[body], self.y[body], self.height[body]
            inertia = number_text(self.check["bodies"][body]["inertia_kg_m2"])
            corner = f'x="{x - thick / 2:.1f}" y="{y - height / 2:.1f}" width="{thick}" height="{height:.1f}" rx="2"'
            title = f"<title>{escape(f'{name}: {inertia} kg m²')}</title>"
            self.parts.append(f'<rect class="disc{self._colour(body)}" {corner}>{title}</rect>')
            if self.dense:
                continue
            turn = f' transform="rotate(-35 {x:.1f} {y + height / 2 + 12:.1f})"' if self.slanted else ""
            anchor = "end" if self.slanted else "middle"
            where = f'x="{x:.1f}" y="{y + height / 2 + 14:.1f}" text-anchor="{anchor}"{turn}'
            self.parts.append(f'<text class="name" {where}>{escape(name)}</text>')
            for i, (sign, what) in enumerate(marks.get(body, [])[:3]):
                above = y - height / 2 - 12 - 19 * i
                self.upper = min(self.upper, above - 12)
                self.parts.append(
                    f'<g class="mark"><title>{escape(what)}</title><circle cx="{x:.1f}" cy="{above:.1f}" r="8.5"/>'
                    f'<text x="{x:.1f}" y="{above + 4:.1f}" text-anchor="middle">{sign}</text></g>'
                )

    def svg(self) -> str:
        bottom = max((y + h / 2 for y, h in zip(self.y, self.height)), default=0.0)
        room = 30.0 + (0.6 * LETTER * max(map(len, self.names), default=0) if self.slanted and not self.dense else 0.0)
        left = -0.82 * LETTER * max(map(len, self.names), default=0) + PAD if self.slanted and not self.dense else 0.0
        left = min(0.0, left)
        width, height = self.right - left, bottom + room - self.upper
        view = f'viewBox="{left:.0f} {self.upper:.0f} {width:.0f} {height:.0f}" width="{width:.0f}" height="{height:.0f}"'
        least = f"min-width:{min(width, LEAST):.0f}px"  # narrower, nobody could read the names
        return f'<svg class="train" style="{least}" {view} aria-hidden="true">{"".join(self.parts)}</svg>'
