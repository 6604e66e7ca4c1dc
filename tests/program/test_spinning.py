"""Machines that turn: a rotation of the whole machine changes neither steps nor moments; works and their balance are right."""

import cmath
import math

import pytest
from sweep_inputs import needs_sweeps

# Two discs; the first is shaken. Their twist obeys w'' = -2 (k w + d w') - A sin(W t), a linear equation.
DISCS = """
&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 1.0 /
&coupling name = 'shaft' bodies = 'a', 'b' stiffness = 1.0e4 damping = 0.2 /
&excitation name = 'shaker' body = 'a' amplitude = 20.0 frequency = 100.0 /
&run t_end = 10.0 /
&output points = 201 /
"""

# A train with a planetary set, a geared branch and couplings of three kinds; no torque depends on an absolute speed or angle.
TRAIN = """
&body name = 'rotor' inertia = 2.0 /
&body name = 'sun' inertia = 0.1 /
&body name = 'carrier' inertia = 0.6 /
&body name = 'ring' inertia = 1.5 /
&body name = 'pinion' inertia = 0.2 /
&body name = 'wheel' inertia = 0.9 /
&body name = 'drum' inertia = 4.0 /
&coupling name = 'shaft' bodies = 'rotor', 'sun' stiffness = 3.0e4 cubic_stiffness = 1.0e6 damping = 3.0 /
&coupling name = 'slip' bodies = 'rotor', 'ring' stiffness = 0.0 damping = 2.0 /
&coupling name = 'quill' bodies = 'carrier', 'pinion' stiffness = 8.0e4 damping = 1.0 /
&coupling name = 'rope' bodies = 'wheel', 'drum' stiffness = 2.0e4 gap = 1.0e-3 damping = 5.0 /
&planetary name = 'set' sun = 'sun' ring = 'ring' carrier = 'carrier' teeth = 20, 60 /
&gear name = 'mesh' bodies = 'pinion', 'wheel' teeth = 30, 70 /
&excitation name = 'shaker' body = 'rotor' amplitude = 50.0 frequency = 60.0 /
&run t_end = 2.0 method = 'rk853' /
&output points = 101 /
"""


def twist_of_discs(t):
    """The twist of DISCS from rest [rad]: the response to sin(W t), and the free vibration that meets the start."""
    drive, damping, stiffness, amplitude = 100.0, 0.2, 1e4, 20.0
    response = -amplitude / (2 * stiffness - drive**2 + 2j * damping * drive)  # of exp(i W t)
    decay = -damping + 1j * math.sqrt(2 * stiffness - damping**2)
    start, rate = -response.imag, -(1j * drive * response).imag
    # the free vibration is Re(c exp(decay t)) with Re(c) = start, Re(c decay) = rate
    free = complex(start, (start * decay.real - rate) / decay.imag)
    return (response * cmath.exp(1j * drive * t)).imag + (free * cmath.exp(decay * t)).real


def run(nocdyn, file, out, *settings):
    options = [option for setting in settings for option in ("--set", setting)]
    outcome = nocdyn("run", file, "--out", out, "--quiet", *options)
    assert outcome.returncode == 0, outcome.stderr
    header, rows = nocdyn.table(out)
    return nocdyn.summary(out), {name: [row[i] for row in rows] for i, name in enumerate(header)}


@pytest.mark.parametrize("method", ["rk45", "rk853", "rodas5p", "auto", "taylor"])
def test_discs_vibrate_as_at_rest(nocdyn, method):
    nocdyn.write("discs.nml", DISCS)
    steps = []
    for speed in (0, 100, 3000, 1e5):
        turning = [f"body.{name}.speed={speed}" for name in "ab"]
        summary, columns = run(nocdyn, "discs.nml", "out", f"run.method={method}", *turning)
        steps.append(summary["counts"]["accepted_steps"])
        moment = columns["moment_shaft [N m]"]
        exact = [1e4 * twist_of_discs(t) for t in columns["t [s]"]]
        assert max(abs(m - e) for m, e in zip(moment, exact)) < 1e-3 * 33.9
        extremes = summary["columns"]["moment_shaft [N m]"]
        assert max(extremes["max"], -extremes["min"]) == pytest.approx(33.886, rel=1e-3)
        rigid = 0.1 * (10.0 - math.sin(1000.0) / 100.0)  # A / (2 J W) (t - sin(W t) / W)
        assert columns["phi_b [rad]"][-1] == pytest.approx(10 * speed + rigid + twist_of_discs(10.0) / 2, rel=1e-12, abs=1e-5)
    assert max(steps) <= 1.05 * min(steps)


@pytest.mark.parametrize("formulation", ["reduced", "paper", "multiplier"])
def test_a_rotation_that_is_added_changes_no_step_and_no_moment(nocdyn, formulation):
    nocdyn.write("train.nml", TRAIN)
    at_rest, still = run(nocdyn, "train.nml", "out", f"run.formulation={formulation}")
    speeds = [f"body.{name}.speed=3000" for name in ("rotor", "sun", "carrier", "ring", "pinion")]
    speeds += [f"body.{name}.speed={-3000 * 3 / 7!r}" for name in ("wheel", "drum")]
    turning, moved = run(nocdyn, "train.nml", "out", f"run.formulation={formulation}", *speeds)
    assert turning["counts"]["accepted_steps"] == pytest.approx(at_rest["counts"]["accepted_steps"], rel=0.05)
    moments = [name for name in still if name.startswith(("moment_", "damping_", "reaction_"))]
    assert len(moments) > 6
    for name in moments:
        largest = max(abs(value) for value in still[name])
        assert max(abs(a - b) for a, b in zip(still[name], moved[name])) <= 10 * 1e-6 * largest + 1e-9, name


@needs_sweeps
def test_variants_of_a_machine_that_turns_are_those_of_runs(nocdyn):
    quantities = ["phi_drum", "twist_shaft", "twist_slip", "moment_shaft", "moment_rope", "omega_ring"]
    sweep = "&sweep design = 'grid' /\n&vary target = 'coupling.quill.damping' low = 0.5 high = 2.5 count = 5 /\n"
    sweep += "".join(f"&record quantity = '{name}' statistic = 'final' /\n" for name in quantities)
    sweep += "&record quantity = 'phi_drum' statistic = 'max_abs' /\n&record quantity = 'moment_shaft' statistic = 'max' /\n"
    speeds = [f"body.{name}.speed=800" for name in ("rotor", "sun", "carrier", "ring", "pinion")]
    speeds += [f"body.{name}.speed={-800 * 3 / 7!r}" for name in ("wheel", "drum")]
    nocdyn.write("train.nml", TRAIN)
    nocdyn.write("sweep.nml", TRAIN + sweep)
    options = [option for setting in speeds for option in ("--set", setting)]
    outcome = nocdyn("sweep", "sweep.nml", "--out", "sweep", "--csv", "--quiet", *options)
    assert outcome.returncode == 0, outcome.stderr
    lines = [line.split(",") for line in (nocdyn.folder / "sweep" / "sweep.csv").read_text().splitlines()]
    header, rows = lines[0], lines[1:]
    for damping, row in zip((0.5, 1.0, 1.5, 2.0, 2.5), rows):
        summary, columns = run(nocdyn, "train.nml", "out", *speeds, f"coupling.quill.damping={damping}")
        results = dict(zip(header, row))
        for name, values in columns.items():
            for label, value in results.items():
                if label.startswith(f"{name.split()[0]}_final"):
                    assert float(value) == pytest.approx(values[-1], rel=1e-4, abs=1e-7), label
        largest = max(abs(summary["columns"]["phi_drum [rad]"][end]) for end in ("min", "max"))
        assert [float(v) for k, v in results.items() if k.startswith("phi_drum_max_abs")] == [pytest.approx(largest, rel=1e-6)]


@pytest.mark.parametrize("method", ["rk45", "rk853", "rodas5p", "taylor"])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_works_are_right_where_the_motion_is_easy(nocdyn, method, rtol):
    # speed = A / (J W) (1 - cos(W t)): the work is the kinetic energy, at most 0.3175 J
    nocdyn.write(
        "disc.nml",
        "&body name = 'disc' inertia = 10.0 /\n"
        "&excitation name = 'shaker' body = 'disc' amplitude = 126.0 frequency = 100.0 /\n"
        "&run t_end = 5.0 /\n&output points = 501 /\n",
    )
    _, columns = run(nocdyn, "disc.nml", "out", f"run.method={method}", f"run.rtol={rtol}")
    turned_over = 5.0 * 100.0 / math.pi * 0.3175  # up and down in each period
    for t, work in zip(columns["t [s]"], columns["work_in [J]"]):
        exact = 5.0 * (126.0 / 1000.0 * (1 - math.cos(100.0 * t))) ** 2
        assert abs(work - exact) < 1e-3 * turned_over


def test_a_body_without_any_element_keeps_turning(nocdyn):
    nocdyn.write("body.nml", "&body name = 'disc' inertia = 1.0 speed = 1.0e4 /\n&run t_end = 100.0 /\n&output points = 3 /\n")
    for method in ("rk45", "rodas5p", "taylor"):
        _, columns = run(nocdyn, "body.nml", "out", f"run.method={method}")
        assert columns["phi_disc [rad]"] == pytest.approx([0.0, 5e5, 1e6], rel=1e-12)


@pytest.mark.parametrize("passing", ["", "&motor name='m' body='a' a=10 b=0 c=0 /\n&load name='l' body='b' constant=10 /\n"])
def test_the_balance_is_judged_by_the_vibration(nocdyn, passing):
    # turning, the discs hold 9e6 J; their vibration 0.1 J; from motor to load pass 3e5 J
    nocdyn.write("discs.nml", DISCS + passing)
    speeds = [option for name in "ab" for option in ("--set", f"body.{name}.speed=3000")]
    outcome = nocdyn("run", "discs.nml", "--out", "out", *speeds)
    assert "large energy balance error" not in outcome.stdout
    loose = ["--set", "run.rtol=0.05", "--set", "run.atol=0.01"]
    outcome = nocdyn("run", "discs.nml", "--out", "out", *speeds, *loose)
    assert outcome.returncode == 0
    note = [line for line in outcome.stdout.splitlines() if "large energy balance error" in line]
    assert len(note) == 1
    assert "J; the vibration, as kinetic energy about the rigid motion and elastic energy, holds at most " in note[0]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_a_rotor_that_hardly_vibrates_is_not_judged_by_that(nocdyn, rtol):
    # 3e5 J pass through a coupling that holds at most 1e-5 J
    nocdyn.write(
        "stiff.nml",
        """\
&body name='m' inertia=10 speed=157 /
&body name='g' inertia=20 speed=157 /
&coupling name='k' bodies='m','g' stiffness=1e9 damping=2e4 /
&motor name='d' body='m' kind='induction' breakdown_torque=15000 breakdown_slip=0.05 synchronous_speed=157.08 /
&load name='l' body='g' table_speed=0,100,150,158,200 table_torque=0,10,20,19,30 /
&excitation name='x' body='g' amplitude=100 frequency_hz=50 /
&run t_end=100 /
""",
    )
    summary, _ = run(nocdyn, "stiff.nml", "out", f"run.rtol={rtol}")
    assert not [note for note in summary["machine"]["notes"] if "large energy balance error" in note]
