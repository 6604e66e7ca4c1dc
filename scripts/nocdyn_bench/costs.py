"""What a step and what a chunk of a sweep cost: numbers behind the rates of W2."""

import json
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from .nocdyn_sweep import MPIRUN, write_sweep

VARIANTS = 16384  # integrated for one number
FEW, MORE = 64, 192  # variants that are integrated while instructions are counted; the difference counts
CHUNKS = (1, 4, 16, 64, 256, 1024, 4096)
MESSAGES = 2000
CHUNK_SECONDS = 0.2  # what nocdyn aims at


@dataclass
class Costs:
    """Tables that a function fills line by line."""

    name: str
    title: str
    compute: Callable[[int], list[str]]  # from the number of rounds
    lines: list[str] = field(default_factory=list)

    def measure(self, rounds: int) -> None:
        self.lines = self.compute(rounds)


@dataclass(frozen=True)
class Sweeping:
    """The program chunk_costs on variants of W2."""

    folder: Path  # of the programs of bench/
    scratch: Path

    def run(self, method: str, tolerance: float, variants: int, chunk: int, lanes: int, before: tuple = (), folder: Path | None = None) -> dict:
        file, out = self.scratch / "costs.nml", self.scratch / "costs"
        shutil.rmtree(out, ignore_errors=True)
        write_sweep(file, variants, f"method = '{method}' rtol = {tolerance} atol = {tolerance}")
        command = [*before, (folder or self.folder) / "chunk_costs", file, variants, chunk, lanes, out]
        return json.loads(subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout)

    def best(self, rounds: int, *arguments) -> dict:
        """The shortest time of each kind."""
        found = [self.run(*arguments) for _ in range(rounds)]
        return {key: min(one[key] for one in found) for key in found[0]}

    def peak(self, rounds: int) -> float:
        """Unfused additions and multiplications in a second, of a loop that does nothing else."""
        return max(_report([self.folder / "peak_flops"])["flops"] for _ in range(rounds))

    def message(self, size: int) -> float:
        """Seconds for the messages about one chunk whose results have so many bytes."""
        return _report([*MPIRUN, "-n", 2, self.folder / "mpi_message_costs", size, MESSAGES])["seconds"]


def _report(command: list) -> dict:
    return json.loads(subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout)


def step_costs(sweeping: Sweeping, plain: Path, settings: dict[str, tuple[float, int]], rounds: int) -> list[str]:
    """`plain`: programs for processors with AVX2, which valgrind knows; settings: tolerance and lanes of each method."""
    peak = sweeping.peak(rounds)
    rows = []
    for method, (tolerance, lanes) in settings.items():
        fast = sweeping.best(rounds, method, tolerance, VARIANTS, 2048, lanes)
        few, more = (count_instructions(sweeping, plain, method, tolerance, lanes, variants) for variants in (FEW, MORE))
        steps = more.steps - few.steps
        rate = VARIANTS / fast["compute"]
        flops = (more.flops - few.flops) / (MORE - FEW)
        rows.append([f"`{method}`", f"{tolerance:.1e}", f"{fast['steps'] / VARIANTS:.1f}", f"{(more.flops - few.flops) / steps:.0f}",
                     f"{(more.instructions - few.instructions) / steps:.0f}", f"{1e9 * fast['compute'] / fast['steps']:.0f}",
                     f"{1e-9 * flops * rate:.1f}", f"{flops * rate / peak:.0%}"])
    head = ["method", "tolerance", "steps of a variant", "operations in a step", "instructions in a step", "ns for a step", "Gflop/s",
            "share of the peak"]
    return [*_table(head, rows), "",
            "A step is that of one lane. Operations are additions, subtractions, multiplications, divisions and square roots of doubles, counted by valgrind from "
            f"the instructions that {MORE - FEW} variants execute, in a program for AVX2 (four doubles in a register); times are those of the program for this "
            "processor. The peak is that of a loop of unfused additions and multiplications in registers, "
            f"measured here: {1e-9 * peak:.0f} Gflop/s."]


def chunk_costs(sweeping: Sweeping, method: str, tolerance: float, lanes: int, has_mpi: bool, rounds: int) -> list[str]:
    found = {chunk: sweeping.best(rounds, method, tolerance, min(VARIANTS, 512 * chunk), chunk, lanes) for chunk in CHUNKS}
    fastest = min(one["compute"] / min(VARIANTS, 512 * chunk) for chunk, one in found.items())
    rows = []
    for chunk, one in found.items():
        variants = min(VARIANTS, 512 * chunk)
        chunks = variants / chunk
        own = 1e6 * (one["compute"] - fastest * variants) / chunks
        rows.append([str(chunk), f"{variants / one['compute']:.3g}", f"{fastest * variants / one['compute']:.0%}", f"{max(own, 0.0):.0f}",
                     f"{1e6 * one['hand_out'] / chunks:.2f}", f"{1e6 * one['journal'] / chunks:.1f}", str(one["bytes"]),
                     f"{1e6 * sweeping.message(one['bytes']):.1f}" if has_mpi else "-"])
    head = ["variants in a chunk", "variants per second", "efficiency", "start and end, us", "hand-out, us", "journal, us", "bytes",
            "messages, us"]
    size = round(CHUNK_SECONDS / fastest)
    largest = found[CHUNKS[-1]]
    journal = largest["journal"] / (min(VARIANTS, 512 * CHUNKS[-1]) / CHUNKS[-1]) / CHUNKS[-1]
    lines = [*_table(head, rows), "",
             f"`{method}`, {lanes} lanes, one thread. Start and end: what the lanes that begin together and run empty together cost, beside the fastest "
             "chunk. Hand-out: lock and books. Journal: packing, checksum, one write. Messages: request, answer, results and time between two ranks on this machine.", "",
             f"A chunk is made to take {CHUNK_SECONDS} s, {size} variants here but at most 8192. In the journal a variant takes "
             f"{1e6 * journal:.3g} us, a {fastest / journal:.0f}th of what its integration takes"]
    if has_mpi:
        message = sweeping.message(largest["bytes"]) / CHUNKS[-1]
        lines[-1] += (f", and {1e6 * message:.3g} us in messages: rank 0, which does both, would be busy with nothing else at about "
                      f"{fastest / (journal + message):.0f} ranks of this workload")
    lines[-1] += ". Variants that take longer move that limit out in proportion."
    return lines


@dataclass(frozen=True)
class Executed:
    flops: int
    instructions: int
    steps: int


def count_instructions(sweeping: Sweeping, plain: Path, method: str, tolerance: float, lanes: int, variants: int) -> Executed:
    profile = sweeping.scratch / "callgrind.out"
    valgrind = ("valgrind", "--tool=callgrind", "--dump-instr=yes", "--compress-pos=no", "--compress-strings=no",
                f"--callgrind-out-file={profile}")
    steps = sweeping.run(method, tolerance, variants, variants, lanes, valgrind, plain)["steps"]
    program = plain / "chunk_costs"
    counts = executions(profile.read_text(encoding="utf-8"), program.name)
    weights = operations(subprocess.run(["objdump", "--disassemble", "--no-show-raw-insn", program], check=True, capture_output=True,
                                        text=True).stdout)
    return Executed(sum(count * weights[address] for address, count in counts.items()), sum(counts.values()), steps)


def executions(profile: str, program: str) -> Counter:
    """How often each instruction of the program itself was executed, by address."""
    counts, is_own, is_call = Counter(), False, False
    for line in profile.splitlines():
        if line.startswith("ob="):
            is_own = line.endswith("/" + program)
        elif line.startswith("calls="):
            is_call = True  # the next line holds what the called procedure took
        elif line.startswith("0x"):
            if is_own and not is_call:
                address, _, count = line.split()
                counts[int(address, 16)] += int(count)
            is_call = False
    return counts


def operations(disassembly: str) -> Counter:
    """Operations on doubles of each instruction, by address."""
    weights = Counter()
    for address, name, operands in re.findall(r"^\s*([0-9a-f]+):\s+(v?(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\d+)[ps]d)\s+(.*)$",
                                              disassembly, re.MULTILINE):
        width = 1 if name.endswith("sd") else 8 if "zmm" in operands else 4 if "ymm" in operands else 2
        weights[int(address, 16)] = width * (2 if "fm" in name or "fnm" in name else 1)
    return weights


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] + ["---:"] * (len(head) - 1), *rows)]
