"""What a step and what a chunk of a sweep cost: numbers behind the rates of W2."""

import json
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from .nocdyn_sweep import MPIRUN, write_sweep
from .tables import table

VARIANTS = 16384  # integrated for one number
FEW, MORE = 64, 192  # variants that are integrated while instructions are counted; the difference counts
CHUNKS = (1, 4, 16, 64, 256, 1024, 4096)
MESSAGES = 300
CHUNK_SECONDS, MOST_AT_ONCE = 0.2, 8192  # what nocdyn aims at, src/analyse/sweep/engine/journal_scheduler.f90


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
class Case:
    """How variants of W2 are integrated."""

    method: str
    tolerance: float


@dataclass(frozen=True)
class Cost:
    """Of so many variants in chunks; seconds of all of them."""

    variants: int
    chunk: int
    compute: float
    hand_out: float
    journal: float
    bytes: int  # of a chunk
    steps: int
    lanes: int

    @property
    def chunks(self) -> float:
        return self.variants / self.chunk

    @property
    def rate(self) -> float:
        return self.variants / self.compute


@dataclass(frozen=True)
class Sweeping:
    """The programs of bench/ that measure costs."""

    folder: Path
    scratch: Path

    def run(self, case: Case, variants: int, chunk: int, before: tuple = (), folder: Path | None = None) -> Cost:
        """`before`: a command that runs the program; `folder`: of another build."""
        file, out = self.scratch / "costs.nml", self.scratch / "costs"
        shutil.rmtree(out, ignore_errors=True)
        write_sweep(file, variants, f"method = '{case.method}' rtol = {case.tolerance} atol = {case.tolerance}")
        program = (folder or self.folder) / "chunk_costs"
        return Cost(variants, chunk, **_report([*before, program, file, variants, chunk, out]))

    def best(self, rounds: int, case: Case, variants: int, chunk: int) -> Cost:
        """The shortest time of each kind."""
        found = [self.run(case, variants, chunk) for _ in range(rounds)]
        shortest = {key: min(getattr(cost, key) for cost in found) for key in ("compute", "hand_out", "journal")}
        return replace(found[0], **shortest)

    def peak(self, rounds: int) -> float:
        """Unfused additions and multiplications in a second, of a loop that does nothing else."""
        return max(_report([self.folder / "peak_flops"])["flops"] for _ in range(rounds))

    def message(self, rounds: int, size: int) -> float:
        """Seconds for the messages about one chunk whose results have so many bytes."""
        command = [*MPIRUN, "-n", 2, self.folder / "mpi_message_costs", size, MESSAGES]
        return min(_report(command)["seconds"] for _ in range(rounds))


def _report(command: list) -> dict:
    """What a program prints."""
    return json.loads(subprocess.run(list(map(str, command)), check=True, capture_output=True, text=True).stdout)


def step_costs(sweeping: Sweeping, plain: Path, cases: list[Case], rounds: int) -> list[str]:
    """`plain`: programs for processors with AVX2, which valgrind knows."""
    peak = sweeping.peak(rounds)
    rows = []
    for case in cases:
        fast = sweeping.best(rounds, case, VARIANTS, 2048)
        few, more = (count_instructions(sweeping, plain, case, variants) for variants in (FEW, MORE))
        steps, flops = more.steps - few.steps, (more.flops - few.flops) / (MORE - FEW)
        rows.append(
            [
                f"`{case.method}`",
                f"{case.tolerance:.1e}",
                str(fast.lanes),
                f"{fast.steps / VARIANTS:.1f}",
                f"{(more.flops - few.flops) / steps:.0f}",
                f"{(more.instructions - few.instructions) / steps:.0f}",
                f"{1e9 * fast.compute / fast.steps:.0f}",
                f"{1e-9 * flops * fast.rate:.1f}",
                f"{flops * fast.rate / peak:.0%}",
            ]
        )
    head = [
        "method",
        "tolerance",
        "lanes",
        "steps of a variant",
        "operations in a step",
        "instructions in a step",
        "ns for a step",
        "Gflop/s",
        "share of the peak",
    ]
    return [
        *table(head, rows),
        "",
        "A step is that of one lane, its share of starting variants and following statistics included. Operations are additions, "
        "subtractions, multiplications, divisions and square roots of doubles, counted by valgrind from the instructions that "
        f"{MORE - FEW} variants execute, in a program for AVX2 (four doubles in a register); times are those of the program for "
        "this processor. The peak is that of a loop of unfused additions and multiplications in registers, measured here: "
        f"{1e-9 * peak:.0f} Gflop/s.",
    ]


def chunk_costs(sweeping: Sweeping, case: Case, has_mpi: bool, rounds: int) -> list[str]:
    costs = [sweeping.best(rounds, case, min(VARIANTS, 512 * chunk), chunk) for chunk in CHUNKS]
    messages = [sweeping.message(rounds, cost.bytes) if has_mpi else None for cost in costs]
    fastest = max(cost.rate for cost in costs)
    rows = []
    for cost, message in zip(costs, messages):
        own = 1e6 * (cost.compute - cost.variants / fastest) / cost.chunks
        rows.append(
            [
                str(cost.chunk),
                f"{cost.rate:.3g}",
                f"{cost.rate / fastest:.0%}",
                f"{own:.0f}",
                f"{1e6 * cost.hand_out / cost.chunks:.2f}",
                f"{1e6 * cost.journal / cost.chunks:.1f}",
                str(cost.bytes),
                f"{1e6 * message:.1f}" if has_mpi else "-",
            ]
        )
    head = [
        "variants in a chunk",
        "variants per second",
        "efficiency",
        "start and end, us",
        "hand-out, us",
        "journal, us",
        "bytes",
        "messages, us",
    ]
    return [
        *table(head, rows),
        "",
        f"`{case.method}`, {costs[0].lanes} lanes, one thread. Start and end: cost of filling the lanes at the "
        "start and of idle lanes at the end, compared with the fastest chunk. Hand-out: lock and scheduler. Journal: "
        "packing, checksum, one write. Messages: request, answer, results and time between two ranks on this machine, without "
        "the work of either.",
        "",
        scaling_out(costs[-1], messages[-1], fastest),
    ]


def scaling_out(cost: Cost, message: float | None, rate: float) -> str:
    """What the largest chunk says of many workers."""
    journal = cost.journal / cost.variants
    text = (
        f"The size of a chunk is chosen for {CHUNK_SECONDS} s of work, {CHUNK_SECONDS * rate:.0f} variants here, with a limit of "
        f"{MOST_AT_ONCE}. A variant takes {1e6 * journal:.2g} us in the journal and {1e6 / rate:.3g} us for its integration"
    )
    if message is not None:
        both = journal + message / cost.chunk
        text += (
            f", and {1e6 * message / cost.chunk:.2g} us in messages. Rank 0 does both for all others, and is busy "
            f"with it at about {1 / (rate * both):.0f} ranks of one thread"
        )
    return text + ". With longer variants the limit grows in proportion."


@dataclass(frozen=True)
class Executed:
    flops: int
    instructions: int
    steps: int


def count_instructions(sweeping: Sweeping, plain: Path, case: Case, variants: int) -> Executed:
    profile = sweeping.scratch / "callgrind.out"
    valgrind = (
        "valgrind",
        "--tool=callgrind",
        "--dump-instr=yes",
        "--compress-pos=no",
        "--compress-strings=no",
        f"--callgrind-out-file={profile}",
    )
    steps = sweeping.run(case, variants, variants, valgrind, plain).steps
    program = plain / "chunk_costs"
    counts = executions(profile.read_text(encoding="utf-8"), program.name)
    disassemble = ["objdump", "--disassemble", "--no-show-raw-insn", program]
    weights = operations(subprocess.run(disassemble, check=True, capture_output=True, text=True).stdout)
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
    for address, name, operands in re.findall(
        r"^\s*([0-9a-f]+):\s+(v?(?:add|sub|mul|div|sqrt|fn?m(?:add|sub)\d+)[ps]d)\s+(.*)$", disassembly, re.MULTILINE
    ):
        width = 1 if name.endswith("sd") else 8 if "zmm" in operands else 4 if "ymm" in operands else 2
        weights[int(address, 16)] = width * (2 if "fm" in name or "fnm" in name else 1)
    return weights
