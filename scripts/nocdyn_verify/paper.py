"""verification.pdf: the same on paper, by matplotlib alone."""

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from .outcomes import Installation, Outcome
from .page import difference_text, facts, number, released_text, verdict
from .picture import STYLE, draw_on

SIZE = (11.69, 8.27)  # A4, lying [in]
LEFT, TOP, BOTTOM = 0.04, 0.95, 0.06  # of the page
LINE = 0.0145  # height of a line, of the page
SMALL = 6.2
COLUMNS = (  # heading, place, characters
    ("id", 0.0, 27),
    ("quantity", 0.135, 40),
    ("expected", 0.325, 14),
    ("computed", 0.395, 14),
    ("unit", 0.465, 9),
    ("difference", 0.508, 10),
    ("allowed", 0.555, 14),
    ("result", 0.615, 10),
    ("as released", 0.655, 14),
    ("origin and reference", 0.725, 52),
)


def write_paper(path: Path, machine: Installation, outcomes: Sequence[Outcome], version: str) -> None:
    """Writes the pages."""
    information = {"Title": f"Verification of nocdyn {machine.version}", "Creator": "nocdyn verify"}
    with matplotlib.rc_context({**STYLE, "font.size": 8}), PdfPages(path, metadata=information) as pages:
        figures = [first_page(machine, outcomes, version), *table_pages(outcomes)]
        for place, figure in enumerate(figures, start=1):
            footer = f"nocdyn {machine.version}, {machine.date}; program {machine.program[:12]}; page {place} of {len(figures)}"
            figure.text(LEFT, 0.03, footer, size=SMALL, color="0.35")
            pages.savefig(figure)


def first_page(machine: Installation, outcomes: Sequence[Outcome], version: str) -> Figure:
    """The verdict, what was verified, and the picture."""
    figure = Figure(figsize=SIZE)
    figure.text(LEFT, TOP, f"Verification of nocdyn {machine.version}", size=16, va="top")
    figure.text(LEFT, TOP - 0.05, "\n".join(textwrap.wrap(verdict(outcomes), 130)), size=11, weight="bold", va="top")
    for place, (name, text) in enumerate(facts(machine, outcomes, version)):
        figure.text(LEFT, TOP - 0.12 - 0.024 * place, name, va="top", color="0.35")
        figure.text(LEFT + 0.16, TOP - 0.12 - 0.024 * place, textwrap.shorten(text, 130, placeholder=" ..."), va="top")
    draw_on(figure.add_axes((0.17, 0.11, 0.78, 0.49)), outcomes)
    return figure


def rows(one: Outcome) -> list[tuple[str, ...]]:
    """The lines of a case."""
    case = one.case
    texts = (
        case.id,
        case.quantity + (f" ({case.at})" if case.at else ""),
        number(case.expected),
        number(one.computed),
        case.unit,
        difference_text(one),
        f"{case.tolerance:.3g} {case.error[:3]}.",
        "pass" if one.passes else f"FAIL {one.problem}",
        released_text(one),
        f"{case.origin}: {case.reference}",
    )
    wrapped = [textwrap.wrap(text, width) or [""] for text, (_, _, width) in zip(texts, COLUMNS)]
    return [tuple(lines[k] if k < len(lines) else "" for lines in wrapped) for k in range(max(map(len, wrapped)))]


def table_pages(outcomes: Sequence[Outcome]) -> Iterator[Figure]:
    """Pages of the table; a case is on one page."""
    figure, height, feature = None, 0.0, ""
    for one in outcomes:
        lines = rows(one)
        needed = LINE * len(lines) + (0.035 if one.case.feature != feature else 0.004)
        if figure is None or height - needed < BOTTOM:
            if figure is not None:
                yield figure
            figure, height = Figure(figsize=SIZE), TOP
            for heading, place, _ in COLUMNS:
                figure.text(LEFT + place, height, heading, size=SMALL, color="0.35", va="top")
            height -= 0.022
        if one.case.feature != feature:
            feature = one.case.feature
            figure.text(LEFT, height - 0.008, feature, size=9, weight="bold", va="top")
            height -= 0.031
        colour = "black" if one.passes else "#B03A00"
        for line in lines:
            for (_, place, _), text in zip(COLUMNS, line):
                figure.text(LEFT + place, height, text, size=SMALL, va="top", color=colour)
            height -= LINE
        height -= 0.004
    if figure is not None:
        yield figure
