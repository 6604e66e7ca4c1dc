"""What the tests of figures share: runs, and the scripts' Python parts within this process."""

import importlib
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

NOCDYN = os.environ["NOCDYN"]
SCRIPTS = Path(os.environ["NOCDYN_SOURCE"]) / "scripts"
SIGNATURES = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}

for package in ("f90nml", "matplotlib", "numpy", "pandas"):
    if importlib.util.find_spec(package) is None:
        pytest.fail(f"{package} is not installed for {sys.executable}: run scripts/setup figures test", pytrace=False)
sys.path.insert(0, str(SCRIPTS))


def run_input(folder: Path, text: str, *options: str) -> Path:
    """Results of a machine, in `folder`; the run itself may fail."""
    file = folder / "machine.nml"
    file.write_text(text, encoding="utf-8")
    subprocess.run([NOCDYN, "run", "--quiet", "--out", folder / "results", *options, file], capture_output=True)
    return folder / "results"


# Of the kinds of columns in results that tests write: caption and rank. Names begin with one of them.
KINDS = {
    "t": ("time", 11),
    "phi": ("angle", 11),
    "omega": ("speed", 7),
    "twist": ("twist", 9),
    "moment": ("elastic moment", 1),
    "total_moment": ("elastic and damping moment", 1),
    "damping": ("moment of damping and friction", 11),
    "force": ("tooth force", 3),
    "stress": ("shear stress", 4),
    "reaction": ("reaction", 2),
    "order": ("oscillations per turn of the body", 11),
    "frequency": ("frequency", 11),
    "drive": ("factor of the drive", 11),
}
ELEMENT_KINDS = {"phi": "body", "omega": "body", "force": "mesh", "reaction": "gear"}


def column(label: str, statistic: str = "", file: str = "trajectory.csv") -> dict:
    """An entry of columns.json for a label such as 'half_range_moment_shaft [N m]'."""
    name, unit = label.removesuffix("]").split(" [")
    name = name.removeprefix(f"{statistic}_")
    kind = next(kind for kind in KINDS if name == kind or name.startswith(f"{kind}_"))
    caption, rank = KINDS[kind]
    entry = {"label": label, "file": file, "name": name, "kind": kind} | ({"statistic": statistic} if statistic else {})
    entry |= {"element_kind": ELEMENT_KINDS.get(kind, "coupling" if name != kind else "")}
    entry |= {"element": name.removeprefix(kind).removeprefix("_"), "point": "", "unit": unit}
    return entry | {"caption": caption, "positive": "", "rank": rank}


def write_columns(folder: Path, columns: list[dict], name: str = "columns.json") -> None:
    (folder / name).write_text(json.dumps({"columns": columns}), encoding="utf-8")


def call(monkeypatch, module: str, *arguments: object) -> None:
    """A script's Python part within this process, for the start of Matplotlib takes a second."""
    main = importlib.import_module(f"nocdyn_report.{module}").main
    monkeypatch.setattr(sys, "argv", [module, *map(str, arguments)])
    main()


def refusal(monkeypatch, module: str, *arguments: object) -> str | int:
    """The line of results that are refused; the exit code of wrong usage."""
    plot, failure = (importlib.import_module(f"nocdyn_report.{name}") for name in ("plot", "failure"))
    kind = next(kind for kind, (drawn_by, _) in plot.KINDS.items() if drawn_by == module)
    with pytest.raises((SystemExit, failure.ResultsError)) as leaving:
        call(monkeypatch, module, *arguments)
    return leaving.value.code if leaving.type is SystemExit else f"nocdyn plot {kind}: {leaving.value}"


def assert_figures(folder: Path, *names: str, formats: tuple[str, ...] = tuple(SIGNATURES)) -> None:
    for name in names:
        for kind in formats:
            content = (folder / f"{name}.{kind}").read_bytes()
            assert content.startswith(SIGNATURES[kind]) and len(content) > 1000, f"{name}.{kind}"
    assert len(list(folder.iterdir())) == len(names) * len(formats)


def chain(bodies: int, run: str) -> str:
    groups = [f"&body name = 'rotor{i}' inertia = 1.0 /" for i in range(bodies)]
    groups += [
        f"&coupling name = 'shaft{i}' bodies = 'rotor{i - 1}', 'rotor{i}' stiffness = 1e3 damping = 1.0 /"
        for i in range(1, bodies)
    ]
    return "\n".join([*groups, "&motor name = 'drive' body = 'rotor0' a = 100.0 b = 1.0 c = 0.0 /", f"&run {run} /", ""])
