"""Why there is no report."""


class ReportError(Exception):
    """The message, for the person at the keyboard, and the exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


USAGE, FILES = 2, 3  # exit codes: wrong usage or input; a file cannot be read or written
