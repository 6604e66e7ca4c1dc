"""What has changed since another revision."""

import difflib
from pathlib import Path

from ..content import Block, Listing, Paragraph, Section, Table, by_columns, cut, share, text
from ..readable import texts
from ..result_files import ResultFiles
from ..revisions import changes, key_numbers, verdict_changes
from ..sources import Sources
from ..verdict import Line, sentence, verdict_lines
from .summary import TONES

MOST_ROWS = 60
MOST_LINES = 120  # of the changes of the input


def changes_section(sources: Sources, old: ResultFiles) -> Section:
    section = Section("changes", "Changes since the other revision")
    lines = verdict_lines(old)
    section.add(Paragraph(f"Compared with the results in {old.folder}. The verdict there: {sentence(lines)[0]}"))
    section.add(*_verdict(sources, lines), *_numbers(sources, old))
    listing = _input(sources, old)
    return section.add_details(listing) if listing else section


def _verdict(sources: Sources, lines: list[Line]) -> list[Block]:
    pairs = verdict_changes(lines, sources.verdict)
    if not pairs:
        return [Paragraph("Every line of the verdict is the same.")]
    known = [new or old for old, new in pairs]
    columns = [
        ("load case", texts([", ".join(filter(None, one.cases)) for one in known])),
        ("element", texts([one.element for one in known])),
        ("criterion", texts([one.named_criterion for one in known])),
    ]
    for head, place in (("old", 0), ("new", 1)):
        mine = [pair[place] for pair in pairs]
        values = [sources.units.amount(one.value, one.unit, like=one.limit) if one else "" for one in mine]
        limits = [sources.units.amount(one.limit, one.unit) if one else "" for one in mine]
        columns.append((f"{head} value, limit", texts([f"{a}, {b}" if a else "" for a, b in zip(values, limits)])))
        told = [(one.assessment if place else one.finding) if one else "no such line" for one in mine]
        columns.append((f"{head} finding", [text(word, TONES[one.finding] if one else "") for word, one in zip(told, mine)]))
    table = by_columns("Lines of the verdict that are not the same", columns)
    table.rows = list({tuple(cell.text for cell in row): row for row in table.rows}.values())  # load cases with equal lines
    return [cut(table, MOST_ROWS, "the files of the results")]


def _numbers(sources: Sources, old: ResultFiles) -> list[Block]:
    before, after = key_numbers(old), key_numbers(sources.results.files)
    found = changes(before, after)
    total = len({*before, *after})
    told = f"{total - len(found)} of {total} natural frequencies, critical speeds and largest values are the same to four digits."
    blocks: list[Block] = [Paragraph(told)]
    for unit in dict.fromkeys(one.unit for one in found):
        mine = [one for one in found if one.unit == unit]
        head, cells = sources.units.column("", unit, [value for one in mine for value in (one.old, one.new)])
        columns = [
            ("what", texts([one.sort for one in mine])),
            ("of", texts([one.name for one in mine])),
            (f"old{head}", cells[::2]),
            (f"new{head}", cells[1::2]),
            ("change [%]", [share(one.ratio) for one in mine]),
        ]
        table: Table = by_columns(f"Numbers that are not the same{head}", columns)
        blocks.append(cut(table, MOST_ROWS, "the files of the results"))
    return blocks


def _input(sources: Sources, old: ResultFiles) -> Listing | None:
    """The lines of the complete input that differ, if both runs have left it."""
    texts_of = [_text(old), _text(sources.results.files)]
    if not all(texts_of):
        return None
    lines = list(difflib.unified_diff(*(one.splitlines() for one in texts_of), lineterm="", n=2))[2:]
    if not lines:
        return None
    more = f" (the first {MOST_LINES} of {len(lines)} lines)" if len(lines) > MOST_LINES else ""
    return Listing(f"Changes of the complete input, - old, + new{more}", "\n".join(lines[:MOST_LINES]))


def _text(files: ResultFiles) -> str:
    there = files.there("run")
    file = there[0].folder / "input.nml" if there else Path()
    return file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
