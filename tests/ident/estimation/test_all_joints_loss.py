"""Student's loss: what least squares sees of residuals, and what it finds then."""

from dataclasses import replace

import numpy as np
from exact import GAIN, exact_pair, values
from scipy import stats

from ident.estimation.estimate import GainEstimate
from ident.estimation.estimators.nls import AllJointsOptions, all_joints_gains, student
from ident.estimation.problem import GainOptions, pair
from ident.observation.observation import Observation
from ident.payload.payload import Payload

LOOSE = GainOptions(noise_floor=1e-12, max_rel_std=10.0, uncertainty="classical")


def found(motions: tuple[Observation, Observation], heavy: Payload, loss: str, options=LOOSE) -> GainEstimate:
    return all_joints_gains(pair(*motions, heavy, options), AllJointsOptions(loss=loss))


def with_currents(motions: tuple[Observation, Observation], change) -> tuple[Observation, Observation]:
    unloaded, loaded = (
        replace(each, joints=tuple(replace(joint, V=change(joint.V)) for joint in each.joints)) for each in motions
    )
    return unloaded, loaded


def test_what_least_squares_sees_is_the_score_of_student_s_distribution():
    e = np.array([0.31, -0.52, 0.17, 2.9, -41.0, 0.08, -0.23])
    s = stats.norm.ppf(0.75) ** -1 * 0.31  # 0.31 is the median of the sizes
    u, step = e / s, 1e-5
    law = stats.t(4.0)
    score = -(law.logpdf(u + step) - law.logpdf(u - step)) / (2.0 * step)
    slope = -(law.logpdf(u + step) - 2.0 * law.logpdf(u) + law.logpdf(u - step)) / step**2
    # Differences of logarithms of size 10 over 1e-10; 1.4826 has five digits.
    np.testing.assert_allclose(student(e, np.ones(7)), s * score / slope.mean(), rtol=1e-4)
    rounded = np.array([3e-17, -2e-17, 1e-16])  # far below 1e-6 of the currents, they stay as they are
    np.testing.assert_allclose(student(rounded, np.full(3, 2.7)), rounded, rtol=1e-12)


def test_gross_outliers_hardly_move_gains_and_are_told(structure, heavy, rng):
    motions = exact_pair(structure, heavy, GAIN, rng, noise=0.003, rows=300)

    def spoilt(V: np.ndarray) -> np.ndarray:
        far = np.arange(len(V)) % 50 == 7  # 2 %, all to one side
        return np.where(far, V + 3.0 * np.sqrt(np.mean(V**2)), V)

    clean = found(motions, heavy, "squares")
    squares, tamed = (found(with_currents(motions, spoilt), heavy, loss) for loss in ("squares", "student"))
    std = np.array([joint.residual_std for joint in clean.joints]) / np.abs(GAIN)
    off = [np.abs(values(each) / GAIN - 1.0) / std for each in (squares, tamed)]
    assert off[0].max() > 20.0
    assert off[1].max() < 4.0  # of six gains; the loss costs a tenth in deviation
    # Deviations are those of data without outliers, not of the squares of these.
    told = np.array([joint.residual_std for joint in tamed.joints]) / np.abs(GAIN)
    np.testing.assert_allclose(told / std, 1.1, atol=0.25)
    share = float(tamed.remarks[-1].split()[0])
    assert 2.0 <= share < 4.0
    given = np.concatenate([joint.V for each in with_currents(motions, spoilt) for joint in each.joints])
    np.testing.assert_array_equal(np.sort(tamed.solution.rows.V), np.sort(given))
