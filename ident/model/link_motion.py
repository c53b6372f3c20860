"""Motion of one link from that of the preceding one, vectorised over samples; samples last."""

from functools import lru_cache
from typing import TypeAlias

import numpy as np

from ident.model.arm import Arm
from ident.support.arrays import Array

ROUNDING = 1e-15
"""Size below which an entry of a rotation matrix is a rounding error of the model file's quaternion."""

Term: TypeAlias = tuple[int, int, float, float, float]
"""Row and column of an entry of a rotation, then its constant, cosine and sine part."""
Vector: TypeAlias = list[Array | float]
"""Three components, each of shape (samples,), or 0.0 if zero."""


def along(direction: Array, amount: Array | float) -> Vector:
    """Return the components of `amount` along a constant direction; 0.0 for zero components, which are skipped."""
    return [float(x) * amount if x else 0.0 for x in direction]


def add_cross(out: Array, x: Array, y: Vector) -> None:
    """Add x cross y to `out`, shape (..., 3, samples), skipping the components of y that are 0.0."""
    for k in range(3):
        if not isinstance(y[k], float) or y[k]:
            out[..., (k + 1) % 3, :] += x[..., (k + 2) % 3, :] * y[k]
            out[..., (k + 2) % 3, :] -= x[..., (k + 1) % 3, :] * y[k]


def add_accelerated(a: Array, L: Array, arrow: Vector) -> None:
    """Move the acceleration `a` of a point, shape (3, samples), along `arrow`; L as `motion_matrix` returns it."""
    for k in range(3):
        if not isinstance(arrow[k], float) or arrow[k]:
            a += L[:, k] * arrow[k]


def lever(arm: Arm, j: int, q: Array) -> Vector:
    """Return the origin of frame j in frame j - 1 at positions q of joint j, shape (samples,)."""
    arrow = along(arm.translation[j], 1.0)
    if arm.revolute[j]:
        return arrow
    return [x + y for x, y in zip(arrow, along(arm.rotation[j] @ arm.axis[j], q), strict=True)]


def joint_rotation(arm: Arm, j: int, terms: list[Term], q: Array) -> Array:
    """Return the rotation from frame j - 1 to frame j at positions q of joint j, shape (3, 3, samples)."""
    return rotation(terms, q if arm.revolute[j] else np.zeros(len(q)))


def add_joint_motion(vectors: Array, arm: Arm, j: int, dq: Array, ddq: Array) -> None:
    """Add the motion of joint j to w, dw and a."""
    w, dw, a = vectors[:3]
    if arm.revolute[j]:
        add_cross(dw, w, along(arm.axis[j], dq))
        turned, accelerated = w, dw
    else:
        add_cross(a, w, along(arm.axis[j], 2.0 * dq))
        turned, accelerated = None, a
    for k in np.flatnonzero(arm.axis[j]):
        accelerated[k] += arm.axis[j, k] * ddq
        if turned is not None:
            turned[k] += arm.axis[j, k] * dq


def rotation_terms(arm: Arm, j: int) -> list[Term]:
    """Return entries of the rotation from frame j - 1 to frame j as constant + cosine cos(q) + sine sin(q) (Rodrigues).

    With parallel axes, the usual case, most entries and terms are zero; those below rounding are taken as zero too.
    """
    axis, turn = (np.asarray(each[j], np.float64) for each in (arm.axis, arm.rotation))
    return _rotation_terms(axis.tobytes(), turn.tobytes())


@lru_cache(maxsize=256)  # cached for the joints of an arm
def _rotation_terms(of_axis: bytes, of_rotation: bytes) -> list[Term]:
    axis, rotation = np.frombuffer(of_axis), np.frombuffer(of_rotation).reshape(3, 3)
    x, y, z = axis
    back, kept = rotation.T, np.outer(axis, axis)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    terms = np.stack((kept @ back, (np.eye(3) - kept) @ back, -skew @ back))  # (3 terms, 3, 3)
    terms[np.abs(terms) < ROUNDING] = 0.0
    constant, cosine, sine = terms.tolist()
    entries = ((r, c, constant[r][c], cosine[r][c], sine[r][c]) for r in range(3) for c in range(3))
    return [entry for entry in entries if any(entry[2:])]


def rotation(terms: list[Term], angle: Array) -> Array:
    """Return the rotation of `rotation_terms` at `angle`, shape (3, 3, samples)."""
    c, s = np.cos(angle), np.sin(angle)
    E = np.zeros((3, 3, len(angle)))
    for row, column, constant, cosine, sine in terms:
        if constant:
            E[row, column] += constant
        if cosine:
            E[row, column] += cosine * c
        if sine:
            E[row, column] += sine * s
    return E


def motion_matrix(w: Array, dw: Array) -> Array:
    """Return the matrix of x -> dw x x + w x (w x x), shape (3, 3, samples)."""
    L = np.empty((3, *w.shape))
    square = w * w
    for k in range(3):
        b, c = (k + 1) % 3, (k + 2) % 3
        product = w[b] * w[c]
        np.add(square[b], square[c], out=L[k, k])
        np.negative(L[k, k], out=L[k, k])
        np.add(product, dw[k], out=L[c, b])
        np.subtract(product, dw[k], out=L[b, c])
    return L
