"""Gives every table of a site that FORD has made a box of its own, in which it scrolls if it is wider than the page, and its
columns a width at which their texts can be read.

usage: wide_tables.py SITE

A column of numbers, names or a few words is never broken; in a column of sentences a line has at least some words.
"""

import html
import re
import sys
from pathlib import Path

TABLE = re.compile(r"<table>.*?</table>", re.DOTALL)
ROW = re.compile(r"<tr>.*?</tr>", re.DOTALL)
CELL = re.compile(r"<(t[hd])((?: [^>]*)?)>(.*?)</\1>", re.DOTALL)

FEW_WORDS, SENTENCE = 18, 60  # longest text of a column: up to so many characters it is not broken; from so many on it is wide
FEW, MANY = 3, 7  # tables of at most so many columns fit on a narrow screen; of so many they are set smaller


def length_of(cell):
    """Characters of a cell, about."""
    text = re.sub(r"<br ?/?>.*", "", cell, flags=re.DOTALL)
    return len(html.unescape(re.sub(r"<[^>]+>", "", text)).strip())


def kinds_of(table):
    """The class of each column by its longest text below the head: 'short', 'middle' or 'long'."""
    rows = [[length_of(cell) for _, _, cell in CELL.findall(row)] for row in ROW.findall(table)[1:]]
    longest = [max(column) for column in zip(*rows, strict=True)]
    return ["short" if one <= FEW_WORDS else "middle" if one < SENTENCE else "long" for one in longest]


def boxed(table):
    """The table in its box, with the classes of its columns."""
    kinds = kinds_of(table)
    size = " few" if len(kinds) <= FEW else " many" if len(kinds) >= MANY else ""

    def marked(row):
        columns = iter(kinds)
        return CELL.sub(lambda cell: f'<{cell[1]}{cell[2]} class="{next(columns)}">{cell[3]}</{cell[1]}>', row)

    return f'<div class="table-box{size}" tabindex="0">{ROW.sub(lambda row: marked(row[0]), table)}</div>'


def main(site):
    for page in (site / "page").glob("*.html"):
        text = page.read_text(encoding="utf-8")
        page.write_text(TABLE.sub(lambda table: boxed(table[0]), text), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
