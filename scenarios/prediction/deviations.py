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
from dataclasses import dataclass, replace

import numpy as np

from ident.model.parameters import STANDARD
from ident.model.regressor import regressor
from ident.model.structure import Structure
from ident.payload.payload import KnownPayload, Payload
from ident.support.arrays import Array, Indices
from scenarios.experiments.robots import nominal_links
from sim.plant import Plant

ROWS_PER_SECOND = 20.0
"""Number of rows for which standard deviations are predicted."""
RESIDUAL = 0.02
"""Residual of a decimated row, as a share of the joint's rms torque; a common factor of all predictions."""
TINY = np.finfo(float).tiny
FRICTION = ("Fv", "Fc")
"""Joint-specific columns that differ between motions."""
JOINTWISE = ("ls-2011", "iv")
"""Estimators that solve each joint separately; the others share link parameters."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carried:
    """A payload on the flange."""

    chi: Array  # its standard parameters, in the order of `INERTIAL`, shape (10,)
    known: KnownPayload

    @classmethod
    def nominal(cls, payload: Payload) -> "Carried":
        """Return a payload with its nominal values."""
        return cls(chi=payload.known_part().chi, known=payload.known_part())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionRows:
    """A sampled motion: N samples, n joints, p standard columns."""

    motion: tuple[Array, Array, Array]  # q, dq, ddq, each (N, n)
    W: Array  # standard columns of all joints, shape (N, n, p)
    Y: Array  # columns of a payload, shape (N, n, 10)
    rigid: Array  # torque of the bare arm and its rotors [N m], shape (N, n)
    bare: Array  # torque of the bare arm, rotors, friction and offsets [N m], shape (N, n)
    rate_hz: float  # sampling rate [Hz]

    def torques(self, chi: Array) -> Array:
        """Return joint torques without and with a payload of these standard parameters [N m], shape (2, N, n)."""
        return np.stack((self.bare, self.bare + self.Y @ chi))

    def weighted(self, slow: Array) -> "MotionRows":
        """Return the rows with weights by joint speed: 1/2 at `slow` [rad/s], shape (n,), next to none at rest."""
        speed = self.motion[1] ** 2
        share = np.maximum(speed / (speed + slow**2), 1e-6)  # of no row zero, so that no column is
        W, Y, rigid = self.W * share[:, :, None], self.Y * share[:, :, None], self.rigid * share
        return replace(self, W=W, Y=Y, rigid=rigid)

    def variance(self, chi: Array) -> Array:
        """Return the variance of each joint's sampled torque [N^2 m^2], equivalent to that of rows, shape (n,)."""
        return RESIDUAL**2 * np.mean(self.torques(chi) ** 2, axis=(0, 1)) * self.rate_hz / ROWS_PER_SECOND


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArmModel:
    """The bare arm of a plant with its drives, as columns and standard parameters."""

    structure: Structure
    chi: Array  # standard parameters of arm and drives, shape (p,)
    inertial: Array  # standard parameters of links and rotors, others zero, shape (p,)
    bias: Array  # offset of every joint's torque [N m], shape (n,)

    @classmethod
    def of(cls, plant: Plant, structure: Structure) -> "ArmModel":
        """Return the arm of a plant with the links of its model file; `PlantError` if MuJoCo cannot read that."""
        robot, drives = plant.robot, plant.drives
        links, own = nominal_links(robot.model, robot.flange).whole, {"Ia": drives.rotor_inertia}
        friction = dict(zip(FRICTION, (drives.viscous_friction, drives.coulomb_friction), strict=True))
        return cls(
            structure=structure,
            chi=structure.base.standard(links, own | friction),
            inertial=structure.base.standard(links, own),
            bias=drives.gain * drives.amplifier_offset + drives.coulomb_asymmetry,
        )

    def rows(self, motion: tuple[Array, Array, Array], rate_hz: float) -> MotionRows:
        """Return the columns and torques of the motors in a motion q, dq, ddq of the joints, (N, n), at a rate."""
        if (A := self.structure.arm.transmission) is not None:
            motion = motion[0] @ A.T, motion[1] @ A.T, motion[2] @ A.T
        W = regressor(self.structure.arm, *motion)
        Y, bare = W[:, :, self.structure.payload_columns], W @ self.chi + self.bias
        return MotionRows(motion=motion, W=W, Y=Y, rigid=W @ self.inertial, bare=bare, rate_hz=rate_hz)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Deviations:
    """Predicted relative standard deviations of the gains, each of shape (n,)."""

    noise: Array
    payload: Array

    @property
    def total(self) -> Array:
        """Total of both."""
        return np.hypot(self.noise, self.payload)


def predicted(rows: MotionRows, structure: Structure, method: str) -> Callable[[Carried], Deviations]:
    """Prepare the rows of a motion, and return a function that predicts the standard deviations for a payload."""
    n, base, normals = rows.bare.shape[1], structure.base.columns, list[Array]()
    groups = [[j] for j in range(n)] if method in JOINTWISE else [list(range(n))]
    offset, friction = _own("off", n), np.stack([_own(name, n) for name in FRICTION])
    for j, independent in enumerate(structure.joint_independent):
        if method in JOINTWISE:
            Z = np.column_stack((rows.W[:, j, base[independent]], rows.Y[:, j], 0.0 * rows.rigid[:, j]))
        else:  # orthogonal to friction
            shared = np.setdiff1d(base, np.append(friction, offset))
            F = rows.W[:, j, friction[:, j]]
            Q = np.linalg.qr(F / np.maximum(np.linalg.norm(F, axis=0), TINY))[0]  # a joint may hardly move
            Z = np.column_stack((rows.W[:, j, np.append(offset[j], shared)], rows.Y[:, j], rows.rigid[:, j]))
            Z -= Q @ (Q.T @ Z)
        normals.append(Z.T @ Z)

    def predict(what: Carried) -> Deviations:
        noise, payload, variance = np.empty(n), np.empty(n), rows.variance(what.chi)
        for group in groups:
            parts, k = [_information(normals[j], what, variance[j]) for j in group], len(group)
            shared = len(parts[0][0]) - 2
            info, push = np.zeros((shared + 2 * k, shared + 2 * k)), np.zeros((shared + 2 * k, parts[0][1].shape[1]))
            for i, (own, by) in enumerate(parts):  # a first column and a gain of its own, the others shared
                at = np.array([i, *range(k, k + shared), k + shared + i])
                info[np.ix_(at, at)] += own
                push[at] += by
            noise[group], payload[group] = _deviations(info, push, k)
        return Deviations(noise=noise, payload=payload)

    return predict


def _own(name: str, n: int) -> Indices:  # the column of each joint's parameter
    return len(STANDARD) * np.arange(n) + STANDARD.index(name)


def _information(G: Array, what: Carried, variance: float) -> tuple[Array, Array]:
    """Return a joint's information on [A, unknown payload, ln g], and the effect of errors of the known payload.

    G is its normal matrix (m, m) of [A, Y, bare torque], the last 0 if the payload alone has the gain's column.
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
    """Return the deviations of the last unknowns, the gains, by noise and by the payload, with all others free."""
    # The others are eliminated (Schur complement), without their directions that have no information.
    others, cross = info[:-gains, :-gains], info[:-gains, -gains:]
    scale = np.sqrt(np.maximum(np.diag(others), TINY))
    values, vectors = np.linalg.eigh(others / np.outer(scale, scale))
    kept = values > 1e-12 * max(values[-1], 0.0)
    half = vectors[:, kept] / np.sqrt(values[kept]) / scale[:, None]  # (., k): inverse = half half^T
    explained = half.T @ cross
    information = info[-gains:, -gains:] - explained.T @ explained
    covariance = np.linalg.inv(information + np.eye(gains))
    off = covariance @ (push[-gains:] - explained.T @ (half.T @ push[:-gains]))
    return np.sqrt(np.diag(covariance)), np.linalg.norm(off, axis=1)
