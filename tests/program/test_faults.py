"""Electrical faults and excitations with a start, an end or a decay: closed forms of torques and of the motion they cause."""

import csv
import json

import numpy as np
import pytest

MAINS = 2 * np.pi * 50
RATED, SUBTRANSIENT = 1000.0, 0.2
TIMES = {"subtransient_time": 0.03, "transient_time": 0.8, "armature_time": 0.15}
FAULT = (
    "&excitation name='f' body='b' kind='fault' fault='{fault}' rated_torque=1000 subtransient_reactance=0.2 frequency_hz=50 "
    "time=0.1 {more} /\n"
)
BODY = "&body name='b' inertia=5 /\n&run t_end=0.5 /\n&output points=501 /\n"
GIVEN = (  # decays of the rotor's flux, 0.4 s, and of the stator's, 0.15 s
    "&excitation name='f' body='b' kind='fault' frequency_hz=50 time=0 term_amplitudes=-5000, 2500 term_multiples=1, 2 "
    f"term_times={1 / (1 / 0.4 + 1 / 0.15)!r}, 0.4 /\n"
)
INERTIAS, STIFFNESSES = (40.0, 25.0, 8.0), (2.0e6, 3.0e5)


def columns_of(nocdyn, text, *words):
    nocdyn.write("machine.nml", text)
    done = nocdyn("run", "machine.nml", *words)
    assert (done.returncode, done.stderr) == (0, "")
    with (nocdyn.folder / "results/machine/trajectory.csv").open() as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def circuits_of(subtransient, transient, synchronous, times):
    """Shares of the admittance and time constants of the rotor's circuits: Y(p) = 1/x'' - sum of share / (1 + p T)."""
    parts = [1 / x if x else 0 for x in (subtransient, transient, synchronous)]
    if not transient:
        return [(parts[0] - parts[2], times["subtransient_time"])]
    return [(parts[0] - parts[1], times["subtransient_time"]), (parts[1] - parts[2], times["transient_time"])]


def simulated(fault, times, subtransient, circuits, armature, angle=2 * np.pi / 3, turn=np.pi / 2):
    """The braking torque per unit in the frame of the stator, by Runge-Kutta steps: fluxes of the stator and of the rotor."""

    def parts(t, y):
        wave = np.exp(1j * (MAINS * t + (turn if fault == "two_phase" else 0)))
        psi, rotor = y[0], y[1:]
        from_rotor = sum(s * (z * wave) for (s, _), z in zip(circuits, rotor, strict=True))  # z in the frame of the rotor
        if fault == "two_phase":  # no current in the open phase gives the flux of that axis
            psi = (wave + subtransient * from_rotor).real + 1j * psi.imag
        return wave, psi, (psi - wave) / subtransient - from_rotor

    def rates(t, y):
        wave, psi, current = parts(t, y)
        voltage = 1j * MAINS * np.exp(1j * (MAINS * t - angle)) if fault == "resynchronisation" else 0
        stator = voltage - subtransient / armature * current
        change = psi / wave - 1
        rotor = [(change - z) / time for (_, time), z in zip(circuits, y[1:], strict=True)]
        return np.array([1j * stator.imag if fault == "two_phase" else stator, *rotor])

    h = times[1] - times[0]
    y = np.zeros(1 + len(circuits), dtype=complex)
    y[0] = 1j if fault == "two_phase" else 1
    torques = []
    for t in times:
        _, psi, current = parts(t, y)
        torques.append((psi * current.conjugate()).imag)
        k1 = rates(t, y)
        k2 = rates(t + h / 2, y + h / 2 * k1)
        k3 = rates(t + h / 2, y + h / 2 * k2)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(t + h, y + h * k3))
    return np.array(torques)


@pytest.mark.parametrize("fault", ["three_phase", "two_phase", "resynchronisation"])
@pytest.mark.parametrize("reactances", [(0.2, 0.3, 1.8), (0.2, None, None), (0.15, None, 1.9)])
def test_torques_are_those_of_the_fluxes(nocdyn, fault, reactances):
    keys = ("subtransient_reactance", "transient_reactance", "synchronous_reactance")
    given = {key: x for key, x in zip(keys, reactances, strict=True) if x}
    more = TIMES if reactances[1] else {key: x for key, x in TIMES.items() if key != "transient_time"}
    text = " ".join(f"{key}={x}" for key, x in (given | more).items())
    machine = FAULT.replace("subtransient_reactance=0.2 ", "").format(fault=fault, more=text)
    columns = columns_of(nocdyn, machine + BODY)
    t, torque = columns["t [s]"], columns["torque_f [N m]"]
    steps = np.arange(4001) * 1e-4
    expected = simulated(fault, steps, reactances[0], circuits_of(*reactances, TIMES), TIMES["armature_time"])
    np.testing.assert_allclose(torque[t > 0.0999], -RATED * expected[::10], atol=2e-5 * RATED / reactances[0])
    assert not np.any(torque[t < 0.0999])


def test_peaks_have_the_mean_torques_of_the_resistances(nocdyn):
    """The first flux models of a machine with one circuit in each axis, by another program: 8501 and 6204 N m."""
    keys = "time=0 rated_torque=1000 subtransient_reactance=0.150749 frequency_hz=50 subtransient_time=0.03 armature_time=0.15"
    for fault, peak, remaining in (("two_phase", 8501, 8506), ("three_phase", 6204, 6172)):
        for more, expected in (("synchronous_reactance=1.81", peak), ("", remaining)):
            text = f"&excitation name='f' body='b' kind='fault' fault='{fault}' {keys} {more} /\n"
            columns_of(nocdyn, "&body name='b' inertia=1e6 speed=157.08 /\n" + text + "&run t_end=0.05 /\n")
            summary = json.loads((nocdyn.folder / "results/machine/summary.json").read_text())
            assert -summary["columns"]["torque_f [N m]"]["min"] == pytest.approx(expected, abs=0.6)


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
    text = bodies + (
        f"&coupling name='s1' bodies='a', 'b' stiffness={STIFFNESSES[0]} /\n"
        f"&coupling name='s2' bodies='b', 'c' stiffness={STIFFNESSES[1]} /\n"
        + GIVEN
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
            "fault='two_phase' rated_torque=1 subtransient_reactance=0.2 transient_reactance=0.3 synchronous_reactance=0.25 "
            "frequency=300 time=0",
            "bad.nml:1: &excitation 'f': synchronous_reactance = 0.25; allowed: >= transient_reactance = 0.3",
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
