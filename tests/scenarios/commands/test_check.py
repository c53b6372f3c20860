import re
from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, ur_like
from printed import printed
from robot_folders import robot_folder

import rx90_mjcf
from ident.recordings.files import read_recording, write_recording
from ident.recordings.recording import Recording
from ident.support.errors import RobotModelError
from scenarios.cli import main
from scenarios.experiments.robots import named_robot, robot_file
from scenarios.support.errors import ScenarioError, WrongValue

pytestmark = pytest.mark.usefixtures("_computed_once")
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
    """A folder with the UR-like arm, a bare and a loaded recording, and one whose v4 is clipped."""
    folder = tmp_path_factory.mktemp("cell")
    links = "".join(
        LINK.format(j=j, parent=f"l{j - 1}" if j > 1 else "base", xyz=xyz, pitch=repr(float(pitch)), axis=axis)
        for j, (xyz, pitch, axis) in enumerate(PLACES, 1)
    )
    (folder / "arm.urdf").write_text(URDF.format(links=links))
    bare, loaded = known_logs(ur_like(), BRICK, np.abs(UR_GAIN), np.random.default_rng(61), middle=UR_MIDDLE)
    write_recording(bare, folder / "bare.parquet")
    write_recording(loaded, folder / "loaded.parquet")
    v = loaded.v.copy()
    v[:, 3] = np.minimum(v[:, 3], 0.7 * v[:, 3].max())
    write_recording(Recording(loaded.t, loaded.q, v), folder / "clipped.parquet")
    return folder


def test_a_clean_log_ends_with_0_and_fits_the_schema(cell, capsys):
    found = printed(capsys, "check", ["check", str(cell / "arm.urdf"), str(cell / "bare.parquet")])
    assert found["verdict"] != "wrong"
    assert not [each for each in found["diagnoses"] if each["severity"] == "wrong"]
    bare = read_recording(cell / "bare.parquet")
    joints = found["logs"][0]["joints"]
    assert [each["joint"] for each in joints] == [1, 2, 3, 4, 5, 6]
    # the filters smooth an extreme, and cut the ends off
    np.testing.assert_allclose([each["high"] for each in joints], bare.q.max(axis=0), atol=0.1)
    np.testing.assert_allclose(joints[0]["covered"], (joints[0]["high"] - joints[0]["low"]) / 12.6, rtol=1e-9)


def test_all_and_files_list_every_check_and_how_joints_moved(cell, capsys):
    for option in ("--all", "--format=markdown", "--format=html", "--quiet"):
        assert main(["check", str(cell / "arm.urdf"), str(cell / "bare.parquet"), option]) == 0
        told = capsys.readouterr().out
        for words in ("no current is clipped", "encoder resolution", "Motion of bare", "Rms acceleration"):
            assert (words in told) == (option != "--quiet")
        assert ("--all lists every check" in told) == (option == "--quiet")


def test_a_clipped_current_ends_with_1_and_is_named_after_the_verdict(cell, capsys):
    words = ["check", str(cell / "arm.urdf"), str(cell / "bare.parquet"), str(cell / "clipped.parquet")]
    assert main(words) == 1
    lines = capsys.readouterr().out.splitlines()
    assert re.match(r"WRONG: \d+ faults? .*\(\d+ checks of six logs\)", lines[0])
    (line,) = [line for line in lines if "is clipped at" in line]
    assert line.startswith("WRONG clipped.parquet: v4 is clipped at its largest value ")
    assert line.endswith(". Move more slowly or carry less.")
    found = printed(capsys, "check", [*words], status=1)
    (clipped,) = [each for each in found["diagnoses"] if each["name"] == "clipping" and each["severity"] == "wrong"]
    assert (found["verdict"], clipped["joints"]) == ("wrong", [4])
    assert [Path(log).name for log in clipped["logs"]] == ["clipped.parquet"]


def test_bad_input_ends_with_2_and_one_line(cell, capsys, monkeypatch):
    monkeypatch.chdir(cell)
    for words, said in (
        (["arm.urdf", "nowhere.parquet"], "nowhere.parquet"),
        (["nobody", "bare.parquet"], "unknown robot 'nobody'"),
        (["arm.urdf", "bare.parquet", "--loaded", "bare.parquet"], "--loaded: no payload is given"),
        (["panda", "bare.parquet"], "6 joints, but robot"),
    ):
        assert said in refused(capsys, ["check", *words])


def test_a_robot_is_a_model_file_a_robot_file_or_a_name():
    model, file, name = (named_robot(word) for word in (str(rx90_mjcf.MJCF), str(robot_file("rx90")), "rx90"))
    assert model.gain is None
    assert file.gain is not None
    np.testing.assert_array_equal(name.gain, file.gain)
    np.testing.assert_array_equal(model.structure.arm.translation, name.structure.arm.translation)
    assert named_robot("tx40").structure.arm.couplings == ((4, 5),)
    assert named_robot("yam").flange == "gripper"
    assert named_robot("rx90", ((1, 2),)).structure.arm.couplings == ((1, 2),)
    assert model.structure.arm.couplings == ()
    with pytest.raises(ScenarioError, match=r"--flange: for model files only; 'rx90' states its own last body"):
        named_robot("rx90", flange="link5")
    with pytest.raises(WrongValue, match="not an empty word"):
        named_robot("")


def test_a_coupling_of_a_robot_s_file_whose_motor_is_nearer_to_the_base_is_refused(tmp_path):
    coupling = "[[coupling]]\nmotor = 2\nturns_with = 4\n"
    friction = '_friction = { value = 0.7, origin = "measured", source = "invented" }\n'
    path = robot_folder(tmp_path, 5, extra=f"{coupling}viscous{friction}coulomb{friction}")
    with pytest.raises(RobotModelError, match=r"cannot couple joints 4 and 2; .* the one nearer to the base first"):
        named_robot(str(path))
    assert named_robot(str(path), ((1, 3),)).structure.arm.couplings == ((1, 3),)
