"""What a mode is besides an oscillation of the bodies, in words."""

TOO_FEW = 1.0e-3  # relative error of a frequency, by the nodes of shafts, from which on the program marks it
VAGUE = 0.03  # from which on it is not known better


def marks_of(mode: dict) -> list[str]:
    """Of a mode of modes.json."""
    marks = [f"mostly {mode['state']}"] if mode.get("state") else []
    error = mode.get("error_by_shaft_nodes", 0.0)
    size = f"more than {100.0 * VAGUE:.2g}" if error > VAGUE else f"about {100.0 * error:.1g}"
    return [*marks, f"nodes too few: error {size} %"] if error > TOO_FEW else marks
