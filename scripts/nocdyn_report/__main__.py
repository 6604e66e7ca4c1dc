"""The commands of nocdyn that are written in Python: python -m nocdyn_report COMMAND [WORD]...; older Pythons read it too."""

import importlib
import io
import os
import sys

OLDEST = (3, 11)
FILES = 3  # exit code
OUTPUT = "standard output"
FAILED = 1  # also of a command that was interrupted
MODULES = {
    "fmu": "nocdyn._fmu",
    "import": "nocdyn_import.command",
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
    """Runs a command; returns its exit code. What no command refuses itself, a file or an output, is one line here."""
    if sys.version_info < OLDEST:
        oldest, found = (".".join(map(str, version[:2])) for version in (OLDEST, sys.version_info))
        return refuse(f"{sys.executable}: nocdyn {command} needs Python {oldest} or newer, this is {found}")
    sys.argv = [f"nocdyn {command}", *words]
    sys.stdout = Output(sys.stdout)
    try:
        code = run(command, words)
        sys.stdout.flush()  # Python itself would do it at its end, where nobody tells the error
        return code
    except BrokenPipeError:  # who reads the output has gone
        close_output()
        return FILES
    except OSError as error:
        if error.filename == OUTPUT:
            close_output()
        return refuse(f"{error.filename or f'{command}: cannot write'}: {error.strerror or error}")
    except KeyboardInterrupt:
        print(f"nocdyn {command}: interrupted", file=sys.stderr)
        return FAILED


def run(command, words):
    """The exit code of a command, however it leaves."""
    sys.path.append(os.path.join(os.path.dirname(__file__), "../../python"))  # of the sources; an installed nocdyn is beside this
    try:
        return importlib.import_module(MODULES[command]).main(words)
    except SystemExit as leaving:
        return leaving.code
    except ModuleNotFoundError as error:
        module = (error.name or "").split(".")[0]
        if module not in PACKAGES:
            raise
        package = PACKAGES[module]
        what = f"the Python package {package}, which {sys.executable} does not have"
        return refuse(f"nocdyn {command} needs {what}: pip install {package}, or name another Python by NOCDYN_PYTHON")


class Output(io.TextIOWrapper):
    """Standard output whose errors say that they are its own."""

    def __init__(self, plain):
        form = {"encoding": plain.encoding, "errors": plain.errors, "line_buffering": plain.line_buffering}
        super().__init__(plain.buffer, write_through=plain.write_through, **form)

    def write(self, text):
        return self.named(super().write, text)

    def flush(self):
        self.named(super().flush)

    def named(self, act, *arguments):
        try:
            return act(*arguments)
        except OSError as error:
            raise OSError(error.errno, error.strerror, OUTPUT) from None


def close_output():
    """What is still to be printed goes nowhere."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def refuse(message):
    print(f"nocdyn: {message}", file=sys.stderr)
    return FILES


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
