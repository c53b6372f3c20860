"""The vectorised inverse dynamic regressor: joint torque is linear in the standard parameters (paper, eq. 9).

In the frame of link i, with w, dw and a its motion (`inverse_dynamics`), and u, p the angular velocity of link i and
the velocity of its origin for unit speed of joint j, the torque of joint j is

    tau_j = p . (M a + dw x MS + w x (w x MS)) + u . (J dw + w x J w + MS x a)

The brackets are linear in J = (XX .. ZZ), MS = (MX, MY, MZ) and M; `_link_columns` has them as matrices.
"""

from collections.abc import Iterator

import numpy as np

from ident.model.arm import Arm
from ident.model.inverse_dynamics import LinkMotion, add_cross, link_motions
from ident.model.parameters import INERTIAL, STANDARD, labels
from ident.support.arrays import Array

BLOCK = 2048
"""Number of samples per block: limits the overhead of NumPy calls, and fits the processor's cache."""


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
    arm: Arm, q: Array, dq: Array, ddq: Array, *, weight: Array | None = None, size: int = BLOCK
) -> Iterator[tuple[slice, Array]]:
    """Yield the regressor block by block, samples last, for processing without storing it.

    Args:
        arm: The arm, n joints.
        q: Joint positions [rad or m], shape (N, n).
        dq: Joint velocities, shape (N, n).
        ddq: Joint accelerations, shape (N, n).
        weight: Factor of each joint's row at each sample, shape (N, n); None for 1. It takes little time here, because
            a row is linear in the unit speed of its joint.
        size: Number of samples of a block.

    Yields:
        The slice of samples, and their columns, shape (n, 14 n + 3 c, samples of the block). The array is
        overwritten by the next block.
    """
    n, p = arm.n, len(STANDARD)
    buffer = np.zeros((n, len(labels(n, arm.couplings)), size))
    weight = np.ones_like(q) if weight is None else weight
    rows = np.arange(n)
    for start in range(0, len(q), size):
        block = slice(start, min(start + size, len(q)))
        columns = buffer[..., : block.stop - start]
        dq_block, ddq_block, share = dq[block].T, ddq[block].T, weight[block].T  # (n, samples)
        up = np.empty((0, 2, 3, len(share.T)))  # u and p of each joint up to link i, times its weight
        for i, link in enumerate(link_motions(arm, q[block].T, dq_block, ddq_block)):
            add_cross(up[:, 1], up[:, 0], link.arrow)
            own = np.zeros((1, *up.shape[1:]))
            own[0, 0 if arm.revolute[i] else 1] = arm.axis[i][:, None] * share[i]
            up = np.concatenate((np.einsum("jkbs,abs->jkas", up, link.E), own))
            _link_columns(link, up, columns[: i + 1, p * i : p * i + len(INERTIAL)])
        columns[rows, p * rows + STANDARD.index("Ia")] = share * ddq_block
        columns[rows, p * rows + STANDARD.index("Fv")] = share * dq_block
        columns[rows, p * rows + STANDARD.index("Fc")] = share * np.sign(dq_block)
        columns[rows, p * rows + STANDARD.index("off")] = share
        for c, (first, second) in enumerate(arm.couplings):
            Iam, Fvm, Fcm = range(p * n + 3 * c, p * n + 3 * c + 3)
            pair, other = [first, second], [second, first]
            columns[pair, Iam] = share[pair] * ddq_block[other]
            columns[pair, Fvm] = share[pair] * dq_block[other]
            columns[pair, Fcm] = share[pair] * np.sign(dq_block[first] + dq_block[second])
        yield block, columns


def _link_columns(link: LinkMotion, up: Array, out: Array) -> None:
    """Write the ten inertial columns of one link into `out`, shape (joints up to it, 10, samples)."""
    w, dw, a = link.vectors
    # NumPy loops in memory order: with the summed axis next to the samples, the sum stays in the cache.
    np.einsum("jas,bas->jbs", up[:, 0], _inertia_matrix(w, dw, link.L), out=out[:, :6])
    np.einsum("jas,bas->jbs", up.reshape(len(up), 6, -1), _mass_matrix(a, link.L), out=out[:, 6:])


def _inertia_matrix(w: Array, dw: Array, L: Array) -> Array:
    """Transposed matrix of (XX, XY, XZ, YY, YZ, ZZ) -> J dw + w x J w, shape (6, 3, samples)."""
    xy, xz, yz = w[0] * w[1], w[0] * w[2], w[1] * w[2]
    K = np.empty((6, 3, w.shape[1]))
    K[0, 0], K[0, 1], K[0, 2] = dw[0], xz, -xy
    K[1, 0], K[1, 1], K[1, 2] = -L[2, 0], L[2, 1], L[0, 0] - L[1, 1]
    K[2, 0], K[2, 1], K[2, 2] = L[1, 0], L[2, 2] - L[0, 0], -L[1, 2]
    K[3, 0], K[3, 1], K[3, 2] = -yz, dw[1], xy
    K[4, 0], K[4, 1], K[4, 2] = L[1, 1] - L[2, 2], -L[0, 1], L[0, 2]
    K[5, 0], K[5, 1], K[5, 2] = yz, -xz, dw[2]
    return K


def _mass_matrix(a: Array, L: Array) -> Array:
    """Transposed matrix of (MX, MY, MZ, M) -> moment MS x a, then force M a + L MS, shape (4, 6, samples)."""
    F = np.empty((4, 6, a.shape[1]))
    for b in range(3):
        F[b, b], F[b, (b + 2) % 3], F[b, (b + 1) % 3] = 0.0, a[(b + 1) % 3], -a[(b + 2) % 3]
        F[b, 3:] = L[:, b]
    F[3, :3], F[3, 3:] = 0.0, a
    return F
