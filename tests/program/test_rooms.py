"""The rooms of `src`: every `use` is one that the table in docs/pages/code.md allows, and no rooms use each other in a circle."""

import re
from graphlib import TopologicalSorter

from conftest import SOURCE

LAYERS = ["base", "integrate", "model", "io", "analyse", "app"]
MODEL_AND_FILES_APART = {"integrate", "model", "io"}  # which do not use one another
LEAST_MODULES = 200  # fewer than that were not found where they are
MOST_FILES = 14
ROW = re.compile(r"^\| `([a-z_/]+)` \| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)
MODULE = re.compile(r"^\s*(?:module|program)\s+(nocdyn\w*)", re.MULTILINE | re.IGNORECASE)
USE = re.compile(r"^\s*use\b[^!\n]*?\b(nocdyn_\w+)", re.MULTILINE | re.IGNORECASE)


def table():
    """Room -> the rooms that it may use, as the page says."""
    text = (SOURCE / "docs/pages/code.md").read_text(encoding="utf-8")
    return {room: {"base/core", *re.findall(r"`([a-z_/]+)`", uses)} for room, _, uses in ROW.findall(text)}


def sources():
    """The text of each module and program, by its name."""
    files = (path for path in (SOURCE / "src").rglob("*") if path.suffix.lower() in (".f90", ".f", ".f03", ".f08"))
    texts = [(path, path.read_text(encoding="utf-8")) for path in files]
    return {MODULE.search(text)[1].lower(): (path, text) for path, text in texts}


def room_of(path):
    return path.parent.relative_to(SOURCE / "src").as_posix()


def arrows():
    """(module, its room, used module, the room of that) for every `use` between modules of src."""
    modules = sources()
    for name, (path, text) in modules.items():
        for used in map(str.lower, USE.findall(text)):
            assert used in modules, f"{path.name} uses {used}, which no file of src holds"
            yield name, room_of(path), used, room_of(modules[used][0])


def test_the_test_sees_the_modules_of_src():
    assert len(sources()) >= LEAST_MODULES
    assert len(list(arrows())) > LEAST_MODULES


def test_every_use_is_allowed_by_the_table_of_rooms():
    allowed = table()
    wrong = [
        f"{name} ({room}) uses {used} ({other})"
        for name, room, used, other in arrows()
        if room != other and other not in allowed.get(room, ())
    ]
    assert not wrong


def test_the_table_has_every_room_and_no_arrow_that_is_not_used():
    used = {room: set() for room in table()}
    for _, room, _, other in arrows():
        used.setdefault(room, set()).add(other)
    rooms = {room_of(path) for path, _ in sources().values()}
    assert set(table()) == rooms
    idle = {room: rest for room, uses in table().items() if (rest := uses - used[room] - {"base/core", room})}
    assert not idle


def test_no_rooms_use_each_other_in_a_circle():
    graph = {}
    for _, room, _, other in arrows():
        if room != other:
            graph.setdefault(room, set()).add(other)
    TopologicalSorter(graph).prepare()  # raises CycleError with the circle


def test_use_points_down_the_layers():
    for room, uses in table().items():
        layer = room.split("/")[0]
        for other in (use.split("/")[0] for use in uses):
            assert LAYERS.index(other) <= LAYERS.index(layer), f"{room} uses {other}"
            assert other == layer or not {other, layer} <= MODEL_AND_FILES_APART, f"{room} uses {other}"


def test_a_module_is_named_after_its_file_and_a_room_is_not_crowded():
    files = {}
    for name, (path, _) in sources().items():
        if not path.stem.startswith("main"):
            assert name == f"nocdyn_{path.stem}", path
        files.setdefault(room_of(path), []).append(path.name)
    crowded = {room: len(names) for room, names in files.items() if len(names) > MOST_FILES}
    assert not crowded


def test_tests_stand_in_the_rooms_of_what_they_test():
    tests = {path.parent.relative_to(SOURCE / "tests").as_posix() for path in (SOURCE / "tests").rglob("test_*.pf")}
    assert len(tests) > 10
    assert tests <= set(table())
