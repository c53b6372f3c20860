"""Where an arm ends in a model file that has a gripper too, and where nobody names its last body.

A payload is bolted to the flange, never to a jaw: joints of a gripper at the arm's end are held where they are drawn.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import mujoco

from sim.errors import RobotError
from sim.silenced_mujoco import silenced

GRIPPING = re.compile(r"grip|jaw|finger|claw|pincer|carriage|knuckle", re.IGNORECASE)
"""Names of a gripper's joints and of the bodies that they move."""
OPENING = 2.5
"""Largest travel of a jaw that turns [rad]; a wrist that carries a gripper's name turns farther."""
SHORT = 0.1
"""Largest travel of fingers that slide side by side and have no telling name [m]."""
FEWEST = 2
"""Least joints of an arm that ends before a gripper."""
MOVING = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


@dataclass(frozen=True, slots=True)
class ArmEnd:
    """Where an arm ends.

    Attributes:
        flange: Its last body, None where all joints are its own.
        held: Names of the joints that are taken for a gripper's.
    """

    flange: str | None
    held: tuple[str, ...] = ()


@silenced()
def arm_end(path: Path) -> ArmEnd:
    """The body that carries the gripper, and the gripper's joints; no flange where the file has no gripper.

    Args:
        path: MJCF or URDF file; one that MuJoCo cannot read is left to those who say why.

    Raises:
        RobotError: If its joints form several chains, as of two arms.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError:
        return ArmEnd(None)
    joints = [joint for joint in spec.joints if joint.type in MOVING and not _floats(joint.parent)]
    above = [_above(k, joints) for k in range(len(joints))]
    held = set[int]()
    for k, joint in enumerate(joints):  # those above come first; what a jaw carries is the gripper's too
        beside = [j for j, other in enumerate(joints) if above[j] == above[k] and other.type == joint.type]
        fingers = len(beside) > 1 and not any(each in above for each in beside)
        if above[k] in held or _is_jaw(joint, fingers=fingers):
            held.add(k)
    arm = [k for k in range(len(joints)) if k not in held]
    tips = [joints[k].parent.name for k in arm if not any(above[j] == k for j in arm)]
    if len(tips) > 1 and all(tips):
        raise RobotError(
            f"robot model {path}: its joints form {len(tips)} chains, which end at {', '.join(tips)}; name the last "
            f"body of the arm, such as --flange {tips[0]}: joints outside the chain to it are locked"
        )
    if not held or len(arm) < FEWEST or len(tips) != 1 or not tips[0]:
        return ArmEnd(None)
    return ArmEnd(tips[0], tuple(joints[k].name for k in sorted(held)))


def _is_jaw(joint: mujoco.MjsJoint, *, fingers: bool) -> bool:
    """Whether a joint is a gripper's; `fingers` of one that moves beside others alike and carries no joint."""
    travel = float(joint.range[1] - joint.range[0])
    slides = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
    if GRIPPING.search(joint.name):
        return True
    if GRIPPING.search(joint.parent.name):
        return slides or 0.0 < travel <= OPENING
    return fingers and slides and 0.0 < travel <= SHORT


def _above(k: int, joints: list[mujoco.MjsJoint]) -> int | None:
    """The joint that carries joint k: the one before it on the same body, or the last of the nearest body above."""
    body = joints[k].parent
    if k and joints[k - 1].parent is body:
        return k - 1
    while (body := body.parent) is not None:
        own = [j for j, other in enumerate(joints) if other.parent is body]
        if own:
            return own[-1]
    return None


def _floats(body: mujoco.MjsBody | None) -> bool:
    """Whether a body is, or stands on, one that moves freely."""
    while body is not None:
        if any(joint.type not in MOVING for joint in body.joints):
            return True
        body = body.parent
    return False
