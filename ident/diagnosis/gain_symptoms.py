"""Implausible gains: a sign that contradicts friction, a value far from the others, a large residual.

The default standard deviation accounts for autocorrelated residuals. They are reported if they make it much larger than
that of white residuals (eq. 20): a better model then helps more than a longer motion.
"""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.gain_signs import FRICTION_Z, joint_signs
from ident.estimation.intervals import Rows, classical, max_of_classical_and_jackknife

FAR = 100.0
"""Factor from the median of the other gains beyond which a unit is suspected; joints of one arm differ by up to 30."""
SURE_LOAD_Z = 10.0
"""Number of standard deviations of 1/g from zero beyond which the sign from the load is significant; every identified
gain exceeds it."""
UNEXPLAINED = 0.15
"""Share of a joint's current above which its residual is reported."""
MUCH = 2.0
"""Ratio of standard deviations that is reported; with white residuals the largest of six joints reaches 1.8."""
UNAWARE = "classical"
"""Covariance estimator for white residuals."""


def symptoms(estimate: GainEstimate, causes: Diagnosed) -> Diagnosed:
    """Return diagnoses of gains and residuals; if the logs have faults, only those that refuse gains."""
    autocorrelated = autocorrelation(estimate)
    found = [*gain_diagnoses(estimate), *([] if autocorrelated is None else [autocorrelated])]
    if causes.severity is Severity.WRONG:
        found = [each for each in found if each.severity is Severity.WRONG]
    return Diagnosed(diagnoses=tuple(found))


def gain_diagnoses(estimate: GainEstimate) -> list[Diagnosis]:
    """Return the diagnoses of implausible gains of an estimate."""
    found = {j: each.value for j, each in enumerate(estimate.joints) if isinstance(each, IdentifiedGain)}
    return [*_contradicted(estimate), *negative(found), *far_off(found), *_unexplained(estimate)]


def negative(gains: dict[int, float]) -> Iterator[Diagnosis]:
    """Negative gains, by joint from 0."""
    for j, gain in gains.items():
        if gain < 0.0:
            yield Diagnosis(
                name="negative gain",
                severity=Severity.WEAK,
                sentence=f"joint {j + 1}: the gain is negative; v{j + 1} and q{j + 1} have opposite signs in every log",
                advice=f"correct for a motor mounted in reverse; else negate v{j + 1} or q{j + 1}",
                joints=(j,),
                value=gain,
                unit="N m/unit",
            )


def far_off(gains: dict[int, float]) -> Iterator[Diagnosis]:
    """Gains far from the others, by joint from 0; none for a single gain."""
    for j, gain in gains.items():
        others = [abs(each) for k, each in gains.items() if k != j]
        ratio = abs(gain) / float(np.median(others)) if others else 1.0
        if not 1.0 / FAR < ratio < FAR:
            yield Diagnosis(
                name="gain outlier",
                severity=Severity.WEAK,
                sentence=f"joint {j + 1}: the gain is {ratio:.2g} times the median of the others",
                advice=f"check the unit of v{j + 1}",
                joints=(j,),
                value=ratio,
                unit="times",
            )


def _contradicted(estimate: GainEstimate) -> Iterator[Diagnosis]:
    """Joints whose gain has one sign by the payload and the other by friction."""
    signs = joint_signs(estimate)
    sure = (np.abs(signs.load_z) > SURE_LOAD_Z) & (np.abs(signs.friction_z) > FRICTION_Z)
    for k in np.flatnonzero(sure & (signs.load_z * signs.friction_z < 0.0)):
        j = int(estimate.solution.joints[k])
        if isinstance(estimate.joints[j], IdentifiedGain):
            yield Diagnosis(
                name="sign of the gain",
                severity=Severity.WRONG,
                sentence=f"joint {j + 1}: payload and friction give the gain opposite signs",
                advice=f"check the signs of q{j + 1} and v{j + 1}, the model and the payload's centre of mass",
                joints=(j,),
            )


def _unexplained(estimate: GainEstimate) -> Iterator[Diagnosis]:
    """Joints whose currents the model explains badly."""
    for j in range(len(estimate.joints)):
        share = estimate.residual_share(j)
        if share is not None and share > UNEXPLAINED:
            yield Diagnosis(
                name="residual",
                severity=Severity.WEAK,
                sentence=f"joint {j + 1}: {100.0 * share:.0f} % of the current is not explained by the model",
                advice="check that the model is of this robot, with its couplings, friction and base",
                joints=(j,),
                value=100.0 * share,
                unit="%",
            )


def autocorrelation(estimate: GainEstimate) -> Diagnosis | None:
    """Ratio of the standard deviation of a gain to that for white residuals; None without a gain."""
    solution, options = estimate.solution, estimate.options
    place = {int(j): k for k, j in enumerate(solution.joints)}
    known = [j for j, gain in enumerate(estimate.joints) if isinstance(gain, IdentifiedGain)]
    if not known:
        return None
    plain = np.diag(classical(solution.rows, solution.influence))
    claimed = np.diag(estimate.covariance)
    if options.uncertainty == UNAWARE:
        claimed = np.diag(max_of_classical_and_jackknife(solution.rows, solution.influence))
    ratio = np.sqrt(np.divide(claimed, plain, out=np.ones(len(plain)), where=plain > 0.0))
    worst = max(known, key=lambda j: ratio[place[j]])
    size = float(ratio[place[worst]])
    lag = lag_one(solution.rows, worst)
    accounted = "would be" if options.uncertainty == UNAWARE else "is"
    return Diagnosis(
        name="autocorrelation",
        severity=Severity.WEAK if size > MUCH else Severity.GOOD,
        sentence=f"joint {worst + 1}: residuals are autocorrelated (lag 1: {lag:z.2f}); the standard deviation that "
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
