"""What is recorded of a variant is the quantity of that name, whatever columns its machine has and in whatever order."""

import csv
import functools
import re

import pytest
from sweep_inputs import TWO_DISCS, needs_sweeps

pytestmark = needs_sweeps

# Each number that decides by 0 which banks and columns there are stands here with a value that is not 0.
MACHINE = """\
&body     name = 'rotor'  inertia = 2.0  speed = 3.0 /
&body     name = 'disc'   inertia = 1.0 /
&body     name = 'wheel'  inertia = 1.5  speed = -1.0 /
&coupling name = 'shaft'  bodies = 'rotor', 'disc'   stiffness = 40.0  damping = 0.2 /
&coupling name = 'belt'   bodies = 'disc', 'wheel'   stiffness = 30.0  gap = 0.1  damping = 0.3 /
&coupling name = 'clutch' bodies = 'ground', 'wheel' stiffness = 5.0   friction = 0.4 /
&motor    name = 'drive'  body = 'rotor'  kind = 'dc'  voltage = 12.0  resistance = 0.5  flux_constant = 0.3  inductance = 0.2 /
&motor    name = 'engine' body = 'wheel'  kind = 'dc'  voltage = 6.0   resistance = 0.8  flux_constant = 0.2  inductance = 0.3
          governor_speed = 8.0  governor_gain = 0.2  governor_time = 0.5 /
&load     name = 'air'    body = 'disc'   quadratic = 0.02 /
&load     name = 'rub'    body = 'wheel'  viscous = 0.1  constant = 0.2  constant_speed = 0.3 /
&run      t_end = 0.5 rtol = 1e-9 atol = 1e-9 /
&output   points = 501 /
"""

VALUES = {
    "coupling.shaft.damping": (0.0, 0.2, 0.7),
    "coupling.shaft.gap": (0.0, 0.05, 0.2),
    "coupling.shaft.friction": (0.0, 0.3, 1.0),
    "coupling.belt.damping": (0.0, 0.3, 1.0),
    "coupling.belt.gap": (0.0, 0.1, 0.4),
    "coupling.belt.friction": (0.0, 0.3, 1.0),
    "coupling.clutch.friction": (0.0, 0.4, 1.0),
    "coupling.clutch.damping": (0.0, 0.5),
    "motor.drive.inductance": (0.0, 0.2, 0.5),
    "motor.engine.inductance": (0.0, 0.3, 0.6),
    "load.air.quadratic": (0.0, 0.02, 0.05),
    "load.air.constant": (0.0, 0.1),
    "load.rub.constant": (0.0, 0.2, 0.5),
}

# Of the largest value of a column, or of the largest energy. Rows are h = 1 ms apart: they miss a smooth extremum by x'' h^2 / 8
# at most, and that of a damping moment that begins with a contact by x' h.
TOLERANCE = 1e-3


@pytest.fixture(scope="module")
def quantities_of(shared_nocdyn):
    """Final and largest absolute value of every column but the time of a run with some numbers."""
    shared_nocdyn.write("machine.nml", MACHINE)

    @functools.cache
    def run(*words):
        assert shared_nocdyn("run", "machine.nml", "--out", "run", "--quiet", *words).returncode == 0
        header, rows = shared_nocdyn.table("run")
        return {label: (rows[-1][i], max(abs(row[i]) for row in rows)) for i, label in enumerate(header) if i > 0}

    return run


def sweep(nocdyn, targets, rows, quantities):
    """The rows of sweep.csv of a list of variants."""
    nocdyn.write("list.csv", "\n".join(",".join(map(str, row)) for row in [targets, *rows]) + "\n")
    records = "".join(f"&record quantity = '{quantity}' statistic = 'final', 'max_abs' /\n" for quantity in quantities)
    machine = (nocdyn.folder / "machine.nml").read_text()
    nocdyn.write("sweep.nml", machine + "&sweep design = 'list' file = 'list.csv' /\n" + records)
    outcome = nocdyn("sweep", "sweep.nml", "--out", "out", "--csv", "--quiet")
    assert outcome.stderr == ""
    with open(nocdyn.folder / "out/sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def machine_without(target):
    """The machine in which a number is 0."""
    group, name, key = target.split(".")
    line = next(line for line in MACHINE.splitlines() if re.match(rf"&{group} +name = '{name}' ", line))
    rest = re.sub(rf" {key} = \S+", "", line)
    return MACHINE.replace(line, re.sub(r"(name = '\w+')", rf"\1 {key} = 0.0", rest))


def compare(row, run, quantities):
    energy = run["kinetic_energy [J]"][1]
    for quantity in quantities:
        name, unit = quantity.removesuffix("]").split(" [")
        final, largest = run.get(quantity, run.get(quantity.removeprefix("total_"), (0.0, 0.0)))
        tolerance = TOLERANCE * (energy if unit == "J" else max(largest, 1e-3))
        assert float(row[f"{name}_final [{unit}]"]) == pytest.approx(final, abs=tolerance), quantity
        assert float(row[f"{name}_max_abs [{unit}]"]) == pytest.approx(largest, abs=tolerance), quantity


@pytest.mark.parametrize("base", ["as it is", "without it"])
@pytest.mark.parametrize("target", VALUES)
@pytest.mark.parametrize("order", ["first zero", "last zero"])
def test_a_number_that_changes_the_columns_leaves_every_quantity_its_own(nocdyn, quantities_of, target, base, order):
    nocdyn.write("machine.nml", MACHINE if base == "as it is" else machine_without(target))
    values = VALUES[target] if order == "first zero" else VALUES[target][::-1]
    runs = [quantities_of(f"--set={target}={value}") for value in values]
    # the current of a motor without inductance is no torque that is not there
    quantities = [label for label in {**runs[0], **runs[-1]} if all(label in run or label.endswith("[N m]") for run in runs)]
    rows = sweep(nocdyn, [target], [[value] for value in values], quantities)
    for row, run in zip(rows, runs, strict=True):
        assert row["status"] == "done"
        compare(row, run, quantities)


def test_several_numbers_may_change_the_columns(nocdyn, quantities_of):
    nocdyn.write("machine.nml", MACHINE)
    targets = [
        "coupling.shaft.damping",
        "coupling.shaft.gap",
        "coupling.clutch.friction",
        "load.rub.constant",
        "load.rub.quadratic",
    ]
    rows = [
        (0.1, 0, 0.4, 0.2, 0.1),
        (0, 0, 0.4, 0, 0),
        (0.2, 0.1, 0, 0.2, 0),
        (0, 0.1, 0, 0, 0.1),
        (0, 0, 0, 0, 0),
        (1, 0, 1, 1, 1),
    ]
    runs = [quantities_of(*(f"--set={t}={v}" for t, v in zip(targets, row, strict=True))) for row in rows]
    results = sweep(nocdyn, targets, rows, runs[0])
    for row, run in zip(results, runs, strict=True):
        compare(row, run, runs[0])


def test_torques_that_are_not_there_are_0_and_at_their_largest_from_the_start(nocdyn):
    nocdyn.write("machine.nml", MACHINE + "&record quantity = 'damping_shaft' statistic = 'mean', 'time_of_max' from = 0.25 /\n")
    row = sweep(nocdyn, ["coupling.shaft.damping"], [[0], [0.2]], ["damping_shaft"])[0]
    results = [value for label, value in row.items() if label.startswith("damping_shaft")]
    assert [float(value) for value in results] == [0.0, 0.25, 0.0, 0.0]


def test_the_moment_in_a_shaft_without_damping_is_the_elastic_one(nocdyn, quantities_of):
    nocdyn.write("machine.nml", MACHINE)
    values = [0, 0.2]
    rows = sweep(nocdyn, ["coupling.shaft.damping"], [[value] for value in values], ["total_moment_shaft", "moment_shaft"])
    runs = [quantities_of(f"--set=coupling.shaft.damping={value}") for value in values]
    assert "total_moment_shaft [N m]" not in runs[0]
    assert rows[0]["total_moment_shaft_max_abs [N m]"] == rows[0]["moment_shaft_max_abs [N m]"]
    assert rows[1]["total_moment_shaft_max_abs [N m]"] != rows[1]["moment_shaft_max_abs [N m]"]
    compare(rows[1], runs[1], ["total_moment_shaft [N m]", "moment_shaft [N m]"])


@pytest.mark.parametrize("values", [(0, 0.2), (0.2, 0)])
def test_a_variant_without_a_quantity_that_is_no_torque_is_refused(nocdyn, values):
    nocdyn.write("machine.nml", MACHINE)
    rows = sweep(nocdyn, ["motor.drive.inductance"], [[value] for value in values], ["current_drive"])
    for row, value in zip(rows, values, strict=True):
        reason = "" if value else "current_drive is recorded, but this machine has no such column"
        assert (row["status"], row["reason"]) == ("done" if value else "refused", reason)


def test_a_quantity_that_no_variant_has_is_refused(nocdyn):
    nocdyn.write("list.csv", "coupling.clutch.friction_speed\n1\n2\n")
    groups = "&sweep design = 'list' file = 'list.csv' /\n&record quantity = 'damping_drive' statistic = 'final' /\n"
    nocdyn.write("sweep.nml", MACHINE + groups)
    outcome = nocdyn("sweep", "sweep.nml", "--out", "out")
    assert outcome.returncode == 2
    assert "quantity = 'damping_drive' is no column of trajectory.csv" in outcome.stderr


def test_times_that_vary_past_those_of_the_file_leave_statistics_room(nocdyn):
    nocdyn.write("machine.nml", MACHINE + "&record quantity = 'omega_disc' statistic = 'mean' from = 1.5 /\n")
    rows = sweep(nocdyn, ["run.t_end"], [[2.0], [1.0], [3.0]], ["omega_rotor"])
    assert [row["status"] for row in rows] == ["done", "refused", "done"]
    assert "from = 1.5 is out of range" in rows[1]["reason"]


def test_numbers_that_change_the_machine_only_together_do_so_wherever_the_work_begins(nocdyn):
    nocdyn.write("machine.nml", TWO_DISCS)
    rows = [(0.1, 0.2), (0.2, 0.1), (0, 0), (0, 0), (0.3, 0.3), (0, 0.1)]
    whole = sweep(nocdyn, ["load.drag.quadratic", "load.drag.constant"], rows, ["torque_drag"])
    assert {row["status"] for row in whole} == {"done"}
    assert whole[2]["torque_drag_max_abs [N m]"] == whole[3]["torque_drag_max_abs [N m]"]
    assert len({row["torque_drag_max_abs [N m]"] for row in whole}) == 5
    for part in (1, 2):
        assert nocdyn("sweep", "sweep.nml", "--out", "shards", "--shard", f"{part}/2").returncode == 0
    nocdyn("merge", "shards")
    assert (nocdyn.folder / "shards/sweep.nc").read_bytes() == (nocdyn.folder / "out/sweep.nc").read_bytes()
