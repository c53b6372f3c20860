"""Data of a model file besides kinematics: limits of torque and speed, home pose, missing data.

Identification uses no masses, efforts and speeds, but a simulation does. MuJoCo reads both kinds of file, and its
compiler refuses impossible numbers by name; only the speeds of a URDF are read here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from ident.model.xml_tree import read_xml, vector
from sim.errors import PlantError
from sim.model_spec import ONE_AXIS, full_spec, silenced, unusable_meshes

OF_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
"""Transmission types of actuators; both are equivalent for a joint with one axis."""
IGNORED = {"damping": "damping", "frictionloss": "friction loss", "armature": "armature"}
"""Drive attributes of a joint by MuJoCo's name (also for a URDF's <dynamics>), and in words."""
STRONGEST, FASTEST = 1e6, 1e3
"""Torque [N m, N] and speed [rad/s, m/s] above which a joint has no limit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """Data of a model file by joint name; values that are not stated are absent."""

    torque: Mapping[str, float]  # largest torque [N m] or force [N]
    velocity: Mapping[str, float]  # largest speed [rad/s or m/s]
    home: Mapping[str, float]  # positions of a keyframe [rad or m]
    locked: tuple[str, ...]  # joints of the file outside the chain to the flange
    from_shapes: tuple[str, ...]  # links whose inertia comes from their shapes, because the file states none
    missing_meshes: tuple[str, ...]  # files of meshes that are missing or not solids; their shapes are omitted
    # Drive attributes that are ignored, such as friction loss: many files state values for numerical stability,
    # which cannot be recognised:
    ignored: tuple[str, ...]


@silenced()
def model_facts(path: Path, flange: str | None) -> ModelFacts:
    """Read the data of an arm up to a body; `PlantError` if MuJoCo cannot, `RobotModelError` for a speed."""
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise PlantError(f"robot model {path}: MuJoCo cannot read it: {' '.join(str(error).split())}") from error
    names = [joint.name or f"joint{number}" for number, joint in enumerate(spec.joints, 1)]
    keys = [key for key in spec.keys if len(key.qpos) == len(names) and (key.name == "home" or len(spec.keys) == 1)]
    arm = full_spec(path, flange)
    for body in arm.bodies:
        if body.mass < 0.0:  # of a body without a joint of its own, MuJoCo takes it as zero
            raise PlantError(f"robot model {path}: link {body.name!r} has a mass of {body.mass:g} kg")
    moved, own = {id(joint.parent) for joint in arm.joints}, {joint.name for joint in arm.joints}
    shaped = [body for body in arm.bodies[1:] if id(body) in moved and body.geoms and not body.explicitinertial]
    torque, velocity = _torques(spec), _speeds(path) if path.suffix.lower() == ".urdf" else {}
    if len(velocity) > 1 and {*torque.values(), *velocity.values()} == {1.0}:  # CAD exporters write it for unknown
        torque = velocity = {}
    return ModelFacts(
        torque=torque,
        velocity=velocity,
        home=dict(zip(names, map(float, keys[0].qpos), strict=True)) if keys else {},
        locked=tuple(j.name for j in spec.joints if j.type in ONE_AXIS and flange and j.name not in own),
        from_shapes=tuple(body.name for body in shaped),
        missing_meshes=unusable_meshes(path, flange),
        ignored=tuple(word for name, word in IGNORED.items() if any(np.any(getattr(j, name)) for j in spec.joints)),
    )


def _torques(spec: mujoco.MjSpec) -> dict[str, float]:
    """Return the largest torque by joint: the smaller of its own and its actuators' together, as in MuJoCo."""
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
    return {name: value for name, value in torque.items() if value < STRONGEST}


def _speeds(path: Path) -> dict[str, float]:
    """Return the largest speeds of a URDF by joint; 0, negative and infinite ones often mean unknown."""
    speeds: dict[str, float] = {}
    for joint in read_xml(path).iterfind("joint"):
        for limit in joint.iterfind("limit"):
            if limit.get("velocity", "").lower() not in ("inf", "+inf"):
                speeds[joint.get("name", "")] = (vector(limit, "velocity", 1) or (0.0,))[0]
    return {name: speed for name, speed in speeds.items() if 0.0 < speed < FASTEST}
