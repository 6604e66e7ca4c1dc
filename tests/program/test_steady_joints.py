"""Joints, losses and drives in analyses about a steady state: which are locked, and what the teeth lose."""

import csv
import json
import random

import pytest
from conftest import IS_SLOW

BODIES = "".join(
    f"&body name = '{name}' inertia = {inertia} /\n"
    for name, inertia in (("sun", 1), ("ring", 2), ("carrier", 3), ("out", 5), ("load", 4))
)
GEARBOX = (
    BODIES
    + """&planetary name = 'set' sun = 'sun' ring = 'ring' carrier = 'carrier' teeth = 30, 60 /
&coupling name = 'shaft' bodies = 'carrier', 'out' stiffness = 1000 damping = 1 /
&motor name = 'm' body = 'sun' a = 100 b = 1 c = 0 /
&load name = 'l' body = 'load' viscous = 2 /
"""
)
EXCITATION = "&excitation name = 'e' body = 'load' kind = 'orders' orders = 2 amplitudes = 5 /\n"
END = "&response body = 'sun' speed = 20, 200 /\n&run t_end = 60 rtol = 1e-9 atol = 1e-10 /\n&output interval = 1 /\n"
GEAR = "&gear name = '{}' bodies = '{}', '{}' teeth = 1, 1 internal = .true. /\n"


def steady_states(nocdyn, text):
    outcome = nocdyn("equilibrium", nocdyn.write("machine.nml", text), "--out", "steady")
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "steady/equilibrium.json").read_text())


def last_row(nocdyn, text):
    outcome = nocdyn("run", nocdyn.write("machine.nml", text), "--out", "run", "--quiet")
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table("run")
    return dict(zip(header, rows[-1], strict=True))


def same_state(state, row, tolerance):
    """Whether a steady state has the values of a row of a run, in all columns that both have."""
    values = {key: value for key, value in state["values"].items() if key in row}
    assert len(values) > 5
    return all(abs(value - row[key]) <= tolerance * max(1, abs(value)) for key, value in values.items())


def test_a_clutch_is_locked_or_open_by_its_last_level(nocdyn):
    text = GEARBOX + (
        "&clutch name = 'brake' bodies = 'ring', 'ground' capacity = 300 times = 0, 0.5 levels = 0, 1 /\n"
        "&clutch name = 'direct' bodies = 'sun', 'ring' capacity = 300 table_time = 0.2, 0.5 table_level = 1, 0 /\n"
        "&clutch name = 'last' bodies = 'out', 'load' kind = 'dog' /\n"
    )
    found = steady_states(nocdyn, text + END)
    assert found["notes"][:2] == [
        "locked in this state: clutch 'brake', clutch 'last'",
        "open in this state: clutch 'direct'",
    ]
    values = found["steady_states"][0]["values"]
    assert values["omega_sun [rad/s]"] == pytest.approx(3 * values["omega_carrier [rad/s]"], rel=1e-12)
    assert values["omega_ring [rad/s]"] == 0
    # The brake carries the torque of the ring, twice that of the sun.
    assert values["torque_brake [N m]"] == pytest.approx(-2 * values["torque_m [N m]"], rel=1e-12)
    assert same_state(found["steady_states"][0], last_row(nocdyn, text + END), 1e-6)


@pytest.mark.parametrize("lock", ["clutch", "freewheel", "drive"])
def test_locked_joints_are_as_rigid_as_gears(nocdyn, lock):
    gearbox = GEARBOX + EXCITATION
    joints = "&drive name = 'hold' body = 'ring' speed = 0 /\n"
    if lock != "drive":
        joints = "&clutch name = 'hold' bodies = 'ring', 'ground' kind = 'dog' /\n"
    kind = "freewheel" if lock == "freewheel" else "clutch"
    joints += f"&{kind} name = 'j' bodies = 'out', 'load' capacity = 1e4 /\n"
    held = gearbox.replace("&body name = 'ring' inertia = 2 /\n", "").replace("ring = 'ring'", "ring = 'ground'")
    tables = {}
    for name, text in (("joints", gearbox + joints + END), ("gears", held + GEAR.format("j", "out", "load") + END)):
        for command, table in (("modes", "modes.csv"), ("response", "response.csv"), ("campbell", "campbell.csv")):
            outcome = nocdyn(command, nocdyn.write(f"{name}.nml", text), "--out", name)
            assert outcome.returncode == 0, outcome.stderr
            with open(nocdyn.folder / name / table) as file:
                tables[name, command] = list(csv.DictReader(file))
    for command in ("modes", "response", "campbell"):
        rows, expected = tables["joints", command], tables["gears", command]
        assert len(rows) == len(expected) > 0
        for row, other in zip(rows, expected, strict=True):
            common = [key for key in other if key in row and "reaction" not in key]
            assert len(common) == len([key for key in other if "reaction" not in key])
            for key in common:
                if row[key] != other[key]:
                    assert float(row[key]) == pytest.approx(float(other[key]), rel=1e-9, abs=1e-9), key


def test_a_freewheel_that_would_pull_overruns(nocdyn):
    text = GEARBOX + "&clutch name = 'b' bodies = 'ring', 'ground' kind = 'dog' /\n"
    for direction, state in (("forward", "locked"), ("backward", "open")):
        joint = f"&freewheel name = 'f' bodies = 'out', 'load' direction = '{direction}' /\n"
        found = steady_states(nocdyn, text + joint + END)
        assert any(note.startswith(f"{state} in ") and "freewheel 'f'" in note for note in found["notes"])
        assert same_state(found["steady_states"][0], last_row(nocdyn, text + joint + END), 1e-5)


def test_a_clutch_that_cannot_hold_slips_in_the_steady_state(nocdyn):
    text = GEARBOX + "&clutch name = 'b' bodies = 'ring', 'ground' capacity = 20 /\n" + GEAR.format("g", "out", "load") + END
    text = text.replace("t_end = 60", "t_end = 200")
    found = steady_states(nocdyn, text)
    assert found["notes"] == ["slipping in this state: clutch 'b'"]
    # the sun has half of the torque of the ring, 10 N m, so that the motor turns with 90 rad/s
    assert found["steady_states"][0]["values"]["omega_sun [rad/s]"] == pytest.approx(90, rel=1e-12)
    assert found["steady_states"][0]["values"]["torque_b [N m]"] == pytest.approx(-20, rel=1e-12)
    assert same_state(found["steady_states"][0], last_row(nocdyn, text), 1e-5)


def test_a_brake_that_holds_nothing_back_is_a_state_without_modes(nocdyn):
    text = "&body name = 'a' inertia = 1 /\n&clutch name = 'b' bodies = 'a', 'ground' capacity = 20 /\n&run t_end = 1 /\n"
    assert (
        "steady state, at rest, stable: joints hold all that could move"
        in nocdyn("equilibrium", nocdyn.write("m.nml", text)).stdout
    )
    outcome = nocdyn("modes", "m.nml")
    assert outcome.returncode == 1
    assert outcome.stderr.endswith("m.nml: locked in this state: clutch 'b', so that nothing moves\n")


def test_what_a_brake_cannot_hold_and_nothing_else_brakes_has_no_steady_state(nocdyn):
    text = "&body name = 'a' inertia = 1 /\n&clutch name = 'b' bodies = 'a', 'ground' capacity = 20 /\n"
    text += "&motor name = 'm' body = 'a' kind = 'constant' torque = 30 /\n&run t_end = 1 /\n"
    outcome = nocdyn("equilibrium", nocdyn.write("m.nml", text))
    assert outcome.returncode == 1
    assert "clutch 'b' does not hold: locked it would carry 30 N m; allowed: -20 to 20; slipping, there is no" in outcome.stderr


def test_gears_that_contradict_each_other_are_refused_beside_brakes(nocdyn):
    text = GEARBOX + "&clutch name = 'b' bodies = 'ring', 'ground' kind = 'dog' /\n" + GEAR.format("g", "sun", "ring")
    text += "&gear name = 'h' bodies = 'sun', 'ring' teeth = 1, 2 /\n"
    outcome = nocdyn("modes", nocdyn.write("machine.nml", text + END))
    assert outcome.returncode == 2 and "&gear 'h'" in outcome.stderr


WORM = """&body name = 'motor' inertia = 0.1 /
&body name = 'worm' inertia = 0.05 /
&body name = 'drum' inertia = 5 /
&coupling name = 'k' bodies = 'motor', 'worm' stiffness = 1000 damping = 1 /
&gear name = 'w' bodies = 'worm', 'drum' teeth = 1, 40 efficiency = 0.42 reverse_efficiency = -0.15 /
&motor name = 'm' body = 'motor' a = 100 b = 1 c = 0 /
&load name = 'l' body = 'drum' viscous = 200 /
"""


def test_a_steady_state_has_the_losses_of_teeth(nocdyn):
    state = steady_states(nocdyn, WORM + "&run t_end = 1 /\n")["steady_states"][0]
    values, power = state["values"], state["power_W"]
    # 100 - w = 200 w / 40^2 / 0.42
    assert values["omega_worm [rad/s]"] == pytest.approx(100 / (1 + 200 / 1600 / 0.42), rel=1e-12)
    assert power["loss w"] == pytest.approx(-0.58 * power["motor m"], rel=1e-12)
    assert power["load l"] == pytest.approx(-0.42 * power["motor m"], rel=1e-12)
    assert abs(state["power_residual_W"]) < 1e-11 * state["power_put_in_W"]


def test_a_run_starts_in_the_steady_state_with_its_losses_and_locks(nocdyn):
    text = WORM.replace("bodies = 'worm', 'drum'", "bodies = 'shaft', 'drum'")
    text += "&body name = 'shaft' inertia = 0.2  bearing_friction = 2 /\n"
    text += "&clutch name = 'c' bodies = 'worm', 'shaft' capacity = 500 times = 0, 3 levels = 1, 0 /\n"
    row = last_row(nocdyn, text + "&run t_end = 2 start = 'equilibrium' /\n&output interval = 0.5 /\n")
    header, rows = nocdyn.table("run")
    for other in rows:
        for key, value in zip(header, other, strict=True):
            if key.startswith(("omega", "twist", "torque", "loss")):
                assert value == pytest.approx(row[key], rel=1e-9, abs=1e-9)
    assert row["loss_w [N m]"] < -1
    notes = nocdyn.summary("run")["machine"]["notes"]
    assert "locked in this state: clutch 'c'" in notes


def test_teeth_that_lock_themselves_hold_in_a_steady_state(nocdyn):
    text = WORM.replace("&motor name = 'm' body = 'motor' a = 100", "&motor name = 'm' body = 'drum' a = -900")
    text = text.replace("&load name = 'l' body = 'drum'", "&load name = 'l' body = 'motor'") + "&run t_end = 60 /\n"
    found = steady_states(nocdyn, text)
    assert found["notes"] == ["locked in this state: teeth of 'w'"]
    assert found["steady_states"][0]["is_at_rest"]
    assert abs(last_row(nocdyn, text)["omega_drum [rad/s]"]) < 1e-9


def random_train(seed):
    """A motor, a train with losses, locks and couplings, and loads."""
    generator = random.Random(seed)
    uniform = generator.uniform
    text, sign = f"&motor name = 'm' body = 'b0' a = {uniform(50, 200)} b = {uniform(0.5, 3)} c = 0 /\n", 1
    bodies = generator.randint(3, 7)
    for i in range(1, bodies):
        pair = f"name = 'e{i}' bodies = 'b{i - 1}', 'b{i}'"
        losses = f"efficiency = {uniform(0.6, 0.99)} reverse_efficiency = {uniform(-0.3, 0.95)}"
        kind = generator.choice(("gear", "gear", "mesh", "coupling", "clutch", "freewheel", "planetary"))
        if kind == "gear":
            internal = generator.random() < 0.5
            text += f"&gear {pair} teeth = {generator.randint(15, 40)}, 30 {losses} internal = .{str(internal).lower()}. /\n"
            sign *= 1 if internal else -1
        elif kind == "mesh":
            text += f"&mesh {pair} radii = 0.1, {uniform(0.1, 0.3)} stiffness = 1e6 damping = 300 {losses} /\n"
            sign = -sign
        elif kind == "coupling":
            text += f"&coupling {pair} stiffness = {uniform(1e2, 1e4)} damping = 5 /\n"
        elif kind == "clutch":
            text += f"&clutch {pair} capacity = 1e4 times = 0.1 levels = 1 /\n"
        elif kind == "freewheel":
            text += f"&freewheel {pair} direction = '{'forward' if sign > 0 else 'backward'}' /\n"
        else:
            sides = f"sun = 'b{i - 1}' ring = 'ground' carrier = 'b{i}'"
            text += f"&planetary name = 'e{i}' {sides} teeth = 20, 40 {losses} /\n"
    text += f"&load name = 'l' body = 'b{bodies - 1}' viscous = {uniform(0.5, 5)} quadratic = {uniform(0, 0.01)} /\n"
    text += "".join(f"&body name = 'b{i}' inertia = {uniform(0.1, 2)} /\n" for i in range(bodies))
    return text + "&run t_end = 120 rtol = 1e-9 atol = 1e-10 /\n&output interval = 10 /\n"


# In a slow build the search of train 6, 15 s of a fast one, would take minutes.
@pytest.mark.parametrize("seed", range(4) if IS_SLOW else range(12))
def test_random_trains_run_into_their_steady_states(nocdyn, seed):
    text = random_train(seed)
    found = steady_states(nocdyn, text)["steady_states"]
    row = last_row(nocdyn, text)
    assert any(same_state(state, row, 1e-5) for state in found)
    assert all(abs(state["power_residual_W"]) < 1e-10 * state["power_put_in_W"] for state in found)


def test_a_run_starts_steadily_beside_a_freewheel_that_overruns(nocdyn):
    text = GEARBOX + "&freewheel name = 'back' bodies = 'ring', 'ground' direction = 'backward' /\n"
    text += "&freewheel name = 'idle' bodies = 'sun', 'ground' direction = 'backward' /\n" + GEAR.format("g", "out", "load")
    text += "&run t_end = 1 start = 'equilibrium' /\n&output interval = 0.5 /\n"
    values = steady_states(nocdyn, text)["steady_states"][0]["values"]
    assert values["omega_ring [rad/s]"] == 0 and values["torque_back [N m]"] < 0
    row = last_row(nocdyn, text)
    assert row["omega_sun [rad/s]"] == pytest.approx(values["omega_sun [rad/s]"], rel=1e-9)
    notes = nocdyn.summary("run")["machine"]["notes"]
    assert "open in this state: freewheel 'idle'" in notes


def test_the_column_of_a_lock_is_no_reaction(nocdyn):
    text = GEARBOX + "&clutch name = 'set_ring' bodies = 'ring', 'ground' kind = 'dog' /\n" + GEAR.format("g", "out", "load")
    values = steady_states(nocdyn, text + END)["steady_states"][0]["values"]
    assert values["torque_set_ring [N m]"] == pytest.approx(values["reaction_set_ring [N m]"], rel=1e-12)
