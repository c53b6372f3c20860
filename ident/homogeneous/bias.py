"""What noise of the currents does to gains by ordinary least squares of the homogeneous form, in closed form."""

import numpy as np

from ident.all_joints.reduction import own_sigma
from ident.arrays import Array
from ident.homogeneous.system import HomogeneousSystem
from ident.least_squares import factors


def noise_bias(system: HomogeneousSystem, gain: Array) -> Array | None:
    """Relative error of each gain that the noise of the currents makes.

    With I the block diagonal matrix of the currents and P the projection on all other columns, the gains solve
    S g = I^T (1 - P) k, S = I^T (1 - P) I. White noise of deviation sigma_j adds to S, on average, N = diag(sigma_j^2
    sum over the rows of j of (1 - P)_ii), and nothing to the right-hand side: E g = (S_0 + N)^-1 S_0 g_0.

    Args:
        system: The equations; sigma_j is what each joint's own free least squares leaves.
        gain: Found by ordinary least squares, shape (n,).

    Returns:
        Shape (n,), None if the currents show no more beside the arm's parameters than such noise would.
    """
    currents, others = system.H[:, : system.n], system.H[:, system.n :]
    Q = factors(others, rank_tol=system.problem.options.rank_tol).Q
    apart = currents - Q @ (Q.T @ currents)
    S = apart.T @ apart
    sigma = np.array([own_sigma(each, own) for each, own in zip(system.columns, system.own, strict=True)])
    left = system.weight**2 * (1.0 - np.sum(Q**2, axis=1))
    N = np.diag(sigma**2 * np.bincount(system.joint, weights=left))
    scale = 1.0 / np.sqrt(np.diag(S))  # of unit diagonal, whatever the currents' units
    clean = scale[:, None] * (S - N) * scale
    if np.linalg.eigvalsh(clean)[0] <= 0.0:
        return None
    without = scale * np.linalg.solve(clean, scale * (S @ gain))
    return gain / without - 1.0
