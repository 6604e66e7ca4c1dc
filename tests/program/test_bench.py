"""What scripts/bench concludes from what it measures."""

import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import SOURCE

sys.path.insert(0, str(SOURCE / "scripts"))
from nocdyn_bench import costs, example_runs, example_sweeps, rounds, torsional_machines, torsional_results, variants
from nocdyn_bench.contestant import Contestant, ContestantError, Run
from nocdyn_bench.harmonic_balance import HarmonicBalance
from nocdyn_bench.nocdyn_sweep import random_design, write_input
from nocdyn_bench.shipped import Shipped

PROFILE = """\
events: Ir
ob=/somewhere/program
fn=work
0x401000 0 10
0x401004 0 20
calls=3 0x402000 0
0x401008 0 700
0x40100c 0 5
ob=/lib/libm.so.6
0x401000 0 1000
ob=/somewhere/program
0x401004 0 1
"""

DISASSEMBLY = """\
0000000000401000 <work>:
  401000:\tvaddpd %ymm0,%ymm1,%ymm2
  401004:\tvmulsd %xmm0,%xmm1,%xmm1
  401008:\tcall   402000 <other>
  40100c:\tvfmadd231pd %zmm0,%zmm1,%zmm2
  401010:\tvmovapd %ymm0,(%rax)
  401014:\tdivpd  %xmm1,%xmm0
"""


def test_instructions_of_the_program_count_and_those_of_called_procedures_once():
    assert costs.executions(PROFILE, "program") == {0x401000: 10, 0x401004: 21, 0x40100C: 5}


def test_an_instruction_has_an_operation_for_each_double_of_its_registers():
    assert costs.operations(DISASSEMBLY) == {0x401000: 4, 0x401004: 1, 0x40100C: 16, 0x401014: 2}


COUNTED = """\
Profiled target:  nocdyn run engine.nml
2,000 (100.0%)  PROGRAM TOTALS

1,980 (99.00%)  ???:__nocdyn_transient_MOD_run_transient [/somewhere/nocdyn]
1,800 (90.00%)  ???:__nocdyn_integration_MOD_integrate [/somewhere/nocdyn]
1,799 (89.95%)  ???:__nocdyn_integration_MOD_integrate_with [/somewhere/nocdyn]
  400 (20.00%)  ???:__nocdyn_extremes_MOD_update_extremes [/somewhere/nocdyn]
  200 (10.00%)  ???:__nocdyn_after_step_MOD_output_until.constprop.0 [/somewhere/nocdyn]
  100 ( 5.00%)  ???:__nocdyn_missed_states_MOD_note_missed_state [/somewhere/nocdyn]
"""


def test_the_parts_of_a_run_are_steps_outputs_extremes_and_the_search_after_it():
    shares = example_runs.shares_of(COUNTED)
    assert shares == pytest.approx(
        {
            "steps": 0.6,
            "rows": 0.1,
            "extremes by samples": 0.2,
            "extremes by polynomials": 0.0,
            "steady states": 0.05,
            "rest": 0.05,
        }
    )


def test_procedures_that_are_counted_are_there():
    sources = {path.stem: path.read_text(encoding="utf-8") for path in (SOURCE / "src").rglob("*.f90")}
    for name in (example_runs.STEPS, example_runs.SEARCH, *example_runs.PARTS.values()):
        module, procedure = name.removeprefix("nocdyn_").split("_MOD_")
        assert f"subroutine {procedure}(" in sources[module]


def test_the_errors_of_a_sweep_are_the_largest_of_states_and_relative_peaks():
    exact = np.array([[1.0, 2.0, 3.0, 4.0, 200.0], [1.0, 2.0, 3.0, 4.0, 100.0]])
    found = exact + np.array([[0, 0, 0, 1e-7, 1e-5], [0, -3e-7, 0, 0, 0]])
    errors = variants.errors_of(found, exact)
    assert (errors.state, errors.peak) == (pytest.approx(3e-7, rel=1e-6), pytest.approx(5e-8, rel=1e-6))
    assert errors.are_below(variants.Errors(1e-6, 1e-6))
    assert not errors.are_below(variants.Errors(2e-7, 1e-6))
    assert not errors.are_below(variants.Errors(1e-6, 2e-8))


@pytest.mark.parametrize("column", range(5))
def test_a_variant_without_a_result_is_no_accurate_one(column):
    exact = np.full((3, 5), 2.0)
    found = exact.copy()
    found[1, column] = np.nan
    errors = variants.errors_of(found, exact)
    assert not errors.are_below(variants.Errors(1e-6, 1e-6))
    assert errors.are_below(variants.Errors(1e-6, 1e-6), has_peak=False) == (column == 4)


def test_variants_fill_their_ranges():
    found = variants.CASE2.variants(1000)
    for column, (low, high) in zip(found.T, variants.CASE2.ranges):
        assert low <= column.min() < low + 0.01 * (high - low) and high - 0.01 * (high - low) < column.max() <= high


EXAMPLES = SOURCE / "input" / "examples"
MILL = Shipped(EXAMPLES / "rolling_mill" / "rolling_mill.nml", "shaft")
ENGINE = Shipped(EXAMPLES / "engine" / "engine.nml", "crank_8")


def test_the_peers_have_the_numbers_of_the_input():
    stiffness, damping, gap = MILL.numbers()[0].reshape(3, -1)
    assert (stiffness.tolist(), damping.tolist(), gap.tolist()) == ([6e7, 4.5e7], [5e4, 4e4], [0.0, 0.02])
    assert MILL.motor.tolist() == [[1.2e7, 1.9108e6, 0.0], [0.0, 0.0, 0.0], [0.0, 800.0, 0.0]]
    assert [(body, points.shape) for body, points in MILL.tables] == [(2, (5, 2))]
    assert [(body, harmonics.shape) for body, harmonics in ENGINE.orders] == [(body, (8, 3)) for body in range(3, 9)]
    assert (len(ENGINE.times), ENGINE.watched) == (2501, (8, 9))


def test_a_variant_has_other_numbers_in_its_place_only():
    found = MILL.numbers(("coupling.spindle.gap", "coupling.shaft.stiffness"), np.array([[0.01, 5e7], [0.03, 7e7]]))
    assert found.tolist() == [[5e7, 4.5e7, 5e4, 4e4, 0.0, 0.01], [7e7, 4.5e7, 5e4, 4e4, 0.0, 0.03]]
    assert MILL.moments(np.array([0.1, -0.1]), found) == pytest.approx([5e6, -7e6])


def test_a_machine_with_a_law_that_peers_do_not_know_is_refused():
    with pytest.raises(ValueError, match=r"^torque_split\.nml: the peers do not know &body angle$"):
        Shipped(EXAMPLES / "torque_split" / "torque_split.nml", "quill").numbers()


@pytest.mark.parametrize("machine", [MILL, ENGINE], ids=lambda machine: machine.file.stem)
def test_heyoka_integrates_the_machine_that_nocdyn_integrates(nocdyn, machine):
    pytest.importorskip("heyoka")
    peers = pytest.importorskip("nocdyn_bench.peers.heyoka")
    states = peers.contestants(machine)[0].solve(1e-9, 1e-9, 1).states
    nocdyn("run", machine.file, "--out", "out", "--quiet")
    header, rows = nocdyn.table("out")
    names = [name.partition(" [")[0] for name in header]
    columns = [names.index(name) for name in machine.state_names]
    assert states == pytest.approx(np.array(rows)[:, columns], abs=1e-5)  # they reach 2e-6


@pytest.mark.parametrize("machine", [MILL, ENGINE], ids=lambda machine: machine.file.stem)
def test_all_peers_have_the_same_right_hand_side(machine):
    heyoka, sides = pytest.importorskip("heyoka"), pytest.importorskip("nocdyn_bench.peers.right_hand_sides")
    from nocdyn_bench.peers.heyoka_models import Model

    model, fill = Model(machine), sides.variant_derivative(machine).py_func
    equations = heyoka.cfunc([side for _, side in model.equations], model.variables)
    spread = np.repeat([5.0, 0.02], machine.bodies)  # of speeds and angles: all branches of the gap
    for seed, (until, lines) in itertools.product(range(20), model.pieces):
        states, found = machine.start + np.random.default_rng(seed).normal(0, spread), np.empty(machine.states)
        fill(until - 1e-3, states, found, machine.numbers()[0])
        pars = model.start_pars(np.zeros((1, 0)))[0]
        pars[model.piece_pars] = lines
        for gap in model.gaps:
            indicators = gap.indicators(*model._halves(states), *gap.values)
            pars[gap.par : gap.par + 3] = gap.law(indicators, *gap.values)
        assert found == pytest.approx(equations(states, pars=pars, time=until - 1e-3), rel=1e-12, abs=1e-9)


def test_a_contestant_that_fails_everywhere_or_somewhere_is_named_with_the_reason():
    def refuse(rtol, atol, repetitions):
        raise ContestantError("'gas' has no Taylor series")

    def fail_loosely(rtol, atol, repetitions):
        if rtol > 1e-4:
            raise ContestantError("too large a step")
        return Run([1.0], np.zeros((1, 2)))

    contestants = [Contestant("a", "", refuse), Contestant("b", "", fail_loosely)]
    points, sentences = rounds.try_out(contestants, [(1e-3, 1e-3), (1e-6, 1e-6)], lambda _: {})
    assert [(point.contestant.label, point.rtol) for point in points] == [("b", 1e-6)]
    assert sentences == ["a fails: 'gas' has no Taylor series", "b fails at rtol 1e-03: too large a step"]


def test_every_example_with_springs_has_a_sweep_whose_cost_can_be_measured(nocdyn):
    files = example_sweeps.with_springs(sorted(EXAMPLES.glob("*/*.nml")))
    assert len(files) >= 13
    for file in files:
        family = example_sweeps.family_of(file)
        write_input(family, nocdyn.folder / "sweep.nml", random_design(family, 2))
        outcome = nocdyn("check", "sweep.nml")
        assert (outcome.returncode, outcome.stderr) == (0, ""), file


def test_the_table_of_the_examples_has_rates_and_measured_errors_of_the_methods_that_can_be_used(nocdyn, monkeypatch):
    for name in ("FEW", "LEAST", "MOST"):
        monkeypatch.setattr(example_sweeps, name, 3)
    files = [EXAMPLES / name / f"{name}.nml" for name in ("rolling_mill", "three_rotors")]
    programs = Path(nocdyn.executable).parent
    _, _, *rows, _, _ = example_sweeps.example_sweeps(programs, nocdyn.folder, files, ["auto", "taylor"], 1)
    cells = [[cell.strip(" `") for cell in row.strip("|").split("|")] for row in rows]
    assert [row[:3] for row in cells] == [
        ["rolling_mill", "3", "coupling.shaft.stiffness"],
        ["three_rotors", "3", "coupling.shaft.stiffness"],
    ]
    for row in cells:
        assert row[5] in ("auto", "taylor")
        assert all(0 < float(row[i]) < 1e-5 for i in (4, 7))
        assert all(float(row[i].replace(" ", "")) > 1 for i in (3, 6))


def test_each_contestant_of_a_sweep_has_the_loosest_tolerance_that_is_good_enough(monkeypatch):
    pytest.importorskip("heyoka")
    throughput = pytest.importorskip("nocdyn_bench.throughput")

    def solve(tolerance, parameters):
        return variants.Found(0.5, 2.0 + np.full((len(parameters), 5), tolerance))

    def refuse(tolerance, parameters):
        raise ContestantError("'gas' has no Taylor series")

    exact = variants.SweepContestant("exact", "", lambda _, parameters: solve(0.0, parameters))
    monkeypatch.setattr(throughput.heyoka_sweep, "accurate_results", lambda _, parameters: solve(0.0, parameters).results)
    monkeypatch.setattr(throughput.scipy_sweep, "contestants", lambda *_: [exact])
    contestants = [variants.SweepContestant("a", "", solve), variants.SweepContestant("b", "", refuse)]
    workload = throughput.Throughput("W", "", variants.CASE2, 20, 10, contestants, [])
    workload.measure(1)
    assert [(rate.contestant.label, rate.best) for rate in workload.rates] == [("a", 40.0)]
    assert workload.rates[0].tolerance == pytest.approx(10**-6.1)
    assert workload.failures == ["b fails: 'gas' has no Taylor series"]


def test_a_loose_tolerance_is_found_whose_errors_are_smaller_than_those_of_tighter_ones(monkeypatch):
    pytest.importorskip("heyoka")
    throughput = pytest.importorskip("nocdyn_bench.throughput")

    def solve(tolerance, parameters):  # as of a method that takes another order at 1e-5
        return variants.Found(0.5, 2.0 + np.full((len(parameters), 5), 0.0 if 0.9e-5 < tolerance < 1.1e-5 else tolerance))

    contestant = variants.SweepContestant("a", "", solve)
    workload = throughput.Throughput("W", "", variants.CASE2, 20, 10, [contestant], [])
    exact = np.full((10, 5), 2.0)
    assert workload._chosen(contestant, np.zeros((20, 2)), exact).tolerance == pytest.approx(1e-5)


TORSIONAL = [machine() for machine in (*torsional_machines.MACHINES, torsional_machines.timed_plant)]


@pytest.mark.parametrize("machine", TORSIONAL, ids=lambda machine: machine.name)
def test_nocdyn_and_opentorsion_can_describe_every_machine_that_is_compared(nocdyn, machine):
    firsts = [shaft.first for shaft in machine.shafts]
    assert len({*firsts, machine.bodies[-1]}) == len(firsts) + 1
    machine.write_input(nocdyn.folder / "response.nml")
    machine.write_input(nocdyn.folder / "modes.nml", has_torques=False)
    outcome = nocdyn("check", "response.nml", "modes.nml")
    assert (outcome.returncode, outcome.stderr) == (0, "")


def test_modes_and_responses_are_read_with_their_phases(nocdyn):
    machine = torsional_machines.damped_engine()
    machine.write_input(nocdyn.folder / "machine.nml")
    machine.write_input(nocdyn.folder / "modes.nml", has_torques=False)
    for command, file in (("response", "machine.nml"), ("modes", "modes.nml")):
        assert nocdyn(command, file, "--out", command, *(["--at", "0"] if command == "modes" else [])).returncode == 0
    modes = torsional_results.read_modes(nocdyn.folder / "modes")
    assert len(modes.undamped) == len(modes.poles) == len(machine.inertias) - 1
    assert np.abs(modes.poles) == pytest.approx(modes.undamped, rel=1e-3)  # weakly damped
    found = torsional_results.read_response(machine, nocdyn.folder / "response")
    omegas = found.speeds[:, None] * found.orders
    brake = machine.index("brake")  # no torque acts on it but those of its shaft and its damper
    inertia, damping = machine.inertias["brake"], machine.viscous["brake"]
    inertial = (1j * omegas * damping - omegas**2 * inertia) * found.angles[:, brake]
    assert inertial == pytest.approx(-found.moments[:, -1], abs=1e-10 * np.abs(found.moments).max())


def test_the_speeds_of_bodies_follow_through_shafts_and_gears():
    machine = torsional_machines.branched_gears()
    ratios = dict(zip(machine.bodies, machine.ratios))
    assert ratios["pump"] == pytest.approx(-0.3 / 0.13)
    assert ratios["fan"] == pytest.approx(0.3 / 0.4 * 0.15 / 0.37)
    assert machine.orders == pytest.approx(sorted([2.0, ratios["fan"] * 5.0, -ratios["pump"], -6.0 * ratios["pump"]]))


def test_differences_of_responses_are_relative_to_the_largest_amplitude_of_a_shaft():
    expected = np.array([[[1.0, 2.0], [100.0, 50.0]], [[0.1, 4.0], [1.0, 1.0j]]])
    found = expected.copy()
    found[0, 0, 1] += 4e-6j
    found[1, 1, 1] += 5e-5
    assert torsional_results.difference(found, expected) == pytest.approx(1e-6)
    found[0, 0, 0] = np.nan
    assert torsional_results.difference(found, expected) == np.inf
    assert torsional_results.difference(expected[:, :1], expected) == np.inf


def test_modes_of_another_number_do_not_agree():
    expected = torsional_results.Modes(np.array([10.0, 20.0]), np.array([-1.0 + 10.0j, -2.0 + 20.0j]))
    near = torsional_results.Modes(np.array([10.0, 20.002]), np.array([-1.0 + 10.0j, -2.0 + 20.0j]))
    assert near.differences(expected) == pytest.approx((1e-4, 0.0))
    assert torsional_results.Modes(np.array([10.0]), expected.poles).differences(expected) == (np.inf, 0.0)


def test_a_machine_in_which_opentorsion_differs_is_named(nocdyn):
    pytest.importorskip("opentorsion")
    from nocdyn_bench import torsional

    agreement = torsional.Agreement(torsional_machines.three_rotors(), 0.0, 1e-9, 2e-8, 0.0)
    workload = torsional.Torsional("opentorsion", "", Path(nocdyn.executable), nocdyn.folder, [agreement])
    assert workload.disagreements == ["three_rotors: nocdyn and openTorsion differ by 2.0e-08, more than 1e-08"]
    workload.agreements = [workload._compare(machine) for machine in (TORSIONAL[0], TORSIONAL[2])]
    assert workload.disagreements == []


def test_what_compiled_peers_print_goes_to_the_log(tmp_path):
    script = """
import ctypes, sys
from pathlib import Path
from nocdyn_bench.peer_output import divert_to
divert_to(Path(sys.argv[1]) / "out" / "peers.log")
ctypes.CDLL(None).puts(b"the problem seems to become stiff")
print("a table")
print("a complaint", file=sys.stderr)
"""
    command = [sys.executable, "-c", script, tmp_path]
    outcome = subprocess.run(command, cwd=SOURCE / "scripts", capture_output=True, text=True, check=True)
    assert (outcome.stdout, outcome.stderr) == ("a table\n", "a complaint\n")
    assert (tmp_path / "out" / "peers.log").read_text(encoding="utf-8") == "the problem seems to become stiff\n"


def test_the_harmonic_balance_beside_nocdyn_finds_the_folds_of_a_hardening_spring():
    one = HarmonicBalance(1, 1.0, 0.1, 0.05, 0.18, 5)
    one.follow(0.8, 1.6, 2.5, 0.02)
    assert one.folds() == pytest.approx([1.2696019555, 1.1157002518], abs=1e-4)
