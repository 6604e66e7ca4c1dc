"""Waterfalls: amplitudes of chirps whose orders are known, what is drawn of measured and computed run-ups, and refusals."""

import numpy as np
import pytest
from figure_files import assert_figures, call, refusal
from nocdyn_report import waterfall_figures
from nocdyn_report.failure import ChoiceError
from nocdyn_report.waterfalls import frequency_waterfall, order_waterfall, sampled_at

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit

TIMES = np.arange(0, 20, 5e-4)
SPEEDS = 2 * np.pi / 60 * (300 + 1200 * TIMES / 20)
ANGLES = 2 * np.pi / 60 * (300 * TIMES + 1200 * TIMES**2 / 40)
CHIRP = 3 + 5 * np.sin(ANGLES) + 0.1 * SPEEDS * np.sin(2 * ANGLES + 1) + 2 * np.cos(2.5 * ANGLES)

RUN_UP = """&case title = 'Bench' /
&body name = 'a' inertia = 1.0 speed_rpm = 200 /
&body name = 'b' inertia = 2.0 speed_rpm = 200 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 1e4 damping = 4.0 /
&excitation name = 'e' body = 'a' kind = 'orders' orders = 2 amplitudes = 5 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 30 /
&run t_end = 8 /
&output points = 4001 /
"""


def at(one, line):
    return one.amplitudes[:, np.abs(one.lines - line).argmin()]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("is_down", [False, True])
def test_orders_of_a_chirp_have_their_amplitudes(sign, is_down):
    times, values, speeds = TIMES, CHIRP, SPEEDS
    if is_down:
        times, values, speeds = TIMES[-1] - TIMES[::-1], CHIRP[::-1], SPEEDS[::-1]
    one = order_waterfall(times, values, sign * speeds)
    assert len(one.speeds) > 60 and np.all(np.diff(one.speeds) > 0)
    assert one.speeds[0] < 45 and one.speeds[-1] > 145
    assert at(one, 1) == pytest.approx(5.0, rel=5e-3)
    assert at(one, 2) == pytest.approx(0.1 * one.speeds, rel=5e-3)
    assert at(one, 2.5) == pytest.approx(2.0, rel=5e-3)
    others = (np.abs(one.lines[:, None] - [0, 1, 2, 2.5]) > 0.2).all(axis=1)
    assert one.amplitudes[:, others].max() < 0.02


def test_an_order_above_the_lines_has_no_alias():
    one = order_waterfall(TIMES, 5 * np.sin(ANGLES) + 2 * np.sin(30 * ANGLES), SPEEDS)
    assert one.lines[-1] < 30
    assert one.amplitudes[:, np.abs(one.lines - 1) > 0.2].max() < 0.02


def test_frequencies_of_a_chirp_lie_on_the_lines_of_its_orders():
    one = frequency_waterfall(TIMES, 5 * np.sin(2 * ANGLES), SPEEDS)
    ridge = one.lines[one.amplitudes.argmax(axis=1)]
    assert ridge == pytest.approx(2 * one.speeds / (2 * np.pi), abs=one.lines[1])
    assert 4 < one.amplitudes.max() <= 5.0 + 1e-6


def test_lines_that_the_record_cannot_tell_are_left_out():
    one = order_waterfall(TIMES[::20], CHIRP[::20], SPEEDS[::20])
    assert one.lines[-1] <= 2 * np.pi / (4 * 0.01 * SPEEDS[-1]) < one.lines[-1] + 1 / 8


def test_cubic_polynomials_are_sampled_exactly():
    x = np.sort(np.random.default_rng(1).uniform(0, 1, 12))
    between = np.linspace(x[0], x[-1], 50)
    assert sampled_at(x, x**3 - x, between) == pytest.approx(between**3 - between, abs=1e-12)


@pytest.mark.parametrize(
    ("speeds", "words"),
    [(0 * SPEEDS + 50, "no run-up"), (SPEEDS - 60, "changes its sign"), (SPEEDS / 100, "too short for a waterfall")],
)
def test_what_is_no_run_up_is_refused(speeds, words):
    with pytest.raises(ChoiceError, match=words):
        order_waterfall(TIMES, CHIRP, speeds)


def test_a_measured_run_up_is_drawn_beside_the_computed_one(nocdyn, monkeypatch):
    nocdyn("run", nocdyn.write("m.nml", RUN_UP), "--out", "ref")
    record = "&measurement name = '{}' signal = '{}' file = 'ref/trajectory.csv' column = '{}' {} /\n"
    groups = record.format("g", "total_moment_c", "total_moment_c", "scale = 2")
    groups += record.format("n", "omega_a", "omega_a", "")
    outcome = nocdyn("run", nocdyn.write("m.nml", RUN_UP + groups), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    figure = waterfall_figures.measured_waterfalls(nocdyn.folder / "out", "Bench")["waterfall_g"]
    titles = [axes.get_title() for axes in figure.axes[:4]]
    assert titles == ["measured", "computed", "", ""]
    measured, computed = (axes.collections[0].get_array() for axes in figure.axes[2:4])
    large = computed > 0.1 * computed.max()
    assert np.asarray(measured[large]) == pytest.approx(2 * np.asarray(computed[large]), rel=1e-6)
    assert [text.get_text().strip() for text in figure.axes[0].texts] == ["2"]
    folder = nocdyn.folder / "out"
    call(monkeypatch, "run_figures", folder, "--waterfall", "total_moment_*", "--speed", "A", "--format", "png")
    assert_figures(folder / "figures", "waterfall_total_moment_c", formats=("png",))
    for words, message in (
        (("--waterfall", "total_moment_c", "--speed", "x"), "no speed of 'x'; there are: a, b"),
        (("--waterfall", "total_moment_c", "--to", "0.5"), "total_moment_c over omega_a: "),
        (("--waterfall", "nothing"), "no column matches 'nothing'"),
    ):
        assert message in refusal(monkeypatch, "run_figures", folder, *words)
    assert refusal(monkeypatch, "run_figures", folder, "--speed", "a") == 2
    assert refusal(monkeypatch, "run_figures", folder, "--waterfall", "phi_a", "--columns", "phi_a") == 2
