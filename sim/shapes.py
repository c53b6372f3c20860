"""Shapes that a model file does not have: the flange's face, the payload, and capsules for an arm without shapes.

A capsule from the joint of link j to the next joint represents the link. Its radius is `RADIUS_SHARE` times its length,
and at least `LEAST_RADIUS` times the reach of the arm. A link of zero length, as in a wrist with intersecting axes, has
no capsule. The last link ends at the flange, if the model states one. The floor is the plane z = 0 if the first joint
is above it.
"""

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.errors import ModelFileError
from sim.model_spec import compiler_reason, full_spec, silenced
from sim.plant import PayloadBody
from sim.robot import Robot

NAMES = ("flange", "attachment_site", "attachment", "tool0", "ee_link")
"""Names of sites and bodies at a flange; the first one found is used."""
RADIUS_SHARE = 0.12
"""Radius of a capsule, as a share of the link's length."""
LEAST_RADIUS = 0.03
"""Least radius, as a share of the reach: the sum of all lengths."""
FLOOR = "capsule_floor"
PLANE, CAPSULE = mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_CAPSULE
CYLINDER, BOX = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_BOX


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Flange:
    """A flange's face: the mounting face of payloads.

    Attributes:
        origin: Its centre in the frame of the last link [m], shape (3,), relative to the last joint, as for a payload.
        rotation: Rotation matrix from the flange's axes to those of the last link, shape (3, 3); z points away from the
            arm.
        name: Name of the site or body that defines the flange; empty if the last joint's axis is used.
    """

    origin: Array
    rotation: Array
    name: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solid:
    """A box or a cylinder of a payload.

    Attributes:
        cylinder: Whether the shape is a cylinder about its z axis, otherwise a box.
        size: Radius and half length of a cylinder, half edges of a box [m].
        center: From the last joint in the axes of the last link [m], shape (3,).
        rotation: Rotation matrix from the shape's axes to those of the last link, shape (3, 3).
    """

    cylinder: bool
    size: tuple[float, ...]
    center: Array
    rotation: Array


@silenced()
def flange_of(robot: Robot) -> Flange:
    """The flange of an arm.

    Raises:
        ModelFileError: If its model file cannot be compiled.
    """
    try:
        model = full_spec(robot.model, robot.flange).compile()
    except ValueError as error:
        raise ModelFileError(f"robot model {robot.model}: {compiler_reason(error)}") from error
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    last = int(model.jnt_bodyid[-1])
    R, p = data.xmat[last].reshape(3, 3), data.xanchor[-1]
    for name in NAMES:
        for kind, places, turns, bodies in (
            (mujoco.mjtObj.mjOBJ_SITE, data.site_xpos, data.site_xmat, model.site_bodyid),
            (mujoco.mjtObj.mjOBJ_BODY, data.xpos, data.xmat, np.arange(model.nbody)),
        ):
            k = mujoco.mj_name2id(model, kind, name)
            if k >= 0 and model.body_weldid[bodies[k]] == model.body_weldid[last]:
                return Flange(origin=R.T @ (places[k] - p), rotation=R.T @ turns[k].reshape(3, 3), name=name)
    quat, along_axis = np.empty(4), np.empty(9)  # the smallest rotation that maps z to the axis
    mujoco.mju_quatZ2Vec(quat, model.jnt_axis[-1] / np.linalg.norm(model.jnt_axis[-1]))
    mujoco.mju_quat2Mat(along_axis, quat)
    return Flange(origin=np.zeros(3), rotation=along_axis.reshape(3, 3), name="")


def add_solid(body: mujoco.MjsBody, solid: Solid) -> None:
    """Give a mounted payload a shape."""
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(solid.rotation).ravel())
    kind, size = CYLINDER if solid.cylinder else BOX, [*solid.size, 0.0][:3]
    body.add_geom(type=kind, size=size, pos=solid.center, quat=quat, mass=0.0)


def add_payload_shape(body: mujoco.MjsBody, payload: PayloadBody) -> None:
    """Set the shape of a mounted payload to the solid cylinder with axis z that has its mass and moments."""
    ixx, iyy, izz, *_ = payload.inertia
    radius = np.sqrt(2.0 * izz / payload.mass)
    length = np.sqrt(max(6.0 * (ixx + iyy) / payload.mass - 3.0 * radius**2, 1e-4))
    body.add_geom(type=CYLINDER, size=[radius, 0.5 * length, 0], pos=payload.com)


def stand_in(spec: mujoco.MjSpec, robot: Robot) -> list[str]:
    """Name all bodies of a robot's model, and add capsules and a floor if no moving part has a shape.

    Returns:
        Names of the bodies with a capsule, from base to flange; empty if the model has shapes.
    """
    for k, body in enumerate(spec.bodies):
        if not body.name:
            body.name = f"unnamed_body_{k}"
    moving = {body.name for joint in spec.joints for body in (joint.parent, *joint.parent.find_all("body"))}
    if any(geom.parent.name in moving for geom in spec.geoms):
        return []
    flange = flange_of(robot)
    return add_capsules(spec, flange.origin if flange.name else None)


def add_capsules(spec: mujoco.MjSpec, flange: Array | None) -> list[str]:
    """Add capsules to an arm, and a floor if it is above the plane z = 0 and has none.

    Args:
        spec: The arm; bodies have names.
        flange: Centre of the flange's face in the frame of the last link [m], None if the model does not state it.

    Returns:
        Names of the bodies that have one, from base to flange.
    """
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [int(body) for body in model.jnt_bodyid]
    ends = [*data.xanchor]
    if flange is not None:
        ends.append(ends[-1] + data.xmat[bodies[-1]].reshape(3, 3) @ flange)
    lengths = [float(np.linalg.norm(b - a)) for a, b in pairwise(ends)]
    thinnest = LEAST_RADIUS * sum(lengths)
    names: list[str] = []
    for body, length, *line in zip(bodies, lengths, ends[:-1], ends[1:], strict=False):
        if length <= thinnest:
            continue
        R = data.xmat[body].reshape(3, 3)
        fromto = np.concatenate([R.T @ (end - data.xpos[body]) for end in line])
        names.append(model.body(body).name)
        radius = max(RADIUS_SHARE * length, thinnest)
        spec.body(names[-1]).add_geom(type=CAPSULE, fromto=fromto, size=[radius, 0.0, 0.0], mass=0.0)
    if float(ends[0][2]) > thinnest and not any(geom.type == PLANE for geom in spec.geoms):
        floor = spec.worldbody.add_body(name=FLOOR)
        floor.add_geom(type=PLANE, size=[3.0, 3.0, 0.1])
    return names
