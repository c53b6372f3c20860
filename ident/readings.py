"""What a log may mean instead of what it says: a joint's sign or zero, order, a base, lengths, no weight.

Signs, zeros and orders are other states of the same arm, and lengths do not decide which of its parameters show: its
base parameters stay what they are. Only under another gravity there may be more.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from ident.arm import Arm
from ident.arrays import Array, Indices

TURNS = (0, 90, 180, 270)
"""Zeros that conventions differ by [degrees]."""
STRETCHES = (0.8, 1.25)
"""Factors that lengths are tried with."""
WEIGHTLESS = "v without the weight of links and payload"
"""Words of the reading that the controller took out what gravity asks for."""
SAME_DIRECTION = 1e-6
"""Difference of unit vectors under which gravity points the same way."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reading:
    """One way to read the columns of a log: `q_arm = factor * q[:, q_order] + zero`, `v_arm = v[:, v_order]`.

    Attributes:
        words: What differs from the log as it is, for messages.
        factor: Of each joint's position, 1, -1 or what makes radians of another unit, shape (n,).
        zero: Position of the arm where the log says 0 [rad], shape (n,).
        q_order: Column of the positions of each joint, from 0, shape (n,).
        v_order: Column of the current of each joint, from 0, shape (n,).
        gravity: In the base frame [m/s^2], shape (3,).
        stretch: Factor of the distance of each frame from the one before, shape (n,).
    """

    words: str
    factor: Array
    zero: Array
    q_order: Indices
    v_order: Indices
    gravity: Array
    stretch: Array


def readings(arm: Arm) -> Iterator[tuple[Reading, ...]]:
    """The log as it is, and every reading of it with one mistake, simpler ones first.

    Yields:
        Readings of the same states, which differ in the order of the currents only; the very first is the log as it is.
    """
    given = as_it_is(arm)
    order = given.q_order
    pairs = list(combinations(range(arm.n), 2))
    yield (
        given,
        *(
            replace(given, words=f"columns v{i + 1} and v{j + 1} exchanged", v_order=_exchanged(order, i, j))
            for i, j in pairs
        ),
    )
    yield from other_zeros(arm, given)
    for i, j in pairs:
        other = replace(given, words=f"columns q{i + 1} and q{j + 1} exchanged", q_order=_exchanged(order, i, j))
        yield other, replace(other, words=f"joints {i + 1} and {j + 1} exchanged", v_order=other.q_order)
    yield from _other_bases(arm, given)
    yield from _other_lengths(arm, given)
    if arm.gravity.any():
        yield (replace(given, words=WEIGHTLESS, gravity=np.zeros(3)),)


def as_it_is(arm: Arm) -> Reading:
    """The log as it is."""
    order = np.arange(arm.n)
    return Reading(
        words="the log as it is", factor=np.ones(arm.n), zero=np.zeros(arm.n), q_order=order, v_order=order,
        gravity=arm.gravity, stretch=np.ones(arm.n),
    )  # fmt: skip


def _exchanged(order: Indices, i: int, j: int) -> Indices:
    changed = order.copy()
    changed[[i, j]] = order[[j, i]]
    return changed


def other_zeros(arm: Arm, given: Reading) -> Iterator[tuple[Reading]]:
    """One joint's positions negated, turned by quarters, or both; a prismatic joint has nothing to turn."""
    for j in range(arm.n):
        for turn, sign in product(TURNS if arm.revolute[j] else (0,), (1, -1)):
            if turn or sign < 0:
                own = np.arange(arm.n) == j
                words = f"q{j + 1}" + (" negated" if sign < 0 else "") + (f" plus {turn} degrees" if turn else "")
                yield (
                    replace(
                        given, words=words, factor=np.where(own, sign, 1.0), zero=np.where(own, np.deg2rad(turn), 0.0)
                    ),
                )


def _other_bases(arm: Arm, given: Reading) -> Iterator[tuple[Reading]]:
    """Gravity along the axes of the base frame and halfway between them."""
    size = float(np.linalg.norm(arm.gravity))
    for corner in product((0.0, 1.0, -1.0), repeat=3):
        length = float(np.linalg.norm(corner))
        if length and size:
            gravity = np.array(corner) * size / length
            if np.abs(gravity - arm.gravity).max() > SAME_DIRECTION * size:
                words = f"gravity along ({', '.join(f'{x:g}' for x in corner)}) of the base"
                yield (replace(given, words=words, gravity=gravity),)


def _other_lengths(arm: Arm, given: Reading) -> Iterator[tuple[Reading]]:
    """All lengths, or one of them, a fifth shorter or a quarter longer; what precedes the first joint shows nowhere."""
    long = np.flatnonzero(arm.translation.any(axis=1))
    for factor in STRETCHES:
        yield (replace(given, words=f"every length times {factor:g}", stretch=np.full(arm.n, factor)),)
        for j in long[long > 0]:
            stretch = np.where(np.arange(arm.n) == j, factor, 1.0)
            yield (replace(given, words=f"the length from joint {j} to {j + 1} times {factor:g}", stretch=stretch),)
