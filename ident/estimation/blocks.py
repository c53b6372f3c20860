"""Least squares of all joints together, on cross products by joint and time block.

The currents of joint j are V_j = h_j (A_j theta + k_j) + F_j phi_j + e_j. Rows are padded to (n, B, w): joint, time
block, row in the block. Cross products have the square of the condition number of their columns, so they are formed of
columns that are orthonormal: F_j = Q_j R_j joint by joint; [A_j k_j V_j] without its part in the first own columns; and
theta = U z such that the columns of z, of all joints with the weights h_j / sigma_j, are orthonormal. Then

    e_j = R_j rest_j - Q_j c_j        rest_j = (-h_j z, -h_j, 1),  R_j = [Z_j k_j V_j],  Z_j = A_j U

Leaving out a time block changes all unknowns by (N - N_b)^-1 J_b' e_b, from the same cross products: this is the
jackknife and, with e_b, the prediction of the block by a fit without it.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from ident.estimation.intervals import Layout
from ident.numerics.least_squares import factors
from ident.support.arrays import Array, Indices, Mask

DEPENDENT_OWN = 1e-7
"""Smallest norm of the new part of a unit column of a joint's friction that counts as independent."""
DEPENDENT_ALONE = 5e-15
"""Relative eigenvalue of the cross products of unit columns below which one joint does not show a combination."""
DEPENDENT_SHARED = 1e-10
"""Relative norm of the new part of a unit column below which a shared parameter is not identifiable."""
NOTHING = 1e-10
"""Norm of a column, relative to that on another joint or of another column, below which it is rounding error. The arm's
structure cannot tell: columns of compliance and friction follow from torques of a motion, in which joints may rest."""
SMALL_PIVOT = 1e-9
"""Relative pivot of cross products below which the columns are factorised instead."""
ROUNDING = 1e-6
"""Smallest standard deviation of a joint's residual, as a share of its rms current: with a smaller one, rounding errors
of cross products would exceed the priors."""


def flipped(x: Array) -> Array:
    """Transpose the last two axes."""
    return x.swapaxes(-1, -2)


def flat(x: Array) -> Array:
    """Join time blocks, (n, B, w, m) to (n, B w, m)."""
    return x.reshape(x.shape[0], x.shape[1] * x.shape[2], x.shape[3])


def outside(Q: Array, x: Array) -> tuple[Array, Array]:
    """Part of columns (.., r, m) outside orthonormal ones (.., r, b), and their coordinates in these, (.., b, m)."""
    along = flipped(Q) @ x
    left = Q @ along
    np.subtract(x, left, out=left)
    more = flipped(Q) @ left  # rounding errors of the first pass
    left -= Q @ more
    return left, along + more


@dataclass(frozen=True, slots=True, eq=False)
class Own:
    """Own columns of all joints, F_j = Q_j R_j; a column that is dependent on earlier ones is left out."""

    Q: Array  # orthonormal or zero, shape (n, B, w, f)
    R: Array  # upper triangular, with 1 on the diagonal of columns that are left out, shape (n, f, f)
    used: Mask  # mask of the columns that are not left out, shape (n, f)
    largest: Array  # largest norm of a column of each joint, shape (n,)

    @classmethod
    def none(cls, layout: Layout) -> "Own":
        """No column."""
        n = layout.shape[0]
        return cls(np.zeros((*layout.shape, 0)), np.zeros((n, 0, 0)), np.zeros((n, 0), np.bool_), np.zeros(n))

    def extended(self, F: Array) -> "Own":
        """Append columns, shape (n, B, w, m)."""
        n, e = len(F), F.shape[-1]
        f = self.Q.shape[-1]
        given, Q = flat(F), flat(self.Q)
        norms = np.linalg.norm(given, axis=1)
        largest = np.maximum(self.largest, norms.max(axis=1, initial=0.0))
        R, used = np.zeros((n, f + e, f + e)), np.zeros((n, f + e), np.bool_)
        R[:, :f, :f], used[:, :f] = self.R, self.used
        for k in range(e):
            long = norms[:, k] > DEPENDENT_OWN * largest
            size = np.where(long, norms[:, k], 1.0)[:, None]
            new = np.where(long[:, None], given[:, :, k], 0.0) / size
            new, inside = (x[..., 0] for x in outside(Q, new[..., None]))
            left = np.linalg.norm(new, axis=1)
            used[:, f + k] = left > DEPENDENT_OWN
            on = used[:, f + k, None]
            R[:, : f + k, f + k] = np.where(on, inside * size, 0.0)
            R[:, f + k, f + k] = np.where(on, left[:, None] * size, 1.0)[:, 0]
            Q = np.concatenate((Q, np.where(on, new / np.where(on, left[:, None], 1.0), 0.0)[..., None]), axis=2)
        return Own(Q.reshape(*self.Q.shape[:-1], f + e), R, used, largest)


@dataclass(frozen=True, eq=False)
class Alone:
    """The fit of each joint alone, with all its columns and free payloads."""

    basis: tuple[Array, ...]  # orthonormal or zero columns, without the first own columns, shape (n, B w, q) together
    rank: Indices  # number of nonzero ones, shape (n,)
    left: Array  # currents without their part in own columns and basis, shape (n, B w)

    def outside(self, x: Array) -> Array:
        """Part of columns (n, B w, m) outside the basis."""
        for Q in self.basis:
            x = outside(Q, x)[0]
        return x

    def extended(self, columns: Array, norms: Array) -> "Alone":
        """Append columns without their own part, shape (n, B w, m), that had some norms, (n, m); 0 omits a column."""
        unit = self.outside(columns / np.where(norms > NOTHING * norms.max(axis=0), norms, np.inf)[:, None])
        new = unit @ orthonormalising(flipped(unit) @ unit, DEPENDENT_ALONE)
        new = new @ orthonormalising(flipped(new) @ new, 0.5)
        rank = np.count_nonzero(new.any(axis=1), axis=1)
        return Alone((*self.basis, new), self.rank + rank, outside(new, self.left[..., None])[0][..., 0])


def orthonormalising(gram: Array, tol: float) -> Array:
    """T such that the columns W T are orthonormal, from W'W (n, m, m); shape (n, m, largest rank)."""
    values, vectors = np.linalg.eigh(gram)
    kept = values > tol * np.maximum(values[:, -1:], 1.0) if values.shape[1] else values > 0.0
    most = int(kept.sum(axis=1).max(initial=0))
    T = vectors * np.where(kept, 1.0 / np.sqrt(np.where(kept, values, 1.0)), 0.0)[:, None]
    return np.ascontiguousarray(T[:, :, T.shape[2] - most :])


@dataclass(frozen=True, eq=False)
class Blocks:
    """Rows of all joints, with cross products by time block. b own columns, k coordinates z of p shared parameters.

    Z = A U is not stored, and appended columns are arrays of their own, so that models share all others.
    """

    layout: Layout  # places of rows
    own: Own  # friction and offset
    A: tuple[Array, ...]  # shared columns without their own part, shape (n, B, w, p) together
    kV: Array  # k and V without their own part, shape (n, B, w, 2)
    C: Array  # coordinates of [A k V] in the own columns, shape (n, b, p + 2)
    std: Array  # prior standard deviation of each shared parameter about zero, infinite without a prior, shape (p,)
    weight: Array  # weights of the joints with which the columns of z are orthonormal, shape (n,)
    U: Array  # theta = U z, shape (p, k)
    RR: Array  # cross products of [Z k V], shape (n, B, k + 2, k + 2)
    FR: Array  # cross products of own columns with them, shape (n, B, b, k + 2)
    alone: Alone  # the fit of each joint alone

    @cached_property
    def FF(self) -> Array:
        """Cross products of own columns, shape (n, B, b, b)."""
        return flipped(self.own.Q) @ self.own.Q

    @cached_property
    def total(self) -> Array:
        """Cross products of [Z k V] of all blocks, shape (n, k + 2, k + 2)."""
        return np.sum(self.RR, axis=1)

    @cached_property
    def currents(self) -> Array:
        """Currents of each joint, padded, shape (n, B w)."""
        return (flat(self.own.Q) @ self.C[:, :, -1:] + flat(self.kV[..., 1:]))[..., 0]

    @property
    def rows_of_currents(self) -> Array:
        """Currents of the rows, shape (r,)."""
        return self.layout.rows(self.currents.reshape(*self.layout.shape, 1))[:, 0]

    @property
    def prior(self) -> Array:
        """Rows of the priors of shared parameters, in standard deviations, shape (priors, k)."""
        believed = np.isfinite(self.std)
        return self.U[believed] / self.std[believed, None]

    @classmethod
    def of(cls, layout: Layout, F: Array, columns: Array, p: int) -> "Blocks":
        """Of own columns (r, b), and p shared columns, known torque, currents and payloads' columns, (r, p + 2 + m)."""
        own, n = Own.none(layout).extended(layout.padded(F)), layout.shape[0]
        raw = flat(layout.padded(columns))
        del columns
        norms = np.linalg.norm(raw, axis=1)
        free, C = outside(flat(own.Q), raw)
        del raw
        norms[:, p : p + 2] = 0.0
        alone = Alone((), np.count_nonzero(own.used, axis=1), free[:, :, p + 1])
        shared, kV, _ = np.split(free.reshape(*layout.shape, -1), (p, p + 2), axis=3)
        return cls(
            layout=layout, own=own, A=(shared,), kV=kV, C=C[:, :, : p + 2], std=np.full(p, np.inf), weight=np.ones(n),
            U=np.zeros((p, 0)), RR=np.zeros(0), FR=np.zeros(0),
            alone=alone.extended(free, norms),
        )  # fmt: skip

    def joint(self, j: int) -> Array:
        """Columns [A k V] of a joint, shape (B, w, p + 2)."""
        return np.concatenate([*(part[j] for part in self.A), self.kV[j]], axis=2)

    @cached_property
    def cross(self) -> Array:
        """Cross products of [A k V], of all blocks, shape (n, p + 2, p + 2)."""
        return np.array([W.T @ W for W in (flat(self.joint(j)[None])[0] for j in range(len(self.kV)))])

    def times(self, x: Array) -> Array:
        """[Z k V] x, or without V, by coordinates of each joint, and block or 1, (n, B, .., m); shape (n, B, w, m)."""
        k = self.U.shape[1]
        out = self.kV[..., : x.shape[2] - k] @ x[:, :, k:]
        start, theta = 0, self.U @ x[:, :, :k]
        for part in self.A:
            out += part @ theta[:, :, start : (start := start + part.shape[3])]
        return out

    def against(self, y: Array) -> Array:
        """Cross products of [Z k V] with columns (n, B, w, m), shape (n, B, k + 2, m)."""
        of_theta = np.concatenate([flipped(part) @ y for part in self.A], axis=2)
        return np.concatenate((self.U.T @ of_theta, flipped(self.kV) @ y), axis=2)

    def at(self, weight: Array) -> "Blocks":
        """The same with columns of z that are orthonormal with other weights of the joints, shape (n,)."""
        p, believed = len(self.std), np.isfinite(self.std)
        gram = np.tensordot(weight**2, self.cross[:, :p, :p], 1)
        gram[believed, believed] += self.std[believed] ** -2
        U = _inverse_root(gram)
        if U is None:
            rows = np.zeros((np.count_nonzero(believed), p))
            rows[np.arange(len(rows)), np.flatnonzero(believed)] = 1.0 / self.std[believed]
            own = (x * self.joint(j).reshape(-1, p + 2)[:, :p] for j, x in enumerate(weight))
            found = factors(np.vstack([*own, rows]), rank_tol=DEPENDENT_SHARED)
            U = np.zeros((p, len(found.columns)))
            U[found.columns] = linalg.solve_triangular(found.R, np.eye(len(found.columns)))
        turn, RR, FR = linalg.block_diag(U, np.eye(2)), list[Array](), list[Array]()
        for j, Q in enumerate(self.own.Q):
            R = self.joint(j) @ turn
            RR.append(flipped(R) @ R)
            FR.append(flipped(Q) @ R)
        return replace(self, weight=weight, U=U, RR=np.array(RR), FR=np.array(FR))

    def widened(self, more: Array, std: Array, independent: Array | None = None) -> "Blocks":
        """Append shared columns (r, m) with their prior standard deviations (m,).

        `independent` are the combinations of them that are independent of the earlier columns on each joint alone, zero
        beyond their number, shape (n, m, m); None if all are.
        """
        (p, k), m = self.U.shape, more.shape[1]
        raw = flat(self.layout.padded(more))
        free, C = outside(flat(self.own.Q), raw)
        T = np.eye(m) if independent is None else independent
        alone = self.alone.extended(free @ T, np.linalg.norm(raw @ T, axis=1))
        new = free.reshape(*self.layout.shape, m)
        wide = replace(
            self,
            A=(*self.A, new),
            C=np.concatenate((self.C[:, :, :p], C, self.C[:, :, p:]), axis=2),
            std=np.concatenate((self.std, std)),
            alone=alone,
        )
        X = np.zeros((k, m))
        for _ in range(2):
            along = np.einsum("j,jbkm->km", self.weight**2, self.against(new)[:, :, :k])
            along -= self.prior.T @ (self.prior @ X)
            new, X = new - self.times(along[None, None]), X + along
        moved = self.prior @ X  # in the old coordinates, the new columns also move what has a prior
        gram = np.einsum("j,jbkm->km", self.weight**2, flipped(new) @ new) + np.diag(std**-2.0) + moved.T @ moved
        T = _inverse_root(gram)
        if T is None:
            return wide.at(self.weight)
        U = np.zeros((p + m, k + m))
        U[:p, :k], U[:p, k:], U[p:, k:] = self.U, -self.U @ X @ T, T
        Z = new @ T
        old, added = np.r_[:k, k + m : k + m + 2], self.against(Z)
        RR = np.empty((*added.shape[:2], k + m + 2, k + m + 2))
        RR[:, :, old[:, None], old], RR[:, :, old, k : k + m] = self.RR, added
        RR[:, :, k : k + m, old], RR[:, :, k : k + m, k : k + m] = flipped(added), flipped(Z) @ Z
        FR = np.concatenate((self.FR[..., :k], flipped(self.own.Q) @ Z, self.FR[..., k:]), axis=3)
        return replace(wide, U=U, RR=RR, FR=FR)

    def with_currents(self, V: Array) -> "Blocks":
        """The same columns with other currents, shape (r,)."""
        free, C = outside(flat(self.own.Q), flat(self.layout.padded(V[:, None])))
        V, RR = free.reshape(*self.layout.shape, 1), self.RR.copy()
        other = replace(self, kV=np.concatenate((self.kV[..., :1], V), axis=3))
        last = other.against(V)
        RR[..., -1:], RR[..., -1, :] = last, last[..., 0]
        return replace(
            other,
            C=np.concatenate((self.C[:, :, :-1], C), axis=2),
            RR=RR,
            FR=np.concatenate((self.FR[..., :-1], flipped(self.own.Q) @ V), axis=3),
            alone=replace(self.alone, left=self.alone.outside(free)[..., 0]),
        )


def _inverse_root(gram: Array) -> Array | None:
    """Upper triangular T with T' gram T = 1; None if it is nearly singular."""
    size = np.sqrt(np.diag(gram))
    if not size.all():
        return None
    try:
        L = np.linalg.cholesky(gram / np.outer(size, size))
    except np.linalg.LinAlgError:
        return None
    if np.diag(L).min(initial=1.0) < SMALL_PIVOT**0.5:
        return None
    return np.asarray(linalg.solve_triangular(L, np.eye(len(L)), lower=True).T / size[:, None])
