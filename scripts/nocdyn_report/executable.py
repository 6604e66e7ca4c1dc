"""Where the program nocdyn is."""

import os
import shutil
from pathlib import Path

BUILT = Path(__file__).resolve().parents[2] / "build/release/bin/nocdyn"


def find_executable() -> Path | None:
    """The one of the environment variable NOCDYN, which nocdyn sets, else that in the PATH, else the one built here."""
    for candidate in (os.environ.get("NOCDYN"), shutil.which("nocdyn"), BUILT):
        if candidate and Path(candidate).is_file():
            return Path(candidate).resolve()
    return None
