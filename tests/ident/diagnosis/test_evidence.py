"""Held-out predictions beside fits that are really made without a block; gains and z beside the formulas."""

from dataclasses import replace
from itertools import pairwise, product
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import linalg

from ident.diagnosis.evidence import Evidence, Fits, Score, each_added, free_fit
from ident.diagnosis.evidence import log_density_improvement as improvement
from ident.diagnosis.hypothesis import scored_as
from ident.diagnosis.models import numbered_blocks
from ident.estimation.intervals import BLOCKS, z_of

RIDGE = 1e-6
"""Relative effect of a prior of 1e-9 on unit columns, which a residual feels times coefficients of up to a thousand."""


def added(fits: Fits, columns) -> Evidence | None:
    """What one set of columns adds."""
    return each_added(fits, [columns])[0]


FITTED = (0, 2)


class Made:
    """Three joints in two logs with 2 x 20 blocks; joint 2 has too few rows to be fitted, others an uneven number."""

    def __init__(self, seed: int = 3) -> None:
        rng = np.random.default_rng(seed)
        self.W, self.V, self.block = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
        for rows, p, size in ((130, 4, 0.3), (3, 4, 1.0), (171, 6, 7.0)):
            block = np.sort(rng.integers(0, 2 * BLOCKS, rows))
            W = rng.normal(size=(rows, p)) * rng.uniform(0.1, 30.0, p)
            self.W.append(W)
            self.block.append(block)
            self.V.append(size * (W @ rng.normal(size=p) / 10.0 + rng.normal(size=rows) * (1.0 + block / 15.0)))
        self.columns = [rng.normal(size=(len(V), 3)) * (0.4, 5.0, 90.0) for V in self.V]

    @property
    def fits(self) -> Fits:
        parts = zip(self.W, self.V, self.block, strict=True)
        return Fits(tuple(free_fit(*each, 2 * BLOCKS) if len(each[1]) > 3 else None for each in parts))

    def squares(self, columns: list[np.ndarray | None]) -> np.ndarray:
        """Sums of squares of joints 1 and 3 in each block, by a fit without it; columns share coefficients."""
        X, Y, sigma = self.together(columns)
        joint, block = (np.concatenate([each(j) for j in FITTED]) for each in (self.joint, self.block.__getitem__))
        found, size = np.zeros((3, 2 * BLOCKS)), np.linalg.norm(X, axis=0)
        X = X / np.where(size == 0.0, 1.0, size)
        for b in range(2 * BLOCKS):
            x = np.linalg.lstsq(X[block != b], Y[block != b])[0]
            for j in FITTED:
                own = (block == b) & (joint == j)
                found[j, b] = np.sum((sigma[j] * (Y[own] - X[own] @ x)) ** 2)
        return found

    def joint(self, j: int) -> np.ndarray:
        return np.full(len(self.V[j]), j)

    def together(self, columns: list[np.ndarray | None], sigma=None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Equations of joints 1 and 3 in units of their deviations, which are the last of what is returned."""
        m, sigma = next(each.shape[1] for each in columns if each is not None), self.sigma() if sigma is None else sigma
        more = [np.zeros((len(self.V[j]), m)) if columns[j] is None else columns[j] for j in FITTED]
        X = np.hstack((linalg.block_diag(*(self.W[j] for j in FITTED)), np.vstack(more)))
        unit = np.concatenate([np.full(len(self.V[j]), sigma[j]) for j in FITTED])
        return X / unit[:, None], np.concatenate([self.V[j] for j in FITTED]) / unit, sigma

    def sigma(self) -> np.ndarray:
        """Of the held-out residuals without columns, each joint alone."""
        found = np.zeros(3)
        for j in FITTED:
            left = np.empty(len(self.V[j]))
            for b in range(2 * BLOCKS):
                own = self.block[j] == b
                x = np.linalg.lstsq(self.W[j][~own], self.V[j][~own])[0]
                left[own] = self.V[j][own] - self.W[j][own] @ x
            found[j] = np.sqrt(np.mean(left**2))
        return found


@pytest.fixture(scope="module")
def made() -> Made:
    return Made()


def test_what_is_held_out_is_left_by_a_fit_that_has_not_seen_the_block(made):
    score = made.fits.score
    nothing = [np.zeros((len(V), 1)) for V in made.V]
    np.testing.assert_allclose(score.squares, made.squares(nothing), rtol=RIDGE, atol=1e-12)
    np.testing.assert_array_equal(score.rows[[0, 2]], [np.bincount(made.block[j], minlength=40) for j in (0, 2)])
    assert not np.vstack((score.squares[1], score.rows[1])).any()
    np.testing.assert_allclose(made.fits.sigma, made.sigma(), rtol=RIDGE)


def test_long_blocks_are_predicted_as_short_ones(rng):
    # (I - Q_b Q_b') times the held-out residual is the residual: of blocks of more than twice as many rows as columns.
    block = np.repeat(np.arange(3), (31, 9, 47))
    fit = free_fit(rng.normal(size=(87, 5)) * (0.3, 7.0, 2.0, 5.0, 11.0), rng.normal(size=87), block, 3)
    assert fit.layout.shape[2] > 2 * fit.Q.shape[1]
    x, Q = rng.normal(size=(87, 2)), fit.Q.at(np.arange(87))
    found = fit.layout.rows(fit.predicted(x))
    for b in range(3):
        own = block == b
        np.testing.assert_allclose(found[own] - Q[own] @ (Q[own].T @ found[own]), x[own], rtol=0, atol=1e-12)


def test_a_joint_with_dependent_columns_is_predicted_as_without_them(made):
    W, V, block = made.W[0], made.V[0], made.block[0]
    doubled = np.column_stack((W, W[:, 0] - 3.0 * W[:, 2], np.zeros(len(V))))
    plain, other = (Fits((free_fit(each, V, block, 40),)).score.squares for each in (W, doubled))
    np.testing.assert_allclose(other, plain, rtol=1e-6)  # a prior of 1e-9 on each of unit columns


@pytest.mark.parametrize("which", [[0], [1], [0, 1, 2]])
@pytest.mark.parametrize("felt", [(0, 1, 2), (2,), (0,)])
def test_columns_that_are_added_predict_each_block_as_fits_of_all_joints_without_it(made, which, felt):
    columns = [each[:, which] if j in felt else None for j, each in enumerate(made.columns)]
    score, after = made.fits.score, made.squares([each if j != 1 else None for j, each in enumerate(columns)])
    # Differences of sums of squares that are 10 000 times as large in units of sigma.
    expected = improvement(score, replace(score, squares=after))
    np.testing.assert_allclose(added(made.fits, columns).u, expected, rtol=1e-5, atol=1e-6)


def test_coefficients_are_those_of_one_weighted_fit_of_all_joints(made):
    X, Y, _ = made.together(made.columns)
    found = added(made.fits, made.columns)
    np.testing.assert_allclose(found.value, np.linalg.lstsq(X, Y)[0][-3:], rtol=1e-5)  # condition below 1e3
    unit = np.linalg.inv(X.T @ X)[-3:, -3:]
    size = np.sqrt(np.diag(unit))
    # The deviation adds squares of scores of blocks, whose mean is that of white residuals: 1 + 1 of them.
    ratio = np.diag(found.covariance) / size**2
    assert ((ratio > 1.3) & (ratio < 4.0)).all()


def test_a_deviation_grows_where_residuals_last_for_a_block():
    one, other, rng = Made(), Made(), np.random.default_rng(8)
    steps, level = 21.0 * rng.normal(size=40), rng.normal(size=40)
    slow = [level[block][:, None] for block in one.block]
    for j in FITTED:
        other.V[j] = other.V[j] + steps[other.block[j]] * np.abs(slow[j][:, 0])
    ratio = []
    for each in (one, other):
        found = added(each.fits, slow)
        white = 1.0 / sum(np.sum(each.fits.parts[j].without(slow[j] / each.sigma()[j]) ** 2) for j in (0, 2))
        ratio.append(float(found.covariance[0, 0]) / white)
    assert ratio[1] > 2.0 * ratio[0]


def test_columns_that_the_model_knows_add_nothing(made):
    known, zero = [W @ np.ones((W.shape[1], 1)) for W in made.W], [np.zeros((len(V), 1)) for V in made.V]
    for columns in (known, zero, [None] * 3, [None, made.columns[1], None]):  # the last of the joint that has no fit
        assert added(made.fits, columns) is None

    for unit in (1e-5, 1e5):  # of the currents
        fits = Fits((free_fit(made.W[0], unit * made.V[0], made.block[0], 2 * BLOCKS),))
        assert added(fits, [known[0] + made.columns[0][:, :1]]) is not None
        assert added(fits, [known[0]]) is None


@pytest.mark.parametrize("together", [1, 1 << 19])
def test_many_sets_of_columns_add_what_each_adds_alone(made, together, monkeypatch):
    monkeypatch.setattr("ident.diagnosis.evidence.TOGETHER", together)
    one, three = [each[:, :1] for each in made.columns], made.columns
    other = [each[:, 1:2] for each in made.columns]
    choices = [three, one, [None, one[1], None], [None, None, other[2]], [other[0], None, None], other, [None] * 3]
    choices.append([three[0], None, None])
    for found, columns in zip(each_added(made.fits, choices), choices, strict=True):
        alone = added(made.fits, columns)
        assert (found is None) == (alone is None)
        if found is not None and alone is not None:
            for name in ("u", "value", "covariance"):
                np.testing.assert_allclose(getattr(found, name), getattr(alone, name), rtol=1e-9)  # rounding


def test_columns_that_improve_the_fit_less_than_they_are_worth_are_not_compared(made):
    fits = made.fits
    best = np.sqrt(fits.score.by_log.min(axis=1))  # of the log with the smaller residual

    def left(columns) -> float:
        """Sum of squares of a fit of both joints, in units of `best`."""
        X, y, _ = made.together(columns, best)
        return float(np.sum((y - X @ np.linalg.lstsq(X, y)[0]) ** 2))

    three, last = made.columns, [each[:, 2:] for each in made.columns]
    choices = [three, last, [three[0], None, None], [None, None, last[2]], [None, three[1], None]]
    improved = [0.5 * (left(choices[-1]) - left(each)) for each in choices]  # the last is of no fitted joint
    for worth in (0.5 * (a + b) for a, b in pairwise(sorted(improved))):
        for found, columns, each in zip(each_added(fits, choices, worth), choices, improved, strict=True):
            assert (found is not None) == (each > worth)
            if found is not None:
                np.testing.assert_allclose(found.value, added(fits, columns).value, rtol=1e-9)


def test_blocks_are_twentieths_of_each_log_whatever_rows_are_left_out():
    motion = np.array([0, 0, 0, 0, 1, 1, 1, 1])
    position = np.array([0, 9, 10, 199, 0, 2, 39, 45])
    # 10 rows a block in a log of 200, 2 in one of 40; a row beyond the end is of the last block
    expected = [0, 0, 1, 19, 20, 21, 39, 39]
    rows = [[[12, 199], [], [150]], [[39], [7, 38], []]]  # numbers of the rows of the joints, by log
    joints = ([SimpleNamespace(position=each) for each in log] for log in rows)
    logs = [SimpleNamespace(observation=SimpleNamespace(joints=each)) for each in joints]
    np.testing.assert_array_equal(numbered_blocks(SimpleNamespace(motions=logs), motion, position), expected)


def score(rng: np.random.Generator, joints: int = 2) -> Score:
    return Score(rng.uniform(0.5, 9.0, (joints, 40)), rng.integers(3, 30, (joints, 40)).astype(float))


def test_the_gain_of_a_block_is_the_difference_of_normal_log_densities(rng):
    one, other = score(rng), score(rng)
    other = replace(other, rows=one.rows)
    expected = np.zeros(40)
    for j, own, (sign, each) in product(range(2), (slice(20), slice(20, 40)), ((-1.0, one), (1.0, other))):
        rows, squares = each.rows[j, own], each.squares[j, own]
        variance = squares.sum() / rows.sum()
        expected[own] += sign * (-0.5 * rows * np.log(2.0 * np.pi * variance) - 0.5 * squares / variance)
    np.testing.assert_allclose(improvement(one, other), expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(improvement(other, one), -expected, rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(improvement(one, one), np.zeros(40))


def test_rows_of_both_readings_alone_are_counted(rng):
    one, other = score(rng), score(rng)
    expected = 0.0
    for j, own in product(range(2), (slice(20), slice(20, 40))):
        variance = [each.squares[j, own].sum() / each.rows[j, own].sum() for each in (one, other)]
        both = np.minimum(one.rows[j, own], other.rows[j, own]).sum()
        expected += 0.5 * both * np.log(variance[0] / variance[1])
    np.testing.assert_allclose(improvement(one, other).sum(), expected, rtol=1e-9)
    np.testing.assert_allclose(improvement(other, one).sum(), -expected, rtol=1e-9)


def test_joints_that_either_reading_explains_to_the_last_digit_or_not_at_all_gain_nothing(rng):
    one, other = score(rng), score(rng)
    exact = replace(other, squares=np.where([[True], [False]], 0.0, other.squares))
    np.testing.assert_allclose(
        improvement(one, exact),
        improvement(*(replace(each, squares=each.squares[1:], rows=each.rows[1:]) for each in (one, exact))),
    )


def test_z_is_the_sum_of_gains_over_its_standard_error():
    u = np.array([3.0, -1.0, 4.0, 0.5])
    # By hand: sum 6.5, mean 1.625; squares 1.890625 + 6.890625 + 5.640625 + 1.265625 = 15.6875, times 4/3.
    np.testing.assert_allclose(z_of(u), 6.5 / np.sqrt(15.6875 * 4.0 / 3.0), rtol=1e-12)
    np.testing.assert_allclose(z_of(-u), -z_of(u), rtol=1e-12)
    assert z_of(np.concatenate((u, np.zeros(9)))) == z_of(u)  # blocks without rows
    assert z_of(np.array([7.0])) == z_of(np.array([7.0, 7.0])) == z_of(np.zeros(40)) == 0.0


def test_a_score_of_exchanged_and_scaled_currents_is_told_by_the_columns_of_the_log(rng):
    found = score(rng, 3)
    orders, units = [np.array([0, 1, 2]), np.array([2, 0, 1])], [np.ones(3), np.array([10.0, -0.5, 4.0])]
    logs = [SimpleNamespace(v_order=order, v_factor=unit) for order, unit in zip(orders, units, strict=True)]
    told = scored_as(found, SimpleNamespace(logs=logs))
    # In log 2 joint 1 was read from column 3 times 10, joint 2 from column 1 times -0.5, joint 3 from column 2 times 4.
    np.testing.assert_array_equal(told.squares[:, :20], found.squares[:, :20])
    np.testing.assert_array_equal(told.rows[:, :20], found.rows[:, :20])
    for joint, (column, unit) in enumerate(((2, 10.0), (0, -0.5), (1, 4.0))):
        np.testing.assert_allclose(told.squares[column, 20:], found.squares[joint, 20:] / unit**2, rtol=1e-14)
        np.testing.assert_array_equal(told.rows[column, 20:], found.rows[joint, 20:])
