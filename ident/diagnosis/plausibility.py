"""Checks that a number alone cannot fail: degrees for radians, the same file twice, files swapped, no load.

Each raises one error that says what the data look like and what to do, before or after an estimate that would
otherwise look like an answer.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ident.estimation.estimate import GainEstimate, RefusedGain
from ident.estimation.estimators.ls_2011 import JointByJointOptions, joint_by_joint_gains
from ident.estimation.gain_signs import FRICTION_Z, joint_signs
from ident.estimation.problem import Problem
from ident.model.arm import Arm
from ident.recordings.copies import share_samples
from ident.recordings.current_noise import same_noise
from ident.recordings.motion import Motion
from ident.recordings.recording import NO_JOINT, Recording
from ident.support.errors import IdentificationError, NotIdentifiable, RecordingError

LOAD_Z = 4.0
"""Standard deviations that 1/g must differ from zero by on some joint for a load to be there."""
FAINT_Z = 12.0
"""Deviations below which on all joints an absent payload is suspected: a method whose gains keep their sign, as `nls`,
finds 4 to 10 of none (two bare motions of a UR-like arm, six seeds)."""
RECORD_BARE = "record one with nothing on the flange (--unloaded)"
LARGE_RESIDUAL = 0.15
"""Share of a joint's current above which its residual is worth a note."""


def check_joints(arm: Arm, recording: Recording) -> None:
    """Refuse a recording of more or fewer joints than the arm has.

    Raises:
        RecordingError: If so.
    """
    if recording.n != arm.n:
        raise RecordingError(
            f"{recording.name}: {recording.n} joints, but robot {arm.name} has {arm.n}; check the model or the columns"
            f"{NO_JOINT if recording.n > arm.n else ''}"
        )


def check_positions(arm: Arm, recording: Recording) -> None:
    """Refuse positions that no joint of the arm can reach, and say if they look like degrees.

    Raises:
        RecordingError: Naming the joint.
    """
    check_joints(arm, recording)
    slack = 0.1
    for j in range(arm.n):
        if not arm.revolute[j]:
            continue
        lower, upper = max(arm.lower[j], -4.0 * np.pi), min(arm.upper[j], 4.0 * np.pi)
        low, high = float(recording.q[:, j].min()), float(recording.q[:, j].max())
        if low < lower - slack or high > upper + slack:
            reachable = np.deg2rad(low) >= lower - slack and np.deg2rad(high) <= upper + slack
            degrees = reachable and max(-low, high) > 2.0 * np.pi
            advice = "the log looks like degrees; convert q to radians" if degrees else "check the model and the units"
            raise RecordingError(
                f"{recording.name}: q{j + 1} runs from {low:.4g} to {high:.4g}, outside the range {lower:.4g} to "
                f"{upper:.4g} rad of {arm.joint_names[j]}; {advice}"
            )


def check_different(recordings: Sequence[Recording]) -> None:
    """Refuse one recording given for two motions, whole or in part: its rows would count twice.

    Raises:
        NotIdentifiable: If two hold the same samples.
    """
    for first, second in combinations(recordings, 2):
        if share_samples(first, second):
            raise NotIdentifiable(
                f"{first.name} and {second.name} contain the same motion, fully or partly; record each motion anew"
            )


def check_copies(unseen: Recording, seen: Sequence[Recording]) -> None:
    """Refuse a recording that is another one resampled, shifted in time, smoothed or truncated.

    Raises:
        NotIdentifiable: If so.
    """
    for each in seen:
        if same_noise(unseen, each):
            raise NotIdentifiable(
                f"{unseen.name} has the current noise of {each.name}, so it is a resampled, shifted, smoothed or "
                "truncated copy of it; record each motion anew"
            )


def check_payloads(motions: Sequence[Motion]) -> None:
    """Refuse motions that all carry the same payload: nothing tells it from the last link.

    Raises:
        NotIdentifiable: Naming logs and payload.
    """
    payloads = [each.payload for each in motions]
    if payloads[0] is None or any(each != payloads[0] for each in payloads):
        return
    names = list(dict.fromkeys(each.recording.name for each in motions))
    carry = f"{' and '.join(names)} carry" if len(names) > 1 else f"{names[0]} carries"
    raise NotIdentifiable(
        f"{carry} the same payload of {payloads[0].mass:g} kg, and no log is bare: a gain needs motions with and "
        "without it; give the log of the bare flange with --unloaded, or record one"
    )


def check_load(estimate: GainEstimate, *, bare: bool = True) -> None:
    """Refuse an estimate that shows no load, no gain, or a negative load: the two files are swapped.

    To be asked of the estimate that is reported: a load that one method does not see may be plain to another.

    Args:
        estimate: The estimate.
        bare: Whether a motion has a bare flange.

    Raises:
        NotIdentifiable: Saying which.
    """
    signs = joint_signs(estimate)
    seen = np.abs(signs.load_z) > LOAD_Z
    if len(seen) and not seen.any():
        if not bare:
            raise NotIdentifiable(f"without a bare motion no joint's load is identifiable: {RECORD_BARE}")
        raise NotIdentifiable(
            f"{estimate.method} finds no load on any joint in the loaded motion; was the payload mounted?"
        )
    if not estimate.identifiable.any():
        reason = next(joint.reason for joint in estimate.joints if isinstance(joint, RefusedGain))
        missing = "" if bare else f" without a bare motion: {RECORD_BARE}"
        faint = bare and len(seen) and bool((np.abs(signs.load_z) < FAINT_Z).all())
        mounted = "; was the payload mounted?" if faint else ""
        raise NotIdentifiable(f"no drive gain can be identified{missing}; joint 1: {reason}{mounted}")
    check_swapped(estimate)


def cause_of(error: IdentificationError, problem: Problem) -> IdentificationError:
    """Why nothing was found: files that are swapped, as the linear method tells where another does not converge.

    Args:
        error: Why, as the method says.
        problem: Of which it found nothing.

    Returns:
        What is wrong, the same error where nothing else is.
    """
    try:
        estimate = joint_by_joint_gains(problem, JointByJointOptions())
    except IdentificationError:
        return error
    try:
        check_swapped(estimate)
    except NotIdentifiable as swapped:
        return swapped
    return error


def check_swapped(estimate: GainEstimate) -> None:
    """Refuse an estimate with gains, all of whose loads are negative: the two files are swapped.

    A drive wired backwards has a negative gain and negative friction over gain as well; with the files swapped
    only the payload changes sign. Where friction is too small to tell, positive gains are expected.

    Raises:
        NotIdentifiable: If so.
    """
    if not estimate.identifiable.any():
        return
    signs = joint_signs(estimate)
    seen = np.abs(signs.load_z) > LOAD_Z
    sign = np.where(np.abs(signs.friction_z) > FRICTION_Z, np.sign(signs.friction_z), 1.0)
    if seen.any() and not (signs.load_z * sign > 0.0)[seen].any():
        raise NotIdentifiable(
            "every joint gives a negative payload mass; the unloaded and loaded files are probably swapped"
        )


def prediction_warnings(shares: Mapping[int, float]) -> tuple[str, ...]:
    """A warning on every joint whose currents the other parts of the motions predict badly.

    Motions of good recordings predict each other within a tenth: 9.0 % at most with the noise of the paper, 6.9 % of
    real ones whose model holds.

    Args:
        shares: Norm of the prediction's error over that of the currents, by joint from 0.
    """
    return tuple(
        f"joint {joint + 1}: the current is predicted with an error of {100.0 * share:.0f} % (good recordings: "
        "up to 10 %), so the model is wrong and the results of this joint are invalid; check coupling "
        "(--coupling), friction, sign, column and base"
        for joint, share in shares.items()
        if share > LARGE_RESIDUAL
    )
