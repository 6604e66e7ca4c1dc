"""Makes a report on a machine: runs what is missing, and writes report.html and report.pdf beside the results."""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from .calculations import FAILED, Calculations, calculate
from .confined import Folder
from .content import Section
from .failure import FILES, ReportError
from .notes_text import read_notes
from .page import render
from .pdf import find_browser, print_pdf
from .program import find_program
from .revisions import former, results_of_revision
from .sections.appendix import details_section, input_section
from .sections.campbell import campbell_section
from .sections.changes import changes_section
from .sections.energy import energy_section
from .sections.fatigue import fatigue_section
from .sections.machine import data_section, machine_section
from .sections.modes import modes_section
from .sections.motion import motion_section
from .sections.orbit import orbit_section
from .sections.remarks import notes_section, remarks_section
from .sections.response import response_section
from .sections.scope import scope_section
from .sections.steady import steady_section
from .sections.summary import summary_section
from .sections.transit import transit_section
from .sources import NOTES_FILE, Sources

PAGE, PDF = "report.html", "report.pdf"


def main(words: Sequence[str] | None = None) -> None:
    arguments = _parser().parse_args(words)
    try:
        sys.exit(_make(arguments))
    except ReportError as error:
        message = str(error) if str(error).startswith("nocdyn: ") else f"nocdyn report: {error}"
        print(message, file=sys.stderr)
        sys.exit(error.code)
    except OSError:  # the caller tells it, with the file or the output
        raise
    except Exception as error:  # a traceback helps nobody at the keyboard
        place = error.__traceback__
        while place.tb_next:
            place = place.tb_next
        where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}"
        print(
            f"nocdyn report: a mistake in this script, please report it: {type(error).__name__}: {error} ({where})",
            file=sys.stderr,
        )
        sys.exit(FAILED)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="nocdyn report", description=__doc__)
    parser.add_argument("file", metavar="FILE", help="input file")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the results (results/<name of the file>)")
    parser.add_argument(
        "--set", action="append", default=[], metavar="PATH=VALUE", help="override a key of the input, as for nocdyn run"
    )
    parser.add_argument("--no-pdf", action="store_true", help="write report.html only; Chromium is not needed")
    parser.add_argument(
        "--allow-outside", action="store_true", help="take notes, pictures and tables from other folders than that of FILE"
    )
    parser.add_argument("--against", type=Path, metavar="DIR", help="tell the changes since the revision whose results are there")
    parser.add_argument("--quiet", "-q", action="store_true", help="print nothing but errors")
    return parser


def _make(arguments: argparse.Namespace) -> int:
    """Returns the exit code."""
    tell: Callable[[str], None] = (lambda line: None) if arguments.quiet else lambda line: print(f"  {line}", flush=True)
    if Path(arguments.file).exists() and not Path(arguments.file).is_file():  # a pipe has its text once
        raise ReportError(f"{arguments.file}: is no file; the report shows the text of the input", FILES)
    program = find_program()
    if not arguments.no_pdf:
        find_browser()
    if arguments.against:
        results_of_revision(arguments.against)
    results = calculate(program, arguments.file, arguments.out, arguments.set, tell)
    sources = Sources(results, _text(arguments.file), arguments.set)
    page = render(sources, list(_sections(sources, arguments)))
    written = _write(results.folder, page, arguments.no_pdf)
    if not arguments.quiet:
        print(f"{arguments.file}: {results.folder} has {' and '.join(written)}")
    return _code(results)


def _text(file: str) -> str:
    return Path(file).read_text(encoding="utf-8", errors="replace")


def _sections(sources: Sources, arguments: argparse.Namespace) -> list[Section]:
    made = [make(sources) for make in (machine_section, steady_section, data_section, modes_section, campbell_section)]
    made += [make(sources) for make in (response_section, transit_section, orbit_section, motion_section)]
    made += [make(sources) for make in (energy_section, fatigue_section)]
    there = [section for section in made if section is not None]
    folder = Folder(Path(arguments.file).parent, arguments.allow_outside)
    remarks = remarks_section(_notes(sources, arguments.file, folder))
    body = [section for section in there if section.blocks]
    changed = [changes_section(sources, former(arguments.against, sources.results.folder))] if arguments.against else []
    body = [summary_section(sources), *changed, *([remarks] if remarks else []), *body]
    appendices = [notes_section(sources), scope_section(sources, there), input_section(sources, arguments.set, folder)]
    return [*body, *details_section([*changed, *there]), *appendices]


def _notes(sources: Sources, file: str, folder: Folder) -> str:
    """The HTML of the author's text; the file is in the folder of the input."""
    name = sources.notes_file
    if not name:
        return ""
    found = NOTES_FILE.search(sources.text)
    line = sources.text.count("\n", 0, found.end()) + 1 if found else 1
    return read_notes(folder, name, f"{file}:{line}: &case: notes_file")


def _write(folder: Path, page: str, no_pdf: bool) -> list[str]:
    """Both files get their names when both are complete; a PDF of an earlier report does not stay beside another page."""
    asides = {name: folder / f".{os.getpid()}.{name}" for name in (PAGE, PDF)}
    try:
        asides[PAGE].write_text(page, encoding="utf-8")
        if not no_pdf:
            print_pdf(asides[PAGE], asides[PDF])
        (folder / PDF).unlink(missing_ok=True)
        os.replace(asides[PAGE], folder / PAGE)
        if not no_pdf:
            os.replace(asides[PDF], folder / PDF)
    except OSError as error:
        raise ReportError(f"{folder / PAGE}: cannot be written: {error.strerror}", FILES) from None
    finally:
        for aside in asides.values():
            aside.unlink(missing_ok=True)
    return [PAGE] if no_pdf else [PAGE, PDF]


def _code(results: Calculations) -> int:
    """That of a run that failed: its report says so."""
    run = results.of["run"]
    if run.state != "failed":
        return 0
    print("\n".join(f"nocdyn: {line}" for line in run.message.splitlines()), file=sys.stderr)
    return FAILED
