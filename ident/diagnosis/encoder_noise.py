"""Bias of gains by encoder noise, by comparison with an estimate that it does not bias (Hausman 1978).

Noise of the positions enters the regressor and biases least squares. Instruments avoid this bias (`iv`), with a simpler
model of friction: they are compared with the estimate only if noise is a noticeable share of an acceleration.
"""

from collections.abc import Iterator

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Effect, Severity
from ident.diagnosis.estimate_model import FINEST, claimed, consequence, severity_of
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.estimators.iv import InstrumentOptions, instrumental_gains
from ident.estimation.problem import Problem
from ident.numerics.signals import edge_samples, smooth_motion
from ident.observation.full_rate import FullRate
from ident.support.errors import IdentificationError

WORDS = "the positions are too noisy or too coarse for these filters"
ADVICE = "lower --cutoff-hz to what the motion needs, use --method iv, or log at a higher rate"


def encoder_noise(problem: Problem, estimate: GainEstimate) -> Iterator[Diagnosis]:
    """Return the diagnosis of gains that encoder noise biases; none if no gain would be refused."""
    behind = [motion.observation.full_rate for motion in problem.motions]
    if max((share_of_acceleration(each) for each in behind if each is not None), default=0.0) < FINEST:
        return
    try:
        effects = tuple(_effects(estimate, instrumental_gains(problem, InstrumentOptions())))
    except IdentificationError:
        return
    if severity_of(effects) is Severity.WRONG:  # less may be chance, or the other model
        yield Diagnosis(
            name="encoder noise",
            severity=Severity.WRONG,
            sentence=f"{WORDS}{consequence(effects)}",
            cause=WORDS,
            advice=ADVICE,
            effects=effects,
        )


def share_of_acceleration(behind: FullRate) -> float:
    """Largest share of a joint's mean square acceleration that is due to white noise of the recorded positions."""
    edge = edge_samples(behind.recording.period, behind.cutoff_hz)
    impulse = np.zeros((4 * edge + 1, 1))
    impulse[2 * edge] = 1.0
    _, _, answer = smooth_motion(impulse, behind.recording.period, behind.cutoff_hz)
    noise = behind.noise / (2.0 * behind.recording.period) * np.sum(answer**2)
    power = np.mean(behind.ddq**2, axis=0)
    return float(np.max(np.divide(noise, power, out=np.zeros_like(power), where=power > 0.0)))


def _effects(estimate: GainEstimate, unbiased: GainEstimate) -> Iterator[Effect]:
    """Difference of each gain from the unbiased one, with the standard deviation of both."""
    for j, (mine, other) in enumerate(zip(estimate.joints, unbiased.joints, strict=True)):
        if isinstance(mine, IdentifiedGain) and isinstance(other, IdentifiedGain):
            moved = mine.value / other.value - 1.0
            spread = float(np.hypot(claimed(mine), claimed(other)))
            yield Effect(joint=j, percent=100.0 * moved, deviations=moved / spread)
