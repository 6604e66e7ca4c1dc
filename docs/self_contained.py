"""Makes a FORD site readable without a network: local copies of Bootstrap and MathJax in place of FORD's links to them.

usage: self_contained.py SITE

The copies come from the Debian packages libjs-bootstrap5 and libjs-mathjax. Exit codes: 0 done, 1 the pages are not
those that this script knows, 3 a package is missing.
"""
import os
import pathlib
import re
import shutil
import sys

LIBRARIES = pathlib.Path("/usr/share/javascript")
BOOTSTRAP = ["css/bootstrap.min.css", "js/bootstrap.bundle.min.js"]
MATHJAX = ["MathJax.js", "config/TeX-AMS-MML_SVG.js", "extensions", "jax/element", "jax/input/TeX", "jax/output/SVG/autoload",
           "jax/output/SVG/fonts/TeX", "jax/output/SVG/jax.js"]
COPIES = {"bootstrap5": BOOTSTRAP, "mathjax": MATHJAX}

# what FORD links to, and the file in the site that replaces it; formulas as SVG need no font files
REMOTE = re.compile(r'(href|src)="https://cdn\.[^"]*/(bootstrap\.min\.css|bootstrap\.bundle\.min\.js|MathJax\.js)[^"]*"')
LOCAL = {
    "bootstrap.min.css": "lib/bootstrap5/css/bootstrap.min.css",
    "bootstrap.bundle.min.js": "lib/bootstrap5/js/bootstrap.bundle.min.js",
    "MathJax.js": "lib/mathjax/MathJax.js?config=TeX-AMS-MML_SVG",
}
INTEGRITY = re.compile(r'\s+(integrity|crossorigin)="[^"]*"')


def copy_libraries(site):
    for library, parts in COPIES.items():
        for part in parts:
            source, target = LIBRARIES / library / part, site / "lib" / library / part
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, dirs_exist_ok=True)
            else:
                shutil.copy(source, target)


def localised(html, to_root):
    """The page with local links, and how many there are."""
    html, count = REMOTE.subn(lambda link: f'{link[1]}="{to_root}/{LOCAL[link[2]]}"', html)
    return INTEGRITY.sub("", html), count


def main(site):
    missing = [library for library in COPIES if not (LIBRARIES / library).is_dir()]
    if missing:
        return 3
    copy_libraries(site)
    for page in site.rglob("*.html"):
        if "lib" in page.relative_to(site).parts:
            continue
        html, count = localised(page.read_text(encoding="utf-8"), os.path.relpath(site, page.parent))
        if count != len(LOCAL):
            print(f"{page}: expected {len(LOCAL)} links to replace, found {count}", file=sys.stderr)
            return 1
        page.write_text(html, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
