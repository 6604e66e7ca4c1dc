"""Files that appear whole or not at all."""

import os
from pathlib import Path

from .failure import FILES, ReportError


def write_whole(path: Path, text: str) -> None:
    """Written aside and renamed."""
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8")
        os.replace(aside, path)
    except OSError as error:
        aside.unlink(missing_ok=True)
        raise ReportError(f"{path}: cannot be written: {error.strerror}", FILES) from None
