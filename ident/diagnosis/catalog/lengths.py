"""Lengths that differ from the model's: all of them, or one between two joints."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ident.diagnosis.alternative import Alternative, Direction, in_rows
from ident.diagnosis.fitted_currents import STEP, Reference
from ident.diagnosis.logs import Logs
from ident.support.arrays import Array

FACTORS = (0.8, 1.25)
"""Tested factors; others are found by first-order steps."""
LARGEST = 0.2
"""Largest relative change for which the first order is valid."""


def alternatives(logs: Logs) -> Iterator[Alternative]:
    """Every length, or one, a fifth shorter or a quarter longer."""
    for factor in FACTORS:
        for which in _which(logs):
            yield lengthened(logs, which, factor)


def directions(reference: Reference, logs: Logs) -> Iterator[Direction]:
    """Every length, or one, slightly longer."""
    arm = logs.structure.arm
    for which in _which(logs):
        longer = replace(arm, translation=_length_factors(arm.n, which, 1.0 + STEP)[:, None] * arm.translation)
        parts = [motion.rows(motion.changed(longer)[..., None]) for motion in reference.motions]
        yield Direction(
            family="lengths", joints=() if which is None else (which,), logs=logs.every,
            columns=in_rows(parts, logs.every),
            alternative=lambda value, which=which: lengthened(logs, which, 1.0 + float(value[0])),
            unit="%", scale=100.0, largest=LARGEST,
        )  # fmt: skip


def lengthened(logs: Logs, which: int | None, factor: float) -> Alternative:
    """Return every length, or that before a joint, from 0, times a factor."""
    n = logs.structure.arm.n
    what = "all lengths are" if which is None else f"the length from joint {which} to {which + 1} is"
    return Alternative(
        family="lengths",
        words=f"{what} {factor:.3g} times {'those' if which is None else 'that'} of the model",
        joints=() if which is None else (which,),
        logs=logs.every,
        hypothesis=replace(logs.given, length_factors=_length_factors(n, which, factor)),
        advice="use the model of this arm; check units and the variant of the arm",
        value=100.0 * (factor - 1.0),
        unit="%",
        refined=lambda more: lengthened(logs, which, factor * float(np.exp(more[0]))),
    )


def _which(logs: Logs) -> list[int | None]:
    """All, and each that is not zero, without that before the first joint, which has no effect."""
    long = np.flatnonzero(logs.structure.arm.translation.any(axis=1)).tolist()
    return [None, *(j for j in long if j > 0)] if long else []


def _length_factors(n: int, which: int | None, factor: float) -> Array:
    return np.full(n, factor) if which is None else np.where(np.arange(n) == which, factor, 1.0)
