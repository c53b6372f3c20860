from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg

from ident.estimation.identifiability import predicted_rel_std
from ident.estimation.rows import Rows
from ident.estimation.uncertainty import UNCERTAINTIES
from ident.numerics.least_squares import least_squares


@pytest.fixture
def rows(rng) -> Rows:
    """Joints 0 and 2, the second with two motions; positions with gaps; residuals of different size."""
    joint, motion = np.repeat([0, 2, 2], [7, 5, 6]), np.repeat([0, 0, 1], [7, 5, 6])
    position = np.concatenate([np.sort(rng.choice(12, size, replace=False)) for size in (7, 5, 6)])
    residual = rng.normal(size=18) * np.where(joint == 0, 0.3, 1.7)
    return Rows(
        V=rng.normal(size=18),
        residual=residual,
        joint=joint,
        motion=motion,
        position=position,
        row_period=0.25,
        unknowns={0: 2, 2: 4},
        weight=np.where(joint == 0, 3.1, 0.6),
        explained=linalg.block_diag(linalg.orth(rng.normal(size=(7, 2))), linalg.orth(rng.normal(size=(11, 2)))),
    )


@pytest.fixture
def influence(rows, rng) -> np.ndarray:
    """Of three quantities; all errors push the second one the same way."""
    influence = rng.normal(size=(3, 18))
    influence[1] = rows.residual
    return influence


def test_rows_know_the_deviation_share_and_rms_of_a_joint(rows):
    own = slice(7, 18)
    assert rows.of(2) == own
    np.testing.assert_allclose(rows.sigma(2), np.sqrt(np.sum(rows.residual[own] ** 2) / (11 - 4)), rtol=1e-14)
    np.testing.assert_allclose(rows.rms_current(2), np.sqrt(np.sum(rows.V[own] ** 2) / 11), rtol=1e-14)
    share = np.sqrt(np.sum(rows.residual[own] ** 2) / np.sum(rows.V[own] ** 2))
    np.testing.assert_allclose(rows.residual_share(2), share, rtol=1e-14)
    assert list(rows.runs()) == [slice(0, 7), slice(7, 12), slice(12, 18)]
    none = replace(rows, V=rows.V[:0], joint=rows.joint[:0], motion=rows.motion[:0])
    assert not list(none.runs())


def test_classical_covariance_gives_each_joint_s_rows_its_own_deviation(rows, influence):
    a, b = influence[:, :7], influence[:, 7:]
    expected = rows.sigma(0) ** 2 * a @ a.T + rows.sigma(2) ** 2 * b @ b.T
    np.testing.assert_allclose(UNCERTAINTIES["classical"](rows, influence, 1.0), expected, rtol=1e-13)


@pytest.mark.parametrize(("serial_s", "lags"), [(0.0, 1), (0.25, 1), (0.6, 2), (0.7, 3), (1.0, 4), (500.0, 2000)])
def test_serial_covariance_is_the_sum_of_newey_and_west(rows, influence, serial_s, lags):
    expected = np.zeros((3, 3))
    for i in range(18):
        for k in range(18):
            apart = abs(rows.position[i] - rows.position[k])
            if rows.joint[i] == rows.joint[k] and rows.motion[i] == rows.motion[k] and apart < lags:
                share = (1.0 - apart / lags) * rows.residual[i] * rows.residual[k]
                expected += share * np.outer(influence[:, i], influence[:, k])
    found = UNCERTAINTIES["serial"](rows, influence, serial_s)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)  # sums of 18 x 18 terms of size one


def test_the_larger_of_both_is_taken_quantity_by_quantity_with_the_classical_correlations(rows, influence):
    classical, serial, larger = (UNCERTAINTIES[n](rows, influence, 1.0) for n in ("classical", "serial", "larger"))
    assert (np.diag(classical) > np.diag(serial)).any()
    assert (np.diag(classical) < np.diag(serial)).any()
    np.testing.assert_allclose(np.diag(larger), np.maximum(np.diag(classical), np.diag(serial)), rtol=1e-13)

    def correlation(C: np.ndarray) -> np.ndarray:
        return C / np.sqrt(np.outer(np.diag(C), np.diag(C)))

    np.testing.assert_allclose(correlation(larger), correlation(classical), rtol=1e-12, atol=1e-14)


def test_a_prediction_never_assumes_less_than_the_noise_floor(rows, influence):
    inverse, covariance = np.array([0.5, -2.0, 4.0]), np.diag([1e-6, 400.0, 1e-6])
    found = predicted_rel_std(rows, influence, inverse, covariance, 0.05)
    rms = np.where(rows.joint == 0, rows.rms_current(0), rows.rms_current(2))
    least = np.sqrt(np.sum((influence * 0.05 * rms) ** 2, axis=1))
    np.testing.assert_allclose(found, [least[0] / 0.5, 20.0 / 2.0, least[2] / 4.0], rtol=1e-13)


@pytest.mark.parametrize("name", UNCERTAINTIES)
def test_a_covariance_is_symmetric_never_indefinite_and_the_square_of_what_scales(name, rows, influence):
    uncertainty = UNCERTAINTIES[name]
    found = uncertainty(rows, influence, 0.6)
    assert found.shape == (3, 3)
    np.testing.assert_allclose(found, found.T, rtol=1e-13)
    assert np.linalg.eigvalsh(found).min() > -1e-12 * np.trace(found)  # rounding
    assert (np.diag(found) > 0.0).all()
    per_quantity = np.array([-1.7, 0.3, 5.0])
    scaled = uncertainty(rows, per_quantity[:, None] * influence, 0.6)
    np.testing.assert_allclose(scaled, np.outer(per_quantity, per_quantity) * found, rtol=1e-12)
    larger = replace(rows, residual=-2.3 * rows.residual)
    np.testing.assert_allclose(uncertainty(larger, influence, 0.6), 2.3**2 * found, rtol=1e-12)


@pytest.mark.parametrize("name", UNCERTAINTIES)
def test_a_quantity_is_moved_by_the_residuals_of_the_rows_that_influence_it_alone(name, rows, influence):
    own = influence * (rows.joint == 2)
    found = UNCERTAINTIES[name](rows, own, 0.6)
    louder = replace(rows, residual=np.where(rows.joint == 2, 1.0, 9.0) * rows.residual)
    np.testing.assert_allclose(UNCERTAINTIES[name](louder, own, 0.6), found, rtol=1e-12)


def serial_of(motions: int, left_out: bool) -> tuple[float, float, float]:
    """Spread of the estimates, rms of white and of serial deviations, over 400 draws of AR(1) residuals."""
    rng, found, white, own = np.random.default_rng(1), [], [], []
    n, phi = 400, 0.7
    positions = [np.sort(rng.choice(n, 300, replace=False)) if left_out else np.arange(n) for _ in range(motions)]
    W = np.vstack([np.column_stack((np.ones(n), np.sin(np.arange(n) / 40.0)))[p] for p in positions])
    for _ in range(400):
        noise = np.zeros((motions, n + 50))
        for k in range(1, n + 50):
            noise[:, k] = phi * noise[:, k - 1] + rng.normal(size=motions)
        Y = W @ [1.0, 2.0] + np.concatenate([noise[m, 50:][p] for m, p in enumerate(positions)])
        fit = least_squares(W, Y, rank_tol=1e-9)
        rows = Rows(
            V=Y,
            residual=fit.residual,
            joint=np.zeros(len(Y), dtype=np.intp),
            motion=np.repeat(np.arange(motions), len(positions[0])),
            position=np.concatenate(positions),
            row_period=0.05,
            unknowns={0: 2},
            weight=np.ones(len(Y)),
            explained=fit.basis,
        )
        influence = (W @ fit.cofactor[1])[None]
        found.append(fit.x[1])
        white.append(UNCERTAINTIES["classical"](rows, influence, 1.0)[0, 0])
        own.append(UNCERTAINTIES["serial"](rows, influence, 1.0)[0, 0])
    return float(np.std(found)), float(np.sqrt(np.mean(white))), float(np.sqrt(np.mean(own)))


@pytest.mark.parametrize("left_out", [False, True])
def test_serial_deviations_hold_where_residuals_are_correlated_and_white_ones_do_not(left_out):
    # AR(1) with 0.7: the white formula is short by up to sqrt(1.7 / 0.3) = 2.4. The spread is known to 3.5 %;
    # Bartlett weights up to 20 rows keep some 85 to 100 % of the true deviation.
    spread, white, own = serial_of(2, left_out)
    assert white < 0.65 * spread
    assert 0.8 * spread < own < 1.15 * spread
