"""nocdyn plot transit: what is in the figures of passages of barred ranges, and what is refused."""

import json
import math
import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest
from figure_files import NOCDYN, assert_figures, call, refusal
from nocdyn_report import plot, style, transit_figures
from nocdyn_report.transit_results import read_transit

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit

RPM = 30.0 / math.pi
RANGE = (45.0, 55.0)  # [rad/s]
DISCS = f"""&case title = 'Costs $5' /
&body name = 'a $' inertia = 2.0 speed = 30 /
&body name = 'b' inertia = 3.0 speed = 30 /
&coupling name = 's$' bodies = 'a $', 'b' stiffness = 1.2e4 damping = 2.4 section_modulus = 1e-6 /
&motor name = 'a' body = 'a $' kind = 'constant' torque = 40 /
&motor name = 'b' body = 'b' kind = 'constant' torque = 60 /
&excitation name = 'back_a' body = 'a $' kind = 'step' time = 2 amplitude = -80 /
&excitation name = 'back_b' body = 'b' kind = 'step' time = 2 amplitude = -120 /
&excitation name = 'shake' body = 'a $' kind = 'orders' orders = 2 amplitudes = 5 /
&limit coupling = 's$' moment = 60.0 vibratory_moment = 2 /
&limit coupling = 's$' stress = 1e6 stress_transient = 70e6 /
&transit body = 'a $' range = {RANGE[0]}, {RANGE[1]} order = 2 direction = 'both' /
&run t_end = 4 /
"""
CASES = "&load_case name = 'weak' set = 'excitation.shake.amplitudes=1' /\n&load_case name = 'strong' /\n"


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    """The results of the discs, and of two load cases of them."""
    folder = tmp_path_factory.mktemp("transit")
    for name, text in (("one", DISCS), ("cases", DISCS + CASES)):
        (folder / f"{name}.nml").write_text(text, encoding="utf-8")
        subprocess.run([NOCDYN, "transit", folder / f"{name}.nml", "--out", folder / name], check=True, capture_output=True)
    return folder


@pytest.fixture
def results(computed, tmp_path):
    """A copy that a test may change."""
    return shutil.copytree(computed / "one", tmp_path / "r")


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    style.pyplot.close("all")


def grid_of(figure):
    """The panels of a figure, [rows][passages]."""
    columns = figure.axes[0].get_subplotspec().get_gridspec().ncols
    return [figure.axes[first : first + columns] for first in range(0, len(figure.axes), columns)]


def levels(axes, style_of):
    """The heights of lines across the panel that have the dashes of a style."""
    dashes = style_of["linestyle"][1]
    lines = [line for line in axes.lines if len(line.get_ydata()) == 2 and line._unscaled_dash_pattern[1] == dashes]
    return sorted({float(line.get_ydata()[0]) for line in lines if line.get_ydata()[0] == line.get_ydata()[1]})


def texts(axes):
    return [text.get_text().strip() for text in axes.texts]


def change(results, change_of):
    """transit.json with a change."""
    report = json.loads((results / "transit.json").read_text())
    change_of(report)
    (results / "transit.json").write_text(json.dumps(report))


def test_passages_stand_side_by_side_with_the_range_and_the_times_in_it(results):
    ((name, figure),) = transit_figures.figures_of(results)
    speeds, *loads = grid_of(figure)
    assert name == "transit" and len(speeds) == 2 and len(loads) == 2
    table = pd.read_csv(results / "transit.csv")
    report = json.loads((results / "transit.json").read_text())
    for number, (axes, entry) in enumerate(zip(speeds, report["passages"], strict=True), start=1):
        rows = table[table["passage"] == number]
        thin, thick = (line for line in axes.lines if len(line.get_xdata()) > 2)
        assert thick.get_ydata() == pytest.approx(rows.filter(like="mean_omega").to_numpy()[:, 0] * RPM)
        assert np.ptp(thin.get_ydata() - thick.get_ydata()) > 1
        (shade,) = axes.patches
        assert (shade.get_y(), shade.get_y() + shade.get_height()) == pytest.approx(tuple(RPM * one for one in RANGE))
        edges = [line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2]
        assert edges == [entry["enters"], entry["leaves"]]
        assert texts(axes) == [f"{entry['enters']:.4g} s", f"{entry['leaves']:.4g} s"]
        direction = ("up", "down")[number - 1]
        assert axes.get_title("left").startswith(f"{number}: {direction}, {entry['time_in_range']:.3g} s in 429.7 to 525.2 rpm")
        for row in loads:
            (time,) = row[number - 1].patches
            assert (time.get_x(), time.get_x() + time.get_width()) == pytest.approx((entry["enters"], entry["leaves"]))
    assert "cycles of order 2" in speeds[0].get_title("left")
    assert speeds[0].get_ylabel() == r"speed of a \$ [rpm]"
    assert figure.get_suptitle().startswith(r"Costs \$5")


def test_peaks_and_limits_are_in_the_panels_of_their_quantities(results):
    ((_, figure),) = transit_figures.figures_of(results)
    _, moments, stresses = grid_of(figure)
    assert moments[0].get_title("left") == r"coupling 's\$': moment" and moments[0].get_ylabel() == "moment [N m]"
    assert stresses[0].get_title("left") == r"coupling 's\$': stress" and stresses[0].get_ylabel() == "stress [MPa]"
    transit = read_transit(results)
    _, stress = transit.quantities
    for passage, of_moment, of_stress in zip(transit.passages, moments, stresses, strict=True):
        peak = passage.peak(stress)
        (point,) = [line for line in of_stress.lines if line.get_marker() == "o"]
        assert point.get_xdata()[0] == peak["time"] and abs(point.get_ydata()[0]) == pytest.approx(peak["largest"] / 1e6)
        there = np.interp(peak["time"], passage.time, passage.values(stress))  # on the curve, whatever its sign
        assert point.get_ydata()[0] == pytest.approx(there / 1e6, rel=0.01)
        (bar,) = of_stress.containers
        (segment,) = bar[2][0].get_segments()
        assert np.ptp(segment[:, 1]) == pytest.approx(2 * peak["half_range"] / 1e6)
        assert segment[0, 0] == peak["half_range_time"]
        assert f"\N{PLUS-MINUS SIGN}{peak['half_range'] / 1e6:.4g}" in texts(of_stress)
        # the limit of the half range is about the middle of its turn, that of the magnitude about zero
        middle = segment[:, 1].mean()
        assert levels(of_stress, transit_figures.TRANSIENT) == pytest.approx([middle - 70, middle + 70])
        assert levels(of_moment, transit_figures.PEAK_LIMIT) == [-60, 60]
        assert levels(of_moment, transit_figures.TRANSIENT) == levels(of_stress, transit_figures.PEAK_LIMIT) == []
    legend = [text.get_text() for text in figure.legends[0].texts]
    assert "half range of the worst turn" in legend and "limit of the magnitude" in legend


def test_limits_far_outside_stand_in_the_title(results):
    def raise_limits(report):
        for passage in report["passages"]:
            passage["peaks"][1]["half_range_limit"] = 3e9

    change(results, raise_limits)
    ((_, figure),) = transit_figures.figures_of(results)
    panel = grid_of(figure)[2][0]
    assert panel.get_title("left").endswith("   (limit \N{PLUS-MINUS SIGN}3000 MPa is outside)")
    assert levels(panel, transit_figures.TRANSIENT) == [] and panel.get_ylim()[1] < 100


def test_many_passages_and_quantities_go_on_several_figures(results, monkeypatch):
    monkeypatch.setattr(transit_figures, "MOST_ROWS", 1)
    table = pd.read_csv(results / "transit.csv")
    third = table[table["passage"] == 1].assign(passage=3)
    pd.concat([table, third]).to_csv(results / "transit.csv", index=False)
    change(results, lambda report: report["passages"].append(report["passages"][0]))
    figures = dict(transit_figures.figures_of(results))
    assert list(figures) == ["transit", "transit_2", "transit_3", "transit_4"]
    assert [len(grid_of(figure)[0]) for figure in figures.values()] == [2, 2, 1, 1]
    assert grid_of(figures["transit_4"])[0][0].get_title("left").startswith("3: up")


def test_each_load_case_has_its_figures(computed, tmp_path, capsys):
    folder = shutil.copytree(computed / "cases", tmp_path / "r")
    assert plot.main(["transit", str(folder), str(computed / "one"), "--format", "svg"]) == 0
    told = capsys.readouterr().out.splitlines()
    assert told == [f"transit (SVG) are in {one / 'figures'}" for one in (folder / "weak", folder / "strong", computed / "one")]
    assert "Costs $5: load case weak" in (folder / "weak/figures/transit.svg").read_text(encoding="utf-8")
    assert plot.main(["transit", str(folder), "--out", str(tmp_path / "f")]) == 2
    said = capsys.readouterr().err
    assert said == f"nocdyn plot transit: --out is for one folder of results; there are: {folder / 'weak'}, {folder / 'strong'}\n"


def test_figures_appear_in_three_formats(results, tmp_path, monkeypatch):
    call(monkeypatch, "transit_figures", results, "--out", tmp_path / "f")
    assert_figures(tmp_path / "f", "transit")


def remove(name):
    return lambda results: (results / name).unlink()


def write(name, text):
    return lambda results: (results / name).write_text(text)


def without_a_passage(results):
    change(results, lambda report: report["passages"].pop())


def without_passages(results):
    change(results, lambda report: report["passages"].clear())


def without_a_column(results):
    table = pd.read_csv(results / "transit.csv")
    table.drop(columns="stress_s$ [Pa]").to_csv(results / "transit.csv", index=False)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (shutil.rmtree, "there is no such results folder"),
        (remove("transit.json"), "no transit.json here; 'nocdyn transit FILE --out "),
        (remove("transit.csv"), "no transit.csv here; 'nocdyn transit FILE --out "),
        (write("transit.json", "{"), "transit.json: is no complete JSON: line 1"),
        (write("transit.json", "{}"), "transit.json: this is no transit.json of nocdyn"),
        (write("transit.csv", "passage\n1\n2\n"), "transit.csv: there is no column 't [s]'; it must be of the same run"),
        (without_a_column, "transit.csv: there is no column 'stress_s$ [Pa]'; it must be of the same run as transit.json"),
        (without_a_passage, "transit.csv: its passages are not those of transit.json; both must be of the same run"),
        (without_passages, "nothing to draw: the run is never in a range of &transit"),
    ],
)
def test_a_folder_that_is_no_transit_is_refused(spoil, message, results, monkeypatch):
    spoil(results)
    said = refusal(monkeypatch, "transit_figures", results)
    assert said.startswith(f"nocdyn plot transit: {results}") and message in said and "\n" not in said
