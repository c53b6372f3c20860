"""Check recordings before anything is identified: the samples of each, then all of them against the model."""

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

from ident.arrays import Array
from ident.diagnosis.common_delay import common_delay
from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, worst_first
from ident.diagnosis.excitation import excitation, predicted_rel_std
from ident.diagnosis.friction_sign import friction_sign
from ident.diagnosis.gains import symptoms
from ident.diagnosis.logs import observed_logs
from ident.diagnosis.reach import beyond_reach
from ident.diagnosis.samples import FILTERED, SAMPLE_CHECKS
from ident.diagnosis.samples.motion import JointMotion, joint_motions
from ident.diagnosis.samples.temperature import Warmth, temperature
from ident.errors import IdentificationError, RecordingError
from ident.estimate import GainEstimate
from ident.estimators import DEFAULT, estimator
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.plausibility import check_joints
from ident.preparation import Recorded, earlier, joined, spoilt_samples
from ident.problem import Motion, Problem
from ident.recording import Recording
from ident.recording_repairs import repaired
from ident.structure import Structure

OBSERVE_DEFAULTS = ObserveOptions()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogRead:
    """One log, as it was checked.

    Attributes:
        recording: As logged.
        motions: How each joint moved, None where the log cannot be filtered.
    """

    recording: Recording
    motions: tuple[JointMotion, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """What a check found.

    Attributes:
        logs: Each log.
        found: What is said of them.
        observing: Filters, with the delay that was undone.
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
) -> Checked:
    """Check recordings of one arm.

    Args:
        recordings: Of the arm; whatever the first carries, others may carry something else.
        structure: Of the arm that is said to have moved.
        observing: Filters.
        gains: When a gain counts as identifiable.
        loaded: Which of them carry `payload`, None where none surely does.
        payload: That one has, None where that is not asked.
        about: What the gains are about [N m / drive unit], shape (n,), None where nobody knows.
        warmths: Temperatures of those that have them.
        undelay: Whether a delay of the currents that is common to all of them is measured and undone.

    Raises:
        RecordingError: If a recording has other joints than the arm.
    """
    for each in recordings:
        check_joints(structure.arm, each)
    logs, found, used = list[LogRead](), list[Diagnosis](), list[Recorded]()
    for k, each in enumerate(recordings):
        read, said, parts = _log_read(each, structure, observing)
        logs.append(read)
        found += [*said, *_limits(structure, parts)]
        carried = payload if loaded is not None and loaded[k] else None if k == 0 else Payload(mass=1.0, known="none")
        used += [Recorded(part, carried) for part in (parts if read.motions is not None else ())]
    found += temperature(warmths)
    if not used:
        return Checked(logs=tuple(logs), found=Diagnosed(diagnoses=worst_first(found)), observing=observing)
    names = {each.name for each in found if each.severity is not Severity.GOOD}
    motions = _observed(used, structure, observing, names)
    if undelay:
        doubted = observed_logs([each.recording for each in used], Problem(structure, motions, gains), observing)
        delay, said = common_delay(doubted)
        found.append(said)
        if delay:
            observing = earlier(observing, delay)
            motions = _observed(used, structure, observing, names)
    problem = Problem(structure, motions, gains)
    found += friction_sign([Problem(structure, (motion,), gains) for motion in motions], about)
    if payload is not None and about is not None and not (loaded or [False])[0]:
        predicted = predicted_rel_std(motions[0].observation, payload, about, gains)
        found.append(excitation(used[0].recording.name, predicted, gains))
    estimate = None
    if loaded is not None and any(loaded) and not all(loaded):
        try:
            estimate = _estimate(problem)
        except IdentificationError:
            estimate = None  # what is wrong with the logs is said all the same
    doubts = diagnose(observed_logs([each.recording for each in used], problem, observing), estimate, _estimate)
    told = joined(doubts, Diagnosed(diagnoses=tuple(found)))
    told = told if estimate is None else joined(told, symptoms(estimate, told))
    return Checked(logs=tuple(logs), found=told, observing=observing)


def _observed(
    used: Sequence[Recorded], structure: Structure, observing: ObserveOptions, names: Set[str]
) -> tuple[Motion, ...]:
    """Motions without the samples that what was found by these names spoils."""
    return tuple(
        Motion(observe(each.recording, structure, observing, spoilt_samples(each.recording, names)), each.payload)
        for each in used
    )


def _estimate(problem: Problem) -> GainEstimate:
    """By the default method, to tell what a fault does to the gains.

    Raises:
        IdentificationError: If it finds none.
    """
    chosen = estimator(DEFAULT)
    return chosen.estimate(problem, chosen.options())


def _limits(structure: Structure, parts: Sequence[Recording]) -> list[Diagnosis]:
    """Joints of a log that are where the model's cannot be."""
    beyond = sorted({j for part in parts for j in beyond_reach(structure.arm, part)})
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
            logs=(parts[0].name,),
        )
    ]


def _log_read(
    recording: Recording, structure: Structure, observing: ObserveOptions
) -> tuple[LogRead, list[Diagnosis], tuple[Recording, ...]]:
    """One log by itself; one that cannot be filtered is looked at no further."""
    found = [
        said for name, each in SAMPLE_CHECKS.items() if name not in FILTERED for said in each(recording, observing)
    ]
    parts, done = repaired(recording, structure.arm, observing)
    found += done
    longest = max(parts, key=lambda part: len(part.t))
    try:
        observe(longest, structure, observing)
    except RecordingError as error:
        sentence = f"it cannot be filtered: {str(error).removeprefix(f'{longest.name}: ')}"
        found.append(Diagnosis(name="filters", severity=Severity.WRONG, sentence=sentence, logs=(recording.name,)))
        return LogRead(recording=recording, motions=None), found, parts
    longest = replace(longest, name=recording.name)
    for name in FILTERED:
        found += SAMPLE_CHECKS[name](longest, observing)
    return LogRead(recording=recording, motions=joint_motions(longest, structure.arm, observing)), found, parts
