"""nocdyn import FILE [--out machine.nml]: an input from a mass-elastic sheet (CSV) or from openTorsion (JSON)."""

import argparse
import os
import sys
from pathlib import Path

from nocdyn_import.machine import FILES, USAGE, SourceError
from nocdyn_import.sheet import read_sheet
from nocdyn_import.tors import read_tors

READERS = {".csv": read_sheet, ".txt": read_sheet, ".tsv": read_sheet, ".json": read_tors, ".tors": read_tors}


def main(words):
    arguments = parser().parse_args(words)
    source = Path(arguments.file)
    reader = READERS.get(source.suffix.lower())
    if reader is None:
        return refuse(
            [
                f"{source}: the ending {source.suffix or 'of this name'} is not known; "
                "allowed: .csv (a mass-elastic sheet), .json (openTorsion)"
            ]
        )
    out = Path(arguments.out) if arguments.out else source.with_suffix(".nml")
    if out.exists() and not arguments.force:
        return refuse([f"{out} exists; choose another name with --out, or overwrite it with --force"])
    try:
        machine = reader(source)
        text = machine.checked_text()
    except SourceError as failure:
        return refuse(failure.lines, failure.code)
    write(out, text)
    for note in machine.notes:
        print(f"{source}: note: {note}")
    print(f"{source}: {out} is written; nocdyn modes {out} --at rest looks at it")
    return 0


def parser():
    words = argparse.ArgumentParser(
        prog="nocdyn import",
        description="Writes an input from a mass-elastic sheet, a CSV file with a row for each station, "
        "or from a machine of openTorsion "
        "in JSON. What the source has and the input has not is told.",
    )
    words.add_argument("file", metavar="FILE", help="sheet (.csv) or machine of openTorsion (.json)")
    words.add_argument("--out", metavar="FILE.nml", help="the input; default: the name of FILE with the ending .nml")
    words.add_argument("--force", action="store_true", help="overwrite an input that exists")
    return words


def write(out, text):
    """The file appears whole or not at all."""
    aside = out.with_name(f".{out.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(out)
    except OSError:
        aside.unlink(missing_ok=True)
        raise


def refuse(lines, code=USAGE):
    for line in lines:
        print(f"nocdyn: {line}", file=sys.stderr)
    return code if code in (USAGE, FILES) else USAGE
