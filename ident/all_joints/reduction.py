"""Each joint's rows reduced to as many as its columns, by an orthogonal factorisation: nothing is lost."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.all_joints.columns import JointColumns
from ident.all_joints.friction import OwnColumns
from ident.arrays import Array, Indices
from ident.errors import TooFewRows

DEPENDENT = 1e-9
"""Relative singular value of unit columns under which a joint alone does not see a combination of them."""
ROUNDING = 1e-9
"""Least standard deviation of a joint's residual that is believed, as a share of its rms current."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReducedJoint:
    """`Q @ [F A k V] = sigma^-1` times the joint's columns, of which F comes first.

    Attributes:
        Q: Orthonormal, shape (r, m).
        F: Own columns, shape (m, f), triangular.
        A: Shared columns, shape (m, p).
        k: Known torque, shape (m,).
        V: Currents, shape (m,).
        sigma: Standard deviation of the residual that the joint leaves alone [drive units].
    """

    Q: Array
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
    sigma = _own_sigma(joint, own)
    W = np.column_stack((own.F, joint.shared, joint.known, joint.V)) / sigma
    if len(W) <= W.shape[1]:
        raise TooFewRows(
            f"joint {joint.joint + 1}: {len(W)} rows cannot give {W.shape[1]} unknowns; record a longer motion"
        )
    Q, R = linalg.qr(W, mode="economic", check_finite=False)
    return ReducedJoint(Q=Q, F=R[:, :f], A=R[:, f : f + p], k=R[:, -2], V=R[:, -1], sigma=sigma)


def _own_sigma(joint: JointColumns, own: OwnColumns) -> float:
    """Standard deviation of what a joint's rows alone leave, whatever the payload [drive units]."""
    W = np.hstack((own.F, joint.shared, *joint.payload))
    norms = np.linalg.norm(W, axis=0)
    unit = W[:, norms > 0.0] / norms[norms > 0.0]
    x, _, rank, _ = linalg.lstsq(unit, joint.V, cond=DEPENDENT, check_finite=False)
    residual = joint.V - unit @ x
    sigma = float(np.linalg.norm(residual)) / np.sqrt(max(1, len(joint.V) - rank))
    return max(sigma, ROUNDING * float(np.sqrt(np.mean(joint.V**2))))


def stacked_rows(joints: Sequence[ReducedJoint]) -> Indices:
    """Joint of each reduced row, one joint after the other."""
    return np.repeat(np.arange(len(joints)), [len(each.V) for each in joints])
