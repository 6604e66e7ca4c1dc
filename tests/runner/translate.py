"""Translates a pFUnit test module (.pf) into a Fortran module and the main program that runs its tests.

    translate.py test_x.pf test_x.f90

Knows what this project uses of pFUnit 4: @test, @before, @after and the assertions of funit.f90, each on one line.
"""

import difflib
import re
import sys
from pathlib import Path

ASSERTIONS = (
    "assertTrue",
    "assertFalse",
    "assertEqual",
    "assertNotEqual",
    "assertRelativelyEqual",
    "assertIsFinite",
    "assertLessThan",
    "assertLessThanOrEqual",
    "assertGreaterThan",
    "assertGreaterThanOrEqual",
)
MARKERS = ("test", "before", "after")
# The names that `use funit` brings along in pFUnit 4.14 (FUnit.F90, FUnit_Core.F90, Assert.F90, fHamcrest.F90), and those of the
# function that pFUnit makes of a test module. A module that declares or imports one of them does not build with pFUnit.
NAMES_OF_PFUNIT = """
    initialize run generic_run finalize loadtests_interface stub get_context output_unit
    sourcelocation test testsuite testmethod testresult testrunner basetestrunner remoterunner robustrunner testlistener
    testlistenervector listenerpointer resultprinter xmlprinter debuglistener namefilter testcase abstracttestparameter
    parameterizedtestcase parallelcontext serialcontext throw catchnext catch anyexceptions expectation subject predicate
    wascalled wasnotcalled wascalledonce testannotation disable timeoutannotation taplistener
    assertfail asserttrue assertfalse assertequal assertexceptionraised assertsameshape assertany assertall assertnone
    assertnotall assertnotequal assertlessthan assertlessthanorequal assertgreaterthan assertgreaterthanorequal
    assertrelativelyequal assertisnan assertisfinite whitespaceoptions ignore_all trim_all keep_all ignore_differences
    matcherdescription stringdescription assert_that abstractmatcher is isnot not isequal equal_to istrueorfalse true false
    isnear near isrelativelynear relatively_near anyof any_of allof all_of every every_item stringcontains contains_string
    stringstartswith starts_with stringendswith ends_with isarraywithsize array_with_size empty_array matchable
    suite t
"""
TAKEN = set(NAMES_OF_PFUNIT.split())
CANONICAL = {name.lower(): name for name in ASSERTIONS + MARKERS}

ANNOTATION = re.compile(r"\s*@(\w*)\s*(.*?)\s*$")
SUBROUTINE = re.compile(r"\s*subroutine\s+(\w+)\s*(\(\s*\))?\s*(!.*)?$", re.IGNORECASE)
MODULE = re.compile(r"\s*module\s+(\w+)\s*$", re.IGNORECASE)
PROCEDURE = re.compile(r"(?!\s*end\b)[^!'\"]*\b(?:subroutine|function)\s+(\w+)", re.IGNORECASE)
STATEMENT_WITH_NAMES = re.compile(r"\s*(?:use\b.*?\bonly\s*:|interface\b(?=\s+\w)|[^'\"]*?::)(.*)", re.IGNORECASE)
BLOCK = re.compile(r"\s*(type\s*(?:,[^:]*)?(?:::)?\s*\w+\s*$|(?:abstract\s+)?interface\b)", re.IGNORECASE)
END_OF_BLOCK = re.compile(r"\s*end\s*(?:type|interface)\b", re.IGNORECASE)
BLANK_OR_COMMENT = re.compile(r"\s*(!.*)?$")

TESTS_FOLDER = Path(__file__).resolve().parent.parent


class Translation:
    """The Fortran lines of one .pf file, the procedures found in it, and the mistakes in it."""

    def __init__(self, source: Path):
        self.source = source.resolve()
        inside = self.source.is_relative_to(TESTS_FOLDER)
        self.shown_name = str(self.source.relative_to(TESTS_FOLDER)) if inside else self.source.name
        self.lines: list[str] = []
        self.mistakes: list[str] = []
        self.module = ""
        self.procedures: dict[str, list[str]] = {marker: [] for marker in MARKERS}
        self.is_in_specification = True
        self.is_in_block = False  # of a type or an interface in the specification
        self.statement = ""  # so far, of continued lines
        self.marker = ""  # annotation that waits for its subroutine

    def translate(self) -> None:
        self.locate(1)
        text = self.source.read_text(encoding="utf-8")
        for number, line in enumerate(text.splitlines(), start=1):
            self.translate_line(number, line)
        if self.module.lower() != self.source.stem.lower():
            self.refuse(1, f"the file must hold 'module {self.source.stem}', named as the file")
        if not self.procedures["test"]:
            self.refuse(1, "no @test in this file")
        for marker in ("before", "after"):
            if len(self.procedures[marker]) > 1:
                self.refuse(1, f"more than one @{marker}")

    def translate_line(self, number: int, line: str) -> None:
        annotation = ANNOTATION.match(line)
        if annotation:
            self.translate_annotation(number, *annotation.groups())
            return
        self.lines.append(line)
        if self.marker and not BLANK_OR_COMMENT.match(line):
            self.name_procedure(number, line)
        procedure = PROCEDURE.match(line)
        self.refuse_taken(number, [procedure.group(1)] if procedure else self.declared_names(line))
        module = MODULE.match(line)
        if module and not self.module:
            self.module = module.group(1)

    def declared_names(self, line: str) -> list[str]:
        """The names that a line before the module's `contains` declares or imports, a continued line after its beginning."""
        code = re.sub(r"'[^']*'|\"[^\"]*\"", "''", line).split("!")[0].rstrip()
        if re.match(r"\s*contains\s*$", code, re.IGNORECASE) and not self.is_in_block:
            self.is_in_specification = False
        if not self.is_in_specification or not code.strip():
            return []
        statement = self.statement + code.rstrip("&").strip().lstrip("&") + " "
        self.statement = statement if code.endswith("&") else ""
        if self.statement:
            return []
        begins_block, was_in_block = BLOCK.match(statement), self.is_in_block
        self.is_in_block = (was_in_block or bool(begins_block)) and not END_OF_BLOCK.match(statement)
        found = STATEMENT_WITH_NAMES.match(statement)
        if was_in_block or not found:
            return []
        names, depth = [""], 0
        for character in found.group(1):
            depth += (character in "([") - (character in ")]")
            if character == "," and depth == 0:
                names.append("")
            else:
                names[-1] += character
        return [match.group(1) for name in names if (match := re.match(r"\s*(\w+)", name))]

    def refuse_taken(self, number: int, names: list[str]) -> None:
        for name in names:
            if name.lower() in TAKEN:
                self.refuse(number, f"{name} is a name of pFUnit's; call it something else")

    def translate_annotation(self, number: int, word: str, arguments: str) -> None:
        name = CANONICAL.get(word.lower())
        if name is None:
            near = difflib.get_close_matches(word.lower(), CANONICAL, n=1)
            hint = f"did you mean @{CANONICAL[near[0]]}?" if near else "known are @" + ", @".join(CANONICAL.values())
            self.refuse(number, f"unknown annotation @{word}: {hint}")
        elif name in MARKERS:
            if self.marker or arguments:
                self.refuse(number, f"@{name} stands alone on the line before its subroutine")
            self.marker = name
            self.lines.append(f"! @{name}")
        elif arguments.startswith("(") and arguments.endswith(")") and arguments[1:-1].strip():
            self.lines += [
                f"    call {name}({arguments[1:-1]}, &",
                f"      location=SourceLocation('{self.shown_name}', {number}))",
                "    if (anyExceptions()) return",
            ]
            self.locate(number + 1)
        else:
            self.refuse(number, f"@{name} needs its arguments in parentheses, all on its line and nothing after them")

    def name_procedure(self, number: int, line: str) -> None:
        subroutine = SUBROUTINE.match(line)
        if subroutine:
            self.procedures[self.marker].append(subroutine.group(1))
        else:
            self.refuse(number, f"expected 'subroutine NAME()' after @{self.marker}")
        self.marker = ""

    def refuse(self, number: int, mistake: str) -> None:
        self.mistakes.append(f"{self.source}:{number}: error: {mistake}")

    def locate(self, number: int) -> None:
        """Lets the compiler name lines of the .pf file in its messages."""
        self.lines.append(f'# {number} "{self.source}"')

    def main_program(self) -> list[str]:
        fixture = "".join(f", {marker}={name}" for marker in ("before", "after") for name in self.procedures[marker])
        names = [name for marker in MARKERS for name in self.procedures[marker]]
        return [
            "",
            f"program run_{self.module}",
            "  use funit_runner, only: finish_tests, run_test, start_tests",
            *(f"  use {self.module}, only: {name}" for name in names),
            "  implicit none",
            "  call start_tests()",
            *(f"  call run_test('{name}', {name}{fixture})" for name in self.procedures["test"]),
            "  call finish_tests()",
            f"end program run_{self.module}",
        ]


def main() -> int:
    if len(sys.argv) != 3:
        print("usage: translate.py SOURCE.pf RESULT.f90", file=sys.stderr)
        return 2
    translation = Translation(Path(sys.argv[1]))
    translation.translate()
    if translation.mistakes:
        print("\n".join(translation.mistakes), file=sys.stderr)
        return 1
    lines = translation.lines + translation.main_program()
    result = Path(sys.argv[2])
    result.parent.mkdir(parents=True, exist_ok=True)
    result.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
