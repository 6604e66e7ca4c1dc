"""What nocdyn promises, whatever it is given: the promises that an outcome breaks."""

import json
import re
import unicodedata

CRASHES = (
    b"Backtrace", b"ERROR STOP", b"Error termination", b"Fortran runtime", b"On entry to", b"Program received signal",
    b"runtime error", b"Sanitizer",
    b"Traceback", b"a mistake in this script",
    b"terminate called", b"Assertion", b"IEEE_", b"Error allocating", b"internal error",
)  # fmt: skip
NOT_FINITE = re.compile(r"(?<![\w'.])[-+]?(?:nan|inf|infinity)(?!\w)", re.IGNORECASE)
QUOTED = re.compile(rb"'[^'\n]*'|\"[^\"\n]*\"|=[^/\n]*")
FINISHED = (
    "trajectory.csv", "trajectory.nc", "cycles.csv", "equilibrium.json", "modes.csv", "modes.json", "sweep.nc", "sweep.csv",
    "response.csv", "response_orders.csv", "response.nc", "response.json", "campbell.csv", "campbell.json", "report.html",
)  # fmt: skip
DIRECTIONS = "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"


def odd_characters(text):
    """The first thing in bytes that a terminal must not get."""
    try:
        decoded = text.decode()
    except UnicodeDecodeError:
        return "what is not UTF-8"
    for character in decoded:
        if character != "\n" and (unicodedata.category(character) in ("Cc", "Zl", "Zp") or character in DIRECTIONS):
            return f"U+{ord(character):04X}"
    return None


def refuse_constant(name):
    raise ValueError(f"{name} in JSON")


def read_json(path):
    return json.loads(path.read_text(), parse_constant=refuse_constant)


def csv_findings(path):
    """Numbers that are not finite below the header; in sweep.csv, of variants that are done."""
    header, *rows = path.read_text().splitlines() or [""]
    names = header.split(",")
    status = names.index("status") if "status" in names else None
    for number, row in enumerate(rows, 2):
        cells = row.split(",")
        if status is not None and cells[status] not in ("0", "done"):
            continue
        if any(NOT_FINITE.fullmatch(cell.strip()) for cell in cells):
            yield f"{path.name} line {number} has a number that is not finite"
            return


def netcdf_findings(path):
    """Results of variants that are done and not finite."""
    try:
        import h5py
        import numpy
    except ImportError:
        return
    with h5py.File(path) as file:
        done = file["status"][:] == 0
        for name, data in file.items():
            values = data[:] if data.attrs.get("role", b"") in (b"result", "result") else None
            if values is not None and values.shape == done.shape and not numpy.isfinite(values[done]).all():
                yield f"{path.name}: {name} of a variant that is done is not finite"


def file_findings(path):
    try:
        if path.suffix == ".json":
            read_json(path)
        elif path.suffix == ".csv":
            yield from csv_findings(path)
        elif path.name == "sweep.nc":
            yield from netcdf_findings(path)
    except (ValueError, OSError, KeyError, IndexError, RuntimeError) as error:
        yield f"{path.name} cannot be read: {error}"[:200]


def result_files(case, folder):
    return [path for path in sorted(folder.rglob("*")) if path.is_file() and str(path.relative_to(folder)) not in case.files]


def failure_findings(case, outcome, folder):
    """A failure says why, and leaves nothing that looks like a result."""
    if not outcome.err.strip():
        yield f"exit code {outcome.code} without a message"
    if any(change.startswith("words: ") and change != "words: set" for change in case.changes):
        return  # perhaps of several files, the others of which are done
    if case.words[:1] == ("report",):
        return  # it reports failures too, beside what did not fail
    for path in result_files(case, folder):
        if path.name in FINISHED and not (path.name.startswith("sweep.") and outcome.code == 1):
            yield f"exit code {outcome.code} leaves {path.name}"
        if path.name.startswith("."):
            yield f"exit code {outcome.code} leaves {re.sub('[0-9]+', 'N', path.name)}"
        if path.name == "summary.json" and "sweep" not in case.words and read_json(path)["status"] == "done":
            yield f"exit code {outcome.code} leaves a summary of success"


def success_findings(case, outcome, folder):
    texts = b" ".join(QUOTED.findall(b" ".join([*case.files.values(), *(word.encode(errors="replace") for word in case.words)])))
    if not NOT_FINITE.search(texts.decode(errors="replace").replace("'", " ")):
        found = NOT_FINITE.search(outcome.out.decode(errors="replace"))
        if found:
            yield f"'{found[0].lower()}' among the results printed"
    for path in result_files(case, folder):
        if path.name.startswith("."):
            yield f"exit code 0 leaves {re.sub('[0-9]+', 'N', path.name)}"
        else:
            yield from file_findings(path)


def findings(case, outcome, folder, memory):
    """Sentences, none if all is well."""
    if not outcome.in_time:
        return ["takes too long"]
    crashes = [word.decode() for word in CRASHES if word in outcome.err or word in outcome.out]
    if crashes:
        return [f"'{crashes[0]}' is printed"]
    if outcome.code < 0:
        return [f"ended by signal {-outcome.code}"]
    if outcome.code not in (0, 1, 2, 3):
        return [f"exit code {outcome.code}"]
    found = [f"takes more than {memory} MB"] if outcome.memory > memory else []
    for name, text in (("output", outcome.out), ("error", outcome.err)):
        odd = odd_characters(text)
        if odd:
            found.append(f"{odd} in standard {name}")
    found += failure_findings(case, outcome, folder) if outcome.code else success_findings(case, outcome, folder)
    return sorted(set(found))
