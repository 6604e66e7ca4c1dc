"""Breaks one constant of a law after the other in a copy of the sources, and tells which are caught by no verification case."""

import argparse
import csv
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COPY = ROOT / "build/mutants"
TABLE = Path(__file__).with_name("mutations.csv")
CAUGHT, MISSED, USAGE = 0, 1, 2  # exit codes
FAILED = 1  # of nocdyn verify: a case fails


@dataclass(frozen=True)
class Mutation:
    law: str
    file: str  # in src
    old: str  # once in the file
    new: str


def read_mutations(words):
    """Those whose law has one of the words; all without words."""
    with TABLE.open(newline="", encoding="utf-8") as file:
        mutations = [Mutation(**row) for row in csv.DictReader(file)]
    return [one for one in mutations if not words or any(word in one.law for word in words)]


def misplaced(mutations, root=ROOT):
    """Mutations whose text is not exactly once in its file."""
    return [one for one in mutations if (root / "src" / one.file).read_text(encoding="utf-8").count(one.old) != 1]


def copy_sources(folder):
    """The files of the repository; one that is the same keeps its time, so that it is not compiled again."""
    names = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    for name in names:
        source, target = ROOT / name, folder / name
        if not source.is_file() or (target.is_file() and target.read_bytes() == source.read_bytes()):
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)


def build(folder):
    """Whether the programs could be built."""
    if not (folder / "build/release/build.ninja").is_file():
        subprocess.run(["cmake", "--preset", "release", "-DBUILD_TESTING=OFF"], cwd=folder, check=True, capture_output=True)
    words = ["cmake", "--build", "--preset", "release", "--target", "nocdyn_program", "nocdyn_sweep_program"]
    return subprocess.run(words, cwd=folder, check=False, capture_output=True).returncode == 0


def failed_cases(folder):
    """The names of the cases that fail."""
    words = [sys.executable, "-m", "nocdyn_verify", "--quiet", "--out", str(folder / "build/verification")]
    setting = {"PYTHONPATH": str(folder / "scripts"), "NOCDYN": str(folder / "build/release/bin/nocdyn")}
    done = subprocess.run(words, env={**os.environ, **setting}, cwd=folder, check=False, capture_output=True, text=True)
    if done.returncode not in (0, FAILED):
        raise SystemExit(f"scripts/mutate: nocdyn verify: {done.stderr}")
    return re.findall(r"^(\w+\.[\w.]+): ", done.stderr, re.MULTILINE)


def is_caught(folder, mutation):
    """Whether a case fails; the text is put back whatever happens."""
    path = folder / "src" / mutation.file
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        if not build(folder):
            print(f"{mutation.law}: cannot be built", flush=True)
            return False
        failed = failed_cases(folder)
    finally:
        path.write_text(text, encoding="utf-8")
    more = f" and {len(failed) - 3} more" if len(failed) > 3 else ""
    print(f"{mutation.law}: {', '.join(failed[:3]) + more if failed else 'NOT CAUGHT'}", flush=True)
    return bool(failed)


def main(words):
    parser = argparse.ArgumentParser(prog="scripts/mutate", description=__doc__)
    parser.add_argument("law", nargs="*", help="only laws whose name has one of these words")
    parser.add_argument("--copy", type=Path, default=COPY, metavar="DIR", help="of the sources; default: build/mutants")
    arguments = parser.parse_args(words)
    mutations, folder = read_mutations(arguments.law), arguments.copy.resolve()
    wrong = misplaced(mutations)
    if not mutations:
        parser.error(f"there is no such law; those of {TABLE.name}: {', '.join(one.law for one in read_mutations([]))}")
    if wrong:
        parser.error(f"{TABLE.name}: the text is not once in its file: {', '.join(one.law for one in wrong)}")
    copy_sources(folder)
    if not build(folder) or failed_cases(folder):
        parser.error(f"{folder}: without a mutation it cannot be built, or a case fails")
    missed = [one.law for one in mutations if not is_caught(folder, one)]
    print(f"{len(mutations) - len(missed)} of {len(mutations)} mutations are caught", *missed, sep="\n  not: ")
    return MISSED if missed else CAUGHT


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
