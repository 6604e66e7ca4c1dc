"""Adds a search to a site that FORD has made without one.

usage: search_index.py SITE PAGES

PAGES holds the pages as FORD has read them. The search finds their sections, then modules, procedures and types by name
and summary. The index is made here: FORD's own is made in the browser, for every search, and takes minutes to write.
Exit code 1: a section has no place in the site.
"""

import html
import itertools
import json
import re
import shutil
import sys
from pathlib import Path

from lunr import lunr
from lunr.index import Index

KEY_ROW = re.compile(r"^\| (`[^|]*`) \| \[`&(\w+)`\]\(\./([^)]*)\)(?:[^|]*\|){3} (.*) \|$", re.MULTILINE)
HEADING = re.compile(r"^#{2,4} +(.*)$", re.MULTILINE)
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LIST_ROW = re.compile(r"<tr[^>]*>\s*<td><a href='\.\./([^']+)'>([^<]+)</a></td>.*?<td>(?!.*<td>)(.*?)</td>\s*</tr>", re.DOTALL)
MARKUP = re.compile(
    r"\[TOC\]|<!--.*?-->|<[^>]+>|\]\([^)]*\)|\[\[|[\[\]]|\$\$|\\[()]|^```\w*$|^[\s|:-]+$|[`*|]", re.MULTILINE | re.DOTALL
)
LISTS = {"modules": "module", "procedures": "procedure", "types": "type", "programs": "program"}

TITLE_BOOST = 10  # a heading before text
GUIDE_BOOST, KEY_BOOST = 5, 4  # groups before keys of their name, the guide before the sources
FORM = """
            <div class="d-flex align-items-end flex-grow-1">
              <form action="{root}search.html" role="search" class="ms-auto">
                <input type="text" class="form-control" aria-label="Search" placeholder="Search" name="q"
                       autocomplete="off" required>
              </form>
            </div>
          </div><!--/.nav-collapse -->"""
SCRIPTS = ["lib/lunr/lunr.js", "search/index.js", "search/search.js"]


def plain(text):
    """Words without markup."""
    return html.unescape(re.sub(r"\s+", " ", MARKUP.sub(" ", text))).strip()


def slug(heading):
    """The anchor that the Markdown extension toc makes of a heading."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


def keys_of(text):
    """The keys in their index, each of which leads to its group in the reference."""
    for names, group, target, meaning in KEY_ROW.findall(text):
        yield {"url": f"page/{target}", "title": plain(names), "part": f"key of &{group}", "text": plain(meaning)}


def sections_of(name, text):
    """What there is to find in a page: the part before the first heading, and that below each heading, or keys."""
    if name == "keys.md":
        yield from keys_of(text)
        return
    title = re.match(r"title: *(.*)", text)[1]
    blank = FENCED.sub(lambda block: " " * len(block[0]), text)  # comments in code are no headings
    starts = [match.start() for match in HEADING.finditer(blank)] + [len(text)]
    url = f"page/{name.removesuffix('.md')}.html"
    yield {"url": url, "title": title, "part": "guide", "text": plain(text[text.index("\n") : starts[0]])}
    for first, last in itertools.pairwise(starts):
        heading = HEADING.match(text, first)
        yield {
            "url": f"{url}#{slug(heading[1])}",
            "title": plain(heading[1]),
            "part": title,
            "text": plain(text[heading.end() : last]),
        }


def sources_of(site):
    """Modules, procedures, types and programs, as the lists of the site name them."""
    for name, part in LISTS.items():
        page = site / "lists" / f"{name}.html"
        if page.exists():
            for row in re.findall(r"<tr.*?</tr>", page.read_text(encoding="utf-8"), re.DOTALL):
                if match := LIST_ROW.match(row):
                    yield {"url": match[1], "title": match[2], "part": part, "text": plain(match[3])}


def boost_of(document):
    """How much a word in the document counts."""
    if document["part"].startswith("key of "):
        return KEY_BOOST
    return GUIDE_BOOST if document["url"].startswith("page/") else 1


def index_of(documents):
    """A lunr index of the documents, which are known in it by their numbers."""
    numbered = [
        (
            {"id": number, "title": document["title"], "names": document["title"].replace("_", " "), "text": document["text"]},
            {"boost": boost_of(document)},
        )
        for number, document in enumerate(documents)
    ]
    fields = [{"field_name": "title", "boost": TITLE_BOOST}, {"field_name": "names", "boost": TITLE_BOOST // 2}, "text"]
    return lunr(ref="id", fields=fields, documents=numbered)


def query(words):
    """As search.js asks: a word as it is, and as the beginning of a longer one."""
    return " ".join(f"{word}^10 {word}*" for word in re.findall(r"\w+", words.lower()))


def search(serialized, documents, words):
    """The documents found, best first: what search.js shows."""
    return [documents[int(result["ref"])] for result in Index.load(serialized).search(query(words))]


def check_anchors(site, documents):
    for document in documents:
        file, _, anchor = document["url"].partition("#")
        if anchor and f'id="{anchor}"' not in (site / file).read_text(encoding="utf-8"):
            sys.exit(f"search_index.py: {file} has no section {anchor}")


def add_form(site):
    for page in site.rglob("*.html"):
        root = "../" * (len(page.relative_to(site).parts) - 1)
        text = page.read_text(encoding="utf-8")
        page.write_text(text.replace("</div><!--/.nav-collapse -->", FORM.format(root=root).strip(), 1), encoding="utf-8")


def main(site, pages):
    documents = [
        section for page in sorted(pages.glob("*.md")) for section in sections_of(page.name, page.read_text(encoding="utf-8"))
    ]
    check_anchors(site, documents)
    documents += sources_of(site)
    (site / "search").mkdir(exist_ok=True)
    data = json.dumps(
        {"documents": documents, "index": index_of(documents).serialize()}, ensure_ascii=False, separators=(",", ":")
    )
    (site / "search" / "index.js").write_text(f"const site = {data}\n", encoding="utf-8")
    shutil.copy(Path(__file__).with_name("search.js"), site / "search")
    add_form(site)
    results = site / "search.html"
    scripts = "".join(f'<script src="{script}"></script>\n' for script in SCRIPTS)
    results.write_text(results.read_text(encoding="utf-8").replace("</body>", f"{scripts}</body>"), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
