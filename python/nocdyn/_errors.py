"""Exceptions, from the messages of the program."""

import re
from dataclasses import dataclass

WRONG_INPUT = 2  # the exit code of wrong usage or input

_PLACE = re.compile(r"(?P<file>[^\n]*?):(?:(?P<line>\d+):)? (?=&\w|[^&])(?:(?P<group>&\w+(?: '[^']*')?): )?(?P<message>.*)")
_KEY = re.compile(r"(\w+)(?= = |: | is missing| is not a key| has \d)")


@dataclass(frozen=True)
class Mistake:
    """One mistake in an input: where it is, as far as that is known, and what is allowed."""

    file: str
    line: int | None
    group: str | None
    key: str | None
    message: str


class NocdynError(Exception):
    """A computation failed, or a file cannot be read or written; `code` is the exit code of the program."""

    def __init__(self, message, code):
        super().__init__(message)
        self.code = code


class InputError(NocdynError):
    """The input, a setting or a call is wrong; `mistakes` has all that was found."""

    def __init__(self, message):
        super().__init__(message, WRONG_INPUT)
        self.mistakes = [mistake_of(line) for line in message.splitlines()]


def mistake_of(line):
    """A line of a message, taken apart."""
    place = _PLACE.fullmatch(line)
    if place is None:
        return Mistake("", None, None, None, line)
    key = _KEY.match(place["message"])
    number = int(place["line"]) if place["line"] else None
    return Mistake(place["file"], number, place["group"], key and key[1], place["message"])


def raise_error(code, message):
    """Raises what a code other than 0 stands for."""
    raise InputError(message) if code == WRONG_INPUT else NocdynError(message, code)
