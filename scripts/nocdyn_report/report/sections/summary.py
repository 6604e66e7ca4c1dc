"""The verdict, first of all, and the key results."""

from ...columns import LOADS
from ...speed_results import roman
from ..content import Cell, Paragraph, Section, Table, text
from ..numbers import number_text, percent
from ..readable import texts
from ..sources import Sources
from ..verdict import Line, one_for_each_criterion, sentence
from .orbit import parameter_of, unstable_ranges
from .steady import ordered_states, stability_text

MOST_NAMED = 6  # of one sort
MOST_PEAKS = 2  # of a kind
MOST_LINES = 40
TONES = {"exceeded": "bad", "not assessed": "warn", "restricted": "warn", "kept": "good"}


def summary_section(sources: Sources) -> Section:
    section = Section("summary", "Verdict")
    section.add(Paragraph(*sentence(sources.verdict)))
    if sources.verdict:
        section.add(*_verdict(sources))
    rows: list[list[Cell]] = []
    for make in (_failures, _steady, _frequencies, _criticals, _passages, _jumps, _peaks):
        rows += make(sources)
    return section.add(Table("Key results", ["subject", "finding", "assessment"], rows, is_sorted=False))


def _verdict(sources: Sources) -> list[Table]:
    lines = one_for_each_criterion(sources.verdict)
    shown = Table("Verdict on all limits, the worst first", *_table(sources, lines[:MOST_LINES]), is_sorted=False)
    if len(lines) > MOST_LINES:
        shown.note = f"{len(lines) - MOST_LINES} more lines, none of them worse, are in the files of the results."
    return [shown]


def _table(sources: Sources, lines: list[Line]) -> tuple[list[str], list[list[Cell]]]:
    has_cases = any(name for one in lines for name in one.cases)
    rows = []
    for one in lines:
        ratio = "" if one.ratio is None else percent(one.ratio, 4) if one.ratio > 1e-6 else f"0{percent(0)[1:]}"
        amounts = [sources.units.amount(value, one.unit, like=one.limit) for value in (one.value, one.limit)]
        row = texts([one.element, one.named_criterion])
        row += [
            Cell(word, _key(value), is_number=True) for word, value in zip((*amounts, ratio), (one.value, one.limit, one.ratio))
        ]
        cases = [text(_cases(one))] if has_cases else []
        rows.append([*cases, *row, text(one.assessment, TONES[one.finding])])
    heads = ["element", "criterion", "value", "limit", "of limit", "finding"]
    return (["load case", *heads] if has_cases else heads), rows


def _cases(line: Line) -> str:
    return (line.case_names or "all") + (f" (largest of {len(line.cases) + len(line.lower)} load cases)" if line.lower else "")


def _key(value: float | None) -> float:
    return float("inf") if value is None else value


def _row(subject: str, target: str, finding: str, assessment: str = "", tone: str = "") -> list[Cell]:
    return [text(subject, "", f"#{target}"), text(finding), text(assessment, tone)]


def _listed(words: list[str], most: int = MOST_NAMED) -> str:
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def _failures(sources: Sources) -> list[list[Cell]]:
    """Commands that the input asks for and that gave no result: nothing below tells of what they would have shown."""
    rows = []
    for command, subject in (
        ("run", "Run"),
        ("response", "Forced response"),
        ("campbell", "Campbell diagram"),
        ("transit", "Passage"),
        ("orbit", "Periodic motions"),
    ):
        one = sources.results.of.get(command)
        if one and one.state in ("failed", "refused"):
            rows.append(_row(subject, "scope", one.message, one.state, "bad"))
    return rows


def _steady(sources: Sources) -> list[list[Cell]]:
    if not sources.has("equilibrium"):
        return []
    states = ordered_states(sources.equilibrium)
    if len(states) > 1:
        stable = sum(1 for state in states if state["stability"] == "stable")
        return [_row("Steady states", "steady", f"{len(states)} steady states, {stable} of them stable.")]
    (state,) = states
    is_stable = state["stability"] == "stable"
    tone = "good" if is_stable else "bad" if state.get("growth_rate_1_s", 0.0) > 0 else ""
    return [_row("Operating point", "steady", stability_text(state), state["stability"], tone)]


def _frequencies(sources: Sources) -> list[list[Cell]]:
    if not sources.has("modes"):
        return []
    found = sources.modes.oscillating
    if not found:
        return []
    named = [f"{roman(mode['mode'])} {number_text(mode['frequency_Hz'], 4)} Hz" for mode in found]
    growing = [roman(mode["mode"]) for mode in found if mode["damping_ratio"] < 0]
    verdicts = (f"unstable: {_listed(growing)}", "bad") if growing else ("damped", "good")
    return [_row("Natural frequencies", "modes", _listed(named), *verdicts)]


def _criticals(sources: Sources) -> list[list[Cell]]:
    if not sources.has("campbell"):
        return []
    rows = []
    crossings = sources.campbell.crossings
    for wanted, words in (("inside", "in operation"), ("margin", "within the margin of operation")):
        if named := [sources.named(one) for one in crossings if one.place == wanted]:
            rows.append(_row("Critical speeds", "critical", _listed(named), words, "warn"))
    if rows or not crossings:
        return rows or [
            _row("Critical speeds", "critical", "No order meets a natural frequency in the range of speeds.", "none", "good")
        ]
    named = list(map(sources.named, crossings))
    words, tone = ("clear of operation", "good") if sources.campbell.operation else ("", "")
    return [_row("Critical speeds", "critical", _listed(named), words, tone)]


def _passages(sources: Sources) -> list[list[Cell]]:
    """Of barred ranges."""
    rows = []
    for transit in sources.transits if sources.has("transit") else []:
        told = [f"{one.entry['direction']}: {number_text(one.entry['time_in_range'], 4)} s" for one in transit.passages]
        passes = all(one.entry["passes"] for one in transit.passages)
        which = f", {transit.case}" if transit.case else ""
        finding = f"{_listed(told) or 'none'}{which}"
        if transit.report["ranges"]:
            rows.append(
                _row(
                    "Passages of barred ranges",
                    "transit",
                    finding,
                    *(("passed", "") if told and passes else ("not passed", "warn")),
                )
            )
    return rows


def _jumps(sources: Sources) -> list[list[Cell]]:
    """Folds at which a stable motion ends, and unstable motions."""
    rows = []
    for orbits in sources.orbits if sources.has("orbit") else []:
        named, unit, factor = parameter_of(sources, orbits)
        at = [number_text(factor * one.value, 5) for one in orbits.specials if one.kind == "fold"]
        which = f", {orbits.case}" if orbits.case else ""
        finding = f"folds at {named} {_listed(at)} {unit}".rstrip() if at else "no folds"
        if not orbits.has_stability:
            assessment = "stability not determined", "warn"
        else:
            assessment = ("some unstable", "warn") if unstable_ranges(orbits) else ("stable", "good")
        rows.append(_row("Periodic motions", "orbit", f"{finding}{which}", *assessment))
    return rows


def _peaks(sources: Sources) -> list[list[Cell]]:
    """The largest values of the sorts that one looks for."""
    found: dict[tuple, dict[str, tuple[float, str]]] = {}  # by rank and sort, of each element
    for run in sources.runs:
        early = run.summary.get("start_transient", {})
        for label, one in run.column_list.items():
            column = run.columns.get(label, {})
            if one.rank not in LOADS or one.is_inner or "max" not in column:
                continue
            end = "max" if abs(column["max"]) >= abs(column["min"]) else "min"
            which = f", {run.name}" if run.name else ""
            start = ", in the start transient" if label in early.get(f"has_{end}_of", []) else ""
            value, time = sources.units.amount(abs(column[end]), one.unit), number_text(column[f"time_of_{end}"], 4)
            finding = f"{one.element} {value} at {time} s{which}{start}"
            largest = found.setdefault((one.rank, one.kind, one.unit), {})
            largest[one.element] = max(largest.get(one.element, (0.0, "")), (abs(column[end]), finding))
    rows = []
    captions = {(one.kind, one.unit): one.caption for run in reversed(sources.runs) for one in reversed(run.column_list.values())}
    for (_, kind, unit), values in sorted(found.items(), key=lambda item: item[0][0]):
        largest = [finding for _, finding in sorted(values.values(), reverse=True)[:MOST_PEAKS]]
        rows.append(_row(f"Peak: {captions[kind, unit]}", "motion", "; ".join(largest) + "."))
    return rows
