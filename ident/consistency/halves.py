"""Gains of the first half of every motion against those of the second: does a gain stay the same?

What warms up, slips or comes loose during a motion changes the gains; a deviation from all rows does not say so.
"""

import numpy as np

from ident.consistency.difference import DIFFERENT, FALSE_ALARM, difference_std, most_deviations
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.part import part_changes

NAME = "halves"


def check_halves(evidence: Evidence) -> Finding | None:
    """Whether both halves of the motions give the same gains; None where they do not show them."""
    fit, inverse = evidence.fit, evidence.estimate.solution.inverse
    if fit is None or not evidence.identified:
        return None
    second = np.arange(len(fit.gram)) % 2 == 1
    places = list(evidence.identified.values())
    halves = [part_changes(fit, kept, places) for kept in (~second, second)]
    apart, z = dict[int, float](), dict[int, float]()
    for joint, k in evidence.identified.items():
        if all(k in half for half in halves):
            first, last = (half[k] for half in halves)
            apart[joint] = last.value - first.value
            std = difference_std(evidence, last.influence - first.influence, first.residual + last.residual)
            if std > DIFFERENT * evidence.std(k):
                z[joint] = abs(apart[joint]) / std
    if not z:
        return None
    worst, limit = max(z, key=lambda joint: z[joint]), most_deviations(len(z))
    change = -100.0 * apart[worst] / float(inverse[evidence.identified[worst]])  # of g = 1/x
    return Finding(
        check=NAME,
        joint=worst,
        statistic=z[worst],
        threshold=limit,
        measure="standard deviations",
        sentence=None
        if z[worst] <= limit
        else f"joint {worst + 1}: the second half of the motions gives a gain {abs(change):.2g} % "
        f"{'larger' if change > 0.0 else 'smaller'} than the first, by {z[worst]:.2g} standard deviations of that "
        f"difference ({limit:.2g} on any of {len(z)} joints are an accident once in {1.0 / FALSE_ALARM:.0f} times); "
        "did the drive warm up, or the payload come loose? The deviations do not contain it",
    )
