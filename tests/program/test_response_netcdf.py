"""response.nc, which `&response format = 'netcdf'` writes instead of response.csv and response_orders.csv."""

import csv
import json
import os
import resource
import shutil

import numpy as np
import pytest
import xarray
from conftest import SOURCE
from sweep_inputs import needs_sweeps

pytestmark = needs_sweeps

ENGINE = SOURCE / "input/examples/engine/engine.nml"
TURBINE = SOURCE / "input/examples/ship_turbine/ship_turbine.nml"
NETCDF = ("--set", "response.format=netcdf")
RESULTS = ["response.json", "response.nc", "response_columns.json"]
TABLES = ["response.csv", "response.json", "response_columns.json", "response_orders.csv"]


def table(path):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=float)


@pytest.mark.parametrize(("machine", "words"), [(ENGINE, ()), (TURBINE, ("--set", "response.signals='phi_*', '*line*'"))])
def test_the_file_has_the_numbers_of_both_tables_with_names_and_units(nocdyn, machine, words):
    assert nocdyn("response", machine, "--out", "csv", "-q", *words).returncode == 0
    outcome = nocdyn("response", machine, "--out", "out", "-q", *words, *NETCDF)
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, "", "")
    assert nocdyn.files("out") == RESULTS
    with xarray.open_dataset(nocdyn.folder / "out/response.nc", engine="h5netcdf") as opened:
        found = opened.load()
    (header, rows), (order_header, order_rows) = (
        table(nocdyn.folder / "csv" / name) for name in ("response.csv", "response_orders.csv")
    )
    speed = header[0].split(" [")[0]
    assert dict(found.sizes) == {speed: len(rows), "line": len(order_rows) // len(rows)}
    assert list(found.coords) == [speed]
    labels = [f"{name} [{found[name].attrs['units']}]" for name in [speed, *found.data_vars]]
    assert labels == header + order_header[1:]
    for label, values in zip(header, rows.T, strict=True):
        name = label.split(" [")[0]
        assert found[name].dims == (speed,) and (found[name].values == values).all(), label
    for label, values in zip(order_header[1:], order_rows.T[1:], strict=True):
        name = label.split(" [")[0]
        assert found[name].dims == (speed, "line") and (found[name].values.ravel() == values).all(), label
    reports = [json.loads((nocdyn.folder / folder / "response.json").read_text()) for folder in ("csv", "out")]
    for report in reports:
        del report["wall_time_s"]
    assert reports[0] == reports[1]
    columns = json.loads((nocdyn.folder / "out/response_columns.json").read_text())["columns"]
    assert {column["file"] for column in columns} == {"response.nc"}
    assert found.attrs["input"].startswith("! The complete input")


def test_tables_of_the_other_format_do_not_stay(nocdyn):
    for words, files in ((NETCDF, RESULTS), ((), TABLES), (NETCDF, RESULTS)):
        outcome = nocdyn("response", TURBINE, "--out", "out", *words)
        assert outcome.returncode == 0
        assert nocdyn.files("out") == files
    assert outcome.stdout.endswith(": out has response.nc, response_columns.json and response.json\n")


def test_a_full_disk_leaves_nothing(nocdyn):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))

    outcome = nocdyn("response", TURBINE, "--out", "out", *NETCDF, preexec_fn=limit)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: cannot write 'out/response.nc': File too large\n"
    assert nocdyn.files("out") == []


def test_a_pipe_cannot_be_read_by_both_programs(nocdyn):
    outcome = nocdyn("response", "/dev/stdin", *NETCDF, input=TURBINE.read_text())
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == "nocdyn: /dev/stdin: format = 'netcdf' needs an input that can be read twice, not a pipe\n"


def test_without_the_program_that_writes_it_a_response_says_why_it_cannot_be(nocdyn):
    nocdyn.executable = shutil.copy(os.environ["NOCDYN"], nocdyn.folder / "alone")
    outcome = nocdyn("response", TURBINE, "--out", "out", *NETCDF)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr.startswith(
        f"nocdyn: '{nocdyn.folder / 'nocdyn-sweep'}', the program for format = 'netcdf', does not exist"
    )
    assert nocdyn("modes", TURBINE, *NETCDF).returncode == 0
