"""Machines in this process, by the library of nocdyn.h."""

import ctypes
import difflib
import weakref
from ctypes import POINTER, c_char_p, c_double, c_int, c_void_p
from functools import cache
from types import MappingProxyType

from nocdyn import _find
from nocdyn._errors import raise_error
from nocdyn._input import as_input

_TEXTS = ("name", "unit", "caption", "positive", "kind", "element")  # of a signal
_CHANGES = ("at start", "in motion", "by torque", "as set point")


class _Number(ctypes.Structure):
    _fields_ = (("path", c_char_p), ("unit", c_char_p), ("caption", c_char_p), ("value", c_double), ("change", c_int))


@cache
def _library():
    library = ctypes.CDLL(_find.library())
    for name, result, *arguments in (
        ("release", c_char_p),
        ("open", c_void_p, c_char_p, c_int, POINTER(c_char_p), c_char_p),
        ("open_text", c_void_p, c_char_p, c_char_p, c_int, POINTER(c_char_p), c_char_p),
        ("close", None, c_void_p),
        ("code", c_int, c_void_p),
        ("message", c_char_p, c_void_p),
        ("notes", c_char_p, c_void_p),
        ("signal_count", c_int, c_void_p),
        *((f"signal_{text}", c_char_p, c_void_p, c_int) for text in _TEXTS),
        ("whole_input", c_char_p, c_void_p),
        ("number_count", c_int, c_void_p),
        ("describe_number", None, c_void_p, c_int, POINTER(_Number)),
        ("time", c_double, c_void_p),
        ("end_time", c_double, c_void_p),
        ("set_end_time", c_int, c_void_p, c_double),
        ("steps", c_int, c_void_p),
        ("run_to", c_int, c_void_p, c_double),
        ("read", c_int, c_void_p, POINTER(c_double)),
        ("set", c_int, c_void_p, c_char_p, c_double),
        ("set_torque", c_int, c_void_p, c_char_p, c_double, c_double),
        ("keep", c_void_p, c_void_p),
        ("restore", c_int, c_void_p, c_void_p),
        ("free_state", None, c_void_p),
    ):
        function = getattr(library, f"nocdyn_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def release():
    """The version of nocdyn."""
    return _library().nocdyn_release().decode()


def _number(value, what):
    """A number, also one of NumPy; no text."""
    try:
        if not isinstance(value, str):
            return float(value)
    except (TypeError, ValueError):
        pass
    raise TypeError(f"{what} must be a number, not {value!r}")


def _hint(name, names):
    near = difflib.get_close_matches(str(name), names, 1)
    return f"; did you mean {near[0]!r}?" if near else "; signals has all of them"


class State:
    """A motion that `Machine.keep` has kept."""

    def __init__(self, address, machine):
        self.address, self.machine = address, machine
        weakref.finalize(self, _library().nocdyn_free_state, address)


class Machine:
    """A machine that runs from time to time; signals are read, numbers and torques set between.

    `given` is a path, a text or an `Input`, `set` has settings, {'run.rtol': 1e-9}, and `case` is a load case of it. Without one
    the machine runs by itself.
    """

    def __init__(self, given, set=None, case=None):  # noqa: A002, the word of the command line
        source = as_input(given, set)
        texts = [text.encode() for text in source.overrides()]
        overrides = (c_char_p * max(1, len(texts)))(*texts)
        end = (len(texts), overrides, case.encode() if case else None)
        if source.path and not source.groups:
            self._address = _library().nocdyn_open(source.name.encode(), *end)
        else:
            self._address = _library().nocdyn_open_text(source.text.encode(), source.name.encode(), *end)
        self._free = weakref.finalize(self, _library().nocdyn_close, self._address)
        self._raise_if_wrong(self._call("code"))
        count = self._call("signal_count")
        texts = [{text: self._call(f"signal_{text}", i).decode() for text in _TEXTS} for i in range(count)]
        self.signals = MappingProxyType({text["name"]: text for text in texts})
        self._row = (c_double * count)()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """Frees it; else that is done with the last reference."""
        self._free()
        self._address = None

    def _call(self, name, *arguments):
        if self._address is None:
            raise ValueError("the machine is closed")
        return getattr(_library(), f"nocdyn_{name}")(self._address, *arguments)

    def _raise_if_wrong(self, code):
        if code:
            raise_error(code, self._call("message").decode())

    @property
    def notes(self):
        """What a run prints before it begins."""
        return self._call("notes").decode().splitlines()

    @property
    def time(self):
        """The present time [s]."""
        return self._call("time")

    @property
    def end_time(self):
        """The end, beyond which it does not go: t_end of &run, or what it has been set to [s]."""
        return self._call("end_time")

    @end_time.setter
    def end_time(self, t):
        self._raise_if_wrong(self._call("set_end_time", _number(t, "a time")))

    @property
    def input(self):
        """The text of the whole input, with settings, numbers that have been set and tables."""
        return self._call("whole_input").decode()

    @property
    def numbers(self):
        """The numbers that elements of the input give, by their paths: unit, caption, value, and when they may change."""
        numbers = {}
        for i in range(self._call("number_count")):
            self._call("describe_number", i, number := _Number())
            texts = {"unit": number.unit.decode(), "caption": number.caption.decode()}
            numbers[number.path.decode()] = texts | {"value": number.value, "change": _CHANGES[number.change]}
        return numbers

    @property
    def steps(self):
        """Steps of the integration so far."""
        return self._call("steps")

    def run_to(self, t):
        """Integrates to a time [s]."""
        self._raise_if_wrong(self._call("run_to", _number(t, "a time")))

    def read(self):
        """The signals at the present time, by their names."""
        self._raise_if_wrong(self._call("read", self._row))
        return dict(zip(self.signals, self._row))

    def __getitem__(self, name):
        """A signal at the present time."""
        if name not in self.signals:
            raise KeyError(f"there is no signal {name!r}{_hint(name, self.signals)}")
        return self.read()[name]

    def __setitem__(self, path, value):
        """Sets a number from the present time on: machine['load.work.viscous'] = 80."""
        self._raise_if_wrong(self._call("set", path.encode(), _number(value, f"'{path}'")))

    def set_torque(self, name, torque, rate=0.0):
        """Sets the torque of an `&excitation kind = 'external'` from the present time on [N m], and its rate [N m/s]."""
        torque, rate = _number(torque, "a torque"), _number(rate, "a rate")
        self._raise_if_wrong(self._call("set_torque", name.encode(), torque, rate))

    def keep(self):
        """A copy of all that changes in a motion."""
        address = self._call("keep")
        self._raise_if_wrong(self._call("code"))
        return State(address, self)

    def restore(self, state):
        """Goes back to a state of this machine."""
        if not isinstance(state, State):
            raise TypeError(f"restore needs a state that keep has given, not {state!r}")
        if state.machine is not self:
            raise ValueError("the state is of another machine")
        self._raise_if_wrong(self._call("restore", state.address))
