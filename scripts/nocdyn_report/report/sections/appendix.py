"""Further results, and the input as text, with the tables that it reads."""

import re
from statistics import median

from ..confined import Folder
from ..content import Heading, Items, Listing, Paragraph, Section
from ..failure import ReportError
from ..sources import Sources

TABLE = re.compile(r"""^[^!\n]*?\b(?!notes_file)\w+_file\s*=\s*(?:'([^'\n]*)'|"([^"\n]*)")""", re.MULTILINE | re.IGNORECASE)
MOST_OF_INPUT = 500  # lines
MOST_LINES = 300  # of a table
MOST_BYTES = 1_000_000  # likewise
NARROW = 40  # characters in a line of a table that has room beside others


def details_section(sections: list[Section]) -> list[Section]:
    """What is too long for the sections; none if there is nothing."""
    section = Section("details", "Further results", is_appendix=True)
    for one in sections:
        if one.details:
            first = one.details[0]
            section.add(*([] if isinstance(first, Heading) else [Heading(one.title, f"more-{one.id}")]), *one.details)
    return [section] if section.blocks else []


def input_section(sources: Sources, overrides: list[str], folder: Folder) -> Section:
    section = Section("input", "Input", is_appendix=True)
    lines = sources.text.splitlines(keepends=True)
    section.add(Listing(f"{sources.check['input']}, as it was read", "".join(lines[:MOST_OF_INPUT])))
    if len(lines) > MOST_OF_INPUT:
        section.add(Paragraph(f"{len(lines) - MOST_OF_INPUT} more lines are in the file; report.html has the complete input."))
    if overrides:
        section.add(Items([f"--set {one}" for one in overrides]))
    for name in dict.fromkeys(one or other for one, other in TABLE.findall(sources.text)):
        section.add(_table(folder, name))
    section.add(Listing("Complete input, defaults and tables included", sources.check["complete_input"], is_folded=True))
    return section


def _table(folder: Folder, name: str) -> Listing | Paragraph:
    try:
        lines = folder.read(folder.folder, name, name, MOST_BYTES).decode("utf-8", errors="replace").splitlines()
    except ReportError:
        return Paragraph(f"{name} is in the complete input.")
    if len(lines) > MOST_LINES:
        return Paragraph(f"{name} has {len(lines)} lines; its values are in the complete input.")
    is_narrow = bool(lines) and median(map(len, lines)) <= NARROW
    return Listing(f"{name}, which the input reads", "\n".join(lines), is_narrow=is_narrow)
