"""Residuals that hang together in time: what do they cost?

The default deviation allows for them. It is worth a word where they make it much larger than that of unrelated
residuals (eq. 20): a better model would give more than a longer motion, and a deviation without them is too small.
"""

import numpy as np

from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding, joints_in_words
from ident.rows import Rows

NAME = "whiteness"
MUCH = 2.0
"""Ratio of deviations from which on it is said; stretches of time give one that is uncertain by an eighth,
and the largest of six reaches 1.8 on residuals that are white."""
UNAWARE = "classical"
"""Uncertainty that takes residuals as unrelated."""


def check_whiteness(evidence: Evidence) -> Finding | None:
    """Whether errors that last make a deviation much larger than equation 20 does."""
    growth = {joint: float(evidence.growth[k]) for joint, k in evidence.identified.items()}
    if not growth:
        return None
    rows, worst = evidence.estimate.solution.rows, max(growth, key=lambda joint: growth[joint])
    many = [joint for joint, ratio in growth.items() if ratio > MUCH]
    related = ", ".join(f"{neighbours(rows, joint):.2f}" for joint in many)
    ratios = ", ".join(f"{growth[joint]:.2g}" for joint in many)
    allowed = (
        "would be larger than the one claimed, which takes them as unrelated,"
        if evidence.estimate.options.uncertainty == UNAWARE
        else "allows for them, and is larger than that of unrelated ones"
    )
    return Finding(
        check=NAME,
        joint=worst,
        statistic=growth[worst],
        threshold=MUCH,
        measure="ratio of deviations",
        sentence=f"{joints_in_words(many)}: residuals hang together in time (from row to row by {related}); a "
        f"deviation that minds it {allowed} by a factor of {ratios}: a better model would tell more than longer motions"
        if many
        else None,
    )


def neighbours(rows: Rows, joint: int) -> float:
    """Correlation of a joint's residual with that of the next row."""
    at = np.flatnonzero(rows.joint == joint)
    follows = (np.diff(rows.motion[at]) == 0) & (np.diff(rows.position[at]) == 1)
    residual = rows.residual[at]
    here, there = residual[:-1][follows], residual[1:][follows]
    size = float(np.linalg.norm(here) * np.linalg.norm(there))
    return float(here @ there) / size if size > 0.0 else 0.0
