"""Why there are no figures."""

USAGE, FILES = 2, 3  # exit codes: wrong usage; a file cannot be read or written


class ResultsError(Exception):
    """A folder whose results cannot be used; the message is one line for the person at the keyboard."""

    code = FILES


class ChoiceError(ResultsError):
    """Words of the command that choose nothing of what there is."""

    code = USAGE
