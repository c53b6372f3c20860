"""Each joint's rows reduced to as many as its columns, by an orthogonal factorisation: nothing is lost."""

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.all_joints.columns import JointColumns
from ident.all_joints.friction import OwnColumns
from ident.arrays import Array
from ident.errors import TooFewRows

DEPENDENT = 1e-9
"""Relative singular value of unit columns under which a joint alone does not see a combination of them."""
ROUNDING = 1e-9
"""Least standard deviation of a joint's residual that is believed, as a share of its rms current."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedJoint:
    """`Q @ [F A k V]` are the joint's columns over sigma, of which F comes first, and below them beliefs about phi.

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
    f, p = own.F.shape[1], joint.shared.shape[1]
    sigma = own_sigma(joint, own)
    W = np.column_stack((own.F, joint.shared, joint.known, joint.V)) / sigma
    if len(W) <= W.shape[1]:
        raise TooFewRows(
            f"joint {joint.joint + 1}: {len(W)} rows cannot give {W.shape[1]} unknowns; record a longer motion"
        )
    beliefs = np.zeros((int(own.believed.sum()), W.shape[1]))
    beliefs[np.arange(len(beliefs)), np.flatnonzero(own.believed)] = 1.0 / own.std[own.believed]
    beliefs[:, -1] = (own.mean / own.std)[own.believed]
    factor = linalg.qr(np.vstack((W, beliefs)), mode="economic", check_finite=False)
    Q, R = (np.asarray(part, np.float64) for part in factor)
    return ReducedJoint(Q=Q, rows=len(W), F=R[:, :f], A=R[:, f : f + p], k=R[:, -2], V=R[:, -1], sigma=sigma)


def own_sigma(joint: JointColumns, own: OwnColumns) -> float:
    """Standard deviation of what a joint's rows alone leave, whatever the payload [drive units]."""
    W = np.hstack((own.F, joint.shared, *joint.payload))
    norms = np.linalg.norm(W, axis=0)
    unit = W[:, norms > 0.0] / norms[norms > 0.0]
    x, _, rank, _ = linalg.lstsq(unit, joint.V, cond=DEPENDENT, check_finite=False)
    residual = joint.V - unit @ x
    sigma = float(np.linalg.norm(residual)) / np.sqrt(max(1, len(joint.V) - rank))
    return max(sigma, ROUNDING * float(np.sqrt(np.mean(joint.V**2))))
