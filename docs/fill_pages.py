"""Fills the places of the pages that quote files, outputs and measurements.

usage: fill_pages.py [--examples DIR] [--tables DIR] [--bench DIR] [PAGE]...

A place lies between <!-- fill: WHAT --> and <!-- filled -->, where WHAT is

  file PATH         a source, always filled
  run NAME          what the example NAME of docs/examples prints; filled with --examples, the folder of the programs
  table NAME N      table N of NAME.md; filled with --tables, the folder of these files
  bench TITLE       the section of bench.md whose title begins so; filled with --bench, the folder of scripts/bench
  bench             what stands before the sections
  picture NAME      the same folder's picture NAME.svg, copied to docs/media

Without pages: README.md and all of docs/pages. Names the pages that it changes.
Exit codes: 0 done, 1 something asked for is not there.
"""

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PLACE = re.compile(r"<!-- fill: (\w+)(?: ([^\n]+))? -->\n.*?<!-- filled -->", re.DOTALL)
LANGUAGES = {".f90": "fortran", ".nml": "fortran", ".py": "python", ".txt": "cmake"}
VERDICT = re.compile(r".*\*\*(?:reached|missed)\*\*.*\n*")


class MissingError(Exception):
    """A file, a table or a section that a page asks for."""


def quoted_file(name):
    file = ROOT / name
    if not file.exists():
        raise MissingError(file)
    return f"```{LANGUAGES[file.suffix]}\n{file.read_text(encoding='utf-8')}```"


def quoted_run(name, folder):
    if not (folder / name).exists():
        raise MissingError(folder / name)
    said = subprocess.run([folder / name], check=True, capture_output=True, text=True).stdout
    return f"```text\n$ build/{name}\n{said}```"


def table(argument, folder):
    name, number = argument.split()
    file = folder / f"{name}.md"
    if not file.exists():
        raise MissingError(file)
    tables = re.findall(r"^\|.*(?:\n\|.*)*", file.read_text(encoding="utf-8"), re.MULTILINE)
    if int(number) > len(tables):
        raise MissingError(f"table {number} in {file}")
    return tables[int(number) - 1]


def section_of_bench(title, folder):
    file = folder / "bench.md"
    if not file.exists():
        raise MissingError(file)
    head, *sections = re.split(r"^## ", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
    if not title:
        return head.partition("\n")[2].strip()
    for section in sections:
        name, _, text = section.partition("\n")
        if name.startswith(title):
            return f"*{name}*\n\n{VERDICT.sub('', text).strip()}"
    raise MissingError(f"section {title} in {file}")


def picture(name, folder):
    file = folder / f"{name}.svg"
    if not file.exists():
        raise MissingError(file)
    shutil.copy(file, ROOT / "docs" / "media" / file.name)
    return f"![{name.replace('_', ' ')}](../media/{file.name})"


def filled(text, examples=None, tables=None, bench=None):
    """The text with the places filled whose sources are given; the others stay as they are."""

    def fill(place):
        what, argument = place.groups(default="")
        source = {"file": ROOT, "run": examples, "table": tables, "bench": bench, "picture": bench}[what]
        if source is None:
            return place[0]
        content = {
            "file": lambda name, _: quoted_file(name),
            "run": quoted_run,
            "table": table,
            "bench": section_of_bench,
            "picture": picture,
        }[what](argument, source)
        return f"<!-- fill: {f'{what} {argument}'.strip()} -->\n\n{content}\n\n<!-- filled -->"

    return PLACE.sub(fill, text)


def main():
    parser = argparse.ArgumentParser(prog="fill_pages.py", description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    for option in ("--examples", "--tables", "--bench"):
        parser.add_argument(option, type=Path)
    parser.add_argument("pages", nargs="*", type=Path)
    arguments = parser.parse_args()
    for page in arguments.pages or [ROOT / "README.md", *sorted((ROOT / "docs" / "pages").glob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        try:
            new = filled(text, arguments.examples, arguments.tables, arguments.bench)
        except MissingError as missing:
            sys.exit(f"{page.name}: there is no {missing}")
        if new != text:
            page.write_text(new, encoding="utf-8")
            print(f"{page.name}: changed")


if __name__ == "__main__":
    main()
