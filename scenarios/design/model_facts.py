"""Data of a model file besides kinematics: end of the arm, limits of torque and speed, home pose, missing data.

Identification uses no masses, inertias, efforts and speeds, but a simulation does, so they are checked here. A payload
is mounted on the flange, never on a jaw: joints of a gripper at the arm's end are locked at their initial positions.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from ident.model.arm import urdf_to_flange
from ident.model.xml_tree import read_xml, title, vector
from ident.payload.payload import INERTIA_KEYS
from ident.support.errors import RobotModelError
from ident.support.naming import shown
from sim.errors import ModelFileError, RobotError
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
LEFT = {"damping": "damping", "frictionloss": "friction loss", "armature": "armature"}
"""Drive attributes of a joint by MuJoCo's name (also for a URDF's <dynamics>), and in words."""
STRONGEST = {"effort": 1e6, "velocity": 1e3}
"""Largest plausible effort [N m, N] and speed [rad/s, m/s] of a joint; the strongest arms have 1e5 N m."""
SLACK = 1e-6
"""Relative rounding error of moments of inertia."""


@dataclass(frozen=True, slots=True)
class ArmEnd:
    """The last body of an arm, None if all joints belong to it, and the joints recognised as those of a gripper."""

    flange: str | None
    held: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """Data by joint name; values that are not stated are absent.

    Attributes:
        torque: Largest torque [N m] or force [N].
        velocity: Largest speed [rad/s or m/s].
        home: Positions of a keyframe [rad or m].
        home_name: Name of that keyframe.
        from_shapes: Links whose inertia comes from their shapes, because the file states none.
        missing_meshes: Files of meshes that are missing or not solids; their shapes are omitted.
        left: Drive attributes of the file that are ignored, such as friction loss: many files state values for
            numerical stability, equal for all joints, and these cannot be recognised.
    """

    torque: Mapping[str, float]
    velocity: Mapping[str, float]
    home: Mapping[str, float]
    home_name: str
    from_shapes: tuple[str, ...]
    missing_meshes: tuple[str, ...]
    left: tuple[str, ...]


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
        raise RobotError(
            f"robot model {path}: its joints form {len(tips)} chains, which end at {', '.join(tips)}; name the last "
            f"body of the arm, such as --flange {tips[0]}: joints outside the chain to it are locked"
        )
    if not held or len(arm) < FEWEST or len(tips) != 1 or not tips[0]:
        return ArmEnd(None)
    return ArmEnd(tips[0], tuple(joints[k].name for k in sorted(held)))


def _upwards(body: mujoco.MjsBody | None) -> Iterator[mujoco.MjsBody]:
    """Yield a body and its ancestors."""
    while body is not None:
        yield body
        body = body.parent


@silenced()
def model_facts(path: Path, flange: str | None) -> ModelFacts:
    """Read the data of an arm up to a body, None for all joints.

    Raises:
        ModelFileError: If the file has no arm.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise ModelFileError(f"robot model {path}: MuJoCo cannot read it: {reason}") from error
    own = {joint.name: float(joint.actfrcrange[1]) for joint in spec.joints if joint.actfrcrange[1] > 0.0}
    driven = _of_actuators(spec)  # MuJoCo keeps both
    torque = {name: min(own.get(name, np.inf), driven.get(name, np.inf)) for name in {**own, **driven}}
    velocity: dict[str, float] = {}
    if path.suffix.lower() == ".urdf":
        joints = read_xml(path).findall("joint")
        limits = [(joint.get("name", ""), limit) for joint in joints for limit in joint.findall("limit")]
        torque, velocity = (
            {name: value for name, value in pairs if np.isfinite(value) and value > 0.0}  # 0 often means unknown
            for key in STRONGEST
            for pairs in [[(name, float(limit.get(key, "nan"))) for name, limit in limits]]
        )
        if len(limits) > 1 and {*torque.values(), *velocity.values()} == {1.0}:  # CAD exporters write it for unknown
            torque, velocity = {}, {}
    names = [joint.name or f"joint{number}" for number, joint in enumerate(spec.joints, 1)]
    keys = [key for key in spec.keys if key.name == "home" or len(spec.keys) == 1]
    key = next((key for key in keys if len(key.qpos) == len(names)), None)
    arm = full_spec(path, flange)
    bodies = [body for body in arm.bodies[1:] if body.geoms and not body.explicitinertial]
    moved = {id(joint.parent) for joint in arm.joints}
    return ModelFacts(
        torque=torque,
        velocity=velocity,
        home={} if key is None else dict(zip(names, map(float, key.qpos), strict=True)),
        home_name="" if key is None else key.name,
        from_shapes=tuple(body.name for body in bodies if id(body) in moved),
        missing_meshes=unusable_meshes(path, flange),
        left=tuple(word for name, word in LEFT.items() if any(np.any(getattr(each, name)) for each in spec.joints)),
    )


def _of_actuators(spec: mujoco.MjSpec) -> dict[str, float]:
    """Return the largest torque by joint from the actuators of the file; MuJoCo adds those of one joint.

    If one of several has no limit, the joint has none.
    """
    found: dict[str, float] = {}
    unlimited = set[str]()
    for actuator in spec.actuators:
        gear = abs(float(actuator.gear[0])) or 1.0
        force = max(0.0, float(actuator.forcerange[1]))
        servo = any(actuator.biasprm[1:3])  # position or velocity servos; others are force actuators
        if not force and not servo and actuator.ctrlrange[1] > 0.0:
            force = float(actuator.ctrlrange[1]) * abs(float(actuator.gainprm[0]))
        if actuator.trntype in OF_JOINTS:
            found[actuator.target] = found.get(actuator.target, 0.0) + force * gear
            unlimited |= set() if force else {actuator.target}
    return {name: torque for name, torque in found.items() if name not in unlimited}


def check_stated_numbers(path: Path, flange: str | None = None) -> None:
    """Check masses and drives of the arm in a URDF; MuJoCo's compiler checks MJCF files.

    Raises:
        RobotModelError: If a value is impossible; the message names line, element and value.
    """
    if path.suffix.lower() != ".urdf":
        return
    root = read_xml(path)
    if flange is not None:
        urdf_to_flange(root, flange)
    for link in root.findall("link"):
        for inertial in link.findall("inertial"):
            for mass in inertial.findall("mass"):
                value = vector(mass, "value", 1)
                if value is not None and value[0] < 0.0:
                    said = shown(mass.attrib["value"])
                    raise RobotModelError(f"{title(mass)}: value = {said}: expected a mass of 0 or more")
            for inertia in inertial.findall("inertia"):
                _check_inertia(link, inertia)
    for joint in root.findall("joint"):
        for limit in joint.findall("limit"):
            for key, most in STRONGEST.items():
                if limit.get(key, "").lower() in ("inf", "+inf"):  # no limit is stated
                    continue
                value = vector(limit, key, 1, largest=most)
                if value is not None and value[0] < 0.0:
                    raise RobotModelError(f"{title(limit)}: {key} = {shown(limit.attrib[key])} is negative")


def _check_inertia(link: Element, inertia: Element) -> None:
    ixx, iyy, izz, ixy, ixz, iyz = ((vector(inertia, key, 1) or (0.0,))[0] for key in INERTIA_KEYS)
    moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    if moments[0] + moments[1] < (1.0 - SLACK) * moments[2]:
        principal = ", ".join(f"{each:.4g}" for each in moments)
        raise RobotModelError(
            f"{title(inertia)} of link {shown(link.get('name', ''))}: no body has principal moments "
            f"{principal} kg m^2: none is negative, and none exceeds the sum of the other two"
        )
