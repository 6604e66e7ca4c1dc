"""Columns of a trajectory by patterns of their names."""

import difflib
import re
from collections.abc import Iterable, Sequence

from .results import TIME, Header, ResultsError, name_of, quantity_of


def matching(header: Header, patterns: Iterable[str]) -> list[str]:
    """Labels of the columns that a pattern matches, in the order of the file; '*' stands for any text, '?' for a character."""
    labels = [label for label in header.labels if label != TIME]
    chosen: set[str] = set()
    for pattern in patterns:
        expression = re.compile(re.escape(pattern).replace(r"\*", ".*").replace(r"\?", "."), re.IGNORECASE | re.DOTALL)
        found = [label for label in labels if expression.fullmatch(name_of(label)) or expression.fullmatch(label)]
        if not found:
            raise ResultsError(f"{header.folder}: no column matches '{pattern}'{_nearest(pattern, labels)}")
        chosen.update(found)
    return [label for label in labels if label in chosen]


def _nearest(pattern: str, labels: Sequence[str]) -> str:
    kinds = dict.fromkeys(f"{quantity_of(label)}_*" for label in labels if quantity_of(label))
    nearest = difflib.get_close_matches(pattern.lower(), [*kinds, *map(name_of, labels)], 3, 0.75)
    choices = nearest or list(kinds)[:8]
    return f"; {'nearest' if nearest else 'there are'}: {', '.join(choices)}" if choices else ""


def widest(header: Header, labels: Sequence[str], most: int) -> list[str]:
    """As many labels at most, those whose values have the widest ranges, in the order of the file."""
    if len(labels) <= most:
        return list(labels)
    chosen = sorted(labels, key=lambda label: -header.ranges.get(label, 0.0))[:most]
    return [label for label in labels if label in set(chosen)]
