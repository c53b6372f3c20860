"""`rx90 check`: what it prints, how it ends, what it asks for."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like
from robot_folders import robot_folder

import rx90_mjcf
from ident.errors import RobotModelError
from ident.recording import Recording
from ident.recording_files import read_recording, write_recording
from scenarios.cli import main
from scenarios.files.schema_line import ENDING, FOLDER
from scenarios.named_robot import named_robot
from scenarios.robots import ROBOTS

URDF = """<robot name="six"><link name="base"/>{links}</robot>"""
LINK = (
    '<link name="l{j}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    '</link><joint name="joint{j}" type="revolute"><parent link="{parent}"/><child link="l{j}"/>'
    '<origin xyz="{xyz}" rpy="0 {pitch} 0"/><axis xyz="{axis}"/>'
    '<limit lower="-6.3" upper="6.3" effort="1" velocity="9"/></joint>'
)
PLACES = [  # of `ur_like`
    ("0 0 0.128", 0.0, "0 0 1"), ("0 0.22 0", np.pi / 2, "0 1 0"), ("0 -0.171 0.612", 0.0, "0 1 0"),
    ("0 0 0.572", np.pi / 2, "0 1 0"), ("0 0.115 0", 0.0, "0 0 1"), ("0 0 0.116", 0.0, "0 1 0"),
]  # fmt: skip


@pytest.fixture(scope="module")
def cell(tmp_path_factory) -> Path:
    """A folder with the UR-like arm, a bare recording, and one with q3 negated."""
    folder = tmp_path_factory.mktemp("cell")
    links = "".join(
        LINK.format(j=j, parent=f"l{j - 1}" if j > 1 else "base", xyz=xyz, pitch=repr(float(pitch)), axis=axis)
        for j, (xyz, pitch, axis) in enumerate(PLACES, 1)
    )
    (folder / "arm.urdf").write_text(URDF.format(links=links))
    bare, _ = known_logs(ur_like(), BRICK, np.abs(UR_GAIN), np.random.default_rng(61), middle=UR_MIDDLE)
    write_recording(bare, folder / "bare.parquet")
    write_recording(Recording(bare.t, bare.q * [1, 1, -1, 1, 1, 1], bare.v), folder / "negated.parquet")
    return folder


def test_a_clean_log_ends_with_0_and_fits_the_schema(cell, capsys):
    assert main(["check", str(cell / "arm.urdf"), str(cell / "bare.parquet"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    jsonschema.Draft202012Validator(json.loads((FOLDER / f"check{ENDING}").read_text())).validate(found)
    assert found["verdict"] != "wrong"
    assert found["readings"]["better"] == []
    assert found["readings"]["driven_by_friction"] == []
    assert "q1 plus 90 degrees" in found["readings"]["same"]
    bare = read_recording(cell / "bare.parquet")
    joints = found["logs"][0]["joints"]
    assert [each["joint"] for each in joints] == [1, 2, 3, 4, 5, 6]
    # the filters smooth an extreme, and cut the ends off
    np.testing.assert_allclose([each["high"] for each in joints], bare.q.max(axis=0), atol=0.1)
    np.testing.assert_allclose(joints[0]["covered"], (joints[0]["high"] - joints[0]["low"]) / 12.6, rtol=1e-9)


def test_a_negated_joint_ends_with_1_and_is_named_in_a_line_of_the_table(cell, capsys):
    assert main(["check", str(cell / "arm.urdf"), str(cell / "negated.parquet")]) == 1
    printed = capsys.readouterr().out
    (line,) = [line for line in printed.splitlines() if "explains the currents better" in line]
    assert "q3 negated" in line
    assert " wrong " in line
    assert printed.splitlines()[-1].startswith("WRONG: ")
    assert "mend the log, or the model" in printed


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["arm.urdf", "nowhere.parquet"], "nowhere.parquet"),
        (["nobody", "bare.parquet"], "unknown robot 'nobody'"),
        (["arm.urdf", "bare.parquet", "--loaded", "bare.parquet"], "--loaded: no payload is given"),
        (["panda", "bare.parquet"], "6 joints, but robot"),
    ],
)
def test_bad_input_ends_with_2_and_one_line(cell, capsys, monkeypatch, words, said):
    monkeypatch.chdir(cell)
    assert main(["check", *words]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert said in printed.err
    assert printed.err.count("\n") == 1


def test_a_robot_is_a_model_file_a_robot_file_or_a_name():
    model, file, name = (named_robot(word) for word in (str(rx90_mjcf.MJCF), str(ROBOTS["rx90"]), "rx90"))
    assert model.gain is None
    assert file.gain is not None
    np.testing.assert_array_equal(name.gain, file.gain)
    np.testing.assert_array_equal(model.structure.arm.translation, name.structure.arm.translation)
    assert named_robot("tx40").structure.arm.couplings == ((4, 5),)
    assert named_robot("rx90", ((1, 2),)).structure.arm.couplings == ((1, 2),)
    assert model.structure.arm.couplings == ()


def test_a_coupling_of_a_robot_s_file_whose_motor_is_nearer_to_the_base_is_refused(tmp_path):
    coupling = "[[coupling]]\nmotor = 2\nturns_with = 4\n"
    friction = '_friction = { value = 0.7, origin = "measured", source = "invented" }\n'
    path = robot_folder(tmp_path, 5, extra=f"{coupling}viscous{friction}coulomb{friction}")
    with pytest.raises(RobotModelError, match=r"cannot couple joints 4 and 2; .* the one nearer to the base first"):
        named_robot(str(path))
    assert named_robot(str(path), ((1, 3),)).structure.arm.couplings == ((1, 3),)
