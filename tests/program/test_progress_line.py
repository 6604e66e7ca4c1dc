"""Progress shows on a terminal only, and only on work that takes longer than a second; that of sweeps in logs too."""

import os
import pty
import re
import select
import signal
import time

from conftest import CASE_2, wait_for
from sweep_inputs import SWEEP, TWO_DISCS, needs_sweeps

PROGRESS = re.compile(r"\r[^\r]*case2\.nml: \d+ %, \d+ s left\x1b\[K")
ERASED = "\r\x1b[K"


LOGGED = re.compile(
    r"discs\.nml: \d+ of 100000000 variants, [\d.e+]+ per second, \d+ s left\nnocdyn: discs\.nml: interrupted .*\n"
)
SWEEP_PROGRESS = re.compile(r"\rdiscs\.nml: \d+ of 100000000 variants, [\d.e+]+ per second, \d+ s left\x1b\[K")


def read_available(terminal, seconds, awaited=b"%"):
    """What is written to the terminal until it closes, `awaited` has come or the time is over."""
    text, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        ready, _, _ = select.select([terminal], [], [], 0.05)
        if not ready:
            continue
        try:
            piece = os.read(terminal, 4096)
        except OSError:  # the program has closed its end
            break
        if not piece:
            break
        text += piece
        if awaited in text:
            break
    return text.decode()


def test_a_long_run_shows_progress_on_a_terminal_after_a_second(nocdyn):
    terminal, end = pty.openpty()
    began = time.monotonic()
    process = nocdyn.start_endless("out", stderr=end)
    os.close(end)
    shown = read_available(terminal, 20)
    assert time.monotonic() - began >= 1.0
    assert PROGRESS.fullmatch(shown)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    rest = os.read(terminal, 4096).decode()
    os.close(terminal)
    assert ERASED + "nocdyn: " in rest


@needs_sweeps
def test_a_long_sweep_shows_how_many_variants_are_done(nocdyn):
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    endless = ("--set", "sweep.samples=100000000", "--set", "run.t_end=20")
    terminal, end = pty.openpty()
    process = nocdyn.start("sweep", "discs.nml", "--out", "out", *endless, stderr=end)
    os.close(end)
    shown = read_available(terminal, 20, b"left")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    rest = os.read(terminal, 4096).decode()
    os.close(terminal)
    assert SWEEP_PROGRESS.search(shown)
    assert ERASED + "nocdyn: " in rest


@needs_sweeps
def test_a_long_sweep_tells_a_log_now_and_then_how_many_variants_are_done(nocdyn):
    nocdyn.write("discs.nml", TWO_DISCS + SWEEP)
    endless = ("--set", "sweep.samples=100000000", "--threads", 1)
    processes = [nocdyn.start("sweep", "discs.nml", "--out", out, *endless, *words) for out, words in (("a", ()), ("b", ("-q",)))]
    # together longer than the ten seconds after which a log gets its first line, shorter than the twenty until the second;
    # stopped in between, as they would keep two processors busy
    wait_for(lambda: (nocdyn.folder / "a/sweep.journal").is_file())
    size = (nocdyn.folder / "a/sweep.journal").stat().st_size
    wait_for(lambda: (nocdyn.folder / "a/sweep.journal").stat().st_size > size)
    for number, seconds in ((signal.SIGSTOP, 10), (signal.SIGCONT, 2), (signal.SIGINT, 0)):
        for process in processes:
            process.send_signal(number)
        time.sleep(seconds)
    logged, quiet = (process.communicate(timeout=30)[1] for process in processes)
    assert LOGGED.fullmatch(logged)
    assert quiet.startswith("nocdyn: ") and quiet.count("\n") == 1


def test_a_short_run_shows_no_progress(nocdyn):
    terminal, end = pty.openpty()
    process = nocdyn.start("run", CASE_2, stderr=end)
    os.close(end)
    assert process.wait(timeout=30) == 0
    assert read_available(terminal, 5) == ""
    os.close(terminal)


def test_quiet_and_pipes_show_no_progress(nocdyn):
    terminal, end = pty.openpty()
    quiet = nocdyn.start_endless("quiet", "--quiet", stderr=end)
    piped = nocdyn.start_endless("piped")
    os.close(end)
    # longer than the second after which progress would show
    time.sleep(1.5)
    for process in (quiet, piped):
        process.send_signal(signal.SIGINT)
    output, complaint = piped.communicate(timeout=30)
    quiet.communicate(timeout=30)
    shown = read_available(terminal, 5)
    os.close(terminal)
    assert (output, complaint.count("\n")) == ("", 1)
    assert "%" not in complaint and "\r" not in complaint
    assert "interrupted" in shown and "%" not in shown
