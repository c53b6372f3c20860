"""What a scenario or motion can be besides right: each ends with one line on stderr that names it."""

import os
from pathlib import Path

import pytest
from bad_files import WHOLE, names_file, only_line

from scenarios.cli import main
from scenarios.experiments.scenario import load_scenario
from scenarios.support.errors import ScenarioError

SCENARIO_FAULTS = {
    "nested": ("a = " + "[" * 50_000, "nested deeper than 16"),
    "dotted": ("a." * 50_000 + "a = 1", "nested deeper than 16"),
    "not UTF-8": (b"description = '\xe9'", "byte 15 is not UTF-8"),
    "a novel": (b"# " + b"x" * 4_000_001, "4 MB are too much"),
    "empty": ("", "the file is empty"),
    "decimal comma": (WHOLE.replace("2.8", "2,8"), r"\(at line \d+, column \d+\); numbers have a decimal point"),
    "no TOML": ("description : 1", "not TOML"),
    "extends a list": ("extends = ['nominal']", r"extends = \['nominal'\]; expected the name of one scenario"),
    "extends itself": ("extends = 'mine.toml'", "extends itself through mine.toml -> mine.toml"),
    "extends a stranger": ("extends = 'nominl'", "unknown scenario 'nominl'; did you mean 'nominal'"),
}


@pytest.mark.parametrize("name", SCENARIO_FAULTS)
def test_a_faulty_scenario_is_one_line(capsys, tmp_path, name):
    content, message = SCENARIO_FAULTS[name]
    path = tmp_path / "mine.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert main(["run", str(path)]) == 2
    names_file(only_line(capsys), path, message)


MOTION = (
    "duration = 8.0\ncenter = [0.1, 0.2]\nsine = [[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]]\n"
    "cosine = [[0.05, -0.08, 0.03], [0.1, -0.16, 0.06]]\n"
)
MOTION_FAULTS = {
    "no duration": (MOTION.replace("duration", "# duration"), "duration is missing; expected duration, center, sine"),
    "durations": (MOTION.replace("duration", "durations"), "unknown key 'durations'; did you mean 'duration'"),
    "text": (MOTION.replace("8.0", "'8.0'"), "duration = '8.0'; expected a number"),
    "a year": (MOTION.replace("8.0", "3600"), r"duration = 3600; expected up to 600 s"),
    "just too long": (MOTION.replace("8.0", "600.001"), r"duration = 600.001; expected up to 600 s"),
    "no time": (MOTION.replace("8.0", "0.0"), "duration = 0; expected up to 600 s"),
    "nan": (MOTION.replace("-0.08", "nan"), "cosine contains a number that is not finite or beyond 10000"),
    "huge": (MOTION.replace("[0.1, 0.2]", "[0.1, 1e300]"), "center contains a number that is not finite or beyond"),
    "huge whole number": (MOTION.replace("0.2]", "9" * 400 + "]", 1), r"center = .* bits\]; expected an array"),
    "true": (MOTION.replace("[0.1, 0.2]", "[0.1, true]"), r"center = \[0.1, True\]; expected an array of numbers"),
    "ragged": (MOTION.replace("-0.1, 0.0]", "-0.1]"), "sine = .*; expected rows of numbers, all of one length"),
    "flat": (
        MOTION.replace("[[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]]", "[0.1, 0.2]"),
        "sine = .*; expected rows of numbers",
    ),
    "sizes": (MOTION.replace("[0.1, 0.2]", "[0.1]"), r"center \(1,\), sine \(2, 3\) and cosine \(2, 3\) do not fit"),
    "a start": (MOTION.replace("-0.08", "-0.09"), "the motion does not start at rest"),
    "not two": (MOTION, "moves 2 joints of 6"),
    "nested": ("a = " + "[" * 50_000, "nested deeper than 16"),
}


@pytest.mark.parametrize("name", MOTION_FAULTS)
def test_a_faulty_motion_is_one_line(capsys, tmp_path, name):
    text, message = MOTION_FAULTS[name]
    (tmp_path / "motion.toml").write_text(text)
    (tmp_path / "mine.toml").write_text("extends = 'nominal'\n[experiment]\nmotion = 'motion.toml'\n")
    assert main(["run", str(tmp_path / "mine.toml")]) == 2
    names_file(only_line(capsys), Path("motion.toml"), message)


def test_a_motion_or_scenario_that_is_no_regular_file_is_one_line(capsys, tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "folder.toml").mkdir()
    for name, message in (("pipe.toml", "is a pipe"), ("folder.toml", "is a folder"), ("absent.toml", "no such file")):
        assert main(["run", str(tmp_path / name)]) == 2
        assert message in only_line(capsys)
    for name, message in (("pipe.toml", "is a pipe"), ("absent.toml", "unknown motion 'absent.toml'")):
        (tmp_path / "mine.toml").write_text(f"extends = 'nominal'\n[experiment]\nmotion = '{name}'\n")
        assert main(["run", str(tmp_path / "mine.toml")]) == 2
        assert message in only_line(capsys)


def test_a_circle_of_scenarios_is_told_once(tmp_path):
    (tmp_path / "one.toml").write_text("extends = 'two.toml'")
    (tmp_path / "two.toml").write_text("extends = 'one.toml'")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(str(tmp_path / "one.toml"))
    assert str(caught.value) == f"{tmp_path / 'one.toml'}: extends itself through one.toml -> two.toml -> one.toml"
