"""The null vector of the homogeneous form, its derivative, and where there is more than one."""

import numpy as np
import pytest

from ident.estimation.estimators.tls_2014 import null_vector
from ident.support.errors import NotIdentifiable


def test_the_null_vector_is_the_last_eigenvector_of_the_scaled_normal_matrix(rng):
    M = rng.normal(size=(40, 5)) * [1.0, 30.0, 0.2, 4.0, 7.0]
    M[:, 4] = M[:, :4] @ [0.7, 0.02, -3.0, 0.4] + 0.3 * rng.normal(size=40)
    scale = np.array([2.0, 11.0, 0.3, 5.0, 6.0])
    z = np.linalg.eigh((M / scale).T @ (M / scale))[1][:, 0] / scale
    found = null_vector(M, scale, rank_tol=1e-9)
    np.testing.assert_allclose(found.x, z / z[-1], rtol=1e-9)
    h, column, row = 1e-6, 2, 17
    derivative = found.derivative(np.full(40, column), np.full(40, 3.0))[:, row]
    ends = []
    for sign in (-1.0, 1.0):
        other = M.copy()
        other[row, column] += 3.0 * sign * h
        ends.append(null_vector(other, scale, rank_tol=1e-9).x)
    np.testing.assert_allclose(derivative, (ends[1] - ends[0]) / (2.0 * h), atol=1e-7 * np.abs(derivative).max())


def test_a_null_vector_that_is_not_the_only_one_or_knows_no_payload_is_refused(rng):
    M = rng.normal(size=(40, 5))
    M[:, 1], M[:, 2] = M[:, 0], 3.0 * M[:, 0]
    with pytest.raises(NotIdentifiable, match="the gains are not unique"):
        null_vector(M, np.ones(5), rank_tol=1e-7)
    M = rng.normal(size=(40, 5))
    M[:, 4], M[:, 3] = 0.7 * M[:, 0], 2.0 * M[:, 1] + M[:, 0]
    with pytest.raises(NotIdentifiable, match="the gains are not unique"):
        null_vector(M, np.ones(5), rank_tol=1e-7)
    M = rng.normal(size=(40, 5))
    M[:, 1] = 2.0 * M[:, 0]
    with pytest.raises(NotIdentifiable, match="the gains are not unique"):
        null_vector(M, np.ones(5), rank_tol=1e-7)
