"""Initial gains: signs from load or friction, magnitudes joint by joint or from shared parameters."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy import linalg

from ident.estimation.all_joints.friction import OwnColumns
from ident.estimation.all_joints.reduction import DEPENDENT, ReducedJoint
from ident.estimation.joint_by_joint.joint_fit import JointFit, joint_fit
from ident.estimation.problem import Problem
from ident.support.arrays import Array

SURE_Z = 6.0
"""Number of standard deviations at which a joint's own estimate of its gain is used."""
NOTHING = 1e-10
"""Relative norm below which a column is rounding error."""


def alone(problem: Problem) -> Array:
    """Return 1/g of the joints that determine it alone (eq. 27), zero for the others, shape (n,)."""
    h, known = np.zeros(problem.structure.arm.n), [payload.known_part() for payload in problem.payloads]
    for j in range(len(h)) if known else ():
        fit = joint_fit(problem, j, known)
        if isinstance(fit, JointFit) and abs(fit.inverse) > SURE_Z * float(fit.fit.std[-1]):
            h[j] = fit.inverse
    return h


def start_of(
    alone: Array, joints: Sequence[ReducedJoint], own: Sequence[OwnColumns], given: Mapping[int, float]
) -> Array:
    """Return 1/g of joints alone, and of the others from link parameters shared with these, shape (n,).

    Args:
        alone: Result of `alone`, shape (n,).
        joints: Reduced rows of each of the n joints.
        own: Their own columns.
        given: 1/g of joints, from 0, whose gains are known.
    """
    h = alone.copy()
    h[list(given)] = list(given.values())
    by_load = h != 0.0
    sign: Array = np.sign(h)
    for j in np.flatnonzero(~by_load).tolist():
        sign[j] = -1.0 if friction_z(joints[j], own[j].names) < 0.0 else 1.0
    if not by_load.any():  # the scale is free: one joint has 1
        loudest = int(np.argmax([np.linalg.norm(each.V[each.inner]) for each in joints]))
        h[loudest] = sign[loudest]
    while not h.all():
        h = _extended(joints, h, sign)
    return h


def friction_z(joint: ReducedJoint, names: Sequence[str]) -> float:
    """The more significant of Coulomb and viscous friction over its standard deviation, signed as the gain."""
    W = np.column_stack((joint.F, joint.A, joint.k))
    norms = np.linalg.norm(W, axis=0)
    unit = W / np.where(norms > 0.0, norms, 1.0)
    pseudo = linalg.pinv(unit, rtol=DEPENDENT, check_finite=False)
    x, deviation = pseudo @ joint.V, np.linalg.norm(pseudo, axis=1)
    z = [x[k] / deviation[k] for k, name in enumerate(names) if name in ("Fv", "Fc") and deviation[k] > 0.0]
    return float(max(z, key=abs, default=0.0))


def _extended(joints: Sequence[ReducedJoint], h: Array, sign: Array) -> Array:
    """Add the gain of one more joint, from the parameters that it shares with joints that have a gain.

    The joint with the best fit is added first.
    """
    have: list[int] = np.flatnonzero(h).tolist()
    B = np.vstack([h[j] * joints[j].A[joints[j].inner] for j in have])
    y = np.concatenate([joints[j].V[joints[j].inner] - h[j] * joints[j].k[joints[j].inner] for j in have])
    norms = np.linalg.norm(B, axis=0)
    shown = norms > NOTHING * norms.max(initial=0.0)  # gravity about a vertical axis is rounding error
    unit = np.where(shown, B, 0.0) / np.where(shown, norms, 1.0)
    theta = linalg.lstsq(unit, y, cond=1e-6, check_finite=False)[0] / np.where(shown, norms, 1.0)
    best, share = (-1, 1.0), -1.0
    for j in np.flatnonzero(h == 0.0).tolist():
        each = joints[j]
        torque, V = (each.A @ theta + each.k)[each.inner], each.V[each.inner]
        scale = float(np.linalg.norm(torque))
        along = float(torque @ V) / scale**2 if scale > 0.0 else 0.0
        explained = abs(along) * scale / max(float(np.linalg.norm(V)), 1e-300)
        size = abs(along) if along * sign[j] > 0.0 else float(np.linalg.norm(V)) / max(scale, 1e-300)
        if explained > share:
            best, share = (j, size), explained
    extended = h.copy()
    extended[best[0]] = sign[best[0]] * (best[1] or 1.0)
    return extended
