"""Derivative of inverse dynamics with respect to displacements of the joints.

All quantities are in the base frame. The twist of a joint is S = (s, u), angular part first. Its derivative is dS = [V,
S], with V the twist of the preceding link, and ddS likewise. A joint's link and the following ones together have the
inertia J, first moment h and mass m, which form the inertia operator I from twist to momentum; the momentum p; the rate
B of their second moments; and the required wrench f. By virtual work the torque of joint j is S_j . f_j. With joint k
displaced by x, the following links have the additional acceleration D = S ddx + 2 dS dx + ddS x and angular velocity E
= s dx + ds x (`docs/derivations.md`):

    change of torque i = (I S_i) . D_k + 2 (B' s_i + p x u_i) . E_k                          joints i from k on
                       = S_i . (I D_k + 2 (B E_k, E_k x p) + x S_k x f_k)                    joints i before k
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg

from ident.model.arm import Arm
from ident.model.parameters import INERTIAL, STANDARD, labels, pseudo_inertia
from ident.model.regressor import drive_torques, joint_pose
from ident.support.arrays import Array


class States(NamedTuple):
    """Positions, velocities and accelerations of the joints."""

    q: Array  # positions [rad or m], shape (N, n)
    dq: Array  # velocities, shape (N, n)
    ddq: Array  # accelerations, shape (N, n)

    def of(self, piece: slice) -> "States":
        """The states of some samples."""
        return States(*(x[piece] for x in self))


@dataclass(frozen=True, slots=True, eq=False)
class Kinematics:
    """States of an arm without its masses; twists and accelerations have shape (n, 2, 3, N), angular part first."""

    arm: Arm
    pose: Array  # pose of each link's frame, shape (n, 3, 4, N)
    S: tuple[Array, Array, Array]  # twist of each joint, its rate of change, and the rate of change of that
    V: Array  # twist of each link
    A: Array  # rate of change of V, minus gravity

    @classmethod
    def of(cls, arm: Arm, states: States) -> "Kinematics":
        """Of a motion."""
        if (through := arm.to_joints) is not None:
            states = States(*(x @ through.T for x in states))
        pose = np.empty((arm.n, 3, 4, len(states.q)))
        for j, q in enumerate(states.q.T):
            E, arrow = joint_pose(arm, j, q)
            if j == 0:
                pose[j, :, :3] = E.swapaxes(0, 1)
                for k, x in enumerate(arrow):
                    pose[j, k, 3] = x
            else:
                pose[j, :, :3] = np.einsum("abs,cbs->acs", pose[j - 1, :, :3], E)
                pose[j, :, 3] = pose[j - 1, :, 3] + sum(pose[j - 1, :, k] * x for k, x in enumerate(arrow))
        S = np.zeros((arm.n, 2, 3, len(states.q)))
        axis = np.einsum("jabs,jb->jas", pose[:, :, :3], arm.axis)
        turns = np.asarray(arm.revolute, bool)
        S[turns, 0] = axis[turns]
        S[turns, 1] = _cross(pose[turns, :, 3], axis[turns])
        S[~turns, 1] = axis[~turns]
        dq, ddq = (each.T[:, None, None, :] for each in (states.dq, states.ddq))
        own = dq * S
        V = _from_base(own)
        before = V - own
        dS = _bracket(before, S)
        own = dq * dS + ddq * S
        A = _from_base(own)
        A[:, 1] -= arm.gravity[:, None]
        return cls(arm, pose, (S, dS, _bracket(A - own, S) + _bracket(before, dS)), V, A)


@dataclass(frozen=True, slots=True, eq=False)
class Dynamics:
    """Changes of the torques of an arm of n motors and known parameters along a motion, to first order."""

    arm: Arm
    # change of torque j per displacement of motor k, its rate and acceleration, without Coulomb friction, (3, n, n, N):
    by_motor: Array
    by_base: Array  # torque of each motor per acceleration of the base [m/s^2], shape (n, 3, N)
    by_length: Array  # change of torque j per relative change of the distance of frame k from the one before, (n, n, N)

    @classmethod
    def of(cls, moving: Kinematics, chi: Array) -> "Dynamics":
        """Of standard parameters, shape (14 n + 3 c,) for c couplings; names as in `parameters.labels`."""
        arm, n = moving.arm, moving.arm.n
        inertial = chi[: len(STANDARD) * n].reshape(n, -1)[:, : len(INERTIAL)]
        masses = pseudo_inertia(inertial)
        (S, dS, ddS), V, A = moving.S, moving.V, moving.A
        turned = masses[:, None] @ moving.pose  # (n, 3, 4, N)
        P, h, m = np.einsum("jacs,jbcs->jabs", turned, moving.pose), turned[:, :, 3], masses[:, 3, 3, None, None]
        J = _around(P)
        momentum = _momentum(J, h, m, V)
        B = np.einsum("jas,jbs->jabs", V[:, 1], h)
        for k in range(3):
            B[:, :, k] += _cross(V[:, 0], P[:, :, k])
        f = _momentum(J, h, m, A) + _moved(V, momentum)
        J, h, m, p, B, f = (_from_base(x[::-1])[::-1] for x in (J, h, m, momentum[:, 1], _around(B), f))

        def rate(w: Array) -> Array:
            """Wrench due to an additional angular velocity w: moment B w, force w x p."""
            return np.stack((np.einsum("jabs,jbs->jas", B, w), _cross(w, p)), axis=1)

        IS = _momentum(J, h, m, S)
        turning = np.einsum("jbas,jbs->jas", B, S[:, 0]) + _cross(p, S[:, 1])
        later = np.concatenate((IS, turning[:, None]), axis=1)  # times D_k and 2 E_k, by displacement and by rate
        D = np.stack((np.concatenate((ddS, 2.0 * dS[:, :1]), axis=1), 2.0 * np.concatenate((dS, S[:, :1]), axis=1)))
        by_x = _momentum(J, h, m, ddS) + 2.0 * rate(dS[:, 0]) + _moved(S, f)
        wrench = np.stack((by_x, 2.0 * (_momentum(J, h, m, dS) + rate(S[:, 0]))))
        change = np.empty((3, n, n, S.shape[-1]))
        for k in range(n):
            change[:2, k:, k] = np.einsum("jabs,oabs->ojs", later[k:], D[:, k])
            change[:2, :k, k] = np.einsum("jabs,oabs->ojs", S[:k], wrench[:, k])
            change[2, k, k:] = change[2, k:, k] = np.einsum("jabs,abs->js", IS[k:], S[k])
        by_base, by_length = IS[:, 1], np.zeros_like(change[0])
        for k in np.flatnonzero(arm.translation[1:].any(axis=1)) + 1:
            # the following links are elsewhere by x, which turns with the preceding link
            x, w, dw = np.einsum("abs,b->as", moving.pose[k - 1, :, :3], arm.translation[k]), V[k - 1, 0], A[k - 1, 0]
            a = _cross(dw, x) + _cross(w, _cross(w, x))
            by_length[k:, k] = np.einsum("jas,as->js", by_base[k:], a)
            moved = np.stack((_cross(h[k], a) + _cross(x, f[k, 1]), m[k] * a))
            by_length[:k, k] = np.einsum("jabs,abs->js", S[:k], moved)
        if (through := arm.to_joints) is not None:
            change = np.einsum("ji,lk,ojls->oiks", through, through, change, optimize=True)
            by_base, by_length = (np.einsum("ji,j...->i...", through, each) for each in (by_base, by_length))
        steady = [name.rstrip("0123456789") in ("Fc", "off", "Fcm") for name in labels(n, arm.couplings)]
        linear, each, none = np.where(steady, 0.0, chi), np.eye(n), np.zeros((n, n))
        change[1] += drive_torques(arm, linear, each, none).T[..., None]
        change[2] += drive_torques(arm, linear, none, each).T[..., None]
        return cls(arm, change, by_base, by_length)

    def displaced(self, further: States) -> Array:
        """Return the first-order change of torques by each motor's displacement [N m or N], shape (N, n, n).

        `further` has the displacements and their first and second time derivatives. Coulomb friction is not included.
        """
        x, dx, ddx = further.q.T, further.dq.T, further.ddq.T
        by_x, by_dx, by_ddx = self.by_motor
        return np.moveaxis(by_x * x + by_dx * dx + by_ddx * ddx, 2, 0)

    def misplaced(self) -> Array:
        """Change per error of each motor's zero, then per tilt of the base [N m/rad; N m/m], shape (N, n, n + 2)."""
        return np.concatenate((-np.moveaxis(self.by_motor[0], 2, 0), self.tilted()), axis=2)

    def tilted(self) -> Array:
        """Change per rotation of the base about each of `across` [N m / rad], shape (N, n, 2)."""
        # gravity rotates the other way, and acts as the opposite acceleration of the base
        return -np.einsum("jas,ka->sjk", self.by_base, np.cross(self.arm.gravity, across(self.arm)))

    def lengthened(self) -> Array:
        """Change per relative change of the distance of each joint's frame from the one before, shape (N, n, n)."""
        return np.moveaxis(self.by_length, 2, 0)


def across(arm: Arm) -> Array:
    """Two unit vectors perpendicular to gravity, shape (2, 3); none without gravity, shape (0, 3)."""
    return linalg.null_space(arm.gravity[None]).T if arm.gravity.any() else np.zeros((0, 3))


def _around(x: Array) -> Array:
    """Return tr(X) 1 - X of every 3 x 3 matrix: the inertia from second moments."""
    out = -x
    trace = np.einsum("jaas->js", x)
    for k in range(3):
        out[:, k, k] += trace
    return out


def _momentum(J: Array, h: Array, m: Array, motion: Array) -> Array:
    """Return moment J w + h x v and force w x h + m v."""
    w, v = motion[:, 0], motion[:, 1]
    out = m[:, None] * motion
    np.einsum("jabs,jbs->jas", J, w, out=out[:, 0])
    out[:, 0] += _cross(h, v)
    out[:, 1] += _cross(w, h)
    return out


def _moved(motion: Array, wrench: Array) -> Array:
    """Return the rate of change of a wrench that moves with a twist."""
    out = _cross(motion[:, :1], wrench)
    out[:, 0] += _cross(motion[:, 1], wrench[:, 1])
    return out


def _bracket(one: Array, other: Array) -> Array:
    """Return the rate of change of a twist that moves with another twist."""
    out = _cross(one[:, :1], other)
    out[:, 1] += _cross(one[:, 1], other[:, 0])
    return out


def _cross(x: Array, y: Array) -> Array:
    """Return the cross product along the second to last axis."""
    out = np.empty(np.broadcast_shapes(x.shape, y.shape))
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        np.multiply(x[..., a, :], y[..., b, :], out=out[..., k, :])
        out[..., k, :] -= x[..., b, :] * y[..., a, :]
    return out


def _from_base(x: Array) -> Array:
    """Return cumulative sums over joints."""
    total = x.copy()
    for j in range(1, len(x)):  # np.cumsum is slow along a first axis
        total[j] += total[j - 1]
    return total
