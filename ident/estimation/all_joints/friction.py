"""The columns of a joint's own friction and offset, in current units."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.support.arrays import Array, Mask

DEPENDENT = 1e-7
"""Smallest norm of the new part of a unit column that counts as independent."""


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A further column of a joint's own friction.

    Attributes:
        column: Shape (r,).
        mean: Prior mean of its coefficient.
        std: Prior standard deviation, infinite without a prior.
    """

    column: Array
    mean: float = 0.0
    std: float = float("inf")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnColumns:
    """F of one joint.

    Attributes:
        names: Name of each column, f strings; "Fv" and "Fc" occur once per motion if they differ between motions.
        motion: Motion of each column, -1 for all, f numbers.
        F: The columns, shape (r, f).
        mean: Prior mean of each coefficient, shape (f,).
        std: Prior standard deviation, infinite without a prior, shape (f,).
    """

    names: tuple[str, ...]
    motion: tuple[int, ...]
    F: Array
    mean: Array
    std: Array

    @property
    def believed(self) -> Mask:
        """Mask of the columns with a prior, shape (f,)."""
        return np.isfinite(self.std)


def own_columns(joint: JointColumns, terms: dict[str, Term], *, per_motion: bool) -> OwnColumns:
    """Return the columns of offset, viscous and Coulomb friction of a joint, and of further terms.

    Args:
        joint: Its rows.
        terms: Further ones by name.
        per_motion: Whether viscous and Coulomb friction differ between motions.

    Returns:
        The columns that are independent of earlier ones on these rows.
    """
    names, parts = _plain_columns(joint, per_motion=per_motion)
    names += ((name, -1) for name in terms)
    parts += terms.values()
    F = np.column_stack([part.column for part in parts]) if parts else np.zeros((len(joint.V), 0))
    chosen = _independent(F, _known(joint, names, F))
    return OwnColumns(
        names=tuple(names[k][0] for k in chosen),
        motion=tuple(names[k][1] for k in chosen),
        F=F[:, chosen],
        mean=np.array([parts[k].mean for k in chosen]),
        std=np.array([parts[k].std for k in chosen]),
    )


def _plain_columns(joint: JointColumns, *, per_motion: bool) -> tuple[list[tuple[str, int]], list[Term]]:
    """Friction and offset of a joint: name and motion of each column, -1 for all motions, and the columns."""
    motions: Sequence[int] = np.unique(joint.motion).tolist()
    names, parts = list[tuple[str, int]](), list[Term]()
    for name, column in joint.own.items():
        for which in motions if per_motion and name != "off" else [-1]:
            names.append((name, which))
            parts.append(Term(column if which < 0 else np.where(joint.motion == which, column, 0.0)))
    return names, parts


def _known(joint: JointColumns, names: Sequence[tuple[str, int]], F: Array) -> tuple[list[int], Array, int]:
    """Columns known to be independent, an orthonormal basis of them, and the number of columns tested."""
    base = joint.base
    if base is None or not set(base.own) <= set(names):
        return [], F[:, :0], 0
    chosen = [names.index(each) for each in base.own]
    plain = sum(1 for name, _ in names if name in joint.own)
    return chosen, base.Q[:, : len(chosen)], plain


def _independent(F: Array, known: tuple[list[int], Array, int]) -> list[int]:
    """Return the columns that are independent of all earlier ones, in order.

    A prior belongs to a column's coefficient, so of two equal columns the earlier one, without a prior, is kept.
    """
    chosen, Q, first = known
    norms = np.linalg.norm(F, axis=0)
    for k in range(first, F.shape[1]):
        if norms[k] > DEPENDENT * norms.max():
            new = F[:, k] / norms[k]
            for _ in range(2):  # the second pass removes rounding errors of the first
                new = new - Q @ (Q.T @ new)
            size = float(np.linalg.norm(new))
            if size > DEPENDENT:
                chosen, Q = [*chosen, k], np.column_stack((Q, new / size))
    return chosen
