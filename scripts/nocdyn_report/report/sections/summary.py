"""The findings, first of all."""

from ...columns import LOADS
from ...speed_results import roman
from ..content import Cell, Section, Table, text
from ..numbers import number_text, percent
from ..sources import Sources
from .response import limited, passage, ratio_tone, shares_of_limits
from .steady import stability_text

MOST_NAMED = 6  # of one sort
MOST_PEAKS = 2  # of a kind


def summary_section(sources: Sources) -> Section:
    rows: list[list[Cell]] = []
    for make in (_failures, _steady, _frequencies, _criticals, _limits, _barred, _run_limits, _peaks, _life, _damage_per_hour):
        rows += make(sources)
    columns = ["subject", "finding", "assessment"]
    return Section("summary", "Summary of findings", [Table("Findings", columns, rows, is_sorted=False)])


def _row(subject: str, target: str, finding: str, assessment: str = "", tone: str = "") -> list[Cell]:
    return [text(subject, "", f"#{target}"), text(finding), text(assessment, tone)]


def _listed(words: list[str], most: int = MOST_NAMED) -> str:
    return ", ".join(words[:most]) + (f" and {len(words) - most} more" if len(words) > most else "")


def _failures(sources: Sources) -> list[list[Cell]]:
    """Commands that the input asks for and that gave no result: nothing below tells of what they would have shown."""
    rows = []
    for command, subject in (("run", "Run"), ("response", "Forced response"), ("campbell", "Campbell diagram")):
        one = sources.results.of[command]
        if one.state in ("failed", "refused"):
            rows.append(_row(subject, "scope", one.message, one.state, "bad"))
    return rows


def _steady(sources: Sources) -> list[list[Cell]]:
    if not sources.has("equilibrium"):
        return []
    states = sources.equilibrium["steady_states"]
    if len(states) > 1:
        stable = sum(1 for state in states if state["stability"] == "stable")
        return [_row("Steady states", "steady", f"{len(states)} steady states, {stable} of them stable.")]
    (state,) = states
    is_stable = state["stability"] == "stable"
    tone = "good" if is_stable else "bad" if state.get("growth_rate_1_s", 0.0) > 0 else ""
    return [_row("Steady state", "steady", stability_text(state), state["stability"], tone)]


def _frequencies(sources: Sources) -> list[list[Cell]]:
    if not sources.has("modes"):
        return []
    found = sources.modes.oscillating
    if not found:
        return []
    named = [f"{roman(mode['mode'])} {number_text(mode['frequency_Hz'])} Hz" for mode in found]
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


def _limits(sources: Sources) -> list[list[Cell]]:
    if not sources.has("response"):
        return []
    rows = []
    for name, ratio, speed in shares_of_limits(sources.response_report):
        at = f"{number_text(sources.speed(speed))} {sources.speed_unit}"
        rows.append(_row("Limit", "limits", f"{name} reaches {percent(ratio)} of its limit at {at}.", *ratio_tone(ratio)))
    return rows


def _barred(sources: Sources) -> list[list[Cell]]:
    if not sources.has("response") or not limited(sources.response_report):
        return []
    ranges = sources.response_report["barred_speed_ranges"]
    if not ranges:
        return [_row("Barred ranges", "limits", "No range of speeds is barred.", "none", "good")]
    rows = []
    for one in ranges:
        ends = sorted((sources.speed(one["from_rad_s"]), sources.speed(one["to_rad_s"])))
        finding = f"{number_text(ends[0])} to {number_text(ends[1])} {sources.speed_unit}, by {one['quantity']}."
        rows.append(_row("Barred range", "limits", finding, *passage(one)))
    return rows


def _run_limits(sources: Sources) -> list[list[Cell]]:
    rows = []
    for run in sources.runs:
        for one in run.summary.get("limits", []):
            which = f" in load case {run.name}" if run.name else ""
            finding = f"{one['column']} reaches {percent(one['ratio'])} of its limit over the time{which}."
            rows.append(_row("Limit", "motion", finding, *ratio_tone(one["ratio"])))
    return rows


def _peaks(sources: Sources) -> list[list[Cell]]:
    """The largest values of the sorts that one looks for."""
    found: dict[tuple, dict[str, tuple[float, str]]] = {}  # by rank and sort, of each quantity
    for run in sources.runs:
        early = run.summary.get("start_transient", {})
        for label, one in run.column_list.items():
            column = run.columns.get(label, {})
            if one.rank not in LOADS or "max" not in column:
                continue
            end = "max" if abs(column["max"]) >= abs(column["min"]) else "min"
            which = f", {run.name}" if run.name else ""
            start = ", in the start transient" if label in early.get(f"has_{end}_of", []) else ""
            value, time = number_text(column[end]), number_text(column[f"time_of_{end}"])
            finding = f"{one.name} {value} {one.unit} at {time} s{which}{start}"
            largest = found.setdefault((one.rank, one.sort), {})
            largest[one.name] = max(largest.get(one.name, (0.0, "")), (abs(column[end]), finding))
    rows = []
    for (_, (_, caption, _)), values in sorted(found.items(), key=lambda item: item[0][0]):
        largest = [finding for _, finding in sorted(values.values(), reverse=True)[:MOST_PEAKS]]
        rows.append(_row(f"Peak: {caption}", "motion", "; ".join(largest) + "."))
    return rows


def _life(sources: Sources) -> list[list[Cell]]:
    rows = []
    is_complete = all(run.summary["status"] == "done" for run in sources.runs)
    if sources.results.cases and sources.runs:
        lives = [("all load cases", one) for one in sources.cases.get("fatigue", [])]
        is_complete = sources.cases["is_complete"]
    else:
        lives = [("the run", one) for run in sources.runs for one in run.summary.get("fatigue", [])]
    for which, one in lives:
        damage = one.get("damage_of_repeats", one["damage"])
        life = f"; failure after {number_text(one['repeats_to_failure'], 4)} repeats" if "repeats_to_failure" in one else ""
        bad = damage > 1 or one.get("mean_exceeds_strength", False)
        words = ("exceeded", "bad") if bad else ("not used up", "good") if is_complete else ("incomplete", "warn")
        rows.append(_row("Life", "fatigue", f"{one['name']}: damage {number_text(damage, 4)} of {which}{life}.", *words))
    return rows


def _damage_per_hour(sources: Sources) -> list[list[Cell]]:
    if not sources.has("response") or not sources.response_report.get("fatigue"):
        return []
    rows = []
    for one in sources.response_report["fatigue"]:
        speed = f"{number_text(sources.speed(one['speed_rad_s']))} {sources.speed_unit}"
        finding = f"{one['name']}: damage up to {number_text(one['largest_damage_per_hour'], 4)} per hour at {speed}"
        if "damage_of_profile" in one:
            finding += f"; damage of the profile {number_text(one['damage_of_profile'], 4)}"
        if "hours_to_failure" in one:
            finding += f", failure after {number_text(one['hours_to_failure'], 4)} h of it"
        words = ("", "")
        if "damage_of_profile" in one or one["mean_exceeds_strength"]:
            bad = one.get("damage_of_profile", 0.0) > 1 or one["mean_exceeds_strength"]
            words = ("exceeded", "bad") if bad else ("not used up", "good")
        rows.append(_row("Life at a speed", "hourly", f"{finding}.", *words))
    return rows
