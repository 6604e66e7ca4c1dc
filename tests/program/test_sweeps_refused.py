"""Sweeps that cannot be: every mistake of their groups with file, line and what is allowed, in one go."""

import pytest
from conftest import SPINNER

GROUPS = {
    "sweep": "&sweep design = 'random' samples = 9 /\n",
    "vary": "&vary target = 'load.drag.viscous' low = 0.1 high = 0.9 /\n",
    "record": "&record quantity = 'omega_disc' statistic = 'final' /\n",
}


def refusal(nocdyn, **groups):
    """What `nocdyn sweep` says of the spinner with some groups replaced; the first of them is on line 5."""
    path = nocdyn.write("m.nml", SPINNER + "".join((GROUPS | groups).values()))
    outcome = nocdyn("sweep", path, "--out", "out")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert not (nocdyn.folder / "out").exists()
    return outcome.stderr.replace(f"{nocdyn.folder}/", "")


@pytest.mark.parametrize(
    ("groups", "complaint"),
    [
        ({"sweep": ""}, "m.nml: there is no &sweep; 'nocdyn help input sweep' shows one"),
        ({"vary": ""}, "m.nml:5: &sweep: design = 'random' has nothing to vary; needed: a &vary"),
        (
            {"record": ""},
            "m.nml:5: &sweep: no number of the variants is kept; needed: a &record with quantity, fatigue, mode, response, "
            "orbit or path",
        ),
        (
            {"record": "&record /"},
            "m.nml:7: &record: there is nothing to record; needed: quantity, fatigue, mode, response, orbit, path or "
            "trajectories",
        ),
        (
            {"vary": "&vary target = 'load.drag.viscus' low = 0 high = 1 /\n"},
            "m.nml:6: &vary: target = 'load.drag.viscus': viscus is not a key of &load; did you mean 'viscous'?",
        ),
        (
            {"vary": "&vary target = 'run.method' low = 0 high = 1 /\n"},
            "m.nml:6: &vary: target = 'run.method': method is not a number (word); "
            "allowed: t_start, t_end, rtol, atol, start_speed, max_steps",
        ),
        (
            {"vary": "&vary target = 'load.drag.constant_speed' low = 1 high = 2 /\n"},
            "m.nml:6: &vary: target = 'load.drag.constant_speed': constant_speed needs constant",
        ),
        (
            {"record": "&record quantity = 'omega_disk' statistic = 'max' /\n"},
            "m.nml:7: &record: quantity = 'omega_disk' is no column of trajectory.csv; did you mean 'omega_disc'?",
        ),
        (
            {"record": "&record quantity = 'speed_disc' statistic = 'max' /\n"},
            "m.nml:7: &record: quantity = 'speed_disc' is no column of trajectory.csv, which has 'phi_disc', 'omega_disc'",
        ),
        (
            {"vary": "&vary target = 'drag.viscous' low = 0 high = 1 /\n"},
            "m.nml:6: &vary: target = 'drag.viscous': there is no group 'drag'; did you mean 'load.drag.viscous'?",
        ),
        (
            {"record": "&record quantity = 'omega_disc' statistic = 'max' from = 1 /\n"},
            "m.nml:7: &record: from = 1 is out of range; allowed: < t_end = 1",
        ),
        (
            {"record": GROUPS["record"] + "&record trajectories = 10 /\n"},
            "m.nml:8: &record: trajectories(1) = 10 is out of range; allowed: 1 to 9, the number of variants",
        ),
    ],
)
def test_a_sweep_that_cannot_be_is_refused(nocdyn, groups, complaint):
    assert refusal(nocdyn, **groups) == f"nocdyn: {complaint}\n"


def test_all_mistakes_of_a_sweep_are_told_in_one_go(nocdyn):
    message = refusal(
        nocdyn,
        sweep="&sweep design = 'grid' /\n",
        vary=GROUPS["vary"].replace("drag", "drg"),
        record="&record quantity = 'omega' statistic = 'rms' from = -1 /\n",
    )
    places = ["m.nml:6: &vary: target", "m.nml:6: &vary: count", "m.nml:7: &record: quantity", "m.nml:7: &record: from"]
    assert [line.split(" = ")[0].removesuffix(" is missing; design") for line in message.splitlines()] == [
        f"nocdyn: {place}" for place in places
    ]


def mistaken_keys(message):
    return [line.removeprefix("nocdyn: ").split(" = ")[0] for line in message.splitlines()]


def test_a_wrong_design_does_not_hide_other_mistakes(nocdyn):
    record = "&record quantity = 'omega_disk' statistic = 'final' /\n&record quantity = 'omega' statistic = 'maxi' /\n"
    groups = {
        "sweep": "&sweep design = 'sobal' samples = 9 /\n",
        "vary": "&vary target = 'load.drag.viscus' low = 2 high = 1 /\n",
        "record": record,
    }
    assert mistaken_keys(refusal(nocdyn, **groups)) == [
        "m.nml:5: &sweep: design",
        "m.nml:6: &vary: high",
        "m.nml:6: &vary: target",
        "m.nml:7: &record: quantity",
        "m.nml:8: &record: statistic(1)",
        "m.nml:8: &record: quantity",
    ]
    message = refusal(nocdyn, **groups)
    assert nocdyn("check", "m.nml").stderr == message


def test_quantities_are_not_judged_before_it_is_known_what_varies(nocdyn):
    damping = "&record quantity = 'omega' statistic = 'final' /\n"
    assert mistaken_keys(refusal(nocdyn, sweep="&sweep design = 'lst' file = 'list.csv' /\n", vary="", record=damping)) == [
        "m.nml:5: &sweep: design"
    ]


def test_a_mistake_in_the_machine_is_told_without_those_that_need_the_machine(nocdyn):
    path = nocdyn.write(
        "m.nml", SPINNER.replace("2.0", "-2.0") + GROUPS["sweep"] + GROUPS["vary"] + GROUPS["record"].replace("disc", "disk")
    )
    outcome = nocdyn("sweep", path, "--out", "out")
    assert mistaken_keys(outcome.stderr.replace(f"{nocdyn.folder}/", "")) == ["m.nml:1: &body 'disc': inertia"]


def test_a_list_is_refused_with_its_own_file_and_line(nocdyn):
    nocdyn.write("list.csv", "load.drag.viscous, body.disc.name\n0.5, 1\n0.5\n")
    message = refusal(nocdyn, sweep="&sweep design = 'list' file = 'list.csv' /\n", vary="")
    assert message == (
        "nocdyn: m.nml:5: &sweep: file: list.csv:3: 1 column in '0.5'; needed: 2, separated by blanks or a comma\n"
        "nocdyn: m.nml:5: &sweep: file: list.csv:1: column 2, 'body.disc.name': name is not a number (name); "
        "allowed: inertia, entrained, bearing_friction, angle, speed\n"
    )


def test_a_list_may_have_semicolons_and_decimal_commas(nocdyn):
    record = GROUPS["record"] + "&sweep design = 'list' file = 'list.csv' /\n"
    swept = []
    for text in ('"load.drag.viscous";"run.t_end"\n0,5;1\n0,75;2\n', "load.drag.viscous, run.t_end\n0.5, 1\n0.75, 2\n"):
        nocdyn.write("list.csv", text)
        outcome = nocdyn("sweep", nocdyn.write("m.nml", SPINNER + record), "--out", f"out{len(swept)}", "--csv")
        assert outcome.returncode == 0, outcome.stderr
        swept.append((nocdyn.folder / f"out{len(swept)}/sweep.csv").read_text())
    assert swept[0] == swept[1]


def test_columns_of_a_table_of_results_are_a_list(nocdyn):
    path = nocdyn.write("m.nml", SPINNER + "".join(GROUPS.values()))
    assert nocdyn("sweep", path, "--out", "out", "--csv").returncode == 0
    rows = [line.split(",") for line in (nocdyn.folder / "out/sweep.csv").read_text().splitlines()]
    nocdyn.write("list.csv", "".join(f"{row[1]}\n" for row in rows))
    again = nocdyn.write("again.nml", SPINNER + "&sweep design = 'list' file = 'list.csv' /\n" + GROUPS["record"])
    assert nocdyn("sweep", again, "--out", "again", "--csv").returncode == 0
    assert [line.split(",")[:3] for line in (nocdyn.folder / "again/sweep.csv").read_text().splitlines()] == [
        row[:3] for row in rows
    ]


@pytest.mark.parametrize("command", ["sweep", "check"])
def test_an_override_of_a_number_that_varies_is_refused(nocdyn, command):
    path = nocdyn.write("m.nml", SPINNER + "".join(GROUPS.values()))
    outcome = nocdyn(command, path, "--set", "load.drag.viscous=0.3")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == (
        "nocdyn: --set load.drag.viscous=0.3: has no effect on a sweep: the &vary on line 6 gives this number its values; "
        "to change those, write vary(1).KEY=VALUE\n"
    )
    assert nocdyn(command, path, "--set", "vary(1).low=0.3").returncode == 0


def test_a_list_that_is_not_there_cannot_be_read(nocdyn):
    path = nocdyn.write("m.nml", SPINNER + "&sweep design = 'list' file = 'none.csv' /\n" + GROUPS["record"])
    outcome = nocdyn("sweep", path, "--out", "out")
    assert outcome.returncode == 3
    assert "m.nml:5: &sweep: file: " in outcome.stderr and "none.csv: cannot be read: there is no such file" in outcome.stderr


def test_a_variant_with_a_number_that_is_not_allowed_is_refused_alone(nocdyn):
    nocdyn.write("list.csv", "load.drag.viscous, run.t_start\n0.5, 0\n-0.5, 0\n0.5, 2\n0.25, 0.5\n")
    path = nocdyn.write("m.nml", SPINNER + "&sweep design = 'list' file = 'list.csv' /\n" + GROUPS["record"])
    assert nocdyn("sweep", path, "--out", "out", "--csv").returncode == 0
    table = (nocdyn.folder / "out/sweep.csv").read_text()
    assert "load.drag.viscous = -0.5 is out of range; allowed: >= 0 [N m s/rad]" in table
    assert "run.t_start: t_end = 1 is out of range; allowed: > t_start = 2" in table


def test_trajectories_of_refused_variants_are_said_to_be_missing(nocdyn):
    nocdyn.write("list.csv", "load.drag.viscous, run.t_start\n0.5, 0\n-0.5, 0\n0.5, 2\n")
    groups = "&sweep design = 'list' file = 'list.csv' /\n" + GROUPS["record"] + "&record trajectories = 1, 2 /\n"
    path = nocdyn.write("m.nml", SPINNER + groups)
    outcome = nocdyn("sweep", path, "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert f"\n{path}: note: no trajectory of variant 2: refused, or with more rows than allowed\n" in outcome.stdout
    outcome = nocdyn("sweep", path, "--out", "out", "--set", "record(2).trajectories=2,1,3")
    assert f"\n{path}: note: no trajectory of variants 2, 3: refused, or with more rows than allowed\n" in outcome.stdout
    assert nocdyn.files("out") == ["columns.json", "input.nml", "summary.json", "sweep.nc", "variant-1"]
    assert "note" not in nocdyn("sweep", path, "--out", "out", "--set", "record(2).trajectories=1").stdout
    assert nocdyn("sweep", path, "--out", "out", "-q").stdout == ""


def test_a_trajectory_of_a_machine_that_cannot_be_is_said_to_be_missing(nocdyn):
    machine = SPINNER.replace(
        "&run", "&body name = 'rim' inertia = 1 speed = -0.5 /\n&gear name = 'mesh' bodies = 'disc', 'rim' radii = 1, 2 /\n&run"
    )
    nocdyn.write("list.csv", "body.rim.speed\n-0.5\n9\n")
    groups = "&sweep design = 'list' file = 'list.csv' /\n" + GROUPS["record"] + "&record trajectories = 2 /\n"
    outcome = nocdyn("sweep", nocdyn.write("m.nml", machine + groups), "--out", "out")
    assert "note: no trajectory of variant 2: refused, or with more rows than allowed\n" in outcome.stdout, outcome


def test_check_looks_at_the_sweep_too(nocdyn):
    path = nocdyn.write("m.nml", SPINNER + "".join(GROUPS.values()) + "&record trajectories = 1, 2 /\n")
    outcome = nocdyn("check", path, "--set", "sweep.samples=100000")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert outcome.stdout.endswith("\n  sweep: random, 100000 variants that differ in 1 number, 1 result, 2 trajectories\n")
    outcome = nocdyn("check", path, "--set", "sweep.samples=1", "--set", "record(2).trajectories=1")
    assert outcome.stdout.endswith("\n  sweep: random, 1 variant that differs in 1 number, 1 result, 1 trajectory\n")
    outcome = nocdyn("check", path, "--set", "sweep.samples=1")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.endswith(
        "m.nml:8: &record: trajectories(2) = 2 is out of range; allowed: 1 to 1, the number of variants\n"
    )


def test_check_wants_a_sweep_where_something_varies(nocdyn):
    path = nocdyn.write("m.nml", SPINNER + GROUPS["vary"])
    outcome = nocdyn("check", path)
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr == f"nocdyn: {path}: there is no &sweep; 'nocdyn help input sweep' shows one\n"
