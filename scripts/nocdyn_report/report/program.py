"""The program nocdyn: where it is, and what a command of it answers."""

import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..executable import find_executable
from .failure import FILES, ReportError

PREFIX = "nocdyn: "  # of its messages


@dataclass(frozen=True)
class Answer:
    """How a command ended."""

    code: int
    message: str  # of a failure, as the program printed it
    output: str
    seconds: float

    @property
    def sentence(self) -> str:
        """The message without the name of the program."""
        return "\n".join(line.removeprefix(PREFIX) for line in self.message.splitlines())


@dataclass(frozen=True)
class Program:
    path: Path

    def __call__(self, *words: str) -> Answer:
        began = time.monotonic()
        try:
            done = subprocess.run([self.path, *words], stdin=subprocess.DEVNULL, capture_output=True, check=False)
        except OSError as error:
            raise ReportError(f"{self.path}: cannot be started: {error.strerror}", FILES) from None
        message, output = (text.decode("utf-8", "replace").rstrip("\n") for text in (done.stderr, done.stdout))
        code = done.returncode if done.returncode >= 0 else 128 - done.returncode  # as the shell tells signals
        return Answer(code, message, output, time.monotonic() - began)

    @property
    def identity(self) -> str:
        """Another build is another program."""
        status = self.path.stat()
        return f"{self.path}, {status.st_size} bytes, {status.st_mtime_ns}"


def find_program() -> Program:
    """The program that computes what a report needs."""
    found = find_executable()
    if found is None:
        raise ReportError(
            "there is no program nocdyn in the PATH, and none in build/release/bin; README.md tells how to build it", FILES
        )
    return Program(found)


def option_words(overrides: Sequence[str]) -> list[str]:
    """--set PATH=VALUE for each."""
    return [word for override in overrides for word in ("--set", override)]
