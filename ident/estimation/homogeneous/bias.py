"""What noise of the currents does to gains by ordinary least squares of the homogeneous form, in closed form."""

import numpy as np

from ident.estimation.all_joints.reduction import own_sigma
from ident.estimation.homogeneous.solved import Unknowns
from ident.estimation.homogeneous.system import HomogeneousSystem
from ident.numerics.least_squares import factors


def noise_bias(system: HomogeneousSystem, found: Unknowns) -> dict[int, float] | None:
    """Relative error that the noise of the currents makes in each gain that has one, by joint from 0.

    With I the block diagonal matrix of the currents and P the projection on all other columns, the gains solve
    S g = I^T (1 - P) k, S = I^T (1 - P) I. White noise of deviation sigma_j adds to S, on average, N = diag(sigma_j^2
    sum over the rows of j of (1 - P)_ii), and nothing to the right-hand side: E g = (S_0 + N)^-1 S_0 g_0.

    Args:
        system: The equations; sigma_j is what each joint's own free least squares leaves.
        found: Their solution by ordinary least squares.

    Returns:
        None if the currents show no more beside the arm's parameters than such noise would.
    """
    solved = np.flatnonzero(found.seen)
    currents, others, gain = system.H[:, solved], system.H[:, system.n :], found.x[solved]
    Q = factors(others, rank_tol=system.problem.options.rank_tol).Q
    apart = currents - Q @ (Q.T @ currents)
    S = apart.T @ apart
    sigma = np.array([own_sigma(each, own) for each, own in zip(system.columns, system.own, strict=True)])
    left = system.weight**2 * (1.0 - np.sum(Q**2, axis=1))
    N = np.diag((sigma**2 * np.bincount(system.joint, weights=left))[solved])
    scale = 1.0 / np.sqrt(np.diag(S))  # of unit diagonal, whatever the currents' units
    clean = scale[:, None] * (S - N) * scale
    if np.linalg.eigvalsh(clean)[0] <= 0.0:
        return None
    without = scale * np.linalg.solve(clean, scale * (S @ gain))
    return dict(zip(solved.tolist(), (gain / without - 1.0).tolist(), strict=True))
