"""Tables in Markdown."""


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Its lines; all columns but the first are numbers."""
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] + ["---:"] * (len(head) - 1), *rows)]
