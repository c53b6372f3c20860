"""Motors that several joints turn: an arm's equations in motor positions, against Pinocchio and virtual work."""

from dataclasses import replace

import numpy as np
import pytest
from known_logs import BRICK, UR_GAIN, UR_MIDDLE, known_logs, mounted, ur_like
from pinocchio_arms import ELBOW, WRIST, random_arm, standard_parameters_of
from pinocchio_arms import rnea as torque_of_joints
from refusals import refused

from ident.identification import identify
from ident.model.arm import Arm, arm_from_pinocchio, with_transmission
from ident.model.displacement import Dynamics, Kinematics, States, across
from ident.model.regressor import inverse_dynamics, regressor, regressor_blocks
from ident.model.structure import structure_of
from ident.recordings.recording import Motion
from ident.support.errors import Contradiction, RobotModelError


@pytest.mark.parametrize("A", [ELBOW, WRIST])
def test_torques_of_motors_do_the_work_of_those_of_the_joints(A, rng):
    model = random_arm(rng, 6, prismatic=0.0)
    arm = with_transmission(arm_from_pinocchio(model), A)
    q, dq, ddq = rng.uniform(-2.0, 2.0, (3, 40, 6))
    joints = np.array([torque_of_joints(model, *state) for state in zip(q, dq, ddq, strict=True)])
    drives = rng.uniform(0.3, 2.0, (6, 4))  # Ia, Fv, Fc, off of the motors
    chi = np.hstack((standard_parameters_of(model), drives)).ravel()
    motors = [x @ A.T for x in (q, dq, ddq)]
    friction = np.stack((motors[2], motors[1], np.sign(motors[1]), np.ones_like(q)), axis=2)
    tau = inverse_dynamics(arm, chi, *motors)
    left = tau - np.einsum("sjk,jk->sj", friction, drives)
    np.testing.assert_allclose(left @ A, joints, rtol=0, atol=1e-11 * np.abs(joints).max())  # hundreds of roundings
    W = regressor(arm, *motors)
    np.testing.assert_allclose(W @ chi, tau, rtol=0, atol=1e-11 * np.abs(tau).max())
    weight = rng.uniform(0.2, 3.0, (40, 6))
    for first in (0, 2, 5):
        ((_, part),) = regressor_blocks(arm, *motors, first=first, weight=weight)
        expected = np.moveaxis(weight[..., None] * W, 0, 2)[first:]
        np.testing.assert_allclose(part, expected, rtol=0, atol=1e-12 * np.abs(W).max())


def test_a_tilted_base_changes_the_torques_of_the_motors_by_its_gravity(rng):
    model = random_arm(rng, 6, prismatic=0.0)
    arm = with_transmission(arm_from_pinocchio(model), WRIST)
    states = rng.uniform(-2.0, 2.0, (3, 7, 6))
    chi = np.hstack((standard_parameters_of(model), np.zeros((6, 4)))).ravel()
    found = Dynamics.of(Kinematics.of(arm, States(*states)), chi).tilted()
    for k, u in enumerate(across(arm)):  # torques are linear in gravity, which turns about u the other way
        turned = replace(arm, gravity=arm.gravity + np.cross(arm.gravity, u))
        change = inverse_dynamics(turned, chi, *states) - inverse_dynamics(arm, chi, *states)
        np.testing.assert_allclose(found[..., k], change, rtol=0, atol=1e-11 * np.abs(change).max())


def test_motors_reach_what_their_joints_reach_together(arm):
    turned = with_transmission(replace(arm, upper=np.where(np.arange(6) == 3, np.inf, arm.upper)), WRIST)
    assert (turned.lower[0], turned.upper[0]) == pytest.approx((-1.3 * arm.upper[0], -1.3 * arm.lower[0]))
    low, high = 0.6 * arm.lower[4] - 0.9 * arm.upper[5], 0.6 * arm.upper[4] - 0.9 * arm.lower[5]
    assert (turned.lower[5], turned.upper[5]) == pytest.approx((low, high))
    assert turned.upper[3] == np.inf
    assert structure_of(turned).first_links == [0, 1, 2, 3, 4, 4]
    with_transmission(arm, np.diag([1e7, 1.0, 1.0, 1.0, 1.0, 3e-4]))  # units of each motor's own


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda A: A[:5], "6 rows of 6 numbers"),
        (lambda A: A[[0, 1, 2, 3, 4, 4]], "singular"),
        (lambda A: np.ma.masked_equal(A, 0.4), "masked"),
        (lambda A: "A", "type <U1"),
    ],
)
def test_an_impossible_transmission_is_refused(arm, change, said):
    refused(RobotModelError, said, with_transmission, arm, change(WRIST))


def test_a_motor_turns_joints_of_one_kind(arm: Arm):
    slides = replace(arm, revolute=np.arange(6) != 2)
    refused(RobotModelError, "kind", with_transmission, slides, ELBOW)
    refused(RobotModelError, "both", with_transmission, replace(arm, couplings=((4, 5),)), WRIST)


def logs_of(A: np.ndarray) -> tuple[Motion, Motion]:
    rng = np.random.default_rng(3)
    return mounted(*known_logs(ur_like(), BRICK, UR_GAIN, rng, middle=UR_MIDDLE, noise=0.01, transmission=A), BRICK)


def test_gains_of_motors_that_several_joints_turn_are_found():
    A = WRIST[[2, 1, 0, 3, 4, 5]]  # motors in another order than their joints
    found = identify(with_transmission(arm_from_pinocchio(ur_like()), A), logs_of(A))
    z = (found.gain - UR_GAIN) / found.std
    assert found.gain.count() >= 5
    assert np.abs(z).max() < 3.0  # six gains: by chance one set of logs in sixty
    assert [each.name for each in found.found.findings] == ["negative gain"]  # of axis 2, wired in reverse


@pytest.mark.parametrize(
    ("place", "turns", "said", "row"),
    [
        pytest.param(
            1, ((1, 0), (1, 1)), "motor 3 turns by joint 2 plus joint 3", "[0, 1, 1, 0, 0, 0]", marks=pytest.mark.slow
        ),
        (3, ((1, 0), (-1, 1)), "motor 5 turns by joint 5 minus joint 4", "[0, 0, 0, -1, 1, 0]"),
        pytest.param(
            4, ((1, 1), (1, -1)), "motor 5 turns by joint 5 plus joint 6 and motor 6 turns by joint 5 minus",
            "[0, 0, 0, 0, 1, -1]", marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_a_transmission_that_nobody_stated_is_named_with_the_matrix_to_state(place, turns, said, row):
    A = np.eye(6)
    A[place : place + 2, place : place + 2] = turns
    try:
        found = [each for each in identify(arm_from_pinocchio(ur_like()), logs_of(A)).found.findings]
        words = f"{found[0].sentence}; {found[0].advice}"
    except Contradiction as error:  # if no gain is left
        words = str(error)
    assert said in words
    assert "state transmission = [[1, 0, 0, 0, 0, 0], " in words
    assert row in words


@pytest.mark.parametrize(
    ("turns", "said"),
    [
        (0.0, "each motor turns one joint alone, against the stated transmission"),
        pytest.param(1.0, "motors turn the other way, against the stated transmission", marks=pytest.mark.slow),
    ],
)
def test_a_transmission_that_is_stated_and_that_motors_do_not_have_is_named(turns, said):
    true, stated = np.eye(6), np.eye(6)
    true[2, 1], stated[2, 1] = turns, -1.0
    with pytest.raises(Contradiction) as refused:
        identify(with_transmission(arm_from_pinocchio(ur_like()), stated), logs_of(true))
    assert said in str(refused.value)
    rows = "state transmission = [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 1, 1, 0, 0, 0], "
    assert (rows if turns else "state none in robot.toml") in str(refused.value)


@pytest.mark.slow
def test_currents_of_motors_beside_positions_of_joints_are_named():
    A = np.eye(6)
    A[2, 1] = 1.0
    logs = [replace(m, recording=replace(m.recording, q=np.linalg.solve(A, m.recording.q.T).T)) for m in logs_of(A)]
    with pytest.raises(Contradiction, match="motor 3 turns by joint 2 plus joint 3, and v alone is that of the motors"):
        identify(arm_from_pinocchio(ur_like()), logs)
