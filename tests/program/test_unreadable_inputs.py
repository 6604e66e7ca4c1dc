"""Inputs that are missing, no files, empty, not text, damaged: one clear message, never a backtrace."""

import random

import pytest
from conftest import CASE_2, SOURCE

COMMANDS = ["run", "check", "matrices"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_missing_file_is_exit_code_3(nocdyn, command):
    outcome = nocdyn(command, "absent.nml")
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: absent.nml: cannot be read: there is no such file\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_an_empty_name_is_no_file(nocdyn, command):
    outcome = nocdyn(command, "")
    assert (outcome.returncode, outcome.stderr) == (3, "nocdyn: an empty text is not the name of a file\n")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_folder_is_no_input(nocdyn, command):
    outcome = nocdyn(command, SOURCE)
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == f"nocdyn: {SOURCE}: cannot be read: Is a directory\n"


@pytest.mark.parametrize("content", ["", "\n\n", "! nothing but words\n"])
def test_an_empty_file_is_refused(nocdyn, content):
    nocdyn.write("empty.nml", content)
    outcome = nocdyn("run", "empty.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == "nocdyn: empty.nml: no group in it; 'nocdyn new FILE' writes an example\n"


def test_a_binary_file_is_refused_in_one_line(nocdyn):
    path = nocdyn.folder / "binary.nml"
    path.write_bytes(random.Random(1).randbytes(20_000))
    outcome = nocdyn("check", path, errors="replace")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"nocdyn: {path}: not a text file\n"


def mutated(text, rng):
    """The bytes of a text with one to four random accidents."""
    for _ in range(rng.randint(1, 4)):
        lines = text.split(b"\n")
        line = rng.randrange(len(lines))
        place = rng.randrange(len(text) + 1)
        accident = rng.randrange(6)
        if accident == 0:
            text = text[:place] + bytes([rng.randrange(256)]) + text[place + 1 :]
        elif accident == 1:
            text = text[:place] + rng.choice([b"'", b"/", b"&", b"=", b",", b"(", b")", b"*", b"9", b"e", b"!"]) + text[place:]
        elif accident == 2:
            text = text[:place] + text[place + rng.randint(1, 20) :]
        elif accident == 3:
            del lines[line]
            text = b"\n".join(lines)
        elif accident == 4:
            lines.insert(rng.randrange(len(lines)), lines[line])
            text = b"\n".join(lines)
        else:
            text = text[:place]
        text = text or b" "
    return text


@pytest.mark.parametrize("part", range(5))
def test_malformed_inputs_are_read_or_refused_but_never_crash(nocdyn, part):
    original = CASE_2.read_bytes()
    codes = set()
    for seed in range(100 * part, 100 * part + 100):
        path = nocdyn.folder / f"damaged_{seed}.nml"
        path.write_bytes(mutated(original, random.Random(seed)))
        outcome = nocdyn("check", path, errors="replace")
        assert outcome.returncode in (0, 2), path
        assert "Backtrace" not in outcome.stderr and "Fortran runtime error" not in outcome.stderr, path
        assert (outcome.stderr == "") == (outcome.returncode == 0), path
        assert all(path.name in line for line in outcome.stderr.splitlines()), outcome.stderr
        codes.add(outcome.returncode)
    assert codes == {0, 2}


DISC = """\
&body name = 'disc' inertia = 1.0 /
&load name = 'l' viscous = 1.0
  body = {body} /
&run t_end = 1.0
  rtol = {rtol} /
&output
  directory = {directory} /
"""


@pytest.mark.parametrize(
    ("key", "value", "place", "message"),
    [
        ("body", "'" + "\u00e4" * 5000 + "'", "3: &load 'l': body: there is no &body", "; allowed: 'disc'"),
        (
            "rtol",
            "1" * 5000 + "x",
            "5: &run: rtol = 111",
            " is not a number; a number with its unit stands in quotes; allowed: 1e-14 to 0.1",
        ),
        (
            "directory",
            "'" + "x" * 5000 + "'",
            "7: &output: directory = 'xxx",
            " is too long for a folder; allowed: 4000 bytes, 255 from slash to slash",
        ),
        (
            "directory",
            "'" + "x" * 5000,
            "7: &output: directory: a quote is missing: the text <'xxx",
            "> is not closed on its line",
        ),
        ("rtol", "2" * 5000 + "*1", "5: &run: rtol: the repeat count of 222", "2 ... must be from 1 to 1000000"),
    ],
)
def test_messages_name_file_line_and_key_and_cut_long_values(nocdyn, key, value, place, message):
    values = {"body": "'disc'", "rtol": "1e-6", "directory": "'out'"} | {key: value}
    nocdyn.write("long.nml", DISC.format(**values))
    outcome = nocdyn("run", "long.nml")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith(f"nocdyn: long.nml:{place}")
    assert outcome.stderr.endswith(message + "\n")
    assert len(outcome.stderr.encode()) < 300


def test_a_long_override_is_cut(nocdyn):
    outcome = nocdyn("run", CASE_2, "--set", "output.directory=" + "x/" * 3000)
    assert outcome.returncode == 2
    assert outcome.stderr.startswith("nocdyn: --set output.directory=x/x/") and len(outcome.stderr) < 400


@pytest.mark.parametrize("folder", ["x" * 5000, "x/" * 2500, "y/" + "x" * 256])
def test_a_folder_of_results_that_is_too_long_is_refused_before_anything_is_made(nocdyn, folder):
    outcome = nocdyn("run", CASE_2, "--out", folder)
    assert outcome.returncode == 2
    assert outcome.stderr.startswith(f"nocdyn: --out {folder[:80]} ... is too long for a folder; allowed: 4000 bytes, 255 from")
    assert nocdyn.files(".") == []


def test_a_file_in_place_of_the_folder_of_results_is_told(nocdyn):
    nocdyn.write("p.nml", "")
    outcome = nocdyn("run", CASE_2, "--out", "p.nml")
    message = "nocdyn: cannot write 'p.nml/trajectory.csv': the folder cannot be made: there is a file of this name\n"
    assert (outcome.returncode, outcome.stderr) == (3, message)
