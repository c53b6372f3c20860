"""Check recordings before anything is identified: each log, then all of them against the model of the arm."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ident.arrays import Array
from ident.checks.arm_remarks import arm_remarks, named_readings
from ident.checks.between_logs import between_remarks, mounted_remarks
from ident.checks.clipping import clipping_remarks
from ident.checks.clock import clock_remarks
from ident.checks.columns import column_remarks
from ident.checks.comparison import Comparison, compared, prepared
from ident.checks.excitation import excitation_remarks, predicted_rel_std
from ident.checks.friction_sign import backward_joints, friction_remarks
from ident.checks.gear_ratio import motor_side
from ident.checks.lateness import delay_remark
from ident.checks.motion import JointMotion, joint_motions, motion_remarks
from ident.checks.noise import noise_remarks
from ident.checks.payload_decides import payload_remarks
from ident.checks.remark import Grade, Remark, worst
from ident.checks.samples import sample_remarks
from ident.checks.several import Several, several_mistakes, several_remark
from ident.checks.warming import Warmth, warming_remarks
from ident.errors import RecordingError
from ident.observation import Observation, ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.problem import Motion, Problem
from ident.recording import Recording
from ident.recording_checks import log_faults
from ident.structure import Structure

LogCheck = Callable[[Recording, ObserveOptions], list[Remark]]
LOG_CHECKS: dict[str, LogCheck] = {
    "clock": lambda recording, _: clock_remarks(recording),
    "samples": lambda recording, _: sample_remarks(recording),
    "clipping": lambda recording, _: clipping_remarks(recording),
}
"""What is asked of the samples alone; any clock will do."""
MOTION_CHECKS: dict[str, LogCheck] = {"noise": noise_remarks, "columns": column_remarks}
"""What is asked of a log that can be filtered."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogRead:
    """One log, as it was checked.

    Attributes:
        recording: The log.
        observed: Its linear system, None where it cannot be filtered.
        motions: How each joint moved, None likewise.
        remarks: What was seen.
    """

    recording: Recording
    observed: Observation | None
    motions: tuple[JointMotion, ...] | None
    remarks: tuple[Remark, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Checked:
    """What a check found.

    Attributes:
        logs: Each log.
        comparison: Of the logs that can be compared, None where there is none.
        backward: Joints, from 0, whose friction drives.
        several: That more than one thing is wrong, None if that is not so.
        remarks: On the model and all logs together.
    """

    logs: tuple[LogRead, ...]
    comparison: Comparison | None
    backward: tuple[int, ...]
    several: Several | None
    remarks: tuple[Remark, ...]

    @property
    def all_remarks(self) -> tuple[Remark, ...]:
        """Every line, log after log, those on the model last."""
        return (*(remark for log in self.logs for remark in log.remarks), *self.remarks)

    @property
    def grade(self) -> Grade:
        """The worst of all."""
        return worst(self.all_remarks)

    @property
    def named(self) -> tuple[str, ...]:
        """Readings that surely explain the logs better, in words; none where more than one thing is wrong."""
        if self.comparison is None or self.several is not None:
            return ()
        found = named_readings(self.comparison, self.backward)
        return tuple(reading.words for each in found for reading in each.readings)


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
        gains: When a gain would count as identifiable.
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
    read = [_log_read(each, structure, observing) for each in recordings]
    observed = {k: each.observed for k, each in enumerate(read) if each.observed is not None}
    usable = [recordings[k] for k in observed]
    warm = warming_remarks(warmths)
    if not usable:
        return Checked(logs=tuple(read), comparison=None, backward=(), several=None, remarks=tuple(warm))
    problems = [Problem(structure, (Motion(each, None),), gains) for each in observed.values()]
    backward = backward_joints(problems, about)
    logs = prepared(structure, usable, observing)
    comparison = compared(logs, motor_side(logs))
    sure = named_readings(comparison, backward)
    several = several_mistakes(logs, sure, observing)
    more = None if several is None else several_remark(several)
    carrying = [loaded is not None and loaded[k] for k in observed]
    mounted = (payload if carries else None for carries in carrying)
    problem = Problem(structure, tuple(map(Motion, observed.values(), mounted)), gains)
    remarks = between_remarks(problem, logs, comparison)
    wrong = worst(remarks) is Grade.WRONG
    if not wrong:  # whatever else would be named is not it
        remarks += arm_remarks(comparison, backward, more)
        remarks += friction_remarks(backward)
        wrong = worst(remarks) is Grade.WRONG
    if payload is not None and any(carrying) and not all(carrying):
        remarks += mounted_remarks(problem, usable)
    if payload is not None:
        said = payload_remarks(logs, carrying, payload, comparison.same)
        remarks += [each for each in said if each.grade is Grade.GOOD or not wrong]
    if payload is not None and about is not None and not carrying[0]:
        first = problems[0].motions[0].observation
        remarks += excitation_remarks(usable[0].name, predicted_rel_std(first, payload, about, gains), gains)
    return Checked(
        logs=tuple(read), comparison=comparison, backward=backward, several=several, remarks=(*remarks, *warm)
    )


def _log_read(recording: Recording, structure: Structure, options: ObserveOptions) -> LogRead:
    """One log by itself; what cannot be filtered is not looked at further."""
    remarks = [
        Remark(topic="values", log=recording.name, seen=f"{fault.sentence}; {fault.advice}", grade=Grade.WRONG)
        for fault in log_faults(recording)
    ]
    remarks = remarks or [Remark(topic="values", log=recording.name, seen="no jumps, no spikes")]
    for each in LOG_CHECKS.values():
        remarks += each(recording, options)
    try:
        observed = observe(recording, structure, options)
    except RecordingError as error:
        seen = _without_name(error, recording)
        remarks.append(Remark(topic="model", log=recording.name, seen=f"not compared: {seen}", grade=Grade.WRONG))
        return LogRead(recording=recording, observed=None, motions=None, remarks=tuple(remarks))
    motions = joint_motions(recording, structure.arm, options)
    for each in MOTION_CHECKS.values():
        remarks += each(recording, options)
    remarks += motion_remarks(recording, motions)
    remarks.append(delay_remark(recording, observed, options))
    return LogRead(recording=recording, observed=observed, motions=motions, remarks=tuple(remarks))


def _without_name(error: Exception, recording: Recording) -> str:
    return str(error).removeprefix(f"{recording.name}: ")
