"""nocdyn plot sweep: figures of sweeps of every kind, and what it says of folders that it cannot draw."""

import importlib
import importlib.util
import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from figure_files import refusal

SOURCE = Path(os.environ["NOCDYN_SOURCE"])
SIGNATURES = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}

pytestmark = pytest.mark.filterwarnings("error::UserWarning")  # as Matplotlib's of a layout that does not fit
DONE, REFUSED, FAILED = 0, 1, 2
UNITS = {"viscous": "N m s/rad", "cubic_stiffness": "N m/rad3", "stiffness": "N m/rad", "inertia": "kg m2"}
UNITS |= {"frequency": "rad/s", "frequency_hz": "Hz"}

LOAD, CUBIC = "load.work.viscous", "coupling.coupling.cubic_stiffness"
MOMENT, SPEED = "moment_coupling_max_abs", "omega_motor_final"


@pytest.fixture(scope="session", autouse=True)
def python_packages() -> None:
    for package in ("f90nml", "h5netcdf", "h5py", "matplotlib", "numpy", "pandas"):
        if importlib.util.find_spec(package) is None:
            pytest.fail(f"{package} is not installed for {sys.executable}: run scripts/setup figures test", pytrace=False)
    sys.path.insert(0, str(SOURCE / "scripts"))


def unit_of(name: str) -> str:
    if "." in name and not name.endswith("_final"):
        return UNITS[name.rsplit(".", 1)[-1]]
    return "s" if name.endswith("time_of_max") else "N m" if name.startswith("moment") else "rad/s"


def write_sweep(folder: Path, design: str, varied: dict, results: dict, status=None, title: str = "Costs $5") -> Path:
    """A sweep.nc as 'nocdyn sweep' writes it, without what the figures do not need."""
    import h5netcdf

    variants = len(next(iter(varied.values())))
    status = np.zeros(variants, dtype=np.int8) if status is None else np.asarray(status, dtype=np.int8)
    folder.mkdir(exist_ok=True)
    with h5netcdf.File(folder / "sweep.nc", "w") as file:
        file.attrs.update(title=title, design=design)
        file.dimensions = {"variant": variants}
        for role, values_of in (("parameter", varied), ("result", results)):
            for name, values in values_of.items():
                known = status == DONE if role == "result" else True
                variable = file.create_variable(name, ("variant",), data=np.where(known, values, np.nan))
                variable.attrs.update(units=unit_of(name), label=name, role=role, long_name=name)
        file.create_variable("status", ("variant",), data=status)
    write_columns(folder, results)
    return folder


def write_columns(folder: Path, names) -> None:
    """columns.json, as far as the figures need it."""
    entries = [
        {
            "label": f"{name} [{unit_of(name)}]",
            "name": name,
            "kind": "",
            "statistic": "min" if "_min" in name else "final",
            "element_kind": "",
            "element": "",
            "point": "",
            "unit": unit_of(name),
            "caption": "",
        }
        for name in names
    ]
    (folder / "columns.json").write_text(json.dumps({"columns": entries}), encoding="utf-8")


def draw(monkeypatch, capsys, folder: Path, formats: tuple[str, ...] = ("svg",)) -> list[str]:
    """The names of the figures, each of which has been seen in these formats."""
    main = importlib.import_module("nocdyn_report.sweep_figures").main
    monkeypatch.setattr(sys, "argv", ["plot_sweep", str(folder), "--format", ",".join(formats)])
    main()
    names = capsys.readouterr().out.split(f" ({', '.join(formats).upper()})")[0].split(", ")
    for name in names:
        for kind in formats:
            content = (folder / "figures" / f"{name}.{kind}").read_bytes()
            assert content.startswith(SIGNATURES[kind]) and len(content) > 1000, f"{name}.{kind}"
    assert len(list((folder / "figures").iterdir())) == len(names) * len(formats)
    return names


def text_of(folder: Path, figure: str) -> str:
    return (folder / "figures" / f"{figure}.svg").read_text(encoding="utf-8").replace("\\$", "$")


def draw_only(folder: Path, *wanted: str, formats: tuple[str, ...] = ("svg",)) -> list[str]:
    """The texts of these figures in SVG; the others are not written."""
    figures = importlib.import_module("nocdyn_report.sweep_figures")
    sweep = importlib.import_module("nocdyn_report.sweep_results").read_sweep(folder)
    for name, figure in figures.figures_of(sweep):
        if name in wanted:
            figures.add_title(figure, sweep.title, sweep.remark)
            figure.set_layout_engine("none")  # which takes a third of the time
            figures.save(figure, folder / "figures", name, formats)
        else:
            figures.pyplot.close(figure)
    return [text_of(folder, name) for name in wanted if "svg" in formats]


def random_numbers(variants: int, count: int) -> np.ndarray:
    return np.random.default_rng(1).random((count, variants))


def test_random_sweep_of_two_numbers_with_failures_is_drawn(tmp_path, monkeypatch, capsys):
    load, cubic = random_numbers(200, 2)
    status = np.full(200, DONE)
    status[:4], status[4] = FAILED, REFUSED
    folder = write_sweep(tmp_path, "random", {LOAD: load, CUBIC: cubic}, {MOMENT: load - cubic, SPEED: -load}, status)
    assert draw(monkeypatch, capsys, folder, ("png", "svg")) == ["histograms", "influence", "scatter", "map"]
    text = text_of(folder, "scatter")
    assert "Costs $5" in text and "random design, 200 variants, 1 refused, 4 failed" in text
    assert "rank correlation -1.00" in text and "refused or failed" in text
    assert "load.work.viscous" in text and "[N m s/rad]" in text
    assert "moment_coupling_max_abs [N m]" in text_of(folder, "histograms")
    assert "refused or failed" in text_of(folder, "map")


def test_a_sweep_is_drawn_without_its_kind_being_named(tmp_path, capsys):
    numbers = random_numbers(200, 2)
    folder = write_sweep(tmp_path, "random", {LOAD: numbers[0], CUBIC: numbers[1]}, {MOMENT: numbers[0]})
    (folder / "summary.json").write_text("{}")  # as of a run
    assert importlib.import_module("nocdyn_report.plot").main([str(folder), "--format", "png"]) == 0
    assert "histograms" in capsys.readouterr().out


def test_results_are_named_in_words_and_units_as_in_bands(tmp_path):
    folder = write_sweep(tmp_path, "random", {LOAD: np.arange(9.0), CUBIC: 1e5 + np.arange(9.0)}, {MOMENT: 2e4 + np.arange(9.0)})
    names = {"element_kind": "coupling", "element": "coupling", "caption": "elastic moment"}
    entry = json.loads((folder / "columns.json").read_text())["columns"][0] | names
    entry |= {"label": f"{MOMENT} [N m]", "long_name": "moment_coupling, all orders: largest value"}
    (folder / "columns.json").write_text(json.dumps({"columns": [entry]}))
    histograms, scatter, influence = draw_only(folder, "histograms", "scatter", "influence")
    assert ">coupling, elastic moment, all orders: largest value<" in histograms and ">largest value [kN m]<" in histograms
    assert "median: 20.004 kN m<" in histograms and "[kN m/rad3]" in scatter
    assert MOMENT not in histograms + scatter + influence


def test_percentiles_are_those_of_the_printed_summary(tmp_path):
    order = np.random.default_rng(1).permutation(101)
    folder = write_sweep(tmp_path, "random", {LOAD: order}, {MOMENT: order + 1.0})
    [text] = draw_only(folder, "histograms")
    assert "5 %: 6 N m<" in text and "median: 51 N m<" in text and "95 %: 96 N m<" in text


def test_percentiles_that_differ_little_are_told_apart(tmp_path):
    order = np.random.default_rng(1).permutation(101)
    folder = write_sweep(tmp_path, "random", {LOAD: order}, {MOMENT: 1e4 + 1e-5 * order, SPEED: np.full(101, 100.0 / 3.0)})
    [text] = draw_only(folder, "histograms")
    assert "5 %: 10.00000005 kN m<" in text and "median: 10.0000005 kN m<" in text and "95 %: 10.00000095 kN m<" in text
    assert "5 %: 33.333 rad/s<" in text and "95 %: 33.333 rad/s<" in text


@pytest.mark.parametrize(
    ("extremes", "words"),
    [
        ({7: 1e9}, ["1 further out,", "up to 1e+09 N m"]),
        ({7: -1e9}, ["1 further out,", "down to -1e+09 N m"]),
        ({7: -1e6, 8: 1e9, 9: -1e7}, ["3 further out,", "down to -1e+07 N m,", "up to 1e+09 N m"]),
    ],
)
def test_outliers_are_counted_beside_the_histogram(extremes, words, tmp_path):
    values = np.linspace(0.0, 1.0, 100)
    values[list(extremes)] = list(extremes.values())
    folder = write_sweep(tmp_path, "random", {LOAD: np.arange(100.0), CUBIC: np.arange(100.0)}, {MOMENT: values})
    text, scatter = draw_only(folder, "histograms", "scatter")
    assert all(f">{word}<" in text for word in words) and text.count(" to ") == len(words) - 1
    assert "triangles: beyond the axis" in scatter


def test_grid_of_two_numbers_is_a_heat_map(tmp_path, monkeypatch, capsys):
    load, cubic = (axis.ravel() for axis in np.meshgrid(np.linspace(50, 150, 5), [0.0, 10.0, 20.0], indexing="ij"))
    status = np.where(load + cubic > 160.0, REFUSED, DONE)
    folder = write_sweep(tmp_path, "grid", {LOAD: load, CUBIC: cubic}, {MOMENT: load * cubic}, status)
    assert draw(monkeypatch, capsys, folder) == ["histograms", "scatter", "map"]
    panels = importlib.import_module("nocdyn_report.sweep_panels")
    results = importlib.import_module("nocdyn_report.sweep_results")
    sweep = results.read_sweep(folder)
    x, y, cells = panels.grid_cells(sweep, sweep.results[0])
    assert x == pytest.approx([37.5, 62.5, 87.5, 112.5, 137.5, 162.5]) and y == pytest.approx([-5.0, 5.0, 15.0, 25.0])
    assert cells[1, 2] == 100.0 * 10.0 and cells.mask.sum() == 1 and cells.mask[2, 4]


def grid_of(*axes) -> list[np.ndarray]:
    return [axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")]


def test_extremes_of_a_grid_are_drawn(tmp_path):
    load, cubic = grid_of(np.linspace(50, 150, 20), np.arange(10.0))
    moment = np.where((load == 150) & (cubic == 0), 1e6, 100.0 + load)
    folder = write_sweep(tmp_path, "grid", {LOAD: load, CUBIC: cubic}, {MOMENT: moment, SPEED: -moment})
    histograms, scatter = draw_only(folder, "histograms", "scatter")
    assert "further out" not in histograms and "triangles" not in scatter
    figures = importlib.import_module("nocdyn_report.sweep_figures")
    sweep = importlib.import_module("nocdyn_report.sweep_results").read_sweep(folder)
    panels = figures.draw_maps(sweep, sweep.results).axes
    scales = [(norm.vmin, norm.vmax, type(norm).__name__) for axes in panels[:2] for norm in [axes.collections[0].norm]]
    assert scales == [(150.0, 1e6, "LogNorm"), (-1e6, -150.0, "Normalize")]


def test_resonances_for_few_values_of_a_second_number_are_a_family_of_curves(tmp_path, monkeypatch, capsys):
    frequency, load = grid_of(np.linspace(0.5, 12.0, 116), [1.0, 2.0, 4.0])
    moment = 1.0 / np.abs(6.4 + 0.1j * load - frequency)
    varied = {"excitation.shaker.frequency": frequency, LOAD: load}
    folder = write_sweep(tmp_path / "few", "grid", varied, {MOMENT: moment, "moment_coupling_time_of_max": frequency})
    assert draw(monkeypatch, capsys, folder) == ["resonance", "map"]
    text = text_of(folder, "resonance")
    assert ">1: largest 10 N m at 6.4 rad/s<" in text and ">4: largest 2.5 N m at 6.4 rad/s<" in text
    assert text.count("largest 5 N m") == 1 and ">2<" in text, "the latest of times is no peak"
    assert "load.work.viscous" in text and "dots: the extremes of the curves" in text and "frequency [Hz]" in text

    frequency, load = grid_of(np.linspace(0.5, 12.0, 10), np.arange(9.0))
    folder = write_sweep(tmp_path / "many", "grid", {LOAD: load, "excitation.shaker.frequency": frequency}, {MOMENT: frequency})
    assert draw(monkeypatch, capsys, folder) == ["histograms", "scatter", "map"]


def test_influence_is_shown_as_bars_the_strongest_first(tmp_path):
    numbers = random_numbers(400, 20)
    varied = {f"body.rotor{i}.inertia": row for i, row in enumerate(numbers)}
    folder = write_sweep(tmp_path, "random", varied, {MOMENT: numbers[5] - 3.0 * numbers[11], SPEED: np.ones(400)})
    assert "15 of 20 varied numbers" in draw_only(folder, "influence")[0]
    modules = [importlib.import_module(f"nocdyn_report.sweep_{name}") for name in ("figures", "influence", "results")]
    sweep = modules[2].read_sweep(folder)
    figure = modules[0].draw_influences(sweep, sweep.results, modules[1].Influence(sweep))
    bars = [bar.get_width() for bar in figure.axes[0].patches if bar.get_height() == 0.7]
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert len(bars) == 15 and names[:2] == ["body.rotor11.inertia", "body.rotor5.inertia"]
    assert bars[0] < -0.9 and 0.2 < bars[1] < 0.4 and max(map(abs, bars[2:])) < 0.2
    assert not any(bar.get_width() for bar in figure.axes[1].patches if bar.get_height() == 0.7), "a constant depends on nothing"


def test_many_scattered_variants_become_shades_and_contours(tmp_path):
    load, cubic = random_numbers(25_000, 2)
    status = np.where(load > 0.99, FAILED, DONE)
    folder = write_sweep(tmp_path, "sobol", {LOAD: load, CUBIC: cubic}, {MOMENT: load + cubic**2}, status)
    histograms, influence, scatter, scatter_map = draw_only(folder, "histograms", "influence", "scatter", "map")
    assert "25 000 variants" in histograms and "25 000 variants" in influence
    assert "Sobol design, 25 000 variants" in scatter_map
    assert "darker: more variants" in scatter
    assert "failed (one in 3 is shown)" in scatter
    draw_only(folder, "scatter", formats=("pdf",))
    assert (folder / "figures" / "scatter.pdf").stat().st_size < 200_000


def test_frequency_alone_gives_a_resonance_curve_with_its_peak(tmp_path, monkeypatch, capsys):
    frequency = np.random.default_rng(1).permutation(np.linspace(0.5, 12.0, 116))
    moment = 1.0 / np.abs(6.4 + 0.1j - frequency)
    folder = write_sweep(
        tmp_path,
        "grid",
        {"excitation.shaker.frequency": frequency},
        {MOMENT: moment, "moment_coupling_time_of_max": frequency, "moment_coupling_min_from_2": -moment},
        np.where(frequency > 11.0, FAILED, DONE),
    )
    assert draw(monkeypatch, capsys, folder) == ["resonance"]
    text = text_of(folder, "resonance")
    assert "largest: 10 N m" in text and "at 6.4 rad/s = 1.019 Hz" in text and "frequency [Hz]" in text
    assert "excitation.shaker.frequency [rad/s]" in text
    assert text.count("largest: ") == 1, "the latest of times is no peak"
    assert "smallest: -10 N m" in text and text.count("at 6.4 rad/s = 1.019 Hz") == 2


def test_a_frequency_in_hz_gives_a_resonance_curve_with_one_scale(tmp_path, monkeypatch, capsys):
    frequency = np.linspace(0.5, 12.0, 116)
    moment = 1.0 / np.abs(6.4 + 0.1j - frequency)
    folder = write_sweep(tmp_path, "grid", {"excitation.shaker.frequency_hz": frequency}, {MOMENT: moment})
    assert draw(monkeypatch, capsys, folder) == ["resonance"]
    text = text_of(folder, "resonance")
    assert "at 6.4 Hz" in text and "6.4 Hz =" not in text and "frequency [Hz]" not in text


def test_another_number_alone_gives_curves(tmp_path, monkeypatch, capsys):
    folder = write_sweep(tmp_path, "latin", {LOAD: np.geomspace(1.0, 1e6, 40)}, {MOMENT: np.linspace(0.0, 1.0, 40)})
    assert draw(monkeypatch, capsys, folder) == ["histograms", "curves"]
    assert "Latin design" in text_of(folder, "curves") and "largest" not in text_of(folder, "curves")


def test_many_numbers_and_results_go_on_in_further_figures(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("nocdyn_report.sweep_figures.ROWS", 2)
    monkeypatch.setattr("nocdyn_report.sweep_figures.COLUMNS", 2)
    numbers = random_numbers(150, 3)
    varied = {f"body.rotor{i}.inertia": row for i, row in enumerate(numbers)}
    results = {f"omega_rotor{i}_final": numbers[2 - i % 2] + 0.01 * numbers[0] for i in range(3)}
    folder = write_sweep(tmp_path, "latin", varied, results, np.arange(150) % 50 == 0)
    assert draw(monkeypatch, capsys, folder) == [
        "histograms",
        "histograms_2",
        "influence",
        "influence_2",
        "scatter",
        "scatter_2",
        "parallel",
        "parallel_2",
    ]
    text = text_of(folder, "scatter_2")  # of the third result, which is the third number with some of the first
    assert "body.rotor2.inertia" in text and "body.rotor0.inertia" in text and "body.rotor1.inertia" not in text
    assert "of 3 varied numbers the 2 most correlated with the result" in text


def test_what_chance_gives_is_said_to_be_grey(tmp_path):
    numbers = random_numbers(1000, 2)
    folder = write_sweep(tmp_path, "random", {"body.a.inertia": numbers[0], "body.b.inertia": numbers[1]}, {SPEED: numbers[0]})
    assert "grey: no more than chance alone gives" in draw_only(folder, "scatter")[0]
    panels = importlib.import_module("nocdyn_report.sweep_panels")
    pairs = np.split(random_numbers(1000, 400), 200)
    beyond = sum(abs(panels.rank_correlation(*pair)) > panels.chance(1000) for pair in pairs)
    assert 3 <= beyond <= 20  # 5 % of 200, give or take three deviations


def test_a_file_is_not_a_folder(tmp_path, monkeypatch):
    numbers = random_numbers(10, 2)
    folder = write_sweep(tmp_path, "random", {"body.a.inertia": numbers[0]}, {SPEED: numbers[1]})
    said = refusal(monkeypatch, "sweep_figures", folder / "sweep.nc")
    assert "is a file; the folder that it is in is what is drawn" in said


def test_parallel_axes_say_what_they_leave_out(tmp_path):
    numbers = random_numbers(1000, 12)
    varied = {f"body.rotor{i}.inertia": row for i, row in enumerate(numbers)}
    folder = write_sweep(tmp_path, "latin", varied, {SPEED: numbers[11]}, np.where(numbers[0] < 0.05, FAILED, DONE))
    [text] = draw_only(folder, "parallel")
    assert "500 of 1000 variants are drawn; 10 of 12 varied numbers, the most correlated first" in text
    assert "body.rotor11." in text
    assert "failed (one in 3 is shown)" in text


@pytest.mark.parametrize(
    ("load", "cubic"),
    [
        (np.ones(1), np.zeros(1)),
        (np.ones(3000), np.arange(3000.0)),
        (np.arange(3000.0), np.arange(3000.0)),
        (np.geomspace(1e-3, 1e3, 3000), np.random.default_rng(1).random(3000)),
    ],
)
def test_awkward_lists_are_drawn(load, cubic, tmp_path, monkeypatch, capsys):
    folder = write_sweep(tmp_path, "list", {LOAD: load, CUBIC: cubic}, {MOMENT: cubic, SPEED: 0.0 * load})
    assert draw(monkeypatch, capsys, folder) == ["histograms", "influence", "scatter", "map"]
    assert "constant" in text_of(folder, "scatter")


def test_results_that_done_variants_do_not_have_are_left_out(tmp_path):
    load, cubic = random_numbers(100, 2)
    partly = np.where(load < 0.1, np.nan, load)
    folder = write_sweep(tmp_path, "random", {LOAD: load, CUBIC: cubic}, {MOMENT: partly, SPEED: np.full(100, np.nan)})
    histograms, scatter = draw_only(folder, "histograms", "scatter")
    assert "rank correlation +1.00" in scatter and SPEED not in histograms


def test_table_is_drawn_where_there_is_no_netcdf_file(tmp_path, monkeypatch, capsys):
    (tmp_path / "input.nml").write_text("""&case title = 'From a table' /
&body name = 'rotor' inertia = 1.0 /
&load name = 'work' body = 'rotor' /
&sweep design = 'list' file = 'list.csv' /
""")
    (tmp_path / "sweep.csv").write_text(
        f"variant,{LOAD} [N m s/rad],body.rotor.teeth,{MOMENT} [N m],omega_a.b_final [rad/s],status,steps,reason\n"
        '1,50.0,20,3.5,1.0,done,100,\n2,60.0,21,,,failed,90,"too, many steps"\n3,70.0,22,4.5,2.0,done,95,\n'
    )
    write_columns(tmp_path, [MOMENT, "omega_a.b_final"])
    assert draw(monkeypatch, capsys, tmp_path) == ["histograms", "influence", "scatter", "map"]
    text = text_of(tmp_path, "scatter")
    assert "From a table" in text and "list design, 3 variants, 1 failed" in text and "body.rotor.teeth<" in text
    assert "omega_a.b_final [rad/s]" in text


@pytest.mark.parametrize(
    "store",
    [
        # as the NetCDF library does it: UTF-8 that is marked as ASCII
        lambda text: np.bytes_(text.encode()),
        lambda text: np.bytes_(text.encode("latin-1")),
        lambda text: text,
    ],
)
def test_names_beyond_ascii_are_drawn(store, tmp_path):
    import h5py

    folder = write_sweep(tmp_path, "random", {LOAD: np.arange(9.0), CUBIC: np.arange(9.0)}, {MOMENT: np.arange(9.0)})
    with h5py.File(folder / "sweep.nc", "r+") as file:
        file.attrs["title"] = store("Größe")
        file[MOMENT].attrs["label"] = store("moment_größe_final")
        file[MOMENT].attrs["long_name"] = store("moment_größe, at the end")
    [text] = draw_only(folder, "histograms")
    assert "Größe" in text and "moment_größe_final [N m]" in text and "moment_größe, at the end" in text


def test_only_the_formats_that_are_asked_for_are_written(tmp_path, monkeypatch, capsys):
    folder = write_sweep(tmp_path, "grid", {LOAD: np.arange(9.0)}, {MOMENT: np.arange(9.0)})
    main = importlib.import_module("nocdyn_report.sweep_figures").main
    files = {"png": ["curves.png"], "svg,PDF": ["curves.pdf", "curves.svg"], None: ["curves.pdf", "curves.png", "curves.svg"]}
    for number, (kinds, names) in enumerate(files.items()):
        out = tmp_path / str(number)
        monkeypatch.setattr(sys, "argv", ["plot_sweep", str(folder), "--out", str(out), *(["--format", kinds] if kinds else [])])
        main()
        assert sorted(path.name for path in out.iterdir()) == names
    monkeypatch.setattr(sys, "argv", ["plot_sweep", str(folder), "--format", "png,tiff"])
    capsys.readouterr()
    with pytest.raises(SystemExit) as leaving:
        main()
    assert leaving.value.code == 2 and "'tiff' is none of png, svg, pdf" in capsys.readouterr().err


D = {
    "columns.json": json.dumps(
        {"columns": [dict.fromkeys(("name", "kind", "element_kind", "element", "point", "unit", "caption"), "") | {"label": "d"}]}
    )
}


@pytest.mark.parametrize(
    ("files", "message"),
    [
        (None, "there is no such results folder"),
        ({}, "no sweep.nc or sweep.csv here"),
        ({"sweep.journal": ""}, "the sweep is not finished; 'nocdyn sweep --resume' goes on with it"),
        ({"sweep.nc": "no NetCDF"}, "sweep.nc: cannot be read: "),
        ({"sweep.csv": ""}, "sweep.csv: not the table of a sweep: "),
        ({"sweep.csv": "t [s],phi_a [rad]\n0,1\n"}, "sweep.csv: not the table of a sweep: "),
        ({"sweep.csv": "variant,a.b.c,d,status\n1,1,one,done\n"}, "sweep.csv: not the table of a sweep: "),
        (
            {"sweep.csv": "variant,a.b.c,d,status\n1,1,1,well\n"},
            "sweep.csv: not the table of a sweep: the status 'well' is none of done, refused, failed",
        ),
        ({"sweep.csv": "variant,a.b.c,d,status\n1,1,1,done\n"}, "input.nml: missing; the figures of a table need the input"),
        (
            {"sweep.csv": "variant,a.b.c,d,status\n1,1,1,done\n", "input.nml": "&run t_end = 1.0 /\n"},
            "input.nml: this is not the input of a sweep",
        ),
        (
            {"sweep.csv": "variant,a.b.c,d,status\n1,1,1,done\n", "input.nml": "&a b = 1 /\n&sweep design = 'random' /\n"},
            "no columns.json here, as results of older releases have none; compute the results again",
        ),
        (
            {"sweep.csv": "variant,a.b.c,d,status\n1,1,,failed\n", "input.nml": "&a b = 1 /\n&sweep design = 'random' /\n"} | D,
            "nothing to draw: none of the 1 variants was done",
        ),
        (
            {"sweep.csv": "variant,a.b.c,d,status\n1,1,,done\n", "input.nml": "&a b = 1 /\n&sweep design = 'random' /\n"} | D,
            "nothing to draw: no variant has any of the results",
        ),
        (
            {"sweep.csv": "variant,a.b.c,status\n1,1,done\n", "input.nml": "&a b = 1 /\n&sweep design = 'random' /\n"} | D,
            "nothing to draw: the sweep has 1 varied numbers and 0 results",
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
    said = refusal(monkeypatch, "sweep_figures", folder)
    assert said.startswith("nocdyn plot sweep: ") and message in said and str(folder) in said and "\n" not in said


def test_netcdf_file_of_something_else_is_refused(tmp_path, monkeypatch):
    import h5netcdf

    with h5netcdf.File(tmp_path / "sweep.nc", "w") as file:
        file.dimensions = {"time": 2}
        file.create_variable("pressure", ("time",), data=np.zeros(2))
    assert "this is no sweep.nc of nocdyn: status is missing" in refusal(monkeypatch, "sweep_figures", tmp_path)
