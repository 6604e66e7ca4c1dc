"""What is kept of a sweep: sweep.nc as xarray reads it, sweep.csv as pandas does, and what kills and full disks leave.

The program sweep_store (tests/store) keeps results that need no computation."""

import csv
import os
import random
import resource
import signal
import subprocess
import time
from pathlib import Path

import numpy
import pandas
import pytest
import xarray
from conftest import IS_SANITIZED

STORE = os.environ["NOCDYN_SWEEP_STORE"]

VARIANTS = 20_000
RESULTS = ["omega_motor_final", "moment_a_b_max", "moment_a_b_max_"]


def store(folder, variants=VARIANTS, chunk=512, **options):
    return subprocess.run([STORE, folder, str(variants), str(chunk)], capture_output=True, text=True, timeout=120, **options)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept")
    outcome = store(folder)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return folder, outcome.stdout.splitlines()


def files(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def limited_to(size):
    """Files of the process cannot grow beyond so many bytes."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def test_a_finished_sweep_leaves_its_files_alone(kept):
    folder, _ = kept
    assert files(folder) == ["sweep.csv", "sweep.nc"]


def test_xarray_reads_names_units_and_flags(kept):
    folder, _ = kept
    with xarray.open_dataset(folder / "sweep.nc") as data:
        assert data.sizes["variant"] == VARIANTS
        assert (data.variant.values == numpy.arange(1, VARIANTS + 1)).all()
        assert data["load.work.viscous"].attrs == {
            "units": "N m s/rad",
            "long_name": "viscous of load 'work'",
            "label": "load.work.viscous",
            "role": "parameter",
        }
        assert data["gear.a_b.radii(2)"].attrs["label"] == "gear.a/b.radii(2)"
        assert [name for name in data if data[name].attrs.get("role") == "result"] == RESULTS
        assert data.status.attrs["flag_meanings"] == "done refused failed"
        assert list(data.status.attrs["flag_values"]) == [0, 1, 2]
        assert data.attrs["title"] == "A sample" and data.attrs["design"] == "random" and data.attrs["seed"] == 42
        assert data.attrs["input"] == "&body name = 'a' /\n&sweep design = 'random' /\n"


def test_xarray_reads_nan_and_the_reason_of_what_is_not_done(kept):
    folder, _ = kept
    with xarray.open_dataset(folder / "sweep.nc") as data:
        is_done = data.status.values == 0
        for name in RESULTS:
            assert (numpy.isnan(data[name].values) == ~is_done).all()
        assert (data.failed_variant.values == data.variant.values[~is_done]).all()
        reasons = dict(zip(data.failed_variant.values, data.reason.values, strict=True))
    assert reasons[5] == 'variant 5 is "refused", and why'
    assert reasons[7] == "too many steps"


def test_the_table_holds_the_same_numbers(kept):
    folder, _ = kept
    table = pandas.read_csv(folder / "sweep.csv")
    with xarray.open_dataset(folder / "sweep.nc") as data:
        columns = ["load.work.viscous [N m s/rad]", "omega_motor_final [rad/s]"]
        for column, name in zip(columns, ["load.work.viscous", "omega_motor_final"], strict=True):
            assert numpy.array_equal(table[column].to_numpy(), data[name].values, equal_nan=True)
        words = numpy.array(["done", "refused", "failed"])[data.status.values]
        assert (table["status"].to_numpy() == words).all()
        assert (table["steps"].to_numpy() == data.steps.values).all()
    with open(folder / "sweep.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert rows[4]["reason"] == 'variant 5 is "refused", and why' and rows[0]["reason"] == ""


def test_order_statistics_are_those_of_numpy(kept):
    folder, lines = kept
    with xarray.open_dataset(folder / "sweep.nc") as data:
        for name, line in zip(RESULTS, lines[1:], strict=True):
            values = data[name].values
            found = list(map(float, line.split()))
            # numpy rounds its interpolation otherwise in the last bit
            expected = numpy.nanquantile(values, [0, 0.05, 0.5, 0.95, 1])
            numpy.testing.assert_allclose(found[:5], expected, rtol=4e-16, atol=0)
            assert found[5:] == [numpy.nanargmin(values) + 1, numpy.nanargmax(values) + 1]


def test_the_files_are_the_same_bytes_for_other_chunks(kept, tmp_path):
    folder, lines = kept
    outcome = store(tmp_path, chunk=3001)
    assert outcome.stdout.splitlines() == lines
    for name in ("sweep.nc", "sweep.csv"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_a_killed_sweep_goes_on_and_ends_in_the_same_bytes(kept, tmp_path):
    folder, _ = kept
    moments = random.Random(1)
    found = [0]
    for _ in range(8):
        process = subprocess.Popen([STORE, tmp_path, str(VARIANTS), "16"], stdout=subprocess.PIPE, text=True)
        found.append(int(process.stdout.readline().split()[1]))
        time.sleep(moments.uniform(0, 0.02))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        if not (tmp_path / "sweep.journal").exists():
            break
    outcome = store(tmp_path)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert found == sorted(found) and found[-1] > 0
    for name in ("sweep.nc", "sweep.csv"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


def test_a_full_disk_leaves_a_journal_to_go_on_with(kept, tmp_path):
    folder, _ = kept
    outcome = store(tmp_path, preexec_fn=limited_to(500_000))
    assert outcome.returncode == 3
    assert outcome.stderr == f"cannot write '{tmp_path}/sweep.journal': File too large\n"
    assert files(tmp_path) == ["sweep.journal"]
    outcome = store(tmp_path)
    assert outcome.returncode == 0 and int(outcome.stdout.split()[1]) > VARIANTS // 4
    assert (tmp_path / "sweep.nc").read_bytes() == (folder / "sweep.nc").read_bytes()


def test_no_room_for_the_head_of_a_journal_leaves_nothing(tmp_path):
    outcome = store(tmp_path, preexec_fn=limited_to(100))
    assert outcome.returncode == 3
    assert outcome.stderr == f"cannot write '{tmp_path}/sweep.journal': File too large\n"
    assert files(tmp_path) == []


def test_no_room_for_the_table_leaves_the_journal_and_no_table(kept, tmp_path):
    folder, _ = kept
    outcome = store(tmp_path, preexec_fn=limited_to((folder / "sweep.csv").stat().st_size - 1))
    assert (outcome.returncode, outcome.stderr) == (3, f"cannot write '{tmp_path}/sweep.csv': File too large\n")
    assert files(tmp_path) == ["sweep.journal", "sweep.nc"]


# nothing of sweep.nc fits, its attributes do, half of it does, all but its end does
@pytest.mark.parametrize("room", [0, 100, 9_000, 500_000, -1])
def test_no_room_for_the_results_leaves_the_journal_alone(kept, tmp_path, room):
    folder, _ = kept
    # a whole journal: the table is larger than that
    store(tmp_path, preexec_fn=limited_to((folder / "sweep.csv").stat().st_size - 1))
    (tmp_path / "sweep.nc").unlink()
    size = room if room >= 0 else (folder / "sweep.nc").stat().st_size - 1
    outcome = store(tmp_path, preexec_fn=limited_to(size))
    assert (outcome.returncode, outcome.stderr) == (3, f"cannot write '{tmp_path}/sweep.nc': File too large\n")
    assert files(tmp_path) == ["sweep.journal"]


def test_a_second_process_is_refused(tmp_path):
    process = subprocess.Popen([STORE, tmp_path, "100000000", "16"], stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    outcome = store(tmp_path)
    process.kill()
    process.communicate()
    assert (outcome.returncode, outcome.stderr) == (
        2,
        f"{tmp_path}/sweep.journal: another process is at work on this sweep\n",
    )


def peak_memory(folder, variants):
    """Of one run, in bytes."""
    process = subprocess.Popen([STORE, folder, str(variants), "512"], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return usage.ru_maxrss * 1024


@pytest.mark.skipif(IS_SANITIZED, reason="AddressSanitizer keeps what is freed")
def test_memory_does_not_grow_with_the_variants(tmp_path):
    small, large = peak_memory(tmp_path / "small", 100_000), peak_memory(tmp_path / "large", 300_000)
    results = 200_000 * 3 * 8
    assert large - small < results / 4
