"""scripts/slurm, with stand-ins for sbatch and srun that run the jobs at once."""

import os
import shutil
import subprocess

import pytest
from conftest import SOURCE
from sweep_inputs import MPI_ENVIRONMENT, MPI_PROGRAM, SWEEP, TWO_DISCS, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

# Prints the number of the job as --parsable does, notes its words, and runs the script: once, or for each job of an array.
SBATCH = """\
#!/usr/bin/env bash
set -euo pipefail
echo "$*" >> sbatch.log
job=$(wc -l < sbatch.log)
last=0
while [[ $1 == -* ]]; do
  case $1 in
    --array=*) last=${1#--array=1-} ;;
    --ntasks=*) export SLURM_NTASKS=${1#--ntasks=} ;;
  esac
  shift
done
script=$1
shift
cp "$script" spooled
if ((last == 0)); then
  bash spooled "$@" > "job-$job.out" 2>&1
fi
for ((i = 1; i <= last; i++)); do
  SLURM_ARRAY_TASK_ID=$i SLURM_ARRAY_TASK_MIN=1 SLURM_ARRAY_TASK_COUNT=$last bash spooled "$@" > "job-$job-$i.out" 2>&1
done
echo "$job;cluster"
"""
SRUN = """\
#!/usr/bin/env bash
set -euo pipefail
[[ $1 == --kill-on-bad-exit=1 ]]
exec mpirun -n "$SLURM_NTASKS" "${@:2}"
"""


@pytest.fixture
def slurm(nocdyn):
    """Runs a script where sbatch and srun are the stand-ins."""
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    for name, text in (("sbatch", SBATCH), ("srun", SRUN)):
        nocdyn.write(f"bin/{name}", text).chmod(0o755)
    path = f"{nocdyn.folder}/bin:{os.environ['PATH']}"
    environment = MPI_ENVIRONMENT | {"PATH": path, "NOCDYN": nocdyn.executable, "NOCDYN_MPI": str(MPI_PROGRAM)}

    def call(*words):
        return subprocess.run(words, cwd=nocdyn.folder, env=environment, check=False, capture_output=True, text=True, timeout=60)

    return call


def same_as_one_sweep(nocdyn, folder):
    nocdyn("sweep", "discs.nml", "--out", "whole")
    return (nocdyn.folder / folder / "sweep.nc").read_bytes() == (nocdyn.folder / "whole/sweep.nc").read_bytes()


def test_an_array_and_its_merge_make_the_sweep(nocdyn, slurm):
    outcome = slurm(SOURCE / "scripts/slurm/submit_shards", "3", "discs.nml", "out", "--quiet")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout == "array of 3 jobs: 1, merge: 2\n"
    array, merge = (nocdyn.folder / "sbatch.log").read_text().splitlines()
    assert array == f"--parsable --array=1-3 {SOURCE}/scripts/slurm/shard discs.nml --out out --quiet"
    assert merge == f"--parsable --dependency=afterok:1 {SOURCE}/scripts/slurm/merge out"
    assert same_as_one_sweep(nocdyn, "out")


def test_options_of_sbatch_reach_the_array(nocdyn, slurm):
    script = f"SBATCH_ARGUMENTS='--time=1:00:00 --cpus-per-task=4' {SOURCE}/scripts/slurm/submit_shards 2 discs.nml out"
    assert slurm("sh", "-c", script).returncode == 0
    assert "--array=1-2 --time=1:00:00 --cpus-per-task=4 " in (nocdyn.folder / "sbatch.log").read_text()


def test_an_array_that_is_submitted_again_computes_nothing_again(nocdyn, slurm):
    words = ("sbatch", "--array=1-2", SOURCE / "scripts/slurm/shard", "discs.nml", "--out", "out")
    slurm(*words)
    before = (nocdyn.folder / "out/sweep.1-of-2.journal").read_bytes()
    assert slurm(*words).returncode == 0
    assert (nocdyn.folder / "out/sweep.1-of-2.journal").read_bytes() == before


@needs_mpi
def test_a_job_of_many_tasks_makes_the_sweep(nocdyn, slurm):
    outcome = slurm("sbatch", "--ntasks=2", SOURCE / "scripts/slurm/sweep", "discs.nml", "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert nocdyn.summary("out")["ranks"] == 2
    assert same_as_one_sweep(nocdyn, "out")


@pytest.mark.parametrize("words", [(), ("3", "discs.nml"), ("0", "discs.nml", "out"), ("many", "discs.nml", "out")])
def test_wrong_usage_is_told(slurm, words):
    outcome = slurm(SOURCE / "scripts/slurm/submit_shards", *words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith("usage: ")


@pytest.mark.skipif(not shutil.which("shellcheck"), reason="shellcheck is not installed")
def test_the_scripts_are_clean():
    scripts = sorted((SOURCE / "scripts/slurm").iterdir())
    outcome = subprocess.run(["shellcheck", *scripts], check=False, capture_output=True, text=True)
    assert (outcome.returncode, outcome.stdout) == (0, "")
