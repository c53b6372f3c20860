import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from bare_documents import bare_document
from model_files import INERTIAL, LINKS, RADIANS, ends, mjcf, urdf_joint, urdf_link
from printed import printed

from ident.model.regressor import regressor
from ident.model.structure import structure_of
from ident.parameters.arm import Quantity
from ident.parameters.links import nearest_links
from scenarios.cli import main
from scenarios.experiments.robots import nominal_links, read_arm
from scenarios.gains_in_use.model_patch import patched_model
from scenarios.results.bare import BareResult, Links
from scenarios.support.errors import ScenarioError

JOINTS = [f"{link[0]}_joint" for link in LINKS]
FRICTION = ("Fv", "Fc", "off")
INERTIAS = [(0.11 + 0.01 * k, 0.13, 0.09 + 0.02 * k, 0.012, -0.007, 0.005 * k) for k in range(6)]
MASSES = (7.1, 12.3, 4.2, 2.1, 1.9, 0.7)
ANCHORS = [[round(0.03 + 0.01 * k, 2), -0.02, round(0.05 - 0.02 * k, 2)] for k in range(6)]
RPY = "0.3 -0.2 0.5"


def lopsided_urdf() -> str:
    """A URDF whose third link has its inertia turned, and the fifth no origin; a tool is fixed to the last."""
    text, above = '<robot name="ur">\n<link name="base"/>\n', "base"
    for k, (name, pos, rpy, axis) in enumerate(LINKS):
        turned = f' rpy="{RPY}"' if k == 2 else ""
        origin = "" if k == 4 else f'<origin xyz="0.0{k + 1} -0.02 0.05"{turned}/>'
        place = f'<origin xyz="{pos}" rpy="{RADIANS[rpy]}"/><axis xyz="{axis}"/>'
        text += urdf_link(f"{name}_link", MASSES[k], INERTIAS[k], origin)
        text += urdf_joint(f"{name}_joint", "revolute", (above, f"{name}_link"), place, ends(-2.97, 3.05, 150, 3.1))
        above = f"{name}_link"
    text += urdf_link("tool", 0.31, (0.002, 0.003, 0.0025, 0, 0, 0), '<origin xyz="0 0.01 0.04"/>')
    place = '<origin xyz="0 0.02 0.09" rpy="0.1 0.4 0"/>'
    return f"{text}{urdf_joint('flange', 'fixed', (above, 'tool'), place)}</robot>\n"


def lopsided_mjcf() -> str:
    """An MJCF with anchors beside the bodies' origins, a link of a shape, one of principal moments, and a tool."""
    text = mjcf(head='<compiler angle="degree" autolimits="true" balanceinertia="true"/>')
    anchors = iter(ANCHORS)
    text = re.sub(' axis="', lambda _: f' pos="{" ".join(map(str, next(anchors)))}" axis="', text)
    head, tail = text.split('<body name="wrist_2_link"')
    tail = tail.replace(INERTIAL, '<geom type="box" size="0.05 0.07 0.11" mass="1.3" pos="0.02 0.01 0"/>', 1)
    tool = (
        '<body name="tool" pos="0 0.02 0.09" euler="10 20 0"><inertial pos="0 0.01 0.04" mass="0.31" '
        'diaginertia="0.002 0.003 0.0025"/></body></body></body></body>'
    )
    head = head.replace(INERTIAL, INERTIAL.replace("mass", 'quat="0.9 0.3 0.1 0" mass'), 3)
    return f'{head}<body name="wrist_2_link"' + tail.replace("</body></body></body>", tool, 1)


def told(cell: Path, model: str, **more: object) -> np.ndarray:
    """Write links of other base parameters, with motors, as identification prints them."""
    structure, nominal = structure_of(read_arm(cell / model, ())), nominal_links(cell / model, None)
    rng = np.random.default_rng(4)
    chi = np.zeros((6, 14))
    for j in range(6):
        chi[j, :10] = rng.uniform(0.8, 1.25) * nominal.own[j] + nominal.carried[j]
        chi[j, 10] = rng.uniform(0.1, 0.4)
    names = zip(structure.base.names, (structure.base.regrouping @ chi.ravel()).tolist(), strict=True)
    shown = [
        Quantity(name=k, unit="", value=v, residual_std=0.01)
        for k, v in names
        if k.rstrip("0123456789") not in FRICTION
    ]
    found = nearest_links(structure.base, shown, 1e-4 * np.eye(len(shown)), nominal)
    joints = [{"joint": j + 1, "name": name, "friction": []} for j, name in enumerate(JOINTS)]
    consistent = Links.of(found, nominal, structure.arm).model_dump(mode="json") | more
    document = bare_document(1, joints, [], consistent=consistent)
    (cell / "bare.json").write_text(json.dumps(document))
    return np.hstack((found.own + nominal.carried, found.motor[:, None], np.zeros((6, 3)))).ravel()


def edit(cell: Path, change) -> None:
    """Change what identification printed."""
    document = json.loads((cell / "bare.json").read_text())
    change(document)
    (cell / "bare.json").write_text(json.dumps(document))


@pytest.fixture(scope="module")
def motion() -> np.ndarray:
    return np.random.default_rng(9).uniform(-2.1, 1.9, (3, 7, 6))


@pytest.fixture
def cell(tmp_path):
    rows = (f'[[gains]]\njoint = {j + 1}\nname = "{n}"\nestimate = 9.5\nstd = 0.1' for j, n in enumerate(JOINTS))
    (tmp_path / "gains.toml").write_text("\n".join(rows))
    (tmp_path / "arm.urdf").write_text(lopsided_urdf())
    (tmp_path / "arm.xml").write_text(lopsided_mjcf())
    return tmp_path


def patched(cell: Path, model: str, *more: str) -> list[str]:
    given = ["--gains", str(cell / "gains.toml"), "--arm", str(cell / "bare.json"), "--links"]
    return ["patch", str(cell / model), *given, "--out", str(cell / f"patched{Path(model).suffix}"), *more]


def by_pinocchio(path: Path, motion: np.ndarray) -> np.ndarray:
    model = pin.buildModelFromUrdf(str(path))
    return np.array([pin.rnea(model, model.createData(), *state) for state in np.moveaxis(motion, 1, 0)])


def same(seen: object, expected: np.ndarray) -> None:
    # Numbers are written with all digits; MuJoCo diagonalises every inertia, to rounding.
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_pinocchio_finds_the_torques_of_the_set_in_a_patched_urdf(cell, motion):
    chi = told(cell, "arm.urdf")
    chi[10::14] = 0.0  # URDF has no attribute for motors
    assert main(patched(cell, "arm.urdf")) == 0
    expected = regressor(read_arm(cell / "arm.urdf", ()), *motion) @ chi
    same(by_pinocchio(cell / "patched.urdf", motion), expected)
    assert np.abs(by_pinocchio(cell / "arm.urdf", motion) - expected).max() > 0.02 * np.abs(expected).max()


def test_mujoco_finds_the_torques_of_the_set_in_a_patched_mjcf(cell, motion):
    chi = told(cell, "arm.xml")
    assert main(patched(cell, "arm.xml")) == 0
    model = mujoco.MjModel.from_xml_path(str(cell / "patched.xml"))
    model.jnt_limited[:] = 0
    data, seen = mujoco.MjData(model), []
    for data.qpos[:], data.qvel[:], data.qacc[:] in np.moveaxis(motion, 1, 0):
        mujoco.mj_inverse(model, data)
        seen.append(data.qfrc_inverse.copy())
    same(seen, regressor(read_arm(cell / "arm.xml", ()), *motion) @ chi)


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


def test_every_number_is_reported_before_and_after(cell, capsys):
    told(cell, "arm.xml")
    edit(cell, lambda document: document["consistent"]["links"][3].update(motor_found=False))
    main(patched(cell, "arm.xml", "--json"))
    changes = {(each["joint"], each["attribute"]): each for each in printed(capsys, "patch")["changes"]}
    for joint, attribute, before in (
        ("wrist_2", "mass", None),
        ("elbow", "mass", "2.5"),
        ("elbow", "pos", "0 0 0.1"),
        ("elbow", "fullinertia", "diaginertia 0.02 0.03 0.04"),
        ("shoulder_lift", "fullinertia", "quat 0.9 0.3 0.1 0 diaginertia 0.02 0.03 0.04"),
    ):
        assert changes[f"{joint}_joint", f"inertial {attribute}"]["before"] == before
    motors = [joint for joint, attribute in changes if attribute == "armature"]
    assert motors == [name for name in JOINTS if name != JOINTS[3]]  # data do not determine that one
    assert float(changes["elbow_joint", "armature"]["after"]) > 0.05


@pytest.mark.parametrize(
    ("model", "change", "message"),
    [
        ("arm.urdf", {"farthest_deviations": 3.9, "farthest_parameter": "MX3"}, None),
        ("arm.urdf", {"farthest_deviations": 4.1, "farthest_parameter": "MX3"}, r"MX3 .* 4\.1 standard deviations"),
        ("arm.urdf", None, "gains are unknown"),
        ("arm.urdf", ("0 -0.131 0.613", "0 -0.131 0.614"), "another frame for joint elbow_joint"),
        ("arm.urdf", ('value="0.31"', 'value="0.32"'), "another frame for joint wrist_3_joint, or other bodies"),
        ("arm.xml", ("<compiler", '<compiler boundmass="0.1"/><compiler'), "boundmass = '0.1'"),
        ("arm.xml", ("<compiler", '<compiler inertiafromgeom="true"/><compiler'), "inertiafromgeom = 'true'"),
    ],
)
def test_a_set_that_cannot_be_written_is_refused(cell, capsys, model, change, message):
    told(cell, model, **(change if isinstance(change, dict) else {}))
    if change is None:
        edit(cell, lambda document: document.update(consistent=None, consistent_reason="gains are unknown"))
    if isinstance(change, tuple):
        text = (cell / model).read_text()
        assert change[0] in text
        (cell / model).write_text(text.replace(*change, 1))
    assert main(patched(cell, model)) == (0 if message is None else 2)
    assert re.search(message or "", capsys.readouterr().err)
    assert (cell / f"patched{Path(model).suffix}").exists() is (message is None)


def test_links_that_were_found_with_other_gains_are_refused(cell, capsys):
    told(cell, "arm.urdf")
    for gain, status in ((9.5, 0), (9.5 * (1.0 + 1e-9), 0), (8.3, 2), (11.4, 2)):
        edit(cell, lambda document: document["joints"][2].update(gain=gain))  # noqa: B023
        assert main(patched(cell, "arm.urdf")) == status
    assert "a gain of 11.4 on joint 3, but --gains has 9.5" in capsys.readouterr().err
    friction = [word for word in patched(cell, "arm.urdf") if word != "--links"]
    assert main(friction) == 0  # it is in drive units, whatever the gains


def test_a_total_mass_is_refused(tmp_path):
    (tmp_path / "arm.xml").write_text('<mujoco><compiler angle="degree"/><compiler settotalmass="20"/></mujoco>')
    with pytest.raises(ScenarioError, match="settotalmass = '20'"):
        patched_model(tmp_path / "arm.xml", {}, [])


def test_a_link_of_an_included_file_is_refused(cell):
    told(cell, "arm.xml")
    links = BareResult.model_validate_json((cell / "bare.json").read_bytes()).consistent
    assert links is not None
    (cell / "scene.xml").write_text('<mujoco><include file="arm.xml"/><worldbody/></mujoco>')
    with pytest.raises(ScenarioError, match="joint shoulder_pan_joint: the file has no joint of this name"):
        patched_model(cell / "scene.xml", {}, links.links)
