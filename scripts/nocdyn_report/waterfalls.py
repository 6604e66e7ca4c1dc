"""Spectra of run-ups and run-downs over the speed: amplitudes of all orders and of all frequencies.

They are computed here and not by the program: windows and lines are chosen for a picture, and the signals are there already,
in measured_NAME.csv and the trajectory, both at the same times; a run would have to know beforehand which columns somebody wants
to see so. Orders are found as in src/analyse/measured/order_tracking.f90, which finds one amplitude for comparisons (K. R. Fyfe,
E. D. S. Munck, Mechanical Systems and Signal Processing 11 (1997) 187-205): sampled at equal angles by cubic polynomials, with
Hann windows over some turns. Frequencies have windows of the time in which a middle order moves by one line, so that neither
speed nor frequency smears more than the other.
"""

import math
from dataclasses import dataclass

import numpy as np

from .failure import ChoiceError

TURN = 2.0 * math.pi
TURNS = 16  # of a window: lines at every sixteenth of an order
OVERLAP = 8  # windows begin after this part of their length
SAMPLES = 4.0  # of the record in a period of the highest line
MIDDLE = 2.0  # order by which windows in time are chosen
FEWEST = 16  # windows of a waterfall
CHANGE = 1.2  # of the speed, from which on there is something to see
HIGHEST = 100.0  # order that is looked for


@dataclass(frozen=True)
class Waterfall:
    speeds: np.ndarray  # of the windows, ascending [rad/s]
    lines: np.ndarray  # orders, or frequencies [Hz]
    amplitudes: np.ndarray  # [windows, lines]


def order_waterfall(times: np.ndarray, values: np.ndarray, speeds: np.ndarray, turns: int = TURNS) -> Waterfall:
    """Amplitudes of orders in windows over some turns."""
    angles, turning = _angles(times, speeds)
    size = np.abs(speeds)
    highest = min(TURN / (SAMPLES * _interval(times) * size.max()), HIGHEST)
    lines = np.arange(int(highest * turns) + 1) / turns
    mean, spectra = [], []
    for start in np.arange(0.0, angles[-1] - TURN * turns, TURN * turns / OVERLAP):
        ends = np.interp([start, start + TURN * turns], angles, turning)
        count = max(2 * int((ends[1] - ends[0]) / _interval(times)), 2 * len(lines))  # more than the record has: no alias
        at = np.interp(start + TURN * turns / count * np.arange(count), angles, turning)
        mean.append(_windowed_mean(np.interp(at, times, size)))
        spectra.append(_amplitudes(sampled_at(times, values, at), len(lines)))
    return _of_run_up(np.array(mean), lines, spectra)


def frequency_waterfall(times: np.ndarray, values: np.ndarray, speeds: np.ndarray) -> Waterfall:
    """Amplitudes of frequencies in windows of the time."""
    interval, span = _interval(times), times[-1] - times[0]
    rate = np.ptp(np.abs(speeds)) / TURN / span  # of the turning frequency [1/s2]
    length = min(span * OVERLAP / (2 * FEWEST), 1.0 / math.sqrt(MIDDLE * rate) if rate > 0 else span)
    count = max(32, 2 * round(0.5 * length / interval))
    even = np.arange(times[0], times[-1], interval)
    values, speeds = sampled_at(times, values, even), np.interp(even, times, np.abs(speeds))
    lines = np.arange(int(count / SAMPLES) + 1) / (count * interval)
    parts = [slice(start, start + count) for start in range(0, len(even) - count + 1, max(1, count // OVERLAP))]
    mean = np.array([_windowed_mean(speeds[part]) for part in parts])
    return _of_run_up(mean, lines, [_amplitudes(values[part], len(lines)) for part in parts])


def _hann(count: int) -> np.ndarray:
    return (1.0 - np.cos(TURN * np.arange(count) / count)) / count


def _windowed_mean(values: np.ndarray) -> float:
    return float((values * _hann(len(values))).sum())


def _amplitudes(values: np.ndarray, lines: int) -> np.ndarray:
    """Of the first lines of the spectrum, without the mean."""
    return 2.0 * np.abs(np.fft.rfft((values - _windowed_mean(values)) * _hann(len(values)))[:lines])


def _of_run_up(mean: np.ndarray, lines: np.ndarray, spectra: list[np.ndarray]) -> Waterfall:
    """Windows with ascending speeds; of a speed that rises and falls, those between its smallest and its largest value."""
    if len(mean) < FEWEST:
        raise ChoiceError(f"too short for a waterfall: {len(mean)} windows; needed: {FEWEST}")
    first, last = int(mean.argmin()), int(mean.argmax())
    rows = np.arange(first, last + 1) if first <= last else np.arange(first, last - 1, -1)
    rows = rows[np.append(True, np.diff(np.maximum.accumulate(mean[rows])) > 0)]
    if len(rows) < FEWEST or mean[rows[-1]] < CHANGE * mean[rows[0]]:
        raise ChoiceError(
            f"no run-up: the speed goes from {mean.min():.4g} to {mean.max():.4g} rad/s in {len(rows)} windows; "
            f"needed: {FEWEST} windows and {CHANGE:g} times the speed"
        )
    return Waterfall(mean[rows], lines, np.array([spectra[row] for row in rows]))


def _interval(times: np.ndarray) -> float:
    return float(times[-1] - times[0]) / (len(times) - 1)


def _angles(times: np.ndarray, speeds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ascending angles from 0 on, with their times."""
    if np.any(speeds > 0) and np.any(speeds < 0):
        raise ChoiceError("the speed changes its sign; orders need one direction")
    size = np.abs(speeds)
    angles = np.append(0.0, np.cumsum(0.5 * (size[1:] + size[:-1]) * np.diff(times)))
    rising = np.append(True, np.diff(angles) > 0)
    return angles[rising], times[rising]


def sampled_at(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cubic polynomials through the four points about each abscissa, as the program samples records."""
    if len(x) < 4:
        return np.interp(at, x, y)
    first = np.clip(np.searchsorted(x, at, side="right") - 2, 0, len(x) - 4)
    at = np.clip(at, x[0], x[-1])
    value = np.zeros(len(at))
    for i in range(4):
        term = y[first + i].astype(float)
        for k in range(4):
            if k != i:
                term = term * (at - x[first + k]) / (x[first + i] - x[first + k])
        value += term
    return value
