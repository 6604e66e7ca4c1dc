"""Where the program and its library are: named by the environment, in the prefix of this package, on the path, or in a build."""

import os
import shutil
from pathlib import Path

HERE = Path(__file__).resolve().parent
PREFIX = HERE.parents[3]  # of PREFIX/lib/pythonX.Y/site-packages/nocdyn and of PREFIX/share/nocdyn/python/nocdyn
BUILD = HERE.parents[1] / "build/release"
LIBRARY = "libnocdyn_c.so"


def program():
    """The path of `nocdyn`."""
    places = [os.environ.get("NOCDYN"), PREFIX / "bin/nocdyn", shutil.which("nocdyn"), BUILD / "bin/nocdyn"]
    return _first(places, "the program nocdyn", "NOCDYN")


def library():
    """The path of `libnocdyn_c.so`, the library of nocdyn.h."""
    places = [os.environ.get("NOCDYN_LIBRARY")]
    for found in (os.environ.get("NOCDYN"), PREFIX / "bin/nocdyn", shutil.which("nocdyn")):
        if found:
            places += _libraries(Path(found).resolve().parents[1])
    return _first([*places, BUILD / "lib" / LIBRARY], LIBRARY, "NOCDYN_LIBRARY")


def _libraries(prefix):
    return [prefix / "lib" / LIBRARY, *sorted(prefix.glob(f"lib/*-linux-gnu/{LIBRARY}")), prefix / "lib64" / LIBRARY]


def _first(places, what, variable):
    for place in places:
        if place and Path(place).exists():
            return str(place)
    raise FileNotFoundError(f"{what} is not installed; the variable {variable} of the environment may hold its path")
