"""Sweeps that record modes and forced responses, and numbers that are tied to each other."""

import csv
import json
import subprocess
from math import pi, sqrt

import f90nml
import pytest
from sweep_inputs import MPI_ENVIRONMENT, mpirun, needs_mpi, needs_sweeps

pytestmark = needs_sweeps

J_1, J_2, STIFFNESS = 3.0, 2.0, 5.0e4
NATURAL = sqrt(STIFFNESS * (1 / J_1 + 1 / J_2))
LOSSY = "magnifier = 50"  # has no equivalent in time: no motion can be computed
VISCOUS = "damping = 20"
MACHINE = f"""\
&body name = 'one' inertia = {J_1} /
&body name = 'two' inertia = {J_2} /
&coupling name = 'shaft' bodies = 'one', 'two' stiffness = {STIFFNESS} DAMPING diameter = 0.1 /
&excitation name = 'x' body = 'one' kind = 'orders' orders = 2, 3 amplitudes = 7, 2 /
&run t_end = 1 /
&response body = 'one' speed_rpm = 300, 1500 count = 13 operating_rpm = 600, 700 /
&limit coupling = 'shaft' vibratory_moment = 300 stress = 1e7 /
"""
GRID = """\
&sweep design = 'grid' /
&vary target = 'coupling.shaft.stiffness' scale = 'relative' low = 0.8 high = 1.2 count = 3 /
"""
RESPONSES = """\
&record response = 'shaft' order = 2 statistic = 'peak', 'peak_speed', 'margin', 'ratio' /
&record response = 'stress_shaft' statistic = 'ratio', 'peak', 'peak_speed' /
"""
MODES = "&record mode = 1 statistic = 'frequency', 'damping_ratio' /\n"


def sweep(nocdyn, text, *words):
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", "swept", "--csv", "-q", *words)
    assert outcome.returncode == 0, outcome.stderr
    return rows(nocdyn.folder / "swept/sweep.csv")


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def report(nocdyn, command, text, value):
    path = nocdyn.write("alone.nml", text)
    outcome = nocdyn(command, path, "--out", "alone", "--set", f"coupling.shaft.stiffness={value!r}")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "alone" / f"{command}.json").read_text())


def test_recorded_responses_are_those_of_the_machine_alone(nocdyn):
    machine = MACHINE.replace("DAMPING", LOSSY)
    found = sweep(nocdyn, machine + GRID + RESPONSES)
    assert [float(row["coupling.shaft.stiffness [1]"]) for row in found] == [0.8, 1.0, 1.2]
    for row in found:
        alone = report(nocdyn, "response", machine, STIFFNESS * float(row["coupling.shaft.stiffness [1]"]))
        order_2 = alone["critical_speeds"][0]
        assert order_2["order"] == 2
        assert float(row["moment_shaft_order_2_peak [N m]"]) == order_2["moment_N_m"]
        speed = float(row["moment_shaft_order_2_peak_speed [rad/s]"])
        assert speed == order_2["peak_speed_rad_s"]
        assert float(row["moment_shaft_order_2_margin"]) == order_2["distance_to_operation"]
        modulus = pi * 0.1**3 / 16
        by_order = order_2["moment_N_m"] * max(1 / 300, 1 / modulus / 1e7)
        assert float(row["moment_shaft_order_2_ratio"]) == pytest.approx(by_order, rel=1e-12)
        stress = alone["largest"][1]
        assert stress["quantity"] == "stress_shaft"
        assert float(row["stress_shaft_peak [Pa]"]) == stress["half_range"]
        assert float(row["stress_shaft_peak_speed [rad/s]"]) == stress["half_range_speed_rad_s"]
        assert float(row["stress_shaft_ratio"]) == stress["ratio_to_limit"]


def test_records_do_not_depend_on_what_a_response_writes(nocdyn):
    machine = MACHINE.replace("DAMPING", LOSSY)
    some = machine.replace("&response ", "&response signals = 'phi_one' ")
    assert sweep(nocdyn, some + GRID + RESPONSES) == sweep(nocdyn, machine + GRID + RESPONSES)


def test_recorded_modes_are_those_of_the_machine_alone(nocdyn):
    machine = MACHINE.replace("DAMPING", VISCOUS)
    for row in sweep(nocdyn, machine + GRID + MODES):
        factor = float(row["coupling.shaft.stiffness [1]"])
        alone = report(nocdyn, "modes", machine, STIFFNESS * factor)
        (mode,) = [mode for mode in alone["modes"] if mode["kind"] == "oscillating"]
        assert float(row["mode_1_frequency [Hz]"]) == mode["frequency_Hz"]
        assert float(row["mode_1_damping_ratio"]) == mode["damping_ratio"]
        ratio = 20 * (1 / J_1 + 1 / J_2) / 2 / (NATURAL * sqrt(factor))
        assert mode["damping_ratio"] == pytest.approx(ratio, rel=1e-10)


PATHS = (
    "equilibrium.steady_states[1].values.moment_shaft [N m]",
    "modes.modes[2].frequency_Hz",
    "modes.modes[2].shape[1]",
    "campbell.crossings[2].speed_rad_s",
    "response.limits_exceeded",
    "response.largest[1].half_range",
)
TURNING = (
    MACHINE.replace("DAMPING", VISCOUS).replace("inertia", "speed = 60 inertia")
    + """\
&motor name = 'm' body = 'one' a = 100 b = 1 c = 0 /
&load name = 'l' body = 'two' viscous = 0.5 /
"""
)


def value_at(content, path):
    """The number that a path such as 'modes[2].shape[1]' has in JSON that has been read."""
    if path in content:
        return float(content[path])
    head, _, rest = path.partition(".")
    name, _, index = head.partition("[")
    content = content[name][int(index[:-1]) - 1] if index else content[name]
    return value_at(content, rest) if rest else float(content)


def test_a_number_of_any_report_is_recorded_by_its_path(nocdyn):
    listed = ", ".join(f"'{path}'" for path in PATHS)
    found = sweep(nocdyn, TURNING + GRID + f"&record path = {listed} /\n" + MODES)
    assert sweep(nocdyn, TURNING + GRID + f"&record path = {listed} /\n" + MODES, "--threads", "3") == found
    stiffness = [STIFFNESS * share for share in (0.8, 1.0, 1.2)]
    for row, value in zip(found, stiffness, strict=True):
        for path in PATHS:
            command, place = path.split(".", 1)
            assert float(row[path]) == value_at(report(nocdyn, command, TURNING, value), place)
        assert row["modes.modes[2].frequency_Hz"] == row["mode_1_frequency [Hz]"]
    assert len({row["campbell.crossings[2].speed_rad_s"] for row in found}) == 3


def test_a_variant_without_the_number_of_a_path_fails_and_says_so(nocdyn):
    grid = GRID.replace("low = 0.8 high = 1.2", "low = 1.0 high = 20.0")  # the mode leaves the range of speeds
    found = sweep(nocdyn, TURNING + grid + "&record path = 'campbell.crossings[1].speed_rad_s' /\n")
    assert [row["status"] for row in found] == ["done", "failed", "failed"]
    assert found[1]["reason"] == "campbell.json of this variant has no number crossings[1].speed_rad_s"


CLUTCH = """\
&body name = 'three' inertia = 1 speed = 60 /
&clutch name = 'k' bodies = 'two', 'three' capacity = 1e6 /
"""


def test_sweeps_of_modes_and_responses_lock_clutches_as_the_commands_do(nocdyn):
    machine = TURNING + CLUTCH
    found = sweep(nocdyn, machine + GRID + "&record response = 'shaft' statistic = 'peak' /\n" + MODES)
    for row, share in zip(found, (0.8, 1.0, 1.2), strict=True):
        modes = report(nocdyn, "modes", machine, STIFFNESS * share)["modes"]
        assert [mode["frequency_Hz"] for mode in modes if mode["kind"] == "oscillating"] == [float(row["mode_1_frequency [Hz]"])]
        (largest, *_) = report(nocdyn, "response", machine, STIFFNESS * share)["largest"]
        assert largest["half_range"] == float(row["total_moment_shaft_peak [N m]"])


def test_motion_modes_and_responses_are_recorded_together_in_the_order_of_the_file(nocdyn):
    machine = MACHINE.replace("DAMPING", VISCOUS)
    motion = "&record quantity = 'omega_two' statistic = 'final' /\n"
    alone = [sweep(nocdyn, machine + GRID + record) for record in (MODES, motion, RESPONSES)]
    together = sweep(nocdyn, machine + GRID + MODES + motion + RESPONSES)
    labels = list(together[0])
    order = ["mode_1_frequency [Hz]", "omega_two_final [rad/s]", "total_moment_shaft_order_2_peak [N m]", "stress_shaft_ratio"]
    assert sorted(order, key=labels.index) == order
    for i, row in enumerate(together):
        for part in alone:
            own = {label: text for label, text in part[i].items() if label != "steps"}
            assert own.items() <= row.items()
        assert row["steps"] == alone[1][i]["steps"]


def test_results_of_analyses_do_not_depend_on_threads_or_shards(nocdyn):
    text = MACHINE.replace("DAMPING", VISCOUS) + GRID.replace("count = 3", "count = 37") + MODES + RESPONSES
    one = sweep(nocdyn, text, "--threads", "1")
    assert sweep(nocdyn, text, "--threads", "4") == one
    for shard in ("1/2", "2/2"):
        assert nocdyn("sweep", nocdyn.folder / "machine.nml", "--out", "shards", "-q", "--shard", shard).returncode == 0
    assert nocdyn("merge", "shards", "--csv", "-q").returncode == 0
    assert rows(nocdyn.folder / "shards/sweep.csv") == one


@needs_mpi
def test_results_of_analyses_do_not_depend_on_ranks(nocdyn):
    text = MACHINE.replace("DAMPING", VISCOUS) + GRID.replace("count = 3", "count = 37") + MODES + RESPONSES
    one = sweep(nocdyn, text)
    words = [*mpirun(2), "sweep", "machine.nml", "--out", "ranks", "--csv", "-q"]
    outcome = subprocess.run(words, cwd=nocdyn.folder, env=MPI_ENVIRONMENT, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    assert rows(nocdyn.folder / "ranks/sweep.csv") == one


def test_a_variant_without_the_mode_or_a_steady_state_fails_with_its_reason(nocdyn):
    machine = MACHINE.replace("DAMPING", VISCOUS)
    vary = "&sweep design = 'grid' /\n&vary target = 'coupling.shaft.damping' low = 20 high = 1e5 count = 2 /\n"
    light, heavy = sweep(nocdyn, machine + vary + MODES)
    assert (light["status"], heavy["status"]) == ("done", "failed")
    assert heavy["reason"] == "mode 1 is recorded, but the number of oscillating modes about the steady state is 0"
    falling = "&load name = 'l' body = 'one' table_speed = 0, 10, 1000 table_torque = 0, 10, 9 extrapolation = 'constant' /\n"
    vary = "&sweep design = 'grid' /\n&vary target = 'coupling.shaft.damping' low = 1e-6 high = 20 count = 2 /\n"
    unstable, stable = sweep(nocdyn, machine + falling + vary + RESPONSES)
    assert (unstable["status"], stable["status"]) == ("failed", "done")
    assert "the steady state is unstable" in unstable["reason"]
    assert unstable["total_moment_shaft_order_2_peak [N m]"] in ("", "nan", "NaN")


CHAIN = """\
&body name = 'a' inertia = 2.0 speed = 1.0 /
&body name = 'b' inertia = 1.0 /
&body name = 'c' inertia = 1.0 /
&body name = 'd' inertia = 1.0 /
&coupling name = 'crank_1' bodies = 'a', 'b' stiffness = 40.0 damping = 0.2 /
&coupling name = 'crank_2' bodies = 'b', 'c' stiffness = 70.0 damping = 0.0 /
&coupling name = 'shaft'   bodies = 'c', 'd' stiffness = 55.0 damping = 0.1 /
&run t_end = 2.0 /
&record quantity = 'omega_c' statistic = 'final', 'max' /
"""


def tied(pattern, scale, values):
    low, high = values[0], values[-1]
    return (
        f"&sweep design = 'grid' /\n&vary target = '{pattern}' scale = '{scale}' "
        f"low = {low} high = {high} count = {len(values)} /\n"
    )


@pytest.mark.parametrize(
    ("pattern", "scale", "values", "targets"),
    [
        ("coupling.crank_*.stiffness", "relative", (0.5, 1.0, 1.5), {"crank_1.stiffness": 40.0, "crank_2.stiffness": 70.0}),
        ("coupling.crank_*.stiffness", "absolute", (40.0, 50.0, 60.0), {"crank_1.stiffness": 1, "crank_2.stiffness": 1}),
        ("coupling.*_2.stiffness", "relative", (0.5, 1.0, 1.5), {"crank_2.stiffness": 70.0}),
        ("coupling.*.damping", "relative", (0.0, 1.0, 2.0), {"crank_1.damping": 0.2, "crank_2.damping": 0, "shaft.damping": 0.1}),
    ],
)
def test_a_pattern_ties_the_numbers_that_a_list_gives_one_by_one(nocdyn, pattern, scale, values, targets):
    together = sweep(nocdyn, CHAIN + tied(pattern, scale, values))
    lines = [",".join(f"coupling.{target}" for target in targets)]
    lines += [",".join(repr(base * value) for base in targets.values()) for value in values]
    nocdyn.write("list.csv", "\n".join(lines) + "\n")
    one_by_one = sweep(nocdyn, CHAIN + "&sweep design = 'list' file = 'list.csv' /\n")
    results = ("omega_c_final [rad/s]", "omega_c_max [rad/s]", "steps")
    assert [[row[label] for label in results] for row in together] == [[row[label] for label in results] for row in one_by_one]
    assert len({row["omega_c_max [rad/s]"] for row in together}) == 3


def test_the_input_of_a_relative_number_can_be_set(nocdyn):
    text = CHAIN + tied("coupling.crank_1.stiffness", "relative", (0.5, 1.0))
    set_to_80 = sweep(nocdyn, text, "--set", "coupling.crank_1.stiffness=80")
    plain = sweep(nocdyn, text)
    assert set_to_80[0]["omega_c_final [rad/s]"] == plain[1]["omega_c_final [rad/s]"]


def test_trajectories_of_tied_variants_are_those_of_the_variants(nocdyn):
    text = CHAIN + tied("coupling.crank_*.stiffness", "relative", (0.5, 1.0)) + "&record trajectories = 1 /\n"
    found = sweep(nocdyn, text)
    header, table = nocdyn.table("swept/variant-1")
    assert table[-1][header.index("omega_c [rad/s]")] == pytest.approx(float(found[0]["omega_c_final [rad/s]"]), rel=1e-5)
    groups = f90nml.read(nocdyn.folder / "swept/variant-1/input.nml")["coupling"]
    assert [group["stiffness"] for group in groups] == [20.0, 35.0, 55.0]


@pytest.mark.parametrize(
    ("groups", "complaint"),
    [
        (
            "&vary target = 'coupling.sh_*.stiffness' low = 1 high = 2 /",
            "machine.nml:9: &vary: target = 'coupling.sh_*.stiffness': no &coupling has a name like 'sh_*'; allowed: 'shaft'",
        ),
        (
            "&vary target = 'coupling.*.stiffness' low = 1 high = 2 /\n"
            "&vary target = 'coupling.shaft.stiffness' low = 1 high = 2 /",
            "machine.nml:10: &vary: target = 'coupling.shaft.stiffness': varies already, as number 1; allowed: once",
        ),
        (
            "&vary target = 'coupling.shaft.gap' scale = 'relative' low = 1 high = 2 /",
            "target = 'coupling.shaft.gap': scale = 'relative' multiplies the value in the input, and that is 0 or not given; "
            "needed: another value, or scale = 'absolute'",
        ),
        (
            "&vary target = 'coupling.shaft.gap' scale = 'rel' low = 1 high = 2 /",
            "scale = 'rel' is not known; allowed: 'absolute', 'relative'",
        ),
        ("&record mode = 0 statistic = 'frequency' /", "mode = 0 is out of range; allowed: >= 1"),
        (
            "&record mode = 2 statistic = 'frequency' /",
            "mode = 2 is out of range; the machine of the input has 1 oscillating modes about its steady state",
        ),
        ("&record mode = 1 /", "mode needs statistic"),
        ("&record mode = 1 path = 'modes.modes[1].frequency_Hz' statistic = 'frequency' /", "mode and path"),
        ("&record path = 'modes.modes[1].frequency_Hz' statistic = 'max' /", "statistic needs"),
        (
            "&record path = 'mode.frequency_Hz' /",
            "path = 'mode.frequency_Hz' does not begin with the name of an analysis; allowed: 'equilibrium.', 'modes.', "
            "'campbell.', 'response.' or 'orbit.' and what its report has",
        ),
        (
            "&record path = 'modes.modes[2].frequency_hz' /",
            "path = 'modes.modes[2].frequency_hz': modes.json of this machine has no number 'modes[2].frequency_hz'; "
            "did you mean 'modes[2].frequency_Hz'?",
        ),
        (
            "&record path = 'modes.modes[2].frequency_Hz', 'modes.modes[2].frequency_Hz' /",
            "'modes.modes[2].frequency_Hz' is recorded already; allowed: once",
        ),
        ("&record mode = 1 response = 'shaft' statistic = 'peak' /", "mode and response"),
        ("&record quantity = 'omega_one' mode = 1 statistic = 'final' /", "quantity and mode"),
        ("&record mode = 1 order = 2 statistic = 'frequency' /", "is of the mode alone; allowed: no order"),
        (
            "&record mode = 1 statistic = 'peak' /",
            "statistic = 'peak' does not belong to mode; allowed: 'frequency', 'damping_ratio'",
        ),
        (
            "&record response = 'shaft' statistic = 'max' /",
            "statistic = 'max' does not belong to response; allowed: 'peak', 'peak_speed', 'margin', 'ratio'",
        ),
        (
            "&record quantity = 'omega_one' statistic = 'peak' /",
            "statistic = 'peak' does not belong to quantity; needed: mode or response",
        ),
        (
            "&record response = 'shafts' statistic = 'peak' /",
            "response = 'shafts' is no coupling, shaft or mesh, and no column of response.csv; did you mean 'shaft'?",
        ),
        (
            "&record response = 'shaft' order = 4 statistic = 'peak' /",
            "order = 4: no excitation has this order of 'one'; the orders of the excitations are 2, 3",
        ),
        (
            "&record response = 'shaft' statistic = 'peak' /\n&record response = 'shaft' statistic = 'peak' /",
            "machine.nml:10: &record: 'total_moment_shaft_peak' is recorded already; allowed: once",
        ),
    ],
)
def test_wrong_groups_are_refused(nocdyn, groups, complaint):
    text = MACHINE.replace("DAMPING", VISCOUS) + "&sweep design = 'random' samples = 2 /\n" + groups
    if "&vary" not in groups:
        text += "\n&vary target = 'coupling.shaft.damping' low = 1 high = 2 /"
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", "swept")
    assert outcome.returncode == 2
    assert complaint in outcome.stderr
    assert not (nocdyn.folder / "swept").exists()


@pytest.mark.parametrize(
    ("lost", "statistic", "complaint"),
    [
        (
            "operating_rpm = 600, 700",
            "margin",
            "statistic = 'margin' is the distance to the speeds in operation; needed: operating",
        ),
        (
            "&limit coupling = 'shaft' vibratory_moment = 300 stress = 1e7 /",
            "ratio",
            "statistic = 'ratio' needs a &limit of 'shaft'",
        ),
        (
            "&response body = 'one' speed_rpm = 300, 1500 count = 13 operating_rpm = 600, 700 /",
            "peak",
            "there is no group &response",
        ),
    ],
)
def test_a_result_whose_numbers_are_missing_is_refused(nocdyn, lost, statistic, complaint):
    text = (
        MACHINE.replace("DAMPING", VISCOUS).replace(lost, "") + GRID + f"&record response = 'shaft' statistic = '{statistic}' /\n"
    )
    outcome = nocdyn("sweep", nocdyn.write("machine.nml", text), "--out", "swept")
    assert outcome.returncode == 2
    assert complaint in outcome.stderr
