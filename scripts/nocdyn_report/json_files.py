"""Reports of the program, which are files of JSON."""

import json
from collections.abc import Collection
from pathlib import Path

from .failure import ResultsError


def read_json(file: Path, keys: Collection[str]) -> dict:
    """What a file has, if it is one of nocdyn: with these keys at least."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise ResultsError(f"{file}: is no complete JSON: line {error.lineno}") from None
    except UnicodeDecodeError:
        raise ResultsError(f"{file}: cannot be read: it is no text in UTF-8") from None
    except OSError as error:
        raise ResultsError(f"{file}: cannot be read: {error.strerror}") from None
    if not isinstance(content, dict) or not set(keys) <= content.keys():
        raise ResultsError(f"{file}: this is no {file.name} of nocdyn")
    return content


def with_case(title: str, case: str) -> str:
    """The title of a machine, with the load case that results are of, if there is one."""
    return f"{title}: load case {case}" if case else title
