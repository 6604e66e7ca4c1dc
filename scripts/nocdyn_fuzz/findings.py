"""Findings made small, and stored such that they can be had again."""

import shlex
from dataclasses import replace

from .corpus import GROUP

TRIALS = 150  # of one finding


def without_parts(content, parts):
    """The content without each of these pieces, from the largest share to single ones."""
    share = len(parts)
    while share >= 1:
        share = (share + 1) // 2
        for first in range(0, len(parts), share):
            gone = parts[first : first + share]
            yield content[: gone[0].start()] + content[gone[-1].end() :]
        if share == 1:
            return


def smaller_cases(case):
    """Cases with less in them."""
    for i in range(len(case.words) - 1):
        if case.words[i] == "--set":
            yield case.with_words(case.words[:i] + case.words[i + 2 :])
    for name in case.files:
        if name != case.main:
            yield replace(case, files={other: content for other, content in case.files.items() if other != name})
    for name, content in case.files.items():
        parts = list(GROUP.finditer(content))
        if name == case.main and parts:
            for smaller in without_parts(content, parts):
                yield case.with_file(name, smaller)
        elif len(content) > 200:
            yield case.with_file(name, content[: len(content) // 2])
            yield case.with_file(name, content[len(content) // 2 :])


def minimised(case, complaint, judge):
    """A smaller case of which `judge` says the same."""
    trials = 0
    shrinks = True
    while shrinks:
        shrinks = False
        for smaller in smaller_cases(case):
            trials += 1
            if trials > TRIALS:
                return case
            if complaint in judge(smaller):
                case, shrinks = smaller, True
                break
    return case


def command_line(case):
    return shlex.join(["nocdyn", *case.words]).encode("utf-8", "surrogateescape")


def store(case, complaints, outcome, folder):
    """The files, the command, what was found and what was printed."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in case.files.items():
        (folder / name).write_bytes(content)
    (folder / "command").write_bytes(command_line(case) + b"\n")
    said = [*complaints, "", *case.changes, "", f"exit code {outcome.code}, {outcome.memory} MB", ""]
    (folder / "finding.txt").write_bytes("\n".join(said).encode() + outcome.out[-5000:] + outcome.err[-20000:])
