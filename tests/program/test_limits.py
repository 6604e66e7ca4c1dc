"""Limits on inputs that are small but ask for much or have many mistakes: time and memory linear in the size of the file."""

import os
import re
import resource

import pytest
from conftest import IS_SANITIZED, SOURCE
from sweep_inputs import needs_sweeps

MACHINE = "&body name='a' inertia=1 /\n&body name='b' inertia=1 /\n&run t_end=1 /\n&output points=11 /\n"
TABLE = "&excitation name='e' body='a' kind='table' table_time={} table_torque=1, 2 /\n"
SWEEP = (
    "&coupling name='c' bodies='a', 'b' stiffness=1 /\n&record quantity='omega_a' statistic='max' /\n"
    "&sweep design='list' file='{}' /\n"
)
SHOWN = 50
MEMORY = 1_000_000_000  # bytes of address space; the inputs below took several times as much
SECONDS = 10  # of the processor; in quadratic time the inputs below take a minute


def set_limits():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))


def limited(nocdyn, *words):
    return nocdyn(*words, preexec_fn=None if IS_SANITIZED else set_limits, errors="strict")


@pytest.mark.parametrize(
    ("text", "mistakes", "first"),
    [
        (
            MACHINE + TABLE.format("20000*x"),
            20_000,
            ":5: &excitation 'e': table_time(1) = x is not a number; allowed: a finite number [s]",
        ),
        (
            "&body name='a' inertia=1\n" + "".join(f"key{i}=1\n" for i in range(20_000)) + "/\n&run t_end=1 /\n",
            20_000,
            ":2: &body",
        ),
        (MACHINE + "\x01\n" * 20_000, 20_000, ":5: a control character (code 1) does not belong in an input file"),
        (MACHINE + "&case title=" + "=" * 20_000 + " /\n", 20_000, ":5: &case: title: '=' without a key before it: <==="),
        (MACHINE + "&ghost /\n" * 5_000, 5_000, ":5: &ghost: there is no such group"),
    ],
)
def test_the_first_mistakes_are_shown_and_the_others_counted(nocdyn, text, mistakes, first):
    nocdyn.write("many.nml", text)
    outcome = limited(nocdyn, "check", "many.nml")
    lines = outcome.stderr.splitlines()
    assert outcome.returncode == 2
    assert lines[0].startswith(f"nocdyn: many.nml{first}")
    assert len(lines) == SHOWN + 1
    assert lines[-1] == f"nocdyn: many.nml: {mistakes - SHOWN} more mistakes; the first {SHOWN} are shown"


@pytest.mark.parametrize("list_of_values", ["1000000*0.5 " * 2000, "1000000*0.5 7", "1 " * 1_000_001])
def test_a_key_has_at_most_a_million_values(nocdyn, list_of_values):
    nocdyn.write("values.nml", MACHINE + TABLE.format(list_of_values))
    outcome = limited(nocdyn, "check", "values.nml")
    message = "nocdyn: values.nml:5: &excitation 'e': table_time: too many values; allowed: at most 1000000 for a key\n"
    assert (outcome.returncode, outcome.stderr) == (2, message)


def test_a_long_list_by_subscripts_is_read_in_linear_time(nocdyn):
    pairs = "".join(f"table_time({i})={i} table_torque({i})=1\n" for i in range(1, 50_001))
    nocdyn.write("long.nml", MACHINE + "&excitation name='e' body='a' kind='table'\n" + pairs + "/\n")
    assert limited(nocdyn, "check", "long.nml").returncode == 0
    nocdyn.write(
        "beyond.nml", MACHINE + "&excitation name='e' body='a' kind='table' table_time(1::600000) = 1, 2, 3 table_torque = 1 /\n"
    )
    outcome = limited(nocdyn, "check", "beyond.nml")
    assert outcome.returncode == 2
    assert "&excitation 'e': table_time has too many values; allowed: at most 1000000" in outcome.stderr


def test_a_list_of_variants_needs_no_room_for_lines_without_numbers(nocdyn):
    names = ",".join(["body.a.inertia"] * 9999)
    (nocdyn.folder / "wide.csv").write_text(names + "\n" * 100_000)
    nocdyn.write("wide.nml", MACHINE + SWEEP.format("wide.csv"))
    outcome = limited(nocdyn, "check", "wide.nml")
    assert outcome.returncode == 2
    assert outcome.stderr.splitlines()[0] == "nocdyn: wide.nml:7: &sweep: file: wide.csv: 0 rows; needed: at least 1"
    (nocdyn.folder / "wide.csv").write_text(",".join(["x"] * 10_001) + "\n1\n")
    outcome = limited(nocdyn, "check", "wide.nml")
    assert outcome.stderr == "nocdyn: wide.nml:7: &sweep: file: wide.csv:1: 10001 columns; allowed: at most 10000\n"


def test_a_file_that_is_too_large_is_not_read(nocdyn):
    with open(nocdyn.folder / "sparse.nml", "wb") as file:
        file.truncate(100_000_000_000)
    outcome = limited(nocdyn, "check", "sparse.nml")
    message = "nocdyn: sparse.nml: cannot be read: it has more than 100000000 bytes, the most allowed\n"
    assert (outcome.returncode, outcome.stderr) == (3, message)


def test_a_link_to_itself_is_told_as_such(nocdyn):
    os.symlink("loop.nml", nocdyn.folder / "loop.nml")
    outcome = nocdyn("check", "loop.nml")
    message = "nocdyn: loop.nml: cannot be read: it is a symbolic link that leads to itself\n"
    assert (outcome.returncode, outcome.stderr) == (3, message)


def test_an_empty_value_is_refused(nocdyn):
    nocdyn.write("empty.nml", MACHINE + "&coupling name='c' bodies='a', 'b' stiffness =   damping = 0.5 /\n")
    outcome = nocdyn("check", "empty.nml")
    message = "nocdyn: empty.nml:5: &coupling 'c': stiffness has no value; needed: >= 0 [N m/rad]\n"
    assert (outcome.returncode, outcome.stderr) == (2, message)


@pytest.mark.parametrize("text", ["\x1b[31m", "\u009b31m", "\u202e", "\u2066", "\x7f"])
def test_nothing_that_is_printed_acts_on_the_terminal(nocdyn, text):
    (nocdyn.folder / "t.csv").write_text(f"{text} 1\n2 {text}\n")
    (nocdyn.folder / "l.csv").write_text(f"body.{text}.inertia,{text}\n1,2\n")
    nocdyn.write(
        "table.nml", MACHINE + "&coupling name='c' bodies='a', 'b' table_file='t.csv' /\n&load name='x' body='" + text + "' /\n"
    )
    nocdyn.write("list.nml", MACHINE + SWEEP.format("l.csv"))
    nocdyn.write(f"{text}.nml", MACHINE)
    for words in [
        ("check", "table.nml"),
        ("check", "list.nml"),
        ("sweep", "list.nml"),
        ("check", f"{text}.nml"),
        ("run", f"{text}.nml"),
        ("equilibrium", f"{text}.nml"),
        ("modes", f"{text}.nml"),
        ("check", "table.nml", "--set", text),
    ]:
        outcome = nocdyn(*words)
        printed = outcome.stdout + outcome.stderr
        assert printed
        assert not [c for c in printed if c != "\n" and not (c.isprintable() or c == " ")], (words, printed)
        assert text not in printed


def test_bytes_that_are_not_utf_8_are_printed_as_numbers(nocdyn):
    (nocdyn.folder / "latin.nml").write_bytes(MACHINE.encode() + b"&load name='m\xfchle' body='\xff\x9b' viscous=1 /\n")
    outcome = nocdyn("check", "latin.nml", errors="strict")
    assert "there is no &body '\\xFF\\x9B'" in outcome.stderr


def test_a_trajectory_that_is_too_large_is_refused_before_the_run(nocdyn):
    chain = SOURCE / "input/examples/chain_200/chain_200.nml"
    for command in ["check", "run"]:
        outcome = nocdyn(command, chain, "--set", "output.points=10000000")
        assert outcome.returncode == 2
        assert re.search(
            r"^nocdyn: .*: &output: 10000000 rows of \d+ columns would take about \d+ GB; allowed: at most 100 GB; "
            r"ask for fewer rows by points or interval, or for some columns$",
            outcome.stderr,
        )
        assert ("trajectory.csv: about " in outcome.stdout) == (command == "check")
    assert nocdyn.files(".") == []


@needs_sweeps
def test_a_sweep_that_is_too_large_is_refused_before_it_starts(nocdyn):
    sweep = (
        SWEEP.replace("'list' file='{}'", "'random' samples=2000000000").replace("'max'", "'max', 'min'")
        + "&vary target='body.a.inertia' low=1 high=2 /\n"
    )
    nocdyn.write("large.nml", MACHINE + sweep)
    message = (
        "nocdyn: large.nml:7: &sweep: the files of 2000000000 variants would take about 130 GB; allowed: at most 100 GB; "
        "ask for fewer variants, results or trajectories\n"
    )
    for command in ["check", "sweep"]:
        outcome = nocdyn(command, "large.nml")
        assert (outcome.returncode, outcome.stderr) == (2, message)
    assert nocdyn.files(".") == ["large.nml"]
    outcome = nocdyn("check", "large.nml", "--set", "sweep.samples=10000000")
    assert outcome.stdout.endswith("  files: about 640 MB\n") or outcome.returncode == 3


@pytest.mark.parametrize("teeth", ["", "2*", "3*", ", ,"])
def test_values_of_which_none_is_given_are_refused(nocdyn, teeth):
    nocdyn.write("teeth.nml", MACHINE + f"&gear name='g' bodies='a', 'b' teeth = {teeth} /\n")
    outcome = nocdyn("check", "teeth.nml")
    message = "nocdyn: teeth.nml:5: &gear 'g': teeth has no value; needed: >= 1\n"
    assert (outcome.returncode, outcome.stderr) == (2, message)


def test_a_line_feed_in_the_name_of_a_file_splits_no_message(nocdyn):
    for command in ["check", "run", "equilibrium", "modes"]:
        nocdyn.write("two\nlines.nml", MACHINE)
        outcome = nocdyn(command, "two\nlines.nml")
        assert "\nlines" not in outcome.stdout + outcome.stderr, command
        assert "two lines.nml: " in outcome.stdout, command
        nocdyn.write("two\nlines.nml", MACHINE + "&load name='x' body='c' /\n")
        outcome = nocdyn(command, "two\nlines.nml")
        assert (outcome.returncode, outcome.stderr.count("\n")) == (2, 1), outcome.stderr
        assert outcome.stderr.startswith("nocdyn: two lines.nml:5: &load 'x': "), outcome.stderr


@pytest.mark.parametrize("letter", ["x", "ü", "\u4e2d"])
def test_long_paths_are_cut_in_their_middle(nocdyn, letter):
    path = "/".join(["", *[letter * 60] * 3, "m.nml"])
    shown = path[:30] + " ..." + path[-46:]
    for words in [("check", path), ("run", path)]:
        outcome = nocdyn(*words, errors="strict")
        assert outcome.returncode == 3
        assert outcome.stderr == f"nocdyn: {shown}: cannot be read: there is no such file\n"
    (nocdyn.folder / path[1:]).parent.mkdir(parents=True)
    nocdyn.write(path[1:], MACHINE + "&load name='x' body='c' /\n")
    outcome = nocdyn("check", path[1:], errors="strict")
    assert outcome.stderr.startswith(f"nocdyn: {path[1:31]} ...{path[-46:]}:5: &load 'x': ")


def test_names_that_are_not_utf_8_are_latin_1_in_all_tables(nocdyn):
    (nocdyn.folder / "latin.nml").write_bytes(MACHINE.encode() + b"&load name='m\xfchle' body='a' viscous=1 /\n")
    assert nocdyn("run", "latin.nml", "--out", "run").returncode == 0
    assert "torque_mühle [N m]" in nocdyn.table("run")[0]
    assert "mühle" in (nocdyn.folder / "run/summary.json").read_text(encoding="utf-8")


@pytest.mark.parametrize("command", ["check", "run", "response", "modes"])
def test_a_limit_of_an_element_that_there_is_not_is_refused_by_every_command(nocdyn, command):
    text = "&body name='a' inertia=1 speed=1 /\n&coupling name='k' bodies='ground','a' stiffness=9 /\n&run t_end=1 /\n"
    nocdyn.write("m.nml", text + "&response body='a' speed=1,2 orders=1 /\n&limit coupling='q' moment=1 /\n")
    outcome = nocdyn(command, "m.nml")
    assert outcome.returncode == 2
    assert outcome.stderr.startswith("nocdyn: m.nml:5: &limit: there is no coupling 'q'")
