import json
import xml.etree.ElementTree as ET
from pathlib import Path

import bare_documents
import mujoco
import numpy as np
import pytest
import yaml
from bad_files import refused
from model_files import LINKS, mjcf, urdf
from printed import printed

from ident.model.structure import structure_of
from scenarios.cli import main
from scenarios.experiments.robots import read_arm
from scenarios.gains_in_use.patch import joint_values, unstated_parameters
from scenarios.results.bare import BareResult
from scenarios.results.gains_file import GainEntry, GainsFile, read_gains

JOINTS = [f"{link[0]}_joint" for link in LINKS]
GAIN = {0: 11.9, 1: 11.6, 2: -9.8, 3: 10.3, 4: 9.1}
OLD = {0: 12.5, 1: 12.5, 2: 10.4, 3: 9.6, 4: 9.5}
FV = [1.82, 1.86, -0.97, 0.35, 0.34, 0.33]
FC = [1.71, 1.64, -0.93, 0.37, 0.31, 0.29]
IA = {3: 0.085, 4: 0.034, 5: 0.033, 6: 0.031}
"""Over the gain of the reference."""
SIX = 1e-5  # numbers are written with six digits
CLASSES = """<default><joint damping="0.7" frictionloss="0.2"/><general forcerange="-7 8"/>
<default class="wrist"><joint armature="0.3" frictionloss="0.4"/><motor ctrlrange="-21 22"/></default></default>"""
TAIL = """<actuator>
<general name="a" joint="shoulder_pan_joint"/> <!-- kept, José -->
<position name="b" joint="elbow_joint" forcerange="-150  149.5" kp="100"/>
<motor name="c" class="wrist" joint="wrist_1_joint" gear="2"/>
<motor name="d" joint="wrist_2_joint"/>
</actuator>"""
TRANSMISSION = '<transmission name="t"><joint name="elbow_joint"><limit effort="3"/></joint></transmission>'


def gains_text(values: dict[int, float]) -> str:
    lines = list[str]()
    for j, name in enumerate(JOINTS):
        known = f"estimate = {values[j]}\nstd = 0.1" if j in values else 'identifiable = false\nreason = "no\\nload"'
        lines.append(f'[[gains]]\njoint = {j + 1}\nname = "{name}"\n{known}\n')
    return "\n".join(lines)


def bare_document(**more: object) -> dict:
    def found(name: str, value: float, rel: float = 0.01) -> dict:
        return {"parameter": name, "unit": "units", "estimate": value, "std": abs(rel * value)}

    joints = [
        {"joint": j + 1, "name": name, "friction": [found("Fv", FV[j]), found("Fc", FC[j]), found("off", 0.1, 3.0)]}
        for j, name in enumerate(JOINTS)
    ]
    joints[3]["friction"][0] = found("Fv", FV[3], 0.2)
    joints[4]["friction"].insert(0, found("cbrt", 0.1))
    base = [found("ZZ1", 0.9), *(found(f"Ia{j}", value) for j, value in IA.items())]
    return bare_documents.bare_document(**{"reference": 4, "joints": joints, "base_parameters": base, **more})


@pytest.fixture
def cell(tmp_path) -> Path:
    """Models with comments, gains of the arm and of a data sheet, and the result of bare motions."""
    (tmp_path / "gains.toml").write_text(gains_text(GAIN))
    (tmp_path / "sheet.toml").write_text(gains_text(OLD))
    (tmp_path / "bare.json").write_text(json.dumps(bare_document()))
    (tmp_path / "arm.urdf").write_text("<!-- who wrote this -->\n" + urdf(more=TRANSMISSION))
    swap = 'name="wrist_2_link"', 'name="wrist_2_link" childclass="wrist"'
    text = mjcf(head=f'<compiler angle="degree"/>\n{CLASSES}', tail=TAIL, swap=swap)
    (tmp_path / "arm.xml").write_text(f"<!-- who wrote this -->\n{text}")
    return tmp_path


def words(cell: Path, model: str, *more: str, arm: bool = True) -> list[str]:
    known = ["--arm", str(cell / "bare.json")] if arm else []
    out = str(cell / f"patched{Path(model).suffix}")
    return ["patch", str(cell / model), "--gains", str(cell / "gains.toml"), *known, "--out", out, *more]


def changes(capsys, cell: Path, model: str, *more: str, arm: bool = True) -> dict[tuple[str, str], dict]:
    assert main(words(cell, model, *more, "--json", arm=arm)) == 0
    return {(each["joint"], each["attribute"]): each for each in printed(capsys, "patch")["changes"]}


def sheet(cell: Path) -> tuple[str, str]:
    return "--nominal", str(cell / "sheet.toml")


def test_a_joint_has_the_attributes_of_its_class_and_of_those_around_it(cell, capsys):
    text = (cell / "arm.xml").read_text().replace('name="wrist_3_link"', 'name="wrist_3_link" childclass="last"')
    inner = '<default class="last"><joint damping="0.9"/></default></default></default>'
    (cell / "arm.xml").write_text(text.replace("</default></default>", inner))
    told = changes(capsys, cell, "arm.xml")
    before = [told[JOINTS[5], name]["before"] for name in ("damping", "frictionloss", "armature")]
    assert before == ["0.9", "0.4", "0.3"]


def test_a_urdf_has_efforts_scaled_and_friction_in_newton_metres(cell, capsys):
    told = changes(capsys, cell, "arm.urdf", *sheet(cell))
    joints = {each.get("name"): each for each in ET.parse(cell / "patched.urdf").getroot().findall("joint")}
    for j, name in enumerate(JOINTS):
        effort = float(joints[name].find("limit").get("effort"))
        dynamics = joints[name].find("dynamics")
        np.testing.assert_allclose(effort, 150.0 * abs(GAIN[j] / OLD[j]) if j in GAIN else 150.0, rtol=SIX)
        if j not in GAIN:
            assert dynamics is None
            continue
        np.testing.assert_allclose(float(dynamics.get("friction")), GAIN[j] * FC[j], rtol=SIX)
        if j in (3, 4):  # a deviation of a fifth; a law that is no straight line
            assert dynamics.get("damping") is None
        else:
            np.testing.assert_allclose(float(dynamics.get("damping")), GAIN[j] * FV[j], rtol=SIX)
    # Relative deviations: of a gain alone; of a product.
    np.testing.assert_allclose(told[JOINTS[0], "effort"]["rel_std"], 0.1 / 11.9, rtol=1e-12)
    np.testing.assert_allclose(told[JOINTS[0], "friction"]["rel_std"], np.hypot(0.01, 0.1 / 11.9), rtol=1e-12)


def canonical(path: Path, **more: object) -> str:
    return ET.canonicalize(path.read_text(), with_comments=True, **more)


def test_all_else_of_a_model_stays(cell):
    urdf_more = {"exclude_tags": ["dynamics"], "exclude_attrs": ["effort"]}
    mjcf_more = {"exclude_attrs": ["damping", "frictionloss", "armature", "forcerange", "ctrlrange"]}
    for model, more in (("arm.urdf", urdf_more), ("arm.xml", mjcf_more)):
        assert main(words(cell, model, *sheet(cell))) == 0
        copy = cell / f"patched{Path(model).suffix}"
        assert canonical(copy, **more) == canonical(cell / model, **more)
        lines = zip(*(path.read_text().replace(" >", ">").splitlines() for path in (cell / model, copy)), strict=True)
        assert all(a == b or any(name in b for name in ("effort", *mjcf_more["exclude_attrs"])) for a, b in lines)
        assert main(words(cell, model, arm=False)) == 0
        assert canonical(copy) == canonical(cell / model)


def test_an_mjcf_is_patched_where_its_classes_would_say_something_else(cell, capsys):
    told = changes(capsys, cell, "arm.xml", *sheet(cell))
    model, before = (mujoco.MjModel.from_xml_path(str(cell / f"{name}.xml")) for name in ("patched", "arm"))
    damping, old_damping = (np.reshape(each.dof_damping, (6, -1))[:, 0] for each in (model, before))
    ratio = [abs(GAIN[j] / OLD[j]) if j in GAIN else 1.0 for j in range(6)]
    for j, name in enumerate(JOINTS):
        friction = GAIN[j] * FC[j] if j in GAIN else before.dof_frictionloss[j]
        np.testing.assert_allclose(model.dof_frictionloss[j], friction, rtol=SIX)
        np.testing.assert_allclose(damping[j], GAIN[j] * FV[j] if j in (0, 1, 2) else old_damping[j], rtol=SIX)
        rotor = GAIN[3] * IA.get(j + 1, 0.0) if j > 1 else before.dof_armature[j]
        np.testing.assert_allclose(model.dof_armature[j], rotor, rtol=SIX)
        for attribute, old in (
            ("damping", old_damping[j]),
            ("frictionloss", before.dof_frictionloss[j]),
            ("armature", before.dof_armature[j]),
        ):
            assert float(told[name, attribute]["before"] or 0.0) == old
    assert "regrouped" in told[JOINTS[0], "armature"]["reason"]
    np.testing.assert_allclose(told[JOINTS[3], "armature"]["rel_std"], np.hypot(0.01, 0.1 / 10.3), rtol=1e-12)
    for k, (low, high, j) in enumerate([(-7.0, 8.0, 0), (-150.0, 149.5, 2), (-7.0, 8.0, 3)]):
        np.testing.assert_allclose(model.actuator_forcerange[k], ratio[j] * np.array([low, high]), rtol=SIX)
    np.testing.assert_allclose(model.actuator_ctrlrange[2], ratio[3] * np.array([-21.0, 22.0]), rtol=SIX)
    assert not model.actuator_ctrllimited[3]  # an actuator is not of its joint's class


def test_a_joint_of_an_included_file_stays(cell, capsys):
    (cell / "scene.xml").write_text('<mujoco><include file="arm.xml"/></mujoco>')
    told = changes(capsys, cell, "scene.xml")
    assert [key for key in told] == [(name, "joint") for name in JOINTS]
    assert all("included file" in each["reason"] for each in told.values())
    assert canonical(cell / "patched.xml") == canonical(cell / "scene.xml")


def test_a_number_that_is_uncertain_negative_or_missing_stays_with_the_reason(cell, capsys):
    document = bare_document()
    friction = [each["friction"] for each in document["joints"]]
    friction[0][0]["std"] = 0.12 * friction[0][0]["estimate"]
    friction[1][0]["std"] = 12.7 * friction[1][0]["estimate"]
    friction[2][0]["parameter"] = "Fv in motion 1"
    friction[0][1]["estimate"] *= -1.0
    (cell / "bare.json").write_text(json.dumps(document))
    text = (cell / "arm.urdf").read_text().replace('effort="150"', 'effort="0.0"', 1)
    (cell / "arm.urdf").write_text(text.replace('effort="150" ', "", 1))
    told = changes(capsys, cell, "arm.urdf", *sheet(cell))
    for joint, attribute, reason in (
        (0, "effort", "a limit of 0 is no limit"),
        (1, "effort", "the model states no limit"),
        (0, "damping", "deviation of 12 %, more than 10 %"),
        (1, "damping", "deviation of 1270 %, more than 10 %"),
        (2, "damping", "differs between motions"),
        (4, "damping", "not linear in speed (cbrt)"),
        (0, "friction", "identified as -20.3, not positive"),
        (5, "friction", "the gain of joint 6 is refused"),
        (2, "armature", "URDF has no such attribute; found 0.8755"),
    ):
        assert reason in told[JOINTS[joint], attribute]["reason"], told[JOINTS[joint], attribute]
    told = changes(capsys, cell, "arm.urdf", "--max-rel-std", "0.25")
    np.testing.assert_allclose(float(told[JOINTS[3], "damping"]["after"]), GAIN[3] * FV[3], rtol=SIX)


def test_dynamics_that_exist_change_and_keep_the_rest(cell):
    child = '<child link="shoulder_pan_link"/>'
    text = (cell / "arm.urdf").read_text().replace(child, child + '\n<dynamics damping="9" own="x"/>\n', 1)
    (cell / "arm.urdf").write_text(text)
    assert main(words(cell, "arm.urdf")) == 0
    after = (cell / "patched.urdf").read_text()
    assert f'\n<dynamics damping="{GAIN[0] * FV[0]:.6g}" own="x" friction="{GAIN[0] * FC[0]:.6g}"/>\n' in after


def test_torque_constants_are_written_by_joint(cell):
    assert main(words(cell, "arm.urdf", *sheet(cell), "--ros-params", str(cell / "gains.yaml"))) == 0
    text = (cell / "gains.yaml").read_text()
    told = yaml.safe_load(text)["/**"]["ros__parameters"]
    assert told["torque_constants"] == {JOINTS[j]: value for j, value in GAIN.items()}
    assert told["torque_constant_deviations"] == {JOINTS[j]: 0.1 for j in GAIN}
    efforts = {name: each["max_effort"] for name, each in told["joint_limits"].items()}
    assert efforts == pytest.approx({JOINTS[j]: 150.0 * abs(GAIN[j] / OLD[j]) for j in GAIN}, rel=SIX)
    assert '# "wrist_3_joint": no load' in text


@pytest.mark.parametrize(
    ("more", "match"),
    [
        (["--out", "x.xml"], "ends in .urdf"),
        (["--ros-params", "patched.urdf"], "expected different files"),
        (["--arm", "hip.json"], "bare motions of joints hip_joint"),
        (["--arm", "seven.json"], "reference = 7"),
        (["--arm", "none.json"], "none.json: not what `rx90 identify --model ROBOT --unloaded A --json` prints of"),
        (["--nominal", "thousands.toml"], "--nominal: joint 3: "),
        (["--gains", "knee.toml"], "joint 3 is knee_joint"),
        (["--max-rel-std", "0"], "expected 1e-06 to 1"),
        (["rx90"], "robot model rx90: expected a .urdf, .xml or .mjcf file"),
    ],
)
def test_a_contradiction_is_one_line(cell, more, match, capsys, monkeypatch):
    monkeypatch.chdir(cell)
    Path("knee.toml").write_text(gains_text(OLD).replace("elbow_joint", "knee_joint"))
    Path("thousands.toml").write_text(gains_text({**OLD, 2: 1000.0 * OLD[2]}))
    document = bare_document(reference=7)
    Path("seven.json").write_text(json.dumps(document))
    Path("none.json").write_text(json.dumps({**document, "joints": 3}))
    document["joints"][0]["name"] = "hip_joint"
    Path("hip.json").write_text(json.dumps(document))
    before = Path("arm.urdf").read_bytes()
    options = {"--gains": "gains.toml", "--arm": "bare.json", "--out": "patched.urdf"}
    model = more.pop() if len(more) == 1 else "arm.urdf"
    options |= dict(zip(more[::2], more[1::2], strict=True))
    assert match in refused(capsys, ["patch", model, *(word for pair in options.items() for word in pair)])
    assert not Path("patched.urdf").exists()
    assert Path("arm.urdf").read_bytes() == before


def test_what_a_model_does_not_state_is_in_si_with_its_deviations(cell):
    structure, gains = structure_of(read_arm(cell / "arm.xml", ())), read_gains(cell / "gains.toml")
    names = structure.base.names
    stated = np.where(np.array(names) == "Ia4", 0.05, 0.0)
    motor = np.where(np.arange(6) == 4, 0.02, 0.0)  # that of joint 5 is stated
    found, C = unstated_parameters(structure, gains, BareResult.model_validate(bare_document()), stated, motor)
    value, std = (dict(zip(names, each.tolist(), strict=True)) for each in (found, np.sqrt(np.diag(C))))
    unit = GAIN[3]  # that of the reference
    np.testing.assert_allclose([value[f"Ia{j}"] for j in (3, 4, 5)], [unit * IA[3], unit * IA[4] - 0.05, 0.0])
    np.testing.assert_allclose([std[f"Ia{j}"] for j in (3, 4, 5)], [0.01 * unit * IA[3], 0.01 * unit * IA[4], 0.0])
    np.testing.assert_allclose([value[f"off{j}"] for j in (3, 6)], [0.1 * GAIN[2], 0.0])  # joint 6 has no gain


TWO = """<mujoco><worldbody><body name="one"><joint name="x" {}/><inertial pos="0.1 0.2 0.3" mass="1"
diaginertia="1 1 1"/><body name="two" pos="0.4 0 0.3"><joint name="y" axis="1 0 0"/><inertial pos="0.1 0 0.2" mass="1"
diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""
GAINS = GainsFile(gains=tuple(GainEntry(joint=j, estimate=2.5, std=0.01) for j in (1, 2)))


def bare_of_two(base: list[dict]) -> BareResult:
    joints = [{"joint": j + 1, "name": name, "friction": ()} for j, name in enumerate("xy")]
    return BareResult.model_validate(bare_documents.bare_document(2, joints, base))


@pytest.mark.parametrize("axis", ["0 -0.6 0.8", "0.5 -0.3 0.2"])
def test_rotor_inertia_regrouped_with_another_factor_than_one_is_added_whole(tmp_path, axis):
    (tmp_path / "oblique.xml").write_text(TWO.format(f'axis="{axis}"'))
    structure = structure_of(read_arm(tmp_path / "oblique.xml", ()))
    base = structure.base
    rotor = base.regrouping[:, base.labels.index("Ia1")]
    k = int(np.argmax(np.abs(rotor)))
    assert abs(abs(rotor[k]) - 1.0) > 0.03
    stated = np.linspace(0.3, 0.7, len(rotor))
    shown = {"parameter": base.names[k], "estimate": (stated[k] + 0.12 * rotor[k]) / 2.5, "std": 0.004}
    found, C = unstated_parameters(structure, GAINS, bare_of_two([shown]), stated, np.array([0.0, 0.3]))
    np.testing.assert_allclose(found, 0.12 * rotor, rtol=1e-12)  # rounding
    np.testing.assert_allclose(C, np.outer(rotor, rotor) * (0.004 * 2.5 / rotor[k]) ** 2, rtol=1e-12)


def test_a_sliding_joint_shows_rotor_and_links_as_one(tmp_path):
    (tmp_path / "slider.xml").write_text(TWO.format('type="slide" axis="1 0 0"'))
    structure = structure_of(read_arm(tmp_path / "slider.xml", ()))
    assert "Ia1" in structure.base.groups()
    bare = bare_of_two([{"parameter": f"Ia{j}", "estimate": 0.9, "std": 0.01} for j in (1, 2)])
    values = joint_values(structure, GAINS, None, bare, most=0.1)
    assert "only their sum is identifiable" in str(values["x"]["armature"])
