"""Numbers of a model file that no arm has are told with line and value when a robot is made of it."""

import re

import pytest
from collections_of_arms import GRIPPER, ros, written

from ident.model.arm import load_arm
from ident.support.errors import RobotModelError
from scenarios.cli import main
from scenarios.command_line.process import Status
from scenarios.design.model_facts import check_stated_numbers, model_facts
from sim.errors import ModelFileError

ARM = """<robot name="two"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 0.2"/><mass value="MASS"/>
<inertia ixx="0.05" iyy="IYY" izz="IZZ" ixy="IXY" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-2.1" upper="UPPER" effort="EFFORT" velocity="SPEED"/></joint></robot>"""
SOUND = {"MASS": "2.3", "IYY": "0.06", "IZZ": "0.07", "IXY": "0", "UPPER": "2.3", "EFFORT": "41", "SPEED": "1.7"}


def arm(folder, **changes: str):
    text = ARM
    for key, value in {**SOUND, **changes}.items():
        text = text.replace(key, value)
    return written(folder, "arm.urdf", text)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("MASS", "-7.5", "line 2: mass: value = '-7.5': expected a mass of 0 or more"),
        ("MASS", "nan", "line 2: mass: value = 'nan': 'nan' is not a number"),
        ("MASS", "2,3", "line 2: mass: value = '2,3': '2,3' is not a number"),
        ("EFFORT", "-41", "line 5: limit: effort = '-41' is negative"),
        ("EFFORT", "1e9", "line 5: limit: effort = '1e9': beyond 1e+06"),
        ("SPEED", "1001", "line 5: limit: velocity = '1001': beyond 1000"),
        ("IZZ", "0.111", "line 3: inertia of link 'arm': no body has principal moments 0.05, 0.06, 0.111 kg m^2"),
        ("IYY", "-0.06", "line 3: inertia of link 'arm': no body has principal moments -0.06, 0.05, 0.07 kg m^2"),
        ("IXY", "0.0551", "line 3: inertia of link 'arm': no body has principal moments -0.0003"),
    ],
)
def test_a_number_that_no_arm_has_is_told_with_line_and_value(tmp_path, capsys, key, value, said):
    path = arm(tmp_path, **{key: value})
    assert main(["new-robot", str(path), "--out", str(tmp_path / "mine")]) == Status.BAD_INPUT
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    "changes",
    [{}, {"MASS": "0"}, {"EFFORT": "0"}, {"EFFORT": "inf"}, {"SPEED": "+Inf"}, {"SPEED": "999"}, {"IZZ": "0.10999"}],
)
def test_numbers_at_the_edge_of_what_there_is_are_taken(tmp_path, changes):
    check_stated_numbers(arm(tmp_path, **changes))
    check_stated_numbers(written(tmp_path, "gripper.urdf", ros(more=GRIPPER)))


@pytest.mark.parametrize(("upper", "taken"), [("6.3", True), ("12.56", True), ("12.6", False), ("166.2", False)])
def test_ends_of_a_turning_joint_in_degrees_are_refused(tmp_path, upper, taken):
    path = arm(tmp_path, UPPER=upper)
    if taken:
        assert load_arm(path).upper[0] == float(upper)
        return
    said = rf"line 5: limit: upper = {upper} rad is .* turns; a URDF is in radians"
    with pytest.raises(RobotModelError, match=said):
        load_arm(path)


def test_what_the_parser_says_of_a_file_is_one_line_with_its_name(tmp_path):
    path = written(tmp_path, "arm.urdf", ros())
    path.write_text(re.sub(r'mass value="[^"]*"', 'mass value="2;1"', path.read_text(), count=1))
    with pytest.raises(ModelFileError, match=r"^robot model .*arm\.urdf: MuJoCo cannot read it: .*line \d+ ?$"):
        model_facts(path, None)


def test_what_hangs_beside_the_arm_may_state_what_no_body_has(tmp_path):
    lamp = ros(more=GRIPPER.replace('ixx="0.03"', 'ixx="-0.03"').replace('effort="9"', 'effort="-9"'))
    path = written(tmp_path, "arm.urdf", lamp)
    check_stated_numbers(path, "tool0")
    with pytest.raises(RobotModelError, match="link 'finger_l': no body has principal moments"):
        check_stated_numbers(path)
