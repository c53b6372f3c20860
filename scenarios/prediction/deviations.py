"""Predicted standard deviations of drive gains for a motion with a bare flange and with a payload, without simulation.

For all joints together, in torque units of each joint, the unknowns are changes of ln g_j, of the arm's base parameters
theta, of the payload's unknown parameters pi, and of each joint's friction phi_j and offset o_j:

    d(V_j g_j) = T_j d(ln g_j) + A_j d(theta) + Y_j d(pi) + F_j d(phi_j) + d(o_j),    T_j = A_j theta + Y_j chi

Y_j d(pi) and the second part of T_j exist only in the loaded motion, and phi_j differs between motions. Joint by joint
(paper, eq. 27), no parameters are shared, friction belongs to the arm's columns, and the last column is the known part
of the payload's torque. In both cases the information on the gains is the part of their columns that is orthogonal to
the others. ln g_j has a prior standard deviation of 1, as in `nls`, which is the result for a joint without load
(`docs/derivations.md`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.model.parameters import STANDARD
from ident.model.regressor import regressor
from ident.model.structure import Structure
from ident.payload.payload import KnownPayload, Payload, standard_parameters
from ident.support.arrays import Array, Mask
from sim.plant import PayloadBody
from sim.trajectory import FourierTrajectory

ROWS_PER_SECOND = 20.0
"""Number of rows for which standard deviations are predicted."""
RESIDUAL = 0.02
"""Residual of a decimated row, as a share of the joint's rms torque; a common factor of all predictions."""
RANK_TOL = 1e-12
"""Smallest eigenvalue of a normal matrix with unit diagonal that is used."""
FRICTION = ("Fv", "Fc")
"""Joint-specific columns that differ between motions."""
JOINTWISE = ("ls-2011", "iv")
"""Estimators that solve each joint separately; the others share link parameters."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carried:
    """A payload on the flange.

    Attributes:
        chi: Its standard parameters, in the order of `INERTIAL`, shape (10,).
        known: Known parameters.
    """

    chi: Array
    known: KnownPayload

    @classmethod
    def of(cls, body: PayloadBody, believed: Payload) -> "Carried":
        """Return the true payload and its known parameters."""
        return cls(chi=standard_parameters(body.mass, body.com, body.inertia), known=believed.known_part())

    @classmethod
    def nominal(cls, payload: Payload) -> "Carried":
        """Return a payload with its nominal values."""
        return cls(chi=payload.known_part().chi, known=payload.known_part())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionRows:
    """A sampled motion: N samples, n joints, p standard columns.

    Attributes:
        motion: q, dq, ddq, each (N, n).
        W: Standard columns of all joints, shape (N, n, p).
        Y: Columns of a payload, shape (N, n, 10).
        rigid: Torque of the bare arm and its rotors [N m], shape (N, n).
        bare: Torque of the bare arm, rotors, friction and offsets [N m], shape (N, n).
        rate_hz: Sampling rate [Hz].
    """

    motion: tuple[Array, Array, Array]
    W: Array
    Y: Array
    rigid: Array
    bare: Array
    rate_hz: float

    def torques(self, chi: Array) -> Array:
        """Return joint torques without and with a payload of these standard parameters [N m], shape (2, N, n)."""
        return np.stack((self.bare, self.bare + self.Y @ chi))

    def variance(self, chi: Array) -> Array:
        """Return the variance of each joint's sampled torque [N^2 m^2], equivalent to that of rows, shape (n,)."""
        return RESIDUAL**2 * np.mean(self.torques(chi) ** 2, axis=(0, 1)) * self.rate_hz / ROWS_PER_SECOND


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmModel:
    """The arm of a motion.

    Attributes:
        structure: Its identifiable structure.
        chi: Standard parameters of arm and drives, shape (p,).
        inertial: Standard parameters of links and rotors, others zero, shape (p,).
        bias: Offset of every joint's torque [N m], shape (n,).
    """

    structure: Structure
    chi: Array
    inertial: Array
    bias: Array

    def rows(self, trajectory: FourierTrajectory, rate_hz: float) -> MotionRows:
        """Sample a motion at a rate."""
        motion = trajectory(np.arange(0.0, trajectory.duration, 1.0 / rate_hz))
        W = regressor(self.structure.arm, *motion)
        Y, bare = W[:, :, self.structure.payload_columns], W @ self.chi + self.bias
        return MotionRows(motion=motion, W=W, Y=Y, rigid=W @ self.inertial, bare=bare, rate_hz=rate_hz)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deviations:
    """Predicted relative standard deviations of the gains, each of shape (n,).

    Attributes:
        noise: Contribution of the residual.
        payload: Contribution of the specified standard deviations of the payload's known parameters.
    """

    noise: Array
    payload: Array

    @property
    def total(self) -> Array:
        """Total of both."""
        return np.hypot(self.noise, self.payload)


Prediction = Callable[[MotionRows, Structure], Callable[[Carried], Deviations]]
"""Function that prepares a motion and returns a function that predicts the standard deviations for a payload."""


def prediction_of(method: str) -> Prediction:
    """Return the prediction for an estimator."""
    return joint_by_joint if method in JOINTWISE else all_joints


def joint_by_joint(rows: MotionRows, structure: Structure) -> Callable[[Carried], Deviations]:
    """Predict each gain from the rows of its joint, with common friction of both motions (`ls-2011`)."""
    n = rows.bare.shape[1]
    arm = [rows.W[:, j, structure.base.columns[structure.joint_independent[j]]] for j in range(n)]
    columns = [np.concatenate((A, rows.Y[:, j]), axis=1) for j, A in enumerate(arm)]
    normals = [each.T @ each for each in columns]

    def predict(what: Carried) -> Deviations:
        known, variance = what.known.mask, rows.variance(what.chi)
        noise, payload = np.empty(n), np.empty(n)
        for j, G in enumerate(normals):
            b = len(G) - len(known)
            bare, loaded = _selection(len(G), b, known)
            loaded[b:, -1] = np.where(known, what.chi, 0.0)
            info = (bare.T @ G @ bare + loaded.T @ G @ loaded) / variance[j]
            information, imitated = _eliminated(info, 1)
            noise[j] = 1.0 / np.sqrt(1.0 + max(information[0, 0], 0.0))
            push = (loaded.T @ G[:, b:] @ what.known.spread) / variance[j]  # by an error of the known parameters
            payload[j] = noise[j] ** 2 * np.linalg.norm(push[-1] - imitated[0] @ push[:-1])
        return Deviations(noise=noise, payload=payload)

    return predict


def all_joints(rows: MotionRows, structure: Structure) -> Callable[[Carried], Deviations]:
    """Predict all gains with shared link parameters; friction differs between motions, offsets do not (`nls`)."""
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
        known, variance = what.known.mask, rows.variance(what.chi)
        common = len(shared) + np.count_nonzero(~known)
        info, push = np.zeros((common + n, common + n)), np.zeros((common + n, what.known.spread.shape[1]))
        for j, G in enumerate(normals / variance[:, None, None]):
            bare, loaded = _selection(len(G), b, known)
            bare[-1, -1] = loaded[-1, -1] = 1.0
            loaded[b:-1, -1] = what.chi
            local, pushed = bare.T @ G @ bare + loaded.T @ G @ loaded, loaded.T @ G[:, b:-1] @ what.known.spread
            offset = local[1:, 0] / local[0, 0]  # part of the others that the joint's offset explains
            at = np.append(np.arange(common), common + j)
            info[np.ix_(at, at)] += local[1:, 1:] - np.outer(offset, local[0, 1:])
            push[at] += pushed[1:] - np.outer(offset, pushed[0])
        information, imitated = _eliminated(info, n)
        covariance = np.linalg.inv(information + np.eye(n))
        off = covariance @ (push[-n:] - imitated @ push[:-n])
        return Deviations(noise=np.sqrt(np.diag(covariance)), payload=np.linalg.norm(off, axis=1))

    return predict


def _eliminated(info: Array, last: int) -> tuple[Array, Array]:
    """Return the information on the last unknowns with others free (Schur complement), and the rest.

    Directions of the others without information are dropped.
    """
    scale = np.sqrt(np.maximum(np.diag(info)[:-last], np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(info[:-last, :-last] / np.outer(scale, scale))
    kept = values > RANK_TOL * max(values[-1], 0.0)
    half = vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]  # (., k): inverse = half half^T
    cross = half.T @ info[:-last, -last:]
    return info[-last:, -last:] - cross.T @ cross, (half @ cross).T


def _selection(m: int, b: int, known: Mask) -> tuple[Array, Array]:
    """Return columns [A, Y, ...] of the unknowns, bare and loaded, that of the gain last; both (m, unknowns)."""
    free = b + np.flatnonzero(~known)
    bare = np.zeros((m, b + len(free) + 1))
    bare[np.arange(b), np.arange(b)] = 1.0
    loaded = bare.copy()
    loaded[free, b + np.arange(len(free))] = 1.0
    return bare, loaded


def _unit(columns: Array) -> Array:
    """Return columns of unit length, so that those of a hardly moving joint are kept."""
    return columns / np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
