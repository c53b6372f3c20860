"""Files that a scenario names lie beside the file that says so, whoever extends it."""

import shutil
from pathlib import Path

import pytest
from robot_folders import robot_folder

from scenarios.experiments.scenario import load_scenario, robot_of
from scenarios.experiments.scenario_files import CATALOG, seen_from
from scenarios.experiments.setup import setup_of
from scenarios.support.errors import UnknownName, UnreadableFile

MOTION = CATALOG / "motions" / "drive-gains.toml"


@pytest.fixture
def parent(tmp_path) -> Path:
    """A folder with a scenario whose robot and motion lie beside it."""
    folder = tmp_path / "arm"
    folder.mkdir()
    robot_folder(folder, 6)
    shutil.copy(MOTION, folder / "motion.toml")
    text = 'extends = "nominal"\nrobot = "robot.toml"\n[experiment]\nmotion = "motion.toml"\n'
    (folder / "scenario.toml").write_text(text)
    return folder


def child(parent: Path, text: str = "") -> str:
    below = parent.parent / "studies" / "heavy"
    below.mkdir(parents=True)
    (below / "mine.toml").write_text(f'extends = "../../arm/scenario.toml"\n{text}')
    return str(below / "mine.toml")


def test_robot_and_motion_of_a_parent_lie_beside_the_parent_even_where_the_child_has_files_of_these_names(parent):
    path = child(parent)
    for name in ("robot.toml", "motion.toml"):
        (Path(path).parent / name).write_text("")
    scenario = load_scenario(path)
    assert scenario.table.robot == "../../arm/robot.toml"  # relative, so that records hold on another machine
    assert robot_of(scenario).model == robot_of(load_scenario(str(parent / "scenario.toml"))).model
    own, parents = setup_of(scenario), setup_of(load_scenario(str(parent / "scenario.toml")))
    assert (own.experiments[0].trajectory.sine == parents.experiments[0].trajectory.sine).all()


def test_a_child_s_own_places_are_beside_itself_and_names_stay_names(parent):
    path = child(parent, 'robot = "own.toml"\n[experiment]\nmotion = "drive-gains"\n')
    robot_folder(Path(path).parent, 6)
    (Path(path).parent / "robot.toml").rename(Path(path).parent / "own.toml")
    shutil.copy(parent / "scenario.toml", Path(path).parent / "unused.toml")
    table = load_scenario(path).table
    assert (table.robot, table.experiment.motion) == ("own.toml", "drive-gains")
    over = Path(path).with_name("further.toml")
    over.write_text('extends = "mine.toml"\n')
    table = load_scenario(str(over)).table
    assert (table.robot, table.experiment.motion) == ("own.toml", "drive-gains")


@pytest.mark.parametrize("group", ["random", "sources"])
def test_motions_that_are_drawn_are_places_too_and_other_choices_are_not(group):
    draws = {
        "motion": {"target": ["experiment.motion"], "choice": ["slow.toml", "drive-gains"]},
        "weight": {"target": "belief.payload", "choice": ["slow.toml"]},
        "number": {"target": "plant.gain", "distribution": "norm"},
        "nothing": {"choice": ["slow.toml"]},  # refused later, by name
    }
    found = seen_from({group: draws}, Path("/lab/arm"), Path("/lab/studies"))[group]
    moved = {"target": ["experiment.motion"], "choice": ["../arm/slow.toml", "drive-gains"]}
    assert found == {**draws, "motion": moved}


def test_an_absolute_place_stays_where_it_is():
    table = {"robot": "/lab/robot.toml", "experiment": {"motion": "/lab/m.toml"}}
    assert seen_from(table, Path("/lab/arm"), Path("/lab/studies")) == table


def test_a_robot_s_name_stays_a_name():
    assert seen_from({"robot": "tx40"}, Path("/lab/arm"), Path("/lab/studies")) == {"robot": "tx40"}


def test_seen_from_its_own_folder_a_place_stays_as_it_is_written():
    table = {"robot": "./robot.toml", "experiment": {"motion": "slow/../m.toml"}}
    assert seen_from(table, Path("/lab/arm"), Path("/lab/arm")) == table


@pytest.mark.parametrize(
    ("name", "key", "error"),
    [("robot.toml", "robot", UnreadableFile), ("motion.toml", "experiment.motion", UnknownName)],
)
def test_a_file_that_is_not_there_is_told_with_the_file_and_the_key_that_ask_for_it(parent, name, key, error):
    path = child(parent)
    (parent / name).unlink()
    with pytest.raises(error, match=rf"^{parent}/scenario\.toml: {key}: .*arm/{name}"):
        setup_of(load_scenario(path))


def test_a_scenario_is_named_by_its_file_and_scenario_toml_by_its_folder(tmp_path):
    folder = tmp_path / "my arm.v2"
    (folder / "nested").mkdir(parents=True)
    for path in ("scenario.toml", "heavy.toml", "nested/scenario.toml", "scenario-b.toml"):
        (folder / path).write_text('extends = "nominal"')
    names = {"scenario.toml": "my arm.v2", "heavy.toml": "heavy", "nested/scenario.toml": "nested"}
    for path, name in {**names, "scenario-b.toml": "scenario-b"}.items():
        assert load_scenario(str(folder / path)).name == name
    assert load_scenario("ideal").name == "ideal"


def test_a_scenario_of_the_working_folder_has_its_name(tmp_path, monkeypatch):
    (tmp_path / "cell 7").mkdir()
    monkeypatch.chdir(tmp_path / "cell 7")
    (tmp_path / "cell 7" / "scenario.toml").write_text('extends = "nominal"')
    assert load_scenario("scenario.toml").name == "cell 7"
