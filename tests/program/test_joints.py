"""Rigid joints of every kind: what check says of them, their columns, their refusals, and start speeds that do not fit."""

import pytest
from conftest import DATA
from test_machines_refused import refusal

JOINTS = DATA / "every_joint.nml"
THREE = "".join(f"&body name = '{name}' inertia = 1.0 /\n" for name in "abc") + "&run t_end = 1.0 /\n"
FOUR = "".join(f"&body name = 'body{i}' inertia = 1.0 /\n" for i in range(1, 5)) + "&run t_end = 1.0 /\n"


def test_check_tells_what_the_joints_allow(nocdyn):
    outcome = nocdyn("check", JOINTS)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    report, speeds = outcome.stdout.split("  speeds at the start, and those given", 1)
    first, *lines = report.splitlines()
    assert "7 bodies, 2 gears, 2 planetary sets, 1 differential, 1 constraint, 2 couplings" in first
    assert lines == [
        "  3 degrees of freedom",
        "  geared together: 'sun', 'ring', 'carrier', 'output', 'left', 'right', 'pump' with 3 degrees of freedom",
        "  2 constraints repeat others; ratios count as equal within 1e-9 of their size",
        "  coordinates: 'sun', 'right', 'pump'",
        "  speed of 'ring' = -0.2857143 * speed of 'sun' + 0.3214286 * speed of 'pump'",
        "  speed of 'carrier' = 0.25 * speed of 'pump'",
        "  speed of 'output' = -0.1666667 * speed of 'pump'",
        "  speed of 'left' = -1 * speed of 'right' - 0.3333333 * speed of 'pump'",
        "  note: gear 'twin' repeats what 'pair' already fixes; its tooth force is not unique, the smallest-norm share is"
        " reported",
        "  note: constraint 'sum' repeats what 'mixer' already fixes; its multiplier is not unique, the smallest-norm share is"
        " reported",
        lines[-1],
    ]
    assert lines[-1].startswith("  note: the start speeds were projected onto the constraints: impulse ")
    assert [line.split()[0] for line in speeds.splitlines()[1:]] == ["sun", "ring", "carrier", "output", "left", "right", "pump"]


def test_members_of_planetary_sets_and_differentials_have_columns_of_their_own(nocdyn):
    assert nocdyn("run", JOINTS, "--out", "out").returncode == 0
    header, rows = nocdyn.table("out")
    assert [label for label in header if label.startswith("reaction_")] == [
        "reaction_mixer [N m]",
        "reaction_mixer_ring [N m]",
        "reaction_mixer_carrier [N m]",
        "reaction_pair [N m]",
        "reaction_twin [N]",
        "reaction_reducer [N m]",
        "reaction_reducer_ring [N m]",
        "reaction_reducer_carrier [N m]",
        "reaction_axle [N m]",
        "reaction_axle_case [N m]",
        "reaction_sum [N m]",
    ]
    last = dict(zip(header, rows[-1]))
    for name, ring in (("mixer", 3.5), ("reducer", 3)):
        torque = last[f"reaction_{name} [N m]"]
        assert abs(torque) > 1e-3
        assert last[f"reaction_{name}_ring [N m]"] == pytest.approx(ring * torque, rel=1e-14)
        assert last[f"reaction_{name}_carrier [N m]"] == pytest.approx(-(1 + ring) * torque, rel=1e-14)
    assert last["reaction_axle_case [N m]"] == -2 * last["reaction_axle [N m]"]
    # 'sum' is 'mixer' times 2, and 'twin' is 'pair' times 0.2
    assert last["reaction_sum [N m]"] == pytest.approx(2 * last["reaction_mixer [N m]"], rel=1e-12)
    assert last["reaction_twin [N]"] == pytest.approx(0.2 * last["reaction_pair [N m]"], rel=1e-12)


@pytest.mark.parametrize("formulation", ["paper", "multiplier"])
def test_formulations_agree_on_joints_of_every_kind(nocdyn, formulation):
    for name in ("reduced", formulation):
        options = (f"run.formulation={name}", "run.rtol=1e-10", "run.atol=1e-11", "run.method=rk853")
        assert nocdyn("run", JOINTS, "--out", name, *(w for o in options for w in ("--set", o))).returncode == 0
    header, rows = nocdyn.table("reduced")
    for row, other in zip(rows, nocdyn.table(formulation)[1]):
        assert row == pytest.approx(other, rel=1e-7, abs=1e-7), header


@pytest.mark.parametrize(
    ("group", "message"),
    [
        (
            "&planetary name = 'p' sun = 'a' ring = 'a' carrier = 'b' teeth = 20, 70 /",
            "&planetary 'p': ring is 'a', as is sun; allowed: different members",
        ),
        (
            "&planetary name = 'p' sun = 'ground' ring = 'ground' carrier = 'b' teeth = 20, 70 /",
            "&planetary 'p': ring is 'ground', as is sun; allowed: different members",
        ),
        (
            "&planetary name = 'p' sun = 'a' ring = 'b' carrier = 'c' teeth = 70, 20 /",
            "&planetary 'p': teeth(2) = 20 must be greater than teeth(1) = 70",
        ),
        ("&planetary name = 'p' sun = 'a' ring = 'b' carrier = 'c' /", "&planetary 'p': teeth is missing; needed: "),
        (
            "&differential name = 'd' sides = 'a', 'b' case = 'b' /",
            "&differential 'd': case is 'b', as is sides; allowed: different members",
        ),
        ("&differential name = 'd' sides = 'a', 'a' case = 'b' /", "&differential 'd': sides has 'a' twice"),
        (
            "&constraint name = 'k' bodies = 'a', 'b' coefficients = 1, 2, 3 /",
            "&constraint 'k': coefficients has 3 values and bodies has 2 values; needed: as many of each",
        ),
        ("&constraint name = 'k' bodies = 'a', 'b' coefficients = 1, 0 /", "&constraint 'k': coefficients(2) = 0 "),
        ("&constraint name = 'k' bodies = 'a', 'ground' coefficients = 1, 1 /", "&constraint 'k': bodies(2) = 'ground'"),
        ("&constraint name = 'k' coefficients = 1, 1 /", "&constraint 'k': bodies is missing; needed: "),
        ("&gear name = 'g' bodies = 'a', 'ground' teeth = 1, 2 /", "&gear 'g': locks 'a', as no other body in it turns"),
        (
            "&constraint name = 'k' bodies = 'b' coefficients = 3 /",
            "&constraint 'k': locks 'b', as no other body in it turns",
        ),
    ],
)
@pytest.mark.parametrize("command", ["run", "check"])
def test_joints_that_cannot_be_are_refused(nocdyn, command, group, message):
    assert refusal(nocdyn, command, group + "\n" + THREE).startswith("nocdyn: pair.nml:1: " + message)


def test_joints_of_all_kinds_share_one_name_space(nocdyn):
    gear = "&gear name = 'x' bodies = 'a', 'b' teeth = 1, 2 /\n"
    message = refusal(nocdyn, "check", gear + "&constraint name = 'x' bodies = 'b', 'c' coefficients = 1, 2 /\n" + THREE)
    assert message == "nocdyn: pair.nml:2: &constraint 'x': the name 'x' is taken by &gear on line 1\n"


def test_two_columns_of_one_name_are_refused(nocdyn):
    planetary = "&planetary name = 'p' sun = 'a' ring = 'b' carrier = 'c' teeth = 20, 70 /\n"
    message = refusal(nocdyn, "check", planetary + "&gear name = 'p_ring' bodies = 'a', 'b' teeth = 1, 2 /\n" + THREE)
    assert message == (
        "nocdyn: pair.nml:2: &gear 'p_ring': its column 'reaction_p_ring [N m]' would have the label of one of "
        "&planetary 'p'; allowed: another name\n"
    )


@pytest.mark.parametrize("command", ["run", "check"])
def test_a_loop_that_locks_is_refused_with_both_ways_and_ratios(nocdyn, command):
    pairs = ((1, 2, 1, -1.0), (2, 4, 1, -0.5), (1, 3, 1, -1.0), (3, 4, 2.2, -1))
    gears = [
        f"&gear name = 'g{i}' bodies = 'body{a}', 'body{b}' radii = {r}, {-s} /\n"
        for i, (a, b, r, s) in enumerate(pairs, start=1)
    ]
    message = refusal(nocdyn, command, "".join(gears) + FOUR)
    assert message == (
        "nocdyn: pair.nml:4: &gear 'g4': locks 'body1', 'body2', 'body3', 'body4': "
        "'g1', 'g2' and 'g3', 'g4' drive 'body4' at 2 and 2.2 times 'body1'\n"
    )


def test_joints_of_three_bodies_that_lock_are_refused_with_the_rows_involved(nocdyn):
    joints = [
        "&planetary name = 'p' sun = 'a' ring = 'b' carrier = 'c' teeth = 20, 70 /\n",
        "&gear name = 'g' bodies = 'a', 'b' teeth = 20, 30 /\n",
        "&gear name = 'h' bodies = 'a', 'c' teeth = 20, 30 /\n",
    ]
    message = refusal(nocdyn, "check", "".join(joints) + THREE)
    assert message == (
        "nocdyn: pair.nml:1: &planetary 'p': locks 'a', 'b', 'c': together with 'g', 'h' it leaves no speed but 0\n"
    )


FIRST = "&gear name = 'g' bodies = 'a', 'b' radii = 0.1, 0.3 /\n"


@pytest.mark.parametrize("second", ["radii = 0.3, 0.9", "radii = 0.7, 2.1", "teeth = 19, 57", "radii = 0.1, 0.30000000000000004"])
def test_ratios_that_decimals_round_differently_agree(nocdyn, second):
    gears = f"{FIRST}&gear name = 'h' bodies = 'a', 'b' {second} /\n"
    outcome = nocdyn("check", nocdyn.write("decimals.nml", gears + THREE))
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "  1 constraint repeats others; ratios count as equal within 1e-9 of their size\n" in outcome.stdout
    assert "  note: gear 'h' repeats what 'g' already fixes; " in outcome.stdout


def test_ratios_that_differ_by_more_than_the_tolerance_lock(nocdyn):
    gears = FIRST + "&gear name = 'h' bodies = 'a', 'b' radii = 0.1, 0.3000000009 /\n"
    assert "locks 'a', 'b': 'g' and 'h' drive 'b' at " in refusal(nocdyn, "check", gears + THREE)


PAIR = """\
&body name = 'a' inertia = 1.0 speed = {a} /
&body name = 'b' inertia = 3.0 speed = {b} /
&gear name = 'g' bodies = 'a', 'b' radii = 0.5, 0.5 /
&run t_end = 1.0 {start} /
"""


@pytest.mark.parametrize("command", ["run", "check"])
def test_start_speeds_that_violate_a_joint_are_refused_with_the_nearest_that_do_not(nocdyn, command):
    message = refusal(nocdyn, command, PAIR.format(a=1.0, b=1.0, start=""))
    assert message == (
        "nocdyn: pair.nml:3: &gear 'g': the start speeds violate it: 0.5 * 1 rad/s ('a') + 0.5 * 1 rad/s ('b') = 1, "
        "which must be 0; nearest speeds that fit: -0.5 rad/s ('a'), 0.5 rad/s ('b'); &run start = 'projected' takes them\n"
    )
    nocdyn.write("fits.nml", PAIR.format(a=-0.5, b=0.5, start=""))
    assert nocdyn(command, "fits.nml").returncode == 0


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_projected_start_speeds_come_with_impulse_and_energy_lost(nocdyn, formulation):
    # momentum 1 - 3 along the gear, inertia 4: speeds -+0.5; the force times 0.5 m turns 'a' back by 1.5 kg m2/s
    note = "the start speeds were projected onto the constraints: impulse -3 N s in gear 'g'; kinetic energy lost: 1.5 J"
    nocdyn.write("pair.nml", PAIR.format(a=1.0, b=1.0, start="start = 'projected'"))
    assert f"  note: {note}\n" in nocdyn("check", "pair.nml").stdout
    outcome = nocdyn("run", "pair.nml", "--out", "out", "--set", f"run.formulation={formulation}")
    assert f"note: {note}\n" in outcome.stdout
    assert nocdyn.summary("out")["machine"]["notes"] == [note]
    header, rows = nocdyn.table("out")
    start = dict(zip(header, rows[0]))
    assert start["omega_a [rad/s]"] == pytest.approx(-0.5, rel=1e-14)
    assert start["omega_b [rad/s]"] == pytest.approx(0.5, rel=1e-14)
    assert start["kinetic_energy [J]"] == pytest.approx(0.5, rel=1e-14)


def test_the_impulse_of_a_projected_start_passes_through_joints_that_fit(nocdyn):
    # 'h' holds at the start; seen from 'b' momentum -1 + 3 + 2, inertia 1 + 3 + 2: speed 2/3
    further = "&body name = 'c' inertia = 8.0 speed = -0.5 /\n&gear name = 'h' bodies = 'b', 'c' teeth = 20, 40 /\n"
    text = PAIR.format(a=1.0, b=1.0, start="start = 'projected'") + further
    note = (
        "the start speeds were projected onto the constraints: impulse -3.333333 N s in gear 'g', 0.6666667 N m s in gear 'h'; "
        "kinetic energy lost: 1.666667 J"
    )
    assert f"  note: {note}\n" in nocdyn("check", nocdyn.write("three.nml", text)).stdout


def test_start_speeds_that_fit_are_not_projected(nocdyn):
    nocdyn.write("pair.nml", PAIR.format(a=1.0, b=-1.0, start="start = 'projected'"))
    assert "note" not in nocdyn("check", "pair.nml").stdout
