"""Check recordings before identification: the samples of each, then all of them with the model."""

from collections.abc import Sequence
from dataclasses import dataclass

from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, worst_first
from ident.diagnosis.excitation import excitation, predicted_rel_std
from ident.diagnosis.friction_sign import friction_sign
from ident.diagnosis.gain_symptoms import symptoms
from ident.diagnosis.joint_limits import beyond_limits
from ident.diagnosis.link_masses import link_mass_consistency
from ident.diagnosis.plausibility import cause_of, check_joints, check_load
from ident.diagnosis.samples.motion import JointMotion, joint_motions
from ident.diagnosis.samples.temperature import Warmth, temperature
from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators import DEFAULT, estimator
from ident.estimation.gain_options import GainOptions
from ident.estimation.problem import Problem
from ident.model.structure import Structure
from ident.observation.following import following
from ident.observation.observation import ObserveOptions
from ident.payload.payload import Payload
from ident.preparation import DOUBTED, Examined, assembled, examined, joined, undelayed
from ident.recordings.recording import Recording
from ident.support.arrays import Array
from ident.support.errors import IdentificationError

OBSERVE_DEFAULTS = ObserveOptions()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogRead:
    """One checked log.

    Attributes:
        recording: The original recording.
        motions: Motion of each joint, None if the log cannot be filtered.
    """

    recording: Recording
    motions: tuple[JointMotion, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """Result of a check.

    Attributes:
        logs: One entry per log.
        found: Diagnoses of the logs.
        observing: Filters, with the compensated delay.
    """

    logs: tuple[LogRead, ...]
    found: Diagnosed
    observing: ObserveOptions = OBSERVE_DEFAULTS


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
    """Check recordings of one arm.

    Args:
        recordings: Recordings of the arm, with the same or different payloads.
        structure: Identifiable structure of the arm.
        observing: Filters.
        gains: Limits for accepting a gain.
        loaded: Whether each recording has `payload` mounted, None if unknown.
        payload: The mounted or planned payload, None without one.
        about: Nominal gains [N m / drive unit], shape (n,), None if unknown.
        warmths: Temperatures of the recordings that have them.
        undelay: Whether a common delay of the currents is estimated and compensated.
        links: Standard parameters of the model's links, shape (n, 10), for a test of the gains; None if unknown.

    Raises:
        RecordingError: If the number of joints of a recording is not that of the arm.
    """
    for each in recordings:
        check_joints(structure.arm, each)
    observing, _ = following(observing, recordings)
    examinations = [examined(each, structure, observing) for each in recordings]
    logs = tuple(_log_read(each, structure, observing) for each in examinations)
    found = [each for one in examinations for each in (*_diagnoses_of(one), *_limits(structure, one))]
    found += temperature(warmths)
    with_payload = loaded or (False,) * len(recordings)
    carried = [
        payload if with_payload[k] else None if k == 0 else Payload(mass=1.0, known="none")
        for k in range(len(recordings))
    ]
    if not any(each.parts for each in examinations):
        return Checked(logs=logs, found=Diagnosed(diagnoses=worst_first(found)), observing=observing)
    prepared = assembled(examinations, carried, structure, observing, gains, DOUBTED)
    if undelay:
        prepared, diagnosis = undelayed(prepared)
        found.append(diagnosis)
    problem = prepared.problem
    found += friction_sign([Problem(structure, (motion,), gains) for motion in problem.motions], about)
    if payload is not None and about is not None and not with_payload[0]:
        predicted = predicted_rel_std(problem.motions[0].observation, payload, about, gains)
        found.append(excitation(prepared.motions[0].recording.name, predicted, gains))
    estimate, refused = None, None
    if any(with_payload) and not all(with_payload):
        try:
            estimate = _estimate(problem)
            check_load(estimate)
        except IdentificationError as error:
            refused = cause_of(error, problem)
    findings = diagnose(prepared.logs(), estimate, _estimate)
    found_all = joined(findings, Diagnosed(diagnoses=tuple(found)))
    if estimate is not None and refused is None:  # the cause is reported, not its effects
        weight = None if links is None else link_mass_consistency(problem, estimate, links)
        found_all = joined(found_all, symptoms(estimate, found_all), more=() if weight is None else (weight,))
    if refused is not None and found_all.severity is not Severity.WRONG:
        found_all = joined(found_all, more=(Diagnosis(name="load", severity=Severity.WRONG, sentence=str(refused)),))
    return Checked(logs=logs, found=found_all, observing=prepared.observing)


def _estimate(problem: Problem) -> GainEstimate:
    """Estimate with the default method, for the effect of faults on the gains.

    Raises:
        IdentificationError: If there is no estimate.
    """
    chosen = estimator(DEFAULT)
    return chosen.estimate(problem, chosen.options())


def _log_read(log: Examined, structure: Structure, observing: ObserveOptions) -> LogRead:
    """Return the motion of the joints of a log."""
    motions = None if log.unfit is not None else joint_motions(log.longest, structure.arm, observing)
    return LogRead(recording=log.recording, motions=motions)


def _diagnoses_of(log: Examined) -> list[Diagnosis]:
    """Return the diagnoses of one log."""
    found = [*(each for own in log.diagnoses.values() for each in own), *log.repairs]
    if log.unfit is not None:
        sentence = f"the log cannot be filtered: {log.unfit.reason}"
        found.append(Diagnosis(name="filters", severity=Severity.WRONG, sentence=sentence, logs=(log.recording.name,)))
    return found


def _limits(structure: Structure, log: Examined) -> list[Diagnosis]:
    """Return diagnoses of joints beyond the model's limits."""
    beyond = sorted({j for part in log.repaired for j in beyond_limits(structure.arm, part)})
    if not beyond:
        return []
    listed = ", ".join(f"q{j + 1}" for j in beyond)
    return [
        Diagnosis(
            name="joint limits",
            severity=Severity.WRONG,
            sentence=f"{listed} {'is' if len(beyond) == 1 else 'are'} beyond the model's limits",
            advice="check units (degrees, motor side), zeros and the model's limits",
            joints=tuple(beyond),
            logs=(log.recording.name,),
        )
    ]
