"""Commands, options and what they print."""

import re

import f90nml
import pytest
from conftest import CASE_1, CASE_2, SOURCE


def one_line(text):
    return text.endswith("\n") and text.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "a command is missing"),
        (
            ["rnu", "x.nml"],
            "'rnu' is not a command; did you mean 'run'? "
            "allowed: 'run', 'check', 'equilibrium', 'modes', 'response', 'campbell', 'sensitivity', 'fit', 'orbit', 'transit', "
            "'matrices', 'sweep', 'optimise', 'merge', 'plot', 'report', 'fmu', 'import', 'verify', 'new', 'help'",
        ),
        (["simulate"], "'simulate' is not a command"),
        (["x" * 3000], "'" + "x" * 80 + " ...' is not a command; allowed: "),
        (["run"], "an input file is missing: nocdyn run FILE..."),
        (["check"], "an input file is missing: nocdyn check FILE..."),
        (["equilibrium"], "an input file is missing: nocdyn equilibrium FILE..."),
        (["modes"], "an input file is missing: nocdyn modes FILE..."),
        (["matrices"], "exactly one file is needed: nocdyn matrices FILE"),
        (["matrices", CASE_1, CASE_2], "exactly one file is needed: nocdyn matrices FILE"),
        (["new"], "exactly one file is needed: nocdyn new FILE"),
        (["run", CASE_1, "--ouy", "x"], "'--ouy' is not an option"),
        (["run", CASE_1, "--ouy", "x"], "did you mean '--out'?"),
        (
            ["sweep", CASE_1, "--resum"],
            "'--resum' is not an option of nocdyn sweep; did you mean '--resume'? "
            "allowed: '--out', '--set', '--case', '--threads', '--compile', '--shard', '--resume', '--csv', '--quiet', "
            "'--help'\n",
        ),
        (["new", "a.nml", "--force"], "'--force' is not an option of nocdyn new; allowed: '--kind', '--help'\n"),
        (["run", CASE_1, "--out"], "--out needs a value: --out DIR\n"),
        (["run", CASE_1, "--out="], "--out needs a value: --out DIR\n"),
        (["run", CASE_1, "--set"], "--set needs a value: --set PATH=VALUE\n"),
        (["run", CASE_1, "--out", "a", "--out", "b"], "--out is given twice"),
        (["run", CASE_1, "--quiet=yes"], "--quiet takes no value"),
        (
            ["new", "a.nml", "--out", "a"],
            "--out is an option of nocdyn run, check, equilibrium, modes, response, campbell, sensitivity, fit, orbit, "
            "transit, sweep and optimise",
        ),
        (["modes", CASE_1, "--at"], "--at needs a value: --at equilibrium|rest|TIME\n"),
        (["modes", CASE_1, "--at", "rest", "--at=0"], "--at is given twice"),
        (["equilibrium", CASE_1, "--at", "rest"], "--at is an option of nocdyn modes and sensitivity"),
        (
            ["modes", CASE_1, "--quiet"],
            "--quiet is an option of nocdyn run, response, campbell, fit, orbit, transit, sweep, optimise and merge",
        ),
        (
            ["check", CASE_1, "--quiet"],
            "--quiet is an option of nocdyn run, response, campbell, fit, orbit, transit, sweep, optimise and merge",
        ),
        (
            ["new", "a.nml", "--set", "run.t_end=1"],
            "--set is an option of nocdyn run, check, equilibrium, modes, response, campbell, sensitivity, fit, orbit, "
            "transit, matrices, sweep and optimise",
        ),
        (["--version", "now"], "--version takes no arguments"),
        (["help", "gear"], "'gear' is a group of the input: nocdyn help input gear"),
        (["help", "torques"], "'torques' is a topic of the input: nocdyn help input torques"),
        (["--versoin"], "'--versoin' is not a command; did you mean '--version'?"),
        (
            ["help", "simulate"],
            "there is no help on 'simulate'; "
            "try 'run', 'check', 'equilibrium', 'modes', 'response', 'campbell', 'sensitivity', 'fit', 'orbit', 'transit', "
            "'matrices', 'sweep', 'optimise', 'merge', 'plot', 'report', 'fmu', 'import', 'verify', 'new', 'help' or 'input'",
        ),
        (["help", "input", "boddy"], "there is no topic or group 'boddy'; did you mean 'body'?\n"),
        (["help", "input", "torsionel"], "there is no topic or group 'torsionel'; did you mean 'torsional'?\n"),
        (["help", "input", "x" * 3000], "there is no topic or group '" + "x" * 80 + " ...'; 'nocdyn help input' lists them\n"),
        (["help", "input", "gear", "mesh"], "'nocdyn help input' takes one topic or group; here 'gear', 'mesh'\n"),
    ],
)
def test_wrong_usage_is_refused_with_code_2(nocdyn, words, message):
    outcome = nocdyn(*words)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert message in outcome.stderr
    assert one_line(outcome.stderr) and outcome.stderr.startswith("nocdyn: ")
    assert list(nocdyn.folder.iterdir()) == []


@pytest.mark.parametrize("words", [["help"], ["--help"], ["-h"]])
def test_help_names_every_command_and_the_exit_codes(nocdyn, words):
    outcome = nocdyn(*words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    commands = ("run", "check", "equilibrium", "modes", "matrices", "new")
    for command in (*(f"{command} FILE" for command in commands), "help [COMMAND]", "help input", "--version"):
        assert f"nocdyn {command}" in outcome.stdout
    assert "0 done, 1 a computation failed, 2 wrong usage or input, 3 a file cannot be read or written" in outcome.stdout


@pytest.mark.parametrize("command", ["run", "check", "equilibrium", "modes", "matrices", "new", "help"])
def test_every_command_has_help_by_two_ways(nocdyn, command):
    by_command = nocdyn("help", command)
    assert by_command.returncode == 0
    assert by_command.stdout.startswith(f"nocdyn {command}")
    assert nocdyn(command, "--help").stdout == by_command.stdout


COMMANDS = ["run", "check", "equilibrium", "modes", "matrices", "sweep", "merge", "new", "help"]
OPTIONS = {
    "--out": "a",
    "--set": "a=1",
    "--case": "a",
    "--variant": "a",
    "--at": "rest",
    "--modes": "1",
    "--range_hz": "1,2",
    "--peaks": None,
    "--holzer": None,
    "--kind": "ship",
    "--threads": "1",
    "--shard": "1/2",
    "--compile": "never",
    "--code": None,
    "--json": None,
    "--resume": None,
    "--csv": None,
    "--strict": None,
    "--quiet": None,
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_takes_the_options_that_its_help_names_and_no_others(nocdyn, command):
    help_text = nocdyn("help", command).stdout
    usage = help_text.split("\n\n")[0]
    named = set(re.findall(r"(?<!\S)\[?(--[a-z_]+)", usage))
    assert named <= set(OPTIONS)
    assert set(re.findall(r"^  (--[a-z_]+)", help_text, re.MULTILINE)) <= named
    for option, value in OPTIONS.items():
        words = [option] if value is None else [option, value]
        message = nocdyn(command, "missing", *words).stderr
        assert (f"{option} is an option of nocdyn " in message) == (option not in named), (option, message)


def test_help_on_run_names_its_options(nocdyn):
    text = nocdyn("help", "run").stdout
    assert all(option in text for option in ("--out DIR", "--set PATH=VALUE", "--quiet"))


def test_help_on_all_names_every_group_and_key_that_a_run_writes(nocdyn):
    nocdyn("run", CASE_2, "--out", "out", "-q")
    text = nocdyn("help", "input", "all").stdout
    overview = nocdyn("help", "input").stdout
    for kind, values in f90nml.read(nocdyn.folder / "out/input.nml").items():
        assert f"&{kind}" in text and f"\n  &{kind} " in overview
        for group in values if isinstance(values, list) else [values]:
            assert all(re.search(rf"^ +{key} ", text, re.MULTILINE) for key in group)


def test_every_topic_and_group_of_the_overview_has_help(nocdyn):
    overview = nocdyn("help", "input").stdout
    topics = re.findall(r"^(\w+): ", overview, re.MULTILINE)
    assert len(topics) >= 5 and all(f"help input {word}" in overview for word in ("TOPIC", "GROUP", "all"))
    for topic in topics:
        groups = re.findall(r"^  &(\w+)", re.search(rf"^{topic}: .*?\n\n", overview, re.MULTILINE | re.DOTALL)[0], re.MULTILINE)
        text = nocdyn("help", "input", topic).stdout
        assert re.findall(r"^&(\w+), ", text, re.MULTILINE) == groups
        for group in groups:
            assert nocdyn("help", "input", group).stdout.split("\n\nExample")[0] in text


@pytest.mark.parametrize("group", ["gear", "&gear", "GEAR"])
def test_help_on_a_group_shows_its_keys_and_no_others(nocdyn, group):
    text = nocdyn("help", "input", group).stdout
    assert "radii" in text and "teeth" in text and "cubic_stiffness" not in text


def test_the_version_is_that_of_the_build(nocdyn):
    declared = re.search(r"project\(nocdyn VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
    outcome = nocdyn("--version")
    assert outcome.returncode == 0
    assert outcome.stdout.split()[:2] == ["nocdyn", declared]
    assert nocdyn("-V").stdout == outcome.stdout


def test_new_writes_an_input_that_runs(nocdyn):
    outcome = nocdyn("new", "mine.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "nocdyn run mine.nml" in outcome.stdout
    assert nocdyn("run", "mine.nml", "-q").returncode == 0
    assert nocdyn.files("results/mine") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]


def test_new_explains_every_key(nocdyn):
    nocdyn("new", "mine.nml")
    comments = [line for line in (nocdyn.folder / "mine.nml").read_text().splitlines() if line.startswith("!")]
    for key in ("inertia", "cubic_stiffness", "teeth", "viscous", "max_steps", "directory"):
        assert any(line.startswith(f"!     {key} ") for line in comments)


def test_new_makes_the_folder(nocdyn):
    assert nocdyn("new", "machines/small/mine.nml").returncode == 0
    assert nocdyn("check", "machines/small/mine.nml").returncode == 0
    assert nocdyn.files("machines/small") == ["mine.nml"]


def test_new_leaves_a_file_that_exists_alone(nocdyn):
    nocdyn.write("mine.nml", "precious")
    outcome = nocdyn("new", "mine.nml")
    assert (outcome.returncode, outcome.stdout) == (3, "")
    assert outcome.stderr == "nocdyn: 'mine.nml' exists and was not changed\n"
    assert (nocdyn.folder / "mine.nml").read_text() == "precious"


def test_check_reports_the_machine_and_integrates_nothing(nocdyn):
    outcome = nocdyn("check", CASE_1, CASE_2)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    for path in (CASE_1, CASE_2):
        assert f"{path}: 3 bodies, 1 gear, 1 coupling, 1 motor, 1 load, 1 excitation\n" in outcome.stdout
    assert outcome.stdout.count("2 degrees of freedom") == 2
    assert outcome.stdout.count("speed of 'machine' = -0.6666667 * speed of 'pinion'") == 2
    assert list(nocdyn.folder.iterdir()) == []


def test_check_goes_on_past_a_bad_file(nocdyn):
    outcome = nocdyn("check", "absent.nml", CASE_1)
    assert outcome.returncode == 3
    assert "absent.nml: cannot be read: there is no such file" in outcome.stderr
    assert str(CASE_1) in outcome.stdout


def test_a_file_whose_name_looks_like_an_option_comes_after_two_dashes(nocdyn, spinner):
    spinner.rename(nocdyn.folder / "--odd.nml")
    assert nocdyn("check", "--odd.nml").returncode == 2
    assert nocdyn("check", "--", "--odd.nml").returncode == 0


def test_an_input_may_come_through_a_pipe(nocdyn):
    outcome = nocdyn("run", "/dev/stdin", input=CASE_2.read_text())
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert nocdyn.files("results/stdin") == ["columns.json", "input.nml", "summary.json", "trajectory.csv"]


def test_a_chain_of_ten_thousand_bodies_is_checked(nocdyn):
    bodies = 10000
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(bodies)]
    lines += [f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1.0 /" for i in range(0, bodies - 1, 2)]
    lines += [f"&gear name = 'g{i}' bodies = 'b{i}', 'b{i + 1}' radii = 1, 2 /" for i in range(1, bodies - 1, 2)]
    nocdyn.write("chain.nml", "\n".join([*lines, "&run t_end = 1.0 /\n"]))
    outcome = nocdyn("check", "chain.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "10000 bodies, 4999 gears, 5000 couplings" in outcome.stdout
    assert "5001 degrees of freedom" in outcome.stdout


def test_output_that_cannot_be_written_is_not_a_success(nocdyn):
    with open("/dev/full", "w") as full:
        outcome = nocdyn.start("help", stdout=full)
        assert outcome.communicate()[1] == "nocdyn: standard output cannot be written\n"
    assert outcome.returncode == 3


def test_every_mistake_is_a_line_with_the_program_and_the_place(nocdyn):
    nocdyn.write("bad.nml", "&body name = 'a' inertia = -1 /\n&run t_end = 1.0 methd = 'rk45' /\n")
    outcome = nocdyn("check", "bad.nml")
    first, second = outcome.stderr.splitlines()
    assert first.startswith("nocdyn: bad.nml:1: &body 'a': inertia = -1 is out of range")
    assert second.startswith("nocdyn: bad.nml:2: &run: methd is not a key of &run; did you mean 'method'?")
