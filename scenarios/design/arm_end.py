"""Detection of the end of the arm in a model file with a gripper.

A payload is mounted on the flange, never on a jaw: joints of a gripper at the arm's end are locked at their initial
positions.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import mujoco

from sim.errors import RobotError
from sim.model_spec import silenced

GRIPPING = re.compile(r"grip|jaw|finger|claw|pincer|carriage|knuckle", re.IGNORECASE)
"""Names of a gripper's joints and of the bodies that they move."""
OPENING = 2.5
"""Largest travel of a rotating jaw [rad]; a wrist with a gripper-like name has more."""
SHORT = 0.1
"""Largest travel of parallel sliding fingers without a known name [m]."""
FEWEST = 2
"""Least number of joints of an arm before a gripper."""
MOVING = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


@dataclass(frozen=True, slots=True)
class ArmEnd:
    """End of an arm.

    Attributes:
        flange: Its last body, None if all joints belong to the arm.
        held: Names of the joints recognised as those of a gripper.
    """

    flange: str | None
    held: tuple[str, ...] = ()


@silenced()
def arm_end(path: Path) -> ArmEnd:
    """Return the body that carries the gripper, and the gripper's joints; no flange if the file has no gripper.

    Args:
        path: MJCF or URDF file; a file that MuJoCo cannot read is reported elsewhere.

    Raises:
        RobotError: If its joints form several chains, as for two arms.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError:
        return ArmEnd(None)
    joints = [joint for joint in spec.joints if joint.type in MOVING and not _floats(joint.parent)]
    above = [_above(k, joints) for k in range(len(joints))]
    held = set[int]()
    for k, joint in enumerate(joints):  # parents first; bodies on a jaw belong to the gripper too
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
    """Return whether a joint belongs to a gripper; `fingers`: whether it is one of several parallel joints."""
    travel = float(joint.range[1] - joint.range[0])
    slides = joint.type == mujoco.mjtJoint.mjJNT_SLIDE
    if GRIPPING.search(joint.name):
        return True
    if GRIPPING.search(joint.parent.name):
        return slides or 0.0 < travel <= OPENING
    return fingers and slides and 0.0 < travel <= SHORT


def _above(k: int, joints: list[mujoco.MjsJoint]) -> int | None:
    """Return the parent of joint k: the preceding one on its body, or the last one of the nearest parent body."""
    body = joints[k].parent
    if k and joints[k - 1].parent is body:
        return k - 1
    while (body := body.parent) is not None:
        own = [j for j, other in enumerate(joints) if other.parent is body]
        if own:
            return own[-1]
    return None


def _floats(body: mujoco.MjsBody | None) -> bool:
    """Return whether a body is free-floating or fixed to a free-floating one."""
    while body is not None:
        if any(joint.type not in MOVING for joint in body.joints):
            return True
        body = body.parent
    return False
