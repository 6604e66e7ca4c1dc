"""nocdyn plot response, nocdyn plot campbell and the drawing of a train: what is in the figures, and what is refused."""

import json
import math
import subprocess
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from figure_files import NOCDYN, SCRIPTS, assert_figures, call, column, refusal, write_columns
from nocdyn_report import campbell_figures, mode_figures, response_figures, speed_panels, style
from nocdyn_report.speed_results import Operation, read_campbell, read_response, roman
from nocdyn_report.train_layout import GROUND, lay_out

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit

RPM = 30.0 / math.pi
SPEEDS = np.linspace(100.0, 500.0, 41)  # [rpm]
ORDERS = (1.0, 2.5, 4.0, 6.0, 8.0, 9.0)
CRITICAL = 300.0  # speed [rpm] at which order 2.5 meets mode 2
LINE_AT = 200.0  # the row of this speed comes last in the tables


def write(folder, name, content):
    folder.mkdir(parents=True, exist_ok=True)
    if isinstance(content, dict) and name.endswith(".csv"):
        pd.DataFrame(content).to_csv(folder / name, index=False)
    else:
        (folder / name).write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return folder


def amplitude(order, speed):
    """A peak of order 2.5 at the critical speed, the others the smaller the higher."""
    return 900.0 / (1 + ((speed - CRITICAL) / 15.0) ** 2) if order == 2.5 else 300.0 / order + 0.0 * speed


def report(**changes):
    content = {
        "title": "Costs $5",
        "input": "machine.nml",
        "body": "prop $",
        "operating_rad_s": [350.0 / RPM, 450.0 / RPM],
        "margin": 0.1,
        "lines": [{"order": order} for order in ORDERS],
        "critical_speeds": [
            {"mode": 2, "order": 2.5, "speed_rad_s": CRITICAL / RPM, "frequency_Hz": 12.5, "distance_to_operation": 0.143},
            {"mode": 4, "order": 9.0, "speed_rad_s": 330.0 / RPM, "frequency_Hz": 49.5, "distance_to_operation": 0.057},
        ],
        "barred_speed_ranges": [
            {"quantity": "moment_s1", "from_rad_s": 280.0 / RPM, "to_rad_s": 320.0 / RPM, "can_be_passed": True},
            {"quantity": "moment_s1", "from_rad_s": 296.0 / RPM, "to_rad_s": 304.0 / RPM, "can_be_passed": False},
        ],
    }
    return content | changes


def response(folder, elements=1, unit="rpm", **changes):
    """A response of as many couplings, a mesh and a stress of its own; the rows are not in the order of the speeds."""
    speed = np.append(SPEEDS[SPEEDS != LINE_AT], LINE_AT)
    label = f"omega_prop $ [{unit}]"
    shown = speed / {"rpm": 1.0, "rad/s": RPM, "Hz": 60.0}[unit]
    table, orders = {label: shown, "drive [1]": 1.0 + 0.0 * speed}, {label: np.repeat(shown, len(ORDERS))}
    orders["order [1]"] = np.tile(ORDERS, len(speed))
    orders["frequency [Hz]"] = np.repeat(speed, len(ORDERS)) * orders["order [1]"] / 60.0
    amplitudes = np.array([[amplitude(order, one) for order in ORDERS] for one in speed])
    half_range = amplitudes.sum(axis=1)
    for name, one in [*((f"moment_s{i}", "N m") for i in range(1, elements + 1)), ("force_mesh", "N")]:
        table |= {f"mean_{name} [{one}]": -speed, f"half_range_{name} [{one}]": half_range}
        table[f"peak_{name} [{one}]"] = speed + half_range
        orders |= {f"{name} [{one}]": amplitudes.ravel(), f"phase_{name} [deg]": 0.0 * amplitudes.ravel()}
    table |= {"half_range_stress_s1 [Pa]": 2e4 * half_range, "half_range_stress_shaft_end [Pa]": 3e4 * half_range}
    table |= {"limit_moment_s1 [N m]": 500.0 - 0.1 * speed, "transient_limit_moment_s1 [N m]": 900.0 - 0.1 * speed}
    table["peak_limit_moment_s1 [N m]"] = 1600.0 + 0.0 * speed
    write(folder, "response.csv", table)
    write(folder, "response_orders.csv", orders)
    statistics = ("half_range", "mean", "peak_limit", "peak", "limit", "transient_limit", "phase")
    columns = [
        column(one, next((word for word in statistics if one.startswith(f"{word}_")), ""), file)
        for file, labels in (("response.csv", table), ("response_orders.csv", orders))
        for one in labels
    ]
    write_columns(folder, columns, "response_columns.json")
    return write(folder, "response.json", report(**changes))


def panels_of(results, *options):
    """The visible panels of all figures, with their titles."""
    parser = speed_panels.figure_parser("x", "response", "")
    for name in ("--columns", "--orders"):
        parser.add_argument(name, nargs="+", type=float if name == "--orders" else str)
    for name in ("--peak", "--log"):
        parser.add_argument(name, action="store_true")
    figures = dict(response_figures.figures_of(results, parser.parse_args([str(results), *map(str, options)])))
    return {axes.get_title("left"): axes for figure in figures.values() for axes in figure.axes if axes.get_visible()}


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    style.pyplot.close("all")


def texts(axes):
    return [text.get_text() for text in axes.texts]


def line_of(axes, values):
    """The only line with these values."""
    found = [line for line in axes.lines if np.size(line.get_ydata()) == len(values) and np.allclose(line.get_ydata(), values)]
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize("unit", ["rpm", "rad/s", "Hz"])
def test_a_panel_has_the_curves_of_the_tables_over_rising_rpm(tmp_path, unit):
    axes = panels_of(response(tmp_path / "r", unit=unit))["s1"]
    together = sum(amplitude(order, SPEEDS) for order in ORDERS)
    line = line_of(axes, together)
    assert line.get_xdata() == pytest.approx(SPEEDS) and line.get_color() == "black"
    for order in ORDERS:
        assert line_of(axes, amplitude(order, SPEEDS)).get_xdata() == pytest.approx(SPEEDS)
    assert line_of(axes, 500.0 - 0.1 * SPEEDS).get_linestyle() == "-"
    assert line_of(axes, 900.0 - 0.1 * SPEEDS).get_linestyle() == "--"
    assert axes.get_xlim() == pytest.approx((100.0, 500.0)) and axes.get_ylabel() == "elastic moment [N m]"


def test_the_largest_orders_are_named_and_the_others_are_thin(tmp_path):
    results = response(tmp_path / "r")
    axes = panels_of(results)["s1"]
    assert {"2.5", "1", "4", "6"} <= set(texts(axes)) and not {"8", "9"} & set(texts(axes))
    assert line_of(axes, amplitude(9.0, SPEEDS)).get_color() == response_figures.OTHERS["color"]
    axes = panels_of(results, "--orders", 9, 2.5)["s1"]
    assert {"2.5", "9"} <= set(texts(axes)) and "1" not in texts(axes)
    assert line_of(axes, amplitude(9.0, SPEEDS)).get_color() in response_figures.ORDER_COLOURS


def test_an_order_has_the_same_colour_in_all_panels(tmp_path):
    panels = panels_of(response(tmp_path / "r", elements=3))
    assert len({line_of(panels[name], amplitude(2.5, SPEEDS)).get_color() for name in ("s1", "s2", "s3", "mesh")}) == 1


def test_critical_and_barred_speeds_are_marked_in_the_panels_that_they_concern(tmp_path):
    panels = panels_of(response(tmp_path / "r", elements=2))
    assert "II/2.5" in texts(panels["s1"]) and "II/2.5" in texts(panels["mesh"])
    assert "IV/9" not in texts(panels["s1"]), "its order is small there"
    for name in ("s1", "mesh"):
        marks = [line for line in panels[name].lines if line.get_marker() == 7]
        assert [list(line.get_xdata()) for line in marks] == [pytest.approx([300.0, 330.0])]
    assert "280–320" in texts(panels["s1"]) and "280–320" not in texts(panels["s2"])  # noqa: RUF001
    legend = [text.get_text() for text in panels["s1"].figure.legends[0].texts]
    assert {"barred speeds", "not to be passed through", "in operation: 350 to 450 rpm", "margin of 10 %"} <= set(legend)
    assert {"limit in continuous operation", "limit while passing through", "critical: mode/order"} <= set(legend)


def test_the_stress_of_a_moment_is_a_second_scale_and_another_one_a_panel(tmp_path):
    panels = panels_of(response(tmp_path / "r"))
    assert sorted(name for name in panels) == ["mesh", "s1", "shaft_end"]
    scale = panels["s1"].child_axes[0]
    assert scale.get_ylabel() == "stress [MPa]"
    panels["s1"].figure.canvas.draw()
    assert scale.get_ylim()[1] == pytest.approx(0.02 * panels["s1"].get_ylim()[1])
    assert panels["shaft_end"].get_ylabel() == "shear stress [MPa]" and panels["mesh"].get_ylabel() == "tooth force [N]"


def test_a_limit_of_the_stress_is_drawn_and_barred_in_the_panel_of_the_moment(tmp_path):
    barred = [{"quantity": "stress_s2", "from_rad_s": 280.0 / RPM, "to_rad_s": 320.0 / RPM, "can_be_passed": False}]
    results = response(tmp_path / "r", elements=2, barred_speed_ranges=barred)
    table = pd.read_csv(results / "response.csv")
    table["half_range_stress_s2 [Pa]"] = 2e4 * table["half_range_moment_s2 [N m]"]
    table["limit_stress_s2 [Pa]"] = 2e4 * 640.0
    table.to_csv(results / "response.csv", index=False)
    columns = json.loads((results / "response_columns.json").read_text(encoding="utf-8"))["columns"]
    columns += [column(f"{one}_stress_s2 [Pa]", one, "response.csv") for one in ("half_range", "limit")]
    write_columns(results, columns, "response_columns.json")
    axes = panels_of(results)["s2"]
    line_of(axes, 640.0 + 0.0 * SPEEDS)
    assert "280–320" in texts(axes)  # noqa: RUF001
    assert "not to be passed through" in [text.get_text() for text in axes.figure.legends[0].texts]


def test_panels_of_one_sort_have_one_unit(tmp_path):
    results = response(tmp_path / "r", elements=2)
    table = pd.read_csv(results / "response.csv")
    for name in ("half_range", "peak"):
        table[f"{name}_moment_s2 [N m]"] *= 100.0
    table.to_csv(results / "response.csv", index=False)
    panels = panels_of(results)
    assert {panels[name].get_ylabel().rpartition(" [")[2] for name in ("s1", "s2")} == {"kN m]"}


def test_means_and_largest_magnitudes_are_drawn_if_asked_for(tmp_path):
    axes = panels_of(response(tmp_path / "r"), "--peak")["s1"]
    line_of(axes, SPEEDS)  # the mean is negative
    assert line_of(axes, 1600.0 + 0.0 * SPEEDS).get_color() == speed_panels.DANGER
    line_of(axes, SPEEDS + sum(amplitude(order, SPEEDS) for order in ORDERS))
    assert axes.get_ylim()[1] > 1200.0


def test_limits_far_above_do_not_squeeze_the_curves(tmp_path):
    results = response(tmp_path / "r")
    table = pd.read_csv(results / "response.csv")
    table["limit_moment_s1 [N m]"] = table["transient_limit_moment_s1 [N m]"] = 1e5
    table.to_csv(results / "response.csv", index=False)
    (title, axes), *_ = panels_of(results).items()
    assert title == "s1   (limit, from 1e+05 N m on, is above)" and axes.get_ylim()[1] < 2000.0


def test_fifteen_couplings_go_on_several_pages_by_kind(tmp_path, monkeypatch, capsys):
    results = response(tmp_path / "r", elements=15)
    call(monkeypatch, "response_figures", results, "--format", "svg")
    names = ("moment", "moment_2", "moment_3", "force", "stress")
    assert_figures(results / "figures", *names, formats=("svg",))
    assert capsys.readouterr().out == f"{', '.join(names)} (SVG) are in {results / 'figures'}\n"
    text = (results / "figures" / "moment_3.svg").read_text(encoding="utf-8")
    assert ">s13<" in text and ">s15<" in text and ">s12<" not in text and "Costs $5" in text.replace("\\$", "$")


def test_quantities_speeds_and_folders_are_chosen(tmp_path, monkeypatch, capsys):
    folders = [response(tmp_path / name, elements=3) for name in "ab"]
    options = ["--columns", "MOMENT_s?", "--from", "250", "--to", "400", "--format", "svg"]
    call(monkeypatch, "response_figures", *folders, *options)
    for folder in folders:
        assert_figures(folder / "figures", "moment", formats=("svg",))
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert panels_of(folders[0], "--from", 250, "--to", 400)["s1"].get_xlim() == pytest.approx((250.0, 400.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--columns", "momnt_*"], "no quantity matches 'momnt_*'; there are: moment_s1, force_mesh, stress_shaft_end"),
        (["--orders", "7"], "no order 7; there are: 1, 2.5, 4, 6, 8, 9"),
        (["--from", "501"], "nothing to draw: 0 row(s) at the chosen speeds; the table goes from 100 to 500 rpm"),
        (["--from", "105", "--to", "115"], "nothing to draw: 1 row(s) at the chosen speeds; the table goes from 100 to 500 rpm"),
    ],
)
def test_choices_of_nothing_are_refused(options, message, tmp_path, monkeypatch):
    results = response(tmp_path / "r")
    assert refusal(monkeypatch, "response_figures", results, *options) == f"nocdyn plot response: {results}: {message}"
    assert not (results / "figures").exists()


@pytest.mark.parametrize(
    ("module", "options", "message"),
    [
        ("response_figures", ["--from", "2", "--to", "1"], "--from 2 must be less than --to 1"),
        ("response_figures", ["--to", "soon"], "argument --to: 'soon' is no number"),
        ("response_figures", ["b", "--out", "x"], "--out is for one folder of results"),
        ("campbell_figures", ["--top", "-1"], "--top must be above 0"),
        ("campbell_figures", ["--format", "tiff"], "'tiff' is none of png, svg, pdf"),
    ],
)
def test_options_that_are_wrong_are_usage_errors(module, options, message, monkeypatch, capsys):
    assert refusal(monkeypatch, module, "a", *options) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("response.csv", None, ": no response.csv here; 'nocdyn response FILE --out "),
        ("response_orders.csv", None, ": no response_orders.csv here; 'nocdyn response FILE --out "),
        ("response.json", None, ": no response.json here; 'nocdyn response FILE --out "),
        ("response.json", "{", "response.json: is no complete JSON: line 1"),
        ("response.json", "{}", "response.json: this is no response.json of nocdyn"),
        ("response.csv", "t [s]\n1\n2\n", "response.csv: the first column must be a speed, as 'omega_motor [rad/s]'"),
        ("response.csv", "omega_a [rpm]\n1\n", "response.csv: nothing to draw: the table has 1 row(s)"),
        ("response.csv", "omega_a [rpm]\n1\nx\n", "response.csv: not a table of numbers: "),
        ("response_columns.json", None, ": no response_columns.json here, as results of older releases have none; compute "),
        ("response_columns.json", "{}", "response_columns.json: this is no response_columns.json of nocdyn"),
        ("response_orders.csv", "omega_prop $ [rpm]\n1\n", "there is no column 'order [1]', which response_columns.json has"),
    ],
)
def test_a_folder_that_is_no_response_is_refused(name, content, message, tmp_path, monkeypatch):
    results = response(tmp_path / "r")
    (results / name).unlink() if content is None else write(results, name, content)
    said = refusal(monkeypatch, "response_figures", results)
    assert said.startswith(f"nocdyn plot response: {results}") and message in said and "\n" not in said


def test_orders_at_other_speeds_are_refused(tmp_path, monkeypatch):
    results = response(tmp_path / "r")
    pd.read_csv(results / "response_orders.csv").iloc[:-1].to_csv(results / "response_orders.csv", index=False)
    assert "its speeds are not those of response.csv" in refusal(monkeypatch, "response_figures", results)


def test_a_response_without_half_ranges_is_refused(tmp_path, monkeypatch):
    results = response(tmp_path / "r")
    columns = json.loads((results / "response_columns.json").read_text(encoding="utf-8"))["columns"]
    write_columns(results, [one for one in columns if one.get("statistic") != "half_range"], "response_columns.json")
    assert "nothing to draw: there is no half range" in refusal(monkeypatch, "response_figures", results)
    assert "there is no such results folder" in refusal(monkeypatch, "response_figures", tmp_path / "missing")


def campbell(folder, modes=3, orders=(1.0, 2.5, 12.0), **changes):
    """Constant frequencies of 10, 20 ... Hz, and an excitation of 7 Hz."""
    table = {"omega_motor [rpm]": SPEEDS[::-1]}
    table |= {f"frequency_{mode} [Hz]": 10.0 * mode + 0.0 * SPEEDS for mode in range(1, modes + 1)}
    table |= {f"damping_ratio_{mode} [1]": 0.01 + 0.0 * SPEEDS for mode in range(1, modes + 1)}
    table |= {f"order_{order:g} [Hz]": order * SPEEDS[::-1] / 60.0 for order in orders} | {"line_4 [Hz]": 7.0 + 0.0 * SPEEDS}
    write(folder, "campbell.csv", table)
    crossings = [
        {"mode": mode, "order": order, "speed_rad_s": 600.0 * mode / order / RPM, "frequency_Hz": 10.0 * mode}
        | {"distance_to_operation": max(0.0, distance), "is_too_near": distance < 0.1}
        for mode in range(1, modes + 1)
        for order in orders
        if 100.0 <= 600.0 * mode / order <= 500.0
        for distance in [max((350.0 - 600.0 * mode / order) / 350.0, (600.0 * mode / order - 450.0) / 450.0)]
    ]
    lines = [{"order": order} for order in orders] + [{"line": 4, "line_name": "fixed"}]
    content = {"title": "", "input": "in/train.nml", "body": "motor", "lines": lines, "crossings": crossings}
    return write(folder, "campbell.json", content | {"operating_rad_s": [350.0 / RPM, 450.0 / RPM], "margin": 0.1} | changes)


def test_campbell_s_diagram_has_frequencies_orders_and_crossings(tmp_path):
    results = campbell(tmp_path / "c")
    figure = campbell_figures.draw_campbell(read_campbell(results), (100.0, 500.0), None)
    axes = figure.axes[0]
    assert "train.nml" in figure.get_suptitle()
    for values in (10.0, 20.0, 30.0, 7.0):
        assert line_of(axes, np.full(SPEEDS.size, values)).get_xdata() == pytest.approx(SPEEDS)
    line_of(axes, SPEEDS * 2.5 / 60.0)
    assert {"I   10 Hz", "II   20 Hz", "III   30 Hz", "1", "2.5", "12", "7 Hz"} <= set(texts(axes))
    marks = {line.get_color(): line for line in axes.lines if line.get_marker() == "o"}
    assert sorted(marks[campbell_figures.FAR["color"]].get_xdata()) == pytest.approx([100.0, 150.0, 240.0])
    assert marks[campbell_figures.MARGIN["color"]].get_xdata() == pytest.approx([480.0])
    assert len(marks) == 2


def test_crossings_near_the_operation_stand_out(tmp_path):
    results = campbell(tmp_path / "c", modes=15, orders=(5.0, 5.5, 6.0))
    axes = campbell_figures.draw_campbell(read_campbell(results), (100.0, 500.0), None).axes[0]
    marks = {line.get_color(): line.get_xdata() for line in axes.lines if line.get_marker() == "o"}
    inside, margin, far = (
        marks[one["color"]] for one in (campbell_figures.INSIDE, campbell_figures.MARGIN, campbell_figures.FAR)
    )
    assert ((inside >= 350.0) & (inside <= 450.0)).all() and len(inside) == 3
    assert (((margin > 315.0) & (margin < 350.0)) | ((margin > 450.0) & (margin < 495.0))).all() and len(margin) > 0
    assert ((far < 315.1) | (far > 494.9)).all()
    assert {f"{one:.4g}" for one in inside} <= set(texts(axes))


def test_modes_above_all_orders_are_left_out_and_said_to_be(tmp_path):
    results = campbell(tmp_path / "c", modes=15, orders=(1.0, 2.0))
    diagram = read_campbell(results)
    figure = campbell_figures.draw_campbell(diagram, (100.0, 500.0), None)
    assert "; modes III to XV are above" in figure.get_suptitle()
    assert "III   30 Hz" not in texts(figure.axes[0])
    axes = campbell_figures.draw_campbell(diagram, (100.0, 500.0), 155.0).axes[0]
    assert axes.get_ylim() == (0.0, 155.0) and "XV   150 Hz" in texts(axes)


def test_orders_that_leave_above_are_named_there(tmp_path):
    diagram = read_campbell(campbell(tmp_path / "c"))
    axes = campbell_figures.draw_campbell(diagram, (100.0, 500.0), 30.0).axes[0]
    (name,) = [text for text in axes.texts if text.get_text() == "12"]
    assert name.xy == pytest.approx((0.125, 1.0))  # 12 x 150 rpm = 30 Hz
    (name,) = [text for text in axes.texts if text.get_text() == "2.5"]
    assert name.xy == pytest.approx((1.0, 500.0 * 2.5 / 60.0 / 30.0))


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("campbell.csv", None, ": no campbell.csv here; 'nocdyn campbell FILE --out "),
        ("campbell.json", None, ": no campbell.json here; 'nocdyn campbell FILE --out "),
        ("campbell.json", "[]", "campbell.json: this is no campbell.json of nocdyn"),
        ("campbell.csv", "omega_a [rpm]\n1\n2\n", "campbell.csv: nothing to draw: there is no column 'frequency_1 [Hz]'"),
    ],
)
def test_a_folder_without_campbell_s_diagram_is_refused(name, content, message, tmp_path, monkeypatch):
    results = campbell(tmp_path / "c")
    (results / name).unlink() if content is None else write(results, name, content)
    said = refusal(monkeypatch, "campbell_figures", results)
    assert said.startswith(f"nocdyn plot campbell: {results}") and message in said and "\n" not in said


MACHINE = """\
&body name = 'motor' inertia = 2 /
&body name = 'pinion' inertia = 0.1 /
&body name = 'wheel' inertia = 1 /
&body name = 'fan' inertia = 30 /
&coupling name = 'fast' bodies = 'motor', 'pinion' stiffness = 4000 damping = 4 diameter = 0.03 /
&coupling name = 'slow' bodies = 'wheel', 'fan' stiffness = 9000 damping = 9 /
&gear name = 'g' bodies = 'pinion', 'wheel' teeth = 20, 60 /
&motor name = 'm' body = 'motor' kind = 'constant' torque = -10 /
&load name = 'l' body = 'fan' quadratic = 0.5 /
&excitation name = 'x' body = 'fan' kind = 'orders' orders = 2, 3 amplitudes = 10, 5 /
&excitation name = 'y' body = 'motor' amplitude = 3 frequency_hz = 20 /
&limit coupling = 'fast' vibratory_moment = 40 moment = 90 /
&run t_end = 1 /
&response body = 'motor' speed_rpm = -20, -900 count = 81 operating_rpm = -300, -400 /
"""


START = """
&body name = 'motor' inertia = 3 /
&body name = 'fan' inertia = 2 /
&coupling name = 'c' bodies = 'motor', 'fan' stiffness = 6.0e4 damping = 5.0 /
&motor name = 'start' body = 'motor' kind = 'synchronous' frequency_hz = 50 poles = 4
       slips = 0, 1 mean_torques = 0, 50 pulsations = 10, 10 /
&load name = 'air' body = 'fan' quadratic = 5e-4 /
&run t_end = 1 /
&response body = 'motor' speed_rpm = 200, 1400 operating_rpm = 300, 1200 /
"""


def test_the_line_at_twice_the_slip_frequency_has_one_name(tmp_path):
    write(tmp_path, "machine.nml", START)
    for command, read, key in (("response", read_response, "critical_speeds"), ("campbell", read_campbell, "crossings")):
        words = [NOCDYN, command, tmp_path / "machine.nml"]
        printed = subprocess.run(words, check=True, capture_output=True, text=True, cwd=tmp_path).stdout
        assert printed.count("twice-slip") >= 2 and "order twice-slip" not in printed  # in the table, in the verdict
        subprocess.run([*words, "--out", tmp_path], check=True, capture_output=True)
        content = json.loads((tmp_path / f"{command}.json").read_text())
        assert [one["line_name"] for one in content["lines"]] == [one["line_name"] for one in content[key]] == ["twice-slip"]
        found = read(tmp_path)
        assert [one.name for one in getattr(found, "criticals", None) or found.crossings] == ["I/twice-slip"]
        (line,) = found.lines
        assert (line if command == "response" else line[0]).title == "twice-slip"


def test_a_line_of_a_body_of_another_speed_varies(tmp_path):
    fluid = START.replace("stiffness = 6.0e4", "friction = 800 friction_speed = 20").split("&motor")[0]
    fluid += """
&motor name = 'drive' body = 'motor' kind = 'constant' torque = 20 /
&load name = 'air' body = 'fan' quadratic = 5e-3 /
&excitation name = 'blades' body = 'fan' kind = 'orders' orders = 3 amplitudes = 5 /
&run t_end = 1 /
&response body = 'motor' speed_rpm = 200, 1400 /
"""
    write(tmp_path, "machine.nml", fluid)
    subprocess.run([NOCDYN, "response", tmp_path / "machine.nml", "--out", tmp_path], check=True, capture_output=True)
    content = json.loads((tmp_path / "response.json").read_text())
    assert [one["line_name"] for one in content["lines"]] == ["varying"]


def test_what_the_program_writes_is_drawn(tmp_path, monkeypatch):
    write(tmp_path, "machine.nml", MACHINE)
    for command in ("response", "campbell"):
        subprocess.run([NOCDYN, command, tmp_path / "machine.nml", "--out", tmp_path], check=True, capture_output=True)
        call(monkeypatch, f"{command}_figures", tmp_path, "--format", "png,svg")
    assert_figures(tmp_path / "figures", "total_moment", "reaction", "campbell", formats=("png", "svg"))
    found, diagram = read_response(tmp_path), read_campbell(tmp_path)
    assert (np.diff(found.speed) >= 0).all() and found.speed[[0, -1]] == pytest.approx([-900.0, -20.0])
    assert [line.name for line in found.lines] == [line.name for line, _ in diagram.lines] and "20 Hz" in found.lines[-1].name
    assert [quantity.label for quantity in found.quantities] == ["total_moment_fast", "total_moment_slow", "reaction_g"]
    assert found.quantities[0].limit == pytest.approx(40.0) and found.quantities[0].peak_limit == pytest.approx(90.0)
    assert found.quantities[0].stress == pytest.approx(16.0 / (math.pi * 0.03**3))
    assert found.operation.spans == [
        (pytest.approx(-300.0), pytest.approx(-270.0), True),
        (pytest.approx(-400.0), pytest.approx(-300.0), False),
        (pytest.approx(-440.0), pytest.approx(-400.0), True),
    ]


@pytest.mark.parametrize(("factor", "unit", "divisor"), [(1.0, "N m", 1.0), (100.0, "kN m", 1e3), (2e4, "MN m", 1e6)])
def test_large_moments_are_in_kilo_and_mega(factor, unit, divisor, tmp_path):
    found = read_response(response(tmp_path / "r")).quantities[0]
    large = replace(found, half_range=factor * found.half_range)
    assert large.in_short().unit == unit and large.in_short().stress == pytest.approx(2e4 * divisor)
    assert large.in_short().half_range == pytest.approx(large.half_range / divisor)
    assert large.in_short().limit == pytest.approx(large.limit / divisor)


def test_modes_are_counted_in_roman_numbers():
    assert [roman(number) for number in (1, 4, 9, 14, 40, 49, 99)] == ["I", "IV", "IX", "XIV", "XL", "XLIX", "XCIX"]


def test_positions_are_spread_as_little_as_needed():
    assert speed_panels.spread(np.array([3.0, 1.0, 1.0]), 0.5) == pytest.approx([3.0, 0.75, 1.25])
    assert speed_panels.spread(np.array([0.0, 1.0]), 0.5) == pytest.approx([0.0, 1.0])
    moved = speed_panels.spread(np.random.default_rng(1).random(24), 0.04)
    assert np.diff(np.sort(moved)).min() > 0.04 - 1e-12


def test_no_margin_has_no_spans():
    assert Operation(300.0, 400.0, 0.0).spans == [(300.0, 400.0, False)]


def test_geared_shafts_are_rows_with_the_wheels_above_each_other():
    """The ship's turbines: propeller, bull, and on both sides pinion, wheel, driver, turbine."""
    shafts = [(1, 0), (2, 3), (4, 5), (6, 7), (8, 9)]
    train = lay_out(10, shafts, [(1, 2), (3, 4), (1, 6), (7, 8)])
    assert train.place == [0, 1, 1, 2, 2, 3, 1, 2, 2, 3]
    assert train.row == [0, 0, 1, 1, 2, 2, -1, -1, -2, -2]
    assert len(set(train.line)) == train.lines == 5


def test_a_branch_of_a_shaft_has_a_row_of_its_own():
    train = lay_out(5, [(0, 1), (1, 2), (2, 3), (1, 4)], [])
    assert train.place == [0, 1, 2, 3, 2] and train.row[:4] == [0] * 4 and train.row[4] != 0


def test_trains_of_single_wheels_go_on_along_the_train():
    train = lay_out(4, [(0, 1)], [(1, 2), (2, 3)])
    assert train.place == [0, 1, 1, 2] and train.row[2] != train.row[3]


def test_shafts_with_inertia_have_their_shares_of_the_kinetic_energy(tmp_path):
    """modes.json has them after those of the bodies, modes.csv their names."""
    mode = {"mode": 1, "kind": "oscillating", "frequency_Hz": 3.0, "damping_ratio": 0.1, "shape": [1.0, 0.5]}
    mode |= {"phase_deg": [0, 180], "kinetic_share": [0.5, 0.3, 0.2], "potential_share": [0.25, 0.75]}
    couplings = [{"name": "rubber", "bodies": [1, 2]}, {"name": "tail", "bodies": [2, 0]}]
    content = {"title": "", "input": "a.nml", "about": "rest", "bodies": ["a", "b"], "couplings": couplings, "gears": []}
    write(tmp_path, "modes.json", content | {"modes": [mode]})
    write(tmp_path, "modes.csv", "mode,kinetic_a [1],kinetic_b [1],kinetic_tail [1],potential_rubber [1],potential_tail [1]\n")
    modes = mode_figures.read_modes(tmp_path)
    assert modes.shafts_with_inertia == [1]
    energy = mode_figures.draw_modes(modes, modes.oscillating).axes[3]
    assert sorted(round(bar.get_height()) for bar in energy.patches) == [-75, -25, 20, 30, 50]


def test_bars_stand_over_their_names_and_titles_have_the_marks_of_modes(tmp_path):
    """The shaft from the second to the fourth body has a place of its own, not that of the third."""
    mode = {"mode": 1, "kind": "oscillating", "frequency_Hz": 3.0, "damping_ratio": 0.1, "shape": [1.0, 0.5, 0.2, 0.1]}
    mode |= {"phase_deg": [0, 180, 0, 0], "kinetic_share": [0.4, 0.3, 0.2, 0.1], "potential_share": [1.0]}
    mode |= {"state": "stator flux q of motor 'm'", "error_by_shaft_nodes": 0.021}
    content = {"title": "", "input": "a.nml", "about": "rest", "bodies": list("abcd"), "gears": []}
    content["couplings"] = [{"name": "line", "bodies": [2, 4]}]
    write(tmp_path, "modes.json", content | {"modes": [mode]})
    modes = mode_figures.read_modes(tmp_path)
    _, _, shape, energy = mode_figures.draw_modes(modes, modes.oscillating).axes
    assert "mostly stator flux q of motor 'm', nodes too few: error about 2 %" in shape.get_title("left")
    bar = next(bar for bar in energy.patches if bar.get_height() < 0)
    names = {label.get_text(): place for place, label in zip(energy.get_xticks(), energy.get_xticklabels())}
    assert bar.get_x() + bar.get_width() / 2 == pytest.approx(names["line"]) and names["line"] > names["d"]


@pytest.mark.parametrize("seed", range(20))
def test_bodies_of_any_machine_have_places_of_their_own(seed):
    random = np.random.default_rng(seed)
    bodies = int(random.integers(1, 30))
    pairs = [(GROUND if random.random() < 0.1 else int(random.integers(0, i)), i) for i in range(1, bodies)]
    pairs += [tuple(map(int, random.integers(0, bodies, 2))) for _ in range(int(random.integers(0, 4)))]
    are_gears = random.random(len(pairs)) < 0.4
    train = lay_out(
        bodies, [p for p, g in zip(pairs, are_gears) if not g], [p for p, g in zip(pairs, are_gears) if g and GROUND not in p]
    )
    assert len(set(zip(train.place, train.row))) == bodies and min(train.place) == 0


@pytest.mark.parametrize("kind", ["run", "modes", "campbell", "response", "sweep", "transit"])
def test_a_script_calls_the_command_of_its_kind(kind):
    script = "plot" if kind == "run" else f"plot_{kind}"
    words = "" if kind == "run" else f" {kind}"
    assert f'-m nocdyn_report plot{words} "$@"' in (SCRIPTS / script).read_text(encoding="utf-8")
