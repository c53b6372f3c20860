"""Display of the motions of an experiment: one arm per motion, side by side, in one MuJoCo scene.

Nothing is simulated: every arm is at its reference position, which the controller follows to a fraction of a degree. A
payload is drawn as the solid cylinder with its mass and moments, on a bracket.

Collision shapes are grey and leave gaps between links. A link extends from the axis of its joint to the axis of the
next one. Capsules fill the gaps between its shapes and these axes, and a cylinder about the axis represents a joint.
Links have alternating colours. Arms whose shapes have colours or meshes are not changed.
"""

import time
import warnings
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import mujoco
import numpy as np

from ident.support.arrays import Array, Indices
from sim.errors import ADVICE, PlantError
from sim.experiment import Experiment
from sim.model_spec import full_spec, silenced
from sim.plant import PayloadBody, mount_payload
from sim.robot import Robot
from sim.shapes import CAPSULE, CYLINDER, LEAST_RADIUS, PLANE, add_payload_shape, flange_of, stand_in
from sim.trajectory import FourierTrajectory

LINKS = [0.93, 0.94, 0.95, 1.0], [0.25, 0.5, 0.76, 1.0]
JOINT, PAYLOAD, BRACKET = [0.2, 0.22, 0.25, 1.0], [0.91, 0.42, 0.1, 1.0], [0.4, 0.42, 0.45, 1.0]
UNCOLOURED = [0.5, 0.5, 0.5, 1.0]
"""Default colour of MuJoCo."""
SKY = mujoco.mjtTexture.mjTEXTURE_SKYBOX
SAMPLES = np.linspace(-1.0, 1.0, 41)[:, None]
"""Positions of points along a capsule, relative to its half length."""
ELEVATION = -15.0
"""Direction in which the camera looks, above the horizon [deg]."""
ROOM = 1.15
"""Size of a picture relative to its content; also the spacing between neighbouring arms."""
SLENDER = 4.0 / 3.0, 7.0 / 3.0
"""Aspect ratios (width over height) of pictures that are cropped to the arms."""
TIMES = 40
"""Number of times of the motions for the layout of a scene, unless times are given."""
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""Corners of a box, relative to its half edges, shape (8, 3)."""


def drawn_arm(robot: Robot, payload: PayloadBody | None) -> mujoco.MjSpec:
    """Return the model of an arm for rendering, with its payload.

    Raises:
        PlantError: If its model file cannot be compiled.
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


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Arms side by side.

    Attributes:
        model: All of them.
        places: Indices of each arm's joint positions in the state, one array (n,) per experiment.
        motions: Reference motion of each.
        duration: Duration of the longest motion [s].
        times: Times for which the scene is laid out [s].
        azimuth: Direction in which the camera looks, about the vertical from x [deg].
    """

    model: mujoco.MjModel
    places: tuple[Indices, ...]
    motions: tuple[FourierTrajectory, ...]
    duration: float
    times: Array
    azimuth: float

    def put(self, data: mujoco.MjData, t: float) -> None:
        """Move every arm to its position at a time [s]."""
        for places, motion in zip(self.places, self.motions, strict=True):
            data.qpos[places] = motion(np.array([t]))[0][0]
        mujoco.mj_kinematics(self.model, data)

    def seen(self) -> Array:
        """Corners of all arms at all times, in coordinates right, up and towards the camera, shape (k, 3) [m]."""
        q = np.zeros((len(self.times), self.model.nq))
        for places, motion in zip(self.places, self.motions, strict=True):
            q[:, places] = motion(self.times)[0]
        return _swept(self.model, q) @ np.transpose(_directions(self.azimuth))

    def height(self, width: int) -> int:
        """Return the height in pixels that the arms need, an even number, as films require; within `SLENDER`."""
        across, up, _ = np.ptp(self.seen(), axis=0)
        return 2 * round(0.5 * width / float(np.clip(across / up, *SLENDER)))


@silenced()
def scene(experiments: Sequence[Experiment], times: Sequence[float] | None = None) -> Scene:
    """Place the arms of some experiments side by side, from left to right, viewed from where they appear widest.

    The scene is laid out for some times [s], by default for the whole motions.

    Raises:
        PlantError: If a model file cannot be compiled.
    """
    motions = tuple(experiment.trajectory for experiment in experiments)
    duration = max(motion.duration for motion in motions)
    instants = np.linspace(0.0, duration, TIMES) if times is None else np.array(times)
    try:
        arms = [drawn_arm(each.plant.robot, each.plant.payload if each.loaded else None) for each in experiments]
        swept = [_swept(arm.copy().compile(), motion(instants)[0]) for arm, motion in zip(arms, motions, strict=True)]
        azimuth = _azimuth(swept)
        right, _, towards = _directions(azimuth)
        furnish(arms[0], sunlight=0.3 * (right - towards) - np.array([0.0, 0.0, 1.0]))
        extents = [(each @ right).min() for each in swept], [(each @ right).max() for each in swept]
        gap, place = (ROOM - 1.0) * max(np.ptp(each @ right) for each in swept), 0.0
        for k, arm in enumerate(arms[1:], start=1):
            for element in [*arm.lights, *planes(arm)]:
                arm.delete(element)
            place += extents[1][k - 1] - extents[0][k] + gap
            arms[0].attach(arm, prefix=f"motion {k}: ", frame=arms[0].worldbody.add_frame(pos=place * right))
        model = arms[0].compile()
    except ValueError as error:
        path = experiments[0].plant.robot.model
        raise PlantError(f"robot model {path}: {str(error).splitlines()[0]}") from error
    ends = np.cumsum([0, *(motion.n for motion in motions)])  # arms are in the order of their attachment
    places = tuple(model.jnt_qposadr[one:other] for one, other in pairwise(ends))
    return Scene(model, places, motions, duration, instants, azimuth)


def watch(shown: Scene) -> None:
    """Play the motions repeatedly in MuJoCo's viewer until its window is closed.

    Raises:
        PlantError: If no window can be opened.
    """
    import glfw
    import mujoco.viewer

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its warnings are reported below
        if not glfw.init():
            raise PlantError(f"no window can be opened: {glfw.get_error()[1].decode()}; --render FILE needs none")
    data = mujoco.MjData(shown.model)
    shown.put(data, 0.0)
    with mujoco.viewer.launch_passive(shown.model, data) as window:
        look(shown, 1.5, window.cam)
        started = time.monotonic()
        while window.is_running():
            shown.put(data, (time.monotonic() - started) % shown.duration)
            window.sync()
            time.sleep(0.01)


def pictures(shown: Scene, times: Sequence[float], *, width: int, height: int) -> Generator[Array]:
    """Yield pictures of the scene at times [s], rendered off-screen: 8-bit RGB, shape (height, width, 3).

    Raises:
        PlantError: If OpenGL is not available.
    """
    model, data = shown.model, mujoco.MjData(shown.model)
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    try:
        renderer = mujoco.Renderer(model, height, width)
    except Exception as error:  # each OpenGL backend raises other errors, from AttributeError to FatalError
        raise PlantError(
            f"no OpenGL for rendering ({type(error).__name__} {str(error).partition(chr(10))[0]}); {ADVICE}"
        ) from error
    camera = mujoco.MjvCamera()
    look(shown, width / height, camera)
    with renderer:
        for t in times:
            shown.put(data, t)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            yield renderer.render()


def look(shown: Scene, aspect: float, camera: mujoco.MjvCamera) -> None:
    """Place a camera to show every arm at the scene's times, in a picture with the given aspect ratio."""
    seen = shown.seen()
    middle = 0.5 * (seen.min(axis=0) + seen.max(axis=0))
    slope = np.tan(np.radians(0.5 * shown.model.vis.global_.fovy))
    across, up, towards = (seen - middle).T
    camera.lookat = middle @ np.array(_directions(shown.azimuth))
    camera.azimuth, camera.elevation = shown.azimuth, ELEVATION
    camera.distance = (towards + ROOM * np.maximum(np.abs(up) / slope, np.abs(across) / (aspect * slope))).max()


def _swept(model: mujoco.MjModel, q: Array) -> Array:
    """Corners of the bounding boxes of all shapes but planes, and joint anchors, at positions (N, nq), (k, 3) [m]."""
    data, found = mujoco.MjData(model), list[Array]()
    solid = model.geom_type != int(mujoco.mjtGeom.mjGEOM_PLANE)
    center, half = model.geom_aabb[solid, None, :3], model.geom_aabb[solid, None, 3:]
    for position in q:
        data.qpos[:] = position
        mujoco.mj_kinematics(model, data)
        turned = (center + CORNERS * half) @ data.geom_xmat[solid].reshape(-1, 3, 3).transpose(0, 2, 1)
        found += [(data.geom_xpos[solid, None] + turned).reshape(-1, 3), data.xanchor.copy()]
    return np.vstack(found)


def _azimuth(swept: Sequence[Array]) -> float:
    """Return the viewing direction [deg] in which the arms appear widest."""
    spread = sum(np.cov(each[:, :2].T) for each in swept)
    widest = np.linalg.eigh(spread)[1][:, -1]
    found = np.degrees(np.arctan2(widest[1], widest[0])) + 90.0
    return float((found + 45.0) % 180.0 - 45.0 + (0.0 if (found + 45.0) % 180.0 > 90.0 else 180.0))


def _directions(azimuth: float) -> tuple[Array, Array, Array]:
    """Return the unit vectors right, up and towards the viewer of a camera, in world axes."""
    a, e = np.radians(azimuth), np.radians(ELEVATION)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return right, np.cross(right, ahead), -ahead
