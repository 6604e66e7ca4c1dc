"""nocdyn modes --holzer: the tables by hand, what is left at their ends, and what is refused."""

import csv
import re
from math import isclose, pi, sin, sqrt

import pytest
from conftest import SOURCE

J = {"a": 10.0, "b": 20.0, "c": 30.0}
K_1, K_2 = 1.0e4, 2.0e4
DISCS = f"""\
&body name = 'a' inertia = {J["a"]} /
&body name = 'b' inertia = {J["b"]} /
&body name = 'c' inertia = {J["c"]} /
&coupling name = 'one' bodies = 'a', 'b' stiffness = {K_1} /
&coupling name = 'two' bodies = 'b', 'c' stiffness = {K_2} /
&run t_end = 1 /
"""


def squares():
    """omega^2 of three discs, the roots of omega^4 - p omega^2 + q."""
    p = K_1 * (1 / J["a"] + 1 / J["b"]) + K_2 * (1 / J["b"] + 1 / J["c"])
    q = K_1 * K_2 * sum(J.values()) / (J["a"] * J["b"] * J["c"])
    return [p / 2 - sqrt(p**2 / 4 - q), p / 2 + sqrt(p**2 / 4 - q)]


def tables(nocdyn, *words):
    outcome = nocdyn("modes", *words, "--holzer", "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    with open(nocdyn.folder / "out/holzer.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return outcome.stdout, rows


def test_three_discs_have_the_table_that_one_fills_by_hand(nocdyn):
    printed, rows = tables(nocdyn, nocdyn.write("discs.nml", DISCS), "--at", "rest")
    for mode, square in enumerate(squares()):
        lines = rows[3 * mode : 3 * mode + 3]
        assert [line["body"] for line in lines] == ["a", "b", "c"]
        theta, total = 1.0, 0.0
        for line, stiffness in zip(lines, (K_1, K_2, None), strict=True):
            assert isclose(2 * pi * float(line["frequency [Hz]"]), sqrt(square), rel_tol=1e-12)
            assert isclose(float(line["theta [1]"]), theta, rel_tol=1e-10)
            total += J[line["body"]] * square * theta
            if stiffness:
                assert isclose(float(line["sum [N m]"]), total, rel_tol=1e-10)
                assert isclose(float(line["twist [rad]"]), total / stiffness, rel_tol=1e-10)
                theta -= total / stiffness
        assert abs(float(lines[-1]["sum [N m]"])) < 1e-9 * J["a"] * square
    assert printed.count("Holzer table of undamped mode") == 2


def test_nothing_is_left_at_the_end_of_a_geared_branched_train(nocdyn):
    _, rows = tables(nocdyn, SOURCE / "input/examples/ship_turbine/ship_turbine.nml")
    bodies = 10
    assert len(rows) % bodies == 0
    assert len(rows) >= 5 * bodies
    for first in range(0, len(rows), bodies):
        lines = rows[first : first + bodies]
        largest = max(abs(float(line["J omega^2 theta [N m]"])) for line in lines)
        assert lines[-1]["by"] == ""
        assert abs(float(lines[-1]["sum [N m]"])) < 1e-7 * largest
        theta = {line["body"]: float(line["theta [1]"]) for line in lines}
        for line in lines[:-1]:  # amplitudes follow from the sums, or from the ratios of the gears
            here, there = theta[line["body"]], theta[line["to"]]
            if line["ratio [1]"]:
                assert isclose(there, float(line["ratio [1]"]) * here, rel_tol=1e-8, abs_tol=1e-9)
            else:
                assert abs(here - float(line["twist [rad]"]) - there) < 1e-8 * (abs(here) + abs(there) + abs(here - there))


BRAKED = """\
&body name = 'motor' inertia = 0.5 /
&body name = 'pinion' inertia = 0.1 /
&body name = 'wheel' inertia = 0.3 /
&body name = 'drum' inertia = 2.0 /
&coupling name = 'quill' bodies = 'motor', 'pinion' stiffness = 1e4 /
&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 40 /
&coupling name = 'shaft' bodies = 'wheel', 'drum' stiffness = 2e4 /
&clutch name = 'joint' bodies = {bodies} capacity = 100 /
&run t_end = 1 /
"""


def test_a_brake_carries_the_moments_of_the_shafts_that_it_holds(nocdyn):
    for held in ("pinion", "wheel"):  # motor and drum each turn against the brake, through the gear or not
        printed, rows = tables(nocdyn, nocdyn.write("m.nml", BRAKED.format(bodies=f"'{held}', 'ground'")))
        for first in range(0, len(rows), 4):
            last = rows[first + 3]
            assert (last["body"], last["to"], last["by"]) == (held, "ground", "joint")
            assert abs(float(last["theta [1]"])) < 1e-12
            line = {row["body"]: row for row in rows[first : first + 4]}
            for body, stiffness in (("motor", 1e4), ("drum", 2e4)):
                twist = float(line[body]["theta [1]"])
                assert float(line[body]["twist [rad]"]) == pytest.approx(twist, abs=1e-12)
                assert float(line[body]["J omega^2 theta [N m]"]) == pytest.approx(stiffness * twist, abs=1e-8)
                if abs(twist) > 0.5:
                    through = {"motor wheel": -2.0, "drum pinion": -0.5}.get(f"{body} {held}", 1.0)
                    assert float(last["sum [N m]"]) == pytest.approx(through * stiffness * twist)
        assert printed.count("joint to ground") == 2 and "remainder" not in printed


def test_a_locked_clutch_joins_as_a_gear_of_ratio_one(nocdyn):
    text = BRAKED.replace("&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 40 /\n", "")
    _, rows = tables(nocdyn, nocdyn.write("m.nml", text.format(bodies="'pinion', 'wheel'")))
    for first in range(0, len(rows), 4):
        lines = {row["body"]: row for row in rows[first : first + 4]}
        assert (lines["pinion"]["to"], lines["pinion"]["by"], float(lines["pinion"]["ratio [1]"])) == ("wheel", "joint", 1.0)
        assert lines["drum"]["by"] == ""
        assert abs(float(lines["drum"]["sum [N m]"])) < 1e-9 * abs(float(lines["drum"]["J omega^2 theta [N m]"]))


def test_the_inertia_of_a_shaft_is_lumped_and_the_difference_is_told(nocdyn):
    length, diameter, density, modulus = 2.0, 0.1, 7850.0, 8e10
    text = "&body name = 'a' inertia = 1e-9 /\n&body name = 'b' inertia = 1e-9 /\n"
    text += f"&shaft name = 's' bodies = 'a', 'b' lengths = {length} diameters = {diameter} shear_modulus = {modulus}"
    text += f" density = {density} nodes = 7 /\n&run t_end = 1 /\n"
    printed, rows = tables(nocdyn, nocdyn.write("m.nml", text), "--at", "rest")
    assert "the inertia of 's' is lumped in these tables" in printed
    with open(nocdyn.folder / "out/modes.csv", newline="") as file:
        modes = [
            float(row["undamped_frequency [Hz]"])
            for row in csv.DictReader(file)
            if float(row["undamped_frequency [Hz]"] or 0) > 0
        ]
    stations, wave = 8, sqrt(modulus / density)
    assert len(rows) == stations * (stations + 1)
    for mode in range(1, stations + 1):
        lines = rows[(stations + 1) * (mode - 1) : (stations + 1) * mode]
        assert [line["body"] for line in lines] == ["a", *(f"s[{k}]" for k in range(1, stations)), "b"]
        lumped = float(lines[0]["frequency [Hz]"])  # free ends, half of an inertia at each of them
        assert lumped == pytest.approx(stations * wave / (pi * length) * abs(sin(mode * pi / (2 * stations))), rel=1e-6)
        whole = float(lines[0]["frequency in modes.csv [Hz]"])
        assert whole == pytest.approx(modes[mode - 1], rel=1e-9)
        if mode == 1:
            assert whole == pytest.approx(wave / (2 * length), rel=1e-6)
            told = float(re.search(r"Hz where the shafts are not lumped, (\S+) % off", printed)[1])
            assert told == pytest.approx(100 * (lumped / whole - 1), rel=0.05)
        inertias = sum(float(line["inertia [kg m2]"]) for line in lines)
        assert inertias == pytest.approx(density * length * pi * diameter**4 / 32, rel=1e-6)
        largest = max(abs(float(line["J omega^2 theta [N m]"])) for line in lines)
        assert abs(float(lines[-1]["sum [N m]"])) < 1e-7 * largest


def test_segments_of_a_shaft_are_cut_into_parts_of_their_own(nocdyn):
    text = (
        "&body name = 'a' inertia = 1 /\n&body name = 'b' inertia = 2 /\n&shaft name = 's' bodies = 'a', 'b' lengths = 1.0, 0.5 "
    )
    text += (
        "diameters = 0.1, 0.08 bores = 0.02, 0.03 shear_modulus = 8e10, 7e10 density = 7850, 7000 nodes = 5 /\n&run t_end = 1 /\n"
    )
    _, rows = tables(nocdyn, nocdyn.write("m.nml", text), "--at", "rest")
    stiffness = [float(line["stiffness [N m/rad]"]) for line in rows[:6]]
    moments = [pi / 32 * (0.1**4 - 0.02**4), pi / 32 * (0.08**4 - 0.03**4)]
    expected = [8e10 * moments[0] / 0.25] * 4 + [7e10 * moments[1] / 0.25] * 2
    assert stiffness == pytest.approx(expected) or stiffness == pytest.approx(expected[::-1])
    assert float(rows[0]["frequency in modes.csv [Hz]"]) == pytest.approx(float(rows[0]["frequency [Hz]"]), rel=1e-3)


@pytest.mark.parametrize(
    ("addition", "message"),
    [
        ("&coupling name = 'loop' bodies = 'a', 'c' stiffness = 5 /", "there is no table of Holzer: 'loop' closes a loop"),
        ("&body name = 'd' inertia = 1 / &constraint name = 'sum' bodies = 'a', 'b', 'd' coefficients = 1, 1, -2 /",
         "there is no table of Holzer: 'sum' does not join two bodies"),
    ],
)  # fmt: skip
def test_machines_that_are_no_tree_have_no_table(nocdyn, addition, message):
    outcome = nocdyn("modes", nocdyn.write("machine.nml", DISCS + addition + "\n"), "--at", "rest", "--holzer")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    assert outcome.stderr.startswith(f"nocdyn: machine.nml: {message}") or message in outcome.stderr
