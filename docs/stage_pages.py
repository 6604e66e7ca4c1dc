"""Prepares docs/pages for FORD.

usage: stage_pages.py REFERENCE FOLDER

REFERENCE is what nocdyn_input_reference prints: its topics go to the end of the page on input files. In FOLDER, links from
page to page lead to the HTML files of the site, and a code block without a language is marked as text, because FORD would
guess one.
"""

import re
import shutil
import sys
from pathlib import Path

PAGES = Path(__file__).resolve().parent / "pages"
PAGE_LINK = re.compile(r"\]\(([a-z-]+)\.md(#[^)]*)?\)")
CODE_BLOCK = re.compile(r"^```$(.*?^```$)", re.MULTILINE | re.DOTALL)
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)


def groups_of(reference):
    """The topics with the sections of their groups, one heading level lower."""
    return re.sub("^##", "###", reference[reference.index("\n## ") + 1 :], flags=re.MULTILINE)


def for_ford(text):
    """A page as FORD needs it."""
    text = PAGE_LINK.sub(r"](./\1.html\2)", text)
    return FENCED.sub(lambda block: CODE_BLOCK.sub(r"```text\1", block[0]), text)


def staged_pages(reference):
    """Name -> text of every page, ready for FORD."""
    texts = {page.name: page.read_text(encoding="utf-8") for page in sorted(PAGES.glob("*.md"))}
    texts["input.md"] += "\n" + groups_of(reference)
    return {name: for_ford(text) for name, text in texts.items()}


def main(reference, folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, text in staged_pages(reference.read_text(encoding="utf-8")).items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
