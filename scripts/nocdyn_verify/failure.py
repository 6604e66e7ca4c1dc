"""How a verification that cannot be done ends."""

FAILED, USAGE, FILES = 1, 2, 3  # exit codes


class VerificationError(Exception):
    """A message for the user, and the exit code."""

    def __init__(self, message: str, code: int = FILES) -> None:
        super().__init__(message)
        self.code = code
