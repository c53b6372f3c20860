import json
import shutil
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from printed import fits
from quick import quick_scenario

from ident.estimation.problem import GainOptions
from ident.observation.observation import ObserveOptions
from ident.support.errors import IdentificationError
from scenarios.experiments.run import Simulated, as_identified, simulate
from scenarios.experiments.scenario import load_scenario, setup_of
from scenarios.results.problem_folder import PROBLEM, read_problem, write_problem
from scenarios.results.run_folder import simulated_problem
from scenarios.support.errors import ScenarioError

OBSERVING = ObserveOptions(reversal_speed=0.13, cutoff_hz=14.0)
GAINS = GainOptions(max_rel_std=0.21, uncertainty="jackknife")
DIFFERENT = """
[belief]
couplings = [[5, 6]]
[belief.payloads]
light = { mass = 2.3, com = [0.01, 0.02, 0.1], inertia = { ixx = 0.004, iyy = 0.005, izz = 0.006 } }
[plant.payloads]
light = { mass = 2.3, com = [0.01, 0.02, 0.1], inertia = { ixx = 0.004, iyy = 0.005, izz = 0.006 } }
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Simulated:
    """Light, bare, loaded, light: four motions, two mountings, the first of them twice."""
    path = quick_scenario(tmp_path_factory.mktemp("quick"), DIFFERENT)
    text = path.read_text().replace("[experiment]", '[experiment]\nprotocol = ["light", "bare", "loaded", "light"]')
    path.write_text(text)
    return simulate(setup_of(load_scenario(str(path))), 5)


@pytest.fixture(scope="module")
def folder(done, tmp_path_factory):
    place = tmp_path_factory.mktemp("problems") / "one"
    write_problem(place, replace(simulated_problem(done.setup, done.recordings), observing=OBSERVING, gains=GAINS))
    return place


def test_what_is_read_back_is_what_identification_was_given(done, folder):
    found, given = read_problem(folder), as_identified(done.setup, done.recordings)
    assert (found.observing, found.gains) == (OBSERVING, GAINS)
    assert found.arm.couplings == ((4, 5),)
    assert found.folder == folder
    assert len(found.motions) == 4
    for one, other in zip(found.motions, given, strict=True):
        np.testing.assert_array_equal(one.recording.t, other.recording.t)
        np.testing.assert_array_equal(one.recording.q, other.recording.q)
        np.testing.assert_array_equal(one.recording.v, other.recording.v)
        assert one.payload == other.payload
    light, again, bare, loaded = (motion.payload for motion in found.motions)
    assert light is again  # one mounting, together where the first is
    assert bare is None
    assert loaded not in (None, light)
    fits(json.loads((folder / PROBLEM).read_text()), "problem")


def test_nothing_of_the_truth_is_in_the_folder(done, folder):
    assert {path.name for path in folder.iterdir()} == {
        PROBLEM, "robot.xml", "payload-1.toml", "payload-2.toml", *(f"motion-{k}.parquet" for k in (1, 2, 3, 4))
    }  # fmt: skip
    texts = "".join(path.read_text() for path in folder.iterdir() if path.suffix != ".parquet")
    for gain in done.setup.true_gain[:4]:
        assert f"{gain:g}" not in texts
    assert done.setup.scenario.name not in texts
    spec = mujoco.MjSpec.from_file(str(folder / "robot.xml"))
    for body in spec.bodies[3:]:
        assert body.mass == 1.0
        np.testing.assert_array_equal(body.inertia, [1.0, 1.0, 1.0])


def test_gravity_and_deviations_of_a_payload_are_kept(tmp_path, done):
    problem = simulated_problem(done.setup, done.recordings)
    motions = problem.motions
    tilted = tmp_path / "tilted.xml"
    tilted.write_text(problem.model.read_text().replace('gravity="0 0 -9.81"', 'gravity="1.5 -2 -9.4"'))
    weighed = replace(motions[0].payload, mass_std=0.0123, known="mass")
    given = [motions[2], replace(motions[0], payload=weighed)]
    write_problem(tmp_path / "p", replace(problem, model=tilted, motions=given))
    found = read_problem(tmp_path / "p")
    np.testing.assert_array_equal(found.arm.gravity, [1.5, -2.0, -9.4])
    assert [each.payload for each in found.motions] == [None, weighed]


WRONG = [
    ("{", "not JSON"),
    ({"robot": {"model": "../robot.xml"}}, "robot.model: string should match pattern"),
    ({"observe": {"cutof_hz": 3.0}}, "observe: unknown key 'cutof_hz'"),
]


@pytest.mark.parametrize(("change", "message"), WRONG, ids=lambda value: None)
def test_an_impossible_problem_file_is_refused_with_its_place(change, message, folder, tmp_path):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    known = json.loads((folder / PROBLEM).read_text())
    (tmp_path / PROBLEM).write_text(change if isinstance(change, str) else json.dumps({**known, **change}))
    with pytest.raises(ScenarioError, match=PROBLEM) as caught:
        read_problem(tmp_path)
    assert message.lower() in str(caught.value).lower()
    assert "\n" not in str(caught.value)


def test_a_file_that_is_missing_is_named(folder, tmp_path):
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True)
    (tmp_path / "motion-3.parquet").unlink()
    with pytest.raises(IdentificationError, match=r"motion-3\.parquet"):
        read_problem(tmp_path)
    (tmp_path / PROBLEM).unlink()
    with pytest.raises(ScenarioError, match=r"problem\.json: no such file"):
        read_problem(tmp_path)
