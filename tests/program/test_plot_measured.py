"""nocdyn plot of results that have measurements: what is in the figures."""

import json

import pandas as pd
import pytest
from figure_files import assert_figures, call, refusal
from nocdyn_report import fit_figures, measured_figures
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
    lower = figures["measured_o"].axes[1]
    assert lower.get_xlabel() == "speed of a [rpm]"
    legend = [text.get_text() for text in figures["measured_o"].axes[0].get_legend().get_texts()]
    assert legend == ["measured", "computed", "below: bias, their mean difference"]
    assert lower.lines[0].get_ydata()[0] == pytest.approx((computed.get_ydata() - measured.get_ydata()).mean())
    assert list(computed.get_ydata()) == pytest.approx(list(table["computed [N m]"]))


FITTED = """
&measurement name = 'g' signal = 'total_moment_c' times = 0, 0.1, 0.2, 0.3 values = 0, -60, -70, -65 deviation = 4 /
&measurement name = 'o' kind = 'order' order = 2 signal = 'total_moment_c' speeds_rpm = 300, 600 values = 4, 70 /
&measurement name = 'p' kind = 'peak' signal = 'total_moment_c' speed_rpm = 400 values = 30 /
&measurement name = 'f' kind = 'frequency' frequency_hz = 19.2 relative_damping = 0.021 deviation = 0.01 /
&unknown target = 'coupling.c.stiffness' low = 5e3 high = 2e4 /
&unknown target = 'coupling.c.damping' low = 1 high = 10 /
"""


def test_a_fit_is_drawn(nocdyn, monkeypatch):
    folder = compute(nocdyn, "fit", FITTED)
    report = json.loads((folder / "fit.json").read_text())
    figures = fit_figures.draw_all(folder)
    names = ["fit_g", "fit_o", "fit_p", "fit_f", "fit_unknowns", "fit_correlations"]
    assert list(figures) == names
    table = pd.read_csv(folder / "fit_g.csv")
    upper, lower = figures["fit_g"].axes
    drawn = [list(line.get_ydata()) for line in upper.lines]
    assert drawn == [pytest.approx(list(table[f"{word} [N m]"])) for word in ("measured", "before", "computed")]
    assert list(lower.lines[1].get_ydata()) == pytest.approx(list(table["difference [N m]"]))
    legend = [text.get_text() for text in upper.get_legend().get_texts()]
    assert legend[-1] == "below: ± 2 standard deviations of the measurement" and lower.get_legend() is None
    assert figures["fit_o"].axes[1].get_xlabel() == "speed of a [rpm]"
    frequencies, dampings = ([bar.get_height() for bar in axes.patches] for axes in figures["fit_f"].axes)
    assert frequencies[0] == pytest.approx(19.2) and len(frequencies) == 3 and dampings[0] == 0.021
    left, right = figures["fit_unknowns"].axes
    stiffness = report["unknowns"][0]
    assert left.lines[2].get_xdata()[0] == pytest.approx((stiffness["fitted"] - 5e3) / 1.5e4)
    ends = right.containers[0].lines[1][0].get_xdata()[0], right.containers[0].lines[1][1].get_xdata()[0]
    half = 100 * 1.959963984540054 * stiffness["standard_error"] / stiffness["fitted"]
    assert ends == pytest.approx((-half, half))
    image = figures["fit_correlations"].axes[0].images[0].get_array()
    assert image[0, 1] == pytest.approx(stiffness["correlation"][1])
    call(monkeypatch, "fit_figures", folder, "--format", "svg")
    assert_figures(folder / "figures", *names, formats=("svg",))


def test_what_no_measurement_tells_has_no_interval(nocdyn):
    idle = "&body name = 'idle' inertia = 1 /\n&unknown target = 'body.idle.inertia' low = 0.5 high = 2 /\n"
    groups = "".join(line for line in FITTED.splitlines(keepends=True) if "'g'" in line or "stiffness" in line)
    right = fit_figures.draw_all(compute(nocdyn, "fit", groups + idle))["fit_unknowns"].axes[1]
    assert "not determined" in [text.get_text() for text in right.texts]


def test_a_folder_without_a_fit_is_refused(tmp_path, monkeypatch):
    assert "fit.json: cannot be read" in refusal(monkeypatch, "fit_figures", tmp_path)
