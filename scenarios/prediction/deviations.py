"""Predicted standard deviations of drive gains for a motion with a bare flange and with a payload, without simulation.

For all joints together, in torque units of each joint, the unknowns are changes of ln g_j, of the arm's base parameters
theta, of the payload's unknown parameters pi, and of each joint's friction phi_j and offset o_j:

    d(V_j g_j) = T_j d(ln g_j) + A_j d(theta) + Y_j d(pi) + F_j d(phi_j) + d(o_j),    T_j = A_j theta + Y_j chi

Y_j d(pi) and the second part of T_j exist only in the loaded motion, and phi_j differs between motions. Joint by joint
(paper, eq. 27), no parameters are shared, and friction belongs to the arm's columns, which contain A_j theta. In both
cases the information on the gains is the part of their columns that is orthogonal to the others. ln g_j has a prior
standard deviation of 1, as in `nls`, which is the result for a joint without load (`docs/derivations.md`).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.model.parameters import INERTIAL, STANDARD, labels
from ident.model.regressor import regressor
from ident.model.structure import PROBE_SEED, Structure
from ident.payload.payload import KnownPayload, Payload, standard_parameters
from ident.support.arrays import Array, Indices
from sim.controller import inverse_dynamics
from sim.errors import TrajectoryError
from sim.plant import PayloadBody, Plant, bare_arm

ROWS_PER_SECOND = 20.0
"""Number of rows for which standard deviations are predicted."""
RESIDUAL = 0.02
"""Residual of a decimated row, as a share of the joint's rms torque; a common factor of all predictions."""
RANK_TOL = 1e-12
"""Smallest eigenvalue of a normal matrix with unit diagonal that is used."""
SAME_TORQUE = 1e-6
"""Largest difference between identification model and MuJoCo, relative to the torque; equal models give 1e-13."""
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
    """The bare arm of a plant with its drives, as columns and standard parameters.

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

    @classmethod
    def of(cls, plant: Plant, structure: Structure) -> "ArmModel":
        """Return the arm of a plant.

        The inertial parameters are the minimum-norm solution for MuJoCo's inverse dynamics at random states: those
        without effect on torques are irrelevant here, and frame conventions of the models do not matter.

        Raises:
            TrajectoryError: If the identification model cannot reproduce these torques.
        """
        arm, drives = structure.arm, plant.drives
        states = np.random.default_rng(PROBE_SEED).uniform(-2.0, 2.0, (3, 10 * arm.n, arm.n))
        torque = inverse_dynamics(bare_arm(plant.robot.model, drives.rotor_inertia, plant.robot.flange), *states)
        names = [name.rstrip("0123456789") for name in labels(arm.n, arm.couplings)]
        columns = [k for k, name in enumerate(names) if name in (*INERTIAL, "Ia")]
        W = regressor(arm, *states)
        inertial = np.zeros(W.shape[2])
        inertial[columns] = linalg.lstsq(W[..., columns].reshape(-1, len(columns)), torque.ravel())[0]
        off = np.abs(W @ inertial - torque).max() / np.abs(torque).max()
        if off > SAME_TORQUE:
            raise TrajectoryError(
                f"robot {plant.robot.name}: identification and simulation read {plant.robot.model} differently: "
                f"torques differ by {100.0 * off:.2g} %"
            )
        chi = inertial.copy()
        for name, values in (("Fv", drives.viscous_friction), ("Fc", drives.coulomb_friction)):
            chi[_own(name, arm.n)] = values
        bias = drives.gain * drives.amplifier_offset + drives.coulomb_asymmetry
        return cls(structure=structure, chi=chi, inertial=inertial, bias=bias)

    def rows(self, motion: tuple[Array, Array, Array], rate_hz: float) -> MotionRows:
        """Return the columns and torques of a motion q, dq, ddq, each (N, n), sampled at a rate."""
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
    arm = [structure.base.columns[columns] for columns in structure.joint_independent]
    normals = [_normal(rows.W[:, j, own], rows.Y[:, j], 0.0 * rows.rigid[:, j]) for j, own in enumerate(arm)]

    def predict(what: Carried) -> Deviations:
        each = [_information(G, what, s2) for G, s2 in zip(normals, rows.variance(what.chi), strict=True)]
        noise, payload = zip(*(_deviations(info, push, 1) for info, push in each), strict=True)
        return Deviations(noise=np.concatenate(noise), payload=np.concatenate(payload))

    return predict


def all_joints(rows: MotionRows, structure: Structure) -> Callable[[Carried], Deviations]:
    """Predict all gains with shared link parameters; friction differs between motions, offsets do not (`nls`)."""
    n = rows.bare.shape[1]
    offset, friction = _own("off", n), [_own(name, n) for name in FRICTION]
    shared = np.setdiff1d(structure.base.columns, np.concatenate((offset, *friction)))
    normals: list[Array] = []
    for j in range(n):
        F = rows.W[:, j, np.array([own[j] for own in friction])]
        Q = np.linalg.qr(F / np.maximum(np.linalg.norm(F, axis=0), np.finfo(float).tiny))[0]  # a joint may hardly move
        normals.append(_normal(rows.W[:, j, np.append(offset[j], shared)], rows.Y[:, j], rows.rigid[:, j], without=Q))

    def predict(what: Carried) -> Deviations:
        common = len(shared) + np.count_nonzero(~what.known.mask)
        size = n + common + n  # offsets, shared parameters, gains
        info, push = np.zeros((size, size)), np.zeros((size, what.known.spread.shape[1]))
        for j, (G, s2) in enumerate(zip(normals, rows.variance(what.chi), strict=True)):
            own, by = _information(G, what, s2)
            at = np.array([j, *range(n, n + common), n + common + j])
            info[np.ix_(at, at)] += own
            push[at] += by
        noise, payload = _deviations(info, push, n)
        return Deviations(noise=noise, payload=payload)

    return predict


def _own(name: str, n: int) -> Indices:
    """Return the column of each joint's parameter of that name."""
    return len(STANDARD) * np.arange(n) + STANDARD.index(name)


def _normal(A: Array, Y: Array, rigid: Array, without: Array | None = None) -> Array:
    """Return the normal matrix of the columns of arm, payload and bare torque, orthogonal to orthonormal columns."""
    Z = np.column_stack((A, Y, rigid))
    if without is not None:
        Z = Z - without @ (without.T @ Z)
    return Z.T @ Z


def _information(G: Array, what: Carried, variance: float) -> tuple[Array, Array]:
    """Return a joint's information on [A, unknown payload, ln g], and the effect of errors of the known payload.

    G is its normal matrix (m, m) of [A, Y, bare torque]; without bare torque, the payload alone has the gain's column.
    """
    b = len(G) - len(what.chi) - 1
    free = b + np.flatnonzero(~what.known.mask)
    bare = np.zeros((len(G), b + len(free) + 1))
    bare[np.arange(b), np.arange(b)] = bare[-1, -1] = 1.0
    loaded = bare.copy()
    loaded[free, b + np.arange(len(free))] = 1.0
    loaded[b:-1, -1] = what.chi
    info = bare.T @ G @ bare + loaded.T @ G @ loaded
    return info / variance, loaded.T @ G[:, b:-1] @ what.known.spread / variance


def _deviations(info: Array, push: Array, gains: int) -> tuple[Array, Array]:
    """Return the deviations of the last unknowns, the gains, by noise and by the payload, with all others free.

    The others are eliminated (Schur complement), without their directions that have no information.
    """
    others, cross = info[:-gains, :-gains], info[:-gains, -gains:]
    scale = np.sqrt(np.maximum(np.diag(others), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(others / np.outer(scale, scale))
    kept = values > RANK_TOL * max(values[-1], 0.0)
    half = vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]  # (., k): inverse = half half^T
    explained = half.T @ cross
    information = info[-gains:, -gains:] - explained.T @ explained
    covariance = np.linalg.inv(information + np.eye(gains))
    off = covariance @ (push[-gains:] - explained.T @ (half.T @ push[:-gains]))
    return np.sqrt(np.diag(covariance)), np.linalg.norm(off, axis=1)
