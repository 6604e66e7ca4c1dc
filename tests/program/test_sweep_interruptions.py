"""Sweeps that are killed, interrupted, or cannot write: nothing that was done is lost, and the end is the same."""

import os
import random
import re
import signal
import subprocess
import time

import h5py
import numpy
import pytest
from conftest import IS_SLOW, wait_for
from sweep_inputs import MPI_ENVIRONMENT, MPI_PROGRAM, SWEEP, TWO_DISCS, limited_to, mpirun, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

# variants that take this sweep about a second of one thread
SAMPLES = 6000 if IS_SLOW else 40000
T_END = 20 if IS_SLOW else 200
LONG = ("--set", f"sweep.samples={SAMPLES}", "--set", f"run.t_end={T_END}")
ENDLESS = ("--set", "sweep.samples=100000000", "--set", "run.t_end=20")
INTERRUPTED = (
    r"nocdyn: .*discs\.nml: interrupted with (\d+) of 100000000 variants done; "
    r"repeat the command with --resume to continue\n"
)


@pytest.fixture
def discs(nocdyn):
    return nocdyn.write("discs.nml", TWO_DISCS + SWEEP)


@pytest.fixture(scope="module")
def whole(shared_nocdyn):
    """The results of a sweep that ran through."""
    shared_nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    assert shared_nocdyn("sweep", "discs.nml", "--out", "whole", "--threads", 1, *LONG).returncode == 0
    return (shared_nocdyn.folder / "whole/sweep.nc").read_bytes()


def journal(nocdyn, folder="out"):
    return nocdyn.folder / folder / "sweep.journal"


def rank_journals(ranks):
    return [f"sweep.rank-{rank}.journal" for rank in range(1, ranks)]


def start(nocdyn, *words, ranks=0, **options):
    """A sweep that has begun to compute; with ranks, on as many."""
    if ranks:
        options |= {"env": MPI_ENVIRONMENT}
        command = [*mpirun(ranks), *map(str, words)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        process = subprocess.Popen(command, cwd=nocdyn.folder, **(pipes | options))
    else:
        process = nocdyn.start(*words, **options)
    wait_for(lambda: journal(nocdyn).exists() and journal(nocdyn).stat().st_size > 8000)
    return process


def is_done(outcome):
    """Without an error; a busy machine has lines of progress."""
    progress = re.compile(r": \d+ of \d+ variants, \d+ per second")
    return outcome.returncode == 0 and all(progress.search(line) for line in outcome.stderr.splitlines())


def test_a_sweep_that_is_killed_twenty_times_ends_as_one_that_is_not(nocdyn, discs, whole):
    moments = random.Random(20261121)
    kills = 0
    while kills < 20:
        process = nocdyn.start("sweep", discs, "--out", "out", "--threads", 1 + kills % 2, "--resume", *LONG)
        time.sleep(moments.uniform(0.0, 0.12))
        process.kill()
        process.communicate()
        kills += 1
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", *LONG)
    assert is_done(outcome)
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]
    assert (nocdyn.folder / "out/sweep.nc").read_bytes() == whole


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_sweep_keeps_its_journal(nocdyn, discs, number):
    process = start(nocdyn, "sweep", discs, "--out", "out", *ENDLESS)
    process.send_signal(number)
    output, complaint = process.communicate(timeout=30)
    assert (process.returncode, output) == (1, "")
    found = re.fullmatch(INTERRUPTED, complaint)
    assert found
    assert nocdyn.files("out") == ["sweep.journal"]
    outcome = nocdyn("sweep", discs, "--out", "out", *ENDLESS)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        f"nocdyn: out/sweep.journal holds {found[1]} of 100000000 variants of an unfinished sweep; "
        "continue it with --resume, or remove it\n"
    )


def test_what_is_done_is_not_done_again(nocdyn, discs):
    process = start(nocdyn, "sweep", discs, "--out", "out", *LONG, "--threads", 1)
    process.send_signal(signal.SIGINT)
    done = int(re.search(r"interrupted with (\d+) of", process.communicate(timeout=30)[1])[1])
    assert 0 < done < SAMPLES
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", *LONG)
    assert outcome.returncode == 0
    assert outcome.stdout.startswith(f"{discs}: reusing {done} of {SAMPLES} variants from out/sweep.journal\n")
    assert nocdyn.summary("out")["variants_computed"] == SAMPLES - done
    assert nocdyn.summary("out")["counts"]["done"] == SAMPLES


def interrupt(nocdyn, discs, *words):
    process = start(nocdyn, "sweep", discs, "--out", "out", *ENDLESS, *words)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)


@pytest.mark.parametrize(
    ("words", "difference"),
    [
        (("--set", "run.rtol=1e-7"), "the input has changed: &run: rtol was 1e-08, is 1e-07"),
        (("--set", "body.wheel.inertia=1.5"), "the input has changed: &body 'wheel': inertia was 1, is 1.5"),
        (("--set", "sweep.seed=4"), "the input has changed: &sweep: seed was 3, is 4"),
        (("--set", "case.title=Three"), "the input has changed: &case: title was 'Two discs', is 'Three'"),
        (("--set", "output.points=21"), "the input has changed: &output: points was 11, is 21"),
    ],
)
def test_a_sweep_with_another_input_is_not_gone_on_with(nocdyn, discs, words, difference):
    interrupt(nocdyn, discs)
    before = journal(nocdyn).read_bytes()
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", *ENDLESS, *words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    remedy = "remove it, or choose another folder with --out"
    assert outcome.stderr == f"nocdyn: out/sweep.journal belongs to another sweep: {difference}; {remedy}\n"
    assert nocdyn("sweep", discs, "--out", "out", *ENDLESS, *words).stderr == outcome.stderr
    assert journal(nocdyn).read_bytes() == before


def test_a_group_that_has_gone_is_named(nocdyn, discs):
    interrupt(nocdyn, discs)
    nocdyn.write(
        "discs.nml", (TWO_DISCS + SWEEP).replace("&load     name = 'drag'", "&load     name = 'brake'").replace("drag", "brake")
    )
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", *ENDLESS)
    assert outcome.returncode == 2
    assert "the input has changed: the new input has no &load 'drag'" in outcome.stderr


def test_a_journal_of_another_version_is_not_gone_on_with(nocdyn, discs):
    # the program of the tests writes as version 9; without room for sweep.nc it leaves its journal
    command = [os.environ["NOCDYN_SWEEP_STORE"], "out", "60", "20"]
    subprocess.run(command, cwd=nocdyn.folder, check=False, capture_output=True, preexec_fn=limited_to(10000))
    before = journal(nocdyn).read_bytes()
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    this = re.escape(nocdyn("--version").stdout.strip())
    other = "belongs to another sweep: it was started by nocdyn 9"
    complaint = f"nocdyn: out/sweep\\.journal {other}, this is {this}; remove it, .*\n"
    assert re.fullmatch(complaint, outcome.stderr)
    assert journal(nocdyn).read_bytes() == before


def write_list(nocdyn, rows):
    """A sweep over a list of stiffnesses."""
    groups = [line for line in SWEEP.splitlines() if "&vary" not in line and "&sweep" not in line]
    nocdyn.write("variants.csv", "\n".join(["coupling.shaft.stiffness", *rows]) + "\n")
    return nocdyn.write("discs.nml", TWO_DISCS + "&sweep design = 'list' file = 'variants.csv' /\n" + "\n".join(groups))


def test_a_list_that_has_changed_is_not_gone_on_with(nocdyn):
    rows = [f"{20 + 1e-4 * i}" for i in range(2 * SAMPLES)]
    discs = write_list(nocdyn, rows)
    process = start(nocdyn, "sweep", discs, "--out", "out", "--set", "run.t_end=20")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    write_list(nocdyn, ["21", *rows[1:]])
    outcome = nocdyn("sweep", discs, "--out", "out", "--set", "run.t_end=20", "--resume")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    complaint = "the file of &sweep with the variants has changed; remove it, or choose another folder with --out"
    assert outcome.stderr == f"nocdyn: out/sweep.journal belongs to another sweep: {complaint}\n"


def test_results_of_a_list_that_has_changed_are_not_taken_for_those_of_the_new_one(nocdyn):
    discs = write_list(nocdyn, ["20", "30", "40"])
    nocdyn("sweep", discs, "--out", "out")
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (0, f"{discs}: all 3 variants are done already; results in out\n")
    write_list(nocdyn, ["20", "31", "40"])
    before = (nocdyn.folder / "out/sweep.nc").read_bytes()
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    complaint = "the file of &sweep with the variants has changed; without --resume they are replaced"
    assert outcome.stderr == f"nocdyn: out holds the results of another sweep: {complaint}\n"
    assert (nocdyn.folder / "out/sweep.nc").read_bytes() == before


def test_results_of_another_version_are_not_taken_for_those_of_this_one(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out")
    with h5py.File(nocdyn.folder / "out/sweep.nc", "r+") as file:
        file.attrs["source"] = numpy.bytes_("nocdyn 9")
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    other = "nocdyn: out holds the results of another sweep: it was started by nocdyn 9"
    assert outcome.stderr.startswith(f"{other}, this is nocdyn ")


def test_results_that_cannot_be_read_are_not_taken_for_finished(nocdyn, discs):
    nocdyn.write("out/sweep.nc", "not of NetCDF")
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: 'out/sweep.nc' cannot be read: NetCDF: Unknown file format\n"


def test_nothing_to_go_on_with_is_said(nocdyn, discs):
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert outcome.returncode == 0
    assert outcome.stdout.startswith(f"{discs}: out holds nothing to resume; the sweep starts from the beginning\n")


def test_a_sweep_that_is_done_stays_as_it_is(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out")
    before = {name: (nocdyn.folder / "out" / name).stat().st_mtime_ns for name in nocdyn.files("out")}
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert is_done(outcome)
    assert outcome.stdout == f"{discs}: all 60 variants are done already; results in out\n"
    assert {name: (nocdyn.folder / "out" / name).stat().st_mtime_ns for name in nocdyn.files("out")} == before


def test_results_of_another_sweep_are_not_taken_for_its_own(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out")
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", "--set", "sweep.samples=61")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: out holds the results of another sweep: the input has changed: &sweep: samples was 60, is 61; "
        "without --resume they are replaced\n"
    )


def test_results_with_another_title_are_not_taken_for_its_own(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out")
    before = (nocdyn.folder / "out/input.nml").read_bytes()
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", "--set", "case.title=Three")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: out holds the results of another sweep: the input has changed: &case: title was 'Two discs', is 'Three'; "
        "without --resume they are replaced\n"
    )
    assert (nocdyn.folder / "out/input.nml").read_bytes() == before


@pytest.mark.parametrize("words", [[], ["--resume"]])
def test_a_part_does_not_go_to_the_folder_of_a_whole_sweep(nocdyn, discs, words):
    interrupt(nocdyn, discs)
    outcome = nocdyn("sweep", discs, "--out", "out", "--shard", "1/2", *words, *ENDLESS)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: out holds the journal of a whole sweep, sweep.journal; continue it with --resume and without --shard, "
        "remove it, or choose another folder with --out\n"
    )
    assert nocdyn.files("out") == ["sweep.journal"]


@pytest.mark.parametrize("words", [[], ["--resume"]])
def test_a_whole_sweep_does_not_go_to_the_folder_of_parts(nocdyn, discs, words):
    for part in (1, 2):
        nocdyn("sweep", discs, "--out", "out", "--shard", f"{part}/3")
    journals = ["sweep.1-of-3.journal", "sweep.2-of-3.journal"]
    outcome = nocdyn("sweep", discs, "--out", "out", *words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        f"nocdyn: out holds journals of parts of a sweep: '{journals[0]}', '{journals[1]}'; continue them with --shard, "
        "remove them, or choose another folder with --out\n"
    )
    assert nocdyn.files("out") == journals


def test_merged_parts_are_done_for_a_whole_sweep_too(nocdyn, discs):
    for part in (1, 2):
        nocdyn("sweep", discs, "--out", "out", "--shard", f"{part}/2")
    nocdyn("merge", "out")
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (0, f"{discs}: all 60 variants are done already; results in out\n")


def test_a_damaged_journal_is_told_and_made_good(nocdyn, discs):
    process = start(nocdyn, "sweep", discs, "--out", "out", *LONG, "--threads", 1)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    content = journal(nocdyn).read_bytes()
    journal(nocdyn).write_bytes(content[:-10])
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", *LONG)
    assert is_done(outcome)
    note = "note: out/sweep.journal has damaged entries; their variants are computed again"
    assert outcome.stdout.startswith(f"{discs}: {note}\n{discs}: reusing ")
    assert nocdyn.summary("out")["counts"]["done"] == SAMPLES


LIST = "&sweep design = 'list' file = 'list.csv' /\n&record quantity = 'omega_wheel' statistic = 'final' /\n"


def test_results_of_another_list_are_not_taken_for_its_own(nocdyn):
    nocdyn.write("discs.nml", TWO_DISCS + LIST)
    nocdyn.write("list.csv", "load.drag.viscous\n0.2\n")
    nocdyn("sweep", "discs.nml", "--out", "out")
    nocdyn.write("list.csv", "load.drag.viscous\n0.3\n")
    outcome = nocdyn("sweep", "discs.nml", "--out", "out", "--resume")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: out holds the results of another sweep: the file of &sweep with the variants has changed; "
        "without --resume they are replaced\n"
    )


def test_a_table_of_results_that_are_done_already_is_refused(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out")
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", "--csv")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        f"nocdyn: {discs}: all 60 variants are done already; results in out, without sweep.csv; "
        "run without --resume to write it\n"
    )
    nocdyn("sweep", discs, "--out", "out", "--csv")
    assert nocdyn("sweep", discs, "--out", "out", "--resume", "--csv").returncode == 0


@pytest.mark.parametrize("words", [[], ["--resume"]])
def test_a_journal_without_a_byte_holds_nothing_up(nocdyn, discs, words):
    nocdyn.write("out/sweep.journal", "")
    outcome = nocdyn("sweep", discs, "--out", "out", *words)
    assert is_done(outcome)
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]


def test_a_part_that_waits_for_the_others_is_not_called_unfinished(nocdyn, discs):
    nocdyn("sweep", discs, "--out", "out", "--shard", "1/2")
    outcome = nocdyn("sweep", discs, "--out", "out", "--shard", "1/2")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: out/sweep.1-of-2.journal holds all 30 variants of this part, which nocdyn merge uses; "
        "to compute them again, remove it\n"
    )
    outcome = nocdyn("sweep", discs, "--out", "out", "--shard", "1/2", "--resume")
    assert is_done(outcome)
    taken, done = outcome.stdout.splitlines()
    assert taken == f"{discs}: reusing 30 of 30 variants from out/sweep.1-of-2.journal"
    assert done == f"{discs}: part 1 of 2 done, 30 variants; when all parts are done: nocdyn merge out"


@pytest.mark.parametrize("size", [0, 3000, 30000])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_full_disk_ends_a_sweep_that_can_be_gone_on_with(nocdyn, discs, size, threads):
    samples = ("--set", "sweep.samples=1000")
    outcome = nocdyn("sweep", discs, "--out", "out", "--threads", threads, *samples, preexec_fn=limited_to(size))
    assert (outcome.returncode, outcome.stdout) == (3, "")
    remedy = "" if size == 0 else "; when it can be written, repeat the command with --resume to continue"
    assert outcome.stderr == f"nocdyn: cannot write 'out/sweep.journal': File too large{remedy}\n"
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume", *samples)
    assert outcome.returncode == 0
    assert nocdyn.summary("out")["counts"]["done"] == 1000


def test_a_disk_without_room_for_the_results_keeps_the_journal(nocdyn, discs):
    # more than the journal of 60 variants needs, less than sweep.nc does
    outcome = nocdyn("sweep", discs, "--out", "out", preexec_fn=limited_to(10000))
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert "sweep.nc" in outcome.stderr and "repeat the command with --resume to continue\n" in outcome.stderr
    assert nocdyn.files("out") == ["sweep.journal"]
    outcome = nocdyn("sweep", discs, "--out", "out", "--resume")
    assert outcome.returncode == 0
    assert nocdyn.summary("out")["variants_computed"] == 0


@needs_mpi
@pytest.mark.parametrize(("ranks", "rank"), [(2, 0), (3, 2)])
def test_a_dead_rank_ends_the_job_and_leaves_the_journal(nocdyn, discs, whole, ranks, rank):
    process = start(nocdyn, "sweep", discs, "--out", "out", *LONG, ranks=ranks)
    victims = subprocess.run(["pgrep", "-P", str(process.pid)], check=True, capture_output=True, text=True).stdout.split()
    assert len(victims) == ranks
    subprocess.run(["kill", "-9", victims[rank]], check=True)
    process.communicate(timeout=60)
    assert process.returncode != 0
    assert nocdyn.files("out") == ["sweep.journal", *rank_journals(ranks)]
    assert nocdyn("sweep", discs, "--out", "out", "--resume", *LONG).returncode == 0
    assert nocdyn.summary("out")["variants_computed"] < SAMPLES
    assert (nocdyn.folder / "out/sweep.nc").read_bytes() == whole


@needs_mpi
def test_an_interrupted_job_keeps_its_journal(nocdyn, discs):
    process = start(nocdyn, "sweep", discs, "--out", "out", *ENDLESS, ranks=3)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode != 0
    assert nocdyn.files("out") == ["sweep.journal", *rank_journals(3)]


@needs_mpi
@pytest.mark.parametrize(
    ("rows", "complaint"),
    [
        ("0.2\n0.4\n", "discs.nml: the file of &sweep with the variants differs from that of rank 0"),
        (None, "list.csv: cannot be read: there is no such file"),
    ],
)
def test_a_rank_with_another_list_ends_the_job(nocdyn, rows, complaint):
    nocdyn.write("here/discs.nml", TWO_DISCS + LIST)
    nocdyn.write("here/list.csv", "load.drag.viscous\n0.2\n0.3\n")
    (nocdyn.folder / "there").mkdir()
    if rows:
        nocdyn.write("there/list.csv", f"load.drag.viscous\n{rows}")
    ranks = [
        ["-n", "1", "--wdir", nocdyn.folder / name, MPI_PROGRAM, "sweep", "discs.nml", "--out", "out"]
        for name in ("here", "there")
    ]
    command = ["mpirun", *ranks[0], ":", *ranks[1]]
    outcome = subprocess.run(command, env=MPI_ENVIRONMENT, check=False, capture_output=True, text=True, timeout=60)
    assert outcome.returncode != 0 and f"{complaint}\n" in outcome.stderr
    assert nocdyn.files("here") == ["discs.nml", "list.csv", "out"] and "sweep.nc" not in nocdyn.files("here/out")


@needs_mpi
@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["run", "discs.nml"], "nocdyn-mpi has no command 'run'; use nocdyn run"),
        (
            ["sweep", "discs.nml", "--shard", "1/2"],
            "--shard is an option of nocdyn sweep; nocdyn-mpi distributes the variants itself",
        ),
        (["sweep", "none.nml"], "none.nml: cannot be read: there is no such file"),
    ],
)
def test_only_one_rank_complains(nocdyn, discs, words, complaint):
    command = [*mpirun(2), *words]
    outcome = subprocess.run(
        command, cwd=nocdyn.folder, env=MPI_ENVIRONMENT, check=False, capture_output=True, text=True, timeout=60
    )
    assert outcome.returncode in (2, 3) and outcome.stdout.count("nocdyn: ") == 0
    assert outcome.stderr.count("nocdyn: ") == 1 and f"nocdyn: {complaint}\n" in outcome.stderr


@needs_mpi
@pytest.mark.parametrize(("words", "first"), [(["--help"], "nocdyn sweep FILE"), (["--version"], "nocdyn ")])
def test_help_and_version_are_said_once(nocdyn, words, first):
    outcome = subprocess.run([*mpirun(2), *words], env=MPI_ENVIRONMENT, check=False, capture_output=True, text=True, timeout=60)
    wanted = nocdyn("sweep", "--help") if words == ["--help"] else nocdyn("--version")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, wanted.stdout, "")
    assert first in wanted.stdout
