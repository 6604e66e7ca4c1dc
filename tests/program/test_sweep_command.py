"""nocdyn sweep and nocdyn merge: what they print, write and refuse."""

import csv
import os
import re
import shutil
import subprocess

import h5netcdf
import pytest
import xarray
from sweep_inputs import MIXED, SWEEP, SWEEP_PROGRAM, TWO_DISCS, needs_sweeps

pytestmark = needs_sweeps

# A single run at this tolerance is the truth for one at the tolerance of the sweep.
TRUTH = ("--set", "run.rtol=1e-12", "--set", "run.atol=1e-12")
# largest relative error of the results of a sweep at tolerance 1e-8
ERROR = 1e-6

PURE_POWERS = """\
&body     name = 'disc'   inertia = 1.0  speed = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'disc' stiffness = 0.0 cubic_stiffness = 4.0 /
&motor    name = 'drive'  body = 'disc' a = 0.3 b = 0.0 c = 0.2 /
&run      t_end = 2.0 rtol = 1e-8 atol = 1e-8 /
&output   points = 11 /
&sweep    design = 'grid' /
&vary     target = 'coupling.spring.cubic_stiffness' low = 2.0 high = 6.0 count = 4 /
&record   quantity = 'omega_disc' statistic = 'final' /
"""


@pytest.fixture
def discs(nocdyn):
    return nocdyn.write("discs.nml", TWO_DISCS + SWEEP)


def table(nocdyn, folder):
    """The rows of sweep.csv."""
    with open(nocdyn.folder / folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_a_sweep_leaves_its_files_and_no_journal(nocdyn, discs):
    outcome = nocdyn("sweep", discs, "--out", "out", "--csv", "--threads", 2)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.csv", "sweep.nc"]
    title, header, *rows, end = outcome.stdout.splitlines()
    assert title == "Two discs"
    assert header.split() == [
        "result",
        "(60",
        "variants)",
        "min",
        "5",
        "%",
        "median",
        "95",
        "%",
        "max",
        "variant",
        "of",
        "min",
        "variant",
        "of",
        "max",
    ]
    assert [row.split()[0] for row in rows] == [
        "omega_wheel_final",
        "omega_wheel_max",
        "omega_wheel_time_of_max",
        "moment_shaft_max_abs_from_0.5",
        "moment_shaft_rms_from_0.5",
    ]
    took = r"computed in [\d.e+-]+ s \([\d.e+]+ per second\), written in [\d.e+-]+ s"
    assert re.fullmatch(f"{re.escape(str(discs))}: 60 variants done, {took}; results in out", end)


def test_a_quiet_sweep_prints_nothing(nocdyn, discs):
    outcome = nocdyn("sweep", discs, "--out", "out", "-q")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, "", "")


def test_the_summary_tells_counts_speed_and_the_distribution_of_results(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out", "--csv", "--threads", 2)
    summary = nocdyn.summary("out")
    assert (summary["status"], summary["title"], summary["threads"], summary["ranks"]) == ("done", "Two discs", 2, 1)
    assert summary["counts"] == {"variants": 60, "done": 60, "refused": 0, "failed": 0}
    assert summary["design"]["design"] == "random" and summary["design"]["seed"] == 3
    assert summary["variants_per_second"] == pytest.approx(60 / summary["wall_time_s"])
    assert summary["writing_time_s"] > 0
    assert (summary["settings"]["formulation"], summary["settings"]["complement"]) == ("reduced", "natural")
    found = summary["statistics"]["omega_wheel_max"]
    values = {int(row["variant"]): float(row["omega_wheel_max [rad/s]"]) for row in table(nocdyn, "out")}
    assert found["unit"] == "rad/s"
    assert (found["min"], found["max"]) == (min(values.values()), max(values.values()))
    assert (values[found["variant_of_min"]], values[found["variant_of_max"]]) == (found["min"], found["max"])
    assert found["min"] < found["p5"] < found["median"] < found["p95"] < found["max"]


def test_the_results_are_those_of_single_runs(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out", "--csv")
    for row in table(nocdyn, "out")[::7]:
        stiffness = row["coupling.shaft.stiffness [N m/rad]"]
        viscous = row["load.drag.viscous [N m s/rad]"]
        numbers = ("--set", f"coupling.shaft.stiffness={stiffness}", "--set", f"load.drag.viscous={viscous}")
        nocdyn("run", discs, "--out", "single", *numbers, *TRUTH)
        wheel = nocdyn.summary("single")["columns"]["omega_wheel [rad/s]"]
        assert float(row["omega_wheel_final [rad/s]"]) == pytest.approx(wheel["last"], rel=ERROR)
        assert float(row["omega_wheel_max [rad/s]"]) == pytest.approx(wheel["max"], rel=ERROR)
        # an error e of a parabola moves its top by e / (slope of its slope x distance): the root of the tolerance
        assert float(row["omega_wheel_time_of_max [s]"]) == pytest.approx(wheel["time_of_max"], rel=1e-4)


def test_variants_that_cannot_be_or_fail_are_recorded_with_their_reasons(nocdyn):
    nocdyn.write("mixed.nml", MIXED)
    outcome = nocdyn("sweep", "mixed.nml", "--out", "out", "--csv")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    rows = table(nocdyn, "out")
    assert [row["variant"] for row in rows] == [str(i) for i in range(1, 51)]
    refused = [row for row in rows if row["status"] == "refused"]
    assert {row["body.disc.inertia [kg m2]"] for row in refused} == {"-0.5", "0"} and len(refused) == 20
    assert all("inertia = " in row["reason"] and "; allowed: >" in row["reason"] for row in refused)
    failed = [row for row in rows if row["status"] == "failed"]
    assert failed and all("the step size became too small at t = " in row["reason"] for row in failed)
    assert all(row["omega_disc_final [rad/s]"] == "" for row in refused + failed)
    done = [row for row in rows if row["status"] == "done"]
    assert all(row["reason"] == "" and row["omega_disc_final [rad/s]"] != "" for row in done)
    counts = {"variants": 50, "done": len(done), "refused": 20, "failed": len(failed)}
    assert nocdyn.summary("out")["counts"] == counts
    assert f"{len(done)} variants done, 20 refused, {len(failed)} failed, " in outcome.stdout


def test_numbers_of_run_can_vary(nocdyn):
    nocdyn.write("mixed.nml", MIXED)
    nocdyn("sweep", "mixed.nml", "--out", "out", "--csv")
    rows = [row for row in table(nocdyn, "out") if row["status"] == "done"]
    for row in rows[:: len(rows) // 4]:
        names = {"run.t_end [s]", "body.disc.inertia [kg m2]", "coupling.shaft.cubic_stiffness [N m/rad3]"}
        numbers = [word for name in names for word in ("--set", f"{name.split()[0]}={row[name]}")]
        nocdyn("run", "mixed.nml", "--out", "single", *numbers, *TRUTH)
        speed = nocdyn.summary("single")["columns"]["omega_disc [rad/s]"]
        assert float(row["omega_disc_final [rad/s]"]) == pytest.approx(speed["last"], rel=ERROR)


@pytest.mark.parametrize("method", ["rk45", "taylor"])
def test_laws_without_their_linear_terms_are_computed(nocdyn, method):
    nocdyn.write("spring.nml", PURE_POWERS)
    assert nocdyn("sweep", "spring.nml", "--out", "out", "--csv", "--set", f"run.method={method}").returncode == 0
    for row in table(nocdyn, "out"):
        cubic = row["coupling.spring.cubic_stiffness [N m/rad3]"]
        nocdyn("run", "spring.nml", "--out", "single", "--set", f"coupling.spring.cubic_stiffness={cubic}", *TRUTH)
        speed = nocdyn.summary("single")["columns"]["omega_disc [rad/s]"]
        assert float(row["omega_disc_final [rad/s]"]) == pytest.approx(speed["last"], rel=ERROR)


@pytest.mark.parametrize("method", ["rk45", "taylor"])
def test_variants_of_other_tolerances_have_the_bits_of_a_sweep_of_these(nocdyn, method):
    groups = [line for line in SWEEP.splitlines() if "&vary" not in line and "&sweep" not in line]
    groups += ["&sweep design = 'grid' /", "&vary target = 'run.rtol' low = 1e-12 high = 1e-4 count = 2 /"]
    groups += ["&vary target = 'load.drag.viscous' low = 0.3 high = 0.6 count = 2 /"]
    words = ("--csv", "--set", f"run.method={method}")
    for folder, rtol in (("alone", "1e-8"), ("fine", "1e-12"), ("coarse", "1e-4")):
        nocdyn.write("discs.nml", TWO_DISCS.replace("rtol = 1e-8", f"rtol = {rtol}") + "\n".join(groups) + "\n")
        assert nocdyn("sweep", "discs.nml", "--out", folder, *words).returncode == 0
    alone, fine, coarse = (table(nocdyn, folder) for folder in ("alone", "fine", "coarse"))
    assert alone == fine == coarse
    assert alone[0]["steps"] != alone[2]["steps"]


def test_a_sweep_without_a_variant_that_is_done_fails(nocdyn, discs):
    outcome = nocdyn("sweep", discs, "--out", "out", "--set", "run.max_steps=5")
    assert outcome.returncode == 1
    with h5netcdf.File(nocdyn.folder / "out/sweep.nc") as content:
        reason = content.variables["reason"][0].tobytes().rstrip(b"\0").decode()
    assert "the most that max_steps allows" in reason
    assert (
        outcome.stderr
        == f"nocdyn: {discs}: no variant can be computed; reason of the first one: {reason}; all reasons are in out/sweep.nc\n"
    )
    assert nocdyn.summary("out")["status"] == "failed"
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]


def test_a_table_of_an_earlier_sweep_does_not_stay_beside_new_results(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out", "--csv")
    assert "sweep.csv" in nocdyn.files("out")
    nocdyn("sweep", discs, "--out", "out", "--set", "sweep.seed=4")
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]


LIFE = "&fatigue name = 'life' coupling = {0} reference_moment = 5 reference_cycles = 1e6 slope = 5 /\n"


def test_cycles_of_an_earlier_run_do_not_stay_beside_new_results(nocdyn, discs):
    coupling = re.search(r"&coupling\s+name = ('\w+')", TWO_DISCS)[1]
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP + LIFE.format(coupling))
    nocdyn("run", "discs.nml", "--out", "out")
    assert "cycles.csv" in nocdyn.files("out")
    assert nocdyn("sweep", "discs.nml", "--out", "out").returncode == 0
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]


def test_limits_that_a_sweep_does_not_look_at_are_noted(nocdyn, discs):
    coupling = re.search(r"&coupling\s+name = ('\w+')", TWO_DISCS)[1]
    path = nocdyn.write("limited.nml", TWO_DISCS + SWEEP + f"&limit coupling = {coupling} moment = 5 /\n")
    assert ": &limit: note: a sweep compares nothing with a &limit; " in nocdyn("sweep", path, "--out", "out").stdout
    assert "note:" not in nocdyn("sweep", discs, "--out", "other", "--set", "sweep.seed=4").stdout
    assert nocdyn("sweep", path, "--out", "quiet", "--quiet").stdout == ""


def test_trajectories_of_an_earlier_sweep_and_a_run_do_not_stay_beside_new_results(nocdyn, discs):
    nocdyn("run", discs, "--out", "out")
    for variants in ("1, 2, 3", "2"):
        nocdyn.write("discs.nml", TWO_DISCS + SWEEP + f"&record trajectories = {variants} /\n")
        assert nocdyn("sweep", "discs.nml", "--out", "out").returncode == 0
        for own in ("variant-3/own.txt", "variant-/input.nml", "variant-1a/input.nml"):
            nocdyn.write(f"out/{own}", "of the user")
    assert nocdyn.files("out") == [
        "columns.json",
        "input.nml",
        "summary.json",
        "sweep.nc",
        "variant-",
        "variant-1a",
        "variant-2",
        "variant-3",
    ]
    assert nocdyn.files("out/variant-") == nocdyn.files("out/variant-1a") == ["input.nml"]
    assert nocdyn.files("out/variant-3") == ["own.txt"]
    assert nocdyn.files("out/variant-2") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]


def test_a_run_does_not_go_to_the_folder_of_a_sweep(nocdyn, discs, spinner):
    nocdyn("sweep", discs, "--out", "out/discs")
    before = {name: (nocdyn.folder / "out/discs" / name).read_bytes() for name in nocdyn.files("out/discs")}
    outcome = nocdyn("run", discs, spinner, "--out", "out", "-q")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        f"nocdyn: {discs}: out/discs holds the results of a sweep; choose another folder with --out, or remove sweep.nc\n"
    )
    assert {name: (nocdyn.folder / "out/discs" / name).read_bytes() for name in nocdyn.files("out/discs")} == before
    assert nocdyn.files("out/spinner") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]


@pytest.mark.parametrize("name", ["sweep.journal", "sweep.1-of-2.journal"])
def test_a_run_does_not_go_to_the_folder_of_a_sweep_that_is_not_finished(nocdyn, discs, name):
    nocdyn.write(f"out/{name}", "of a sweep")
    outcome = nocdyn("run", discs, "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        f"nocdyn: {discs}: out holds an unfinished sweep; choose another folder with --out, or remove '{name}'\n"
    )
    assert nocdyn.files("out") == [name]


def test_a_reader_of_the_output_who_is_gone_costs_no_results(nocdyn, discs):
    reading, writing = os.pipe()
    os.close(reading)
    nocdyn.start("sweep", discs, "--out", "out", stdout=writing).wait(timeout=60)
    os.close(writing)
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]


def test_trajectories_of_chosen_variants_are_those_of_runs(nocdyn, discs):
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP + "&record trajectories = 2, 17 /\n")
    nocdyn("sweep", "discs.nml", "--out", "out", "--csv")
    assert nocdyn.files("out") == [
        "columns.json",
        "input.nml",
        "summary.json",
        "sweep.csv",
        "sweep.nc",
        "variant-17",
        "variant-2",
    ]
    assert nocdyn.files("out/variant-17") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]
    row = table(nocdyn, "out")[16]
    header, rows = nocdyn.table("out/variant-17")
    speed = rows[-1][header.index("omega_wheel [rad/s]")]
    assert speed == pytest.approx(float(row["omega_wheel_final [rad/s]"]), rel=ERROR)
    assert "&sweep" not in (nocdyn.folder / "out/variant-17/input.nml").read_text()
    nocdyn("run", "out/variant-17/input.nml", "--out", "again")
    assert (nocdyn.folder / "again/trajectory.csv").read_bytes() == (nocdyn.folder / "out/variant-17/trajectory.csv").read_bytes()


def test_input_nml_repeats_the_sweep(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out", "--set", "run.rtol=1e-7")
    nocdyn("sweep", "out/input.nml", "--out", "again")
    assert (nocdyn.folder / "again/sweep.nc").read_bytes() == (nocdyn.folder / "out/sweep.nc").read_bytes()


def test_run_takes_no_notice_of_the_groups_of_a_sweep(nocdyn, discs):
    nocdyn.write("plain.nml", TWO_DISCS)
    assert nocdyn("run", discs, "--out", "sweep", "-q").returncode == 0
    nocdyn("run", "plain.nml", "--out", "plain", "-q")
    assert (nocdyn.folder / "sweep/trajectory.csv").read_bytes() == (nocdyn.folder / "plain/trajectory.csv").read_bytes()


def test_shards_are_merged(nocdyn, discs):
    for part in (1, 2, 3):
        outcome = nocdyn("sweep", discs, "--out", "out", "--shard", f"{part}/3")
        assert outcome.stdout == f"{discs}: part {part} of 3 done, 20 variants; when all parts are done: nocdyn merge out\n"
    assert nocdyn.files("out") == [f"sweep.{part}-of-3.journal" for part in (1, 2, 3)]
    outcome = nocdyn("merge", "out", "--csv")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout.startswith("Two discs\n")
    assert outcome.stdout.endswith(f"{discs}: 60 variants done; results in out\n")
    assert nocdyn.summary("out")["input"] == str(discs)
    assert "variants_per_second" not in nocdyn.summary("out")
    nocdyn("sweep", discs, "--out", "whole", "--csv")
    for name in ("sweep.nc", "sweep.csv"):
        assert (nocdyn.folder / "out" / name).read_bytes() == (nocdyn.folder / "whole" / name).read_bytes()
    assert nocdyn("merge", "out").returncode == 0
    journals = [f"sweep.{part}-of-3.journal" for part in (1, 2, 3)]
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", *journals, "sweep.nc"]


def test_parts_of_a_list_are_merged_without_its_file(nocdyn):
    sweep = (
        "&sweep design = 'list' file = 'list.csv' /\n&record quantity = 'omega_wheel' statistic = 'final' trajectories = 2 /\n"
    )
    nocdyn.write("discs.nml", TWO_DISCS + sweep)
    nocdyn.write("list.csv", "load.drag.viscous\n0.2\n0.3\n0.4\n")
    nocdyn("sweep", "discs.nml", "--out", "whole")
    for part in (1, 2):
        nocdyn("sweep", "discs.nml", "--out", "out", "--shard", f"{part}/2")
    (nocdyn.folder / "list.csv").unlink()
    outcome = nocdyn("merge", "out", "-q")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, "", "")
    for name in ("sweep.nc", "variant-2/trajectory.csv"):
        assert (nocdyn.folder / "out" / name).read_bytes() == (nocdyn.folder / "whole" / name).read_bytes()


def test_a_merge_without_all_parts_is_refused_by_their_variants(nocdyn, discs):
    for part in (1, 3):
        nocdyn("sweep", discs, "--out", "out", "--shard", f"{part}/3", "-q")
    outcome = nocdyn("merge", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == "nocdyn: sweep.2-of-3.journal is not there: no journal holds variants 21 to 40 of 60\n"
    assert nocdyn.files("out") == ["sweep.1-of-3.journal", "sweep.3-of-3.journal"]


def test_parts_of_different_sweeps_are_not_merged(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out", "--shard", "1/2", "-q")
    nocdyn("sweep", discs, "--out", "out", "--shard", "2/2", "-q", "--set", "run.rtol=1e-7", "--set", "case.title=Three")
    outcome = nocdyn("merge", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: out/sweep.1-of-2.journal and out/sweep.2-of-2.journal are not of one sweep: their inputs differ, from the "
        "first to the second: &case: title was 'Two discs', is 'Three'; &run: rtol was 1e-08, is 1e-07\n"
    )


@pytest.mark.parametrize(
    ("operand", "complaint"),
    [
        ("nope", "nope: there is no such folder"),
        ("discs.nml", "discs.nml: is not a folder; nocdyn merge needs the folder of the journals"),
    ],
)
def test_a_merge_of_no_folder_is_refused_with_code_3(nocdyn, discs, operand, complaint):
    outcome = nocdyn("merge", operand)
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (3, "", f"nocdyn: {complaint}\n")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["sweep"], "exactly one file is needed: nocdyn sweep FILE"),
        (["merge"], "exactly one folder is needed: nocdyn merge DIR"),
        (["merge", "."], ".: the folder holds no journal of a sweep; nocdyn sweep FILE --shard K/N writes them"),
        (["sweep", "discs.nml", "--threads", "0"], "--threads 0: allowed: a number from 1 to 4096"),
        (["sweep", "discs.nml", "--threads=2", "--threads=2"], "--threads is given twice"),
        (["sweep", "discs.nml", "--shard", "3/2"], "--shard 3/2: allowed: K/N, the part K of N, with K from 1 to N"),
        (["sweep", "discs.nml", "--shard", "2"], "--shard 2: allowed: K/N, the part K of N, with K from 1 to N"),
        (["sweep", "discs.nml", "--shard"], "--shard needs a value: --shard K/N"),
        (["sweep", "discs.nml", "--shard", "5/61"], "--shard 5/61: the sweep has 60 variants; allowed: at most as many parts"),
        (["sweep", "discs.nml", "--csv=yes"], "--csv takes no value"),
        (
            ["sweep", "discs.nml", "--csv", "--shard", "1/2"],
            "--csv and --shard: a part of a sweep has no table; nocdyn merge DIR --csv",
        ),
        (["run", "discs.nml", "--resume"], "--resume is an option of nocdyn orbit and sweep"),
        (["run", "discs.nml", "--csv"], "--csv is an option of nocdyn sweep and merge"),
        (["sweep", "plain.nml"], "plain.nml: there is no &sweep; 'nocdyn help input sweep' shows one"),
        (["sweep", "discs.nml", "--set", "run.formulation=cubist"], "run.formulation"),
    ],
)
def test_wrong_usage_is_refused_with_code_2(nocdyn, discs, words, complaint):
    nocdyn.write("plain.nml", TWO_DISCS)
    outcome = nocdyn(*words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith("nocdyn: ") and complaint in outcome.stderr and outcome.stderr.count("\n") == 1
    assert sorted(path.name for path in nocdyn.folder.iterdir()) == ["discs.nml", "plain.nml"]


@pytest.mark.parametrize("words", [("--threads", "4096"), ()])
def test_threads_beyond_what_processors_can_use_are_not_started(nocdyn, discs, words):
    environment = os.environ | {"OMP_NUM_THREADS": "4096"}
    outcome = nocdyn("sweep", discs, "--out", "out", *words, env=environment)
    most = 8 * len(os.sched_getaffinity(0))
    assert (outcome.returncode, outcome.stderr) == (0, "")
    note = f"note: {most} threads instead of 4096: at most 8 for each available processor"
    assert outcome.stdout.startswith(f"{discs}: {note}\n")
    assert nocdyn.summary("out")["threads"] == most


@pytest.mark.parametrize("name", ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE"])
def test_a_process_of_an_mpi_job_does_not_compute_what_the_others_do(nocdyn, discs, name):
    environment = os.environ | {name: "2"}
    outcome = nocdyn("sweep", discs, "--out", "out", env=environment)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        f"nocdyn: this is one of 2 processes of an MPI job ({name}), which would all compute the same sweep; "
        "nocdyn-mpi sweep distributes it among them\n"
    )
    assert not (nocdyn.folder / "out").exists()
    assert nocdyn("sweep", discs, "--out", "out", "--shard", "1/2", env=environment).returncode == 0
    assert nocdyn("sweep", discs, "--out", "alone", env=os.environ | {name: "1"}).returncode == 0


def test_names_beyond_ascii_are_read_as_they_are(nocdyn):
    nocdyn.write("discs.nml", (TWO_DISCS + SWEEP).replace("wheel", "räd").replace("Two discs", "Zwei Räder"))
    assert nocdyn("sweep", "discs.nml", "--out", "out").returncode == 0
    with xarray.open_dataset(nocdyn.folder / "out/sweep.nc", engine="h5netcdf") as sweep:
        assert sweep.attrs["title"] == "Zwei Räder"
        assert sweep["omega_räd_final"].attrs["label"] == "omega_räd_final"
        assert "'räd'" in sweep.attrs["input"].encode("utf-8", "surrogateescape").decode()
    outcome = nocdyn("sweep", "discs.nml", "--out", "out", "--resume")
    assert outcome.stdout == "discs.nml: all 60 variants are done already; results in out\n"


def test_the_program_for_sweeps_says_what_it_is_for(nocdyn):
    outcome = subprocess.run([SWEEP_PROGRAM, "check", "x.nml"], check=False, capture_output=True, text=True)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == "nocdyn: nocdyn-sweep has no command 'check'; use nocdyn check\n"


@pytest.mark.parametrize(
    ("words", "same"),
    [
        (["--help"], ["help", "sweep"]),
        (["-h"], ["help", "sweep"]),
        (["sweep", "--help"], ["help", "sweep"]),
        (["merge", "--help"], ["help", "merge"]),
        (["--version"], ["--version"]),
    ],
)
def test_the_program_for_sweeps_has_help_and_version(nocdyn, words, same):
    outcome = subprocess.run([SWEEP_PROGRAM, *words], check=False, capture_output=True, text=True)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout == nocdyn(*same).stdout


def test_help_on_sweep_names_its_options_and_no_others(nocdyn):
    text = nocdyn("help", "sweep").stdout
    options = {"--out", "--set", "--case", "--threads", "--compile", "--shard", "--resume", "--csv", "--quiet"}
    assert set(re.findall(r"--\w+", text)) == options


def test_without_the_program_for_sweeps_a_sweep_says_why_it_cannot_be(nocdyn, discs):
    nocdyn.executable = shutil.copy(os.environ["NOCDYN"], nocdyn.folder / "alone")
    outcome = nocdyn("sweep", discs)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    missing = nocdyn.folder / "nocdyn-sweep"
    assert outcome.stderr == (
        f"nocdyn: '{missing}', the program for nocdyn sweep, does not exist; "
        "cmake --build --preset release builds it beside nocdyn, unless -DNOCDYN_SWEEP=OFF is set\n"
    )
