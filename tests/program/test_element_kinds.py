"""Elements of every kind from the input file to the results."""

from math import pi

import pytest
from conftest import DATA

EVERY_KIND = DATA / "every_kind.nml"
ELECTRICAL_KINDS = DATA / "electrical_kinds.nml"

KLOSS = f"""&body name = 'rotor' inertia = 2.0 /
&motor name = 'mains' body = 'rotor' kind = 'induction'
       breakdown_torque = 100.0 breakdown_slip = 0.2 synchronous_speed = {50 * pi!r} /
&run t_end = 4.858310390217 method = 'rk853' rtol = 1e-12 atol = 1e-12 /
&output points = 2 /
"""

BACKLASH = f"""&body name = 'rotor' inertia = 5.0 angle = {pi / 2!r} /
&coupling name = 'teeth' bodies = 'ground', 'rotor' stiffness = 2.0e4 damping = 50.0 gap = {pi / 4!r} /
&run t_end = 0.5 method = 'rk853' rtol = 1e-11 atol = 1e-12 /
&output interval = 0.05 /
"""

DRIVE = """&body name = 'rotor' inertia = 2.0 /
&motor name = 'drive' body = 'rotor' kind = 'dc' voltage = 100.0 resistance = 1.0 flux_constant = 2.0 {inductance}
       governor_speed = 20.0 governor_gain = 0.1 governor_time = 0.5 /
&load name = 'work' body = 'rotor' viscous = 1.0 /
&run t_end = 20.0 rtol = 1e-10 atol = 1e-10 /
&output points = 201 /
"""


def largest_residual(table):
    return max(map(abs, table["energy_residual [J]"]))


def run(nocdyn, text, *settings):
    nocdyn.done(text, *[word for s in settings for word in ("--set", s)])
    return nocdyn.values()


def test_an_induction_motor_runs_up_in_its_time(nocdyn):
    table = run(nocdyn, KLOSS)
    assert table["omega_rotor [rad/s]"][-1] == pytest.approx(0.95 * 50 * pi, rel=1e-9)


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_backlash_moves_as_in_the_modelica_standard_library(nocdyn, formulation):
    table = run(nocdyn, BACKLASH, f"run.formulation={formulation}")
    angle = table["phi_rotor [rad]"]
    assert [angle[2], angle[5], angle[10]] == pytest.approx([0.24983586, 0.58081557, -0.30995804], abs=1e-7)
    assert largest_residual(table) < 1e-5


@pytest.mark.parametrize("inductance", ["", "inductance = 0.05"])
def test_a_governed_dc_motor_comes_to_its_set_point(nocdyn, inductance):
    table = run(nocdyn, DRIVE.format(inductance=inductance))
    assert table["omega_rotor [rad/s]"][-1] == pytest.approx(20.0, abs=1e-3)
    throttle = table["throttle_drive [1]"]
    assert throttle[0] == pytest.approx(1.0) and throttle[-1] == pytest.approx(0.5, abs=1e-3)
    assert min(throttle) >= 0 and max(throttle) <= 1
    assert ("current_drive [A]" in table) == bool(inductance)
    assert largest_residual(table) < 1e-5


@pytest.mark.parametrize("kinds", [EVERY_KIND, ELECTRICAL_KINDS], ids=lambda path: path.stem)
@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
@pytest.mark.parametrize("method", ["auto", "rk853", "rodas5p"])
def test_energy_of_every_kind_of_element_adds_up(nocdyn, kinds, formulation, method):
    settings = [f"run.formulation={formulation}", f"run.method={method}", "run.rtol=1e-9", "run.atol=1e-10"]
    words = [word for s in settings for word in ("--set", s)]
    assert nocdyn("run", kinds, "--out", "out", *words).returncode == 0
    table = nocdyn.values()
    assert largest_residual(table) < 1e-6
    assert table["work_in [J]"][-1] > 1


def test_check_counts_elements_of_one_role_together(nocdyn):
    outcome = nocdyn("check", EVERY_KIND)
    assert "0 gears, 4 couplings, 1 shaft, 1 mesh, 5 motors, 3 loads, 12 excitations" in outcome.stdout


def test_check_counts_electrical_machines_and_faults(nocdyn):
    outcome = nocdyn("check", ELECTRICAL_KINDS)
    assert "0 gears, 4 couplings, 6 motors, 1 load, 3 excitations" in outcome.stdout


def test_matrices_name_the_laws_that_are_not_those_of_the_paper(nocdyn):
    text = nocdyn("matrices", EVERY_KIND).stdout
    assert "Other laws than those of the paper: coupling 'shaft', 'splines', 'clutch', 'rubber', 'teeth'\n" in text
    assert "Other laws than those of the paper: motor 'constant', 'induction', 'table', 'dc'\n" in text


@pytest.mark.parametrize(
    "law, complaint",
    [
        (
            "gap = 0.1 polynomial = 0, 0",
            "gap = 0.1 needs an elastic moment at its edges: stiffness, cubic_stiffness or polynomial that is not 0",
        ),
        ("stiffness = 0 saturation = 5", "saturation = 5 needs stiffness > 0 [N m/rad]"),
    ],
)
def test_edges_and_limits_without_stiffness_are_refused(nocdyn, law, complaint):
    text = BACKLASH.replace("stiffness = 2.0e4 damping = 50.0", law).replace(f" gap = {pi / 4!r}", "")
    (nocdyn.folder / "machine.nml").write_text(text)
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == f"nocdyn: machine.nml:2: &coupling 'teeth': {complaint}\n"


def test_an_induction_motor_against_its_own_sense_is_refused(nocdyn):
    (nocdyn.folder / "machine.nml").write_text("""&body name = 'rotor' inertia = 2.0 /
&motor name = 'mains' body = 'rotor' kind = 'induction'
  breakdown_torque = -100.0 breakdown_slip = 0.2 synchronous_speed = 157.0 /
&run t_end = 1.0 /
""")
    outcome = nocdyn("check", "machine.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == (
        "nocdyn: machine.nml:3: &motor 'mains': breakdown_torque = -100 must have the sign of synchronous_speed = 157\n"
    )


@pytest.mark.parametrize("command", ["run", "check"])
def test_a_coupling_without_a_law_is_noted(nocdyn, command):
    text = "&body name='a' inertia=1 speed=1 /\n&body name='b' inertia=1 /\n&run t_end=1 /\n"
    text += "&coupling name='u' bodies='a','b' {} /\n"
    note = "note: coupling 'u' transmits nothing: it has no stiffness, table, damping or friction"
    for keys in ("", "rest_twist = 0.1", "stiffness = 0 polynomial = 0, 0"):
        assert note in nocdyn(command, nocdyn.write("m.nml", text.format(keys))).stdout
    for keys in ("stiffness = 1", "damping = 1", "friction = 1", "polynomial = 0, 2", "table_twist = 0, 1 table_moment = 0, 1"):
        assert "transmits" not in nocdyn(command, nocdyn.write("m.nml", text.format(keys))).stdout


SHAFTED = """\
&body name = 'a' inertia = 1 speed = 10 /
&body name = 'b' inertia = 2 /
&body name = 'c' inertia = 2 /
&shaft name = 'line' bodies = 'a', 'b' lengths = 2 diameters = 0.1 shear_modulus = 8e10 density = 7850
  damping_ratio = 0.01 damping_frequency_hz = 50 nodes = 4 /
&mesh name = 'teeth' bodies = 'b', 'c' radii = 0.1, 0.1 stiffness = 1e8 damping = 10 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 10 /
&load name = 'l' body = 'c' viscous = 1 /
&run t_end = 0.1 /
"""


def test_shafts_and_meshes_are_called_so(nocdyn):
    path = nocdyn.write("m.nml", SHAFTED)
    assert ": 3 bodies, 0 gears, 0 couplings, 1 shaft, 1 mesh, 1 motor, 1 load, 0 excitations" in nocdyn("check", path).stdout
    lines = nocdyn("equilibrium", path).stdout.split("power into the machine [W]")[1].splitlines()
    assert [line.split()[:2] for line in lines if line][:4] == [
        ["mesh", "teeth"], ["motor", "m"], ["load", "l"], ["shaft", "line"],
    ]  # fmt: skip
