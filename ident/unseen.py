"""Prediction of a motion that was not used in any fit: errors of its currents, and what its payload says of the gains.

The current is the torque of arm and payload over the gain (paper, eq. 7). The arm is identified from bare motions with
the same gains, or read from a model file. Predictions with other gains are compared on the same motion, with a t-test
of its time blocks. The limit of the prediction error follows from the fit.

A factor common to all gains cancels in predictions of a bare motion, where the identified arm scales with the gains,
but not with a weighed payload: with the bare motions it also gives gains, of which those in question must not differ.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Final, Literal

import numpy as np

from ident.diagnosis.diagnosis import SHARE, SPOILS, Diagnosed, Diagnosis, Severity
from ident.diagnosis.plausibility import LARGE_RESIDUAL, check_different
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import DEFAULT
from ident.estimation.intervals import TIME_BLOCKS, JointPrediction, cross_validated
from ident.estimation.known_gains import KnownGains, check_comparable, estimated_gains
from ident.estimation.problem import Columns, GainOptions, ObservedMotion
from ident.identification import Identification, doubts, estimate_by
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.parameters.arm import BareArm, Quantity, arm_in_use, predicted_torque, rel_errors
from ident.parameters.weighing import LEVEL, UNKNOWN, masses_of_joints
from ident.preparation import DOUBTED, Policy, Prepared, joined, prepare, refusal_of
from ident.recordings.recording import Motion
from ident.support.arrays import Array
from ident.support.display import Displayed
from ident.support.errors import Contradiction, GainsError, IdentificationError, PayloadError

Verdict = Literal["better", "worse", "no different"]
BETTER: Final = "better"
WORSE: Final = "worse"
NO_DIFFERENT: Final = "no different"


@dataclass(frozen=True, slots=True, kw_only=True)
class UnseenJoint:
    """A joint's currents on a motion that was not used in any fit; values are None if the joint has no gain.

    Attributes:
        joint: The joint, from 0.
        rel_error: Norm of the prediction error relative to that of the currents.
        other_rel_error: As `rel_error`, relative, with the other gains or the unchanged model; None if there are none.
        fitted_rel_error: Norm of the residual relative to that of the currents, of the fitted motions; None for a model
            file.
        largest_rel_error: Largest `rel_error` of a predicted motion: three times the cross-validation error of the fit
            with the standard deviations of arm, gain and payload, at most 15 %; relative.
        gain_rel_error: Relative error of the gain according to the payload on this motion, positive if it is too large;
            None for a bare motion, for the arm of a model file, and if the motion gives no gain.
        gain_rel_std: Standard deviation of `gain_rel_error`, relative.
        unstated_rel: Norm of the currents of offset and missing rotor inertia, which the model file does not state,
            relative to that of the currents; the prediction includes them, as --arm has them; None for an identified
            arm.
    """

    joint: int
    rel_error: float | None = None
    other_rel_error: float | None = None
    fitted_rel_error: float | None = None
    largest_rel_error: float | None = None
    gain_rel_error: float | None = None
    gain_rel_std: float | None = None
    unstated_rel: float | None = None

    @property
    def exceeds(self) -> bool:
        """Whether the error exceeds its limit."""
        largest = self.largest_rel_error
        return self.rel_error is not None and largest is not None and self.rel_error > largest

    @property
    def doubted(self) -> bool:
        """Whether the payload significantly contradicts the gain: the interval of its error does not contain zero."""
        error, std = self.gain_rel_error, self.gain_rel_std
        return error is not None and std is not None and abs(error) > SPOILS * std


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen(Displayed):
    """Prediction of a motion that was not used in any fit.

    Attributes:
        log: Recording of the motion.
        loaded: Whether the motion carries a payload.
        verdict: Whether the motion is predicted better than with the other gains or model, by Student's t-test of time
            blocks at 5 %; None if there are no others.
        rel_error: Root mean square of the joints' relative errors; in a comparison, of the joints that both predict.
        other_rel_error: Relative error with the other gains or model; None if there are none.
        joints: One entry per joint, in order.
        diagnoses: One entry per check, the worst first.
    """

    log: str
    loaded: bool
    verdict: Verdict | None
    rel_error: float
    other_rel_error: float | None
    joints: tuple[UnseenJoint, ...]
    diagnoses: tuple[Diagnosis, ...] = ()

    def _headline(self) -> str:
        than = "" if self.verdict is None else f", {self.verdict} than with the other gains"
        return f"Currents of {self.log} predicted within {100.0 * self.rel_error:.2g} % of rms{than}"

    def _columns(self) -> Mapping[str, Sequence[object]]:
        values = {each.name: [getattr(own, each.name) for own in self.joints] for each in fields(UnseenJoint)}
        return values | {"joint": [each.joint + 1 for each in self.joints]}

    @property
    def passed(self) -> bool:
        """Whether currents are predicted, better than by the others if any, and no payload contradicts a gain."""
        return self.verdict in (None, BETTER) and self.not_worse

    @property
    def not_worse(self) -> bool:
        """Whether currents are predicted, not worse than by the others if any, and no payload contradicts a gain."""
        return self.verdict != WORSE and not any(each.exceeds or each.doubted for each in self.joints)

    @property
    def fitted(self) -> bool:
        """Whether the arm was fitted to motions, not read from a file."""
        return any(each.fitted_rel_error is not None for each in self.joints)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UnseenMotion:
    """A motion that was not used in any fit, its linear systems, in sequence, its diagnoses, and the gains it gives."""

    log: Motion
    parts: tuple[ObservedMotion, ...]
    diagnoses: tuple[Diagnosis, ...] = ()
    estimate: GainEstimate | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UsedModel:
    """Model that predicts currents."""

    gains: KnownGains
    base: Array  # base parameters of the arm, including friction, shape (b,)
    covariance: Array  # covariance of `base` from the residuals, shape (b, b); zero if unknown
    fits: Mapping[int, JointPrediction]  # cross-validation of the fit, by joint from 0; empty for a model file
    unstated: Array | None = None  # part of `base` that no model file states, as offsets, shape (b,)


def used_model(arm: BareArm) -> UsedModel:
    """Return the model of an arm that was identified with given gains."""
    assert arm.gains is not None, "of an arm with fixed gains"
    fits = {each.joint: each for each in cross_validated(arm.selected.final.rows)}
    base, covariance = arm.in_si()
    return UsedModel(gains=arm.gains, base=base, covariance=covariance, fits=fits)


def predict_unseen(identified: Identification, log: Motion, *, other: KnownGains | None = None) -> Unseen:
    """Predict a motion with the identified gains, as `predict_with`."""
    assert identified.prepared is not None, "an identification has what it was found from"
    return predict_with(estimated_gains(identified.estimate), identified.prepared, log, other=other)


def predict_with(gains: KnownGains, prepared: Prepared, log: Motion, *, other: KnownGains | None = None) -> Unseen:
    """Predict a motion with given gains and the arm identified with them, and in the same way with other gains.

    `prepared` are the motions used for the gains or the arm. Raises `IdentificationError` if the motion is one of
    those, has a fault or cannot be observed, or no motion was bare; `PayloadError` if mass or centre of its payload is
    unknown; `GainsError` if no joint has a gain in both, or the signs of a joint differ.
    """
    if other is not None:
        check_comparable(gains, other)
    problem, observing, policy = prepared.problem, prepared.observing, prepared.policy
    unseen = unseen_motion(
        log, prepared.motions, problem.structure, observing=observing, gains=problem.options, policy=policy
    )
    return predicted(unseen, *(used_model(arm_in_use(problem, each)) for each in (gains, other) if each is not None))


def unseen_motion(
    log: Motion,
    seen: Sequence[Motion],
    structure: Structure,
    *,
    observing: ObserveOptions,
    gains: GainOptions,
    policy: Policy = DOUBTED,
) -> UnseenMotion:
    """Check and observe a motion in the same way as those used for the gains.

    The bare ones of the motions `seen` in the fit help to test this one; `observing` has the delay that was corrected.
    Raises `PayloadError` if mass or centre of its payload is unknown, `IdentificationError` if it was used in the fit
    or has a fault.
    """
    name = log.recording.name
    if log.payload is not None and log.payload.known not in ("all", "com"):
        raise PayloadError(
            f"{name}: known = {log.payload.known!r} in its payload, but a prediction of torques needs mass and centre "
            "of mass; if only the mass is known, use rx90 verify"
        )
    door = partial(prepare, robot=structure, observing=observing, gains=gains, policy=replace(policy, undelay=False))
    if not policy.repeats:
        check_different([each.recording for each in (*seen, log)])
    bare = [each for each in seen if each.payload is None]
    try:
        own = door([log])
        weighed = bare and log.payload is not None
        compared = doubts(door([*bare, log]), estimate_by(DEFAULT) if weighed else None, before=(), needed=False)
    except IdentificationError as error:
        if name in str(error):
            raise
        raise type(error)(f"{name}, the motion to predict: {error}") from error
    of_it = [each for each in compared.found.diagnoses if not bare or name in each.logs]
    found = joined(Diagnosed(diagnoses=own.diagnoses), more=of_it).diagnoses
    wrong = [each for each in found if each.severity is Severity.WRONG]
    if wrong:
        mounted = "; if it carries a payload, state it" if log.payload is None else ""
        raise Contradiction(f"{name}, the motion to predict: {refusal_of(wrong)}{mounted}")
    return UnseenMotion(log=log, parts=own.problem.motions, diagnoses=found, estimate=compared.estimate)


def predicted(unseen: UnseenMotion, found: UsedModel, other: UsedModel | None = None) -> Unseen:
    """Predict the currents of a motion, and compare with another model; `GainsError` if no joint has a gain in both."""
    system, payload, fits = Columns.of(unseen.parts), unseen.log.payload, found.fits

    def currents(torque: Array, gains: KnownGains) -> Array:
        per_torque = np.zeros(len(gains.names))
        per_torque[gains.joints] = 1.0 / gains.value
        return torque * per_torque[system.joint] / gains.relative(system.V, system.joint)

    errors, shares = list[Array](), list[dict[int, float]]()  # by model; relative, by joint
    for model in (found,) if other is None else (found, other):
        error = currents(predicted_torque(system, model.base, payload), model.gains) - system.V
        errors.append(np.where(np.isin(system.joint, model.gains.joints), error, 0.0))
        relative = rel_errors(errors[-1], system.V, system.joint)
        shares.append({j: relative[j] for j in model.gains.joints.tolist() if j in relative})
    both = sorted(set(shares[0]).intersection(*shares[1:]))
    if not both:
        raise GainsError("gains: no joint has a gain in both sets, so they cannot be compared")
    overall = [float(np.sqrt(np.mean([share[j] ** 2 for j in both]))) for share in shares]
    unstated = dict[int, float]()
    if found.unstated is not None:
        unstated = rel_errors(currents(system.W @ found.unstated, found.gains), system.V, system.joint)
    joints, masses = list[UnseenJoint](), tuple[Quantity | str, ...]()
    if payload is not None and unseen.estimate is not None:
        masses = masses_of_joints(payload, found.gains, unseen.estimate)
    gain_of = dict(zip(found.gains.joints.tolist(), zip(found.gains.value, found.gains.std, strict=True), strict=True))
    for j in range(unseen.parts[0].observation.structure.arm.n):
        rel_error, fit = shares[0].get(j), fits.get(j)
        mass, off, unsure = masses[j] if masses else None, None, None
        if isinstance(mass, Quantity) and payload is not None:
            off, unsure = mass.value / payload.mass - 1.0, float(np.hypot(mass.std, payload.mass_std)) / payload.mass
        joints.append(
            UnseenJoint(
                joint=j,
                rel_error=rel_error,
                other_rel_error=None if other is None else shares[1].get(j),
                fitted_rel_error=None if rel_error is None or fit is None else fit.fitted,
                largest_rel_error=_largest(system, unseen, found, j, *gain_of[j]) if j in gain_of else None,
                gain_rel_error=off,
                gain_rel_std=unsure,
                unstated_rel=None if rel_error is None else unstated.get(j),
            )
        )
    return Unseen(
        log=unseen.log.recording.name,
        loaded=payload is not None,
        verdict=None if other is None else _verdict(system, errors[0], errors[1], both),
        rel_error=overall[0],
        other_rel_error=None if other is None else overall[1],
        joints=tuple(joints),
        diagnoses=unseen.diagnoses,
    )


def _verdict(system: Columns, found: Array, other: Array, joints: Sequence[int]) -> Verdict:
    """Return Student's t-test of the difference of relative squared errors per time block, of all joints together."""
    from scipy.special import stdtrit  # slow import, rarely needed

    more = np.zeros(TIME_BLOCKS)  # excess error of the others
    for j in joints:
        at = system.joint == j
        gained = (other[at] ** 2 - found[at] ** 2) / np.sum(system.V[at] ** 2)
        more += [float(block.sum()) for block in np.array_split(gained, TIME_BLOCKS)]
    error = float(np.std(more, ddof=1)) / np.sqrt(TIME_BLOCKS)
    if abs(more.mean()) <= float(stdtrit(TIME_BLOCKS - 1, 1.0 - 0.5 * LEVEL)) * error:
        return NO_DIFFERENT
    return BETTER if more.mean() > 0.0 else WORSE


def _largest(system: Columns, unseen: UnseenMotion, model: UsedModel, j: int, g: float, std: float) -> float:
    """Return the limit of a joint's relative prediction error, at most `LARGE_RESIDUAL`, as for a model file.

    It is `SPOILS` times the expected error: the cross-validation error of the fit, and the effect of the standard
    deviations of arm, payload and gain (the latter only through the payload's torque) on these currents.
    """
    known, at = (unseen.log.payload or UNKNOWN).known_part(), np.flatnonzero(system.joint == j)
    V, W, W_L = system.V[at], system.W[at], system.carried[at]
    of_arm = np.sum((W @ model.covariance) * W)
    of_payload = np.sum((W_L @ np.column_stack((known.spread, known.chi * std / g))) ** 2)
    size = g**2 * np.sum(V**2)
    if j not in model.fits:
        return float(np.hypot(LARGE_RESIDUAL, SPOILS * np.sqrt(of_arm / size)))
    expected = np.hypot(model.fits[j].share, np.sqrt((of_arm + of_payload) / size))
    return float(np.clip(SPOILS * expected, SHARE, LARGE_RESIDUAL))
