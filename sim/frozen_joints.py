"""Of a model file, the arm alone: what leads from the world to the flange moves, all else is held or left out.

What counts of a model file are links with their inertias, joints with their places and ranges, and gravity. Drives,
friction and rotors are the robot file's; sensors, keyframes, contacts, solver settings and fluids are no part of a
plant. A spring in the file would be a part of the arm that nobody is told of, so it is refused; so is a tie between
joints that move.
"""

import mujoco
import numpy as np

from sim.errors import ModelFileError

DROPPED = ("sensors", "keys", "pairs", "excludes", "actuators", "equalities", "tendons", "flexes", "skins")
"""What of a file is no part of a plant; ties and tendons are first looked at."""
GRIPPER = "remove it; if it belongs to a gripper, name the arm's last body as flange"
"""What to do about a tie."""
FREE = mujoco.mjtJoint.mjJNT_FREE
ONE_AXIS = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


def hold_all_but_arm(spec: mujoco.MjSpec, flange: str | None) -> None:
    """Leave in a model the joints of an arm, each with a name, and nothing that drives or ties them.

    Args:
        spec: As the file says, changed in place.
        flange: Last body of the arm; joints that do not lead to it are held. None where all joints are the arm's.

    Raises:
        ModelFileError: If there is no such body, a joint has more than one axis, or springs and ties act on the arm.
    """
    _refuse_ties(spec, flange)
    for kind in DROPPED:
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    _drop_objects(spec, flange)
    if flange is not None:
        _hold_beside(spec, flange)
    for number, body in enumerate(spec.bodies):
        body.name = body.name or f"body {number}"
        body.gravcomp = 0.0
    for number, joint in enumerate(spec.joints, 1):
        joint.name = joint.name or f"joint{number}"
        joint.actfrclimited = 0  # the robot file states what drives give
        if joint.type not in ONE_AXIS:
            raise ModelFileError(
                f"joint {joint.name} is free or a ball; expected hinge and slide joints on a fixed base"
            )
        if any(joint.stiffness):
            raise ModelFileError(
                f"joint {joint.name} has a spring, stiffness = {joint.stiffness[0]:g}, which "
                "identification does not model; remove it"
            )
    _default_options(spec)


def _refuse_ties(spec: mujoco.MjSpec, flange: str | None) -> None:
    """With a flange, the identification's reader says which ties act on the arm, and in which line they stand."""
    if flange is not None:
        return
    for tie in spec.equalities:
        if tie.active:
            raise ModelFileError(f"equality {tie.name or tie.name1!r} couples joints; {GRIPPER}")
    for tendon in spec.tendons:
        if any(tendon.stiffness) or any(tendon.damping) or tendon.frictionloss:
            raise ModelFileError(f"tendon {tendon.name!r} acts on joints; {GRIPPER}")


def _drop_objects(spec: mujoco.MjSpec, flange: str | None) -> None:
    """Bodies that float freely beside the arm; what carries the flange is the arm."""
    body = spec.worldbody.first_body()
    while body is not None:
        following = spec.worldbody.next_body(body)
        joints = body.find_all(mujoco.mjtObj.mjOBJ_JOINT)
        names = [body.name, *(each.name for each in body.find_all(mujoco.mjtObj.mjOBJ_BODY))]
        if joints and all(joint.type == FREE for joint in joints) and (flange is None or flange not in names):
            spec.delete(body)
        body = following


def bodies_to(spec: mujoco.MjSpec, flange: str) -> list[mujoco.MjsBody]:
    """The bodies from a flange to the world, both included.

    Raises:
        ModelFileError: If no body has that name.
    """
    body = spec.body(flange)
    if body is None:
        raise ModelFileError(f"flange {flange!r}: no body has that name")
    found = [body]
    while (body := body.parent) is not None:
        found.append(body)
    return found


def _hold_beside(spec: mujoco.MjSpec, flange: str) -> None:
    """Hold joints that do not lead to a flange; what hangs there has its mass, and an inertia that a body can have."""
    arm = bodies_to(spec, flange)
    for joint in list(spec.joints):
        if not any(joint.parent is each for each in arm):
            spec.delete(joint)
    for body in spec.bodies:
        if body.explicitinertial and not any(body is each for each in arm):
            _give_possible_inertia(body)


def _give_possible_inertia(body: mujoco.MjsBody) -> None:
    """Moments of a ball in place of those that no body has, which MuJoCo would refuse; no mass in place of less."""
    full = body.fullinertia
    xx, yy, zz, xy, xz, yz = (*body.inertia, 0.0, 0.0, 0.0) if np.isnan(full[0]) else full
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if body.mass < 0.0 or moments[0] < 0.0 or moments[0] + moments[1] < moments[2]:
        body.mass, body.fullinertia = max(body.mass, 0.0), np.full(6, np.nan)
        body.inertia = np.full(3, np.abs(moments).mean())


def _default_options(spec: mujoco.MjSpec) -> None:
    """Every option as MuJoCo has it but gravity: flags of a file may switch friction off, a fluid brake the arm."""
    plain = mujoco.MjSpec().option
    for name in (name for name in dir(plain) if not name.startswith("_") and name != "gravity"):
        setattr(spec.option, name, getattr(plain, name))
