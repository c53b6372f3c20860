"""Data of a model file besides kinematics: end of the arm, limits of torque and speed, home pose, missing data.

Identification uses no masses, inertias, efforts and speeds, but a simulation does, so they are checked here. A payload
is mounted on the flange, never on a jaw: joints of a gripper at the arm's end are locked at their initial positions.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from ident.model.arm import urdf_to_flange
from ident.model.xml_tree import read_xml, title, vector
from ident.payload.payload import INERTIA_KEYS
from ident.support.errors import RobotModelError
from ident.support.naming import shown
from sim.errors import PlantError
from sim.model_spec import full_spec, silenced, unusable_meshes

GRIPPING = re.compile(r"grip|jaw|finger|claw|pincer|carriage|knuckle", re.IGNORECASE)
"""Names of a gripper's joints and of the bodies that they move."""
OPENING, SHORT = 2.5, 0.1
"""Largest travel of a rotating jaw [rad] (a wrist has more), and of sliding fingers without a known name [m]."""
FEWEST = 2
"""Least number of joints of an arm before a gripper."""
MOVING = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
OF_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
"""Transmission types of actuators; both are equivalent for a joint with one axis."""
IGNORED = {"damping": "damping", "frictionloss": "friction loss", "armature": "armature"}
"""Drive attributes of a joint by MuJoCo's name (also for a URDF's <dynamics>), and in words."""
STRONGEST = {"effort": 1e6, "velocity": 1e3}
"""Largest plausible effort [N m, N] and speed [rad/s, m/s] of a joint; the strongest arms have 1e5 N m."""
SLACK = 1e-6
"""Relative rounding error of moments of inertia."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """Data of a model file by joint name; values that are not stated are absent.

    Attributes:
        torque: Largest torque [N m] or force [N].
        velocity: Largest speed [rad/s or m/s].
        home: Positions of a keyframe [rad or m].
        from_shapes: Links whose inertia comes from their shapes, because the file states none.
        missing_meshes: Files of meshes that are missing or not solids; their shapes are omitted.
        ignored: Drive attributes that are ignored, such as friction loss: many files state values for numerical
            stability, which cannot be recognised.
    """

    torque: Mapping[str, float]
    velocity: Mapping[str, float]
    home: Mapping[str, float]
    home_name: str
    from_shapes: tuple[str, ...]
    missing_meshes: tuple[str, ...]
    ignored: tuple[str, ...]


@silenced()
def arm_end(path: Path) -> tuple[str | None, tuple[str, ...]]:
    """Return the body that carries a gripper, None without one, and the gripper's joints.

    `path` is an MJCF or URDF file; a file that MuJoCo cannot read is reported elsewhere.

    Raises:
        PlantError: If its joints form several chains, as for two arms.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError:
        return None, ()
    floating = [
        body for body in spec.bodies if any(each.type not in MOVING for up in _upwards(body) for each in up.joints)
    ]
    joints = [each for each in spec.joints if each.type in MOVING and each.parent not in floating]
    above: list[int | None] = []  # the preceding joint on the same body, or the last one of the nearest parent body
    for k, joint in enumerate(joints):
        same = k > 0 and joints[k - 1].parent is joint.parent
        own = ([j for j, other in enumerate(joints) if other.parent is body] for body in _upwards(joint.parent.parent))
        above.append(k - 1 if same else next((each[-1] for each in own if each), None))
    held = set[int]()
    for k, joint in enumerate(joints):  # parents first; bodies on a jaw belong to the gripper too
        beside = [j for j, other in enumerate(joints) if above[j] == above[k] and other.type == joint.type]
        fingers = len(beside) > 1 and not any(each in above for each in beside)
        travel, slides = float(joint.range[1] - joint.range[0]), joint.type == mujoco.mjtJoint.mjJNT_SLIDE
        if (
            above[k] in held
            or GRIPPING.search(joint.name)
            or (GRIPPING.search(joint.parent.name) and (slides or 0.0 < travel <= OPENING))
            or (fingers and slides and 0.0 < travel <= SHORT)
        ):
            held.add(k)
    arm = [k for k in range(len(joints)) if k not in held]
    tips = [joints[k].parent.name for k in arm if not any(above[j] == k for j in arm)]
    if len(tips) > 1 and all(tips):
        raise PlantError(
            f"robot model {path}: its joints form {len(tips)} chains, which end at {', '.join(tips)}; name the last "
            f"body of the arm, such as --flange {tips[0]}: joints outside the chain to it are locked"
        )
    if not held or len(arm) < FEWEST or len(tips) != 1 or not tips[0]:
        return None, ()
    return tips[0], tuple(joints[k].name for k in sorted(held))


def _upwards(body: mujoco.MjsBody | None) -> Iterator[mujoco.MjsBody]:
    """Yield a body and its ancestors."""
    while body is not None:
        yield body
        body = body.parent


@silenced()
def model_facts(path: Path, flange: str | None) -> ModelFacts:
    """Read the data of an arm up to a body, None for all joints.

    Raises:
        PlantError: If the file has no arm.
        RobotModelError: If a number of a URDF is impossible; MuJoCo's compiler checks MJCF files.
    """
    urdf = path.suffix.lower() == ".urdf"
    torque, velocity = _urdf_limits(path, flange) if urdf else ({}, {})
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise PlantError(f"robot model {path}: MuJoCo cannot read it: {reason}") from error
    torque = torque if urdf else _mjcf_torques(spec)
    names = [joint.name or f"joint{number}" for number, joint in enumerate(spec.joints, 1)]
    keys = [key for key in spec.keys if key.name == "home" or len(spec.keys) == 1]
    key = next((key for key in keys if len(key.qpos) == len(names)), None)
    arm = full_spec(path, flange)
    moved = {id(joint.parent) for joint in arm.joints}
    shaped = [body for body in arm.bodies[1:] if id(body) in moved and body.geoms and not body.explicitinertial]
    return ModelFacts(
        torque=torque,
        velocity=velocity,
        home={} if key is None else dict(zip(names, map(float, key.qpos), strict=True)),
        home_name="" if key is None else key.name,
        from_shapes=tuple(body.name for body in shaped),
        missing_meshes=unusable_meshes(path, flange),
        ignored=tuple(
            word for name, word in IGNORED.items() if any(np.any(getattr(each, name)) for each in spec.joints)
        ),
    )


def _mjcf_torques(spec: mujoco.MjSpec) -> dict[str, float]:
    """Return the largest torque by joint: the smaller of the joint's and the sum of its actuators', as in MuJoCo.

    If one of several actuators has no limit, they have none.
    """
    driven: dict[str, float] = {}
    for actuator in spec.actuators:
        gear = abs(float(actuator.gear[0])) or 1.0
        force = max(0.0, float(actuator.forcerange[1])) or np.inf
        servo = any(actuator.biasprm[1:3])  # position or velocity servos; others are force actuators
        if np.isinf(force) and not servo and actuator.ctrlrange[1] > 0.0:
            force = float(actuator.ctrlrange[1]) * abs(float(actuator.gainprm[0]))
        if actuator.trntype in OF_JOINTS:
            driven[actuator.target] = driven.get(actuator.target, 0.0) + force * gear
    own = {joint.name: float(joint.actfrcrange[1]) for joint in spec.joints if joint.actfrcrange[1] > 0.0}
    torque = {name: min(own.get(name, np.inf), driven.get(name, np.inf)) for name in {**own, **driven}}
    return {name: value for name, value in torque.items() if np.isfinite(value)}


def _urdf_limits(path: Path, flange: str | None) -> tuple[dict[str, float], dict[str, float]]:
    """Return efforts and speeds of a URDF by joint, 0 and infinity aside, which often mean unknown.

    Raises:
        RobotModelError: If a limit or a mass property of the arm is impossible; the message names line and value.
    """
    root, whole = read_xml(path), read_xml(path)
    if flange is not None:
        urdf_to_flange(root, flange)
    for inertial in root.iterfind("link/inertial"):
        for mass in inertial.iterfind("mass"):
            if (vector(mass, "value", 1) or (0.0,))[0] < 0.0:
                raise RobotModelError(
                    f"{title(mass)}: value = {shown(mass.attrib['value'])}: expected a mass of 0 or more"
                )
        for inertia in inertial.iterfind("inertia"):
            ixx, iyy, izz, ixy, ixz, iyz = ((vector(inertia, key, 1) or (0.0,))[0] for key in INERTIA_KEYS)
            moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
            if moments[0] + moments[1] < (1.0 - SLACK) * moments[2]:
                raise RobotModelError(
                    f"{title(inertia)}: no body has principal moments {', '.join(f'{each:.4g}' for each in moments)} "
                    "kg m^2: none is negative, and none exceeds the sum of the other two"
                )
    for limit in root.iterfind("joint/limit"):
        for key, most in STRONGEST.items():
            unlimited = limit.get(key, "").lower() in ("inf", "+inf")
            if not unlimited and (vector(limit, key, 1, largest=most) or (0.0,))[0] < 0.0:
                raise RobotModelError(f"{title(limit)}: {key} = {shown(limit.attrib[key])} is negative")
    limits = [(joint.get("name", ""), limit) for joint in whole.iterfind("joint") for limit in joint.iterfind("limit")]
    torque, velocity = (
        {name: float(limit.get(key, "nan")) for name, limit in limits if 0.0 < float(limit.get(key, "nan")) < np.inf}
        for key in STRONGEST
    )
    if len(limits) > 1 and {*torque.values(), *velocity.values()} == {1.0}:  # CAD exporters write it for unknown
        return {}, {}
    return torque, velocity
