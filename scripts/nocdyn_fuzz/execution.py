"""One command in a folder of its own, within limits of time, memory and disk."""

import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

SANITIZED = {
    "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1:hard_rss_limit_mb={memory}:abort_on_error=0:exitcode=66",
    "UBSAN_OPTIONS": "print_stacktrace=1:halt_on_error=1:exitcode=66",
}


@dataclass(frozen=True)
class Limits:
    """What a command may take."""

    seconds: float = 10.0  # of the processor
    memory: int = 1500  # [MB], of address space; for a build with AddressSanitizer, resident
    file_size: int = 30  # [MB]
    is_sanitized: bool = False

    def apply(self):
        """To this process and those that it starts."""
        if not self.is_sanitized:
            resource.setrlimit(resource.RLIMIT_AS, (self.memory << 20, self.memory << 20))
        resource.setrlimit(resource.RLIMIT_FSIZE, (self.file_size << 20, self.file_size << 20))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def environment(self, program):
        known = {name: value for name, value in os.environ.items() if not name.startswith(("OMP_", "NOCDYN"))}
        known |= {"NOCDYN": str(program)}  # for reports
        added = SANITIZED if self.is_sanitized else {}
        return known | {"OMP_NUM_THREADS": "2"} | {name: text.format(memory=self.memory) for name, text in added.items()}


@dataclass(frozen=True)
class Outcome:
    """What a command answered."""

    code: int  # negative: the signal that ended it
    out: bytes
    err: bytes
    in_time: bool
    memory: int  # largest resident [MB]
    is_interrupted: bool = False


def is_sanitized(program):
    """Whether AddressSanitizer is in it."""
    with open(program, "rb") as file:
        return b"__asan_init" in file.read()


def processor_time(process):
    """So far [s]."""
    try:
        fields = Path(f"/proc/{process.pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def ended(process, until):
    """Whether the process ends before `until` says so; the end is not collected."""
    while not os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT):
        if until():
            return False
        time.sleep(0.001)
    return True


def wait_quickly(process, limits):
    """True if the process ended by itself within the limits; a machine at work may take ten times as long by the clock."""
    begun = time.monotonic()

    def is_late():
        passed = time.monotonic() - begun
        return passed > limits.seconds and (processor_time(process) > limits.seconds or passed > 10 * limits.seconds)

    return ended(process, is_late)


def command_line(program, words):
    """Reports are made by a script, which calls the program."""
    if words[:1] == ("report",):
        return (sys.executable, "-m", "nocdyn_report", "report", *words[1:])
    return (program, *words)


def execute(program, words, folder, limits, interrupt=False):
    """With `interrupt`, a command that takes too long is asked to end; that it does so at once is what is wanted of it."""
    out, err = folder.with_suffix(".out"), folder.with_suffix(".err")
    in_time, is_interrupted = True, False
    with open(out, "wb") as out_file, open(err, "wb") as err_file:
        command = [os.fsencode(word) for word in command_line(program, words)]
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=out_file, stderr=err_file, env=limits.environment(program)
        )
        if not wait_quickly(process, limits):
            in_time = False
            if interrupt:
                os.kill(process.pid, signal.SIGTERM)  # SIGINT is ignored in the background
                is_interrupted = in_time = wait_quickly(process, limits)
            os.kill(process.pid, signal.SIGKILL)  # not by `process`, which would collect the end
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    answer = Outcome(process.returncode, out.read_bytes(), err.read_bytes(), in_time, usage.ru_maxrss >> 10, is_interrupted)
    out.unlink()
    err.unlink()
    return answer
