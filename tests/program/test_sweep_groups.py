"""Inputs with the groups of a sweep: &sweep, &vary, &record."""

import re

import pytest
from conftest import CASE_2, DATA, SPINNER

VARIED = DATA / "varied_machine.nml"
SWEEP = "&sweep design = 'random' samples = 9 /\n"
VARY = "&vary target = 'load.drag.viscous' low = 0.1 high = 0.9 /\n"
RECORD = "&record quantity = 'omega_disc' statistic = 'final' /\n"


def test_a_run_takes_the_machine_as_it_is(nocdyn):
    machine = nocdyn.write("machine.nml", VARIED.read_text().split("&sweep")[0])
    assert nocdyn("run", VARIED, "--out", "varied", "-q").returncode == 0
    assert nocdyn("run", machine, "--out", "alone", "-q").returncode == 0
    varied, alone = ((nocdyn.folder / folder / "trajectory.csv").read_bytes() for folder in ("varied", "alone"))
    assert varied == alone


def test_the_input_of_the_results_can_be_run_again(nocdyn):
    nocdyn("run", VARIED, "--out", "first", "-q")
    nocdyn("run", "first/input.nml", "--out", "second", "-q")
    first, second = ((nocdyn.folder / folder / "input.nml").read_text() for folder in ("first", "second"))
    assert first == second
    assert [first.count(f"\n&{group}\n") for group in ("sweep", "vary", "record")] == [1, 3, 2]


@pytest.mark.parametrize("command", ["matrices", "modes", "equilibrium"])
def test_other_commands_take_the_machine_as_it_is(nocdyn, command):
    outcome = nocdyn(command, VARIED)
    alone = nocdyn(command, nocdyn.write("varied_machine.nml", VARIED.read_text().split("&sweep")[0]))
    assert (outcome.returncode, outcome.stderr) == (alone.returncode, alone.stderr)
    assert outcome.stdout.replace(str(VARIED), "") == alone.stdout.replace(str(nocdyn.folder / "varied_machine.nml"), "")


def test_a_new_input_is_an_ordinary_machine_and_explains_sweeps(nocdyn):
    nocdyn("new", "new.nml")
    text = (nocdyn.folder / "new.nml").read_text()
    assert not re.search(r"^&(sweep|vary|record)", text, re.MULTILINE)
    assert all(f"! &{group}, " in text for group in ("sweep", "vary", "record"))


@pytest.mark.parametrize(
    ("group", "parts"),
    [
        (
            "sweep",
            ["  design = 'latin': ", "    samples                whole number, 1 to 2e+09               required", "'list'"],
        ),
        ("vary", ["    low                    number, any value                      required by 'uniform'", "'lognormal'"]),
        ("record", ["  statistic = 'settling_time': ", "quantity, fatigue, mode, response and orbit need statistic."]),
    ],
)
def test_help_explains_the_groups(nocdyn, group, parts):
    outcome = nocdyn("help", "input", group)
    assert outcome.returncode == 0
    assert all(part in outcome.stdout for part in parts)
    assert f"\n&{group} " in outcome.stdout.split("Example")[1]


@pytest.mark.parametrize(
    ("groups", "complaint"),
    [
        ("&sweep samples = 3 /", "&sweep: design is missing; needed: 'grid', 'random', 'latin', 'sobol', 'list'"),
        ("&sweep design = 'rnd' /", "&sweep: design = 'rnd' is not known; allowed: 'grid', 'random', "),
        ("&sweep design = 'random' /", "&sweep: samples is missing; needed: 1 to 2e+09"),
        ("&sweep design = 'random' samples = 0 /", "&sweep: samples = 0 is out of range; allowed: 1 to 2e+09"),
        ("&sweep design = 'sobol' samples = 2000000001 /", "&sweep: samples = 2000000001 is out of range; allowed: 1 to 2e+09"),
        ("&sweep design = 'random' samples = 3 seed = -1 /", "&sweep: seed = -1 is out of range; allowed: >= 0"),
        (
            "&sweep design = 'grid' samples = 3 /",
            "samples belongs to design = 'random', 'latin' or 'sobol'; here design = 'grid'",
        ),
        ("&sweep design = 'list' /", "&sweep: file is missing; needed: path of a file"),
        ("&sweep design = 'grid' file = 'x' /", "&sweep: file belongs to design = 'list'; here design = 'grid'"),
        ("&sweep design = 'grid' / &sweep design = 'grid' /", "&sweep: given twice, first on line 5; allowed: at most once"),
        ("&vary low = 1 high = 2 /", "&vary: target is missing; needed: any text"),
        ("&vary target = 'run.t_end' high = 2 /", "&vary: low is missing; needed: any value"),
        ("&vary target = 'run.t_end' low = 2 high = 1 /", "&vary: high = 1 is out of range; allowed: > low = 2"),
        ("&vary target = 'run.t_end' low = 2 high = 1 count = 3 /", "&vary: high = 1 is out of range; allowed: > low = 2"),
        ("&vary target = 'run.t_end' low = 2 high = 1 count = 1 /", "&vary: high = 1 is out of range; allowed: >= low = 2"),
        ("&vary target = 'run.t_end' low = 1 high = 2 count = 0 /", "&vary: count = 0 is out of range; allowed: >= 1"),
        (
            "&vary target = 'run.t_end' low = 1 high = 2 mean = 1 /",
            "mean belongs to distribution = 'normal'; here distribution = 'uniform', the default",
        ),
        ("&vary target = 'run.t_end' distribution = 'normal' mean = 1 /", "&vary: deviation is missing; needed: > 0"),
        (
            "&vary target = 'run.t_end' distribution = 'normal' mean = 1 sigma = 2 /",
            "sigma is not a key of &vary; did you mean 'deviation' or 'log_deviation'?",
        ),
        (
            "&vary target = 'run.t_end' distribution = 'lognormal' mu = 1 log_deviation = 2 /",
            "mu is not a key of &vary; did you mean 'mean' or 'median'?",
        ),
        ("&vary target = 'run.t_end' min = 1 high = 2 /", "min is not a key of &vary; did you mean 'low'?"),
        ("&sweep design = 'random' n = 3 /", "&sweep: n is not a key of &sweep; did you mean 'samples'?"),
        ("&record column = 'x' statistic = 'max' /", "column is not a key of &record; did you mean 'quantity'?"),
        (
            "&vary target = 'run.t_end' distribution = 'gauss' /",
            "distribution = 'gauss' is not known; allowed: 'uniform', 'normal', 'lognormal'",
        ),
        (
            "&vary target = 'run.t_end' distribution = 'lognormal' median = 0 log_deviation = 1 /",
            "median = 0 is out of range; allowed: > 0",
        ),
        ("&record quantity = 'x' /", "&record: quantity needs statistic"),
        ("&record statistic = 'max' /", "&record: statistic needs quantity"),
        (
            "&record quantity = 'x' statistic = 'max', 'maximum' /",
            "&record: statistic(2) = 'maximum' is not known; allowed: 'final', 'max', ",
        ),
        (
            "&record quantity = 'x' statistic = 'max', 'min' band = 0.1 /",
            "band belongs to statistic = 'settling_time'; here statistic = 'max', 'min'",
        ),
        ("&record trajectories = 1 band = 0.1 /", "&record: band belongs to statistic = 'settling_time'; here is no statistic"),
        ("&record quantity = 'x' statistic = 'settling_time' band = 0 /", "&record: band = 0 is out of range; allowed: > 0"),
        ("&record trajectories = 1 from = 2 /", "&record: from needs quantity"),
        ("&record trajectories = 1, 0 /", "&record: trajectories(2) = 0 is out of range; allowed: >= 1"),
        ("&record trajectories = 1.5 /", "&record: trajectories(1) = 1.5 is not a whole number; allowed: >= 1"),
    ],
)
def test_groups_that_make_no_sense_are_refused_by_every_command(nocdyn, groups, complaint):
    outcome = nocdyn("check", nocdyn.write("m.nml", SPINNER + groups))
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith("nocdyn: m.nml:5: &") or outcome.stderr.startswith(f"nocdyn: {nocdyn.folder}/m.nml:5: &")
    assert complaint in outcome.stderr
    assert outcome.stderr.count("\n") == 1


def test_a_misspelt_group_has_a_near_match(nocdyn):
    outcome = nocdyn("check", nocdyn.write("m.nml", SPINNER + "&swep design = 'grid' /"))
    assert "&swep: there is no such group; did you mean 'sweep'?" in outcome.stderr


def test_keys_of_the_sweep_are_set_on_the_command_line(nocdyn):
    path = nocdyn.write("m.nml", SPINNER + SWEEP + VARY + RECORD)
    assert nocdyn("run", path, "--out", "out", "-q", "--set", "sweep.samples=12", "--set", "sweep.design=sobol").returncode == 0
    assert "  design = 'sobol'\n  samples = 12\n" in (nocdyn.folder / "out/input.nml").read_text()


def test_another_design_on_the_command_line_displaces_the_keys_of_the_old_one(nocdyn):
    path = nocdyn.write("m.nml", SPINNER + SWEEP + VARY + RECORD)
    assert nocdyn("run", path, "--out", "out", "-q", "--set", "sweep.design=grid").returncode == 0
    assert "&sweep\n  design = 'grid'\n/" in (nocdyn.folder / "out/input.nml").read_text()


@pytest.mark.parametrize("override", ["vary.low=1", "vary.x.low=1", "record.from=1"])
def test_groups_without_names_are_not_reached_without_their_number(nocdyn, override):
    outcome = nocdyn("check", VARIED, "--set", override)
    assert outcome.returncode == 2
    group, key = override.split(".")[0], override.split(".")[-1][:-2]
    assert (
        outcome.stderr
        == f"nocdyn: --set {override}: &{group} has no name; write {group}(1).{key}=VALUE for the first one in the file\n"
    )


def test_groups_without_names_are_reached_by_their_number(nocdyn):
    words = (
        "--set",
        "vary(2).mean=2",
        "--set",
        "record(1).statistic=max",
        "--set",
        "sweep.samples=7",
        "--set",
        "record(2).trajectories=5",
    )
    assert nocdyn("run", VARIED, "--out", "out", "-q", *words).returncode == 0
    text = (nocdyn.folder / "out/input.nml").read_text()
    assert all(line in text for line in ("  mean = 2\n", "  statistic = 'max'\n", "  samples = 7\n", "  trajectories = 5\n"))


def test_an_override_of_a_sweep_that_is_not_there_tells_what_is_missing(nocdyn):
    outcome = nocdyn("check", CASE_2, "--set", "sweep.samples=3")
    assert outcome.returncode == 2
    assert "&sweep: design is missing" in outcome.stderr
