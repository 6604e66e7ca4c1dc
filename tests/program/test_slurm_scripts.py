"""scripts/slurm, with stand-ins for sbatch and srun that run the jobs at once."""

import os
import subprocess

import pytest
from conftest import SOURCE
from sweep_inputs import MPI_ENVIRONMENT, MPI_PROGRAM, SWEEP, TWO_DISCS, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

# Prints the number of the job as --parsable does, notes its words, and runs the script: once, or for each job of an array.
# The least and the number of an array are not set: a part of an array that runs again has others.
SBATCH = """\
#!/usr/bin/env bash
set -euo pipefail
echo "$*" >> sbatch.log
job=$(wc -l < sbatch.log)
jobs=()
while [[ $1 == -* ]]; do
  case $1 in
    --array=1-*) mapfile -t jobs < <(seq "${1#--array=1-}") ;;
    --array=*) IFS=, read -ra jobs <<< "${1#--array=}" ;;
    --ntasks=*) export SLURM_NTASKS=${1#--ntasks=} ;;
    --cpus-per-task=*) export SLURM_CPUS_PER_TASK=${1#--cpus-per-task=} ;;
  esac
  shift
done
script=$1
shift
cp "$script" spooled
if ((${#jobs[@]} == 0)); then
  bash spooled "$@" > "job-$job.out" 2>&1
fi
for i in "${jobs[@]}"; do
  SLURM_ARRAY_TASK_ID=$i bash spooled "$@" > "job-$job-$i.out" 2>&1
done
echo "$job;cluster"
"""
SRUN = """\
#!/usr/bin/env bash
set -euo pipefail
echo "$*" >> srun.log
[[ $1 == --kill-on-bad-exit=1 && $2 == --cpus-per-task=* ]]
exec mpirun -n "$SLURM_NTASKS" "${@:3}"
"""


@pytest.fixture
def slurm(nocdyn):
    """Runs a script where sbatch and srun are the stand-ins."""
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    for name, text in (("sbatch", SBATCH), ("srun", SRUN)):
        nocdyn.write(f"bin/{name}", text).chmod(0o755)
    path = f"{nocdyn.folder}/bin:{os.environ['PATH']}"
    environment = MPI_ENVIRONMENT | {"PATH": path, "NOCDYN": nocdyn.executable, "NOCDYN_MPI": str(MPI_PROGRAM)}

    def call(*words, **variables):
        options = {"check": False, "capture_output": True, "text": True, "timeout": 60}
        return subprocess.run(words, cwd=nocdyn.folder, env=environment | variables, **options)

    return call


def same_as_one_sweep(nocdyn, folder):
    nocdyn("sweep", "discs.nml", "--out", "whole")
    return (nocdyn.folder / folder / "sweep.nc").read_bytes() == (nocdyn.folder / "whole/sweep.nc").read_bytes()


def test_an_array_and_its_merge_make_the_sweep(nocdyn, slurm):
    outcome = slurm(SOURCE / "scripts/slurm/submit_shards", "3", "discs.nml", "out", "--quiet")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    told, again = outcome.stdout.splitlines()
    assert told == "array of 3 jobs: 1, merge: 2"
    assert again.endswith(f"Once every part is there: sbatch {SOURCE}/scripts/slurm/merge out")
    array, merge = (nocdyn.folder / "sbatch.log").read_text().splitlines()
    assert array == f"--parsable --array=1-3 {SOURCE}/scripts/slurm/shard discs.nml --out out --quiet"
    assert merge == f"--parsable --dependency=afterok:1 --kill-on-invalid-dep=yes {SOURCE}/scripts/slurm/merge out"
    assert same_as_one_sweep(nocdyn, "out")


def test_options_of_sbatch_reach_the_array(nocdyn, slurm):
    script = f"SBATCH_ARGUMENTS='--time=1:00:00 --cpus-per-task=4' {SOURCE}/scripts/slurm/submit_shards 2 discs.nml out"
    assert slurm("sh", "-c", script).returncode == 0
    assert "--array=1-2 --time=1:00:00 --cpus-per-task=4 " in (nocdyn.folder / "sbatch.log").read_text()


def test_the_table_is_the_merges(nocdyn, slurm):
    outcome = slurm(SOURCE / "scripts/slurm/submit_shards", "2", "discs.nml", "a folder", "--csv", "--quiet")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    array, merge = (nocdyn.folder / "sbatch.log").read_text().splitlines()
    assert array.endswith(" --out a folder --quiet") and merge.endswith("/merge a folder --csv")
    assert outcome.stdout.endswith("/scripts/slurm/merge a\\ folder --csv\n")
    assert (nocdyn.folder / "a folder/sweep.csv").read_text().count("\n") == 61


def test_an_array_that_is_submitted_again_computes_nothing_again(nocdyn, slurm):
    words = ("sbatch", "--array=1-2", SOURCE / "scripts/slurm/shard", "discs.nml", "--out", "out")
    slurm(*words, NOCDYN_SHARDS="2")
    before = (nocdyn.folder / "out/sweep.1-of-2.journal").read_bytes()
    assert slurm(*words, NOCDYN_SHARDS="2").returncode == 0
    assert (nocdyn.folder / "out/sweep.1-of-2.journal").read_bytes() == before


def test_some_jobs_of_an_array_are_the_same_parts_of_the_sweep(nocdyn, slurm):
    for jobs in ("1,4", "3,2"):
        words = ("sbatch", f"--array={jobs}", SOURCE / "scripts/slurm/shard", "discs.nml", "--out", "out")
        assert slurm(*words, NOCDYN_SHARDS="4").returncode == 0
    assert nocdyn.files("out") == [f"sweep.{part}-of-4.journal" for part in (1, 2, 3, 4)]
    assert nocdyn("merge", "out").returncode == 0
    assert same_as_one_sweep(nocdyn, "out")


@pytest.mark.parametrize("shards", ["", "0", "many"])
def test_a_shard_that_does_not_know_how_many_there_are_is_refused(nocdyn, slurm, shards):
    assert slurm("sbatch", "--array=3", SOURCE / "scripts/slurm/shard", "discs.nml", NOCDYN_SHARDS=shards).returncode == 2
    assert f"NOCDYN_SHARDS = '{shards}' is not how many parts" in (nocdyn.folder / "job-1-3.out").read_text()


@needs_mpi
def test_a_job_of_many_tasks_makes_the_sweep(nocdyn, slurm):
    words = ("--ntasks=2", "--cpus-per-task=2", SOURCE / "scripts/slurm/sweep", "discs.nml", "--out", "out")
    outcome = slurm("sbatch", *words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert " --cpus-per-task=2 " in (nocdyn.folder / "srun.log").read_text()
    assert nocdyn.summary("out")["ranks"] == 2
    assert same_as_one_sweep(nocdyn, "out")


@pytest.mark.parametrize("words", [(), ("3", "discs.nml"), ("0", "discs.nml", "out"), ("many", "discs.nml", "out")])
def test_wrong_usage_is_told(slurm, words):
    outcome = slurm(SOURCE / "scripts/slurm/submit_shards", *words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith("usage: ")
