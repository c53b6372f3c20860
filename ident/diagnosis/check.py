"""Check recordings before anything is identified: the samples of each, then all of them against the model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ident.arrays import Array
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, worst_first
from ident.diagnosis.samples import FILTERED, SAMPLE_CHECKS
from ident.diagnosis.samples.motion import JointMotion, joint_motions
from ident.diagnosis.samples.temperature import Warmth, temperature
from ident.errors import RecordingError
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.recording import Recording
from ident.recording_repairs import repaired
from ident.structure import Structure


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
    """

    logs: tuple[LogRead, ...]
    found: Diagnosed


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

    Raises:
        RecordingError: If a recording has other joints than the arm.
    """
    n = structure.arm.n
    for each in recordings:
        if each.n != n:
            raise RecordingError(f"{each.name}: {each.n} joints, but robot {structure.arm.name} has {n}")
    logs, found = list[LogRead](), list[Diagnosis]()
    for each in recordings:
        read, said = _log_read(each, structure, observing)
        logs.append(read)
        found += said
    found += temperature(warmths)
    return Checked(logs=tuple(logs), found=Diagnosed(diagnoses=worst_first(found)))


def _log_read(recording: Recording, structure: Structure, observing: ObserveOptions) -> tuple[LogRead, list[Diagnosis]]:
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
        return LogRead(recording=recording, motions=None), found
    longest = replace(longest, name=recording.name)
    for name in FILTERED:
        found += SAMPLE_CHECKS[name](longest, observing)
    return LogRead(recording=recording, motions=joint_motions(longest, structure.arm, observing)), found
