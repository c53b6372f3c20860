"""Each joint's rows reduced to as many as its columns, by an orthogonal factorisation: nothing is lost."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.estimation.all_joints.columns import JointColumns
from ident.estimation.all_joints.friction import OwnColumns
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices
from ident.support.errors import TooFewRows

DEPENDENT = 1e-9
"""Relative singular value of unit columns under which a joint alone does not see a combination of them."""
ROUNDING = 1e-9
"""Least standard deviation of a joint's residual that is believed, as a share of its rms current."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedJoint:
    """`Q @ [F A k V]` are the joint's columns over sigma, of which F comes first, and below them beliefs about phi.

    m is the number of those columns that are not zero of themselves: shared parameters that the joint does not feel
    take no row.

    Attributes:
        Q: Orthonormal, shape (r + beliefs, m).
        rows: Rows of the joint, r.
        F: Own columns, shape (m, f), triangular.
        A: Shared columns, shape (m, p).
        k: Known torque, shape (m,).
        V: Currents, shape (m,).
        sigma: Standard deviation of the residual that the joint leaves alone [drive units].
    """

    Q: Array
    rows: int
    F: Array
    A: Array
    k: Array
    V: Array
    sigma: float

    @property
    def data(self) -> Array:
        """The rows of Q that are the joint's, shape (r, m)."""
        return self.Q[: self.rows]

    @property
    def inner(self) -> slice:
        """Rows that own columns do not touch: what the search needs."""
        return slice(self.F.shape[1], None)


def reduced_joint(joint: JointColumns, own: OwnColumns) -> ReducedJoint:
    """Reduce the rows of a joint, weighted by the deviation that the joint leaves alone.

    The weight is that of the joint's own free least squares and fixed. Weights from the residual of the gains
    themselves would make an infinite gain a solution: it explains nothing, and perfectly so.

    Raises:
        TooFewRows: If there are no more rows than columns.
    """
    f, p, r = own.F.shape[1], joint.shared.shape[1], len(joint.V)
    if r <= f + p + 2:
        raise TooFewRows(f"joint {joint.joint + 1}: {r} rows cannot give {f + p + 2} unknowns; record a longer motion")
    turned = _triangular(joint, own)
    m = turned.others.stop + 2
    sigma = left_alone(joint, turned)
    Q, R = turned.Q[:, :m], turned.R[:m, :m] / sigma
    if own.believed.any():
        Q, R = _with_beliefs(Q, R, own)
    A = np.zeros((m, p))
    A[:, turned.felt] = R[:, turned.others]
    return ReducedJoint(Q=Q, rows=r, F=R[:, :f], A=A, k=R[:, -2], V=R[:, -1], sigma=sigma)


def own_sigma(joint: JointColumns, own: OwnColumns) -> float:
    """Standard deviation of what a joint's rows alone leave, whatever the payload [drive units]."""
    return left_alone(joint, _triangular(joint, own))


@dataclass(frozen=True, slots=True, eq=False)
class _Triangular:
    """`Q @ R` are the columns [F A k V payload] of a joint, those of A left out that are zero.

    Attributes:
        Q: Orthonormal, shape (r, c).
        R: Upper triangular, shape (c, c).
        felt: Which columns of A are not zero, shape (a,).
        others: Where they stand.
    """

    Q: Array
    R: Array
    felt: Indices
    others: slice


def _triangular(joint: JointColumns, own: OwnColumns) -> _Triangular:
    f, felt = own.F.shape[1], np.flatnonzero(joint.shared.any(axis=0))
    W = np.column_stack((own.F, joint.shared[:, felt], joint.known, joint.V, *joint.payload))
    factor = linalg.qr(W, mode="economic", check_finite=False)
    Q, R = (np.asarray(part, np.float64) for part in factor)
    return _Triangular(Q, R, felt, slice(f, f + len(felt)))


def left_alone(joint: JointColumns, turned: _Triangular) -> float:
    """Standard deviation of what all columns of a joint but its currents leave of these [drive units]."""
    V = turned.others.stop + 1
    basis = factors(np.delete(turned.R, (V - 1, V), axis=1), rank_tol=DEPENDENT).Q  # the payload's columns span k
    left = turned.R[:, V] - basis @ (basis.T @ turned.R[:, V])
    sigma = float(np.linalg.norm(left)) / np.sqrt(max(1, len(joint.V) - basis.shape[1]))
    return max(sigma, ROUNDING * float(np.sqrt(np.mean(joint.V**2))))


def _with_beliefs(Q: Array, R: Array, own: OwnColumns) -> tuple[Array, Array]:
    """Q and R of the rows below which the beliefs about own columns stand."""
    beliefs = np.zeros((int(own.believed.sum()), R.shape[1]))
    beliefs[np.arange(len(beliefs)), np.flatnonzero(own.believed)] = 1.0 / own.std[own.believed]
    beliefs[:, -1] = (own.mean / own.std)[own.believed]
    factor = linalg.qr(np.vstack((R, beliefs)), mode="economic", check_finite=False)
    turn, grown = (np.asarray(part, np.float64) for part in factor)
    return np.vstack((Q @ turn[: len(R)], turn[len(R) :])), grown
