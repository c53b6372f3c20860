import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bad_files import refused
from printed import printed
from robot_folders import robot_folder

import rx90_mjcf
from ident.recordings.files import read_recording, write_recording
from ident.support.errors import RobotModelError
from scenarios.cli import main
from scenarios.experiments.robots import named_robot, robot_file
from scenarios.support.errors import ScenarioError, WrongValue

pytestmark = pytest.mark.usefixtures("_computed_once")


@pytest.fixture
def bare(weighed_cell) -> str:
    return str(weighed_cell / "run" / "unloaded.parquet")


def test_a_clean_log_ends_with_0_and_fits_the_schema(bare, arm, capsys):
    found = printed(capsys, "check", ["check", "rx90", bare])
    assert found["verdict"] != "wrong"
    assert not [each for each in found["diagnoses"] if each["severity"] == "wrong"]
    joints = found["logs"][0]["joints"]
    assert [each["joint"] for each in joints] == [1, 2, 3, 4, 5, 6]
    # the filters smooth an extreme, and cut the ends off
    np.testing.assert_allclose([each["high"] for each in joints], read_recording(bare).q.max(axis=0), atol=0.1)
    covered = (joints[0]["high"] - joints[0]["low"]) / (arm.upper[0] - arm.lower[0])
    np.testing.assert_allclose(joints[0]["covered"], covered, rtol=1e-9)


def test_all_and_files_list_every_check_and_how_joints_moved(bare, capsys):
    for option in ("--all", "--format=markdown", "--format=html", "--quiet"):
        assert main(["check", "rx90", bare, option]) == 0
        told = capsys.readouterr().out
        for words in (
            "no current is clipped",
            "With these logs",
            "encoder resolution",
            "Motion of unloaded",
            "Rms acceleration",
        ):
            assert (words in told) == (option != "--quiet")
        assert ("--all lists every check" in told) == (option == "--quiet")


def test_a_clipped_current_ends_with_1_and_is_named_after_the_verdict(bare, tmp_path, capsys):
    log = read_recording(bare)
    v = np.minimum(log.v, np.where(np.arange(6) == 3, 0.7 * log.v.max(axis=0), np.inf))
    write_recording(replace(log, v=v), tmp_path / "clipped.parquet")
    words = ["check", "rx90", str(tmp_path / "clipped.parquet")]
    assert main(words) == 1
    lines = capsys.readouterr().out.splitlines()
    assert re.match(r"WRONG: \d+ faults? .*\(\d+ checks of rx90 logs\)", lines[0])
    (line,) = [line for line in lines if "is clipped at" in line]
    assert line.startswith("WRONG: v4 is clipped at its largest value ")
    assert line.endswith(". Move more slowly or carry less.")
    found = printed(capsys, "check", [*words], status=1)
    (clip,) = [each for each in found["diagnoses"] if each["name"] == "clipping" and each["severity"] == "wrong"]
    assert (found["verdict"], clip["joints"]) == ("wrong", [4])
    assert [Path(log).name for log in clip["logs"]] == ["clipped.parquet"]


def test_bad_input_ends_with_2_and_one_line(bare, capsys):
    for words, said in (
        (["rx90", "nowhere.parquet"], "nowhere.parquet"),
        (["nobody", bare], "unknown robot 'nobody'"),
        (["rx90", bare, "--loaded", bare], "--loaded: no payload is given"),
        (["panda", bare], "6 joints, but robot"),
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
