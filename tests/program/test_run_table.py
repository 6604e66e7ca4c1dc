"""What a person reads of a run: chosen columns, the printed table, extremes from a time, the transient of the start."""

import bisect
import math
import re

import pytest
from conftest import BALANCE, CASE_2, POLYNOMIALS, SOURCE, first_case
from sweep_inputs import SWEEP_PROGRAM

INPUTS = sorted((SOURCE / "input").rglob("*.nml"))
TUTORIAL = SOURCE / "docs/tutorial/pump.nml"

# Two discs on a shaft, 45 rad/s, damping ratio 0.01: a constant torque of 30 N m twists it by 15 N m in the mean.
DISCS = """\
&body name = 'driver' inertia = 1.0 {driver} /
&body name = 'driven' inertia = 1.0 speed = 0.0 /
&coupling name = 'line' bodies = 'driver', 'driven' stiffness = 1012.5 damping = 0.45 /
&motor name = 'drive' body = 'driver' kind = 'constant' torque = 30.0 /
&run t_end = 5.0 rtol = 1e-10 atol = 1e-12 {run} /
&output points = 1001 {output} /
"""
FREQUENCY = 45.0
HALF_PERIOD = math.pi / FREQUENCY


def discs(nocdyn, driver="", run="", output="", *words):
    nocdyn.write("discs.nml", DISCS.format(driver=driver, run=run, output=output))
    return nocdyn("run", "discs.nml", "--out", "out", *words)


# columns that are chosen


def header_of(nocdyn, *words):
    outcome = nocdyn("run", CASE_2, "--out", "out", "--quiet", "--set", "output.points=3", *words)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return nocdyn.table("out")[0]


@pytest.mark.parametrize(
    ("patterns", "names"),
    [
        ("'moment_*', 'reaction_*'", ["moment_coupling [N m]", "reaction_reducer [N]"]),
        ("'*_pinion'", ["phi_pinion [rad]", "omega_pinion [rad/s]"]),
        ("'omega_*', 'omega_machine'", ["omega_motor [rad/s]", "omega_pinion [rad/s]", "omega_machine [rad/s]"]),
        ("'* [J]'", ["kinetic_energy [J]", "elastic_energy [J]", "work_in [J]", "work_out [J]", "energy_residual [J]"]),
        ("'torque_drive [N m]'", ["torque_drive [N m]"]),
        ("'*w*r*k*'", ["torque_work [N m]", "work_in [J]", "work_out [J]"]),
        ("'t'", []),
    ],
)
def test_chosen_columns_follow_the_time_in_the_order_of_the_table(nocdyn, patterns, names):
    assert header_of(nocdyn, "--set", f"output.columns={patterns}") == ["t [s]", *names]


def test_chosen_columns_have_the_values_of_the_whole_table(nocdyn):
    whole = header_of(nocdyn)
    rows = nocdyn.table("out")[1]
    extremes = nocdyn.summary("out")["columns"]
    header = header_of(nocdyn, "--set", "output.columns='reaction_*', 'phi_*'")
    assert nocdyn.table("out")[1] == [[row[whole.index(name)] for name in header] for row in rows]
    assert nocdyn.summary("out")["columns"] == extremes  # of all columns


def test_a_pattern_without_a_column_is_refused_with_the_nearest(nocdyn):
    patterns = "'omega_*', 'momnt_*', '*_pinyon', 'omega_motr', 'phi_motor [deg]', 'power', 'moments', 'motor'"
    nocdyn.write("case.nml", CASE_2.read_text().replace("interval = 0.01", f"interval = 0.01 columns = {patterns}"))
    line = 1 + (nocdyn.folder / "case.nml").read_text().split("columns =")[0].count("\n")
    messages = [
        f"nocdyn: case.nml:{line}: &output: columns({number}) = '{pattern}' matches no column of trajectory.csv{hint}\n"
        for number, pattern, hint in (
            (2, "momnt_*", "; did you mean 'moment_*'?"),
            (3, "*_pinyon", "; did you mean '*_pinion'?"),
            (4, "omega_motr", "; did you mean 'omega_motor'?"),
            (5, "phi_motor [deg]", "; did you mean 'phi_motor [rad]'?"),
            (
                6,
                "power",
                "; allowed: 'phi_*', 'omega_*', 'twist_*', 'moment_*', 'torque_*', 'reaction_*', 'kinetic_energy', "
                "'elastic_energy', 'work_in', 'work_out', 'energy_residual'",
            ),
            (7, "moments", "; did you mean 'moment_*'?"),
            (8, "motor", "; did you mean '*_motor'?"),
        )
    ]
    for command in ("run", "check"):
        outcome = nocdyn(command, "case.nml")
        assert (outcome.returncode, outcome.stdout, outcome.stderr) == (2, "", "".join(messages))
    assert nocdyn.files(".") == ["case.nml"]


def test_the_columns_of_no_pattern_are_refused(nocdyn):
    outcome = nocdyn("run", CASE_2, "--set", "output.columns=''")
    assert outcome.returncode == 2 and "columns(1) = '' matches no column of trajectory.csv; allowed: 'phi_*'," in outcome.stderr


def test_patterns_with_units_are_those_of_the_columns(nocdyn):
    rpm = ("--set", "output.units=rpm")
    speeds = [f"omega_{body} [rpm]" for body in ("motor", "pinion", "machine")]
    assert header_of(nocdyn, *rpm, "--set", "output.columns='* [rpm]'") == ["t [s]", *speeds]
    outcome = nocdyn("check", CASE_2, *rpm, "--set", "output.columns='omega_motor [rad/s]'")
    assert outcome.stderr.endswith(" matches no column of trajectory.csv; did you mean 'omega_motor [rpm]'?\n")


def test_trajectories_of_a_sweep_have_the_chosen_columns(nocdyn):
    sweep = (
        "&sweep design = 'grid' /\n&vary target = 'motor.drive.torque' low = 10.0 high = 30.0 count = 2 /\n"
        "&record quantity = 'omega_driver' statistic = 'final' trajectories = 2 /\n"
    )
    nocdyn.write("discs.nml", DISCS.format(driver="", run="", output="columns = 'total_*'") + sweep)
    if SWEEP_PROGRAM.exists():
        assert nocdyn("sweep", "discs.nml", "--out", "out").returncode == 0
        assert nocdyn.table("out/variant-2")[0] == ["t [s]", "total_moment_line [N m]"]
    outcome = nocdyn("check", "discs.nml", "--set", "output.columns=total_moment")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert "columns(1) = 'total_moment' matches no column of trajectory.csv; did you mean 'total_moment_*'?" in outcome.stderr


# extremes from a time


def test_extremes_from_a_time_are_those_of_the_motion_from_there_on(nocdyn):
    # 15 N m (1 - e^(-zeta omega t) cos(omega t)), about; the largest values are halves of a period apart
    assert discs(nocdyn, output="extremes_from = 1.0").returncode == 0
    summary = nocdyn.summary("out")
    assert summary["extremes_from"] == 1.0
    header, rows = nocdyn.table("out")
    for name, found in summary["columns"].items():
        column = [row[header.index(name)] for row in rows if row[0] >= 1.0]
        error = POLYNOMIALS * (max(column) - min(column)) + BALANCE * (name == "energy_residual [J]")
        assert found["min"] <= min(column) + error and max(column) - error <= found["max"]
        assert min(found["time_of_min"], found["time_of_max"]) >= 1.0
        assert found["max"] - max(column) <= 0.02 * (max(column) - min(column)) + 1e-9, "rows are a ninth of a half period apart"
    decay = 0.01 * FREQUENCY
    damped = FREQUENCY * math.sqrt(1 - 0.01**2)
    number = math.ceil(1.0 * damped / math.pi)  # of the first half period that ends after 1 s, an odd one ends with a maximum
    number += 1 - number % 2
    t = number * math.pi / damped
    moment = summary["columns"]["moment_line [N m]"]
    assert moment["min"] == pytest.approx(-15 * (1 + math.exp(-decay * t)), rel=1e-7)
    assert moment["time_of_min"] == pytest.approx(t, rel=1e-5)


def test_the_extremes_at_their_start_inside_a_step_are_the_values_there(nocdyn):
    # a body that coasts: the speed falls, the first value counts
    nocdyn.write(
        "coast.nml",
        "&body name = 'a' inertia = 2.0 speed = 8.0 /\n&load name = 'l' body = 'a' viscous = 1.0 /\n"
        "&run t_end = 3.0 rtol = 1e-11 /\n&output points = 2 extremes_from = 0.7 /\n",
    )
    text = nocdyn("run", "coast.nml", "--out", "out").stdout
    speed = nocdyn.summary("out")["columns"]["omega_a [rad/s]"]
    assert (speed["max"], speed["time_of_max"]) == (pytest.approx(8 * math.exp(-0.35), rel=1e-9), 0.7)
    assert (speed["min"], speed["time_of_min"]) == (pytest.approx(8 * math.exp(-1.5), rel=1e-9), 3.0)
    assert text.startswith("quantity from t = 0.7 s ")


@pytest.mark.parametrize(
    ("value", "allowed"), [("5", "< t_end = 5"), ("7.5", "< t_end = 5"), ("-0.1", ">= t_start = 0"), ("inf", None)]
)
def test_extremes_from_outside_of_the_run_are_refused(nocdyn, value, allowed):
    outcome = discs(nocdyn, output=f"extremes_from = {value}")
    assert outcome.returncode == 2
    if allowed:
        assert outcome.stderr == f"nocdyn: discs.nml:6: &output: extremes_from = {value} is out of range; allowed: {allowed}\n"
        assert nocdyn("check", "discs.nml").stderr == outcome.stderr


def test_a_run_that_fails_before_has_no_extremes(nocdyn):
    outcome = discs(nocdyn, run="max_steps = 10", output="extremes_from = 4.0")
    assert outcome.returncode == 1
    assert all(list(column) == ["last"] for column in nocdyn.summary("out")["columns"].values())


# the first fast transient


def test_the_first_swings_of_a_start_out_of_balance_are_told(nocdyn):
    lines = discs(nocdyn).stdout.splitlines()
    summary = nocdyn.summary("out")
    moment = summary["columns"]["moment_line [N m]"]
    assert moment["min"] == pytest.approx(-30, rel=0.02) and moment["time_of_min"] == pytest.approx(HALF_PERIOD, rel=1e-3)
    transient = summary["start_transient"]
    assert transient["until"] == pytest.approx(3 * 2 * HALF_PERIOD, rel=1e-6)
    # the moments are largest, 0, at the start itself
    swinging = ["twist_line [rad]", "moment_line [N m]", "damping_line [N m]", "total_moment_line [N m]"]
    assert (transient["has_min_of"], transient["has_max_of"]) == (swinging, ["damping_line [N m]"])
    (shaft,) = (line for line in lines if line.startswith("total_moment_line [N m]"))
    assert re.fullmatch(r"total_moment_line \[N m\] .* [0-9.]+\* +0 +0", shaft)
    assert "* in the first fast transient of a start out of balance, up to t = 0.419 s; " in "\n".join(lines)
    assert not any("*" in line for line in lines if line.startswith(("omega", "torque", "phi")))


def test_a_start_in_balance_has_no_transient(nocdyn):
    # the shaft carries 15 N m from the start
    text = discs(nocdyn, "angle = 0.0148148148148148").stdout
    assert "start_transient" not in nocdyn.summary("out")
    assert "*" not in text


def test_extremes_after_the_transient_are_not_marked(nocdyn):
    text = discs(nocdyn, output="extremes_from = 0.42").stdout
    transient = nocdyn.summary("out")["start_transient"]
    assert transient["has_min_of"] == transient["has_max_of"] == []
    assert "*" not in text


@pytest.mark.parametrize("speed", [0.0, 3000.0])
def test_the_beats_after_the_start_of_an_excitation_are_told(nocdyn, speed):
    # the torque begins with 0, but not the motion that belongs to it: 33 N m at first, 20 N m in the end
    nocdyn.write(
        "beats.nml",
        f"&body name = 'a' inertia = 1.0 speed = {speed} /\n&body name = 'b' inertia = 1.0 speed = {speed} /\n"
        "&coupling name = 's' bodies = 'a', 'b' stiffness = 1e4 damping = 0.2 /\n"
        "&excitation name = 'x' body = 'a' amplitude = 20.0 frequency = 100.0 /\n"
        "&run t_end = 40.0 rtol = 1e-9 atol = 1e-11 /\n&output points = 2 /\n",
    )
    assert "*" in nocdyn("run", "beats.nml", "--out", "out").stdout
    transient = nocdyn.summary("out")["start_transient"]
    assert transient["until"] == pytest.approx(3 / 0.2, rel=1e-6)
    assert "moment_s [N m]" in transient["has_min_of"] and "moment_s [N m]" in transient["has_max_of"]


def test_a_transient_as_long_as_the_run_is_not_told(nocdyn):
    # three periods are 0.42 s
    assert "*" not in discs(nocdyn, "", "", "", "--set", "run.t_end=0.8").stdout
    assert "*" in discs(nocdyn, "", "", "", "--set", "run.t_end=0.9").stdout


@pytest.mark.parametrize(
    ("damping", "until"),
    [
        (0.45, 6 * HALF_PERIOD),  # decays in 2.2 s, and 6.7 s are more than half of the run
        (4.5, 3 / 4.5),  # three decay times
        (18.0, 6 * HALF_PERIOD),  # three decay times are less than three periods
    ],
)
def test_the_transient_lasts_until_it_has_decayed_or_for_three_periods(nocdyn, damping, until):
    discs(nocdyn, "", "", "", "--set", f"coupling.line.damping={damping}")
    assert nocdyn.summary("out")["start_transient"]["until"] == pytest.approx(until, rel=1e-6)


def test_a_speed_of_twist_at_the_start_is_out_of_balance(nocdyn):
    text = discs(nocdyn, "angle = 0.0148148148148148 speed = 0.1").stdout
    assert "out of balance, up to t = 0.419 s" in text


# the printed table


def columns_of(text):
    return re.findall(r"^(\w+) \[[^]]*\]  ", text, re.MULTILINE)


@pytest.mark.parametrize("path", INPUTS, ids=lambda path: path.stem)
def test_the_printed_summary_of_every_shipped_input_fits_a_screen(nocdyn, path):
    case = first_case(path)
    loose = ("--set", "run.rtol=1e-3", "--set", "run.atol=1e-4", "--set", "output.points=3")
    outcome = nocdyn("run", path, "--out", "out", *loose, *case)
    printed = outcome.stdout.partition("largest of all load cases")[0]
    lines = [line for line in printed.splitlines() if ": note: " not in line]
    assert outcome.returncode == 0 and len(lines) <= 32
    names = columns_of(printed)
    folder = "/".join(("out", *case[1:]))
    rank = {column["name"]: column["rank"] for column in nocdyn.columns(folder)}
    # moments, then reactions, forces and stresses, torques and losses, speeds, the others
    sorts = [bisect.bisect([2, 5, 7, 8], rank[name]) for name in names]
    assert sorts == sorted(sorts)
    columns = nocdyn.summary(folder)["columns"]
    all_names = [name for name in columns if "] [" not in name]  # of rods only on request
    if len(names) < len(all_names):
        rest = len(all_names) - len(names)
        assert f"({rest} more column{'s' * (rest > 1)}: summary.json has all; " in printed


def test_many_columns_leave_lines_to_every_sort_and_to_the_largest(nocdyn):
    # 40 shafts, of which the last carries most, 40 speeds, one motor
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 /\n" for i in range(41))
    shafts = "".join(f"&coupling name = 's{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1e4 damping = 10.0 /\n" for i in range(40))
    motor = "&motor name = 'drive' body = 'b40' kind = 'constant' torque = 100.0 /\n"
    nocdyn.write("chain.nml", bodies + shafts + motor + "&run t_end = 0.5 rtol = 1e-4 /\n")
    outcome = nocdyn("run", "chain.nml", "--out", "out")
    names = columns_of(outcome.stdout)
    assert [name for name in names if name.startswith("torque")] == ["torque_drive"]
    assert len([name for name in names if name.startswith("omega")]) >= 4
    shown = [name for name in names if name.startswith("total_moment")]
    columns = nocdyn.summary("out")["columns"]
    shafts = [f"total_moment_s{i}" for i in range(40)]
    by_size = sorted(shafts, key=lambda name: max(abs(columns[f"{name} [N m]"][key]) for key in ("min", "max")))
    assert shown == sorted(by_size[-len(shown) :], key=shafts.index)


def test_numbers_that_only_rounding_keeps_from_zero_are_zero(nocdyn):
    # 10 sin(pi t / 0.1) ends at a zero, and the elastic energy touches zero; nothing moves the other body
    nocdyn.write(
        "zeros.nml",
        """\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 2.0 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 100.0 /
&excitation name = 'x' body = 'a' amplitude = 10.0 frequency = 31.41592653589793 /
&run t_end = 2.0 rtol = 1e-9 /
""",
    )
    text = nocdyn("run", "zeros.nml", "--out", "out").stdout
    columns = nocdyn.summary("out")["columns"]
    assert 0 < abs(columns["torque_x [N m]"]["last"]) < 1e-12
    (torque,) = (line for line in text.splitlines() if line.startswith("torque_x"))
    assert torque.split()[3] == "0"
    (energy,) = (line for line in text.splitlines() if line.startswith("elastic_energy"))
    assert columns["elastic_energy [J]"]["min"] <= 0 and energy.split()[3] == "0"


def test_there_is_no_negative_zero_in_the_table(nocdyn):
    assert discs(nocdyn).returncode == 0
    assert "-0," not in (nocdyn.folder / "out/trajectory.csv").read_text().splitlines()[1] + ","


def test_the_steady_moments_that_are_rounding_are_zero(nocdyn):
    path = SOURCE / "input/examples/engine/engine.nml"
    text = nocdyn("equilibrium", path).stdout
    assert re.search(r"moment_crank_1 \[N m\] +0\n", text) and "e-" not in text


# the moment in the shaft


def test_the_moment_in_the_shaft_is_the_elastic_one_and_that_of_damping(nocdyn):
    assert discs(nocdyn).returncode == 0
    header, rows = nocdyn.table("out")
    at = {name.split(" ")[0]: i for i, name in enumerate(header)}
    # of the second disc, which only the shaft moves: J omega' = -moment
    for row in rows:
        elastic, damping = row[at["moment_line"]], row[at["damping_line"]]
        assert row[at["total_moment_line"]] == pytest.approx(elastic + damping, abs=1e-12)
    step = rows[1][0]
    for before, row, after in zip(rows[:-2], rows[1:-1], rows[2:], strict=True):
        slope = (after[at["omega_driven"]] - before[at["omega_driven"]]) / (2 * step)
        assert -row[at["total_moment_line"]] == pytest.approx(slope, abs=0.3)  # omega''' h^2 / 6
    found = nocdyn.summary("out")["columns"]["total_moment_line [N m]"]
    assert found["min"] <= min(row[at["total_moment_line"]] for row in rows) < found["min"] + 0.5


def test_only_couplings_with_damping_have_a_moment_in_the_shaft_of_their_own(nocdyn):
    for damping, has_one in ((0, False), (0.45, True)):
        discs(nocdyn, "", "", "", "--set", f"coupling.line.damping={damping}")
        assert ("total_moment_line [N m]" in nocdyn.table("out")[0]) == has_one


# notes


def test_a_body_that_nothing_connects_or_drives_is_noted(nocdyn):
    loose = "&body name = 'spare' inertia = 1.0 speed = 2.0 /\n"
    nocdyn.write("loose.nml", DISCS.format(driver="", run="", output="") + loose)
    note = "note: nothing connects or drives 'spare': it keeps its speed\n"
    assert "loose.nml: " + note in nocdyn("run", "loose.nml", "--out", "out").stdout
    assert "  " + note in nocdyn("check", "loose.nml").stdout
    nocdyn.write("loose.nml", DISCS.format(driver="", run="", output="") + loose + loose.replace("spare", "other"))
    assert "note: nothing connects or drives 'spare', 'other': they keep their speeds\n" in nocdyn("check", "loose.nml").stdout
    assert "nothing connects" not in nocdyn("check", TUTORIAL).stdout  # a gear connects, too


def test_an_interval_beyond_the_end_is_noted(nocdyn):
    note = "note: interval = 11 s is longer than the run of 10 s: there are rows at t_start and t_end only\n"
    override = ("--set", "output.interval=11")
    assert f"{CASE_2}: {note}" in nocdyn("run", CASE_2, "--out", "out", *override).stdout
    assert note.strip().removeprefix("note: ") in nocdyn.summary("out")["machine"]["notes"]
    assert f"  {note}" in nocdyn("check", CASE_2, *override).stdout
    assert "note" not in nocdyn("check", CASE_2, "--set", "output.interval=10").stdout


SHAKEN = """\
&body name='a' inertia=1 /
&body name='b' inertia=1 /
&coupling name='k' bodies='a','b' stiffness=1e5 damping=0.5 /
&excitation name='x' body='a' amplitude=10 frequency_hz=50 /
&run t_end={} /
{}
"""


@pytest.mark.parametrize(
    ("t_end", "output", "rows", "note"),
    [
        (4, "", 1001, ""),
        (10, "", 5001, "5001 rows for excitation 'x' with 50 Hz, as &output gives no interval"),
        (
            10,
            "&output points=1001 /",
            1001,
            "the rows are 0.01 s apart and do not show the vibration by excitation 'x', up to 50 Hz",
        ),
        (
            10,
            "&output interval=0.02 /",
            501,
            "the rows are 0.02 s apart and do not show the vibration by excitation 'x', up to 50 Hz",
        ),
        (10, "&output interval=0.002 /", 5001, ""),
    ],
)
def test_rows_show_the_fastest_excitation_where_the_input_gives_none(nocdyn, t_end, output, rows, note):
    assert nocdyn("run", nocdyn.write("m.nml", SHAKEN.format(t_end, output)), "--out", "out").returncode == 0
    assert len(nocdyn.table("out")[1]) == rows
    (found,) = [one for one in nocdyn.summary("out")["machine"]["notes"] if "rows" in one] or [""]
    assert found.startswith(note) and bool(found) == bool(note)


def test_check_predicts_the_size_of_the_rows_that_a_run_chooses(nocdyn):
    more = "".join(f"&body name='c{i}' inertia=1 /\n&coupling name='d{i}' bodies='a','c{i}' stiffness=1e5 /\n" for i in range(20))

    def size(output):
        outcome = nocdyn("check", nocdyn.write("m.nml", more + SHAKEN.format(200, output)))
        return [line for line in outcome.stdout.splitlines() if "trajectory" in line]

    assert size("") == size("&output points=100001 /") and len(size("")) == 1
    assert size("&output points=1001 /") == []
