"""The author's own text: Markdown to HTML that can do no harm, for raw HTML is shown as text."""

import base64
import mimetypes
from pathlib import Path
from urllib.parse import unquote

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

from .confined import Folder
from .failure import USAGE, ReportError

PICTURES = ("image/png", "image/jpeg", "image/gif", "image/svg+xml", "image/webp")
MOST_BYTES = 2_000_000  # of a picture
MOST_NOTES = 2_000_000  # bytes of the text
LOWER = 2  # levels by which headings are lowered, below those of the sections


def read_notes(folder: Folder, name: str, place: str) -> str:
    """The HTML of a file in the folder of the input; `place` begins messages."""
    file = folder.folder / name
    content = folder.read(folder.folder, name, f"nocdyn: {place}: {file}", MOST_NOTES)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ReportError(f"nocdyn: {place}: {file}: is no text in UTF-8 (byte {error.start + 1})", USAGE) from None
    return to_html(text, file.parent, folder, place)


def to_html(text: str, base: Path, folder: Folder, place: str) -> str:
    """The HTML of a text; its pictures have paths from `base` and are in `folder`."""
    parser = MarkdownIt("commonmark", {"html": False, "linkify": False}).enable(["table", "strikethrough"])
    tokens = parser.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(6, int(token.tag[1]) + LOWER)}"
        for child in token.children or []:
            if child.type == "image":
                _embed(child, base, folder, place)
    return RendererHTML().render(tokens, parser.options, {})


def _embed(image: Token, base: Path, folder: Folder, place: str) -> None:
    """A picture beside the file becomes a part of the report, which needs no other file."""
    source = unquote(str(image.attrs["src"]))
    kind = mimetypes.guess_type(source)[0]
    if ":" in source.split("/")[0] or source.startswith("//") or kind not in PICTURES:
        raise ReportError(f"nocdyn: {place}: picture '{source}': allowed: a file PNG, JPEG, GIF, WebP or SVG", USAGE)
    content = folder.read(base, source, f"nocdyn: {place}: picture '{source}'", MOST_BYTES)
    image.attrs["src"] = f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
