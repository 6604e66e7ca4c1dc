"""Runs the verification cases with the installed program, and writes verification.html, .pdf and .json."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from nocdyn_report.executable import find_executable

from .cases import RELEASED, chosen, read_cases, read_released, write_released
from .failure import FAILED, VerificationError
from .outcomes import Installation, Outcome, installation, verify, write_json
from .page import verdict, write_page
from .paper import write_paper

CASES = Path(__file__).resolve().parents[2] / "verification"  # of the sources, or of what is installed
NAME = "verification"


def read_arguments(words: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="nocdyn verify", description=__doc__)
    parser.add_argument("chosen", nargs="*", metavar="CASE", help="only these cases, or those of these features")
    parser.add_argument("--out", type=Path, default=Path("results"), metavar="DIR", help="write to DIR; default: results")
    parser.add_argument("--cases", type=Path, metavar="DIR", help="cases of one's own: a folder like that of the program")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), metavar="NUMBER")
    parser.add_argument("--keep", action="store_true", help=f"write the values to {RELEASED} beside the cases, at a release")
    parser.add_argument("--quiet", action="store_true", help="print nothing but errors and failed cases")
    arguments = parser.parse_args(words)
    if arguments.threads < 1:
        parser.error(f"--threads {arguments.threads}: allowed: 1 or more")
    if arguments.keep and arguments.chosen:
        parser.error("--keep keeps the values of all cases, not of chosen ones")
    return arguments


def find_program() -> Path:
    """The program that is verified."""
    found = find_executable()
    if found is None:
        raise VerificationError("there is no program nocdyn in the PATH")
    return found


def find_cases(wanted: Path | None) -> Path:
    place = wanted or CASES
    if not place.is_dir():
        raise VerificationError(f"{place}: the folder of the verification cases does not exist")
    return place


def prepare(folder: Path) -> Path:
    """The file in a folder that results are written to before they get their names; refused before anything is computed."""
    part = folder / f"{NAME}.part"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        part.touch()
        part.unlink()
    except OSError as error:
        raise VerificationError(f"{folder}: cannot be written: {error.strerror}") from None
    return part


def write_results(part: Path, machine: Installation, outcomes: Sequence[Outcome], version: str) -> None:
    """All files, each whole or not at all."""
    try:
        part.write_text(write_page(machine, outcomes, version), encoding="utf-8")
        part.replace(part.with_suffix(".html"))
        write_paper(part, machine, outcomes, version)
        part.replace(part.with_suffix(".pdf"))
        write_json(part, machine, outcomes)
        part.replace(part.with_suffix(".json"))
    except OSError as error:
        part.unlink(missing_ok=True)
        raise VerificationError(f"{part.parent}: cannot be written: {error.strerror}") from None


def tell(outcomes: Sequence[Outcome]) -> None:
    """The cases that fail."""
    for one in outcomes:
        if not one.passes:
            reason = one.problem or f"{one.computed:.15g}, expected {one.case.expected:.15g} {one.case.unit}"
            print(f"{one.case.id}: {one.case.quantity}: {reason}", file=sys.stderr)


def main(words: Sequence[str]) -> int:
    arguments = read_arguments(words)
    try:
        program, folder = find_program(), find_cases(arguments.cases)
        version, released = read_released(folder)
        cases = chosen(read_cases(folder), arguments.chosen)
        part = prepare(arguments.out)
        machine = installation(program, folder, cases)
        outcomes = verify(program, folder, cases, released, arguments.threads)
        write_results(part, machine, outcomes, version)
        tell(outcomes)
        code = 0 if all(one.passes for one in outcomes) else FAILED
        if arguments.keep and code == 0:
            write_released(folder, machine.version, {one.case.id: one.computed for one in outcomes})
    except VerificationError as error:
        print(f"nocdyn: verify: {error}", file=sys.stderr)
        return error.code
    if not arguments.quiet:
        kept = f" {folder / RELEASED} has the values of {machine.version}." if arguments.keep and code == 0 else ""
        print(f"{verdict(outcomes)} {arguments.out} has {NAME}.html, {NAME}.pdf and {NAME}.json.{kept}")
    return code


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
