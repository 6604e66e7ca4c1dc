"""Curves for assets/figures.js: arrays as 32-bit numbers in base 64, each stored once."""

import base64
import hashlib
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..thinning import thin

MOST_TURNS = 4  # pixels for each turn of a line: with fewer it fills its panel
STEP = 1e-3  # of the range of a curve: smaller steps are no turns
LEAST_PARTS, MOST_PARTS = 25, 125  # of an envelope
PIXELS = 500  # that a curve is wide: at most twice as many points
COLOURS = 8  # of assets/report.css, before strokes change


class Arrays:
    """All arrays of a report."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._known: dict[bytes, int] = {}

    def put(self, values: Sequence[float] | np.ndarray) -> int:
        """The number of an array."""
        content = np.asarray(values, dtype="<f4").tobytes()
        digest = hashlib.sha256(content).digest()
        if digest not in self._known:
            self._known[digest] = len(self.texts)
            self.texts.append(base64.b64encode(content).decode("ascii"))
        return self._known[digest]

    def curve(
        self, name: str, x: np.ndarray, y: np.ndarray, *, pixels: int = PIXELS, shown: bool = True, **style: object
    ) -> dict:
        """A curve over a rising x, with the extremes of every pixel; `pixels`: of the picture, without zoom."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        if (turns := _turns(y)) > pixels / MOST_TURNS:
            x, low, y = _envelope(x, y, turns)
            style["low"] = self.put(low)
        else:
            x, y = thin(x, y, PIXELS)
        return {"name": name, "x": self.put(x), "y": self.put(y), "shown": shown, **style}

    def points(self, name: str, x: Sequence[float], y: Sequence[float], labels: Sequence[str], **style: object) -> dict:
        return {"name": name, "x": self.put(x), "y": self.put(y), "labels": list(labels), "shown": True, "points": True, **style}


def _turns(y: np.ndarray) -> int:
    """How often a curve turns; many turns in few pixels would be a solid block."""
    y = y[np.isfinite(y)]
    steps = np.diff(y)
    return int(np.count_nonzero(np.diff(np.sign(steps[np.abs(steps) > STEP * np.ptp(y)])))) if len(y) > 1 else 0


def _envelope(x: np.ndarray, y: np.ndarray, turns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The smallest and the largest value of each part, which has one oscillation or more."""
    ends = np.linspace(0, len(y), min(MOST_PARTS, max(LEAST_PARTS, turns // 2)) + 1).astype(int)
    parts = [slice(start, max(start + 1, end)) for start, end in pairwise(ends)]
    middles = np.array([x[part].mean() for part in parts])
    return middles, np.array([y[part].min() for part in parts]), np.array([y[part].max() for part in parts])


def band(start: float, end: float, kind: str, label: str) -> dict:
    """A range of x that is shaded: 'operation', 'margin', 'barred', 'passable'."""
    return {"from": start, "to": end, "kind": kind, "label": label}
