"""Data of a model file besides kinematics: limits of torque and speed, home pose, missing data.

Identification does not use masses, inertias, efforts and speeds, but a simulation does, so they are checked here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import mujoco
import numpy as np

from ident.model.files.urdf import urdf_to_flange
from ident.model.files.xml_tree import read_xml, title, vector
from ident.payload.payload import INERTIA_KEYS
from ident.support.errors import RobotModelError
from ident.support.naming import shown
from sim.errors import ModelFileError
from sim.model_spec import full_spec, silenced, unusable_meshes

OF_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
"""Transmission types of actuators; both are equivalent for a joint with one axis."""
LEFT = {"damping": "damping", "frictionloss": "friction loss", "armature": "armature"}
"""Drive attributes of a joint by MuJoCo's name (also for a URDF's <dynamics>), and in words."""
STRONGEST = {"effort": 1e6, "velocity": 1e3}
"""Largest plausible effort [N m, N] and speed [rad/s, m/s] of a joint; the strongest arms have 1e5 N m."""
SLACK = 1e-6
"""Relative rounding error of moments of inertia."""


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
def model_facts(path: Path, flange: str | None) -> ModelFacts:
    """Read the data.

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
        torque = _stated(limits, "effort")
        velocity = _stated(limits, "velocity")
        if len(limits) > 1 and {*torque.values(), *velocity.values()} == {1.0}:  # CAD exporters write it for unknown
            torque, velocity = {}, {}
    home, home_name = _keyframe(spec)
    left = tuple(word for name, word in LEFT.items() if any(np.any(getattr(joint, name)) for joint in spec.joints))
    arm = full_spec(path, flange)
    bodies = [body for body in arm.bodies[1:] if body.geoms and not body.explicitinertial]
    moved = {id(joint.parent) for joint in arm.joints}
    return ModelFacts(
        torque=torque,
        velocity=velocity,
        home=home,
        home_name=home_name,
        from_shapes=tuple(body.name for body in bodies if id(body) in moved),
        missing_meshes=unusable_meshes(path, flange),
        left=left,
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


def _stated(limits: list[tuple[str, Element]], key: str) -> dict[str, float]:
    """Return positive numbers of an attribute; in many files, 0 means an unknown limit."""
    values = {name: float(limit.get(key, "nan")) for name, limit in limits}
    return {name: value for name, value in values.items() if np.isfinite(value) and value > 0.0}


def _keyframe(spec: mujoco.MjSpec) -> tuple[dict[str, float], str]:
    """Return positions by joint of a keyframe named home, or of the only one, if it has all joints."""
    joints = list(spec.joints)
    for key in spec.keys:
        if (key.name == "home" or len(spec.keys) == 1) and len(key.qpos) == len(joints):
            names = [joint.name or f"joint{number}" for number, joint in enumerate(joints, 1)]
            return {name: float(x) for name, x in zip(names, key.qpos, strict=True)}, key.name
    return {}, ""


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
            _check_inertial(link, inertial)
    for joint in root.findall("joint"):
        for limit in joint.findall("limit"):
            for key, most in STRONGEST.items():
                if limit.get(key, "").lower() in ("inf", "+inf"):  # no limit is stated
                    continue
                value = vector(limit, key, 1, largest=most)
                if value is not None and value[0] < 0.0:
                    raise RobotModelError(f"{title(limit)}: {key} = {shown(limit.attrib[key])} is negative")


def _check_inertial(link: Element, inertial: Element) -> None:
    for mass in inertial.findall("mass"):
        value = vector(mass, "value", 1)
        if value is not None and value[0] < 0.0:
            raise RobotModelError(f"{title(mass)}: value = {shown(mass.attrib['value'])}: expected a mass of 0 or more")
    for inertia in inertial.findall("inertia"):
        ixx, iyy, izz, ixy, ixz, iyz = ((vector(inertia, key, 1) or (0.0,))[0] for key in INERTIA_KEYS)
        moments = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        if moments[0] + moments[1] < (1.0 - SLACK) * moments[2]:
            principal = ", ".join(f"{each:.4g}" for each in moments)
            raise RobotModelError(
                f"{title(inertia)} of link {shown(link.get('name', ''))}: no body has principal "
                f"moments {principal} kg m^2: none is negative, and none exceeds the sum of the other two"
            )
