"""`rx90 patch`: attributes of a copy of a model against gains times what was found, and the rest as it was."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from model_files import LINKS, mjcf, urdf
from printed import printed

from ident.model.structure import structure_of
from scenarios.cli import main
from scenarios.experiments.files.gains import GainEntry, GainsFile, read_gains
from scenarios.experiments.robot_models import read_arm
from scenarios.gains_in_use.model_values import BareFile, Unknown, joint_values, unstated_parameters

JOINTS = [f"{link[0]}_joint" for link in LINKS]
GAIN = {0: 11.9, 1: 11.6, 2: -9.8, 3: 10.3, 4: 9.1}
OLD = {0: 12.5, 1: 12.5, 2: 10.4, 3: 9.6, 4: 9.5}
FV = [1.82, 1.86, -0.97, 0.35, 0.34, 0.33]
FC = [1.71, 1.64, -0.93, 0.37, 0.31, 0.29]
IA = {3: 0.085, 4: 0.034, 5: 0.033, 6: 0.031}
"""Over the gain of the reference."""
HEAD = "<!-- who wrote this -->\n"
CLASSES = """<default><joint damping="0.7" frictionloss="0.2"/><general forcerange="-7 8"/>
<default class="wrist"><joint armature="0.3" frictionloss="0.4"/><motor ctrlrange="-21 22"/></default></default>"""
TAIL = """<actuator>
<general name="a" joint="shoulder_pan_joint"/> <!-- kept -->
<position name="b" joint="elbow_joint" forcerange="-150  149.5" kp="100"/>
<motor name="c" class="wrist" joint="wrist_1_joint" gear="2"/>
</actuator>"""


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
    return {"reference": 4, "joints": joints, "base_parameters": base, **more}


@pytest.fixture
def cell(tmp_path) -> Path:
    """Models with comments, gains of the arm and of a data sheet, and what bare motions said."""
    (tmp_path / "gains.toml").write_text(gains_text(GAIN))
    (tmp_path / "sheet.toml").write_text(gains_text(OLD))
    (tmp_path / "bare.json").write_text(json.dumps(bare_document()))
    other = '<transmission name="t"><joint name="elbow_joint"><limit effort="3"/></joint></transmission>'
    (tmp_path / "arm.urdf").write_text(HEAD + urdf(swap=('effort="150"', "effort = '150'"), more=other))
    head = '<compiler angle="degree" autolimits="true"/>\n' + CLASSES
    swap = 'name="wrist_2_link"', 'name="wrist_2_link" childclass="wrist"'
    (tmp_path / "arm.xml").write_text(HEAD + mjcf(head=head, tail=TAIL, swap=swap))
    return tmp_path


def patched(cell: Path, model: str, *more: str, out: str | None = None, arm: bool = True) -> list[str]:
    known = ["--arm", str(cell / "bare.json")] if arm else []
    out = out or f"patched{Path(model).suffix}"
    return ["patch", str(cell / model), "--gains", str(cell / "gains.toml"), *known, "--out", str(cell / out), *more]


def sheet(cell: Path) -> tuple[str, str]:
    return "--nominal", str(cell / "sheet.toml")


def test_a_urdf_has_efforts_scaled_and_friction_in_newton_metres(cell):
    assert main(patched(cell, "arm.urdf", *sheet(cell))) == 0
    joints = {each.get("name"): each for each in ET.parse(cell / "patched.urdf").getroot().findall("joint")}
    for j, name in enumerate(JOINTS):
        effort = float(joints[name].find("limit").get("effort"))
        dynamics = joints[name].find("dynamics")
        # Numbers are written with six digits.
        np.testing.assert_allclose(effort, 150.0 * abs(GAIN[j] / OLD[j]) if j in GAIN else 150.0, rtol=1e-5)
        if j not in GAIN:
            assert dynamics is None
            continue
        np.testing.assert_allclose(float(dynamics.get("friction")), GAIN[j] * FC[j], rtol=1e-5)
        if j in (3, 4):  # a deviation of a fifth; a law that is no straight line
            assert dynamics.get("damping") is None
        else:
            np.testing.assert_allclose(float(dynamics.get("damping")), GAIN[j] * FV[j], rtol=1e-5)


def test_gains_of_a_data_sheet_in_another_unit_are_refused(cell, capsys):
    thousands = {j: 1000.0 * g if j == 2 else g for j, g in OLD.items()}
    (cell / "sheet.toml").write_text(gains_text(thousands))
    assert main(patched(cell, "arm.urdf", *sheet(cell))) == 2
    assert "--nominal: joint 3: " in capsys.readouterr().err
    assert not (cell / "patched.urdf").exists()


def test_all_else_of_a_urdf_stays(cell):
    main(patched(cell, "arm.urdf", *sheet(cell)))
    before, after = ((cell / name).read_text() for name in ("arm.urdf", "patched.urdf"))
    without = ET.canonicalize(after, exclude_tags=["dynamics"], exclude_attrs=["effort"], with_comments=True)
    assert without == ET.canonicalize(before, exclude_attrs=["effort"], with_comments=True)
    assert after.startswith(HEAD)
    assert '<limit effort="3"/></joint></transmission>' in after


def test_ros_parameters_are_made_only_when_they_are_asked_for(cell, monkeypatch):
    asked = list[object]()

    def rendered(*given: object) -> str:
        asked.append(given)
        return "x"

    monkeypatch.setattr("scenarios.results.ros_parameters.ros_parameters", rendered)
    assert main(patched(cell, "arm.urdf")) == 0
    assert not asked
    assert main(patched(cell, "arm.urdf", "--ros-params", str(cell / "gains.yaml"), out="again.urdf")) == 0
    assert len(asked) == 1


def test_without_a_data_sheet_efforts_stay(cell, capsys):
    assert main(patched(cell, "arm.urdf", "--json")) == 0
    changes = json.loads(capsys.readouterr().out)["changes"]
    efforts = [each for each in changes if each["attribute"] == "effort"]
    assert [each["after"] for each in efforts] == [None] * 6
    assert {each["before"] for each in efforts} == {"150"}
    assert all("--nominal" in each["reason"] for each in efforts)


def test_without_bare_motions_friction_stays(cell, capsys):
    assert main(patched(cell, "arm.urdf", "--json", arm=False)) == 0
    assert all("--arm" in each["reason"] for each in json.loads(capsys.readouterr().out)["changes"][1::3])
    before, after = (ET.canonicalize((cell / f"{n}.urdf").read_text(), with_comments=True) for n in ("arm", "patched"))
    assert before == after


def test_every_attribute_that_differs_is_told_with_both_values(cell, capsys):
    for model in ("arm.urdf", "arm.xml"):
        assert main(patched(cell, model, *sheet(cell), "--json")) == 0
        changes = printed(capsys, "patch")["changes"]
        texts = [(cell / name).read_text() for name in (model, f"patched{Path(model).suffix}")]
        counts = [
            sum(len(each.attrib) for each in ET.fromstring(text).iter()) for text in texts
        ]  # what is new has no value before, but that of a class
        changed = [each for each in changes if each["after"] is not None]
        assert all(f'"{each["after"]}"' in texts[1] or f"'{each['after']}'" in texts[1] for each in changed)
        classes = {"0.7", "0.2", "0.3", "0.4", "-7 8", "-21 22"}
        assert counts[1] - counts[0] == sum(each["before"] is None or each["before"] in classes for each in changed)


def test_an_mjcf_is_patched_where_its_classes_would_say_something_else(cell):
    assert main(patched(cell, "arm.xml", *sheet(cell))) == 0
    model = mujoco.MjModel.from_xml_path(str(cell / "patched.xml"))
    before = mujoco.MjModel.from_xml_path(str(cell / "arm.xml"))
    ratio = [abs(GAIN[j] / OLD[j]) if j in GAIN else 1.0 for j in range(6)]
    for j in range(6):
        known = j in GAIN
        if known:
            np.testing.assert_allclose(model.dof_frictionloss[j], GAIN[j] * FC[j], rtol=1e-5)  # six digits
        else:
            assert model.dof_frictionloss[j] == before.dof_frictionloss[j]
        if known and j not in (3, 4):
            np.testing.assert_allclose(np.ravel(model.dof_damping[j])[0], GAIN[j] * FV[j], rtol=1e-5)
        else:
            np.testing.assert_array_equal(model.dof_damping[j], before.dof_damping[j])
    for k, (low, high, j) in enumerate([(-7.0, 8.0, 0), (-150.0, 149.5, 2)]):
        np.testing.assert_allclose(model.actuator_forcerange[k], ratio[j] * np.array([low, high]), rtol=1e-5)
    np.testing.assert_allclose(model.actuator_ctrlrange[2], ratio[3] * np.array([-21.0, 22.0]), rtol=1e-5)
    np.testing.assert_allclose(model.actuator_forcerange[2], ratio[3] * np.array([-7.0, 8.0]), rtol=1e-5)
    assert "<!-- kept -->" in (cell / "patched.xml").read_text()


def test_armature_is_written_where_it_shows_by_itself(cell, capsys):
    assert main(patched(cell, "arm.xml", "--json")) == 0
    told = {e["joint"]: e for e in json.loads(capsys.readouterr().out)["changes"] if e["attribute"] == "armature"}
    assert "regrouped" in told[JOINTS[0]]["reason"]
    model = mujoco.MjModel.from_xml_path(str(cell / "patched.xml"))
    for j, value in IA.items():
        assert told[JOINTS[j - 1]]["after"] is not None
        np.testing.assert_allclose(model.dof_armature[j - 1], GAIN[3] * value, rtol=1e-5)  # six digits
    # Relative deviations of a product: 1 % of the parameter, 0.1 of 10.3 of the gain.
    np.testing.assert_allclose(told[JOINTS[3]]["rel_std"], np.hypot(0.01, 0.1 / 10.3), rtol=1e-12)


def test_a_larger_deviation_is_taken_when_asked_for(cell, capsys):
    assert main(patched(cell, "arm.urdf", "--max-rel-std", "0.25", "--json")) == 0
    told = json.loads(capsys.readouterr().out)["changes"]
    damping = next(e for e in told if e["joint"] == JOINTS[3] and e["attribute"] == "damping")
    np.testing.assert_allclose(float(damping["after"]), GAIN[3] * FV[3], rtol=1e-5)  # six digits


def test_dynamics_that_are_there_change_and_keep_the_rest(cell):
    text = (cell / "arm.urdf").read_text()
    child = '<child link="shoulder_pan_link"/>'
    marked = text.replace(child, child + '\n<dynamics damping="9" own="x" />\n', 1)
    (cell / "arm.urdf").write_text(marked)
    assert main(patched(cell, "arm.urdf")) == 0
    after = (cell / "patched.urdf").read_text()
    assert f'\n<dynamics damping="{GAIN[0] * FV[0]:.6g}" own="x" friction="{GAIN[0] * FC[0]:.6g}" />\n' in after


def test_torque_constants_are_written_by_joint(cell):
    assert main(patched(cell, "arm.urdf", "--ros-params", str(cell / "gains.yaml"))) == 0
    text = (cell / "gains.yaml").read_text()
    told = yaml.safe_load(text)["/**"]["ros__parameters"]
    assert told["torque_constants"] == {JOINTS[j]: value for j, value in GAIN.items()}
    assert told["torque_constant_deviations"] == {JOINTS[j]: 0.1 for j in GAIN}
    assert '# "wrist_3_joint": no load' in text


def test_a_model_that_is_none_is_named(cell, capsys):
    assert main(["patch", "rx90", "--gains", str(cell / "gains.toml"), "--out", str(cell / "patched.urdf")]) == 2
    assert "robot model rx90: expected a .urdf, .xml or .mjcf file" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (["--out", "x.xml"], "ends in .urdf"),
        (["--out", "./arm.urdf"], "expected different files"),
        (["--ros-params", "patched.urdf"], "expected different files"),
        (["--arm", "gains.toml"], "expected what `rx90 identify"),
        (["--nominal", "nowhere.toml"], "nowhere.toml: no such file"),
        (["--max-rel-std", "0"], "expected 1e-06 to 1"),
    ],
)
def test_what_cannot_be_meant_is_one_line(cell, words, match, capsys, monkeypatch):
    monkeypatch.chdir(cell)
    before = (cell / "arm.urdf").read_bytes()
    try:
        given = dict(zip(words[::2], words[1::2], strict=False))
        plain = {"--arm": "bare.json", "--out": "patched.urdf"}
        options = [word for pair in {**plain, **given}.items() for word in pair]
        status = main(["patch", "arm.urdf", "--gains", "gains.toml", *options])
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2
    assert match in capsys.readouterr().err
    assert not (cell / "patched.urdf").exists()
    assert (cell / "arm.urdf").read_bytes() == before


def test_gains_and_friction_are_of_the_arm(cell, capsys):
    text = (cell / "gains.toml").read_text()
    (cell / "gains.toml").write_text(text.replace("elbow_joint", "knee_joint"))
    assert main(patched(cell, "arm.urdf")) == 2
    assert "joint 3 is knee_joint" in capsys.readouterr().err
    (cell / "gains.toml").write_text(text)
    document = bare_document()
    document["joints"][0]["name"] = "hip_joint"
    (cell / "bare.json").write_text(json.dumps(document))
    assert main(patched(cell, "arm.urdf")) == 2
    assert "bare motions of joints hip_joint" in capsys.readouterr().err
    (cell / "bare.json").write_text(json.dumps(bare_document(reference=7)))
    assert main(patched(cell, "arm.urdf")) == 2
    assert "reference = 7" in capsys.readouterr().err


def test_friction_of_each_motion_is_not_averaged_in_silence(cell, capsys):
    document = bare_document()
    document["joints"][0]["friction"][0]["parameter"] = "Fv in motion 1"
    (cell / "bare.json").write_text(json.dumps(document))
    assert main(patched(cell, "arm.urdf", "--json")) == 0
    told = json.loads(capsys.readouterr().out)["changes"]
    assert "differs between motions" in told[1]["reason"]


def test_what_a_class_says_is_told_as_the_value_before(cell, capsys):
    assert main(patched(cell, "arm.xml", "--json")) == 0
    told = {(e["joint"], e["attribute"]): e["before"] for e in json.loads(capsys.readouterr().out)["changes"]}
    model = mujoco.MjModel.from_xml_path(str(cell / "arm.xml"))
    for j, name in enumerate(JOINTS):
        assert float(told[name, "damping"]) == np.ravel(model.dof_damping[j])[0]
        assert float(told[name, "frictionloss"]) == model.dof_frictionloss[j]
        assert float(told[name, "armature"] or 0.0) == model.dof_armature[j]


def test_a_deviation_beyond_the_limit_a_negative_number_and_no_limit_are_left_alone(cell, capsys):
    document = bare_document()
    friction = document["joints"][0]["friction"]
    friction[0]["std"] = 0.12 * friction[0]["estimate"]
    other = document["joints"][1]["friction"][0]
    other["std"] = 12.7 * other["estimate"]
    friction[1]["estimate"] *= -1.0
    (cell / "bare.json").write_text(json.dumps(document))
    text = (cell / "arm.urdf").read_text().replace("effort = '150'", "effort = '0.0'")
    (cell / "arm.urdf").write_text(text.replace('effort="150" ', "", 1))
    assert main(patched(cell, "arm.urdf", *sheet(cell), "--json")) == 0
    told = json.loads(capsys.readouterr().out)["changes"]
    first = [each["reason"] for each in told if each["joint"] == JOINTS[0]]
    assert first[0] == "a limit of 0 is no limit"
    assert "with a standard deviation of 12 %, more than 10 %" in first[1]
    assert first[2] == "identified as -20.3, not positive"
    assert any("with a standard deviation of 1270 %, more than 10 %" in str(each["reason"]) for each in told)
    second = next(each for each in told if each["joint"] == JOINTS[1])
    assert (second["before"], second["reason"]) == (None, "the model states no limit")


def test_a_negative_gain_is_noted_and_the_others_are_not(cell, capsys):
    assert main(patched(cell, "arm.urdf")) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("is negative") == said.count("Note: joint 3: the gain is negative") == 1
    assert main(patched(cell, "arm.urdf", "--json")) == 0
    (note,) = printed(capsys, "patch")["notes"]
    assert note.startswith("joint 3: ")


def test_the_table_shows_two_deviations(cell, capsys):
    assert main(patched(cell, "arm.urdf", *sheet(cell))) == 0
    lines = capsys.readouterr().out.splitlines()
    row = next(line for line in lines if " effort " in line)
    # Two deviations of the gain alone: 2 * 0.1 / 11.9.
    assert row.split() == ["shoulder_pan_joint", "effort", "150", "142.8", "1.7"]
    named = [line for line in lines if line.strip().startswith(tuple(JOINTS))]
    assert {line.split()[0] for line in named} == set(JOINTS)
    assert all(line.startswith(tuple(JOINTS)) for line in named)  # to the left, as words are


def test_gains_of_another_data_sheet_are_refused(cell, capsys):
    (cell / "sheet.toml").write_text(gains_text(OLD).replace("elbow_joint", "knee_joint"))
    assert main(patched(cell, "arm.urdf", *sheet(cell))) == 2
    assert "joint 3 is knee_joint" in capsys.readouterr().err


def test_what_a_model_does_not_state_is_in_si_with_its_deviations(cell):
    structure, gains = structure_of(read_arm(cell / "arm.xml", ())), read_gains(cell / "gains.toml")
    names = structure.base.names
    stated = np.where(np.array(names) == "Ia4", 0.05, 0.0)
    motor = np.where(np.arange(6) == 4, 0.02, 0.0)  # that of joint 5 is stated
    found, C = unstated_parameters(structure, gains, BareFile.model_validate(bare_document()), stated, motor)
    value, std = (dict(zip(names, each.tolist(), strict=True)) for each in (found, np.sqrt(np.diag(C))))
    unit = GAIN[3]  # that of the reference
    np.testing.assert_allclose([value[f"Ia{j}"] for j in (3, 4, 5)], [unit * IA[3], unit * IA[4] - 0.05, 0.0])
    np.testing.assert_allclose([std[f"Ia{j}"] for j in (3, 4, 5)], [0.01 * unit * IA[3], 0.01 * unit * IA[4], 0.0])
    np.testing.assert_allclose([value[f"off{j}"] for j in (3, 6)], [0.1 * GAIN[2], 0.0])  # joint 6 has no gain


OBLIQUE = """<mujoco><worldbody><body name="one"><joint name="x" axis="0 -0.6 0.8"/>
<inertial pos="0.1 0.2 0.3" mass="1" diaginertia="1 1 1"/>
<body name="two" pos="0.4 0 0.3"><joint name="y" axis="1 0 0"/>
<inertial pos="0.1 0 0.2" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>"""


@pytest.mark.parametrize("axis", ["0 -0.6 0.8", "0.5 -0.3 0.2"])
def test_rotor_inertia_regrouped_with_another_factor_than_one_is_added_whole(tmp_path, axis):
    (tmp_path / "oblique.xml").write_text(OBLIQUE.replace("0 -0.6 0.8", axis))
    structure = structure_of(read_arm(tmp_path / "oblique.xml", ()))
    base = structure.base
    rotor = base.regrouping[:, base.labels.index("Ia1")]
    k = int(np.argmax(np.abs(rotor)))
    assert abs(abs(rotor[k]) - 1.0) > 0.03
    gains = GainsFile(gains=tuple(GainEntry(joint=j, estimate=2.5, std=0.01) for j in (1, 2)))
    stated = np.linspace(0.3, 0.7, len(rotor))
    shown = {"parameter": base.names[k], "estimate": (stated[k] + 0.12 * rotor[k]) / 2.5, "std": 0.004}
    joints = [{"joint": j + 1, "name": name, "friction": ()} for j, name in enumerate("xy")]
    bare = BareFile.model_validate({"reference": 1, "joints": joints, "base_parameters": [shown]})
    found, C = unstated_parameters(structure, gains, bare, stated, np.array([0.0, 0.3]))
    np.testing.assert_allclose(found, 0.12 * rotor, rtol=1e-12)  # rounding
    np.testing.assert_allclose(C, np.outer(rotor, rotor) * (0.004 * 2.5 / rotor[k]) ** 2, rtol=1e-12)


SLIDER = """<mujoco><worldbody><body name="base"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="cart"><joint name="x" type="slide" axis="1 0 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
<body name="arm" pos="0 0 0.3"><joint name="y" axis="0 1 0"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
</body></body></body></worldbody></mujoco>"""


def test_a_sliding_joint_shows_rotor_and_links_as_one(tmp_path):
    (tmp_path / "slider.xml").write_text(SLIDER)
    structure = structure_of(read_arm(tmp_path / "slider.xml", ()))
    gains = GainsFile(gains=tuple(GainEntry(joint=j, estimate=2.5, std=0.01) for j in (1, 2)))
    joints = [{"joint": j + 1, "name": name, "friction": ()} for j, name in enumerate(structure.arm.joint_names)]
    base = [{"parameter": f"Ia{j}", "estimate": 0.9, "std": 0.01} for j in (1, 2)]
    bare = BareFile.model_validate({"reference": 2, "joints": joints, "base_parameters": base})
    assert "Ia1" in structure.base.groups()
    first, _ = joint_values(structure, gains, None, bare, most=0.1)
    assert isinstance(first.armature, Unknown)
    assert "only their sum is identifiable" in first.armature.reason
