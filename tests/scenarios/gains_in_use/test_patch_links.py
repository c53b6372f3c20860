"""`rx90 patch --links`: torques of the patched model against those of the set, by Pinocchio and by MuJoCo."""

import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from model_files import LINKS, mjcf

from ident.arm_parameters.links import FoundLinks, ModelLinks, nearest_links
from ident.arm_parameters.parameter_values import Parameter
from ident.model.regressor import regressor
from ident.model.structure import Structure, structure_of
from ident.payload.payload import standard_parameters
from ident.payload_identification.payload_body import body_values
from scenarios.cli import main
from scenarios.experiments.nominal_links import nominal_links
from scenarios.experiments.robot_models import read_arm
from scenarios.gains_in_use.model_patch import patched_model
from scenarios.gains_in_use.model_values import BareFile
from scenarios.results.links import links_document
from scenarios.support.errors import ScenarioError

JOINTS = [f"{link[0]}_joint" for link in LINKS]
FRICTION = ("Fv", "Fc", "off")
INERTIAS = [(0.11 + 0.01 * k, 0.13, 0.09 + 0.02 * k, 0.012, -0.007, 0.005 * k) for k in range(6)]
MASSES = (7.1, 12.3, 4.2, 2.1, 1.9, 0.7)
ANCHORS = [[round(0.03 + 0.01 * k, 2), -0.02, round(0.05 - 0.02 * k, 2)] for k in range(6)]
RPY = "0.3 -0.2 0.5"


def lopsided_urdf() -> str:
    """A URDF of which the third link has its inertia turned, and the fifth no origin; a tool is fixed to the last."""
    links, above = '<link name="base"/>', "base"
    for k, (name, pos, rpy, axis) in enumerate(LINKS):
        keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        moments = " ".join(f'{key}="{value}"' for key, value in zip(keys, INERTIAS[k], strict=True))
        turned = f' rpy="{RPY}"' if k == 2 else ""
        origin = "" if k == 4 else f'<origin xyz="0.0{k + 1} -0.02 0.05"{turned}/>'
        radians = rpy.replace("90", "1.5707963267948966")
        links += (
            f'\n<link name="{name}_link">\n  <inertial>{origin}<mass value="{MASSES[k]}"/><inertia {moments}/>'
            f'</inertial>\n</link><joint name="{name}_joint" type="revolute"><parent link="{above}"/>'
            f'<child link="{name}_link"/><origin xyz="{pos}" rpy="{radians}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.97" upper="3.05" effort="150" velocity="3.1"/></joint>'
        )
        above = f"{name}_link"
    tool = (
        '<link name="tool"><inertial><origin xyz="0 0.01 0.04"/><mass value="0.31"/><inertia ixx="0.002" iyy="0.003" '
        'izz="0.0025" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="flange" type="fixed"><parent '
        f'link="{above}"/><child link="tool"/><origin xyz="0 0.02 0.09" rpy="0.1 0.4 0"/></joint>'
    )
    return f'<robot name="ur">\n{links}\n{tool}</robot>\n'


def lopsided_mjcf() -> str:
    """An MJCF with anchors beside the bodies' origins, a link of a shape, one of principal moments, and a tool."""
    text = mjcf(head='<compiler angle="degree" autolimits="true" balanceinertia="true"/>')
    anchors = iter(ANCHORS)
    text = re.sub(' axis="', lambda _: f' pos="{" ".join(map(str, next(anchors)))}" axis="', text)
    shape = '<geom type="box" size="0.05 0.07 0.11" mass="1.3" pos="0.02 0.01 0"/>'
    inertial = '<inertial pos="0 0 0.1" mass="2.5" diaginertia="0.02 0.03 0.04"/>'
    head, tail = text.split('<body name="wrist_2_link"')
    tail = tail.replace(inertial, shape, 1)
    tool = (
        '<body name="tool" pos="0 0.02 0.09" euler="10 20 0"><inertial pos="0 0.01 0.04" mass="0.31" '
        'diaginertia="0.002 0.003 0.0025"/></body></body></body></body>'
    )
    head = head.replace(inertial, inertial.replace("mass", 'quat="0.9 0.3 0.1 0" mass'), 3)
    return f'{head}<body name="wrist_2_link"' + tail.replace("</body></body></body>", tool, 1)


def identified(path: Path) -> tuple[Structure, ModelLinks, FoundLinks]:
    """A set from base parameters that are those of other links, with motors."""
    structure, nominal = structure_of(read_arm(path, ())), nominal_links(path, None)
    rng = np.random.default_rng(4)
    chi = np.zeros(14 * 6)
    for j in range(6):
        chi[14 * j : 14 * j + 10] = rng.uniform(0.8, 1.25) * nominal.own[j] + nominal.carried[j]
        chi[14 * j + 10] = rng.uniform(0.1, 0.4)
    b = structure.base.regrouping @ chi
    names = zip(structure.base.names, b.tolist(), strict=True)
    shown = [Parameter(name=k, unit="", value=v, std=0.01) for k, v in names if k.rstrip("0123456789") not in FRICTION]
    return structure, nominal, nearest_links(structure.base, shown, 1e-4 * np.eye(len(shown)), nominal)


def torques(
    structure: Structure, nominal: ModelLinks, found: FoundLinks, motion: np.ndarray, motors: bool
) -> np.ndarray:
    """What the set says, by the regressor."""
    chi = np.zeros(14 * 6)
    for j in range(6):
        chi[14 * j : 14 * j + 10] = found.own[j] + nominal.carried[j]
        chi[14 * j + 10] = found.motor[j] if motors else 0.0
    return regressor(structure.arm, *motion) @ chi


@pytest.fixture(scope="module")
def motion() -> np.ndarray:
    return np.random.default_rng(9).uniform(-2.1, 1.9, (3, 7, 6))


@pytest.fixture
def cell(tmp_path):
    gains = "\n".join(
        f'[[gains]]\njoint = {j + 1}\nname = "{n}"\nestimate = 9.5\nstd = 0.1' for j, n in enumerate(JOINTS)
    )
    (tmp_path / "gains.toml").write_text(gains)
    (tmp_path / "arm.urdf").write_text(lopsided_urdf())
    (tmp_path / "arm.xml").write_text(lopsided_mjcf())
    return tmp_path


def told(cell: Path, model: str, **more: object) -> tuple[Structure, ModelLinks, FoundLinks]:
    """The set in a file as identification prints it."""
    structure, nominal, found = identified(cell / model)
    joints = [{"joint": j + 1, "name": name, "friction": []} for j, name in enumerate(JOINTS)]
    consistent = links_document(found, nominal, structure.arm).model_dump(mode="json") | more
    document = {"reference": 1, "joints": joints, "base_parameters": [], "consistent": consistent}
    (cell / "bare.json").write_text(json.dumps(document))
    return structure, nominal, found


def patched(cell: Path, model: str, *more: str) -> list[str]:
    given = ["--gains", str(cell / "gains.toml"), "--arm", str(cell / "bare.json"), "--links"]
    return ["patch", str(cell / model), *given, "--out", str(cell / f"patched{Path(model).suffix}"), *more]


def test_pinocchio_finds_the_torques_of_the_set_in_a_patched_urdf(cell, motion):
    set_of = told(cell, "arm.urdf")
    assert main(patched(cell, "arm.urdf")) == 0
    model = pin.buildModelFromUrdf(str(cell / "patched.urdf"))
    data = model.createData()
    expected = torques(*set_of, motion, motors=False)  # URDF has no place for them
    seen = np.array([pin.rnea(model, data, *state) for state in np.moveaxis(motion, 1, 0)])
    # Numbers are written with all digits.
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    before = pin.buildModelFromUrdf(str(cell / "arm.urdf"))
    old = np.array([pin.rnea(before, before.createData(), *state) for state in np.moveaxis(motion, 1, 0)])
    assert np.abs(old - expected).max() > 0.02 * np.abs(expected).max()


def test_mujoco_finds_the_torques_of_the_set_in_a_patched_mjcf(cell, motion):
    set_of = told(cell, "arm.xml")
    assert main(patched(cell, "arm.xml")) == 0
    model = mujoco.MjModel.from_xml_path(str(cell / "patched.xml"))
    model.jnt_limited[:] = 0
    data, seen = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in np.moveaxis(motion, 1, 0):
        mujoco.mj_inverse(model, data)
        seen.append(data.qfrc_inverse.copy())
    expected = torques(*set_of, motion, motors=True)
    # MuJoCo diagonalises every inertia, to rounding.
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_the_rest_of_the_file_stays_and_a_comment_says_what_the_links_are(cell):
    told(cell, "arm.urdf")
    main(patched(cell, "arm.urdf"))
    before, after = ((cell / name).read_text() for name in ("arm.urdf", "patched.urdf"))
    assert after.count("Data determine only the base parameters") == 1
    assert 'rpy="0.1 0.4 0"' in after  # the tool's stays
    assert f'rpy="{RPY}"' not in after
    assert '<mass value="0.31"/>' in after

    def stripped(text):
        text = re.sub(r"\s*<!--.*?-->", "", text, flags=re.DOTALL)
        return re.sub(r"<inertial>.*?</inertial>", "", text, flags=re.DOTALL)

    assert stripped(before) == stripped(after)


def test_every_number_is_told_before_and_after(cell, capsys):
    told(cell, "arm.xml")
    main(patched(cell, "arm.xml", "--json"))
    changes = json.loads(capsys.readouterr().out)["changes"]
    of_shape = {each["attribute"]: each for each in changes if each["joint"] == "wrist_2_joint"}
    assert of_shape["inertial mass"]["before"] is None
    third = {each["attribute"]: each for each in changes if each["joint"] == "elbow_joint"}
    assert third["inertial mass"]["before"] == "2.5"
    assert third["inertial pos"]["before"] == "0 0 0.1"
    assert "diaginertia 0.02 0.03 0.04" in third["inertial fullinertia"]["before"]
    (turned,) = (e for e in changes if e["joint"] == "shoulder_lift_joint" and e["attribute"] == "inertial fullinertia")
    assert turned["before"] == "quat 0.9 0.3 0.1 0 diaginertia 0.02 0.03 0.04"
    assert float(third["armature"]["after"]) > 0.05
    assert [each["attribute"] for each in changes].count("armature") == 6  # told once a joint


def test_a_motor_that_data_do_not_show_stays_and_a_set_near_to_the_data_is_taken(cell, capsys):
    told(cell, "arm.xml", farthest_deviations=3.9, farthest_parameter="MX3")
    document = json.loads((cell / "bare.json").read_text())
    document["consistent"]["links"][2]["motor_found"] = False
    (cell / "bare.json").write_text(json.dumps(document))
    assert main(patched(cell, "arm.xml", "--json")) == 0
    changes = json.loads(capsys.readouterr().out)["changes"]
    motors = [each["joint"] for each in changes if each["attribute"] == "armature"]
    assert motors == [name for name in JOINTS if name != JOINTS[2]]


def test_without_being_asked_links_stay(cell):
    told(cell, "arm.urdf")
    words = [word for word in patched(cell, "arm.urdf") if word != "--links"]
    assert main(words) == 0
    assert (cell / "patched.urdf").read_bytes() == (cell / "arm.urdf").read_bytes()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            {"farthest_deviations": 4.1, "farthest_parameter": "MX3"},
            "base parameter MX3 of physically consistent links differs by 4.1 standard deviations",
        ),
        ({}, "no physically consistent set: gains are unknown"),
    ],
)
def test_a_set_that_data_contradict_or_that_is_none_is_refused(cell, capsys, more, said):
    told(cell, "arm.urdf", **more)
    if not more:
        document = json.loads((cell / "bare.json").read_text())
        (cell / "bare.json").write_text(
            json.dumps({**document, "consistent": None, "consistent_reason": "gains are unknown"})
        )
    assert main(patched(cell, "arm.urdf")) == 2
    assert said in capsys.readouterr().err
    assert not (cell / "patched.urdf").exists()


def test_links_that_were_found_with_other_gains_are_refused(cell, capsys):
    told(cell, "arm.urdf")
    document = json.loads((cell / "bare.json").read_text())
    for gain, status in ((9.5, 0), (9.5 * (1.0 + 1e-9), 0), (8.3, 2), (11.4, 2)):
        document["joints"][2]["gain"] = gain
        (cell / "bare.json").write_text(json.dumps(document))
        assert main(patched(cell, "arm.urdf")) == status
    said = "--links: --arm was identified with a gain of 11.4 on joint 3, but --gains has 9.5; identify the bare"
    assert said in capsys.readouterr().err
    friction = [word for word in patched(cell, "arm.urdf") if word != "--links"]
    assert main(friction) == 0  # it is in drive units, whatever the gains


@pytest.mark.parametrize("swap", [("0 -0.131 0.613", "0 -0.131 0.614"), ('value="0.31"', 'value="0.32"')])
def test_a_model_of_other_frames_or_with_another_tool_is_refused(cell, capsys, swap):
    told(cell, "arm.urdf")
    text = (cell / "arm.urdf").read_text()
    assert swap[0] in text
    (cell / "arm.urdf").write_text(text.replace(*swap))
    assert main(patched(cell, "arm.urdf")) == 2
    assert "identify them with this file" in capsys.readouterr().err


@pytest.mark.parametrize("setting", ['settotalmass="20"', 'boundmass="0.1"', 'inertiafromgeom="true"'])
def test_a_compiler_that_changes_masses_is_refused(setting, tmp_path):
    content = f'<mujoco><compiler angle="degree"/><compiler {setting} boundinertia="0"/></mujoco>'.encode()
    (tmp_path / "arm.xml").write_bytes(content)
    with pytest.raises(ScenarioError, match=f"compiler {setting[:8]}"):
        patched_model(tmp_path / "arm.xml", [], [])


def test_a_link_of_an_included_file_is_refused(cell):
    told(cell, "arm.xml")
    links = BareFile.model_validate_json((cell / "bare.json").read_bytes()).consistent
    assert links is not None
    (cell / "scene.xml").write_text('<mujoco><include file="arm.xml"/><worldbody/></mujoco>')
    with pytest.raises(ScenarioError, match="joint shoulder_pan_joint: the file has no joint of this name"):
        patched_model(cell / "scene.xml", [], links.links)


def test_links_as_drawn_have_the_torques_of_the_file(cell, motion):
    for name in ("arm.urdf", "arm.xml"):
        nominal, arm = nominal_links(cell / name, None), read_arm(cell / name, ())
        chi = np.hstack((nominal.own + nominal.carried, nominal.motor[:, None], np.zeros((6, 3)))).ravel()
        if name.endswith("urdf"):
            model = pin.buildModelFromUrdf(str(cell / name))
            seen = np.array([pin.rnea(model, model.createData(), *state) for state in np.moveaxis(motion, 1, 0)])
            expected = regressor(arm, *motion) @ chi
            np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())  # rounding
        assert nominal.carried[5, 9] == 0.31
        assert not nominal.carried[:5].any()
    np.testing.assert_array_equal(nominal.offset, ANCHORS)


def test_body_values_and_standard_parameters_are_each_others_inverse():
    chi = standard_parameters(2.3, (0.1, -0.2, 0.05), (0.31, 0.27, 0.19, 0.04, -0.03, 0.02))
    values = body_values(chi)
    np.testing.assert_allclose(standard_parameters(values[0], values[1:4], values[4:]), chi, rtol=1e-12)  # rounding
