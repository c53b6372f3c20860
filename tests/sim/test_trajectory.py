import numpy as np
import pytest
from plants import short_motion

from sim.trajectory import at_rest


def test_velocity_and_acceleration_are_the_derivatives():
    motion, h = short_motion(2.0), 1e-5
    t = np.linspace(0.1, 1.9, 50)
    q, dq, ddq = motion(t)
    before, after = motion(t - h), motion(t + h)
    # Central differences: h^2 / 6 times the third derivative, some 1e-8, and rounding over h, 1e-11.
    np.testing.assert_allclose((after[0] - before[0]) / (2 * h), dq, rtol=0, atol=1e-7)
    np.testing.assert_allclose((after[1] - before[1]) / (2 * h), ddq, rtol=0, atol=1e-6)
    assert q.shape == dq.shape == ddq.shape == (50, 6)


@pytest.mark.parametrize("seed", range(5))
def test_motions_start_and_end_at_rest_at_the_same_place(seed):
    rng = np.random.default_rng(seed)
    motion = at_rest(rng.normal(size=4), *rng.normal(size=(2, 4, 9)), 3.0)
    q, dq, ddq = motion(np.array([0.0, 3.0]))
    np.testing.assert_allclose(q[0], q[1], rtol=0, atol=1e-13)
    np.testing.assert_allclose(dq, 0.0, atol=1e-12)  # sums of nine terms of the order of 20
    np.testing.assert_allclose(ddq, 0.0, atol=1e-10)


def test_a_motion_at_rest_is_left_as_it_is():
    motion = short_motion()
    again = at_rest(motion.center, motion.sine, motion.cosine, motion.duration)
    np.testing.assert_allclose(again.sine, motion.sine, rtol=0, atol=1e-16)
    np.testing.assert_allclose(again.cosine, motion.cosine, rtol=0, atol=1e-16)
