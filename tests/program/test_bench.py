"""What scripts/bench concludes from what it measures."""

import subprocess
import sys

import numpy as np
import pytest
from conftest import SOURCE

sys.path.insert(0, str(SOURCE / "scripts"))
from nocdyn_bench import costs, variants

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


def test_the_errors_of_a_sweep_are_the_largest_of_states_and_relative_peaks():
    exact = np.array([[1.0, 2.0, 3.0, 4.0, 200.0], [1.0, 2.0, 3.0, 4.0, 100.0]])
    found = exact + np.array([[0, 0, 0, 1e-7, 1e-5], [0, -3e-7, 0, 0, 0]])
    errors = variants.errors_of(found, exact)
    assert (errors.state, errors.peak) == (pytest.approx(3e-7, rel=1e-6), pytest.approx(5e-8, rel=1e-6))
    assert errors.are_below(1e-6) and not errors.are_below(2e-7)


@pytest.mark.parametrize("column", range(5))
def test_a_variant_without_a_result_is_no_accurate_one(column):
    exact = np.full((3, 5), 2.0)
    found = exact.copy()
    found[1, column] = np.nan
    errors = variants.errors_of(found, exact)
    assert not errors.are_below(1e-6)
    assert errors.are_below(1e-6, has_peak=False) == (column == 4)


def test_variants_fill_their_ranges():
    found = variants.variants(1000)
    for column, (low, high) in zip(found.T, variants.RANGES):
        assert low <= column.min() < low + 0.01 * (high - low) and high - 0.01 * (high - low) < column.max() <= high


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
