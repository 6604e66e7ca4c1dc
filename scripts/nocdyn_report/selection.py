"""Columns by patterns of their names, and those that vary most."""

import difflib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from .columns import Column
from .failure import ChoiceError
from .results import Header


def matches(pattern: str, *names: str) -> bool:
    """Whether a pattern is one of the names; '*' stands for any text, '?' for a character."""
    expression = re.escape(pattern).replace(r"\*", ".*").replace(r"\?", ".")
    return any(re.fullmatch(expression, name, re.IGNORECASE | re.DOTALL) for name in names)


def matching(header: Header, patterns: Iterable[str]) -> list[str]:
    """Labels of the columns that a pattern matches, in the order of the file."""
    chosen: set[str] = set()
    for pattern in patterns:
        found = [one.label for one in header.columns.values() if matches(pattern, one.name, one.label)]
        if not found:
            hint = _nearest(pattern, header.columns.values())
            raise ChoiceError(f"{header.folder}: no column matches '{pattern}'{hint}")
        chosen.update(found)
    return [label for label in header.columns if label in chosen]


def _nearest(pattern: str, columns: Collection[Column]) -> str:
    kinds = dict.fromkeys(f"{column.kind}_*" for column in columns if column.element)
    nearest = difflib.get_close_matches(pattern.lower(), [*kinds, *(column.name for column in columns)], 3, 0.75)
    choices = nearest or list(kinds)[:8]
    return f"; {'nearest' if nearest else 'there are'}: {', '.join(choices)}" if choices else ""


def widest(labels: Sequence[str], ranges: Mapping[str, float], most: int) -> list[str]:
    """As many labels at most, those whose values have the widest ranges, in their order."""
    if len(labels) <= most:
        return list(labels)
    chosen = set(sorted(labels, key=lambda label: -ranges.get(label, 0.0))[:most])
    return [label for label in labels if label in chosen]
