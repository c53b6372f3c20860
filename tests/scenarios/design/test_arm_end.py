"""Where an arm ends, when nobody says so: grippers are found by name, travel and shape, and held."""

import pytest
from collections_of_arms import FINGERS, GRIPPER, HAND, menagerie, ros, written
from small_arms import no_limits, scara, weak, with_jaw

from scenarios.design.arm_end import ArmEnd, arm_end
from sim.errors import RobotError


@pytest.mark.parametrize("jaw", ["jaw", "jointGripper", "left_finger"])
def test_a_last_joint_by_the_name_of_a_jaw_is_held_and_the_arm_ends_before_it(tmp_path, jaw):
    path = written(tmp_path, "arm.xml", with_jaw(jaw=jaw))
    assert arm_end(path) == ArmEnd("palm", (jaw,))


def test_a_jaw_is_known_by_its_body_too_unless_it_turns_as_far_as_a_wrist(tmp_path):
    text = with_jaw(jaw="m6")
    assert arm_end(written(tmp_path, "jaw.xml", text)) == ArmEnd("palm", ("m6",))  # of body claw_part
    wrist = text.replace('name="m6" axis="0 1 0" range="-0.2 1.7"', 'name="m6" axis="0 1 0" range="-1.9 1.7"')
    assert wrist != text
    assert arm_end(written(tmp_path, "wrist.xml", wrist)) == ArmEnd(None)
    plain = text.replace("claw_part", "part6")
    assert arm_end(written(tmp_path, "plain.xml", plain)) == ArmEnd(None)


def test_fingers_that_slide_side_by_side_are_held_whatever_their_names_if_they_are_short(tmp_path):
    hand = HAND.replace("finger1", "m7").replace("finger2", "m8").replace('name="hand"', 'name="x"')
    short = written(tmp_path, "short.xml", menagerie(hand=hand))
    assert arm_end(short) == ArmEnd("wrist_link", ("m7", "m8"))
    long = written(tmp_path, "long.xml", menagerie(hand=hand.replace("0.04", "0.4")))
    with pytest.raises(
        RobotError, match=r"form 2 chains, which end at left, right; name the last body .* --flange left"
    ):
        arm_end(long)


def test_fingers_that_equalities_or_mimicry_tie_are_held(tmp_path):
    tied = written(tmp_path, "tied.xml", menagerie(hand=HAND, tail=FINGERS))
    assert arm_end(tied) == ArmEnd("wrist_link", ("finger1", "finger2"))
    assert arm_end(written(tmp_path, "mimic.urdf", ros(more=GRIPPER))) == ArmEnd("wrist_link", ("grip", "grip_r"))


@pytest.mark.parametrize("text", [scara(), weak(), no_limits()])
def test_an_arm_without_a_gripper_is_all_its_own(tmp_path, text):
    assert arm_end(written(tmp_path, "arm.urdf" if text.startswith("<robot") else "arm.xml", text)) == ArmEnd(None)


def test_what_a_jaw_carries_is_the_gripper_s(tmp_path):
    inertial = '<inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>'
    tip, text = f'<body name="tip">{inertial}<joint name="m7" range="0 1"/></body>', with_jaw()
    start = text.index('name="jaw"')
    end = text.index("/>", start) + 2
    text = text[:end] + tip + text[end:]
    assert arm_end(written(tmp_path, "arm.xml", text)) == ArmEnd("palm", ("jaw", "m7"))
