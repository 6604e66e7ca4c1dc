"""verification.html: one page that needs nothing beside it."""

from collections.abc import Sequence
from html import escape

from .outcomes import NOTABLE, Installation, Outcome
from .picture import as_svg, draw

WIDTH = 9.0  # of the picture [in]
STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 84rem; padding: 0 1rem; color: #1a1a1a; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.15rem; margin-top: 2rem; }
.verdict { font-size: 1.15rem; font-weight: 600; padding: .6rem .9rem; border-left: 6px solid #0072B2; background: #eef5fb; }
.verdict.failed { border-color: #D55E00; background: #fdf0e6; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .82rem; } th, td { text-align: left; vertical-align: top; padding: .2rem .6rem;
border-bottom: 1px solid #ddd; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
tr.failed td { background: #fdf0e6; } td.id { font-family: ui-monospace, monospace; }
.origin { color: #555; } td.changed { font-weight: 600; color: #8a4b00; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1rem; font-size: .9rem; } dd { margin: 0;
overflow-wrap: anywhere; } svg { max-width: 100%; height: auto; }
@media (max-width: 45rem) { body { margin: 1rem auto; } dl { display: block; } dt { color: #555; } dd { margin: 0 0 .3rem; } }
@media print { body { font-size: 9pt; margin: 0; max-width: none; } .scroll { overflow: visible; } tr { break-inside: avoid; } }
"""


def number(value: float | None, digits: int = 10) -> str:
    return "" if value is None else f"{value:.{digits}g}"


def digits(one: Outcome) -> int:
    """Of the values: so many that the difference of a case that fails shows."""
    return 10 if one.passes else 15


def difference_text(one: Outcome) -> str:
    if one.difference is None:
        return ""
    return f"{one.difference:.1e}" if one.difference else "0"


def released_text(one: Outcome) -> str:
    """The value of the latest release, and how far the new one is from it where that is a notable part of the tolerance."""
    return number(one.released) + (f" ({one.change:.2g} tol.)" if one.has_changed else "")


def verdict(outcomes: Sequence[Outcome]) -> str:
    """The sentence at the top."""
    failed = [one.case.id for one in outcomes if not one.passes]
    if not failed:
        return f"All {len(outcomes)} cases pass." if len(outcomes) > 1 else "The case passes."
    return f"{len(failed)} of {len(outcomes)} cases fail: {', '.join(failed)}."


def facts(machine: Installation, outcomes: Sequence[Outcome], version: str) -> list[tuple[str, str]]:
    """What was verified, where and when."""
    origins = [one.case.origin for one in outcomes]
    counts = [f"{origins.count(origin)} {origin}" for origin in dict.fromkeys(origins)]
    return [
        ("Program", f"nocdyn {machine.version}, by {machine.compiler}"),
        ("Checksum of the program", f"sha256 {machine.program}"),
        ("Checksum of the cases", f"sha256 {machine.cases}"),
        ("Processor", machine.processor),
        ("System", machine.system),
        ("Date", machine.date),
        ("Cases", f"{len(outcomes)}: {', '.join(counts)}"),
        ("As released", changes(outcomes, version)),
    ]


def changes(outcomes: Sequence[Outcome], version: str) -> str:
    """What is different from the values of the latest release."""
    if not version:
        return "none"
    known = [one for one in outcomes if one.released is not None]
    changed = [one.case.id for one in known if one.has_changed]
    text = f"{version} computed {len(known)} of these values where it was made; "
    if not changed:
        return text + f"none differs by more than {NOTABLE:g} of its tolerance"
    return text + f"by more than {NOTABLE:g} of the tolerance differ {len(changed)}: {', '.join(changed)}"


HEADINGS = (
    ("", "case"),
    ("", "quantity"),
    ("number", "expected"),
    ("number", "computed"),
    ("", "unit"),
    ("number", "difference"),
    ("number", "tolerance"),
    ("", "result"),
    ("number", "as released"),
)


def write_row(one: Outcome) -> str:
    """A row of values, and the origin of the expected one below its quantity."""
    case = one.case
    result = "pass" if one.passes else "FAIL" + (f": {one.problem}" if one.problem else "")
    feature, _, name = case.id.partition(".")
    cells = [
        ("id", f"{escape(feature)}.<wbr>{escape(name).replace('.', '.<wbr>')}"),
        (
            "",
            escape(case.quantity + (f" ({case.at})" if case.at else ""))
            + f'<div class="origin">{escape(case.origin)}: {escape(case.reference)}</div>',
        ),
        ("number", number(case.expected, digits(one))),
        ("number", number(one.computed, digits(one))),
        ("", escape(case.unit)),
        ("number", difference_text(one)),
        ("number", f"{case.tolerance:.3g} {case.error[:3]}."),
        ("", escape(result)),
        ("number changed" if one.has_changed else "number", released_text(one)),
    ]
    columns = "".join(f'<td class="{kind}">{text}</td>' if kind else f"<td>{text}</td>" for kind, text in cells)
    return f"<tr{'' if one.passes else ' class=failed'}>{columns}</tr>"


def write_page(machine: Installation, outcomes: Sequence[Outcome], version: str) -> str:
    """The page."""
    failed = any(not one.passes for one in outcomes)
    headings = "".join(f'<th class="{kind}">{text}</th>' if kind else f"<th>{text}</th>" for kind, text in HEADINGS)
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Verification of nocdyn {escape(machine.version)}</title><style>{STYLE}</style></head><body>",
        f"<h1>Verification of nocdyn {escape(machine.version)}</h1>",
        f'<p class="verdict{" failed" if failed else ""}">{escape(verdict(outcomes))}</p><dl>',
        *(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in facts(machine, outcomes, version)),
        "</dl><h2>Differences and tolerances</h2>",
        as_svg(draw(outcomes, WIDTH)),
    ]
    for feature in dict.fromkeys(one.case.feature for one in outcomes):
        parts += [
            f'<h2>{escape(feature)}</h2><div class="scroll"><table><thead><tr>{headings}</tr></thead><tbody>',
            *(write_row(one) for one in outcomes if one.case.feature == feature),
            "</tbody></table></div>",
        ]
    return "\n".join([*parts, "</body></html>", ""])
