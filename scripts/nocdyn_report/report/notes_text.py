"""The author's own text: Markdown to HTML that can do no harm, for raw HTML is shown as text."""

import base64
import mimetypes
from pathlib import Path
from urllib.parse import unquote

from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token

from .failure import FILES, USAGE, ReportError

PICTURES = ("image/png", "image/jpeg", "image/gif", "image/svg+xml", "image/webp")
MOST_BYTES = 2_000_000  # of a picture
LOWER = 2  # levels by which headings are lowered, below those of the sections


def read_notes(file: Path, place: str) -> str:
    """The HTML of a file; `place` begins messages."""
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise ReportError(f"nocdyn: {place}: {file}: cannot be read: {error.strerror}", FILES) from None
    except UnicodeDecodeError as error:
        raise ReportError(f"nocdyn: {place}: {file}: is no text in UTF-8 (byte {error.start + 1})", USAGE) from None
    return to_html(text, file.parent, place)


def to_html(text: str, folder: Path, place: str) -> str:
    parser = MarkdownIt("commonmark", {"html": False, "linkify": False}).enable(["table", "strikethrough"])
    tokens = parser.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(6, int(token.tag[1]) + LOWER)}"
        for child in token.children or []:
            if child.type == "image":
                _embed(child, folder, place)
    return RendererHTML().render(tokens, parser.options, {})


def _embed(image: Token, folder: Path, place: str) -> None:
    """A picture beside the file becomes a part of the report, which needs no other file."""
    source = unquote(str(image.attrs["src"]))
    kind = mimetypes.guess_type(source)[0]
    if ":" in source.split("/")[0] or source.startswith("//") or kind not in PICTURES:
        raise ReportError(f"nocdyn: {place}: picture '{source}': allowed: a file PNG, JPEG, GIF, WebP or SVG", USAGE)
    try:
        content = (folder / source).read_bytes()
    except OSError as error:
        raise ReportError(f"nocdyn: {place}: picture '{source}': cannot be read: {error.strerror}", FILES) from None
    if len(content) > MOST_BYTES:
        raise ReportError(f"nocdyn: {place}: picture '{source}': {len(content)} bytes; allowed: up to {MOST_BYTES}", USAGE)
    image.attrs["src"] = f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
