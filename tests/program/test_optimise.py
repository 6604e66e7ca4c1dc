"""nocdyn optimise: closed forms of dampers, catalogues and limits against all choices one by one, refusals."""

import csv
import json

import numpy as np
import pytest

DAMPER = """\
&body name = 'disc' inertia = 1.0 /
&body name = 'ring' inertia = {mass!r} /
&coupling name = 'shaft' bodies = 'ground', 'disc' stiffness = {stiffness!r} /
&coupling name = 'link' bodies = 'disc', 'ring' stiffness = {link!r} damping = 5.0 /
&excitation name = 'shaker' body = 'disc' amplitude = 2.0 frequency = 90 /
&response excitation = 'shaker' frequency = {low!r}, {high!r} /
&objective response = 'shaft' statistic = 'peak' /
&design target = 'coupling.link.damping' low = 0.5 high = 500 /
&run t_end = 1 /
"""
PUMP = """\
&body name = 'engine' inertia = 4.0 speed_rpm = 900 /
&body name = 'flywheel' inertia = 6.0 /
&body name = 'pump' inertia = 1.5 /
&coupling name = 'crank' bodies = 'engine', 'flywheel' stiffness = 2.0e6 damping = 120.0 /
&coupling name = 'rubber' bodies = 'flywheel', 'pump' kind = 'rubber' catalogue_file = 'sizes.csv' size = '25' limits = .true. /
&motor name = 'mean' body = 'engine' kind = 'constant' torque = 150.0 /
&load name = 'water' body = 'pump' quadratic = 0.017 /
&excitation name = 'firing' body = 'engine' kind = 'orders' orders = 2.0, 4.0 amplitudes = 300.0, 80.0 /
&response body = 'engine' speed_rpm = 200, 1500 count = 60 /
&objective response = 'rubber' statistic = 'peak' /
&design target = 'coupling.rubber.size' /
&design target = 'body.pump.inertia' low = 1.2 high = 1.8 step = 0.3 /
&run t_end = 1.0 /
"""
SIZES = """\
size, stiffness [kN m/rad], relative damping, vibratory torque [N m], maximum torque [N m]
10, 6, 0.8, 60,
16, 9, 0.8, , 2000
25, 12, 0.9, 250, 2000
40, 20, 0.9, 320, 2000
"""


def optimise(nocdyn, text, *words, folder="out"):
    outcome = nocdyn("optimise", nocdyn.write("a.nml", text), "--out", "out", *words)
    assert outcome.returncode == 0, outcome.stderr
    return json.loads((nocdyn.folder / folder / "optimise.json").read_text())


def candidates(nocdyn):
    with (nocdyn.folder / "out/optimise.csv").open() as file:
        return list(csv.DictReader(file))


def best(report):
    return {one["target"]: one["best"] for one in report["numbers"]}


def response_peak(mass, stiffness, link, damping):
    """The largest amplification of the disc."""
    w = np.sqrt(stiffness) * np.linspace(0.5, 1.5, 400001)
    d = link + 1j * w * damping
    return np.max(stiffness * abs((d - mass * w**2) / ((stiffness - w**2 + d) * (d - mass * w**2) - d**2)))


@pytest.mark.parametrize("mass", [0.2, 0.07])
def test_houdaille(nocdyn, mass):
    """The best damping of a damper without a spring, and its amplification (J. P. Den Hartog, Mechanical Vibrations, 3.3)."""
    omega = 130.0 if mass < 0.1 else 100.0
    text = DAMPER.format(mass=mass, stiffness=omega**2, link=0.0, low=0.3 * omega, high=2 * omega)
    report = optimise(nocdyn, text)
    zeta = best(report)["coupling.link.damping"] / (2 * mass * omega)
    assert zeta == pytest.approx(1 / np.sqrt(2 * (1 + mass) * (2 + mass)), rel=1e-4)
    assert report["objectives"][0]["best"] == pytest.approx(2 * (2 + mass) / mass, rel=1e-6)


def test_tuned_damper(nocdyn):
    """Two numbers: both peaks are equally high."""
    mass, omega = 0.13, 100.0
    text = DAMPER.format(mass=mass, stiffness=omega**2, link=600.0, low=0.3 * omega, high=2 * omega)
    report = optimise(nocdyn, text + "&design target = 'coupling.link.stiffness' low = 100 high = 5000 /\n")
    link, damping = (best(report)[f"coupling.link.{key}"] for key in ("stiffness", "damping"))
    lowest = response_peak(mass, omega**2, link, damping)
    assert report["objectives"][0]["best"] / 2 == pytest.approx(lowest, rel=1e-6)
    for angle in np.arange(0, 2 * np.pi, np.pi / 8):  # all neighbours are worse
        near = response_peak(mass, omega**2, link * (1 + 1e-3 * np.cos(angle)), damping * (1 + 1e-3 * np.sin(angle)))
        assert near > lowest * (1 - 1e-7)


def test_margins(nocdyn):
    """A critical speed above and one below the speeds in operation: at best both are equally far."""
    low, high = 40.0, 70.0
    text = f"""\
&body name = 'a' inertia = 2 speed = 50 /
&body name = 'b' inertia = 3 /
&coupling name = 'c' bodies = 'a', 'b' stiffness = 1e4 damping = 1 /
&excitation name = 'e' body = 'a' kind = 'orders' orders = 1, 3 amplitudes = 1, 1 /
&response body = 'a' speed = 5, 150 operating = {low}, {high} /
&objective goal = 'maximise' mode = 1 order = 1 statistic = 'crossing_margin' /
&objective goal = 'maximise' mode = 1 order = 3 statistic = 'crossing_margin' /
&design target = 'coupling.c.stiffness' low = 5e3 high = 2e4 /
&run t_end = 1 /
"""
    report = optimise(nocdyn, text)
    omega = 2 / (1 / high + 1 / (3 * low))
    damping = 1 / 2 + 1 / 3  # over the inertias: the frequency is the damped one
    stiffness = (omega**2 + (damping / 2) ** 2) / damping
    assert best(report)["coupling.c.stiffness"] == pytest.approx(stiffness, rel=1e-5)
    assert [one["best"] for one in report["objectives"]] == pytest.approx([omega / high - 1] * 2, rel=1e-5)


def test_catalogue_with_limits(nocdyn):
    """Every size with every inertia, as nocdyn response has each of them; the best one of those that keep their limits."""
    nocdyn.write("sizes.csv", SIZES)
    report = optimise(nocdyn, PUMP)
    rows = candidates(nocdyn)
    assert len(rows) == 12
    known = {}
    for size in ("10", "16", "25", "40"):
        for inertia in (1.2, 1.5, 1.8):
            settings = ("--set", f"coupling.rubber.size='{size}'", "--set", f"body.pump.inertia={inertia!r}")
            assert nocdyn("response", "a.nml", "--out", "one", "--quiet", *settings).returncode == 0
            one = json.loads((nocdyn.folder / "one/response.json").read_text())
            ratios = [line["ratio"] for line in one["verdict"]["lines"] if "moment, continuous" in line["criterion"]]
            with (nocdyn.folder / "one/response.csv").open() as file:
                peak = max(float(row["half_range_moment_rubber [N m]"]) for row in csv.DictReader(file))
            known[size, inertia] = peak, max(ratios, default=0.0)
    for row in rows:
        peak, ratio = known[row["coupling.rubber.size"], float(row["body.pump.inertia [kg m2]"])]
        assert float(row["moment_rubber_peak [N m]"]) == pytest.approx(peak, rel=1e-12)
        of_limit = row["coupling 'rubber', moment, continuous [of limit]"]
        assert float(of_limit or 0) == pytest.approx(ratio, rel=1e-12)
    allowed = {choice: peak for choice, (peak, ratio) in known.items() if ratio <= 1}
    assert len(allowed) < 12
    size, inertia = min(allowed, key=allowed.get)
    assert report["sizes"][0]["best"] == size
    assert best(report)["body.pump.inertia"] == inertia
    assert nocdyn("response", "out/optimised.nml", "--out", "again", "--quiet", "--strict").returncode == 0


def test_limit_of_a_run(nocdyn):
    """A twist that a limit of the moment keeps from being smaller; a run of optimised.nml has that moment."""
    text = """\
&body name = 'motor' inertia = 2.0 /
&body name = 'fan' inertia = 10.0 /
&coupling name = 'c' bodies = 'motor', 'fan' stiffness = 5000 damping = 20 /
&excitation name = 'switch' body = 'motor' kind = 'step' amplitude = 500 time = 0.05 /
&load name = 'work' body = 'fan' viscous = 5 /
&limit coupling = 'c' moment = 700 /
&objective quantity = 'twist_c' statistic = 'max_abs' /
&design target = 'coupling.c.stiffness' low = 1000 high = 1e5 /
&load_case name = 'half' set = 'excitation.switch.amplitude=250' /
&load_case name = 'full' set = 'excitation.switch.amplitude=500' /
&run t_end = 1.0 rtol = 1e-9 /
"""
    report = optimise(nocdyn, text, "--case", "full", folder="out/full")
    assert report["limits"][0]["ratio"] == pytest.approx(1, abs=1e-5)
    assert "a limit is what keeps it" in " ".join(report["notes"])
    assert nocdyn("run", "out/full/optimised.nml", "--out", "again", "--quiet").returncode == 0
    summary = json.loads((nocdyn.folder / "again/summary.json").read_text())
    column = next(values for name, values in summary["columns"].items() if name.startswith("total_moment_c"))
    assert max(abs(column["max"]), abs(column["min"])) == pytest.approx(700, rel=1e-5)


def test_no_choice_keeps_limits(nocdyn):
    nocdyn.write("sizes.csv", SIZES.replace("250", "50").replace("320", "100").replace("0.8, ,", "0.8, 40,"))
    report = optimise(nocdyn, PUMP)
    assert not report["keeps_limits"]
    assert "no choice keeps all limits" in report["notes"][0]
    rows = candidates(nocdyn)
    ratios = [float(row["coupling 'rubber', moment, continuous [of limit]"]) for row in rows]
    assert [row["best"] for row in rows].index("yes") == ratios.index(min(ratios))


def test_input_better_than_choices(nocdyn):
    """A note names the number of the input that is not to be had, and steps that do not reach the highest value."""
    nocdyn.write("sizes.csv", SIZES.replace("250", "400"))
    own = PUMP.replace("coupling.rubber.size' /", "coupling.rubber.size' sizes = '25' /")
    assert optimise(nocdyn, own)["notes"] == []
    report = optimise(nocdyn, own, "--set", "design(2).step=5", "--set", "design(2).low=1.6")
    peak = report["objectives"][0]
    assert peak["before"] < peak["best"]
    first, steps = report["notes"]
    assert first.startswith(f"the input is better than the best choice, moment_rubber_peak {peak['before']:.7g} against ")
    assert first.endswith(": body.pump.inertia = 1.5 is not among its values")
    assert steps == "body.pump.inertia has one value only, low = 1.6: the step is larger than the range to high = 1.8"
    report = optimise(nocdyn, own, "--set", "design(2).step=0.4")
    assert "the steps from low = 1.2 do not reach high = 1.8; its highest value is 1.6" in report["notes"][-1]
    report = optimise(nocdyn, own, "--set", "design(1).sizes='10'", "--set", "design(2).low=1.6", "--set", "design(2).step=0.2")
    assert "it exceeds limits less" in report["notes"][0]
    assert "coupling.rubber.size = '25' is not among its sizes; body.pump.inertia = 1.5 is not" in report["notes"][0]
    between = DAMPER.format(mass=0.2, stiffness=1e4, link=0.0, low=30, high=200).replace("low = 0.5", "low = 60")
    report = optimise(nocdyn, between, "--set", "coupling.link.damping=9")
    assert "coupling.link.damping = 9 is not from 60 to 500" in report["notes"][0]


def test_load_cases_without_design(nocdyn):
    """What a file lacks is said once, not of each load case."""
    cases = (
        "&load_case name = 'a' set = 'load.water.quadratic=0.01' /\n&load_case name = 'b' set = 'load.water.quadratic=0.02' /\n"
    )
    nocdyn.write("sizes.csv", SIZES)
    nocdyn.write("a.nml", "".join(line for line in PUMP.splitlines(True) if "&design" not in line) + cases)
    result = nocdyn("optimise", "a.nml")
    assert (result.returncode, result.stdout, result.stderr.count("\n")) == (2, "", 1)
    assert "a.nml: there is no group &design" in result.stderr
    assert not (nocdyn.folder / "results").exists()


def test_no_choice_has_results(nocdyn):
    text = DAMPER.format(mass=0.2, stiffness=1e4, link=0.0, low=30, high=200)
    nocdyn.write("a.nml", text.replace("response = 'shaft' statistic = 'peak'", "quantity = 'omega_disc' statistic = 'final'"))
    result = nocdyn("optimise", "a.nml", "--set", "run.max_steps=2")
    assert result.returncode == 1
    assert result.stderr.startswith("nocdyn: a.nml: no choice gives the objectives: the integration stopped at ")


@pytest.mark.parametrize(
    ("former", "new", "message"),
    [
        ("&objective response = 'rubber' statistic = 'peak' /", "", "there is no group &objective"),
        ("response = 'rubber' statistic = 'peak'", "goal = 'minimise'", "&objective: no number is named"),
        ("statistic = 'peak'", "statistic = 'curve'", "statistic(1) = 'curve' is not known; allowed: 'final', "),
        (
            "statistic = 'peak'",
            "statistic = 'crossing'",
            "does not belong to response; allowed: 'peak', 'peak_speed', 'margin', 'ratio', 'peak_frequency'\n",
        ),
        ("response = 'rubber' statistic", "response = 'gum' statistic", "response = 'gum' is no coupling, shaft or mesh"),
        (
            "&design target = 'coupling.rubber.size' /\n&design target = 'body.pump.inertia' low = 1.2 high = 1.8 step = 0.3 /",
            "",
            "there is no group &design",
        ),
        ("coupling.rubber.size' /", "coupling.crank.size' /", "coupling 'crank' has no catalogue"),
        ("coupling.rubber.size' /", "coupling.gum.size' /", "there is no &coupling 'gum'"),
        ("coupling.rubber.size' /", "coupling.rubber.size' sizes = '16', '17' /", "the catalogue has no size '17'"),
        (
            "coupling.rubber.size' /",
            "coupling.rubber.size' low = 1 high = 2 /",
            "a.nml:11: &design: low = 1: 'coupling.rubber.size' is no number, but a size of a catalogue; allowed: sizes",
        ),
        ("coupling.rubber.size' /", "coupling.rubber.size' values = 3, 4 /", "values = 3: 'coupling.rubber.size' is no number"),
        ("step = 0.3", "step = 1e-9", "step = 1e-09 gives more than 10000 values"),
        ("low = 1.2 high = 1.8 step = 0.3", "", "no values; needed: low and high, or values"),
        ("low = 1.2 high", "low = nan high", "low = nan is not a finite number; allowed: a finite number"),
        ("low = 1.2 high = 1.8 step = 0.3", "low = -1 high = 1", "low: "),
        ("low = 1.2 high = 1.8 step = 0.3", "low = 1 high = 2 start = 3", "start = 3 is out of range; allowed: 1 to 2"),
        ("low = 1.2 high = 1.8 step = 0.3", "sizes = '10'", "sizes belong to a target such as 'coupling.rubber.size'"),
        ("pump.inertia' low", "pump.inertias' low", "inertias"),
        ("coupling.rubber.size' /", "body.pump.inertia' values = 1, 2 /", "is the number 1 already"),
    ],
)
def test_refusals(nocdyn, former, new, message):
    nocdyn.write("sizes.csv", SIZES)
    assert former in PUMP
    nocdyn.write("a.nml", PUMP.replace(former, new))
    result = nocdyn("optimise", "a.nml")
    assert result.returncode == 2
    assert message in result.stderr
    assert "curve'" not in result.stderr.replace(new, "").replace("(1) = 'curve'", "")
    assert not (nocdyn.folder / "results").exists()
