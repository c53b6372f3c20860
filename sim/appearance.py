"""Appearance of a rendered arm: connected links of alternating colours, a payload on a bracket, a floor and a sky.

Collision shapes are grey and leave gaps between links. A link extends from the axis of its joint to the axis of the
next one. Capsules fill the gaps between its shapes and these axes, and a cylinder about the axis represents a joint.
Arms whose shapes have colours or meshes are not changed.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from ident.support.arrays import Array
from sim.compile import mount_payload
from sim.model_spec import full_spec
from sim.plant import PayloadBody
from sim.robot import Robot
from sim.shapes import CAPSULE, CYLINDER, LEAST_RADIUS, PLANE, add_payload_shape, flange_of, stand_in

LINKS = [0.93, 0.94, 0.95, 1.0], [0.25, 0.5, 0.76, 1.0]
JOINT, PAYLOAD, BRACKET = [0.2, 0.22, 0.25, 1.0], [0.91, 0.42, 0.1, 1.0], [0.4, 0.42, 0.45, 1.0]
UNCOLOURED = [0.5, 0.5, 0.5, 1.0]
"""Default colour of MuJoCo."""
SKY = mujoco.mjtTexture.mjTEXTURE_SKYBOX
SAMPLES = np.linspace(-1.0, 1.0, 41)[:, None]
"""Positions of points along a capsule, relative to its half length."""


def drawn_arm(robot: Robot, payload: PayloadBody | None) -> mujoco.MjSpec:
    """Return the model of an arm for rendering, with its payload.

    Raises:
        ModelFileError: If its model file cannot be compiled.
    """
    spec = full_spec(robot.model, robot.flange)
    stand_in(spec, robot)
    flange = flange_of(robot).origin
    moving = _shapes_from(spec.joints[0].parent)
    if not any(geom.material or geom.rgba.tolist() != UNCOLOURED for geom in moving):
        _colour_links(spec)
        if not any(geom.type == mujoco.mjtGeom.mjGEOM_MESH for geom in moving):
            _join_links(spec, flange)
    body = mount_payload(spec, payload)
    if payload is not None:
        add_payload_shape(body, payload)
        body.geoms[-1].rgba = PAYLOAD
        _add(body, CAPSULE, flange, np.array(payload.com), 0.3 * float(body.geoms[-1].size[0]), BRACKET)
    return spec


def furnish(spec: mujoco.MjSpec, sunlight: Array) -> None:
    """Add a sky, a light with direction (3,) and an infinite floor to a scene, in place of its own."""
    for element in [*spec.lights, *planes(spec), *(each for each in spec.textures if each.type == SKY)]:
        spec.delete(element)
    picture = {"width": 64, "height": 384}
    sky = {"rgb1": [0.93, 0.95, 0.97], "rgb2": [0.62, 0.69, 0.76]}
    spec.add_texture(name="room sky", type=SKY, builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, **picture, **sky)
    tiles = {"rgb1": [0.78, 0.79, 0.8], "rgb2": [0.72, 0.73, 0.74], "width": 64, "height": 64}
    checker = mujoco.mjtBuiltin.mjBUILTIN_CHECKER
    spec.add_texture(name="room tiles", type=mujoco.mjtTexture.mjTEXTURE_2D, builtin=checker, **tiles)
    material = spec.add_material(name="room floor", texrepeat=[8.0, 8.0])
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "room tiles"
    spec.worldbody.add_geom(type=PLANE, size=[0.0, 0.0, 0.1], material="room floor")
    sun = {"type": mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, "diffuse": [0.6] * 3, "castshadow": False}
    spec.worldbody.add_light(pos=[0.0, 0.0, 5.0], dir=sunlight, **sun)
    spec.visual.headlight.ambient = spec.visual.headlight.diffuse = [0.35] * 3
    for each in spec.materials:
        each.reflectance = 0.0  # without shadows a film is smaller and rendered in half the time


def planes(spec: mujoco.MjSpec) -> list[mujoco.MjsGeom]:
    """Return the shapes that are planes, usually floors."""
    return [geom for geom in spec.geoms if geom.type == PLANE]


def _shapes_from(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    return [geom for each in (body, *body.find_all("body")) for geom in each.geoms]


def _colour_links(spec: mujoco.MjSpec) -> None:
    for geom in spec.geoms:
        geom.rgba = JOINT
    for k, joint in enumerate(spec.joints):
        for geom in _shapes_from(joint.parent):
            geom.rgba = LINKS[k % 2]


@dataclass(frozen=True, slots=True, eq=False)
class _Link:
    """Return points on the centre lines of a link's shapes, (k, 3), or its end if it has none; and its radius [m]."""

    points: Array
    radius: float

    def nearest(self, start: Array, anchor: Array, axis: Array) -> Array:
        """Return the point with the shortest path from a start along an axis and then straight to the point."""
        feet = anchor + ((self.points - anchor) @ axis)[:, None] * axis
        ways = np.linalg.norm(self.points - feet, axis=1) + np.linalg.norm(feet - start, axis=1)
        return self.points[int(ways.argmin())]


def _join_links(spec: mujoco.MjSpec, flange: Array) -> None:
    """Fill the gaps between an arm's shapes, from floor to flange (in the frame of the last link)."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = [0, *(int(body) for body in model.jnt_bodyid)]
    ends = [*data.xanchor, data.xanchor[-1] + data.xmat[bodies[-1]].reshape(3, 3) @ flange]
    met = np.array([*ends[0][:2], min(0.0, float(ends[0][2]))])  # where one link ends and the next one begins
    least = LEAST_RADIUS * float(np.linalg.norm(np.diff([met, *ends], axis=0), axis=1).sum())
    if least == 0.0:
        return  # nothing that has a length
    links = [_link(model, data, body, end, least) for body, end in zip(bodies, ends, strict=True)]
    for k, (body, link) in enumerate(zip(bodies, links, strict=True)):
        here, (R, p) = spec.body(model.body(body).name), (data.xmat[body].reshape(3, 3), data.xpos[body])
        begun, reached = met, link.nearest(met, ends[0], np.array([0.0, 0.0, 1.0]))
        drawn: list[tuple[mujoco.mjtGeom, Array, Array, float, list[float]]] = []
        if k:
            anchor, axis = data.xanchor[k - 1], data.xaxis[k - 1]
            reached = link.nearest(met, anchor, axis)
            begun = anchor + (reached - anchor) @ axis * axis
            radius = max(link.radius, links[k - 1].radius)
            back, front = sorted(((met - anchor) @ axis, (begun - anchor) @ axis))
            if model.jnt_type[k - 1] == int(mujoco.mjtJoint.mjJNT_SLIDE):  # found wherever it has moved
                back, front = np.array([back, front]) - model.jnt_range[k - 1, ::-1]
                radius = 0.5 * link.radius
            drawn.append(
                (
                    CYLINDER,
                    anchor + (back - 1.08 * radius) * axis,
                    anchor + (front + 1.08 * radius) * axis,
                    0.85 * radius,
                    JOINT,
                )
            )
        colour = LINKS[(k - 1) % 2] if k else JOINT
        drawn.append((CAPSULE, begun, reached, 0.9 * link.radius, colour))
        met = ends[k]
        leaving = link.points[np.linalg.norm(link.points - met, axis=1).argmin()]
        if k < len(data.xanchor):
            anchor, axis = data.xanchor[k], data.xaxis[k]
            leaving = link.nearest(begun, anchor, axis)
            met = anchor + (leaving - anchor) @ axis * axis
        drawn.append((CAPSULE, leaving, met, 0.9 * link.radius, colour))
        for shape, one, other, size, rgba in drawn:
            _add(here, shape, R.T @ (one - p), R.T @ (other - p), size, rgba)


def _link(model: mujoco.MjModel, data: mujoco.MjData, body: int, end: Array, least: float) -> _Link:
    """Return the shapes that move with a body, in the axes of the world."""
    found: list[Array] = []
    radius = 0.0
    for geom in np.flatnonzero((model.body_weldid[model.geom_bodyid] == body) & (model.geom_type != int(PLANE))):
        size, rod = model.geom_size[geom], model.geom_type[geom] in (int(CAPSULE), int(CYLINDER))
        half = size[1] * data.geom_xmat[geom].reshape(3, 3)[:, 2] if rod else np.zeros(3)
        found.append(data.geom_xpos[geom] + SAMPLES * half)
        radius = max(radius, float(size[0]))
    return _Link(np.vstack(found), radius) if found else _Link(end[None], least)


def _add(
    body: mujoco.MjsBody, shape: mujoco.mjtGeom, one: Array, other: Array, radius: float, rgba: list[float]
) -> None:
    if np.linalg.norm(other - one) > 1e-6:  # MuJoCo refuses a capsule without a length
        body.add_geom(type=shape, fromto=[*one, *other], size=[radius, 0.0, 0.0], rgba=rgba, mass=0.0)
