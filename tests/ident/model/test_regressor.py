"""Regressor, inverse dynamics and its derivative, against Pinocchio, each other and differences of torques."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from pinocchio_arms import ELBOW, WRIST, random_arm, reference_regressor

from ident.model.arm import Arm, arm_from_pinocchio, with_transmission
from ident.model.displacement import Dynamics, Kinematics, States
from ident.model.parameters import STANDARD, labels
from ident.model.regressor import BLOCK, drive_torques, inverse_dynamics, regressor, regressor_blocks

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
    torque = inverse_dynamics(coupled, chi, q, dq, ddq)
    # Relative to the largest torque: a few hundred roundings.
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def lopsided(rng: np.random.Generator, samples: int, n: int) -> tuple[States, States]:
    values = rng.uniform(0.3, 2.0, (6, samples, n)) * rng.choice([-1.0, 1.0], (6, samples, n))
    return States(*values[:3]), States(*values[3:])


@pytest.fixture
def coupled(arm: Arm) -> Arm:
    return replace(arm, couplings=((1, 2), (4, 5)))


@pytest.mark.parametrize("A", [None, ELBOW, WRIST])
def test_a_little_displacement_of_a_motor_changes_torques_by_its_share(coupled, arm, rng, A):
    slides = replace(arm_from_pinocchio(random_arm(rng, prismatic=0.4)), couplings=coupled.couplings)
    moved = slides if A is None else with_transmission(arm, A)
    chi = rng.normal(size=len(labels(6, moved.couplings)))  # not those of any body
    states, further = lopsided(rng, 1041, 6)
    change = Dynamics.of(Kinematics.of(moved, states), chi).displaced(further)
    at, by = (np.array((each.q, each.dq, each.ddq)) for each in (states, further))
    h = 1e-5
    steady = np.ones(len(change), bool)  # speeds are far from zero, sums of coupled ones are not
    for pair in moved.couplings:
        steady &= np.abs(states.dq[:, pair].sum(axis=1)) > 3.0 * h
    for k, only in enumerate(np.eye(6)):
        there, back = (inverse_dynamics(moved, chi, *(at + size * only * by))[steady] for size in (h, -h))
        expected = (there - back) / (2.0 * h)
        # A central difference is off by h^2 of a third derivative, 1e-10, and by rounding over h, 1e-11.
        np.testing.assert_allclose(change[steady, :, k], expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("A", [None, WRIST])
def test_a_longer_distance_between_frames_changes_torques_by_its_share(rng, A):
    slides = replace(arm_from_pinocchio(random_arm(rng, prismatic=0.4)), gravity=np.array([3.1, -2.7, -8.9]))
    moved, h = slides if A is None else with_transmission(slides, A), 1e-5
    chi, (states, _) = rng.normal(size=len(labels(6, ()))), lopsided(rng, 41, 6)
    found = Dynamics.of(Kinematics.of(moved, states), chi).by_length
    for k in range(6):
        factors = [1.0 + size * (np.arange(6) == k)[:, None] for size in (h, -h)]
        longer, shorter = (
            inverse_dynamics(replace(moved, translation=each * moved.translation), chi, states.q, states.dq, states.ddq)
            for each in factors
        )
        expected = (longer - shorter) / (2.0 * h)  # torques are quadratic in lengths: but for rounding, exact
        np.testing.assert_allclose(found[:, k].T, expected, rtol=0, atol=1e-8 * np.abs(longer).max())
    assert not found[:, 0].any()


def test_drives_carry_their_own_torque_and_each_other_s_where_they_are_coupled(coupled, rng):
    names = labels(6, coupled.couplings)
    chi = rng.uniform(0.3, 2.0, len(names))
    value = dict(zip(names, chi, strict=True))
    dq, ddq = rng.uniform(0.3, 2.0, (2, 4, 6)) * [1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
    expected = np.empty_like(dq)
    for j in range(6):
        Ia, Fv, Fc, off = (value[f"{name}{j + 1}"] for name in ("Ia", "Fv", "Fc", "off"))
        expected[:, j] = Ia * ddq[:, j] + Fv * dq[:, j] + Fc * np.sign(dq[:, j]) + off
    for one, other, of in ((1, 2, 3), (2, 1, 3), (4, 5, 6), (5, 4, 6)):
        Iam, Fvm, Fcm = (value[f"{name}{of}"] for name in ("Iam", "Fvm", "Fcm"))
        expected[:, one] += Iam * ddq[:, other] + Fvm * dq[:, other] + Fcm * np.sign(dq[:, one] + dq[:, other])
    np.testing.assert_allclose(drive_torques(coupled, chi, dq, ddq), expected, rtol=1e-12)  # a handful of roundings
