"""Fatigue: damage and life of runs, of all load cases, and of continuous operation at a speed."""

from ..content import Figure, Heading, Paragraph, Section, Table, number, text
from ..numbers import number_text
from ..sources import Run, Sources


def fatigue_section(sources: Sources) -> Section | None:
    section = Section("fatigue", "Fatigue")
    if sources.results.cases and sources.runs and sources.cases.get("fatigue"):
        section.add(_of_cases(sources.cases["fatigue"]))
        if not sources.cases["is_complete"]:
            section.add(Paragraph("Not all load cases were run to their ends: this is the damage of what was computed.", "bad"))
    for run in sources.runs:
        if run.summary.get("fatigue"):
            section.add(_of_run(run))
    if sources.has("response") and sources.response_report.get("fatigue"):
        section.add(Heading("Continuous operation at a speed", "hourly"), *_of_speeds(sources))
    return section if section.blocks else None


def _of_cases(lives: list[dict]) -> Table:
    rows = []
    for one in lives:
        parts = ", ".join(f"{name}: {number_text(part, 4)}" for name, part in one["damage_of_load_cases"].items())
        rows.append([text(one["name"]), text(one["element"]), number(one.get("position")), number(one["damage"], 4, _tone(one))])
        rows[-1] += [number(one.get("repeats_to_failure"), 4), text(parts), _strength(one)]
    columns = [
        "name",
        "element",
        "position [m]",
        "damage of all",
        "repeats of all to failure",
        "damage of the load cases",
        "strength",
    ]
    note = "Damage by Miner, each load case as often as it occurs; failure is expected at 1."
    return Table("Damage of all load cases", columns, rows, note)


def _tone(one: dict) -> str:
    return "bad" if one.get("damage_of_repeats", one["damage"]) > 1 else ""


def _strength(one: dict) -> object:
    exceeds = one.get("mean_exceeds_strength", False)
    return text("the mean of a cycle exceeds the strength" if exceeds else "means below the strength", "bad" if exceeds else "")


def _of_run(run: Run) -> Table:
    rows = []
    for one in run.summary["fatigue"]:
        row = [
            text(one["name"]),
            text(one["element"]),
            number(one.get("position")),
            number(one["cycles"]),
            number(one["largest_range"]),
        ]
        row += [number(one["mean_of_largest_range"]), text(one["unit"]), number(one["damage"], 4), number(one["repeats"])]
        rows.append(
            [*row, number(one["damage_of_repeats"], 4, _tone(one)), number(one.get("repeats_to_failure"), 4), _strength(one)]
        )
    columns = ["name", "element", "position [m]", "cycles", "largest range", "its mean", "unit", "damage of the run", "repeats"]
    columns += ["damage of repeats", "repeats to failure", "strength"]
    which = f" of load case {run.name}" if run.name else ""
    note = "Cycles by rainflow counting, damage by Miner; failure is expected at 1. cycles.csv has the cycles by classes."
    return Table(f"Damage{which}", columns, rows, note)


def _of_speeds(sources: Sources) -> list[Paragraph | Table | Figure]:
    rows, profiles = [], []
    for one in sources.response_report["fatigue"]:
        row = [text(one["name"]), text(one["element"]), text(one["quantity"]), number(one["largest_damage_per_hour"], 4)]
        row += [number(sources.speed(one["speed_rad_s"])), number(one.get("damage_of_profile"), 4, _profile_tone(one))]
        rows.append([*row, number(one.get("hours_to_failure"), 4), _strength(one)])
        parts = (one.get(key, []) for key in ("profile_speeds_rad_s", "profile_hours", "profile_damage_per_hour"))
        for speed, hours, rate in zip(*parts):
            profiles.append([text(one["name"]), number(sources.speed(speed)), number(hours), number(rate, 4)])
    unit = sources.speed_unit
    columns = ["name", "element", "quantity", "largest damage of an hour [1/h]", f"at [{unit}]", "damage of the profile"]
    note = "Cycles of the synthesis of all orders about their mean; failure is expected at a damage of 1."
    blocks: list[Paragraph | Table | Figure] = []
    blocks.append(Table("Damage of continuous operation", [*columns, "hours to failure [h]", "strength"], rows, note))
    if profiles:
        heads = ["name", f"speed [{unit}]", "time at it [h]", "damage of an hour [1/h]"]
        blocks.append(Table("Profile of speeds", heads, profiles))
    figure = _hourly(sources)
    return [*blocks, figure] if figure else blocks


def _profile_tone(one: dict) -> str:
    return "bad" if one.get("damage_of_profile", 0.0) > 1 else ""


def _hourly(sources: Sources) -> Figure | None:
    columns = [column for column in sources.response.columns if column.kind == "damage_per_hour"]
    if not columns:
        return None
    response, table = sources.response, sources.table("response", "response.csv")
    speed = [sources.of_rpm(one) for one in response.speed]
    order = table.iloc[:, 0].argsort(kind="stable")
    names, labels = [column.title for column in columns], [column.label for column in columns]
    curves = [sources.arrays.curve(name, speed, table[label].to_numpy()[order]) for name, label in zip(names, labels)]
    spec = {
        "x": {"label": f"speed of {response.body}", "unit": sources.speed_unit},
        "y": {"label": columns[0].caption, "unit": columns[0].unit, "zero": True},
        "curves": curves,
        "name": "fatigue",
    }
    largest = "; ".join(f"{name} {number_text(float(table[label].max()), 3)}" for name, label in zip(names, labels))
    return Figure("Damage of an hour over the speed", f"Damage per hour over the speed. Largest: {largest}.", spec)
