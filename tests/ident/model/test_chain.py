"""The arm within a model file that has more: what leads to the flange is read, what ties it is refused."""

import numpy as np
import pytest
from collections_of_arms import FINGERS, GRIPPER, HAND, TABLE, menagerie, ros, written

from ident.model.arm import load_arm
from ident.support.errors import RobotModelError

ARM = ("shoulder", "elbow", "wrist")


def read(folder, text: str, flange: str | None = None):
    name = "arm.xml" if text.startswith("<mujoco") else "arm.urdf"
    return load_arm(written(folder, name, text), flange=flange)


@pytest.mark.parametrize(
    ("text", "flange"),
    [
        (menagerie(), "wrist_link"),
        (menagerie(hand=HAND, tail=FINGERS), "wrist_link"),
        (menagerie(hand=HAND, tail=FINGERS), "hand"),
        (menagerie(world=TABLE), None),
        (menagerie(world=TABLE), "wrist_link"),
        (menagerie(hand=HAND, tail='<equality><weld body1="left" body2="hand"/></equality>'), "hand"),
        (ros(), "tool0"),
        (ros(), "wrist_link"),
        (ros(more=GRIPPER), "tool0"),
    ],
)
def test_the_arm_is_what_leads_to_the_flange(tmp_path, text, flange):
    arm = read(tmp_path, text, flange)
    assert arm.joint_names == ARM
    expected = [[0.0, 0.05, 0.15], [0.0, 0.0, 0.3]]
    np.testing.assert_allclose(arm.translation[1:], expected, rtol=1e-15)  # Pinocchio adds frames up


def test_a_flange_in_the_middle_ends_the_arm_there(tmp_path):
    assert read(tmp_path, menagerie(), "elbow_link").joint_names == ARM[:2]
    assert read(tmp_path / "urdf", ros(), "elbow_link").joint_names == ARM[:2]


def test_a_finger_may_be_the_flange(tmp_path):
    arm = read(tmp_path, menagerie(hand=HAND), "left")
    assert arm.joint_names == (*ARM, "finger1")
    assert read(tmp_path / "urdf", ros(more=GRIPPER), "finger_l").joint_names == (*ARM, "grip")


FAULTS = {
    "branches": (menagerie(hand=HAND), None, "joint finger2 branches off.*name the arm's last body as flange"),
    "fingers tied": (menagerie(hand=HAND, tail=FINGERS), None, "equality of kind joint ties joints.*as flange"),
    "a tied finger that moves": (menagerie(hand=HAND, tail=FINGERS), "left", "equality of kind joint ties joints"),
    "a loop of links": (
        menagerie(tail='<equality><connect body1="wrist_link" body2="shoulder_link" anchor="0 0 0"/></equality>'),
        "wrist_link",
        "equality of kind connect ties joints",
    ),
    "a weld to the world": (
        menagerie(tail='<equality><weld body1="elbow_link"/></equality>'),
        "wrist_link",
        "kind weld",
    ),
    "a weld of sites": (menagerie(tail='<equality><weld site1="a" site2="b"/></equality>'), "wrist_link", "kind weld"),
    "a tied tendon": (
        menagerie(
            tail='<tendon><fixed name="t"><joint joint="elbow"/></fixed></tendon>'
            '<equality><tendon tendon1="t"/></equality>'
        ),
        "wrist_link",
        "kind tendon",
    ),
    "a tendon that is not there": (
        menagerie(tail='<equality><tendon tendon1="t"/></equality>'),
        "wrist_link",
        "kind tendon",
    ),
    "no such body": (menagerie(), "wrist_lnk", "flange 'wrist_lnk': no body has that name; did you mean 'wrist_link'"),
    "no such link": (ros(), "tool", "flange 'tool': no body has that name; did you mean 'tool0'"),
    "a mimic": (ros(more=GRIPPER), None, "joint 'grip_r': it mimics another joint.*as flange"),
    "a mimic that leads to the flange": (ros(more=GRIPPER), "finger_r", "joint 'grip_r': it mimics another joint"),
    "a base that stands still": (menagerie(), "base", "it has no moving joint"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_no_serial_arm_is_refused_with_what_to_do(tmp_path, fault):
    text, flange, message = FAULTS[fault]
    with pytest.raises(RobotModelError, match=message) as caught:
        read(tmp_path, text, flange)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "tie",
    [
        '<tendon><fixed name="t"><joint joint="finger1"/></fixed></tendon><equality><tendon tendon1="t"/></equality>',
        '<equality><connect body1="left" body2="right" anchor="0 0 0"/></equality>',
        '<equality><joint joint1="finger1"/></equality>',
    ],
)
def test_ties_among_what_is_held_do_not_matter(tmp_path, tie):
    assert read(tmp_path, menagerie(hand=HAND, tail=tie), "wrist_link").joint_names == ARM


SPOILT = {
    "a frame": menagerie(world='<frame pos="1 0 0"><body name="shelf"><joint/></body></frame>'),
    "a composite": menagerie(world='<body name="bag"><composite type="cable"/></body>'),
    "a class": menagerie(head='<default><default class="jaw"><joint axis="0 0 0" axs="1"/></default></default>'),
    "two joints": menagerie(hand='<body name="gimbal"><joint axis="1 0 0"/><joint axis="0 1 0"/></body>'),
    "a number": menagerie(hand='<body name="camera" pos="0 O 0"/>'),
    "a weld of sites": menagerie(
        hand='<body name="a"><site name="s"/></body><body name="b"><site name="t"/></body>',
        tail='<equality><weld site1="s" site2="t"/></equality>',
    ),
    "links": ros(more='<link name="lamp"/><link name="lamp"/><joint name="l" type="blinking"/><link/>'),
    "a joint": ros(
        more='<link name="w"/><joint name="j" type="planar"><parent link="tool0"/><child link="w"/>'
        '<origin xyz="0 0 x"/><limit lower="1" upper="-1"/></joint>'
    ),
}


@pytest.mark.parametrize("fault", SPOILT)
def test_nothing_off_the_arm_leads_to_a_refusal(tmp_path, fault):
    flange = "wrist_link" if SPOILT[fault].startswith("<mujoco") else "tool0"
    assert read(tmp_path, SPOILT[fault], flange).joint_names == ARM


def test_a_flange_within_a_frame_is_told_to_be_written_flat(tmp_path):
    framed = menagerie(hand='<frame><body name="palm"><joint name="turn"/></body></frame>')
    with pytest.raises(RobotModelError, match="frame is not supported"):
        read(tmp_path, framed, "palm")


def test_a_base_that_floats_is_no_object_beside_the_arm(tmp_path):
    floating = menagerie().replace('<body name="base" childclass="arm">', '<body name="base"><freejoint/>')
    with pytest.raises(RobotModelError, match="a free joint is not supported"):
        read(tmp_path, floating)
