"""What a report consists of: sections with paragraphs, lists of facts, tables, figures, text."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from .numbers import name_and_unit, number_text, unit_text


@dataclass(frozen=True)
class Cell:
    """What a table shows, by what it is sorted, and where a link leads."""

    text: str
    key: float | str = ""
    link: str = ""
    tone: str = ""  # 'good', 'bad', 'warn'
    is_number: bool = False


@dataclass
class Table:
    caption: str
    columns: list[str]  # 'frequency [Hz]'
    rows: list[list[Cell]]
    note: str = ""
    is_sorted: bool = True  # whether the reader may sort it
    kind: str = "table"
    number: int = 0  # in the report, as the id
    id: str = ""

    @property
    def heads(self) -> list[tuple[str, str, bool]]:
        """Name, unit, whether there are numbers below."""
        named = (name_and_unit(column) for column in self.columns)
        numbers = [any(row[i].is_number for row in self.rows) for i in range(len(self.columns))]
        return [(name, unit_text(unit), is_number) for (name, unit), is_number in zip(named, numbers)]


@dataclass
class Figure:
    """Curves; `spec` is what assets/figures.js draws."""

    caption: str
    text: str  # alternative to the picture
    spec: dict
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


@dataclass
class Section:
    id: str
    title: str
    blocks: list[Block] = field(default_factory=list)
    is_appendix: bool = False
    number: str = ""

    def add(self, *blocks: Block) -> "Section":
        self.blocks.extend(blocks)
        return self


def text(value: object, tone: str = "", link: str = "") -> Cell:
    return Cell(str(value), str(value).lower(), link, tone)


def number(value: object, digits: int = 5, tone: str = "") -> Cell:
    """A number with its digits; what is no finite number sorts last."""
    key = float(value) if isinstance(value, (int, float)) else float("inf")
    return Cell(number_text(value, digits), key, "", tone, True)


NOISE = 1e-9  # of the largest number of a sort: what rounding leaves of a zero, as the program prints it too


def rounded(values: dict[str, float], sorts: dict[str, str]) -> dict[str, float]:
    """Numbers by names; what is rounding beside the largest one of its sort (unit) is 0."""
    largest: dict[str, float] = {}
    for name, value in values.items():
        largest[sorts[name]] = max(largest.get(sorts[name], 0.0), abs(value))
    return {name: value if abs(value) > NOISE * largest[sorts[name]] else 0 for name, value in values.items()}


def share(value: float | None, digits: int = 3, tone: str = "") -> Cell:
    """A part of 1, in percent."""
    return Cell(
        number_text(None if value is None else 100.0 * value, digits), float("inf") if value is None else value, "", tone, True
    )


def first(rows: Sequence[list[Cell]], most: int, where: str) -> tuple[list[list[Cell]], str]:
    """At most so many rows, and a note that says where the others are."""
    return list(rows[:most]), f"{len(rows) - most} more rows are in {where}." if len(rows) > most else ""
