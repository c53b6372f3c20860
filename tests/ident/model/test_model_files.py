"""Model files without MuJoCo: limits, each just inside and just outside; the arm in a file that has more."""

import os
from xml.etree import ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest
from model_files import FINGERS, GRIPPER, HAND, LINKS, TABLE, menagerie, mjcf, ros, urdf, written
from refusals import refused

import rx90_mjcf
from ident.model import mjcf as mjcf_files
from ident.model import xml_tree
from ident.model.arm import FARTHEST, STRONGEST_GRAVITY, arm_from_pinocchio, load_arm
from ident.model.xml_tree import LARGEST, vector
from ident.support.errors import RobotModelError
from ident.support.files import captured_stderr

JOINT_NAMES = tuple(f"{link[0]}_joint" for link in LINKS)
LIMIT = 'lower="-2.97" upper="3.05"'


def read(folder, text: str, flange: str | None = None):
    return load_arm(written(folder, "arm.xml" if text.startswith("<mujoco") else "arm.urdf", text), flange=flange)


def test_numbers_have_sign_exponent_and_any_white_space():
    assert vector(ET.Element("body", pos=" +1.5e-3\n-.25\t3. "), "pos", 3) == (1.5e-3, -0.25, 3.0)
    assert vector(ET.Element("body"), "pos", 3) is None
    for word in ("1e", ".", "--1", "1.2.3", "0x1", "1_0", "nan", "-inf", "\uff11", "1e5e", "O.5"):
        refused(RobotModelError, f"body: pos = .*{word!r}", vector, ET.Element("body", pos=f"2 3 {word}"), "pos", 3)
    for sign in (1, -1):
        assert vector(ET.Element("body", pos=f"{sign * LARGEST} 0.5"), "pos", 2) == (sign * LARGEST, 0.5)
        refused(RobotModelError, "beyond 1e", vector, ET.Element("body", pos=f"0.5 {sign * 1.1 * LARGEST}"), "pos", 2)


def nested(depth: int) -> str:
    return "<mujoco>" + "<a>" * (depth - 1) + "</a>" * (depth - 1) + "</mujoco>"


def turned(k: int) -> str:
    return mjcf(links=[(f"l{i}", "0 0 0.1", "0 0 0", "0 1 0") for i in range(k)])


FIXED = '<joint name="j{1}" type="fixed"><parent link="l{0}"/><child link="l{1}"/></joint>'
LINK_ROW = "<link name='l0'/>" + "".join(f"<link name='l{k}'/>{FIXED.format(k - 1, k)}" for k in range(1, 1000))
MOVING = '<joint name="last" type="continuous"><parent link="l0"/><child link="end"/></joint>'
EDGES = {
    "distance": (mjcf(swap=("0 0 0.163", f"0 0 -{FARTHEST}")), mjcf(swap=("0 0 0.163", "0 0 -50.1")), "beyond 50"),
    "gravity": (
        mjcf(head=f'<option gravity="0 0 {STRONGEST_GRAVITY}"/>'),
        mjcf(head='<option gravity="0 0 100.1"/>'),
        "beyond 100",
    ),
    "angle": (
        mjcf(swap=('euler="0 90 0"', f'euler="0 {LARGEST} 0"')),
        mjcf(swap=('euler="0 90 0"', 'euler="0 1000001 0"')),
        r"beyond 1e\+06",
    ),
    "joints": (turned(24), turned(25), "25 joints; .* 24"),
    "turns": (urdf(swap=(LIMIT, 'lower="-12.5" upper="1e16"')), urdf(swap=(LIMIT, 'lower="-12.6"')), "2 turns"),
    "range": (urdf(swap=(LIMIT, 'lower="0.5" upper="0.5"')), urdf(swap=(LIMIT, 'lower="0.5"')), "from 0.5 to 0"),
    "links": (
        f"<robot>{LINK_ROW.replace(FIXED.format(998, 999), MOVING).replace('l999', 'end')}</robot>",
        f"<robot>{LINK_ROW}<link name='more'/></robot>",
        "1001 links, expected 1 to 1000",
    ),
}


@pytest.mark.parametrize("edge", EDGES)
def test_a_model_is_read_up_to_its_limit(tmp_path, edge):
    inside, outside, message = EDGES[edge]
    assert read(tmp_path, inside).n > 0
    refused(RobotModelError, message, read, tmp_path, outside)


def test_a_file_is_read_up_to_its_size_and_depth_with_all_that_it_includes(tmp_path, monkeypatch):
    path = written(tmp_path, "x.xml", nested(xml_tree.DEEPEST))
    assert xml_tree.read_xml(path).tag == "mujoco"
    path.write_text(nested(xml_tree.DEEPEST + 1))
    refused(RobotModelError, "line 1: elements are nested deeper than 200", xml_tree.read_xml, path)
    for k in range(70):
        written(tmp_path, f"{k}.xml", f'<mujoco><a><b><include file="{k + 1}.xml"/></b></a></mujoco>')
    refused(RobotModelError, "nested deeper than 200", load_arm, tmp_path / "0.xml")
    folder = tmp_path / "scene"
    written(folder, "arm.xml", mjcf())
    scene = written(folder, "scene.xml", '<mujoco><include file="arm.xml"/></mujoco>')
    size = sum(path.stat().st_size for path in folder.iterdir())
    monkeypatch.setattr(mjcf_files, "LARGEST_FILE", size)
    assert load_arm(scene).joint_names == JOINT_NAMES
    monkeypatch.setattr(mjcf_files, "LARGEST_FILE", size - 1)
    refused(RobotModelError, "MB are included", load_arm, scene)


def test_an_arm_has_the_names_axes_places_limits_and_gravity_of_its_file(tmp_path, arm):
    text = urdf(swap=(' effort="150" velocity="3.1"', "")).replace("elbow_joint", "a&lt;b&amp;&quot;c&quot;")
    found = read(tmp_path, text)
    assert found.name == "ur"
    assert found.joint_names == tuple(name.replace("elbow_joint", 'a<b&"c"') for name in JOINT_NAMES)
    np.testing.assert_array_equal(found.axis, [[float(x) for x in link[3].split()] for link in LINKS])
    np.testing.assert_array_equal(found.translation, [[float(x) for x in link[1].split()] for link in LINKS])
    np.testing.assert_array_equal(found.gravity, [0.0, 0.0, -9.81])
    assert (found.lower[0], found.upper[5]) == (-2.97, 3.05)
    # From degrees.
    np.testing.assert_allclose(arm.upper, np.deg2rad([160, 137.5, 142.5, 270, 120, 270]), rtol=1e-15)


def test_a_range_limits_a_joint_where_the_file_says_so(tmp_path):
    for auto, own in (("false", ""), ("false", "true"), ("true", ""), ("true", "false")):
        limited = f'limited="{own}"' if own else ""
        text = mjcf(head=f'<compiler autolimits="{auto}"/>').replace("range=", f"{limited} range=")
        upper = np.deg2rad(175.0) if (own or auto) == "true" else np.inf
        np.testing.assert_allclose(read(tmp_path, text).upper, upper, rtol=1e-15)  # rounding


def test_an_attribute_is_taken_for_a_misspelt_one_only_if_that_is_missing(tmp_path):
    found = read(tmp_path, urdf(swap=("effort=", 'command_effort="9" effort=')))
    assert found.joint_names == JOINT_NAMES
    swapped = urdf(swap=("upper=", "uper="))
    refused(RobotModelError, "unknown attribute 'uper'; did you mean 'upper'", read, tmp_path, swapped)


def test_a_coupling_of_joints_that_do_not_exist_or_in_the_other_order_is_refused():
    for one, other in ((5, 4), (2, 2), (3, 6), (-1, 2)):
        with pytest.raises(RobotModelError, match=f"joints {one + 1} and {other + 1}; expected two of its 6"):
            load_arm(rx90_mjcf.MJCF, ((one, other),))
    refused(RobotModelError, "given twice", load_arm, rx90_mjcf.MJCF, ((4, 5), (4, 5)))


def test_a_floating_base_is_refused():
    floating = pin.Model()
    floating.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    refused(RobotModelError, "joint root: type JointModelFreeFlyer", arm_from_pinocchio, floating)


def test_what_a_library_prints_is_collected_and_the_terminal_is_given_back(capfd):
    with captured_stderr() as lines:
        os.write(2, b"Error: first\n\n  second\x07 \n")
        assert lines == []
    assert lines == ["Error: first", "second"]
    with pytest.raises(RobotModelError, match="broken"), captured_stderr():
        raise RobotModelError("broken")
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"


ARM = ("shoulder", "elbow", "wrist")
TENDON = '<tendon><fixed name="t"><joint joint="{}"/></fixed></tendon><equality><tendon tendon1="t"/></equality>'
CHAINS = [
    (menagerie(), "elbow_link", ARM[:2]),
    (menagerie(hand=HAND, tail=FINGERS), "hand", ARM),
    (menagerie(hand=HAND), "left", (*ARM, "finger1")),
    (menagerie(world=TABLE), None, ARM),
    (menagerie(world=TABLE), "wrist_link", ARM),
    (ros(), "tool0", ARM),
    (ros(), "elbow_link", ARM[:2]),
    (ros(more=GRIPPER), "tool0", ARM),
    (ros(more=GRIPPER), "finger_l", (*ARM, "grip")),
    # Ties among what is locked.
    (menagerie(hand=HAND, tail=TENDON.format("finger1")), "wrist_link", ARM),
    (menagerie(hand=HAND, tail='<equality><joint joint1="finger1"/></equality>'), "wrist_link", ARM),
    (
        menagerie(
            hand='<body name="a"><site name="s"/></body><body name="b"><site name="t"/></body>',
            tail='<equality><weld site1="s" site2="t"/></equality>',
        ),
        "wrist_link",
        ARM,
    ),
    # Faults outside the chain.
    (menagerie(world='<frame pos="1 0 0"><body name="shelf"><joint/></body></frame>'), "wrist_link", ARM),
    (menagerie(world='<body name="bag"><composite type="cable"/></body>'), "wrist_link", ARM),
    (menagerie(head='<default><default class="jaw"><joint axs="1"/></default></default>'), "wrist_link", ARM),
    (menagerie(hand='<body name="gimbal"><joint axis="1 0 0"/><joint axis="0 1 0"/></body>'), "wrist_link", ARM),
    (menagerie(hand='<body name="camera" pos="0 O 0"/>'), "wrist_link", ARM),
    (ros(more='<link name="lamp"/><link name="lamp"/><joint name="l" type="blinking"/><link/>'), "tool0", ARM),
]


@pytest.mark.parametrize(("text", "flange", "joints"), CHAINS)
def test_the_arm_is_what_leads_to_the_flange(tmp_path, text, flange, joints):
    arm = read(tmp_path, text, flange)
    assert arm.joint_names == joints
    expected = [[0.0, 0.05, 0.15], [0.0, 0.0, 0.3]]
    np.testing.assert_allclose(arm.translation[1:3], expected[: len(joints) - 1], rtol=1e-15)  # sums of frames


def motors(*ratios: tuple[float, float]) -> str:
    """Motors that act on the elbow and the wrist with ratios."""
    ends = [f'<joint joint="elbow" coef="{a}"/><joint joint="wrist" coef="{b}"/>' for a, b in ratios]
    fixed = "".join(f'<fixed name="t{k}">{each}</fixed>' for k, each in enumerate(ends))
    acts = "".join(f'<motor name="m{k}" tendon="t{k}"/>' for k in range(len(ends)))
    return f"<tendon>{fixed}</tendon><actuator>{acts}</actuator>"


def test_a_motor_on_two_joints_is_read_only_with_the_coupling_stated_that_it_is(tmp_path):
    summed, pair = (3.0, 3.0), ((1, 2),)
    assert load_arm(written(tmp_path, "arm.xml", menagerie(tail=motors(summed))), pair).couplings == pair
    for ratios, couplings in (
        ([summed], ()),
        ([summed], ((0, 1),)),
        ([(3.0, -3.0)], pair),
        ([summed, (3.0, -3.0)], pair),  # a differential
    ):
        path = written(tmp_path, "arm.xml", menagerie(tail=motors(*ratios)))
        with pytest.raises(RobotModelError, match="'m0' on tendon 't0': it moves joints elbow and wrist together"):
            load_arm(path, couplings)


FAULTS = [
    (menagerie(hand=HAND), None, "joint finger2 branches off.*as flange"),
    (menagerie(hand=HAND, tail=FINGERS), None, "kind joint ties joints.*as flange"),
    (menagerie(hand=HAND, tail=FINGERS), "left", "kind joint ties joints"),
    (
        menagerie(tail='<equality><connect body1="wrist_link" body2="shoulder_link"/></equality>'),
        "wrist_link",
        "connect",
    ),
    (menagerie(tail='<equality><weld site1="a" site2="b"/></equality>'), "wrist_link", "kind weld"),
    (menagerie(tail=TENDON.format("elbow")), "wrist_link", "kind tendon"),
    (menagerie(), "wrist_lnk", "flange 'wrist_lnk': .*'wrist_link'"),
    (ros(), "tool", "flange 'tool': .*'tool0'"),
    (ros(more=GRIPPER), None, "joint 'grip_r': it mimics.*ends before it: --flange tool0,"),
    (ros(more=GRIPPER), "finger_r", "joint 'grip_r': it mimics"),
    (menagerie(), "base", "no moving joint"),
    (
        ros().replace("<mass value=", "<mass valu=", 1),
        "tool0",
        "line 1: mass: unknown attribute 'valu'; did you mean 'value'",
    ),
    (ros().replace('ixx="', 'ixx="0,', 1), "tool0", "line 1: inertia: ixx = .* is not a number"),
    (ros().replace("<mass ", "<mas ", 1), "tool0", "line 1: mas in an inertial is unknown; did you mean 'mass'"),
    (
        ros(more='<transmission name="d"><joint name="elbow"/><joint name="wrist"/></transmission>'),
        "tool0",
        "'d': it moves joints elbow and wrist together",
    ),
    (urdf(swap=('name="elbow_joint"', "")), None, "a joint without a name"),
    (menagerie(hand='<frame><body name="palm"><joint name="turn"/></body></frame>'), "palm", "frame"),
    (
        menagerie().replace('<body name="base" childclass="arm">', '<body name="base"><freejoint/>'),
        None,
        "freejoint: type 'free'",
    ),
]


@pytest.mark.parametrize(("text", "flange", "message"), FAULTS)
def test_what_is_no_serial_arm_is_refused_in_one_line(tmp_path, text, flange, message):
    refused(RobotModelError, message, read, tmp_path, text, flange)
