"""Runs that fail, are interrupted, or cannot write: exit code, message, and what is left behind."""

import os
import re
import resource
import signal
import time
from pathlib import Path

import pytest
from conftest import CASE_1, CASE_2, ENDLESS, IS_SLOW, TRAPS_EXCEPTIONS, wait_for

RESULTS = ["columns.json", "input.nml", "summary.json", "trajectory.csv"]
PARTIAL = ["columns.json", "input.nml", "summary.json", "trajectory.partial.csv"]

# The cubic part wins beyond 0.32 rad, and the disc has the speed to get there.
EXPLODING = """\
&body name = 'disc' inertia = 1.0 speed = 1.0 /
&coupling name = 'shaft' bodies = 'ground', 'disc' stiffness = 1.0 cubic_stiffness = -10.0 /
&run t_end = 100.0 /
&output interval = 0.1 /
"""

# A moment of 1e450 N m.
BEYOND = ["--set", "body.disc.angle=1e50", "--set", "coupling.shaft.polynomial=0,0,0,0,0,0,0,1e50"]


@pytest.mark.parametrize("method", ["rk45", "rosenbrock"])
def test_a_machine_that_blows_up_fails_with_time_and_state(nocdyn, method):
    nocdyn.write("exploding.nml", EXPLODING)
    outcome = nocdyn("run", "exploding.nml", "--out", "out", "--set", f"run.method={method}")
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert outcome.stderr.startswith("nocdyn: exploding.nml: the step size became too small at t = 1.31")
    assert "twist of 'shaft' cannot be kept within" in outcome.stderr
    assert outcome.stderr.endswith("; the rows up to t = 1.3 s are in out/trajectory.partial.csv\n")
    assert nocdyn.files("out") == PARTIAL


@pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build traps the overflow")
def test_a_state_that_is_not_finite_is_named(nocdyn):
    nocdyn.write("exploding.nml", EXPLODING)
    outcome = nocdyn("run", "exploding.nml", "--out", "out", *BEYOND)
    assert (outcome.returncode, outcome.stdout) == (1, "")
    assert "the derivative of the speed of 'disc' at the start, t = 0 s, is not a finite number" in outcome.stderr


def test_a_failed_run_keeps_the_rows_until_then(nocdyn):
    nocdyn.write("exploding.nml", EXPLODING)
    nocdyn("run", "exploding.nml", "--out", "out")
    _, rows = nocdyn.table("out", "trajectory.partial.csv")
    assert [row[0] for row in rows] == [i * 0.1 for i in range(14)]
    summary = nocdyn.summary("out")
    assert summary["status"] == "failed"
    assert "step size became too small" in summary["message"]
    assert summary["counts"]["rows"] == 14
    assert 1.3 < summary["time_reached"] < 1.4


@pytest.mark.parametrize("method", ["auto", "rk45", "rodas5p"])
def test_a_failed_run_has_the_extremes_up_to_where_it_came(nocdyn, method):
    nocdyn.write("exploding.nml", EXPLODING)
    nocdyn("run", "exploding.nml", "--out", "out", "--set", f"run.method={method}")
    summary = nocdyn.summary("out")
    speed = summary["columns"]["omega_disc [rad/s]"]
    assert summary["extremes"] == "of the motion"
    assert speed["max"] > 10 * speed["last"]  # the last row is at 1.3 s
    assert 1.3 < speed["time_of_max"] <= summary["time_reached"]


@pytest.mark.skipif(TRAPS_EXCEPTIONS, reason="the debug build traps the overflow")
def test_a_run_that_cannot_start_has_no_row_and_no_extremes(nocdyn):
    nocdyn.write("exploding.nml", EXPLODING)
    nocdyn("run", "exploding.nml", "--out", "out", *BEYOND)
    summary = nocdyn.summary("out")
    assert (summary["extremes"], summary["counts"]["rows"], summary["columns"]) == ("of the rows", 0, {})
    assert nocdyn.table("out", "trajectory.partial.csv")[1] == []


def test_too_few_steps_are_a_failure_that_names_the_key(nocdyn):
    outcome = nocdyn("run", CASE_2, "--out", "out", "--set", "run.max_steps=5")
    assert outcome.returncode == 1
    assert "after 5 steps, the most that max_steps allows" in outcome.stderr
    assert nocdyn.files("out") == PARTIAL


def test_a_run_that_fails_before_its_first_step_leaves_a_partial_file(nocdyn):
    outcome = nocdyn("run", CASE_2, "--out", "out", "--set", "run.max_steps=1", "--set", "output.points=2")
    assert outcome.returncode == 1
    assert nocdyn.files("out") == PARTIAL
    assert len(nocdyn.table("out", "trajectory.partial.csv")[1]) == 1


def test_a_failed_run_replaces_the_results_of_an_earlier_one(nocdyn):
    nocdyn("run", CASE_2, "--out", "out")
    assert nocdyn.files("out") == RESULTS
    nocdyn("run", CASE_2, "--out", "out", "--set", "run.max_steps=5")
    assert nocdyn.files("out") == PARTIAL
    nocdyn("run", CASE_2, "--out", "out")
    assert nocdyn.files("out") == RESULTS
    assert nocdyn.summary("out")["status"] == "done"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_a_partial_result(nocdyn, number):
    nocdyn("run", CASE_2, "--out", "out", "-q")
    process = nocdyn.start_endless("out")
    process.send_signal(number)
    output, complaint = process.communicate(timeout=30)
    assert (process.returncode, output) == (1, "")
    assert complaint.startswith(f"nocdyn: {CASE_2}: the integration was interrupted at t = ")
    assert complaint.count("\n") == 1 and "out/trajectory.partial.csv" in complaint
    assert nocdyn.files("out") == PARTIAL
    summary = nocdyn.summary("out")
    assert summary["status"] == "interrupted"
    _, rows = nocdyn.table("out", "trajectory.partial.csv")
    assert [row[0] for row in rows] == list(range(int(summary["time_reached"]) + 1))
    assert summary["extremes"] == "of the motion"


def test_an_interruption_ends_the_whole_list_of_files(nocdyn):
    process = nocdyn.start("run", CASE_1, CASE_2, "--out", "out", *ENDLESS)
    wait_for(lambda: list((nocdyn.folder).glob("out/case1/.trajectory.csv.*")))
    process.send_signal(signal.SIGINT)
    _, complaint = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "files not run after the interruption: 1" in complaint
    assert nocdyn.files("out") == ["case1"]


def test_signals_that_come_together_are_one_interruption(nocdyn):
    # `timeout` sends its signal to the program and then to the program's group
    process = nocdyn.start_endless("out")
    for number in (signal.SIGSTOP, signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGCONT):
        process.send_signal(number)
    process.communicate(timeout=30)
    assert process.returncode == 1
    assert nocdyn.files("out") == PARTIAL


def test_a_second_interruption_ends_a_program_that_does_not_end(nocdyn):
    reading, writing = os.pipe()  # full, so that the message of the first interruption cannot be written
    os.set_blocking(writing, False)
    with pytest.raises(BlockingIOError):
        while True:
            os.write(writing, bytes(4096))
    os.set_blocking(writing, True)
    process = nocdyn.start_endless("out", stderr=writing)
    process.send_signal(signal.SIGINT)
    wait_for(lambda: nocdyn.files("out") == PARTIAL)
    time.sleep(2.1)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=30) == 128 + signal.SIGINT
    os.close(reading)
    os.close(writing)


def test_a_signal_that_the_shell_ignores_stays_ignored(nocdyn):
    options = {"preexec_fn": lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)}
    horizon = ("--set", f"run.t_end={200 if IS_SLOW else 2000}", "--set", "output.interval=1")
    process = nocdyn.start("run", CASE_2, "--out", "out", "-q", *horizon, **options)
    wait_for(lambda: list((nocdyn.folder / "out").glob(".trajectory.csv.*")))
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=60)
    assert process.returncode == 0
    assert nocdyn.files("out") == RESULTS


def test_a_killed_run_leaves_earlier_results_whole(nocdyn):
    nocdyn("run", CASE_2, "--out", "out", "-q")
    before = {name: (nocdyn.folder / "out" / name).read_bytes() for name in RESULTS}
    process = nocdyn.start_endless("out")
    process.kill()
    process.communicate()
    assert {name: (nocdyn.folder / "out" / name).read_bytes() for name in RESULTS} == before


def test_a_folder_that_cannot_be_made_is_exit_code_3(nocdyn, spinner):
    nocdyn.write("file", "in the way")
    outcome = nocdyn("run", spinner, "--out", "file/out")
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == ("nocdyn: cannot write 'file/out/trajectory.csv': the folder cannot be made: Not a directory\n")
    assert (nocdyn.folder / "file").read_text() == "in the way"


def limited_to(size):
    """Files of the process cannot grow beyond so many bytes."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


# nothing fits, one piece of the trajectory fits, all but its last piece does
@pytest.mark.parametrize("size", [0, 100_000, 320_000])
def test_a_full_disk_is_exit_code_3_and_leaves_nothing(nocdyn, size):
    outcome = nocdyn("run", CASE_2, "--out", "out", preexec_fn=limited_to(size))
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: cannot write 'out/trajectory.csv': File too large\n"
    assert nocdyn.files("out") == []


def test_a_disk_with_no_room_for_the_columns_leaves_nothing(nocdyn, spinner):
    # more than trajectory and input need, less than columns.json does
    outcome = nocdyn("run", spinner, "--out", "out", "--set", "output.points=2", preexec_fn=limited_to(1200))
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: cannot write 'out/columns.json': File too large\n"
    assert nocdyn.files("out") == []


def test_a_full_disk_leaves_earlier_results_whole(nocdyn):
    nocdyn("run", CASE_2, "--out", "out", "-q")
    before = {name: (nocdyn.folder / "out" / name).read_bytes() for name in RESULTS}
    outcome = nocdyn("run", CASE_2, "--out", "out", "--set", "load.work.viscous=50", preexec_fn=limited_to(100_000))
    assert outcome.returncode == 3
    assert {name: (nocdyn.folder / "out" / name).read_bytes() for name in nocdyn.files("out")} == before


ANALYSED = """&body name = 'a' inertia = 1 speed = 10 /
&body name = 'b' inertia = 2 speed = 10 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 1000 damping = 1 /
&load name = 'l' body = 'b' viscous = 1 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 10 /
&excitation name = 'x' body = 'a' kind = 'orders' orders = 1 amplitudes = 2 /
&response body = 'a' speed = 8, 12 count = 5 /
&run t_end = 1 /
"""


# all files but the longest one fit
@pytest.mark.parametrize("command", ["modes", "response", "campbell", "equilibrium"])
def test_files_of_an_analysis_appear_together_or_not_at_all(nocdyn, command):
    nocdyn.write("m.nml", ANALYSED)
    assert nocdyn(command, "m.nml", "--out", "whole").returncode == 0
    names = nocdyn.files("whole")
    longest = max(names, key=lambda name: (nocdyn.folder / "whole" / name).stat().st_size)
    room = (nocdyn.folder / "whole" / longest).stat().st_size - 1
    outcome = nocdyn(command, "m.nml", "--out", "new", preexec_fn=limited_to(room))
    assert (outcome.returncode, outcome.stderr) == (3, f"nocdyn: cannot write 'new/{longest}': File too large\n")
    assert nocdyn.files("new") == []
    before = {name: (nocdyn.folder / "whole" / name).read_bytes() for name in names}
    changed = ("--set", "body.a.inertia=1.5")
    assert nocdyn(command, "m.nml", "--out", "whole", *changed, preexec_fn=limited_to(room // 2)).returncode == 3
    assert {name: (nocdyn.folder / "whole" / name).read_bytes() for name in nocdyn.files("whole")} == before


def test_new_on_a_full_disk_leaves_nothing(nocdyn):
    outcome = nocdyn("new", "mine.nml", preexec_fn=limited_to(100))
    assert outcome.returncode == 3 and outcome.stderr == "nocdyn: cannot write 'mine.nml': File too large\n"
    assert list(nocdyn.folder.iterdir()) == []


CHAIN = "".join(f"&body name = 'b{i}' inertia = 1 /\n" for i in range(400)) + "".join(
    f"&coupling name = 'k{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e5 damping = 1 /\n" for i in range(399)
)
ASKED = """\
&load name = 'l' body = 'b0' viscous = 1 /
&motor name = 'm' body = 'b9' kind = 'constant' torque = 10 /
&excitation name = 'x' body = 'b0' kind = 'orders' orders = 1, 2, 3 amplitudes = 1, 1, 1 /
&response body = 'b0' speed_rpm = 100, 900 count = 10000 /
&run t_end = 1 /
"""


def catches(process, number):
    """Whether a process has a handler for a signal."""
    mask = re.search(r"^SigCgt:\s*(\w+)$", Path(f"/proc/{process.pid}/status").read_text(), re.MULTILINE)[1]
    return int(mask, 16) >> (number - 1) & 1 == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("command", ["modes", "response", "campbell", "equilibrium"])
def test_an_interrupted_analysis_leaves_a_message_and_no_files(nocdyn, command, number):
    path = nocdyn.write("chain.nml", CHAIN + ASKED)
    process = nocdyn.start(command, path, "--out", "out")
    wait_for(lambda: catches(process, number))  # it takes some seconds then
    process.send_signal(number)
    output, complaint = process.communicate(timeout=30)
    assert (process.returncode, output) == (1, "")
    assert complaint == f"nocdyn: {path}: interrupted, without results\n"
    assert not (nocdyn.folder / "out").exists()


def test_an_analysis_that_is_interrupted_while_it_writes_leaves_no_hidden_files(nocdyn):
    text = "&body name='a' inertia=1 /\n&body name='b' inertia=1 /\n&coupling name='k' bodies='a','b' stiffness=1e5 damping=1 /\n"
    text += "&excitation name='x' body='a' kind='orders' orders=1 amplitudes=1 /\n&run t_end=1 /\n"
    path = nocdyn.write("two.nml", text + "&response body='a' speed=1, 9 count=60000 /\n")
    process = nocdyn.start("response", path, "--out", "out")
    wait_for(lambda: list(nocdyn.folder.glob("out/.*")))
    process.send_signal(signal.SIGTERM)
    _, complaint = process.communicate(timeout=60)
    assert (process.returncode, complaint) == (1, f"nocdyn: {path}: interrupted, without results\n")
    assert not list((nocdyn.folder / "out").iterdir())
