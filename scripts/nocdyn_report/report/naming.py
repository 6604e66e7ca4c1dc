"""What columns are called."""

from ..columns import Column

WHOLE = ("", "max")  # points of signals that tell all of an element
ENDS = ("1", "2")  # of a shaft, whose largest moment is another column


def name_of(column: Column) -> str:
    """As 'tail', 'tail 1'."""
    return column.element if column.point in WHOLE and column.element else column.title


def is_end(column: Column) -> bool:
    """Whether another column tells more: that of all of the shaft."""
    return column.element_kind == "shaft" and column.point in ENDS
