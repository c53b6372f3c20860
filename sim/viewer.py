"""The motions of an experiment to look at: an arm for each, side by side, in one MuJoCo scene.

Nothing is simulated: every arm stands where its reference motion puts it, as the controller follows it to a fraction of
a degree. A payload is drawn as the solid cylinder of its mass and moments.
"""

import time
import warnings
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from ident.support.arrays import Array, Indices
from sim.capsules import stand_in
from sim.clearance import add_payload_shape
from sim.compile import mount_payload
from sim.errors import ADVICE, ModelFileError, NoPicture
from sim.experiment import Experiment
from sim.model_spec import full_spec
from sim.silenced_mujoco import silenced

BESIDE = 1.3
"""Distance of neighbouring arms, in shares of an arm's reach."""
AZIMUTH, ELEVATION = 135.0, -15.0
"""Direction in which the camera looks, about the vertical from x, and above the horizon [deg]."""
ROOM = 1.1
"""Size of a picture in shares of what it must hold."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Arms side by side.

    Attributes:
        model: All of them.
        places: Where the positions of each arm's joints stand in the state, one array (n,) an experiment.
        motions: Reference motion of each.
        duration: Of the longest motion [s].
    """

    model: mujoco.MjModel
    places: tuple[Indices, ...]
    motions: tuple[Callable[[Array], tuple[Array, Array, Array]], ...]
    duration: float

    def put(self, data: mujoco.MjData, t: float) -> None:
        """Move every arm to where it is at a time [s] of its motion."""
        for places, motion in zip(self.places, self.motions, strict=True):
            data.qpos[places] = motion(np.array([t]))[0][0]
        mujoco.mj_kinematics(self.model, data)


@silenced()
def scene(experiments: Sequence[Experiment]) -> Scene:
    """Put the arms of some experiments side by side, from left to right in their order.

    Raises:
        ModelFileError: If a model file cannot be compiled.
    """
    # To the right of the first, as the camera sees it.
    right, _, _ = _directions()
    try:
        whole = _drawn(experiments[0])
        for light in list(whole.lights):
            whole.delete(light)
        sun = {"type": mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, "diffuse": [0.6] * 3, "castshadow": False}
        whole.worldbody.add_light(pos=[0.0, 0.0, 5.0], dir=[-0.3, 0.3, -1.0], **sun)
        for floor in _planes(whole):
            floor.size[:2] = 0.0  # without end
        for material in whole.materials:
            material.reflectance = 0.0  # a film without is smaller, and drawn in half the time
        step = BESIDE * reach(experiments[0])
        for k, experiment in enumerate(experiments[1:], start=1):
            arm = _drawn(experiment)
            for element in [*arm.lights, *_planes(arm)]:
                arm.delete(element)
            whole.attach(arm, prefix=_prefix(k), frame=whole.worldbody.add_frame(pos=k * step * right))
        model = whole.compile()
    except ValueError as error:
        path = experiments[0].plant.robot.model
        raise ModelFileError(f"robot model {path}: {str(error).splitlines()[0]}") from error
    names = [model.joint(j).name for j in range(model.njnt)]
    places = tuple(
        np.array([model.jnt_qposadr[j] for j, name in enumerate(names) if _owner(name) == k])
        for k in range(len(experiments))
    )
    motions = tuple(experiment.trajectory for experiment in experiments)
    return Scene(model, places, motions, max(motion.duration for motion in motions))


def reach(experiment: Experiment) -> float:
    """Sum of the distances from each body to the next [m], the payload's included."""
    spec = _drawn(experiment)
    return float(sum(np.linalg.norm(body.pos) for body in spec.bodies[1:]))


def watch(shown: Scene) -> None:
    """Play the motions in MuJoCo's viewer, again and again, until its window is closed.

    Raises:
        NoPicture: If no window can be opened.
    """
    import glfw
    import mujoco.viewer

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what it warns of is told below
        if not glfw.init():
            raise NoPicture(f"no window can be opened: {glfw.get_error()[1].decode()}; --render FILE needs none")
    data = mujoco.MjData(shown.model)
    shown.put(data, 0.0)
    with mujoco.viewer.launch_passive(shown.model, data) as window:
        camera = overview(shown, 1.5)
        for name in ("lookat", "distance", "azimuth", "elevation"):
            setattr(window.cam, name, getattr(camera, name))
        started = time.monotonic()
        while window.is_running():
            shown.put(data, (time.monotonic() - started) % shown.duration)
            window.sync()
            time.sleep(0.01)


def pictures(shown: Scene, times: Sequence[float], *, width: int, height: int) -> Generator[Array]:
    """Pictures of the scene without a screen.

    Args:
        shown: The scene.
        times: When [s].
        width: Pixels.
        height: Pixels.

    Yields:
        8-bit RGB, shape (height, width, 3), one a time.

    Raises:
        NoPicture: If there is no OpenGL to draw with.
    """
    model, data = shown.model, mujoco.MjData(shown.model)
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    try:
        renderer = mujoco.Renderer(model, height, width)
    except Exception as error:  # each OpenGL has errors of its own, from AttributeError to FatalError
        raise NoPicture(
            f"no OpenGL for rendering ({type(error).__name__} {str(error).partition(chr(10))[0]}); {ADVICE}"
        ) from error
    camera = overview(shown, width / height)
    with renderer:
        for t in times:
            shown.put(data, t)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            yield renderer.render()


def overview(shown: Scene, aspect: float) -> mujoco.MjvCamera:
    """A camera that sees every arm all along its motion, in a picture `aspect` times as wide as it is high."""
    data, model = mujoco.MjData(shown.model), shown.model
    solid = model.geom_type != int(mujoco.mjtGeom.mjGEOM_PLANE)
    found: list[Array] = []
    for t in np.linspace(0.0, shown.duration, 40):
        shown.put(data, float(t))
        radius = np.concatenate([model.geom_rbound[solid], np.zeros(model.njnt)])
        centers = np.concatenate([data.geom_xpos[solid], data.xanchor]) @ np.transpose(_directions())
        found += [(centers - radius[:, None]).min(axis=0), (centers + radius[:, None]).max(axis=0)]
    low, high = np.min(found, axis=0), np.max(found, axis=0)
    half = 0.5 * (high - low)  # to the right, up, towards the camera
    slope = np.tan(np.radians(0.5 * model.vis.global_.fovy))
    camera = mujoco.MjvCamera()
    camera.lookat = 0.5 * (low + high) @ np.array(_directions())
    camera.azimuth, camera.elevation = AZIMUTH, ELEVATION
    camera.distance = half[2] + ROOM * max(half[1] / slope, half[0] / (aspect * slope))
    return camera


def _directions() -> tuple[Array, Array, Array]:
    """Right, up and towards the viewer in the camera's picture, unit vectors of the world."""
    a, e = np.radians(AZIMUTH), np.radians(ELEVATION)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return right, np.cross(right, ahead), -ahead


def _planes(spec: mujoco.MjSpec) -> list[mujoco.MjsGeom]:
    return [geom for geom in spec.geoms if geom.type == mujoco.mjtGeom.mjGEOM_PLANE]


def _drawn(experiment: Experiment) -> mujoco.MjSpec:
    """An arm as its file draws it, with what it carries."""
    robot = experiment.plant.robot
    spec = full_spec(robot.model, robot.flange)
    stand_in(spec, robot)
    body = mount_payload(spec, experiment.plant.payload if experiment.loaded else None)
    if experiment.loaded:
        add_payload_shape(body, experiment.plant.payload)
        body.geoms[-1].rgba = [0.55, 0.57, 0.6, 1.0]
    return spec


def _prefix(number: int) -> str:
    return f"motion {number}: "


def _owner(joint: str) -> int:
    """Which arm a joint is of."""
    number, found, _ = joint.removeprefix("motion ").partition(": ")
    return int(number) if found and number.isdecimal() else 0
