"""Names that cannot be columns of a table."""

import pytest
from conftest import SPINNER


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("", "'' is an empty name"),
        ("ground", "'ground' is not allowed as a name: it is the body that does not turn"),
        ("n" * 200, "is too long for a name; allowed: "),
        (" disc", "' disc' is a name with a blank at its beginning or end"),
        ("a,b", "'a,b' is a name with a comma, semicolon, equals sign, quote or tab, which is not allowed"),
        ("a=b", "'a=b' is a name with a comma, semicolon, equals sign, quote or tab, which is not allowed"),
    ],
)
def test_names_that_a_table_cannot_hold_are_refused(nocdyn, name, message):
    outcome = nocdyn("check", nocdyn.write("named.nml", SPINNER.replace("name = 'disc'", f"name = '{name}'")))
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert "named.nml:1: &body" in outcome.stderr and message in outcome.stderr
