"""Reads Fortran sources in free form: procedures, their arguments, their comments."""

import re
from dataclasses import dataclass, field
from pathlib import Path

PARENTHESES = r"\([^()]*(?:\([^()]*\)[^()]*)*\)"
KINDS = rf"(?:type|class|real|integer|logical|character|complex)\s*(?:{PARENTHESES})?"
PREFIX = rf"(?:(?:pure|impure|elemental|recursive|non_recursive|module|{KINDS})\s+)*"
START = re.compile(rf"^{PREFIX}(?:subroutine|function)\s+(\w+)\s*(?:\(([^)]*)\))?", re.IGNORECASE)
END = re.compile(r"^end\s*(?:subroutine|function)\b", re.IGNORECASE)
INTERFACE = re.compile(r"^(?:abstract\s+)?interface\b", re.IGNORECASE)
END_INTERFACE = re.compile(r"^end\s*interface\b", re.IGNORECASE)
TYPE = re.compile(r"^type(?:\s*,[^:]*)?\s*(?:::)?\s*(?!is\b)(\w+)$", re.IGNORECASE)
END_TYPE = re.compile(r"^end\s*type\b", re.IGNORECASE)
BINDING = re.compile(r"^procedure\b\s*(?:\((\w+)\))?([^:]*)::\s*(.*)$", re.IGNORECASE)
PUBLIC = re.compile(r"^public\s*(?:::)?\s*(.+)$", re.IGNORECASE)
DECLARATION = re.compile(rf"^([a-z]+\s*(?:{PARENTHESES})?)((?:\s*,\s*\w+\s*(?:{PARENTHESES})?)*)\s*::\s*(.*)$", re.IGNORECASE)
NAME_IN_LIST = re.compile(rf"(\w+)\s*(?:{PARENTHESES})?(?:\s*=>?[^,]*)?(?:,|$)")


@dataclass(frozen=True)
class Statement:
    """One statement; a continued one is joined."""

    line: int  # the first one, from 0
    last: int
    code: str  # without comments and without the contents of character literals
    comment: str  # those of all its lines


@dataclass
class Argument:
    name: str
    declaration: str = ""  # type and attributes
    comment: str = ""  # that of FORD, which begins with two exclamation marks

    @property
    def is_real(self) -> bool:
        return self.declaration.lower().startswith("real")


@dataclass
class Procedure:
    file: Path
    name: str
    arguments: list[Argument]
    first: int
    doc: str  # the comment above it
    host: "Procedure | None"
    is_interface: bool
    last: int = 0
    inner_lines: int = 0  # those of its internal procedures

    @property
    def lines(self) -> int:
        """From the first statement to the last, without internal procedures."""
        return self.last - self.first + 1 - self.inner_lines


@dataclass
class Source:
    path: Path
    lines: list[str]
    procedures: list[Procedure] = field(default_factory=list)
    public: set[str] = field(default_factory=set)  # names that the module exports
    bindings: dict[str, str] = field(default_factory=dict)  # public bindings of types: procedure -> binding


def split_comment(line: str) -> tuple[str, str]:
    """The code, its character literals emptied, and the comment from the exclamation mark on."""
    code, quote = "", ""
    for position, character in enumerate(line):
        if quote:
            if character == quote:
                quote = ""
                code += character
        elif character == "!":
            return code, line[position:]
        else:
            if character in "'\"":
                quote = character
            code += character
    return code, ""


def statements(lines: list[str]):
    """All statements in their order."""
    number = 0
    while number < len(lines):
        code, comment = split_comment(lines[number])
        first, joined, comments = number, code.strip(), [comment]
        while joined.endswith("&") and number + 1 < len(lines):
            number += 1
            code, comment = split_comment(lines[number])
            comments.append(comment)
            if code.strip():
                joined = f"{joined[:-1].rstrip()} {code.strip().removeprefix('&').lstrip()}"
        if joined:
            yield Statement(first, number, joined, " ".join(filter(None, comments)))
        number += 1


def doc_above(lines: list[str], number: int) -> str:
    """The comment `!>` that ends on the line above."""
    found = []
    while number > 0 and (text := lines[number - 1].strip()).startswith(("!>", "!!")):
        found.insert(0, text[2:].strip())
        number -= 1
    return " ".join(found)


def read_source(path: Path) -> Source:
    source = Source(path, path.read_text(encoding="utf-8").splitlines())
    open_procedures: list[Procedure] = []
    interfaces, in_type = 0, False
    for statement in statements(source.lines):
        code = statement.code
        if INTERFACE.match(code):
            interfaces += 1
        elif END_INTERFACE.match(code):
            interfaces -= 1
        elif END.match(code):
            _close(source, open_procedures, statement)
        elif start := START.match(code):
            names = [name.strip() for name in (start[2] or "").split(",") if name.strip()]
            open_procedures.append(
                Procedure(
                    path,
                    start[1],
                    [Argument(name.lower()) for name in names],
                    statement.line,
                    doc_above(source.lines, statement.line),
                    open_procedures[-1] if open_procedures else None,
                    interfaces > 0,
                )
            )
        elif END_TYPE.match(code):
            in_type = False
        elif TYPE.match(code):
            in_type = True
        elif in_type:
            _bind(source, statement)
        elif open_procedures:
            _declare(open_procedures[-1], source.lines, statement)
        elif match := PUBLIC.match(code):
            source.public |= {name.strip().lower() for name in match[1].split(",")}
    return source


def _close(source: Source, open_procedures: list[Procedure], statement: Statement) -> None:
    procedure = open_procedures.pop()
    procedure.last = statement.last
    if open_procedures:
        open_procedures[-1].inner_lines += procedure.last - procedure.first + 1
    source.procedures.append(procedure)


def _bind(source: Source, statement: Statement) -> None:
    if (match := BINDING.match(statement.code)) and "private" not in match[2].lower():
        for item in match[3].split(","):
            binding, _, procedure = item.lower().partition("=>")
            source.bindings[match[1].lower() if match[1] else (procedure or binding).strip()] = binding.strip()


def _declare(procedure: Procedure, lines: list[str], statement: Statement) -> None:
    """The comment of an argument stands behind it or on the lines below."""
    match = DECLARATION.match(statement.code)
    if not match:
        return
    names = {name.lower() for name in NAME_IN_LIST.findall(match[3])}
    comment = statement.comment
    number = statement.last + 1
    while number < len(lines) and lines[number].strip().startswith("!!"):
        comment += " " + lines[number].strip()
        number += 1
    for argument in procedure.arguments:
        if argument.name in names and not argument.declaration:
            argument.declaration = f"{match[1]}{match[2]}".strip()
            argument.comment = comment.partition("!!")[2].strip()
