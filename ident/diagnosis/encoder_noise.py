"""Bias of gains by encoder noise, by comparison with an estimate that it does not bias (Hausman 1978).

Noise of the positions enters the regressor and biases least squares. Instruments avoid this bias (`iv`), with a simpler
model of friction: they are compared with the estimate only where noise may matter, as its share of the payload's torque
exceeds the gain's standard deviation; by about that share a gain is biased that the payload alone determines.
"""

from collections.abc import Collection, Iterator

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Effect, Severity
from ident.diagnosis.estimate_model import claimed, consequence, severity_of
from ident.diagnosis.motion_quality import acceleration_of_unit_noise
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.estimators.iv import InstrumentOptions, instrumental_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.estimation.sweep import inertia_matrices
from ident.support.arrays import Array
from ident.support.errors import IdentificationError

WORDS = "the positions are too noisy or too coarse for these filters"
ADVICE = "lower --cutoff-hz to what the motion needs, use --method iv, or log at a higher rate"


def encoder_noise(problem: Problem, estimate: GainEstimate) -> Iterator[Diagnosis]:
    """Return the diagnosis of gains that encoder noise biases; none if no gain would be refused."""
    share = np.max([np.zeros(problem.structure.arm.n), *map(noise_in_load, problem.motions)], axis=0)
    given = [(j, gain) for j, gain in enumerate(estimate.joints) if isinstance(gain, IdentifiedGain)]
    near = [j for j, gain in given if share[j] > claimed(gain)]
    if not near:
        return
    try:
        effects = tuple(_effects(estimate, instrumental_gains(problem, InstrumentOptions()), near))
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


def noise_in_load(motion: ObservedMotion) -> Array:
    """Share of the variance of the payload's torque on each joint that noise of the accelerations adds, shape (n,)."""
    observation = motion.observation
    structure, behind = observation.structure, observation.full_rate
    if motion.payload is None or behind is None:
        return np.zeros(structure.arm.n)
    part = motion.payload.known_part()
    known = part.chi * part.mask
    chi = np.zeros(structure.base.regrouping.shape[1])
    chi[structure.payload_columns] = known
    squared = np.mean(inertia_matrices(structure.arm, chi, behind.states.q) ** 2, axis=0)
    log = behind.recording
    unit = acceleration_of_unit_noise(len(log.t), log.period, behind.cutoff_hz)
    noise = squared @ (behind.noise / (2.0 * log.period) * unit**2)
    load = np.array([np.var(each.W_L @ known) for each in observation.joints])
    return np.divide(noise, load, out=np.zeros_like(noise), where=load > 0.0)


def _effects(estimate: GainEstimate, unbiased: GainEstimate, joints: Collection[int]) -> Iterator[Effect]:
    """Difference of gains from the unbiased ones, with the standard deviation of both."""
    for j in joints:
        mine, other = estimate.joints[j], unbiased.joints[j]
        if isinstance(mine, IdentifiedGain) and isinstance(other, IdentifiedGain):
            moved = mine.value / other.value - 1.0
            spread = float(np.hypot(claimed(mine), claimed(other)))
            yield Effect(joint=j, percent=100.0 * moved, deviations=moved / spread)
