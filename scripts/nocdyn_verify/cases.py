"""The cases: for each feature a folder with cases.csv, a row for each quantity that is known, and the folders of inputs."""

import csv
import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .failure import USAGE, VerificationError

TABLE = "cases.csv"
RELEASED = "released.csv"
RELEASED_COLUMNS = ("id", "version", "value")
INPUT = "case.nml"
ORIGINS = ("closed form", "published", "conservation", "other code", "measured")
ERRORS = ("relative", "absolute")
# Chapters of the guide, in its order: folders with underscores for spaces.
FEATURES = (
    "bodies",
    "couplings",
    "shafts",
    "gears",
    "losses",
    "joints that lock",
    "joints that move",
    "engines",
    "electrical machines",
    "steady states",
    "modes",
    "campbell",
    "response",
    "orbit",
    "transit",
    "fatigue",
    "sweeps",
)
COLUMNS = (
    "id",
    "folder",
    "command",
    "quantity",
    "signal",
    "at",
    "expected",
    "unit",
    "tolerance",
    "error",
    "origin",
    "reference",
)


@dataclass(frozen=True)
class Case:
    """A quantity that is known."""

    id: str  # feature.name
    feature: str  # chapter of the guide
    folder: str  # of its input, in the one of the cases; several cases may share one
    command: str  # words after nocdyn, without the file: 'modes --at rest'
    quantity: str  # in words
    signal: str  # a column of the table, or a path in the report
    at: str  # where: 't = 1', 'maximum', 'mode = 2, order = 1'
    expected: float
    unit: str
    tolerance: float
    error: str  # of the tolerance: relative or absolute
    origin: str
    reference: str  # the formula with its source, or the publication

    @property
    def home(self) -> str:
        """The folder of the feature."""
        return self.id.partition(".")[0]

    def difference(self, computed: float) -> float:
        """Computed less expected, as the tolerance counts it."""
        difference = computed - self.expected
        return difference / abs(self.expected) if self.error == "relative" else difference


def read_cases(folder: Path) -> list[Case]:
    """All cases of a folder, by features."""
    features = [name for name in FEATURES if (folder / name.replace(" ", "_") / TABLE).is_file()]
    if not features:
        raise VerificationError(f"{folder}: there is no folder of a feature with {TABLE}; features: {', '.join(FEATURES)}")
    return [case for feature in features for case in read_table(folder, feature)]


def read_table(folder: Path, feature: str) -> list[Case]:
    path = folder / feature.replace(" ", "_") / TABLE
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
            columns = tuple(reader.fieldnames or ())
    except OSError as error:
        raise VerificationError(f"{path}: cannot be read: {error.strerror}") from None
    if columns != COLUMNS:
        raise VerificationError(f"{path}: the columns are {', '.join(columns)}; needed: {', '.join(COLUMNS)}", USAGE)
    cases = [read_case(path, line, row, feature) for line, row in enumerate(rows, start=2)]
    names = [case.id for case in cases]
    for name in names:
        if names.count(name) > 1:
            raise VerificationError(f"{path}: there are {names.count(name)} cases {name!r}; needed: one of a name", USAGE)
    return cases


def read_case(path: Path, line: int, row: dict[str, str], feature: str) -> Case:
    def refuse(key: str, allowed: str) -> VerificationError:
        return VerificationError(f"{path}:{line}: {key} = {row[key]!r}; allowed: {allowed}", USAGE)

    if None in row or None in row.values():
        raise VerificationError(f"{path}:{line}: needed: {len(COLUMNS)} values", USAGE)
    numbers = {}
    for key in ("expected", "tolerance"):
        try:
            numbers[key] = float(row[key])
        except ValueError:
            raise refuse(key, "a number") from None
    if not numbers["tolerance"] > 0:
        raise refuse("tolerance", "a number above 0")
    if row["error"] not in ERRORS:
        raise refuse("error", ", ".join(ERRORS))
    if row["error"] == "relative" and numbers["expected"] == 0:
        raise refuse("error", "absolute, as 0 is expected")
    if row["origin"] not in ORIGINS:
        raise refuse("origin", ", ".join(ORIGINS))
    if not (path.parent / row["folder"] / INPUT).is_file():
        raise refuse("folder", f"a folder beside the table with {INPUT}")
    home = feature.replace(" ", "_")
    own = {"id": f"{home}.{row['id']}", "folder": f"{home}/{row['folder']}", "feature": feature}
    return Case(**{**row, **numbers, **own})


def read_released(folder: Path) -> tuple[str, dict[str, float]]:
    """The version of the latest release, and what it computed; nothing without such a file."""
    path = folder / RELEASED
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return rows[0]["version"], {row["id"]: float(row["value"]) for row in rows}
    except FileNotFoundError:
        return "", {}
    except OSError as error:
        raise VerificationError(f"{path}: cannot be read: {error.strerror}") from None
    except (IndexError, KeyError, TypeError, ValueError):
        needed = f"{', '.join(RELEASED_COLUMNS)} in each row, as nocdyn verify --keep writes them"
        raise VerificationError(f"{path}: needed: {needed}", USAGE) from None


def write_released(folder: Path, version: str, values: dict[str, float]) -> Path:
    """Keeps what this version computed, for the next one; the file."""
    path = folder / RELEASED
    part = path.with_suffix(".part")
    try:
        with part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(RELEASED_COLUMNS)
            writer.writerows((name, version, repr(value)) for name, value in sorted(values.items()))
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise VerificationError(f"{path}: cannot be written: {error.strerror}") from None
    return path


def chosen(cases: Sequence[Case], words: Sequence[str]) -> list[Case]:
    """Those of some features, with underscores or spaces, or with some names; all without words."""
    if not words:
        return list(cases)
    wanted = {word.replace("_", " ") if word in {case.home for case in cases} else word for word in words}
    features = list(dict.fromkeys(case.feature for case in cases))
    for word in wanted - {case.id for case in cases} - set(features):
        near = difflib.get_close_matches(word, [*features, *(case.id for case in cases)], 1)
        hint = f"did you mean {near[0]!r}?" if near else f"allowed: a name as in the table, or a feature: {', '.join(features)}"
        raise VerificationError(f"there is no case or feature {word!r}; {hint}", USAGE)
    return [case for case in cases if case.id in wanted or case.feature in wanted]
