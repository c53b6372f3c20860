"""The second moments of a body's mass, which are positive semidefinite."""

import numpy as np

from ident.support.arrays import Array


def pseudo_inertia(chi: Array) -> Array:
    """Pseudo-inertia [[tr(J)/2 - J, m c], [m c, m]], shape (4, 4) (Wensing, Kim and Slotine 2018, eq. 7).

    Args:
        chi: Standard parameters in the order of `INERTIAL`, shape (10,).
    """
    J = np.zeros((3, 3))
    J[np.triu_indices(3)] = chi[:6]
    J = J + np.triu(J, 1).T
    P = np.empty((4, 4))
    P[:3, :3] = 0.5 * np.trace(J) * np.eye(3) - J
    P[:3, 3] = P[3, :3] = chi[6:9]
    P[3, 3] = chi[9]
    return P
