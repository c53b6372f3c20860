"""The null vector of noisy equations, normalised, with what each entry of a column does to it."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.support.arrays import Array, Indices
from ident.support.errors import NotIdentifiable


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NullVector:
    """The x, its last entry 1, for which M / scale has the smallest product of its norm with that of `scale x`.

    Attributes:
        x: Shape (m,).
        explained: Orthonormal columns that span the rest of M, shape (r, m - 1).
        by_row: G M^T, shape (m, r), with G the sum of v_k v_k^T / (s^2 - s_k^2) over the other singular vectors.
        G: Shape (m, m).
        left: M x of the unit vector z, shape (r,).
        z: The singular vector, shape (m,).
        scale: Of the columns, shape (m,).
    """

    x: Array
    explained: Array
    by_row: Array
    G: Array
    left: Array
    z: Array
    scale: Array

    def derivative(self, column: Indices, size: Array) -> Array:
        """Of x, to first order at constant scales: dz = G (dM^T M + M^T dM) z.

        Args:
            column: Column of the entry that moves in each row, shape (r,).
            size: How far it moves, shape (r,).

        Returns:
            Shape (m, r).
        """
        dz = self.by_row * self.z[column] + self.G[:, column] * self.left
        dz = dz * (size / self.scale[column]) / self.scale[:, None]
        return (dz - np.outer(self.x, dz[-1])) * (self.scale[-1] / self.z[-1])


def null_vector(M: Array, scale: Array, *, rank_tol: float) -> NullVector:
    """Find the null vector by singular values.

    Args:
        M: Equations `M x = 0`, shape (r, m).
        scale: By which columns are divided, shape (m,).
        rank_tol: Smallest relative singular value that counts, and smallest last entry.

    Raises:
        NotIdentifiable: If there are several null vectors, or the last column has no part in it.
    """
    Q, R = linalg.qr(M / scale, mode="economic", check_finite=False)
    U, s, Vt = np.linalg.svd(R)
    z, others = Vt[-1], Vt[:-1].T
    if s[-2] <= rank_tol * s[0] or abs(z[-1]) <= rank_tol:
        raise NotIdentifiable("the gains are not unique; record a more exciting motion, or a payload")
    explained = np.asarray(Q @ U[:, :-1], np.float64)
    gap = s[-1] ** 2 - s[:-1] ** 2
    return NullVector(
        x=z / z[-1] * (scale[-1] / scale),
        explained=explained,
        by_row=(others * (s[:-1] / gap)) @ explained.T,
        G=(others / gap) @ others.T,
        left=np.asarray(s[-1] * (Q @ U[:, -1]), np.float64),
        z=z,
        scale=scale,
    )
