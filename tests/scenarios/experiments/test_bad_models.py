import pytest
from bad_files import names_file
from model_files import mjcf, urdf

from ident.support.errors import RobotModelError
from scenarios.experiments.robots import read_arm

ELBOW = "0 -0.131 0.613"
JOINT = '<joint name="elbow_joint" axis="0 1 0" range="-170 175"/>'
HINGE = '<joint name="elbow_joint" type="revolute">'
FIXED = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'


def joint(more: str) -> str:
    return mjcf(swap=(JOINT, JOINT.replace("/>", f" {more}/>")))


def turned(orientation: str) -> str:
    return mjcf(swap=('euler="0 90 0"', orientation))


MJCF_FAULTS = [
    (mjcf(swap=(ELBOW, "0 -0.131 O.613")), r"line 6: body 'elbow_link': pos = .*'O.613'"),
    (mjcf(swap=(ELBOW, "0,-0.131,0.613")), "separated by spaces"),
    (mjcf(swap=(ELBOW, "-0.131 0.613")), "2 numbers, expected 3"),
    (turned('euler="0 9O 0"'), "'9O'"),
    (turned('zaxis="0 0 0"'), "zaxis .*line 5"),
    (turned('xyaxes="1 2 3 2 4 6"'), "shoulder_lift_joint"),
    (turned('eular="0 90 0"'), "'eular'; did you mean 'euler'"),
    (mjcf(swap=("-170 175", "175 -170")), "shoulder_pan_joint: .*from 3.05433 to -2.96706"),
    (
        mjcf(head='<default><joint range="1 -1"/></default>', swap=(JOINT, '<joint name="elbow_joint"/>')),
        "elbow_joint: .*from 0.0174533 to -0.0174533",
    ),
    (mjcf(swap=("0 1 0", "0 0 0")), "shoulder_lift_joint: its axis"),
    (joint('ref="x"'), "ref = 'x'"),
    (joint('class="arm"'), "line 6: joint 'elbow_joint': unknown default class 'arm'"),
    (joint('type="ball"'), "'ball'"),
    (mjcf(head='<default><joint axis="0 O 1"/></default>'), "line 2: joint: axis = .*'O'"),
    (mjcf(head='<default class="ur"/>'), "line 2"),
    (mjcf(head='<option><flag gravity="disable"/></option>'), "gravity is 0 or disabled"),
    (mjcf(head='<compiler eulerseq="xYz"/>'), "eulerseq = 'xYz'"),
    (mjcf(head='<compiler coordinate="global"/>'), "coordinate = 'global'"),
    (mjcf(swap=("wrist_1_joint", "elbow_joint")), "line 7: joint 'elbow_joint' .* line 6$"),
    (mjcf(swap=(JOINT, f'{JOINT}<joint name="x"/>')), "joint 'x': a second joint"),
    (mjcf(swap=("</body>", "</body><body><joint/></body><body><joint/></body>")), "branches off"),
    (mjcf(world="<boddy/>"), "line 3: boddy"),
    (mjcf(tail='<equality><joint joint1="elbow_joint"/></equality>'), "line 10: joint: an equality"),
    (mjcf(head='<include file="no.xml"/>'), r"line 2: include: .*no\.xml: no such file"),
    (mjcf(head='<include file="arm.xml"/>'), "'arm.xml' is included a second time"),
    ('<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">]>' + mjcf(), "line 1: document type"),
    (mjcf()[:400], r"line 5, column \d+: not XML"),
    (urdf(), "the root element is robot, expected mujoco"),
    (mjcf(world="<xacro:m/>"), "line 3: xacro:m: .*run xacro first"),
]
URDF_FAULTS = [
    (urdf(swap=(ELBOW, "0 -0.131 O.613")), "line 5: origin: xyz = .*'O.613'"),
    (urdf(swap=(ELBOW, "0 -131 613")), "elbow_joint is at 0 -131 613 m .*beyond 50"),
    (urdf(swap=('xyz="0 1 0"', 'xyz="0 0 0"')), "shoulder_lift_joint: its axis"),
    (urdf(swap=('<axis xyz="0 1 0"/>', "<axis/>")), "line 4: axis: xyz is missing"),
    (urdf(swap=("<origin", "<orgin")), "orgin in joint 'shoulder_pan_joint' .* 'origin'"),
    (urdf(swap=("<axis", "<origin/><axis")), "line 3: joint 'shoulder_pan_joint' has a second origin"),
    (urdf(swap=('lower="-2.97"', 'lower="-2,97"')), "shoulder_pan_joint.*-2,97"),
    (urdf(swap=("<limit", "<dynamics")), "shoulder_pan_joint.* limits"),
    (urdf(swap=(HINGE, HINGE.replace("revolute", "floating"))), "elbow_joint"),
    (urdf(swap=(HINGE, HINGE.replace("revolute", "revolut"))), r"elbow_joint.*\[revolut\]"),
    (urdf(swap=('<parent link="base"/>', '<parent link="bse"/>')), r"\[bse\] of joint \[shoulder_pan_joint\]"),
    (urdf(more='<link name="base"/>'), "'base' is not unique"),
    (urdf(swap=("wrist_1_joint", "elbow_joint")), "'elbow_joint' is not unique"),
    (urdf(more='<link name="table"/>'), r"\[base\] and \[table\]"),
    (urdf(more=FIXED.format("l", "base", "elbow_link")), "line 9: joint 'l': link 'elbow_link' has two parent"),
    (
        urdf(more=f'<link name="x"/><link name="y"/>{FIXED.format("l", "x", "y")}{FIXED.format("k", "y", "x")}'),
        "link 'y' is its own ancestor",
    ),
    ("<robot name='x'/>", "0 links, expected 1 to 1000"),
    (mjcf(), "the root element is mujoco, expected robot"),
    (urdf(swap=(ELBOW, "0 ${offset} 0.613")), r"line 5: origin: '0 \$\{offset\} 0.613': .*run xacro"),
]
CASES = [*(("arm.xml", *each) for each in MJCF_FAULTS), *(("arm.urdf", *each) for each in URDF_FAULTS)]
CASES += [("arm.txt", mjcf(), "expected a .urdf, .xml or .mjcf file"), ("arm.urdf.xacro", urdf(), "run xacro first")]
CASES.append(("arm.xml", mjcf(swap=("elbow_link", "d\udce9_link")), r"line 6, column \d+: not XML in UTF-8"))


@pytest.mark.parametrize(("name", "text", "message"), CASES)
def test_a_faulty_model_is_one_line(tmp_path, name, text, message):
    path = tmp_path / name
    path.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(RobotModelError) as caught:
        read_arm(path, ())
    assert "\n" not in str(caught.value)
    names_file(str(caught.value), path, message)


def test_a_faulty_model_of_a_command_is_one_line(identify, tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(MJCF_FAULTS[0][0])
    names_file(identify(model=path), path, MJCF_FAULTS[0][1])
