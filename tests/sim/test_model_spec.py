import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from model_files import FINGERS, GRIPPER, HAND, HOME, IN_COLLECTION, TABLE, menagerie, ros, written
from refusals import refused
from robot_folders import arm_xml

from sim.controller import inverse_dynamics
from sim.errors import PlantError
from sim.model_spec import full_spec, lean_spec, unusable_meshes
from sim.plant import PayloadBody, bare_arm, mount_payload

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


def test_what_a_simulation_adds_has_no_defaults_of_the_file(tmp_path):
    kinds = (
        '<general ctrllimited="true" forcerange="-3 3" gear="5" dyntype="filter"/><tendon stiffness="4" range="0 1"/>'
    )
    kinds += '<joint damping="9" armature="2"/><geom mass="3" margin="0.1"/>'
    found = []
    for head in ("", f"<default>{kinds}</default>"):
        spec = lean_spec(written(tmp_path, f"{len(head)}.xml", menagerie(head=head)))
        drive = spec.add_actuator(name="drive", target=spec.joints[0].name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        joint, geom = spec.worldbody.add_body().add_joint(), spec.worldbody.add_geom()
        of = (drive, ("ctrllimited", "forcerange", "gear", "dyntype")), (joint, ("damping", "armature"))
        of += (spec.add_tendon(), ("stiffness", "range")), (geom, ("margin",))
        found.append([getattr(each, name) for each, names in of for name in names])
    for with_defaults, without in zip(*found, strict=True):
        np.testing.assert_array_equal(with_defaults, without)


ARM = menagerie(hand=HAND, tail=FINGERS)


@pytest.mark.parametrize(
    ("name", "text", "flange", "more"),
    [
        ("arm.xml", ARM, "wrist_link", 0.7 + 2 * 0.02),
        ("arm.xml", ARM, "hand", 0.7 + 2 * 0.02),
        ("arm.urdf", ros(kinds=("revolute",) * 3, more=GRIPPER), "tool0", 0.2),
    ],
)
def test_what_is_behind_or_beside_the_flange_is_held_and_weighs_what_it_weighs(
    tmp_path, plain, name, text, flange, more
):
    path = written(tmp_path, name, text)
    model = bare_arm(path, ROTORS, flange)
    assert [model.joint(j).name for j in range(model.njnt)] == ["shoulder", "elbow", "wrist"]
    np.testing.assert_allclose(model.body_mass.sum(), 6.0 + 4.0 + 2.0 + more, rtol=1e-12)  # rounding of a sum
    assert np.abs(torques(path, flange) - plain).max() > 0.1


def test_a_urdf_is_compiled_without_the_meshes_that_it_names(tmp_path):
    path = written(tmp_path, "arm.urdf", ros())
    assert not list(full_spec(path).meshes)
    model = lean_spec(path).compile()
    np.testing.assert_array_equal(model.jnt_type, [mujoco.mjtJoint.mjJNT_HINGE] * 2 + [mujoco.mjtJoint.mjJNT_SLIDE])
    np.testing.assert_array_equal(model.jnt_range[2], [0.05, 0.6])


def test_shapes_for_collisions_give_a_link_of_a_urdf_no_inertia(tmp_path):
    box = '<collision><geometry><box size="0.1 0.1 0.3"/></geometry></collision></link>'
    path = written(tmp_path, "arm.urdf", ros(inertial=False).replace("</link><joint", f"{box}<joint"))
    refused(PlantError, r"arm\.urdf: link 'shoulder_link' has no mass or no moments of inertia", bare_arm, path, ROTORS)


FAULTS = {
    "a spring": (menagerie(joint='stiffness="3"'), None, r"arm\.xml: joint elbow has a spring, stiffness = 3,"),
    "a free arm": (
        menagerie().replace(
            'childclass="arm">', 'childclass="arm"><freejoint name="float"/>' + IN_COLLECTION.format(mass=3)
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
    "an inertia of a lost mesh": (menagerie(inertial=""), None, r"link 'shoulder_link' has its inertia from the mesh"),
    "a link that no body is": (
        menagerie().replace('diaginertia="0.03 0.028 0.012"', 'diaginertia="0.03 0.028 0.112"', 1),
        None,
        "link 'shoulder_link': one principal moment of inertia exceeds",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_no_plant_can_be_made_of_is_refused_in_one_line(tmp_path, fault):
    text, flange, message = FAULTS[fault]
    path = written(tmp_path, "arm.xml", text)
    refused(PlantError, rf"\A(?=.*{re.escape(str(path))})(?=.*\Z).*(?:{message})", bare_arm, path, ROTORS, flange)


def test_a_payload_hangs_in_the_frame_whose_origin_is_on_the_last_joint(tmp_path):
    text = menagerie().replace('name="wrist" axis', 'name="wrist" pos="0.02 0.03 0.01" axis')
    spec = lean_spec(written(tmp_path, "arm.xml", text))
    body = mount_payload(spec, PayloadBody(mass=1.5, com=(0.1, 0.2, 0.3), inertia=(0.1, 0.1, 0.1, 0, 0, 0)))
    model, data = (m := spec.compile()), mujoco.MjData(m)
    data.qpos[:] = [0.4, -0.3, 0.9]
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.xpos[model.body(body.name).id], data.xanchor[2], rtol=0, atol=1e-12)  # rounding


def test_a_torque_limit_of_the_model_file_s_own_joints_does_not_cut_what_drives_give(tmp_path):
    text = arm_xml(3).replace('name="axis2"', 'actuatorfrcrange="-1 1" name="axis2"')
    path = written(tmp_path, "arm.xml", text)
    assert mujoco.MjModel.from_xml_string(text).jnt_actfrclimited.any()
    assert not lean_spec(path).compile().jnt_actfrclimited.any()


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
FLAT = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n"
ANTENNA = (
    '<link name="antenna"><inertial><mass value="MASS"/><inertia ixx="2.4e-8" ixy="6.1e-8" ixz="1.2e-8" iyy="2.8e-8" '
    'iyz="8e-9" izz="3.8e-8"/></inertial></link><joint name="antenna_fixed" type="fixed"><parent link="PARENT"/>'
    '<child link="antenna"/></joint>'
)
"""Products of inertia beyond the moments, as in the file of a mobile manipulator."""


def with_meshes(folder, meshes, **changes):
    for name, text in meshes.items():
        written(folder / "assets", name, text)
    return written(folder, "arm.xml", menagerie(**changes))


@pytest.mark.parametrize("text", [FLAT, "no mesh"])
def test_a_mesh_that_is_no_solid_is_left_out_where_inertials_are_stated(tmp_path, text):
    path = with_meshes(tmp_path, {"shoulder.obj": TETRAHEDRON, "elbow.obj": text, "wrist.obj": TETRAHEDRON})
    assert [mesh.file for mesh in full_spec(path).meshes] == ["shoulder.obj", "wrist.obj"]
    assert full_spec(path).compile().nmesh == 2
    assert unusable_meshes(path) == ("elbow.obj",)
    np.testing.assert_allclose(bare_arm(path, ROTORS).body_mass.sum(), 12.0, rtol=1e-12)  # rounding of a sum


def test_an_inertia_from_a_mesh_that_is_no_solid_is_asked_for(tmp_path):
    path = with_meshes(tmp_path, {f"{k}.obj": FLAT for k in ("shoulder", "elbow", "wrist")}, inertial="")
    with pytest.raises(
        PlantError, match=r"'shoulder_link' has its inertia from the mesh 'shoulder\.obj', from which MuJoCo"
    ):
        bare_arm(path, ROTORS)


@pytest.mark.parametrize("massless", ['mass="0"', 'density="0"'])
def test_a_lost_mesh_without_mass_takes_no_inertia_from_its_link(tmp_path, massless):
    text = menagerie(inertial="").replace('<geom class="visual"', f'<geom class="visual" {massless}')
    model = bare_arm(written(tmp_path, "arm.xml", text), ROTORS)
    capsule = 1000.0 * (np.pi * 0.05**2 * 0.15 + 4.0 / 3.0 * np.pi * 0.05**3)
    np.testing.assert_allclose(model.body_mass[-4:-1], capsule, rtol=1e-9)  # MuJoCo's density of water


@pytest.mark.parametrize("place", ["named", "declared", "beside"])
def test_a_mesh_in_a_package_is_found_around_the_file(tmp_path, place):
    folder = tmp_path / "src" / ("robot_description" if place == "named" else "robot")
    if place == "declared":
        written(folder, "package.xml", "<package><name>robot_description</name></package>")
    path = written(tmp_path / "src" / "bringup" / "urdf" if place == "beside" else folder / "urdf", "arm.urdf", ros())
    meshes = (tmp_path / "src" / "robot_description" if place == "beside" else folder) / "meshes"
    stl = b"\0" * 80 + (4).to_bytes(4, "little")
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
    for corners in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
        stl += np.zeros(3, dtype="<f4").tobytes() + points[list(corners)].tobytes() + b"\0\0"
    meshes.mkdir(parents=True)
    (meshes / "elbow.stl").write_bytes(stl)
    assert [mesh.file for mesh in full_spec(path).meshes] == [str(meshes / "elbow.stl")]
    assert full_spec(path).compile().nmesh == 1
    assert unusable_meshes(path) == tuple(f"package://robot_description/meshes/{k}.stl" for k in ("shoulder", "wrist"))


def test_an_impossible_inertia_of_what_the_arm_stands_on_does_not_matter(tmp_path):
    stand = ANTENNA.split("<joint")[0].replace("antenna", "base_link").replace("MASS", "7.5")
    text = ros().replace('<link name="base_link"/>', stand)
    assert "7.5" in text
    model = bare_arm(written(tmp_path, "arm.urdf", text), ROTORS, "tool0")
    np.testing.assert_allclose(model.body_mass.sum(), 19.5, rtol=1e-12)  # rounding of a sum


@pytest.mark.parametrize("parent", ["elbow_link", "tool0"])
@pytest.mark.parametrize("mass", ["0.5", "-0.5"])
def test_a_link_beside_the_arm_that_no_body_is_does_not_matter(tmp_path, parent, mass):
    more = ANTENNA.replace("PARENT", parent).replace("MASS", mass)
    model = bare_arm(written(tmp_path, "arm.urdf", ros(more=more)), ROTORS, "tool0")
    np.testing.assert_allclose(model.body_mass.sum(), 12.0 + max(float(mass), 0.0), rtol=1e-12)  # rounding of a sum
    with pytest.raises(PlantError, match="antenna"):
        bare_arm(written(tmp_path, "arm.urdf", ros(more=more)), ROTORS, "antenna" if parent == "tool0" else None)
