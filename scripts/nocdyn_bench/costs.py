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
from .tables import rounded, table

VARIANTS = 16384  # integrated for one number
FEW, MORE = 64, 192  # variants that are integrated while instructions are counted; the difference counts
CHUNKS = (1, 4, 16, 64, 256, 1024, 4096)
MESSAGES = 10000
RANKS = (1, 2, 10, 55, 100, 1000, 10000)
SIMULATED = ((1e10, 1e-5), (1e8, 1e-2))  # variants and the seconds of one
ANSWER = 5e-6  # of rank 0 to a request over a network; what nocdyn counts on, src/analyse/sweep/engine/hand_out.f90
SPREAD = 0.5  # of the time of variants from share to share


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

    def message(self, rounds: int) -> float:
        """Seconds for the messages about one share of the variants."""
        command = [*MPIRUN, "-n", 2, self.folder / "mpi_message_costs", MESSAGES]
        return min(_report(command)["seconds"] for _ in range(rounds))

    def hand_out(self, ranks: int, variants: float, seconds: float, journal: float, answer: float) -> dict:
        """What a simulation says of variants that take so many seconds."""
        return _report([self.folder / "hand_out_costs", ranks, variants, seconds, journal, answer, SPREAD])


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


def chunk_costs(sweeping: Sweeping, case: Case, rounds: int) -> list[str]:
    costs = [sweeping.best(rounds, case, min(VARIANTS, 512 * chunk), chunk) for chunk in CHUNKS]
    fastest = max(cost.rate for cost in costs)
    rows = []
    for cost in costs:
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
    ]
    return [
        *table(head, rows),
        "",
        f"`{case.method}`, {costs[0].lanes} lanes, one thread. Start and end: cost of filling the lanes at the "
        "start and of idle lanes at the end, compared with the fastest chunk. Hand-out: lock and scheduler. Journal: "
        "packing, checksum, one write.",
    ]


def hand_out_costs(sweeping: Sweeping, case: Case, rounds: int) -> list[str]:
    """The hand-out to many ranks, simulated with the costs of this machine."""
    cost = sweeping.best(rounds, case, VARIANTS, CHUNKS[-1])
    journal, message = cost.journal / cost.variants, sweeping.message(rounds)
    answer = max(message, ANSWER)
    rows = []
    for variants, seconds in SIMULATED:
        for ranks in RANKS:
            found = sweeping.hand_out(ranks, variants, seconds, journal, answer)
            sweep = [f"{variants:.0e}".replace("e+0", "e").replace("e+", "e"), _duration(seconds)]
            rows.append([rounded(ranks), *sweep, f"{found['efficiency']:.1%}", rounded(found["seconds"]), f"{found['busy']:.1%}"])
    head = ["ranks", "variants", "time of a variant", "efficiency", "time of the sweep, s", "rank 0 hands out"]
    return [
        *table(head, rows),
        "",
        "Efficiency: share of the time of all ranks, of one thread each, in which they integrate. A simulation of the hand-out "
        f"by the procedure of `nocdyn-mpi`: a variant takes {1e6 * journal:.2g} us in the journal of its rank, as measured here, "
        f"and a request {1e6 * answer:.2g} us of rank 0; between two ranks of this machine its messages take {1e6 * message:.2g} "
        f"us. The variants of one share take up to {SPREAD:.0%} more or less time than those of another. The time "
        "is that until the last rank ends, without the start of the ranks and the merge of the journals.",
    ]


def _duration(seconds: float) -> str:
    return f"{1e6 * seconds:.0f} us" if seconds < 1e-3 else f"{1e3 * seconds:.0f} ms"


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
