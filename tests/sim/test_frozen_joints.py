"""What of a model file is a plant's: links, joints, gravity, and nothing that a file adds for another purpose."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from collections_of_arms import FINGERS, GRIPPER, HAND, HOME, INERTIAL, TABLE, menagerie, ros, written
from robot_folders import arm_xml

from sim.compile import bare_arm, mount_payload
from sim.controller import inverse_dynamics
from sim.errors import ModelFileError
from sim.model_spec import full_spec, lean_spec
from sim.plant import PayloadBody

ROTORS = np.array([0.3, 0.2, 0.1])
STATES = np.random.default_rng(4).uniform(-1.5, 1.5, (3, 5, 3))


def torques(path: Path, flange: str | None = None, payload: PayloadBody | None = None) -> np.ndarray:
    return inverse_dynamics(bare_arm(path, ROTORS, flange, payload), *STATES)


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return torques(written(tmp_path_factory.mktemp("plain"), "arm.xml", menagerie()))


@pytest.mark.parametrize(
    "text",
    [
        menagerie(tail=HOME),
        menagerie(world=TABLE),
        menagerie(tail='<sensor><jointpos joint="elbow"/></sensor>'),
        menagerie(head='<option density="1000" viscosity="3" wind="4 5 6"><flag frictionloss="disable"/></option>'),
        menagerie().replace('name="elbow_link"', 'name="elbow_link" gravcomp="1"'),
        menagerie().replace('name="elbow" axis', 'name="elbow" damping="9" armature="2" frictionloss="3" axis'),
        menagerie(tail='<equality><weld body1="wrist_link" body2="base" active="false"/></equality>'),
        menagerie(tail='<contact><exclude body1="wrist_link" body2="shoulder_link"/></contact>'),
    ],
)
def test_what_drives_measures_or_brakes_the_arm_in_a_file_is_no_part_of_a_plant(tmp_path, plain, text):
    np.testing.assert_array_equal(torques(written(tmp_path, "arm.xml", text)), plain)


@pytest.mark.parametrize("flange", ["wrist_link", "hand"])
def test_a_hand_behind_the_flange_is_held_and_weighs_what_it_weighs(tmp_path, plain, flange):
    path = written(tmp_path, "arm.xml", menagerie(hand=HAND, tail=FINGERS))
    model = bare_arm(path, ROTORS, flange)
    assert [model.joint(j).name for j in range(model.njnt)] == ["shoulder", "elbow", "wrist"]
    expected = 6.0 + 4.0 + 2.0 + 0.7 + 2 * 0.02
    np.testing.assert_allclose(model.body_mass.sum(), expected, rtol=1e-12)  # rounding of a sum
    assert np.abs(torques(path, flange) - plain).max() > 0.1


@pytest.mark.parametrize("flange", [None, "wrist_link"])
def test_what_floats_beside_the_arm_is_not_drawn_and_what_stands_there_is(tmp_path, flange):
    bodies = [body.name for body in full_spec(written(tmp_path, "arm.xml", menagerie(world=TABLE)), flange).bodies]
    assert "table" in bodies
    assert "wrist_link" in bodies
    assert "cup" not in bodies


def test_a_flange_that_floats_is_no_object_beside_the_arm(tmp_path):
    path = written(tmp_path, "arm.xml", menagerie(world=TABLE))
    with pytest.raises(ModelFileError, match="is free or a ball"):
        full_spec(path, "cup")


def test_joints_of_a_urdf_that_do_not_lead_to_the_flange_are_held(tmp_path):
    kinds = ("revolute",) * 3
    path = written(tmp_path, "arm.urdf", ros(kinds=kinds, more=GRIPPER))
    model = bare_arm(path, ROTORS, "tool0")
    assert [model.joint(j).name for j in range(model.njnt)] == ["shoulder", "elbow", "wrist"]
    np.testing.assert_allclose(model.body_mass.sum(), 12.0 + 0.2, rtol=1e-12)
    bare = bare_arm(written(tmp_path / "bare", "arm.urdf", ros(kinds=kinds)), ROTORS)
    np.testing.assert_allclose(bare.body_mass.sum(), 12.0, rtol=1e-12)


def test_a_urdf_is_compiled_without_the_meshes_that_it_names(tmp_path):
    path = written(tmp_path, "arm.urdf", ros())
    assert not list(full_spec(path).meshes)
    model = lean_spec(path).compile()
    np.testing.assert_array_equal(model.jnt_type, [mujoco.mjtJoint.mjJNT_HINGE] * 2 + [mujoco.mjtJoint.mjJNT_SLIDE])
    np.testing.assert_array_equal(model.jnt_range[2], [0.05, 0.6])


def test_shapes_for_collisions_give_a_link_of_a_urdf_no_inertia(tmp_path):
    box = '<collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision></link>'
    path = written(tmp_path, "arm.urdf", ros(inertial=False).replace("</link><joint", f"{box}<joint"))
    with pytest.raises(ModelFileError, match=r"arm\.urdf: link 'shoulder_link' has no mass or no moments of inertia"):
        bare_arm(path, ROTORS)


def test_inertia_from_shapes_of_an_mjcf_file_is_the_shapes(tmp_path):
    text = menagerie(inertial="").replace('<geom class="visual" mesh="shoulder"/>', "")
    for name in ("elbow", "wrist"):
        text = text.replace(f'<geom class="visual" mesh="{name}"/>', "")
    model = bare_arm(written(tmp_path, "arm.xml", text), ROTORS)
    capsule = np.pi * 0.05**2 * 0.15 + 4.0 / 3.0 * np.pi * 0.05**3
    np.testing.assert_allclose(model.body_mass[-4:-1], 1000.0 * capsule, rtol=1e-9)  # MuJoCo's density of water


FAULTS = {
    "a spring": (menagerie(joint='stiffness="3"'), None, r"arm\.xml: joint elbow has a spring, stiffness = 3,"),
    "a free arm": (
        menagerie().replace(
            'childclass="arm">', 'childclass="arm"><freejoint name="float"/>' + INERTIAL.format(mass=3)
        ),
        None,
        "joint float is free or a ball",
    ),
    "a tie": (menagerie(hand=HAND, tail=FINGERS), None, "equality '?finger1'? couples joints; remove it; if"),
    "a tendon": (
        menagerie(tail='<tendon><fixed name="t" stiffness="4"><joint joint="elbow" coef="1"/></fixed></tendon>'),
        None,
        "tendon 't' acts on joints",
    ),
    "no such flange": (menagerie(), "tool1", "flange 'tool1': no body has that name"),
    "an inertia of a lost mesh": (
        menagerie(inertial=""),
        None,
        r"link 'shoulder_link' has its inertia from the mesh",
    ),
    "a link that no body is": (
        menagerie().replace('diaginertia="0.03 0.028 0.012"', 'diaginertia="0.03 0.028 0.112"', 1),
        None,
        r"A \+ B >= C.*\(element 'shoulder_link'\)",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_no_plant_can_be_made_of_is_refused_in_one_line(tmp_path, fault):
    text, flange, message = FAULTS[fault]
    path = written(tmp_path, "arm.xml", text)
    with pytest.raises(ModelFileError, match=message) as caught:
        bare_arm(path, ROTORS, flange)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_payload_hangs_in_the_frame_whose_origin_is_on_the_last_joint(tmp_path):
    text = menagerie().replace('name="wrist" axis', 'name="wrist" pos="0.02 0.03 0.01" axis')
    spec = lean_spec(written(tmp_path, "arm.xml", text))
    body = mount_payload(spec, PayloadBody(mass=1.5, com=(0.1, 0.2, 0.3), inertia=(0.1, 0.1, 0.1, 0, 0, 0)))
    model, data = (m := spec.compile()), mujoco.MjData(m)
    data.qpos[:] = [0.4, -0.3, 0.9]
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.xpos[model.body(body.name).id], data.xanchor[2], rtol=0, atol=1e-12)  # rounding


def test_joints_without_names_are_numbered(tmp_path):
    path = written(
        tmp_path,
        "arm.xml",
        menagerie()
        .replace('joint name="elbow"', "joint")
        .replace('<position class="arm" name="elbow_servo" joint="elbow"/>', ""),
    )
    assert [joint.name for joint in lean_spec(path).joints] == ["shoulder", "joint2", "wrist"]


def test_a_torque_limit_of_the_model_file_s_own_joints_does_not_cut_what_drives_give(tmp_path):
    text = arm_xml(3).replace('name="axis2"', 'actuatorfrcrange="-1 1" name="axis2"')
    path = written(tmp_path, "arm.xml", text)
    assert mujoco.MjModel.from_xml_string(text).jnt_actfrclimited.any()
    assert not lean_spec(path).compile().jnt_actfrclimited.any()
