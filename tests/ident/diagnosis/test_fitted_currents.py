"""What small faults change of the currents, beside differences of logs that are read so and observed again."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import doubted, logs_of
from known_logs import BRICK, fourier
from real_friction import MIDDLE, RATE, Truth

from ident.diagnosis.fitted_currents import STEP, Reference, reference
from ident.diagnosis.hypothesis import Hypothesis, as_logged
from ident.estimation.sweep import across
from ident.model.arm import Arm
from ident.model.parameters import STANDARD
from ident.model.regressor import regressor
from ident.model.structure import structure_of
from ident.observation.observation import Observation, ObserveOptions, observe
from ident.recordings.recording import Recording

OPTIONS = ObserveOptions()
SIZE = 1e-3
"""Of the differences: second-order terms cancel, rounding is 1e-13 of it."""
RESAMPLED = 2e-3
"""Relative error of torques that are evaluated at a lower rate and interpolated, of a joint's rms."""


@pytest.fixture(scope="module")
def fit(sound) -> Reference:
    return reference(sound.problem)


def currents(fit: Reference, log: int, seen: Observation, chi: np.ndarray | None = None) -> list[np.ndarray]:
    """What the fitted arm predicts of rows through the estimator's own regressor."""
    base = seen.structure.base
    chi = fit.torques[log].chi if chi is None else chi
    return [h * each.W @ (base.regrouping[each.columns] @ chi) for h, each in zip(fit.h, seen.joints, strict=True)]


def observed(fit: Reference, log: Recording, hypothesis: Hypothesis, k: int, options: ObserveOptions = OPTIONS):
    arm = hypothesis.of_arm(fit.arm)
    structure = fit.problem.structure if arm is fit.arm else structure_of(arm)
    return observe(hypothesis.logs[k].read(log), structure, options)


def differences(fit: Reference, logs, k: int, read: Callable[[float], Hypothesis]) -> list[np.ndarray]:
    """Central differences by the parameter of a reading."""
    both = [currents(fit, k, observed(fit, logs.recordings[k], read(s * SIZE), k)) for s in (1.0, -1.0)]
    return [(one - other) / (2.0 * SIZE) for one, other in zip(*both, strict=True)]


def assert_near(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=6.0 * share * max(np.sqrt(np.mean(expected**2)), 1e-6))


@pytest.mark.parametrize("k", [0, 1])
def test_rows_of_the_fitted_torque_are_those_of_the_estimators_regressor(fit, sound, k):
    motion = fit.motions[k]
    expected = currents(fit, k, sound.problem.motions[k].observation)
    for found, want in zip(motion.rows(motion.along.sampled[..., None]), expected, strict=True):
        assert_near(found[:, 0], want, RESAMPLED)


@pytest.mark.parametrize("k", [0, 1])
def test_zeros_move_currents_as_logs_with_other_zeros(fit, sound, k):
    found = fit.motions[k].rows(fit.motions[k].displaced())
    for joint in range(3):

        def read(x: float, joint: int = joint) -> Hypothesis:
            return as_logged(fit.arm, 2).changed((k,), zero=x * np.eye(3)[joint])

        for j, want in enumerate(differences(fit, sound, k, read)):
            assert_near(found[j][:, joint], want, RESAMPLED)


def test_a_turned_base_moves_currents_as_the_arm_that_stands_so(fit, sound):
    found = fit.motions[1].rows(fit.motions[1].tilted())
    for which, axis in enumerate(across(fit.arm)):

        def read(x: float, axis: np.ndarray = axis) -> Hypothesis:
            gravity = np.cos(x) * fit.arm.gravity + np.sin(x) * np.cross(axis, fit.arm.gravity)
            return replace(as_logged(fit.arm, 2), gravity=gravity)

        # A slanting base has more base parameters; with those of the upright one the others are zero.
        for j, want in enumerate(_by_arms(fit, sound, read)):
            assert_near(found[j][:, which], want, RESAMPLED)


def test_longer_links_move_currents_as_the_arm_that_has_them(fit, sound):
    for joint in (1, 2):
        length_factors = np.where(np.arange(3) == joint, 1.0, 0.0)
        longer = replace(fit.arm, translation=(1.0 + STEP * length_factors)[:, None] * fit.arm.translation)
        found = fit.motions[1].rows(fit.motions[1].changed(longer)[..., None])

        def read(x: float, length_factors: np.ndarray = length_factors) -> Hypothesis:
            return replace(as_logged(fit.arm, 2), length_factors=1.0 + x * length_factors)

        for j, want in enumerate(_by_arms(fit, sound, read)):
            assert_near(found[j][:, 0], want, RESAMPLED)


def _by_arms(fit: Reference, sound, read: Callable[[float], Hypothesis]) -> list[np.ndarray]:
    """Differences between arms, whose base parameters differ, by all standard parameters."""
    behind = fit.motions[1].behind
    torque = []
    for sign in (1.0, -1.0):
        arm: Arm = read(sign * SIZE).of_arm(fit.arm)
        W = regressor(arm, behind.q, behind.dq, behind.ddq)  # (N, n, p)
        torque.append(W @ fit.torques[1].chi)
    full = (torque[0] - torque[1]) / (2.0 * SIZE)
    D = behind.decimator
    found = []
    for j in range(3):
        masked = np.where(behind.moving[:, j], full[:, j], 0.0)
        kept = sound.problem.motions[1].observation.joints[j].position
        rows = [D.kernel @ masked[i : i + len(D.kernel)] for i in D.factor * kept]
        found.append(fit.h[j] * np.array(rows))
    return found


def test_a_slower_clock_moves_currents_as_a_log_of_other_seconds(fit, sound):
    found = fit.motions[0].rows(fit.motions[0].hurried()[..., None])
    both = []
    for sign in (1.0, -1.0):
        factor = 1.0 + sign * SIZE
        same = replace(  # as many samples a cut-off
            OPTIONS,
            cutoff_hz=OPTIONS.cutoff_hz / factor,
            decimation_cutoff_hz=OPTIONS.decimation_cutoff_hz / factor,
            rows_per_second=OPTIONS.rows_per_second / factor,
        )
        read = as_logged(fit.arm, 2).changed((0,), clock=factor)
        both.append(currents(fit, 0, observed(fit, sound.recordings[0], read, 0, same)))
    for j in range(3):
        # first order one way: its second order is SIZE of it
        assert_near(found[j][:, 0], (both[0][j] - both[1][j]) / (2.0 * SIZE), RESAMPLED + 2.0 * SIZE)


def test_the_rate_of_currents_is_that_of_a_motion_a_little_later(axes):
    def log(later: float) -> Recording:
        motion = fourier(np.random.default_rng(31), MIDDLE)
        t = np.arange(0.0, motion.period, 1.0 / RATE)
        return Recording(t, motion(t + later)[0], base[0].v, "bare")

    base = logs_of(Truth(), seed=9)
    sound = doubted(axes, [log(0.0), base[1]])
    fit = reference(sound.problem)
    chi = fit.torques[0].chi.copy()
    chi[np.arange(3) * len(STANDARD) + STANDARD.index("Fv")] = fit.motions[0]._viscous() / fit.h
    found = fit.motions[0].rows(fit.motions[0].rate()[..., None])
    at = [observe(log(s * SIZE), axes, OPTIONS) for s in (1.0, -1.0, 0.0)]
    own = [currents(fit, 0, each, chi) for each in at]
    for j in range(3):
        clear = [  # of reversals, whose samples differ
            {
                int(p): x
                for p, w, x in zip(o.joints[j].position, o.joints[j].weight, v[j], strict=True)
                if abs(w - 1.0) < 1e-6
            }
            for o, v in zip(at, own, strict=True)
        ]
        rows = dict(zip(at[2].joints[j].position.tolist(), found[j][:, 0], strict=True))
        kept = sorted(set(clear[0]) & set(clear[1]) & set(clear[2]) - {0})  # the first filter begins at rest
        assert len(kept) > 100
        want = np.array([clear[0][p] - clear[1][p] for p in kept]) / (2.0 * SIZE)
        assert_near(np.array([rows[p] for p in kept]), want, 3.0 * RESAMPLED)  # a rate has more of high frequencies


def test_nothing_that_is_said_of_the_payload_enters(fit, axes, sound):
    wrong = replace(BRICK, mass=40.0, com=(0.3, 0.3, 0.3))
    other = reference(doubted(axes, sound.recordings, (None, wrong)).problem)
    np.testing.assert_array_equal(other.fitted.theta, fit.fitted.theta)


def test_axes_across_gravity_are_unit_vectors_across_it(axes):
    arm = replace(axes.arm, gravity=np.array([1.0, -2.0, 9.0]))
    both = np.vstack((across(arm), arm.gravity / np.linalg.norm(arm.gravity)))
    np.testing.assert_allclose(both @ both.T, np.eye(3), atol=1e-12)
    assert across(replace(arm, gravity=np.zeros(3))).shape == (0, 3)
