"""Fatigue: damage and life of runs, of all load cases, and of continuous operation at a speed."""

from ..content import Block, Cell, Figure, Heading, Panel, Paragraph, Section, Table, by_columns, number, text
from ..numbers import number_text
from ..readable import life, texts
from ..sources import Run, Sources


def fatigue_section(sources: Sources) -> Section | None:
    section = Section("fatigue", "Fatigue")
    has_cases = bool(sources.results.cases and sources.runs and sources.cases.get("fatigue"))
    if has_cases:
        section.add(_of_cases(sources.cases["fatigue"]))
        if not sources.cases["is_complete"]:
            section.add(Paragraph("Not all load cases were run to their ends: this is the damage of what was computed.", "bad"))
    for run in sources.runs:
        if run.summary.get("fatigue"):
            (section.add_details if has_cases else section.add)(_of_run(sources, run))
    if sources.has("response") and sources.response_report.get("fatigue"):
        blocks = [Heading(f"Continuous operation at a {sources.response.axis.noun}", "hourly"), *_of_speeds(sources)]
        section.add(*blocks)
    return section if section.blocks else None


def _of_cases(lives: list[dict]) -> Table:
    cases = list(dict.fromkeys(name for one in lives for name in one["damage_of_load_cases"]))
    columns = [
        ("name", texts([one["name"] for one in lives])),
        ("element", texts([one["element"] for one in lives])),
        ("position [m]", [number(one.get("position")) for one in lives]),
        *((f"damage of {name}", [life(one["damage_of_load_cases"].get(name)) for one in lives]) for name in cases),
        ("of all", [life(one["damage"], _tone(one)) for one in lives]),
        ("repeats of all to failure", [life(one.get("repeats_to_failure")) for one in lives]),
        ("mean of a cycle", [_strength(one) for one in lives]),
    ]
    note = "Damage by Miner, each load case as often as it occurs; failure is expected at 1."
    return by_columns("Damage of all load cases", columns, note)


def _tone(one: dict) -> str:
    return "bad" if one.get("damage_of_repeats", one["damage"]) > 1 else ""


def _strength(one: dict) -> Cell:
    exceeds = one.get("mean_exceeds_strength", False)
    return text("exceeds the strength", "bad") if exceeds else text("below the strength")


def _of_run(sources: Sources, run: Run) -> Table:
    lives = run.summary["fatigue"]
    amount = sources.units.amount
    columns = [
        ("name", texts([one["name"] for one in lives])),
        ("element", texts([one["element"] for one in lives])),
        ("position [m]", [number(one.get("position")) for one in lives]),
        ("cycles", [number(one["cycles"]) for one in lives]),
        ("largest range", texts([amount(one["largest_range"], one["unit"]) for one in lives])),
        ("its mean", texts([amount(one["mean_of_largest_range"], one["unit"]) for one in lives])),
        ("damage of the run", [life(one["damage"]) for one in lives]),
        ("repeats", [number(one["repeats"]) for one in lives]),
        ("damage of repeats", [life(one["damage_of_repeats"], _tone(one)) for one in lives]),
        ("repeats to failure", [life(one.get("repeats_to_failure")) for one in lives]),
        ("mean of a cycle", [_strength(one) for one in lives]),
    ]
    which = f" of load case {run.name}" if run.name else ""
    note = "Cycles by rainflow counting, damage by Miner; failure is expected at 1. cycles.csv has the cycles by classes."
    return by_columns(f"Damage{which}", columns, note)


def _of_speeds(sources: Sources) -> list[Block]:
    lives, axis = sources.response_report["fatigue"], sources.response.axis
    unit = sources.axis_unit(axis)
    columns = [
        ("name", texts([one["name"] for one in lives])),
        ("element", texts([one["element"] for one in lives])),
        ("largest damage of an hour [1/h]", [life(one["largest_damage_per_hour"]) for one in lives]),
        (f"at [{unit}]", [number(sources.on_axis(axis, axis.point(one))) for one in lives]),
        ("damage of the profile", [life(one.get("damage_of_profile"), _profile_tone(one)) for one in lives]),
        ("hours to failure [h]", [life(one.get("hours_to_failure")) for one in lives]),
        ("mean of a cycle", [_strength(one) for one in lives]),
    ]
    profiles = []
    for one in lives:
        parts = (one.get(key, []) for key in ("profile_speeds_rad_s", "profile_hours", "profile_damage_per_hour"))
        for speed, hours, rate in zip(*parts):
            profiles.append([text(one["name"]), number(sources.speed(speed)), number(hours), life(rate)])
    note = "Cycles of the synthesis of all orders about their mean; failure is expected at a damage of 1."
    blocks: list[Block] = [by_columns("Damage of continuous operation", columns, note)]
    if profiles:
        heads = ["name", f"speed [{unit}]", "time at it [h]", "damage of an hour [1/h]"]
        blocks.append(Table("Profile of speeds", heads, profiles))
    figure = _hourly(sources)
    return [*blocks, figure] if figure else blocks


def _profile_tone(one: dict) -> str:
    return "bad" if one.get("damage_of_profile", 0.0) > 1 else ""


NO_RATE = 1e-9  # damage of an hour: below, nothing is drawn


def _hourly(sources: Sources) -> Figure | None:
    columns = [column for column in sources.response.columns if column.kind == "damage_per_hour"]
    table = sources.table("response", "response.csv")
    columns = [column for column in columns if table[column.label].max() > NO_RATE]
    if not columns:
        return None
    response = sources.response
    speed = [sources.on_axis(response.axis, one) for one in response.speed]
    order = table.iloc[:, 0].argsort(kind="stable")
    names, labels = [column.title for column in columns], [column.label for column in columns]
    curves = [sources.arrays.curve(name, speed, table[label].to_numpy()[order]) for name, label in zip(names, labels)]
    spec = {
        "x": {"label": response.axis.label, "unit": sources.axis_unit(response.axis)},
        "y": {"label": columns[0].caption, "unit": columns[0].unit, "zero": True},
        "curves": curves,
        "name": "fatigue",
    }
    largest = "; ".join(f"{name} {number_text(float(table[label].max()), 3)}" for name, label in zip(names, labels))
    over = f"over the {response.axis.noun}"
    return Figure(f"Damage of an hour {over}", [Panel("", f"Damage per hour {over}. Largest: {largest}.", spec)])
