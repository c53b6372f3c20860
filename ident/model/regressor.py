"""Inverse dynamics and its regressor: a Newton-Euler recursion over links, vectorised over samples (paper, eq. 9).

The outward recursion gives the motion of each link in its own frame: w and dw its angular velocity and acceleration, a
the acceleration of its origin minus gravity. Relative to its origin, a link of inertia J, first moment MS and mass M
requires (d'Alembert's principle)

    force M a + L MS,  L x = dw x x + w x (w x x)       moment J dw + w x J w + MS x a

For torques, the inward recursion sums these of a joint's link and of all following links. For the regressor, with u, p
the angular velocity of link i and the velocity of its origin for unit speed of joint j,

    tau_j = p . force_i + u . moment_i

which is linear in J = (XX .. ZZ), MS = (MX, MY, MZ) and M. Samples are on the last axis.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from ident.model.arm import Arm
from ident.model.parameters import INERTIAL, STANDARD, labels
from ident.support.arrays import Array

BLOCK = 2048
"""Number of samples per block of the regressor: limits the overhead of NumPy calls, and fits the processor's cache."""
ROUNDING = 1e-15
"""Size below which an entry of a rotation matrix is a rounding error of the model file's quaternion."""
Vector: TypeAlias = list[Array | float]
"""Three components, each of shape (samples,), or 0.0 if zero: these are skipped."""


@dataclass(slots=True)
class LinkMotion:
    """A link's pose in the preceding frame, and its motion in its own frame."""

    E: Array  # rotation from the preceding frame to its own, (3, 3, samples)
    arrow: Vector  # its origin in the preceding frame
    vectors: Array  # w, dw and a, (3, 3, samples)
    L: Array  # matrix of x -> dw x x + w x (w x x), (3, 3, samples)


def link_motions(
    arm: Arm, q: Array, dq: Array, ddq: Array, gravity: Array | None = None, length: Array | None = None
) -> Iterator[LinkMotion]:
    """Yield the motion of each link, from the base on, by positions (of motors) and derivatives, shape (n, samples).

    `gravity` of each sample is in the base frame [m/s^2], shape (3, samples), None for the arm's; `length` is a factor
    of each distance between frames, shape (n, samples), None for 1.
    """
    if (through := arm.to_joints) is not None:
        q, dq, ddq = through @ q, through @ dq, through @ ddq
    vectors, L = np.zeros((3, 3, q.shape[1])), np.zeros((3, 3, q.shape[1]))
    vectors[2] = -arm.gravity[:, None] if gravity is None else -gravity
    for j in range(arm.n):
        E, arrow = joint_pose(arm, j, q[j], 1.0 if length is None else length[j])
        moved = vectors.copy()
        _add_product(moved[2], L, arrow)
        vectors = np.einsum("kbs,abs->kas", moved, E)
        w, dw, a = vectors
        if arm.revolute[j]:
            _add_cross(dw, w, _along(arm.axis[j], dq[j]))
        else:
            _add_cross(a, w, _along(arm.axis[j], 2.0 * dq[j]))
        for k in np.flatnonzero(arm.axis[j]):
            (dw if arm.revolute[j] else a)[k] += arm.axis[j, k] * ddq[j]
            if arm.revolute[j]:
                w[k] += arm.axis[j, k] * dq[j]
        L, square = np.empty((3, *w.shape)), w * w
        for k in range(3):
            b, c = (k + 1) % 3, (k + 2) % 3
            product = w[b] * w[c]
            L[k, k] = -(square[b] + square[c])
            L[c, b] = product + dw[k]
            L[b, c] = product - dw[k]
        yield LinkMotion(E, arrow, vectors, L)


def joint_pose(arm: Arm, j: int, q: Array, length: Array | float = 1.0) -> tuple[Array, Vector]:
    """Return rotation from frame j - 1 to frame j, (3, 3, samples), and origin of frame j in frame j - 1.

    `length` is a factor of the distance.
    """
    terms, arrow = _rotation_terms(arm, j), _along(arm.translation[j], length)
    if not arm.revolute[j]:
        slid = _along(arm.axis[j] @ arm.rotation[j].T, q)
        q, arrow = np.zeros(len(q)), [x + y for x, y in zip(arrow, slid, strict=True)]
    return (terms @ np.stack((np.ones(len(q)), np.cos(q), np.sin(q)))).reshape(3, 3, -1), arrow


@lru_cache(maxsize=64)
def _rotation_terms(arm: Arm, j: int) -> Array:
    """Entries of the rotation from frame j - 1 to frame j as factors of 1, cos(q) and sin(q) (Rodrigues), (9, 3)."""
    kept, (x, y, z) = np.outer(arm.axis[j], arm.axis[j]), arm.axis[j]
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    terms = np.stack((kept, np.eye(3) - kept, -skew)) @ arm.rotation[j].T
    return np.ascontiguousarray(np.where(np.abs(terms) < ROUNDING, 0.0, terms).reshape(3, 9).T)


def _along(direction: Array, amount: Array | float) -> Vector:
    """Return the components of `amount` along a constant direction."""
    return [float(x) * amount if x else 0.0 for x in direction]


def _add_cross(out: Array, x: Array, y: Vector) -> None:
    """Add x cross y to `out`, shape (..., 3, samples)."""
    for k in range(3):
        if not isinstance(y[k], float) or y[k]:
            out[..., (k + 1) % 3, :] += x[..., (k + 2) % 3, :] * y[k]
            out[..., (k + 2) % 3, :] -= x[..., (k + 1) % 3, :] * y[k]


def _add_product(out: Array, L: Array, x: Vector) -> None:
    """Add L x to `out`, shape (3, samples)."""
    for k in range(3):
        if not isinstance(x[k], float) or x[k]:
            out += L[:, k] * x[k]


def _drive_columns(arm: Arm, dq: Array, ddq: Array) -> Iterator[tuple[int, int, Array]]:
    """Yield joint, column and values (samples,) of the regressor of rotors, friction and offsets."""
    n, p = arm.n, len(STANDARD)
    for j in range(n):
        for k, values in enumerate((ddq[j], dq[j], np.sign(dq[j]), np.ones_like(dq[j])), len(INERTIAL)):
            yield j, p * j + k, values
    for c, (first, second) in enumerate(arm.couplings):
        both = np.sign(dq[first] + dq[second])
        for j, other in ((first, second), (second, first)):
            for k, values in enumerate((ddq[other], dq[other], both), p * n + 3 * c):
                yield j, k, values


@dataclass(frozen=True, slots=True, eq=False)
class LinkMotions:
    """The motion of every link along that of an arm, for torques of many sets of parameters."""

    arm: Arm  # the arm, n joints
    dq: Array  # joint velocities [rad/s or m/s], shape (N, n)
    ddq: Array  # joint accelerations, shape (N, n)
    links: tuple[LinkMotion, ...]

    @classmethod
    def of(cls, arm: Arm, q: Array, dq: Array, ddq: Array) -> "LinkMotions":
        """Of a motion, positions, velocities and accelerations of shape (N, n)."""
        return cls(arm, dq, ddq, tuple(link_motions(arm, q.T, dq.T, ddq.T)))

    def torques(self, chi: Array) -> Array:
        """As `inverse_dynamics` gives them, shape (N, n)."""
        arm, samples = self.arm, len(self.dq)
        torque, carried = np.empty((arm.n, samples)), np.zeros((2, 3, samples))  # moment, force
        for j, link in reversed(list(enumerate(self.links))):
            XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M = chi[len(STANDARD) * j :][: len(INERTIAL)]
            J = np.array([[XX, XY, XZ], [XY, YY, YZ], [XZ, YZ, ZZ]])
            MS: Vector = [float(MX), float(MY), float(MZ)]
            w, dw, a = link.vectors
            wrench = np.stack((J @ dw, M * a))
            _add_cross(wrench[0], w, list(J @ w))
            _add_cross(wrench[0], -a, MS)
            _add_product(wrench[1], link.L, MS)
            carried += wrench
            torque[j] = arm.axis[j] @ carried[0 if arm.revolute[j] else 1]
            carried = np.einsum("kas,abs->kbs", carried, link.E)
            _add_cross(carried[0], -carried[1], link.arrow)  # lever arm times force
        return arm.of_motors(torque.T) + drive_torques(arm, chi, self.dq, self.ddq)


def inverse_dynamics(arm: Arm, chi: Array, q: Array, dq: Array, ddq: Array) -> Array:
    """Return the joint torques [N m] or forces [N] of standard parameters, `regressor(arm, q, dq, ddq) @ chi`, (N, n).

    The parameters, shape (14 n + 3 c,) for c couplings, have the names of `parameters.labels`; positions [rad or m],
    velocities and accelerations have the shape (N, n).
    """
    return LinkMotions.of(arm, q, dq, ddq).torques(chi)


def drive_torques(arm: Arm, chi: Array, dq: Array, ddq: Array) -> Array:
    """Return the torque of rotors, friction and offsets, a part of `inverse_dynamics`, shape (N, n)."""
    torque = np.zeros(dq.shape)
    for j, k, values in _drive_columns(arm, dq.T, ddq.T):
        if chi[k]:
            torque[:, j] += chi[k] * values
    return torque


def regressor(arm: Arm, q: Array, dq: Array, ddq: Array) -> Array:
    """Regressor of the inverse dynamic identification model (paper, eq. 9 and 10).

    Args:
        arm: The arm, n joints.
        q: Joint positions [rad or m], shape (N, n).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).

    Returns:
        W_st, shape (N, n, 14 n + 3 c) for c couplings, with `tau = W_st @ chi_st`; columns as in `parameters.labels`.

    Example:
        For a pendulum at rest at q = 0 with gravity along -x of its frame, the first moment MY gives a torque:

        >>> from ident.model.arm import Arm
        >>> import numpy as np
        >>> arm = Arm("pendulum", ("hinge",), np.eye(3)[None], np.zeros((1, 3)), np.eye(3)[2:],
        ...           np.array([True]), np.array([-9.81, 0, 0]), np.full(1, -np.inf), np.full(1, np.inf))
        >>> W = regressor(arm, np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1)))
        >>> float(W[0, 0, STANDARD.index("MY")])
        -9.81
    """
    samples, n = q.shape
    W = np.empty((samples, n, len(labels(n, arm.couplings))))
    for block, columns in regressor_blocks(arm, q, dq, ddq, size=max(1, min(BLOCK, samples))):
        W[block] = np.moveaxis(columns, 2, 0)
    return W


def regressor_blocks(
    arm: Arm,
    q: Array,
    dq: Array,
    ddq: Array,
    *,
    weight: Array | None = None,
    size: int = BLOCK,
    first: int = 0,
    gravity: Array | None = None,
    length: Array | None = None,
) -> Iterator[tuple[slice, Array]]:
    """Yield slices of samples and their regressor, samples last, for processing without storing it.

    Positions, velocities and accelerations have the shape (N, n), and so has `weight`, a factor of each joint's row
    that takes little time here, because a row is linear in the unit speed of its joint. `first` is the first joint
    whose row is computed; `gravity` of each sample [m/s^2], (N, 3), and `length`, a factor of each distance between
    frames, (N, n), are those of the arm if None. Columns, (n - first, 14 n + 3 c, samples of the block), are
    overwritten by the next block.
    """
    n, p, through = arm.n, len(STANDARD), arm.to_joints
    lowest = first if through is None else 0
    buffer = np.zeros((n - lowest, len(labels(n, arm.couplings)), min(size, len(q))))
    weight = np.ones_like(q) if weight is None else weight
    for start in range(0, len(q), size):
        block = slice(start, min(start + size, len(q)))
        columns = buffer[..., : block.stop - start]
        dq_block, ddq_block, share = dq[block].T, ddq[block].T, weight[block].T  # (n, samples)
        up = np.zeros((0 if through is None else n, 2, 3, len(share.T)))  # u and p of each motor, times its weight
        further = [None if each is None else each[block].T for each in (gravity, length)]
        for i, link in enumerate(link_motions(arm, q[block].T, dq_block, ddq_block, *further)):
            if i < lowest:
                continue
            _add_cross(up[:, 1], up[:, 0], link.arrow)
            up = np.einsum("jkbs,abs->jkas", up, link.E)
            if through is None:  # the links before i do not move with joint i
                up = np.concatenate((up, np.zeros((1, *up.shape[1:]))))
            moved = np.ones(1) if through is None else through[i]
            turned = moved[:, None] * (share[i : i + 1] if through is None else share)
            up[-len(moved) :, 0 if arm.revolute[i] else 1] += arm.axis[i][:, None] * turned[:, None]
            out, (by_inertia, by_mass) = columns[: len(up), p * i : p * i + len(INERTIAL)], _link_matrices(link)
            # NumPy loops in memory order: with the summed axis next to the samples, the sum stays in the cache.
            np.einsum("jas,bas->jbs", up[:, 0], by_inertia, out=out[:, :6])
            np.einsum("jas,bas->jbs", up.reshape(len(up), 6, -1), by_mass, out=out[:, 6:])
        for j, k, values in _drive_columns(arm, dq_block, ddq_block):
            if j >= lowest:
                np.multiply(share[j], values, out=columns[j - lowest, k])
        yield block, columns[first - lowest :]


def _link_matrices(link: LinkMotion) -> tuple[Array, Array]:
    """Transposed matrices (6, 3, samples) of inertias to moment; of first moments, mass to wrench (4, 6, samples)."""
    (w, dw, a), L = link.vectors, link.L
    xy, xz, yz = w[0] * w[1], w[0] * w[2], w[1] * w[2]
    K = np.empty((6, 3, w.shape[1]))
    K[0, 0], K[0, 1], K[0, 2] = dw[0], xz, -xy
    K[1, 0], K[1, 1], K[1, 2] = -L[2, 0], L[2, 1], L[0, 0] - L[1, 1]
    K[2, 0], K[2, 1], K[2, 2] = L[1, 0], L[2, 2] - L[0, 0], -L[1, 2]
    K[3, 0], K[3, 1], K[3, 2] = -yz, dw[1], xy
    K[4, 0], K[4, 1], K[4, 2] = L[1, 1] - L[2, 2], -L[0, 1], L[0, 2]
    K[5, 0], K[5, 1], K[5, 2] = yz, -xz, dw[2]
    F = np.empty((4, 6, w.shape[1]))
    for b in range(3):
        F[b, b], F[b, (b + 2) % 3], F[b, (b + 1) % 3] = 0.0, a[(b + 1) % 3], -a[(b + 2) % 3]
        F[b, 3:] = L[:, b]
    F[3, :3], F[3, 3:] = 0.0, a
    return K, F
