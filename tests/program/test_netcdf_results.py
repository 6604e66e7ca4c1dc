"""trajectory.nc, which `&output format = 'netcdf'` writes instead of trajectory.csv."""

import os
import re
import resource
import shutil
import signal

import pytest
import xarray
from conftest import CASE_1, CASE_2, ENDLESS, SOURCE, wait_for
from sweep_inputs import SWEEP, TWO_DISCS, needs_sweeps

pytestmark = needs_sweeps

NETCDF = ("--set", "output.format=netcdf")
RESULTS = ["columns.json", "input.nml", "summary.json", "trajectory.nc"]


def open_results(nocdyn, path="out/trajectory.nc"):
    with xarray.open_dataset(nocdyn.folder / path, engine="h5netcdf") as found:
        return found.load()


def test_the_file_has_the_numbers_of_the_table_with_names_and_units(nocdyn):
    # more rows than one block of 2^18 numbers holds
    words = ("--set", "output.points=15001", "--quiet")
    assert nocdyn("run", CASE_2, "--out", "csv", *words).returncode == 0
    outcome = nocdyn("run", CASE_2, "--out", "out", *words, *NETCDF)
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, "", "")
    assert nocdyn.files("out") == RESULTS
    header, rows = nocdyn.table("csv")
    found = open_results(nocdyn)
    names = ["t", *found.data_vars]
    assert [f"{name} [{found[name].attrs['units']}]" for name in names] == header
    assert dict(found.sizes) == {"t": len(rows)} and list(found.coords) == ["t"]
    for name, values in zip(names, zip(*rows, strict=True), strict=True):
        assert found[name].attrs["long_name"] == name
        assert (found[name].values == values).all(), name
    assert found.attrs["title"] == "Paper, case 2: harmonic torque on the motor"
    assert found.attrs["input"] == (nocdyn.folder / "out/input.nml").read_text()
    size = (nocdyn.folder / "out/trajectory.nc").stat().st_size
    assert size < 1.1 * 8 * len(rows) * len(header) < 0.6 * (nocdyn.folder / "csv/trajectory.csv").stat().st_size


def test_the_line_of_the_documentation_opens_it(nocdyn, monkeypatch):
    page = (SOURCE / "docs/pages/results.md").read_text()
    (line,) = re.findall(r"^table = xarray\.open_dataset\(.*$", page, re.MULTILINE)
    monkeypatch.chdir(nocdyn.folder)
    assert nocdyn("run", CASE_2, *NETCDF).returncode == 0
    scope = {"xarray": xarray}
    exec(line, scope)
    header, rows = nocdyn("run", CASE_2, "--out", "csv") and nocdyn.table("csv")
    table = scope["table"]
    assert [table.index.name, *table.columns] == [name.split(" [")[0] for name in header]
    assert [table.index[-1], *table.iloc[-1]] == rows[-1]


def test_it_prints_what_a_run_prints(nocdyn):
    took = re.compile(r"[\d.e+-]+ ms; ")
    texts = [took.sub("", nocdyn("run", CASE_2, "--out", "out", *words).stdout) for words in ((), NETCDF)]
    assert texts[0] == texts[1] and texts[0].startswith("Paper, case 2")


def test_chosen_columns_are_its_variables(nocdyn):
    nocdyn("run", CASE_2, "--out", "out", *NETCDF, "--set", "output.columns='omega_*', 'reaction_*'")
    assert list(open_results(nocdyn).data_vars) == ["omega_motor", "omega_pinion", "omega_machine", "reaction_reducer"]


def test_names_that_netcdf_does_not_allow_are_changed(nocdyn):
    nocdyn.write(
        "odd.nml",
        "&body name = 'a/b' inertia = 1.0 speed = 1.0 /\n&body name = 'räd' inertia = 1.0 /\n"
        "&run t_end = 1.0 /\n&output format = 'netcdf' columns = 'omega_*' /\n",
    )
    assert nocdyn("run", "odd.nml", "--out", "out").returncode == 0
    found = open_results(nocdyn)
    assert {name: column.attrs["long_name"] for name, column in found.data_vars.items()} == {
        "omega_a_b": "omega_a/b",
        "omega_räd": "omega_räd",
    }


def test_a_run_that_fails_leaves_its_rows(nocdyn):
    outcome = nocdyn("run", CASE_2, "--out", "out", *NETCDF, "--set", "run.max_steps=100")
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert outcome.stderr.endswith("; the rows up to t = 1.24 s are in out/trajectory.partial.nc\n")
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "trajectory.partial.nc"]
    assert list(open_results(nocdyn, "out/trajectory.partial.nc")["t"].values) == [i * 0.01 for i in range(125)]


def test_an_interrupted_run_leaves_its_rows(nocdyn):
    process = nocdyn.start("run", CASE_2, "--out", "out", *NETCDF, *ENDLESS)
    wait_for(lambda: list(nocdyn.folder.glob("out/.trajectory.nc.*")))
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate(timeout=30)
    assert process.returncode == 1 and "out/trajectory.partial.nc" in complaint
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "trajectory.partial.nc"]
    assert nocdyn.summary("out")["counts"]["rows"] == open_results(nocdyn, "out/trajectory.partial.nc").sizes["t"]


def test_no_trajectory_of_an_earlier_run_stays(nocdyn):
    failing = ("--set", "run.max_steps=100")
    runs = [
        ((*NETCDF,), "trajectory.nc"),
        ((), "trajectory.csv"),
        ((*NETCDF, *failing), "trajectory.partial.nc"),
        (failing, "trajectory.partial.csv"),
        (NETCDF, "trajectory.nc"),
    ]
    for words, name in runs:
        nocdyn("run", CASE_2, "--out", "out", "-q", *words)
        assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", name]


@pytest.mark.parametrize("size", [0, 50_000, 150_000])
def test_a_full_disk_is_exit_code_3_and_leaves_nothing(nocdyn, size):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    outcome = nocdyn("run", CASE_2, "--out", "out", *NETCDF, preexec_fn=limit)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: cannot write 'out/trajectory.nc': File too large\n"
    assert nocdyn.files("out") == []


def test_a_folder_that_cannot_be_is_exit_code_3(nocdyn):
    nocdyn.write("file", "")
    outcome = nocdyn("run", CASE_2, "--out", "file/out", *NETCDF)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: cannot write 'file/out/trajectory.nc': the folder cannot be made: Not a directory\n"


def test_files_of_both_formats_and_wrong_ones_are_each_treated_once(nocdyn):
    nocdyn.write("bad.nml", "&body name = 'a' inertia = -1.0 /\n&run t_end = 1.0 /\n")
    nocdyn.write("netcdf.nml", CASE_1.read_text().replace("interval = 0.01", "interval = 0.01 format = 'netcdf'"))
    outcome = nocdyn("run", CASE_2, "bad.nml", "netcdf.nml", "--out", "out")
    assert outcome.returncode == 2
    assert outcome.stderr == "nocdyn: bad.nml:1: &body 'a': inertia = -1.0 is out of range; allowed: >= 0 [kg m2]\n"
    assert [line.split(":")[0] for line in outcome.stdout.splitlines()] == [str(CASE_2), "netcdf.nml"]
    assert nocdyn.files("out/case2") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]
    assert nocdyn.files("out/netcdf") == RESULTS


def test_a_format_that_is_not_known_is_refused(nocdyn):
    outcome = nocdyn("run", CASE_2, "--set", "output.format=netcfd")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: --set output.format=netcfd: format = netcfd is not known; allowed: 'csv', 'netcdf'; did you mean 'netcdf'?\n"
    )


def test_its_size_is_estimated(nocdyn):
    chain = SOURCE / "input/examples/chain_200/chain_200.nml"
    columns = ("--set", "output.columns='omega_*'")
    outcome = nocdyn("check", chain, "--set", "output.points=200001", *columns, *NETCDF)
    assert outcome.stdout.endswith("\n  trajectory.nc: about 320 MB\n")  # 201 columns


def test_a_pipe_cannot_be_read_by_both_programs(nocdyn):
    outcome = nocdyn("run", "/dev/stdin", *NETCDF, input=CASE_2.read_text())
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == "nocdyn: /dev/stdin: format = 'netcdf' needs an input that can be read twice, not a pipe\n"
    with open(CASE_2) as file:
        assert nocdyn("run", "/dev/stdin", *NETCDF, "--out", "out", stdin=file).returncode == 0
    assert nocdyn.files("out") == RESULTS


def test_without_the_program_that_writes_it_a_run_says_why_it_cannot_be(nocdyn):
    nocdyn.executable = shutil.copy(os.environ["NOCDYN"], nocdyn.folder / "alone")
    outcome = nocdyn("run", CASE_2, *NETCDF)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    missing = nocdyn.folder / "nocdyn-sweep"
    assert outcome.stderr == (
        f"nocdyn: '{missing}', the program for format = 'netcdf', does not exist; "
        "cmake --build --preset release builds it beside nocdyn, unless -DNOCDYN_SWEEP=OFF is set\n"
    )
    assert nocdyn("run", CASE_2).returncode == 0


def test_trajectories_of_a_sweep_have_the_format_too(nocdyn):
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP + "&record trajectories = 2 /\n")
    assert nocdyn("sweep", "discs.nml", "--out", "out", *NETCDF).returncode == 0
    assert nocdyn.files("out/variant-2") == RESULTS
    assert open_results(nocdyn, "out/variant-2/trajectory.nc").sizes["t"] == 11
    assert nocdyn("sweep", "discs.nml", "--out", "out").returncode == 0
    assert nocdyn.files("out/variant-2") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]
