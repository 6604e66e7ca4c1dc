"""Tables in Markdown."""

import math


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Its lines; all columns but the first are numbers."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] + ["---:"] * (len(head) - 1), *rows)]


def rounded(number: float) -> str:
    """Three digits, thousands apart."""
    digits = max(0, math.floor(math.log10(number)) - 2)
    return f"{round(number, -digits):,.0f}".replace(",", " ")
