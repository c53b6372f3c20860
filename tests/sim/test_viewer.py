import mujoco
import numpy as np
import pytest

from scenarios.experiments.scenario import load_scenario, setup_of
from sim.errors import PlantError
from sim.viewer import _azimuth, _directions, pictures, scene

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


def test_the_camera_looks_across_the_direction_in_which_arms_are_widest():
    for degrees in (-71.0, 13.0, 64.0, 158.0):
        line, across = (np.array([np.cos(x), np.sin(x), 0.0]) for x in np.radians([degrees, degrees + 90.0]))
        corners = np.outer([-1.7, 0.4, 2.9], line) + np.outer([0.1, -0.2, 0.15], across) - [3.0, 0.7, 2.0]
        flat = np.linalg.svd(corners[:, :2] - corners[:, :2].mean(axis=0))[2][0]
        azimuth = _azimuth([corners])
        np.testing.assert_allclose(abs(np.dot(_directions(azimuth)[0][:2], flat)), 1.0, rtol=1e-12)
        assert 45.0 <= azimuth <= 225.0


def test_arms_are_side_by_side_at_all_times_from_left_to_right(shown, experiments):
    data, toward = mujoco.MjData(shown.model), np.radians(shown.azimuth)
    across = list[np.ndarray]()
    for t in shown.times:
        shown.put(data, t)
        across.append((data.xanchor @ [np.sin(toward), -np.cos(toward), 0.0]).reshape(len(experiments), -1))
    reach = np.ptp(across, axis=(0, 2)).max()
    assert (np.min(across, axis=(0, 2))[1:] - np.max(across, axis=(0, 2))[:-1] > 0.15 * reach).all()


def test_loaded_arms_alone_show_their_payload(shown, experiments):
    loaded = [experiment.loaded for experiment in experiments]
    assert loaded == [False, True, True, False]
    assert (shown.model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE).sum() == 1  # one floor for all
    names = [shown.model.body(i).name for i in range(shown.model.nbody)]
    bodies = [i for i, name in enumerate(names) if name.endswith("payload")]
    assert [shown.model.body_geomnum[i] > 0 for i in bodies] == loaded
    masses = [shown.model.body_mass[i] for i in bodies]
    np.testing.assert_allclose(masses, [e.plant.payload.mass if e.loaded else 0.0 for e in experiments], atol=1e-9)


def test_without_opengl_a_picture_is_refused_with_what_to_install(shown, monkeypatch):
    def renderer(*_):
        raise mujoco.FatalError("gladLoadGL error\nmore")

    monkeypatch.setattr(mujoco, "Renderer", renderer)
    with pytest.raises(PlantError, match=r"^no OpenGL for rendering \(FatalError gladLoadGL error\); install EGL"):
        next(pictures(shown, [0.0], width=64, height=64))
