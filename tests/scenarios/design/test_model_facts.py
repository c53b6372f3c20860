from bad_files import refused
from model_files import no_limits, written
from robot_folders import arm_xml

from scenarios.design.model_facts import model_facts

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


ACTUATORS = """<actuator>
  <motor joint="axis1" ctrlrange="-7 7" gear="3"/>
  <motor joint="axis2" ctrlrange="-7 7" gear="11"/>
  <velocity joint="axis3" kv="100" ctrlrange="-3 3"/>
  <position joint="axis4" kp="50" ctrlrange="-2 2" forcerange="-13 17"/>
  <motor joint="axis5" ctrlrange="-7 7" gear="3"/>
  <motor joint="axis5" ctrlrange="-2 2" gear="-5"/>
  <position joint="axis6" kp="5000" forcerange="-13 17" ctrlrange="-3 3"/>
  <velocity joint="axis6" kv="100"/>
  <motor jointinparent="axis7" ctrlrange="-4 4" gear="2.5"/>
  <motor joint="axis8" ctrlrange="-9 9"/>
  <motor joint="axis8" ctrlrange="-6 6"/>
</actuator>"""


def test_the_torque_is_the_least_that_joint_and_actuators_together_allow_and_a_servo_s_command_is_none(tmp_path):
    text = arm_xml(9, extra=ACTUATORS)
    for j, most in ((1, 19), (2, 80), (8, 11), (9, 29)):
        text = text.replace(f'name="axis{j}"', f'actuatorfrcrange="-{most} {most}" name="axis{j}"', 1)
    facts = model_facts(written(tmp_path, "arm.xml", text), None)
    of = {1: 19.0, 2: 7.0 * 11.0, 4: 17.0, 5: 7.0 * 3.0 + 2.0 * 5.0, 7: 4.0 * 2.5, 8: 11.0, 9: 29.0}
    assert facts.torque == {f"axis{j}": torque for j, torque in of.items()}


def test_an_effort_and_a_speed_of_1_on_every_joint_are_those_of_an_exporter(tmp_path):
    placeholders = no_limits().replace('effort="0" velocity="0"', 'effort="1" velocity="1"')
    facts = model_facts(written(tmp_path, "ones.urdf", placeholders), None)
    assert facts.torque == facts.velocity == {}
    one_stated = placeholders.replace('effort="1"', 'effort="1.5"', 1)
    facts = model_facts(written(tmp_path, "one.urdf", one_stated), None)
    assert facts.torque == {"a1": 1.5, "a3": 1.0, "a5": 1.0}
    assert facts.velocity == {"a1": 1.0, "a3": 1.0, "a5": 1.0}


def test_a_number_that_no_arm_has_is_refused_with_its_place_and_one_that_limits_nothing_is_not_stated(tmp_path, capsys):
    for key, value, said in (
        ("MASS", "-7.5", "link 'arm' has a mass of -7.5 kg"),
        ("MASS", "2,3", "line 2: mass: value = '2,3': '2,3' is not a number"),
        ("EFFORT", "4l", "'effort' Element 'limit', line 5"),
        ("SPEED", "1e7", "line 5: limit: velocity = '1e7': beyond 1e+06"),
        ("IZZ", "0.111", "'arm'"),
        ("IXY", "0.0551", "'arm'"),
    ):
        path = arm(tmp_path, **{key: value})
        assert said in refused(capsys, ["new-robot", str(path), "--out", str(tmp_path / "mine")])
    for speed, effort in (("0", "0"), ("-1.7", "1e6"), ("inf", "inf"), ("1e4", "0")):
        facts = model_facts(arm(tmp_path, SPEED=speed, EFFORT=effort), None)
        assert facts.torque == facts.velocity == {}
