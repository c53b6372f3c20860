"""Identify drive gains from bare and loaded recordings: check, observe, estimate, check."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ident.agreement import agreed, disagreement_notes, disagreements, refused
from ident.arm import Arm
from ident.conclusion import concluded
from ident.consistency import CHECKS, Check, findings
from ident.consistency.evidence import Evidence
from ident.consistency.finding import Finding
from ident.consistency.joints import torn
from ident.contradiction import check_shape, check_signs
from ident.errors import Contradiction, NotConverged, NotIdentifiable
from ident.estimate import GainEstimate
from ident.estimators import DEFAULT, estimator, ls_2011
from ident.lag import in_time, lag_notes, lags, with_suspects
from ident.observation import ObserveOptions, observe
from ident.odd_gains import odd_gain_notes
from ident.one_log import Counting, alike, scale_notes
from ident.options import GainOptions
from ident.payload import Payload
from ident.plausibility import (
    SamenessCheck,
    check_different,
    check_load,
    check_positions,
    check_swapped,
    residual_notes,
)
from ident.problem import Motion, Problem
from ident.rates import rate_notes
from ident.recording import Recording
from ident.structure import Structure, structure_of
from ident.wiring import WiringCheck, check_wiring, known_wiring

OBSERVE_DEFAULTS, GAIN_DEFAULTS = ObserveOptions(), GainOptions()
ALONE = "larger"
"""Uncertainty that the limits of contradictions were measured with (`docs/derivations.md`)."""
ALONE_OPTIONS = ls_2011.JointByJointOptions()


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


@dataclass(frozen=True, slots=True, eq=False)
class Identification:
    """What `identify` found.

    Attributes:
        estimate: A gain or a reason for each joint, with what proves it, and the payload parameters found on the way.
        notes: What was done to the recordings, and what their owner should know.
        findings: What the consistency tests found; those that fail are among the notes.
    """

    estimate: GainEstimate
    notes: tuple[str, ...]
    findings: tuple[Finding, ...] = ()


def identify(
    unloaded: Recording,
    loaded: Recording,
    robot: Arm | Structure,
    payload: Payload,
    *,
    method: str = DEFAULT,
    options: object | None = None,
    observing: ObserveOptions = OBSERVE_DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    wiring: WiringCheck = check_wiring,
    checks: Mapping[str, Check] = CHECKS,
) -> Identification:
    """Identify drive gains from one bare and one loaded motion; arguments as `identify_motions`."""
    return identify_motions(
        (Recorded(unloaded), Recorded(loaded, payload)),
        robot,
        method=method,
        options=options,
        observing=observing,
        gains=gains,
        wiring=wiring,
        checks=checks,
    )


def identify_motions(
    motions: Sequence[Recorded],
    robot: Arm | Structure,
    *,
    method: str = DEFAULT,
    options: object | None = None,
    observing: ObserveOptions = OBSERVE_DEFAULTS,
    gains: GainOptions = GAIN_DEFAULTS,
    wiring: WiringCheck = check_wiring,
    sameness: SamenessCheck = check_different,
    checks: Mapping[str, Check] = CHECKS,
) -> Identification:
    """Identify drive gains from any number of motions, bare and with one or more mountings of a payload.

    Args:
        motions: In order of time, where that is known.
        robot: The arm that moved, or its structure, which takes a while to find for many joints.
        method: A name in `ESTIMATORS`.
        options: The method's own, of the class that `ESTIMATORS` names; its defaults if None.
        observing: Filters and thresholds.
        gains: When a gain counts as identifiable, and how its uncertainty is found.
        wiring: What makes sure that the logs are of this arm; `known_wiring` where nobody doubts it.
        sameness: What makes sure that no recording is given twice; `repeatable` where motions are simulated.
        checks: Consistency tests of the estimate; `UNCHECKED` where nobody reads what they say.

    Raises:
        IdentificationError: One class a cause, if the data cannot be what they are said to be; the message says what
            they look like.
    """
    chosen = estimator(method)
    structure = robot if isinstance(robot, Structure) else structure_of(robot)
    for motion in motions:
        check_positions(structure.arm, motion.recording)
    sameness([motion.recording for motion in motions])
    observed = tuple(Motion(observe(each.recording, structure, observing), each.payload) for each in motions)
    problem = Problem(structure, observed, gains)

    def wired() -> None:
        for first, second in _compared(motions):
            wiring(structure, first.recording, second.recording, observing)

    counted = list[Counting]()
    if wiring is known_wiring:
        wired()
    else:
        counted = alike(problem, [each.recording.name for each in motions], wired)
    bare = any(motion.payload is None for motion in motions)
    alone = joint_by_joint(problem)
    if alone is not None:
        check_alone(problem, alone)
    wanted = chosen.options() if options is None else options
    if alone is not None and method == ls_2011.NAME and wanted == ALONE_OPTIONS:
        estimate = concluded(method, problem, alone.solution)  # found already, judged by another uncertainty
    else:
        try:
            estimate = chosen.estimate(problem, wanted)
        except NotConverged:
            if alone is not None:  # the joints alone may say why
                check_load(alone, bare=bare)
            raise
    check_load(estimate, bare=bare)
    if alone is None:
        check_alone(problem, estimate)
    late = lags(problem, estimate)
    estimate = in_time(estimate, late)
    different = disagreements(problem, estimate, drift=chosen.drift)
    observation_notes = tuple(note for motion in observed for note in motion.observation.notes)
    kept = agreed(estimate, different)
    found = findings(Evidence(problem=problem, estimate=kept, drift=chosen.drift), checks)
    kept = refused(kept, torn(found))
    notes = (
        estimate.remarks
        + tuple(each.sentence for each in found if each.sentence is not None)
        + observation_notes
        + rate_notes([each.recording for each in motions])
        + scale_notes(counted)
        + odd_gain_notes(kept)
        + lag_notes(late)
        + disagreement_notes(different)
        + residual_notes(estimate)
    )
    return Identification(kept, notes, found)


def check_alone(problem: Problem, estimate: GainEstimate) -> None:
    """Refuse what no gains can explain.

    Whether a load shows is not asked: the joints alone may not see one that the method sees.
    """
    check_swapped(estimate)
    try:
        check_signs(estimate)
        check_shape(problem, estimate)
    except Contradiction as error:  # a delay makes one too
        raise Contradiction(with_suspects(str(error), lags(problem, estimate))) from None


def joint_by_joint(problem: Problem) -> GainEstimate | None:
    """What each joint says alone (eq. 27), None where no payload of known parameters makes a difference.

    Signs and shapes that contradict each other show here: a fit of all joints together settles between them.
    """
    options = replace(problem.options, uncertainty=ALONE)
    try:
        return ls_2011.joint_by_joint_gains(replace(problem, options=options), ALONE_OPTIONS)
    except NotIdentifiable:
        return None


def _compared(motions: Sequence[Recorded]) -> list[tuple[Recorded, Recorded]]:
    """A motion with a bare flange, if there is one, beside the first of each mounting."""
    first = next((each for each in motions if each.payload is None), motions[0])
    others = {id(each.payload): each for each in reversed(motions) if each.payload is not first.payload}
    return [(first, other) for other in reversed(others.values())] or [(first, each) for each in motions[1:2]]
