from dataclasses import replace

import numpy as np
import pytest
from plants import RX90
from robot_folders import arm_xml, robot_folder

from sim.errors import ModelFileError
from sim.robot_files import read_robot
from sim.shapes import flange_of


def robot(tmp_path, change=lambda text: text):
    found = read_robot(robot_folder(tmp_path, 2))
    found.model.write_text(change(arm_xml(2)))
    return found


def on_last(text: str, element: str) -> str:
    """An element on the last link."""
    return text.replace("</body></body>", f"{element}</body></body>")


def test_the_rx90_s_flange_is_its_site():
    flange = flange_of(RX90)
    np.testing.assert_allclose(flange.origin, [0.0, 0.0, 0.085], rtol=0, atol=1e-15)
    np.testing.assert_allclose(flange.rotation, np.eye(3), rtol=0, atol=1e-14)  # a product of seven rotations
    assert flange.name == "flange"


@pytest.mark.parametrize("joint", ["0 0 0", "0.04 -0.013 0.027"])
@pytest.mark.parametrize(
    ("element", "name"),
    [
        ('<site name="flange" pos="0.1 0.02 -0.03" xyaxes="0 1 0 0 0 1"/>', "flange"),
        ('<body name="tool0" pos="0.1 0.02 -0.03" xyaxes="0 1 0 0 0 1"/>', "tool0"),
        (
            '<body name="tip" pos="0.1 0 0"><site name="attachment_site" pos="0 0.02 -0.03" '
            'xyaxes="0 1 0 0 0 1"/></body>',
            "attachment_site",
        ),
    ],
)
def test_a_site_or_body_of_a_known_name_on_the_last_link_is_the_flange_seen_from_its_joint(
    tmp_path, element, name, joint
):
    def change(text: str) -> str:
        return on_last(text.replace('<joint name="axis2"', f'<joint pos="{joint}" name="axis2"'), element)

    flange = flange_of(robot(tmp_path, change))
    assert flange.name == name
    from_joint = np.subtract([0.1, 0.02, -0.03], np.array(joint.split(), dtype=float))
    np.testing.assert_allclose(flange.origin, from_joint, rtol=0, atol=1e-15)
    np.testing.assert_allclose(flange.rotation, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], rtol=0, atol=1e-15)


def test_without_one_the_last_joint_s_axis_stands_for_it_and_a_flange_elsewhere_does_not_count(tmp_path):
    def change(text: str) -> str:
        text = text.replace('<joint name="axis2"', '<joint pos="0.03 -0.01 0.02" name="axis2"')
        return text.replace("<worldbody>", '<worldbody><site name="flange" pos="1 0 0"/>')

    flange = flange_of(robot(tmp_path, change))
    assert flange.name == ""
    np.testing.assert_array_equal(flange.origin, np.zeros(3))  # payloads are measured from there
    np.testing.assert_allclose(flange.rotation[:, 2], [0.0, 1.0, 0.0], rtol=0, atol=1e-15)
    np.testing.assert_allclose(flange.rotation.T @ flange.rotation, np.eye(3), rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(flange.rotation), 1.0, rtol=1e-14)


def test_a_model_that_cannot_be_compiled_is_refused_by_name(tmp_path):
    broken = robot(tmp_path, lambda text: text.replace("<worldbody>", "<worldbody><nonsense/>"))
    with pytest.raises(ModelFileError, match=r"robot model .*arm\.xml: "):
        flange_of(replace(broken))
