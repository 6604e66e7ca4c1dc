"""Kills, full disks and damaged journals with three ranks and with shards: the end has the bytes of a sweep that ran through."""

import os
import random
import re
import signal
import subprocess
import time

import pytest
from conftest import IS_SLOW, wait_for
from sweep_inputs import MPI_ENVIRONMENT, MPI_PROGRAM, SWEEP, TWO_DISCS, limited_to, mpirun, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

RANKS = 3
RANK_JOURNALS = [f"sweep.rank-{rank}.journal" for rank in range(1, RANKS)]
SHARDS = 2
SAMPLES = 2000 if IS_SLOW else 24000
T_END = 20 if IS_SLOW else 200
LONG = ("--set", f"sweep.samples={SAMPLES}", "--set", f"run.t_end={T_END}")


@pytest.fixture
def discs(nocdyn):
    return nocdyn.write("discs.nml", TWO_DISCS + SWEEP).name


@pytest.fixture(scope="module")
def whole(shared_nocdyn):
    """The results of a sweep that ran through."""
    shared_nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    assert shared_nocdyn("sweep", "discs.nml", "--out", "whole", *LONG).returncode == 0
    return (shared_nocdyn.folder / "whole/sweep.nc").read_bytes()


def shard_words(number):
    return ["--shard", f"{number}/{SHARDS}"]


def start_ranks(nocdyn, *words, limit="unlimited"):
    """mpirun and its ranks in a process group of their own; `limit` of files in blocks of 512 bytes."""
    # MPI has files of its own that grow, unless the ranks talk by TCP
    environment = MPI_ENVIRONMENT | {"OMPI_MCA_btl": "self,tcp", "PMIX_MCA_gds": "hash"}
    shell = ["sh", "-c", f'ulimit -f {limit}; exec "$@"', "sh", str(MPI_PROGRAM), *map(str, words)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([*mpirun(RANKS)[:-1], *shell], cwd=nocdyn.folder, env=environment, start_new_session=True, **pipes)


def kill_ranks(process):
    """All ranks at once, as a computer that loses its power does."""
    ranks = subprocess.run(["pgrep", "-P", str(process.pid)], check=False, capture_output=True, text=True).stdout.split()
    for rank in ranks:
        os.kill(int(rank), signal.SIGKILL)


def journal(nocdyn, name="sweep.journal"):
    return nocdyn.folder / "out" / name


def assert_ends_as(nocdyn, whole):
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc"]
    assert (nocdyn.folder / "out/sweep.nc").read_bytes() == whole


def assert_reuses(output, variants, note=""):
    """Some of what a journal holds, but not all."""
    reused = re.match(rf"{re.escape(note)}discs\.nml: reusing (\d+) of {variants} variants from out/", output)
    assert reused and 0 < int(reused[1]) < variants, output


def complaints(errors):
    """What standard error says besides how far a slow sweep is."""
    return [line for line in errors.splitlines() if not re.fullmatch(r"discs\.nml: \d+ of \d+ variants, .* left", line)]


def finish_on_ranks(nocdyn, discs, whole):
    """Goes on with three ranks; the output."""
    process = start_ranks(nocdyn, "sweep", discs, "--out", "out", "--resume", *LONG)
    output, complaint = process.communicate(timeout=60)
    assert (process.returncode, complaints(complaint)) == (0, [])
    assert_ends_as(nocdyn, whole)
    return output


def finish_shards(nocdyn, discs, whole):
    """Goes on with the first shard, computes the others and merges them; the output of the first."""
    first, *others = (
        nocdyn("sweep", discs, "--out", "out", "--resume", *shard_words(number), *LONG) for number in range(1, SHARDS + 1)
    )
    merged = nocdyn("merge", "out")
    for outcome in (first, *others, merged):
        assert (outcome.returncode, complaints(outcome.stderr)) == (0, [])
    for number in range(1, SHARDS + 1):
        journal(nocdyn, f"sweep.{number}-of-{SHARDS}.journal").unlink(missing_ok=True)
    assert_ends_as(nocdyn, whole)
    return first.stdout


def wait_until_it_computes(process, file):
    """Until it has added to its journal."""
    before = file.stat().st_size if file.exists() else 0
    wait_for(lambda: process.poll() is not None or (file.exists() and file.stat().st_size > before + 4000))


@needs_mpi
def test_ranks_that_are_killed_together_lose_nothing_that_was_done(nocdyn, discs, whole):
    for _ in range(2):
        process = start_ranks(nocdyn, "sweep", discs, "--out", "out", "--resume", *LONG)
        wait_until_it_computes(process, journal(nocdyn))
        kill_ranks(process)
        process.communicate(timeout=60)
        assert process.returncode != 0 and nocdyn.files("out") == ["sweep.journal", *RANK_JOURNALS]
    assert_reuses(finish_on_ranks(nocdyn, discs, whole), SAMPLES)


def test_a_shard_that_is_killed_five_times_ends_as_one_that_is_not(nocdyn, discs, whole):
    moments = random.Random(20261122)
    for kill in range(5):
        process = nocdyn.start("sweep", discs, "--out", "out", "--threads", 1 + kill % 2, "--resume", *shard_words(1), *LONG)
        wait_until_it_computes(process, journal(nocdyn, "sweep.1-of-2.journal"))
        time.sleep(moments.uniform(0.0, 0.02))
        process.kill()
        process.communicate()
    assert_reuses(finish_shards(nocdyn, discs, whole), SAMPLES // SHARDS)


@needs_mpi
def test_a_full_disk_stops_three_ranks_that_can_be_gone_on_with(nocdyn, discs, whole):
    process = start_ranks(nocdyn, "sweep", discs, "--out", "out", *LONG, limit=24)
    output, complaint = process.communicate(timeout=60)
    assert (process.returncode, output) == (3, "")
    assert complaint.count("nocdyn: ") == 1
    assert re.search(r"nocdyn: cannot write 'out/sweep\.(rank-[12]\.)?journal': File too large; when", complaint)
    assert nocdyn.files("out") == ["sweep.journal", *RANK_JOURNALS]
    assert_reuses(finish_on_ranks(nocdyn, discs, whole), SAMPLES)


def test_a_full_disk_stops_a_shard_that_can_be_gone_on_with(nocdyn, discs, whole):
    outcome = nocdyn("sweep", discs, "--out", "out", *shard_words(1), *LONG, preexec_fn=limited_to(20000))
    assert (outcome.returncode, outcome.stdout) == (3, "")
    remedy = "when it can be written, repeat the command with --resume to continue"
    assert complaints(outcome.stderr) == [f"nocdyn: cannot write 'out/sweep.1-of-2.journal': File too large; {remedy}"]
    assert nocdyn.files("out") == ["sweep.1-of-2.journal"]
    assert_reuses(finish_shards(nocdyn, discs, whole), SAMPLES // SHARDS)


def test_a_disk_without_room_for_merged_results_keeps_the_journals(nocdyn, discs):
    journals = [f"sweep.{number}-of-{SHARDS}.journal" for number in (1, 2)]
    for number in (1, 2):
        assert nocdyn("sweep", discs, "--out", "out", *shard_words(number)).returncode == 0
    outcome = nocdyn("merge", "out", preexec_fn=limited_to(10000))
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert "sweep.nc" in outcome.stderr and outcome.stderr.count("\n") == 1
    assert nocdyn.files("out") == journals
    assert nocdyn("merge", "out").returncode == 0


def damage(file):
    """A bit in the midst of the entries has flipped, and the last entry is cut."""
    content = bytearray(file.read_bytes()[:-10])
    content[3 * len(content) // 4] ^= 1  # behind the head
    file.write_bytes(content)


@needs_mpi
def test_three_ranks_make_a_damaged_journal_good(nocdyn, discs, whole):
    start_ranks(nocdyn, "sweep", discs, "--out", "out", *LONG, limit=24).communicate(timeout=60)
    damage(journal(nocdyn))
    damage(journal(nocdyn, RANK_JOURNALS[1]))
    damaged = ("sweep.journal", RANK_JOURNALS[1])
    note = "".join(f"{discs}: note: out/{name} has damaged entries; their variants are computed again\n" for name in damaged)
    assert_reuses(finish_on_ranks(nocdyn, discs, whole), SAMPLES, note)


def test_a_damaged_shard_is_told_and_made_good(nocdyn, discs, whole):
    file = journal(nocdyn, "sweep.1-of-2.journal")
    assert nocdyn("sweep", discs, "--out", "out", *shard_words(1), *LONG).returncode == 0
    damage(file)
    note = f"{discs}: note: out/{file.name} has damaged entries; their variants are computed again\n"
    assert_reuses(finish_shards(nocdyn, discs, whole), SAMPLES // SHARDS, note)


def ranks_outcome(nocdyn, ranks, *words):
    command = [*mpirun(ranks), "sweep", *words]
    return subprocess.run(
        command, cwd=nocdyn.folder, env=MPI_ENVIRONMENT, check=False, capture_output=True, text=True, timeout=60
    )


def held(nocdyn, discs, *words):
    """How many variants the journals hold, as a sweep without --resume says."""
    outcome = nocdyn("sweep", discs, "--out", "out", *LONG, *words)
    assert outcome.returncode == 2
    return re.fullmatch(
        rf"nocdyn: (out/sweep\.journal.*) holds? +(\d+) of {SAMPLES} variants of an unfinished sweep; .*\n", outcome.stderr
    ).groups()


@needs_mpi
@pytest.mark.parametrize("ranks", [0, 2, 5])
def test_a_sweep_of_three_ranks_is_gone_on_with_by_any_number(nocdyn, discs, whole, ranks):
    start_ranks(nocdyn, "sweep", discs, "--out", "out", *LONG, limit=24).communicate(timeout=60)
    journals, number = held(nocdyn, discs)
    assert journals == "out/sweep.journal and 2 of ranks" and 0 < int(number) < SAMPLES
    words = (discs, "--out", "out", "--resume", *LONG)
    outcome = ranks_outcome(nocdyn, ranks, *words) if ranks else nocdyn("sweep", *words)
    told = complaints(outcome.stderr)
    assert (outcome.returncode, told) == (0, [])
    assert outcome.stdout.startswith(f"{discs}: reusing {number} of {SAMPLES} variants from out/sweep.journal and 2 of ranks\n")
    assert nocdyn.summary("out")["variants_computed"] == SAMPLES - int(number)
    assert_ends_as(nocdyn, whole)


@needs_mpi
def test_journals_of_ranks_without_that_of_rank_0_are_gone_on_with(nocdyn, discs, whole):
    start_ranks(nocdyn, "sweep", discs, "--out", "out", *LONG, limit=24).communicate(timeout=60)
    journal(nocdyn).unlink()
    assert 0 < int(held(nocdyn, discs)[1]) < SAMPLES
    finish_on_ranks(nocdyn, discs, whole)


@needs_mpi
def test_journals_of_ranks_are_merged(nocdyn, discs, whole):
    start_ranks(nocdyn, "sweep", discs, "--out", "out", *LONG, limit=24).communicate(timeout=60)
    unfinished = nocdyn("merge", "out")
    assert unfinished.returncode == 2 and unfinished.stderr.startswith("nocdyn: out/sweep.journal: unfinished, without variant")
    assert unfinished.stderr.count("\n") == 1
    # then the three journals fit on the disk, and the results do not
    process = start_ranks(nocdyn, "sweep", discs, "--out", "out", "--resume", *LONG, limit=SAMPLES * 45 // 512)
    assert "nocdyn: cannot write 'out/sweep.nc'" in process.communicate(timeout=60)[1]
    assert nocdyn("merge", "out").returncode == 0
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.journal", "sweep.nc", *RANK_JOURNALS]
    assert (nocdyn.folder / "out/sweep.nc").read_bytes() == whole


@needs_mpi
def test_journals_of_ranks_and_of_shards_do_not_mix(nocdyn, discs):
    start_ranks(nocdyn, "sweep", discs, "--out", "out", *LONG, limit=24).communicate(timeout=60)
    journal(nocdyn).unlink()
    outcome = nocdyn("sweep", discs, "--out", "out", *shard_words(1), *LONG)
    assert outcome.returncode == 2
    assert outcome.stderr.startswith("nocdyn: out holds the journal of a whole sweep, sweep.rank-1.journal; continue it with")


@needs_mpi
def test_a_rank_without_the_folder_of_rank_0_ends_the_job(nocdyn, discs):
    (nocdyn.folder / "elsewhere").mkdir()
    nocdyn.write("here/discs.nml", TWO_DISCS + SWEEP)
    parts = [["-n", "1", "--wdir", nocdyn.folder / name, MPI_PROGRAM, "sweep", "discs.nml"] for name in ("here", "elsewhere")]
    command = ["mpirun", *map(str, [*parts[0], ":", *parts[1]])]
    outcome = subprocess.run(command, env=MPI_ENVIRONMENT, check=False, capture_output=True, text=True, timeout=60)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    told = re.search(
        r"nocdyn: results/discs: rank 1 does not find the sweep.journal of rank 0 there; "
        r"the folder must be on a file system that all ranks share; .*\n",
        outcome.stderr,
    )
    assert told and outcome.stderr.count("nocdyn: ") == 1
