"""The shipped sweeps do what an independent computation of some of their variants says."""

import csv
import os
from pathlib import Path

import pytest
from conftest import SOURCE

pytestmark = pytest.mark.skipif(not (Path(os.environ["NOCDYN"]).parent / "nocdyn-sweep").exists(), reason="built without sweeps")

SWEEPS = SOURCE / "input/sweeps"

# Variants to compute: where they depend on `samples`, references are of this many.
SAMPLES = {"throughput": 200, "resonance": None, "tolerance": 100, "coupling_tolerance": 100}

# By variant the values of the varied keys and the results, by sweep_references.py, which prints these tables.
REFERENCE = {
    "throughput": {
        1: (
            {
                "load.work.viscous": 146.95758488280666,
                "coupling.coupling.cubic_stiffness": 19.202909718728364,
            },
            {
                "phi_motor_final": 26.08868003655,
                "phi_pinion_final": 24.92759732216,
                "phi_machine_final": -16.61839821477,
                "omega_motor_final": 2.291120576061,
                "omega_pinion_final": 2.316982846003,
                "omega_machine_final": -1.544655230669,
                "moment_coupling_max_abs": 249.3257141204,
            },
        ),
        57: (
            {
                "load.work.viscous": 94.77047582407627,
                "coupling.coupling.cubic_stiffness": 11.545499889641507,
            },
            {
                "phi_motor_final": 35.71034109625,
                "phi_pinion_final": 34.55957192425,
                "phi_machine_final": -23.03971461617,
                "omega_motor_final": 3.306029502414,
                "omega_pinion_final": 3.344967124202,
                "omega_machine_final": -2.229978082802,
                "moment_coupling_max_abs": 211.2973860527,
            },
        ),
        200: (
            {
                "load.work.viscous": 133.45308228398875,
                "coupling.coupling.cubic_stiffness": 12.90433398734631,
            },
            {
                "phi_motor_final": 28.08974183112,
                "phi_pinion_final": 26.87564517581,
                "phi_machine_final": -17.91709678387,
                "omega_motor_final": 2.439548617485,
                "omega_pinion_final": 2.551045550137,
                "omega_machine_final": -1.700697033425,
                "moment_coupling_max_abs": 235.3477148416,
            },
        ),
    },
    "resonance": {
        1: (
            {
                "excitation.shaker.frequency": 0.5,
            },
            {
                "moment_coupling_max_abs_from_12": 167.964062617,
                "moment_coupling_max_from_12": -138.9201835766,
                "moment_coupling_min_from_12": -167.964062617,
            },
        ),
        91: (
            {
                "excitation.shaker.frequency": 5.0,
            },
            {
                "moment_coupling_max_abs_from_12": 172.7607721814,
                "moment_coupling_max_from_12": -134.9285440525,
                "moment_coupling_min_from_12": -172.7607721814,
            },
        ),
        231: (
            {
                "excitation.shaker.frequency": 12.0,
            },
            {
                "moment_coupling_max_abs_from_12": 156.1724006086,
                "moment_coupling_max_from_12": -150.8637170499,
                "moment_coupling_min_from_12": -156.1724006086,
            },
        ),
    },
    "tolerance": {
        1: (
            {
                "coupling.shaft.stiffness": 59260731.93181561,
                "coupling.spindle.stiffness": 38869305.038695276,
                "body.stand.inertia": 2517.9850030327416,
                "body.roll.inertia": 1882.0920355266337,
                "coupling.shaft.damping": 44215.25399048966,
                "coupling.spindle.damping": 54654.021817701214,
                "coupling.spindle.gap": 0.037964177362483635,
            },
            {
                "moment_shaft_max_abs": 1488520.6515,
                "moment_spindle_max_abs": 984749.1152097,
                "moment_spindle_max": 431516.0309271,
                "omega_roll_min": 3.272087386124,
            },
        ),
        15: (
            {
                "coupling.shaft.stiffness": 56243023.92883748,
                "coupling.spindle.stiffness": 39995216.03519418,
                "body.stand.inertia": 2488.949609847259,
                "body.roll.inertia": 1799.1866573298907,
                "coupling.shaft.damping": 51205.8128946832,
                "coupling.spindle.damping": 63007.06217439572,
                "coupling.spindle.gap": 0.04731380160183713,
            },
            {
                "moment_shaft_max_abs": 1536963.34248,
                "moment_spindle_max_abs": 980704.9637315,
                "moment_spindle_max": 348723.9489997,
                "omega_roll_min": 2.85737138406,
            },
        ),
        25: (
            {
                "coupling.shaft.stiffness": 56016647.289850205,
                "coupling.spindle.stiffness": 42856886.94597547,
                "body.stand.inertia": 2430.0682537264393,
                "body.roll.inertia": 1797.0148315587476,
                "coupling.shaft.damping": 27901.241406699366,
                "coupling.spindle.damping": 13566.456973800805,
                "coupling.spindle.gap": 0.026204956635053775,
            },
            {
                "moment_shaft_max_abs": 1410291.411598,
                "moment_spindle_max_abs": 1010413.146392,
                "moment_spindle_max": 718535.2983313,
                "omega_roll_min": 3.736975621882,
            },
        ),
        81: (
            {
                "coupling.shaft.stiffness": 53739625.75672951,
                "coupling.spindle.stiffness": 44801098.16233931,
                "body.stand.inertia": 2586.0912994141595,
                "body.roll.inertia": 1831.300453642845,
                "coupling.shaft.damping": 34129.09163985772,
                "coupling.spindle.damping": 23562.578546291265,
                "coupling.spindle.gap": 0.040431772855414695,
            },
            {
                "moment_shaft_max_abs": 1564097.391678,
                "moment_spindle_max_abs": 1058520.250336,
                "moment_spindle_max": 534725.2827429,
                "omega_roll_min": 3.084797513315,
            },
        ),
    },
    "coupling_tolerance": {
        1: (
            {
                "coupling.rubber.stiffness": 1.0236811513427764,
                "coupling.rubber.relative_damping": 1.0268851725617423,
                "body.rotor.inertia": 0.9612273508799262,
            },
            {
                "total_moment_rubber_curve_1": 5194.77088113,
                "total_moment_rubber_order_0.5_curve_1": 1375.051027158,
                "total_moment_rubber_curve_81": 4774.127996991,
                "total_moment_rubber_order_0.5_curve_81": 4680.220235509,
                "total_moment_rubber_curve_155": 1076.517607314,
                "total_moment_rubber_order_0.5_curve_155": 1073.312715297,
            },
        ),
        57: (
            {
                "coupling.rubber.stiffness": 1.0036683376785847,
                "coupling.rubber.relative_damping": 1.2425101725617425,
                "body.rotor.inertia": 0.9627898508799262,
            },
            {
                "total_moment_rubber_curve_1": 4726.47460077,
                "total_moment_rubber_order_0.5_curve_1": 1376.027230955,
                "total_moment_rubber_curve_81": 4212.886421582,
                "total_moment_rubber_order_0.5_curve_81": 4038.964716911,
                "total_moment_rubber_curve_155": 1037.875328815,
                "total_moment_rubber_order_0.5_curve_155": 1029.868102582,
            },
        ),
        100: (
            {
                "coupling.rubber.stiffness": 1.096036696390715,
                "coupling.rubber.relative_damping": 0.9471976725617424,
                "body.rotor.inertia": 1.0229461008799263,
            },
            {
                "total_moment_rubber_curve_1": 5978.858002004,
                "total_moment_rubber_order_0.5_curve_1": 1415.632986522,
                "total_moment_rubber_curve_81": 5017.806280793,
                "total_moment_rubber_order_0.5_curve_81": 5078.994011305,
                "total_moment_rubber_curve_155": 1191.318670344,
                "total_moment_rubber_order_0.5_curve_155": 1186.197924864,
            },
        ),
    },
}

# Of a result's size. rtol = atol of throughput.nml are 1e-6 a step, those of the others 1e-9 and less.
ACCURACY = {"throughput": 1e-6, "resonance": 1e-8, "tolerance": 1e-7, "coupling_tolerance": 1e-7}

# Of the errors of W2 in scripts/bench: absolute ones of the states, relative ones of the peak.
WANTED = 1e-6


@pytest.fixture(scope="module")
def rows_of(shared_nocdyn):
    """The rows of sweep.csv by variant, without units in the labels."""
    tables = {}

    def rows(name):
        if name not in tables:
            options = ["--set", f"sweep.samples={SAMPLES[name]}"] if SAMPLES[name] else []
            outcome = shared_nocdyn("sweep", SWEEPS / f"{name}.nml", "--out", name, "--csv", "--quiet", *options)
            assert (outcome.returncode, outcome.stderr) == (0, "")
            with open(shared_nocdyn.folder / name / "sweep.csv", newline="") as file:
                tables[name] = {
                    int(row["variant"]): {label.partition(" [")[0]: text for label, text in row.items()}
                    for row in csv.DictReader(file)
                }
        return tables[name]

    return rows


def test_every_shipped_sweep_has_a_reference():
    assert sorted(path.stem for path in SWEEPS.glob("*.nml")) == sorted(REFERENCE)


@pytest.mark.parametrize("name", REFERENCE)
def test_every_variant_of_a_shipped_sweep_is_done(rows_of, name):
    assert {row["status"] for row in rows_of(name).values()} == {"done"}


@pytest.mark.parametrize("name", REFERENCE)
def test_variants_have_the_values_and_the_results_of_the_reference(rows_of, name):
    for variant, (values, results) in REFERENCE[name].items():
        row = rows_of(name)[variant]
        assert {target: float(row[target]) for target in values} == values, variant
        for label, expected in results.items():
            assert float(row[label]) == pytest.approx(expected, rel=ACCURACY[name]), f"variant {variant}: {label}"


def test_the_errors_of_the_throughput_are_below_a_millionth(rows_of):
    for variant, (_, results) in REFERENCE["throughput"].items():
        for label, expected in results.items():
            most = WANTED * (expected if label.startswith("moment") else 1.0)
            assert float(rows_of("throughput")[variant][label]) == pytest.approx(expected, rel=0, abs=most), f"{variant}: {label}"


@pytest.mark.parametrize("name", REFERENCE)
def test_the_reference_of_a_variant_is_what_its_program_computes(name):
    pytest.importorskip("scipy")
    import sweep_references

    values, results = next(iter(REFERENCE[name].values()))
    assert sweep_references.results(name, values) == pytest.approx(results, rel=1e-10)
