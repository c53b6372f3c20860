"""Joint torques of known standard parameters by the recursive Newton-Euler algorithm, without the regressor.

The outward recursion gives the required force of each link and the moment about its origin; the inward recursion sums
those of a joint's link and of all following links. Operations are vectorised over samples, in frames of the links.
"""

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
    torque = np.empty_like(q)
    turns = [rotation_terms(arm, j) for j in range(arm.n)]
    for start in range(0, len(q), BLOCK):
        block = slice(start, start + BLOCK)
        torque[block] = _link_torques(arm, turns, chi, q[block].T, dq[block].T, ddq[block].T).T
    return torque + drive_torques(arm, chi, dq, ddq)


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
class _Link:
    """A link's pose in the preceding frame, and its required wrench in its own frame; samples last.

    Attributes:
        E: Rotation from the preceding frame to its own, (3, 3, samples).
        arrow: Its origin in the preceding frame.
        wrench: Moment about its origin, then force, (2, 3, samples).
    """

    E: Array
    arrow: Vector
    wrench: Array


def _link_torques(arm: Arm, turns: list[list[Term]], chi: Array, q: Array, dq: Array, ddq: Array) -> Array:
    """Return the torque of the links; motion and result have shape (n, samples)."""
    torque = np.empty_like(q)
    carried = np.zeros((2, 3, q.shape[1]))
    for j, link in reversed(list(enumerate(_links(arm, turns, chi, q, dq, ddq)))):
        carried += link.wrench
        torque[j] = arm.axis[j] @ carried[0 if arm.revolute[j] else 1]
        carried = np.einsum("kas,abs->kbs", carried, link.E)
        add_cross(carried[0], -carried[1], link.arrow)  # lever arm times force
    return torque


def _links(arm: Arm, turns: list[list[Term]], chi: Array, q: Array, dq: Array, ddq: Array) -> list[_Link]:
    """Yield the links, from the base on."""
    samples, links = q.shape[1], list[_Link]()
    motion = np.zeros((3, 3, samples))  # w, dw, and a, the acceleration of the origin minus gravity
    motion[2] = -arm.gravity[:, None]
    L = np.zeros((3, 3, samples))
    for j in range(arm.n):
        arrow, E = lever(arm, j, q[j]), joint_rotation(arm, j, turns[j], q[j])
        add_accelerated(motion[2], L, arrow)
        motion = np.einsum("kbs,abs->kas", motion, E)
        add_joint_motion(motion, arm, j, dq[j], ddq[j])
        L = motion_matrix(motion[0], motion[1])
        first = len(STANDARD) * j
        links.append(_Link(E, arrow, _wrench(chi[first : first + len(INERTIAL)], motion, L)))
    return links


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
