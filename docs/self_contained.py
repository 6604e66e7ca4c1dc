"""Makes a FORD site readable without a network: local copies of the scripts and styles that its pages load.

usage: self_contained.py SITE

The copies come from the Debian packages libjs-bootstrap5, libjs-lunr and libjs-mathjax (scripts/setup docs). Exit code 1: the
pages load something that this script does not know, or a package is missing.
"""

import os
import pathlib
import re
import shutil
import sys

INSTALLED = pathlib.Path("/usr/share/javascript")
COPIES = [
    "bootstrap5/css/bootstrap.min.css",
    "bootstrap5/js/bootstrap.bundle.min.js",
    "lunr/lunr.js",
    "mathjax/MathJax.js",
    "mathjax/config/TeX-AMS-MML_SVG.js",
    "mathjax/extensions",
    "mathjax/jax/element",
    "mathjax/jax/input/TeX",
    "mathjax/jax/output/SVG/autoload",
    "mathjax/jax/output/SVG/fonts/TeX",
    "mathjax/jax/output/SVG/jax.js",
]
LOCAL = {
    "bootstrap.min.css": "bootstrap5/css/bootstrap.min.css",
    "bootstrap.bundle.min.js": "bootstrap5/js/bootstrap.bundle.min.js",
    "lunr.js": "lunr/lunr.js",
    "MathJax.js": "mathjax/MathJax.js?config=TeX-AMS-MML_SVG",  # formulas as SVG need no font files
}
LOADED = re.compile(r"<(?:script|link)\b[^>]*\"https?://[^>]*>")
ADDRESS = re.compile(r'"https?://[^"?]*/([^"/?]+)[^"]*"')
INTEGRITY = re.compile(r'\s+(?:integrity|crossorigin)="[^"]*"')


def copy_libraries(target):
    for part in COPIES:
        (target / part).parent.mkdir(parents=True, exist_ok=True)
        if (INSTALLED / part).is_dir():
            shutil.copytree(INSTALLED / part, target / part, dirs_exist_ok=True)
        else:
            shutil.copy(INSTALLED / part, target / part)


def localised(html, libraries):
    """The page with links to the copies; KeyError names what has none."""

    def local(tag):
        return INTEGRITY.sub("", ADDRESS.sub(lambda address: f'"{libraries}/{LOCAL[address[1]]}"', tag[0]))

    return LOADED.sub(local, html)


def main(site):
    missing = [part for part in COPIES if not (INSTALLED / part).exists()]
    if missing:
        sys.exit(f"self_contained.py: {INSTALLED / missing[0]} is missing; scripts/setup docs installs it")
    pages = list(site.rglob("*.html"))
    copy_libraries(site / "lib")
    for page in pages:
        try:
            html = localised(page.read_text(encoding="utf-8"), os.path.relpath(site / "lib", page.parent))
        except KeyError as unknown:
            sys.exit(f"self_contained.py: {page} loads {unknown}, of which there is no copy")
        page.write_text(html, encoding="utf-8")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
