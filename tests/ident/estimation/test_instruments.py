"""`iv`: the smooth motion, least squares with instruments, and what they mend."""

from dataclasses import replace

import numpy as np
import pytest
from consistency_logs import logs_of, problem_of
from exact import EXACT, GAIN, TRUSTING, exact_pair, full_rate
from real_friction import Truth

from ident.estimation.estimators.iv import instrumental, instrumental_gains, instruments
from ident.estimation.joint_by_joint import gain_system, joint_by_joint_gains
from ident.estimation.problem import pair
from ident.observation.full_rate import FullRate
from ident.observation.smooth_motion import DEGREE, Reference, reference
from ident.support.errors import NotIdentifiable


def smooth(q: np.ndarray) -> Reference:
    return reference(full_rate(q, np.zeros(q.shape[1]), period=0.005))


def slow_motion(t: np.ndarray, rates: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sine a joint of the given frequencies [Hz], not periodic in the recording."""
    w = 2.0 * np.pi * np.array(rates)
    angle = np.outer(t, w) + 0.3
    return 0.7 * np.sin(angle) + 0.2 * t[:, None], 0.7 * w * np.cos(angle) + 0.2, -0.7 * w**2 * np.sin(angle)


def test_a_slow_motion_is_found_with_its_derivatives():
    t = 0.005 * np.arange(3000)
    true = slow_motion(t, (0.4, 0.9))
    found = smooth(true[0])
    # Pieces of 1/15 s at most: the sixth derivative times the piece to the sixth over the sixth's spline constant.
    for each, exact, atol in zip((found.q, found.dq, found.ddq), true, (1e-6, 3e-5, 3e-3), strict=True):
        np.testing.assert_allclose(each, exact, atol=atol)


def test_the_share_of_the_noise_that_is_kept_is_that_of_the_coefficients(monkeypatch):
    # Noise as the positions' filter leaves it, white up to 15 Hz, on a cubic, which any number of pieces fits: what
    # 65 of 450 independent values in 6 joints hold is known to sqrt(2 / (6 * 65)) = 7 %; 4 of them.
    monkeypatch.setattr("ident.observation.smooth_motion.MOST", 65.5 / 450)  # 60 pieces, and no other number
    monkeypatch.setattr("ident.observation.smooth_motion.FINER", 1e3)
    t, rng = 0.005 * np.arange(3000), np.random.default_rng(2)
    below = (np.fft.rfftfreq(3000, 0.005) < 15.0)[:, None]
    sizes = 0.01 * np.arange(1, 7)
    noise = np.fft.irfft(np.fft.rfft(sizes * rng.standard_normal((3000, 6)), axis=0) * below, 3000, axis=0)
    true = (0.1 * t[:, None]) ** 3
    found = smooth(true + noise)
    np.testing.assert_allclose(found.kept, 65 / (2 * 15.0 * t[-1]), rtol=1e-12)
    of_all = np.mean(noise**2, axis=0)
    assert np.mean(np.mean((found.q - true) ** 2, axis=0) / of_all) == pytest.approx(65 / 450, rel=0.28)
    np.testing.assert_allclose(found.left, np.sqrt(of_all * (1 - 65 / 450)), rtol=0.1)


def test_no_other_number_of_pieces_has_a_smaller_criterion_of_schwarz(monkeypatch):
    t, rng, independent = 0.005 * np.arange(3000), np.random.default_rng(2), 2 * 15.0 * 0.005 * 2999
    q = slow_motion(t, (0.2, 2.1, 0.7))[0] + 1e-3 * rng.standard_normal((3000, 3))

    def criterion() -> np.ndarray:
        found = smooth(q)
        return independent * np.log(found.left**2) + independent * found.kept * np.log(independent)

    chosen, numbers = criterion(), {int((0.5 * independent - DEGREE) / 1.15**k) for k in range(0, 39, 2)}
    monkeypatch.setattr("ident.observation.smooth_motion.FINER", 1e3)
    for number in numbers:
        monkeypatch.setattr("ident.observation.smooth_motion.MOST", (number + 0.5 + DEGREE) / independent)
        assert (criterion() >= chosen - 1e-6).all()


def test_no_more_than_half_of_the_independent_samples_become_coefficients():
    kept = smooth(slow_motion(0.005 * np.arange(3000), (3.0, 4.0))[0]).kept
    assert ((kept <= 0.5) & (kept > 0.49)).all()


def test_instruments_solve_their_normal_equations(structure, heavy):
    rng = np.random.default_rng(5)
    problem = pair(*exact_pair(structure, heavy, GAIN, rng, noise=0.02, rows=80), heavy, TRUSTING)
    system = gain_system(problem, 3, [heavy.known_part()])
    W, V = system.W, system.rows.V
    Z = W + 0.3 * np.sqrt(np.mean(W**2, axis=0)) * rng.standard_normal(W.shape)
    fit = instrumental(system, Z, 1e-9)
    inverse = np.linalg.inv(Z.T @ W)
    np.testing.assert_allclose(fit.fit.x, inverse @ Z.T @ V, rtol=1e-6)  # inverse of a condition of some 1e5
    np.testing.assert_allclose(fit.by_current, inverse @ Z.T, atol=1e-6 * np.abs(fit.by_current).max())
    np.testing.assert_allclose(fit.fit.residual, V - W @ fit.fit.x, atol=1e-12 * np.abs(V).max())
    np.testing.assert_allclose(fit.fit.cofactor, inverse @ Z.T @ Z @ inverse.T, rtol=1e-5)
    np.testing.assert_allclose(fit.fit.sigma, np.linalg.norm(V - W @ fit.fit.x) / np.sqrt(160 - W.shape[1]), rtol=1e-9)
    np.testing.assert_allclose(fit.fit.basis @ (fit.fit.basis.T @ W), W, atol=1e-10 * np.abs(W).max())
    assert fit.inverse == fit.fit.x[-1]


def test_instruments_that_are_too_few_or_dependent_or_zero_or_of_no_recording_are_refused(structure, heavy):
    problem = pair(*exact_pair(structure, heavy, GAIN, np.random.default_rng(5), rows=40), heavy, TRUSTING)
    system = gain_system(problem, 3, [heavy.known_part()])
    b = system.W.shape[1]

    def some(rows: int):
        kept = np.random.default_rng(1).permutation(len(system.W))[:rows]
        return replace(system, W=system.W[kept], rows=replace(system.rows, V=system.rows.V[kept]))

    double, empty = system.W.copy(), system.W.copy()
    double[:, 2], empty[:, 4] = 3.0 * double[:, 1], 0.0
    dependent, zero = "does not excite every parameter: relative", "column 4 of the observation matrix is zero"
    assert instrumental(some(b + 1), some(b + 1).W, 1e-12).fit.x.shape == (b,)
    with pytest.raises(NotIdentifiable, match=f"{b} rows cannot give {b} unknowns"):
        instrumental(some(b), some(b).W, 1e-9)
    for wrong, said in ((double, dependent), (empty, zero)):
        for part, Z in ((system, wrong), (replace(system, W=wrong), system.W)):
            with pytest.raises(NotIdentifiable, match=said):
                instrumental(part, Z, 1e-9)
    with pytest.raises(NotIdentifiable, match="motion 1 has rows but no recording; iv needs it"):
        instrumental_gains(problem)


def test_instruments_along_the_recorded_motion_are_the_regressor(axes, monkeypatch):
    problem = problem_of(axes, logs_of(Truth()))

    def same(behind: FullRate) -> Reference:
        share = 1.5 if behind is problem.motions[0].observation.full_rate else 1.0
        kept = share * np.array([0.1, 0.3, 0.2])
        return Reference(q=behind.q, dq=behind.dq, ddq=behind.ddq, kept=kept, left=np.zeros(3))

    monkeypatch.setattr("ident.estimation.estimators.iv.reference", same)
    along, kept = instruments(problem)
    for ours, theirs in zip(along.motions, problem.motions, strict=True):
        assert ours.payload is theirs.payload
        for a, b in zip(ours.observation.joints, theirs.observation.joints, strict=True):
            np.testing.assert_allclose(a.W, b.W, atol=1e-12 * np.abs(b.W).max())
            np.testing.assert_allclose(a.W_L, b.W_L, atol=1e-12 * np.abs(b.W_L).max())
            np.testing.assert_array_equal(a.V, b.V)
    assert kept == pytest.approx(0.45, rel=1e-12)
    estimate, ordinary = instrumental_gains(problem), joint_by_joint_gains(problem)
    np.testing.assert_allclose(estimate.solution.inverse, ordinary.solution.inverse, rtol=1e6 * EXACT)
    # 0.45 of the positions' variance, and that share to the fifth power of the accelerations'.
    assert estimate.remarks == (
        "the instruments retain up to 45 % of the noise variance of positions, 1.8 % of that of accelerations",
    )
