"""What goes wrong with logs of six joints, and how it is named."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.recordings.recording import Recording

Pair = tuple[Recording, Recording]


def changed(log: Recording, *, t=None, q=None, v=None) -> Recording:
    return Recording(log.t if t is None else t, log.q if q is None else q, log.v if v is None else v, log.name)


def late(log: Recording, rows: int) -> Recording:
    """Currents some rows later."""
    return changed(log, v=np.vstack((log.v[[0] * rows], log.v[:-rows])))


def exchanged(x: np.ndarray, i: int, j: int) -> np.ndarray:
    order = np.arange(x.shape[1])
    order[[i, j]] = j, i
    return x[:, order]


def at(joint: int, value: float, otherwise: float, n: int = 6) -> np.ndarray:
    return np.where(np.arange(n) == joint, value, otherwise)


@dataclass(frozen=True)
class LogFault:
    """One thing that is wrong.

    Attributes:
        put: What makes sound logs wrong.
        name: Of the diagnosis.
        joints: That it names.
        logs: That it names.
        words: In its sentence.
    """

    put: Callable[[Recording, Recording], Pair]
    name: str
    joints: tuple[int, ...]
    logs: tuple[str, ...]
    words: str


FAULTS = {
    "q3 negated in one log": LogFault(
        lambda a, b: (a, changed(b, q=b.q * at(2, -1.0, 1.0))), "sign", (2,), ("loaded",), "q3 is negated"
    ),
    "q5 negated": LogFault(
        lambda a, b: tuple(changed(x, q=x.q * at(4, -1.0, 1.0)) for x in (a, b)), "sign", (4,), (), "q5 is negated"
    ),
    "zero of q4 a quarter off": LogFault(
        lambda a, b: tuple(changed(x, q=x.q - at(3, np.pi / 2.0, 0.0)) for x in (a, b)), "zero", (3,), (), "zero of q4"
    ),
    "zero of q2 off by 4 degrees": LogFault(
        lambda a, b: tuple(changed(x, q=x.q - at(1, 0.07, 0.0)) for x in (a, b)), "zero", (1,), (), "zero of q2"
    ),
    "columns q2 and q3 exchanged in one log": LogFault(
        lambda a, b: (a, changed(b, q=exchanged(b.q, 1, 2))), "order", (1, 2), ("loaded",), "q2 and q3 are exchanged"
    ),
    "columns v2 and v3 exchanged": LogFault(
        lambda a, b: tuple(changed(x, v=exchanged(x.v, 1, 2)) for x in (a, b)), "order", (1, 2), (),
        "v2 and v3 are exchanged",
    ),
    "v2 negated in one log": LogFault(
        lambda a, b: (a, changed(b, v=b.v * at(1, -1.0, 1.0))), "current sign", (1,), ("loaded",), "v2 is negated"
    ),
    "v2 times 1.15 in one log": LogFault(
        lambda a, b: (a, changed(b, v=b.v * at(1, 1.15, 1.0))), "current scale", (1,), ("loaded",), "v2 is scaled"
    ),
    "all currents times 1000 in one log": LogFault(
        lambda a, b: (a, changed(b, v=1000.0 * b.v)), "current scale", (), ("loaded",), "all currents are scaled by 1"
    ),
    "currents 16 ms late in one log": LogFault(
        lambda a, b: (a, late(b, 2)), "delay", (), ("loaded",), "ms later than the positions"
    ),
    "a clock that runs fast in one log": LogFault(
        lambda a, b: (a, changed(b, t=1.25 * b.t)), "clock", (), ("loaded",), "t must be multiplied by 0.8"
    ),
    "all positions halved": LogFault(
        lambda a, b: tuple(changed(x, t=2.0 * x.t) for x in (a, b)), "clock", (), (), "t must be multiplied by 0.5"
    ),
}  # fmt: skip
