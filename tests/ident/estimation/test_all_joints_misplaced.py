"""Zeros that are off and a tilted base, on recordings of a three-axis arm with known drives."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import PAYLOADS, problem_of, ready_of
from exact import shared_columns
from known_logs import BRICK
from pinocchio_arms import random_arm
from real_friction import GAIN, Truth, real_logs

from ident.estimation.all_joints import fit
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains, with_misplaced
from ident.estimation.problem import Problem
from ident.estimation.terms import torques_of
from ident.model.arm import Arm, arm_from_pinocchio
from ident.model.displacement import Dynamics, Kinematics, States
from ident.model.regressor import regressor
from ident.model.structure import structure_of
from ident.payload.payload import Payload
from ident.recordings.recording import Recording

N = 3
ZEROS = np.array([0.02, -0.011, 0.017])  # of joint 1, whose axis is vertical, no log tells


def logs_of(zeros: np.ndarray, noise: float = 1e-3) -> list[Recording]:
    logs = real_logs(Truth(), PAYLOADS, np.random.default_rng(5), noise=noise)
    return [replace(log, q=log.q + zeros) for log in logs]


def off(problem: Problem, **options) -> np.ndarray:
    """Relative errors of the gains of joints 2 and 3; the load hardly tells that of joint 1."""
    estimate = all_joints_gains(problem, AllJointsOptions(friction="viscous-coulomb", **options))
    return (1.0 / estimate.solution.inverse / GAIN - 1.0)[1:]


def test_columns_of_zeros_are_what_the_torques_change_by(axes):
    logs, h = logs_of(np.zeros(N)), 1e-4
    problem = problem_of(axes, logs)
    ready = ready_of(problem)
    assert with_misplaced(ready, zero_deg=0.0, tilt_deg=0.0) is ready
    theta = fit(ready, {}, None).theta
    columns = ready.columns.of_logs([each.sweep.rows(each.by(Dynamics.misplaced)) for each in torques_of(ready, theta)])

    def torque(off: np.ndarray) -> np.ndarray:  # an encoder that reads so much too much
        shifted = ready_of(problem_of(axes, [replace(log, q=log.q - off) for log in logs]))
        return shared_columns(shifted) @ theta + shifted.k

    for k, one in enumerate(np.eye(N)):
        slopes = (torque(h * one) - torque(-h * one)) / (2.0 * h)
        for j in range(N):
            own = ready.columns.joint == j
            # Splines between the instants that torques are taken at, and a mask of reversals that sees rounded speeds.
            size = max(np.abs(slopes[own]).max(), 1e-3)
            np.testing.assert_allclose(columns[own, k], slopes[own], rtol=0, atol=2e-3 * size)


def swinging(arm: Arm, payload: Payload, **observing: float) -> Problem:
    """A bare and a loaded motion of an arm along sines, without noise or friction."""
    structure, rng, t = structure_of(arm), np.random.default_rng(3), 0.004 * np.arange(2500)
    w, phase, chi = rng.uniform(1.5, 4.0, N), rng.uniform(0.0, 6.0, N), rng.uniform(0.5, 2.0, 14 * N)
    q, dq, ddq = (0.4 * w**k * np.sin(np.outer(t, w) + phase + 0.5 * k * np.pi) for k in range(3))
    W = regressor(arm, q, dq, ddq)
    load = W[:, :, structure.payload_columns] @ payload.known_part().chi
    logs = [Recording(t, q, W @ chi + k * load, "log") for k in (0.0, 1.0)]
    return problem_of(structure, logs, (None, payload), **observing)


def test_an_arm_on_a_wall_has_two_tilts_about_the_axes_across_gravity(axes):
    problem, h = swinging(replace(axes.arm, gravity=np.array([-9.81, 0.0, 0.0])), BRICK), 1e-5
    ready = ready_of(problem)
    theta = fit(ready, {}, None).theta
    torques = torques_of(ready, theta)[1]
    found = torques.by(Dynamics.tilted)
    q, still = torques.sweep.behind.states.q, np.zeros((len(found), N))
    assert np.abs(found).max(axis=(0, 1)).min() > 1.0

    def turned(about: np.ndarray) -> np.ndarray:  # torques on a base that is turned so
        turn = np.eye(3) + np.cross(np.eye(3), about)
        arm = replace(problem.structure.arm, gravity=turn @ problem.structure.arm.gravity)
        return regressor(arm, q, still, still) @ torques.chi

    for axis in np.eye(3)[1:]:  # y and z
        slope = (turned(h * axis) - turned(-h * axis)) / (2.0 * h)
        x = np.linalg.lstsq(found.reshape(-1, 2), slope.ravel())[0]
        np.testing.assert_allclose(np.linalg.norm(x), 1.0, rtol=1e-6)  # about a unit vector between both axes
        np.testing.assert_allclose(found @ x, slope, rtol=0, atol=1e-6 * np.abs(slope).max())


def test_a_belief_that_is_surer_than_the_data_is_kept(axes):
    ready = with_misplaced(ready_of(problem_of(axes, logs_of(ZEROS, noise=0.05))), zero_deg=1e-3, tilt_deg=2e-3)
    found, own = fit(ready, {}, None), np.flatnonzero(np.isfinite(ready.blocks.std))
    believed = np.radians([1e-3] * N + [2e-3] * 2)
    assert (np.abs(found.theta[own]) < 0.2 * believed).all()
    np.testing.assert_allclose(np.linalg.norm(found.of_theta(own).belief, axis=1), believed, rtol=1e-2)


def test_gains_are_right_where_zeros_are_unknown_and_off_where_they_are_taken_for_right(axes):
    problem = problem_of(axes, logs_of(ZEROS))
    taken, unknown = (np.abs(off(problem, zero_std=each, tilt_std=0.0)).max() for each in (0.0, 1.0))
    assert taken > 4e-3
    assert unknown < min(1.5e-3, 0.3 * taken)


def test_a_zero_that_is_off_by_a_degree_where_a_joint_turns_is_by_a_millimetre_where_it_slides(payload):
    arm = arm_from_pinocchio(random_arm(np.random.default_rng(10), N, prismatic=0.5))
    assert arm.revolute.tolist() == [1.0, 0.0, 1.0]
    problem = swinging(arm, payload)
    ready = with_misplaced(ready_of(problem), zero_deg=2.3, tilt_deg=0.7)
    expected = [np.radians(2.3), 2.3e-3, np.radians(2.3), *2 * [np.radians(0.7)]]
    np.testing.assert_allclose(ready.blocks.std[-5:], expected, rtol=1e-12)


@pytest.mark.parametrize("tilt_deg", [0.0, 0.7])
def test_a_joint_alone_shows_the_combinations_of_errors_that_no_other_masses_imitate(payload, rng, tilt_deg):
    # Axes and gravity in general directions; a low cut-off makes the samples of torques sparse: errors of splines
    # between them are above any rounding.
    arm = arm_from_pinocchio(random_arm(np.random.default_rng(8), N, prismatic=0.0))
    problem = swinging(replace(arm, gravity=np.array([3.3, -1.7, -9.1])), payload, cutoff_hz=2.0)
    structure, kept = problem.structure, slice(N + 2 if tilt_deg else N)
    plain, wide = ready_of(problem), with_misplaced(ready_of(problem), zero_deg=2.3, tilt_deg=tilt_deg)
    found = wide.blocks.alone.rank - plain.blocks.alone.rank
    states = States(*rng.uniform(-2.0, 2.0, (3, 150, N)))  # any motion of the arm: bare, then with a payload
    W = regressor(structure.arm, states.q, states.dq, states.ddq)
    chi = np.where(np.arange(W.shape[2]) % 14 < 10, rng.normal(size=W.shape[2]), 0.0)
    load = np.zeros_like(chi)
    load[structure.payload_columns] = rng.normal(size=10)
    kinematics = Kinematics.of(structure.arm, states)
    D = np.vstack([Dynamics.of(kinematics, x).misplaced()[..., kept] for x in (chi, chi + load)])
    for j in range(N):
        base, own = W[:, j, structure.base.columns], W[:, j, structure.payload_columns]
        known = np.block([[base, np.zeros_like(own)], [base, own]])
        # dependent to rounding, some 1e-14; else from 1e-2 on
        ranks = [np.linalg.matrix_rank(each, rtol=1e-10) for each in (known, np.hstack((known, D[:, j])))]
        assert found[j] == ranks[1] - ranks[0] < D.shape[2]
