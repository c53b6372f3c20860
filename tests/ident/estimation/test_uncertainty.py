from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg

from ident.estimation.estimate import predicted_rel_std
from ident.estimation.intervals import UNCERTAINTIES, Rows


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
    np.testing.assert_allclose(UNCERTAINTIES["classical"](rows, influence), expected, rtol=1e-13)


def test_a_prediction_never_assumes_less_than_the_noise_floor(rows, influence):
    inverse, covariance = np.array([0.5, -2.0, 4.0]), np.diag([1e-6, 400.0, 1e-6])
    found = predicted_rel_std(rows, influence, inverse, covariance, 0.05)
    rms = np.where(rows.joint == 0, rows.rms_current(0), rows.rms_current(2))
    least = np.sqrt(np.sum((influence * 0.05 * rms) ** 2, axis=1))
    np.testing.assert_allclose(found, [least[0] / 0.5, 20.0 / 2.0, least[2] / 4.0], rtol=1e-13)


@pytest.mark.parametrize("name", UNCERTAINTIES)
def test_a_covariance_is_symmetric_never_indefinite_and_the_square_of_what_scales(name, rows, influence):
    uncertainty = UNCERTAINTIES[name]
    found = uncertainty(rows, influence)
    assert found.shape == (3, 3)
    np.testing.assert_allclose(found, found.T, rtol=1e-13)
    assert np.linalg.eigvalsh(found).min() > -1e-12 * np.trace(found)  # rounding
    assert (np.diag(found) > 0.0).all()
    per_quantity = np.array([-1.7, 0.3, 5.0])
    scaled = uncertainty(rows, per_quantity[:, None] * influence)
    np.testing.assert_allclose(scaled, np.outer(per_quantity, per_quantity) * found, rtol=1e-12)
    larger = replace(rows, residual=-2.3 * rows.residual)
    np.testing.assert_allclose(uncertainty(larger, influence), 2.3**2 * found, rtol=1e-12)


@pytest.mark.parametrize("name", UNCERTAINTIES)
def test_a_quantity_is_moved_by_the_residuals_of_the_rows_that_influence_it_alone(name, rows, influence):
    own = influence * (rows.joint == 2)
    found = UNCERTAINTIES[name](rows, own)
    louder = replace(rows, residual=np.where(rows.joint == 2, 1.0, 9.0) * rows.residual)
    np.testing.assert_allclose(UNCERTAINTIES[name](louder, own), found, rtol=1e-12)
