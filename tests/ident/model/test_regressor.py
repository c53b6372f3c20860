"""Regressor and inverse dynamics, against Pinocchio and each other."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import random_arm, reference_regressor

from ident.model.arm import arm_from_pinocchio
from ident.model.parameters import STANDARD, labels
from ident.model.regressor import BLOCK, LinkMotions, inverse_dynamics, regressor, regressor_blocks

STATES = 200


def inertial_columns(W: np.ndarray, n: int) -> np.ndarray:
    return W.reshape(len(W), n, n, len(STANDARD))[..., :10].reshape(len(W), n, 10 * n)


@pytest.mark.parametrize("seed", range(4))
def test_inertial_columns_are_pinocchio_s_on_random_arms(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    model = random_arm(rng, n)
    q, dq, ddq = rng.uniform(-2, 2, (3, STATES, n))
    W = inertial_columns(regressor(arm_from_pinocchio(model), q, dq, ddq), n)
    reference = reference_regressor(model, q, dq, ddq)
    np.testing.assert_allclose(W, reference, rtol=0, atol=1e-12 * np.abs(reference).max())


def test_unbounded_revolute_joints_take_an_angle(rng):
    model = pin.Model()
    model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "spin")
    model.appendBodyToJoint(1, pin.Inertia.Random(), pin.SE3.Identity())
    q, dq, ddq = rng.uniform(-9, 9, (3, 5, 1))
    reference = reference_regressor(model, np.column_stack((np.cos(q), np.sin(q))), dq, ddq)
    W = regressor(arm_from_pinocchio(model), q, dq, ddq)
    np.testing.assert_allclose(W[..., :10], reference, rtol=0, atol=1e-12 * np.abs(reference).max())


def test_blocks_cover_every_sample_once_and_leave_nothing_behind(arm, rng):
    q, dq, ddq = rng.uniform(-2, 2, (3, 2 * BLOCK + 17, 6))
    whole = regressor(arm, q, dq, ddq)
    covered = np.zeros(len(q), dtype=int)
    for block, columns in regressor_blocks(arm, q, dq, ddq):
        covered[block] += 1
        np.testing.assert_array_equal(np.moveaxis(columns, 2, 0), whole[block])
    assert (covered == 1).all()
    # One sample alone is the same sample in a block: no state leaks from block to block.
    np.testing.assert_allclose(regressor(arm, q[-1:], dq[-1:], ddq[-1:])[0], whole[-1], rtol=0, atol=1e-13)


def test_samples_may_have_their_own_gravity_lengths_and_weights_and_rows_begin_at_any_joint(arm, rng):
    coupled = replace(arm, couplings=((4, 5),))
    q, dq, ddq, weight = rng.uniform(-2, 2, (4, 5, 6))
    gravity, length = rng.uniform(-12, 12, (5, 3)), rng.uniform(0.5, 1.5, (5, 6))
    expected = weight[..., None] * [
        regressor(replace(coupled, gravity=g, translation=f[:, None] * arm.translation), *states)[0]
        for g, f, *states in zip(gravity, length, q[:, None], dq[:, None], ddq[:, None], strict=True)
    ]
    further = {"gravity": gravity, "length": length, "weight": weight}
    for block, columns in regressor_blocks(coupled, q, dq, ddq, first=2, size=3, **further):
        # Entries up to 1e2: a few hundred roundings.
        np.testing.assert_allclose(np.moveaxis(columns, 2, 0), expected[block, 2:], rtol=0, atol=1e-12)


def test_drives_couplings_and_any_parameters_give_what_the_regressor_gives(arm, rng):
    coupled = replace(arm, couplings=((1, 2), (4, 5)))
    chi = rng.normal(size=len(labels(6, coupled.couplings)))  # not those of any body
    q, dq, ddq = rng.uniform(-2, 2, (3, BLOCK + 17, 6))
    expected = regressor(coupled, q, dq, ddq) @ chi
    motions = LinkMotions.of(coupled, q, dq, ddq)
    for torque in (
        inverse_dynamics(coupled, chi, q, dq, ddq),
        motions.torques(chi),
        -0.5 * motions.torques(-2.0 * chi),
    ):
        # Relative to the largest torque: a few hundred roundings.
        np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
