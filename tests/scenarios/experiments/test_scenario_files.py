import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from robot_folders import robot_folder

from scenarios.experiments.motions import read_motion
from scenarios.experiments.scenario import load_scenario, robot_of, setup_of, stated_payloads
from scenarios.experiments.scenario_files import CATALOG, seen_from
from scenarios.support.errors import ScenarioError, WrongValue
from scenarios.support.texts import toml_value
from sim.trajectory import FourierTrajectory

MOTION = CATALOG / "motions" / "drive-gains.toml"
BODY = "mass = 6.3, com = [0.08, 0.03, 0.11], inertia = { ixx = 0.021, iyy = 0.034, izz = 0.019 }"
DEVIATIONS = "mass_std = 0.02, com_std = [0.0, 0.003, 0.0], inertia_std = { ixx = 0.0, iyy = 0.0, izz = 0.002 }"
SINE, COSINE = [[0.1, 0.1, -0.1], [0.2, -0.1, 0.0]], [[0.05, -0.08, 0.03], [0.1, -0.16, 0.06]]
CONTROL = "".join(map(chr, (*range(0x20), 0x7F)))


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


def test_motions_that_are_drawn_are_places_too_and_absolute_ones_names_and_other_choices_are_not():
    arm, studies = Path("/lab/arm"), Path("/lab/studies")
    draws = {
        "motion": {"target": ["experiment.motion"], "choice": ["slow.toml", "drive-gains"]},
        "weight": {"target": "belief.payload", "choice": ["slow.toml"]},
        "number": {"target": "plant.gain", "distribution": "norm"},
        "nothing": {"choice": ["slow.toml"]},  # refused later, by name
    }
    moved = {**draws, "motion": {"target": ["experiment.motion"], "choice": ["../arm/slow.toml", "drive-gains"]}}
    for group in ("random", "sources"):
        assert seen_from({group: draws}, arm, studies) == {group: moved}
    for table in ({"robot": "/lab/robot.toml", "experiment": {"motion": "/lab/m.toml"}}, {"robot": "tx40"}):
        assert seen_from(table, arm, studies) == table
    table = {"robot": "./robot.toml", "experiment": {"motion": "slow/../m.toml"}}
    assert seen_from(table, arm, arm) == table


def test_a_file_that_is_not_there_is_told_with_the_key_that_asks_for_it(parent):
    path = child(parent)
    for name, key, error in (("motion.toml", "experiment.motion", WrongValue), ("robot.toml", "robot", ScenarioError)):
        (parent / name).unlink()
        with pytest.raises(error, match=rf"^mine: {key}: .*arm/{name}"):
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


def test_a_payload_has_the_deviations_that_its_table_states_and_one_with_a_name_has_none(tmp_path):
    (tmp_path / "two.toml").write_text(
        'extends = "nominal"\n[experiment]\nprotocol = ["bare", "heavy", "light"]\n'
        f'[plant]\npayloads = {{ heavy = "offset", light = {{ {BODY} }} }}\n'
        '[belief]\npayloads = { heavy = "offset", light = "offset" }\n'
    )
    (tmp_path / "mine.toml").write_text(
        f'extends = "two.toml"\n[belief.payloads]\nlight = {{ {BODY}, {DEVIATIONS} }}\n'
    )
    setup = setup_of(load_scenario(str(tmp_path / "mine.toml")))
    for payloads in (setup.payloads, stated_payloads(setup.scenario)):
        light, heavy = payloads["light"], payloads["heavy"]
        stds = (light.mass_std, *light.com_std, *light.inertia_std)
        assert stds == (0.02, 0.0, 0.003, 0.0, 0.0, 0.0, 0.002, 0.0, 0.0, 0.0)
        assert (heavy.mass, heavy.mass_std, *heavy.com_std, *heavy.inertia_std) == (5.087, *(0.0,) * 10)


def motion(folder: Path, off: float) -> FourierTrajectory:
    sine = [[0.1 + off, 0.1, -0.1], SINE[1]]
    text = f"duration = 8.0\ncenter = [0.1, -0.2]\nsine = {sine}\ncosine = {COSINE}\n"
    (folder / f"{off}.toml").write_text(text)
    return read_motion(f"{off}.toml", folder)


def test_a_motion_is_read_as_it_stands_and_a_start_that_is_off_by_a_millionth_is_no_rest(tmp_path):
    found = motion(tmp_path, 0.0)
    assert found.duration == 8.0
    for values, expected in ((found.center, [0.1, -0.2]), (found.sine, SINE), (found.cosine, COSINE)):
        np.testing.assert_allclose(values, expected, atol=1e-12)  # put to rest, which they are to rounding
    motion(tmp_path, 1e-7)
    with pytest.raises(ScenarioError, match=r"does not start at rest \(coefficients off by"):
        motion(tmp_path, 1e-5)


@pytest.mark.parametrize(
    "value",
    [
        f"a{CONTROL}b",
        'a "b" \\ c \\u007f',
        "\u00fcn\u00ef \u2028 \U0001f9be \U000e0001",
        ["x\x7f", [2.5, -3], []],
        {"mass": 7.3, "all": True, "deep": {"of": ("a", "b")}, "none": {}},
        -0.1 + 1e-17,
        float("inf"),
    ],
)
def test_a_value_is_read_back_as_it_was(value):
    text = toml_value(value)
    assert "\n" not in text
    expected = {**value, "deep": {"of": ["a", "b"]}} if isinstance(value, dict) else value
    assert tomllib.loads(f"x = {text}")["x"] == expected
