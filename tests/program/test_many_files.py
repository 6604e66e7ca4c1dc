"""nocdyn run with several files, and where results go."""

import pytest
from conftest import CASE_1, CASE_2, SPINNER

RESULTS = ["columns.json", "input.nml", "summary.json", "trajectory.csv"]
BAD = SPINNER.replace("inertia", "inertai")
EXPLODING = """\
&body name = 'disc' inertia = 1.0 speed = 1.0 /
&coupling name = 'shaft' bodies = 'ground', 'disc' stiffness = 1.0 cubic_stiffness = -10.0 /
&run t_end = 100.0 /
"""


def test_results_go_to_a_folder_named_like_the_input(nocdyn):
    nocdyn("run", CASE_2)
    assert nocdyn.files("results/case2") == RESULTS


def test_the_input_says_where_results_go(nocdyn):
    nocdyn.write("a.nml", SPINNER.replace("points", "directory = 'far/away/' points"))
    nocdyn("run", "a.nml")
    assert nocdyn.files("far/away") == RESULTS


def test_out_counts_more_than_the_input(nocdyn):
    nocdyn.write("a.nml", SPINNER.replace("points", "directory = 'far' points"))
    nocdyn("run", "a.nml", "--out", "near/")
    assert nocdyn.files("near") == RESULTS
    assert not (nocdyn.folder / "far").exists()


def test_several_files_have_folders_of_their_own_in_out(nocdyn):
    outcome = nocdyn("run", CASE_1, CASE_2, "--out=out")
    assert outcome.returncode == 0
    assert nocdyn.files("out") == ["case1", "case2"]
    assert nocdyn.files("out/case1") == nocdyn.files("out/case2") == RESULTS


def test_several_files_print_one_line_each(nocdyn):
    outcome = nocdyn("run", CASE_1, CASE_2)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    first, second = outcome.stdout.splitlines()
    assert first.startswith(f"{CASE_1}: done at t = 10 s, ") and first.endswith("results in results/case1")
    assert second.startswith(f"{CASE_2}: done at t = 10 s, ") and "1001 rows" in second


def test_one_file_prints_title_and_all_columns_that_fit_a_screen(nocdyn):
    outcome = nocdyn("run", CASE_2)
    assert outcome.stdout.startswith("Paper, case 2: harmonic torque on the motor\n")
    header, _ = nocdyn.table("results/case2")
    table, _ = outcome.stdout.split("energy came from [J]\n")
    assert sorted(line.split("]")[0] + "]" for line in table.splitlines()[2:-1]) == sorted(header[1:])


def test_quiet_prints_nothing_but_errors(nocdyn, spinner):
    assert nocdyn("run", CASE_1, spinner, "--quiet").stdout == ""
    outcome = nocdyn("run", "absent.nml", spinner, "-q")
    assert outcome.stdout == ""
    assert outcome.stderr == "nocdyn: absent.nml: cannot be read: there is no such file\n"


@pytest.mark.parametrize(
    ("files", "code"),
    [
        (["good.nml"], 0),
        (["exploding.nml", "good.nml"], 1),
        (["bad.nml", "good.nml"], 2),
        (["exploding.nml", "bad.nml", "good.nml"], 2),
        (["absent.nml", "exploding.nml", "bad.nml", "good.nml"], 3),
    ],
)
def test_the_run_goes_on_past_bad_files_and_the_code_is_the_worst(nocdyn, files, code):
    nocdyn.write("good.nml", SPINNER)
    nocdyn.write("bad.nml", BAD)
    nocdyn.write("exploding.nml", EXPLODING)
    outcome = nocdyn("run", *files)
    assert outcome.returncode == code
    assert nocdyn.files("results/good") == RESULTS
    assert outcome.stdout.splitlines()[-1].startswith("good.nml: done at t = 1 s")
    for name in files[:-1]:
        assert sum(name in line for line in outcome.stderr.splitlines()) == 1
    assert not (nocdyn.folder / "results/bad").exists()


@pytest.mark.parametrize("options", [[], ["--out", "out"]])
def test_two_files_with_one_folder_are_refused(nocdyn, options):
    nocdyn.write("a/same.nml", SPINNER)
    nocdyn.write("b/same.nml", SPINNER)
    outcome = nocdyn("run", "a/same.nml", "b/same.nml", *options)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    folder = "out/same" if options else "results/same"
    assert outcome.stderr == f"nocdyn: 'a/same.nml' and 'b/same.nml' would both write to '{folder}'; nothing was run\n"
    assert not (nocdyn.folder / folder).exists()


def test_a_bad_file_does_not_claim_a_folder(nocdyn):
    nocdyn.write("a/same.nml", BAD)
    nocdyn.write("b/same.nml", SPINNER)
    assert nocdyn("run", "a/same.nml", "b/same.nml").returncode == 2
    assert nocdyn.files("results/same") == RESULTS


@pytest.mark.parametrize(("out", "folder"), [("./a//b/./", "a/b"), ("./", "."), ("a/../b", "a/../b")])
def test_a_result_folder_is_named_plainly(nocdyn, spinner, out, folder):
    assert nocdyn("run", spinner, "--out", out).stdout.splitlines()[-1].endswith(f"results in {folder}")
    assert (nocdyn.folder / folder / "trajectory.csv").exists()


def test_two_spellings_of_a_folder_are_one_folder(nocdyn, spinner):
    for name, folder in (("plain", "x"), ("dotted", "./x/")):
        nocdyn.write(f"{name}.nml", spinner.read_text().replace("&output", f"&output directory = '{folder}'"))
    outcome = nocdyn("run", "plain.nml", "dotted.nml")
    assert outcome.returncode == 2 and "would both write to 'x'; nothing was run" in outcome.stderr


def test_the_table_of_a_large_machine_stops_and_says_so(nocdyn):
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(40))
    nocdyn.write("many.nml", bodies + "&run t_end = 1.0 /\n&output points = 2 /\n")
    lines = nocdyn("run", "many.nml").stdout.splitlines()
    assert lines[-2] == "(60 more columns: summary.json has all; &output columns = 'omega_*', for instance, chooses)"
    assert len(lines) == 29  # with the note that nothing moves the bodies
