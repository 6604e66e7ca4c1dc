"""Columns of a trajectory by patterns of their names."""

import difflib
import re
from collections.abc import Collection, Iterable, Sequence

from .columns import Column
from .results import Header, ResultsError


def matching(header: Header, patterns: Iterable[str]) -> list[str]:
    """Labels of the columns that a pattern matches, in the order of the file; '*' stands for any text, '?' for a character."""
    chosen: set[str] = set()
    for pattern in patterns:
        expression = re.compile(re.escape(pattern).replace(r"\*", ".*").replace(r"\?", "."), re.IGNORECASE | re.DOTALL)
        found = [
            one.label for one in header.columns.values() if expression.fullmatch(one.name) or expression.fullmatch(one.label)
        ]
        if not found:
            hint = _nearest(pattern, header.columns.values())
            raise ResultsError(f"{header.folder}: no column matches '{pattern}'{hint}")
        chosen.update(found)
    return [label for label in header.columns if label in chosen]


def _nearest(pattern: str, columns: Collection[Column]) -> str:
    kinds = dict.fromkeys(f"{column.kind}_*" for column in columns if column.element)
    nearest = difflib.get_close_matches(pattern.lower(), [*kinds, *(column.name for column in columns)], 3, 0.75)
    choices = nearest or list(kinds)[:8]
    return f"; {'nearest' if nearest else 'there are'}: {', '.join(choices)}" if choices else ""


def widest(header: Header, labels: Sequence[str], most: int) -> list[str]:
    """As many labels at most, those whose values have the widest ranges, in the order of the file."""
    if len(labels) <= most:
        return list(labels)
    chosen = sorted(labels, key=lambda label: -header.ranges.get(label, 0.0))[:most]
    return [label for label in labels if label in set(chosen)]
