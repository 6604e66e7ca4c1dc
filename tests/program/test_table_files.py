"""Tables in files beside the input."""

import os

import f90nml
import pytest

MACHINE = """&body name = 'b' inertia = 1.0 /
&load name = 'l' body = 'b' table_file = 'tables/load.csv' interpolation = 'cubic' /
&run t_end = 0.1 /
&output points = 3 /
"""


def write(nocdyn, table):
    (nocdyn.folder / "in/tables").mkdir(parents=True)
    (nocdyn.folder / "in/m.nml").write_text(MACHINE)
    (nocdyn.folder / "in/tables/load.csv").write_bytes(table)
    return nocdyn.folder / "in/m.nml"


def test_the_results_hold_the_values_and_not_the_file(nocdyn):
    path = write(nocdyn, b"# speed, torque\r\n-1.0, -2.5\r\n0.1, 0.2\r\n1e1, 3\r\n")
    assert nocdyn("run", path, "--out", "out").returncode == 0
    load = f90nml.read(nocdyn.folder / "out/input.nml")["load"]
    assert load["table_speed"] == [-1.0, 0.1, 10.0]
    assert load["table_torque"] == [-2.5, 0.2, 3.0]
    assert load["interpolation"] == "cubic"
    assert "table_file" not in load
    assert nocdyn("run", "out/input.nml", "--out", "again").returncode == 0
    assert (nocdyn.folder / "again/input.nml").read_text() == (nocdyn.folder / "out/input.nml").read_text()


def test_a_long_table_is_read_back_by_f90nml(nocdyn):
    rows = [(i / 7, (i * 7919 % 1000) / 3) for i in range(2000)]
    path = write(nocdyn, "".join(f"{x!r} {y!r}\n" for x, y in rows).encode())
    assert nocdyn("run", path, "--out", "out").returncode == 0
    load = f90nml.read(nocdyn.folder / "out/input.nml")["load"]
    assert list(zip(load["table_speed"], load["table_torque"])) == rows


def test_errors_in_a_table_file_are_reported_with_its_line(nocdyn):
    path = write(nocdyn, b"0 1\n1 x\n").relative_to(nocdyn.folder)
    outcome = nocdyn("check", path)
    assert outcome.returncode == 2
    place = f"nocdyn: {path}:2: &load 'l': table_file: {path.parent}/tables/load.csv"
    assert outcome.stderr == f"{place}:2: column 2, 'x', is not a number\n"


def test_decimal_commas_are_read_where_semicolons_or_tabs_separate_columns(nocdyn):
    path = write(nocdyn, b"")
    for table in ("# v; M\n-1,5;-2,5\n0,1;0,2\n1e1;3\n", "-1,5\t-2,5\r\n0,1\t0,2\r\n1e1\t3\r\n"):
        (path.parent / "tables/load.csv").write_text(table)
        assert nocdyn("run", path, "--out", "out").returncode == 0
        load = f90nml.read(nocdyn.folder / "out/input.nml")["load"]
        assert load["table_speed"] == [-1.5, 0.1, 10.0]
        assert load["table_torque"] == [-2.5, 0.2, 3.0]
    (path.parent / "tables/load.csv").write_text("-1,5,-2,5\n0,1,0,2\n")
    assert "4 columns in '-1,5,-2,5'; needed: 2, separated by blanks or a comma; with decimal commas by semicolons or tabs" in (
        nocdyn("check", path).stderr
    )


def test_a_missing_file_has_exit_code_3(nocdyn):
    path = write(nocdyn, b"")
    (path.parent / "tables/load.csv").unlink()
    outcome = nocdyn("check", path)
    assert outcome.returncode == 3
    assert outcome.stderr.endswith("/in/tables/load.csv: cannot be read: there is no such file\n")


@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero"), lambda path: path.mkdir()])
@pytest.mark.parametrize(
    "group",
    [
        "&excitation name = 'x' body = 'a' kind = 'table' table_file = 'odd' /",
        "&excitation name = 'x' body = 'a' kind = 'orders' table_file = 'odd' /",
        "&case notes_file = 'odd' /",
        "&sweep design = 'list' file = 'odd' /\n&record quantity = 'omega_a' statistic = 'final' /",
    ],
)
def test_a_file_that_an_input_names_is_no_pipe_device_or_folder(nocdyn, make, group):
    make(nocdyn.folder / "odd")
    nocdyn.write("m.nml", "&body name = 'a' inertia = 1 /\n&run t_end = 1 /\n" + group + "\n")
    outcome = nocdyn("check", "m.nml")
    assert outcome.returncode == 3
    assert outcome.stderr.startswith("nocdyn: m.nml:3: &") and outcome.stderr.endswith(
        "odd: cannot be read: it is no regular file\n"
    )


def test_notes_of_the_author_must_be_there_and_are_not_named_beside_the_results(nocdyn):
    case = "&case author = 'A. Smith' notes_file = 'notes.md' /\n"
    nocdyn.write("a.nml", case + "&body name = 'a' inertia = 1.0 /\n&run t_end = 1.0 /\n")
    outcome = nocdyn("check", "a.nml")
    assert outcome.returncode == 3
    assert outcome.stderr == "nocdyn: a.nml:1: &case: notes_file: notes.md: cannot be read: there is no such file\n"
    nocdyn.write("notes.md", "# Notes\n")
    assert nocdyn("run", "a.nml").returncode == 0
    copy = f90nml.read(nocdyn.folder / "results/a/input.nml")["case"]
    assert copy["author"] == "A. Smith"
    assert "notes_file" not in copy


@pytest.mark.parametrize(
    "table",
    [
        b"-1.5 -2.5\n0.1 0.2\n10 3\n",
        b"-1.5,-2.5\r\n0.1,0.2\r\n10,3\r\n",
        b"-1.5\t-2.5\n0.1\t0.2\n10\t3",
        b"-1.5;-2.5\n0.1;0.2\n10;3\n",
        b"\xef\xbb\xbf-1,5;-2,5\r\n0,1;0,2\r\n10;3\r\n",
        b"\xef\xbb\xbfsep=;\r\n-1,5;-2,5\r\n0,1;0,2\r\n10;3\r\n",
        b"SEP=,\r\n-1.5,-2.5\r\n0.1,0.2\r\n10,3\r\n",
        b"sep=\t\n-1,5\t-2,5\n0,1\t0,2\n10\t3\n",
        b"speed [rad/s];torque [N m]\n-1,5;-2,5\n0,1;0,2\n10;3\n",
        b"-1,5 -2,5\n0,1 0,2\n10 3\n",
        b'"speed","torque"\n"-1,5","-2,5"\n"0,1","0,2"\n"10","3"\n',
    ],
)
def test_tables_of_spreadsheets_are_read(nocdyn, table):
    path = write(nocdyn, table)
    assert nocdyn("run", path, "--out", "out").returncode == 0
    load = f90nml.read(nocdyn.folder / "out/input.nml")["load"]
    assert (load["table_speed"], load["table_torque"]) == ([-1.5, 0.1, 10.0], [-2.5, 0.2, 3.0])


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (b"-1,5,2\n0,1,3\n", ":1: 3 columns in '-1,5,2'; needed: 2, separated by blanks or a comma; with decimal commas by semi"),
        (b"-1;2;\n0;1;\n", ":1: 3 columns in '-1;2;'; needed: 2, separated by semicolons as in other lines"),
        (b"-1;2\n0,1\n", ":2: 1 column in '0,1'; needed: 2, separated by semicolons as in other lines"),
        ("-1 2\n0 1\n".encode("utf-16"), ": not a text file"),
    ],
)
def test_tables_of_another_format_have_one_clear_message(nocdyn, table, message):
    outcome = nocdyn("check", write(nocdyn, table))
    assert outcome.returncode == 2
    assert f"/in/tables/load.csv{message}" in outcome.stderr.splitlines()[0]
