"""Measurements beside what was computed: the list `measurements` of a report, with the files of its members."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

HERTZ = 0.5 / math.pi  # of 1 rad/s
SERIES, ORDER, FREQUENCY, PEAK = "series", "order", "frequency", "peak"


@dataclass(frozen=True)
class Comparison:
    """A measurement and the computed values beside it; frequencies in Hz."""

    facts: Mapping  # a member of the list
    table: pd.DataFrame  # measured_NAME.csv
    body: str = ""  # whose speed is that of orders, if the report says it

    @property
    def name(self) -> str:
        return self.facts["name"]

    @property
    def kind(self) -> str:
        return self.facts["kind"]

    @property
    def unit(self) -> str:
        return "Hz" if self.kind == FREQUENCY else self.facts["unit"]

    @property
    def subject(self) -> str:
        """What was measured, as 'order 2 of total_moment_shaft'."""
        if self.kind == FREQUENCY:
            return "natural frequencies"
        before = {ORDER: f"order {self.facts.get('order', 0):g} of ", PEAK: f"{self.facts.get('statistic', '')} of "}
        return before.get(self.kind, "").replace("_", " ") + self.facts["signal"]

    @property
    def abscissa(self) -> np.ndarray:
        """Times [s], speeds [rad/s], numbers of modes."""
        return self.table.iloc[:, 0].to_numpy()

    @property
    def measured(self) -> np.ndarray:
        return self._column("measured")

    @property
    def computed(self) -> np.ndarray:
        return self._column("computed")

    @property
    def before(self) -> np.ndarray | None:
        """Computed values before a fit, if it compared the same ones."""
        return self._column("before") if f"before [{self.facts['unit']}]" in self.table else None

    @property
    def damping_before(self) -> np.ndarray | None:
        return self.table["before_damping [1]"].to_numpy() if "before_damping [1]" in self.table else None

    @property
    def dampings(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Measured and computed damping ratios of frequencies; None if none was measured."""
        names = ["measured_damping [1]", "computed_damping [1]"]
        return tuple(self.table[name].to_numpy() for name in names) if set(names) <= set(self.table) else None

    def value(self, key: str) -> float | None:
        """A statistic in `unit`; None if the measurement has none of it."""
        found = self.facts.get(key)
        return found if found is None else self._factor * found

    @property
    def _factor(self) -> float:
        return HERTZ if self.kind == FREQUENCY else 1.0

    def _column(self, name: str) -> np.ndarray:
        return self._factor * self.table[f"{name} [{self.facts['unit']}]"].to_numpy()


def read_comparisons(folder: Path, report: str) -> list[Comparison]:
    """Those of a report such as 'summary.json' that have values; none if the report is missing."""
    file = folder / report
    if not file.is_file():
        return []
    content = json.loads(file.read_text(encoding="utf-8"))
    members = content.get("measurements", [])
    there = (one for one in members if one["values"] > 0 and (folder / one["file"]).is_file())
    return [Comparison(one, pd.read_csv(folder / one["file"]), content.get("body", "")) for one in there]
