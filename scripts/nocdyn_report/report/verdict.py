"""What all analyses and load cases say of the limits: one list, the worst first, every criterion once."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from .result_files import ResultFiles

ANALYSES = ("response", "campbell", "run", "transit", "orbit")  # that compare with limits; of equal lines the first one's stays
FINDINGS = ("exceeded", "not assessed", "restricted", "kept")  # the worst first
OPEN = "not assessed"
STEADY = ("steady", "continuous", "transient")  # words of criteria on steady oscillations; others are on largest values
MOST_CASES = 2  # that are named in a line
DISTANCE = "distance of a critical speed"


@dataclass(frozen=True)
class Line:
    """What one analysis says of one criterion, as `verdict` of its report has it."""

    analysis: str
    cases: tuple[str, ...]  # '' of the machine, or of all load cases together
    element: str
    criterion: str
    rule: str
    limit_at: str
    finding: str
    assessment: str
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    ratio: float | None = None
    detail: str = ""
    lower: frozenset[str] = frozenset()  # other load cases, in which the criterion is kept with a smaller ratio

    @property
    def subject(self) -> str:
        """As "shaft 'tail', stress, continuous (IACS UR M68)"."""
        return f"{self.element}, {self.named_criterion}"

    @property
    def named_criterion(self) -> str:
        return f"{self.criterion} ({self.rule})" if self.rule else self.criterion

    @property
    def question(self) -> tuple[str, ...]:
        """What is asked: lines of one question and one load case answer the same."""
        if self.criterion.startswith(DISTANCE):
            return (DISTANCE, self.element, self.detail)
        kind = "steady" if self.criterion.rpartition(", ")[2] in STEADY else "largest"
        return (kind, self.element, self.limit_at) if self.limit_at else (self.criterion, self.element)

    @property
    def case_names(self) -> str:
        """Of the load cases, '' of the machine."""
        named = [name for name in self.cases if name]
        return ", ".join(named[:MOST_CASES]) + (f" and {len(named) - MOST_CASES} more" if len(named) > MOST_CASES else "")

    @property
    def shown(self) -> tuple:
        """All but the load case."""
        return (self.element, self.named_criterion, self.finding, self.assessment, self.value, self.limit)


def verdict_lines(files: ResultFiles, analyses: Iterable[str] = ANALYSES) -> list[Line]:
    """Of the analyses that have results in a folder."""
    lines = [_line(entry) for analysis in analyses for entry in files.report(analysis).get("verdict", {}).get("lines", [])]
    return worst_first(_once(_answered(lines)))


def worst_first(lines: Iterable[Line]) -> list[Line]:
    return sorted(lines, key=lambda one: (FINDINGS.index(one.finding), -(one.ratio or 0.0)))


def one_for_each_criterion(lines: list[Line]) -> list[Line]:
    """Of the lines on a criterion that is kept in several load cases, the one that is nearest to the limit."""
    shown: dict[tuple, Line] = {}
    for one in lines:
        key = (
            (one.analysis, one.element, one.named_criterion, one.limit_at)
            if one.finding == "kept" and one.limit_at
            else one.shown
        )
        first = shown.get(key)
        shown[key] = replace(first, lower=first.lower | set(one.cases) - set(first.cases)) if first else one
    return list(shown.values())


def failure_line(analysis: str, message: str) -> Line:
    """An analysis that was asked for and gave nothing: its limits are not assessed."""
    return Line(analysis, ("",), "machine", f"all of nocdyn {analysis}", "", "", OPEN, f"{OPEN}: {message}")


def sentence(lines: list[Line]) -> tuple[str, str]:
    """The verdict in one sentence, and its tone."""
    lines = one_for_each_criterion(lines)
    if not lines:
        return "Nothing was compared: the input sets no limits.", ""
    if exceeded := [one for one in lines if one.finding == "exceeded"]:
        told = "; ".join(_told(one) for one in exceeded[:3])
        return f"exceeded: {told}{f'; and {len(exceeded) - 3} more' if len(exceeded) > 3 else ''}.", "bad"
    count = {finding: sum(one.finding == finding for one in lines) for finding in FINDINGS}
    on_condition = f", {count['restricted']} of {len(lines)} on a condition" if count["restricted"] else ""
    if count[OPEN] == len(lines):
        return f"not assessed: {_criteria(len(lines))} not compared with a limit.", "warn"
    if count[OPEN]:
        return f"kept{on_condition}, as far as assessed: {_criteria(count[OPEN])} not assessed.", "warn"
    return f"kept{on_condition}: no limit is exceeded.", "warn" if on_condition else "good"


def _told(one: Line) -> str:
    return f"{one.subject}, {one.assessment}" + (f" (load case {one.case_names})" if one.case_names else "")


def _criteria(count: int) -> str:
    return "one criterion is" if count == 1 else f"{count} criteria are"


def _line(entry: dict) -> Line:
    texts = [entry.get(key, "") for key in ("element", "criterion", "rule", "limit_at", "finding", "assessment")]
    numbers = {key: entry[key] for key in ("value", "limit", "unit", "ratio", "detail") if key in entry}
    return Line(entry["analysis"], (entry.get("load_case", ""),), *texts, **numbers)


def _answered(lines: list[Line]) -> list[Line]:
    """Without lines that are not assessed where another analysis answers the question, or has asked it before, and without
    distances of critical speeds of which an earlier analysis has told the same finding."""
    answered = {(one.cases, one.question) for one in lines if one.finding != OPEN}
    kept, asked = [], {}
    for one in lines:
        key = one.cases, one.question
        first = asked.setdefault(key, one)
        is_asked = first.analysis != one.analysis
        is_told = is_asked and first.finding == one.finding and one.question[0] == DISTANCE
        if is_told or (one.finding == OPEN and (key in answered or is_asked)):
            continue
        kept.append(one)
    return kept


def _once(lines: list[Line]) -> list[Line]:
    """Lines that differ in the load case only are one."""
    found: dict[tuple, Line] = {}
    for one in lines:
        same = found.get(one.shown)
        found[one.shown] = replace(same, cases=tuple(dict.fromkeys(same.cases + one.cases))) if same else one
    return list(found.values())
