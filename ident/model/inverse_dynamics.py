"""Joint torques of known standard parameters by the recursive Newton-Euler algorithm, without the regressor.

The outward recursion gives the required force of each link and the moment about its origin; the inward recursion sums
those of a joint's link and of all following links. Operations are vectorised over samples, in frames of the links.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ident.model.arm import Arm
from ident.model.link_motion import (
    Term,
    Vector,
    add_accelerated,
    add_cross,
    add_joint_motion,
    joint_rotation,
    lever,
    motion_matrix,
    rotation_terms,
)
from ident.model.parameters import INERTIAL, STANDARD
from ident.support.arrays import Array

BLOCK = 4096
"""Number of samples per block: limits the overhead of NumPy calls, and fits the processor's cache."""


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
    links = [_link_torques(arm, each, chi) for each in _moving_blocks(arm, q, dq, ddq)]
    return np.vstack((np.empty((0, arm.n)), *links)) + drive_torques(arm, chi, dq, ddq)


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
    blocks: tuple[list["_LinkMotion"], ...]

    @classmethod
    def of(cls, arm: Arm, q: Array, dq: Array, ddq: Array) -> "LinkMotions":
        """Of a motion, positions, velocities and accelerations of shape (N, n)."""
        return cls(arm, dq, ddq, tuple(_moving_blocks(arm, q, dq, ddq)))

    def torques(self, chi: Array) -> Array:
        """As `inverse_dynamics` gives them, shape (N, n)."""
        links = [_link_torques(self.arm, each, chi) for each in self.blocks]
        return np.vstack(links) + drive_torques(self.arm, chi, self.dq, self.ddq)


def drive_torques(arm: Arm, chi: Array, dq: Array, ddq: Array) -> Array:
    """Return the torque of rotors, friction and offsets, a part of `inverse_dynamics`.

    Args:
        arm: The arm, n joints, c couplings.
        chi: Standard parameters, shape (14 n + 3 c,).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).

    Returns:
        Shape (N, n).
    """
    n, p = arm.n, len(STANDARD)
    Ia, Fv, Fc, off = (chi[STANDARD.index(name) : p * n : p] for name in ("Ia", "Fv", "Fc", "off"))
    torque = Ia * ddq + Fv * dq + Fc * np.sign(dq) + off
    for c, (first, second) in enumerate(arm.couplings):
        Iam, Fvm, Fcm = chi[p * n + 3 * c : p * n + 3 * c + 3]
        pair, other = [first, second], [second, first]
        both = Fcm * np.sign(dq[:, first] + dq[:, second])
        torque[:, pair] += Iam * ddq[:, other] + Fvm * dq[:, other] + both[:, None]
    return torque


@dataclass(slots=True)
class _LinkMotion:
    """A link's pose in the preceding frame, and its motion in its own frame; samples last.

    Attributes:
        E: Rotation from the preceding frame to its own, (3, 3, samples).
        arrow: Its origin in the preceding frame.
        motion: w, dw and a, the acceleration of its origin minus gravity, (3, 3, samples).
        L: Matrix of x -> dw x x + w x (w x x), (3, 3, samples).
    """

    E: Array
    arrow: Vector
    motion: Array
    L: Array


def _moving_blocks(arm: Arm, q: Array, dq: Array, ddq: Array) -> Iterator[list[_LinkMotion]]:
    """Yield the links, from the base on, for each block of samples; motion has shape (N, n)."""
    turns = [rotation_terms(arm, j) for j in range(arm.n)]
    for start in range(0, len(q), BLOCK):
        yield _moving_links(arm, turns, *(each[start : start + BLOCK].T for each in (q, dq, ddq)))


def _moving_links(arm: Arm, turns: list[list[Term]], q: Array, dq: Array, ddq: Array) -> list[_LinkMotion]:
    """Return the links, from the base on; motion has shape (n, samples)."""
    samples, links = q.shape[1], list[_LinkMotion]()
    motion = np.zeros((3, 3, samples))
    motion[2] = -arm.gravity[:, None]
    L = np.zeros((3, 3, samples))
    for j in range(arm.n):
        arrow, E = lever(arm, j, q[j]), joint_rotation(arm, j, turns[j], q[j])
        motion = motion.copy()
        add_accelerated(motion[2], L, arrow)
        motion = np.einsum("kbs,abs->kas", motion, E)
        add_joint_motion(motion, arm, j, dq[j], ddq[j])
        L = motion_matrix(motion[0], motion[1])
        links.append(_LinkMotion(E, arrow, motion, L))
    return links


def _link_torques(arm: Arm, links: Sequence[_LinkMotion], chi: Array) -> Array:
    """Return the torque of the links, shape (samples, n)."""
    samples = links[0].E.shape[2]
    torque, carried = np.empty((arm.n, samples)), np.zeros((2, 3, samples))
    for j, link in reversed(list(enumerate(links))):
        first = len(STANDARD) * j
        carried += _wrench(chi[first : first + len(INERTIAL)], link.motion, link.L)
        torque[j] = arm.axis[j] @ carried[0 if arm.revolute[j] else 1]
        carried = np.einsum("kas,abs->kbs", carried, link.E)
        add_cross(carried[0], -carried[1], link.arrow)  # lever arm times force
    return torque.T


def _wrench(inertial: Array, motion: Array, L: Array) -> Array:
    """Return moment J dw + w x J w + MS x a about a link's origin, then force M a + L MS, (2, 3, samples)."""
    XX, XY, XZ, YY, YZ, ZZ, MX, MY, MZ, M = inertial
    J, MS = np.array([[XX, XY, XZ], [XY, YY, YZ], [XZ, YZ, ZZ]]), np.array([MX, MY, MZ])
    w, dw, a = motion
    wrench = np.stack((J @ dw, M * a))
    add_cross(wrench[0], w, list(J @ w))
    add_cross(wrench[0], -a, MS.tolist())
    add_accelerated(wrench[1], L, MS.tolist())
    return wrench
