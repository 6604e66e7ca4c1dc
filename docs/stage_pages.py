"""Prepares docs/pages for FORD.

usage: stage_pages.py REFERENCE SCHEMA FOLDER

REFERENCE is what nocdyn_input_reference prints, SCHEMA what `nocdyn help input --json` does: the pages get the groups and the
index of keys at their places. In FOLDER, links from page to page lead to the HTML files of the site, a page of several
sections begins with its contents, and a code block without a language is marked as text, because FORD would guess one.
"""

import itertools
import json
import re
import shutil
import sys
from pathlib import Path

PAGES = Path(__file__).resolve().parent / "pages"
PAGE_LINK = re.compile(r"\]\(([a-z-]+)\.md(#[^)]*)?\)")
CODE_BLOCK = re.compile(r"^```$(.*?^```$)", re.MULTILINE | re.DOTALL)
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
SECTION = re.compile(r"^#{2,3} ", re.MULTILINE)
CONTENTS = "\n\n[TOC]\n\n"
SECTIONS = 3  # pages of fewer are their own contents

# Sections that stood on the page of input files: links to them still lead on.
MOVED = {
    "input-shafts": ("shafts", "couplings-that-stiffen-with-the-frequency"),
    "input-gears": ("elastic-meshes", "losses-of-teeth"),
    "input-clutches": ("clutches-brakes-and-freewheels",),
    "input-motions": ("cardan-joints-slider-cranks-cams", "prescribed-motions"),
    "input-motors": ("induction-motors-by-their-circuit", "speed-control", "asynchronous-start-of-synchronous-motors"),
    "input-torques": ("electrical-faults-and-torques-that-act-for-a-time", "damping-of-vibrations-that-does-not-brake"),
    "input-engines": ("engines-and-orders",),
    "input-runs": ("start-speeds", "load-cases"),
}
UNITS = ("_rpm", "_hz", "_deg")


def groups_of(reference):
    """The topics with the sections of their groups."""
    return reference[reference.index("\n## ") + 1 :]


def object_of(rule):
    """What the schema says of one group of those that may repeat."""
    return rule if "properties" in rule else rule["items"]


def keys_of(rule):
    """The keys of a group: name -> what the schema says of it."""
    return object_of(rule)["properties"]


def overview(schema):
    """The groups by topics, at the anchors that they had on this page."""
    lines = []
    for topic, groups in itertools.groupby(schema.items(), key=lambda group: group[1]["x-topic"]):
        lines += [f"- {topic}:"]
        lines += [
            f'    - <span id="{name}"></span>[`&{name}`](reference.md#{name}) {rule["description"]}' for name, rule in groups
        ]
    return "\n".join(lines)


def base_of(name, keys):
    """The key in SI of a key in rpm, Hz or degrees; other keys are their own."""
    return next((name.removesuffix(unit) for unit in UNITS if name.endswith(unit) and name.removesuffix(unit) in keys), name)


def index_row(group, name, schema):
    """A key with its second name, its group and kinds, its unit, its default and its meaning."""
    keys = keys_of(schema[group])
    rule = keys[name]
    names = [name, *(other for other in keys if other != name and base_of(other, keys) == name)]
    units = ", ".join(keys[one].get("x-unit", "") for one in names)
    kinds = f": {', '.join(rule['x-only-if'].split())}" if "x-only-if" in rule else ""
    meaning = rule["description"].removesuffix(f" [{rule.get('x-unit')}]")
    where = f"[`&{group}`](reference.md#{group}){kinds}"
    default = rule.get("x-default", "required" if name in object_of(schema[group]).get("required", ()) else "")
    cells = (", ".join(f"`{one}`" for one in names), where, units, default, meaning)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def index_of_keys(schema):
    """A table for each letter, below a line of letters."""
    keys = sorted(
        (name, group) for group, rule in schema.items() for name in keys_of(rule) if base_of(name, keys_of(rule)) == name
    )
    lines = [f'<div class="letters" markdown="1">{CONTENTS}</div>', ""]
    for letter, members in itertools.groupby(keys, key=lambda key: key[0][0].upper()):
        lines += [f"## {letter}", "", "| key | group | unit | default | meaning |", "| --- | --- | --- | --- | --- |"]
        lines += [index_row(group, name, schema) for name, group in members]
        lines.append("")
    return "\n".join(lines)


def with_moved(text):
    """The page of input files with the anchors of the sections that it had."""
    for page, anchors in MOVED.items():
        spans = "".join(f'<span id="{anchor}"></span>' for anchor in anchors)
        text = text.replace(f"]({page}.md) |", f"]({page}.md){spans} |", 1)
    return text


def with_contents(text):
    """A page of several sections begins with its contents."""
    if CONTENTS in text or len(SECTION.findall(FENCED.sub("", text))) < SECTIONS:
        return text
    metadata, _, body = text.partition("\n\n")
    return f"{metadata}{CONTENTS}{body}"


def for_ford(text):
    """A page as FORD needs it."""
    text = PAGE_LINK.sub(r"](./\1.html\2)", with_contents(text))
    return FENCED.sub(lambda block: CODE_BLOCK.sub(r"```text\1", block[0]), text)


def staged_pages(reference, schema):
    """Name -> text of every page, ready for FORD."""
    places = {"groups": groups_of(reference), "overview": overview(schema), "keys": index_of_keys(schema)}
    texts = {page.name: page.read_text(encoding="utf-8") for page in sorted(PAGES.glob("*.md"))}
    texts["input.md"] = with_moved(texts["input.md"])
    for place, content in places.items():
        texts = {name: text.replace(f"<!-- reference: {place} -->", content) for name, text in texts.items()}
    return {name: for_ford(text) for name, text in texts.items()}


def main(reference, schema, folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    groups = json.loads(schema.read_text(encoding="utf-8"))["properties"]
    for name, text in staged_pages(reference.read_text(encoding="utf-8"), groups).items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
