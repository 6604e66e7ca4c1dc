"""Keeps what compiled peers print apart from the report."""

import os
import sys
from pathlib import Path


def divert_to(log: Path) -> None:
    """From here on the file descriptors 1 and 2 lead to the log; sys.stdout and sys.stderr lead to where they led.

    For the rest of the process: Fortran and C may hold back what they print until it ends.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("wb") as file:
        for name, descriptor in (("stdout", 1), ("stderr", 2)):
            getattr(sys, name).flush()
            setattr(sys, name, os.fdopen(os.dup(descriptor), "w", encoding="utf-8", buffering=1))
            os.dup2(file.fileno(), descriptor)
