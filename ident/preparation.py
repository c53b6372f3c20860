"""The one door through which logs come: checked, repaired where that needs no guess, and observed."""

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from ident.arm import Arm
from ident.arrays import Mask
from ident.diagnosis.common_delay import common_delay
from ident.diagnosis.diagnose import diagnose
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Severity, worst_first
from ident.diagnosis.logs import Logs, observed_logs
from ident.diagnosis.samples import SAMPLE_CHECKS, SPOILING
from ident.errors import Contradiction, RecordingError
from ident.observation import ObserveOptions, observe
from ident.options import GainOptions
from ident.payload import Payload
from ident.plausibility import check_different, check_joints, check_positions
from ident.problem import Motion, Problem
from ident.recording import Recording
from ident.recording_checks import check_log
from ident.recording_repairs import repaired
from ident.structure import Structure, structure_of

OBSERVE_DEFAULTS, GAIN_DEFAULTS = ObserveOptions(), GainOptions()


@dataclass(frozen=True, slots=True, eq=False)
class Recorded:
    """A recording, and what was mounted.

    Attributes:
        recording: One motion.
        payload: As weighed and drawn, None for a bare flange. Recordings of one mounting share one object: whatever of
            the payload is not known is the same for all of them.
    """

    recording: Recording
    payload: Payload | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """How far logs are trusted.

    Attributes:
        repair: Whether their samples are checked, and repaired where that needs no guess.
        doubt: Whether they are compared with everything that they may mean instead.
        repeats: Whether two may hold the same samples, as simulated ones without noise do.
        undelay: Whether a delay of the currents that is common to all of them is measured and undone.
    """

    repair: bool
    doubt: bool
    repeats: bool
    undelay: bool = False


DOUBTED = Policy(repair=True, doubt=True, repeats=False)
"""Logs of a robot."""
KNOWN = Policy(repair=True, doubt=False, repeats=True)
"""Logs that were doubted before, as those of a saved result."""
SIMULATED = Policy(repair=False, doubt=False, repeats=True)
"""Logs of a simulator, which has no fault but those that were asked for."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prepared:
    """Logs, ready to be estimated from.

    Attributes:
        motions: As they are used: repaired, parts of one with a gap one after the other.
        problem: Their linear systems.
        observing: Filters and thresholds, with the delay that was undone.
        policy: How far they are trusted.
        diagnoses: What their samples show, and what was repaired.
        notes: What was done to them otherwise.
    """

    motions: tuple[Recorded, ...]
    problem: Problem
    observing: ObserveOptions
    policy: Policy
    diagnoses: tuple[Diagnosis, ...]
    notes: tuple[str, ...]

    def logs(self) -> Logs:
        """The same, ready to be compared."""
        return observed_logs([each.recording for each in self.motions], self.problem, self.observing)


def prepare(
    motions: Sequence[Recorded],
    robot: Arm | Structure,
    *,
    observing: ObserveOptions = OBSERVE_DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    policy: Policy = DOUBTED,
) -> Prepared:
    """Check, repair and observe the logs of one arm.

    Args:
        motions: In order of time, where that is known.
        robot: The arm that moved, or its structure, which takes a while to find for many joints.
        observing: Filters and thresholds.
        gains: When a gain counts as identifiable.
        policy: How far the logs are trusted.

    Raises:
        RecordingError: If a log cannot be one of this arm, naming what it looks like.
        Contradiction: If its positions are out of reach, naming the fault that explains it.
        NotIdentifiable: If two logs are one.
    """
    structure = robot if isinstance(robot, Structure) else structure_of(robot)
    for each in motions:
        check_joints(structure.arm, each.recording)
    if not policy.repeats:
        check_different([each.recording for each in motions])
    diagnoses, used = list[Diagnosis](), list[Recorded]()
    for each in motions:
        if policy.repair:
            parts, done = repaired(each.recording, structure.arm, observing)
            diagnoses += done
            for part in parts:
                check_log(part)
            seen = seen_in_samples(max(parts, key=lambda part: len(part.t)), observing, skip={one.name for one in done})
            diagnoses += map(left_out, seen)
        else:
            parts = (each.recording,)
        used += [replace(each, recording=part) for part in parts]
    names = {found.name for found in diagnoses}
    beyond = _out_of_reach(used, structure.arm)
    if beyond is not None and not policy.doubt:
        raise beyond
    try:
        observed = tuple(
            Motion(observe(each.recording, structure, observing, spoilt_samples(each.recording, names)), each.payload)
            for each in used
        )
    except RecordingError as error:
        raise (beyond or error) from error
    prepared = Prepared(
        motions=tuple(used),
        problem=Problem(structure, observed, gains),
        observing=observing,
        policy=policy,
        diagnoses=worst_first(diagnoses),
        notes=tuple(note for motion in observed for note in motion.observation.notes),
    )
    if beyond is not None:
        raise_for(prepared, diagnose(prepared.logs()))
        raise beyond
    return _undelayed(prepared, motions) if policy.undelay else prepared


def _undelayed(prepared: Prepared, motions: Sequence[Recorded]) -> Prepared:
    """The same logs without the delay that is common to them, with what is said of it."""
    delay, said = common_delay(prepared.logs())
    if delay:
        prepared = prepare(
            motions, prepared.problem.structure, observing=earlier(prepared.observing, delay),
            gains=prepared.problem.options, policy=replace(prepared.policy, undelay=False),
        )  # fmt: skip
    return replace(prepared, diagnoses=worst_first([*prepared.diagnoses, said]))


def earlier(observing: ObserveOptions, delay: float) -> ObserveOptions:
    """Options for currents that act by a delay [s] earlier than they are logged."""
    return replace(observing, current_delay=observing.current_delay - delay)


def _out_of_reach(motions: Sequence[Recorded], arm: Arm) -> RecordingError | None:
    """Why positions of a log are none of the arm, None where they may be."""
    try:
        for each in motions:
            check_positions(arm, each.recording)
    except RecordingError as error:
        return error
    return None


def raise_for(prepared: Prepared, found: Diagnosed) -> None:
    """Refuse logs as a whole if something is wrong with them.

    Raises:
        Contradiction: Naming the worst.
    """
    wrong = [each for each in (*found.diagnoses, *prepared.diagnoses) if each.severity is Severity.WRONG]
    if wrong:
        raise Contradiction(refusal_of(wrong))


def refusal_of(wrong: Sequence[Diagnosis]) -> str:
    """One line on what is wrong with logs, the worst first."""
    worst = wrong[0]
    rivals = f" (or {' or '.join(worst.rivals[:2])})" if worst.rivals else ""
    more = f"; {len(wrong) - 1} more with rx90 check" if len(wrong) > 1 else ""
    advice = f"; {worst.advice}" if worst.advice else ""
    return f"{worst.sentence}{rivals}{advice}{more}"


def seen_in_samples(recording: Recording, observing: ObserveOptions, *, skip: set[str]) -> list[Diagnosis]:
    """What the samples of one log show that is not good, whatever arm it is of.

    Args:
        recording: As logged.
        observing: Filters.
        skip: Names of what was repaired.
    """
    return [
        found
        for name, each in SAMPLE_CHECKS.items()
        if name not in ("noise", "motion", "values")
        for found in each(recording, observing)
        if found.severity is not Severity.GOOD and found.name not in skip
    ]


def left_out(found: Diagnosis) -> Diagnosis:
    """A diagnosis of samples that are left out, so that they spoil no gain."""
    if found.name not in SPOILING or found.severity is not Severity.WRONG:
        return found
    return replace(found, severity=Severity.WEAK, sentence=f"{found.sentence}; these samples are left out")


def spoilt_samples(recording: Recording, names: Set[str]) -> Mask | None:
    """Samples that what was found spoils, of each joint, shape (N, n); None where nothing does.

    Args:
        recording: The log.
        names: Of what was found in the logs.
    """
    masks = [spoilt(recording) for name, spoilt in SPOILING.items() if name in names]
    return np.logical_or.reduce(masks) if masks else None


def joined(*parts: Diagnosed, more: Sequence[Diagnosis] = ()) -> Diagnosed:
    """What is said of the same logs in several places."""
    return Diagnosed(
        diagnoses=worst_first([*(each for part in parts for each in part.diagnoses), *more]),
        excluded=tuple(each for part in parts for each in part.excluded),
        untold=tuple(each for part in parts for each in part.untold),
    )
