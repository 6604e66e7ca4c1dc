"""The results of a sweep are the same to the last bit, whatever ran it."""

import subprocess

import pytest
from conftest import SOURCE
from sweep_inputs import MIXED, MPI_ENVIRONMENT, SWEEP, TWO_DISCS, mpirun, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

# enough for several chunks for each of three workers
MANY = ("--set", "sweep.samples=400")


@pytest.fixture(scope="module")
def whole(shared_nocdyn):
    """sweep.nc of one thread, and the function that compares with it."""
    shared_nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    shared_nocdyn.write("mixed.nml", MIXED)
    shared_nocdyn.write("assembled.nml", (SOURCE / "tests/sanitize/assembled.nml").read_text(encoding="utf-8"))
    assert shared_nocdyn("sweep", "discs.nml", "--out", "discs", "--threads", 1, *MANY).returncode == 0
    assert shared_nocdyn("sweep", "mixed.nml", "--out", "mixed", "--threads", 1).returncode == 0
    assert shared_nocdyn("sweep", "assembled.nml", "--out", "assembled", "--threads", 1).returncode == 0
    return shared_nocdyn


def bytes_of(nocdyn, folder):
    return (nocdyn.folder / folder / "sweep.nc").read_bytes()


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_threads_that_assemble_machines_do_not_show(whole, threads):
    whole("sweep", "assembled.nml", "--out", f"assembled-{threads}", "--threads", threads)
    assert bytes_of(whole, f"assembled-{threads}") == bytes_of(whole, "assembled")


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_do_not_show(whole, threads):
    whole("sweep", "discs.nml", "--out", f"threads-{threads}", "--threads", threads, *MANY)
    whole("sweep", "mixed.nml", "--out", f"mixed-{threads}", "--threads", threads)
    assert bytes_of(whole, f"threads-{threads}") == bytes_of(whole, "discs")
    assert bytes_of(whole, f"mixed-{threads}") == bytes_of(whole, "mixed")


@needs_mpi
@pytest.mark.parametrize(("ranks", "threads"), [(1, 1), (2, 1), (8, 1), (3, 2)])
def test_ranks_do_not_show(whole, ranks, threads):
    for name, words in (("discs", MANY), ("mixed", ())):
        folder = f"{name}-{ranks}-ranks-{threads}"
        command = [*mpirun(ranks), "sweep", f"{name}.nml", "--out", folder, "--threads", str(threads), *words]
        outcome = subprocess.run(
            command, cwd=whole.folder, env=MPI_ENVIRONMENT, check=False, capture_output=True, text=True, timeout=120
        )
        assert (outcome.returncode, outcome.stderr) == (0, "")
        assert f"{folder}\n" in outcome.stdout
        assert whole.summary(folder)["ranks"] == ranks and whole.summary(folder)["threads"] == threads
        assert bytes_of(whole, folder) == bytes_of(whole, name)


@pytest.mark.parametrize("shards", [2, 3])
def test_shards_do_not_show(whole, shards):
    for name, words in (("discs", MANY), ("mixed", ())):
        folder = f"{name}-{shards}-shards"
        for part in range(1, shards + 1):
            assert whole("sweep", f"{name}.nml", "--out", folder, "--shard", f"{part}/{shards}", *words).returncode == 0
        assert whole("merge", folder).returncode == 0
        assert bytes_of(whole, folder) == bytes_of(whole, name)


@needs_mpi
def test_a_list_of_variants_is_the_same_on_threads_ranks_and_shards(nocdyn):
    groups = [line for line in SWEEP.splitlines() if "&vary" not in line and "&sweep" not in line]
    nocdyn.write("in/list.nml", TWO_DISCS + "&sweep design = 'list' file = 'variants.csv' /\n" + "\n".join(groups))
    rows = [f"{20 + 0.5 * i},{0.1 + 0.02 * (i * 7 % 40)}" for i in range(40)]
    nocdyn.write("in/variants.csv", "coupling.shaft.stiffness,load.drag.viscous\n" + "\n".join(rows) + "\n")
    assert nocdyn("sweep", "in/list.nml", "--out", "whole", "--threads", 1).returncode == 0
    command = [*mpirun(2), "sweep", "in/list.nml", "--out", "ranks"]
    assert subprocess.run(command, cwd=nocdyn.folder, env=MPI_ENVIRONMENT, check=False, capture_output=True).returncode == 0
    for part in (1, 2):
        nocdyn("sweep", "in/list.nml", "--out", "shards", "--shard", f"{part}/2")
    outcome = nocdyn("merge", "shards")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert bytes_of(nocdyn, "ranks") == bytes_of(nocdyn, "whole")
    assert bytes_of(nocdyn, "shards") == bytes_of(nocdyn, "whole")
