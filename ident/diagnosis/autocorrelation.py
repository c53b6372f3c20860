"""Autocorrelated residuals: what they cost.

The default standard deviation accounts for them. It is worth a word where they make it much larger than that of white
residuals (eq. 20): a better model would then tell more than a longer motion.
"""

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Severity
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.rows import Rows
from ident.estimation.uncertainty.classical import classical
from ident.estimation.uncertainty.max_of_classical_and_jackknife import max_of_classical_and_jackknife

MUCH = 2.0
"""Ratio of standard deviations from which on it is said; the largest of six reaches 1.8 on residuals that are white."""
UNAWARE = "classical"
"""Uncertainty that takes residuals as white."""


def autocorrelation(estimate: GainEstimate) -> Diagnosis | None:
    """How much larger the standard deviation of a gain is than for white residuals; None where there is no gain."""
    solution, options = estimate.solution, estimate.options
    place = {int(j): k for k, j in enumerate(solution.joints)}
    known = [j for j, gain in enumerate(estimate.joints) if isinstance(gain, IdentifiedGain)]
    if not known:
        return None
    plain = np.diag(classical(solution.rows, solution.influence, options.serial_s))
    claimed = np.diag(estimate.covariance)
    if options.uncertainty == UNAWARE:
        claimed = np.diag(max_of_classical_and_jackknife(solution.rows, solution.influence, options.serial_s))
    ratio = np.sqrt(np.divide(claimed, plain, out=np.ones(len(plain)), where=plain > 0.0))
    worst = max(known, key=lambda j: ratio[place[j]])
    size = float(ratio[place[worst]])
    lag = lag_one(solution.rows, worst)
    accounted = "would be" if options.uncertainty == UNAWARE else "is"
    return Diagnosis(
        name="autocorrelation",
        severity=Severity.WEAK if size > MUCH else Severity.GOOD,
        sentence=f"joint {worst + 1}: residuals are autocorrelated (lag 1: {lag:.2f}); the standard deviation that "
        f"accounts for it {accounted} {size:.2g} times that of white residuals",
        advice="refine the model" if size > MUCH else None,
        joints=(worst,),
        value=size,
        unit="times",
    )


def lag_one(rows: Rows, joint: int) -> float:
    """Correlation of a joint's residual with that of the next row."""
    at = np.flatnonzero(rows.joint == joint)
    follows = (np.diff(rows.motion[at]) == 0) & (np.diff(rows.position[at]) == 1)
    residual = rows.residual[at]
    here, there = residual[:-1][follows], residual[1:][follows]
    size = float(np.linalg.norm(here) * np.linalg.norm(there))
    return float(here @ there) / size if size > 0.0 else 0.0
