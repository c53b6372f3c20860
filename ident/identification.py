"""Identify drive gains from recordings, or check these: read, prepare, estimate, diagnose.

`identify` refuses faults, `check` reports them; both take the same steps and find the same diagnoses.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from ident.diagnosis.diagnose import diagnose, lacking
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, finding, two_digits, worst_first
from ident.diagnosis.effects import NO_RESULT, Estimate
from ident.diagnosis.gain_checks import link_mass_consistency, symptoms
from ident.diagnosis.hypothesis import beyond_limits
from ident.diagnosis.motion_quality import JointMotion, Warmth, joint_motions, temperature
from ident.diagnosis.plausibility import (
    advice_on_units,
    cause_of,
    check_load,
    check_payloads,
    excitation,
    friction_sign,
    predicted_rel_std,
)
from ident.estimation.estimate import GainEstimate, IdentifiedGain, JointResult, RefusedGain
from ident.estimation.estimators import DEFAULT, estimator, gives_a_gain
from ident.estimation.problem import GainOptions, Problem
from ident.model.arm import Arm
from ident.model.structure import Structure
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload
from ident.preparation import DOUBTED, REPORTED, Examined, Policy, Prepared, joined, prepare, raise_for, refusal_of
from ident.recordings.recording import Motion, Recording
from ident.support.arrays import Array, MaskedArray
from ident.support.display import Displayed
from ident.support.errors import Contradiction, IdentificationError

OBSERVE_DEFAULTS, GAIN_DEFAULTS = ObserveOptions(), GainOptions()
one_thread = threadpool_limits.wrap(limits=1, user_api="blas")
"""Decorator that keeps BLAS on one thread: on many small matrices several take ten times as long."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Identification(Displayed):
    """Result of `identify`.

    Attributes:
        estimate: A gain or a reason for each joint, with rows and residuals, and payload parameters that were also
            estimated.
        notes: What the method selected, and changes of the recordings.
        found: Diagnoses of logs and estimate: faults, excluded faults, and faults that the logs cannot reveal.
        observing: Filters and thresholds, with the corrected delay.
        prepared: The prepared logs; None if identified elsewhere.
    """

    estimate: GainEstimate
    notes: tuple[str, ...]
    found: Diagnosed
    observing: ObserveOptions = OBSERVE_DEFAULTS
    prepared: Prepared | None = None

    def __repr__(self) -> str:
        """Return a line on the number of gains, and one for each joint, with two standard deviations or the reason."""
        found = self.estimate.identified
        lines = [f"Identification by {self.estimate.method}: {len(found)} of {len(self.joints)} gains, +- 2 sigma"]
        for j, reason in enumerate(self.reasons):
            said = reason if j not in found else f"{found[j].value:.5g} +- {2.0 * found[j].std:.2g} {self._unit}"
            lines.append(f"  joint {j + 1}: {said}")
        return "\n".join([*lines, *(f"  {each.severity.value}: {each.sentence}" for each in self.found.findings)])

    @property
    def _unit(self) -> str:
        revolute = self.prepared is not None and self.prepared.problem.structure.arm.revolute.all()
        return "N m/unit" if revolute else "N (m)/unit"

    def _columns(self) -> dict[str, Sequence[object]]:
        values = {"gain": "value", **dict.fromkeys(("std", "residual_std", "payload_std", "model_std"))}
        return {
            "joint": range(1, len(self.joints) + 1),
            **{
                f"{name} [{self._unit}]": [getattr(each, attribute or name, None) for each in self.joints]
                for name, attribute in values.items()
            },
            "name": [each.joint for each in self.joints],
            "reason": self.reasons,
        }

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

    def gain_at(self, current: Array) -> MaskedArray:
        """Return the gains at currents, as `GainEstimate.gain_at`: constant unless a law of currents corrects them."""
        return self.estimate.gain_at(current)

    @property
    def reasons(self) -> tuple[str | None, ...]:
        """Reason of each joint's refusal, None for a gain."""
        return self.estimate.reasons

    @property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """Diagnoses of logs and estimate, the worst first."""
        return self.found.diagnoses


@one_thread
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
    estimate_of = estimate_by(method, options)
    prepared = prepare(logs, arm, observing=observing, gains=gains, policy=policy)
    raise_for(prepared.diagnoses)
    if not gives_a_gain(options):
        check_payloads(prepared.motions)
    doubted = doubts(prepared, estimate_of, links=links)
    if doubted.failed is not None:  # a fault of the logs is reported as the cause
        check_payloads(prepared.motions)
        raise_for(doubted.found.diagnoses)
        cause = cause_of(doubted.failed, prepared.problem)
        if doubted.found.findings:
            raise type(cause)(f"{cause}; {doubted.found.findings[0].sentence}") from doubted.failed
        raise cause from doubted.failed
    assert doubted.estimate is not None, "it has not failed"
    kept = without_spoilt(doubted.estimate, doubted.found.diagnoses)
    return Identification(kept, kept.remarks + prepared.notes, doubted.found, prepared.observing, prepared)


def estimate_by(method: str, options: object | None = None) -> Estimate:
    """Return the gains of a problem by a method, as a function."""
    chosen = estimator(method)
    wanted = chosen.options() if options is None else options
    return lambda problem: chosen.estimate(problem, wanted)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Doubts:
    """What is wrong with logs, and the gains that they give."""

    found: Diagnosed  # diagnoses of the logs, and of the estimate if there is one
    estimate: GainEstimate | None = None  # the gains, also those that a fault invalidates; None without an estimate
    failed: IdentificationError | None = None  # why the estimate failed, None if it did not


def doubts(
    prepared: Prepared,
    estimate_of: Estimate | None = None,
    *,
    before: Sequence[Diagnosis] | None = None,
    links: Array | None = None,
    needed: bool = True,
) -> Doubts:
    """Diagnose prepared logs: the same faults of the same logs, whatever the command, before gains are judged.

    `estimate_of` estimates the gains, None if no payload is known; `before` are diagnoses of the samples, None for
    those of the preparation; `links` the standard parameters of the model's links, shape (n, 10), for a test of the
    gains. With `needed`, an estimate without a load, or without any gain, fails.
    """
    estimate, failed = None, None
    if estimate_of is not None:
        try:
            estimate = estimate_of(prepared.problem)
            if needed:
                check_load(estimate, bare=any(motion.payload is None for motion in prepared.problem.motions))
        except IdentificationError as error:  # an estimate without any gain may still show why there is none
            failed = error
    if prepared.policy.checked:
        found = diagnose(prepared.logs(), estimate, estimate_of)
    else:
        found = Diagnosed() if estimate is None else lacking(prepared.problem, estimate, prepared.logs())
    found = joined(Diagnosed(diagnoses=tuple(prepared.diagnoses if before is None else before)), found)
    if estimate is not None and failed is None:
        found = joined(found, symptoms(estimate, found))
        weight = None if links is None else link_mass_consistency(prepared.problem, estimate, links)
        found = joined(found, more=() if weight is None else (weight,))
    return Doubts(found=found, estimate=estimate, failed=failed)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """Result of a check."""

    # name of each log, and motion of each joint; no motion if the log cannot be filtered:
    logs: tuple[tuple[str, tuple[JointMotion, ...]], ...]
    found: Diagnosed  # diagnoses of the logs
    observing: ObserveOptions = OBSERVE_DEFAULTS  # filters, with the compensated delay


@one_thread
def check(
    recordings: Sequence[Recording],
    structure: Structure,
    *,
    observing: ObserveOptions,
    gains: GainOptions,
    loaded: Sequence[bool] | None = None,
    payload: Payload | None = None,
    about: Array | None = None,
    warmths: Sequence[Warmth] = (),
    undelay: bool = False,
    links: Array | None = None,
) -> Checked:
    """Check recordings of one arm, with the same or different payloads: as `identify`, but faults are reported.

    `loaded` states whether each recording has the mounted or planned `payload`, None if unknown; `about` are
    assumed gains [N m / drive unit], shape (n,). With `undelay`, a common delay of the currents is estimated and
    compensated. `links` are the standard parameters of the model's links, shape (n, 10), for a test of the gains.
    Raises `RecordingError` if the number of joints of a recording is not that of the arm.
    """
    mounted, policy = loaded or (False,) * len(recordings), replace(REPORTED, undelay=undelay)
    motions = [
        Motion(each, payload if carries else None if k == 0 else Payload(mass=1.0, known="none"))
        for k, (each, carries) in enumerate(zip(recordings, mounted, strict=True))
    ]
    prepared = prepare(motions, structure, observing=observing, gains=gains, policy=policy)
    logs = tuple(
        (each.recording.name, () if each.unfit else joint_motions(each.longest, structure.arm, prepared.observing))
        for each in prepared.examined
    )
    found = [one for each in prepared.examined for one in _of_samples(each, structure)] + temperature(warmths)
    if not prepared.parts:
        return Checked(logs=logs, found=Diagnosed(diagnoses=worst_first(found)), observing=prepared.observing)
    found += [] if prepared.delay is None else [prepared.delay]
    problem = prepared.problem
    found += friction_sign([Problem(structure, (motion,), gains) for motion in problem.motions], about)
    if payload is not None and about is not None and not mounted[0]:
        predicted = predicted_rel_std(problem.motions[0].observation, payload, about, gains)
        found.append(excitation(prepared.motions[0].recording.name, predicted, gains))
    weighed = any(mounted) and not all(mounted)
    doubted = doubts(prepared, estimate_by(DEFAULT) if weighed else None, before=found, links=links)
    diagnosed = doubted.found
    if doubted.failed is not None and diagnosed.severity is not Severity.WRONG:
        sentence = str(cause_of(doubted.failed, problem))
        diagnosed = joined(diagnosed, more=[Diagnosis(name="load", severity=Severity.WRONG, sentence=sentence)])
    return Checked(logs=logs, found=diagnosed, observing=prepared.observing)


def _of_samples(log: Examined, structure: Structure) -> list[Diagnosis]:
    """Return all diagnoses of one log by itself, also those of joints beyond the model's limits."""
    found, name = [*(each for own in log.diagnoses.values() for each in own), *log.repairs], log.recording.name
    if log.unfit is not None:
        sentence = f"the log cannot be filtered: {log.unfit.reason}"
        found.append(finding(name, "filters", sentence, severity=Severity.WRONG))
    beyond = sorted({j for part in log.repaired for j in beyond_limits(structure.arm, part)})
    if beyond:
        listed = ", ".join(f"q{j + 1}" for j in beyond)
        sentence = f"{listed} {'is' if len(beyond) == 1 else 'are'} beyond the model's limits"
        advice = advice_on_units(log.recording)
        found.append(finding(name, "joint limits", sentence, advice, severity=Severity.WRONG, joints=beyond))
    return found


def without_spoilt(estimate: GainEstimate, diagnoses: Sequence[Diagnosis]) -> GainEstimate:
    """Return the estimate without gains that a fault invalidates; raises `Contradiction` if none is left."""
    joints = list(estimate.joints)
    wrong = [each for each in diagnoses if each.severity is Severity.WRONG]
    for each in reversed(wrong):  # the worst diagnosis determines the reason
        for j in spoilt_joints(each):
            gain, effect = joints[j], next((own for own in each.effects if own.joint == j), None)
            if isinstance(gain, RefusedGain) and not each.effects:
                continue
            reason, cause = each.sentence, each.cause or each.sentence
            if effect is not None and effect.deviations is not None:
                large = abs(effect.percent) >= 100.0 * NO_RESULT
                size = "invalid" if large else f"off by {two_digits(effect.percent, sign='+')} %"
                reason = f"the gain is {size}: {cause}"
            joints[j] = RefusedGain(joint=gain.joint, reason=reason, predicted_rel_std=gain.predicted_rel_std)
    if wrong and not any(isinstance(each, IdentifiedGain) for each in joints):
        raise Contradiction(refusal_of(wrong))
    return replace(estimate, joints=tuple(joints))


def refused_for_faults(diagnoses: Sequence[Diagnosis]) -> tuple[int, ...]:
    """Return joints, from 0, whose gains a fault invalidates."""
    return tuple(sorted({j for each in diagnoses if each.severity is Severity.WRONG for j in spoilt_joints(each)}))


def spoilt_joints(diagnosis: Diagnosis) -> tuple[int, ...]:
    """Return joints whose gains a fault invalidates: from its effects, otherwise the joints concerned.

    If it spoils none, it is wrong because the logs are misread, and all gains are refused.
    """
    spoilt = tuple(each.joint for each in diagnosis.effects if each.spoils)
    return spoilt or tuple(each.joint for each in diagnosis.effects) or diagnosis.joints
