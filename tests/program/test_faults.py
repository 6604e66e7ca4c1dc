"""Electrical faults and excitations with a start, an end or a decay: closed forms of torques and of the motion they cause."""

import csv
import json

import numpy as np
import pytest

MAINS = 2 * np.pi * 50
RATED, SUBTRANSIENT, TRANSIENT = 1000.0, 0.2, 0.3
TIMES = {"subtransient_time": 0.03, "transient_time": 0.8, "armature_time": 0.15}
FAULT = (
    "&excitation name='f' body='b' kind='fault' fault='{fault}' rated_torque=1000 subtransient_reactance=0.2 frequency_hz=50 "
    "time=0.1 {more} /\n"
)
BODY = "&body name='b' inertia=5 /\n&run t_end=0.5 /\n&output points=501 /\n"
INERTIAS, STIFFNESSES = (40.0, 25.0, 8.0), (2.0e6, 3.0e5)


def columns_of(nocdyn, text, *words):
    nocdyn.write("machine.nml", text)
    done = nocdyn("run", "machine.nml", *words)
    assert (done.returncode, done.stderr) == (0, "")
    with (nocdyn.folder / "results/machine/trajectory.csv").open() as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def torque_of(fault, x, stator, rotor, angle=2 * np.pi / 3):
    """The torque in units of the rated one that brakes the rotor: the decays of both fluxes, the second with 1 / reactance."""
    phase = MAINS * x
    if fault == "three_phase":
        return rotor * stator * np.sin(phase)
    if fault == "two_phase":
        return rotor * (stator * np.sin(phase) - np.sin(2 * phase) / 2)
    return rotor * (np.sin(angle) * (1 - stator * np.cos(phase)) + (1 - np.cos(angle)) * stator * np.sin(phase))


@pytest.mark.parametrize("fault", ["three_phase", "two_phase", "resynchronisation"])
def test_torques_are_those_of_the_formulas(nocdyn, fault):
    more = " ".join(f"{key}={value}" for key, value in TIMES.items()) + " transient_reactance=0.3"
    columns = columns_of(nocdyn, FAULT.format(fault=fault, more=more) + BODY)
    t, torque = columns["t [s]"], columns["torque_f [N m]"]
    x = np.maximum(t - 0.1, 0)
    rotor = (1 / SUBTRANSIENT - 1 / TRANSIENT) * np.exp(-x / 0.03) + np.exp(-x / 0.8) / TRANSIENT
    expected = np.where(t >= 0.1, -RATED * torque_of(fault, x, np.exp(-x / 0.15), rotor), 0)
    np.testing.assert_allclose(torque, expected, atol=1e-9 * RATED)
    assert np.abs(torque).max() > 3 * RATED


def test_without_time_constants_there_is_no_decay_and_the_peaks_are_the_known_ones(nocdyn):
    peaks = {"three_phase": 5.0, "two_phase": 5 * 0.75 * np.sqrt(3), "resynchronisation": 5 * (np.sqrt(0.75) + np.sqrt(3))}
    for fault, peak in peaks.items():
        columns_of(nocdyn, FAULT.format(fault=fault, more="") + BODY)
        summary = json.loads((nocdyn.folder / "results/machine/summary.json").read_text())
        assert -summary["columns"]["torque_f [N m]"]["min"] == pytest.approx(peak * RATED, rel=1e-6)


def test_given_terms_are_summed(nocdyn):
    text = (
        "&excitation name='f' body='b' kind='fault' term_amplitudes=30, -20, 5 term_multiples=1, 2, 0 term_times=0.1, 0.2, 0.3 "
        "term_phases_deg=10, 20, 90 frequency_hz=50 time=0.1 /\n"
    )
    columns = columns_of(nocdyn, text + BODY)
    t = columns["t [s]"]
    x = np.maximum(t - 0.1, 0)
    degree = np.pi / 180
    expected = 30 * np.exp(-x / 0.1) * np.sin(MAINS * x + 10 * degree) - 20 * np.exp(-x / 0.2) * np.sin(
        2 * MAINS * x + 20 * degree
    )
    expected += 5 * np.exp(-x / 0.3)
    np.testing.assert_allclose(columns["torque_f [N m]"], np.where(t >= 0.1, expected, 0), atol=1e-10)


def modal_twist(times, shaft):
    """The twist of a shaft of three masses at rest by a two-phase fault on the second: modes driven by decaying sines."""
    inertia, k = np.array(INERTIAS), STIFFNESSES
    stiffness = np.array([[k[0], -k[0], 0], [-k[0], k[0] + k[1], -k[1]], [0, -k[1], k[1]]])
    root = 1 / np.sqrt(inertia)
    squares, modes = np.linalg.eigh(root[:, None] * stiffness * root[None, :])
    shapes = root[:, None] * modes
    terms = [(1.0, 1, 1 / 0.15 + 1 / 0.4), (-0.5, 2, 1 / 0.4)]  # amplitude, multiple, rate: of -rated / reactance
    twist = np.zeros_like(times)
    for mode in (1, 2):  # the first one is rigid
        omega = np.sqrt(squares[mode])
        q = np.zeros_like(times)
        for amplitude, multiple, rate in terms:
            s = -rate + 1j * multiple * MAINS
            particular = -RATED / SUBTRANSIENT * amplitude * shapes[1, mode] / (s**2 + omega**2)
            q += np.imag(particular * np.exp(s * times))
            q -= np.imag(particular) * np.cos(omega * times) + np.imag(particular * s) / omega * np.sin(omega * times)
        twist += (shapes[shaft + 1, mode] - shapes[shaft, mode]) * q
    return twist


@pytest.mark.parametrize("method", ["rk853", "taylor", "rodas5p"])
def test_peak_torques_of_three_masses_are_those_of_the_modes(nocdyn, method):
    bodies = "".join(f"&body name='{name}' inertia={inertia} /\n" for name, inertia in zip("abc", INERTIAS, strict=True))
    more = "subtransient_time=0.4 armature_time=0.15"
    text = bodies + (
        f"&coupling name='s1' bodies='a', 'b' stiffness={STIFFNESSES[0]} /\n"
        f"&coupling name='s2' bodies='b', 'c' stiffness={STIFFNESSES[1]} /\n"
        + FAULT.format(fault="two_phase", more=more).replace("time=0.1 ", "time=0 ")
        + f"&run t_end=0.4 method='{method}' rtol=1e-11 atol=1e-13 /\n&output points=401 /\n"
    )
    columns = columns_of(nocdyn, text)
    summary = json.loads((nocdyn.folder / "results/machine/summary.json").read_text())["columns"]
    for shaft, name in enumerate(("s1", "s2")):
        moment = STIFFNESSES[shaft] * modal_twist(columns["t [s]"], shaft)
        np.testing.assert_allclose(columns[f"moment_{name} [N m]"], moment, atol=1e-8 * np.abs(moment).max())
        extremes = summary[f"moment_{name} [N m]"]
        for key in ("min", "max"):
            near = extremes[f"time_of_{key}"] + np.linspace(-2e-5, 2e-5, 4001)
            found = STIFFNESSES[shaft] * getattr(modal_twist(np.maximum(near, 0), shaft), key)()
            assert extremes[key] == pytest.approx(found, rel=1e-8)


LAWS = {
    "harmonic": ("amplitude=20 frequency=30 phase=0.5", lambda t: 20 * np.sin(30 * t + 0.5)),
    "orders": ("orders=1, 3 amplitudes=10, 5", lambda t: 10 * np.sin(4 * t) + 5 * np.sin(12 * t)),
    "table": ("table_time=0, 1 table_torque=5, 25", lambda t: 5 + 20 * t),
    "step": ("amplitude=7 time=0.05", lambda t: np.where(t >= 0.05, 7.0, 0.0)),
    "ramp": ("amplitude=7 time=0.05 duration=0.3", lambda t: 7 * np.clip((t - 0.05) / 0.3, 0, 1)),
    "pulse": (
        "amplitude=7 time=0.05 duration=0.4",
        lambda t: np.where(abs(t - 0.25) < 0.2, 7 * np.sin(np.pi * (t - 0.05) / 0.4), 0),
    ),
    "startup": ("amplitude=7 frequency=50 pole_pairs=2", lambda t: 7 * np.sin(2 * (50 * t - 2 * 4 * t))),
    "fault": (
        "term_amplitudes=4 term_multiples=1 frequency=50 time=0.05",
        lambda t: np.where(t > 0.05, 4 * np.sin(50 * t - 2.5), 0),
    ),
}


@pytest.mark.parametrize("kind", LAWS)
def test_every_excitation_has_a_start_an_end_and_a_decay(nocdyn, kind):
    keys, law = LAWS[kind]
    text = (
        "&body name='b' inertia=1 /\n&drive name='d' body='b' kind='speed' speed=4 /\n"
        f"&excitation name='e' body='b' kind='{kind}' {keys} start=0.1 end=0.3 decay=0.2 /\n"
        "&run t_end=0.5 /\n&output points=501 /\n"
    )
    columns = columns_of(nocdyn, text)
    t = columns["t [s]"]
    expected = np.where((t >= 0.1) & (t < 0.3), law(t) * np.exp(-(t - 0.1) / 0.2), 0)
    inside = np.minimum(abs(t - 0.1), abs(t - 0.3)) > 1e-9
    np.testing.assert_allclose(columns["torque_e [N m]"][inside], expected[inside], atol=1e-8)


def test_a_decay_begins_at_the_time_of_a_step(nocdyn):
    machine = "&body name='b' inertia=1 /\n&excitation name='e' body='b' kind='step' amplitude=9 time=0.4 decay=0.2 /\n"
    nocdyn.write("m.nml", machine + "&run t_end=1 /\n&output points=101 /\n")
    assert nocdyn("run", "m.nml", "--out", "out").returncode == 0
    header, rows = nocdyn.table("out")
    column = header.index("torque_e [N m]")
    for row in rows:
        if abs(row[0] - 0.4) > 1e-9:
            expected = 9 * np.exp(-(row[0] - 0.4) / 0.2) if row[0] > 0.4 else 0.0
            assert row[column] == pytest.approx(expected, rel=1e-12)


def test_torques_that_begin_after_the_run_are_noted(nocdyn):
    motor = "&motor name='m' body='b' kind='induction_dq' voltage=400 frequency_hz=50 poles=4 stator_resistance=0.4 "
    motor += (
        "rotor_resistance=0.3 stator_reactance=0.9 rotor_reactance=0.9 mutual_reactance=25 supply_times=5 supply_factors=1 /\n"
    )
    excitations = "&excitation name='e' body='b' kind='step' amplitude=9 time=2 /\n"
    excitations += "&excitation name='f' body='b' amplitude=9 frequency=5 start=1 /\n"
    nocdyn.write("m.nml", "&body name='b' inertia=1 /\n" + motor + excitations + "&run t_end=1 /\n")
    notes = [line for line in nocdyn("run", "m.nml", "--out", "out").stdout.splitlines() if ": note: " in line]
    assert notes == [
        "m.nml: note: motor 'm' is not connected in the run: its supply begins at t = 5 s",
        "m.nml: note: excitation 'e' has no torque in the run: it begins at t = 2 s",
        "m.nml: note: excitation 'f' has no torque in the run: it begins at t = 1 s",
    ]


def test_a_decay_alone_begins_with_the_run(nocdyn):
    text = (
        "&body name='b' inertia=1 /\n&excitation name='e' body='b' kind='step' amplitude=9 time=-5 decay=0.2 /\n"
        "&run t_start=2 t_end=3 /\n&output points=101 /\n"
    )
    columns = columns_of(nocdyn, text)
    np.testing.assert_allclose(columns["torque_e [N m]"], 9 * np.exp(-(columns["t [s]"] - 2) / 0.2), atol=1e-9)


def test_a_distant_start_does_not_overflow(nocdyn):
    keys = "amplitude=9 frequency=1 start=1e6 decay=1e-6"
    text = f"&body name='b' inertia=1 /\n&excitation name='e' body='b' {keys} /\n&run t_end=1 /\n"
    assert not np.any(columns_of(nocdyn, text)["torque_e [N m]"])


RESPONSE = (
    "&body name='a' inertia=2 /\n&body name='b' inertia=3 /\n&coupling name='c' bodies='a', 'b' stiffness=5000 damping=1 /\n"
    "&motor name='m' body='a' kind='constant' torque=40 /\n&load name='l' body='b' viscous=1 /\n"
    "&excitation name='e' body='b' kind='orders' orders=2 amplitudes=10 {window} /\n"
    "&response body='a' speed=10, 60 count=11 /\n&run t_end=1 /\n"
)


def test_excitations_that_end_have_no_part_in_the_response(nocdyn):
    peaks = []
    for window in ("", "start=0.5", "end=5", "decay=3"):
        nocdyn.write("r.nml", RESPONSE.format(window=window))
        done = nocdyn("response", "r.nml")
        if done.returncode == 0:
            with (nocdyn.folder / "results/r/response.csv").open() as file:
                header, *rows = csv.reader(file)
            peaks.append(max(float(row[next(i for i, h in enumerate(header) if h.startswith("half_range_"))]) for row in rows))
        else:
            peaks.append(0.0)
    assert peaks[0] > 0
    assert peaks == [peaks[0], peaks[0], 0.0, 0.0]


def test_the_response_notes_what_has_ended(nocdyn):
    fault = "&excitation name='f' body='b' kind='fault' term_amplitudes=4 term_multiples=1 frequency=50 time=0.5 /\n"
    nocdyn.write("r.nml", RESPONSE.format(window="") + fault)
    done = nocdyn("response", "r.nml")
    assert "note: excitation 'f' ends or decays, and has no part in the response" in done.stdout
    assert "excitation 'e' ends" not in done.stdout


def test_swept_faults_are_those_of_single_runs(nocdyn):
    machine = FAULT.format(fault="two_phase", more="armature_time=0.1 end=0.3") + BODY
    sweep = machine + (
        "&sweep design='grid' /\n&vary target='excitation.f.rated_torque' low=500 high=1500 count=3 /\n"
        "&vary target='excitation.f.time' low=0.1 high=0.2 count=2 /\n"
        "&vary target='excitation.f.end' low=0.25 high=0.3 count=2 /\n"
        "&record quantity='omega_b' statistic='final' /\n"
    )
    nocdyn.write("sweep.nml", sweep)
    done = nocdyn("sweep", "sweep.nml", "--csv")
    assert done.returncode == 0, done.stderr
    with (nocdyn.folder / "results/sweep/sweep.csv").open() as file:
        header, *rows = csv.reader(file)
    names = ("rated_torque", "time", "end")
    positions = [next(i for i, h in enumerate(header) if h.startswith(f"excitation.f.{name}")) for name in names]
    final = next(i for i, h in enumerate(header) if h.startswith("omega_b_final"))
    assert len(rows) == 12
    for row in rows[::5]:
        words = [w for name, i in zip(names, positions, strict=True) for w in ("--set", f"excitation.f.{name}={row[i]}")]
        single = columns_of(nocdyn, machine, *words)
        assert float(row[final]) == pytest.approx(single["omega_b [rad/s]"][-1], rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            "fault='two_phase' rated_torque=1 subtransient_reactance=0.2 frequency=300 time=-0.5",
            "bad.nml:1: &excitation 'f': time = -0.5 is before the run; allowed: >= t_start = 0 [s]",
        ),
        (
            "fault='two_phase' rated_torque=1 subtransient_reactance=0.2 transient_reactance=0.1 frequency=300 time=0",
            "bad.nml:1: &excitation 'f': transient_reactance = 0.1; allowed: >= subtransient_reactance = 0.2",
        ),
        ("frequency=300 time=0", "fault"),
        (
            "fault='two_phase' rated_torque=1 subtransient_reactance=0.2 frequency=0 time=0",
            "frequency = 0; allowed with kind = 'fault'",
        ),
        (
            "fault='two_phase' rated_torque=1 subtransient_reactance=0.2 frequency=300 time=0 angle_deg=90",
            "angle_deg needs fault = 'resynchronisation'",
        ),
        ("fault='two_phase' rated_torque=1 subtransient_reactance=0.2 frequency=300 time=0.2 end=0.1", "end = 0.1"),
        ("fault='two_phase' rated_torque=1 frequency=300 time=0", "subtransient_reactance"),
        ("fault='four_phase' rated_torque=1 subtransient_reactance=0.2 frequency=300 time=0", "'four_phase'"),
        (
            "fault='two_phase' rated_torque=1 subtransient_reactance=0.2 armature_time=0 frequency=300 time=0",
            "armature_time = 0",
        ),
        ("term_amplitudes=1, 2 term_multiples=1 frequency=300 time=0", "term_multiples"),
        (
            "term_amplitudes=1, 2 term_multiples=1, 2 term_phases=1 frequency=300 time=0",
            "bad.nml:1: &excitation 'f': term_phases has 1 value and term_amplitudes has 2 values; needed: as many of each",
        ),
        ("term_amplitudes=1 frequency=300 time=0", "term_multiples"),
        ("term_amplitudes=1 term_multiples=1 fault='two_phase' frequency=300 time=0", "fault"),
        ("term_amplitudes=1 term_multiples=1 term_times=0 frequency=300 time=0", "term_times"),
        ("term_amplitudes=1 term_multiples=1 frequency=300 time=0 start=2 end=1", "start = 2"),
        ("term_amplitudes=1 term_multiples=1 frequency=300 time=0 decay=0", "decay = 0"),
    ],
)
def test_faults_that_do_not_fit_are_refused(nocdyn, keys, message):
    nocdyn.write("bad.nml", f"&excitation name='f' body='b' kind='fault' {keys} /\n" + BODY)
    for command in ("run", "check"):
        done = nocdyn(command, "bad.nml")
        assert done.returncode == 2
        assert message in done.stderr
