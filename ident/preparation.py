"""Preparation of logs for an estimate: checks, unambiguous repairs, and filtering into linear systems."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from ident.diagnosis.common_delay import common_delay
from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, worst_first
from ident.diagnosis.logs import Logs, observed_logs
from ident.diagnosis.plausibility import check_different, check_joints, check_positions
from ident.diagnosis.repairs import repaired
from ident.diagnosis.samples import FILTERED, OF_THE_MOTION, SAMPLE_CHECKS, SPOILING
from ident.estimation.gain_options import GainOptions
from ident.estimation.problem import ObservedMotion, Problem
from ident.model.arm import Arm
from ident.model.structure import Structure, structure_of
from ident.observation.following import following
from ident.observation.observation import Observation, ObserveOptions, observe
from ident.payload.payload import Payload
from ident.recordings.checks import check_log
from ident.recordings.motion import Motion
from ident.recordings.recording import Recording
from ident.support.arrays import Mask
from ident.support.errors import Contradiction, RecordingError

OBSERVE_DEFAULTS, GAIN_DEFAULTS = ObserveOptions(), GainOptions()


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """Policy for checks and repairs of logs.

    Attributes:
        repair: Whether samples are checked, and repaired if the repair is unambiguous.
        doubt: Whether the logs are tested for faults with alternative hypotheses.
        repeats: Whether two logs may have the same samples, as simulated ones without noise.
        undelay: Whether a common delay of all currents is estimated and corrected.
    """

    repair: bool
    doubt: bool
    repeats: bool
    undelay: bool = False


DOUBTED = Policy(repair=True, doubt=True, repeats=False)
"""Logs of a robot."""
KNOWN = Policy(repair=True, doubt=False, repeats=True)
"""Policy for logs that were tested before, as those of a saved result."""
SIMULATED = Policy(repair=False, doubt=False, repeats=True)
"""Policy for simulated logs, which have only requested faults."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A prepared recording: a log, or a part of it between two gaps.

    Attributes:
        recording: Repaired recording.
        spoilt: Mask of invalid samples of each joint, shape (N, n); None if there are none.
        observation: Its linear system.
    """

    recording: Recording
    spoilt: Mask | None
    observation: Observation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Examined:
    """One log.

    Attributes:
        recording: The original recording.
        repaired: Its parts, with unambiguous repairs.
        repairs: Diagnoses of the repairs.
        diagnoses: Results of the checks of its samples, by name of the check.
        parts: Prepared parts; empty if the log cannot be filtered.
        unfit: Why the log cannot be filtered, None if it can.
    """

    recording: Recording
    repaired: tuple[Recording, ...]
    repairs: tuple[Diagnosis, ...]
    diagnoses: Mapping[str, tuple[Diagnosis, ...]]
    parts: tuple[Part, ...]
    unfit: RecordingError | None

    @property
    def longest(self) -> Recording:
        """Return the longest part, with the name of the log."""
        part = max(self.repaired, key=lambda part: len(part.t))
        return part if part.name == self.recording.name else replace(part, name=self.recording.name)

    @property
    def findings(self) -> tuple[Diagnosis, ...]:
        """Return diagnoses of faults that invalidate gains, and of repairs."""
        done = {each.name for each in self.repairs}
        seen = [each for name, found in self.diagnoses.items() if name not in OF_THE_MOTION for each in found]
        found = (each for each in seen if each.severity is not Severity.GOOD and each.name not in done)
        return (*self.repairs, *map(left_out, found))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """Prepared logs.

    Attributes:
        motions: Repaired motions, with the parts of a log between gaps in sequence.
        parts: The motions with their invalid samples and linear systems.
        problem: Linear systems with payloads.
        observing: Filters and thresholds, with the delay that was corrected.
        policy: Policy for checks and repairs.
        diagnoses: Diagnoses of samples and repairs.
        remarks: Remarks on automatic choices.
    """

    motions: tuple[Motion, ...]
    parts: tuple[Part, ...]
    problem: Problem
    observing: ObserveOptions
    policy: Policy
    diagnoses: tuple[Diagnosis, ...]
    remarks: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on changes of the logs."""
        return (*self.remarks, *(note for each in self.parts for note in each.observation.notes))

    def logs(self) -> Logs:
        """Return the logs for comparisons of hypotheses."""
        recordings, spoilt = ([each.recording for each in self.parts], [each.spoilt for each in self.parts])
        return observed_logs(recordings, self.problem, self.observing, spoilt)


def prepare(
    motions: Sequence[Motion],
    robot: Arm | Structure,
    *,
    observing: ObserveOptions = OBSERVE_DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    policy: Policy = DOUBTED,
) -> Prepared:
    """Check, repair and observe the logs of one arm.

    Args:
        motions: Motions, in order of time if known.
        robot: The arm, or its structure, whose computation takes a while for many joints.
        observing: Filters and thresholds.
        gains: Limits for accepting a gain.
        policy: Policy for checks and repairs of the logs.

    Raises:
        RecordingError: If a log is not of this arm; the message states the probable fault.
        Contradiction: If its positions exceed the limits; the message states the probable fault.
        NotIdentifiable: If two logs have the same motion.
    """
    structure = robot if isinstance(robot, Structure) else structure_of(robot)
    for each in motions:
        check_joints(structure.arm, each.recording)
    if not policy.repeats:
        check_different([each.recording for each in motions])
    observing, lowered = following(observing, [each.recording for each in motions])
    logs = [(examined if policy.repair else trusted)(each.recording, structure, observing) for each in motions]
    used = [part for log in logs for part in log.repaired]
    if policy.repair:
        for each in used:
            check_log(each)
    beyond = _out_of_reach(used, structure.arm)
    if beyond is not None and not policy.doubt:
        raise beyond
    for each in logs:
        if each.unfit is not None:
            raise (beyond or each.unfit) from each.unfit
    prepared = assembled(logs, [each.payload for each in motions], structure, observing, gains, policy)
    prepared = replace(prepared, remarks=() if lowered is None else (lowered,))
    if beyond is not None:
        raise_for(prepared, diagnose(prepared.logs()))
        raise beyond
    if policy.undelay:
        prepared, diagnosis = undelayed(prepared)
        prepared = replace(prepared, diagnoses=worst_first([*prepared.diagnoses, diagnosis]))
    return prepared


def undelayed(prepared: Prepared) -> tuple[Prepared, Diagnosis]:
    """Return logs with the common delay of the currents corrected, and its diagnosis."""
    delay, diagnosis = common_delay(prepared.logs())
    if not delay:
        return prepared, diagnosis
    observing = replace(prepared.observing, current_delay=prepared.observing.current_delay - delay)
    structure, problem = prepared.problem.structure, prepared.problem
    parts = tuple(
        replace(each, observation=observe(each.recording, structure, observing, each.spoilt)) for each in prepared.parts
    )
    motions = tuple(
        replace(motion, observation=part.observation) for motion, part in zip(problem.motions, parts, strict=True)
    )
    return replace(prepared, parts=parts, problem=replace(problem, motions=motions), observing=observing), diagnosis


def assembled(
    logs: Sequence[Examined],
    payloads: Sequence[Payload | None],
    structure: Structure,
    observing: ObserveOptions,
    gains: GainOptions,
    policy: Policy,
) -> Prepared:
    """Return the logs that can be filtered as one problem, with payloads."""
    carried = [(part, payload) for log, payload in zip(logs, payloads, strict=True) for part in log.parts]
    return Prepared(
        motions=tuple(Motion(part.recording, payload) for part, payload in carried),
        parts=tuple(part for part, _ in carried),
        problem=Problem(
            structure, tuple(ObservedMotion(part.observation, payload) for part, payload in carried), gains
        ),
        observing=observing,
        policy=policy,
        diagnoses=worst_first([each for log in logs for each in log.findings]),
    )


def examined(recording: Recording, structure: Structure, observing: ObserveOptions) -> Examined:
    """Check, repair and observe one log."""
    diagnoses = {
        name: tuple(each(recording, observing)) for name, each in SAMPLE_CHECKS.items() if name not in FILTERED
    }
    parts, repairs = repaired(recording, structure.arm, observing)
    names = {
        each.name for found in (*diagnoses.values(), repairs) for each in found if each.severity is not Severity.GOOD
    }
    found = _observed(recording, parts, structure, observing, names)
    if found.unfit is None:
        diagnoses |= {name: tuple(SAMPLE_CHECKS[name](found.longest, observing)) for name in FILTERED}
    return replace(found, repairs=repairs, diagnoses=diagnoses)


def trusted(recording: Recording, structure: Structure, observing: ObserveOptions) -> Examined:
    """Observe one log as it is."""
    return _observed(recording, (recording,), structure, observing, set())


def _observed(
    recording: Recording, parts: tuple[Recording, ...], structure: Structure, observing: ObserveOptions, names: Set[str]
) -> Examined:
    """Return the observed parts of one log, without invalid samples."""
    unfit, ready = None, list[Part]()
    try:
        for each in parts:
            spoilt = spoilt_samples(each, names)
            ready.append(Part(each, spoilt, observe(each, structure, observing, spoilt)))
    except RecordingError as error:
        unfit, ready = error, []
    return Examined(recording=recording, repaired=parts, repairs=(), diagnoses={}, parts=tuple(ready), unfit=unfit)


def _out_of_reach(recordings: Sequence[Recording], arm: Arm) -> RecordingError | None:
    """Return why positions of a log are impossible for the arm, None if they are not."""
    try:
        for each in recordings:
            check_positions(arm, each)
    except RecordingError as error:
        return error
    return None


def raise_for(prepared: Prepared, found: Diagnosed) -> None:
    """Refuse all logs if one has a fault.

    Raises:
        Contradiction: If there is a fault; the message states the worst one.
    """
    wrong = [each for each in (*found.diagnoses, *prepared.diagnoses) if each.severity is Severity.WRONG]
    if wrong:
        raise Contradiction(refusal_of(wrong))


def refusal_of(wrong: Sequence[Diagnosis]) -> str:
    """Return one line on the faults of logs, the worst first."""
    worst = wrong[0]
    rivals = f" (or {' or '.join(worst.rivals[:2])})" if worst.rivals else ""
    more = f"; rx90 check lists {len(wrong) - 1} more" if len(wrong) > 1 else ""
    advice = f"; {worst.advice}" if worst.advice else ""
    return f"{worst.sentence}{rivals}{advice}{more}"


def left_out(found: Diagnosis) -> Diagnosis:
    """Return the diagnosis of invalid samples as a warning, as they are removed."""
    if found.name not in SPOILING or found.severity is not Severity.WRONG:
        return found
    return replace(found, severity=Severity.WEAK, sentence=f"{found.sentence}; these samples are left out")


def spoilt_samples(recording: Recording, names: Set[str]) -> Mask | None:
    """Return the mask of invalid samples of each joint, shape (N, n); None if there are none."""
    masks = [spoilt(recording) for name, spoilt in SPOILING.items() if name in names]
    return np.logical_or.reduce(masks) if masks else None


def joined(*parts: Diagnosed, more: Sequence[Diagnosis] = ()) -> Diagnosed:
    """Return the merged diagnoses of the same logs."""
    return Diagnosed(
        diagnoses=worst_first([*(each for part in parts for each in part.diagnoses), *more]),
        excluded=tuple(each for part in parts for each in part.excluded),
        indistinguishable=tuple(each for part in parts for each in part.indistinguishable),
        indistinguishable_together=tuple(each for part in parts for each in part.indistinguishable_together),
    )
