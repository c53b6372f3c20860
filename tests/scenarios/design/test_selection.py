"""Which motion of a search a robot is given: the best, or what can be fitted where that cannot."""

import re
from dataclasses import replace

import numpy as np
import pytest
from invented_arm import invented_problem

from scenarios.design.excitation import EXCESS, FITTED_HZ, SHARES, Design, Problem
from scenarios.design.search import (
    APART,
    Found,
    Series,
    about_a_pose,
    best_fitted,
    first_fitted,
    quickened,
    with_better,
)
from sim.errors import TrajectoryError
from sim.trajectory import FourierTrajectory, at_rest

USED = SHARES["speed"] + EXCESS
"""Share of its speed limit that a found motion may use between the samples of the search."""


@pytest.fixture(scope="module")
def problem(tmp_path_factory) -> Problem:
    return invented_problem(tmp_path_factory.mktemp("arm"))


@pytest.fixture(scope="module")
def series(problem) -> Series:
    return Series(limits=problem.limits, harmonics=3, duration=6.0)


def point(series: Series, seed: int, cost: float, center=(0.2, 0.3, -0.1)) -> Found:
    return Found(x=series.drawn(np.array(center), np.random.default_rng(seed)), cost=cost, tried=7)


def impossible(series: Series, seed: int, cost: float) -> Found:
    """About a centre so near the end of joint 2 that no motion about it is small enough."""
    return point(series, seed, cost, center=(0.0, 2.7, 0.0))


def allowing(problem: Problem, motion: FourierTrajectory, size: float) -> Design:
    """The problem on a robot whose speeds allow as much of a motion, and not 1 % more."""
    fastest = np.abs(motion(np.arange(0.0, motion.duration, 1.0 / FITTED_HZ))[1]).max(axis=0)
    return Design(replace(problem, limits=replace(problem.limits, velocity=1.001 * size * fastest / USED)))


def size_of(motion: FourierTrajectory, of: FourierTrajectory) -> float:
    np.testing.assert_array_equal(motion.center, of.center)
    ratios = np.concatenate((motion.sine / of.sine, motion.cosine / of.cosine))
    np.testing.assert_allclose(ratios, ratios[0, 0], rtol=1e-12)  # rounding
    return float(ratios[0, 0])


@pytest.mark.parametrize("size", [0.96, 0.91, 0.9])
def test_the_best_motion_is_scaled_with_a_reason_from_a_tenth_on(problem, series, size):
    best = point(series, 8, -9.7)
    design = allowing(problem, series.motion(best.x), size)
    kept = (point(series, 3, -9.5), best) if size > 0.9 else (best,)
    motion, reason = best_fitted(design, series, kept)
    np.testing.assert_allclose(size_of(motion, series.motion(best.x)), size, rtol=1e-12)
    assert design.keeps_limits(motion)
    said = r"even scaled to 91 %, the motion takes \d+ % of the speed of joint " if size <= 0.9 else "$"
    assert re.match(said, reason)


@pytest.mark.parametrize(("seed", "taken"), [(3, "earlier"), (4, "small")])
def test_of_the_best_made_small_and_an_earlier_motion_that_fits_the_one_that_costs_less_is_taken(
    problem, series, seed, taken
):
    best, earlier = point(series, 8, -9.7), point(series, seed, -9.5)
    best.x[3:6] = 3.0  # joints move by 96 % of the largest motion
    earlier.x[3:6] = -1.5  # by 39 %
    design = allowing(problem, series.motion(best.x), 0.42)
    motions = {
        "small": design.fitted(series.motion(best.x), np.array([0.42])),
        "earlier": design.fitted(series.motion(earlier.x)),
    }
    costs = {name: design.cost(motion) for name, motion in motions.items()}
    assert min(costs, key=costs.__getitem__) == taken
    found, _ = best_fitted(design, series, (earlier, best))
    np.testing.assert_allclose(found.sine, motions[taken].sine, rtol=1e-12)  # rounding of the size


def test_where_nothing_can_be_fitted_the_search_is_refused_with_what_is_wrong_with_its_best(problem, series):
    kept = (impossible(series, 5, -4.8), impossible(series, 6, -4.9))
    with pytest.raises(
        TrajectoryError,
        match=r"^no motion found can be scaled to the robot's limits; "
        "the best one: .* range of joint axis2, where",
    ):
        best_fitted(Design(problem), series, kept)


def test_only_better_motions_are_kept_best_last_and_near_ones_make_room():
    def found(cost: float) -> Found:
        return Found(x=np.array([cost]), cost=cost, tried=3)

    kept: tuple[Found, ...] = ()
    for cost in (0.5, 0.7, 0.5, 0.496, 0.4935, 0.487, 0.3, 0.31):
        kept = with_better(kept, found(cost))
    assert [each.cost for each in kept] == [0.5, 0.487, 0.3]
    assert len(with_better(kept, found(0.3))) == len(kept)
    near = with_better((found(0.9), found(0.5), found(0.495)), found(0.3))
    assert [each.cost for each in near] == [0.9, 0.5, 0.3]
    edge = with_better((found(APART), found(0.0)), found(-0.4))
    assert [each.cost for each in edge] == [APART, 0.0, -0.4]


def test_searches_are_made_until_the_best_of_one_is_fitted(problem, series):
    design, made = Design(problem), []
    searches = {
        "refused": (impossible(series, 5, -4.8),),
        "earlier": (point(series, 4, -4.1), impossible(series, 6, -4.9)),
        "another": (point(series, 6, -4.2), impossible(series, 6, -4.9)),
        "fits": (point(series, 3, -4.0),),
    }

    def of(*names: str):
        made.clear()
        for name in names:
            made.append(name)
            yield searches[name]

    found = first_fitted(design, series, of("refused", "earlier", "fits", "refused"))
    np.testing.assert_array_equal(found.sine, series.motion(searches["fits"][0].x).sine)
    assert made == ["refused", "earlier", "fits"]
    found = first_fitted(design, series, of("earlier", "refused"))
    np.testing.assert_array_equal(found.sine, series.motion(searches["earlier"][0].x).sine)
    cheaper, dearer = sorted(("earlier", "another"), key=lambda name: design.cost(series.motion(searches[name][0].x)))
    for order in ((cheaper, dearer), (dearer, cheaper)):
        found = first_fitted(design, series, of(*order))
        np.testing.assert_array_equal(found.sine, series.motion(searches[cheaper][0].x).sine)
    with pytest.raises(TrajectoryError, match="no motion found can be scaled"):
        first_fitted(design, series, of("refused", "refused"))


@pytest.mark.parametrize(("factor", "kept"), [(0.99, False), (1.01, True)])
def test_a_speed_that_is_reached_between_the_samples_of_the_search_counts(problem, factor, kept):
    cosine = np.zeros((3, 30))
    cosine[:, -1] = 0.02, 0.03, -0.01  # 5 Hz: at rest at every sample of 10 Hz
    motion = FourierTrajectory(np.array([0.2, 0.3, -0.1]), np.zeros((3, 30)), cosine, 6.0)
    fastest = 10.0 * np.pi * np.abs(cosine[:, -1])
    free = replace(problem.limits, acceleration=np.full(3, 1e3), torque=np.full(3, 1e5))
    design = Design(replace(problem, limits=replace(free, velocity=factor * fastest / USED)))
    assert design.keeps_limits(motion) is kept


def test_a_slow_motion_is_repeated_faster_as_long_as_limits_allow(problem):
    design, q = Design(problem), np.array([0.2, 0.3, -0.1])
    slow = design.fitted(at_rest(q, *(0.15 * np.random.default_rng(4).standard_normal((2, 3, 4))), 20.0))
    quick = quickened(design, slow)
    times = quick.sine.shape[1] // 4
    assert times > 1
    t = np.linspace(0.0, 20.0 / times, 50)
    (was, speed, _), (now, faster, _) = slow(times * t), quick(t)
    np.testing.assert_allclose(now, was, atol=1e-12)  # rounding: the same path
    np.testing.assert_allclose(faster, times * speed, atol=1e-12)
    assert design.keeps_limits(quick)
    assert design.cost(quick) < design.cost(slow)
    tight = Design(replace(problem, limits=replace(problem.limits, velocity=np.abs(slow(times * t)[1]).max(axis=0))))
    np.testing.assert_array_equal(quickened(tight, slow).sine, slow.sine)  # no speed is left


def test_a_motion_about_a_centre_that_cannot_be_held_is_shrunk_about_a_position_that_can(problem):
    design, q, cosine = Design(problem), np.array([0.0, 2.7, 0.0]), np.zeros((3, 3))  # into the floor
    cosine[1, 0] = 2.4
    motion = at_rest(q, np.zeros((3, 3)), cosine, 12.0)
    (found,) = about_a_pose(design, motion)
    assert design.keeps_limits(found)
    assert not design.can_hold(q)
    size = found.cosine[1, 0] / motion.cosine[1, 0]
    assert 0.1 < size < 0.9
    pose = (found.center - size * motion.center) / (1.0 - size)
    assert design.can_hold(pose)
