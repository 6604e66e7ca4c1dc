"""A machine on its way from another format to a namelist: groups that know where in the source they come from."""

import re
import subprocess
import tempfile
from pathlib import Path

from nocdyn_report.executable import find_executable

USAGE, FILES = 2, 3  # exit codes: wrong input; a file cannot be read or written
LONGEST_NAME = 63  # bytes, as nocdyn has it
COMPLAINT = re.compile(r"^(?:nocdyn: )?(?:.*?):(\d+): (?:&\w+(?: '[^']*')?: )?(.*)$")


class SourceError(Exception):
    """What is wrong with the source, one line each."""

    def __init__(self, lines, code=USAGE):
        super().__init__("\n".join(lines))
        self.lines, self.code = lines, code


class Quantity(str):
    """A number as the source writes it, with its unit: written as a text, which nocdyn converts."""

    __slots__ = ()


class Machine:
    """Groups of an input, one on a line."""

    def __init__(self, source, title):
        self.source = source
        self.lines = [f"! Imported from {Path(source).name} by nocdyn import."]
        self.origins = {}  # number of a line of the input -> place in the source, {key: what it is called there}
        self.notes = []
        self.add(None, "case", {}, title=title)

    def add(self, place, group, called, remark="", /, **keys):
        """Adds a group with those keys that have a value."""
        text = "  ".join(f"{key} = {literal(value)}" for key, value in keys.items() if value not in (None, "", []))
        self.lines.append(f"&{group:8} {text} /" + (f"  ! {remark}" if remark else ""))
        self.origins[len(self.lines)] = (place, called)

    def note(self, text):
        if text not in self.notes:
            self.notes.append(text)

    def own_name(self, text, taken, default):
        """A name that nocdyn takes; another one than the source has is told."""
        name = plain_name(text, taken, default)
        if name != text.strip():
            self.note(f"{text.strip()!r} is named {name!r}")
        return name

    def text(self):
        return "".join(f"{line}\n" for line in [*self.lines, "&run      t_end = 1.0 /  ! seconds; choose what is to be computed"])

    def checked_text(self):
        """The input, if nocdyn accepts it; else what is wrong, in places of the source."""
        with tempfile.TemporaryDirectory(prefix="nocdyn_") as folder:
            file = Path(folder) / "imported.nml"
            file.write_text(self.text(), encoding="utf-8")
            executable = find_executable()
            if executable is None:
                raise SourceError(["the program nocdyn is not found; the environment variable NOCDYN can name it"], FILES)
            done = subprocess.run([executable, "modes", str(file), "--at", "rest"], capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return self.text()
        raise SourceError(unique(self.in_source(line) for line in done.stderr.splitlines()), done.returncode)

    def in_source(self, line):
        """A message on the input as one on the source."""
        found = COMPLAINT.match(line)
        place, called = self.origins.get(int(found[1]), (None, {})) if found else (None, {})
        if not found or place is None:
            return f"{self.source}: " + re.sub(r"^nocdyn: (\S*imported\.nml)?(:\d+)?:? ?", "", line)
        key = re.match(r"\w+", found[2])[0] if re.match(r"\w+", found[2]) else ""
        column = f"{called[key]}: " if key in called else ""
        return f"{place}: {column}{found[2]}"


def unique(lines):
    """The first of messages that differ in place and value only."""
    seen = {}
    for line in lines:
        seen.setdefault(re.sub(r"^(\S+?):\d+|= '[^']*'", "", line), line)
    return list(seen.values())


def literal(value):
    if isinstance(value, bool):
        return ".true." if value else ".false."
    if isinstance(value, list | tuple):
        return ", ".join(map(literal, value))
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    return repr(value)


def plain_name(text, taken, default):
    """A name that nocdyn takes: without commas, semicolons, equals signs, quotes and tabs, and like no other."""
    name = " ".join(re.sub(r"[,;='\"\t\n]", " ", text).split()) or default
    while len(name.encode()) > LONGEST_NAME - 4:
        name = name[:-1]
    if name == "ground":
        name = "ground wheel"
    chosen, number = name, 1
    while chosen in taken:
        number += 1
        chosen = f"{name} {number}"
    taken.add(chosen)
    return chosen
