"""Shapes for an arm whose model file has none: capsules between joint anchors.

A capsule from the joint of link j to the next joint represents the link. Its radius is `RADIUS_SHARE` times its length,
and at least `LEAST_RADIUS` times the reach of the arm. A link of zero length, as in a wrist with intersecting axes, has
no capsule. The last link ends at the flange, if the model states one. The floor is the plane z = 0 if the first joint
is above it.
"""

from itertools import pairwise

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.flange import flange_of
from sim.robot import Robot

RADIUS_SHARE = 0.12
"""Radius of a capsule, as a share of the link's length."""
LEAST_RADIUS = 0.03
"""Least radius, as a share of the reach: the sum of all lengths."""
FLOOR = "capsule_floor"


def stand_in(spec: mujoco.MjSpec, robot: Robot) -> list[str]:
    """Name all bodies of a robot's model, and add capsules and a floor if it has no shapes.

    Returns:
        Names of the bodies with a capsule, from base to flange; empty if the model has shapes.
    """
    for k, body in enumerate(spec.bodies):
        if not body.name:
            body.name = f"unnamed_body_{k}"
    if has_shapes(spec):
        return []
    flange = flange_of(robot)
    return add_capsules(spec, flange.origin if flange.name else None)


def has_shapes(spec: mujoco.MjSpec) -> bool:
    """Whether any moving part of a model has a shape."""
    moving = {body.name for joint in spec.joints for body in (joint.parent, *joint.parent.find_all("body"))}
    return any(geom.parent.name in moving for geom in spec.geoms)


def add_capsules(spec: mujoco.MjSpec, flange: Array | None) -> list[str]:
    """Add capsules and a floor to an arm without shapes.

    Args:
        spec: The arm; bodies have names.
        flange: Centre of the flange's face in the frame of the last link [m], None if the model does not state it.

    Returns:
        Names of the bodies that have one, from base to flange.
    """
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [int(model.jnt_bodyid[j]) for j in range(model.njnt)]
    ends = [data.xanchor[j] for j in range(model.njnt)]
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
        spec.body(names[-1]).add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=fromto, size=[radius, 0.0, 0.0])
    if float(data.xanchor[0][2]) > thinnest and not any(g.type == mujoco.mjtGeom.mjGEOM_PLANE for g in spec.geoms):
        floor = spec.worldbody.add_body(name=FLOOR)
        floor.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[3.0, 3.0, 0.1])
    return names
