from dataclasses import fields

import mujoco
import numpy as np
import pytest
from refusals import refused
from robot_folders import arm_xml, drives, robot_folder
from scipy.spatial.transform import Rotation

from sim.effects import ModelErrors
from sim.errors import PlantError
from sim.plant import PayloadBody, Plant, plant_model
from sim.robot import DriveTruth, Robot, read_robot

BRICK = PayloadBody(mass=1.3, com=(0.03, -0.02, 0.09), inertia=(0.011, 0.012, 0.008, 0.001, -0.0005, 0.0007))
COUPLING = """
[[coupling]]
motor = 3
turns_with = 1
viscous_friction = { value = 0.7, origin = "measured", source = "invented" }
coulomb_friction = { value = 0.4, origin = "measured", source = "invented" }
"""


SPRING = """
[gravity_spring]
joint = 2
stiffness = { value = 500.0, origin = "assumed", source = "invented" }
prestress = { value = 100.0, origin = "assumed", source = "invented" }
radius = { value = 0.05, origin = "assumed", source = "invented" }
distance = { value = 0.2, origin = "assumed", source = "invented" }
"""


def plant_of(robot: Robot, **errors) -> Plant:
    return Plant(robot=robot, drives=robot.drives, payload=BRICK, errors=ModelErrors(**errors))


def test_what_is_one_robot_s_alone_is_refused_on_another_by_name(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 7))
    for errors, message in (
        ({"d3_error": 0.004}, r"errors: d3_error = 0\.004 m: invented has no frame d3; leave it at 0"),
        ({"gravity_spring": 900.0}, r"errors: gravity_spring = 900 N/m: invented has no gravity spring; leave it at 0"),
        ({"wrist_coupling": 0.5}, r"errors: wrist_coupling = 0\.5: invented has no coupling; leave it at 0"),
    ):
        refused(PlantError, message, plant_of, robot, **errors)


def test_a_robot_file_that_states_them_has_frames_couplings_and_a_spring(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 4, extra=f'[frames]\nd3 = "part3"\n{COUPLING}{SPRING}'))
    assert robot.frames == {"d3": "part3"}
    (coupling,), spring = robot.coupling, robot.gravity_spring
    motor = {"motor": 2, "turns_with": 0, "viscous_friction": 0.7, "coulomb_friction": 0.4}
    assert dict(coupling) == motor
    assert dict(spring) == {"joint": 1, "stiffness": 500.0, "prestress": 100.0, "radius": 0.05, "distance": 0.2}
    model = plant_model(plant_of(robot, d3_error=0.01), loaded=False, step=1e-3)
    drawn = np.array([0.02, 0.0, 0.221])  # 0.31 m / 1.4
    # 4 digits are drawn.
    np.testing.assert_allclose(model.body("part3").pos, drawn * (1 + 0.01 / np.linalg.norm(drawn)), rtol=0, atol=1e-12)
    with pytest.raises(PlantError, match="invented has no frame r4"):
        plant_model(plant_of(robot, r4_error=0.01), loaded=False, step=1e-3)


def test_a_frame_without_a_body_and_a_spring_without_a_link_are_refused(tmp_path):
    missing = read_robot(robot_folder(tmp_path / "missing", 4, extra='[frames]\nr4 = "part9"\n'))
    with pytest.raises(PlantError, match=r"errors: r4_error = 0\.003 m: .*arm\.xml has no body 'part9'"):
        plant_model(plant_of(missing, r4_error=0.003), loaded=False, step=1e-3)
    path = robot_folder(tmp_path / "short", 4, extra=SPRING)
    model = path.parent / "arm.xml"
    model.write_text(model.read_text().replace('name="part3" pos="0.02 0 0.221"', 'name="part3" pos="0 0 0"'))
    with pytest.raises(PlantError, match="errors: gravity_spring: part2 has zero length, so no spring can be attached"):
        plant_model(plant_of(read_robot(path), gravity_spring=900.0), loaded=False, step=1e-3)


def test_a_coupled_motor_turns_with_the_sum_of_the_joints_that_its_robot_names(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 4, extra=COUPLING))
    compliance = (1e-4, 2e-4, 3e-4, 5e-4)
    model = plant_model(plant_of(robot, wrist_coupling=0.4, joint_compliance=compliance), loaded=False, step=5e-4)
    free = plant_model(plant_of(robot, joint_compliance=compliance), loaded=False, step=5e-4)
    M, own = (inertia_matrix(m)[-4:, -4:] for m in (model, free))
    rotor = 0.4 * robot.drives.rotor_inertia[2]
    expected = np.zeros((4, 4))
    expected[0, 2] = expected[2, 0] = rotor  # its part: rotor (dq1 + dq3)^2 / 2 instead of rotor dq3^2 / 2, and joint 1
    np.testing.assert_allclose(M - own, expected, rtol=0, atol=1e-12)  # has that much less of its own; rounding of M
    assert model.tendon("axis3_coupling").id == model.ntendon - 1
    np.testing.assert_allclose(model.tendon_damping[-1], 0.4 * 0.7, rtol=1e-15)
    np.testing.assert_allclose(model.tendon_frictionloss[-1], 0.4 * 0.4, rtol=1e-15)
    viscous = robot.drives.viscous_friction - 0.4 * 0.7 * np.array([1, 0, 1, 0])
    np.testing.assert_allclose(model.dof_damping[-4:], viscous, rtol=1e-15)
    coulomb = robot.drives.coulomb_friction - 0.4 * 0.4 * np.array([0, 0, 1, 0])
    np.testing.assert_allclose(model.dof_frictionloss[-4:], coulomb, rtol=1e-15)


def inertia_matrix(model: mujoco.MjModel) -> np.ndarray:
    data, M = mujoco.MjData(model), np.empty((model.nv, model.nv))
    data.qpos[:] = 0.3 * np.arange(1, model.nq + 1)
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    return M


def test_drives_of_the_model_file_are_replaced_by_those_of_the_plant(tmp_path):
    # A position servo with a gear, as model collections have them, is no torque drive.
    servo = '<actuator><position name="s" joint="axis1" kp="900" kv="7" gear="3"/></actuator>'
    robot = read_robot(robot_folder(tmp_path, 2, model_extra=servo))
    bare = read_robot(robot_folder(tmp_path / "bare", 2))
    first, second = (plant_model(plant_of(r), loaded=False, step=1e-3) for r in (robot, bare))
    for name in ("actuator_gainprm", "actuator_biasprm", "actuator_gear", "actuator_gaintype", "actuator_biastype"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))
    assert first.nu == 2
    assert not first.actuator_biasprm[:, 1:].any()


def test_a_wrong_robot_file_is_refused_in_one_line_that_names_the_place(tmp_path):
    path = robot_folder(tmp_path, 3)
    text = path.read_text()
    for faulty, message in (
        (text + "[", r"robot\.toml: .*(at line|end of document)"),
        (text.replace("[drives.gain]", "[drives.gain_]"), r"unknown key drives\.gain_; did you mean 'gain'"),
        (text.replace('origin = "assumed"\n', "", 1), r"home\.origin is missing$"),
        (text.replace('source = "invented"', 'source = ""', 1), r"home\.source"),
        (text.replace('"assumed"', '["assumed", "measured"]', 1), "2 origins for 3 values"),
        (text.replace("value = [3.0, 3.3, ", "value = [3.3, "), r"max_velocity \[3\.3, 3\.6\]: expected 3 fin"),
        (text.replace("value = [0.8, ", "value = [0.0, "), "gain .* has a zero"),
        (text.replace("value = [3.1, ", "value = [-3.1, "), "has a negative value"),
        (text.replace("arm.xml", "leg.xml"), "model = 'leg.xml': there is no file"),
        (text + COUPLING.replace("= 1", "= 4"), "3 with joint 4: expected two"),
        (text + COUPLING + COUPLING.replace("= 1", "= 2"), "a motor is named twice"),
        (text + SPRING.replace("joint = 2", "joint = 3"), "first 2 joints"),
        (f"transmission = [[1, 0, 0], [0, 1, 0]]\n{text}", "transmission: expected 3 rows of 3 numbers"),
        (f"transmission = [[1, 0, 0], [0, 1, 0], [0, 1, 1]]\n{text}{COUPLING}", "transmission: .*; give one of both"),
    ):
        assert faulty != text
        path.write_text(faulty)
        assert str(path) in str(refused(PlantError, message, read_robot, path))


def test_a_model_with_another_number_of_joints_than_its_robot_file_is_refused(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 3))
    robot.model.write_text(arm_xml(2))
    refused(PlantError, "2 joints, but invented has 3", plant_model, plant_of(robot), loaded=False, step=1e-3)


def test_what_is_read_is_what_the_file_says(tmp_path):
    robot = read_robot(robot_folder(tmp_path, 5))
    stated = drives(5)
    for field in fields(DriveTruth):
        np.testing.assert_array_equal(getattr(robot.drives, field.name), stated[field.name])
    np.testing.assert_array_equal(robot.drives.max_velocity, stated["max_velocity"])
    np.testing.assert_array_equal(robot.drives.max_acceleration, stated["max_acceleration"])
    np.testing.assert_array_equal(robot.home, 0.3 - 0.07 * np.arange(5))
    with pytest.raises(ValueError, match="read-only"):
        robot.home[0] = 1.0


def test_the_spring_is_hooked_above_its_joint_s_axis_and_along_its_joint_s_link(tmp_path):
    path = robot_folder(tmp_path, 4, extra=SPRING)
    model = path.parent / "arm.xml"
    place = 'name="part2" pos="0.02 0 0.258"'
    assert place in model.read_text()
    model.write_text(model.read_text().replace(place, f'{place} quat="0.8 0.1 -0.5 0.3"'))
    model = plant_model(plant_of(read_robot(path), gravity_spring=2e4), loaded=False, step=1e-3)
    along = np.array([0.02, 0.0, 0.221]) / np.linalg.norm([0.02, 0.0, 0.221])  # from joint 2 to joint 3, as drawn
    far, near = model.site("spring_far"), model.site("spring_near")
    assert [model.body(site.bodyid[0]).name for site in (far, near)] == ["part2", "part1"]
    # Rounding; of lengths below half a metre.
    np.testing.assert_allclose(far.pos, 0.2 * along, rtol=0, atol=1e-15)
    upright = Rotation.from_quat([0.1, -0.5, 0.3, 0.8]).apply(along)  # where the link points at zero
    np.testing.assert_allclose(near.pos, [0.02, 0.0, 0.258] + 0.05 * upright, rtol=0, atol=1e-15)
