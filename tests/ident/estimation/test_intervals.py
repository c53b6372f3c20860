"""Covariances of what residuals move, and time blocks left out: beside fits that are really made without them."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from linear_solutions import Linear
from scipy import linalg

from ident.estimation.estimate import uncertain
from ident.estimation.intervals import (
    UNCERTAINTIES,
    Basis,
    Rows,
    classical,
    cross_validated,
    held_out,
    jackknife,
    max_of_classical_and_jackknife,
)
from ident.estimation.problem import GainOptions

UNKNOWNS = 7
MOTIONS = (900, (100, 60))
"""Position of the first row, and rows of each motion, including those that are left out."""


@pytest.fixture
def linear(rng) -> Linear:
    """Motions of 100 and 60 positions from 900 on, of which joint 0 lacks some and joint 2 others, but not the ends."""
    parts = []
    for (j, share), (m, length) in product(((0, 0.9), (2, 0.7)), enumerate(MOTIONS[1])):
        kept = rng.uniform(size=length) < share
        kept[[0, -1]] = True
        at = np.flatnonzero(kept)
        parts.append((np.full_like(at, j), np.full_like(at, m), MOTIONS[0] + at))
    joint, motion, position = np.hstack(parts)
    W = rng.normal(size=(len(joint), UNKNOWNS)) * np.where(joint == 0, 2.0, 0.3)[:, None]
    V = W @ rng.normal(size=UNKNOWNS) + rng.normal(size=len(joint)) * np.where(joint == 0, 0.2, 5.0)
    weight = np.where(joint == 0, 4.7, 0.17)
    prior = np.zeros((2, UNKNOWNS))
    prior[0, 1], prior[1, 6] = 30.0, 2.5
    return Linear(W, V, weight, joint, motion, position, prior, np.array([12.0, -0.4]))


def jackknifed(linear: Linear) -> np.ndarray:
    """The covariance of the first unknowns by fits that are made without each block."""
    fits = np.array([linear.fit(~block)[:UNKNOWNS] for block in linear.blocks(*MOTIONS)])
    apart = fits - fits.mean(axis=0)
    return 39.0 / 40.0 * apart.T @ apart


def test_what_is_left_out_is_predicted_as_by_a_fit_without_it(linear):
    left, number = held_out(linear.rows)
    for k, block in enumerate(linear.blocks(*MOTIONS)):
        expected = linear.left(~block)[block]
        np.testing.assert_allclose(left[block], expected, rtol=0, atol=1e-11 * np.abs(expected).max())  # rounding
        np.testing.assert_array_equal(number == k, block)


def test_its_covariance_is_that_of_fits_without_each_stretch(linear):
    found = jackknife(linear.rows, linear.influence)
    np.testing.assert_allclose(found, jackknifed(linear), rtol=0, atol=1e-11 * np.abs(found).max())


def test_an_unknown_that_one_stretch_alone_shows_moves_no_other(linear):
    own = np.where(next(linear.blocks(*MOTIONS)), np.sin(1.0 + np.arange(len(linear.V))), 0.0)
    more = replace(linear, W=np.column_stack((linear.W, own)), belief=np.pad(linear.belief, ((0, 0), (0, 1))))
    found = jackknife(more.rows, more.influence)[:UNKNOWNS, :UNKNOWNS]
    # Least norm: what is not shown is zero.
    np.testing.assert_allclose(found, jackknifed(more), rtol=0, atol=1e-9 * np.abs(found).max())


def test_cautious_is_the_larger_of_classical_and_jackknife(linear):
    rows, influence = linear.rows, linear.influence
    rows = replace(rows, residual=rows.residual * np.where(rows.joint == 0, 1.0 + np.sin(rows.position), 1.0))
    one, two, both = (kind(rows, influence) for kind in (classical, jackknife, max_of_classical_and_jackknife))
    assert (np.diag(one) > np.diag(two)).any()
    assert (np.diag(one) < np.diag(two)).any()
    np.testing.assert_allclose(np.diag(both), np.maximum(np.diag(one), np.diag(two)), rtol=1e-13)
    scale = np.sqrt(np.outer(np.diag(one), np.diag(one)) / np.outer(np.diag(both), np.diag(both)))
    np.testing.assert_allclose(both * scale, one, rtol=1e-12)


def test_a_basis_without_its_zeros_is_the_whole_one(rng):
    own, more = [rng.normal(size=size) for size in ((5, 2), (3, 4))], rng.normal(size=(8, 3))
    basis, dense = Basis.of(*own).beside(more), np.hstack((linalg.block_diag(*own), more))
    x, y, some = rng.normal(size=(9, 2)), rng.normal(size=(8, 2)), np.array([1, 4, 6])
    assert basis.shape == dense.shape
    np.testing.assert_array_equal(basis.at(some), dense[some])
    np.testing.assert_allclose(basis.times(x), dense @ x, rtol=0, atol=1e-14)
    np.testing.assert_allclose(basis.against(y), dense.T @ y, rtol=0, atol=1e-14)


def test_of_no_gain_there_is_no_covariance():
    none = np.zeros(0, dtype=int)
    rows = Rows(V=none, residual=none, joint=none, motion=none, position=none, unknowns={},
        weight=none, explained=Basis.of())  # fmt: skip
    assert jackknife(rows, np.zeros((0, 0))).shape == (0, 0)


@pytest.fixture
def rows(linear, rng) -> Rows:
    """Of joints that have no unknown in common."""
    found = linear.rows
    own = (linalg.orth(rng.normal(size=(np.sum(found.joint == j), 2))) for j in (0, 2))
    return replace(found, explained=Basis.of(*own))


@pytest.fixture
def influence(rows, rng) -> np.ndarray:
    """Of three quantities; all errors push the second one the same way."""
    influence = rng.normal(size=(3, len(rows.V)))
    influence[1] = rows.residual
    return influence


def test_rows_know_the_deviation_share_and_rms_of_a_joint(rows):
    own = slice(int(np.sum(rows.joint == 0)), len(rows.V))
    assert rows.of(2) == own
    left, squares, r = np.sum(rows.residual[own] ** 2), np.sum(rows.V[own] ** 2), len(rows.V[own])
    found = rows.sigma(2), rows.rms_current(2), rows.residual_share(2)
    expected = np.sqrt([left / (r - rows.unknowns[2]), squares / r, left / squares])
    np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_classical_covariance_gives_each_joint_s_rows_its_own_deviation(rows, influence):
    a, b = np.split(influence, [rows.of(2).start], axis=1)
    expected = rows.sigma(0) ** 2 * a @ a.T + rows.sigma(2) ** 2 * b @ b.T
    np.testing.assert_allclose(UNCERTAINTIES["classical"](rows, influence), expected, rtol=1e-13)


def test_a_prediction_never_assumes_less_than_the_noise_floor(rows, influence, monkeypatch):
    covariance = np.diag([1e-6, 400.0, 1e-6])
    monkeypatch.setitem(UNCERTAINTIES, "jackknife", lambda rows, influence: covariance)
    same, found = uncertain(rows, influence, GainOptions(noise_floor=0.05, uncertainty="jackknife"))
    assert same is covariance
    rms = np.where(rows.joint == 0, rows.rms_current(0), rows.rms_current(2))
    least = np.sqrt(np.sum((influence * 0.05 * rms) ** 2, axis=1))
    np.testing.assert_allclose(found, [least[0], 20.0, least[2]], rtol=1e-13)


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


def test_parts_left_out_are_predicted_as_by_fits_without_them(linear):
    error = np.zeros(len(linear.V))
    for block in linear.blocks(*MOTIONS, parts=5):
        error[block] = linear.left(~block)[block]
    for j, found in zip((0, 2), cross_validated(linear.rows), strict=True):
        own = linear.joint == j
        assert found.joint == j
        for share, left in ((found.share, error), (found.fitted, linear.left(linear.every))):
            np.testing.assert_allclose(share, np.linalg.norm(left[own]) / np.linalg.norm(linear.V[own]), rtol=1e-9)
        assert found.share > found.fitted
