"""Lossless reduction of each joint's rows to as many as its columns, by an orthogonal factorisation."""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import Base, JointColumns
from ident.estimation.all_joints.friction import OwnColumns
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable

DEPENDENT = 1e-9
"""Relative singular value of unit columns below which a combination is not identifiable from one joint alone."""
ROUNDING = 1e-9
"""Smallest standard deviation of a joint's residual, as a share of its rms current."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedJoint:
    """`Q @ [F A k V]` are the joint's columns divided by sigma, and below them the priors of phi.

    m is the number of nonzero columns: shared parameters that do not act on the joint need no row.

    Attributes:
        basis: Orthonormal basis of the joint's columns, shape (r, s).
        turn: Coordinates of the joint's rows of Q in this basis, shape (s, m).
        beliefs: The rows of Q of the priors, shape (beliefs, m).
        F: Own columns, shape (m, f), triangular.
        A: Shared columns, shape (m, p).
        k: Known torque, shape (m,).
        V: Currents, shape (m,).
        sigma: Standard deviation of the residual in a fit of this joint alone [drive units].
    """

    basis: Array
    turn: Array
    beliefs: Array
    F: Array
    A: Array
    k: Array
    V: Array
    sigma: float

    @property
    def Q(self) -> Array:
        """Orthonormal, shape (r + beliefs, m)."""
        return np.vstack((self.basis @ self.turn, self.beliefs))

    def on_rows(self, x: Array) -> Array:
        """Product of the joint's rows of Q with an array of shape (m, ...): shape (r, ...)."""
        return self.basis @ (self.turn @ x)

    @property
    def inner(self) -> slice:
        """Rows in which own columns are zero, which the search uses."""
        return slice(self.F.shape[1], None)


def reduced_joint(joint: JointColumns, own: OwnColumns) -> ReducedJoint:
    """Reduce the rows of a joint, weighted by the residual of a fit of this joint alone.

    The weight is fixed. With weights from the residual at the estimated gains, an infinite gain would be a solution.

    Raises:
        NotIdentifiable: If there are no more rows than columns.
    """
    f, p, r = own.F.shape[1], joint.shared.shape[1], len(joint.V)
    if r <= f + p + 2:
        raise NotIdentifiable.too_few_rows(r, f + p + 2, joint.joint)
    turned = _triangular(joint, own)
    m = turned.others.stop + 2
    sigma = left_alone(joint, turned)
    turn, R, beliefs = turned.turn[:, :m], turned.R[:m, :m] / sigma, np.zeros((0, m))
    if own.believed.any():
        lower, R = _with_beliefs(R, own)
        turn, beliefs = turn @ lower[:m], lower[m:]
    A = np.zeros((len(R), p))
    A[:, turned.felt] = R[:, turned.others]
    return ReducedJoint(
        basis=turned.basis, turn=turn, beliefs=beliefs, F=R[:, :f], A=A, k=R[:, -2], V=R[:, -1], sigma=sigma
    )


def base_of(joint: JointColumns, own: OwnColumns) -> Base:
    """Return the basis common to all fits of a joint: these own columns, and all columns from positions."""
    f, p, felt = own.F.shape[1], joint.shared.shape[1], np.flatnonzero(joint.shared.any(axis=0))
    W = np.column_stack((own.F, joint.shared[:, felt], joint.known, *joint.payload))
    Q, R = np.linalg.qr(W)
    A, last = np.zeros((len(R), p)), f + len(felt)
    A[:, felt] = R[:, f:last]
    names = enumerate(zip(own.names, own.motion, strict=True))
    return Base(Q=Q, own={name: R[:, j] for j, name in names}, A=A, k=R[:, last], payload=R[:, last + 1 :])


@dataclass(frozen=True, slots=True, eq=False)
class _Triangular:
    """`basis @ turn @ R` are the columns [F A k V payload] of a joint, without zero columns of A.

    Attributes:
        basis: Orthonormal, shape (r, s).
        turn: Orthonormal, shape (s, c).
        R: Upper triangular, shape (c, c).
        felt: Indices of the nonzero columns of A, shape (a,).
        others: Their place in R.
    """

    basis: Array
    turn: Array
    R: Array
    felt: Indices
    others: slice


def _triangular(joint: JointColumns, own: OwnColumns) -> _Triangular:
    """Factorise the columns of a fit: most are in the base; currents and further columns are added."""
    base = joint.base or base_of(joint, own)
    names, felt = list(zip(own.names, own.motion, strict=True)), np.flatnonzero(joint.shared.any(axis=0))
    terms = [j for j, name in enumerate(names) if name not in base.own]
    added = np.column_stack((own.F[:, terms], joint.shared[:, base.A.shape[1] :], joint.V))
    basis, new = _added(base.Q, added)

    def known(columns: Array) -> Array:
        return np.vstack((columns, np.zeros((len(new) - len(columns), columns.shape[1]))))

    F = [new[:, terms.index(j)] if j in terms else known(base.own[name][:, None]) for j, name in enumerate(names)]
    A = np.hstack((known(base.A), new[:, len(terms) : -1]))[:, felt]
    W = np.column_stack((*F, A, known(base.k[:, None]), new[:, -1], known(base.payload)))
    turn, R = np.linalg.qr(W)
    return _Triangular(basis, turn, R, felt, slice(len(names), len(names) + len(felt)))


def _added(Q: Array, columns: Array) -> tuple[Array, Array]:
    """Extend the orthonormal Q by columns (r, c); return the basis, and their coordinates in it, (s, c)."""
    inside, left, R = np.zeros((Q.shape[1], columns.shape[1])), columns, np.eye(columns.shape[1])
    for _ in range(2):  # the second pass removes rounding errors of the first
        again = Q.T @ left
        inside += again @ R
        left, more = np.linalg.qr(left - Q @ again)
        R = more @ R
    return np.hstack((Q, left)), np.vstack((inside, R))


def left_alone(joint: JointColumns, turned: _Triangular) -> float:
    """Standard deviation of the residual of a joint's currents, fitted with all its columns [drive units]."""
    V = turned.others.stop + 1
    basis = factors(np.delete(turned.R, (V - 1, V), axis=1), rank_tol=DEPENDENT).Q  # the payload's columns span k
    left = turned.R[:, V] - basis @ (basis.T @ turned.R[:, V])
    sigma = float(np.linalg.norm(left)) / np.sqrt(max(1, len(joint.V) - basis.shape[1]))
    return max(sigma, ROUNDING * float(np.sqrt(np.mean(joint.V**2))))


def _with_beliefs(R: Array, own: OwnColumns) -> tuple[Array, Array]:
    """Q and R of the triangle R with the priors of own columns below it."""
    beliefs = np.zeros((int(own.believed.sum()), R.shape[1]))
    beliefs[np.arange(len(beliefs)), np.flatnonzero(own.believed)] = 1.0 / own.std[own.believed]
    beliefs[:, -1] = (own.mean / own.std)[own.believed]
    return np.linalg.qr(np.vstack((R, beliefs)))
