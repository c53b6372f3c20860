"""Reduction of a model file to the arm: joints from the world to the flange move, all others are locked or removed.

The links with their inertias, the joints with their places and ranges, and gravity are used. Drives, friction and rotor
inertias come from the robot file; sensors, keyframes, contacts, solver settings and fluids are ignored. Springs and
constraints between moving joints are refused, because the identification model lacks them.
"""

import mujoco
import numpy as np

from sim.errors import ModelFileError

DROPPED = ("sensors", "keys", "pairs", "excludes", "actuators", "equalities", "tendons", "flexes", "skins")
"""Elements of a file that are removed; equalities and tendons are checked first."""
GRIPPER = "remove it; if it belongs to a gripper, name the arm's last body as flange"
"""Advice for a constraint between joints."""
FREE = mujoco.mjtJoint.mjJNT_FREE
ONE_AXIS = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)


def hold_all_but_arm(spec: mujoco.MjSpec, flange: str | None) -> None:
    """Reduce a model to the joints of an arm, each with a name, without drives and constraints.

    Args:
        spec: The model of the file, changed in place.
        flange: Last body of the arm; joints outside the chain to it are locked. None if all joints belong to the arm.

    Raises:
        ModelFileError: If there is no such body, a joint has more than one axis, or springs or constraints act on the
            arm.
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
        joint.actfrclimited = 0  # drive torques are stated in the robot file
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
    """With a flange, the reader of the identification reports constraints on the arm, with their lines."""
    if flange is not None:
        return
    for tie in spec.equalities:
        if tie.active:
            raise ModelFileError(f"equality {tie.name or tie.name1!r} couples joints; {GRIPPER}")
    for tendon in spec.tendons:
        if any(tendon.stiffness) or any(tendon.damping) or tendon.frictionloss:
            raise ModelFileError(f"tendon {tendon.name!r} acts on joints; {GRIPPER}")


def _drop_objects(spec: mujoco.MjSpec, flange: str | None) -> None:
    """Remove free-floating bodies that do not carry the flange."""
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
    """Lock joints outside the chain to a flange; bodies there keep their mass and get a physically possible inertia."""
    arm = bodies_to(spec, flange)
    for joint in list(spec.joints):
        if not any(joint.parent is each for each in arm):
            spec.delete(joint)
    for body in spec.bodies:
        if body.explicitinertial and not any(body is each for each in arm):
            _give_possible_inertia(body)


def _give_possible_inertia(body: mujoco.MjsBody) -> None:
    """Replace impossible moments, which MuJoCo would refuse, by those of a sphere, and negative masses by zero."""
    full = body.fullinertia
    xx, yy, zz, xy, xz, yz = (*body.inertia, 0.0, 0.0, 0.0) if np.isnan(full[0]) else full
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if body.mass < 0.0 or moments[0] < 0.0 or moments[0] + moments[1] < moments[2]:
        body.mass, body.fullinertia = max(body.mass, 0.0), np.full(6, np.nan)
        body.inertia = np.full(3, np.abs(moments).mean())


def _default_options(spec: mujoco.MjSpec) -> None:
    """Reset all options but gravity to defaults: flags may disable friction, and a fluid would damp the arm."""
    plain = mujoco.MjSpec().option
    for name in (name for name in dir(plain) if not name.startswith("_") and name != "gravity"):
        setattr(spec.option, name, getattr(plain, name))
