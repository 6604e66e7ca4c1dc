"""Mutants of the shipped inputs and command lines: `scripts/fuzz --help`."""

import argparse
import collections
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

from . import commands, findings
from .corpus import SOURCE, read_corpus
from .execution import Limits, execute, is_sanitized
from .judgement import findings as judge
from .mutations import mutate_file

state = {}  # of a worker


def make_case(seed, number, corpus, shares):
    """The mutant of that number; the same whatever else is computed."""
    rng = random.Random(f"{seed} {number}")
    case = commands.add_command(rng, rng.choice(corpus.cases), shares)
    for _ in range(rng.choice((0, 1, 1, 1, 1, 1, 1, 2, 3))):
        case = mutate_file(rng, case, corpus)
    case = commands.small_sweep(rng, case)
    if not case.changes or rng.random() < 0.15:
        case = commands.mutate_words(rng, case)
    return case


def may_be_long(case):
    """Whether nothing limits what the input asks for: a sweep, or a command line without its limit of steps."""
    is_limited = ("--set", commands.STEPS[1]) in zip(case.words, case.words[1:])
    has_loop = case.words[:1] in (("sweep",), ("response",), ("campbell",), ("report",))
    return has_loop or (case.words[:1] in (("run",), ("modes",)) and not is_limited)


def is_of_sweep(path):
    """Whether the input has groups that `check` looks at and `run` does not."""
    return any(group in path.read_bytes() for group in (b"&vary", b"&record", b"&sweep"))


def examine(case):
    """What a command answers, and what is wrong with that."""
    folder = Path(tempfile.mkdtemp(dir=state["folder"]))
    for name, content in case.files.items():
        (folder / name).write_bytes(content)
    try:
        outcome = execute(state["program"], case.words, folder, state["limits"], interrupt=may_be_long(case))
        complaints = judge(case, outcome, folder, state["limits"].memory)
        checked = folder / "out/input.nml"
        if not complaints and outcome.code == 0 and case.words[0] == "run" and checked.is_file() and not is_of_sweep(checked):
            again = execute(state["program"], ("check", "out/input.nml"), folder, state["limits"])
            complaints = [] if again.code == 0 else ["its own input.nml is refused"]
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return outcome, complaints


def start_worker(program, limits, folder, options):
    limits.apply()
    state.update(program=program, limits=limits, folder=folder, corpus=read_corpus(), options=options)


def work(number):
    """One mutant; what was found is stored."""
    options = state["options"]
    shares = commands.DEEP if options.deep else commands.COMMANDS
    case = make_case(options.seed, number, state["corpus"], shares)
    outcome, complaints = examine(case)
    if complaints:
        if "takes too long" not in complaints and not options.as_it_is:
            case = findings.minimised(case, complaints[0], lambda smaller: examine(smaller)[1])
            outcome, complaints = examine(case)
        findings.store(case, complaints, outcome, options.findings / str(number))
    return number, case.words[:1], outcome.code, complaints


def parse():
    parser = argparse.ArgumentParser(
        prog="scripts/fuzz",
        description="Runs commands of nocdyn on mutants of the shipped inputs, and tells where nocdyn breaks a promise: crashes, "
        "numbers that are not finite, results after a failure, failures without a message, too much time or memory.",
        epilog="Exit codes: 0 nothing was found, 1 findings, 2 wrong usage.",
    )
    parser.add_argument("--build", type=Path, default=SOURCE / "build/release", help="folder of the build (build/release)")
    parser.add_argument("--count", type=int, default=2000, help="so many mutants (2000)")
    parser.add_argument("--seed", type=int, default=1, help="of the random numbers (1)")
    parser.add_argument("--first", type=int, default=1, help="number of the first mutant (1); with --count 1, a single one again")
    parser.add_argument("--deep", action="store_true", help="fewer checks, more runs, steady states, modes and sweeps")
    parser.add_argument("--jobs", type=int, default=2, help="processes at the same time (2)")
    parser.add_argument("--seconds", type=float, default=10, help="of the processor for a mutant (10)")
    parser.add_argument("--memory", type=int, default=1500, help="MB for a mutant (1500)")
    parser.add_argument("--findings", type=Path, default=Path("fuzz_findings"), help="folder for findings (fuzz_findings)")
    parser.add_argument("--as-it-is", action="store_true", help="store findings without making them small")
    return parser.parse_args()


def report(counts, found, seconds):
    total = sum(counts.values())
    print(f"{total} mutants in {seconds:.0f} s: " + ", ".join(f"{count} {name}" for name, count in sorted(counts.items())))
    for complaint, numbers in sorted(found.items(), key=lambda item: -len(item[1])):
        print(f"  {complaint}: {len(numbers)}, e.g. {', '.join(map(str, numbers[:5]))}")


def main():
    options = parse()
    program = (options.build / "bin/nocdyn").resolve()
    if not program.is_file():
        print(f"scripts/fuzz: there is no program {program}", file=sys.stderr)
        return 2
    options.findings = options.findings.resolve()
    limits = Limits(seconds=options.seconds, memory=options.memory, is_sanitized=is_sanitized(program))
    begun = time.monotonic()
    counts, found = collections.Counter(), collections.defaultdict(list)
    with tempfile.TemporaryDirectory(prefix="nocdyn-fuzz-") as folder:
        numbers = range(options.first, options.first + options.count)
        with multiprocessing.Pool(options.jobs, start_worker, (program, limits, folder, options)) as pool:
            for number, words, code, complaints in pool.imap_unordered(work, numbers, chunksize=4):
                counts[f"{words[0] if words and words[0] in commands.COMMANDS else 'other'} ({code})"] += 1
                for complaint in complaints:
                    found[complaint].append(number)
    report(counts, found, time.monotonic() - begun)
    if found:
        print(f"scripts/fuzz: findings; inputs and commands are in {options.findings}", file=sys.stderr)
        return 1
    return 0


sys.exit(main())
