"""Least squares with instruments: columns that go with those of the model but not with their errors."""

import numpy as np
from scipy import linalg

from ident.estimation.joint_by_joint.gain_system import GainSystem
from ident.estimation.joint_by_joint.joint_fit import JointFit
from ident.numerics.least_squares import LeastSquares
from ident.support.arrays import Array
from ident.support.errors import NotExcited, TooFewRows


def instrumental(system: GainSystem, Z: Array, rank_tol: float) -> JointFit:
    """Solve `Z^T W x = Z^T V` (Janot, Vandanjon and Gautier 2014).

    Args:
        system: V and W of a joint.
        Z: Instruments, one for each column of W, shape (r, b).
        rank_tol: Smallest relative singular value of Z, and of W seen through Z, that counts.

    Returns:
        The solution; its residual is V - W x, its covariance sigma^2 (Z^T W)^-1 Z^T Z (W^T Z)^-1.

    Raises:
        TooFewRows: If rows are fewer than unknowns plus one.
        NotExcited: If the instruments do not show every unknown.
    """
    W, V = system.W, system.rows.V
    r, b = W.shape
    if r <= b:
        raise TooFewRows(f"{r} rows cannot give {b} unknowns; record a longer motion")
    scale, aid = np.linalg.norm(W, axis=0), np.linalg.norm(Z, axis=0)
    if not scale.all() or not aid.all():
        raise NotExcited(f"column {int(np.argmin(np.minimum(scale, aid)))} of the observation matrix is zero")
    Q, R = linalg.qr(Z / aid, mode="economic", check_finite=False)
    through = Q.T @ (W / scale)
    for part in (R, through):
        singular = np.linalg.svd(part, compute_uv=False)
        if singular[-1] < rank_tol * singular[0]:
            raise NotExcited(
                "the reference motion does not excite every parameter: relative singular value "
                f"{singular[-1] / singular[0]:.1e} is below {rank_tol:.0e}"
            )
    by_current = linalg.solve(through, Q.T, check_finite=False) / scale[:, None]
    x = by_current @ V
    residual = V - W @ x
    fit = LeastSquares(
        x=x,
        cofactor=by_current @ by_current.T,
        sigma=float(np.linalg.norm(residual) / np.sqrt(r - b)),
        residual=residual,
        condition=float(np.linalg.cond(through)),
        basis=np.asarray(linalg.qr(W / scale, mode="economic", check_finite=False)[0], np.float64),
    )
    return JointFit(system, fit, by_current)
