"""What is made of a motion that was found: a quicker one, and a smaller one about a position that can be held."""

from dataclasses import replace

import numpy as np
import pytest
from invented_arm import invented_problem

from scenarios.design.excitation import Design, Problem
from scenarios.design.fitting import about_a_pose, quickened
from scenarios.design.search import admissible
from sim.trajectory import at_rest


@pytest.fixture(scope="module")
def problem(tmp_path_factory) -> Problem:
    return invented_problem(tmp_path_factory.mktemp("arm"))


def test_a_slow_motion_is_quickened_to_the_multiple_of_its_pace_that_shows_most_within_the_limits(problem):
    design, q = Design(problem), np.array([0.2, 0.3, -0.1])
    rng = np.random.default_rng(4)
    slow = design.fitted(at_rest(q, *(0.15 * rng.standard_normal((2, 3, 4))), 20.0))
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
    design = Design(problem)
    q = np.array([0.0, 2.7, 0.0])  # into the floor
    cosine = np.zeros((3, 3))
    cosine[1, 0] = 2.4
    motion = at_rest(q, np.zeros((3, 3)), cosine, 12.0)
    (found,) = about_a_pose(design, motion)
    assert design.keeps_limits(found)
    assert not admissible(design, q[None])[0]
    assert np.abs(found.cosine).max() > 0.1
