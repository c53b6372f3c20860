"""Identify drive gains from recordings: read, prepare, estimate, diagnose."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnose import diagnose, lacking
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity
from ident.diagnosis.estimate_model import NO_RESULT, Estimate
from ident.diagnosis.gain_symptoms import symptoms
from ident.diagnosis.link_masses import link_mass_consistency
from ident.diagnosis.plausibility import cause_of, check_load, check_payloads
from ident.estimation.estimate import GainEstimate, IdentifiedGain, JointResult, RefusedGain
from ident.estimation.estimators import DEFAULT, estimator
from ident.estimation.gain_options import GainOptions
from ident.estimation.problem import Problem
from ident.model.arm import Arm
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.preparation import DOUBTED, Policy, Prepared, joined, prepare, raise_for, refusal_of
from ident.recordings.motion import Motion
from ident.support.arrays import Array, MaskedArray
from ident.support.errors import Contradiction, IdentificationError

OBSERVE_DEFAULTS, GAIN_DEFAULTS = ObserveOptions(), GainOptions()


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """Result of `identify`.

    Attributes:
        estimate: A gain or a reason for each joint, with rows and residuals, and payload parameters that were also
            estimated.
        notes: What the method selected, and changes of the recordings.
        found: Diagnoses of logs and estimate: faults, excluded faults, and faults that cannot be checked.
        observing: Filters and thresholds, with the corrected delay.
        prepared: The prepared logs; None if identified elsewhere.
    """

    estimate: GainEstimate
    notes: tuple[str, ...]
    found: Diagnosed
    observing: ObserveOptions = OBSERVE_DEFAULTS
    prepared: Prepared | None = field(default=None, repr=False)

    @property
    def joints(self) -> tuple[JointResult, ...]:
        """Each joint's gain, or the reason of its refusal."""
        return self.estimate.joints

    @property
    def gain(self) -> MaskedArray:
        """Drive gains [N m / drive unit], shape (n,), masked where refused."""
        return self.estimate.gain

    @property
    def std(self) -> MaskedArray:
        """Total standard deviations of the gains [N m / drive unit], shape (n,), masked where refused."""
        return self.estimate.std

    @property
    def residual_std(self) -> MaskedArray:
        """Contributions of the residuals to `std` [N m / drive unit], shape (n,), masked where refused."""
        return self.estimate.residual_std

    @property
    def payload_std(self) -> MaskedArray:
        """Contributions of the payload to `std` [N m / drive unit], shape (n,), masked where refused."""
        return self.estimate.payload_std

    @property
    def model_std(self) -> MaskedArray:
        """Contributions of the model's assumptions to `std` [N m / drive unit], shape (n,), masked where refused."""
        return self.estimate.model_std

    @property
    def reasons(self) -> tuple[str | None, ...]:
        """Reason of each joint's refusal, None for a gain."""
        return self.estimate.reasons

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """Diagnoses of logs and estimate, the worst first."""
        return self.found.diagnoses


def identify(
    arm: Arm | Structure,
    logs: Sequence[Motion],
    *,
    method: str = DEFAULT,
    options: object | None = None,
    observing: ObserveOptions = OBSERVE_DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    policy: Policy = DOUBTED,
    links: Array | None = None,
) -> Identification:
    """Identify drive gains from any number of motions, bare and with one or more mountings of payloads.

    Args:
        arm: The arm, or its structure, whose computation takes a while for many joints.
        logs: Motions from `read`, in order of time if known.
        method: A name in `ESTIMATORS`.
        options: Options of the method, of the class in `ESTIMATORS`; defaults if None.
        observing: Filters and thresholds.
        gains: Limits for accepting a gain, and the method for its uncertainty.
        policy: Policy for checks and repairs of the logs.
        links: Standard parameters of the model's links, shape (n, 10), for a test of the gains; None if unknown.

    Raises:
        IdentificationError: If the data contradict their description; one class per cause, and the message states the
            probable fault.
    """
    chosen = estimator(method)
    wanted = chosen.options() if options is None else options
    prepared = prepare(logs, arm, observing=observing, gains=gains, policy=policy)
    raise_for(prepared, Diagnosed())

    def estimate_of(problem: Problem) -> GainEstimate:
        return chosen.estimate(problem, wanted)

    estimate = _estimated(prepared, estimate_of)
    found = _diagnosed(prepared, estimate, estimate_of, links)
    kept = without_spoilt(estimate, found.diagnoses)
    return Identification(kept, estimate.remarks + prepared.notes, found, prepared.observing, prepared)


def _estimated(prepared: Prepared, estimate_of: Estimate) -> GainEstimate:
    """Return the estimate of prepared logs; if it fails, a fault of the logs is reported as the cause.

    Raises:
        IdentificationError: If there is no estimate.
    """
    try:
        estimate = estimate_of(prepared.problem)
        check_load(estimate, bare=any(motion.payload is None for motion in prepared.problem.motions))
    except IdentificationError as error:
        check_payloads(prepared.motions)
        raise_for(prepared, diagnose(prepared.logs()) if prepared.policy.doubt else Diagnosed())
        cause = cause_of(error, prepared.problem)
        if prepared.diagnoses:
            raise type(cause)(f"{cause}; {prepared.diagnoses[0].sentence}") from error
        raise cause from error
    return estimate


def _diagnosed(prepared: Prepared, estimate: GainEstimate, estimate_of: Estimate, links: Array | None) -> Diagnosed:
    """Return the diagnoses of prepared logs and of their estimate, causes before their effects."""
    if prepared.policy.doubt:
        found = diagnose(prepared.logs(), estimate, estimate_of)
    else:
        found = lacking(prepared.problem, estimate, prepared.logs())
    found = joined(Diagnosed(diagnoses=prepared.diagnoses), found)
    found = joined(found, symptoms(estimate, found))
    weight = None if links is None else link_mass_consistency(prepared.problem, estimate, links)
    return joined(found, more=() if weight is None else (weight,))


def without_spoilt(estimate: GainEstimate, diagnoses: Sequence[Diagnosis]) -> GainEstimate:
    """Return the estimate without gains that a fault invalidates.

    Raises:
        Contradiction: If no gain is left.
    """
    joints = list(estimate.joints)
    wrong = [each for each in diagnoses if each.severity is Severity.WRONG]
    for each in reversed(wrong):  # the worst diagnosis determines the reason
        for j in spoilt_joints(each):
            gain = joints[j]
            if isinstance(gain, IdentifiedGain) or each.effects:
                joints[j] = RefusedGain(
                    joint=gain.joint, reason=_reason(each, j), predicted_rel_std=gain.predicted_rel_std
                )
    if wrong and not any(isinstance(each, IdentifiedGain) for each in joints):
        raise Contradiction(refusal_of(wrong))
    return replace(estimate, joints=tuple(joints))


def _reason(wrong: Diagnosis, joint: int) -> str:
    """Return the reason of refusing a joint, from 0: the fault, and its effect on this gain."""
    cause = wrong.cause or wrong.sentence
    effect = next((each for each in wrong.effects if each.joint == joint), None)
    if effect is None or effect.deviations is None:
        return wrong.sentence
    if abs(effect.percent) >= 100.0 * NO_RESULT:
        return f"the gain is invalid: {cause}"
    return f"the gain is off by {two_digits(effect.percent, sign='+')} %: {cause}"


def refused_for_faults(diagnoses: Sequence[Diagnosis]) -> tuple[int, ...]:
    """Return joints, from 0, whose gains a fault invalidates."""
    return tuple(sorted({j for each in diagnoses if each.severity is Severity.WRONG for j in spoilt_joints(each)}))


def spoilt_joints(diagnosis: Diagnosis) -> tuple[int, ...]:
    """Return joints whose gains a fault invalidates: from its effects, otherwise the joints concerned."""
    if diagnosis.effects:
        return tuple(each.joint for each in diagnosis.effects if each.spoils)
    return diagnosis.joints
