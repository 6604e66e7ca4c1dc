"""How long a report takes: a ship plant with two load cases, from its input file to the page that a browser has opened."""

import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

from .tables import table
from .torsional_machines import timed_plant

CASES = """&excitation name = 'blow' body = 'propeller' kind = 'pulse' amplitude = -2.0e5 time = 2.0 duration = 0.2 /
&fatigue name = 'life' coupling = 'shaft_12' reference_moment = 1.0e6 reference_cycles = 2.0e6 slope = 5 /
&limit coupling = 'shaft_12' vibratory_moment = 4.0e5 /
&load_case name = 'calm' repeats = 1.0e6 /
&load_case name = 'ice' repeats = 100 with = 'blow' /
"""
MOST_SECONDS, MOST_MEGABYTES, MOST_SECONDS_TO_OPEN = 15.0, 5.0, 1.0
WORDS = ("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-sync")


def report_costs(root: Path, scratch: Path, rounds: int) -> list[str]:
    """Lines of a table; `root`: of the repository."""
    file = scratch / "plant.nml"
    plant = timed_plant()
    plant.write_input(file)
    text = file.read_text(encoding="utf-8").replace("&run t_end = 1.0 /", "&run t_end = 10.0 /")
    file.write_text(text + CASES, encoding="utf-8")
    seconds = {words: [_report(root, file, scratch / "report", words) for _ in range(rounds)] for words in ((), ("--no-pdf",))}
    page = scratch / "report" / "report.html"
    opened = [_seconds_to_open(page) for _ in range(rounds)]
    megabytes = page.stat().st_size / 1e6
    rows = [
        ["`nocdyn report plant.nml`", f"{median(seconds[()]):.2g} s", f"{MOST_SECONDS:g} s", median(seconds[()]) < MOST_SECONDS],
        ["the same with `--no-pdf`", f"{median(seconds[('--no-pdf',)]):.2g} s", "-", None],
        ["`report.html`", f"{megabytes:.2g} MB", f"{MOST_MEGABYTES:g} MB", megabytes < MOST_MEGABYTES],
        ["Chromium opens it", f"{median(opened):.2g} s", f"{MOST_SECONDS_TO_OPEN:g} s", median(opened) < MOST_SECONDS_TO_OPEN],
    ]
    verdicts = {True: "**reached**", False: "**missed**", None: "-"}
    return [
        *table(["", "median", "wanted below", ""], [[*row[:3], verdicts[row[3]]] for row in rows]),
        "",
        f"{len(plant.inertias)} bodies, 12 orders, {plant.count} speeds, two load cases of 10 s, nothing calculated before; "
        f"{rounds} rounds. Opened: until the end of the event `load`.",
    ]


def _report(root: Path, file: Path, out: Path, words: tuple[str, ...]) -> float:
    shutil.rmtree(out, ignore_errors=True)
    began = time.perf_counter()
    subprocess.run([root / "scripts" / "report", file, "--quiet", "--out", out, *words], check=True, stdin=subprocess.DEVNULL)
    return time.perf_counter() - began


def _seconds_to_open(page: Path) -> float:
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    with tempfile.TemporaryDirectory() as profile:
        for word in (*WORDS, f"--user-data-dir={profile}"):
            options.add_argument(word)
        driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
        try:
            driver.get(page.resolve().as_uri())
            return driver.execute_script("return performance.getEntriesByType('navigation')[0].loadEventEnd") / 1e3
        finally:
            driver.quit()
