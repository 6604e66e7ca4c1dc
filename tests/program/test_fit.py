"""nocdyn fit: the optimum against an independent least squares, what cannot be told apart, bounds, priors, refusals."""

import json

import numpy as np
import pytest

MACHINE = """\
&body name = 'motor' inertia = 2 speed = 0 /
&body name = 'mid' inertia = {mid!r} /
&body name = 'fan' inertia = 3 /
&coupling name = 'a' bodies = 'motor', 'mid' stiffness = {a!r} damping = {c!r} /
&coupling name = 'b' bodies = 'mid', 'fan' stiffness = {b!r} damping = 1 /
&load name = 'drag' body = 'fan' viscous = {v!r} /
&excitation name = 'step' body = 'motor' kind = 'step' amplitude = 20 time = 0.1 /
&run t_end = 2 /
&output points = 11 /
"""
TRUE = {"a": 2000.0, "b": 3500.0, "c": 1.5, "v": 0.8, "mid": 1.0}
START = {"a": 1800.0, "b": 3800.0, "c": 2.0, "v": 1.0, "mid": 1.1}
PATHS = {
    "a": "coupling.a.stiffness",
    "b": "coupling.b.stiffness",
    "c": "coupling.a.damping",
    "v": "load.drag.viscous",
    "mid": "body.mid.inertia",
}
TIMES = np.linspace(0, 2, 1001)
SIGNALS = ("omega_motor", "omega_fan", "total_moment_b")


def system(x):
    """The matrix of the linear machine: speeds and twists as states."""
    a, b, c, v, mid = x
    inertia = [2.0, mid, 3.0]
    matrix = np.zeros((5, 5), dtype=np.result_type(a, b, c, v, mid))  # omega motor, mid, fan, twists motor - mid, mid - fan
    for first, (k, d) in enumerate(((a, c), (b, 1.0))):
        for row, sign in ((first, -1), (first + 1, 1)):
            matrix[row, first] += sign * d / inertia[row]
            matrix[row, first + 1] -= sign * d / inertia[row]
            matrix[row, 3 + first] += sign * k / inertia[row]
        matrix[3 + first, first] = 1
        matrix[3 + first, first + 1] = -1
    matrix[2, 2] -= v / 3.0
    return matrix


def exact(x):
    """The signals by the eigenvalues of the linear machine."""
    b, matrix = x[1], system(x)
    values, vectors = np.linalg.eig(matrix)
    parts = np.linalg.solve(vectors, np.array([20 / 2.0, 0, 0, 0, 0], dtype=complex)) / values
    late = np.maximum(TIMES - 0.1, 0)
    states = vectors @ (parts[:, None] * (np.exp(values[:, None] * late) - 1))
    moment = -(b * states[4] + 1.0 * (states[1] - states[2]))
    return np.array([states[0], states[2], moment])


def optimum(residuals, start):
    """Gauss-Newton with central differences of the exact solution."""
    x = np.array(start)

    for _ in range(30):
        r = residuals(x)
        steps = 1e-4 * np.abs(x)
        columns = []
        for k, step in enumerate(steps):
            ends = [residuals(x + n * step * np.eye(len(x))[k]) for n in (-2, -1, 1, 2)]
            columns.append((ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step))
        jacobian = np.array(columns).T
        step = np.linalg.lstsq(jacobian, -r, rcond=None)[0]
        x = x + step
        if np.all(np.abs(step) < 1e-11 * np.abs(x)):
            break
    return x, np.linalg.inv(jacobian.T @ jacobian)


def fit(nocdyn, text, *words):
    outcome = nocdyn("fit", nocdyn.write("machine.nml", text), "--out", "out", *words)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / "out/fit.json").read_text()), outcome.stdout


def unknowns(**bounds):
    return "".join(f"&unknown target = '{PATHS[key]}' {text} /\n" for key, text in bounds.items())


def record(nocdyn, seed=3, noise=0.02):
    values = exact([TRUE[key] for key in PATHS]).real
    deviations = noise * np.std(values, axis=1)
    measured = values + deviations[:, None] * np.random.default_rng(seed).standard_normal(values.shape)
    rows = "".join(",".join(repr(float(v)) for v in row) + "\n" for row in np.array([TIMES, *measured]).T)
    nocdyn.write("record.csv", "t [s]," + ",".join(SIGNALS) + "\n" + rows)
    text = "".join(
        f"&measurement name = 'm_{signal}' signal = '{signal}' file = 'record.csv'\n"
        f"  column = '{signal}' deviation = {float(d)!r} /\n"
        for signal, d in zip(SIGNALS, deviations, strict=True)
    )
    return text, measured, deviations


def test_the_optimum_is_that_of_an_independent_least_squares(nocdyn):
    text, measured, deviations = record(nocdyn)
    wide = {key: f"low = {0.5 * value} high = {2 * value}" for key, value in TRUE.items()}
    report, printed = fit(nocdyn, MACHINE.format(**START) + text + unknowns(**{key: wide[key] for key in PATHS}))
    assert report["has_converged"]
    best, covariance = optimum(lambda x: ((exact(x).real - measured) / deviations[:, None]).ravel(), [TRUE[key] for key in PATHS])
    freedoms = measured.size - len(PATHS)
    factor = report["sum_of_squares"] / freedoms
    for k, one in enumerate(report["unknowns"]):
        error = np.sqrt(covariance[k, k])
        assert one["target"] == list(PATHS.values())[k]
        assert abs(one["fitted"] - best[k]) <= 1e-5 * error, one["target"]
        assert one["standard_error"] == pytest.approx(np.sqrt(factor) * error, rel=1e-4)
        assert abs(one["fitted"] - list(TRUE.values())[list(TRUE).index(list(PATHS)[k])]) < 5 * error
    assert 0.8 < factor < 1.2
    assert "coupling.a.stiffness and coupling.b.stiffness are hardly told apart" in printed
    # the fitted input does the same again
    nocdyn("run", "out/fitted.nml", "--out", "again")
    again = {m["name"]: m for m in nocdyn.summary("again")["measurements"]}
    for measurement in report["measurements"]:
        assert again[measurement["name"]]["spread"] == pytest.approx(measurement["spread"], rel=1e-4)


@pytest.mark.parametrize("deviation", [None, 0.002])
def test_frequencies_and_damping_ratios_are_fitted_together(nocdyn, deviation):
    """Two modes have four numbers; without a deviation of its own, a damping ratio is as exact as a relative frequency."""
    lowest = 20  # [rad/s], above the rigid body's rate

    def modes(x):
        values = np.sort_complex(np.array([one for one in np.linalg.eigvals(system(x)) if one.imag > lowest]) * -1j) * 1j
        return values.imag, -values.real / np.abs(values)

    frequencies, dampings = modes([TRUE[key] for key in PATHS])
    frequencies, dampings = frequencies * [1.004, 0.997], dampings * [1.15, 0.9]
    keys = f"damping_deviation = {deviation}" if deviation else ""
    text = (
        f"&measurement name = 'impact' kind = 'frequency' frequency = {', '.join(map(repr, frequencies.tolist()))}\n"
        f"  relative_damping = {', '.join(map(repr, dampings.tolist()))} deviation = 0.004 {keys} /\n"
    )
    names = ("a", "c", "mid")
    wide = {key: f"low = {0.5 * TRUE[key]} high = {2 * TRUE[key]}" for key in names}
    report, printed = fit(nocdyn, MACHINE.format(**TRUE) + text + unknowns(**wide))
    assert report["values"] == 4

    def residuals(some):
        found = modes([dict(zip(names, some)).get(key, value) for key, value in zip(PATHS, (TRUE[key] for key in PATHS))])
        relative = (found[0] - frequencies) / frequencies / 0.004
        return np.concatenate([relative, (found[1] - dampings) / (deviation or 0.004)])

    best, covariance = optimum(residuals, [TRUE[key] for key in names])
    factor = report["sum_of_squares"] / (4 - len(names))
    for k, one in enumerate(report["unknowns"]):
        error = np.sqrt(covariance[k, k])
        assert abs(one["fitted"] - best[k]) <= 1e-5 * error, one["target"]
        assert one["standard_error"] == pytest.approx(np.sqrt(factor) * error, rel=1e-4)
    (member,) = report["measurements"]
    difference = modes([dict(zip(names, best)).get(key, TRUE[key]) for key in PATHS])[1] - dampings
    assert member["damping_bias"] == pytest.approx(difference.mean(), rel=1e-3, abs=1e-6)
    assert "impact, damping ratios" in printed


def test_values_before_and_after_are_written(nocdyn):
    text, measured, _ = record(nocdyn)
    report, _ = fit(nocdyn, MACHINE.format(**START) + text + unknowns(a="low = 1000 high = 4000"))
    assert [one["file"] for one in report["measurements"]] == [f"fit_m_{signal}.csv" for signal in SIGNALS]
    table = np.genfromtxt(nocdyn.folder / "out/fit_m_omega_fan.csv", delimiter=",", names=True, deletechars="")
    assert table.dtype.names == ("t_[s]", *(f"{word}_[rad/s]" for word in ("measured", "before", "computed", "difference")))
    assert table["measured_[rad/s]"] == pytest.approx(measured[1])
    before = exact([START[key] for key in PATHS]).real[1]
    after = exact([report["unknowns"][0]["fitted"], *(START[key] for key in list(PATHS)[1:])]).real[1]
    assert table["before_[rad/s]"] == pytest.approx(before, abs=1e-7)
    assert table["computed_[rad/s]"] == pytest.approx(after, abs=1e-7)


GEARED = MACHINE + (
    "&body name = 'wheel' inertia = 0.7 /\n&gear name = 'pair' bodies = 'mid', 'wheel' radii = 1, 1 internal = .true. /\n"
)


def test_what_cannot_be_told_apart_is_named(nocdyn):
    text, _, _ = record(nocdyn)
    two = (
        "&unknown target = 'body.mid.inertia' low = 0.1 high = 2 /\n&unknown target = 'body.wheel.inertia' low = 0.1 high = 2 /\n"
    )
    numbers = TRUE | {"mid": 0.5}
    report, printed = fit(nocdyn, GEARED.format(**numbers) + text + two)
    assert "cannot be told apart: 'body.mid.inertia', 'body.wheel.inertia': only their sum is determined" in printed
    assert [one["is_determined"] for one in report["unknowns"]] == [False, False]
    assert sum(one["fitted"] for one in report["unknowns"]) == pytest.approx(TRUE["mid"], rel=2e-3)


def test_a_number_without_effect_is_named(nocdyn):
    text, _, _ = record(nocdyn)
    idle = "&body name = 'idle' inertia = 1 /\n&unknown target = 'body.idle.inertia' low = 0.5 high = 2 /\n"
    _, printed = fit(nocdyn, MACHINE.format(**TRUE) + text + idle + unknowns(v="low = 0.1 high = 2"))
    assert "no measurement depends on body.idle.inertia" in printed


def test_bounds_hold_and_are_said(nocdyn):
    text, _, _ = record(nocdyn)
    report, printed = fit(nocdyn, MACHINE.format(**TRUE | {"v": 1.0}) + text + unknowns(v="low = 0.9 high = 2"))
    assert report["unknowns"][0]["fitted"] == 0.9
    assert report["unknowns"][0]["is_at_bound"]
    assert "load.drag.viscous is at its bound" in printed


def test_unknowns_at_bounds_are_no_numbers_without_effect(nocdyn):
    text, _, _ = record(nocdyn)
    two = unknowns(a="low = 2100 high = 3000", c="low = 0.1 high = 0.5", v="low = 0.1 high = 2")
    report, printed = fit(nocdyn, MACHINE.format(**TRUE) + text + two)
    assert [(one["is_determined"], one["is_at_bound"]) for one in report["unknowns"]] == [
        (True, True),
        (True, True),
        (True, False),
    ]
    assert "no measurement depends on" not in printed
    assert "cannot be told apart" not in printed
    assert "coupling.a.stiffness = 2000 of the input is not between low and high: it begins at 2100" in printed


def test_one_number_for_several_is_said(nocdyn):
    text, _, _ = record(nocdyn)
    one = "&unknown target = 'coupling.*.stiffness' low = '1 kN m/rad' high = '5 kN m/rad' /\n"
    report, printed = fit(nocdyn, MACHINE.format(**TRUE) + text + one)
    assert "coupling.*.stiffness has several values in the input, of which the first, 2000, is shown" in printed
    assert (report["unknowns"][0]["low"], report["unknowns"][0]["high"]) == (1000, 5000)


def test_what_is_left_out_is_said(nocdyn):
    text, measured, _ = record(nocdyn)
    machine = MACHINE.format(**TRUE) + text + unknowns(v="low = 0.1 high = 2")
    report, printed = fit(nocdyn, machine, "--set", "run.t_end=1.5")
    outside = int(np.count_nonzero(TIMES > 1.5))
    assert f"'m_omega_fan': left out: {outside} values where nothing was computed, 0 gaps of the file" in printed
    assert report["values"] == measured.size - 3 * outside
    outcome = nocdyn("fit", "machine.nml", "--out", "none", "--set", "measurement.m_omega_fan.from=5")
    assert outcome.returncode == 2
    assert "&measurement 'm_omega_fan': none of its values is where something is computed" in outcome.stderr
    assert not (nocdyn.folder / "none").exists()


def test_a_prior_pulls(nocdyn):
    """With a prior as narrow as the data, the mean of both."""
    text, _, _ = record(nocdyn)
    machine = MACHINE.format(**TRUE | {"v": 1.0}) + text
    free, _ = fit(nocdyn, machine + unknowns(v="low = 0.1 high = 2"))
    one = free["unknowns"][0]
    error = one["standard_error"] / (free["sum_of_squares"] / (free["values"] - 1)) ** 0.5
    prior = one["fitted"] + 4 * error
    pulled, _ = fit(nocdyn, machine + unknowns(v=f"low = 0.1 high = 2 prior = {prior!r} deviation = {error!r}"))
    assert pulled["unknowns"][0]["fitted"] == pytest.approx(one["fitted"] + 2 * error, abs=0.02 * error)


@pytest.mark.parametrize(
    ("addition", "message"),
    [
        ("", "there is no group &unknown"),
        ("&unknown target = 'coupling.a.stifness' low = 1 high = 2 /\n", "did you mean"),
        ("&unknown target = 'coupling.a.stiffness' low = 2 high = 1 /\n", "low"),
        ("&unknown target = 'coupling.a.stiffness' low = 100 high = 200 start = 300 /\n", "start = 300 is out of range"),
        ("&unknown target = 'body.mid.inertia' low = -1 high = 2 /\n", "low: body.mid.inertia = -1"),
        ("&unknown target = 'coupling.a.stiffness' low = 100 high = 200 prior = 150 /\n", "deviation"),
        (2 * "&unknown target = 'coupling.a.stiffness' low = 100 high = 200 /\n", "is the unknown 1 already"),
    ],
)
def test_refusals(nocdyn, addition, message):
    text, _, _ = record(nocdyn)
    outcome = nocdyn("fit", nocdyn.write("machine.nml", MACHINE.format(**TRUE) + text + addition), "--out", "out")
    assert outcome.returncode == 2
    assert message in outcome.stderr
    assert not (nocdyn.folder / "out/fitted.nml").exists()


def test_without_measurements(nocdyn):
    outcome = nocdyn(
        "fit", nocdyn.write("machine.nml", MACHINE.format(**TRUE) + unknowns(v="low = 0.1 high = 2")), "--out", "out"
    )
    assert outcome.returncode == 2
    assert "there is no group &measurement" in outcome.stderr
