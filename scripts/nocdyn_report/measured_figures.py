"""Measured values over the computed ones, and their differences: of a run, a response or modes with &measurement."""

import json
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from matplotlib import pyplot
from matplotlib.figure import Figure

from .style import COLOURS, PIXELS, REFERENCE, WIDTH, add_title, plain
from .thinning import thin

MEASURED = {"color": "0.55", "linewidth": 1.0}
COMPUTED = {"color": COLOURS[0], "linewidth": 1.2}
LONGEST = 34  # characters of a line beside a panel
MOST_POINTS = 40  # of a record that has a mark for each value
DIGITS = 4


@dataclass(frozen=True)
class Comparison:
    """A member of the list `measurements` of a report, with its file."""

    facts: Mapping
    table: pd.DataFrame

    @property
    def remark(self) -> str:
        """Its statistics."""
        words = [f"bias {self._value('bias')}", f"spread {self._value('spread')} {self.facts['unit']}"]
        if "correlation" in self.facts:
            words.append(f"correlation {self._value('correlation')}")
        if self.facts.get("delay_s"):
            words.append(f"clock moved by {self._value('delay_s')} s")
        if "band_Hz" in self.facts:
            words.append("{:g} to {:g} Hz".format(*self.facts["band_Hz"]))
        return ", ".join(words)

    def _value(self, key: str) -> str:
        return f"{self.facts[key]:.{DIGITS}g}"


def read_comparisons(folder: Path, report: str) -> list[Comparison]:
    """Those of a report such as 'summary.json' that have values; none if the report is missing."""
    file = folder / report
    if not file.is_file():
        return []
    members = json.loads(file.read_text(encoding="utf-8")).get("measurements", [])
    drawn = (one for one in members if one["values"] > 1 and (folder / one["file"]).is_file())
    return [Comparison(one, pd.read_csv(folder / one["file"])) for one in drawn]


def draw_comparison(comparison: Comparison, title: str) -> Figure:
    """Both over their abscissa, and below them the differences."""
    facts, table = comparison.facts, comparison.table
    figure, (upper, lower) = pyplot.subplots(2, 1, sharex=True, figsize=(WIDTH, 5.2), height_ratios=(2, 1))
    x = table.iloc[:, 0].to_numpy()
    mark = {"marker": "o", "markersize": 3.5} if len(x) <= MOST_POINTS else {}
    for place, look, label in ((1, MEASURED, "measured"), (2, COMPUTED, "computed")):
        upper.plot(*thin(x, table.iloc[:, place].to_numpy(), PIXELS), label=label, **look, **mark)
    lower.axhline(facts["bias"], **REFERENCE)
    lower.plot(*thin(x, table.iloc[:, 3].to_numpy(), PIXELS), color=COLOURS[1], linewidth=1.0, **mark)
    upper.legend(loc="best", ncols=2)
    order = f", order {facts['order']:g}" if "order" in facts else ""
    upper.set_ylabel(plain(textwrap.fill(f"{facts['caption']}{order} [{facts['unit']}]", LONGEST)))
    lower.set_ylabel(f"difference\n[{facts['unit']}]")
    lower.set_xlabel({"t [s]": "time [s]"}.get(table.columns[0], table.columns[0]))
    if not mark:
        lower.set_xlim(min(x), max(x))
    name = f"{facts['name']}: {facts.get('signal', 'natural frequencies')}"
    add_title(figure, title, name, comparison.remark)
    return figure


def measured_figures(folder: Path, report: str, title: str) -> dict[str, Figure]:
    """A figure for each measurement, by the name of its file."""
    comparisons = read_comparisons(folder, report)
    return {one.facts["file"].removesuffix(".csv"): draw_comparison(one, title) for one in comparisons}
