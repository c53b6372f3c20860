import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bad_files import refused
from plants import CYLINDER
from printed import printed
from robot_folders import robot_folder
from weighed_cell import with_other

import scenarios.design.search as module
from ident.model.arm import load_arm
from ident.model.structure import structure_of
from ident.payload.payload import Payload
from scenarios.cli import main
from scenarios.design.excitation import EXCESS, HALF_TURN, SHARES, Design, Limits
from scenarios.design.search import LEGS, Found, Series, best_fitted, hold_design, judge_in, search, starts
from scenarios.experiments.motions import read_motion
from scenarios.experiments.scenario import load_scenario, setup_of, setup_without_motion
from scenarios.prediction.deviations import Carried
from scenarios.support.errors import ScenarioError
from sim.errors import TrajectoryError
from sim.plant import Plant
from sim.robot import read_robot
from sim.trajectory import FourierTrajectory, at_rest

START = np.array([0.2, 0.3, -0.1])


@pytest.fixture(scope="module")
def design(tmp_path_factory) -> Design:
    """The problem of an invented arm of three joints, which has no shapes."""
    robot = read_robot(robot_folder(tmp_path_factory.mktemp("arm"), 3))
    body, structure = replace(CYLINDER, com=(0.05, -0.03, 0.14)), structure_of(load_arm(robot.model))
    plant = Plant(robot=robot, drives=robot.drives, payload=body)
    carried = Carried.nominal(Payload(mass=body.mass, com=body.com, inertia=body.inertia))
    known = {"plant": plant, "structure": structure, "carried": carried}
    return Design(**known, limits=Limits.of(plant), joints=np.arange(3), method="nls")


def test_the_best_of_random_motions_about_every_start_in_turn_is_taken(design):
    seen = list[np.ndarray]()

    def judge(points):
        seen.extend(points)
        return [0.25 if k == 7 else 0.5 for k in range(len(points))]

    series = Series.harmonic(design.limits, 3, 9.0)
    places = np.array([[0.1, 0.2, 0.3], [-0.4, -0.5, -0.6]])
    begun = module.random_point(series, places, 2, judge)
    np.testing.assert_array_equal([each[:3] for each in seen[6:8]], places)
    np.testing.assert_array_equal(begun.x, seen[7])
    assert (begun.cost, begun.tried) == (0.25, 0)
    drawn = np.array([each[6:].reshape(2, 3, 3) for each in seen])  # 300 draws of six: deviations to 2 %
    np.testing.assert_allclose(drawn.std(axis=(0, 1, 2)), np.arange(1.0, 4.0) ** -0.5, rtol=0.08)


def test_motions_are_judged_in_workers_in_their_order_at_the_cost_that_they_have(design):
    series = Series.harmonic(design.limits, 3, 6.0)
    rng = np.random.default_rng(1)
    points = [series.drawn(START, rng) for _ in range(5)]
    here = [design.cost(series.motion(x)) for x in points]
    assert len(set(here)) == 5
    with ThreadPoolExecutor(1) as pool:
        for workers in (1, 2, 7):
            assert judge_in(pool, workers, design, series)(points) == here


def test_a_search_starts_at_home_if_that_keeps_its_distance_else_elsewhere_if_it_can(design, monkeypatch):
    home, rng = np.array([0.2, 0.4, -0.3]), np.random.default_rng(0)
    np.testing.assert_array_equal(starts(design, home, rng), home[None])
    folded = np.array([0.0, 2.7, 0.0])  # into the floor
    found = starts(design, folded, rng)
    assert len(found) == 30
    assert not design.at_rest(found).any()
    assert design.at_rest(folded[None])[0] > 0.0
    np.testing.assert_allclose(design.at_rest(np.array([home, folded]))[1], design.at_rest(folded[None])[0], rtol=1e-12)
    share = np.abs(found - design.limits.center) / design.limits.half
    assert share.max() <= 0.9
    assert (share.max(axis=0) > 0.6).any()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Design, "at_rest", lambda self, q: np.maximum(q[:, 0], 0.0))  # half of the positions are feasible
        assert (starts(design, home, rng)[:, 0] <= 0.0).all()
    monkeypatch.setattr(module, "POSITIONS", 170)
    torque = design.limits.torque * np.array([1.0, 1e-4, 1.0])
    weak = replace(design, limits=replace(design.limits, torque=torque))
    said = r"robot invented: neither home nor any of 170 random .* takes \d+ % of the torque of joint axis2, where 80 %"
    with pytest.raises(TrajectoryError, match=said):
        starts(weak, np.zeros(3), np.random.default_rng(0))


def test_a_joint_without_limits_is_kept_within_half_a_turn_of_home_either_way(design, tmp_path):
    robot = read_robot(robot_folder(tmp_path, 3)).model_copy(update={"home": np.array([0.3, 0.7, -0.2])})
    ranged = '<joint name="axis2" axis="0 1 0" range="-2.9 2.9"/>'
    robot.model.write_text(robot.model.read_text().replace(ranged, '<joint name="axis2" axis="0 1 0"/>'))
    found = Limits.of(Plant(robot=robot, drives=robot.drives, payload=design.plant.payload))
    np.testing.assert_array_equal(found.lower, [-2.9, 0.7 - HALF_TURN, -2.9])
    np.testing.assert_array_equal(found.upper, [2.9, 0.7 + HALF_TURN, 2.9])


CASES = [  # costs in the search, costs after scaling (None: no size is small enough), which is taken, which are tried
    ([0.9, 0.5, 0.1], [0.9, 0.5, 0.49], 2, [2]),
    ([0.9, 0.5, 0.1], [0.9, 0.6, 0.7], 1, [2, 1]),
    ([0.4, 0.3, 0.1], [0.4, 0.9, None], 0, [2, 1, 0]),
    ([0.9, 0.118, 0.109, 0.105, 0.1], [0.9, 0.0, 0.0, 0.0, None], 1, [4, 1]),  # near ones
]


@pytest.mark.parametrize(("searched", "after", "taken", "tried"), CASES)
def test_the_motion_that_costs_least_after_scaling_is_taken_and_those_that_cannot_are_not_tried(
    searched, after, taken, tried
):
    seen: list[int] = []

    def fitted(k: int) -> int:
        seen.append(k)
        if after[k] is None:
            raise TrajectoryError(f"{k} is too fast")
        return k

    stub = SimpleNamespace(fitted=fitted, cost=lambda k: after[k])
    series = SimpleNamespace(motion=lambda x: x)
    kept = [Found(x=k, cost=cost, tried=7) for k, cost in enumerate(searched)]
    assert best_fitted(stub, series, kept) == taken
    assert seen == tried
    after = [None] * len(after)
    with pytest.raises(TrajectoryError, match=f"^no motion found .*; the best one: {len(kept) - 1} is too fast"):
        best_fitted(stub, series, kept)


def test_a_speed_that_is_reached_between_the_samples_of_the_search_counts(design):
    cosine = np.zeros((3, 30))
    cosine[:, -1] = 0.02, 0.03, -0.01  # 5 Hz: at rest at every sample of 10 Hz
    motion = FourierTrajectory(START, np.zeros((3, 30)), cosine, 6.0)
    fastest = 10.0 * np.pi * np.abs(cosine[:, -1]) / (SHARES["speed"] + EXCESS)
    free = replace(design.limits, acceleration=np.full(3, 1e3), torque=np.full(3, 1e5))
    for factor, kept in ((0.99, False), (1.01, True)):
        assert replace(design, limits=replace(free, velocity=factor * fastest)).keeps_limits(motion) is kept


def test_a_motion_about_a_centre_that_cannot_be_held_is_shrunk_about_a_position_that_can(design):
    q, cosine = np.array([0.0, 2.7, 0.0]), np.zeros((3, 3))  # into the floor
    cosine[1, 0] = 2.4
    motion = at_rest(q, np.zeros((3, 3)), cosine, 12.0)
    found = design.fitted(motion)
    assert design.keeps_limits(found)
    size = found.cosine[1, 0] / motion.cosine[1, 0]
    assert 0.1 < size < 0.9
    pose = (found.center - size * motion.center) / (1.0 - size)
    np.testing.assert_array_equal(design.at_rest(np.array([q, pose])) == 0.0, [False, True])


def test_a_point_s_holds_rest_at_its_poses_and_between_and_come_back_the_same_way(design):
    holds = Series.holds(design.limits, 72.0)
    x = holds.drawn(START, np.random.default_rng(2))
    motion = holds.motion(x)
    q, dq, _ = motion(np.linspace(0.0, 72.0, 4 * LEGS + 1))  # the middle of each hold
    poses = q[: 2 * LEGS + 1 : 2]
    visits = np.arange(0.0, LEGS + 0.5, 0.5)
    there = np.stack([np.interp(visits, np.arange(LEGS + 1), each) for each in poses.T], axis=1)
    size = np.abs(np.diff(poses, axis=0)).max()
    np.testing.assert_allclose(q, np.concatenate((there, there[-2::-1])), rtol=0, atol=4e-3 * size)  # smoothed kinks
    weights = x[2 * holds.n :].reshape(holds.n, LEGS + 1).T
    scale = (poses[1:] - poses[0]) / (weights[1:] - weights[0])
    np.testing.assert_allclose(scale, np.tile(scale[0], (LEGS, 1)), rtol=0.03)  # the same
    fastest = np.abs(motion(np.arange(0.0, 72.0, 0.02))[1]).max()
    assert np.abs(dq).max() < 0.03 * fastest
    t = np.linspace(0.0, 36.0, 50)
    np.testing.assert_allclose(motion(t)[0], motion(72.0 - t)[0], rtol=0, atol=1e-12)


def test_a_path_may_be_passed_several_times(design):
    thrice = Series.harmonic(design.limits, 4, 9.0, 3)
    motion = thrice.motion(thrice.drawn(START, np.random.default_rng(2)))
    t = np.linspace(0.0, 3.0, 40)
    np.testing.assert_allclose(motion(t)[0], motion(t + 3.0)[0], rtol=0, atol=1e-12)
    assert np.abs(motion(t)[0] - motion(t + 1.5)[0]).max() > 0.1


def test_the_point_of_a_motion_gives_the_motion_which_uses_a_share_of_the_limits(design):
    for series in (Series.holds(design.limits, 72.0), Series.harmonic(design.limits, 5, 9.0)):
        motion = series.motion(series.drawn(START, np.random.default_rng(2)))
        again, size = series.motion(series.point(motion)), np.abs(motion.cosine).max()
        for name in ("center", "sine", "cosine"):
            np.testing.assert_allclose(getattr(again, name), getattr(motion, name), rtol=0, atol=1e-6 * size)
        share = 1.0 / design.limits.largest_scale(motion)
        assert ((share > 0.25) & (share < 1.0)).all()


def test_holds_are_slow_use_less_torque_and_want_what_gravity_loads_and_a_joint_at_rest_shows_nothing(design):
    held, unloaded = hold_design(design)
    held = pickle.loads(pickle.dumps(held))
    assert not np.intersect1d(held.joints, np.flatnonzero(unloaded)).size
    assert (held.limits.velocity <= 0.5 / 0.95 + 1e-12).all()
    holds = Series.holds(held.limits, 72.0)
    moving = holds.motion(holds.drawn(START, np.random.default_rng(1)))
    nearly = FourierTrajectory(moving.center, 1e-6 * moving.sine, 1e-6 * moving.cosine, 72.0)
    assert (held.deviations(nearly)[held.joints] > 0.9).all()  # what is known beforehand: 1
    assert (held.deviations(moving)[held.joints] < 0.1).any()
    rows = design.rows(moving)
    weighted, share = rows.weighted(held.slow), rows.motion[1] ** 2 / (rows.motion[1] ** 2 + 0.1**2)
    for found, raw in ((weighted.W, rows.W), (weighted.Y, rows.Y), (weighted.rigid[..., None], rows.rigid[..., None])):
        np.testing.assert_allclose(found, share[:, :, None] * raw, rtol=0, atol=1e-5 * np.abs(found).max())
    with pytest.raises(ScenarioError, match="puts no torque on any joint to identify"):
        hold_design(replace(design, joints=np.flatnonzero(unloaded)))
    with pytest.raises(ScenarioError, match=r"--duration 35: .* need 36 s"):
        Series.holds(held.limits, 35.0)
    np.testing.assert_allclose(held.limits.torque * 0.8, design.limits.torque * 0.7, rtol=1e-12)


@pytest.mark.slow
def test_the_command_writes_a_motion_file_of_holds(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(module, "FIRST", 8)
    out = tmp_path / "motion.toml"
    words = ["excite", "ur10e", "--protocol", "holds", "--evaluations", "1", "--jobs", "1", "--out", str(out)]
    assert main(words) == 0
    said = capsys.readouterr()
    assert "puts no torque on joint 1: holds" in said.err
    assert "Joint Standard deviation % 1 - 2 0." in " ".join(said.out.split())
    assert "excite ur10e --protocol holds --seed 0 --duration 72 --evaluations 1 --out FILE" in out.read_text()
    assert read_motion(out.name, tmp_path).duration == 72.0
    assert main([*words, "--harmonics=9", "--force"]) == 2
    assert "cannot be combined with --protocol holds" in capsys.readouterr().err


SHORT = ["--harmonics", "3", "--duration", "6", "--evaluations", "60", "--seed", "5"]


def test_a_search_that_is_stopped_leaves_its_best_which_an_improving_search_starts_from(tmp_path, capsys, monkeypatch):
    def stopped(*given):
        for k, found in enumerate(search(*given)):
            if k > 2:
                raise KeyboardInterrupt
            yield found

    path = tmp_path / "m.toml"
    monkeypatch.setattr(module, "FIRST", 8)
    monkeypatch.setattr(Design, "fitted", lambda self, motion: motion)  # so short a search may not keep its limits yet
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "search", stopped)
        assert main(["excite", "nominal", "--out", str(path), *SHORT]) == 130
    assert "in m.toml; to continue" in capsys.readouterr().err.replace(f"{tmp_path}/", "")
    found_by = "# Found by: rx90 excite nominal --seed 5 --harmonics 3 --duration 6 --evaluations 60 --out FILE"
    for line in (found_by, "# Stopped after 30 of 60 motions."):  # 2 of 4 + 3 ln 48
        assert line in path.read_text()
    (tmp_path / "cell.toml").write_text('extends = "nominal"\n[experiment]\nmotion = "m.toml"\n')
    left, out = read_motion("m.toml", tmp_path), str(tmp_path / "better.toml")
    words = ["excite", str(tmp_path / "cell.toml"), *SHORT, "--improve", "--out", out, "--json"]
    assert main(words) == 0
    design = Design.of(setup_without_motion(load_scenario("nominal")))
    found, better = printed(capsys, "excite"), read_motion("better.toml", tmp_path)
    # A joint that uses all of a limit begins 0.1 % less, one that uses little with a quarter.
    np.testing.assert_allclose(found["cost_of_start"], design.cost(left), rtol=0, atol=0.01)
    assert found["cost"] <= found["cost_of_start"]
    assert found["tried"] == 5 * 15  # generations of 4 + 3 ln 48, until there are more than 60
    assert design.cost(better) <= design.cost(left)
    assert better.sine.shape == left.sine.shape == (6, 3)
    assert "Stopped" not in (tmp_path / "better.toml").read_text()
    assert "--improve --out FILE" in (tmp_path / "better.toml").read_text()
    for more in (["--harmonics", "2"], ["--duration", "7"]):
        assert "search with --duration 6 and --harmonics 3 or more" in refused(capsys, with_other(words, *more))


def test_a_search_that_improves_writes_the_scenario_s_own_motion_where_it_finds_none_better(
    tmp_path, capsys, monkeypatch
):
    given = []
    monkeypatch.setattr(module, "search", lambda first, *more: given.extend(more) or iter([first]))
    monkeypatch.setattr(Series, "point", lambda self, _: self.drawn(np.zeros(6), np.random.default_rng(0)))
    assert main(["excite", "tx40", "--out", str(tmp_path / "m.toml"), "--improve"]) == 0
    assert given[:3] == [module.SMALL_STEP, 0, 40000]
    said = capsys.readouterr()
    assert "so the scenario's own motion is written" in said.err
    shown = " ".join(said.out.split())
    start, now, change = map(float, re.search(r"at the start (\S+) %, now (\S+) % \((\S+) %\)", shown).groups())
    own, written = setup_of(load_scenario("tx40")).experiments[0].trajectory, read_motion("m.toml", tmp_path)
    worst = 100.0 * Design.of(setup_without_motion(load_scenario("tx40"))).worst(own)
    np.testing.assert_allclose((now, change), (worst, 100.0 * (worst / start - 1.0)), rtol=0.01, atol=0.5)
    np.testing.assert_allclose(written.cosine, own.cosine, rtol=1e-12)  # a start at rest is made anew
