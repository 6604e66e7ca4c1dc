"""Every column has a label of its own: what asks for a quantity by its name gets that one."""

import itertools

import pytest

BODIES = (
    "".join(f"&body name = '{name}' inertia = 1 bearing_friction = 1e-3 /\n" for name in "abcdefgh") + "&run t_end = 1e-3 /\n"
)
# one element of every kind, on bodies of their own where it joins some
ELEMENTS = {
    "body": "&body name = '{}' inertia = 1 bearing_friction = 1e-3 /",
    "coupling": "&coupling name = '{}' bodies = 'a', 'b' stiffness = 1 damping = 1 diameter = 0.1 /",
    "shaft": "&shaft name = '{}' bodies = 'a', 'c' lengths = 1, 2 diameters = 0.1, 0.2 shear_modulus = 8e10 density = 7850 /",
    "mesh": "&mesh name = '{}' bodies = 'a', 'd' teeth = 20, 60 module = 0.005 stiffness = 4e8 damping = 1e3 efficiency = 0.9 /",
    "gear": "&gear name = '{}' bodies = 'a', 'e' teeth = 1, 2 efficiency = 0.9 /",
    "planetary": "&planetary name = '{}' sun = 'e' ring = 'f' carrier = 'g' teeth = 20, 70 efficiency = 0.98 /",
    "differential": "&differential name = '{}' sides = 'b', 'c' case = 'h' /",
    "constraint": "&constraint name = '{}' bodies = 'f', 'h' coefficients = 1, 2 /",
    "clutch": "&clutch name = '{}' bodies = 'a', 'b' capacity = 1 /",
    "freewheel": "&freewheel name = '{}' bodies = 'b', 'c' /",
    "cardan": "&cardan name = '{}' bodies = 'c', 'd' angle_deg = 5 /",
    "crank": "&crank name = '{}' body = 'd' crank_radius = 0.05 rod_length = 0.2 piston_mass = 1 rod_mass = 1 rod_center = 0.1 /",
    "motor": "&motor name = '{}' body = 'a' kind = 'dc' voltage = 1 resistance = 1 flux_constant = 1 inductance = 1 /",
    "load": "&load name = '{}' body = 'b' viscous = 1 /",
    "excitation": "&excitation name = '{}' body = 'c' amplitude = 1 frequency = 1 /",
    "engine": "&engine name = '{}' cylinders = 'b' stroke = 4 firing = 0 orders = 1 amplitudes = 1 /",
}
# endings that columns have: of the ends of a shaft, of nodes
NAMES = ("x", "x_1", "x[1]")


@pytest.mark.parametrize("first", ELEMENTS)
def test_names_that_are_alike_give_different_columns_or_are_refused(nocdyn, first):
    others = list(ELEMENTS)[list(ELEMENTS).index(first) :]
    pairs = [(kind, name) for kind, name in itertools.product(others, NAMES) if (kind, name) != (first, "x")]
    for number, (kind, name) in enumerate(pairs):
        nocdyn.write(f"{number}.nml", BODIES + ELEMENTS[first].format("x") + "\n" + ELEMENTS[kind].format(name) + "\n")
    outcome = nocdyn("run", *(f"{number}.nml" for number in range(len(pairs))), "--out", "out", "--quiet")
    refused = {int(line.removeprefix("nocdyn: ").split(".")[0]): line for line in outcome.stderr.splitlines()}
    for line in refused.values():
        assert "is taken by" in line or "would have the label of one of &" in line, line
        assert ".nml:1" in line
    for number in {*range(len(pairs))} - refused.keys():
        header, _ = nocdyn.table(f"out/{number}")
        assert len(set(header)) == len(header)


@pytest.mark.parametrize("command", ["check", "run", "modes", "equilibrium", "matrices", "sweep"])
def test_a_label_of_two_columns_is_refused_by_every_command(nocdyn, command):
    text = BODIES + ELEMENTS["shaft"].format("s") + "\n" + ELEMENTS["coupling"].format("s_1") + "\n"
    text = text.replace("bearing_friction = 1e-3", "")
    text += "&sweep design = 'grid' /\n&vary target = 'body.a.inertia' low = 1 high = 2 count = 2 /\n"
    nocdyn.write("m.nml", text + "&record quantity = 'total_moment_s_1' statistic = 'final' /\n")
    outcome = nocdyn(command, "m.nml", "--out", "out") if command != "matrices" else nocdyn(command, "m.nml")
    assert outcome.returncode == 2
    assert outcome.stderr == (
        "nocdyn: m.nml:11: &coupling 's_1': its column 'total_moment_s_1 [N m]' would have the label of one of &shaft 's'; "
        "allowed: another name\n"
    )
