"""What the tests of reports share: the script, and the pages in headless Chromium."""

import contextlib
import importlib
import io
import os
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import pytest
from conftest import SOURCE
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

WORD = ["--headless", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
WORD += ["--disable-component-update", "--disable-sync", "--hide-scrollbars"]
sys.path.insert(0, str(SOURCE / "scripts"))
LIBRARY = Path("/usr/share/nodejs/d3/dist/d3.min.js")


def require() -> None:
    """Ends the tests where a browser or the library of the figures is missing."""
    missing = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    missing += [] if LIBRARY.is_file() else ["node-d3"]
    if missing:
        pytest.fail(f"{', '.join(missing)} not installed: run scripts/setup report browser test", pytrace=False)


@dataclass(frozen=True)
class Outcome:
    returncode: int
    stdout: str
    stderr: str


class Reports:
    """A folder with inputs, and the script."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, *words: object, **changes: str) -> Outcome:
        """The Python part of scripts/report within this process, for the start of pandas takes a second."""
        main = importlib.import_module("nocdyn_report.report.command").main
        output, errors = io.StringIO(), io.StringIO()
        with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            patch.chdir(self.folder)
            patch.setattr(sys, "argv", ["report", *map(str, words)])
            for name, value in changes.items():
                patch.setenv(name, value)
            with pytest.raises(SystemExit) as leaving:
                main()
        return Outcome(leaving.value.code, output.getvalue(), errors.getvalue())

    def write(self, name: str, text: str) -> Path:
        (self.folder / name).write_text(text, encoding="utf-8")
        return self.folder / name

    def page(self, name: str = "m") -> Path:
        return self.folder / "results" / name / "report.html"


class Browser:
    """Chromium, which keeps what the console says."""

    def __init__(self) -> None:
        self.profile = tempfile.mkdtemp()
        options = Options()
        options.binary_location = shutil.which("chromium")
        for word in [*WORD, f"--user-data-dir={self.profile}", *(["--no-sandbox"] if os.geteuid() == 0 else [])]:
            options.add_argument(word)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))

    def open(self, page: Path, width: int = 1000, theme: str = "light") -> None:
        metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        media = {"features": [{"name": "prefers-color-scheme", "value": theme}]}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", media)
        self.driver.get(page.resolve().as_uri())

    def ask(self, script: str, *arguments: object) -> object:
        return self.driver.execute_script(script, *arguments)

    def find(self, selector: str) -> object:
        return self.driver.find_element("css selector", selector)

    def console(self) -> list[str]:
        return [entry["message"] for entry in self.driver.get_log("browser")]

    def quit(self) -> None:
        self.driver.quit()
        shutil.rmtree(self.profile, ignore_errors=True)


def faults(browser: Browser) -> list[str]:
    """What is wrong with the page that is open."""
    found = [f"console: {message}" for message in browser.console()]
    found += browser.ask("""
        const found = [];
        for (const figure of document.querySelectorAll('[data-figure]')) {
          const drawn = figure.querySelectorAll('.picture > svg path.curve[d], .picture > svg circle').length;
          if (!drawn || figure.querySelector('svg path.curve[d*="NaN"]')) found.push('not drawn: ' + figure.id);
        }
        for (const train of document.querySelectorAll('svg.train')) {
          const frame = train.getBoundingClientRect();
          for (const text of train.querySelectorAll('text')) {
            const box = text.getBoundingClientRect();
            if (box.left < frame.left - 1 || box.right > frame.right + 1) found.push('cut off: ' + text.textContent);
          }
        }
        for (const link of document.querySelectorAll('a[href^="#"]'))
          if (!document.getElementById(decodeURIComponent(link.hash.slice(1)))) found.push('no target: ' + link.hash);
        for (const one of document.querySelectorAll('[src], [href], [data], [srcset]'))
          if (/^\\s*(https?:)?\\/\\//.test(one.getAttribute('src') || one.getAttribute('href') || ''))
            found.push('from outside: ' + one.outerHTML);
        if (performance.getEntriesByType('resource').length) found.push('it loads resources');
        const ids = [...document.querySelectorAll('[id]')].map((one) => one.id);
        if (new Set(ids).size < ids.length) found.push('two elements have one id');
        const root = document.documentElement;
        if (root.scrollWidth > root.clientWidth) found.push(`overflow: ${root.scrollWidth} of ${root.clientWidth} px`);
        return found;
    """)
    return found
