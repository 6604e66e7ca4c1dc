"""The page: sections, numbered, in the template."""

import base64
import hashlib
import json
from collections.abc import Sequence
from datetime import date
from pathlib import Path

import jinja2
from markupsafe import Markup

from .content import Section, set_beside
from .failure import FILES, ReportError
from .sources import Sources

ASSETS = Path(__file__).parent / "assets"
# D3: installed with nocdyn, else of Debian's node-d3
LIBRARIES = (Path(__file__).parents[3] / "d3.min.js", Path("/usr/share/nodejs/d3/dist/d3.min.js"))
SCRIPTS = ("numbers.js", "picture.js", "figures.js", "page.js")


def render(sources: Sources, sections: Sequence[Section]) -> str:
    number_all(sections)
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(ASSETS),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["css"] = _css_text
    scripts = [_library(), *((ASSETS / name).read_text(encoding="utf-8") for name in SCRIPTS)]
    blocks = [block for section in sections for block in section.blocks if block.kind == "figure"]
    figures = {panel.id: panel.spec for block in blocks for panel in block.panels}
    case = sources.case
    return environment.get_template("report.html.jinja").render(
        title=case.get("title") or Path(sources.check["input"]).stem,
        facts=_facts(sources),
        date=date.today().isoformat(),
        program=f"{sources.check['program']} {sources.check['version']}",
        sections=sections,
        style=Markup((ASSETS / "report.css").read_text(encoding="utf-8")),
        scripts=[Markup(script) for script in scripts],
        hashes=" ".join(f"'sha256-{_digest(script)}'" for script in scripts),
        data=Markup(_embedded({"arrays": sources.arrays.texts, "figures": figures})),
    )


def _library() -> str:
    """The text of D3."""
    for path in LIBRARIES:
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise ReportError(f"{LIBRARIES[-1]}: there is no such file; D3 draws the figures: apt-get install node-d3", FILES)


def number_all(sections: Sequence[Section]) -> None:
    """Sections, tables and figures get numbers, figures their ids."""
    count = {"figure": 0, "table": 0}
    numbers = iter(range(1, len(sections) + 1))
    letters = iter("ABCDEFGH")
    for section in sections:
        set_beside(section.blocks, section.is_appendix)
        section.number = next(letters) if section.is_appendix else str(next(numbers))
        for block in section.blocks:
            kind = {"drawing": "figure", "figure": "figure", "table": "table"}.get(block.kind)
            if kind:
                count[kind] += 1
                block.number, block.id = count[kind], f"{kind}-{count[kind]}"
            for i, panel in enumerate(getattr(block, "panels", []), start=1):
                panel.id = f"{block.id}-{i}"


def _facts(sources: Sources) -> list[tuple[str, str]]:
    """What the title block has."""
    case, check = sources.case, sources.check
    named = [("Customer", case.get("customer")), ("Author", case.get("author")), ("Revision", case.get("revision"))]
    named += [("Date", date.today().isoformat()), ("Program", f"{check['program']} {check['version']} ({check['compiler']})")]
    return [(name, str(value)) for name, value in [*named, ("Input", check["input"])] if value]


def _embedded(content: dict) -> str:
    """JSON that cannot end the element which holds it."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _digest(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")


def _css_text(text: str) -> Markup:
    """What stands between quotes in CSS: every character that could mean something there as its number."""
    return Markup("".join(c if c.isalnum() or c in " .,-" else f"\\{ord(c):06x} " for c in text))
