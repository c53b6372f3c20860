"""Currents of one log with another unit, scale or sign than those of the others."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_logs
from ident.diagnosis.fitted_currents import Reference
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

SCALES = np.concatenate([sign * np.geomspace(1e-4, 1e4, 97) for sign in (1.0, -1.0)])
"""Grid of scales, in steps of a fifth."""
ROUNDING = 1e-9
"""Ratio of the grid, every twelfth point of which is a power of ten."""
LARGEST = 0.3
"""Largest relative change for which the first order is valid."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """For every later log, each current and all together, with the scale on the grid that has the smallest residual."""
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
    """Currents of one log that are slightly larger, all of them or one: the columns are the fitted currents."""
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
    """Return currents of a log with a factor relative to the unit of the others."""
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
    """Whether a factor is typical of units: a power of ten, of either sign."""
    power = float(np.log10(abs(scale)))
    return abs(power - round(power)) < ROUNDING


def _left(logs: Logs, joint: int, k: int) -> Array:
    """Loss of log-likelihood of a joint's currents by each scale of log k, with its own variance for log k.

    The other logs have a common variance: in one sum of squares the part with larger units would dominate.
    """
    held = logs.model.fits.parts[joint]
    if held is None:
        return np.zeros(len(SCALES))
    own = (logs.model.rows[joint].motion == k).astype(np.float64)
    V = held.fit.V
    other, mine = held.fit.without(V * (1.0 - own)), held.fit.without(V * own)
    a, b = other * (1.0 - own), mine * (1.0 - own)  # rows of the other logs: a + b / s
    c, d = other * own, mine * own  # rows of log k: s c + d in its own unit
    others = a @ a + 2.0 * (a @ b) / SCALES + (b @ b) / SCALES**2
    of_k = SCALES**2 * (c @ c) + 2.0 * SCALES * (c @ d) + d @ d
    share = float(own.mean())
    squares = (1.0 - share) * np.log(np.maximum(others, _least(V * (1.0 - own))))
    squares += share * np.log(np.maximum(of_k, _least(V * own)))
    return 0.5 * held.fit.freedom * squares


def _least(V: Array) -> float:
    """Sum of squares of rounding errors."""
    return max(1e-20 * float(V @ V), 1e-300)
