"""What the torques of an arm change by as one joint turns a little further: the derivative of inverse dynamics.

Everything stands in the base frame as matrices of homogeneous points x: a joint moves them by S x, a link has the
velocity V x and, less gravity, the acceleration A x, and the second moments P of its mass. By virtual work joint i
carries tr(S_i^T F_i), with F_i the sum of A P over its link and those beyond (`docs/derivations.md`).
"""

from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.pseudo_inertia import pseudo_inertia
from ident.model.arm import Arm
from ident.model.inverse_dynamics import drive_torques
from ident.model.link_motion import Term, joint_rotation, lever, rotation_terms
from ident.model.parameters import INERTIAL, STANDARD, labels
from ident.support.arrays import Array

BLOCK = 512
"""Samples handled at once: as many as the processor's cache holds the matrices of."""


@dataclass(frozen=True, slots=True)
class States:
    """Where joints are, and how they move.

    Attributes:
        q: Positions [rad or m], shape (N, n).
        dq: Velocities, shape (N, n).
        ddq: Accelerations, shape (N, n).
    """

    q: Array
    dq: Array
    ddq: Array

    def block(self, part: slice) -> "States":
        """Some of the samples, samples last, each (n, samples)."""
        return States(self.q[part].T, self.dq[part].T, self.ddq[part].T)


def displaced_torques(arm: Arm, chi: Array, states: States, further: States) -> Array:
    """Change of the joint torques, to first order, as one joint after the other moves a little further.

    Args:
        arm: The arm, n joints, c couplings.
        chi: Standard parameters, shape (14 n + 3 c,); names as in `parameters.labels`. Coulomb friction has no part.
        states: The motion.
        further: What is added to it: a displacement of each joint, and its first and second derivative by time.

    Returns:
        Change of each joint's torque by the displacement of each joint, shape (N, n, n), torque before displacement.
    """
    turns = [rotation_terms(arm, j) for j in range(arm.n)]
    masses = np.array([pseudo_inertia(each[: len(INERTIAL)]) for each in _of_links(arm, chi)])
    change = np.empty((*states.q.shape, arm.n))
    for start in range(0, len(change), BLOCK):
        part = slice(start, start + BLOCK)
        change[part] = _by_links(_links(arm, turns, masses, states.block(part)), further.block(part))
    steady = [name.rstrip("0123456789") in ("Fc", "off", "Fcm") for name in labels(arm.n, arm.couplings)]
    linear = np.where(steady, 0.0, chi)
    for k, only in enumerate(np.eye(arm.n)):
        change[:, :, k] += drive_torques(arm, linear, only * further.dq, only * further.ddq)
    return change


def _of_links(arm: Arm, chi: Array) -> Array:
    """Standard parameters, a row a link, shape (n, 14)."""
    return chi[: len(STANDARD) * arm.n].reshape(arm.n, len(STANDARD))


@dataclass(frozen=True, slots=True, eq=False)
class _Links:
    """Matrices of every joint and its link; those of motions and forces without their last row, which is zero.

    Attributes:
        S: How the joint moves points, shape (n, 3, 4, samples).
        dS: Rate of change of S, which the links before carry along.
        ddS: Rate of change of that.
        P: Second moments of the masses from the link on, shape (n, 4, 4, samples).
        H: Sum of V P over them, shape (n, 3, 4, samples).
        F: Sum of A P over them.
    """

    S: Array
    dS: Array
    ddS: Array
    P: Array
    H: Array
    F: Array


def _links(arm: Arm, turns: list[list[Term]], masses: Array, states: States) -> _Links:
    poses = _poses(arm, turns, states.q)
    S = np.array([_screw(arm, j, pose) for j, pose in enumerate(poses)])
    dq, ddq = (each[:, None, None, :] for each in (states.dq, states.ddq))
    V = _from_base(dq * S)
    before = V - dq * S
    dS = _bracket(before, S)
    added = dq * dS + ddq * S
    dV = _from_base(added)
    dV[:, :, 3] -= arm.gravity[:, None]
    ddS = _bracket(dV - added, S) + _bracket(before, dS)
    A = dV + _then(V, V)
    P = _turned(np.einsum("jabs,jbc->jacs", poses, masses), poses)
    H, F = _times(V, P), _times(A, P)
    return _Links(S, dS, ddS, *(_from_base(each[::-1])[::-1] for each in (P, H, F)))


def _poses(arm: Arm, turns: list[list[Term]], q: Array) -> Array:
    """Pose of each link's frame, shape (n, 4, 4, samples)."""
    step = np.zeros((arm.n, 4, 4, q.shape[1]))
    step[:, 3, 3] = 1.0
    for j in range(arm.n):
        step[j, :3, :3] = joint_rotation(arm, j, turns[j], q[j]).swapaxes(0, 1)
        for k, x in enumerate(lever(arm, j, q[j])):
            step[j, k, 3] = x
    poses = step
    for j in range(1, arm.n):
        poses[j] = np.einsum("abs,bcs->acs", poses[j - 1], step[j])
    return poses


def _screw(arm: Arm, j: int, pose: Array) -> Array:
    """S of joint j: its axis, turned by the pose, about the pose's origin or along it."""
    S = np.zeros((3, *pose.shape[1:]))
    axis = np.einsum("abs,b->as", pose[:3, :3], arm.axis[j])
    if not arm.revolute[j]:
        S[:, 3] = axis
        return S
    for k in range(3):
        S[(k + 2) % 3, (k + 1) % 3], S[(k + 1) % 3, (k + 2) % 3] = axis[k], -axis[k]
    S[:, 3] = -np.einsum("abs,bs->as", S[:, :3], pose[:3, 3])
    return S


def _by_links(links: _Links, further: States) -> Array:
    """Change of the torques of links, shape (samples, n, n).

    The links from the displaced joint k on are accelerated by D2 x + 2 D1 V x, with D1 and D2 the derivatives of the
    displacement times S_k. Joints before k besides feel that these links and their forces have moved.
    """
    x, dx, ddx = (each[:, None, None, :] for each in (further.q, further.dq, further.ddq))
    S, F = links.S, links.F
    D1, D2 = dx * S + x * links.dS, ddx * S + 2.0 * dx * links.dS + x * links.ddS
    D1 *= 2.0
    beyond = _pairs(_times(S, links.P), D2) + _pairs(_turned(S, links.H), D1[:, :, :3])
    force = _times(D2, links.P) + _then(D1, links.H)
    force += x * _then(S, F)
    force[:, :, :3] += x * _turned(F, S)
    return np.where(np.tri(len(S), dtype=bool), beyond, _pairs(S, force))


def _from_base(x: Array) -> Array:
    """Sums over each joint and those before it."""
    total = x.copy()
    for j in range(1, len(x)):  # np.cumsum is slow along a first axis
        total[j] += total[j - 1]
    return total


def _pairs(one: Array, other: Array) -> Array:
    """tr(X^T Y) of every pair of joints, shape (samples, n, n)."""
    return np.einsum("jabs,kabs->sjk", one, other)


def _times(motion: Array, P: Array) -> Array:
    """X P of every joint."""
    return np.einsum("jabs,jbcs->jacs", motion, P)


def _then(one: Array, other: Array) -> Array:
    """X Y of every joint, neither with a last row."""
    return np.einsum("jabs,jbcs->jacs", one[:, :, :3], other)


def _turned(one: Array, other: Array) -> Array:
    """X Y^T of every joint."""
    return np.einsum("jabs,jcbs->jacs", one, other)


def _bracket(one: Array, other: Array) -> Array:
    """X Y - Y X of every joint."""
    return _then(one, other) - _then(other, one)
