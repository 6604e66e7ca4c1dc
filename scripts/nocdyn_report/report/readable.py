"""Units as engineers read them: one for a column or an axis, by its largest number."""

import math
from collections.abc import Sequence

from .content import Cell, number, text
from .numbers import number_text

PREFIXES = (("M", 1e6), ("k", 1e3))
LARGE = 1e4  # of a unit, from here on it has a prefix; moments, stiffnesses and powers below 10 MN m are in k
STEPS = {"Pa": (("M", LARGE),), "N m": (("M", 1e8), ("k", LARGE))}  # the prefix, and from which number on; other units:
USUAL = (("M", 1e7), ("k", LARGE))
PREFIXED = {"Pa", "N m", "N", "W", "J", "N m/rad", "N m s/rad", "N/m", "N s/m"}
NOISE = 1e-9  # of the largest number of a column: what rounding leaves of a zero, as the program prints it too
DAMAGE_DIGITS = 2  # of a damage or a life, which no material keeps to more
NO_DAMAGE = 1e-12  # below, there is none


class Units:
    """Numbers of SI in units for readers; speeds have the unit that the input uses."""

    def __init__(self, speed: str) -> None:
        self.speed = speed

    def shown(self, unit: str, largest: float) -> tuple[float, str]:
        """What numbers are multiplied by, and the unit that they have then."""
        if unit == "rad":
            return 180.0 / math.pi, "deg"
        if unit == "rad/s" and self.speed in ("rpm", "Hz"):
            return (30.0 / math.pi, "rpm") if self.speed == "rpm" else (0.5 / math.pi, "Hz")
        if unit in PREFIXED:
            for prefix, least in STEPS.get(unit, USUAL):
                if abs(largest) >= least:
                    return 1.0 / dict(PREFIXES)[prefix], prefix + unit
        return 1.0, unit

    def column(self, head: str, unit: str, values: Sequence[float | None], digits: int = 5) -> tuple[str, list[Cell]]:
        """Head and cells; what is rounding beside the largest number is 0."""
        given = [abs(value) for value in values if value is not None and math.isfinite(value)]
        largest = max(given, default=0.0)
        factor, shown = self.shown(unit, largest)
        cells = []
        for value in values:
            is_noise = value is not None and abs(value) <= NOISE * largest
            cells.append(number(value if value is None else 0 if is_noise else factor * value, digits))
        return f"{head} [{shown}]" if shown not in ("", "1") else head, cells

    def amount(self, value: float | None, unit: str, digits: int = 4, like: float | None = None) -> str:
        """As '22.81 MPa'; with the prefix of another number if there is one."""
        if value is None:
            return ""
        factor, shown = self.shown(unit, value if like is None else like)
        return f"{number_text(float(f'{factor * value:.12g}'), digits)} {'' if shown == '1' else shown}".rstrip()


def life(value: float | None, tone: str = "") -> Cell:
    """A damage, or how often something may occur."""
    if value is not None and 0 < value < NO_DAMAGE:
        return Cell("< 10⁻¹²", value, "", tone, True)
    return number(None if value is None else float(value), DAMAGE_DIGITS, tone)


def texts(words: Sequence[object]) -> list[Cell]:
    return [text(word) for word in words]
