import mujoco
import numpy as np
import pytest

from scenarios.experiments.build import setup_of
from scenarios.experiments.files.loading import load_scenario
from sim.errors import NoPicture
from sim.viewer import overview, pictures, scene

T = 3.7


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


def test_arms_stand_from_left_to_right_and_apart(shown):
    data = mujoco.MjData(shown.model)
    shown.put(data, 0.0)
    places = np.array([data.xanchor[p[0]] for p in shown.places])
    camera = overview(shown, 1.5)
    azimuth = np.radians(camera.azimuth)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])  # of MuJoCo's camera, which looks along its azimuth
    steps = np.diff(places @ right)
    reach = 1.32  # the RX-90: 0.42, 0.45, 0.45 m as drawn, to the wrist
    np.testing.assert_allclose(steps, 1.3 * reach, rtol=1e-9)
    np.testing.assert_allclose(np.diff(places, axis=0), np.outer(steps, right), atol=1e-12)


def test_loaded_arms_alone_show_their_payload(shown, experiments):
    loaded = [experiment.loaded for experiment in experiments]
    assert loaded == [False, True, True, False]
    names = [shown.model.body(i).name for i in range(shown.model.nbody)]
    bodies = [i for i, name in enumerate(names) if name.endswith("payload")]
    assert [shown.model.body_geomnum[i] > 0 for i in bodies] == loaded
    masses = [shown.model.body_mass[i] for i in bodies]
    np.testing.assert_allclose(masses, [e.plant.payload.mass if e.loaded else 0.0 for e in experiments], atol=1e-9)


@pytest.mark.parametrize("aspect", [0.7, 2.3])
def test_the_camera_sees_every_joint_all_along_the_motion(shown, aspect):
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


def test_the_camera_sees_shapes_beyond_the_last_joint(experiments):
    plain, loaded = (overview(scene([each]), 1.0) for each in experiments[:2])  # the same motion, bare and loaded
    assert loaded.distance > 1.002 * plain.distance


def test_without_opengl_a_picture_is_refused_with_what_to_install(shown, monkeypatch):
    def renderer(*_):
        raise mujoco.FatalError("gladLoadGL error\nmore")

    monkeypatch.setattr(mujoco, "Renderer", renderer)
    with pytest.raises(NoPicture, match=r"^no OpenGL for rendering \(FatalError gladLoadGL error\); install EGL"):
        next(pictures(shown, [0.0], width=64, height=64))
