import mujoco
import numpy as np
import pytest
from plants import RX90
from robot_folders import robot_folder

from scenarios.experiments.build import setup_of
from scenarios.experiments.files.loading import load_scenario
from sim.appearance import JOINT, LINKS, drawn_arm
from sim.plant import PayloadBody
from sim.robot_files import read_robot

BAR = PayloadBody(mass=1.3, com=(0.13, -0.05, 0.19), inertia=(0.002, 0.003, 0.002, 0.0, 0.0, 0.0))
MET = 1e-3
"""Shapes nearer than this touch [m]: they are placed on each other to rounding."""


def pieces(spec: mujoco.MjSpec, seed: int) -> int:
    """How many unconnected parts a drawing consists of, its joints at random positions."""
    model = spec.compile()
    data = mujoco.MjData(model)
    lower, upper = np.where(model.jnt_limited[:, None], model.jnt_range, (-1.0, 1.0)).T
    rng = np.random.default_rng(seed)
    data.qpos[:] = rng.choice([lower, rng.uniform(lower, upper), upper])  # at the ends of their ranges too
    mujoco.mj_kinematics(model, data)
    left = {g for g in range(model.ngeom) if model.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE}
    count = 0
    while left:
        group, count = [left.pop()], count + 1
        while group:
            one = group.pop()
            near = {g for g in left if mujoco.mj_geomDistance(model, data, one, g, 2 * MET, None) < MET}
            left -= near
            group += near
    return count


@pytest.mark.parametrize("name", ["panda", "so101", "stanford", "tx40", "ur10e", "yam"])
def test_built_in_arms_are_drawn_in_one_piece_wherever_their_joints_are(name):
    plant = setup_of(load_scenario(name)).experiments[1].plant
    for seed in range(5):
        assert pieces(drawn_arm(plant.robot, plant.payload), seed) == 1


def test_a_joint_is_drawn_from_where_one_link_ends_to_where_the_next_begins(tmp_path):
    # Two links along x, the second 0.2 m beside the first along the axis of the joint between them.
    rod = '<geom type="capsule" size="0.02" mass="1" fromto="0 {y} 0 0.4 {y} 0"/>'
    first, second = rod.format(y=0.1), rod.format(y=0.3)
    folder = robot_folder(tmp_path, 2)
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><geom type="capsule" size="0.02" fromto="0.3 0 0 0.3 0 0.6"/>'
        f'<body pos="0 0 0.5"><joint name="a" axis="0 1 0"/>{first}'
        f'<body pos="0.4 0 0"><joint name="b" axis="0 1 0"/>{second}</body></body></worldbody></mujoco>'
    )
    model = drawn_arm(read_robot(folder), None).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joint = [g for g in np.flatnonzero(model.geom_bodyid == 2) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_CYLINDER]
    np.testing.assert_allclose(data.geom_xpos[joint], [[0.4, 0.2, 0.5]], atol=1e-12)
    # Half of 0.2 m, and beyond the links' radius, 0.02 m, on both sides.
    assert 0.12 < model.geom_size[joint, 1].item() < 0.125
    base = np.round(data.geom_xpos[model.geom_bodyid == 0], 12).tolist()
    assert [0.15, 0.0, 0.0] in base  # from below the first joint to the foot of the column beside it


@pytest.mark.parametrize("joints", [1, 3, 7])
def test_an_arm_of_frames_alone_is_drawn_in_one_piece_with_its_payload(tmp_path, joints):
    robot = read_robot(robot_folder(tmp_path, joints))
    for seed in range(3):
        assert pieces(drawn_arm(robot, BAR), seed) == 1


def test_links_alternate_in_colour_and_joints_have_another(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 4))
    spec = drawn_arm(robot, None)
    for k, joint in enumerate(spec.joints):
        colours = {tuple(np.float32(geom.rgba)) for geom in joint.parent.geoms}
        assert colours <= {tuple(np.float32(LINKS[k % 2])), tuple(np.float32(JOINT))}
        assert tuple(np.float32(JOINT)) in colours


def test_an_arm_with_colours_of_its_own_is_left_as_it_is_drawn():
    own = mujoco.MjSpec.from_file(str(RX90.model))
    drawn = drawn_arm(RX90, None)
    assert [(g.name, g.material) for g in drawn.geoms] == [(g.name, g.material) for g in own.geoms]
