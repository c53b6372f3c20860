"""Currents of one log in another unit, of another scale or sign than those of the others."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_logs
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

SCALES = np.concatenate([sign * np.geomspace(1e-4, 1e4, 97) for sign in (1.0, -1.0)])
"""Where scales are looked for; neighbours are a fifth apart."""
ROUNDING = 1e-9
"""Of the grid, whose every twelfth point is a power of ten."""
LARGEST = 0.3
"""Relative change up to which the derivative says its size."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Of every later log, each current and all together, by the scale on the grid that leaves least of the currents."""
    n, count = logs.structure.arm.n, len(logs.recordings)
    if count < 2:
        return
    for k in range(1 if count == 2 else 0, count):
        squares = np.array([_left(logs, j, k) for j in range(n)])  # (n, scales), logarithms of mean squares
        for joints, cost in (((), squares.sum(axis=0)), *(((j,), squares[j]) for j in range(n))):
            scale = float(SCALES[int(np.argmin(cost))])
            if abs(scale - 1.0) > LARGEST:
                yield replace(scaled(logs, (k,), joints, scale), searched=not _of_units(scale))
        for j in range(n):
            yield scaled(logs, (k,), (j,), -1.0)


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Currents of one log that are a little larger, all of them or one: what the fit explains of them."""
    n, count = logs.structure.arm.n, len(logs.recordings)
    if count < 2:
        return
    for k, joints in product(range(1 if count == 2 else 0, count), ((), *((j,) for j in range(n)))):
        yield Direction(
            family="current scale", joints=joints, logs=(k,),
            columns=tuple(
                each[:, None] if not joints or j in joints else None for j, each in enumerate(reference.explained(k))
            ),
            alternative=lambda value, k=k, joints=joints: scaled(logs, (k,), joints, 1.0 + float(value[0])),
            unit="", scale=1.0, largest=LARGEST,
        )  # fmt: skip


def scaled(logs: Logs, scope: tuple[int, ...], joints: tuple[int, ...], scale: float) -> Alternative:
    """Currents of a log that are a factor of what they would be in the unit of the others."""
    own = np.isin(np.arange(logs.structure.arm.n), joints) | (not joints)
    what = "all currents" if not joints else f"v{joints[0] + 1}"
    verb = "are" if not joints else "is"
    words = f"{what} {verb} negated" if scale == -1.0 else f"{what} {verb} scaled by {scale:.4g}"
    return Alternative(
        family="current sign" if scale < 0.0 else "current scale",
        words=in_logs(words, scope, logs.names),
        joints=joints,
        logs=scope,
        hypothesis=logs.given.changed(scope, v_factor=np.where(own, 1.0 / scale, 1.0)),
        advice="use one unit and one sign of the current in all logs",
        value=scale,
        unit="",
        refined=lambda more: scaled(logs, scope, joints, scale * float(np.exp(more[0]))),
    )


def _of_units(scale: float) -> bool:
    """Whether a factor is one that units differ by: a power of ten, of either sign."""
    power = float(np.log10(abs(scale)))
    return abs(power - round(power)) < ROUNDING


def _left(logs: Logs, joint: int, k: int) -> Array:
    """Logarithm of the likelihood that each scale of log k loses of a joint's currents, log k and the others apart.

    Each side has a variance of its own, as in the comparison: in one sum of squares the side of larger units decides.
    """
    held = logs.model.fits.parts[joint]
    if held is None:
        return np.zeros(len(SCALES))
    own = (logs.model.rows[joint].motion == k).astype(np.float64)
    V = held.fit.V
    other, mine = held.fit.without(V * (1.0 - own)), held.fit.without(V * own)
    a, b = other * (1.0 - own), mine * (1.0 - own)  # of the other logs' rows: a + b / s
    c, d = other * own, mine * own  # of log k's: s c + d in its own unit
    others = a @ a + 2.0 * (a @ b) / SCALES + (b @ b) / SCALES**2
    of_k = SCALES**2 * (c @ c) + 2.0 * SCALES * (c @ d) + d @ d
    share = float(own.mean())
    squares = (1.0 - share) * np.log(np.maximum(others, _least(V * (1.0 - own))))
    squares += share * np.log(np.maximum(of_k, _least(V * own)))
    return 0.5 * held.fit.freedom * squares


def _least(V: Array) -> float:
    """Squares of rounding."""
    return max(1e-20 * float(V @ V), 1e-300)
