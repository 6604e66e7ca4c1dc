"""Writes the verification guide: a page for each feature, of its cases and of what stands in its about.md.

usage: verification_pages.py VERIFICATION.json FOLDER

VERIFICATION.json is what `nocdyn verify` writes. FOLDER, with the pages for FORD, gets verification-FEATURE.md, and its
verification.md the table of features.
"""

import json
import sys
from html import escape
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure
from stage_pages import for_ford

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scripts"))

from nocdyn_verify.cases import FEATURES  # noqa: E402
from nocdyn_verify.picture import STYLE, as_svg  # noqa: E402

CASES = ROOT / "verification"
HEADING = "| case | quantity, origin | expected | computed | difference | tolerance |"
PLACE = "<!-- verification: table -->"


def name_of(feature):
    return f"verification-{feature.replace(' ', '-')}"


def overview(cases):
    """Cases by features and origins."""
    origins = list(dict.fromkeys(case["origin"] for case in cases))
    lines = [f"| feature | cases | {' | '.join(origins)} |", "| --- " * (len(origins) + 2) + "|"]
    for feature in FEATURES:
        own = [case["origin"] for case in cases if case["feature"] == feature]
        if own:
            title = f"[{feature[0].upper()}{feature[1:]}]({name_of(feature)}.md)"
            lines.append(f"| {title} | {len(own)} | {' | '.join(str(own.count(one) or '') for one in origins)} |")
    every = [case["origin"] for case in cases]
    lines.append(f"| all | {len(every)} | {' | '.join(str(every.count(one)) for one in origins)} |")
    return "\n".join(lines)


def figure_of(cases):
    """Computed over expected values."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(5.2, 4.2), layout="constrained")
        axes = figure.add_subplot()
        points = [(abs(case["expected"]), abs(case["computed"])) for case in cases if case["expected"] and case["computed"]]
        ends = [min(min(point) for point in points) / 3, max(max(point) for point in points) * 3]
        axes.plot(ends, ends, color="0.6", linewidth=0.9)
        axes.plot(*zip(*points), "o", markersize=4, color="#0072B2", markerfacecolor="none")
        axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends, xlabel="expected (SI, magnitude)", ylabel="computed")
        axes.set_aspect("equal")
    return f'<div class="figure">{" ".join(as_svg(figure).split())}</div>'


def cell(text):
    return escape(text, quote=False).replace("|", "&#124;").replace("*", "\\*").replace("_", "\\_")


def row(case):
    """The quantity, below it the origin of the expected value; the name of the case may be broken at its points."""
    place = f" ({case['at']})" if case["at"] else ""
    unit = "" if case["unit"] == "1" else f" {cell(case['unit']).replace(' ', '&nbsp;')}"
    values = (
        "<br>".join(f"`{part}`" for part in case["id"].split(".")[1:]),
        f"{cell(case['quantity'] + place)}<br><small>{case['origin']}: {cell(case['reference'])}</small>",
        f"{case['expected']:.10g}{unit}",
        f"{case['computed']:.10g}{unit}",
        f"{case['difference']:.1e}",
        f"{case['tolerance']:.3g}",
    )
    return f"| {' | '.join(values)} |"


def page(feature, cases):
    about = (CASES / feature.replace(" ", "_") / "about.md").read_text(encoding="utf-8").strip()
    text, _, missing = about.partition("## What is not verified")
    parts = [
        f"title: Verification: {feature}",
        text.strip(),
        figure_of(cases),
        "## Cases\n\nDifferences and tolerances are relative, or absolute where 0 or a small number is expected.",
        "\n".join([HEADING, "| --- " * HEADING.count(" | ") + "| --- |", *map(row, cases)]),
        f"## What is not verified\n\n{missing.strip()}",
    ]
    return "\n\n".join(parts) + "\n"


def main(report, folder):
    cases = json.loads(report.read_text(encoding="utf-8"))["cases"]
    start = folder / "verification.md"
    start.write_text(for_ford(start.read_text(encoding="utf-8").replace(PLACE, overview(cases))), encoding="utf-8")
    for feature in FEATURES:
        own = [case for case in cases if case["feature"] == feature]
        if own:
            (folder / f"{name_of(feature)}.md").write_text(for_ford(page(feature, own)), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
