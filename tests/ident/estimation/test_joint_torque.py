"""Torques from currents."""

import numpy as np
import pytest

from ident.estimation.known_gains import KnownGains, joint_torque
from ident.recordings.recording import Recording
from ident.support.errors import GainsError

V = np.array([[1.5, 2.0, -4.0], [-0.5, 3.0, 7.0], [2.5, -6.0, 0.0]])
LOG = Recording(np.array([0.3, 0.5, 0.7]), np.cumsum(V, axis=0), V, "log")
GAINS = KnownGains(
    names=("a", "b", "c"),
    joints=np.array([0, 2]),
    value=np.array([2.0, -3.0]),
    covariance=np.array([[0.04, 0.01], [0.01, 0.25]]),
)


def test_torque_is_gain_times_current_and_its_deviation_that_of_the_gain():
    found = joint_torque(LOG, GAINS)
    assert found.joints.tolist() == [0, 2]
    assert found.t.tolist() == [0.3, 0.5, 0.7]
    np.testing.assert_allclose(found.tau, [[3.0, 12.0], [-1.0, -21.0], [5.0, 0.0]], rtol=1e-15)
    np.testing.assert_allclose(found.std, [[0.3, 2.0], [0.1, 3.5], [0.5, 0.0]], rtol=1e-15)


def test_a_log_of_another_arm_is_refused():
    two = Recording(LOG.t, LOG.q[:, :2], LOG.v[:, :2], "two.csv")
    with pytest.raises(GainsError, match=r"two\.csv: 2 joints, but gains of 3"):
        joint_torque(two, GAINS)
    nothing = KnownGains(
        names=GAINS.names, joints=np.zeros(0, dtype=np.intp), value=np.zeros(0), covariance=np.zeros((0, 0))
    )
    with pytest.raises(GainsError, match="no joint has a gain"):
        joint_torque(LOG, nothing)
