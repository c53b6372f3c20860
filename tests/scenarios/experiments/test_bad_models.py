"""What a model file can be besides right: each ends with one line on stderr that names it, and status 2."""

import subprocess
import sys

import pytest
from bad_files import names_file
from model_files import mjcf, urdf
from places import ROOT

ELBOW = "0 -0.131 0.613"
JOINT = '<joint name="elbow_joint" axis="0 1 0" range="-170 175"/>'
HINGE = '<joint name="elbow_joint" type="revolute">'
BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'


MJCF_FAULTS = {
    "letter O": (mjcf(swap=(ELBOW, "0 -0.131 O.613")), r"line 6: body 'elbow_link': pos = .*'O.613' is not a number"),
    "nan": (mjcf(swap=(ELBOW, "0 nan 0.613")), r"'nan' is not a number"),
    "infinite": (mjcf(swap=(ELBOW, "0 inf 0.613")), r"'inf' is not a number"),
    "underscore": (mjcf(swap=(ELBOW, "0 -0.131 0.6_13")), r"'0.6_13' is not a number"),
    "huge": (mjcf(swap=(ELBOW, "0 -0.131 1e300")), r"pos = .*: beyond 50;"),
    "overflow": (mjcf(swap=(ELBOW, "0 -0.131 1e999")), r"pos = .*: beyond 50;"),
    "millimetres": (mjcf(swap=(ELBOW, "0 -131 613")), r"pos = .*: beyond 50; check the number and its unit"),
    "commas": (mjcf(swap=(ELBOW, "0,-0.131,0.613")), r"is not a number; numbers are separated by spaces"),
    "two numbers": (mjcf(swap=(ELBOW, "-0.131 0.613")), r"2 numbers, expected 3"),
    "four numbers": (mjcf(swap=(ELBOW, "0 0 -0.131 0.613")), r"4 numbers, expected 3"),
    "no numbers": (mjcf(swap=(ELBOW, "")), r"0 numbers, expected 3"),
    "zero axis": (mjcf(swap=(JOINT, '<joint name="elbow_joint" axis="0 0 0"/>')), r"axis = '0 0 0' has no direction"),
    "zero quat": (mjcf(swap=('euler="0 90 0"', 'quat="0 0 0 0"')), r"quat = '0 0 0 0' has no direction"),
    "zero zaxis": (mjcf(swap=('euler="0 90 0"', 'zaxis="0 0 0"')), r"zaxis = '0 0 0' has no direction"),
    "zero axisangle": (mjcf(swap=('euler="0 90 0"', 'axisangle="0 0 0 90"')), r"axisangle has no direction"),
    "parallel axes": (
        mjcf(swap=('euler="0 90 0"', 'xyaxes="1 2 3 2 4 6"')),
        r"the axes of xyaxes are parallel or zero",
    ),
    "two turns": (
        mjcf(swap=('euler="0 90 0"', 'euler="0 90 0" quat="1 0 0 0"')),
        r"quat and euler both state its orientation",
    ),
    "angle": (mjcf(swap=('euler="0 90 0"', 'euler="0 9O 0"')), r"'9O' is not a number"),
    "range": (mjcf(swap=("-170 175", "-170")), r"range = '-170': 1 numbers, expected 2"),
    "reversed range": (
        mjcf(swap=("-170 175", "175 -170")),
        r"joint 'shoulder_pan_joint': its range is reversed: from 3.05433 to -2.96706",
    ),
    "reversed range of a class": (
        mjcf(head='<default><joint range="1 -1"/></default>', swap=(JOINT, '<joint name="elbow_joint"/>')),
        r"joint 'elbow_joint': its range is reversed",
    ),
    "xacro": (mjcf(world="<xacro:m/>"), r"line 3: xacro:m: this is a xacro template; run xacro first"),
    "ref": (mjcf(swap=(JOINT, JOINT.replace("/>", ' ref="x"/>'))), r"ref = 'x': 'x' is not a number"),
    "default axis": (
        mjcf(head='<default><joint axis="0 O 1"/></default>'),
        r"joint: axis = '0 O 1': 'O' is not a number",
    ),
    "gravity": (mjcf(head='<option gravity="0 0 -9,81"/>'), r"gravity = '0 0 -9,81': '-9,81' is not a number"),
    "strong gravity": (mjcf(head='<option gravity="0 0 -9810"/>'), r"gravity = '0 0 -9810': beyond 100"),
    "zero gravity": (mjcf(head='<option gravity="0 -0 0.0"/>'), r"line 2: option: gravity is 0; without"),
    "no gravity": (mjcf(head='<option><flag gravity="disable"/></option>'), r"gravity is disabled"),
    "unknown class": (mjcf(swap=(JOINT, JOINT.replace("/>", ' class="arm"/>'))), r"unknown default class 'arm'"),
    "unknown childclass": (mjcf(base='childclass="arm"'), r"line 3: body 'base': unknown default class 'arm'"),
    "renamed class": (
        mjcf(head='<default class="ur"/>'),
        r"line 2: default: the outermost default class must be named main",
    ),
    "eulerseq": (mjcf(head='<compiler eulerseq="xyw"/>'), r"compiler eulerseq = 'xyw'; expected three of x, y, z"),
    "mixed eulerseq": (
        mjcf(head='<compiler eulerseq="xYz"/>'),
        r"compiler eulerseq = 'xYz'; expected three of x, y, z",
    ),
    "angle unit": (mjcf(head='<compiler angle="degrees"/>'), r"compiler angle = 'degrees'; did you mean 'degree'\?"),
    "nameless class": (mjcf(head="<default><default/></default>"), r"a default class inside another needs a name"),
    "joint twice": (mjcf(swap=("elbow_joint", "wrist_1_joint")), r"joint 'wrist_1_joint' appears twice; .*line 6"),
    "body twice": (mjcf(swap=("wrist_1_link", "elbow_link")), r"line 7: body 'elbow_link' appears twice; .*line 6"),
    "free base": (mjcf(swap=("<inertial", "<freejoint/><inertial")), r"freejoint: a free joint is not supported"),
    "ball": (mjcf(swap=(JOINT, '<joint name="elbow_joint" type="ball"/>')), r"'elbow_joint': a ball joint is not"),
    "hing": (mjcf(swap=(JOINT, '<joint type="hing"/>')), r"type 'hing' is unknown; did you mean 'hinge'\?"),
    "two joints": (mjcf(swap=(JOINT, f'{JOINT}<joint name="x"/>')), r"joint 'x': a second joint in one body"),
    "gripper": (mjcf(swap=("</body>", "</body><body><joint/></body><body><joint/></body>")), r"branches off"),
    "two arms": (mjcf(world='<body name="l"><joint name="j"/></body>'), r"branches off; only serial arms"),
    "axs": (mjcf(swap=("axis=", "axs=")), r"unknown attribute 'axs'; did you mean 'axis'\?"),
    "eular": (mjcf(swap=("euler=", "eular=")), r"unknown attribute 'eular'; did you mean 'euler'\?"),
    "boddy": (mjcf(world="<boddy/>"), r"line 3: boddy: unknown element; did you mean 'body'\?"),
    "frame": (mjcf(world='<frame pos="1 0 0"><body/></frame>'), r"frame is not supported; save the model with MuJoCo"),
    "replicate": (mjcf(world='<replicate count="2"><body/></replicate>'), r"replicate is not supported"),
    "composite": (mjcf(world='<composite type="cable"/>'), r"composite is not supported"),
    "loop": (mjcf(tail='<equality><connect body1="base"/></equality>'), r"an equality of kind connect ties joints"),
    "mimic": (
        mjcf(tail='<equality><joint joint1="elbow_joint"/></equality>'),
        r"an equality of kind joint ties joints",
    ),
    "coordinate": (mjcf(head='<compiler coordinate="global"/>'), r"coordinate = 'global' is not supported"),
    "no joint": (mjcf(links=()), r"it has no moving joint"),
    "many joints": (mjcf(links=[(f"l{k}", "0 0 0.1", "0 0 0", "0 1 0") for k in range(25)]), r"25 joints; arms of up"),
    "nested": (mjcf(links=[(f"l{k}", "0 0 0.1", "0 0 0", "0 1 0") for k in range(20_000)]), r"nested deeper than 200"),
    "include missing": (mjcf(head='<include file="no.xml"/>'), r"line 2: include: .*no\.xml: no such file"),
    "include nothing": (mjcf(head="<include/>"), r"line 2: include lacks the attribute file"),
    "include itself": (
        mjcf(head='<include file="arm.xml"/>'),
        r"line 2: include file = 'arm.xml' is included a second time",
    ),
    "unknown to MuJoCo": (mjcf(swap=(JOINT, JOINT.replace("/>", ' colour="1"/>'))), r"MuJoCo cannot read it: .*colour"),
    "entities": (BOMB + mjcf(), r"line 1: document type declarations are not supported"),
    "no XML": ("MuJoCo", r"line 1, column 1: not XML: syntax error"),
    "cut off": (mjcf()[:400], r"line 5, column \d+: not XML: "),
    "URDF": (urdf(), r"line 1: the root element is robot, expected mujoco; URDF files end in .urdf"),
    "blank": (" \n ", r"not XML: no element found"),
}


@pytest.mark.parametrize("name", MJCF_FAULTS)
def test_a_faulty_mjcf_is_one_line(identify, tmp_path, name):
    text, message = MJCF_FAULTS[name]
    path = tmp_path / "arm.xml"
    path.write_text(text)
    names_file(identify(model=path), path, message)


URDF_FAULTS = {
    "letter O": (urdf(swap=(ELBOW, "0 -0.131 O.613")), r"line 5: origin: xyz = .*'O.613' is not a number"),
    "roll": (urdf(swap=('rpy="0 1.57', 'rpy="O 1.57')), r"rpy = .*'O' is not a number"),
    "huge": (urdf(swap=(ELBOW, "0 -0.131 1e300")), r"xyz = .*: beyond 50"),
    "zero axis": (urdf(swap=('xyz="0 1 0"', 'xyz="0 0 0"')), r"axis: xyz = '0 0 0' has no direction"),
    "no axis": (urdf(swap=('<axis xyz="0 1 0"/>', "<axis/>")), r"axis: xyz is missing"),
    "xzy": (urdf(swap=('<axis xyz="0 1 0"/>', '<axis xzy="0 1 0"/>')), r"unknown attribute 'xzy'; did you mean 'xyz'"),
    "orgin": (urdf(swap=("<origin", "<orgin")), r"orgin in joint 'shoulder_pan_joint' is unknown; .* 'origin'\?"),
    "two origins": (urdf(swap=("<axis", "<origin/><axis")), r"line 3: joint 'shoulder_pan_joint' has a second origin"),
    "limit": (urdf(swap=('lower="-2.97"', 'lower="-2,97"')), r"lower = '-2,97': '-2,97' is not a number"),
    "limits": (
        urdf(swap=('upper="3.05"', 'upper="-3.05"')),
        r"joint 'shoulder_pan_joint': its range is reversed: from -2.97 to -3.05",
    ),
    "no limit": (urdf(swap=("<limit", "<dynamics")), r"limit is missing; a joint without limits is of type continuous"),
    "floating": (urdf(swap=(HINGE, HINGE.replace("revolute", "floating"))), r"type 'floating' is not supported"),
    "planar": (urdf(swap=(HINGE, HINGE.replace("revolute", "planar"))), r"type 'planar' is not supported"),
    "revolut": (
        urdf(swap=(HINGE, HINGE.replace("revolute", "revolut"))),
        r"type 'revolut' is unknown; did you mean 'rev",
    ),
    "no type": (urdf(swap=(HINGE, '<joint name="elbow_joint">')), r"'elbow_joint': type None is unknown"),
    "mimic": (urdf(swap=("<axis", '<mimic joint="wrist_3_joint"/><axis')), r"it mimics another joint"),
    "no parent": (urdf(swap=('<parent link="base"/>', "")), r"its parent link '' does not exist"),
    "lost parent": (
        urdf(swap=('<parent link="base"/>', '<parent link="bse"/>')),
        r"'bse' does not exist; did you mean 'base",
    ),
    "link twice": (urdf(more='<link name="base"/>'), r"line 9: link 'base' appears twice; the first one is in line 2"),
    "joint twice": (urdf(swap=("wrist_1_joint", "elbow_joint")), r"joint 'elbow_joint' appears twice"),
    "nameless": (urdf(more="<link/>"), r"line 9: a link without a name"),
    "two bases": (urdf(more='<link name="table"/>'), r"expected one base link .*, found base, table"),
    "loop": (
        urdf(
            more='<joint name="l" type="fixed"><parent link="base"/><child link="elbow_link"/></joint>',
        ),
        r"link 'elbow_link' has two parent joints; closed loops",
    ),
    "circle": (
        urdf(
            more='<link name="x"/><link name="y"/>'
            '<joint name="l" type="fixed"><parent link="x"/><child link="y"/></joint>'
            '<joint name="k" type="fixed"><parent link="y"/><child link="x"/></joint>',
        ),
        r"link 'x' is its own ancestor through its joints",
    ),
    "no link": ("<robot name='x'/>", r"0 links, expected 1 to 1000"),
    "many links": ("<robot>" + "".join(f"<link name='{k}'/>" for k in range(1001)) + "</robot>", r"1001 links"),
    "xacro": (
        "<robot xmlns:xacro='http://x'>\n<xacro:include/></robot>",
        r"line 2: xacro:include: this is a xacro template; run xacro first",
    ),
    "xacro number": (
        urdf(swap=(ELBOW, "0 ${offset} 0.613")),
        r"line 5: origin: '0 \$\{offset\} 0.613': this is a xacro template; run xacro",
    ),
    "xacro deep inside": (urdf(more="<link name='x'><xacro:m/></link>"), r"line 9: xacro:m: this is a xacro template"),
    "MJCF": (mjcf(), r"line 1: the root element is mujoco, expected robot; MJCF files end in .xml or .mjcf"),
    "no XML": ("<robot><link></robot>", r"line 1, column \d+: not XML: mismatched tag"),
}


@pytest.mark.parametrize("name", URDF_FAULTS)
def test_a_faulty_urdf_is_one_line(identify, tmp_path, name):
    text, message = URDF_FAULTS[name]
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    names_file(identify(model=path), path, message)


def test_a_model_of_an_unknown_ending_is_one_line(identify, tmp_path):
    (tmp_path / "arm.txt").write_text(mjcf())
    assert "expected a .urdf, .xml or .mjcf file" in identify(model=tmp_path / "arm.txt")


def test_a_xacro_file_is_told_to_be_expanded(identify, tmp_path):
    (tmp_path / "arm.urdf.xacro").write_text(urdf())
    names_file(identify(model=tmp_path / "arm.urdf.xacro"), tmp_path / "arm.urdf.xacro", "run xacro first")


@pytest.mark.parametrize("head", ["", '<?xml version="1.0" encoding="ISO-8859-1"?>'])
def test_a_name_in_latin_1_is_told_with_its_line(identify, tmp_path, head):
    path = tmp_path / "arm.xml"
    path.write_bytes((head + mjcf(swap=("elbow_link", "d\u00e9_link"))).encode("latin-1"))
    names_file(identify(model=path), path, r"line 6: body: 'd\u00e9_link' is not in UTF-8; save the file as UTF-8")


def test_twenty_thousand_bodies_do_not_end_the_process(good, tmp_path):
    path = tmp_path / "deep.xml"
    path.write_text(MJCF_FAULTS["nested"][0])
    files = [
        "--model",
        path,
        "--unloaded",
        good / "a.csv",
        "--loaded",
        good / "b.csv",
        "--payload",
        good / "payload.toml",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "scenarios", "identify", *files], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "nested deeper than 200" in done.stderr
