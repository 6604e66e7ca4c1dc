"""Fewer points for the same picture."""

import numpy as np


def thin(x: np.ndarray, y: np.ndarray, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Of a line over a rising x, the smallest and the largest y of each of about `pixels` equal parts: no peak is lost."""
    rows = -(-len(y) // pixels)  # of a part
    if rows <= 4:
        return x, y
    parts = len(y) // rows
    whole = y[: parts * rows].reshape(parts, rows)
    starts = np.arange(parts) * rows
    rest = np.arange(parts * rows, len(y))
    ends = [0, len(y) - 1]
    if rest.size:
        ends += [rest[0] + y[rest].argmin(), rest[0] + y[rest].argmax()]
    kept = np.unique(np.concatenate([starts + whole.argmin(axis=1), starts + whole.argmax(axis=1), ends]))
    return x[kept], y[kept]


def thin_curve(x: np.ndarray, y: np.ndarray, pixels: int) -> tuple[np.ndarray, np.ndarray]:
    """Of any curve, the points that are on another of `pixels` x `pixels` pixels than the one before."""
    cells = np.stack([np.floor((values - values.min()) * (pixels / (np.ptp(values) or 1.0))) for values in (x, y)])
    kept = np.ones(len(x), dtype=bool)
    kept[1:-1] = (cells[:, 1:-1] != cells[:, :-2]).any(axis=0)
    return x[kept], y[kept]
