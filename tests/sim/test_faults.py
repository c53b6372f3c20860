"""When a run is no recording, and what is said of it."""

from copy import copy

import numpy as np
import pytest
from plants import experiment, nominal_plant

from sim.compile import lean_model
from sim.errors import LimitReached, Saturated
from sim.experiment import SATURATED_TOO_LONG, fault

STILL = [0.2, 0.3, 1.0, 0.1, 0.4, -0.2]
RUN = 100
"""Samples at 1 kHz that make a saturation too long."""


@pytest.fixture(scope="module")
def model():
    return lean_model(nominal_plant(), loaded=False, step=1e-3)


def logged(model, v: np.ndarray, q: np.ndarray | None = None):
    still = np.tile(STILL, (len(v), 1)) if q is None else q
    return fault(experiment(), model, still, v, unstable=False)


def currents() -> np.ndarray:
    return np.full((1000, 6), 3.0)


def test_a_tenth_of_a_second_at_the_limit_is_too_long_and_a_sample_less_is_not(model):
    assert SATURATED_TOO_LONG * experiment().controller.rate_hz == RUN
    limit, v = experiment().plant.drives.current_limit, currents()
    v[300 : 300 + RUN - 1, 2] = limit[2]
    v[600 : 600 + RUN - 1, 2] = -limit[2]  # short bursts do not add up, nor do those of other joints
    v[399 : 399 + RUN - 1, 4] = limit[4]
    assert logged(model, v) is None
    v[600 + RUN - 1, 2] = -limit[2]
    found = logged(model, v)
    assert isinstance(found, Saturated)
    assert "drive of joint3 at its limit of 240 for more than 0.1 s from t = 0.600 s" in str(found)


def test_the_first_saturation_is_named(model):
    limit, v = experiment().plant.drives.current_limit, currents()
    v[200:350, 1] = limit[1]
    v[500:900, 3] = -limit[3]
    assert "drive of joint2 at its limit of 480 for more than 0.1 s from t = 0.200 s" in str(logged(model, v))


def test_the_first_joint_that_leaves_its_range_is_named_with_time_and_range(model):
    v = currents()
    q = np.tile(STILL, (len(v), 1))
    low, high = model.jnt_range[4]
    q[350:, 4], q[700:, 0] = high + 0.02, model.jnt_range[0][0] - 0.1
    found = logged(model, v, q)
    assert isinstance(found, LimitReached)
    assert f"joint5 at {high + 0.02:.3f} rad leaves its range {low:.3f} to {high:.3f} rad at t = 0.350 s" in str(found)


def test_a_joint_without_a_range_leaves_none(model):
    endless = copy(model)
    endless.jnt_range[3] = 0.0
    assert STILL[3] != 0.0
    q = np.tile(STILL, (1000, 1))
    assert fault(experiment(), endless, q, currents(), unstable=False) is None
    q[600:, 1] = model.jnt_range[1, 1] + 0.3
    assert "joint2" in str(fault(experiment(), endless, q, currents(), unstable=False))
