"""Which way gravity points in the base frame by the currents: how a base is tilted that the model has upright.

`ident.readings` has bases on the wall and the ceiling. A base between them is none of these, and whatever single change
comes nearest to it would be named instead.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import linalg, optimize

from ident.arm import Arm
from ident.arrays import Array
from ident.evidence import NOTHING, convincing, evidence_of, gain_over
from ident.explanation import Explanation, Unknowns, explanations
from ident.instants import Instants, thinned
from ident.readings import Reading, as_it_is

LEAST = 3.0
"""Tilt [degrees] that is believed where nothing else speaks against the model's base.

Two sound logs of a UR10e show 0.1 to 1.2 degrees, simulated ones 0 to 1.1; 4 to 6 where the model stands off by 5. One
log alone, which a cable's weight bends, shows 9 degrees that are not there: it is not asked.
"""
SAME = 2.0
"""Angle [degrees] within which gravity is the one that was begun with."""
FEW = 100
"""Instants of each motion that gravity is searched on where nothing is suspected."""
FIRST = 0.1
"""Angle of the first steps [rad]."""
CLOSE = 2e-3
"""Angle [rad] to which gravity is found."""


def tilt(
    arm: Arm, aslant: Unknowns, seen: Sequence[Instants], better: Sequence[Reading], *, suspected: bool
) -> Explanation | None:
    """What the base explains that stands as the currents say; None where that is as the model or a reading has it.

    Args:
        arm: The arm.
        aslant: Unknowns of it under any gravity.
        seen: Instants of the logs.
        better: Readings that explain the currents better than the log as it is, the best one first.
        suspected: Whether one of them is worth a word, so that a smaller tilt may be why.
    """
    if len(seen) < 2 or not arm.gravity.any():
        return None
    turned = [each.gravity for each in better if each.gravity is not arm.gravity and each.gravity.any()]
    start = turned[0] if turned else arm.gravity
    at = seen if suspected else [thinned(each, FEW) for each in seen]
    reading = under_best_gravity(arm, aslant, at, start)
    if turned and degrees_between(start, reading.gravity) < SAME:
        return None
    if degrees_between(arm.gravity, reading.gravity) < LEAST and not suspected:
        return None
    return explanations(arm, aslant, seen, (reading,))[0]


def shown_by_several(given: Explanation, lean: Explanation) -> bool:
    """Whether a tilt is surely better also without the joint that shows it most.

    The base is one for all joints. What a single joint gains is what else gravity's free direction explains of it:
    backlash and a coarse encoder on the axis of a first joint that stands aslant reached 0.5, all others 0.02 together.

    Args:
        given: What the log as it is explains.
        lean: What the base explains that is tilted.
    """
    gain = gain_over(given.left, lean.left).copy()
    gain[np.argmax(gain)] = 0.0
    return convincing(gain, evidence_of(gain, given.freedom, lean.freedom), lean.reading)


def under_best_gravity(arm: Arm, aslant: Unknowns, seen: Sequence[Instants], start: Array) -> Reading:
    """The reading of all logs with the gravity that explains the currents best, from a start on.

    Args:
        arm: The arm; weightless ones have no gravity to turn.
        aslant: Unknowns of it under any gravity.
        seen: Instants of the logs.
        start: Gravity in the base frame to begin with [m/s^2], shape (3,).
    """
    size = float(np.linalg.norm(arm.gravity))
    ahead = start / np.linalg.norm(start)
    aside = linalg.null_space(ahead[None, :])  # (3, 2)

    def gravity(angles: Array) -> Array:
        direction = ahead + aside @ angles
        return size * direction / np.linalg.norm(direction)

    def left(angles: Array) -> float:
        found = explanations(arm, aslant, seen, (_under(arm, gravity(angles)),))[0].left
        return float(np.log(np.maximum(found, NOTHING)).sum())

    simplex = FIRST * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    found = optimize.minimize(
        left, np.zeros(2), method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": CLOSE, "fatol": 1e-3, "maxfev": 60},
    )  # fmt: skip
    return _under(arm, gravity(found.x))


def degrees_between(a: Array, b: Array) -> float:
    """Angle between two vectors of shape (3,) [degrees]."""
    return float(np.rad2deg(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def _under(arm: Arm, gravity: Array) -> Reading:
    toward = ", ".join(f"{x:.2g}" for x in gravity / np.linalg.norm(gravity))
    turn = degrees_between(arm.gravity, gravity)
    words = f"the base tilted by {turn:.2g} degrees, gravity along ({toward}) of it"
    return replace(as_it_is(arm), words=words, gravity=gravity)
