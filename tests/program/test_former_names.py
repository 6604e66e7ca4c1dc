"""Names that signals had before are understood for a while: with a note, once for each place of the input."""

import pytest
from sweep_inputs import SWEEP_PROGRAM

MACHINE = """\
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 2.0 /
&body name = 'c' inertia = 1.5 /
&coupling name = 'k' bodies = 'a', 'b' stiffness = 100.0 damping = 1.0 /
&shaft name = 's' bodies = 'b', 'c' lengths = 1.0 diameters = 0.05 shear_modulus = 8e10 density = 7850
  damping_ratio = 0.01 damping_frequency = 9 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 1.0 /
&load name = 'l' body = 'c' viscous = 0.1 /
&excitation name = 'x' body = 'c' kind = 'orders' orders = 2 amplitudes = 1.0 /
&response body = 'a' speed = 5.0, 9.0 count = 3 /
&run t_end = 0.1 rtol = 1e-4 /
"""
SWEEP = "&sweep design = 'grid' /\n&vary target = 'load.l.viscous' low = 0.1 high = 0.2 count = 2 /\n"
OTHER_SHAFT = "&body name = 'd' inertia = 1.0 /\n&coupling name = 's_1' bodies = 'c', 'd' stiffness = 10.0 /\n"

# groups of the input, the place, the former name and that of today
PATTERNS = [
    ("&output columns = 'shaft_k' /", "&output: columns", "shaft_k", "total_moment_k"),
    ("&output columns = 'shaft_*' /", "&output: columns", "shaft_k", "total_moment_k"),
    ("&output columns = 'shaft_k [N m]' /", "&output: columns", "shaft_k", "total_moment_k"),
    ("&output columns = 'moment_s_max' /", "&output: columns", "moment_s_max", "total_moment_s_max"),
]
RECORDS = [
    ("&record quantity = 'shaft_k' statistic = 'max' /", "&record: quantity", "shaft_k", "total_moment_k"),
    ("&record quantity = 'shaft_k [N m]' statistic = 'max' /", "&record: quantity", "shaft_k", "total_moment_k"),
    ("&record quantity = 'moment_s_1' statistic = 'max' /", "&record: quantity", "moment_s_1", "total_moment_s_1"),
    ("&record response = 'moment_k' statistic = 'peak' /", "&record: response", "moment_k", "total_moment_k"),
    ("&record response = 'moment_s_2' statistic = 'peak' /", "&record: response", "moment_s_2", "total_moment_s_2"),
]


def notes(outcome):
    return [line.strip() for line in outcome.stdout.splitlines() if "the next release will not know the former name" in line]


def told(place, former, name):
    return f"{place}: {former} is called {name} now; the next release will not know the former name"


@pytest.mark.parametrize("group, place, former, name", PATTERNS, ids=lambda value: value if "&" in value else None)
def test_a_former_column_is_written_with_a_note(nocdyn, group, place, former, name):
    nocdyn.write("m.nml", MACHINE + group + "\n")
    place = f"m.nml:{MACHINE.count(chr(10)) + 1}: {place.split(':')[0]}"
    outcome = nocdyn("run", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert notes(outcome) == [f"m.nml: note: {told(place, former, name)}"]
    assert nocdyn.table("out")[0] == ["t [s]", f"{name} [N m]"]
    assert notes(nocdyn("check", "m.nml")) == [f"note: {told(place, former, name)}"]


@pytest.mark.skipif(not SWEEP_PROGRAM.exists(), reason="nocdyn-sweep is not built")
@pytest.mark.parametrize("group, place, former, name", PATTERNS[:1] + RECORDS, ids=lambda value: value if "&" in value else None)
def test_a_sweep_notes_a_former_name_once(nocdyn, group, place, former, name):
    record = "&record quantity = 'omega_a' statistic = 'final' /\n" if "&output" in group else ""
    nocdyn.write("m.nml", MACHINE + SWEEP + record + group + "\n")
    place = f"m.nml:{(MACHINE + SWEEP + record).count(chr(10)) + 1}: {place.split(':')[0]}"
    outcome = nocdyn("sweep", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert notes(outcome) == [f"m.nml: note: {told(place, former, name)}"]
    assert notes(nocdyn("check", "m.nml")) == [f"note: {told(place, former, name)}"]
    if "&record" in group:
        (column,) = nocdyn.columns("out")
        assert column["name"].startswith(name)
    assert notes(nocdyn("sweep", "m.nml", "--out", "quiet", "--quiet")) == []


@pytest.mark.skipif(not SWEEP_PROGRAM.exists(), reason="nocdyn-sweep is not built")
@pytest.mark.parametrize("key, statistic", [("quantity", "final"), ("response", "peak")])
def test_a_name_of_today_goes_before_a_former_one(nocdyn, key, statistic):
    """'moment_s_1' was the moment of shaft 's' at its first end, and is that of coupling 's_1'."""
    nocdyn.write("m.nml", MACHINE + OTHER_SHAFT + SWEEP + f"&record {key} = 'moment_s_1' statistic = '{statistic}' /\n")
    outcome = nocdyn("sweep", "m.nml", "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert notes(outcome) == []
    (column,) = nocdyn.columns("out")
    assert (column["kind"], column["element_kind"], column["element"]) == ("moment", "coupling", "s_1")


@pytest.mark.parametrize("name", ["moment_k", "total_moment_k", "moment_s_1x", "shaft_s"])
def test_names_of_today_have_no_note(nocdyn, name):
    nocdyn.write("m.nml", MACHINE + f"&output columns = '{name}' /\n")
    assert notes(nocdyn("check", "m.nml")) == []
