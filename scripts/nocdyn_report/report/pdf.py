"""The PDF: the page as headless Chromium prints it."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from .failure import FILES, ReportError

OPTIONS = (
    "--headless",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-extensions",
    "--hide-scrollbars",
    "--window-size=1000,1400",
    "--no-pdf-header-footer",
    "--generate-pdf-document-outline",
)
MOST_SECONDS = 300


def find_browser() -> str:
    """Chromium, without which no PDF is printed."""
    browser = shutil.which("chromium")
    if browser is None:
        raise ReportError("there is no chromium, which prints the PDF: apt-get install chromium, or use --no-pdf", FILES)
    return browser


def print_pdf(page: Path, pdf: Path) -> None:
    """Writes `pdf`; the page is a file on this machine."""
    root = ("--no-sandbox",) if os.geteuid() == 0 else ()  # Chromium refuses to be run by root otherwise
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = [find_browser(), *OPTIONS, *root, f"--user-data-dir={profile}", f"--print-to-pdf={pdf}", page.resolve().as_uri()]
        try:
            done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=MOST_SECONDS)
        except subprocess.TimeoutExpired:
            raise ReportError(f"{pdf}: Chromium did not print it in {MOST_SECONDS} s; --no-pdf does without", FILES) from None
    if done.returncode or not pdf.is_file() or pdf.stat().st_size == 0:
        pdf.unlink(missing_ok=True)
        last = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:] or ["no message"]
        raise ReportError(f"Chromium could not print the PDF: {last[0]}; --no-pdf does without", FILES)
