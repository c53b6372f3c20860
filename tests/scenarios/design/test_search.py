from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from invented_arm import invented_problem
from robot_folders import robot_folder

import scenarios.design.search as module
from scenarios.cli import main
from scenarios.commands.excite import unfinished
from scenarios.design.excitation import HALF_TURN, Design, Limits, Problem, design_problem, robot_limits
from scenarios.design.search import (
    LEAST_SHARE,
    SMALL_STEP,
    STEP,
    Series,
    admissible,
    judge_here,
    judge_in,
    random_point,
    search,
    starts,
)
from scenarios.experiments.motions import read_motion
from scenarios.experiments.scenario import load_scenario, setup_of, setup_without_motion
from sim.errors import TrajectoryError
from sim.plant import Plant
from sim.robot import read_robot


def limits(n: int = 3) -> Limits:
    return Limits(
        lower=-np.array([2.9, 1.7, 3.3])[:n],
        upper=np.array([2.1, 2.7, 1.3])[:n],
        velocity=np.array([3.0, 2.0, 4.0])[:n],
        acceleration=np.array([9.0, 14.0, 31.0])[:n],
        torque=np.array([400.0, 300.0, 100.0])[:n],
    )


SERIES = Series(limits=limits(), harmonics=4, duration=9.0)


@pytest.fixture(scope="module")
def problem(tmp_path_factory) -> Problem:
    return invented_problem(tmp_path_factory.mktemp("arm"))


def test_a_point_s_motion_moves_each_joint_by_its_share_of_what_its_limits_allow():
    x = SERIES.drawn(np.array([-0.3, 0.5, -0.9]), np.random.default_rng(4))
    motion = SERIES.motion(x)
    np.testing.assert_array_equal(motion.center, x[:3])
    share = LEAST_SHARE + (1.0 - LEAST_SHARE) / (1.0 + np.exp(-x[3:6]))
    q, dq, ddq = motion(np.arange(0.0, 9.0, 0.02))
    room = 0.9 * np.minimum(limits().upper - motion.center, motion.center - limits().lower)
    used = np.maximum.reduce(
        [
            np.abs(q - motion.center).max(axis=0) / room,
            np.abs(dq).max(axis=0) / (0.95 * limits().velocity),
            np.abs(ddq).max(axis=0) / (0.95 * limits().acceleration),
        ]
    )
    np.testing.assert_allclose(used, share, rtol=1e-12)  # rounding


def test_the_point_of_a_motion_gives_the_motion_again():
    motion = SERIES.motion(SERIES.drawn(np.array([-0.3, 0.5, -0.9]), np.random.default_rng(4)))
    again = SERIES.motion(SERIES.point(motion))
    for name in ("center", "sine", "cosine"):
        np.testing.assert_allclose(getattr(again, name), getattr(motion, name), rtol=0, atol=1e-12)  # rad, rounding


def squares(points):
    return [float(np.sum((x - 0.7) ** 2)) for x in points]


def test_a_search_tells_the_best_so_far_and_how_many_it_tried():
    first = random_point(SERIES, np.zeros((1, 3)), 5, squares)
    told = list(search(first, STEP, 5, 200, squares))
    assert told[0] is first
    assert first.tried == 0
    assert [found.cost for found in told] == sorted((found.cost for found in told), reverse=True)
    assert all(found.cost == squares([found.x])[0] for found in told)
    steps = np.diff([found.tried for found in told])
    assert (steps == steps[0]).all()
    assert 200 <= told[-1].tried < 200 + steps[0]


def test_random_motions_begin_at_every_start_in_turn_and_the_best_of_them_is_taken():
    seen: list[np.ndarray] = []

    def third(points):
        seen.extend(points)
        return [0.5 if k != 7 else 0.25 for k in range(len(points))]

    begun = random_point(SERIES, np.array([[0.1, 0.2, 0.3], [-0.4, -0.5, -0.6]]), 2, third)
    np.testing.assert_array_equal(seen[6][:3], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(seen[7][:3], [-0.4, -0.5, -0.6])
    np.testing.assert_array_equal(begun.x, seen[7])
    assert begun.cost == 0.25
    assert len(seen) == 300


def test_motions_are_judged_the_same_and_in_their_order_wherever(problem):
    series = Series(limits=problem.limits, harmonics=3, duration=6.0)
    rng = np.random.default_rng(1)
    points = [series.drawn(np.array([0.2, 0.3, -0.1]), rng) for _ in range(5)]
    here = judge_here(Design(problem), series)(points)
    assert len(set(here)) == 5
    with ThreadPoolExecutor(1) as pool:
        for workers in (1, 2, 7):
            assert judge_in(pool, workers, problem, series)(points) == here


def test_a_search_starts_at_home_where_home_keeps_its_distance_and_elsewhere_if_not(problem):
    design = Design(problem)
    home, rng = np.array([0.2, 0.4, -0.3]), np.random.default_rng(0)
    np.testing.assert_array_equal(starts(design, home, rng), home[None])
    folded = np.array([0.0, 2.7, 0.0])  # into the floor
    found = starts(design, folded, rng)
    assert len(found) == 30
    assert admissible(design, found).all()
    assert not admissible(design, folded[None])[0]
    half = 0.5 * (problem.limits.upper - problem.limits.lower)
    center = 0.5 * (problem.limits.upper + problem.limits.lower)
    assert (np.abs(found - center) <= 0.9 * half).all()
    assert (np.abs(found - center).max(axis=0) > 0.6 * half).any()


SAID = (
    r"robot invented: neither home nor any of 170 random positions is "
    r"feasible: at 100 % of them, arm and payload are too heavy "
    r"for joint axis2; check these shapes and torques, or take a lighter"
)


def test_a_robot_that_cannot_hold_its_payload_anywhere_is_refused(problem, monkeypatch):
    monkeypatch.setattr(module, "POSITIONS", 170)
    torque = problem.limits.torque * np.array([1.0, 1e-4, 1.0])
    weak = Design(replace(problem, limits=replace(problem.limits, torque=torque)))
    with pytest.raises(TrajectoryError, match=SAID):
        starts(weak, np.zeros(3), np.random.default_rng(0))


def test_a_joint_without_limits_is_kept_within_half_a_turn_of_home_either_way(problem, tmp_path):
    path = robot_folder(tmp_path, 3)
    robot = replace(read_robot(path), home=np.array([0.3, 0.7, -0.2]))
    text = robot.model.read_text().replace(
        '<joint name="axis2" axis="0 1 0" range="-2.9 2.9"/>', '<joint name="axis2" axis="0 1 0"/>'
    )
    robot.model.write_text(text)
    found = robot_limits(Plant(robot=robot, drives=robot.drives, payload=problem.plant.payload))
    np.testing.assert_array_equal(found.lower, [-2.9, 0.7 - HALF_TURN, -2.9])
    np.testing.assert_array_equal(found.upper, [2.9, 0.7 + HALF_TURN, 2.9])


SHORT = ["--harmonics", "3", "--duration", "6", "--evaluations", "60", "--seed", "5"]


@pytest.fixture
def stopping(monkeypatch):
    """Stops a search after so many generations, as Ctrl-C does; it begins with few random motions."""
    monkeypatch.setattr(module, "FIRST", 8)

    def stop_after(generations: int) -> None:
        def few(*given):
            for k, found in enumerate(search(*given)):
                if k > generations:
                    raise KeyboardInterrupt
                yield found

        monkeypatch.setattr(module, "search", few)

    return stop_after


def test_a_search_that_is_stopped_leaves_its_best_and_the_same_command_goes_on(tmp_path, capsys, stopping, monkeypatch):
    path = tmp_path / "m.toml"
    words = ["excite", "nominal", "--out", str(path), *SHORT]
    stopping(2)
    monkeypatch.setattr(Design, "fitted", lambda self, motion: motion)  # so short a search may not keep its limits yet
    assert main(words) == 130
    text = path.read_text()
    assert "repeat the command to continue" in capsys.readouterr().err
    assert "# Stopped after 30 of 60 motions; repeat the command to continue." in text  # 2 of 4 + 3 ln 48
    left = read_motion("m.toml", tmp_path)
    command = "rx90 excite nominal --seed 5 --harmonics 3 --duration 6 --evaluations 60"
    before = unfinished(path, command)
    assert before is not None
    assert before[1] == 30
    assert unfinished(path, command.replace("seed 5", "seed 3")) is None
    assert unfinished(tmp_path / "none.toml", command) is None
    resumed = []

    def rest(first, step, seed, evaluations, judge):
        resumed.append((first.tried, step, seed, evaluations))
        return search(first, step, seed, evaluations, judge)

    monkeypatch.setattr(module, "search", rest)
    assert main(words) == 0
    assert resumed == [(30, SMALL_STEP, 5 + 30, 60 - 30)]
    said = capsys.readouterr().err
    cost, found = (float(word.rstrip(".")) for word in _costs(said))
    assert (
        "the scenario's own motion is better: the largest standard deviation of its gains is 0.362 %, "
        "that of the motion found " in said
    )
    assert "try more --evaluations, or --improve, which starts from it" in said
    assert found <= cost
    assert "Stopped" not in path.read_text()
    assert unfinished(path, command) is None
    assert read_motion("m.toml", tmp_path).sine.shape == left.sine.shape == (6, 3)


IMPROVING = ["--harmonics", "20", "--evaluations", "25", "--improve"]


def test_a_search_that_improves_begins_with_the_scenario_s_own_motion(tmp_path, capsys):
    path = tmp_path / "m.toml"
    assert main(["excite", "tx40", "--out", str(path), *IMPROVING]) == 0
    cost, found = (float(word.rstrip(".")) for word in _costs(capsys.readouterr().err))
    scenario = load_scenario("tx40")
    design = Design(design_problem(setup_without_motion(scenario)))
    own = setup_of(scenario).experiments[0].trajectory
    np.testing.assert_allclose(cost, design.cost(own), rtol=0, atol=3e-3)  # what uses all its limit begins 0.1 % less
    assert found <= cost
    assert design.cost(read_motion("m.toml", tmp_path)) < cost
    assert "--improve --out FILE" in path.read_text()


def _costs(error: str) -> list[str]:
    words = next(line for line in error.splitlines() if "cost of the start" in line).replace(",", "").split()
    return [words[words.index(word) + 1] for word in ("start", "found")]
