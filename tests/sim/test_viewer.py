import mujoco
import numpy as np
import pytest

from scenarios.experiments.scenario import load_scenario, setup_of
from sim.errors import PlantError
from sim.viewer import ROOM, look, pictures, scene

T = 3.7


def overview(shown, aspect: float) -> mujoco.MjvCamera:
    camera = mujoco.MjvCamera()
    look(shown, aspect, camera)
    return camera


@pytest.fixture(scope="module")
def experiments():
    return setup_of(load_scenario("field-two-weights")).experiments


@pytest.fixture(scope="module")
def shown(experiments):
    return scene(experiments)


def test_every_arm_stands_where_its_motion_puts_it(shown, experiments):
    data = mujoco.MjData(shown.model)
    shown.put(data, T)
    arm = mujoco.MjModel.from_xml_path(str(experiments[0].plant.robot.model))
    alone = mujoco.MjData(arm)
    alone.qpos[:] = experiments[0].trajectory(np.array([T]))[0][0]
    mujoco.mj_kinematics(arm, alone)
    assert shown.model.njnt == len(experiments) * arm.njnt
    first = data.xanchor[: arm.njnt]
    for k in range(len(experiments)):
        anchors = data.xanchor[k * arm.njnt : (k + 1) * arm.njnt]
        beside = anchors[0] - first[0]  # sums of a few lengths: rounding alone
        np.testing.assert_allclose(anchors - beside, alone.xanchor, atol=1e-12)
        assert beside[2] == 0.0
        # Axes have no place: all arms have turned alike.
        np.testing.assert_allclose(data.xaxis[k * arm.njnt : (k + 1) * arm.njnt], alone.xaxis, atol=1e-12)


def boxes(shown, right, t):
    """Extent of each arm to the right at a time, shape (arms, 2)."""
    data = mujoco.MjData(shown.model)
    shown.put(data, t)
    found = np.full((len(shown.places), 2), (np.inf, -np.inf))
    owners = [
        int(name.split()[1][:-1]) if (name := shown.model.body(b).name).startswith("motion ") else 0
        for b in shown.model.geom_bodyid
    ]
    for geom, k in enumerate(owners):
        if shown.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            continue
        center, half = shown.model.geom_aabb[geom].reshape(2, 3)
        R = data.geom_xmat[geom].reshape(3, 3)
        middle, reach = (data.geom_xpos[geom] + R @ center) @ right, np.abs(right @ R) @ half
        found[k] = min(found[k, 0], middle - reach), max(found[k, 1], middle + reach)
    return found


@pytest.mark.parametrize("t", [T, 14.2])
def test_arms_stand_from_left_to_right_and_a_share_of_their_width_apart(experiments, t):
    shown = scene(experiments, [t])
    azimuth = np.radians(overview(shown, 1.5).azimuth)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])  # of MuJoCo's camera, which looks along its azimuth
    found = boxes(shown, right, t)
    widest = np.diff(found, axis=1).max()
    np.testing.assert_allclose(found[1:, 0] - found[:-1, 1], (ROOM - 1.0) * widest, rtol=1e-9)


def test_loaded_arms_alone_show_their_payload(shown, experiments):
    loaded = [experiment.loaded for experiment in experiments]
    assert loaded == [False, True, True, False]
    names = [shown.model.body(i).name for i in range(shown.model.nbody)]
    bodies = [i for i, name in enumerate(names) if name.endswith("payload")]
    assert [shown.model.body_geomnum[i] > 0 for i in bodies] == loaded
    masses = [shown.model.body_mass[i] for i in bodies]
    np.testing.assert_allclose(masses, [e.plant.payload.mass if e.loaded else 0.0 for e in experiments], atol=1e-9)


def test_the_camera_sees_every_joint_all_along_the_motion(shown):
    aspect = 0.7
    camera, data = overview(shown, aspect), mujoco.MjData(shown.model)
    a, e = np.radians(camera.azimuth), np.radians(camera.elevation)
    ahead = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    slope = np.tan(np.radians(0.5 * shown.model.vis.global_.fovy))
    largest = 0.0
    for t in np.linspace(0.0, shown.duration, 101):
        shown.put(data, t)
        ray = data.xanchor - (camera.lookat - camera.distance * ahead)
        depth = ray @ ahead
        across, up = (
            np.abs(ray @ right) / depth / (aspect * slope),
            np.abs(ray @ np.cross(right, ahead)) / depth / slope,
        )
        largest = max(largest, across.max(), up.max())
    assert 0.6 < largest < 1.0  # inside the picture, and not lost in it


def test_without_opengl_a_picture_is_refused_with_what_to_install(shown, monkeypatch):
    def renderer(*_):
        raise mujoco.FatalError("gladLoadGL error\nmore")

    monkeypatch.setattr(mujoco, "Renderer", renderer)
    with pytest.raises(PlantError, match=r"^no OpenGL for rendering \(FatalError gladLoadGL error\); install EGL"):
        next(pictures(shown, [0.0], width=64, height=64))
