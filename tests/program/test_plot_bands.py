"""nocdyn plot sweep: the bands of curves over the speed."""

import importlib
import subprocess

import numpy as np
import pytest
from figure_files import NOCDYN, refusal
from sweep_inputs import needs_sweeps

pytestmark = [needs_sweeps, pytest.mark.filterwarnings("error::UserWarning")]

MACHINE = """\
&case title = 'Two rotors' /
&body name = 'one' inertia = 3 /
&body name = 'two' inertia = 2 /
&coupling name = 'shaft' bodies = 'one', 'two' stiffness = 5e4 damping = 40 diameter = 0.1 /
&excitation name = 'x' body = 'one' kind = 'orders' orders = 2, 3 amplitudes = 70, 20 /
&run t_end = 1 /
&response body = 'one' speed_rpm = 600, 1400 count = 41 operating_rpm = 700, 800 margin = 0.1 /
&limit coupling = 'shaft' vibratory_moment = LIMIT /
&sweep design = 'latin' samples = 40 seed = 2 /
&vary target = 'coupling.shaft.stiffness' scale = 'relative' distribution = 'normal' mean = 1 deviation = 0.05 /
&vary target = 'coupling.shaft.damping' scale = 'relative' low = 0.7 high = 1.4 /
"""
CURVES = """\
&record response = 'shaft' statistic = 'curve' /
&record response = 'shaft' order = 2 statistic = 'curve' /
&record response = 'stress_shaft' statistic = 'curve' /
&record mode = 1 statistic = 'curve' /
"""
CROSSING = "&record mode = 1 order = 2 statistic = 'crossing' /\n"


def swept(folder, limit=300, records=CURVES + CROSSING):
    (folder / "machine.nml").write_text(MACHINE.replace("LIMIT", str(limit)) + records)
    words = [NOCDYN, "sweep", folder / "machine.nml", "--out", folder / "swept", "--csv", "-q"]
    outcome = subprocess.run(words, capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr
    return folder / "swept"


def draw(monkeypatch, capsys, folder, out):
    """The names of the figures, and the text of each."""
    main = importlib.import_module("nocdyn_report.sweep_figures").main
    monkeypatch.setattr("sys.argv", ["nocdyn plot sweep", str(folder), "--format", "svg", "--out", str(out)])
    main()
    names = capsys.readouterr().out.split(" (SVG)")[0].split(", ")
    return {name: (out / f"{name}.svg").read_text(encoding="utf-8") for name in names}


def test_bands_are_drawn_of_the_file_and_of_the_table(tmp_path, monkeypatch, capsys):
    folder = swept(tmp_path)
    found = draw(monkeypatch, capsys, folder, tmp_path / "a")
    assert list(found)[:3] == ["bands", "bands_2", "campbell_bands"] and "histograms" in found
    assert ">shaft: half range<" in found["bands"] and ">shaft: amplitude of order 2<" in found["bands"]
    assert "stress [MPa]" in found["bands_2"], "in an axis of its own"
    for text in ("half of the variants", "machine of the input", "limit in continuous operation", "in operation: 700 to 800 rpm"):
        assert text in found["bands"]
    crossing = np.quantile(read(folder).results[0].values * 30 / np.pi, (0.05, 0.95))
    assert f"I/2: {crossing[0]:.4g}\N{EN DASH}{crossing[1]:.4g}" in found["campbell_bands"]
    (folder / "sweep.nc").unlink()
    assert draw(monkeypatch, capsys, folder, tmp_path / "b").keys() == found.keys()


def read(folder):
    return importlib.import_module("nocdyn_report.sweep_results").read_sweep(folder)


def test_the_share_of_variants_above_the_limit_is_told(tmp_path, monkeypatch, capsys):
    largest = read(swept(tmp_path, records=CURVES)).curves[0].values.max(axis=1)
    limit = float(np.quantile(largest, 0.8))
    found = draw(monkeypatch, capsys, swept(tmp_path, limit, CURVES), tmp_path / "near")
    assert f"{100 * (largest > limit).mean():.0f} % of the variants exceed the limit" in found["bands"]
    found = draw(monkeypatch, capsys, swept(tmp_path, 1.2 * largest.max(), CURVES), tmp_path / "above")
    assert "no variant exceeds the limit" in found["bands"]
    found = draw(monkeypatch, capsys, swept(tmp_path, 4 * largest.max(), CURVES), tmp_path / "far")
    assert "is above" in found["bands"] and "exceed" not in found["bands"]


def test_one_order_is_judged_by_a_limit_of_one_order_alone(tmp_path, monkeypatch, capsys):
    order = "&record response = 'shaft' order = 2 statistic = 'curve' /\n"
    found = draw(monkeypatch, capsys, swept(tmp_path, 300, order), tmp_path / "all")
    assert "limit" not in found["bands"]
    largest = read(tmp_path / "swept").curves[0].values.max()
    limit = f"1e4 vibratory_frequency = 1, 1e3 vibratory_moments = 2*{1.1 * largest}"
    found = draw(monkeypatch, capsys, swept(tmp_path, limit, order), tmp_path / "one")
    assert "no variant exceeds the limit of one order" in found["bands"]


def test_curves_alone_are_enough_for_figures(tmp_path, monkeypatch, capsys):
    found = draw(monkeypatch, capsys, swept(tmp_path, records="&record mode = 1 statistic = 'curve' /\n"), tmp_path / "a")
    assert list(found) == ["campbell_bands"]
    assert "I/2" not in found["campbell_bands"] and "order within 90 % of a mode" in found["campbell_bands"]


def test_a_sweep_without_its_bands_is_refused(tmp_path, monkeypatch):
    folder = swept(tmp_path)
    (folder / "bands.csv").unlink()
    said = refusal(monkeypatch, "sweep_figures", folder)
    assert "no bands.csv here, which 'nocdyn sweep' writes beside the curves; compute the results again" in said
