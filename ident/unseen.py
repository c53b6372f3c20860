"""A motion that no fit has seen, predicted with gains in use: what the currents of each joint are off by.

The torque that arm and payload take, over the gain, is the current (paper, eq. 7). The arm comes from bare motions with
the same gains, or from a model file. Other gains are held against it on the same motion: time blocks of it say whether
one predicts better than the other, or only by chance. A factor common to all gains cancels on a bare motion, where arm
and gains change alike; with a weighed payload it does not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed, Severity
from ident.diagnosis.plausibility import check_different
from ident.estimation.cross_validation import TIME_BLOCKS
from ident.estimation.gain_options import GainOptions
from ident.estimation.joint_by_joint.pooled_system import PooledSystem, pooled_system
from ident.estimation.known_gains import KnownGains, estimated_gains
from ident.estimation.problem import ObservedMotion
from ident.identification import Identification
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.payload_identification.gains_outcome import UNKNOWN, ArmInUse, arm_in_use, predicted_torque, rel_errors
from ident.payload_identification.verification import LEVEL
from ident.preparation import DOUBTED, Policy, Prepared, joined, prepare, refusal_of
from ident.recordings.motion import Motion
from ident.support.arrays import Array
from ident.support.errors import Contradiction, GainsError, PayloadError

BETTER, WORSE, NO_DIFFERENT = "better", "worse", "no different"


@dataclass(frozen=True, slots=True, kw_only=True)
class UnseenJoint:
    """A joint's currents on a motion that no fit has seen; None where a joint has no gain.

    Attributes:
        joint: The joint, from 0.
        rel_error: Norm of the prediction's error over that of the currents.
        other_rel_error: The same with other gains, None where there are none.
        fitted_rel_error: The same of the residual of the motions that the arm was fitted to, None of a model file.
    """

    joint: int
    rel_error: float | None
    other_rel_error: float | None
    fitted_rel_error: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """A motion that no fit has seen, as gains predict it.

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
        """Whether there was nothing to beat, or it was."""
        return self.verdict in (None, BETTER)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnseenMotion:
    """A motion that no fit has seen, ready to be predicted.

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
        fitted: Relative residual of the motions that these were fitted to, by joint from 0; empty of a model file.
    """

    gains: KnownGains
    base: Array
    fitted: Mapping[int, float]


def predict_unseen(identified: Identification, log: Motion, *, other: KnownGains | None = None) -> Unseen:
    """Predict a motion that an identification has not seen with the gains found, and with others.

    Args:
        identified: The gains, with the motions that they were found from.
        log: The motion, with its payload if it carries one.
        other: Gains that these are held against, as of a data sheet.

    Raises:
        IdentificationError: As `predict_with`.
    """
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
        IdentificationError: If the motion is one of those, is spoilt or cannot be observed; if nothing of a joint's
            current is predicted; if no motion was bare.
        PayloadError: If mass or centre of its payload is not known.
        GainsError: If no joint has a gain in both.
    """
    problem, observing = prepared.problem, prepared.observing
    unseen = unseen_motion(
        log, prepared.motions, problem.structure, observing=observing, gains=problem.options, policy=prepared.policy
    )
    models = [used_model(arm_in_use(problem, each), problem.structure) for each in (gains, other) if each is not None]
    return explained(predicted(unseen, *models))


def explained(found: Unseen) -> Unseen:
    """A prediction, if it is nearer to each joint's currents than zero is: else the log is not what it is taken for.

    Raises:
        Contradiction: If not.
    """
    without = [str(each.joint + 1) for each in found.joints if each.rel_error is not None and each.rel_error >= 1.0]
    if without:
        raise Contradiction(
            f"{found.name}, the motion to predict: nothing of the current of joint {', '.join(without)} is predicted; "
            "check its unit and sign, its payload, and that it is of this robot"
        )
    return found


def used_model(found: ArmInUse, structure: Structure) -> UsedModel:
    """An arm that was found from bare motions with gains in use."""
    rows = found.arm.selected.final.fit.rows
    fitted = {j: rows.residual_share(j) for j in found.gains.joints.tolist() if j in rows.unknowns}
    return UsedModel(gains=found.gains, base=found.base(structure), fitted=fitted)


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
            f"{name}: its payload is known = {log.payload.known!r}; to predict torques, state mass and centre of mass; "
            "with the mass alone, weigh it: rx90 verify"
        )
    door = partial(prepare, robot=structure, observing=observing, gains=gains, policy=replace(policy, undelay=False))
    if not policy.repeats:
        check_different([each.recording for each in (*seen, log)])
    bare = [each for each in seen if each.payload is None]
    own = door([log])
    found = Diagnosed(diagnoses=own.diagnoses)
    if policy.doubt:
        compared = diagnose(door([*bare, log]).logs())
        found = joined(found, more=[each for each in compared.diagnoses if name in each.logs])
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
        raise GainsError("gains: no joint has one here and among those to compare with")
    overall = [float(np.sqrt(np.mean([share[j] ** 2 for j in both]))) for share in shares]
    return Unseen(
        name=unseen.log.recording.name,
        loaded=unseen.log.payload is not None,
        joints=tuple(
            UnseenJoint(
                joint=j,
                rel_error=shares[0].get(j),
                other_rel_error=None if other is None else shares[1].get(j),
                fitted_rel_error=found.fitted.get(j),
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
