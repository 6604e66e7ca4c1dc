"""Where the bodies of a drivetrain stand in its drawing: shaft lines along rows, geared bodies one above the other."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

GROUND = -1


@dataclass(frozen=True)
class Train:
    """Places and rows of the bodies, and the shaft line to which each belongs, numbered as they are found."""

    place: list[int]  # along the train
    row: list[int]  # 0 for the first shaft line, above that positive
    line: list[int]

    @property
    def lines(self) -> int:
        return max(self.line) + 1


def lay_out(bodies: int, couplings: Iterable[Sequence[int]], gears: Iterable[Sequence[int]]) -> Train:
    """The drawing of a machine. Pairs of bodies from 0 on; GROUND is not drawn.

    A shaft line is the longest path of couplings; its side branches are lines of their own. The first line begins at the first
    end of a shaft in the order of the input, and a geared line at the body whose mate has a place.
    """
    shafts, meshes = (_neighbours(bodies, pairs) for pairs in (couplings, gears))
    drawing = _Drawing(bodies)
    ends = [body for body in range(bodies) if len(shafts[body]) <= 1]
    for start in [*ends, *range(bodies)]:
        if drawing.has(start):
            continue
        line = _longest(start, shafts, drawing, meshes)
        drawing.put_line(line, max(drawing.place) + 2 if drawing.count else 0, 0)
        drawing.follow(shafts, meshes)
    return Train(drawing.place, drawing.row, drawing.line)


class _Drawing:
    def __init__(self, bodies: int) -> None:
        self.place = [-1] * bodies
        self.row = [0] * bodies
        self.line = [-1] * bodies
        self.count = 0
        self.taken: dict[int, list[tuple[int, int]]] = {}  # ends of the lines of a row
        self.queue: list[int] = []
        self.entries: set[int] = set()  # bodies by whose gears lines got their places

    def has(self, body: int) -> bool:
        return self.line[body] >= 0

    def put_line(self, line: Sequence[int], start: int, row: int) -> None:
        """Bodies one after the other from a place on."""
        for i, body in enumerate(line):
            self.place[body] = start + i
            self.row[body] = row
            self.line[body] = self.count
        self.taken.setdefault(row, []).append((start, start + len(line) - 1))
        self.count += 1
        self.queue.extend(line)

    def free_row(self, near: int, first: int, last: int, inwards: bool = False) -> int:
        """The nearest row where places are free, on the outer side of a row or on that of the first line first."""
        side = 1 if (near >= 0) is not inwards else -1
        for distance in range(1, len(self.line) + 2):
            for row in (near + side * distance, near - side * distance):
                if not any(start <= last and first <= end for start, end in self.taken.get(row, [])):
                    return row
        raise AssertionError

    def follow(self, shafts: list[list[int]], meshes: list[list[int]]) -> None:
        """Puts all lines that hang on lines which have their place."""
        while self.queue:
            body = self.queue.pop(0)
            for mate in meshes[body]:
                if not self.has(mate):
                    self._put_mate(body, mate, shafts, meshes)
            for branch in shafts[body]:
                if not self.has(branch):
                    line = _longest(branch, shafts, self, meshes)
                    place = self.place[body] + 1
                    self.put_line(line, place, self.free_row(self.row[body], place - 1, place + len(line) - 1))

    def _put_mate(self, body: int, mate: int, shafts: list[list[int]], meshes: list[list[int]]) -> None:
        """The line through a geared body: above or below the other one, or one place on if that hangs on a gear itself."""
        ahead = _longest(mate, shafts, self, meshes)
        behind = _longest(mate, shafts, self, meshes, without=set(ahead))[1:]
        goes_on = body in self.entries
        line, start = [*reversed(behind), *ahead], self.place[body] + goes_on - len(behind)
        if start < 0:
            self._shift(-start)
            start = 0
        self.entries.add(mate)
        self.put_line(line, start, self.free_row(self.row[body], start, start + len(line) - 1, goes_on))

    def _shift(self, distance: int) -> None:
        """Makes room at the left."""
        self.place = [place + distance if self.line[body] >= 0 else place for body, place in enumerate(self.place)]
        self.taken = {row: [(a + distance, b + distance) for a, b in ends] for row, ends in self.taken.items()}


def _neighbours(bodies: int, pairs: Iterable[Sequence[int]]) -> list[list[int]]:
    found: list[list[int]] = [[] for _ in range(bodies)]
    for a, b in pairs:
        if GROUND in (a, b) or a == b:
            continue
        for one, other in ((a, b), (b, a)):
            if other not in found[one]:
                found[one].append(other)
    return found


def _longest(
    start: int, shafts: list[list[int]], drawing: _Drawing, meshes: list[list[int]], without: Iterable[int] = ()
) -> list[int]:
    """The longest path of couplings from a body through bodies that have no place; of equal ones that which ends at a gear."""
    before = {start: start}
    barred = set(without) - {start}
    best, depth, stack = start, {start: 0}, [start]
    while stack:
        body = stack.pop()
        if (depth[body], bool(meshes[body])) > (depth[best], bool(meshes[best])):
            best = body
        for other in reversed(shafts[body]):
            if other not in before and other not in barred and not drawing.has(other):
                before[other], depth[other] = body, depth[body] + 1
                stack.append(other)
    path = [best]
    while path[-1] != start:
        path.append(before[path[-1]])
    return path[::-1]
