"""What goes wrong with the positions of a log, and the reading that undoes it."""

from collections.abc import Callable

import numpy as np

from ident.recordings.recording import Recording

Change = Callable[[np.ndarray], np.ndarray]


def negated(joint: int) -> Change:
    def change(q: np.ndarray) -> np.ndarray:
        q[:, joint] *= -1.0
        return q

    return change


def shifted(joint: int, angle: float) -> Change:
    def change(q: np.ndarray) -> np.ndarray:
        q[:, joint] += angle
        return q

    return change


def swapped(joint: int) -> Change:
    def change(q: np.ndarray) -> np.ndarray:
        q[:, [joint, joint + 1]] = q[:, [joint + 1, joint]]
        return q

    return change


CHANGES = (
    {f"joint {j + 1} negated": negated(j) for j in range(6)}
    | {f"joint {j + 1} at {sign}pi/2": shifted(j, float(f"{sign}1") * np.pi / 2) for j in range(1, 6) for sign in "+-"}
    | {f"joints {j + 1} and {j + 2} swapped": swapped(j) for j in range(5)}
)
CURES = (
    {f"joint {j + 1} negated": f"q{j + 1} negated" for j in range(6)}
    | {f"joint {j + 1} at +pi/2": f"q{j + 1} plus 270 degrees" for j in range(1, 6)}
    | {f"joint {j + 1} at -pi/2": f"q{j + 1} plus 90 degrees" for j in range(1, 6)}
    | {f"joints {j + 1} and {j + 2} swapped": f"columns q{j + 1} and q{j + 2} exchanged" for j in range(5)}
)


def corrupted(logs: tuple[Recording, Recording], change: Change) -> tuple[Recording, Recording]:
    """Both recordings with their positions changed."""
    bare, loaded = (Recording(log.t, change(log.q.copy()), log.v, log.name) for log in logs)
    return bare, loaded
