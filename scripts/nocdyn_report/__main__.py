"""The commands of nocdyn that are written in Python: python -m nocdyn_report COMMAND [WORD]...; older Pythons read it too."""

import importlib
import os
import sys

OLDEST = (3, 11)
FILES = 3  # exit code
INTERRUPTED = 130
MODULES = {
    "fmu": "nocdyn._fmu",
    "plot": "nocdyn_report.plot",
    "report": "nocdyn_report.report.command",
    "verify": "nocdyn_verify.__main__",
}
# The packages that a command needs, by the names of their modules: what pip calls them.
PACKAGES = {
    "jinja2": "Jinja2",
    "markupsafe": "Jinja2",
    "markdown_it": "markdown-it-py",
    "matplotlib": "matplotlib",
    "numpy": "numpy",
    "pandas": "pandas",
    "h5py": "h5py",
    "h5netcdf": "h5netcdf",
    "xarray": "xarray",
    "f90nml": "f90nml",
}


def main(command, words):
    """Runs a command; returns its exit code, or leaves with it."""
    if sys.version_info < OLDEST:
        oldest, found = (".".join(map(str, version[:2])) for version in (OLDEST, sys.version_info))
        return refuse(f"{sys.executable}: nocdyn {command} needs Python {oldest} or newer, this is {found}")
    sys.argv = [f"nocdyn {command}", *words]
    sys.path.append(os.path.join(os.path.dirname(__file__), "../../python"))  # of the sources; an installed nocdyn is beside this
    try:
        return importlib.import_module(MODULES[command]).main(words)
    except ModuleNotFoundError as error:
        module = (error.name or "").split(".")[0]
        if module not in PACKAGES:
            raise
        package = PACKAGES[module]
        what = f"the Python package {package}, which {sys.executable} does not have"
        return refuse(f"nocdyn {command} needs {what}: pip install {package}, or name another Python by NOCDYN_PYTHON")
    except KeyboardInterrupt:
        print(f"nocdyn {command}: interrupted", file=sys.stderr)
        return INTERRUPTED


def refuse(message):
    print(f"nocdyn: {message}", file=sys.stderr)
    return FILES


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
