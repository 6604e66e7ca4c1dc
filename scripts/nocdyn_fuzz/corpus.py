"""What is mutated: every input of the repository with its tables, and what can stand in an input."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
FOLDERS = ("input", "tests/program/data", "tests/sanitize", "docs/tutorial")

# A sweep over a list, of which there is none among the shipped ones.
LISTED = b"""\
&body     name = 'disc'  inertia = 2.0  speed = 1.0 /
&body     name = 'wheel' inertia = 1.0 /
&coupling name = 'shaft' bodies = 'disc', 'wheel' stiffness = 40.0 damping = 0.2 /
&load     name = 'drag'  body = 'wheel' viscous = 0.5 /
&run      t_end = 2.0 /
&output   points = 11 /
&sweep    design = 'list' file = 'list.csv' /
&record   quantity = 'omega_wheel' statistic = 'final', 'max' /
&record   trajectories = 1, 3 /
"""
LIST = b"# what differs\ncoupling.shaft.stiffness, load.drag.viscous\n20, 0.2\n30, 0.3\n40, 0.4\n"

GROUP = re.compile(rb"&(\w+)(?:'[^'\n]*'|\"[^\"\n]*\"|![^\n]*|[^/'\"!])*/")
KEY = re.compile(rb"\b([a-z]\w*)\s*(?:\([\d:]*\))?\s*=(?!=)", re.IGNORECASE)
VALUE = re.compile(rb"\b([a-z]\w*)\s*=\s*((?:'[^'\n]*'|[^'&/!=\n]*?)(?:\s*,\s*(?:'[^'\n]*'|[-+.\w]+))*)(?=\s*(?:/|!|\n|\w+\s*=))")
NAME = re.compile(rb"\bname\s*=\s*'([^'\n]*)'")
QUOTED = re.compile(rb"'[^'\n]*'")


@dataclass(frozen=True)
class Case:
    """Files, and the words of a command that is run in their folder."""

    files: dict[str, bytes]
    words: tuple[str, ...]
    main: str = ""  # the input among the files
    changes: tuple[str, ...] = field(default=())  # what the mutations did

    def with_file(self, name, content, change=None):
        return replace(self, files=self.files | {name: content}, changes=self.changes + ((change,) if change else ()))

    def with_words(self, words, change=None):
        return replace(self, words=tuple(words), changes=self.changes + ((change,) if change else ()))


@dataclass(frozen=True)
class Corpus:
    """The inputs, and the words that occur in them."""

    cases: list[Case]
    groups: list[bytes]  # whole groups
    keys: list[bytes]
    settings: list[bytes]  # KEY = VALUE
    texts: list[bytes]  # words in quotes


def settings_of(group):
    """Pairs of key and value."""
    return [(key, value) for key, value in VALUE.findall(group) if value]


def paths(content):
    """What --set can name: group.key, group.name.key."""
    found = []
    for match in GROUP.finditer(content):
        name = NAME.search(match[0])
        middle = [name[1].decode(errors="replace")] if name else []
        kind = match[1].decode(errors="replace")
        found += [
            (".".join([kind, *middle, key.decode()]), value.decode(errors="replace")) for key, value in settings_of(match[0])
        ]
    return found


def with_tables(path):
    """The input and the tables that it names, in one folder."""
    content = path.read_bytes()
    files = {}
    for name in re.findall(r"(?:table_file|file)\s*=\s*'([^']*)'", content.decode()):
        table = path.parent / name
        if table.is_file():
            files[table.name] = table.read_bytes()
            content = content.replace(name.encode(), table.name.encode())
    return Case(files={path.name: content} | files, words=(), main=path.name)


def read_corpus():
    """Everything that the repository ships; the same in each call."""
    found = sorted(path for folder in FOLDERS for path in (SOURCE / folder).rglob("*.nml"))
    cases = [with_tables(path) for path in found]
    cases.append(Case(files={"listed.nml": LISTED, "list.csv": LIST}, words=(), main="listed.nml"))
    groups = sorted({match[0] for case in cases for match in GROUP.finditer(case.files[case.main])})
    settings = sorted({key + b" = " + value for group in groups for key, value in settings_of(group)})
    return Corpus(
        cases=cases,
        groups=groups,
        keys=sorted({key for group in groups for key in KEY.findall(group)}),
        settings=settings,
        texts=sorted({text for group in groups for text in QUOTED.findall(group)}),
    )
