from dataclasses import replace

import mujoco
import numpy as np
import pytest
from model_files import INERTIAL, mjcf, urdf

import rx90_mjcf
from ident.model.arm import Arm, load_arm, minimal_model
from ident.support.errors import RobotModelError
from scenarios.design.model_facts import model_facts
from scenarios.experiments.robots import check_same_kinematics, nominal_links, read_arm

SLANTED = [
    ("a", "0.1 0.2 0.3", "10 20 30", "0.3 -0.5 0.7"),
    ("b", "-0.2 0.15 0.4", "-40 25 75", "0.1 0.9 -0.2"),
    ("c", "0.3 -0.1 0.25", "15 -65 35", "-0.6 0.3 0.5"),
]
TYPES = '<joint name="b_joint" axis="0.1 0.9 -0.2" range="-170 175"/>'
READ_ALIKE = {
    "wall": mjcf(base='pos="0.4 0.5 0.6" euler="90 0 0"'),
    "slanted": mjcf(links=SLANTED),
    "eulerseq zyx": mjcf(head='<compiler eulerseq="zyx"/>', links=SLANTED),
    "eulerseq ZYX in radians": mjcf(head='<compiler angle="radian" eulerseq="ZYX"/>', links=SLANTED),
    "axisangle": mjcf(links=SLANTED, swap=('euler="10 20 30"', 'axisangle="1 2 3 40"')),
    "axisangle in radians": mjcf(
        head='<compiler angle="radian"/>', links=SLANTED, swap=('euler="10 20 30"', 'axisangle="1 2 3 0.7"')
    ),
    "anchor and ref": mjcf(links=SLANTED, swap=(TYPES, TYPES.replace("/>", ' pos="0.1 -0.2 0.05" ref="35"/>'))),
    "slide": mjcf(links=SLANTED, swap=(TYPES, '<joint name="b_joint" type="slide" axis="1 2 3" range="-0.3 0.4"/>')),
    "gravity, said twice": mjcf(head='<option gravity="1 2 3"/><option gravity="1.2 -2.3 -8.4"/>'),
    "classes": mjcf(
        head='<default><joint axis="1 2 3"/><default class="k"><joint type="slide"/>'
        '<default class="l"><joint axis="3 2 1"/></default></default></default>',
        base='childclass="l"',
        links=SLANTED,
        swap=(TYPES, '<joint name="b_joint"/>'),
    ),
    "class of a joint": mjcf(
        head='<default><joint axis="1 2 3"/><default class="k"><joint ref="20"/></default></default>',
        base='childclass="k"',
        links=SLANTED,
        swap=(TYPES, '<joint name="b_joint" class="main"/>'),
    ),
    "furniture": mjcf(world='<body name="table" pos="1 2 3"/><geom size="1"/><light/><camera/>'),
    "meshes that are missing": mjcf(
        head='<compiler meshdir="nowhere"/><asset><mesh name="m" file="m.stl"/>'
        '<texture type="2d" name="t" file="t.png"/><material name="w" texture="t"/></asset>',
        world='<geom type="mesh" mesh="m" material="w"/>',
    ),
    "no inertia": mjcf().replace('<inertial pos="0 0 0.1" mass="2.5" diaginertia="0.02 0.03 0.04"/>', ""),
    "strange inertia": mjcf().replace('diaginertia="0.02 0.03 0.04"', 'diaginertia="0.02 0.03 4"'),
    "limits off": mjcf(head='<compiler autolimits="false"/>').replace("range=", 'limited="false" range='),
}


@pytest.mark.parametrize("name", READ_ALIKE)
def test_unusual_mjcf_is_read_as_mujoco_reads_it(tmp_path, name):
    path = tmp_path / "arm.xml"
    path.write_text(READ_ALIKE[name])
    assert read_arm(path, ()).n == len(mujoco.MjSpec.from_file(str(path)).joints)


def test_a_scene_file_that_includes_the_arm_is_the_arm(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(mjcf(links=SLANTED))
    (tmp_path / "floor.xml").write_text('<mujoco><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>')
    (tmp_path / "scene.xml").write_text(
        '<mujoco><option gravity="0.5 0 -9.7"/><include file="parts/arm.xml"/><include file="floor.xml"/></mujoco>'
    )
    scene, alone = read_arm(tmp_path / "scene.xml", ()), read_arm(tmp_path / "parts" / "arm.xml", ())
    np.testing.assert_array_equal(scene.rotation, alone.rotation)
    np.testing.assert_array_equal(scene.translation, alone.translation)
    np.testing.assert_array_equal(scene.gravity, [0.5, 0.0, -9.7])


def test_a_model_in_another_encoding_is_the_same(tmp_path):
    path, text = tmp_path / "arm.urdf", urdf(more="<!-- Jos\u00e9 -->")
    for encoding in ("utf-16", "utf-8-sig", "utf-8", "latin-1"):
        head = '<?xml version="1.0" encoding="ISO-8859-1"?>' if encoding == "latin-1" else ""
        path.write_bytes((head + text).encode(encoding))
        np.testing.assert_array_equal(load_arm(path).translation[2], [0.0, -0.131, 0.613])


def _carried(joints: list[str]) -> str:
    """Bodies within each other, each on one joint and half a metre from the last."""
    inside = "".join(f'<body pos="0.5 0.1 0.2">{INERTIAL}<joint {each}/>' for each in joints)
    return f"<worldbody>{inside}{'</body>' * len(joints)}</worldbody>"


TURN = {"degree": ('range="-150 120"', "30"), "radian": ('range="-2.6 2.1"', "0.5")}
SLIDE = 'type="slide" range="-0.2 0.05"'


def _scara(unit: str) -> str:
    turn, ref = TURN[unit]
    last = f'axis="0 0 1" {turn} ref="{ref}"'
    return _carried([f'axis="0 0 1" {turn}', f'axis="0 0 1" {turn}', f'axis="0 0 1" {SLIDE} ref="0.03"', last])


def _gantry(unit: str) -> str:
    """Ranges and kinds from default classes; a joint that is not limited; a slide that is drawn off its zero."""
    classes = (
        '<default><joint type="slide" range="-1.5 2.5"/><default class="tool"><joint type="hinge"/></default></default>'
    )
    turn, ref = TURN[unit]
    joints = ['axis="1 0 0"', 'axis="0 1 0" limited="false"', 'axis="0 0 -1" range="0 0.4" ref="-0.1"']
    return classes + _carried([f'class="tool" axis="0 0 1" {turn} ref="{ref}"', *joints])


@pytest.mark.parametrize("robot", [_scara, _gantry])
@pytest.mark.parametrize("unit", ["degree", "radian"])
def test_slides_and_hinges_have_the_ranges_and_zeros_of_mujoco(robot, unit, tmp_path):
    (tmp_path / "arm.xml").write_text(f'<mujoco><compiler angle="{unit}"/>{robot(unit)}</mujoco>')
    arm = read_arm(tmp_path / "arm.xml", ())  # the places of the joints, which need their zeros, are compared there
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    limited = model.jnt_limited.astype(bool)
    lower, upper = model.jnt_range.T
    # Limits of radians, metres and sums of two of them: rounding.
    np.testing.assert_allclose(arm.lower, np.where(limited, lower, -np.inf), rtol=1e-14)
    np.testing.assert_allclose(arm.upper, np.where(limited, upper, np.inf), rtol=1e-14)
    written = mujoco.MjModel.from_xml_string(minimal_model(tmp_path / "arm.xml", None).text)  # for other methods
    np.testing.assert_array_equal(written.jnt_limited, model.jnt_limited)
    for name in ("jnt_range", "qpos0"):
        np.testing.assert_allclose(getattr(written, name)[limited], getattr(model, name)[limited], rtol=1e-14)


def test_a_keyframe_of_a_slide_is_in_metres_and_a_continuous_joint_of_a_urdf_has_no_limits(tmp_path):
    text = f'<mujoco>{_scara("degree")}<keyframe><key name="home" qpos="0.1 -0.2 -0.07 0.3"/></keyframe></mujoco>'
    (tmp_path / "arm.xml").write_text(text)
    assert list(model_facts(tmp_path / "arm.xml", None).home.values()) == [0.1, -0.2, -0.07, 0.3]
    path = tmp_path / "arm.urdf"
    path.write_text(urdf(swap=('elbow_joint" type="revolute"', 'elbow_joint" type="continuous"')))
    arm = read_arm(path, ())
    assert arm.upper.tolist() == [3.05, 3.05, np.inf, 3.05, 3.05, 3.05]
    assert arm.lower[2] == -np.inf


def test_readings_that_differ_are_refused_with_the_joint():
    arm, model = load_arm(rx90_mjcf.MJCF), mujoco.MjModel.from_xml_path(str(rx90_mjcf.MJCF))

    def changed(field: str, place: int | tuple[int, ...], by: float) -> Arm:
        values = np.array(getattr(arm, field), dtype=float)
        values[place] += by
        return replace(arm, **{field: values})

    for spoilt, message in (
        (changed("translation", (3, 1), 1e-5), "the place of joint joint4"),
        (changed("axis", (1, 0), 1e-5), "the axis of joint joint2"),
        (changed("rotation", (5, 0, 2), 1e-5), "the axis of joint joint6"),
        (changed("gravity", 0, 1e-4), r"gravity is .* against"),
        (changed("revolute", 4, -1.0), "joint joint5 is revolute in one and prismatic in the other"),
        (replace(arm, joint_names=("x", *arm.joint_names[1:])), "joint 1 is x against joint1"),
    ):
        with pytest.raises(RobotModelError, match=f"Pinocchio and MuJoCo read it differently: {message}"):
            check_same_kinematics(spoilt, model, rx90_mjcf.MJCF)


def test_an_arm_on_a_mocap_body_has_the_same_links(tmp_path):
    plain, mocap = tmp_path / "plain.xml", tmp_path / "mocap.xml"
    plain.write_text(mjcf())
    mocap.write_text(mjcf(base='mocap="true"'))
    np.testing.assert_array_equal(nominal_links(mocap, None).whole, nominal_links(plain, None).whole)
