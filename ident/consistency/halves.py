"""Gains of the first half of every motion against those of the second: does a gain stay the same?

What warms up, slips or comes loose during a motion changes the gains; a deviation from all rows does not say so.
"""

import numpy as np

from ident.consistency.difference import DIFFERENT, difference_std, judged_difference
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.part import part_of

NAME = "halves"


def check_halves(evidence: Evidence) -> Finding | None:
    """Whether both halves of the motions give the same gains; None where they do not show them."""
    fit, inverse = evidence.fit, evidence.estimate.solution.inverse
    if fit is None or not evidence.identified:
        return None
    second = np.arange(len(fit.gram)) % 2 == 1
    places = list(evidence.identified.values())
    halves = [part_of(fit, kept, places) for kept in (~second, second)]
    residual = halves[0].residual + halves[1].residual
    change, z = dict[int, float](), dict[int, float]()
    for joint, k in evidence.identified.items():
        if all(k in half.changes for half in halves):
            first, last = (half.changes[k] for half in halves)
            apart = last.value - first.value
            std = difference_std(evidence, last.influence - first.influence, residual)
            if std > DIFFERENT * evidence.std(k):
                change[joint] = -100.0 * apart / float(inverse[k])  # of g = 1/x
                z[joint] = abs(apart) / std
    words = ("the second half of the motions gives", "than the first")
    reason = "did the drive warm up, or the payload come loose? The deviations do not contain it"
    return judged_difference(NAME, z, change, words, reason, claimed={joint: evidence.rel_std(joint) for joint in z})
