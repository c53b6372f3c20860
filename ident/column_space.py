"""Directions that columns span, whatever their sizes."""

import numpy as np
from scipy import linalg

from ident.arrays import Array, readonly

NEW = 1e-6
"""Singular value, of unit columns, under which there is nothing new in them."""


def column_space(columns: Array) -> Array:
    """Orthonormal basis of columns, those of zeros left out, shape (r, rank).

    Args:
        columns: Shape (r, k).
    """
    size = np.linalg.norm(columns, axis=0)
    unit = columns[:, size > 0.0] / size[size > 0.0]
    if not unit.shape[1]:
        return unit
    Q, R, _ = linalg.qr(unit, mode="economic", pivoting=True)
    return readonly(Q[:, np.abs(np.diag(R)) > NEW])
