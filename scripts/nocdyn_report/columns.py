"""What the columns of tables of results are: columns.json, of a response response_columns.json. Figures and report name, order
and choose columns by it."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path

from .failure import ResultsError
from .json_files import read_json

COLUMNS, RESPONSE_COLUMNS = "columns.json", "response_columns.json"
MOMENT, REACTION, FORCE, STRESS, TORQUE, LOSS, SPEED, SLIP, TWIST, CURRENT, DETAIL = range(1, 12)  # ranks
LOADS = (MOMENT, REACTION, FORCE, STRESS)  # what a machine is designed for


@dataclass(frozen=True)
class Column:
    """A signal of the machine, or a statistic of one."""

    label: str  # as in the first line of the table
    name: str  # that of the signal, without its unit
    kind: str  # 'total_moment'
    element_kind: str  # the group of the input, '' of the whole machine
    element: str
    point: str  # of the element, '' of all of it
    unit: str
    caption: str  # what it is, in words
    positive: str = ""  # when it is positive
    rank: int = DETAIL
    statistic: str = ""  # 'half_range', '' of the signal itself
    file: str = ""  # the table, '' if it is in none
    long_name: str = ""  # of a result of a sweep, what it is, in words

    @property
    def is_inner(self) -> bool:
        """Whether it is of a node inside of a shaft."""
        return self.point.startswith("[")

    @property
    def title(self) -> str:
        """What tells it from others of its kind: element and point; of the whole machine its caption."""
        if not self.element:
            return self.caption
        return f"{self.element}{'' if self.is_inner else ' '}{self.point}".rstrip()

    def described(self, words: str) -> tuple[str, str]:
        """'stress_shaft, largest value' as one reads it, 'shaft, shear stress, largest value', and its last part."""
        quantity, *rest = re.split(r"(?=[,:] )", words, maxsplit=1)
        if not rest or not self.element or not self.name.startswith(quantity):
            return words, words
        return f"{self.title}, {self.caption}{rest[0]}", re.split("[,:] ", rest[0])[-1]

    def is_of(self, other: "Column") -> bool:
        """Whether both are of one element."""
        return (self.element_kind, self.element) == (other.element_kind, other.element)

    @property
    def sort(self) -> tuple[str, str, str]:
        """Columns of one sort share an axis: kind, caption and unit."""
        return self.kind, self.caption, self.unit


def read_column_list(folder: Path, name: str = COLUMNS) -> list[Column]:
    file = folder / name
    if not file.is_file():
        raise ResultsError(f"{folder}: no {name} here, as results of older releases have none; compute the results again")
    try:
        return columns_of(read_json(file, ["columns"])["columns"])
    except (AttributeError, TypeError):
        raise ResultsError(f"{file}: this is no {file.name} of nocdyn") from None


def columns_of(entries: Iterable[dict]) -> list[Column]:
    """The columns of a list in a file of JSON."""
    known = {field.name for field in fields(Column)}
    return [Column(**{key: value for key, value in entry.items() if key in known}) for entry in entries]


def by_sort(columns: Iterable[Column]) -> list[list[Column]]:
    """The columns of each sort, what one looks for first, first."""
    sorts: dict[tuple[str, str, str], list[Column]] = {}
    for column in sorted(columns, key=lambda one: one.rank):
        sorts.setdefault(column.sort, []).append(column)
    return list(sorts.values())
