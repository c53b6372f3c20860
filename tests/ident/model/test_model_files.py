"""Limits of model files, each just inside and just outside; what C++ libraries print stays out of the terminal."""

import os

import numpy as np
import pytest
from model_files import LINKS, mjcf, urdf

from ident.model.arm import load_arm
from ident.model.files import minimal_model, xml_tree
from ident.model.files import mjcf as mjcf_files
from ident.model.files.mjcf import STRONGEST_GRAVITY
from ident.model.files.xml_tree import FARTHEST, LARGEST, Element, direction, vector
from ident.support.captured_stderr import captured_stderr
from ident.support.errors import RobotModelError


def element(**attributes: str) -> Element:
    return Element("body", attributes, "robot model x: line 3")


def test_numbers_are_read_with_sign_exponent_and_any_white_space():
    assert vector(element(pos=" +1.5e-3\n-.25\t3. "), "pos", 3) == (1.5e-3, -0.25, 3.0)
    assert vector(element(), "pos", 3) is None


@pytest.mark.parametrize("word", ["1e", ".", "--1", "1.2.3", "0x1", "1_0", "nan", "-inf", "\uff11", "1e5e", "O.5"])
def test_what_is_no_number_is_named(word):
    with pytest.raises(RobotModelError, match=r"line 3: body: pos = .* is not a number"):
        vector(element(pos=f"2 3 {word}"), "pos", 3)


@pytest.mark.parametrize("sign", [1, -1])
def test_numbers_are_read_up_to_their_largest(sign):
    assert vector(element(pos=f"{sign * 2.5} 0.5"), "pos", 2, largest=2.5) == (sign * 2.5, 0.5)
    with pytest.raises(RobotModelError, match=r"beyond 2\.5; check the number"):
        vector(element(pos=f"0.5 {sign * 2.5000001}"), "pos", 2, largest=2.5)


def test_the_largest_numbers_are_those_of_an_arm(tmp_path):
    for inside, outside in (
        (mjcf(swap=("0 0 0.163", f"0 0 -{FARTHEST}")), mjcf(swap=("0 0 0.163", "0 0 -50.1"))),
        (mjcf(head=f'<option gravity="0 0 {STRONGEST_GRAVITY}"/>'), mjcf(head='<option gravity="0 0 100.1"/>')),
        (mjcf(swap=('euler="0 90 0"', f'euler="0 {LARGEST} 0"')), mjcf(swap=('euler="0 90 0"', 'euler="0 1000001 0"'))),
    ):
        (tmp_path / "arm.xml").write_text(inside)
        assert load_arm(tmp_path / "arm.xml").n == 6
        (tmp_path / "arm.xml").write_text(outside)
        with pytest.raises(RobotModelError, match=r"beyond .*; check the number"):
            load_arm(tmp_path / "arm.xml")


def test_a_direction_may_be_short_but_not_nothing():
    direction(element(axis="0 2e-6 0"), "axis")
    with pytest.raises(RobotModelError, match="axis = '0 5e-7 5e-7' has no direction"):
        direction(element(axis="0 5e-7 5e-7"), "axis")


def _nested(depth: int) -> str:
    return "<a>" * depth + "</a>" * depth


def test_elements_are_nested_up_to_the_limit(tmp_path):
    path = tmp_path / "x.xml"
    path.write_text(_nested(xml_tree.DEEPEST))
    assert xml_tree.read_xml(path).tag == "a"
    path.write_text(_nested(xml_tree.DEEPEST + 1))
    with pytest.raises(RobotModelError, match="line 1: elements are nested deeper than 200"):
        xml_tree.read_xml(path)


def test_elements_are_counted_up_to_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_tree, "MOST_ELEMENTS", 5)
    path = tmp_path / "x.xml"
    path.write_text("<a>" + "<b/>" * 4 + "</a>")
    assert len(xml_tree.read_xml(path).children) == 4
    path.write_text("<a>" + "<b/>" * 5 + "</a>")
    with pytest.raises(RobotModelError, match="more than 5 elements"):
        xml_tree.read_xml(path)


def test_the_links_of_a_urdf_are_counted_up_to_the_limit(tmp_path):
    links, joints = "<link name='l0'/>", ""
    for k in range(1, 1000):
        links += f"<link name='l{k}'/>"
        joints += f"<joint name='j{k}' type='fixed'><parent link='l{k - 1}'/><child link='l{k}'/></joint>"
    (tmp_path / "arm.urdf").write_text(f"<robot>{links}{joints}</robot>")
    assert minimal_model(tmp_path / "arm.urdf").text.count("<joint") == 999
    with pytest.raises(RobotModelError, match=r"arm\.urdf: robot arm: it has no moving joint"):
        load_arm(tmp_path / "arm.urdf")
    (tmp_path / "arm.urdf").write_text(f"<robot>{links}<link name='more'/>{joints}</robot>")
    with pytest.raises(RobotModelError, match="1001 links, expected 1 to 1000"):
        minimal_model(tmp_path / "arm.urdf")


def test_joints_are_counted_up_to_the_limit(tmp_path):
    for n in (24, 25):
        (tmp_path / f"{n}.xml").write_text(mjcf(links=[(f"l{k}", "0 0 0.1", "0 0 0", "0 1 0") for k in range(n)]))
    assert load_arm(tmp_path / "24.xml").n == 24
    with pytest.raises(RobotModelError, match="25 joints; arms of up to 24 are identified"):
        load_arm(tmp_path / "25.xml")


def test_a_joint_of_a_urdf_may_have_equal_limits_and_huge_ones(tmp_path):
    (tmp_path / "arm.urdf").write_text(urdf(swap=('lower="-2.97" upper="3.05"', 'lower="-1e16" upper="1e16"')))
    assert load_arm(tmp_path / "arm.urdf").upper[0] == np.inf
    (tmp_path / "arm.urdf").write_text(urdf(swap=('lower="-2.97" upper="3.05"', 'lower="0.5" upper="0.5"')))
    assert load_arm(tmp_path / "arm.urdf").n == 6
    (tmp_path / "arm.urdf").write_text(urdf(swap=(' effort="150" velocity="3.1"', "")))
    assert load_arm(tmp_path / "arm.urdf").upper[0] == 3.05


def test_files_are_included_up_to_their_largest_size_together(tmp_path, monkeypatch):
    (tmp_path / "arm.xml").write_text(mjcf())
    (tmp_path / "scene.xml").write_text('<mujoco><include file="arm.xml"/></mujoco>')
    size = sum(path.stat().st_size for path in tmp_path.iterdir())
    monkeypatch.setattr(mjcf_files, "LARGEST_FILE", size)
    assert load_arm(tmp_path / "scene.xml").n == 6
    monkeypatch.setattr(mjcf_files, "LARGEST_FILE", size - 1)
    with pytest.raises(RobotModelError, match="MB are included"):
        load_arm(tmp_path / "scene.xml")


def test_includes_do_not_hide_depth(tmp_path):
    for k in range(70):
        (tmp_path / f"{k}.xml").write_text(f'<mujoco><a><b><include file="{k + 1}.xml"/></b></a></mujoco>')
    with pytest.raises(
        RobotModelError, match=("elements, including those of included files, are nested deeper than 200")
    ):
        load_arm(tmp_path / "0.xml")


def test_an_arm_keeps_its_names_axes_and_places(tmp_path):
    (tmp_path / "arm.urdf").write_text(urdf())
    arm = load_arm(tmp_path / "arm.urdf")
    assert (arm.name, arm.joint_names) == ("ur", tuple(f"{link[0]}_joint" for link in LINKS))
    np.testing.assert_array_equal(arm.axis, [[float(x) for x in link[3].split()] for link in LINKS])
    np.testing.assert_array_equal(arm.translation, [[float(x) for x in link[1].split()] for link in LINKS])
    np.testing.assert_array_equal(arm.gravity, [0.0, 0.0, -9.81])


def test_names_with_signs_of_xml_come_through(tmp_path):
    text = mjcf().replace("elbow_joint", "a&lt;b&amp;&quot;c&quot;")
    (tmp_path / "arm.xml").write_text(text)
    assert load_arm(tmp_path / "arm.xml").joint_names[2] == 'a<b&"c"'


def test_what_a_library_prints_is_collected_and_the_terminal_is_given_back(capfd):
    with captured_stderr() as lines:
        os.write(2, b"Error: first\n\n  second\x07 \n")
        assert lines == []
    assert lines == ["Error: first", "second"]
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"


def test_the_terminal_is_given_back_after_an_error_too(capfd):
    with pytest.raises(RobotModelError, match="broken"), captured_stderr():
        raise RobotModelError("broken")
    os.write(2, b"after\n")
    assert capfd.readouterr().err == "after\n"


def test_a_reader_that_fails_names_its_last_printed_line(tmp_path, monkeypatch, capfd):
    def reader(_: str) -> None:
        os.write(2, b"Warning: this\nError: no such thing\n")
        raise ValueError("The model contains an error.")

    monkeypatch.setitem(load_arm.__globals__["READERS"], "urdf", reader)
    (tmp_path / "arm.urdf").write_text(urdf())
    with pytest.raises(RobotModelError, match=r"arm\.urdf: Pinocchio cannot read it: Error: no such thing$"):
        load_arm(tmp_path / "arm.urdf")
    assert capfd.readouterr().err == ""


LIMITED = [
    ("false", "", np.inf),
    ("false", 'limited="true"', 175.0),
    ("true", "", 175.0),
    ("true", 'limited="false"', np.inf),
]


@pytest.mark.parametrize(("autolimits", "limited", "upper"), LIMITED)
def test_a_range_limits_a_joint_where_the_file_says_so(tmp_path, autolimits, limited, upper):
    text = mjcf(head=f'<compiler autolimits="{autolimits}"/>').replace("range=", f"{limited} range=")
    (tmp_path / "arm.xml").write_text(text)
    np.testing.assert_allclose(load_arm(tmp_path / "arm.xml").upper, np.deg2rad(upper), rtol=1e-15)  # rounding


@pytest.mark.parametrize(
    ("name", "text", "line"),
    [
        ("arm.urdf", urdf(swap=("wrist_1_joint", "elbow_joint")), 5),
        ("arm.xml", mjcf(swap=("wrist_1_joint", "elbow_joint")), 6),
    ],
)
def test_the_first_of_two_elements_of_a_name_is_told_by_its_line_alone_wherever_the_file_lies(
    tmp_path, name, text, line
):
    folder = tmp_path / "cell: 4"
    folder.mkdir()
    (folder / name).write_text(text)
    with pytest.raises(RobotModelError, match=rf"'elbow_joint' appears twice; the first one is in line {line}$"):
        load_arm(folder / name)


def test_a_model_that_was_reduced_before_is_the_same_arm(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(mjcf())
    for name in ("once.xml", "twice.xml"):
        reduced = minimal_model(path).text
        path = tmp_path / name
        path.write_text(reduced)
    first, last = load_arm(tmp_path / "arm.xml"), load_arm(path)
    assert last.joint_names == first.joint_names
    for field in ("translation", "rotation", "axis", "lower", "upper"):
        # One more body around it, which neither turns nor moves.
        np.testing.assert_allclose(getattr(last, field), getattr(first, field), rtol=0, atol=1e-15)
