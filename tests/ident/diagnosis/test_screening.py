"""Screening on subsampled states: residuals beside a plain fit, and the true hypothesis of a corrupted log first."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import doubted, exchanged

from ident.diagnosis.column_faults import orders
from ident.diagnosis.families import FAMILIES
from ident.diagnosis.hypothesis import Logs, as_logged
from ident.diagnosis.screening import MARGIN, SURELY_WORSE, improvements, looked_at, screened, subsampled_states
from ident.diagnosis.screening import unexplained as in_stages
from ident.model.regressor import regressor
from ident.model.structure import structure_of
from ident.numerics.signals import smooth_motion
from ident.observation.observation import ObserveOptions
from ident.recordings.recording import Recording, resampled

OPTIONS = ObserveOptions()


def test_instants_are_of_the_filtered_motion_and_as_many_as_asked_for_at_most(ur_log):
    log = ur_log
    at = subsampled_states(log, 150, OPTIONS)
    # 2 samples and 2 periods of 10 Hz at 125 Hz are 27 at either end; 2500 - 54 in at most 150 are every 17th
    q, dq, ddq = smooth_motion(log.q, log.period, OPTIONS.cutoff_hz)
    v = smooth_motion(log.v, log.period, OPTIONS.decimation_cutoff_hz)[0]
    chosen = slice(27, 2500 - 27, 17)
    assert len(at.v) <= 150
    for found, expected in zip(at.motion, (q, dq, ddq), strict=True):
        np.testing.assert_array_equal(found, expected[chosen])
    np.testing.assert_allclose(at.v, v[chosen], rtol=0, atol=1e-4 * np.abs(v).max())  # beyond 4 periods of the filter
    slow = np.abs(dq) <= 0.2 * np.sqrt(np.mean(dq[27:-27] ** 2, axis=0))
    np.testing.assert_array_equal(at.moving, ~slow[chosen])


def test_a_current_that_acts_late_is_looked_at_late_and_instants_are_no_closer_than_rows(ur_log):
    late = subsampled_states(ur_log, 150, replace(OPTIONS, current_delay=2 * ur_log.period))
    shifted = replace(ur_log, v=np.vstack((ur_log.v[[0, 0]], ur_log.v[:-2])))
    np.testing.assert_allclose(late.v, subsampled_states(shifted, 150, OPTIONS).v, rtol=1e-9, atol=1e-12)  # rounding
    assert len(subsampled_states(ur_log, 10_000, OPTIONS).v) == -(-(2500 - 54) // 6)  # 20 a second of 125


def test_a_jittered_clock_is_made_even_first(ur_log, rng):
    log = ur_log
    t = log.t + rng.uniform(-0.002, 0.002, len(log.t))
    uneven = Recording(t, log.q, log.v)
    even = subsampled_states(resampled(uneven), 150, OPTIONS)
    np.testing.assert_array_equal(subsampled_states(uneven, 150, OPTIONS).motion, even.motion)
    careless = Recording(np.linspace(t[0], t[-1], len(t)), log.q, log.v)  # the samples at times that are not theirs
    assert np.abs(subsampled_states(careless, 150, OPTIONS).motion[0] - even.motion[0]).max() > 1e-4


def unexplained(logs: Logs, hypotheses, at):
    """With the equations of all joints."""
    *_, found = in_stages(logs, hypotheses, at)
    return found


def test_what_is_left_is_what_least_squares_with_every_column_leaves(sound):
    order, sign, unit = np.array([0, 2, 1]), np.array([1.0, 1.0, -1.0]), np.array([1.0, 3.0, -0.5])
    of_motion = {"zero": np.array([0.0, 0.4, 0.0]), "q_factor": sign, "clock": 1.25}
    hypothesis = as_logged(sound.structure.arm, 2).changed((1,), **of_motion, v_order=order, v_factor=unit)
    (left,), (rows,) = unexplained(sound, [hypothesis], looked_at(sound))
    bare, loaded = looked_at(sound)
    q, dq, ddq = loaded.motion * sign
    states = (q + np.array([0.0, 0.4, 0.0]), dq / 1.25, ddq / 1.25**2)
    parts = [regressor(sound.structure.arm, *each) for each in (bare.motion, states)]
    for j in range(3):
        arm = np.vstack([part[at.moving[:, j], j] for part, at in zip(parts, (bare, loaded), strict=True)])
        first = int(bare.moving[:, j].sum())
        again = arm[:, [*sound.structure.payload_columns, *(14 * j + np.array([11, 12, 13]))]].copy()
        again[:first] = 0.0
        V = np.concatenate([bare.v[bare.moving[:, j], j], loaded.v[loaded.moving[:, j], order[j]] * unit[j]])
        W = np.hstack((arm, again))
        kept = (size := np.linalg.norm(W, axis=0)) > 1e-9 * size.max()
        U, s, _ = np.linalg.svd(W[:, kept] / size[kept], full_matrices=False)
        U = U[:, s > 1e-7 * s[0]]
        residual = V - U @ (U.T @ V)
        freedom = len(V) - U.shape[1]
        for log, own, column, by in ((0, slice(first), j, 1.0), (1, slice(first, None), order[j], unit[j])):
            expected = np.mean(residual[own] ** 2) / by**2 * len(V) / freedom
            # Two factorisations, one through normal equations with a prior of 1e-10: a column more or less is 1 %.
            np.testing.assert_allclose(left[column, log], expected, rtol=0.05)
            count = len(residual[own]) * freedom / len(V)
            np.testing.assert_allclose(rows[column, log], count, rtol=0.02)


def test_readings_with_other_gravities_and_lengths_leave_what_least_squares_for_each_arm_leaves(six):
    arm, own = six.structure.arm, as_logged(six.structure.arm, 2)
    factors = np.where(np.arange(arm.n) == 2, 1.3, 0.9)
    others = [replace(own, length_factors=factors), replace(own, gravity=np.array([3.1, -2.7, -8.9]))]
    together = unexplained(six, [own, *others], looked_at(six))[0]
    for k, each in enumerate(others, 1):
        other = doubted(structure_of(each.of_arm(arm)), six.recordings)
        alone = unexplained(other, [as_logged(other.structure.arm, 2)], looked_at(other))[0][0]
        np.testing.assert_allclose(together[k], alone, rtol=0.02)  # with another basis of the same span
        assert not np.allclose(together[0], alone, rtol=0.1)


def test_the_gain_of_a_reading_counts_no_more_instants_than_either_has(sound):
    exchanged = next(each for each in orders(sound) if each.words == "columns q1 and q2 are exchanged")
    hypotheses = [as_logged(sound.structure.arm, 2), exchanged.hypothesis]
    at = looked_at(sound)
    (before, after), freedom = unexplained(sound, hypotheses, at)
    assert (freedom[0] < freedom[1]).any()
    assert (freedom[0] > freedom[1]).any()
    found = improvements(np.stack((before, after)), freedom, at)
    expected = 0.5 * np.min(freedom, axis=0) * np.log(before / after)
    np.testing.assert_allclose(found, [0.0, expected.sum()], rtol=1e-9)


@pytest.mark.parametrize("sound", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_alternatives_that_the_last_joints_contradict_are_those_that_all_joints_exclude(ur, six, sound):
    wrong = [replace(each, v=exchanged(each.v, 1, 2)) for each in six.recordings]
    logs = six if sound else doubted(ur, wrong)
    alternatives = [each for family in FAMILIES for each in family.alternatives(logs)]
    at, hypotheses = looked_at(logs), [logs.given, *(each.hypothesis for each in alternatives)]
    whole = improvements(*unexplained(logs, hypotheses, at), at)[1:]
    ranked = screened(logs, alternatives)
    assert [each.gain for each in ranked] == sorted((each.gain for each in ranked), reverse=True)
    # No reading of sound logs is worth a comparison.
    assert ranked[0].gain < 8.0 if sound else "v2 and v3 are exchanged" in ranked[0].alternative.words
    found = {id(each.alternative): each for each in ranked}
    left_early = 0
    for each, gain in zip(alternatives, whole, strict=True):
        own = found[id(each)]
        assert own.excluded == (gain < -SURELY_WORSE), each.words
        if own.gain >= -SURELY_WORSE - MARGIN:
            np.testing.assert_allclose(own.gain, gain, rtol=1e-6, atol=1e-6)  # other sums of the same products
        left_early += own.gain != pytest.approx(gain, rel=1e-6)
    assert not sound or left_early > 100
