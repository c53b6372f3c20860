"""Display of the motions of an experiment: one arm per motion, side by side, in one MuJoCo scene.

Nothing is simulated: every arm is at its reference position, which the controller follows to a fraction of a degree. A
payload is drawn as the solid cylinder with its mass and moments, on a bracket. Links of an arm without colours have
alternating ones; an arm with collision shapes alone is drawn as these, with the gaps between them.
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
from sim.model_spec import compiled, full_spec, silenced
from sim.plant import PayloadBody, mount_payload
from sim.robot import Robot
from sim.shapes import CAPSULE, PLANE, add_payload_shape, flange_of, stand_in
from sim.trajectory import FourierTrajectory

LINKS = [0.93, 0.94, 0.95, 1.0], [0.25, 0.5, 0.76, 1.0]
BASE, PAYLOAD, BRACKET = [0.2, 0.22, 0.25, 1.0], [0.91, 0.42, 0.1, 1.0], [0.4, 0.42, 0.45, 1.0]
UNCOLOURED = [0.5, 0.5, 0.5, 1.0]
"""Default colour of MuJoCo."""
ROOM = """<mujoco>
  <visual><headlight ambient=".35 .35 .35" diffuse=".35 .35 .35"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" width="64" height="384" rgb1=".93 .95 .97" rgb2=".62 .69 .76"/>
    <texture name="tiles" type="2d" builtin="checker" width="64" height="64" rgb1=".78 .79 .8" rgb2=".72 .73 .74"/>
    <material name="floor" texture="tiles" texrepeat="8 8"/>
  </asset>
  <worldbody>
    <geom type="plane" size="0 0 .1" material="floor"/>
    <light name="sun" type="directional" pos="0 0 5" diffuse=".6 .6 .6" castshadow="false"/>
  </worldbody>
</mujoco>"""
"""Sky, light and infinite floor, in place of those of the model files."""
ELEVATION = -15.0
"""Direction in which the camera looks, above the horizon [deg]."""
MARGIN = 1.15
"""Size of a picture relative to its content; also the spacing between neighbouring arms."""
SLENDER = 4.0 / 3.0, 7.0 / 3.0
"""Aspect ratios (width over height) of pictures that are cropped to the arms."""
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""Corners of a box, relative to its half edges, shape (8, 3)."""


def drawn_arm(robot: Robot, payload: PayloadBody | None) -> mujoco.MjSpec:
    """Return the model of an arm for rendering, with its payload; raises `PlantError` if it cannot be compiled."""
    spec = full_spec(robot.model, robot.flange)
    stand_in(spec, robot)
    flange = flange_of(robot).origin
    moving = _shapes_from(spec.joints[0].parent)
    if not any(geom.material or geom.rgba.tolist() != UNCOLOURED for geom in moving):
        for geom in spec.geoms:
            geom.rgba = BASE
        for k, joint in enumerate(spec.joints):
            for geom in _shapes_from(joint.parent):
                geom.rgba = LINKS[k % 2]
    body = mount_payload(spec, payload)
    if payload is not None:
        add_payload_shape(body, payload)
        body.geoms[-1].rgba = PAYLOAD
        bracket = np.concatenate((flange, payload.com))
        if np.ptp(bracket.reshape(2, 3), axis=0).any():  # MuJoCo refuses a capsule without a length
            size = [0.3 * float(body.geoms[-1].size[0]), 0.0, 0.0]
            body.add_geom(type=CAPSULE, fromto=bracket, size=size, rgba=BRACKET, mass=0.0)
    return spec


def _shapes_from(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    return [geom for each in (body, *body.find_all("body")) for geom in each.geoms]


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Arms side by side."""

    model: mujoco.MjModel
    places: tuple[Indices, ...]  # indices of each arm's joint positions in the state, one array (n,) per experiment
    motions: tuple[FourierTrajectory, ...]
    duration: float
    times: Array  # times for which the scene is laid out [s]
    azimuth: float  # direction in which the camera looks, about the vertical from x [deg]

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
    """Place arms side by side, seen from where they appear widest at some times [s]; `PlantError` for a faulty file."""
    motions = tuple(experiment.trajectory for experiment in experiments)
    duration = max(motion.duration for motion in motions)
    instants = np.linspace(0.0, duration, 40) if times is None else np.array(times)
    with compiled(experiments[0].plant.robot.model):
        arms = [drawn_arm(each.plant.robot, each.plant.payload if each.loaded else None) for each in experiments]
        swept = [_swept(arm.copy().compile(), motion(instants)[0]) for arm, motion in zip(arms, motions, strict=True)]
        azimuth = _azimuth(swept)
        right, _, towards = _directions(azimuth)
        room = mujoco.MjSpec.from_string(ROOM)
        room.light("sun").dir = 0.3 * (right - towards) - np.array([0.0, 0.0, 1.0])
        gap, place = (MARGIN - 1.0) * max(np.ptp(each @ right) for each in swept), 0.0
        for k, (arm, corners) in enumerate(zip(arms, swept, strict=True)):
            skies = [each for each in arm.textures if each.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX]
            for element in [*arm.lights, *skies, *(geom for geom in arm.geoms if geom.type == PLANE)]:
                arm.delete(element)
            place -= (corners @ right).min() if k else 0.0
            room.attach(arm, prefix=f"motion {k}: ", frame=room.worldbody.add_frame(pos=place * right))
            place += (corners @ right).max() + gap
        for material in room.materials:
            material.reflectance = 0.0  # a film is smaller and rendered in half the time
        model = room.compile()
    ends = np.cumsum([0, *(motion.n for motion in motions)])  # arms are in the order of their attachment
    places = tuple(model.jnt_qposadr[one:other] for one, other in pairwise(ends))
    return Scene(model, places, motions, duration, instants, azimuth)


def watch(shown: Scene) -> None:
    """Play the motions in MuJoCo's viewer until its window is closed; raises `PlantError` if none can be opened."""
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
    """Yield 8-bit RGB pictures (height, width, 3) of the scene at times [s]; raises `PlantError` without OpenGL."""
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
    camera.distance = (towards + MARGIN * np.maximum(np.abs(up) / slope, np.abs(across) / (aspect * slope))).max()


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
    return float(225.0 - (135.0 - np.degrees(np.arctan2(widest[1], widest[0]))) % 180.0)  # across, from 45 to 225


def _directions(azimuth: float) -> tuple[Array, Array, Array]:
    """Return the unit vectors right, up and towards the viewer of a camera, in world axes."""
    a, e = np.radians(azimuth), np.radians(ELEVATION)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return right, np.cross(right, ahead), -ahead
