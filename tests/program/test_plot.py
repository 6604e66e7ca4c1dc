"""nocdyn plot run: figures of runs, the choice of columns and times, and what it says of folders that it cannot draw."""

import json

import h5netcdf
import numpy as np
import pandas as pd
import pytest
from figure_files import assert_figures, call, chain, column, refusal, run_input, write_columns
from nocdyn_report import multiples, plot, run_figures, style
from nocdyn_report.results import Series, read_results
from nocdyn_report.thinning import thin, thin_curve

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit


def text_of(folder, figure):
    return (folder / f"{figure}.svg").read_text(encoding="utf-8")


def write_results(folder, columns, input_text="&case title = 'By hand' /\n"):
    """A results folder with this trajectory."""
    folder.mkdir()
    pd.DataFrame(columns).to_csv(folder / "trajectory.csv", index=False)
    (folder / "input.nml").write_text(input_text, encoding="utf-8")
    write_columns(folder, [column(label) for label in columns])
    return folder


TURNING = """
&body name = 'Motor' inertia = 1.0 /
&body name = 'fan' inertia = 1.0 /
&coupling name = 'shaft' bodies = 'motor', 'fan' stiffness = 1.0 /
&coupling name = 'mount' bodies = 'fan', 'ground' stiffness = 1.0 /
"""


def turning(folder, speed="rad/s", angle="rad", rows=11):
    """Two bodies at 10 and 20 of the unit of speed."""
    t = np.linspace(0.0, 1.0, rows)
    return write_results(
        folder,
        {
            "t [s]": t,
            f"phi_Motor [{angle}]": 10.0 * t,
            f"phi_fan [{angle}]": 20.0 * t,
            f"omega_Motor [{speed}]": 10.0 + 0.0 * t,
            f"omega_fan [{speed}]": 20.0 + 0.0 * t,
            f"twist_shaft [{angle}]": t,
            f"twist_mount [{angle}]": -t,
            "moment_shaft [N m]": t,
            "damping_shaft [N m]": t**2,
            "total_moment_shaft [N m]": t + t**2,
        },
        TURNING,
    )


def test_single_body_is_drawn(tmp_path, monkeypatch, capsys):
    results = run_input(tmp_path, chain(1, "t_end = 1.0"))
    call(monkeypatch, "run_figures", results, "--format", "PNG,svg")
    assert_figures(results / "figures", "motion", "phase_planes", "torques", "energy", formats=("png", "svg"))
    assert capsys.readouterr().out == f"motion, phase_planes, torques, energy (PNG, SVG) are in {results / 'figures'}\n"


def test_machine_with_ground_and_awkward_names_is_drawn(tmp_path, monkeypatch):
    results = run_input(
        tmp_path,
        """
&case title = 'Costs $5, and a title that is far too long for one line: 50 % of a lot of words that nobody wants to read' /
&body name = 'a $ b' inertia = 1.0 speed = 1.0 /
&body name = 'wheel_2' inertia = 1.0 speed = -1.0 /
&coupling name = 'mount [x]' bodies = 'ground', 'a $ b' stiffness = 100.0 damping = 0.1 /
&gear name = 'g' bodies = 'a $ b', 'wheel_2' teeth = 20, 20 /
&run t_end = 1.0 /
""",
    )
    call(monkeypatch, "run_figures", results, "--format", "svg")
    assert_figures(results / "figures", "motion", "phase_planes", "torques", "energy", formats=("svg",))


def test_partial_trajectory_of_many_bodies_is_drawn_and_called_partial(tmp_path, monkeypatch, capsys):
    results = run_input(tmp_path, chain(10, "t_end = 1000.0"), "--set", "run.max_steps=200", "--set", "output.points=10001")
    assert (results / "trajectory.partial.csv").is_file()
    call(monkeypatch, "run_figures", results, "--format", "svg")
    names = ("omega", "twist", "phase_planes", "torques", "total_moment", "energy")
    assert_figures(results / "figures", *names, formats=("svg",))
    assert "the trajectory is partial: failed, ends at t = " in capsys.readouterr().err
    assert all("failed, ends at t = " in text_of(results / "figures", name) for name in names)


def test_corners_of_a_fast_oscillation_are_told_with_the_interval_that_rounds_them(tmp_path, monkeypatch, capsys):
    machine = """
&body name = 'disc' inertia = 1.0 angle = 1.0 /
&coupling name = 'spring' bodies = 'ground', 'disc' stiffness = 39.478417604357434 /  ! (2 pi)^2: a second an oscillation
&run t_end = 50.0 /
"""
    options = ["--columns", "twist_*", "--format", "svg"]
    call(monkeypatch, "run_figures", run_input(tmp_path, machine, "--set", "output.interval=0.15"), *options)
    advice = capsys.readouterr().out.splitlines()[1]
    assert advice == "about 6 rows for an oscillation of 'spring' draw corners; smooth: &output interval = 0.04"
    call(monkeypatch, "run_figures", run_input(tmp_path, machine, "--set", "output.interval=0.04"), *options)
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_throttle_and_current_are_drawn(tmp_path, monkeypatch):
    results = run_input(
        tmp_path,
        """
&body name = 'rotor' inertia = 1.0 /
&motor name = 'drive' body = 'rotor' kind = 'dc' voltage = 24.0 resistance = 1.0 flux_constant = 0.5 inductance = 0.1
       governor_speed = 20.0 governor_gain = 0.1 governor_time = 1.0 /
&run t_end = 1.0 /
""",
    )
    call(monkeypatch, "run_figures", results, "--columns", "*_drive", "--format", "svg")
    text = (results / "figures" / "columns.svg").read_text(encoding="utf-8")
    assert "throttle opening [1]" in text and "armature current [A]" in text


def test_a_tooth_force_is_called_a_tooth_force_and_shares_no_axis_with_a_moment(tmp_path, monkeypatch):
    results = run_input(
        tmp_path,
        """
&body name = 'motor' inertia = 1.0 /
&body name = 'pinion' inertia = 0.1 /
&body name = 'wheel' inertia = 2.0 /
&coupling name = 'line' bodies = 'motor', 'pinion' stiffness = 1e3 damping = 1.0 /
&mesh name = 'teeth' bodies = 'pinion', 'wheel' radii = 0.1, 0.2 stiffness = 1e8 damping = 1e3 /
&motor name = 'drive' body = 'motor' kind = 'constant' torque = 10.0 /
&run t_end = 0.1 /
""",
    )
    read = read_results(results)
    figure = run_figures.draw_over_time(read, "torques", run_figures.default_labels(read.header)["torques"])["torques"]
    panels = {axes.get_ylabel(): [text.get_text() for text in axes.get_legend().get_texts()] for axes in figure.axes}
    assert panels == {
        "elastic and damping moment [N m]": ["line"],
        "tooth force [N]": ["teeth"],
        "torque on the body [N m]": ["drive"],
    }
    style.pyplot.close("all")


def test_speeds_are_drawn_in_rpm_if_asked_for(tmp_path, monkeypatch):
    results = turning(tmp_path / "results")
    call(monkeypatch, "run_figures", results, "--columns", "omega_*", "--rpm", "--format", "svg")
    assert "speed [rpm]" in text_of(results / "figures", "columns")
    rpm = read_results(results, rpm=True)
    assert rpm.speed("motor").values == pytest.approx(10.0 * 30.0 / np.pi) and rpm.speed("motor").unit == "rpm"
    assert rpm.twist_rate(rpm.header.columns["twist_shaft [rad]"]).values == pytest.approx(10.0 * 30.0 / np.pi)
    assert rpm.twist_rate(rpm.header.columns["twist_mount [rad]"]).values == pytest.approx(-20.0 * 30.0 / np.pi)


def test_speeds_in_hertz_become_rpm_too(tmp_path):
    results = turning(tmp_path / "results", "Hz")
    assert read_results(results).speed("fan").unit == "Hz"
    assert read_results(results, rpm=True).speed("fan").values == pytest.approx(20.0 * 60.0)


def test_angles_without_speeds_are_drawn_over_time(tmp_path, monkeypatch):
    results = write_results(tmp_path / "results", {"t [s]": [0.0, 1.0], "phi_fan [rad]": [0.0, 2.0]})
    call(monkeypatch, "run_figures", results, "--format", "svg")
    assert_figures(results / "figures", "motion", formats=("svg",))
    assert "angle [rad]" in text_of(results / "figures", "motion")


@pytest.mark.parametrize("options", [[], ["--rpm"]])
def test_units_of_the_file_are_those_of_the_axes(options, tmp_path, monkeypatch):
    results = turning(tmp_path / "results", "rpm", "deg")
    call(monkeypatch, "run_figures", results, "--format", "svg", *options)
    assert_figures(results / "figures", "motion", "phase_planes", "torques", formats=("svg",))  # the file has no energies
    motion, planes, torques = (text_of(results / "figures", name) for name in ("motion", "phase_planes", "torques"))
    assert "speed [rpm]" in motion and "twist [deg]" in motion and "rad" not in motion
    assert "angle φ [deg]" in planes and "speed ω [rpm]" in planes and "rate of twist Δω [rpm]" in planes
    assert "elastic and damping" in torques and "friction" not in torques
    assert read_results(results, rpm=True).speed("fan").values == pytest.approx(20.0)


def test_columns_are_chosen_by_patterns_and_rows_by_times(tmp_path, monkeypatch, capsys):
    results = turning(tmp_path / "results")
    options = ["--columns", "MOMENT_*", "phi_fa?", "--from", "0.25", "--to", "0.75", "--format", "svg"]
    call(monkeypatch, "run_figures", results, *options)
    assert_figures(results / "figures", "columns", formats=("svg",))
    text = text_of(results / "figures", "columns")
    assert "elastic moment" in text and "angle [rad]" in text and "damping" not in text and "Motor" not in text
    assert ">0.3<" in text or ">0.30<" in text
    assert ">0.2<" not in text and ">0.8<" not in text
    assert capsys.readouterr().out == f"columns (SVG) are in {results / 'figures'}\n"


def as_netcdf(results):
    """trajectory.csv replaced by trajectory.nc as nocdyn-sweep writes it."""
    table = pd.read_csv(results / "trajectory.csv")
    with h5netcdf.File(results / "trajectory.nc", "w") as file:
        file.dimensions = {"t": len(table)}
        for i, label in enumerate(table):
            name, unit = label.removesuffix("]").split(" [")
            variable = file.create_variable("t" if name == "t" else f"changed_{i}", ("t",), data=table[label].to_numpy())
            variable.attrs.update(units=np.bytes_(unit.encode()), long_name=np.bytes_(name.encode()))
    (results / "trajectory.csv").unlink()
    return results


def test_a_trajectory_in_netcdf_is_drawn_too(tmp_path, monkeypatch):
    results = turning(tmp_path / "größe")
    for name in ("trajectory.csv", "columns.json"):
        (results / name).write_text((results / name).read_text().replace("fan", "Lüfter"))
    tables = [read_results(results).table, read_results(as_netcdf(results)).table]
    assert (tables[0] == tables[1][list(tables[0])]).all(axis=None)
    assert list(read_results(results, lambda header: header.of("twist")[:1]).table) == ["t [s]", "twist_shaft [rad]"]
    call(monkeypatch, "run_figures", results, "--columns", "omega_*", "--format", "svg")
    assert "Lüfter" in text_of(results / "figures", "columns")
    (results / "trajectory.nc").write_text("no NetCDF")
    assert f"{results}/trajectory.nc: cannot be read: " in refusal(monkeypatch, "run_figures", results)


def test_only_the_columns_that_are_drawn_are_read(tmp_path):
    results = turning(tmp_path / "results")
    assert list(read_results(results, lambda header: header.of("phi")).table) == ["t [s]", "phi_Motor [rad]", "phi_fan [rad]"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--columns", "omega_*", "momnt_shaft"], "no column matches 'momnt_shaft'; nearest: moment_shaft, total_mo"),
        (["--columns", "[omega]_*"], "no column matches '[omega]_*'; nearest: omega_*"),
        (["--columns", "zzz"], "no column matches 'zzz'; there are: phi_*, omega_*, twist_*, moment_*, dam"),
        (["--from", "1.5"], "nothing to draw: 0 row(s) in the chosen time; the trajectory goes from 0 to 1 s"),
        (["--from", "0.45", "--to", "0.55"], "nothing to draw: 1 row(s) in the chosen time; the trajectory goes from 0 to 1 s"),
    ],
)
def test_choices_of_nothing_are_refused(options, message, tmp_path, monkeypatch):
    results = turning(tmp_path / "results")
    assert refusal(monkeypatch, "run_figures", results, *options).startswith(f"nocdyn plot run: {results}: {message}")
    assert not (results / "figures").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--from", "2", "--to", "1"], "--from 2 must be less than --to 1"),
        (["--to", "nan"], "argument --to: 'nan' is no time"),
        (["--to", "soon"], "argument --to: 'soon' is no time"),
        (["--columns"], "argument --columns: expected at least one argument"),
        (["--format", "png,tiff"], "'tiff' is none of png, svg, pdf"),
    ],
)
def test_options_that_are_wrong_are_usage_errors(options, message, tmp_path, monkeypatch, capsys):
    assert refusal(monkeypatch, "run_figures", tmp_path, *options) == 2
    assert message in capsys.readouterr().err


def test_patterns_before_the_folder_are_told_by_the_usage(tmp_path, monkeypatch, capsys):
    assert refusal(monkeypatch, "run_figures", "--columns", "omega_*", tmp_path) == 2
    said = capsys.readouterr().err
    assert said.startswith("usage: nocdyn plot run RESULTS [--columns PATTERN ...]") and "are required: RESULTS" in said


def many(folder, elements, rows=50):
    """As many moments as that, the later the larger."""
    t = np.linspace(0.0, 1.0, rows)
    return write_results(folder, {"t [s]": t} | {f"moment_s{i} [N m]": i * np.sin(9.0 * t) for i in range(1, elements + 1)})


def test_more_than_eight_series_have_small_panels(tmp_path, monkeypatch):
    for elements, name in ((8, "columns"), (9, "moment")):
        results = many(tmp_path / str(elements), elements)
        call(monkeypatch, "run_figures", results, "--columns", "*", "--format", "svg")
        assert_figures(results / "figures", name, formats=("svg",))
    text = text_of(results / "figures", "moment")
    assert all(f">s{i}<" in text for i in range(1, 10)) and "elastic moment [N m]" in text
    figure = run_figures.draw_over_time(read_results(results), "x", [f"moment_s{i} [N m]" for i in range(1, 10)])["moment"]
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert len(panels) == 9 and all(len(axes.lines) == 1 for axes in panels)
    assert len({axes.get_ylim() for axes in panels}) == 9, "ranges from 1 to 9 have scales of their own"


def test_series_of_like_ranges_share_a_scale():
    t = np.linspace(0.0, 1.0, 20)
    columns = [Series(f"s{i}", "N m", (5 + i) * t) for i in range(9)]
    figure = multiples.draw_multiples(t, columns, "moment")
    assert len({axes.get_ylim() for axes in figure.axes}) == 1
    style.pyplot.close(figure)


def test_of_very_many_series_those_that_vary_most_are_drawn(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run_figures, "MOST_PANELS", 9)
    results = many(tmp_path / "results", 20)
    columns = {f"moment_s{i} [N m]": {"min": -i, "max": i} for i in range(1, 21)}
    (results / "summary.json").write_text(json.dumps({"status": "done", "columns": columns}))
    call(monkeypatch, "run_figures", results, "--format", "svg")
    assert_figures(results / "figures", "moment", formats=("svg",))
    assert "others: --columns 'moment_*'" in capsys.readouterr().out
    text = text_of(results / "figures", "moment")
    assert ">s20<" in text and ">s12<" in text and ">s11<" not in text
    assert "9 of 20: those that vary most" in text
    figures = run_figures.draw_over_time(read_results(results), "columns", list(columns))
    assert [len([axes for axes in figure.axes if axes.get_visible()]) for figure in figures.values()] == [9, 9, 2]
    assert list(figures) == ["moment", "moment_2", "moment_3"]
    style.pyplot.close("all")


def test_no_peak_is_lost_where_rows_are_left_out():
    y = np.random.default_rng(1).random(100_003)
    y[[0, 777, 50_000, 100_001]] = [7.0, -5.0, 9.0, 8.0]
    x = np.linspace(0.0, 1.0, len(y))
    thin_x, thin_y = thin(x, y, 1000)
    assert len(thin_x) < 2100 and (np.diff(thin_x) > 0.0).all()
    assert {7.0, -5.0, 9.0, 8.0} <= set(thin_y) and set(zip(thin_x, thin_y)) <= set(zip(x, y))
    for start in range(0, 99_000, 997):  # what is two pixels wide has the extremes of its middle
        inside = (thin_x >= x[start]) & (thin_x <= x[start + 203])
        assert thin_y[inside].max() >= y[start + 101] >= thin_y[inside].min()
    assert len(thin(x[:4000], y[:4000], 1000)[1]) == 4000


def test_a_curve_keeps_its_ends_and_every_pixel_that_it_crosses():
    angle = np.linspace(0.0, 200.0 * np.pi, 200_000)
    x, y = thin_curve(np.cos(angle), np.sin(angle), 100)
    assert len(x) < 100_000 and (x[0], x[-1]) == (1.0, np.cos(angle[-1]))
    assert np.hypot(np.diff(x), np.diff(y)).max() < 2.0 * np.hypot(0.02, 0.02)
    assert len(thin_curve(np.zeros(10), np.zeros(10), 100)[0]) == 2


def test_a_picture_of_a_hundred_thousand_rows_draws_few_of_them():
    t = np.linspace(0.0, 100.0, 100_000)
    columns = [Series(f"s{i}", "N m", np.sin((100.0 + i) * t)) for i in range(multiples.MOST_PANELS)]
    figure = multiples.draw_multiples(t, columns, "moment")
    lengths = [len(line.get_xdata()) for axes in figure.axes for line in axes.lines]
    assert len(lengths) >= len(columns) and max(lengths) < 10_000


def test_powers_of_ten_stand_above_the_axis(tmp_path):
    figure, axes = style.pyplot.subplots()
    axes.plot([0.0, 1.0], [0.0, 3.0e6])
    style.save(figure, tmp_path, "powers", ["svg"])
    assert ">\N{MULTIPLICATION SIGN}10⁶<" in text_of(tmp_path, "powers")


PHI_A = json.dumps({"columns": [column("t [s]"), column("phi_a [rad]")]})


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (None, "there is no such results folder"),
        ({}, "no trajectory.csv here"),
        ({"trajectory.csv": ""}, "not a table of numbers"),
        ({"trajectory.csv": "t [s],phi_a [rad]\n0,one\n", "columns.json": PHI_A}, "not a table of numbers"),
        ({"trajectory.csv": "a,b\n0,1\n2,3\n"}, "there is no column 't [s]'"),
        ({"trajectory.csv": "t [s],phi_a [rad]\n0,1\n"}, "no columns.json here, as results of older releases have none; compute"),
        ({"trajectory.csv": "t [s],phi_a [rad]\n0,1\n", "columns.json": "{}"}, "this is no columns.json of nocdyn"),
        ({"trajectory.csv": "t [s],phi_b [rad]\n0,1\n", "columns.json": PHI_A}, "columns.json: has no column 'phi_b [rad]'"),
        ({"trajectory.csv": "t [s],phi_a [rad]\n0,1\n", "columns.json": PHI_A}, "nothing to draw: the trajectory has 1 row"),
        ({"trajectory.partial.csv": "t [s],phi_a [rad]\n", "columns.json": PHI_A}, "nothing to draw: the trajectory has 0 row"),
        ({"trajectory.csv": "t [s],phi_a [rad]\n0,1\n1,1\n", "columns.json": PHI_A}, "input.nml: missing"),
        (
            {"trajectory.csv": "t [s]\n0\n1\n", "columns.json": PHI_A, "input.nml": ""},
            "nothing to draw: the trajectory has the time only",
        ),
    ],
)
def test_unusable_results_are_one_clear_line(files, message, tmp_path, monkeypatch):
    folder = tmp_path / "results"
    for name, text in (files or {}).items():
        folder.mkdir(exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    if files == {}:
        folder.mkdir()
    said = refusal(monkeypatch, "run_figures", folder)
    assert message in said and str(folder) in said and "\n" not in said


def test_a_folder_of_load_cases_names_those_of_the_cases(tmp_path, monkeypatch):
    for name in ("start", "ice"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "trajectory.csv").write_text("t [s]\n", encoding="utf-8")
    assert f"draw one of its load cases: {tmp_path / 'ice'}, {tmp_path / 'start'}" in refusal(
        monkeypatch, "run_figures", tmp_path
    )


def test_results_that_cannot_be_read_and_choices_of_nothing_have_exit_codes_of_their_own(tmp_path, capsys):
    results = turning(tmp_path / "results")
    (tmp_path / "empty").mkdir()
    for words, code in (
        (["run", tmp_path / "none"], 3),
        ([tmp_path / "empty"], 3),
        ([results / "trajectory.csv"], 3),
        ([results, "--columns", "zzz*"], 2),
        ([results, "--from", "9", "--to", "10"], 2),
    ):
        assert plot.main([str(word) for word in words]) == code, words
        said = capsys.readouterr().err
        assert said.count("\n") == 1 and said.startswith("nocdyn plot run: ")
        assert ("the folder that it is in is what is drawn" in said) == (words[0] == results / "trajectory.csv")
