"""Curves over the speed that sweeps keep, and their bands."""

import csv
import json
import subprocess

import numpy as np
import pytest
import xarray
from sweep_inputs import MPI_ENVIRONMENT, mpirun, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

ROUNDING = 4 * np.finfo(float).eps  # of the interpolation of a quantile
QUANTILES = {"min": 0.0, "p5": 0.05, "p25": 0.25, "median": 0.5, "p75": 0.75, "p95": 0.95, "max": 1.0}
RESPONSE = "&response body = 'b0' speed_rpm = 200, 1800 count = 9 operating_rpm = 900, 1100 /\n"
RUN = "&run t_end = 1 /\n"
RECORDS = """\
&record mode = 1 statistic = 'curve' /
&record response = 'c0' statistic = 'curve', 'peak' /
&record response = 'c0' order = 2 statistic = 'curve' /
&record response = 'stress_c0' statistic = 'curve' /
"""
VARIED = """\
&sweep design = 'random' samples = 7 seed = 5 /
&vary target = 'coupling.*.stiffness' scale = 'relative' distribution = 'normal' mean = 1 deviation = 0.1 /
&vary target = 'body.b1.inertia' scale = 'relative' low = 0.9 high = 1.1 /
"""


def chain(seed: int) -> str:
    """A chain of bodies with two orders of excitation, whose means follow from a motor and a load."""
    random = np.random.default_rng(seed)
    bodies = int(random.integers(2, 5))
    text = "".join(f"&body name = 'b{i}' inertia = {random.uniform(0.5, 4):.4f} /\n" for i in range(bodies))
    for i in range(bodies - 1):
        text += (
            f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = {random.uniform(1e4, 9e4):.1f} "
            f"cubic_stiffness = {random.uniform(0, 1e6):.1f} damping = {random.uniform(5, 40):.2f} diameter = 0.1 /\n"
        )
    text += "&motor name = 'm' body = 'b0' a = 900 b = 4 c = 0 /\n"
    text += f"&load name = 'l' body = 'b{bodies - 1}' viscous = 2 quadratic = 0.01 /\n"
    return text + "&excitation name = 'x' body = 'b0' kind = 'orders' orders = 2, 3.5 amplitudes = 30, 8 /\n"


def sweep(nocdyn, text, *words, folder="swept"):
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", folder, "--csv", *words)
    assert outcome.returncode == 0, outcome.stderr
    return outcome.stdout


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def at_speeds(path, speeds, column):
    """A column of a table over the speed, at some of its speeds."""
    table = {float(row["omega_b0 [rad/s]"]): float(row[column]) for row in rows(path)}
    return [table[speed] for speed in speeds]


def bands_of(folder):
    """Speeds and columns of bands.csv, NaN where a cell is empty."""
    found = rows(folder / "bands.csv")
    return {label: np.array([float(row[label] or "nan") for row in found]) for label in found[0]}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_curve_is_the_response_and_the_diagram_of_the_variant_at_the_speeds(nocdyn, seed):
    sweep(nocdyn, chain(seed) + RESPONSE + RUN + VARIED + RECORDS, "-q")
    with xarray.open_dataset(nocdyn.folder / "swept/sweep.nc", engine="h5netcdf") as swept:
        speeds = swept["omega_b0"].values
        assert speeds == pytest.approx(np.linspace(200, 1800, 9) * np.pi / 30, rel=1e-14)
        for variant in (1, 5):
            for command in ("response", "campbell"):
                assert nocdyn(command, "--variant", f"swept:{variant}", "-q").returncode == 0
            results = nocdyn.folder / f"swept/variant-{variant}"
            for table, column, name in (
                ("response.csv", "half_range_total_moment_c0 [N m]", "total_moment_c0_curve"),
                ("response.csv", "half_range_stress_c0 [Pa]", "stress_c0_curve"),
                ("campbell.csv", "frequency_1 [Hz]", "mode_1_curve"),
            ):
                assert swept[name].dims == ("omega_b0", "variant")
                assert list(swept[name].sel(variant=variant)) == at_speeds(results / table, speeds, column)
            order_2 = [row for row in rows(results / "response_orders.csv") if float(row["order [1]"]) == 2]
            amplitude = {float(row["omega_b0 [rad/s]"]): float(row["total_moment_c0 [N m]"]) for row in order_2}
            assert list(swept["total_moment_c0_order_2_curve"].sel(variant=variant)) == [amplitude[one] for one in speeds]
        assert (swept["total_moment_c0_curve"].max("omega_b0") <= swept["total_moment_c0_peak"]).all(), "peaks between the speeds"


def test_bands_are_the_quantiles_of_the_curves_beside_that_of_the_input(nocdyn):
    limits = "&limit coupling = 'c0' vibratory_moment = 300 /\n&limit coupling = 'c0' stress = 1e6 /\n"
    printed = sweep(nocdyn, chain(4) + limits + RESPONSE + RUN + VARIED + RECORDS)
    assert "bands of 4 curves at 9 points of omega_b0 [rad/s]: bands.csv" in printed and "curve_1" not in printed
    bands = bands_of(nocdyn.folder / "swept")
    with xarray.open_dataset(nocdyn.folder / "swept/sweep.nc", engine="h5netcdf") as swept:
        speeds = bands.pop("omega_b0 [rad/s]")
        assert list(speeds) == list(swept["omega_b0"].values)
        for name, unit in (("total_moment_c0_curve", "N m"), ("total_moment_c0_order_2_curve", "N m"), ("mode_1_curve", "Hz")):
            for word, share in QUANTILES.items():
                expected = np.quantile(swept[name].values, share, axis=1)
                assert bands[f"{name}_{word} [{unit}]"] == pytest.approx(expected, rel=ROUNDING)
            assert list(bands[f"{name}_variants [1]"]) == [7] * 9
    for command in ("response", "campbell"):
        assert nocdyn(command, nocdyn.folder / "machine.nml", "--out", "alone", "-q").returncode in (0, 1)
    alone = nocdyn.folder / "alone"
    moment = at_speeds(alone / "response.csv", speeds, "half_range_total_moment_c0 [N m]")
    assert list(bands["total_moment_c0_curve_nominal [N m]"]) == moment
    assert list(bands["mode_1_curve_nominal [Hz]"]) == at_speeds(alone / "campbell.csv", speeds, "frequency_1 [Hz]")
    assert list(bands["order_3.5 [Hz]"]) == at_speeds(alone / "campbell.csv", speeds, "order_3.5 [Hz]")
    modulus = np.pi * 0.1**3 / 16
    assert bands["total_moment_c0_curve_limit [N m]"] == pytest.approx(np.full(9, 1e6 * modulus)), "that of the stress is lower"
    assert bands["stress_c0_curve_limit [Pa]"] == pytest.approx(np.full(9, 1e6))
    assert "mode_1_curve_limit [Hz]" not in bands
    assert "total_moment_c0_order_2_curve_limit [N m]" not in bands, "limits of all orders together"
    summary = json.loads((nocdyn.folder / "swept/summary.json").read_text())
    assert summary["bands"]["points"] == 9 and len(summary["bands"]["curves"]) == 4
    assert list(summary["statistics"]) == ["total_moment_c0_peak"]


def test_the_curve_of_one_order_has_the_limit_of_one_order(nocdyn):
    limit = "&limit coupling = 'c0' vibratory_moment = 300 vibratory_frequency = 50, 450 vibratory_moments = 40, 80 /\n"
    sweep(nocdyn, chain(4) + limit + RESPONSE + RUN + VARIED + RECORDS, "-q")
    bands = bands_of(nocdyn.folder / "swept")
    expected = np.interp(2 * bands["omega_b0 [rad/s]"], [50, 450], [40, 80])
    assert bands["total_moment_c0_order_2_curve_limit [N m]"] == pytest.approx(expected)
    assert bands["total_moment_c0_curve_limit [N m]"] == pytest.approx(np.full(9, 300))


def test_a_sweep_without_curves_removes_the_bands_of_another_one(nocdyn):
    sweep(nocdyn, chain(1) + RESPONSE + RUN + VARIED + RECORDS, "-q")
    assert (nocdyn.folder / "swept/bands.csv").is_file()
    sweep(nocdyn, chain(1) + RESPONSE + RUN + VARIED + "&record mode = 1 statistic = 'frequency' /\n", "-q")
    assert not (nocdyn.folder / "swept/bands.csv").exists()


def files_of(folder):
    return {name: (folder / name).read_bytes() for name in ("sweep.nc", "sweep.csv", "bands.csv", "columns.json")}


def test_curves_do_not_depend_on_threads_shards_or_resuming(nocdyn):
    text = chain(2) + RESPONSE + RUN + VARIED + RECORDS
    sweep(nocdyn, text, "-q", "--threads", "1")
    one = files_of(nocdyn.folder / "swept")
    sweep(nocdyn, text, "-q", "--threads", "3", folder="threads")
    assert files_of(nocdyn.folder / "threads") == one
    for shard in ("1/2", "2/2"):
        assert nocdyn("sweep", nocdyn.folder / "machine.nml", "--out", "shards", "-q", "--shard", shard).returncode == 0
    assert nocdyn("merge", "shards", "--csv", "-q").returncode == 0
    assert files_of(nocdyn.folder / "shards") == one
    resumed = nocdyn("sweep", nocdyn.folder / "machine.nml", "--out", "swept", "--csv", "--resume")
    assert resumed.returncode == 0 and files_of(nocdyn.folder / "swept") == one


@needs_mpi
def test_curves_do_not_depend_on_ranks(nocdyn):
    sweep(nocdyn, chain(2) + RESPONSE + RUN + VARIED + RECORDS, "-q")
    words = [*mpirun(2), "sweep", "machine.nml", "--out", "ranks", "--csv", "-q"]
    outcome = subprocess.run(words, cwd=nocdyn.folder, env=MPI_ENVIRONMENT, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    assert files_of(nocdyn.folder / "ranks") == files_of(nocdyn.folder / "swept")


PAIR = """\
&body name = 'b0' inertia = 3 /
&body name = 'b1' inertia = 2 /
&coupling name = 'c0' bodies = 'b0', 'b1' stiffness = 5e4 damping = 20 /
&excitation name = 'x' body = 'b0' kind = 'orders' orders = 2 amplitudes = 7 /
"""


def test_a_curve_has_gaps_where_a_variant_has_no_number(nocdyn):
    loads = "".join(f"&load name = 'l{i}' body = 'b{i}' quadratic = 0.01 /\n" for i in (0, 1))  # slopes grow with the speed
    text = PAIR + loads + RESPONSE + RUN + "&record mode = 1 statistic = 'curve' /\n"
    text += "&sweep design = 'grid' /\n&vary target = 'load.*.quadratic' low = 0.01 high = 10 count = 2 /\n"
    sweep(nocdyn, text, "-q")
    bands = bands_of(nocdyn.folder / "swept")
    light, heavy = rows(nocdyn.folder / "swept/sweep.csv")
    assert (light["status"], heavy["status"]) == ("done", "done")
    cells = [heavy[f"mode_1_curve_{point} [Hz]"] for point in range(1, 10)]
    overdamped = np.array([cell == "" for cell in cells])
    assert overdamped.any() and not overdamped.all()
    assert list(bands["mode_1_curve_variants [1]"]) == list(np.where(overdamped, 1, 2))
    assert (bands["mode_1_curve_min [Hz]"] == bands["mode_1_curve_nominal [Hz]"])[overdamped].all()


def test_a_variant_without_the_mode_at_any_speed_fails(nocdyn):
    text = PAIR + RESPONSE + RUN + "&record mode = 1 statistic = 'curve' /\n"
    text += "&sweep design = 'grid' /\n&vary target = 'coupling.c0.damping' low = 20 high = 1e4 count = 2 /\n"
    sweep(nocdyn, text, "-q")
    light, heavy = rows(nocdyn.folder / "swept/sweep.csv")
    assert (light["status"], heavy["status"]) == ("done", "failed")
    assert heavy["reason"] == "mode 1 is recorded, but the number of oscillating modes over the speed is 0"


def test_a_response_that_is_unstable_at_some_speeds_has_a_curve_at_the_others(nocdyn):
    falling = "&load name = 'l' body = 'b0' table_speed = 0, 60, 90, 1000 table_torque = 0, 60, 59, 400 "
    text = PAIR.replace("damping = 20", "damping = 1e-6") + falling + "extrapolation = 'constant' /\n" + RESPONSE + RUN
    text += "&sweep design = 'grid' /\n&vary target = 'coupling.c0.stiffness' low = 5e4 high = 6e4 count = 2 /\n"
    sweep(nocdyn, text + "&record response = 'c0' statistic = 'curve' /\n", "-q")
    bands = bands_of(nocdyn.folder / "swept")
    unstable = (bands["omega_b0 [rad/s]"] > 60) & (bands["omega_b0 [rad/s]"] < 90)
    assert unstable.any() and not unstable.all()
    assert list(bands["total_moment_c0_curve_variants [1]"]) == list(np.where(unstable, 0, 2))
    assert (np.isnan(bands["total_moment_c0_curve_median [N m]"]) == unstable).all()
    assert (np.isnan(bands["total_moment_c0_curve_nominal [N m]"]) == unstable).all()


def test_bands_need_no_computable_machine_of_the_input(nocdyn):
    falling = "&load name = 'l' body = 'b0' table_speed = 0, 10, 1000 table_torque = 0, 10, 9 extrapolation = 'constant' /\n"
    text = PAIR.replace("damping = 20", "damping = 1e-6") + falling + RESPONSE + RUN
    text += "&sweep design = 'grid' /\n&vary target = 'coupling.c0.damping' low = 20 high = 40 count = 2 /\n"
    sweep(nocdyn, text + "&record response = 'c0' statistic = 'curve' /\n", "-q")
    bands = bands_of(nocdyn.folder / "swept")
    assert np.isfinite(bands["total_moment_c0_curve_median [N m]"]).all()
    assert not any("nominal" in label for label in bands)


def test_a_response_over_a_shaker_has_bands_over_its_frequency(nocdyn):
    text = PAIR.replace("kind = 'orders' orders = 2 amplitudes = 7", "kind = 'harmonic' amplitude = 7 frequency_hz = 10")
    text += "&response frequency_hz = 5, 50 count = 10 /\n" + RUN + VARIED + "&record response = 'c0' statistic = 'curve' /\n"
    sweep(nocdyn, text, "-q")
    bands = bands_of(nocdyn.folder / "swept")
    assert bands["frequency [Hz]"] == pytest.approx(np.arange(5, 51, 5))
    assert nocdyn("response", nocdyn.folder / "machine.nml", "--out", "alone", "-q").returncode == 0
    alone = {float(row["frequency [Hz]"]): row for row in rows(nocdyn.folder / "alone/response.csv")}
    moment = [float(alone[one]["half_range_total_moment_c0 [N m]"]) for one in bands["frequency [Hz]"]]
    assert list(bands["total_moment_c0_curve_nominal [N m]"]) == moment


def test_speeds_of_bands_have_the_unit_that_the_input_asks_for(nocdyn):
    sweep(nocdyn, PAIR + RESPONSE + RUN + VARIED + "&record mode = 1 statistic = 'curve' /\n&output units = 'rpm' /\n", "-q")
    assert bands_of(nocdyn.folder / "swept")["omega_b0 [rpm]"] == pytest.approx(np.linspace(200, 1800, 9))


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        ("statistic = 'curve'", "order = 2 statistic = 'curve'", "statistic = 'curve' is of the mode alone; allowed: no order"),
        ("mode = 1", "mode = 2", "mode = 2 is out of range; the machine of the input has 1 oscillating modes over its speed"),
        ("'curve'", "'curve', 'curve'", "'mode_1_curve' is recorded already; allowed: once"),
        (RESPONSE, "", "there is no group &response"),
        (
            "target = 'body.b1.inertia' scale = 'relative' low = 0.9 high = 1.1",
            "target = 'response.speed_rpm(2)' low = 1500 high = 1800",
            "&response: speed varies, and a &record with statistic = 'curve' compares the variants at the same speeds",
        ),
        (
            "count = 9",
            "count = 10001",
            "statistic = 'curve' keeps a number at each of the 10001 speeds of &response; allowed: at most 10000",
        ),
        ("mode = 1", "quantity = 'omega_b0'", "statistic = 'curve' does not belong to quantity; needed: mode or response"),
        ("mode = 1", "orbit = 'branch'", "&orbit"),
    ],
)
def test_curves_that_cannot_be_kept_are_refused(nocdyn, old, new, complaint):
    text = PAIR + RESPONSE + RUN + VARIED + "&record mode = 1 statistic = 'curve' /\n"
    assert old in text
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text.replace(old, new)), "--out", "swept")
    assert outcome.returncode == 2 and complaint in outcome.stderr
    assert not (nocdyn.folder / "swept").exists()


def test_modes_have_no_curve_over_a_shaker(nocdyn):
    text = PAIR.replace("kind = 'orders' orders = 2 amplitudes = 7", "kind = 'harmonic' amplitude = 7 frequency_hz = 10")
    text += "&response frequency_hz = 5, 50 count = 10 /\n" + RUN + VARIED + "&record mode = 1 statistic = 'curve' /\n"
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", "swept")
    assert outcome.returncode == 2
    assert "statistic = 'curve' of a mode is over speeds, and &response is over the frequency of a shaker" in outcome.stderr
