import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import random_arm

import rx90_mjcf
from ident.model.arm import arm_from_pinocchio, load_arm
from ident.support.errors import RobotModelError


def test_an_arm_has_the_limits_and_gravity_of_its_file(arm):
    assert arm.n == 6
    np.testing.assert_allclose(np.rad2deg(arm.upper), [160, 137.5, 142.5, 270, 120, 270])
    np.testing.assert_array_equal(arm.gravity, [0, 0, -9.81])


def test_files_that_are_no_model_are_named(tmp_path):
    for name, text, message in (
        ("arm.txt", "", r"expected a \.urdf, \.xml or \.mjcf file"),
        ("arm.urdf", "<robot", "line 1, column 1: not XML: unclosed token"),
        ("arm.xml", "<robot/>", "line 1: the root element is robot, expected mujoco; URDF files end in .urdf"),
    ):
        path = tmp_path / name
        path.write_text(text)
        with pytest.raises(RobotModelError, match=message) as caught:
            load_arm(path)
        assert "\n" not in str(caught.value)
    with pytest.raises(RobotModelError, match=r"absent\.urdf: no such file"):
        load_arm(tmp_path / "absent.urdf")


@pytest.mark.parametrize("pair", [(5, 4), (2, 2), (3, 6), (-1, 2)])
def test_a_coupling_of_joints_that_are_not_there_or_in_the_other_order_is_refused(pair):
    said = f"cannot couple joints {pair[0] + 1} and {pair[1] + 1}; expected two of its 6 joints, the one nearer"
    with pytest.raises(RobotModelError, match=said):
        load_arm(rx90_mjcf.MJCF, (pair,))


def test_only_serial_arms_of_one_axis_joints_are_taken(rng):
    model = random_arm(rng, 3)
    model.addJoint(1, pin.JointModelRX(), pin.SE3.Identity(), "branch")
    with pytest.raises(RobotModelError, match="joint branch branches off"):
        arm_from_pinocchio(model)
    floating = pin.Model()
    floating.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    with pytest.raises(RobotModelError, match="joint root: type JointModelFreeFlyer is not supported"):
        arm_from_pinocchio(floating)
    with pytest.raises(RobotModelError, match="no moving joint"):
        arm_from_pinocchio(pin.Model())


def test_mjcf_is_found_next_to_its_package():
    assert rx90_mjcf.MJCF.is_file()
