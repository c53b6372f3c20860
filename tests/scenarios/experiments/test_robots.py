import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from robot_folders import arm_xml, robot_folder

from ident.support.errors import RobotModelError
from scenarios.experiments.robots import check_same_payload, joint_places, robot, robot_digests, structure
from scenarios.experiments.scenario import load_scenario, setup_without_motion
from scenarios.experiments.study import monte_carlo, study_identity
from scenarios.support.errors import ScenarioError, WrongValue

N = 3
PAYLOAD = "{ mass = 2.3, com = [0.09, 0.06, 0.11], inertia = { ixx = 0.011, iyy = 0.012, izz = 0.006 } }"


def own_scenario(folder: Path, *, robot_name: str = "arm/robot.toml") -> Path:
    """The file of a scenario of a robot of three joints, whose motion is for six."""
    robot_folder(folder / "arm", N)
    path = folder / "own.toml"
    path.write_text(
        f'extends = "any-arm"\ndescription = "an invented arm"\nrobot = "{robot_name}"\n'
        f'plant.payload = {PAYLOAD}\nexperiment.motion = "drive-gains"\n'
        f"belief = {{ payload = {PAYLOAD}, controller_gain = [1.1, 0.9, 1.2] }}\n"
        "tolerance = { gain = [0.05, 0.05, 0.05], identifiable = [false, true, true] }\n"
    )
    return path


def test_a_robot_that_is_not_there_or_has_other_arrays_is_refused(tmp_path):
    for name, error, message in (
        ("rx91", WrongValue, "unknown robot 'rx91'; did you mean 'rx90'.*; built-in: rx90, "),
        ("arm", WrongValue, "unknown robot 'arm'; did you mean arm/robot.toml"),
        ("gone/robot.toml", ScenarioError, "gone/robot.toml"),
        ("rx90", ScenarioError, r"tolerance\.gain has 3 values, but robot rx90 has 6 joints"),
    ):
        with pytest.raises(error, match=message) as caught:
            setup_without_motion(load_scenario(str(own_scenario(tmp_path, robot_name=name))))
        assert "\n" not in str(caught.value)


def test_a_study_knows_its_robot_s_files(tmp_path):
    path = own_scenario(tmp_path)
    known = study_identity(monte_carlo(load_scenario(str(path)), 2, 0))["scenario"]["robot"]
    assert robot_digests("arm/robot.toml", tmp_path) == known
    for name, old, new, changed in (
        ("arm.xml", 'mass="9.000"', 'mass="9.001"', {"model"}),
        ("robot.toml", "[home]", "# another\n[home]", {"robot"}),
    ):
        file = tmp_path / "arm" / name
        file.write_text(file.read_text().replace(old, new))
        os.utime(file, ns=(1, 1))
        before, known = known, robot_digests("arm/robot.toml", tmp_path)
        assert {key for key in known if known[key] != before[key]} == changed


def test_a_model_file_that_changed_is_read_again(tmp_path):
    path = own_scenario(tmp_path)
    first = setup_without_motion(load_scenario(str(path))).structure
    model = tmp_path / "arm" / "arm.xml"
    model.write_text(arm_xml(N).replace('axis="0 1 0"', 'axis="1 0 0"'))
    os.utime(model, ns=(1, 1))
    again = setup_without_motion(load_scenario(str(path))).structure
    np.testing.assert_array_equal(first.arm.axis[1], [0.0, 1.0, 0.0])
    np.testing.assert_array_equal(again.arm.axis[1], [1.0, 0.0, 0.0])


def test_a_last_link_that_the_identification_sees_elsewhere_is_refused(tmp_path):
    arm = robot(str(robot_folder(tmp_path, N)))
    found = structure(arm, ()).arm
    check_same_payload(found, arm)
    for moved in ((0.0, 0.001, 0.0), (0.0, 0.0, -0.002)):
        translation = found.translation.copy()
        translation[-1] += moved
        with pytest.raises(RobotModelError, match="put a payload on the last link at different places"):
            check_same_payload(replace(found, translation=translation), arm)


HALF = 0.5 * np.pi
TABLES = {  # theta, d, a, alpha; a joint's own value is added to theta, or to d where it slides
    # As published, standard: the frame of a joint is behind it.
    "ur10e": ([0] * 6, [0.1807, 0, 0, 0.17415, 0.11985], [0, -0.6127, -0.57155, 0, 0], [HALF, 0, 0, HALF, -HALF]),
    "stanford": ([0, 0, -HALF, 0, 0], [0.412, 0.154, 0, 0, 0], [0] * 5, [-HALF, HALF, 0, -HALF, HALF]),
    # Modified, of piper_sdk 0.6, C_PiperForwardKinematics, with the zeros of joints 2 and 3 of its description.
    "piper": (
        np.deg2rad([0, -172.22, -102.78, 0, 0, 0]),
        [0.123, 0, 0, 0.25075, 0, 0.091],
        [0, 0, 0.28503, -0.02198, 0, 0],
        np.deg2rad([0, -90, 0, 90, -90, 90]),
    ),
}


@pytest.mark.parametrize(("name", "atol"), [("ur10e", 1e-6), ("stanford", 1e-6), ("piper", 3e-4)])
def test_published_denavit_hartenberg_parameters_lead_to_the_last_link(name, atol):
    # Digits of the model file; of the piper's two descriptions 0.09 mm and 0.01 degrees.
    arm, T = structure(robot(name), ()).arm, np.eye(4)
    q = np.array([0.3, -0.5, 0.7, 1.1, -0.4, 0.2])
    for j, (theta, d, a, alpha) in enumerate(zip(*TABLES[name], strict=False)):
        turn, slide = (q[j], 0.0) if arm.revolute[j] else (0.0, q[j])
        c, s, ca, sa = np.cos(theta + turn), np.sin(theta + turn), np.cos(alpha), np.sin(alpha)
        own = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d + slide], [0, 0, 0, 1]])
        link = np.array([[1, 0, 0, a], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]])
        T = T @ (link @ own if name == "piper" else own @ link)
    anchor, axis = joint_places(arm, q)
    np.testing.assert_allclose(anchor[5], T[:3, 3], rtol=0, atol=atol)
    np.testing.assert_allclose(axis[5], T[:3, 2], rtol=0, atol=atol)
