"""Predicted deviations of drive gains for a motion that is made bare and with a payload; nothing is simulated.

All joints at once, in torque units of each joint, the unknowns are changes of ln g_j, of the arm's base parameters
theta, which all joints share, of the payload's unknown parameters pi and of each joint's own friction and offset o_j:

    d(V_j g_j) = T_j d(ln g_j) + A_j d(theta) + Y_j d(pi) + F_j d(phi_j) + d(o_j),    T_j = A_j theta + Y_j chi

with Y_j d(pi) and the second part of T_j in the loaded motion alone, and phi_j for each motion anew. Joint by joint
(paper, eq. 27) nothing is shared, friction included with the arm's columns, and the last column is the known part of
the payload's torque. In both, the information on the gains is what is left of their columns where the others cannot
imitate them (`docs/derivations.md`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ident.model.parameters import STANDARD
from ident.model.structure import Structure
from ident.support.arrays import Array, Mask
from scenarios.design.rows import ROWS_PER_SECOND, Carried, MotionRows

RESIDUAL = 0.02
"""Residual of a decimated row, as a share of the joint's rms torque; a common factor of all predictions."""
PRIOR = 1.0
"""Deviation of ln g_j beforehand, as of `nls`: a joint that nothing loads has this one, and no more."""
RANK_TOL = 1e-12
"""Least eigenvalue of a normal matrix with unit diagonal that counts: a share of 1e-6 of a unit column."""
FRICTION = ("Fv", "Fc")
"""Columns of a joint's own that differ between motions."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deviations:
    """Predicted relative standard deviations of the gains, each (n,).

    Attributes:
        noise: From the residual of the rows.
        payload: From the stated deviations of what is known of the payload.
    """

    noise: Array
    payload: Array

    @property
    def total(self) -> Array:
        """Both together."""
        return np.hypot(self.noise, self.payload)


Predictor = Callable[[Carried], Deviations]
"""Deviations for a payload, along a motion that is given."""
Prediction = Callable[[MotionRows, Structure], Predictor]
"""Prepares what no payload changes."""


def joint_by_joint(rows: MotionRows, structure: Structure) -> Predictor:
    """Each gain from its own joint's rows, friction the same in both motions (`ls-2011`)."""
    n = rows.bare.shape[1]
    arm = [rows.W[:, j, structure.base.columns[structure.joint_independent[j]]] for j in range(n)]
    normals = [_normal(np.concatenate((A, rows.Y[:, j]), axis=1)) for j, A in enumerate(arm)]

    def predict(what: Carried) -> Deviations:
        known, variance = what.known.mask, _row_variance(rows, what)
        noise, payload = np.empty(n), np.empty(n)
        for j, G in enumerate(normals):
            b = len(G) - len(known)
            bare, loaded = _selection(len(G), b, known)
            loaded[b:, -1] = np.where(known, what.chi, 0.0)
            info = (bare.T @ G @ bare + loaded.T @ G @ loaded) / variance[j]
            left = _eliminated(info, 1)
            kept = left.information[0, 0]
            noise[j] = PRIOR / np.sqrt(1.0 + max(kept, 0.0) * PRIOR**2)
            push = (loaded.T @ G[:, b:] @ what.known.spread) / variance[j]  # rows' weights on an error of what is known
            payload[j] = noise[j] ** 2 * np.linalg.norm(push[-1] - left.imitated[0] @ push[:-1])
        return Deviations(noise=noise, payload=payload)

    return predict


def all_joints(rows: MotionRows, structure: Structure) -> Predictor:
    """All gains through the links that they share; friction differs between motions, offsets do not (`nls`)."""
    n = rows.bare.shape[1]
    joints = np.arange(n)
    own = {name: len(STANDARD) * joints + STANDARD.index(name) for name in (*FRICTION, "off")}
    shared = np.setdiff1d(structure.base.columns, np.concatenate(list(own.values())))
    F = np.stack([_unit(rows.W[:, joints, own[name]]) for name in FRICTION], axis=2).swapaxes(0, 1)
    columns = (rows.W[:, joints, own["off"]][:, :, None], rows.W[:, :, shared], rows.Y, rows.rigid[:, :, None])
    Z = np.concatenate(columns, axis=2).swapaxes(0, 1)  # (n, N, m): offset, arm, payload, torque
    Q = np.linalg.qr(F)[0]
    Z = Z - Q @ (Q.swapaxes(1, 2) @ Z)
    normals = Z.swapaxes(1, 2) @ Z
    b = 1 + len(shared)

    def predict(what: Carried) -> Deviations:
        known, variance = what.known.mask, _row_variance(rows, what)
        common = len(shared) + np.count_nonzero(~known)
        info, push = np.zeros((common + n, common + n)), np.zeros((common + n, what.known.spread.shape[1]))
        for j, G in enumerate(normals / variance[:, None, None]):
            bare, loaded = _selection(len(G), b, known)
            bare[-1, -1] = loaded[-1, -1] = 1.0
            loaded[b:-1, -1] = what.chi
            local, pushed = bare.T @ G @ bare + loaded.T @ G @ loaded, loaded.T @ G[:, b:-1] @ what.known.spread
            offset = local[1:, 0] / local[0, 0]  # what of the others the joint's own offset imitates
            at = np.append(np.arange(common), common + j)
            info[np.ix_(at, at)] += local[1:, 1:] - np.outer(offset, local[0, 1:])
            push[at] += pushed[1:] - np.outer(offset, pushed[0])
        left = _eliminated(info, n)
        covariance = np.linalg.inv(left.information + np.eye(n) / PRIOR**2)
        off = covariance @ (push[-n:] - left.imitated @ push[:-n])
        return Deviations(noise=np.sqrt(np.diag(covariance)), payload=np.linalg.norm(off, axis=1))

    return predict


PREDICTIONS: Mapping[str, Prediction] = {"joint by joint": joint_by_joint, "all joints": all_joints}
"""Kinds of predictions by name."""
JOINTWISE = ("ls-2011", "iv")
"""Estimators that solve each joint by itself; the others share links between joints."""


def prediction_of(method: str) -> Prediction:
    """The prediction that fits an estimator."""
    return PREDICTIONS["joint by joint" if method in JOINTWISE else "all joints"]


@dataclass(frozen=True, slots=True, eq=False)
class _Eliminated:
    """Information on the last unknowns with all others free, and what of them the others imitate."""

    information: Array
    imitated: Array


def _eliminated(info: Array, last: int) -> _Eliminated:
    """Schur complement of a normal matrix on its last unknowns; of the others, what has no information drops out."""
    scale = np.sqrt(np.maximum(np.diag(info)[:-last], np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(info[:-last, :-last] / np.outer(scale, scale))
    kept = values > RANK_TOL * max(values[-1], 0.0)
    half = vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]  # (., k): inverse = half half^T
    cross = half.T @ info[:-last, -last:]
    return _Eliminated(info[-last:, -last:] - cross.T @ cross, (half @ cross).T)


def _selection(m: int, b: int, known: Mask) -> tuple[Array, Array]:
    """Columns [A, Y, ...] as the unknowns use them, bare and loaded, the gain's last; both (m, unknowns)."""
    free = b + np.flatnonzero(~known)
    bare = np.zeros((m, b + len(free) + 1))
    bare[np.arange(b), np.arange(b)] = 1.0
    loaded = bare.copy()
    loaded[free, b + np.arange(len(free))] = 1.0
    return bare, loaded


def _row_variance(rows: MotionRows, what: Carried) -> Array:
    """Variance of a sampled torque of each joint [N^2 m^2], as if decimated rows were as many, shape (n,)."""
    torques = rows.torques(what.chi)
    return RESIDUAL**2 * np.mean(torques**2, axis=(0, 1)) * rows.rate_hz / ROWS_PER_SECOND


def _normal(columns: Array) -> Array:
    return columns.T @ columns


def _unit(columns: Array) -> Array:
    """Columns of unit length, so that a joint that hardly moves keeps its own."""
    return columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
