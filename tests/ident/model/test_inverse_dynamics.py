from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import random_arm, standard_parameters_of

from ident.model.arm import arm_from_pinocchio
from ident.model.inverse_dynamics import BLOCK, LinkMotions, inverse_dynamics
from ident.model.parameters import labels
from ident.model.regressor import regressor


@pytest.mark.parametrize("seed", range(6))
def test_torques_are_pinocchio_s_on_random_arms(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    model = random_arm(rng, n)
    q, dq, ddq = rng.uniform(-2, 2, (3, 70, n))
    chi = np.column_stack((standard_parameters_of(model), np.zeros((n, 4)))).ravel()
    torque = inverse_dynamics(arm_from_pinocchio(model), chi, q, dq, ddq)
    data = model.createData()
    expected = np.array([pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)])
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


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
