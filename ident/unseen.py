"""A motion that was not used in any fit, predicted with gains in use: what the currents of each joint are off by.

The torque that arm and payload take, over the gain, is the current (paper, eq. 7). The arm comes from bare motions with
the same gains, or from a model file. Other gains are held against it on the same motion: time blocks of it say whether
one predicts better than the other, or only by chance. Whether it predicts at all is another question: the fit says how
far off it may be. A factor common to all gains cancels on a bare motion, where arm and gains change alike; with a
weighed payload it does not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import SHARE, SPOILS, Diagnosed, Severity
from ident.diagnosis.plausibility import LARGE_RESIDUAL, check_different
from ident.estimation import cross_validation
from ident.estimation.cross_validation import TIME_BLOCKS, JointPrediction
from ident.estimation.gain_options import GainOptions
from ident.estimation.joint_by_joint.pooled_system import PooledSystem, pooled_system
from ident.estimation.known_gains import KnownGains, check_signs, estimated_gains
from ident.estimation.problem import ObservedMotion, Problem
from ident.identification import Identification
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.payload_identification.gains_outcome import UNKNOWN, ArmInUse, arm_in_use, predicted_torque, rel_errors
from ident.payload_identification.verification import LEVEL
from ident.preparation import DOUBTED, Policy, Prepared, joined, prepare, refusal_of
from ident.recordings.motion import Motion
from ident.support.arrays import Array
from ident.support.errors import Contradiction, GainsError, IdentificationError, PayloadError

BETTER, WORSE, NO_DIFFERENT = "better", "worse", "no different"


@dataclass(frozen=True, slots=True, kw_only=True)
class UnseenJoint:
    """A joint's currents on a motion that was not used in any fit; None where a joint has no gain.

    Attributes:
        joint: The joint, from 0.
        rel_error: Norm of the prediction's error over that of the currents.
        other_rel_error: The same with other gains, None where there are none.
        fitted_rel_error: The same of the residual of the motions that the arm was fitted to, None of a model file.
        largest: `rel_error` beyond which the motion is not predicted.
    """

    joint: int
    rel_error: float | None
    other_rel_error: float | None
    fitted_rel_error: float | None
    largest: float | None

    @property
    def exceeds(self) -> bool:
        """Whether the motion is not predicted."""
        return self.rel_error is not None and self.largest is not None and self.rel_error > self.largest


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """A motion that was not used in any fit, as gains predict it.

    Attributes:
        name: Of its recording.
        loaded: Whether it carries a payload.
        joints: One a joint, in their order.
        rel_error: Root mean square of the relative errors of joints; those that both gains predict, where there are
            others.
        other_rel_error: The same with other gains, None where there are none.
        verdict: Whether the gains predict it `BETTER` than the others, `WORSE` or `NO_DIFFERENT`, None without others.
        found: What is said of the recording.
    """

    name: str
    loaded: bool
    joints: tuple[UnseenJoint, ...]
    rel_error: float
    other_rel_error: float | None
    verdict: str | None
    found: Diagnosed

    @property
    def passed(self) -> bool:
        """Whether every joint's currents are predicted, and what was to be beaten is."""
        return self.verdict in (None, BETTER) and not any(each.exceeds for each in self.joints)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnseenMotion:
    """A motion that was not used in any fit, ready to be predicted.

    Attributes:
        log: With what it carries.
        parts: Its linear systems, one after the other.
        found: What is said of it.
    """

    log: Motion
    parts: tuple[ObservedMotion, ...]
    found: Diagnosed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UsedModel:
    """What predicts currents.

    Attributes:
        gains: Of some joints or all.
        base: Base parameters of the arm, friction among them, shape (b,).
        covariance: Of these from the residuals, shape (b, b); zero where nobody knows it.
        fits: How well the motions that these were fitted to predict each other, by joint from 0; empty of a model file.
    """

    gains: KnownGains
    base: Array
    covariance: Array
    fits: Mapping[int, JointPrediction]


def predict_unseen(identified: Identification, log: Motion, *, other: KnownGains | None = None) -> Unseen:
    """Predict a motion that an identification has not seen, as `predict_with` does, with the gains found."""
    assert identified.prepared is not None, "an identification has what it was found from"
    return predict_with(estimated_gains(identified.estimate), identified.prepared, log, other=other)


def predict_with(gains: KnownGains, prepared: Prepared, log: Motion, *, other: KnownGains | None = None) -> Unseen:
    """Predict a motion with gains in use and the arm that bare motions show with them, and with others likewise.

    Args:
        gains: The gains.
        prepared: The motions that they, or the arm, have seen.
        log: The motion, with its payload if it carries one.
        other: Gains that these are held against, as of a data sheet.

    Raises:
        IdentificationError: If the motion is one of those, is spoilt or cannot be observed; if no motion was bare.
        PayloadError: If mass or centre of its payload is not known.
        GainsError: If no joint has a gain in both, or one has another sign.
    """
    if other is not None:
        check_signs(gains, other)
    problem, observing = prepared.problem, prepared.observing
    unseen = unseen_motion(
        log, prepared.motions, problem.structure, observing=observing, gains=problem.options, policy=prepared.policy
    )
    models = [used_model(arm_in_use(problem, each), problem) for each in (gains, other) if each is not None]
    return predicted(unseen, *models)


def used_model(found: ArmInUse, problem: Problem) -> UsedModel:
    """An arm that was found from the bare motions of a problem with gains in use."""
    return UsedModel(
        gains=found.gains,
        base=found.base(problem.structure),
        covariance=found.covariance(problem.structure, problem.options),
        fits={each.joint: each for each in cross_validation.predicted(found.arm.selected.final.fit.rows)},
    )


def unseen_motion(
    log: Motion,
    seen: Sequence[Motion],
    structure: Structure,
    *,
    observing: ObserveOptions,
    gains: GainOptions,
    policy: Policy = DOUBTED,
) -> UnseenMotion:
    """Check and observe a motion as those that gains were found from.

    Args:
        log: The motion.
        seen: Motions that a fit has seen; the bare ones help to doubt this one.
        structure: Of the arm.
        observing: Filters, with the delay that was undone.
        gains: As identification had them.
        policy: How far the log is trusted.

    Raises:
        PayloadError: If mass or centre of its payload is not known.
        IdentificationError: If it is one of those seen, or something spoils it.
    """
    name = log.recording.name
    if log.payload is not None and log.payload.known not in ("all", "com"):
        raise PayloadError(
            f"{name}: its payload states known = {log.payload.known!r}; to predict torques, state mass and centre of "
            "mass; if only the mass is known, test the gains on it with rx90 verify"
        )
    door = partial(prepare, robot=structure, observing=observing, gains=gains, policy=replace(policy, undelay=False))
    if not policy.repeats:
        check_different([each.recording for each in (*seen, log)])
    bare = [each for each in seen if each.payload is None]
    try:
        own = door([log])
        compared = diagnose(door([*bare, log]).logs()) if policy.doubt else Diagnosed()
    except IdentificationError as error:
        if name in str(error):
            raise
        raise type(error)(f"{name}, the motion to predict: {error}") from error
    of_it = [each for each in compared.diagnoses if not bare or name in each.logs]
    found = joined(Diagnosed(diagnoses=own.diagnoses), more=of_it)
    wrong = [each for each in found.diagnoses if each.severity is Severity.WRONG]
    if wrong:
        mounted = "; if it carries a payload, state it" if log.payload is None else ""
        raise Contradiction(f"{name}, the motion to predict: {refusal_of(wrong)}{mounted}")
    return UnseenMotion(log=log, parts=own.problem.motions, found=found)


def predicted(unseen: UnseenMotion, found: UsedModel, other: UsedModel | None = None) -> Unseen:
    """Predict the currents of a motion, and hold other gains against it.

    Args:
        unseen: The motion.
        found: What predicts it.
        other: What else does, None where nothing is compared.

    Raises:
        GainsError: If no joint has a gain in both.
    """
    system = pooled_system(unseen.parts)
    models = (found,) if other is None else (found, other)
    errors = [_current_error(system, unseen, each) for each in models]
    shares = [
        {j: share for j, share in rel_errors(error, system.V, system.joint).items() if j in model.gains.joints}
        for error, model in zip(errors, models, strict=True)
    ]
    both = sorted(set.intersection(*map(set, shares)))
    if not both:
        raise GainsError("gains: no joint has a gain in both sets, so they cannot be compared")
    largest = _largest(system, unseen, found)
    overall = [float(np.sqrt(np.mean([share[j] ** 2 for j in both]))) for share in shares]
    return Unseen(
        name=unseen.log.recording.name,
        loaded=unseen.log.payload is not None,
        joints=tuple(
            UnseenJoint(
                joint=j,
                rel_error=shares[0].get(j),
                other_rel_error=None if other is None else shares[1].get(j),
                fitted_rel_error=found.fits[j].fitted if j in shares[0] and j in found.fits else None,
                largest=largest.get(j),
            )
            for j in range(unseen.parts[0].observation.structure.arm.n)
        ),
        rel_error=overall[0],
        other_rel_error=None if other is None else overall[1],
        verdict=None if other is None else _verdict(system, errors[0], errors[1], both),
        found=unseen.found,
    )


def _current_error(system: PooledSystem, unseen: UnseenMotion, model: UsedModel) -> Array:
    """Predicted less measured currents [drive units], shape (r,); zero for joints without a gain."""
    payload = unseen.log.payload or UNKNOWN
    per_torque = np.zeros(len(model.gains.names))
    per_torque[model.gains.joints] = 1.0 / model.gains.value
    given = np.isin(system.joint, model.gains.joints)
    return np.where(given, predicted_torque(system, model.base, payload) * per_torque[system.joint] - system.V, 0.0)


def _largest(system: PooledSystem, unseen: UnseenMotion, model: UsedModel) -> dict[int, float]:
    """Relative error of each joint's current beyond which the motion is not predicted, by joint from 0.

    `SPOILS` times what is expected: what the fit is off by in time blocks of its own motions that it has not seen, with
    what deviations of the arm, of the payload and of the gain, which takes the payload's torque alone, make of these
    currents. No more than `LARGE_RESIDUAL`, which stands for a model file as well.
    """
    carried, found = (unseen.log.payload or UNKNOWN).known_part(), dict[int, float]()
    for j, g, std in zip(model.gains.joints.tolist(), model.gains.value, model.gains.std, strict=True):
        at = system.joint == j
        of_arm = np.sum((system.W[at] @ model.covariance) * system.W[at])
        of_payload = np.sum((system.W_L[at] @ np.column_stack((carried.spread, carried.chi * std / g))) ** 2)
        moved = (of_arm + of_payload) / (g**2 * np.sum(system.V[at] ** 2))
        expected = np.hypot(model.fits[j].share, np.sqrt(moved)) if j in model.fits else np.inf
        found[j] = float(np.clip(SPOILS * expected, SHARE, LARGE_RESIDUAL))
    return found


def _verdict(system: PooledSystem, found: Array, other: Array, joints: Sequence[int]) -> str:
    """Student's test of the difference of relative squared errors, one a time block: all joints of a block together."""
    from scipy.special import stdtrit  # slow to import, and seldom asked for

    more = np.zeros(TIME_BLOCKS)  # by which the others are off more
    for j in joints:
        at = system.joint == j
        gained = (other[at] ** 2 - found[at] ** 2) / np.sum(system.V[at] ** 2)
        more += [float(block.sum()) for block in np.array_split(gained, TIME_BLOCKS)]
    error = float(np.std(more, ddof=1)) / np.sqrt(TIME_BLOCKS)
    if abs(more.mean()) <= float(stdtrit(TIME_BLOCKS - 1, 1.0 - 0.5 * LEVEL)) * error:
        return NO_DIFFERENT
    return BETTER if more.mean() > 0.0 else WORSE
