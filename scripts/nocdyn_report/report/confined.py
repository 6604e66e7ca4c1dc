"""Which files an input may bring into a report: those in its own folder."""

import stat
from pathlib import Path

from .failure import FILES, USAGE, ReportError


class Folder:
    """The folder of an input. Reports are passed on: a file of another folder is in one only if the caller allows it."""

    def __init__(self, folder: Path, allows_outside: bool) -> None:
        self.folder = folder
        self.allows_outside = allows_outside

    def has(self, base: Path, name: str) -> bool:
        """Whether a name in a file of the folder `base` is that of a file in here, links followed."""
        if self.allows_outside:
            return True
        if Path(name).is_absolute() or ".." in Path(name).parts:
            return False
        return (base / name).resolve().is_relative_to(self.folder.resolve())

    def read(self, base: Path, name: str, subject: str, most: int) -> bytes:
        """The content of a file that is in here; `subject` begins messages."""
        if not self.has(base, name):
            raise ReportError(
                f"{subject}: is not in the folder of the input; allowed: a relative path without '..' and links out of it, "
                "or --allow-outside",
                USAGE,
            )
        path = base / name
        try:
            status = path.stat()
            if not stat.S_ISREG(status.st_mode):  # a pipe may never end, nor a device
                raise ReportError(f"{subject}: is no regular file", USAGE)
            if status.st_size > most:
                raise ReportError(f"{subject}: {status.st_size} bytes; allowed: up to {most}", USAGE)
            return path.read_bytes()
        except OSError as error:
            raise ReportError(f"{subject}: cannot be read: {error.strerror}", FILES) from None
