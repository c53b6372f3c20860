"""Checks that a number alone cannot fail: degrees for radians, the same file twice, files swapped, no load.

Each raises one error that says what the data look like and what to do, before or after an estimate that would
otherwise look like an answer.
"""

import numpy as np

from ident.arm import Arm
from ident.errors import NotIdentifiable, RecordingError
from ident.gains import GainEstimate
from ident.recording import Recording

LOAD_Z = 4.0
"""Standard deviations that 1/g must differ from zero by on some joint for a load to be there."""
FRICTION_Z = 10.0
"""Standard deviations above which the sign of the friction is trusted."""


def check_positions(arm: Arm, recording: Recording) -> None:
    """Refuse positions that no joint of the arm can reach, and say if they look like degrees.

    Raises:
        RecordingError: Naming the joint.
    """
    if recording.n != arm.n:
        raise RecordingError(
            f"{recording.name}: {recording.n} joints, but robot {arm.name} has {arm.n}; check the model or the columns"
        )
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


def check_pair(unloaded: Recording, loaded: Recording) -> None:
    """Refuse one recording given for both motions.

    Raises:
        NotIdentifiable: If both hold the same samples.
    """
    if unloaded.v.shape == loaded.v.shape and np.array_equal(unloaded.v, loaded.v):
        raise NotIdentifiable(
            f"{unloaded.name} and {loaded.name} hold the same motion; record one with the payload mounted"
        )


def check_load(estimate: GainEstimate) -> None:
    """Refuse an estimate that shows no load, or a negative one: the two files are swapped.

    A drive wired backwards has a negative gain and negative friction over gain as well; with the files swapped
    only the payload changes sign. Where friction is too small to tell, positive gains are expected.

    Raises:
        NotIdentifiable: Saying which.
    """
    seen = [joint for joint in estimate.joints if abs(joint.load_z) > LOAD_Z]
    if not seen:
        if any(joint.rows for joint in estimate.joints):
            raise NotIdentifiable("the loaded motion shows no load on any joint; was the payload mounted?")
        return
    agree = [joint.load_z * (joint.friction_z if abs(joint.friction_z) > FRICTION_Z else 1.0) > 0.0 for joint in seen]
    if not any(agree):
        raise NotIdentifiable(
            "every joint shows a payload of negative mass; the unloaded and loaded files are probably swapped"
        )
