"""Newton-Euler recursion over links, vectorised over samples, and the joint torques of known standard parameters.

The outward recursion gives the motion of each link in its own frame: w and dw its angular velocity and acceleration, a
the acceleration of its origin minus gravity. Relative to its origin, a link of inertia J, first moment MS and mass M
requires (d'Alembert's principle)

    force M a + dw x MS + w x (w x MS)      moment J dw + w x J w + MS x a

The inward recursion sums these of a joint's link and of all following links. Samples are on the last axis.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from ident.model.arm import Arm
from ident.model.parameters import INERTIAL, STANDARD
from ident.support.arrays import Array

BLOCK = 4096
"""Number of samples per block: limits the overhead of NumPy calls, and fits the processor's cache."""
ROUNDING = 1e-15
"""Size below which an entry of a rotation matrix is a rounding error of the model file's quaternion."""
Vector: TypeAlias = list[Array | float]
"""Three components, each of shape (samples,), or 0.0 if zero: these are skipped."""


def inverse_dynamics(arm: Arm, chi: Array, q: Array, dq: Array, ddq: Array) -> Array:
    """Return the torque of standard parameters, `regressor(arm, q, dq, ddq) @ chi`.

    Args:
        arm: The arm, n joints, c couplings.
        chi: Standard parameters, shape (14 n + 3 c,); names as in `parameters.labels`.
        q: Joint positions [rad or m], shape (N, n).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).

    Returns:
        Joint torques [N m] or forces [N], shape (N, n).
    """
    links = [_link_torques(arm, each, chi) for each in _blocks(arm, q, dq, ddq)]
    return np.vstack((np.empty((0, arm.n)), *links)) + drive_torques(arm, chi, dq, ddq)


@dataclass(slots=True)
class LinkMotion:
    """A link's pose in the preceding frame, and its motion in its own frame.

    Attributes:
        E: Rotation from the preceding frame to its own, (3, 3, samples).
        arrow: Its origin in the preceding frame.
        vectors: w, dw and a, (3, 3, samples).
        L: Matrix of x -> dw x x + w x (w x x), (3, 3, samples).
    """

    E: Array
    arrow: Vector
    vectors: Array
    L: Array


@dataclass(frozen=True, slots=True, eq=False)
class LinkMotions:
    """The motion of every link along that of an arm, for torques of many sets of parameters.

    Attributes:
        arm: The arm, n joints.
        dq: Joint velocities [rad/s or m/s], shape (N, n).
        ddq: Joint accelerations, shape (N, n).
        blocks: Links of each block of samples, from the base on.
    """

    arm: Arm
    dq: Array
    ddq: Array
    blocks: tuple[Sequence[LinkMotion], ...]

    @classmethod
    def of(cls, arm: Arm, q: Array, dq: Array, ddq: Array) -> "LinkMotions":
        """Of a motion, positions, velocities and accelerations of shape (N, n)."""
        return cls(arm, dq, ddq, tuple(_blocks(arm, q, dq, ddq)))

    def torques(self, chi: Array) -> Array:
        """As `inverse_dynamics` gives them, shape (N, n)."""
        links = [_link_torques(self.arm, each, chi) for each in self.blocks]
        return np.vstack(links) + drive_torques(self.arm, chi, self.dq, self.ddq)


def drive_torques(arm: Arm, chi: Array, dq: Array, ddq: Array) -> Array:
    """Return the torque of rotors, friction and offsets, a part of `inverse_dynamics`, shape (N, n)."""
    n, p = arm.n, len(STANDARD)
    Ia, Fv, Fc, off = (chi[STANDARD.index(name) : p * n : p] for name in ("Ia", "Fv", "Fc", "off"))
    torque = Ia * ddq + Fv * dq + Fc * np.sign(dq) + off
    for c, (first, second) in enumerate(arm.couplings):
        Iam, Fvm, Fcm = chi[p * n + 3 * c : p * n + 3 * c + 3]
        pair, other = [first, second], [second, first]
        both = Fcm * np.sign(dq[:, first] + dq[:, second])
        torque[:, pair] += Iam * ddq[:, other] + Fvm * dq[:, other] + both[:, None]
    return torque


def _blocks(arm: Arm, q: Array, dq: Array, ddq: Array) -> Iterator[Sequence[LinkMotion]]:
    for start in range(0, len(q), BLOCK):
        yield tuple(link_motions(arm, *(each[start : start + BLOCK].T for each in (q, dq, ddq))))


def link_motions(arm: Arm, q: Array, dq: Array, ddq: Array) -> Iterator[LinkMotion]:
    """Yield the motion of each link, from the base on; positions, velocities and accelerations are (n, samples)."""
    vectors, L = np.zeros((3, 3, q.shape[1])), np.zeros((3, 3, q.shape[1]))
    vectors[2] = -arm.gravity[:, None]
    for j in range(arm.n):
        E, arrow = joint_pose(arm, j, q[j])
        moved = vectors.copy()
        add_accelerated(moved[2], L, arrow)
        vectors = np.einsum("kbs,abs->kas", moved, E)
        w, dw, a = vectors
        if arm.revolute[j]:
            add_cross(dw, w, along(arm.axis[j], dq[j]))
        else:
            add_cross(a, w, along(arm.axis[j], 2.0 * dq[j]))
        for k in np.flatnonzero(arm.axis[j]):
            (dw if arm.revolute[j] else a)[k] += arm.axis[j, k] * ddq[j]
            if arm.revolute[j]:
                w[k] += arm.axis[j, k] * dq[j]
        L = _motion_matrix(w, dw)
        yield LinkMotion(E, arrow, vectors, L)


def joint_pose(arm: Arm, j: int, q: Array) -> tuple[Array, Vector]:
    """Return rotation from frame j - 1 to frame j, (3, 3, samples), and origin of frame j in frame j - 1.

    Entries of the rotation are constant + cosine cos(q) + sine sin(q) (Rodrigues); `q` has the shape (samples,).
    """
    arrow, turn = along(arm.translation[j], 1.0), np.zeros(len(q))
    if arm.revolute[j]:
        turn = q
    else:
        arrow = [x + y for x, y in zip(arrow, along(arm.rotation[j] @ arm.axis[j], q), strict=True)]
    axis, placed = (np.asarray(each[j], np.float64) for each in (arm.axis, arm.rotation))
    c, s, E = np.cos(turn), np.sin(turn), np.zeros((3, 3, len(q)))
    for row, column, constant, cosine, sine in _rotation_terms(axis.tobytes(), placed.tobytes()):
        if constant:
            E[row, column] += constant
        if cosine:
            E[row, column] += cosine * c
        if sine:
            E[row, column] += sine * s
    return E, arrow


@lru_cache(maxsize=256)  # for the joints of an arm
def _rotation_terms(of_axis: bytes, of_rotation: bytes) -> list[tuple[int, int, float, float, float]]:
    """Return row, column, constant, cosine and sine part of nonzero entries; with parallel axes, most are zero."""
    axis, rotation = np.frombuffer(of_axis), np.frombuffer(of_rotation).reshape(3, 3)
    x, y, z = axis
    back, kept = rotation.T, np.outer(axis, axis)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    terms = np.stack((kept @ back, (np.eye(3) - kept) @ back, -skew @ back))  # (3 terms, 3, 3)
    terms[np.abs(terms) < ROUNDING] = 0.0
    constant, cosine, sine = terms.tolist()
    entries = ((r, c, constant[r][c], cosine[r][c], sine[r][c]) for r in range(3) for c in range(3))
    return [entry for entry in entries if any(entry[2:])]


def along(direction: Array, amount: Array | float) -> Vector:
    """Return the components of `amount` along a constant direction."""
    return [float(x) * amount if x else 0.0 for x in direction]


def add_cross(out: Array, x: Array, y: Vector) -> None:
    """Add x cross y to `out`, shape (..., 3, samples)."""
    for k in range(3):
        if not isinstance(y[k], float) or y[k]:
            out[..., (k + 1) % 3, :] += x[..., (k + 2) % 3, :] * y[k]
            out[..., (k + 2) % 3, :] -= x[..., (k + 1) % 3, :] * y[k]


def add_accelerated(a: Array, L: Array, arrow: Vector) -> None:
    """Move the acceleration `a` of a point, shape (3, samples), along `arrow`."""
    for k in range(3):
        if not isinstance(arrow[k], float) or arrow[k]:
            a += L[:, k] * arrow[k]


def _motion_matrix(w: Array, dw: Array) -> Array:
    """Return the matrix of x -> dw x x + w x (w x x), shape (3, 3, samples)."""
    L = np.empty((3, *w.shape))
    square = w * w
    for k in range(3):
        b, c = (k + 1) % 3, (k + 2) % 3
        product = w[b] * w[c]
        L[k, k] = -(square[b] + square[c])
        L[c, b] = product + dw[k]
        L[b, c] = product - dw[k]
    return L


def _link_torques(arm: Arm, links: Sequence[LinkMotion], chi: Array) -> Array:
    """Return the torque of the links, shape (samples, n)."""
    samples = links[0].E.shape[2]
    torque, carried = np.empty((arm.n, samples)), np.zeros((2, 3, samples))
    for j, link in reversed(list(enumerate(links))):
        first = len(STANDARD) * j
        carried += _wrench(chi[first : first + len(INERTIAL)], link)
        torque[j] = arm.axis[j] @ carried[0 if arm.revolute[j] else 1]
        carried = np.einsum("kas,abs->kbs", carried, link.E)
        add_cross(carried[0], -carried[1], link.arrow)  # lever arm times force
    return torque.T


def _wrench(inertial: Array, link: LinkMotion) -> Array:
    """Return moment J dw + w x J w + MS x a about a link's origin, then force M a + L MS, (2, 3, samples)."""
    XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M = inertial
    J = np.array([[XX, XY, XZ], [XY, YY, YZ], [XZ, YZ, ZZ]])
    MS: Vector = [float(MX), float(MY), float(MZ)]
    w, dw, a = link.vectors
    wrench = np.stack((J @ dw, M * a))
    add_cross(wrench[0], w, list(J @ w))
    add_cross(wrench[0], -a, MS)
    add_accelerated(wrench[1], link.L, MS)
    return wrench
