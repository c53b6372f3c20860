"""How late the currents of one log are, beside any motion of the arm.

Currents are shifted against positions in steps, and what any arm of these kinematics leaves of them is compared: the
logarithm of the likelihood, `-sum_j f_j ln s_j` over the joints, has its peak at the delay, and its curvature there is
one over the variance. A delay so long that friction steps leave the instants beside reversals, which the first order of
`ident.delay` cannot bear, is found as well. What is looked for is a delay beyond the one that is stated.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.arrays import Array
from ident.checks.remark import Grade, Remark
from ident.evidence import NOTHING
from ident.explanation import shares_left
from ident.full_rate import FullRate
from ident.observation import Observation, ObserveOptions
from ident.recording import Recording, resampled
from ident.signals import delayed

LONGEST, STEP = 0.06, 0.004
"""Longest delay that is looked for, either way, and steps to it [s]."""
BENT = 0.003
"""Standard deviation of what friction beside reversals makes of a delay [s]; clean logs read up to 6.5 ms."""
WEAK, WRONG = 2.0, 3.0
"""Deviations of a delay from none."""
SURE = 12.0
"""Logarithm of the likelihood ratio to no delay that it takes besides."""


@dataclass(frozen=True, slots=True)
class Lateness:
    """How late currents are logged, beyond the delay that is stated of them.

    Attributes:
        value: Delay [s]; negative where they are early.
        std: Its standard deviation [s], what friction bends included; None where the search ends at its limit.
        evidence: Logarithm of the likelihood ratio to no such delay.
    """

    value: float
    std: float | None
    evidence: float


def lateness(recording: Recording, observed: Observation, options: ObserveOptions) -> Lateness | None:
    """How late the currents of a log are, of all joints together; None where too few instants tell.

    Args:
        recording: One motion.
        observed: The linear system of it.
        options: By which it was observed; a delay that they state is taken out first.
    """
    even, behind = resampled(recording), observed.full_rate
    assert behind is not None, "it is of a recording"
    step = max(1, round(STEP / even.period))
    most = min(round(LONGEST / even.period), behind.edge) // step
    if most < 1:
        return None
    shifts = step * np.arange(-most, most + 1)
    v = delayed(even.v, options.current_delay / even.period)
    shifted = [behind.sampled(np.roll(v, -rows, axis=0)) for rows in shifts.tolist()]  # the ends are left out
    likelihood = _likelihood(observed, behind, shifted)
    if likelihood is None:
        return None
    k = int(likelihood.argmax())
    if k in (0, 2 * most):
        return Lateness(float(shifts[k] * even.period), None, float(likelihood[k] - likelihood[most]))
    before, peak, after = likelihood[k - 1 : k + 2].tolist()
    bend, spacing = 2.0 * peak - before - after, step * even.period
    value = shifts[k] * even.period + 0.5 * spacing * (after - before) / bend
    gained = peak + 0.125 * (after - before) ** 2 / bend - float(likelihood[most])
    return Lateness(float(value), float(np.hypot(spacing / np.sqrt(bend), BENT)), gained)


def _likelihood(observed: Observation, behind: FullRate, shifted: Sequence[Array]) -> Array | None:
    """Of the currents of all joints, each alone, under each shift; None where a joint has too few rows."""
    total = np.zeros(len(shifted))
    for joint, own in enumerate(observed.joints):
        W = own.W[:, np.isin(own.columns, observed.structure.joint_independent[joint])]
        freedom = len(W) - W.shape[1]
        if freedom < 1:
            return None
        V = np.column_stack([behind.decimated(v[:, joint], joint)[own.position] for v in shifted])
        left = shares_left(W, V) * np.linalg.norm(V, axis=0)  # rms of what is shifted in must not count
        total -= freedom * np.log(np.maximum(left, NOTHING * np.linalg.norm(V, axis=0)))
    return total


def delay_remark(recording: Recording, observed: Observation, options: ObserveOptions) -> Remark:
    """What the delay of a log is beyond the one stated, with its deviation."""
    found = lateness(recording, observed, options)
    if found is None:
        return Remark(topic="delay of v", log=recording.name, seen="too few rows show it", grade=Grade.WEAK)
    spread = "" if found.std is None else f", 2 sigma {2e3 * found.std:.2g}"
    seen = f"{1e3 * found.value:.2g} ms{spread}"
    deviations = abs(found.value) / (found.std or BENT)
    if found.evidence < SURE or deviations < WEAK:
        return Remark(topic="delay of v", log=recording.name, seen=seen)
    return Remark(
        topic="delay of v",
        log=recording.name,
        seen=f"{seen} ({'later' if found.value > 0 else 'earlier'} than the positions)",
        grade=Grade.WRONG if deviations > WRONG else Grade.WEAK,
        advice="shift v against q, or log both with one clock",
    )
