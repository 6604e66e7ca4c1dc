"""Start speeds that are not given follow from the others through the gears; digits that are only rounded are accepted."""

import re
from math import pi

import pytest

RPM = pi / 30
ROUNDED = "note: start speeds contradict the gears by no more than their rounding, and are replaced: "
EXACT = 1e-12

GEAR = "&gear name = 'g' bodies = 'a', 'b' teeth = 20, 60 internal = .true. /\n"  # b turns with a third of the speed of a
AXLE = "&differential name = 'axle' sides = 'left', 'right' case = 'case' /\n"


def bodies(**speeds):
    return "".join(
        f"&body name = '{name}' inertia = {i + 1}.0" + (f" speed = {speed!r}" if speed is not None else "") + " /\n"
        for i, (name, speed) in enumerate(speeds.items())
    )


def start(nocdyn, text, *options):
    """Speeds at the start, and the notes of the run."""
    outcome = nocdyn("run", nocdyn.write("m.nml", text + "&run t_end = 1e-3 /\n"), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    header, rows = nocdyn.table("out")
    speeds = {label[6:-8]: value for label, value in zip(header, rows[0]) if label.startswith("omega_")}
    return speeds, [line.split(": ", 1)[1] for line in outcome.stdout.splitlines() if ": note: " in line]


def refusal(nocdyn, text):
    outcome = nocdyn("check", nocdyn.write("m.nml", text + "&run t_end = 1e-3 /\n"))
    assert (outcome.returncode, outcome.stdout) == (2, "")
    return outcome.stderr


@pytest.mark.parametrize(("given", "speed"), [("a", 90.0), ("b", 30.0), ("c", -60.0)])
def test_one_speed_serves_a_train(nocdyn, given, speed):
    train = bodies(**{name: speed if name == given else None for name in "abc"}) + GEAR
    speeds, notes = start(nocdyn, train + "&gear name = 'h' bodies = 'b', 'c' teeth = 40, 20 /\n")
    assert speeds == {"a": pytest.approx(90, rel=EXACT), "b": pytest.approx(30, rel=EXACT), "c": pytest.approx(-60, rel=EXACT)}
    assert notes == []


def test_a_train_without_given_speeds_and_the_bodies_beside_it_start_at_rest(nocdyn):
    speeds, _ = start(nocdyn, bodies(a=None, b=None, c=None, d=7.0) + GEAR)
    assert speeds == {"a": 0, "b": 0, "c": 0, "d": 7}


@pytest.mark.parametrize(
    ("a", "b", "true", "replaced"),
    [
        (100.0, 33.33, 100.0, "33.33 rad/s of 'b' by 33.33333333"),
        (100 * RPM, 33.33 * RPM, 100 * RPM, "33.33 rpm of 'b' by 33.33333333"),
        (1480 * RPM, 493 * RPM, 1480 * RPM, "493 rpm of 'b' by 493.3333333"),
        (104.7, 34.907, 104.721, "104.7 rad/s of 'a' by 104.721"),
    ],
)
def test_digits_that_are_only_rounded_are_accepted_with_a_note(nocdyn, a, b, true, replaced):
    speeds, notes = start(nocdyn, bodies(a=a, b=b) + GEAR)
    assert speeds == {"a": pytest.approx(true, rel=EXACT), "b": pytest.approx(true / 3, rel=EXACT)}
    assert notes == [ROUNDED + replaced]


def test_speeds_in_rpm_are_given_too(nocdyn):
    speeds, notes = start(nocdyn, (bodies(a=100.0, b=33.33) + GEAR).replace("speed =", "speed_rpm ="))
    assert speeds == {"a": pytest.approx(100 * RPM, rel=EXACT), "b": pytest.approx(100 * RPM / 3, rel=EXACT)}
    assert notes == [ROUNDED + "33.33 rpm of 'b' by 33.33333333"]


@pytest.mark.parametrize(("a", "b"), [(100.0, 33.5), (100.0, 33.0), (100.0, 33.32), (100.0, 0.0), (104.7, 34.95)])
def test_digits_that_contradict_the_gears_are_refused(nocdyn, a, b):
    message = refusal(nocdyn, bodies(a=a, b=b) + GEAR)
    assert ":3: &gear 'g': the start speeds violate it: 1 * 10" in message
    assert "which must be 0; nearest speeds that fit: " in message and message.endswith("&run start = 'projected' takes them\n")


def test_speeds_in_rpm_that_contradict_the_gears_are_refused_in_rpm(nocdyn):
    text = (bodies(a=100.0, b=40.0) + GEAR).replace("speed =", "speed_rpm =")
    message = refusal(nocdyn, text)
    assert ": 1 * 100 rpm ('a') + -3 * 40 rpm ('b') = -20, which must be 0; nearest speeds that fit: " in message
    nearest = [float(number) for number in re.findall(r"([0-9.]+) rpm \('.'\)(?:,|; &run)", message)]
    assert refusal(nocdyn, text.replace("_rpm = 40", " = 40")).count(" rad/s (") == 4
    assert start(nocdyn, (bodies(a=nearest[0], b=nearest[1]) + GEAR).replace("speed =", "speed_rpm ="))[1] == []


def test_two_speeds_of_a_differential_give_the_third(nocdyn):
    speeds, notes = start(nocdyn, bodies(case=100.0, left=120.0, right=None) + AXLE)
    assert speeds["right"] == pytest.approx(80, rel=EXACT)
    assert notes == []


def test_speeds_that_the_given_ones_leave_open_are_named(nocdyn):
    speeds, notes = start(nocdyn, bodies(case=100.0, left=None, right=None) + AXLE)
    assert speeds == {name: pytest.approx(100, rel=EXACT) for name in ("case", "left", "right")}
    assert notes == [
        "note: the given start speeds do not determine those of 'left', 'right': the smallest ones that fit are taken"
    ]


def test_speeds_that_may_stay_zero_do(nocdyn):
    speeds, notes = start(
        nocdyn, bodies(case=None, left=100.0, right=-100.0, d=None, e=None) + AXLE + GEAR.replace("a'", "d'").replace("b'", "e'")
    )
    assert speeds == {
        "case": pytest.approx(0, abs=1e-12),
        "left": pytest.approx(100),
        "right": pytest.approx(-100),
        "d": 0,
        "e": 0,
    }
    assert notes == []


def test_an_override_gives_a_speed(nocdyn):
    speeds, _ = start(nocdyn, bodies(a=None, b=None) + GEAR, "--set", "body.b.speed=5")
    assert speeds["a"] == pytest.approx(15, rel=EXACT)


def test_bodies_without_speed_stand_still_before_an_impact(nocdyn):
    # momentum 8 of inertia 1 + 2/9 seen from 'a'
    speeds, _ = start(nocdyn, bodies(a=8.0, b=None) + GEAR, "--set", "run.start=projected")
    assert speeds["a"] == pytest.approx(8 / (1 + 2 / 9), rel=EXACT)


@pytest.mark.parametrize("method", ["given", "equilibrium"])
def test_the_input_that_a_run_leaves_starts_like_the_run(nocdyn, method):
    load = "&load name = 'l' body = 'b' viscous = 1.0 /\n&motor name = 'm' body = 'a' a = 9.0 b = 1.0 c = 0.0 /\n"
    speeds, _ = start(nocdyn, bodies(a=90.0, b=None) + GEAR + load, "--set", f"run.start={method}")
    assert nocdyn("run", "out/input.nml", "--out", "again").returncode == 0
    header, rows = nocdyn.table("again")
    again = {label[6:-8]: value for label, value in zip(header, rows[0]) if label.startswith("omega_")}
    assert again == speeds


@pytest.mark.parametrize("speed", ["1e-308", "1e-49", "1e49"])
def test_speeds_of_any_size_have_digits(nocdyn, speed):
    speeds, _ = start(nocdyn, (bodies(a=1.0, b=None) + GEAR).replace("speed = 1.0", f"speed = {speed}"))
    assert speeds["b"] == pytest.approx(float(speed) / 3, rel=EXACT, abs=0)


TAKEN = "note: speeds at the start that are not given follow through couplings: "
SHAFT = "&shaft name = 's' bodies = 'a', 'b' lengths = 1.0 diameters = 0.05 shear_modulus = 8e10 density = 7850 /\n"


def coupling(name, first, second, keys="stiffness = 10.0"):
    return f"&coupling name = '{name}' bodies = '{first}', '{second}' {keys} /\n"


@pytest.mark.parametrize(
    "joined",
    [
        coupling("k", "a", "b"),
        coupling("k", "b", "a", "stiffness = 0 cubic_stiffness = 5.0"),
        coupling("k", "a", "b", "stiffness = 10.0 gap = 0.1"),
        coupling("k", "a", "b", "table_twist = -1, 1 table_moment = -3, 3 rest_twist = 0.1"),
        SHAFT,
        SHAFT.replace("density = 7850 ", ""),
    ],
)
def test_a_speed_is_that_of_the_neighbour_through_an_elastic_element(nocdyn, joined):
    speeds, notes = start(nocdyn, bodies(a=12.0, b=None) + joined)
    assert speeds == {"a": 12, "b": pytest.approx(12, rel=EXACT)}
    assert notes == [TAKEN + "'b' starts at 12 rad/s as 'a' does"]


def test_nothing_jolts_a_train_that_turns_as_one_of_its_bodies(nocdyn):
    train = bodies(a=12.0, b=None, c=None, d=None) + SHAFT + GEAR.replace("'a', 'b'", "'b', 'c'") + coupling("k", "c", "d")
    outcome = nocdyn("run", nocdyn.write("m.nml", train + "&run t_end = 0.1 /\n"), "--out", "out")
    assert outcome.returncode == 0
    header, rows = nocdyn.table("out")
    twists = [row[k] for row in rows for k, label in enumerate(header) if label.startswith("total_moment_")]
    assert len(twists) > 0
    assert max(map(abs, twists)) < 1e-6


@pytest.mark.parametrize(
    "joined",
    [
        coupling("k", "a", "b", "damping = 1.0"),
        coupling("k", "a", "b", "friction = 1.0"),
        "&clutch name = 'k' bodies = 'a', 'b' capacity = 1.0 /\n",
        "&freewheel name = 'k' bodies = 'b', 'a' /\n",
    ],
)
def test_speeds_do_not_follow_through_dampers_and_clutches(nocdyn, joined):
    speeds, notes = start(nocdyn, bodies(a=12.0, b=None) + joined)
    assert speeds == {"a": 12, "b": 0}
    assert not any("follow" in note for note in notes)


def test_a_given_speed_stays_also_if_it_is_zero(nocdyn):
    speeds, notes = start(nocdyn, bodies(a=12.0, b=0.0) + coupling("k", "a", "b"))
    assert speeds == {"a": 12, "b": 0}
    assert notes == []


@pytest.mark.parametrize(("given", "speed"), [("a", 90.0), ("c", 30.0), ("d", 30.0)])
def test_speeds_follow_through_couplings_and_gears_in_turn(nocdyn, given, speed):
    joined = coupling("k", "a", "b") + GEAR.replace("'a', 'b'", "'b', 'c'") + coupling("l", "c", "d")
    speeds, notes = start(nocdyn, bodies(**{name: speed if name == given else None for name in "abcd"}) + joined)
    assert speeds == {name: pytest.approx(90 if name in "ab" else 30, rel=EXACT) for name in "abcd"}
    told = {
        "a": "'b' starts at 90 rad/s as 'a' does, 'c', 'd' at 30 rad/s",
        "c": "'a', 'b' start at 90 rad/s, 'd' at 30 rad/s as 'c' does",
        "d": "'a', 'b' start at 90 rad/s, 'c' at 30 rad/s as 'd' does",
    }
    assert TAKEN + told[given] in notes


def test_speeds_follow_through_the_teeth_of_a_mesh(nocdyn):
    mesh = "&mesh name = 'z' bodies = 'a', 'b' radii = 0.1, 0.3 stiffness = 1e6 /\n"
    assert start(nocdyn, bodies(a=90.0, b=None) + mesh)[0]["b"] == pytest.approx(-30, rel=EXACT)


def test_a_speed_that_is_rounded_fits_and_the_gears_hold_exactly(nocdyn):
    joined = coupling("k", "a", "b") + GEAR.replace("'a', 'b'", "'b', 'c'") + coupling("l", "c", "d")
    speeds, _ = start(nocdyn, bodies(a=100.0, b=None, c=None, d=33.33) + joined)
    assert speeds["b"] == pytest.approx(100)
    assert speeds["c"] == pytest.approx(speeds["b"] / 3, rel=EXACT)


def test_a_speed_that_gears_replace_is_taken_as_replaced(nocdyn):
    speeds, _ = start(nocdyn, bodies(a=100.0, b=33.33, c=None) + GEAR + coupling("k", "b", "c"))
    assert speeds["c"] == pytest.approx(100 / 3, rel=EXACT)


@pytest.mark.parametrize(
    ("joined", "told"),
    [
        (coupling("k", "a", "b") + coupling("l", "b", "c"), "'a' starts at 10 rad/s, 'c' starts at 20 rad/s"),
        (coupling("k", "a", "b") + coupling("l", "b", "ground"), "'a' starts at 10 rad/s, 'ground' stands still"),
    ],
)
def test_no_speed_is_taken_between_neighbours_that_differ(nocdyn, joined, told):
    speeds, notes = start(nocdyn, bodies(a=10.0, b=None, c=20.0) + joined)
    assert speeds["b"] == 0
    assert f"note: start speeds of 'b' do not follow through couplings, for the bodies beside them differ: {told}" in notes


def test_two_speeds_of_a_differential_may_come_through_couplings(nocdyn):
    joined = AXLE + coupling("k", "left", "wheel") + coupling("l", "right", "other")
    speeds, _ = start(nocdyn, bodies(case=100.0, left=None, right=None, wheel=120.0, other=None) + joined)
    assert [speeds[name] for name in ("left", "right", "other")] == pytest.approx([120, 80, 80], rel=EXACT)


def test_what_is_left_open_is_the_same_on_both_sides_of_a_coupling(nocdyn):
    joined = AXLE + coupling("k", "left", "wheel") + coupling("l", "right", "other")
    speeds, _ = start(nocdyn, bodies(case=100.0, left=None, right=None, wheel=None, other=None) + joined)
    assert speeds == {name: pytest.approx(100, rel=EXACT) for name in speeds}


def test_speeds_follow_through_couplings_between_cardans(nocdyn):
    joined = "&cardan name = 'c' bodies = 'a', 'b' angle = 0.3 /\n&cardan name = 'd' bodies = 'c', 'd' angle = 0.3 /\n"
    speeds, _ = start(
        nocdyn, bodies(a=10.0, b=None, c=None, d=None, e=None) + joined + coupling("k", "b", "c") + coupling("l", "d", "e")
    )
    assert abs(speeds["b"]) > 1
    assert speeds["b"] != pytest.approx(10, rel=1e-3)
    assert speeds["c"] == pytest.approx(speeds["b"], rel=EXACT)
    assert abs(speeds["d"]) > 1
    assert speeds["e"] == pytest.approx(speeds["d"], rel=EXACT)


def test_speeds_follow_a_drive_through_couplings(nocdyn):
    joined = "&drive name = 'd' body = 'a' speed = 25.0 /\n" + coupling("k", "a", "b")
    assert start(nocdyn, bodies(a=None, b=None) + joined)[0] == {"a": 25, "b": pytest.approx(25, rel=EXACT)}


def test_bodies_beside_an_impact_do_not_follow_through_couplings(nocdyn):
    speeds, _ = start(nocdyn, bodies(a=8.0, b=None) + coupling("k", "a", "b"), "--set", "run.start=projected")
    assert speeds == {"a": 8, "b": 0}
