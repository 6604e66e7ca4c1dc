"""--set PATH=VALUE."""

import f90nml
import pytest
from conftest import CASE_2


def used(nocdyn, *overrides):
    words = [word for override in overrides for word in ("--set", override)]
    outcome = nocdyn("run", CASE_2, "--out", "out", "-q", *words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return f90nml.read(nocdyn.folder / "out/input.nml")


def test_a_key_of_a_single_group_is_set(nocdyn):
    assert used(nocdyn, "run.rtol=1e-5")["run"]["rtol"] == 1e-5


def test_keys_of_named_groups_are_set(nocdyn):
    machine = used(nocdyn, "load.work.viscous=80", "gear.reducer.radii=4,3", "body.motor.inertia=1d1")
    assert machine["load"]["viscous"] == 80
    assert machine["gear"]["radii"] == [4, 3]
    assert machine["body"][0]["inertia"] == 10


def test_texts_are_set_with_and_without_quotes(nocdyn):
    assert used(nocdyn, "case.title=soft shaft")["case"]["title"] == "soft shaft"
    assert used(nocdyn, "case.title='soft shaft'")["case"]["title"] == "soft shaft"


def test_a_key_that_the_file_does_not_have_is_set(nocdyn):
    assert used(nocdyn, "run.complement=scaled")["run"]["complement"] == "scaled"


def test_an_override_changes_the_result(nocdyn):
    nocdyn("run", CASE_2, "--out", "plain", "-q")
    nocdyn("run", CASE_2, "--out", "changed", "-q", "--set", "load.work.viscous=80")
    plain, changed = (nocdyn.summary(folder)["columns"]["omega_motor [rad/s]"]["last"] for folder in ("plain", "changed"))
    assert changed > plain + 0.1


def test_an_override_applies_to_every_file(nocdyn, spinner):
    nocdyn("run", CASE_2, spinner, "--out", "out", "--set", "run.t_end=0.5")
    assert [nocdyn.summary(f"out/{name}")["time_reached"] for name in ("case2", "spinner")] == [0.5, 0.5]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("run.rtol", "there is no = in it; write PATH=VALUE"),
        ("run.rtol=", "there is no value after the ="),
        ("=1e-3", "there is no path before the =; write GROUP.KEY=VALUE or GROUP.NAME.KEY=VALUE"),
        ("body.motor.name=rotor", "a name cannot be overridden: other groups refer to it"),
        ("run.max_steps=100000001", "max_steps = 100000001 is out of range; allowed: 1 to 1e+08"),
        ("rtol=1e-3", "there is no dot in rtol; write GROUP.KEY=VALUE or GROUP.NAME.KEY=VALUE"),
        ("runn.rtol=1e-3", "there is no group 'runn'; did you mean 'run'?"),
        ("run.rtoll=1e-3", "rtoll is not a key of &run; did you mean 'rtol'?"),
        ("run.main.rtol=1e-3", "&run has no name; write run.rtol=VALUE"),
        ("body.inertia=3", "&body may occur several times; write body.NAME.inertia=VALUE"),
        ("load.wrok.viscous=80", "there is no &load 'wrok'; did you mean 'work'?"),
        ("load.work.viscous=-1", "viscous = -1 is out of range; allowed: >= 0"),
        ("load.work.viscous=much", "viscous = much is not a number"),
        ("gear.reducer.radii=1,2,3", "radii has 3 values (1, 2, 3); allowed: 2"),
        ("run.method=euler", "'auto', 'rk45', 'rk853', 'rosenbrock', 'rodas4', 'rodas5p', 'taylor'"),
        ("motor.drive.body=moter", "there is no &body 'moter'; did you mean 'motor'?"),
    ],
)
def test_a_wrong_override_is_refused_by_what_was_typed(nocdyn, override, message):
    outcome = nocdyn("run", CASE_2, "--set", override)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith(f"nocdyn: --set {override}: ")
    assert message in outcome.stderr
    assert list(nocdyn.folder.iterdir()) == []


def test_all_wrong_overrides_are_reported_together(nocdyn):
    outcome = nocdyn("check", CASE_2, "--set", "runn.rtol=1", "--set", "run.rtol=x", "--set", "load.work.viscous=-1")
    assert outcome.returncode == 2
    assert outcome.stderr.count("--set ") == 3


@pytest.mark.parametrize(
    ("value", "shown", "message"),
    [
        ("a\x7fb", r"a\x7Fb", "a control character (code 127) does not belong in an input file"),
        ("a\nb", "a b", "a line end does not belong in a value"),
    ],
)
def test_what_no_input_file_can_hold_is_refused(nocdyn, value, shown, message):
    outcome = nocdyn("run", CASE_2, "--set", f"case.title={value}")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"nocdyn: --set case.title={shown}: {message}\n"
    assert list(nocdyn.folder.iterdir()) == []
