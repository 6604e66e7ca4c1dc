"""The words of a command: what nocdyn is asked, within which limits, and changes of these words."""

import re

from .corpus import paths
from .mutations import ODD_BYTES, extreme

BODY = re.compile(rb"&body\s+name\s*=\s*('[^'\n]*')", re.IGNORECASE)

# of a hundred mutants; `check` is the quickest
COMMANDS = {"check": 64, "run": 11, "equilibrium": 6, "modes": 5, "matrices": 3, "sweep": 5, "response": 4, "campbell": 2}
# Fewer `check`, for a long search.
DEEP = {
    "check": 15, "run": 27, "equilibrium": 13, "modes": 10, "matrices": 5, "sweep": 11, "response": 10, "campbell": 8, "report": 1
}  # fmt: skip

# What a run may take, whatever the input says.
STEPS = ("--set", "run.max_steps=300")
OPTIONS = (
    ("--out", ""), ("--out", "a/b/c"), ("--out",), ("--set",), ("--set", "="), ("--set", "run"), ("--set", "run.=1"),
    ("--set", ".=1"), ("--set", "a.b.c.d=1"),
    ("--quiet",), ("--csv",), ("--resume",), ("--threads", "0"), ("--threads", "-1"), ("--threads", "99999999999"),
    ("--threads", "x"), ("--shard", "1/2"),
    ("--shard", "0/2"), ("--shard", "3/2"), ("--shard", "1/0"), ("--shard", "2147483647/2147483647"), ("--shard", "a/b"),
    ("--shard", "1/99999999999"),
    ("--at", "rest"), ("--at", "0"), ("--at", "1e308"), ("--at", "-1"), ("--at", "nan"), ("--at", ""), ("--help",),
    ("--version",), ("--", "-x"), ("--x\x1b[1m",),
    ("none.nml",), (".",), ("",), ("/dev/null",), ("x" * 300,), ("\x1b[31m.nml",), ("a/" * 2000,),
)  # fmt: skip


def add_command(rng, case, shares):
    """The command for a case; sweeps for cases that describe one."""
    command = rng.choices(list(shares), weights=list(shares.values()))[0]
    if command == "sweep" and b"&sweep" not in case.files[case.main]:
        command = "run"
    if command in ("response", "campbell", "report"):
        case = with_response(rng, case)
    words = [command, case.main]
    if command in ("run", "sweep", "response", "campbell", "report") or (
        command in ("equilibrium", "modes") and rng.random() < 0.5
    ):
        words += ["--out", "out"]
    if command in ("run", "sweep", "modes", "report"):
        words += STEPS
    if command in ("response", "campbell", "report") and rng.random() < 0.8:
        words += ("--set", "response.count=5")
    if command == "report":
        words += ("--no-pdf", "--quiet")
    if command == "modes":
        words += rng.choice(([], [], ["--at", "rest"], ["--at", "equilibrium"], ["--at", "0.01"]))
    if command == "sweep":
        words += ["--threads", rng.choice("12")]
        words += rng.choice(([], ["--csv"], ["--quiet"]))
    return case.with_words(words)


def with_response(rng, case):
    """A case with speeds for a forced response."""
    content = case.files[case.main]
    body = BODY.search(content)
    if b"&response" in content or not body:
        return case
    low = rng.choice((1, 10, 100))
    return case.with_file(case.main, content + b"&response body = %s speed = %d, %d /\n" % (body[1], low, low * 3))


def small_sweep(rng, case):
    """As few variants as show something."""
    words = list(case.words)
    content = case.files[case.main]
    if words[0] == "sweep":
        if b"samples" in content:
            words += ["--set", f"sweep.samples={rng.choice((1, 3, 33))}"]
        words += [
            word for i in range(content.count(b"count =")) for word in ("--set", f"vary({i + 1}).count={rng.choice((1, 2, 5))}")
        ]
    return case.with_words(words)


def set_word(rng, case):
    """PATH=VALUE for a number of the input, most often extreme."""
    known = paths(case.files[case.main])
    if not known:
        return ("--set", "run.t_end=1")
    path, value = rng.choice(known)
    new_value = extreme(rng).decode()
    new = rng.choice(
        (
            new_value,
            new_value,
            new_value,
            value,
            value + "," + new_value,
            "",
            rng.choice(ODD_BYTES).decode("utf-8", "surrogateescape"),
        )
    )
    return ("--set", f"{path}={new}".replace("\0", ""))


def mutate_words(rng, case):
    """One change of the command line."""
    words = list(case.words)
    change = rng.choice(("set", "set", "set", "option", "command", "twice", "drop", "swap", "odd"))
    at = rng.randrange(len(words))
    if change == "set":
        words += set_word(rng, case)
    elif change == "option":
        words += rng.choice(OPTIONS)
    elif change == "command":
        words[0] = rng.choice(
            ("merge", "new", "help", "sweep", "run", "matrices", "equilibrium", "response", "campbell", "chek", "")
        )
    elif change == "twice":
        words.insert(at, words[at])
    elif change == "drop":
        del words[at]
    elif change == "swap":
        other = rng.randrange(len(words))
        words[at], words[other] = words[other], words[at]
    else:
        odd = rng.choice(ODD_BYTES).decode("utf-8", "surrogateescape").replace("\0", "")
        where = rng.randrange(len(words[at]) + 1)
        words[at] = words[at][:where] + odd + words[at][where:]
    return case.with_words(words, f"words: {change}")
