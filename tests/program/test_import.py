"""nocdyn import: inputs from mass-elastic sheets and from machines of openTorsion, and the sheet that nocdyn check writes."""

import json
import math

import numpy as np
import pytest

EQUAL = 1e-12  # relative: frequencies of machines with the same numbers
IEEE = """\
# IEEE Subsynchronous Resonance Working Group, IEEE Trans. PAS 104 (1985) 1057-1066, system 1
station,name,inertia [lbm ft2],stiffness [lbf-ft/rad],remarks
1,EXC,1383,4.39e6,exciter
2,GEN,176204,97.97e6,
3,LP,310729,50.12e6,
4,HP,49912,,
"""
GEARED = """\
sep=;
Nr;Description;Inertia;Connects to;Ratio;Stiffness;damping;station damping;maker
;;kgm²;;;kNm/rad;kNms/rad;N m s/rad;
1;motor;2,5;2;1;40,5;0,1;;ABC
2;pinion;0,1;3;1;gear;;;
3;wheel;1,5;4;-0,4;120;;;
3;;;5;;80;;;
4;fan;10;-;-0,4;;;0,5;
5;pump;3;-;-0,4;;;;
"""
SAME = """\
&case title = 'a machine that the sheet holds' /
&body name = 'motor'  inertia = 2.5 /
&body name = 'pinion' inertia = 0.1 /
&body name = 'wheel'  inertia = 1.5 /
&body name = 'fan #1' inertia = 10 /
&body name = 'pump'   inertia = 3 /
&coupling name = 'rubber' bodies = 'motor', 'pinion' stiffness = 40.1e3 relative_damping = 0.8 damping_frequency_hz = 20 /
&gear     name = 'mesh'   bodies = 'wheel', 'pinion' radii = 0.17, 0.53 /
&shaft    name = 'long'   bodies = 'wheel', 'fan #1' lengths = 0.5, 0.3 diameters = 0.1, 0.08 bores = 0.02 0
          shear_modulus = 8e10 /
&coupling name = 'short'  bodies = 'wheel', 'pump' stiffness = 80e3 damping = 3 /
&coupling name = 'tail'   bodies = 'ground', 'pump' stiffness = 1e3 /
&run t_end = 1 /
"""
TORS = {
    "name": "mill",
    "components": [
        {
            "name": "drive",
            "elements": [
                {"name": "rotor", "type": "Disk", "inertia": 3.5, "damping": 0, "excitation": {"type": "x", "values": [[1, 2]]}},
                {"name": "shaft", "type": "ShaftDiscrete", "stiffness": 4e4, "damping": 0},
                {"name": "in", "type": "GearElement", "inertia": 0.2, "damping": 0, "teeth": 17},
                {"name": "out", "type": "GearElement", "inertia": 1.1, "damping": 0, "teeth": 53, "parent": "in"},
            ],
        },
        {
            "name": "mill",
            "elements": [
                {"name": "hub", "type": "Disk", "inertia": 0.3, "damping": 0},
                {"name": "spindle", "type": "ShaftDiscrete", "stiffness": 9e4, "damping": 0},
                {"name": "drum", "type": "Disk", "inertia": 12.0, "damping": 0},
            ],
        },
    ],
    "structure": [["drive.out", "mill.hub"]],
}


def frequencies(nocdyn, file):
    outcome = nocdyn("modes", file, "--at", "rest", "--out", "modes")
    assert outcome.returncode == 0, outcome.stderr
    _, *rows = (nocdyn.folder / "modes/modes.csv").read_text().splitlines()
    return np.array([float(row.split(",")[2]) for row in rows if row.split(",")[1] == "oscillating"])


def imported(nocdyn, name, text):
    nocdyn.write(name, text)
    outcome = nocdyn("import", name, "--out", "machine.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    return outcome.stdout


def test_a_sheet_in_pounds_and_feet_has_the_frequencies_of_its_publication(nocdyn):
    imported(nocdyn, "ieee.csv", IEEE)
    assert frequencies(nocdyn, "machine.nml") == pytest.approx([24.637, 32.374, 51.109], abs=5e-4)


def test_branches_gears_decimal_commas_and_a_line_of_units_are_read(nocdyn):
    printed = imported(nocdyn, "geared.csv", GEARED)
    assert "note: column 'maker' is not imported" in printed
    inertia = np.diag([2.5, 0.1 + 1.5 * 0.4**2, 10, 3])  # of motor, pinion with wheel, fan, pump
    stiffness = np.zeros((4, 4))
    for k, one in ((40.5e3, [1, -1, 0, 0]), (120e3, [0, -0.4, -1, 0]), (80e3, [0, -0.4, 0, -1])):
        stiffness += k * np.outer(one, one)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).real)[1:]
    text = (nocdyn.folder / "machine.nml").read_text()
    nocdyn.write("undamped.nml", text.replace("damping = '0.1 kNms/rad'", "").replace("viscous = 0.5", "viscous = 0"))
    assert frequencies(nocdyn, "undamped.nml") == pytest.approx(np.sqrt(squares) / 2 / math.pi, rel=1e-9)
    assert "&load     name = 'damping of fan'  body = 'fan'  viscous = 0.5" in text


def test_the_sheet_of_check_gives_the_same_machine(nocdyn):
    nocdyn.write("same.nml", SAME)
    outcome = nocdyn("check", "same.nml", "--out", "out")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    sheet = (nocdyn.folder / "out/mass_elastic.csv").read_text()
    assert "# not in this sheet: gear 'mesh': radii (their ratio is in it)\n" in sheet
    assert sheet.count("# not in this sheet") == 1
    imported(nocdyn, "again.csv", sheet)
    assert frequencies(nocdyn, "machine.nml") == pytest.approx(frequencies(nocdyn, "same.nml"), rel=EQUAL)
    nocdyn("check", "machine.nml", "--out", "out2")
    rows = [text.splitlines()[-7:] for text in (sheet, (nocdyn.folder / "out2/mass_elastic.csv").read_text())]
    assert rows[0][0] == rows[1][0]  # the motor and its coupling, with all digits


def test_what_a_sheet_does_not_hold_is_named_in_it_and_on_the_console(nocdyn):
    text = SAME.replace("stiffness = 80e3", "stiffness = 80e3 gap_deg = 1 cubic_stiffness = 5")
    nocdyn.write("more.nml", text + "&motor name = 'drive' body = 'motor' a = 1 b = 1 c = 0 /\n")
    printed = nocdyn("check", "more.nml", "--out", "out").stdout
    sheet = (nocdyn.folder / "out/mass_elastic.csv").read_text()
    for what in ("coupling 'short': cubic_stiffness, gap", "motor 'drive'"):
        assert f"# not in this sheet: {what}\n" in sheet
        assert f"  note: not in mass_elastic.csv: {what}\n" in printed + "\n"


def test_a_machine_of_opentorsion_has_its_frequencies(nocdyn):
    opentorsion = pytest.importorskip("opentorsion")
    printed = imported(nocdyn, "mill.json", json.dumps(TORS))
    assert "note: drive.rotor: its excitation is not imported; &engine or &excitation describe one" in printed
    assembly = opentorsion.Assembly.from_tors(TORS)
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(assembly.M, assembly.K)).real)[1:]
    assert frequencies(nocdyn, "machine.nml") == pytest.approx(np.sqrt(squares) / 2 / math.pi, rel=1e-9)


def test_a_continuous_shaft_of_opentorsion_is_one(nocdyn):
    machine = json.loads(json.dumps(TORS))
    shaft = {"name": "spindle", "type": "ShaftContinuous", "length": 500, "outerDiameter": 90, "innerDiameter": 10}
    machine["components"][1]["elements"][1] = shaft
    printed = imported(nocdyn, "mill.json", json.dumps(machine))
    assert "mill.spindle: density is not given; 8000 kg/m3, as openTorsion takes it" in printed
    assert "mill.spindle: length and diameters are taken in mm, as openTorsion takes them" in printed
    text = (nocdyn.folder / "machine.nml").read_text()
    assert "lengths = '500 mm'  diameters = '90 mm'  bores = '10 mm'" in text
    nocdyn("check", "machine.nml", "--out", "out")
    (stiffness,) = json.loads((nocdyn.folder / "out/check.json").read_text())["shafts"][0]["stiffness_N_m_rad"]
    opentorsion = pytest.importorskip("opentorsion")
    assert stiffness == pytest.approx(opentorsion.Shaft(0, 1, L=500, odl=90, idl=10).k, rel=1e-12)


def broken(**changes):
    """The machine of openTorsion with another element in place of its first shaft."""
    machine = json.loads(json.dumps(TORS))
    machine["components"][0]["elements"][1] = {"name": "shaft", "type": "ShaftDiscrete", "stiffness": 4e4} | changes
    return json.dumps(machine)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "# nothing\n", "a.csv: no line with headings; needed: station, inertia"),
        (
            "a.csv",
            "station,name\n1,x\n",
            "a.csv:1: no column 'inertia'; needed: station, inertia, and what connects the stations",
        ),
        ("a.csv", "station,inertia,J\n1,2,3\n", "a.csv:1: two columns 'inertia'"),
        ("a.csv", "station,inertia\n", "a.csv:1: no rows; needed: one for each station"),
        (
            "a.csv",
            "station,inertia\n1,2,3\n",
            "a.csv:2: 3 cells; allowed: 2, as headings; decimal commas need semicolons or tabs between the cells",
        ),
        ("a.csv", "station,inertia\n1,\n", "a.csv:2: inertia of station 1 is missing; 0 where a wheel is without any"),
        ("a.csv", "station,inertia\n,3\n", "a.csv:2: station: a row without one; needed: its number or sign"),
        (
            "a.csv",
            "station,inertia\n1,3\n1,4\n",
            "a.csv:3: station 1 has an inertia on line 2 too; further rows of it hold connections only",
        ),
        ("a.csv", "station,inertia,k\n1,3,x\n2,4,\n", "a.csv:2: k = 'x' is not a number; allowed: a number, or 'gear'"),
        (
            "a.csv",
            "station,inertia,k\n1,3,5\n",
            "a.csv:2: a connection behind the last row; needed: its station in 'connects to'",
        ),
        (
            "a.csv",
            "station,inertia,k,to\n1,3,5,7\n2,3,,\n",
            "a.csv:2: connects to = '7' is no other station; allowed: 1, 2, ground, - for none",
        ),
        (
            "a.csv",
            "station,inertia,k,to\n1,3,,2\n2,3,,\n",
            "a.csv:2: a connection without stiffness; needed: stiffness, 'gear', or length and outer diameter of a shaft",
        ),
        (
            "a.csv",
            "station,inertia,k,ratio\n1,3,5,1\n2,3,,2\n",
            "a.csv:2: a stiffness between speed ratios 1 and 2; needed: 'gear', or stations of one ratio",
        ),
        ("a.csv", "station,inertia,k,to\n1,3,gear,ground\n", "a.csv:2: stiffness = 'gear' to the ground; needed: a station"),
        (
            "a.csv",
            "station,inertia,length,od,g,c\n1,3,1,0.1,8e10,5\n2,3,,,,\n",
            "a.csv:2: c of a shaft with a length; allowed: relative damping",
        ),
        (
            "a.csv",
            "station,inertia [lb ft2]\n1,3\n2,4\n",
            "a.csv:2: inertia [lb ft2]: inertia = '3 lb ft2': 'lb' is a mass or a force; allowed: lbm "
            "(0.45359237 kg), lbf (4.4482216152605 N)",
        ),
        (
            "a.csv",
            "station,inertia,stiffness [kNm]\n1,3,4\n2,4,\n",
            "a.csv:2: stiffness [kNm]: stiffness = '4 kNm': 'kNm' is a unit of torque; needed: one of "
            "torsional stiffness, such as N m/rad; "
            "the angle counts: 'kNm/rad' or 'kNm/deg'",
        ),
        ("a.csv", "station,inertia\n1,-3\n", "a.csv:2: inertia: inertia = -3.0 is out of range; allowed: >= 0 [kg m2]"),
        ("a.xls", "", "a.xls: the ending .xls is not known; allowed: .csv (a mass-elastic sheet), .json (openTorsion)"),
        ("a.json", "{", "a.json:1: not JSON: Expecting property name enclosed in double quotes in column 2"),
        ("a.json", "[]", "a.json: no machine of openTorsion; needed: an object with components and structure"),
        (
            "a.json",
            broken(type="Spring"),
            "a.json: drive.shaft: type = 'Spring' is not known; allowed: Disk, ShaftDiscrete, ShaftContinuous, GearElement",
        ),
        (
            "a.json",
            broken(name=3),
            "a.json: drive: element {'name': 3, 'type': 'ShaftDiscrete', 'stiffness': 40000.0}; "
            "needed: objects with name and type",
        ),
        ("a.json", broken(stiffness="4"), "a.json: drive.shaft: stiffness = '4' is not a number"),
        ("a.json", broken(stiffness=-1), "a.json: drive.shaft: stiffness = -1.0 is out of range; allowed: >= 0 [N m/rad]"),
        (
            "a.json",
            json.dumps(TORS | {"structure": []}),
            "a.json: structure: components at which no other one ends: drive, mill; needed: exactly one",
        ),
        (
            "a.json",
            json.dumps(TORS | {"structure": [["drive.x", "mill.hub"]]}),
            "a.json: structure: there is no element 'drive.x'",
        ),
    ],
)
def test_wrong_sources_are_refused(nocdyn, name, text, message):
    nocdyn.write(name, text)
    outcome = nocdyn("import", name, "--out", "machine.nml")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (2, "", f"nocdyn: {message}\n")
    assert not (nocdyn.folder / "machine.nml").exists()


def test_names_that_are_changed_and_stations_that_nothing_connects_are_told(nocdyn):
    printed = imported(nocdyn, "a.csv", "station,name,inertia\n1,disc,1\n2,disc,2\n3,a=b,2\n")
    for note in ("'disc' is named 'disc 2'", "'a=b' is named 'a b'", "no station is connected to another one"):
        assert f"a.csv: note: {note}\n" in printed


def test_files_that_exist_stay_and_missing_ones_are_told(nocdyn):
    imported(nocdyn, "ieee.csv", IEEE)
    outcome = nocdyn("import", "ieee.csv", "--out", "machine.nml")
    message = "nocdyn: machine.nml exists; choose another name with --out, or overwrite it with --force\n"
    assert (outcome.returncode, outcome.stderr) == (2, message)
    assert nocdyn("import", "ieee.csv", "--out", "machine.nml", "--force").returncode == 0
    outcome = nocdyn("import", "nothing.csv")
    assert (outcome.returncode, outcome.stderr) == (3, "nocdyn: nothing.csv: No such file or directory\n")
