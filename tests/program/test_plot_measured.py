"""nocdyn plot of results that have measurements: what is in the figures."""

import json

import pandas as pd
import pytest
from figure_files import assert_figures, call
from nocdyn_report import measured_figures
from nocdyn_report.comparisons import read_comparisons

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit

BENCH = """&case title = 'Bench $' /
&body name = 'a' inertia = 1.0 speed_rpm = 300 /
&body name = 'b' inertia = 2.0 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 1e4 damping = 4.0 /
&load name = 'l' body = 'b' quadratic = 0.05 /
&excitation name = 'e' body = 'a' kind = 'orders' orders = 1, 2 amplitudes = 10, 5 /
&motor name = 'm' body = 'a' kind = 'constant' torque = 100 /
&response body = 'a' speed_rpm = 200, 1400 count = 40 /
&run t_end = 0.5 /
"""


def compute(nocdyn, command, groups):
    outcome = nocdyn(command, nocdyn.write("m.nml", BENCH + groups), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    return nocdyn.folder / "out"


def test_measured_frequencies_are_drawn_beside_the_modes(nocdyn, monkeypatch):
    group = "&measurement name = 'impact' kind = 'frequency' frequency_hz = 19.2 relative_damping = {} /\n"
    folder = compute(nocdyn, "modes", group.format(0.021))
    (mode,) = (one for one in json.loads((folder / "modes.json").read_text())["modes"] if one["kind"] == "oscillating")
    (one,) = read_comparisons(folder, "modes.json")
    figure = measured_figures.draw_frequencies(one, "Bench")
    heights = [[bar.get_height() for bar in axes.patches] for axes in figure.axes]
    assert heights == [[pytest.approx(19.2), pytest.approx(mode["frequency_Hz"])], [0.021, pytest.approx(mode["damping_ratio"])]]
    assert figure.axes[0].texts[0].get_text() == f"{100 * (mode['frequency_Hz'] / 19.2 - 1):+.2g} %"
    call(monkeypatch, "mode_figures", folder, "--format", "svg")
    assert_figures(folder / "figures", "modes", "measured_impact", formats=("svg",))


def test_measured_orders_are_points_over_the_speed_in_rpm(nocdyn):
    group = "&measurement name = 'o' kind = 'order' order = 2 signal = 'total_moment_c' speeds_rpm = 300, 600 values = 4, 70 /\n"
    figures = measured_figures.measured_figures(compute(nocdyn, "response", group), "response.json", "Bench")
    measured, computed = figures["measured_o"].axes[0].lines
    assert measured.get_xdata() == pytest.approx([300, 600]) and measured.get_linestyle() == "None"
    assert list(measured.get_ydata()) == [4, 70]
    table = pd.read_csv(nocdyn.folder / "out/measured_o.csv")
    assert list(computed.get_ydata()) == pytest.approx(list(table["computed [N m]"]))
