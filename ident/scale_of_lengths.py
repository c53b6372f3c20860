"""Lengths of a model that are off by an amount, by the currents; and clocks, which lengths cannot be told from.

`ident.readings` has lengths that are off by a fifth or more. Here the factor is searched, of all lengths at once and,
if that explains more, of each. Where every joint turns, all lengths times k are the same as a clock that counts
c = k^-1/2 times: inertias are free, so that only the lengths beside gravity know how fast a second is.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy import optimize

from ident.arm import Arm
from ident.arrays import Array
from ident.evidence import BETTER, EVIDENCE, NOTHING, evidence_of, gain_over
from ident.explanation import Explanation, Unknowns, explanations
from ident.instants import Instants, thinned
from ident.readings import Reading, as_it_is

FEW = 120
"""Instants of each motion that factors are searched on."""
GRID = np.geomspace(0.2, 5.0, 9)
"""Factors that are tried; the best is refined."""
CLOSE = 3e-3
"""Relative distance to which a factor is found."""
LASTS = 0.2
"""Share of a factor's gain left on calm positions: 0.25 to 1.7 of wrong lengths, 0 to 0.06 of noise and backlash.

Encoders of 3 mrad keep 0.7, which `ident.borne_out` has to tell.
"""
LOOKS_BETTER = 0.02
"""Sum of logarithms by which a factor must be better on few instants to be looked at again."""


def scaled_lengths(
    arm: Arm, unknowns: Unknowns, seen: Sequence[Instants], calm: Sequence[Instants]
) -> list[Explanation]:
    """What the arm explains with all lengths, or one of them, times the best factor; none that is not surely better.

    A coarse encoder, or backlash, on the right arm makes all lengths 0.3 to 0.9 times as long, on every joint alike,
    with gains up to 1.8: noise of accelerations counts less then. On positions filtered lower these gains are gone,
    those of wrong lengths are not.

    Args:
        arm: The arm.
        unknowns: Of it.
        seen: Instants of the logs.
        calm: The same of positions filtered lower (`ident.instants.calmer`).
    """
    few = [thinned(each, FEW) for each in seen]
    given = explanations(arm, unknowns, few, (as_it_is(arm),))[0]
    long = np.flatnonzero(arm.translation.any(axis=1))
    long = long[long > 0]  # what precedes the first joint shows nowhere

    def left(reading: Reading) -> Array:
        return explanations(arm, unknowns, few, (reading,))[0].left

    def best(which: Array, words: Callable[[float], str]) -> Reading:
        return _best(arm, which, words, lambda reading: float(np.log(np.maximum(left(reading), NOTHING)).sum()))

    if not len(long):
        return []
    every = best(np.ones(arm.n), lambda k: _every(arm, k))
    if gain_over(given.left, left(every)).sum() < LOOKS_BETTER:
        return []
    single = (
        best(np.arange(arm.n) == j, lambda k, j=j: f"the length from joint {j} to {j + 1} times {k:.3g}") for j in long
    )
    readings = (as_it_is(arm), every, *single)
    own, *found = (explanations(arm, unknowns, seen, (each,))[0] for each in readings)
    own_calm, *found_calm = (explanations(arm, unknowns, calm, (each,))[0] for each in readings)
    pairs = zip(found, found_calm, strict=True)
    return [each for each, calmly in pairs if _sure(own, each) and _lasts((own, each), (own_calm, calmly))]


def _sure(own: Explanation, other: Explanation) -> bool:
    """Whether a factor that was searched is surely better: it takes what any reading does, not the less of lengths."""
    gain = gain_over(own.left, other.left)
    return bool(gain.sum() > BETTER and evidence_of(gain, own.freedom, other.freedom) > EVIDENCE)


def _lasts(seen: tuple[Explanation, Explanation], calm: tuple[Explanation, Explanation]) -> bool:
    """Whether what a factor gains is there on calm positions as well; of the log as it is, and under the factor."""
    gain, calm_gain = (float(gain_over(own.left, other.left).sum()) for own, other in (seen, calm))
    return calm_gain > LASTS * gain


def searched(reading: Reading, scaled: Sequence[Explanation]) -> bool:
    """Whether a reading is of other lengths that one whose factor was searched is of as well."""
    return tuple(reading.stretch != 1.0) in {tuple(each.reading.stretch != 1.0) for each in scaled}


def _best(arm: Arm, which: Array, words: Callable[[float], str], left: Callable[[Reading], float]) -> Reading:
    """The factor of some lengths that leaves least."""

    def reading(log: float) -> Reading:
        k = float(np.exp(log))
        return replace(as_it_is(arm), words=words(k), stretch=np.where(which > 0, k, 1.0))

    logs = np.log(GRID)
    near = float(logs[int(np.argmin([left(reading(float(each))) for each in logs]))])
    step = float(logs[1] - logs[0])
    found = optimize.minimize_scalar(
        lambda log: left(reading(log)), bounds=(near - step, near + step), method="bounded", options={"xatol": CLOSE}
    )
    return reading(float(found.x))


def _every(arm: Arm, k: float) -> str:
    clock = f"t times {k**-0.5:.3g}" if (arm.revolute > 0).all() else "t that counts otherwise"
    return f"every length times {k:.3g}, or {clock}"
