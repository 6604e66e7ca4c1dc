"""Expected numbers of the verification cases, for tests that check more about the same machines: each number stands once."""

import csv
from functools import cache

from conftest import SOURCE


@cache
def cases(feature):
    with (SOURCE / "verification" / feature / "cases.csv").open(newline="", encoding="utf-8") as file:
        return {row["id"]: float(row["expected"]) for row in csv.DictReader(file)}


def known(name):
    """The expected value of a case, by the name that `nocdyn verify` gives it: 'modes.two_discs.f1'."""
    feature, _, case = name.partition(".")
    return cases(feature)[case]
