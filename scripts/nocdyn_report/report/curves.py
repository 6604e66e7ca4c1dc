"""Curves for assets/figures.js: arrays as 32-bit numbers in base 64, each stored once."""

import base64
import hashlib
from collections.abc import Sequence

import numpy as np

from ..thinning import thin

MOST_TURNS = 4  # pixels for each turn of a line: with fewer it fills its panel
TURN = 0.1  # of the range of a curve: smaller swings do not fill a panel
PLACES = 125  # of an envelope
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
    """How often a curve turns by more than a share of its range; many turns in few pixels would be a solid block."""
    y = y[np.isfinite(y)]
    if len(y) < 3:
        return 0
    inner = y[1:-1]
    turning = y[1:-1][(inner - y[:-2]) * (y[2:] - inner) < 0]
    least = TURN * np.ptp(y)
    turns, rises, last = 0, True, float(y[0])
    for value in turning.tolist():
        if (value > last) == rises:
            last = value
        elif abs(value - last) > least:
            turns, rises, last = turns + 1, not rises, value
    return turns


def _envelope(x: np.ndarray, y: np.ndarray, turns: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places, and about each the smallest and the largest value within half an oscillation to both sides."""
    places = np.linspace(0, len(y) - 1, min(PLACES, len(y))).astype(int)
    half = max(1, round(max(len(y) / turns, 0.5 * len(y) / len(places))))
    parts = [slice(max(0, place - half), place + half + 1) for place in places]
    return x[places], np.array([y[part].min() for part in parts]), np.array([y[part].max() for part in parts])


def band(start: float, end: float, kind: str, label: str) -> dict:
    """A range of x that is shaded: 'operation', 'margin', 'barred', 'passable'."""
    return {"from": start, "to": end, "kind": kind, "label": label}
