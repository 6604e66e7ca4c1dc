"""Curves for assets/figures.js: arrays as 32-bit numbers in base 64, each stored once."""

import base64
import hashlib
from collections.abc import Sequence

import numpy as np

from ..thinning import thin

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

    def curve(self, name: str, x: np.ndarray, y: np.ndarray, *, shown: bool = True, **style: object) -> dict:
        """A curve over a rising x, with the extremes of every pixel."""
        x, y = thin(np.asarray(x, dtype=float), np.asarray(y, dtype=float), PIXELS)
        return {"name": name, "x": self.put(x), "y": self.put(y), "shown": shown, **style}

    def points(self, name: str, x: Sequence[float], y: Sequence[float], labels: Sequence[str], **style: object) -> dict:
        return {"name": name, "x": self.put(x), "y": self.put(y), "labels": list(labels), "shown": True, "points": True, **style}


def band(start: float, end: float, kind: str, label: str) -> dict:
    """A range of x that is shaded: 'operation', 'margin', 'barred', 'passable'."""
    return {"from": start, "to": end, "kind": kind, "label": label}
