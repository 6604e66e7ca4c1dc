"""Contestants from PyPI, timed in this process."""
