"""The logarithms of the gains, by damped Newton steps on the squares that the shared parameters leave."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import linalg

from ident.estimation.all_joints.reduction import ReducedJoint
from ident.numerics.least_squares import factors
from ident.support.arrays import Array
from ident.support.errors import NotConverged

SMALLEST_STEP = 1e-11
"""Largest change of a logarithm at which the search ends."""
LONGEST_STEP = 0.5
"""Largest change of the logarithms in one step, as a norm."""
MOST_STEPS = 200
POOR, GOOD = 0.25, 0.75
"""Parts of the promised decrease under which steps become shorter, and above which they become longer."""
SLOWER, FASTER = 4.0, 1.0 / 6.0
UNDAMPED, DAMPED = 1e-9, 1e-3
"""Damping to begin with and at least, so that a free scale is not singular, and after the first step that fails."""
RANK_TOL = 1e-10
"""Relative size of a unit column's new part under which the rows do not show a shared parameter."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Prior:
    """What is believed of log|h| and of shared parameters beforehand, each independent of the others.

    A joint that nothing loads would run to an infinite gain; a wide prior keeps it where the search can end, and
    costs the others nothing.

    Attributes:
        mean: Of log|h|, shape (n,).
        std: Shape (n,).
        shared: Deviation from zero of shared parameters, infinite for those of which nothing is believed, shape (p,).
    """

    mean: Array
    std: Array
    shared: Array

    def off(self, s: Array) -> Array:
        """How far logarithms are from their mean, in deviations, shape (n,)."""
        return (s - self.mean) / self.std

    @cached_property
    def rows(self) -> Array:
        """Rows of the shared parameters of which something is believed, in deviations, shape (beliefs, p)."""
        believed = np.flatnonzero(np.isfinite(self.shared))
        rows = np.zeros((len(believed), len(self.shared)))
        rows[np.arange(len(believed)), believed] = 1.0 / self.shared[believed]
        return rows


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Where the search ended.

    Attributes:
        h: 1/g with its sign, shape (n,).
        theta: Shared parameters, zero for those that the rows do not show, shape (p,).
        cost: Sum of squares of the weighted residual and the prior.
        steps: Steps it took.
    """

    h: Array
    theta: Array
    cost: float
    steps: int


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """The model at some gains: T is what each joint's currents owe to its gain, (R, n); r the residual, (R,).

    Below the rows of the joints stand those of the beliefs about shared parameters.
    """

    h: Array
    theta: Array
    r: Array
    T: Array
    basis: Array
    cost: float


def search(joints: Sequence[ReducedJoint], start: Array, prior: Prior) -> Found:
    """Find the gains at which the shared parameters explain the currents of all joints best.

    Args:
        joints: Reduced rows of every joint, n.
        start: 1/g to begin with, the signs right, shape (n,).
        prior: On log|h|.

    Raises:
        NotConverged: If no end is found.
    """
    sign: Array = np.sign(start)
    s: Array = np.log(np.abs(start))
    damping = UNDAMPED
    point = _point(joints, sign * np.exp(s), prior.rows, prior.off(s))
    for steps in range(MOST_STEPS):
        free = point.T - point.basis @ (point.basis.T @ point.T)
        normal = _curvature(point, free, prior)
        gradient = free.T @ point.r - prior.off(s) / prior.std
        while True:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
            length = float(np.linalg.norm(step))
            step *= min(1.0, LONGEST_STEP / max(length, 1e-300))
            if length < SMALLEST_STEP:
                return Found(h=point.h, theta=point.theta, cost=point.cost, steps=steps)
            tried = _point(joints, sign * np.exp(s + step), prior.rows, prior.off(s + step))
            if tried.cost <= point.cost:
                break
            damping = max(8.0 * damping, DAMPED)
        kept = (point.cost - tried.cost) / max(float(gradient @ step), 1e-300)  # of the decrease that the step promised
        damping = max(UNDAMPED, damping * (SLOWER if kept < POOR else FASTER if kept > GOOD else 1.0))
        s, point = s + step, tried
    raise NotConverged(f"the gains do not converge in {MOST_STEPS} steps; record longer, or with a heavier payload")


def _curvature(point: _Point, free: Array, prior: Prior) -> Array:
    """Second derivative of half the squares that the shared parameters and the prior leave by the logarithms, (n, n).

    With T the currents that each joint owes to its gain, R the residual likewise, and Q the basis of the shared
    parameters, T'(T - R) - (T - R)' Q Q' (T - R), and the prior's. Where their sum is not positive definite, far from
    the end, R is left out (Gauss and Newton); of a joint without load the prior alone may make it so.
    """
    bent = point.T - np.where(point.T != 0.0, point.r[:, None], 0.0)
    along = point.basis.T @ bent
    held = np.diag(prior.std**-2)
    exact = np.diag(np.einsum("rj,rj->j", point.T, bent)) - along.T @ along + held
    return exact if np.linalg.eigvalsh(exact)[0] > 0.0 else free.T @ free + held


def _point(joints: Sequence[ReducedJoint], h: Array, beliefs: Array, off: Array) -> _Point:
    sizes = [len(each.V[each.inner]) for each in joints]
    starts = np.cumsum([0, *sizes])
    nothing = np.zeros(len(beliefs))
    B = np.vstack([*(hj * each.A[each.inner] for hj, each in zip(h, joints, strict=True)), beliefs])
    k = np.concatenate([*(hj * each.k[each.inner] for hj, each in zip(h, joints, strict=True)), nothing])
    V = np.concatenate([*(each.V[each.inner] for each in joints), nothing])
    found, theta = factors(B, rank_tol=RANK_TOL), np.zeros(B.shape[1])
    theta[found.columns] = linalg.solve_triangular(found.R, found.Q.T @ (V - k), check_finite=False)
    model = B @ theta + k
    T = np.zeros((len(V), len(joints)))
    for j, (first, last) in enumerate(pairwise(starts)):
        T[first:last, j] = model[first:last]
    r = V - model
    return _Point(h=h, theta=theta, r=r, T=T, basis=found.Q, cost=float(r @ r + off @ off))
