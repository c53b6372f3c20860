"""Directions that columns span, whatever their sizes."""

import numpy as np
from scipy import linalg

from ident.support.arrays import Array, readonly

NEW = 1e-6
"""Singular value, of unit columns, under which there is nothing new in them."""


def column_space(columns: Array, beside: Array | None = None) -> Array:
    """Orthonormal basis of columns, those of zeros left out, shape (r, rank).

    Args:
        columns: Shape (r, k).
        beside: Orthonormal columns whose directions are not new, shape (r, .).
    """
    size = np.linalg.norm(columns, axis=0)
    unit = columns[:, size > 0.0] / size[size > 0.0]
    if not unit.shape[1]:
        return unit
    new = unit if beside is None else unit - beside @ (beside.T @ unit)
    Q, R, _ = linalg.qr(new, mode="economic", pivoting=True)
    return readonly(Q[:, np.abs(np.diag(R)) > NEW])
