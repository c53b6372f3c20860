import re

import mujoco
import numpy as np
import pytest
from model_files import FINGERS, GRIPPER, HAND, menagerie, no_limits, ros, with_jaw, written
from robot_folders import arm_xml

from ident.model.arm import load_arm
from ident.support.errors import RobotModelError
from scenarios.cli import main
from scenarios.command_line.process import Status
from scenarios.design.model_facts import arm_end, model_facts
from sim.errors import PlantError

JAW = with_jaw(jaw="m6")  # of body claw_part
WRIST = JAW.replace('name="m6" axis="0 1 0" range="-0.2 1.7"', 'name="m6" axis="0 1 0" range="-1.9 1.7"')
INERTIAL = '<inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>'
TIP = f'<body name="tip">{INERTIAL}<joint name="m7" range="0 1"/></body>'
NAMELESS = HAND.replace("finger1", "m7").replace("finger2", "m8").replace('name="hand"', 'name="x"')
ENDS = {
    "jaw": (with_jaw(jaw="jaw"), ("palm", ("jaw",))),
    "by its body": (JAW, ("palm", ("m6",))),
    "turns as far as a wrist": (WRIST, (None, ())),
    "no known name": (JAW.replace("claw_part", "part6"), (None, ())),
    "jaw with a tip": (re.sub(r'(name="jaw"[^>]*/>)', rf"\1{TIP}", with_jaw()), ("palm", ("jaw", "m7"))),
    "short slides": (menagerie(hand=NAMELESS), ("wrist_link", ("m7", "m8"))),
    "equality": (menagerie(hand=HAND, tail=FINGERS), ("wrist_link", ("finger1", "finger2"))),
    "mimic": (ros(more=GRIPPER), ("wrist_link", ("grip", "grip_r"))),
    "no limits": (no_limits(), (None, ())),
}
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


@pytest.mark.parametrize("name", ENDS)
def test_grippers_are_recognised_by_name_travel_and_shape(tmp_path, name):
    text, expected = ENDS[name]
    assert arm_end(written(tmp_path, "arm.urdf" if "<robot" in text else "arm.xml", text)) == expected


def test_two_chains_need_the_name_of_the_last_body(tmp_path):
    long = written(tmp_path, "long.xml", menagerie(hand=NAMELESS.replace("0.04", "0.4")))
    with pytest.raises(PlantError, match=r"form 2 chains, which end at left, right; .* --flange left"):
        arm_end(long)


ACTUATORS = """<actuator>
  <motor joint="axis1" ctrlrange="-7 7" gear="3"/>
  <motor joint="axis2" ctrlrange="-7 7" gear="11"/>
  <velocity joint="axis3" kv="100" ctrlrange="-3 3"/>
  <position joint="axis4" kp="50" ctrlrange="-2 2" forcerange="-13 17"/>
</actuator>"""
SEVERAL = """<actuator>
  <motor joint="axis1" ctrlrange="-7 7" gear="3"/>
  <motor joint="axis1" ctrlrange="-2 2" gear="-5"/>
  <position joint="axis2" kp="5000" forcerange="-13 17" ctrlrange="-3 3"/>
  <velocity joint="axis2" kv="100"/>
  <motor jointinparent="axis3" ctrlrange="-4 4" gear="2.5"/>
  <motor joint="axis4" ctrlrange="-9 9"/>
  <motor joint="axis4" ctrlrange="-6 6"/>
</actuator>"""


def test_the_torque_is_the_least_that_joint_and_actuator_allow_and_a_servo_s_command_is_none(tmp_path):
    text = arm_xml(5, extra=ACTUATORS)
    for j, most in ((1, 19), (2, 80), (5, 29)):
        text = text.replace(f'name="axis{j}"', f'actuatorfrcrange="-{most} {most}" name="axis{j}"')
    facts = model_facts(written(tmp_path, "arm.xml", text), None)
    assert facts.torque == {"axis1": 19.0, "axis2": 77.0, "axis4": 17.0, "axis5": 29.0}


def test_actuators_of_one_joint_add_as_in_mujoco_and_one_without_a_limit_leaves_none(tmp_path):
    text = arm_xml(5, extra=SEVERAL).replace('name="axis4"', 'actuatorfrcrange="-11 11" name="axis4"', 1)
    path = written(tmp_path, "arm.xml", text)
    facts = model_facts(path, None)
    assert set(facts.torque) == {"axis1", "axis3", "axis4"}
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.ctrl[:] = np.where(model.actuator_gear[:, 0] > 0.0, 1.0, -1.0) * 1e3  # clamped
    mujoco.mj_forward(model, data)
    for name, torque in facts.torque.items():
        np.testing.assert_allclose(torque, data.qfrc_actuator[model.joint(name).dofadr[0]], rtol=1e-12)  # rounding
    assert facts.torque["axis4"] == 11.0


def test_an_effort_and_a_speed_of_1_on_every_joint_are_those_of_an_exporter(tmp_path):
    placeholders = no_limits().replace('effort="0" velocity="0"', 'effort="1" velocity="1"')
    facts = model_facts(written(tmp_path, "ones.urdf", placeholders), None)
    assert facts.torque == facts.velocity == {}
    one_stated = placeholders.replace('effort="1"', 'effort="1.5"', 1)
    facts = model_facts(written(tmp_path, "one.urdf", one_stated), None)
    assert facts.torque == {"a1": 1.5, "a3": 1.0, "a5": 1.0}
    assert facts.velocity == {"a1": 1.0, "a3": 1.0, "a5": 1.0}


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("MASS", "-7.5", "line 2: mass: value = '-7.5'"),
        ("MASS", "2,3", "line 2: mass: value = '2,3'"),
        ("EFFORT", "-41", "line 5: limit: effort = '-41'"),
        ("SPEED", "1001", "line 5: limit: velocity = '1001'"),
        ("IZZ", "0.111", "line 3: inertia: no body has principal moments 0.05, 0.06, 0.111 kg m^2"),
        ("IXY", "0.0551", "line 3: inertia: no body has principal moments -0.0003"),
    ],
)
def test_a_number_that_no_arm_has_is_refused_with_line_and_value(tmp_path, capsys, key, value, said):
    path = arm(tmp_path, **{key: value})
    assert main(["new-robot", str(path), "--out", str(tmp_path / "mine")]) == Status.BAD_INPUT
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(("upper", "taken"), [("6.3", True), ("12.56", True), ("12.6", False), ("166.2", False)])
def test_ends_of_a_turning_joint_in_degrees_are_refused(tmp_path, upper, taken):
    path = arm(tmp_path, UPPER=upper)
    if taken:
        assert load_arm(path).upper[0] == float(upper)
        return
    with pytest.raises(RobotModelError, match=rf"line 5: limit: upper = {upper} rad"):
        load_arm(path)
