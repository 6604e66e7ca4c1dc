"""What a report consists of: sections with paragraphs, lists of facts, tables, figures, text."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from .numbers import NONE, name_and_unit, number_text, unit_text


@dataclass(frozen=True)
class Cell:
    """What a table shows, by what it is sorted, and where a link leads."""

    text: str
    key: float | str = ""
    link: str = ""
    tone: str = ""  # 'good', 'bad', 'warn'
    is_number: bool = False


PAPER = 150  # characters that a line of a table has on paper, in the smallest print


@dataclass
class Table:
    caption: str
    columns: list[str]  # 'frequency [Hz]'
    rows: list[list[Cell]]
    note: str = ""
    is_sorted: bool = True  # whether the reader may sort it
    is_beside: bool = False  # on paper, of another table
    kind: str = "table"
    number: int = 0  # in the report, as the id
    id: str = ""

    @property
    def heads(self) -> list[tuple[str, str, bool]]:
        """Name, unit, whether there are numbers below."""
        named = (name_and_unit(column) for column in self.columns)
        numbers = [any(row[i].is_number for row in self.rows) for i in range(len(self.columns))]
        return [(name, unit_text(unit), is_number) for (name, unit), is_number in zip(named, numbers)]

    @property
    def width(self) -> int:
        """Characters of a row without line breaks."""
        heads = [max(map(len, head.split()), default=0) + 1 for head in self.columns]
        return sum(max([head, *(len(row[i].text) + 2 for row in self.rows)]) for i, head in enumerate(heads))

    @property
    def is_wider_than_paper(self) -> bool:
        """Whether there is no room for its words on a page."""
        words = [
            [word for text in (head, *(row[i].text for row in self.rows)) for word in text.split()]
            for i, head in enumerate(self.columns)
        ]
        return sum(max(map(len, column), default=0) + 2 for column in words) > PAPER


@dataclass
class Panel:
    """Curves; `spec` is what assets/figures.js draws."""

    title: str  # '' of a figure that has no other
    text: str  # alternative to the picture
    spec: dict
    id: str = ""


@dataclass
class Figure:
    """Panels with one legend: curves of one name look alike in all of them."""

    caption: str
    panels: list[Panel]
    columns: int = 1  # panels beside one another
    kind: str = "figure"
    number: int = 0
    id: str = ""


@dataclass
class Drawing:
    """A picture that is drawn here, as SVG."""

    caption: str
    text: str
    svg: str
    kind: str = "drawing"
    number: int = 0
    id: str = ""


@dataclass(frozen=True)
class Paragraph:
    text: str
    tone: str = ""
    kind: str = "paragraph"


@dataclass(frozen=True)
class Markup:
    """HTML that is safe, as made of Markdown."""

    html: str
    kind: str = "markup"


@dataclass(frozen=True)
class Listing:
    """Text as it is in a file."""

    caption: str
    text: str
    is_folded: bool = False
    is_narrow: bool = False  # short lines, which stand in columns
    kind: str = "listing"


@dataclass(frozen=True)
class Items:
    items: list[str]
    kind: str = "items"


@dataclass(frozen=True)
class Heading:
    """Of a part of a section."""

    title: str
    id: str
    kind: str = "heading"


Block = Table | Figure | Drawing | Paragraph | Markup | Listing | Items | Heading


NARROW = 62, 84  # characters in a row of a table that has room beside another one; in small print
FEW = 45  # rows of such a table


def set_beside(blocks: Sequence[Block], is_small: bool) -> None:
    """Marks pairs of narrow tables that follow one another."""
    free = None
    for block in blocks:
        is_narrow = isinstance(block, Table) and block.width <= NARROW[is_small] and len(block.rows) <= FEW
        if is_narrow and free:
            free.is_beside = block.is_beside = True
            free = None
        else:
            free = block if is_narrow else None


@dataclass
class Section:
    id: str
    title: str
    blocks: list[Block] = field(default_factory=list)
    details: list[Block] = field(default_factory=list)  # what stands in an appendix
    is_appendix: bool = False
    number: str = ""

    def add(self, *blocks: Block) -> "Section":
        self.blocks.extend(blocks)
        return self

    def add_details(self, *blocks: Block) -> "Section":
        self.details.extend(blocks)
        return self


def text(value: object, tone: str = "", link: str = "") -> Cell:
    return Cell(str(value), str(value).lower(), link, tone)


def number(value: object, digits: int = 5, tone: str = "") -> Cell:
    """A number with its digits; what is no finite number sorts last."""
    key = float(value) if isinstance(value, (int, float)) else float("inf")
    return Cell(number_text(value, digits), key, "", tone, True)


def panels_beside(count: int) -> int:
    """Small panels of a figure in a row: up to four in one, more in rows of three or four, of which there are few."""
    return count if count <= 4 else 3 if count in (5, 6, 9) else 4


def by_columns(caption: str, columns: Sequence[tuple[str, list[Cell]]], note: str = "", is_sorted: bool = True) -> Table:
    """A table of its columns; one without any content is left out."""
    shown = [(head, cells) for head, cells in columns if any(cell.text not in ("", NONE) for cell in cells)]
    rows = [list(row) for row in zip(*(cells for _, cells in shown))]
    return Table(caption, [head for head, _ in shown], rows, note, is_sorted)


def cut(table: Table, most: int, where: str) -> Table:
    """Its first rows."""
    table.rows, more = first(table.rows, most, where)
    table.note = f"{table.note} {more}".strip()
    return table


def share(value: float | None, digits: int = 3, tone: str = "") -> Cell:
    """A part of 1, in percent."""
    return Cell(
        number_text(None if value is None else 100.0 * value, digits), float("inf") if value is None else value, "", tone, True
    )


def first(rows: Sequence[list[Cell]], most: int, where: str) -> tuple[list[list[Cell]], str]:
    """At most so many rows, and a note that says where the others are."""
    return list(rows[:most]), f"{len(rows) - most} more rows are in {where}." if len(rows) > most else ""
