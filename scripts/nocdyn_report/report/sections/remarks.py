"""The author's own text, what was assumed, and every note that the program gave."""

from ..content import Items, Markup, Paragraph, Section, Table, text
from ..sources import Sources

ASSUMED = {  # what each calculation takes for granted, as the documentation says
    "all": [
        "Bodies are rigid and turn about fixed axes; gears are rigid where they are not a mesh.",
        "Couplings have no mass; shafts have theirs along their length.",
    ],
    "equilibrium": ["Steady states: torques that keep changing enter with their means."],
    "modes": ["Modes: linearised about the operating point; the damping is that of the elements there."],
    "campbell": ["Campbell diagram: linearised about the steady state at each speed, which the motors hold."],
    "response": [
        "Forced response: linearised about the steady state at each speed, which the motors hold; the orders are added with "
        "their phases, and the half range is that of the sum.",
        "Limits of speeds apply to continuous operation; where they are exceeded the range is barred.",
    ],
    "shaker": [
        "Forced response: linearised about the steady state, in which the shaker alone oscillates, with its amplitude.",
        "Limits apply to continuous operation; where they are exceeded the range of frequencies is barred.",
    ],
    "transit": [
        "Passage of barred ranges: nonlinear, over the time; the mean speed, over whole turns, says when it is in the range.",
    ],
    "orbit": [
        "Periodic motions: nonlinear, with the period of the excitation or a multiple of it; other motions are not looked for.",
        "Limits and damage apply to stable motions; between them the machine jumps.",
    ],
    "run": ["Motion over the time: nonlinear, as the input describes the elements."],
}


def remarks_section(html: str) -> Section | None:
    return Section("remarks", "Remarks of the author", [Markup(html)]) if html else None


def notes_section(sources: Sources) -> Section:
    section = Section("notes", "Assumptions and notes", is_appendix=True)
    assumed = list(ASSUMED["all"])
    for command in ("equilibrium", "modes", "campbell", "response", "transit", "orbit", "run"):
        kind = "shaker" if command == "response" and sources.has(command) and sources.response.axis.is_frequency else command
        assumed += ASSUMED[kind] if sources.has(command) else []
    section.add(Items(assumed))
    rows = [[text(origin), text(note)] for origin, note in program_notes(sources)]
    if rows:
        section.add(Table("Notes of the program", ["calculation", "note"], rows, is_sorted=False))
    else:
        section.add(Paragraph("The program gave no notes."))
    return section


def program_notes(sources: Sources) -> list[tuple[str, str]]:
    """Each once, with the calculations that gave it."""
    given = [("check", sources.check["notes"])]
    given += [("equilibrium", sources.equilibrium["notes"])] if sources.has("equilibrium") else []
    given += [("modes", sources.modes.content["notes"])] if sources.has("modes") else []
    given += [("campbell", sources.campbell_report["notes"])] if sources.has("campbell") else []
    given += [("response", sources.response_report["notes"])] if sources.has("response") else []
    if sources.has("transit"):
        given += [(f"transit {one.case}".strip(), one.report["notes"]) for one in sources.transits]
    if sources.has("orbit"):
        given += [(f"orbit {one.case}".strip(), one.report["notes"]) for one in sources.orbits]
    given += [(f"run {run.name}".strip(), run.summary.get("machine", {}).get("notes", [])) for run in sources.runs]
    origins: dict[str, list[str]] = {}
    for origin, notes in given:
        for note in notes:
            origins.setdefault(note, []).append(origin)
    return [(", ".join(dict.fromkeys(names)), note) for note, names in origins.items()]
