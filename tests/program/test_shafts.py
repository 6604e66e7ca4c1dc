"""Shafts from their dimensions: frequencies of the continuum, moments and stresses, nodes, refusals."""

import cmath
import csv
import json
from math import cos, pi, sin, sqrt

import pytest
from conftest import peak_memory

EXACT = 1e-8  # relative error of the frequencies that are asked for

LONG = """&body name = 'a' inertia = 200.0 /
&body name = 'b' inertia = 10.0 /
&shaft name = 'line' bodies = 'a', 'b' lengths = 800.0 diameters = 0.78 bores = 0.65 shear_modulus = 75e9 density = 8000 {} /
&run t_end = 1.0 /
"""
LONG_FREQUENCIES = [1.9103322936, 3.8206647591, 5.7309975684, 7.6413308930]

MACHINE = """&body name = 'a' inertia = {j1} angle = 0.01 speed = 0.3 /
&body name = 'b' inertia = {j2} speed = -0.1 /
&shaft name = 'line' bodies = {bodies} lengths = {lengths} diameters = {diameters} bores = {bores} shear_modulus = 8e10
       density = {density} {more} /
&run t_end = {t_end} rtol = 1e-10 atol = 1e-11 /
&output points = 11 {columns} /
"""
STEPPED = {"lengths": [3.0, 0.7, 5.0], "diameters": [0.3, 0.45, 0.25], "bores": [0.0, 0.1, 0.2]}


def machine(j1=20.0, j2=3.0, bodies="'a', 'b'", density=7850, more="", t_end=0.05, columns="", segments=STEPPED):
    lists = {key: ", ".join(map(str, values)) for key, values in segments.items()}
    return MACHINE.format(j1=j1, j2=j2, bodies=bodies, density=density, more=more, t_end=t_end, columns=columns, **lists)


def stiffnesses(segments):
    rows = zip(segments["lengths"], segments["diameters"], segments["bores"])
    return [8e10 * pi / 32 * (outer**4 - inner**4) / length for length, outer, inner in rows]


def modes_content(nocdyn, text, *options):
    outcome = nocdyn("modes", nocdyn.write("machine.nml", text), "--out", "out", *options)
    assert (outcome.returncode, outcome.stderr) == (0, "")
    modes = json.loads((nocdyn.folder / "out/modes.json").read_text())["modes"]
    return [mode for mode in modes if mode["kind"] == "oscillating"], outcome.stdout


def modes_of(nocdyn, text, *options):
    return [mode["frequency_Hz"] for mode in modes_content(nocdyn, text, *options)[0]]


def run(nocdyn, text, *words):
    nocdyn.done(text, *words)
    return nocdyn.values()


def moment_left_over(frequency, segments, j1, j2):
    """What an oscillation of the first disc leaves over at the second one, by transfer matrices of the continuum."""
    omega, wave_speed = 2 * pi * frequency, sqrt(8e10 / 7850)
    angle, moment = 1.0, -(omega**2) * j1
    for length, k in zip(segments["lengths"], stiffnesses(segments)):
        b = omega * length / wave_speed
        angle, moment = cos(b) * angle + sin(b) / (k * b) * moment, -k * b * sin(b) * angle + cos(b) * moment
    return moment - omega**2 * j2 * angle


def test_a_long_shaft_has_the_frequencies_of_the_continuum(nocdyn):
    frequencies = modes_of(nocdyn, LONG.format(""))
    assert frequencies[:4] == pytest.approx(LONG_FREQUENCIES, rel=1e-9)
    assert len(frequencies) <= 25  # one more than there are internal nodes


@pytest.mark.parametrize(("j1", "j2"), [(20.0, 3.0), (0.0, 0.5), (1000.0, 900.0)])
@pytest.mark.parametrize("segments", [STEPPED, {"lengths": [4.0], "diameters": [0.2], "bores": [0.1]}])
def test_frequencies_are_roots_of_the_transfer_matrices(nocdyn, segments, j1, j2):
    frequencies = modes_of(nocdyn, machine(j1=j1, j2=j2, segments=segments))
    for frequency in frequencies[:4]:
        below, above = (moment_left_over(frequency * (1 + side * EXACT), segments, j1, j2) for side in (-1, 1))
        assert below * above < 0


def test_a_stub_costs_no_nodes(nocdyn):
    stub = "&body name = 'c' inertia = 5.0 /\n&shaft name = 'stub' bodies = 'b', 'c' lengths = 0.1 diameters = 0.5 "
    stub += "shear_modulus = 75e9 density = 8000 /\n"
    assert len(modes_of(nocdyn, LONG.format("") + stub)) == len(modes_of(nocdyn, LONG.format(""))) + 1


def test_nodes_can_be_given(nocdyn):
    assert len(modes_of(nocdyn, LONG.format("nodes = 24"))) == 25


def test_orders_of_a_response_ask_for_nodes(nocdyn):
    response = "&response body = 'a' speed_rpm = 30, 60 orders = {} /\n"
    few, many = (len(modes_of(nocdyn, LONG.format("") + response.format(order))) for order in (1, 24))
    assert few == len(modes_of(nocdyn, LONG.format(""))) < 24 < many
    exact = modes_of(nocdyn, LONG.format("nodes = 90"))
    found = modes_of(nocdyn, LONG.format("") + response.format(24))
    wanted = [f for f in exact if f < 24]
    assert found[: len(wanted)] == pytest.approx(wanted, rel=EXACT)


@pytest.mark.parametrize("formulation", ["paper", "multiplier"])
def test_formulations_agree_and_keep_the_energy(nocdyn, formulation):
    text = machine(t_end=0.02)
    table = run(nocdyn, text)
    other = run(nocdyn, text, "--set", f"run.formulation={formulation}")
    for name, values in table.items():
        scale = max(map(abs, values)) + 1e-3
        if name != "energy_residual [J]":
            assert other[name] == pytest.approx(values, abs=1e-6 * scale), name
    stored = [k + e for k, e in zip(table["kinetic_energy [J]"], table["elastic_energy [J]"])]
    assert stored == pytest.approx([stored[0]] * 11, rel=1e-7)


def test_nodes_have_columns_on_request_only(nocdyn):
    assert not any("line[" in name for name in run(nocdyn, machine(), "--set", "output.columns=phi_*"))
    table = run(nocdyn, machine(), "--set", "output.columns=phi_line[*]")
    assert list(table)[:2] == ["t [s]", "phi_line[1] [rad]"]
    assert 0 > table["phi_line[1] [rad]"][0] - 0.01 > table["phi_line[2] [rad]"][0] - 0.01  # on a static twist at the start


def test_a_sweep_of_a_dimension_is_its_variants_alone(nocdyn):
    sweep = "&sweep design = 'grid' /\n&vary target = 'shaft.line.shear_modulus' low = 7.5e10 high = 8.5e10 count = 3 /\n"
    sweep += "&record quantity = 'total_moment_line_max' statistic = 'max' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", machine() + sweep), "--out", "all", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "all/sweep.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for row in rows:
        modulus = next(value for name, value in row.items() if "shear_modulus" in name)
        run(nocdyn, machine(), "--set", f"shaft.line.shear_modulus={modulus}")
        summary = json.loads((nocdyn.folder / "out/summary.json").read_text())
        largest = next(float(value) for name, value in row.items() if "total_moment_line_max" in name)
        assert largest == pytest.approx(summary["columns"]["total_moment_line_max [N m]"]["max"], rel=1e-6)


# At which speed or frequency each of them excites 24 Hz, or a little more: twelve waves on the shaft.
FAST = 24 * 2 * pi
EXCITATIONS = {
    "sine": f"&excitation name = 'x' body = 'a' amplitude = 1 frequency = {FAST} /\n",
    "orders": "&excitation name = 'x' body = 'a' kind = 'orders' orders = 24 amplitudes = 1 /\n"
    f"&motor name = 'm' body = 'b' a = 10 b = {10 / (2 * pi)} c = 0 /\n",
    "geared orders": "&excitation name = 'x' body = 'c' kind = 'orders' orders = 2 amplitudes = 1 /\n"
    "&body name = 'c' inertia = 1 /\n"
    "&gear name = 'g' bodies = 'a', 'c' teeth = 60, 20 /\n"
    "&motor name = 'm' body = 'b' kind = 'induction' breakdown_torque = 10\n"
    f"breakdown_slip = 0.1 synchronous_speed = {FAST / 6} /\n",
    "fault": "&excitation name = 'x' body = 'a' kind = 'fault' fault = 'two_phase' time = 0.1 rated_torque = 1\n"
    f"subtransient_reactance = 0.2 frequency = {FAST / 2} /\n",
    "table": f"&excitation name = 'x' body = 'a' kind = 'table' table_time = 0, 0.5, {0.5 + 1 / 48} table_torque = 0, 0, 1 /\n",
    "zigzag": "&excitation name = 'x' body = 'a' kind = 'table' table_time = 0, 1, 2, 2.0208, 2.0416, 2.1\n"
    "table_torque = 0, 9, 9, 9.6, 9, 9 /\n",
    "pulse": f"&excitation name = 'x' body = 'a' kind = 'pulse' amplitude = 1 time = 0.1 duration = {1 / 24} /\n",
    "mesh": "&body name = 'c' inertia = 1 /\n&mesh name = 'g' bodies = 'a', 'c' teeth = 24, 24 module = 0.01 stiffness = 1e9\n"
    f"transmission_error = 1e-6 /\n&drive name = 'd' body = 'b' speed = {2 * pi} /\n",
    "supply": "&motor name = 'm' body = 'b' kind = 'synchronous' poles = 4 slips = 0, 1 mean_torques = 1, 1 pulsations = 1, 1\n"
    f"frequency = {FAST / 2} /\n",
}


@pytest.mark.parametrize("kind", EXCITATIONS)
def test_excitations_of_every_kind_ask_for_nodes(nocdyn, kind):
    outcome = nocdyn("check", nocdyn.write("machine.nml", LONG.format("") + EXCITATIONS[kind]), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    nodes = json.loads((nocdyn.folder / "out/check.json").read_text())["shafts"][0]["nodes"]
    assert 30 < nodes < 90


def test_nodes_that_do_not_resolve_what_is_excited_are_noted(nocdyn):
    def report(keys, excitation):
        return nocdyn("check", nocdyn.write("machine.nml", LONG.format(keys) + excitation)).stdout

    sine = EXCITATIONS["sine"]
    assert "the 5 nodes of shaft 'line' do not resolve the highest frequency that is excited, 24 Hz" in report("nodes = 5", sine)
    for keys, excitation in [("nodes = 5", ""), ("", ""), ("", sine), ("nodes = 60", sine)]:
        assert "do not resolve" not in report(keys, excitation)
    assert "24000 Hz, which needs more than 1000" in report("", sine.replace(str(FAST), str(1000 * FAST)))


def wave_stress(omega, j1=200.0, j2=10.0, torque=1e3, length=800.0, outer=0.78, bore=0.65):
    """The largest amplitude of the stress along the long shaft, by waves with a complex shear modulus."""
    modulus = 75e9 * (1 + 1j * 0.02 / (2 * pi))
    area = pi / 32 * (outer**4 - bore**4)
    k = omega * cmath.sqrt(8000 / modulus)
    # phi = p cos(k x) + q sin(k x): -omega^2 j1 p = torque + moment(0), moment(length) = omega^2 j2 phi(length)
    stiff = modulus * area * k
    c, s = cmath.cos(k * length), cmath.sin(k * length)
    q_by_p = (omega**2 * j2 * c + stiff * s) / (stiff * c - omega**2 * j2 * s)
    p = -torque / (omega**2 * j1 + stiff * q_by_p)
    moments = [abs(stiff * p * (q_by_p * cmath.cos(k * x) - cmath.sin(k * x))) for x in range(801)]
    return max(moments) * outer / 2 / area


def test_the_largest_stress_of_a_resonance_is_that_of_waves(nocdyn):
    text = LONG.format("relative_damping = 0.02 damping_frequency = 36") + (
        "&excitation name = 'x' body = 'a' amplitude = 1e3 frequency = 36 /\n&response body = 'a' speed = 1, 5 orders = 1 /\n"
        "&output points = 30001 extremes_from = 135 /\n"
    )
    text = text.replace("t_end = 1.0", "t_end = 150")
    table = run(nocdyn, text)
    late = slice(27001, None)
    rows = max(map(abs, table["stress_line [Pa]"][late]))
    summary = nocdyn.summary("out")["columns"]["stress_line [Pa]"]
    assert max(summary["max"], -summary["min"]) == pytest.approx(rows, rel=2e-3)
    assert rows == pytest.approx(wave_stress(36.0), rel=1e-2)


def test_a_sweep_has_the_largest_stress_of_its_variants(nocdyn):
    text = LONG.format("nodes = 8").replace("t_end = 1.0", "t_end = 3") + (
        "&excitation name = 'x' body = 'a' amplitude = 1e3 frequency = 36 /\n&sweep design = 'grid' /\n"
        "&vary target = 'excitation.x.frequency' low = 36 high = 50 count = 2 /\n"
    )

    for quantity in ("stress_line", "total_moment_line_max"):
        text += f"&record quantity = '{quantity}' statistic = 'max', 'min', 'max_abs', 'time_of_max' /\n"
    outcome = nocdyn("sweep", nocdyn.write("sweep.nml", text), "--out", "all", "--csv")
    assert outcome.returncode == 0, outcome.stderr
    with open(nocdyn.folder / "all/sweep.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    for row in rows:
        run(nocdyn, text, "--set", f"excitation.x.frequency={row['excitation.x.frequency [rad/s]']}")
        for label, column in nocdyn.summary("out")["columns"].items():
            quantity = label.split(" ")[0]
            if quantity not in ("stress_line", "total_moment_line_max"):
                continue
            values = {key.split(" ")[0]: float(value) for key, value in row.items() if key.startswith(quantity)}
            largest = max(abs(column["max"]), abs(column["min"]))
            assert values[f"{quantity}_max_abs"] == pytest.approx(largest, rel=1e-5)
            assert values[f"{quantity}_max"] == pytest.approx(column["max"], rel=1e-5)
            assert values[f"{quantity}_min"] == pytest.approx(column["min"], rel=1e-5)


def test_modes_that_the_nodes_do_not_resolve_are_marked(nocdyn):
    length, nodes = 0.3, 14
    shaft = f"&shaft name = 'bar' bodies = 'left', 'right' lengths = {length} diameters = 0.03 shear_modulus = 8e10"
    text = "&body name = 'left' inertia = 0 /\n&body name = 'right' inertia = 0 /\n"
    text += f"{shaft} density = 7850 nodes = {nodes} /\n&run t_end = 1 /\n"
    modes, report = modes_content(nocdyn, text)
    for n, mode in enumerate(modes, start=1):
        error = mode["frequency_Hz"] / (n * sqrt(8e10 / 7850) / (2 * length)) - 1
        assert mode["error_by_shaft_nodes"] == pytest.approx(abs(error), rel=0.1 if abs(error) < 3e-3 else 0.95, abs=1e-9)
    assert [mode["has_too_few_nodes"] for mode in modes] == [mode["error_by_shaft_nodes"] > 1e-3 for mode in modes]
    assert report.count("nodes too few: error") == sum(mode["error_by_shaft_nodes"] > 1e-3 for mode in modes) >= 7
    assert "resolve 7 of the 15 oscillating modes" in report
    response = "&response body = 'left' speed_rpm = 1, 100 orders = 1 /\n"
    outcome = nocdyn("campbell", nocdyn.write("machine.nml", text + response), "--out", "out")
    assert outcome.returncode == 0, outcome.stderr
    assert "the nodes of shafts resolve 7 of the 15 modes" in outcome.stdout


def test_the_memory_of_many_nodes_is_not_their_cube(nocdyn):
    path = nocdyn.write("machine.nml", LONG.format("nodes = 400"))
    assert peak_memory(nocdyn, "check", path)[0] < 100  # MB


def test_segments_may_be_of_several_materials(nocdyn):
    """A free bar of two materials: Z1 tan(omega L1 / c1) + Z2 tan(omega L2 / c2) = 0, with Z = J sqrt(G rho)."""
    lengths, diameters, moduli, densities = (1.2, 0.7), (0.1, 0.14), (8e10, 2.7e10), (7850.0, 2700.0)
    shaft = "&shaft name = 'bar' bodies = 'a', 'b'" + "".join(
        f" {key} = {first}, {second}"
        for key, (first, second) in zip(
            ("lengths", "diameters", "shear_modulus", "density"), (lengths, diameters, moduli, densities)
        )
    )
    text = f"&body name = 'a' inertia = 0 /\n&body name = 'b' inertia = 0 /\n{shaft} /\n&run t_end = 1 /\n"

    def left_over(frequency):
        omega, sines = 2 * pi * frequency, []
        for length, diameter, modulus, density in zip(lengths, diameters, moduli, densities):
            phase = omega * length * sqrt(density / modulus)
            sines.append((diameter**4 * sqrt(modulus * density) * sin(phase), cos(phase)))
        return sines[0][0] * sines[1][1] + sines[1][0] * sines[0][1]

    for frequency in modes_of(nocdyn, text)[:4]:
        assert left_over(frequency * (1 - EXACT)) * left_over(frequency * (1 + EXACT)) < 0


REFUSALS = [
    ("diameters = 0.3, 0.3 bores = 0.1, 0.1 density = 7850, 0", "lengths = 3.0, 1.0", "density(2) = 0, others are not"),
    ("diameters = 3*0.3 bores = 3*0.1 density = 2*7850", "lengths = 3*1.0", "density has 2 values, lengths has 3"),
    ("diameters = 0.3, 0.4", "lengths = 3.0", "lengths has 1 value"),
    ("diameters = 0.3 bores = 0.3", "lengths = 3.0", "bores(1) = 0.3 m is not less than diameters(1) = 0.3 m"),
    ("diameters = 0.3, 0.3, 0.3 nodes = 1", "lengths = 3.0, 1.0, 1.0", "nodes = 1 is out of range; allowed: from 2"),
    ("diameters = 0.3 nodes = 2000", "lengths = 3.0", "nodes"),
    ("diameters = 0.3 damping_frequency_hz = 3", "lengths = 3.0", "damping_frequency"),
]


@pytest.mark.parametrize(("keys", "lengths", "words"), REFUSALS)
def test_bad_dimensions_are_refused(nocdyn, keys, lengths, words):
    density = "" if "density" in keys else "density = 7850"
    shaft = f"&shaft name = 's' bodies = 'a', 'ground' {lengths} {keys} shear_modulus = 8e10 {density} /\n"
    text = "&body name = 'a' inertia = 1.0 /\n" + shaft + "&run t_end = 1.0 /\n"
    outcome = nocdyn("check", nocdyn.write("bad.nml", text))
    assert outcome.returncode == 2
    assert "bad.nml:2: &shaft 's': " in outcome.stderr and words in outcome.stderr


def test_a_shaft_without_stiffness_is_refused(nocdyn):
    outcome = nocdyn("check", nocdyn.write("bad.nml", LONG.format("").replace("75e9", "0.0")))
    assert outcome.returncode == 2
    assert "bad.nml:3: &shaft 'line': shear_modulus(1) = 0.0" in outcome.stderr


def test_a_limit_of_a_coupling_that_is_a_shaft_is_told_so(nocdyn):
    text = """&body name = 'a' inertia = 1.0 /
&body name = 'b' inertia = 1.0 /
&shaft name = 'axle' bodies = 'a', 'b' lengths = 1 diameters = 0.1 shear_modulus = 8e10 /
&excitation name = 'x' body = 'a' kind = 'orders' orders = 1 amplitudes = 1 /
&run t_end = 1 /
&response body = 'a' speed = 10, 20 count = 3 /
&limit coupling = 'axle' moment = 1 /
"""
    outcome = nocdyn("response", nocdyn.write("machine.nml", text), "--out", "out")
    assert outcome.returncode == 2
    assert "machine.nml:7: &limit: 'axle' is a shaft; needed: shaft in place of coupling" in outcome.stderr
    assert nocdyn("response", nocdyn.write("machine.nml", text.replace("coupling =", "shaft =")), "--out", "out").returncode == 0
