"""Numbers as a reader wants them; nothing is computed here."""

import math

DIGITS = 5
PLAIN = 1e-3, 1e6  # magnitudes that are written without a power of ten
GROUPED = 10000  # from here on, blanks part the thousands
BLANK = "\N{NARROW NO-BREAK SPACE}"
NONE = "\N{EN DASH}"
RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def number_text(value: object, digits: int = DIGITS) -> str:
    """A number with some significant digits; whole numbers with all of theirs."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return NONE
    if isinstance(value, int):
        return _grouped(str(value)) if abs(value) >= GROUPED else str(value).replace("-", "\N{MINUS SIGN}")
    value = float(value)
    if math.isinf(value):
        return "\N{MINUS SIGN}∞" if value < 0 else "∞"
    if value == 0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    if not PLAIN[0] <= abs(value) < PLAIN[1]:
        return f"{_trimmed(mantissa)}{BLANK}\N{MULTIPLICATION SIGN}{BLANK}10{str(int(exponent)).translate(RAISED)}"
    text = _trimmed(f"{float(f'{mantissa}e{exponent}'):.{max(0, digits - 1 - int(exponent))}f}")
    return _grouped(text) if abs(value) >= GROUPED else text


def _trimmed(text: str) -> str:
    """Without zeros behind the point, and with a minus that is as wide as a plus."""
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return text.replace("-", "\N{MINUS SIGN}")


def _grouped(text: str) -> str:
    whole, point, rest = text.replace("-", "\N{MINUS SIGN}").partition(".")
    sign, whole = ("\N{MINUS SIGN}", whole[1:]) if whole.startswith("\N{MINUS SIGN}") else ("", whole)
    groups = [whole[max(0, end - 3) : end] for end in range(len(whole), 0, -3)]
    return sign + BLANK.join(reversed(groups)) + point + rest


def percent(share: float | None, digits: int = 3) -> str:
    return NONE if share is None else f"{number_text(100.0 * share, digits)}{BLANK}%"


def name_and_unit(label: str) -> tuple[str, str]:
    """'omega_motor [rad/s]' in two."""
    name, _, unit = label.rpartition(" [")
    return (name, unit.removesuffix("]")) if name else (label, "")


def unit_text(unit: str) -> str:
    """As readers write it: kg m2 with a raised 2, N m with a point between."""
    if unit in ("", "1"):
        return ""
    raised = {"m2": "m²", "m3": "m³", "s2": "s²", "rad2": "rad²", "rad3": "rad³"}
    parts = [" ".join(raised.get(word, word) for word in part.split()) for part in unit.split("/")]
    return "/".join(parts)
