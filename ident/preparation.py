"""Preparation of logs for an estimate: checks, unambiguous repairs, and filtering into linear systems."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ident.diagnosis.diagnose import common_delay, diagnose
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, worst_first
from ident.diagnosis.hypothesis import Logs
from ident.diagnosis.motion_quality import by_joint
from ident.diagnosis.plausibility import check_different, check_joints, check_positions
from ident.diagnosis.samples import FILTERED, OF_THE_MOTION, SAMPLE_CHECKS, SPOILING, repaired
from ident.diagnosis.search import MOST
from ident.estimation.problem import GainOptions, ObservedMotion, Problem
from ident.model.arm import Arm
from ident.model.structure import Structure, structure_from
from ident.observation.observation import DEFAULTS, Observation, ObserveOptions, following, observe
from ident.payload.payload import Payload
from ident.recordings.checks import check_log
from ident.recordings.recording import Motion, Recording, motions_of
from ident.support.arrays import Mask, once_per_object
from ident.support.errors import Contradiction, OptionError, RecordingError

GAIN_DEFAULTS = GainOptions()


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """Policy for checks and repairs of logs."""

    checked: bool = True  # samples are checked and repaired if unambiguous, and logs tested for faults
    refuse: bool = True  # logs that cannot be used, or repeat another, are refused, not left out
    undelay: bool = False  # a common delay of all currents is estimated and corrected

    @property
    def repeats(self) -> bool:
        """Whether two logs may have the same samples, as simulated ones without noise."""
        return not (self.checked and self.refuse)


DOUBTED = Policy()
"""Logs of a robot."""
REPORTED = Policy(refuse=False)
"""Policy for a report on logs of a robot."""
SIMULATED = Policy(checked=False)
"""Policy for simulated logs, which have only requested faults."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A repaired log, or a part of it between two gaps, with its invalid samples (N, n) if any, and linear system."""

    recording: Recording
    spoilt: Mask | None
    observation: Observation


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Examined:
    """One log."""

    recording: Recording
    repaired: tuple[Recording, ...]  # its parts, with unambiguous repairs
    longest: Recording  # the longest part, with the name of the log
    repairs: tuple[Diagnosis, ...]
    diagnoses: Mapping[str, tuple[Diagnosis, ...]]  # results of the checks of its samples, by name of the check
    parts: tuple[Part, ...]  # prepared parts; empty if the log cannot be filtered
    unfit: RecordingError | None  # why the log cannot be filtered, None if it can

    @property
    def findings(self) -> tuple[Diagnosis, ...]:
        """Return diagnoses of faults that invalidate gains, and of repairs; invalid samples are a warning."""
        done, found = {each.name for each in self.repairs}, list(self.repairs)
        for each in (one for name, own in self.diagnoses.items() if name not in OF_THE_MOTION for one in own):
            if each.severity is not Severity.GOOD and each.name not in done:
                left_out = each.name in SPOILING and each.severity is Severity.WRONG
                sentence = f"{each.sentence}; these samples are left out"
                found.append(replace(each, severity=Severity.WEAK, sentence=sentence) if left_out else each)
        return tuple(found)


@dataclass(frozen=True, kw_only=True, eq=False)
class Prepared:
    """Prepared logs."""

    motions: tuple[Motion, ...]  # repaired motions, with the parts of a log between gaps in sequence
    parts: tuple[Part, ...]  # the motions with their invalid samples and linear systems
    problem: Problem
    observing: ObserveOptions  # filters and thresholds, with the delay that was corrected
    policy: Policy
    diagnoses: tuple[Diagnosis, ...]
    remarks: tuple[str, ...] = ()
    examined: tuple[Examined, ...] = field(default=(), repr=False)  # all logs, also those that cannot be filtered
    delay: Diagnosis | None = None  # diagnosis of a common delay of the currents, None if it was not estimated

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on changes of the logs."""
        return (*self.remarks, *(note for each in self.parts for note in each.observation.notes))

    def carrying(self, payload: Payload) -> "Prepared":
        """The same with another description of all payloads that are mounted."""
        motions = tuple(each if each.payload is None else replace(each, payload=payload) for each in self.motions)
        observed = (each if each.payload is None else replace(each, payload=payload) for each in self.problem.motions)
        return replace(self, motions=motions, problem=replace(self.problem, motions=tuple(observed)))

    @once_per_object
    def logs(self) -> Logs:
        """Return the logs for comparisons of hypotheses."""
        recordings, spoilt = (each.recording for each in self.parts), (each.spoilt for each in self.parts)
        return Logs(tuple(recordings), self.problem, self.observing, tuple(spoilt))


def prepare(
    motions: Sequence[Motion],
    robot: Arm | Structure,
    *,
    observing: ObserveOptions = DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    policy: Policy = DOUBTED,
) -> Prepared:
    """Check, repair and observe the logs of one arm, in order of time if known.

    The structure of an arm instead of the arm saves its computation, which takes a while for many joints.

    Raises:
        RecordingError: If a log is not of this arm; the message states the probable fault.
        Contradiction: If its positions exceed the limits; the message states the probable fault.
        NotIdentifiable: If two logs have the same motion.
    """
    motions, structure = motions_of(motions), structure_from(robot)
    for what, given, kind in (("observing", observing, ObserveOptions), ("gains", gains, GainOptions)):
        if not isinstance(given, kind):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise OptionError(f"{what} is {type(given).__name__}; expected {kind.__name__}")
    for each in motions:
        check_joints(structure.arm, each.recording)
    if not policy.repeats:
        check_different([each.recording for each in motions])
    observing, lowered = following(observing, [each.recording for each in motions])
    logs = tuple(examined(each.recording, structure, observing, policy) for each in motions)
    carried = [(part, each.payload) for log, each in zip(logs, motions, strict=True) for part in log.parts]
    prepared = Prepared(
        motions=tuple(Motion(part.recording, payload) for part, payload in carried),
        parts=tuple(part for part, _ in carried),
        problem=Problem(structure, tuple(ObservedMotion(part.observation, its) for part, its in carried), gains),
        observing=observing,
        policy=policy,
        diagnoses=worst_first([each for log in logs for each in log.findings]),
        remarks=() if lowered is None else (lowered,),
        examined=logs,
    )
    if policy.refuse:
        _refuse_unfit(prepared)
    return _undelayed(prepared) if policy.undelay and prepared.parts else prepared


def _refuse_unfit(prepared: Prepared) -> None:
    """Refuse logs of wrong values, of positions beyond the limits, or that cannot be filtered; faults are the cause."""
    policy, arm, beyond = prepared.policy, prepared.problem.structure.arm, None
    used = [part for log in prepared.examined for part in log.repaired]
    for each in used if policy.checked else ():
        check_log(each)
    try:
        for each in used:
            check_positions(arm, each)
    except RecordingError as error:
        if not policy.checked:
            raise
        beyond = error
    for each in prepared.examined:
        if each.unfit is not None:
            raise (beyond or each.unfit) from each.unfit
    if beyond is not None:
        raise_for([*diagnose(prepared.logs()).diagnoses, *prepared.diagnoses])
        raise beyond


def examined(
    recording: Recording, structure: Structure, observing: ObserveOptions, policy: Policy = DOUBTED
) -> Examined:
    """Check, repair and observe one log; only observe it if the policy says so."""
    whole, repairs, diagnoses = (recording,), tuple[Diagnosis, ...](), dict[str, tuple[Diagnosis, ...]]()
    unfit, parts = None, list[Part]()
    if policy.checked:
        early = {name: each for name, each in SAMPLE_CHECKS.items() if name not in FILTERED}
        diagnoses = {name: tuple(each(recording, observing)) for name, each in early.items()}
        whole, repairs = repaired(recording, structure.arm, observing)
    longest = max(whole, key=lambda part: len(part.t))
    longest = longest if longest.name == recording.name else replace(longest, name=recording.name)
    seen = (each for found in (*diagnoses.values(), repairs) for each in found)
    names = {each.name for each in seen if each.severity is not Severity.GOOD}
    try:
        for each in whole:
            masks = [spoilt(each) for name, spoilt in SPOILING.items() if name in names]
            invalid = np.logical_or.reduce(masks) if masks else None
            parts.append(Part(each, invalid, observe(each, structure, observing, invalid)))
    except RecordingError as error:
        unfit, parts = error, []
    if policy.checked and unfit is None:
        diagnoses |= {name: tuple(SAMPLE_CHECKS[name](longest, observing)) for name in FILTERED}
    by_joint.cache_clear()
    return Examined(
        recording=recording,
        repaired=whole,
        longest=longest,
        repairs=repairs,
        diagnoses=diagnoses,
        parts=tuple(parts),
        unfit=unfit,
    )


def _undelayed(prepared: Prepared) -> Prepared:
    """Return logs with the common delay of the currents corrected, and its diagnosis."""
    delay, diagnosis = common_delay(prepared.logs())
    prepared = replace(prepared, delay=diagnosis, diagnoses=worst_first([*prepared.diagnoses, diagnosis]))
    if not delay:
        return prepared
    observing = replace(prepared.observing, current_delay=prepared.observing.current_delay - delay)
    structure, motions = prepared.problem.structure, prepared.problem.motions
    seen = [observe(part.recording, structure, observing, part.spoilt) for part in prepared.parts]
    parts = tuple(replace(part, observation=each) for part, each in zip(prepared.parts, seen, strict=True))
    motions = tuple(replace(motion, observation=each) for motion, each in zip(motions, seen, strict=True))
    return replace(prepared, parts=parts, problem=replace(prepared.problem, motions=motions), observing=observing)


def raise_for(diagnoses: Sequence[Diagnosis]) -> None:
    """Refuse all logs if one has a fault; raises `Contradiction`, whose message states the first one."""
    wrong = [each for each in diagnoses if each.severity is Severity.WRONG]
    if wrong:
        raise Contradiction(refusal_of(wrong))


def refusal_of(wrong: Sequence[Diagnosis]) -> str:
    """Return one line on the faults of logs, the worst first."""
    worst = wrong[0]
    rivals = f" (or {' or '.join(worst.rivals[:2])})" if worst.rivals else ""
    another = ": logs of another robot?" if len(wrong) >= MOST else ""  # the search ended, not the faults
    more = f"; rx90 check lists {len(wrong) - 1} more{another}" if len(wrong) > 1 else ""
    advice = f"; {worst.advice}" if worst.advice else ""
    return f"{worst.sentence}{rivals}{advice}{more}"


def joined(*parts: Diagnosed, more: Sequence[Diagnosis] = ()) -> Diagnosed:
    """Return the merged diagnoses of the same logs."""
    return Diagnosed(
        diagnoses=worst_first([*(each for part in parts for each in part.diagnoses), *more]),
        excluded=tuple(each for part in parts for each in part.excluded),
        undetectable=tuple(each for part in parts for each in part.undetectable),
        largest_undetected=next((each.largest_undetected for each in parts if each.largest_undetected), None),
    )
