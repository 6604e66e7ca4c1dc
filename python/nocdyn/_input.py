"""Inputs: a file or a text, with settings and groups that are added."""

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path


class Written(str):
    """A value as an input writes it."""

    __slots__ = ()


class Group:
    """A group of an input: its keys are its items, or its attributes."""

    def __init__(self, name, /, **keys):
        self.__dict__.update(_name=name, _keys=keys)

    def __getitem__(self, key):
        return self._keys[key]

    def __setitem__(self, key, value):
        self._keys[key] = value

    def __getattr__(self, key):
        try:
            return self.__dict__["_keys"][key]
        except KeyError:
            raise AttributeError(key) from None

    def __setattr__(self, key, value):
        self._keys[key] = value

    def __str__(self):
        """As it stands in a file."""
        return " ".join([f"&{self._name}", *(f"{key} = {literal(value)}" for key, value in self._keys.items()), "/"])


class Input:
    """An input that is built, or a file or text with settings and further groups; nocdyn checks it.

    `given` is a path or the text of a file, or nothing. `set` gives settings as --set does: {'run.t_end': 2}.
    """

    def __init__(self, given="", set=None):  # noqa: A002, the word of the command line
        is_text = isinstance(given, str) and ("&" in given or not given)
        self.path = None if is_text else Path(given)
        self.base = given if is_text else None
        self.settings = dict(set or {})
        self.groups = []

    def __setitem__(self, path, value):
        """Gives a key of the file or text a value: input['load.work.viscous'] = 80."""
        self.settings[path] = value

    def add(self, group, /, **keys):
        """Adds a group, which is returned: its keys may be changed later."""
        self.groups.append(Group(group, **keys))
        return self.groups[-1]

    @property
    def text(self):
        """The text of the file, with the groups that are added, without settings."""
        base = self.path.read_text(encoding="utf-8") if self.path else self.base
        added = "".join(f"{group}\n" for group in self.groups)
        return f"{base}\n{added}" if base and added else base or added

    @property
    def name(self):
        """Its name in messages."""
        return str(self.path) if self.path else "input.nml"

    def overrides(self):
        """PATH=VALUE of each setting."""
        return [f"{path}={literal(value)}" for path, value in self.settings.items()]

    def check(self):
        """Raises InputError if anything is wrong with the machine."""
        from nocdyn._machine import Machine  # which takes inputs

        Machine(self).close()

    @contextmanager
    def file(self):
        """The folder to work in and a file with all groups; tables are looked for beside it."""
        if self.path and not self.groups:
            yield None, str(self.path)
            return
        with tempfile.TemporaryDirectory(prefix="nocdyn_") as folder:
            place = self.path.parent.resolve() if self.path else Path(folder)
            name = f".{self.path.stem}.{os.getpid()}.nml" if self.path else self.name
            file = place / name
            file.write_text(self.text, encoding="utf-8")
            try:
                yield str(place), name
            finally:
                file.unlink()


def as_input(given, settings=None):
    """An input of what a function was given, with more settings."""
    if not isinstance(given, Input):
        return Input(given, settings)
    joined = Input(set=given.settings | dict(settings or {}))
    joined.path, joined.base, joined.groups = given.path, given.base, given.groups
    return joined


def literal(value):
    """A value as an input writes it."""
    if isinstance(value, Written):
        return str(value)
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, str | os.PathLike):
        return "'" + str(value).replace("'", "''") + "'"
    if isinstance(value, int | float):
        return repr(value)
    return ", ".join(map(literal, value))
