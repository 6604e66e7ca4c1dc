"""The commands that pages show with their output.

usage: sessions.py NOCDYN PAGE...

In a block of code, a line that begins with '$ ' is a command; the lines up to the next one are its output. The commands of
a page run in the order of the page, in a new folder that has the project's folders docs and input in it. This script
runs them with the program NOCDYN and writes their output into the pages.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"^```(?:text)?\n(\$ .*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
TIME = re.compile(r"[\d.e+-]+(?= (?:ms|s|per second)\b)")
NUMBER = re.compile(r"[+-]?\d[\d.]*(?:[eE][+-]?\d+)?")
PROGRESS = re.compile(r"^.* variants, .* left\n", re.MULTILINE)  # lines of a sweep that takes more than 10 s
SAME = {"relative": 1e-4, "absolute": 1e-8}  # the output has seven digits; sums that should be 0 are rounding errors


def sessions_of(page):
    """The commands of a page, each with the output that stands below it."""
    return [command for block in BLOCK.findall(page.read_text(encoding="utf-8")) for command in COMMAND.findall(block)]


def make_folder(folder, nocdyn):
    """The folder in which the commands of a page run; the environment that they need."""
    for name in ("docs", "input"):
        (folder / name).symlink_to(ROOT / name)
    path = f"{Path(nocdyn).resolve().parent}:{Path(sys.executable).parent}:{os.environ['PATH']}"
    return os.environ | {"PATH": path, "NOCDYN_PYTHON": sys.executable}


def output_of(command, folder, environment):
    """What a command prints, on both streams."""
    done = subprocess.run(
        ["bash", "-c", command],
        cwd=folder,
        env=environment,
        text=True,
        check=False,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        stdin=subprocess.DEVNULL,
    )
    return PROGRESS.sub("", done.stdout)


def is_same(shown, seen):
    """Whether two outputs have the same words, and numbers that differ by rounding at most; times do not count."""
    shown, seen = TIME.sub("TIME", shown), TIME.sub("TIME", seen)
    if NUMBER.sub("#", shown).split() != NUMBER.sub("#", seen).split():
        return False
    pairs = zip(map(float, NUMBER.findall(shown)), map(float, NUMBER.findall(seen)))
    return all(abs(a - b) <= max(SAME["absolute"], SAME["relative"] * abs(a)) for a, b in pairs)


def main(nocdyn, *pages):
    for page in map(Path, pages):
        text = page.read_text(encoding="utf-8")
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            environment = make_folder(folder, nocdyn)
            for command, shown in sessions_of(page):
                seen = output_of(command, folder, environment)
                if not is_same(shown, seen):
                    print(f"{page}: $ {command}\n{seen}", end="")
                    text = text.replace(f"$ {command}\n{shown}", f"$ {command}\n{seen}", 1)
        page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
