"""Machines that cannot be, and notes on those that can: file, line, group and name."""

import re

import pytest
from conftest import CASE_2, IS_SANITIZED, fast_only, peak_memory

PAIR = """\
&body name = 'a' inertia = 1.0 speed = {a} /
&body name = 'b' inertia = 1.0 speed = {b} /
&gear name = 'first' bodies = 'a', 'b' radii = 1.0, 1.0 /
&gear name = 'second' bodies = 'a', 'b' radii = 1.0, {radius} /
&run t_end = 1.0 /
"""


NOTE = "gear 'second' repeats what 'first' already fixes; its tooth force is not unique, the smallest-norm share is reported"


def refusal(nocdyn, command, text):
    nocdyn.write("pair.nml", text)
    outcome = nocdyn(command, "pair.nml")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    return outcome.stderr


@pytest.mark.parametrize("command", ["run", "check", "matrices"])
def test_gears_that_lock_are_refused_by_location_and_name(nocdyn, command):
    message = refusal(nocdyn, command, PAIR.format(a=0, b=0, radius=2.0))
    assert message.startswith("nocdyn: pair.nml:4: &gear 'second': locks 'a', 'b': ")
    assert message.endswith(": 'first' and 'second' drive 'b' at -1 and -0.5 times 'a'\n")


def test_coordinates_that_cannot_be_independent_are_refused(nocdyn):
    outcome = nocdyn("check", CASE_2, "--set", "run.independent='pinion','machine'")
    assert outcome.returncode == 2
    assert outcome.stderr.startswith("nocdyn: --set run.independent='pinion','machine': &run: independent ")


@pytest.mark.parametrize("command", ["run", "check"])
def test_a_redundant_gear_is_a_note_and_no_failure(nocdyn, command):
    nocdyn.write("pair.nml", PAIR.format(a=1.0, b=-1.0, radius=1.0))
    outcome = nocdyn(command, "pair.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert NOTE in outcome.stdout


def test_the_note_on_a_redundant_gear_is_in_the_summary(nocdyn):
    nocdyn.write("pair.nml", PAIR.format(a=1.0, b=-1.0, radius=1.0))
    nocdyn("run", "pair.nml", "--out", "out")
    machine = nocdyn.summary("out")["machine"]
    assert (machine["gears"], machine["constraints"], machine["degrees_of_freedom"]) == (2, 2, 1)
    assert machine["notes"] == [NOTE]


def test_all_errors_of_a_file_are_reported_together_each_with_its_line(nocdyn):
    message = refusal(
        nocdyn,
        "run",
        "&body name = 'a' inertia = -1 /\n&gera name = 'g' /\n&load name = 'l' body = 'b' viscous = 1e999 /\n&run t_end = 1 /\n",
    )
    assert [line.removeprefix("nocdyn: ").split(": ")[0] for line in message.splitlines()] == [
        "pair.nml:1",
        "pair.nml:2",
        "pair.nml:3",
        "pair.nml:3",
    ]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("output.interval=1e-9", "interval = 1e-09 asks for too many rows; allowed: at most 10000000"),
        ("output.interval=1e-30", "interval = 1e-30 asks for too many rows"),
        ("run.t_end=1e30", "interval = 0.01 asks for too many rows"),
    ],
)
@pytest.mark.parametrize("command", ["run", "check"])
def test_more_rows_than_anyone_can_read_are_refused(nocdyn, command, override, message):
    outcome = nocdyn(command, CASE_2, "--set", override)
    assert outcome.returncode == 2 and message in outcome.stderr
    assert list(nocdyn.folder.iterdir()) == []


@pytest.mark.parametrize("command", ["run", "check"])
def test_rows_that_rounding_makes_equal_are_refused(nocdyn, command):
    outcome = nocdyn(command, CASE_2, "--set", "run.t_start=1e15", "--set", "run.t_end=1000000000000010")
    assert outcome.returncode == 2
    assert f"{CASE_2}:24: &output: interval = 0.01 asks for times that rounding makes equal" in outcome.stderr


@pytest.mark.parametrize(
    ("bodies", "override", "rows"),
    [(2001, "formulation=paper", 6003), (3001, "formulation=multiplier", 6002)],
)
def test_dense_matrices_too_large_for_memory_are_refused(nocdyn, bodies, override, rows):
    lines = [f"&body name = 'b{i}' inertia = 1.0 /" for i in range(bodies)]
    nocdyn.write("large.nml", "\n".join([*lines, "&run t_end = 1.0 /", "&output points = 2 /\n"]))
    outcome = nocdyn("run", "large.nml", "--set", f"run.{override}")
    assert outcome.returncode == 2
    assert outcome.stderr.startswith(f"nocdyn: --set run.{override}: &run: formulation = '")
    assert f"needs dense matrices of {rows} rows for this machine; at most 6000" in outcome.stderr
    assert nocdyn("run", "large.nml").returncode == 0


@pytest.fixture(scope="module")
def hub(shared_nocdyn):
    """A disc with so many branches that no order of the states makes the band of the Jacobian narrow."""
    branches = [
        f"&body name = 'b{i}' inertia = 1.0 speed = 0.0 /\n&coupling name = 'c{i}' bodies = 'hub', 'b{i}' stiffness = 1.0 /"
        for i in range(3000)
    ]
    lines = ["&body name = 'hub' inertia = 1.0 speed = 1.0 /", *branches, "&run t_end = 0.01 method = 'auto' /"]
    shared_nocdyn.write("hub.nml", "\n".join([*lines, "&output points = 2 /\n"]))
    return shared_nocdyn


NEED = "a matrix of 6002 x 6002 entries for this machine, whose couplings leave no narrower band; at most 6000 x 6000 are allowed"


@pytest.mark.parametrize("method", ["rosenbrock", "rodas4", "rodas5p"])
def test_implicit_methods_are_refused_where_their_matrix_is_too_large(hub, method):
    outcome = hub("run", "hub.nml", "--out", "refused", "--set", f"run.method={method}")
    assert (outcome.returncode, outcome.stdout) == (2, "")
    place = f"--set run.method={method}: &run"
    assert outcome.stderr == f"nocdyn: {place}: method = '{method}' needs {NEED}; method = 'rk853' needs none\n"
    assert not (hub.folder / "refused").exists()


@fast_only
@pytest.mark.parametrize("method", ["rk45", "rk853"])
def test_explicit_methods_run_where_a_matrix_would_be_too_large(hub, method):
    outcome = hub("run", "hub.nml", "--out", "out", "--set", f"run.method={method}")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "note" not in outcome.stdout


@fast_only
def test_auto_does_without_a_matrix_that_is_too_large_and_says_so(hub):
    megabytes, output = peak_memory(hub, "run", "hub.nml", "--out", "out")
    note = f"method = 'auto' takes explicit steps alone, those of 'rk853': implicit ones need {NEED}"
    assert f"hub.nml: note: {note}\n" in output
    summary = hub.summary("out")
    assert summary["machine"]["notes"] == [note]
    assert (summary["settings"]["method"], summary["method"]["name"]) == ("auto", "rk853")
    assert megabytes < 220 or IS_SANITIZED  # the matrix alone would have 288
    hub("run", "hub.nml", "--out", "explicit", "--set", "run.method=rk853")
    assert (hub.folder / "out/trajectory.csv").read_bytes() == (hub.folder / "explicit/trajectory.csv").read_bytes()


@fast_only
def test_a_long_chain_keeps_its_implicit_steps(nocdyn):
    bodies = "".join(f"&body name = 'b{i}' inertia = 1.0 speed = {i % 2} /\n" for i in range(3001))
    couplings = "".join(f"&coupling name = 'c{i}' bodies = 'b{i}', 'b{i + 1}' stiffness = 1.0 /\n" for i in range(3000))
    nocdyn.write("chain.nml", bodies + couplings + "&run t_end = 0.01 /\n&output points = 2 /\n")
    for method in ("auto", "rodas5p"):
        outcome = nocdyn("run", "chain.nml", "--out", "out", "--set", f"run.method={method}")
        assert (outcome.returncode, outcome.stderr) == (0, "")
        assert "note" not in outcome.stdout
        assert nocdyn.summary("out")["method"]["name"] == method


@pytest.mark.parametrize("formulation", ["paper", "multiplier"])
def test_a_formulation_without_taylor_series_is_refused(nocdyn, formulation):
    outcome = nocdyn("run", CASE_2, "--out", "out", "--set", "run.method=taylor", "--set", f"run.formulation={formulation}")
    assert outcome.returncode == 2
    assert outcome.stderr == (
        "nocdyn: --set run.method=taylor: &run: method = 'taylor' cannot be used: "
        f"formulation '{formulation}' has no Taylor series; 'reduced' has one\n"
    )
    assert not (nocdyn.folder / "out").exists()


LIGHT = """\
&body name = 'motor' inertia = 2.0 /
&body name = 'pinion' inertia = {pinion} /
&body name = 'wheel' inertia = {wheel} /
&coupling name = 'shaft' bodies = 'motor', 'pinion' stiffness = 100.0 damping = 0.1 /
&gear name = 'reducer' bodies = 'pinion', 'wheel' radii = 1.0, 2.0 /
&motor name = 'drive' body = 'motor' a = 20.0 b = 1.0 c = 0.0 /
&load name = 'work' body = 'wheel' viscous = 4.0 /
&run t_end = 1.0 formulation = '{formulation}' /
"""


@pytest.mark.parametrize("command", ["run", "check", "matrices", "modes", "equilibrium"])
def test_bodies_that_move_without_any_inertia_are_refused_by_name(nocdyn, command):
    message = refusal(nocdyn, command, LIGHT.format(pinion=0, wheel=0, formulation="reduced"))
    assert message == (
        "nocdyn: pair.nml:2: &body 'pinion': inertia = 0: 'pinion', 'wheel' can turn while every body with an inertia stands "
        "still; allowed: > 0 [kg m2], or 0 where a body with an inertia is geared to it\n"
    )


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
@pytest.mark.parametrize("command", ["run", "check", "matrices", "modes", "equilibrium"])
def test_a_pinion_may_be_without_inertia(nocdyn, command, formulation):
    nocdyn.write("light.nml", LIGHT.format(pinion=0, wheel=3.0, formulation=formulation))
    outcome = nocdyn(command, "light.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")


def test_the_inertia_of_a_pinion_may_stand_at_its_wheel(nocdyn):
    nocdyn.write("light.nml", LIGHT.format(pinion=0, wheel=3.0, formulation="reduced"))
    nocdyn.write("heavy.nml", LIGHT.format(pinion=0.5, wheel=1.0, formulation="reduced"))
    nocdyn("run", "light.nml", "--out", "light")
    nocdyn("run", "heavy.nml", "--out", "heavy")
    columns = []
    for name in ("light", "heavy"):
        header, rows = nocdyn.table(name)
        columns.append([row[header.index("omega_wheel [rad/s]")] for row in rows])
    assert columns[0] == pytest.approx(columns[1], rel=1e-5, abs=1e-7)


MISTAKEN = """&body name='a' inertia=1 /
&body name='b' inertia=1 /
&coupling name='k' bodies='a','b' saturation=3 stiffness=0 /
&coupling name='l' bodies='a','b' damping_frequency=3 relative_damping=0.1 /
&shaft name='s' bodies='a','b' lengths=1 diameters=0.1 bores=0.2 shear_modulus=8e10 /
&mesh name='z' bodies='a','b' radii=1,2 stiffness=1e5 transmission_error=1e-5 /
&gear name='g' bodies='ground','b' teeth=1,2 efficiency=0.9 /
&clutch name='c' bodies='a','b' capacity=10 static_capacity=5 /
&crank name='p' body='a' crank_radius=0.1 rod_length=0.11 offset=0.05 piston_mass=1 /
&motor name='m' body='a' kind='induction' breakdown_torque=-1 breakdown_slip=0.1 synchronous_speed=3 /
&engine name='e' cylinders='a' stroke=3 firing=0 orders=1 amplitudes=1 /
&response body='a' speed=20,10 /
&fatigue name='f' coupling='nope' reference_moment=1 reference_cycles=1e6 slope=3 /
&run t_end=1 /
&output interval=1e-30 /
"""


@pytest.mark.parametrize("command", ["check", "run", "modes", "equilibrium"])
def test_the_mistakes_of_all_groups_are_told_at_once_in_the_order_of_the_file(nocdyn, command):
    nocdyn.write("m.nml", MISTAKEN)
    outcome = nocdyn(command, "m.nml")
    assert outcome.returncode == 2
    lines = [int(line.split(":")[2]) for line in outcome.stderr.splitlines()]
    assert lines == [*range(3, 14), 15]


MISTAKES = """\
&body name = 'a' inertia = 1 /
&body name = 'b' inertia = 2 /
&body name = 'c' inertia = 3 /
&shaft name = 's' bodies = 'a', 'b' lengths = 1, 2 diameters = 0.1, 0.2 bores = 0.1, 0 density = 7850, 7850, 7850 \
shear_modulus = 8e10, 7e10, 6e10 /
&clutch name = 'k' bodies = 'b', 'c' table_slip = 1, 2 table_capacity = 100, 90 static_capacity = 50 /
&crank name = 'p' body = 'a' crank_radius = 0.1 rod_length = 0.15 offset = 0.06 rod_mass = 1 piston_mass = 1 /
&motor name = 'm' body = 'a' kind = 'inverter' torque_limit = 10 poles = 3 /
&excitation name = 'f' body = 'c' kind = 'fault' fault = 'two_phase' rated_torque = 1e3 time = -1 frequency_hz = 50 \
subtransient_reactance = 0.3 transient_reactance = 0.2 synchronous_reactance = 0.1 subtransient_time = 0.03 transient_time = 1 \
armature_time = 0.1 /
&fatigue name = 'l' shaft = 't' table_cycles = 1e3, 1e6 table_moment = 10, 20 ultimate_stress = 1e9 profile_speeds = 1 \
profile_hours = 1 /
&run t_end = 1 /
"""
WRONG_KEYS = {
    4: ["shear_modulus", "density", "bores"],
    5: ["table_slip", "static_capacity"],
    6: ["offset", "rod_mass"],
    7: ["kind", "poles"],
    8: ["time", "transient_reactance", "synchronous_reactance"],
    9: ["shaft", "table_moment", "ultimate_stress", "profile_speeds"],
}


@pytest.mark.parametrize("command", ["check", "run", "modes", "campbell"])
def test_all_mistakes_of_all_groups_are_named_at_once(nocdyn, command):
    outcome = nocdyn(command, nocdyn.write("wrong.nml", MISTAKES))
    assert outcome.returncode == 2
    found = {}
    for line in outcome.stderr.splitlines():
        match = re.fullmatch(r"nocdyn: .*wrong\.nml:(\d+): &\w+ '\w': (\w+)\b.*", line)
        assert match, line
        found.setdefault(int(match[1]), []).append(match[2])
    assert list(found) == sorted(found)
    assert {line: len(keys) for line, keys in found.items()} == {line: len(keys) for line, keys in WRONG_KEYS.items()}
