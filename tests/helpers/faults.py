"""What makes sound logs of three axes wrong, in both logs or in the loaded one alone, and what is said of it."""

import numpy as np
from consistency_logs import at, changed, exchanged, late

from ident.recordings.recording import Recording


def times(joint: int, factor: float) -> np.ndarray:
    return at(joint, factor, 1.0, 3)


IN_ONE = {
    "q2 is negated": ("sign", lambda x: changed(x, q=x.q * times(1, -1.0))),
    "q3 is negated and its zero off by 90 degrees": (
        "", lambda x: changed(x, q=at(2, np.pi / 2, 0.0, 3) + x.q * times(2, -1.0)),
    ),
    "q2 and v2 are negated": ("", lambda x: changed(x, q=x.q * times(1, -1.0), v=x.v * times(1, -1.0))),
    "columns v2 and v3 are exchanged": ("order", lambda x: changed(x, v=exchanged(x.v, 1, 2))),
    "v2 is negated": ("current sign", lambda x: changed(x, v=x.v * times(1, -1.0))),
    "v2 is scaled": ("current scale", lambda x: changed(x, v=x.v * times(1, 3.0))),
    "all currents are scaled by 1000": ("current scale", lambda x: changed(x, v=1e3 * x.v)),
    "t must be multiplied by 0.8": ("clock", lambda x: changed(x, t=1.25 * x.t)),
}  # fmt: skip
"""Faults of the loaded log, by the words for them: the family that is told, if any, and the change of a log."""
IN_ALL = {
    "the zero of q2 is off by 90 degrees": ("zero", lambda x: changed(x, q=x.q - at(1, np.pi / 2, 0.0, 3))),
    "q3 is the position of joint 3 plus that of joint 2": (
        "coupling",
        lambda x: changed(x, q=x.q + np.outer(x.q[:, 1], [0.0, 0.0, 1.0])),
    ),
    "joints 2 and 3 are exchanged": ("", lambda x: changed(x, q=exchanged(x.q, 1, 2), v=exchanged(x.v, 1, 2))),
    "columns q are shifted by one place, the first joint last": ("", lambda x: changed(x, q=x.q[:, [1, 2, 0]])),
    "columns v are shifted by one place, the last joint first": ("", lambda x: changed(x, v=x.v[:, [2, 0, 1]])),
    "ms later than the positions": ("delay", lambda x: late(x, 2)),
    "the clock is wrong: t must be multiplied by 2": ("", lambda x: changed(x, t=0.5 * x.t)),
}
FAULTS = IN_ONE | IN_ALL
SIZES = {"t must be multiplied by 0.8": -20.0, "ms later than the positions": 16.0, "v2 is scaled": 3.0}
"""Of faults whose size is estimated, in the unit in which it is said."""


def faulty(fault: str, right: list[Recording]) -> list[Recording]:
    change = FAULTS[fault][1]
    return [change(right[0]) if fault in IN_ALL else right[0], change(right[1])]
