"""Each variant of a sweep is what its run is, whatever was computed before it in the same place: machines of all elements.

All numbers are equal to the last bit where the steps are. They are not where the method is 'auto' and variants share lanes, which
needs machines without rows that move: there it counts other costs (`is_shared` of the system), and so chooses other steps.
"""

import csv
import os
import random

import numpy as np
import pytest
from conftest import IS_SLOW
from random_machines import RandomMachine
from sweep_inputs import limited_to, needs_sweeps

pytestmark = needs_sweeps

MACHINES = int(os.environ.get("NOCDYN_RANDOM_MACHINES", "3" if IS_SLOW else "6"))  # more in a campaign
FIRST = int(os.environ.get("NOCDYN_FIRST_RANDOM_MACHINE", "1"))

RUN = "&run t_end = 0.5 max_steps = 200000 /\n&output points = 504 /\n"  # no row is where an engagement or an excitation jumps
METHODS = ("rk45", "rk853", "taylor", "rodas4", "rodas5p")
STATISTICS = ("final", "max", "min", "max_abs", "mean", "rms", "time_of_max", "time_of_min", "settling_time")
FACTORS = (1.0, 0.8, 1.25, 1.1)

OTHER_STEPS = 1e-3  # of the largest value of a column: the tolerances of the steps are 1e-6
ROWS = 0.05  # of means, which a run does not have: a single row that is apart
ROUNDING = 1e-9  # columns without larger values are zero but for rounding

TEETH = """\
&body name = 'a' inertia = 1.8 /
&body name = 'b' inertia = 0.461 /
&mesh name = 'c' bodies = 'a', 'b' radii = 0.1, 0.157 stiffness = 84000.0 damping = 26.1 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 46.2 /
&load name = 'l' body = 'b' viscous = 1.87 constant = 5.69 constant_speed = 0.413 /
&run t_end = 0.5 /
"""


def variants_of(machine, seed):
    """Some numbers that vary, and their values in each variant."""
    chance = random.Random(f"variants {seed}")
    targets = chance.sample(sorted(machine.targets), min(2, len(machine.targets)))
    rows = [[machine.targets[target] * factor for target in targets] for factor in FACTORS]
    return targets, rows


def run(nocdyn, targets, row):
    """Labels, rows of numbers and extremes of the run of a variant; None if it fails."""
    words = [f"--set={target}={value!r}" for target, value in zip(targets, row)]
    outcome = nocdyn("run", "machine.nml", "--out", "run", "--quiet", *words)
    if outcome.returncode:
        return None
    header, rows = nocdyn.table("run")
    values, extremes = dict(zip(header, np.array(rows).T)), nocdyn.summary("run")["columns"]
    for column in extremes.keys() & values.keys() - {"energy_residual [J]"}:  # of rounding
        of_run = extremes[column]
        size = OTHER_STEPS * max(abs(of_run["min"]), abs(of_run["max"]), ROUNDING)
        assert of_run["min"] - size <= min(values[column]) and max(values[column]) <= of_run["max"] + size, column
    return values, extremes


def write_sweep(nocdyn, text, targets, rows, columns):
    nocdyn.write("list.csv", "\n".join(",".join(map(repr, row)) for row in rows).join([",".join(targets) + "\n", "\n"]))
    kinds = ", ".join(f"'{statistic}'" for statistic in STATISTICS)
    records = "".join(f"&record quantity = '{column}' statistic = {kinds} /\n" for column in columns)
    nocdyn.write("sweep.nml", f"{text}&sweep design = 'list' file = 'list.csv' /\n{records}")


def sweep(nocdyn, folder, *words, **options):
    """The rows of sweep.csv."""
    outcome = nocdyn("sweep", "sweep.nml", "--out", folder, "--csv", "--quiet", *words, **options)
    assert outcome.returncode in (0, 1), outcome.stderr  # 1: all variants fail
    with open(nocdyn.folder / folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def differences(variant, values, extremes, tolerance):
    """Sentences on all that the sweep has not as the run. Without a tolerance every bit counts."""
    found = []
    t = values["t [s]"]
    for column, course in values.items():
        if column == "t [s]" or (tolerance and column == "energy_residual [J]"):
            continue
        name, unit = column.removesuffix("]").split(" [")
        of_run = extremes[column]
        largest = max(abs(of_run["min"]), abs(of_run["max"]))
        size = max(largest, ROUNDING)

        def compare(statistic, right, error=tolerance * size, unit=unit, name=name):
            value = float(variant[f"{name}_{statistic} [{unit}]"])
            if not abs(value - right) <= error:
                found.append(f"{name} {statistic}: {value!r} instead of {right!r}")

        compare("final", course[-1])
        compare("max", of_run["max"])
        compare("min", of_run["min"])
        compare("max_abs", largest)
        if column != "energy_residual [J]":  # it jumps from step to step, between the rows
            compare("mean", np.trapezoid(course, t) / (t[-1] - t[0]), ROWS * size)
            compare("rms", np.sqrt(np.trapezoid(course**2, t) / (t[-1] - t[0])), ROWS * size)
        if not tolerance:
            compare("time_of_max", of_run["time_of_max"], unit="s")
            compare("time_of_min", of_run["time_of_min"], unit="s")
    return found


def compare_with_runs(nocdyn, machine, targets, rows, run_group, tolerance):
    """The columns of the machine, and the rows of sweep.csv."""
    nocdyn.write("machine.nml", machine.text + run_group)
    runs = [run(nocdyn, targets, row) for row in rows]
    done = [values for values, _ in filter(None, runs)]
    if not done:
        pytest.skip("there is no such machine")
    columns = [column for column in done[0] if column != "t [s]" and all(column in values for values in done)]
    write_sweep(nocdyn, machine.text + run_group, targets, rows, columns)
    table = sweep(nocdyn, "one", "--threads", 1)
    wrong = []
    for number, (variant, of_run) in enumerate(zip(table, runs), 1):
        if of_run is None or variant["status"] != "done":
            if (of_run is None) == (variant["status"] == "done"):
                wrong.append(f"variant {number}: {variant['status']} {variant['reason']}")
        else:
            wrong += [f"variant {number}: {text}" for text in differences(variant, *of_run, tolerance)]
    assert not wrong, "\n".join([machine.text, str(targets), *wrong])
    return columns, table


@pytest.mark.parametrize("seed", range(FIRST, FIRST + MACHINES))
def test_a_variant_of_a_sweep_is_its_run(nocdyn, seed):
    machine = RandomMachine(seed)
    targets, rows = variants_of(machine, seed)
    method = METHODS[seed % len(METHODS)] if machine.shares_lanes else "auto"
    run_group = RUN.replace("&run", f"&run method = '{method}'")
    columns, table = compare_with_runs(nocdyn, machine, targets, rows, run_group, 0)
    if machine.has_joints:  # the steps of others follow their works too, if these are recorded
        columns = [column for column in columns if not column.startswith(("work", "energy"))]
    write_sweep(nocdyn, machine.text + run_group, targets, rows[::-1], columns)
    for row, other in zip(table, sweep(nocdyn, "reverse", "--threads", 1)[::-1]):
        del other["variant"]
        wrong = [f"{label}: {other[label]} {row[label]}" for label in other if other[label] != row[label]]
        assert not wrong, "\n".join([machine.text, str(targets), *wrong])


@pytest.mark.parametrize("seed", range(FIRST, FIRST + 1 + MACHINES // 10))
@pytest.mark.parametrize("method", ["auto", *METHODS])
@pytest.mark.parametrize("locks", [False, True])
def test_a_variant_that_shares_lanes_is_its_run(nocdyn, locks, method, seed):
    machine = next(
        machine
        for machine in map(RandomMachine, range(1000 * seed, 1000 * seed + 100))
        if machine.shares_lanes and machine.has_joints == locks
    )
    run_group = RUN.replace("&run", f"&run method = '{method}'")
    targets, rows = variants_of(machine, seed)
    compare_with_runs(nocdyn, machine, targets, rows, run_group, OTHER_STEPS if method == "auto" else 0)


@pytest.mark.parametrize("seed", range(FIRST, FIRST + 1 + MACHINES // 10))
def test_threads_shards_and_interruptions_do_not_show_where_joints_lock(nocdyn, seed):
    machine = next(machine for machine in map(RandomMachine, range(1000 * seed, 1000 * seed + 100)) if machine.has_joints)
    targets, rows = variants_of(machine, seed)
    rows = [[value * (1 + 0.01 * i) for value in row] for i in range(6) for row in rows]
    quantities = [f"phi_{machine.bodies[0]}", f"omega_{machine.bodies[-1]}", "kinetic_energy", "work_in"]
    write_sweep(nocdyn, machine.text + RUN, targets, rows, quantities)
    table = sweep(nocdyn, "one", "--threads", 1)
    assert sweep(nocdyn, "two", "--threads", 2) == table
    for part in (1, 2):
        assert nocdyn("sweep", "sweep.nml", "--out", "parts", "--shard", f"{part}/2", "--quiet").returncode == 0
    assert nocdyn("merge", "parts", "--csv").returncode == 0
    with open(nocdyn.folder / "parts/sweep.csv", newline="") as file:
        assert list(csv.DictReader(file)) == table
    for size in range(1000, 100000, 1000):  # until the journal has room for some of the variants
        outcome = nocdyn("sweep", "sweep.nml", "--out", "late", "--csv", "--threads", 1, preexec_fn=limited_to(size))
        assert outcome.returncode == 3
        if "--resume" in outcome.stderr:
            break
    assert sweep(nocdyn, "late", "--resume") == table


IMPACT = """\
&body name = 'a' inertia = 1 speed = 10 /
&body name = 'b' inertia = 1 /
&clutch name = 'k' bodies = 'a', 'b' kind = 'dog' times = TIME levels = 1 /
&load name = 'l' body = 'b' viscous = 2 /
&run t_end = 1 /
&sweep design = 'grid' /
&vary target = 'body.b.inertia' low = 1 high = 1.25 count = 2 /
&record quantity = 'omega_b' statistic = 'max', 'time_of_max' /
&record quantity = 'omega_a' statistic = 'max', 'time_of_max' /
"""


def test_statistics_of_a_tooth_force_have_its_sign(nocdyn):
    nocdyn.write("machine.nml", TEETH)
    values, extremes = run(nocdyn, [], [])
    assert max(values["force_c [N]"]) <= 0 and extremes["force_c [N]"]["max"] <= 0 and extremes["force_c [N]"]["min"] < -90
    write_sweep(nocdyn, TEETH, ["body.a.inertia"], [[1.8]], ["force_c"])
    (variant,) = sweep(nocdyn, "one")
    assert not differences(variant, {name: values[name] for name in ("t [s]", "force_c [N]")}, extremes, OTHER_STEPS)


@pytest.mark.parametrize("time", [0, 0.3])
def test_extremes_are_those_after_an_impact(nocdyn, time):
    nocdyn.write("sweep.nml", IMPACT.replace("TIME", str(time)))
    for row, inertia in zip(sweep(nocdyn, "out"), (1, 1.25)):
        common = 10 / (1 + inertia)
        assert float(row["omega_b_max [rad/s]"]) == pytest.approx(common, rel=1e-12)
        assert float(row["omega_a_max [rad/s]"]) == pytest.approx(10 if time > 0 else common, rel=1e-12)
        assert float(row["omega_b_time_of_max [s]"]) == pytest.approx(time, abs=1e-12)
        assert float(row["omega_a_time_of_max [s]"]) == 0


def test_the_time_beside_the_largest_magnitude_is_of_that(nocdyn):
    text = "&body name = 'a' inertia = 1 /\n&coupling name = 'c' bodies = 'ground', 'a' stiffness = 1 /\n"
    text += (
        "&excitation name = 'e' body = 'a' kind = 'step' amplitude = -1 time = 0 /\n&run t_end = 6 rtol = 1e-10 atol = 1e-10 /\n"
    )
    text += "&sweep design = 'grid' /\n&vary target = 'body.a.inertia' low = 1 high = 4 count = 2 /\n"
    text += "&record quantity = 'phi_a' statistic = 'max_abs', 'time_of_max', 'time_of_min', 'time_of_max_abs' /\n"
    text += "&record quantity = 'moment_c' statistic = 'max_abs', 'max', 'time_of_max', 'time_of_max_abs' /\n"
    nocdyn.write("sweep.nml", text)
    for row, period in zip(sweep(nocdyn, "out"), (2 * np.pi, 4 * np.pi)):
        for label in ("time_of_max", "time_of_min", "time_of_max_abs"):
            assert float(row[f"phi_a_{label} [s]"]) == pytest.approx(min(period / 2, 6), abs=1e-6)  # phi = cos(omega t) - 1
        assert float(row["moment_c_time_of_max_abs [s]"]) == pytest.approx(min(period / 2, 6), abs=1e-6)
        assert float(row["moment_c_time_of_max [s]"]) == 0


def test_variants_of_a_long_chain_may_end_at_other_times(nocdyn):
    # their formulation is not laid out as a block
    text = "".join(f"&body name = 'b{i}' inertia = 1 speed = {3 if i == 0 else 0} /\n" for i in range(24))
    text += "".join(f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 100 /\n" for i in range(23))
    text += "&run t_end = 1 /\n&sweep design = 'grid' /\n&vary target = 'run.t_end' low = 1 high = 2 count = 2 /\n"
    nocdyn.write("sweep.nml", text + "&record quantity = 'kinetic_energy' statistic = 'max', 'final' /\n")
    for row, t_end in zip(sweep(nocdyn, "out"), (1, 2)):
        nocdyn("run", "sweep.nml", "--out", "run", "--set", f"run.t_end={t_end}", "--quiet")
        assert float(row["kinetic_energy_max [J]"]) == 4.5
        assert float(row["kinetic_energy_final [J]"]) == pytest.approx(
            nocdyn.summary("run")["columns"]["kinetic_energy [J]"]["last"], rel=1e-6
        )


def test_columns_may_count_from_later_times_than_the_columns_after_them(nocdyn):
    text = "&body name = 'a' inertia = 1 speed = 3 /\n&coupling name = 'c' bodies = 'ground', 'a' stiffness = 100 /\n"
    text += "&run t_end = 1 /\n&sweep design = 'grid' /\n&vary target = 'body.a.inertia' low = 1 high = 2 count = 2 /\n"
    text += "&record quantity = 'kinetic_energy' statistic = 'max' from = 0.9 /\n"
    nocdyn.write("sweep.nml", text + "&record quantity = 'elastic_energy' statistic = 'max', 'mean' /\n")
    for row, energy in zip(sweep(nocdyn, "out"), (4.5, 9.0)):
        assert float(row["elastic_energy_max [J]"]) == pytest.approx(energy, rel=1e-6)
        assert float(row["elastic_energy_mean [J]"]) == pytest.approx(energy / 2, rel=0.1)


def test_the_extreme_of_a_run_after_a_jump_is_at_the_jump(nocdyn):
    text = "&body name = 'a' inertia = 1 /\n&excitation name = 'e' body = 'a' kind = 'step' amplitude = 5 time = 0.25 /\n"
    nocdyn.write("machine.nml", text + "&run t_end = 1 /\n&output interval = 0.3 /\n")
    assert nocdyn("run", "machine.nml", "--out", "run").returncode == 0
    torque = nocdyn.summary("run")["columns"]["torque_e [N m]"]
    assert (torque["max"], torque["time_of_max"]) == (5, 0.25)


def test_projected_start_speeds_follow_an_inertia_that_varies(nocdyn):
    text = "&body name = 'a' inertia = 1 speed = 10 /\n&body name = 'b' inertia = 1 speed = 2 /\n"
    text += "&cardan name = 'c' bodies = 'a', 'b' angle_deg = 30 /\n&run t_end = 0.5 start = 'projected' /\n"
    text += "&sweep design = 'grid' /\n&vary target = 'body.b.inertia' low = 1 high = 4 count = 3 /\n"
    nocdyn.write("sweep.nml", text + "&record quantity = 'omega_a' statistic = 'final' /\n")
    for row, inertia in zip(sweep(nocdyn, "out", "--threads", 1), (1, 2.5, 4)):
        nocdyn("run", "sweep.nml", "--out", "run", "--set", f"body.b.inertia={inertia}", "--quiet")
        assert float(row["omega_a_final [rad/s]"]) == nocdyn.summary("run")["columns"]["omega_a [rad/s]"]["last"]


def test_variants_start_with_speeds_that_follow_through_couplings(nocdyn):
    text = "&body name = 'a' inertia = 1 speed = 10 /\n&body name = 'b' inertia = 1 /\n&body name = 'c' inertia = 1 /\n"
    text += (
        "&coupling name = 'k' bodies = 'a', 'b' stiffness = 5 damping = 1 /\n&gear name = 'g' bodies = 'b', 'c' radii = 1, 2 /\n"
    )
    text += "&load name = 'l' body = 'c' viscous = 0.1 /\n&run t_end = 0.5 /\n&sweep design = 'list' file = 'list.csv' /\n"
    nocdyn.write("sweep.nml", text + "&record quantity = 'omega_c' statistic = 'max_abs', 'final' /\n")
    paths = ["coupling.k.stiffness", "body.a.inertia", "gear.g.radii(2)", "body.a.speed"]
    variants = [(5, 1, 2, 10), (0, 1, 2, 10), (5, 2, 4, 8), (7, 3, 2, 8)]
    nocdyn.write("list.csv", ",".join(paths) + "\n" + "".join(",".join(map(str, values)) + "\n" for values in variants))
    for row, values in zip(sweep(nocdyn, "out"), variants):
        options = [f"--set={path}={value}" for path, value in zip(paths, values)]
        nocdyn("run", "sweep.nml", "--out", "run", "--quiet", *options)
        column = nocdyn.summary("run")["columns"]["omega_c [rad/s]"]
        assert float(row["omega_c_final [rad/s]"]) == column["last"]
        fastest = max(abs(column["min"]), abs(column["max"]))
        assert float(row["omega_c_max_abs [rad/s]"]) == fastest
        assert (fastest > 0.9 * values[3] / values[2]) == (values[0] > 0)  # a damper alone begins with a jolt
