"""Load cases: several starts, faults and loads on one machine in one file."""

import csv
import json
import signal

import f90nml
import pytest
from conftest import ENDLESS, wait_for

MACHINE = """&case title = 'Pump' /
&body name = 'motor' inertia = 2.0 speed = 90.0 /
&body name = 'pump' inertia = 5.0 speed = 90.0 /
&coupling name = 'shaft' bodies = 'motor', 'pump' stiffness = 1.0e4 damping = 5.0 /
&motor name = 'drive' body = 'motor' a = 500.0 b = 2.0 c = 0.0 /
&load name = 'work' body = 'pump' quadratic = 0.03 /
"""
FAULT = "&excitation name = 'fault' body = 'motor' amplitude = 400.0 frequency = 30.0 /\n"
RUN = "&run t_end = 0.5 method = 'rk853' /\n&output points = 51 /\n"
LIFE = "&fatigue name = 'life' coupling = 'shaft' reference_moment = 300.0 reference_cycles = 1.0e5 slope = 5.0 repeats = 3 /\n"
CASES = """&load_case name = 'start' title = 'From rest' repeats = 100 set = 'body.motor.speed=0', 'body.pump.speed = 0' /
&load_case name = 'fault' repeats = 7 with = 'fault' /
&load_case name = 'idle' without = 'work' /
"""


def rows(nocdyn, folder):
    return (nocdyn.folder / folder / "trajectory.csv").read_bytes()


def cases(nocdyn, folder="out"):
    return json.loads((nocdyn.folder / folder / "cases.json").read_text())


def complaint(nocdyn, text, *words):
    nocdyn.write("m.nml", text)
    outcome = nocdyn("run", "m.nml", "--out", "out", *words)
    assert outcome.returncode == 2
    assert not (nocdyn.folder / "out").exists()
    return outcome.stderr


def test_each_load_case_is_the_machine_with_its_values_written_in_the_file(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + LIFE + CASES)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    alone = {
        "start": MACHINE.replace("speed = 90.0", "") + RUN + LIFE,
        "fault": MACHINE + FAULT + RUN + LIFE,
        "idle": MACHINE.replace("&load name = 'work' body = 'pump' quadratic = 0.03 /", "") + RUN + LIFE,
    }
    for name, text in alone.items():
        nocdyn.write(f"{name}.nml", text)
        assert nocdyn("run", f"{name}.nml", "--out", f"alone/{name}").returncode == 0
        assert rows(nocdyn, f"out/{name}") == rows(nocdyn, f"alone/{name}")
        assert nocdyn.summary(f"out/{name}")["load_case"] == name
        assert "load_case" not in nocdyn.summary(f"alone/{name}")
    assert len({rows(nocdyn, f"out/{name}") for name in alone}) == 3


def test_the_copy_of_the_input_of_a_case_gives_its_results_again(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + CASES)
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    copy = f90nml.read(nocdyn.folder / "out/fault/input.nml")
    assert "load_case" not in copy and "load_case" not in copy["run"]
    assert nocdyn("run", "out/fault/input.nml", "--out", "again").returncode == 0
    assert rows(nocdyn, "again") == rows(nocdyn, "out/fault")


def test_peaks_are_the_largest_values_of_all_cases(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + CASES)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    result = cases(nocdyn)
    assert [(case["name"], case["title"], case["repeats"], case["status"]) for case in result["load_cases"]] == [
        ("start", "From rest", 100, "done"),
        ("fault", "", 7, "done"),
        ("idle", "", 1, "done"),
    ]
    summaries = {case["name"]: nocdyn.summary(f"out/{case['folder']}")["columns"] for case in result["load_cases"]}
    found = set()
    for peak in result["peaks"]:
        label = f"{peak['column']} [{peak['unit']}]"
        found.add(label)
        values = [column[label][key] for column in summaries.values() if label in column for key in ("min", "max")]
        assert abs(peak["largest"]) == max(map(abs, values))
        column = summaries[peak["load_case"]][label]
        assert (peak["largest"], peak["time"]) in [(column[end], column[f"time_of_{end}"]) for end in ("min", "max")]
    assert found == {label for columns in summaries.values() for label in columns}
    assert "torque_fault [N m]" in found
    lines = outcome.stdout.splitlines()
    assert lines[0].startswith("m.nml: load case 'start': done at t = 0.5 s, ")
    peak = next(peak for peak in result["peaks"] if peak["column"] == "total_moment_shaft")
    line = next(line for line in lines if line.startswith("total_moment_shaft [N m]"))
    assert line.split()[-1] == peak["load_case"] and float(line.split()[3]) == pytest.approx(peak["largest"], rel=1e-6)
    with open(nocdyn.folder / "out/cases.csv", newline="") as file:
        table = list(csv.DictReader(file))
    for row in table:
        column = summaries[row["load_case"]][row["column"]]
        assert [float(row[f"time_of_{end} [s]"]) for end in ("min", "max")] == [column["time_of_min"], column["time_of_max"]]
        assert [float(row[end]) for end in ("min", "max")] == [column["min"], column["max"]]
    assert len(table) == sum(map(len, summaries.values()))


def test_the_damage_of_cases_adds_up_with_their_repeats(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + LIFE + CASES)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    [life] = cases(nocdyn)["fatigue"]
    damage = {name: nocdyn.summary(f"out/{name}")["fatigue"][0]["damage"] for name in ("start", "fault", "idle")}
    expected = {"start": 100 * 3 * damage["start"], "fault": 7 * 3 * damage["fault"], "idle": 3 * damage["idle"]}
    assert expected["start"] > 0 and expected["fault"] > 0
    assert life["damage_of_load_cases"] == pytest.approx(expected, rel=1e-14)
    assert life["damage"] == pytest.approx(sum(expected.values()), rel=1e-14)
    assert life["repeats_to_failure"] == pytest.approx(1 / life["damage"], rel=1e-14)
    assert f"fatigue 'life': damage of all load cases {life['damage']:.4g}, all of them may occur " in outcome.stdout


SHAFT = """&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 2.0 /
&shaft name = 's' bodies = 'a', 'b' lengths = 2*0.5 diameters = 0.05, 0.06 shear_modulus = 8.0e10 density = 7850.0 nodes = 4 /
&excitation name = 'left' body = 'a' amplitude = 900.0 frequency = 50.0 /
&excitation name = 'right' body = 'b' amplitude = 900.0 frequency = 400.0 /
&fatigue name = 'life' shaft = 's' reference_stress = 1.0e7 reference_cycles = 1.0e5 slope = 5.0 /
&run t_end = 0.2 /
&load_case name = 'slow' without = 'right' repeats = 50 /
&load_case name = 'fast' without = 'left' repeats = 2 /
"""


def test_the_damage_of_a_shaft_adds_up_point_by_point(nocdyn):
    """The worst point of a case is not that of another one: the sum is less than that of the worst ones."""
    nocdyn.write("m.nml", SHAFT)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    [life] = cases(nocdyn)["fatigue"]
    single = {name: nocdyn.summary(f"out/{name}")["fatigue"][0] for name in ("slow", "fast")}
    parts = life["damage_of_load_cases"]
    assert life["damage"] == pytest.approx(sum(parts.values()), rel=1e-14)
    assert 0 < parts["slow"] <= 50 * single["slow"]["damage"] and 0 < parts["fast"] <= 2 * single["fast"]["damage"]
    assert single["slow"]["position"] != single["fast"]["position"]
    assert life["damage"] < 50 * single["slow"]["damage"] + 2 * single["fast"]["damage"]
    assert life["damage"] > max(50 * single["slow"]["damage"], 2 * single["fast"]["damage"])


def test_a_case_may_have_a_run_of_its_own(nocdyn):
    runs = "&run load_case = 'start' t_end = 2.0 method = 'rodas4' /\n&run t_end = 0.5 method = 'rk45' /\n"
    nocdyn.write("m.nml", MACHINE + FAULT + runs + CASES)
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    settings = {name: nocdyn.summary(f"out/{name}")["settings"] for name in ("start", "fault")}
    assert (settings["start"]["t_end"], settings["start"]["method"]) == (2.0, "rodas4")
    assert (settings["fault"]["t_end"], settings["fault"]["method"]) == (0.5, "rk45")


def test_the_command_line_overrides_what_a_case_sets(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + CASES)
    words = ("--set", "body.motor.speed=20", "--set", "excitation.fault.amplitude=1", "--set", "run.t_end=0.1")
    outcome = nocdyn("run", "m.nml", "--out", "out", *words)
    assert outcome.returncode == 0, outcome.stderr
    start = f90nml.read(nocdyn.folder / "out/start/input.nml")
    assert [body["speed"] for body in start["body"]] == [20, 0]
    assert start["run"]["t_end"] == 0.1
    assert f90nml.read(nocdyn.folder / "out/fault/input.nml")["excitation"]["amplitude"] == 1


def test_one_case_alone(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + CASES)
    outcome = nocdyn("run", "m.nml", "--out", "out", "--case", "fault")
    assert outcome.returncode == 0
    assert "smallest" in outcome.stdout  # the table of a single run
    assert nocdyn.files("out") == ["cases.csv", "cases.json", "fault"]
    assert [case["name"] for case in cases(nocdyn)["load_cases"]] == ["fault"]


def test_other_commands_see_the_machine_itself_or_one_of_its_cases(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + CASES)
    outcome = nocdyn("check", "m.nml")
    assert "1 load, 0 excitations" in outcome.stdout
    assert "\n  load cases: 'start', 'fault', 'idle'\n" in outcome.stdout
    assert "1 load, 1 excitation\n" in nocdyn("check", "m.nml", "--case", "fault").stdout
    assert nocdyn("equilibrium", "m.nml", "--case", "idle", "--out", "steady").returncode == 0
    steady = json.loads((nocdyn.folder / "steady/idle/equilibrium.json").read_text())
    assert steady["steady_states"][0]["values"]["omega_motor [rad/s]"] == pytest.approx(250.0)  # where the motor gives nothing
    outcome = nocdyn("check", "m.nml", "--case", "faul")
    assert outcome.returncode == 2
    assert outcome.stderr == "nocdyn: m.nml: --case: there is no &load_case 'faul'; did you mean 'fault'?\n"


def test_a_sweep_varies_the_machine_itself(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'load.work.quadratic' low = 0.01 high = 0.03 count = 3 /\n"
    sweep += "&record quantity = 'moment_shaft' statistic = 'max' /\n"
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + CASES + sweep)
    nocdyn.write("plain.nml", MACHINE + RUN + sweep)
    for name in ("m", "plain"):
        outcome = nocdyn("sweep", f"{name}.nml", "--out", name, "--csv")
        assert outcome.returncode == 0, outcome.stderr
    tables = [(nocdyn.folder / name / "sweep.csv").read_text() for name in ("m", "plain")]
    assert tables[0] == tables[1]


def test_a_case_that_fails_does_not_stop_the_others(nocdyn):
    text = MACHINE + FAULT + RUN + CASES.replace("'body.motor.speed=0'", "'run.max_steps=2'")
    nocdyn.write("m.nml", text)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert outcome.returncode == 1
    assert outcome.stderr.startswith("nocdyn: m.nml: load case 'start': ")
    assert "out/start/trajectory.partial.csv" in outcome.stderr
    assert [case["status"] for case in cases(nocdyn)["load_cases"]] == ["failed", "done", "done"]


def test_after_an_interruption_the_table_says_what_was_run(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + LIFE + CASES)
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    assert cases(nocdyn)["is_complete"]
    process = nocdyn.start("run", "m.nml", "--out", "out", *ENDLESS)
    wait_for(lambda: list((nocdyn.folder / "out/start").glob(".trajectory.csv.*")))
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "m.nml: load cases not run after the interruption: 'fault', 'idle'\n" in errors
    found = cases(nocdyn)
    assert not found["is_complete"]
    assert [case["status"] for case in found["load_cases"]] == ["interrupted", "not run", "not run"]
    assert "repeats_to_failure" not in found["fatigue"][0]


def test_damage_of_cases_that_fail_is_said_to_be_incomplete(nocdyn):
    few_steps = "&run load_case = 'fault' t_end = 0.5 method = 'rk853' max_steps = 5 /\n"
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + few_steps + LIFE + CASES)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert outcome.returncode == 1
    assert "\nincomplete: fault (failed)\n" in outcome.stdout
    assert "may occur" not in outcome.stdout
    found = cases(nocdyn)
    assert not found["is_complete"]
    assert [case["status"] for case in found["load_cases"]] == ["done", "failed", "done"]
    assert "stopped at t = 0.0147" in found["load_cases"][1]["message"]
    assert "repeats_to_failure" not in found["fatigue"][0]


@pytest.mark.parametrize(
    "case, message",
    [
        ("name = 'a' without = 'shaft'", "m.nml:10: load case 'a': &fatigue 'life': there is no coupling 'shaft'"),
        ("name = 'a' set = 'output.extremes_from=3'", "m.nml:12: &load_case 'a': set 'output.extremes_from=3': &output: "),
        ("name = 'a' set = 'excitation.sc.time=-1' with = 'sc'", "m.nml:12: &load_case 'a': set 'excitation.sc.time=-1': "),
    ],
)
def test_mistakes_of_cases_are_found_before_any_is_run(nocdyn, case, message):
    fault = "&excitation name = 'sc' body = 'motor' kind = 'fault' fault = 'two_phase' rated_torque = 100 "
    fault += "subtransient_reactance = 0.2 frequency_hz = 50 time = 0.1 /\n"
    text = MACHINE + fault + RUN + LIFE + f"&load_case name = 'b' /\n&load_case {case} /\n"
    assert complaint(nocdyn, text).startswith(f"nocdyn: {message}")


def test_a_damage_above_1_is_said_to_be_too_much(nocdyn):
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + LIFE + "&load_case name = 'a' repeats = 1e9 /\n")
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert ", above 1: the part does not last (a " in outcome.stdout


def test_a_sweep_is_checked_for_the_machine_and_its_cases(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'excitation.fault.amplitude' low = 1 high = 2 count = 3 /\n"
    sweep += "&record quantity = 'moment_shaft' statistic = 'max' /\n"
    text = MACHINE + FAULT + RUN + CASES + sweep
    nocdyn.write("m.nml", text)
    outcome = nocdyn("check", "m.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    target = "target = 'excitation.fault.amplitude': there is no &excitation 'fault'"
    assert f"\n  no sweep of this machine: m.nml:14: &vary: {target}\n" in outcome.stdout
    assert "\n  sweep: grid, 3 variants" in nocdyn("check", "m.nml", "--case", "fault").stdout
    nocdyn.write("m.nml", text.replace("excitation.fault.a", "excitation.fautl.a"))
    outcome = nocdyn("check", "m.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == "nocdyn: m.nml:14: &vary: target = 'excitation.fautl.amplitude': there is no &excitation 'fautl'\n"


@pytest.mark.parametrize(
    "case, message",
    [
        ("name = 'a' /\n&load_case name = 'a'", "m.nml:11: &load_case 'a': the name 'a' is taken by &load_case on line 10"),
        ("name = 'a/b'", "m.nml:10: &load_case 'a/b': name = 'a/b' is no name of a folder; allowed: a name without / and "),
        ("name = '..'", "m.nml:10: &load_case '..': name = '..' is no name of a folder; allowed: "),
        ("name = 'a' with = 'faul'", "m.nml:10: &load_case 'a': with: there is no element 'faul'; did you mean 'fault'?"),
        ("name = 'a' without = 'pump'", "m.nml:10: &load_case 'a': without: 'pump' is a &body; allowed: names of elements"),
        ("name = 'a' with = 'a'", "m.nml:10: &load_case 'a': with: 'a' is a &load_case; allowed: names of elements"),
        (
            "name = 'a' with = 'fault' without = 'fault'",
            "m.nml:10: &load_case 'a': with and without both name 'fault'; allowed: one of them",
        ),
        ("name = 'cases.json'", "m.nml:10: &load_case 'cases.json': name = 'cases.json' is that of a file of results; allowed: "),
        ("name = 'Modes.JSON'", "m.nml:10: &load_case 'Modes.JSON': name = 'Modes.JSON' is that of a file of results; allowed: "),
        ("name = 'a' set = 'output.directory=x'", "m.nml:10: &load_case 'a': set 'output.directory=x': no load case sets that"),
        ("name = 'a' set = 'load_case.a.repeats=4'", "m.nml:10: &load_case 'a': set 'load_case.a.repeats=4': no load case sets"),
        ("name = 'a' repeats = 0", "m.nml:10: &load_case 'a': repeats = 0 is out of range; allowed: > 0"),
        (
            "name = 'a' set = 'load.work.quadratik=1'",
            "m.nml:10: &load_case 'a': set 'load.work.quadratik=1': quadratik is not a key of &load; did you mean 'quadratic'?",
        ),
        (
            "name = 'a' set = 'load.werk.quadratic=1'",
            "m.nml:10: &load_case 'a': set 'load.werk.quadratic=1': there is no &load 'werk'; did you mean 'work'?",
        ),
        (
            "name = 'a' set = 'body.motor.inertia=-1'",
            "m.nml:10: &load_case 'a': set 'body.motor.inertia=-1': inertia = -1 is out of range; allowed: >= 0",
        ),
        ("name = 'a' set = 'run.t_end'", "m.nml:10: &load_case 'a': set 'run.t_end': there is no = in it; write PATH=VALUE"),
        (
            "name = 'b' with = 'fault' /\n&load_case name = 'a' set = 'excitation.fault.amplitude=1'",
            "m.nml:11: &load_case 'a': set 'excitation.fault.amplitude=1': the load case leaves out &excitation 'fault'",
        ),
        ("name = 'a' /\n&run load_case = 'b' t_end = 1", "m.nml:11: &run: load_case: there is no &load_case 'b'"),
        (
            "name = 'a' /\n&run load_case = 'a' t_end = 1 /\n&run load_case = 'a' t_end = 2",
            "m.nml:12: &run: load_case: the &run of 'a' is on line 11",
        ),
        ("name = 'a' /\n&run t_end = 2", "m.nml:11: &run: given twice, first on line 8; allowed: once"),
    ],
)
def test_a_wrong_load_case_is_refused(nocdyn, case, message):
    text = MACHINE + FAULT + RUN + f"&load_case {case} /\n"
    assert complaint(nocdyn, text).startswith(f"nocdyn: {message}")


def test_a_name_that_two_elements_have_is_refused(nocdyn):
    text = MACHINE.replace("'shaft'", "'work'") + RUN + "&load_case name = 'a' without = 'work' /\n"
    assert complaint(nocdyn, text) == (
        "nocdyn: m.nml:9: &load_case 'a': without: 'work' is the name of m.nml:4: &coupling 'work' and of m.nml:6: &load 'work'; "
        "needed: a name that one element has\n"
    )


def test_a_case_without_a_run_is_refused(nocdyn):
    text = MACHINE + "&run load_case = 'a' t_end = 1 /\n&load_case name = 'a' /\n&load_case name = 'b' /\n"
    assert complaint(nocdyn, text) == (
        "nocdyn: m.nml:9: &load_case 'b': there is no &run for it; needed: one with load_case = 'b', or one without load_case, "
        "for all\n"
    )


def test_mistakes_of_several_cases_are_told_together(nocdyn):
    cases = "&load_case name = 'a' set = 'run.rtol=2' /\n&load_case name = 'b' set = 'run.atol=0' /\n"
    lines = complaint(nocdyn, MACHINE + RUN + cases).splitlines()
    assert [line.split(": ")[1:3] for line in lines] == [["m.nml:9", "&load_case 'a'"], ["m.nml:10", "&load_case 'b'"]]


def test_a_sweep_varies_the_machine_of_a_case(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'coupling.shaft.stiffness' low = 1e4 high = 2e4 count = 3 /\n"
    sweep += "&record quantity = 'moment_shaft' statistic = 'max_abs' /\n&record trajectories = 2 /\n"
    cases = "&load_case name = 'short' with = 'fault' set = 'load.work.quadratic=0.02' /\n&load_case name = 'other' /\n"
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + cases + sweep)
    peaks = {}
    for case, folder in (("", "alone"), ("short", "out/short/sweep"), ("other", "out/other/sweep")):
        words = ["--out", "out", "--case", case] if case else ["--out", "alone"]
        outcome = nocdyn("sweep", "m.nml", "--csv", *words)
        assert (outcome.returncode, outcome.stderr) == (0, "")
        lines = (nocdyn.folder / folder / "sweep.csv").read_text().splitlines()
        peaks[case] = [line.split(",")[2] for line in lines[1:]]
    assert peaks["other"] == peaks[""]
    assert all(float(peak) > 1.1 * float(plain) for peak, plain in zip(peaks["short"], peaks[""]))
    run = nocdyn("run", "out/short/sweep/input.nml", "--out", "again", "--set", "coupling.shaft.stiffness=1.5e4")
    assert run.returncode == 0
    column = nocdyn.summary("again")["columns"]["moment_shaft [N m]"]
    assert max(abs(column["min"]), abs(column["max"])) == pytest.approx(float(peaks["short"][1]), rel=1e-4)
    again = nocdyn("sweep", "m.nml", "--csv", "--out", "out", "--case", "short", "--resume")
    assert "are done already; results in out/short/sweep" in again.stdout
    refused = nocdyn("sweep", "m.nml", "--case", "shirt")
    assert refused.returncode == 2
    assert refused.stderr == "nocdyn: m.nml: --case: there is no &load_case 'shirt'; did you mean 'short'?\n"


def test_limits_that_a_case_exceeds_are_told_with_its_name(nocdyn):
    limit = "&limit coupling = 'shaft' moment = 700 /\n"
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + limit + CASES)
    outcome = nocdyn("run", "m.nml", "--out", "out")
    (line,) = [line for line in outcome.stdout.splitlines() if "exceeded at t = " in line]
    assert line.startswith("  fault  ") and "coupling 'shaft'  moment, largest" in line


@pytest.mark.parametrize("mistake", ["coupling.k.stifness=3", "output.extremes_from=5"])
@pytest.mark.parametrize("command", ["check", "run", "modes", "equilibrium"])
def test_a_load_case_alone_does_not_fail_by_the_mistake_of_another(nocdyn, command, mistake):
    text = "&body name='a' inertia=1 /\n&coupling name='k' bodies='ground','a' stiffness=9 /\n&run t_end=1 /\n"
    text += f"&load_case name='good' /\n&load_case name='bad' set='{mistake}' /\n"
    nocdyn.write("m.nml", text)
    assert nocdyn(command, "m.nml", "--case", "good", "--out", "out").returncode == 0
    refused = nocdyn("run", "m.nml", "--case", "bad", "--out", "bad")
    assert refused.returncode == 2 and mistake.split("=")[0] in refused.stderr


def test_names_that_spreadsheets_would_compute_are_texts_in_tables(nocdyn):
    text = "&body name='+1+1' inertia=1 speed=1 /\n&body name='@b' inertia=1 speed=0 /\n&body name='plain' inertia=1 /\n"
    text += "&coupling name='-k' bodies='+1+1','@b' stiffness=9 /\n&coupling name='+k' bodies='@b','plain' stiffness=9 /\n"
    text += "&fatigue name='-life' coupling='-k' reference_moment=10 reference_cycles=1e6 slope=5 /\n"
    nocdyn.write("m.nml", text + "&run t_end=9 /\n&load_case name='+case' /\n")
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    assert nocdyn("modes", "m.nml", "--case", "+case", "--holzer", "--out", "modes").returncode == 0
    paths = [
        "out/cases.csv",
        "out/+case/cycles.csv",
        "out/+case/trajectory.csv",
        "modes/+case/modes.csv",
        "modes/+case/holzer.csv",
    ]
    seen = set()
    for path in paths:
        with open(nocdyn.folder / path, newline="") as file:
            for cell in (cell for row in csv.reader(file) for cell in row):
                assert cell[:1] not in ("=", "+", "@") and (cell[:1] != "-" or float(cell) <= 0), (path, cell)
                seen.add(cell)
    assert {"'+case", "'-life", "'+1+1", "'@b", "'-k", "plain"} <= seen


@pytest.mark.parametrize(
    "cases", ["&load_case name='cut' without='k2' /", "&load_case name='cut' /\n&load_case name='k' with='k2' /"]
)
def test_a_limit_belongs_to_the_machines_that_have_its_element(nocdyn, cases):
    nocdyn.write(
        "m.nml",
        f"""\
&body name='a' inertia=1 speed=10 /
&body name='b' inertia=2 speed=10 /
&coupling name='k1' bodies='a','b' stiffness=1e4 damping=1 /
&coupling name='k2' bodies='a','b' stiffness=1e4 damping=1 /
&excitation name='x' body='a' kind='orders' orders=1 amplitudes=10 /
&limit coupling='k2' moment=1e-3 /
&response body='a' speed=5,50 count=10 /
&run t_end=0.01 /
{cases}
""",
    )
    for command in ("check", "run", "modes", "response", "campbell", "equilibrium"):
        for case in ((), ("--case", "cut")):
            outcome = nocdyn(command, "m.nml", *case)
            assert (outcome.returncode, outcome.stderr) == (0, "")
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    limited = {folder.name: "verdict" in nocdyn.summary(f"out/{folder.name}") for folder in (nocdyn.folder / "out").glob("*/")}
    assert limited == {"cut": False} | ({"k": True} if "'k'" in cases else {})
    text = (nocdyn.folder / "m.nml").read_text()
    nocdyn.write("m.nml", text.replace("&limit coupling='k2'", "&limit coupling='k3'"))
    for command in ("check", "run", "modes", "response"):
        unknown = nocdyn(command, "m.nml", "--case", "cut")
        assert (unknown.returncode, unknown.stderr.count("there is no coupling 'k3'")) == (2, 1)


def test_check_tells_all_mistakes_of_a_file_once(nocdyn):
    text = MACHINE + FAULT + RUN + LIFE.replace("coupling = 'shaft'", "coupling = 'shift'")
    text += "&limit coupling = 'shaff' moment = 1 /\n&response body = 'pump' speed = 9, 3 /\n&run load_case = 'a' t_end = 2 /\n"
    text += "&load_case name = 'a' set = 'run.t_end=-1' /\n&load_case name = 'b' with = 'falt' set = 'load.work.quadratic=x' /\n"
    text += "&load_case name = 'c' without = 'work' /\n"
    nocdyn.write("m.nml", text)
    outcome = nocdyn("check", "m.nml")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    lines = outcome.stderr.splitlines()
    for found in (
        "m.nml:10: &fatigue 'life': there is no coupling 'shift'; did you mean 'shaft'?",
        "m.nml:11: &limit: there is no coupling 'shaff'; did you mean 'shaft'?",
        "m.nml:12: &response: speed = 9, 3 rad/s, which is 85.9437, 28.6479 rpm; allowed: first the slower speed, then",
        "m.nml:14: &load_case 'a': set 'run.t_end=-1': t_end = -1 is out of range; allowed: > t_start = 0",
        "m.nml:15: &load_case 'b': with: there is no element 'falt'; did you mean 'fault'?",
        "m.nml:15: &load_case 'b': set 'load.work.quadratic=x': quadratic = x ",
    ):
        assert [found in line for line in lines].count(True) == 1, found
    assert len(lines) == 6


def test_check_tells_all_limits_that_cannot_be(nocdyn):
    limits = "&limit coupling = 'shaft' /\n&limit coupling = 'shaft' stress = 1e6 /\n&response body = 'pump' speed = 3, 9 /\n"
    nocdyn.write("m.nml", MACHINE + FAULT + RUN + limits)
    outcome = nocdyn("check", "m.nml")
    assert outcome.returncode == 2
    assert [line.split(": ")[1] for line in outcome.stderr.splitlines()] == ["m.nml:10", "m.nml:11"]


def test_a_note_names_its_load_case_once(nocdyn):
    nocdyn.write("m.nml", MACHINE + RUN + "&load_case name = 'a' /\n")
    outcome = nocdyn("run", "m.nml", "--out", "out", "--set", "output.columns='shaft_shaft'")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    [note] = [line for line in outcome.stdout.splitlines() if "shaft_shaft is called" in line]
    assert note.startswith("m.nml: load case 'a': note: --set output.columns='shaft_shaft': &output: ")


def test_a_load_case_sets_numbers_with_a_unit(nocdyn):
    text = """\
&body name = 'disc' inertia = '2000 kg cm2' speed = '60 rpm' /
&load name = 'drag' body = 'disc' viscous = '0.5 N m s/rad' /
&load_case name = 'warm' set = 'load.drag.viscous=3 N m/rpm', "body.disc.inertia='4 lbm ft2'" /
&run t_end = '10 ms' /
"""
    outcome = nocdyn("run", nocdyn.write("cases.nml", text), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    used = (nocdyn.folder / "out/warm/input.nml").read_text()
    assert "viscous = 28.64788975654116" in used and "inertia = 0.1685604" in used
