"""The sections of a report: each a function that makes its section of the results, or None where it does not apply."""
