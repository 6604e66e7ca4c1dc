"""trajectory.csv, summary.json and input.nml."""

import json
import math
import re
from decimal import Decimal

import pytest
from conftest import BALANCE, CASE_2, DATA, POLYNOMIALS, SOURCE, all_if_fast, fast_only

FULL = DATA / "full_machine.nml"
ENERGIES = ["kinetic_energy [J]", "elastic_energy [J]", "work_in [J]", "work_out [J]", "energy_residual [J]"]

CASE_2_HEADER = [
    "t [s]",
    *(f"phi_{body} [rad]" for body in ("motor", "pinion", "machine")),
    *(f"omega_{body} [rad/s]" for body in ("motor", "pinion", "machine")),
    "twist_coupling [rad]",
    "moment_coupling [N m]",
    "torque_drive [N m]",
    "torque_work [N m]",
    "torque_shaker [N m]",
    "reaction_reducer [N]",
    *ENERGIES,
]

FULL_BODIES = ("motor", "sun", "wheel", "ring", "flywheel")
FULL_HEADER = [
    "t [s]",
    *(f"phi_{body} [rad]" for body in FULL_BODIES),
    *(f"omega_{body} [rad/s]" for body in FULL_BODIES),
    *(f"twist_{coupling} [rad]" for coupling in ("shaft", "belt", "anchor")),
    *(f"moment_{coupling} [N m]" for coupling in ("shaft", "belt", "anchor")),
    *(f"damping_{coupling} [N m]" for coupling in ("shaft", "anchor")),
    *(f"total_moment_{coupling} [N m]" for coupling in ("shaft", "anchor")),
    *(f"torque_{motor} [N m]" for motor in ("drive", "booster")),
    "torque_fan [N m]",
    *(f"torque_{excitation} [N m]" for excitation in ("engine", "gust")),
    "reaction_pair [N m]",
    "reaction_inner [N]",
    *ENERGIES,
]


@pytest.fixture(scope="module")
def case_2(shared_nocdyn):
    assert shared_nocdyn("run", CASE_2, "--out", "case2").returncode == 0
    return shared_nocdyn


@pytest.fixture(scope="module")
def full(shared_nocdyn):
    assert shared_nocdyn("run", FULL, "--out", "full").returncode == 0
    return shared_nocdyn


def columns(nocdyn, folder):
    header, rows = nocdyn.table(folder)
    return dict(zip(header, zip(*rows)))


def test_the_header_of_the_papers_machine_is_exact(case_2):
    assert case_2.table("case2")[0] == CASE_2_HEADER


def test_the_header_of_a_machine_with_every_element_is_exact(full):
    assert full.table("full")[0] == FULL_HEADER


def test_there_is_a_row_for_every_interval_and_the_start(case_2):
    times = columns(case_2, "case2")["t [s]"]
    assert list(times) == [i * 0.01 for i in range(1000)] + [10.0]


def test_points_are_spread_evenly_from_start_to_end(full):
    times = columns(full, "full")["t [s]"]
    assert list(times) == [0.5 + 2.5 * i / 500 for i in range(501)]


@pytest.mark.parametrize(
    ("interval", "times"),
    [
        (0.3, [0, 0.3, 0.6, 0.3 * 3, 1.0]),
        (0.25, [0, 0.25, 0.5, 0.75, 1.0]),
        (5, [0, 1.0]),
        (0.1, [i * 0.1 for i in range(10)] + [1.0]),
    ],
)
def test_the_last_row_is_at_the_end_whether_or_not_the_interval_divides(nocdyn, interval, times):
    assert nocdyn("run", CASE_2, "--out", "out", "--set", "run.t_end=1", "--set", f"output.interval={interval}").returncode == 0
    assert list(columns(nocdyn, "out")["t [s]"]) == times


@pytest.mark.parametrize("folder", ["case2", "full"])
def test_numbers_are_the_shortest_that_round_trip(case_2, full, folder):
    lines = (case_2.folder / folder / "trajectory.csv").read_text().splitlines()[1:]
    for cell in ",".join(lines).split(","):
        assert Decimal(cell) == Decimal(repr(float(cell)))


def test_every_row_is_complete_and_every_line_ends(full):
    text = (full.folder / "full/trajectory.csv").read_text()
    assert text.endswith("\n") and "\r" not in text and '"' not in text
    assert {line.count(",") for line in text.splitlines()} == {len(FULL_HEADER) - 1}


def test_columns_obey_their_definitions(full):
    # the numbers of full_machine.nml; rounding only
    table = columns(full, "full")

    def close(a, b):
        return a == pytest.approx(b, rel=1e-12, abs=1e-10)

    for i in range(0, 501, 25):
        value = {name.split(" ")[0]: column[i] for name, column in table.items()}
        assert close(value["twist_shaft"], value["phi_sun"] - value["phi_motor"])
        assert close(value["twist_anchor"], value["phi_flywheel"])
        bend = value["twist_shaft"] - 0.05
        assert close(value["moment_shaft"], (200 + 15 * bend**2) * bend)
        assert close(value["moment_belt"], 80 * value["twist_belt"])
        assert close(value["damping_shaft"], 2 * (value["omega_sun"] - value["omega_motor"]))
        assert close(value["torque_drive"], 150 - 8 * value["omega_motor"] - 0.5 * value["omega_motor"] ** 2)
        assert close(value["torque_fan"], -4 * value["omega_wheel"])
        assert close(20 * value["omega_sun"] + 40 * value["omega_wheel"], 0)
        assert close(0.1 * value["omega_sun"] - 0.3 * value["omega_ring"], 0)
        inertia = dict(zip(FULL_BODIES, (10.0, 2.0, 1.5, 4.0, 20.0)))
        assert close(value["kinetic_energy"], sum(j * value[f"omega_{body}"] ** 2 / 2 for body, j in inertia.items()))


def test_the_energy_balance_closes(full):
    # the tolerances of the file
    table = columns(full, "full")
    assert max(map(abs, table["energy_residual [J]"])) < 1e-6 * table["work_in [J]"][-1]


def test_start_angles_and_speeds_stand_in_the_first_row(full):
    header, rows = full.table("full")
    first = dict(zip(header, rows[0]))
    assert [first[f"phi_{body} [rad]"] for body in FULL_BODIES] == [0.2, -0.1, 0, 0, 0]
    assert [first[f"omega_{body} [rad/s]"] for body in FULL_BODIES] == pytest.approx([1, 3, -1.5, 1, 0], rel=1e-15)
    assert first["work_in [J]"] == first["work_out [J]"] == first["energy_residual [J]"] == 0


def test_the_summary_tells_what_was_done(case_2):
    summary = case_2.summary("case2")
    version = re.search(r"project\(nocdyn VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text()).group(1)
    assert (summary["program"], summary["version"], summary["status"]) == ("nocdyn", version, "done")
    assert summary["input"] == str(CASE_2)
    assert summary["title"] == "Paper, case 2: harmonic torque on the motor"
    assert summary["time_reached"] == 10
    assert summary["wall_time_s"] > 0
    assert "message" not in summary
    assert summary["machine"] == {
        "bodies": 3,
        "gears": 1,
        "constraints": 1,
        "degrees_of_freedom": 2,
        "independent": ["motor", "pinion"],
        "notes": [],
    }
    assert summary["settings"] == {
        "t_start": 0,
        "t_end": 10,
        "method": "rk45",
        "rtol": 1e-9,
        "atol": 1e-9,
        "formulation": "reduced",
        "complement": "natural",
        "max_steps": 1000000,
    }


def test_the_summary_counts_steps_and_rows(case_2):
    counts = case_2.summary("case2")["counts"]
    assert counts["rows"] == 1001
    assert counts["accepted_steps"] > 100
    assert counts["evaluations"] >= 6 * counts["accepted_steps"]
    assert counts["jacobians"] == counts["factorisations"] == 0


def test_the_rosenbrock_method_counts_its_jacobians(nocdyn):
    nocdyn("run", CASE_2, "--out", "out", "--set", "run.method=rosenbrock", "--set", "run.rtol=1e-5")
    counts = nocdyn.summary("out")["counts"]
    assert counts["jacobians"] >= counts["accepted_steps"]
    assert counts["factorisations"] == counts["accepted_steps"] + counts["rejected_steps"]


# The disc of `sqrt(k / J) = 2 rad/s` starts at its largest angle and passes the edges of its gap, then the step comes.
KINKS = """\
&body name = 'disc' inertia = 1.0 angle = 0.75 /
&coupling name = 'play' bodies = 'ground', 'disc' stiffness = 4.0 gap = 0.5 /
&excitation name = 'blow' body = 'disc' kind = 'step' amplitude = -3.0 time = 1.0 /
&run t_end = 1.1 method = '{method}' rtol = 1e-9 /
&output points = 3 /
"""


@pytest.mark.parametrize("method", ["auto", "rk45", "rk853", "rodas4", "rodas5p"])
def test_the_summary_counts_crossings(nocdyn, method):
    nocdyn.write("kinks.nml", KINKS.format(method=method))
    outcome = nocdyn("run", "kinks.nml", "--out", "out")
    # out of contact at pi / 4, with a speed of 1 rad/s to the other edge beyond 1 s: 0.25 - (1 - pi / 4) > -0.25
    summary = nocdyn.summary("out")
    assert summary["counts"]["crossings"] == 2
    assert " rejected), 2 kinks or jumps crossed, 3 rows, " in outcome.stdout.splitlines()[-1]
    blow = summary["columns"]["torque_blow [N m]"]
    assert (blow["max"], blow["time_of_max"], blow["min"]) == (0, 0, -3)
    assert summary["columns"]["moment_play [N m]"]["min"] == 0


def test_a_run_without_kinks_crosses_none(case_2):
    assert case_2.summary("case2")["counts"]["crossings"] == 0


@pytest.mark.parametrize("folder", ["case2", "full"])
def test_no_row_lies_outside_the_extremes(case_2, full, folder):
    table = columns(case_2, folder)
    times = table.pop("t [s]")
    summary = case_2.summary(folder)
    assert summary["extremes"] == "of the motion"
    assert list(summary["columns"]) == list(table)
    for name, column in table.items():
        extremes = summary["columns"][name]
        error = POLYNOMIALS * (max(column) - min(column)) + BALANCE * (name == "energy_residual [J]")
        assert extremes["min"] <= min(column) + error and max(column) - error <= extremes["max"]
        assert times[0] <= extremes["time_of_min"] <= times[-1] and times[0] <= extremes["time_of_max"] <= times[-1]
        assert extremes["last"] == column[-1]


def parabola(times, values, i, t):
    """The value at t of the parabola through the rows i - 1, i and i + 1; the rows are evenly spaced."""
    before, middle, after = values[i - 1 : i + 2]
    x = (t - times[i]) / (times[i] - times[i - 1])
    return middle + x * ((after - before) / 2 + x * (after - 2 * middle + before) / 2)


def peak(values, i):
    before, middle, after = values[i - 1 : i + 2]
    bend = after - 2 * middle + before
    return middle - (after - before) ** 2 / (8 * bend) if bend else middle


@pytest.mark.parametrize("path", [CASE_2, FULL], ids=["case2", "full"])
@pytest.mark.parametrize("method", all_if_fast("auto", "rk45", "rodas5p"))
def test_the_extremes_are_those_of_the_motion_between_the_rows(nocdyn, path, method):
    common = ["run.t_end=3", f"run.method={method}", "run.rtol=1e-9", "run.atol=1e-9"]
    words = [word for override in common for word in ("--set", override)]
    assert nocdyn("run", path, "--out", "coarse", *words, "--set", "output.points=3").returncode == 0
    assert nocdyn("run", path, "--out", "fine", *words, "--set", "output.points=20001").returncode == 0
    table = columns(nocdyn, "fine")
    times = table.pop("t [s]")
    table.pop("energy_residual [J]")  # what the tolerances leave, not smooth
    for name, column in table.items():
        found = nocdyn.summary("coarse")["columns"][name]
        # parabolas through rows 0.15 ms apart are right to 1e-10, the solution has kinks of its tolerance
        close = {"rel": 1e-7, "abs": 1e-7 * max(map(abs, column))}
        for extreme, sign in (("min", -1), ("max", 1)):
            values = [sign * value for value in column]
            i = min(max(values.index(max(values)), 1), len(values) - 2)
            sampled = max(values[0], values[-1], peak(values, i) if values[i] == max(values) else values[0])
            assert sign * found[extreme] == pytest.approx(sampled, **close)
            t = found[f"time_of_{extreme}"]
            i = min(max(round((t - times[0]) / (times[1] - times[0])), 1), len(times) - 2)
            assert sign * parabola(times, values, i, t) == pytest.approx(found[extreme], **close)


OSCILLATOR = """\
&body name = 'disc' inertia = 0.5 speed = 3.0 /
&coupling name = 'spring' bodies = 'ground', 'disc' stiffness = 8.0 /
&run t_end = 2.0 rtol = 1e-12 atol = 1e-12 /
&output points = 2 /
"""


@pytest.mark.parametrize("method", ["auto", "rk45", "rk853", "rodas4", "rodas5p", "taylor"])
def test_the_extremes_of_an_oscillator_are_those_of_the_sine(nocdyn, method):
    nocdyn.write("oscillator.nml", OSCILLATOR)
    assert nocdyn("run", "oscillator.nml", "--out", "out", "--set", f"run.method={method}").returncode == 0
    found = nocdyn.summary("out")["columns"]
    quarter = math.pi / 8  # of the period: 4 rad/s
    expected = {
        "phi_disc [rad]": (-0.75, 3 * quarter, 0.75, quarter),
        "omega_disc [rad/s]": (-3.0, 2 * quarter, 3.0, 0.0),
        "moment_spring [N m]": (-6.0, 3 * quarter, 6.0, quarter),
    }
    for name, values in expected.items():
        keys = ("min", "time_of_min", "max", "time_of_max")
        # the values are right to the error of the solution, the times to its square root
        assert [found[name][key] for key in keys[::2]] == pytest.approx(values[::2], rel=1e-9)
        for key, time in zip(keys[1::2], values[1::2], strict=True):
            periods = (found[name][key] - time) / (4 * quarter)
            assert periods == pytest.approx(round(periods), abs=1e-4)


def test_the_printed_table_has_the_extremes_of_the_motion(nocdyn):
    nocdyn.write("oscillator.nml", OSCILLATOR)
    lines = nocdyn("run", "oscillator.nml").stdout.splitlines()
    assert lines[0].split() == ["quantity", "the", "last", "smallest", "at", "t", "[s]", "largest", "at", "t", "[s]"]
    name, *_, smallest, _, largest, _ = lines[1].split()
    assert (name, smallest, largest) == ("moment_spring", "-6", "6")


def test_the_summary_tells_the_steps_of_either_kind(nocdyn):
    for method, kind in (("rk45", "explicit"), ("rodas5p", "implicit")):
        nocdyn("run", CASE_2, "--out", "out", "--set", f"run.method={method}", "--set", "run.rtol=1e-6")
        summary = nocdyn.summary("out")
        other = "implicit" if kind == "explicit" else "explicit"
        assert summary["method"] == {
            "name": method,
            f"{kind}_steps": summary["counts"]["accepted_steps"],
            f"{other}_steps": 0,
            "switches": 0,
            "first_switches": [],
        }


def test_the_summary_tells_when_auto_switched(nocdyn):
    outcome = nocdyn("run", CASE_2, "--out", "out", "--set", "run.method=auto", "--set", "coupling.coupling.damping=1e6")
    summary = nocdyn.summary("out")
    method = summary["method"]
    assert method["explicit_steps"] > 0 and method["implicit_steps"] > 0
    assert method["explicit_steps"] + method["implicit_steps"] == summary["counts"]["accepted_steps"]
    assert method["switches"] == 1
    (switch,) = method["first_switches"]
    assert switch["to"] == "implicit" and 0 < switch["time"] < 0.01
    line = outcome.stdout.splitlines()[-2]
    assert line.startswith(f"{CASE_2}: stiff: implicit steps from t = 0.000")
    assert line.endswith(f", {method['implicit_steps']} of {summary['counts']['accepted_steps']} steps")


# The fan holds the disc at the speed of the torque, the faster the more stiffly; the torque vanishes every 4 pi s.
WAVERING = """\
&body name = 'disc' inertia = 0.01 /
&motor name = 'fan' body = 'disc' a = 1.0 b = 0.0 c = 1.0e4 /
&excitation name = 'slow' body = 'disc' amplitude = 1.0 frequency = 0.5 /
&run t_end = 30.0 method = 'auto' rtol = 1e-5 atol = 1e-8 /
&output points = 2 /
"""


def test_the_summary_tells_every_switch_with_its_direction(nocdyn):
    nocdyn.write("wavering.nml", WAVERING)
    outcome = nocdyn("run", "wavering.nml", "--out", "out")
    method = nocdyn.summary("out")["method"]
    switches = method["first_switches"]
    assert method["switches"] == len(switches) == 5
    assert [switch["to"] for switch in switches] == ["implicit", "explicit", "implicit", "explicit", "implicit"]
    times = [switch["time"] for switch in switches]
    assert times == sorted(times)
    for i, calm in ((1, 3 * math.pi), (3, 7 * math.pi)):
        assert times[i] < calm + 0.1 and calm < times[i + 1] < calm + 0.5
    assert " s (5 switches in all), " in outcome.stdout


def test_a_machine_that_is_not_stiff_is_not_said_to_be(nocdyn):
    assert "stiff" not in nocdyn("run", CASE_2, "--out", "out", "--set", "run.method=auto").stdout


def test_a_title_with_odd_characters_survives(nocdyn):
    title = 'Welle "öl" \\ 5 µm, it\'s'
    assert nocdyn("run", CASE_2, "--out", "out", "--set", "case.title=" + title).returncode == 0
    assert nocdyn.summary("out")["title"] == title


def test_a_title_that_is_not_utf_8_leaves_valid_json(nocdyn):
    path = nocdyn.folder / "latin.nml"
    path.write_bytes(CASE_2.read_bytes().replace(b"Paper", b"\xd6lwelle"))
    assert nocdyn("run", path, "--out", "out", "-q").returncode == 0
    json.loads((nocdyn.folder / "out/summary.json").read_bytes().decode("utf-8"))


@pytest.mark.parametrize("path", [CASE_2, FULL], ids=["case2", "full"])
@pytest.mark.parametrize(
    "overrides",
    [
        [],
        ["run.rtol=3e-7", "motor.drive.a=123.4567890123456789"],
        ["run.method=rosenbrock", "run.rtol=1e-5", "run.formulation=paper", "run.complement=negated"],
    ],
    ids=["plain", "numbers", "words"],
)
def test_input_nml_reproduces_the_run_bit_for_bit(nocdyn, path, overrides):
    words = [word for override in overrides for word in ("--set", override)]
    assert nocdyn("run", path, "--out", "first", *words).returncode == 0
    assert nocdyn("run", "first/input.nml", "--out", "second").returncode == 0
    first, second = ((nocdyn.folder / folder) for folder in ("first", "second"))
    assert (first / "trajectory.csv").read_bytes() == (second / "trajectory.csv").read_bytes()
    assert (first / "input.nml").read_bytes() == (second / "input.nml").read_bytes()


@fast_only
def test_a_motion_that_the_energy_balance_refutes_is_noted(nocdyn):
    nocdyn.write(
        "coarse.nml",
        """\
&body name = 'a' inertia = 1.0 /
&excitation name = 'x' body = 'a' amplitude = 1.0 frequency = 1000.0 /
&run t_end = 1000.0 rtol = 1e-3 atol = 1e-2 /
&output points = 1001 /
""",
    )
    outcome = nocdyn("run", "coarse.nml", "--out", "out")
    assert outcome.returncode == 0
    assert "coarse.nml: note: large energy balance error: energy_residual reaches " in outcome.stdout
    assert "tighten rtol and atol" in nocdyn.summary("out")["machine"]["notes"][0]


def test_a_motion_that_the_energy_balance_confirms_has_no_note(nocdyn):
    outcome = nocdyn("run", CASE_2, "--out", "out")
    assert "note" not in outcome.stdout
    assert nocdyn.summary("out")["machine"]["notes"] == []
