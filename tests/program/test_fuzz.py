"""Mutants of the shipped inputs and command lines break no promise; what the judgement of scripts/fuzz finds."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from conftest import SOURCE, TRAPS_EXCEPTIONS

sys.path.insert(0, str(SOURCE / "scripts"))
from nocdyn_fuzz import corpus, findings, judgement
from nocdyn_fuzz.execution import Limits, Outcome, execute

MUTANTS = 1000


@pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build ends where the others go on with infinity, and then refuse it")
def test_no_mutant_breaks_a_promise(tmp_path):
    build = Path(os.environ["NOCDYN"]).parents[1]
    command = [sys.executable, "-m", "nocdyn_fuzz", "--build", build, "--count", str(MUTANTS), "--findings", tmp_path / "found"]
    environment = os.environ | {"PYTHONPATH": str(SOURCE / "scripts")}
    outcome = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    assert outcome.stdout.startswith(f"{MUTANTS} mutants in ")


CASE = corpus.Case(files={"a.nml": b"&case title = 'x' /"}, words=("run", "a.nml"), main="a.nml")
FINE = Outcome(code=0, out=b"a.nml: done\n", err=b"", in_time=True, memory=10)


def judged(folder, code=0, out=b"", err=b"", in_time=True, memory=10):
    return judgement.findings(CASE, Outcome(code, out, err, in_time, memory), folder, memory=100)


def test_an_outcome_as_promised_is_no_finding(tmp_path):
    (tmp_path / "trajectory.csv").write_text("t [s],phi_inf [rad],inf\n0,1e308,-1\n")
    (tmp_path / "summary.json").write_text('{"status": "done"}')
    assert judgement.findings(CASE, FINE, tmp_path, memory=100) == []
    assert judged(tmp_path / "none", code=2, err="nocdyn: 'ä' is wrong\n".encode()) == []


@pytest.mark.parametrize(
    ("outcome", "finding"),
    [
        ({"code": -11}, "ended by signal 11"),
        ({"code": 66, "err": b"x"}, "exit code 66"),
        ({"code": 1}, "exit code 1 without a message"),
        ({"code": 1, "err": b"nocdyn_text: x\nERROR STOP\n"}, "'ERROR STOP' is printed"),
        ({"out": b" ** On entry to DGEBAL parameter number 3\n"}, "'On entry to' is printed"),
        ({"out": b"torque [N m]  NaN\n"}, "'nan' among the results printed"),
        ({"out": b"a\x1b[31m\n"}, "U+001B in standard output"),
        ({"code": 2, "err": b"\xe2\x80\xae\n"}, "U+202E in standard error"),
        ({"code": 2, "err": b"\xff\n"}, "what is not UTF-8 in standard error"),
        ({"in_time": False}, "takes too long"),
        ({"memory": 101}, "takes more than 100 MB"),
    ],
)
def test_a_broken_promise_is_found_in_what_is_printed(tmp_path, outcome, finding):
    assert judged(tmp_path, **outcome) == [finding]


@pytest.mark.parametrize(
    ("code", "name", "content", "finding"),
    [
        (0, "trajectory.csv", "t [s],x\n0,1\n1,inf\n", "trajectory.csv line 3 has a number that is not finite"),
        (0, "summary.json", '{"status": NaN}', "summary.json cannot be read: NaN in JSON"),
        (0, ".trajectory.csv.123", "", "exit code 0 leaves .trajectory.csv.N"),
        (1, "trajectory.csv", "t [s]\n", "exit code 1 leaves trajectory.csv"),
        (1, "summary.json", '{"status": "done"}', "exit code 1 leaves a summary of success"),
    ],
)
def test_a_broken_promise_is_found_in_the_files(tmp_path, code, name, content, finding):
    (tmp_path / name).write_text(content)
    assert judged(tmp_path, code=code, err=b"nocdyn: x\n" if code else b"") == [finding]


def test_a_finding_is_made_small():
    content = b"".join(b"&body name = 'b%d' /\n" % number for number in range(40))
    case = corpus.Case(files={"a.nml": content}, words=("check", "a.nml", "--set", "run.t_end=1"), main="a.nml")
    small = findings.minimised(case, "bad", lambda smaller: ["bad"] if b"'b17'" in smaller.files["a.nml"] else [])
    assert small.words == ("check", "a.nml")
    assert small.files["a.nml"].split() == b"&body name = 'b17' /".split()


def test_a_program_that_does_not_end_is_ended(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    begun = time.monotonic()
    outcome = execute(sys.executable, ("-c", "while True: pass"), folder, Limits(seconds=0.2))
    assert not outcome.in_time and outcome.code == -9
    assert time.monotonic() - begun < 30  # by the clock ten times what is allowed of the processor


def test_a_program_without_end_may_be_asked_to_end(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    outcome = execute("/bin/sleep", ("100",), folder, Limits(seconds=0.02), interrupt=True)
    assert outcome.in_time and outcome.is_interrupted and outcome.code == -15
