"""The columns of a joint's own friction and offset, in current units."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.estimation.all_joints.columns import JointColumns
from ident.model.base import independent_columns
from ident.support.arrays import Array, Mask

DEPENDENT = 1e-7
"""Part of a unit column that must be new on the rows at hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A further column of a joint's own friction.

    Attributes:
        column: Shape (r,).
        mean: Of its coefficient, as believed beforehand.
        std: Deviation of that belief, infinite for none.
    """

    column: Array
    mean: float = 0.0
    std: float = float("inf")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnColumns:
    """F of one joint.

    Attributes:
        names: What each column is, f strings; "Fv" and "Fc" come once a motion where they are its own.
        motion: Motion of each column, -1 for all, f numbers.
        F: The columns, shape (r, f).
        mean: What is believed of each coefficient beforehand, shape (f,).
        std: Deviation of that belief, infinite for none, shape (f,).
    """

    names: tuple[str, ...]
    motion: tuple[int, ...]
    F: Array
    mean: Array
    std: Array

    @property
    def believed(self) -> Mask:
        """Columns with a belief, shape (f,)."""
        return np.isfinite(self.std)


def own_columns(joint: JointColumns, terms: dict[str, Term], *, per_motion: bool) -> OwnColumns:
    """Offset, viscous and Coulomb friction of a joint, and further terms.

    Args:
        joint: Its rows.
        terms: Further ones by name.
        per_motion: Whether viscous and Coulomb friction differ between motions.

    Returns:
        Those of the columns that are independent on these rows, earlier ones first.
    """
    motions: Sequence[int] = np.unique(joint.motion).tolist()
    names, motion, parts = list[str](), list[int](), list[Term]()
    for name, column in joint.own.items():
        for which in motions if per_motion and name != "off" else [-1]:
            names.append(name)
            motion.append(which)
            parts.append(Term(column if which < 0 else np.where(joint.motion == which, column, 0.0)))
    names += terms
    motion += [-1] * len(terms)
    parts += terms.values()
    F = np.column_stack([part.column for part in parts]) if parts else np.zeros((len(joint.V), 0))
    seen = np.flatnonzero(F.any(axis=0))
    chosen = np.sort(seen[independent_columns(F[:, seen], [np.arange(len(seen))], DEPENDENT)]) if len(seen) else seen
    return OwnColumns(
        names=tuple(names[k] for k in chosen),
        motion=tuple(motion[k] for k in chosen),
        F=F[:, chosen],
        mean=np.array([parts[k].mean for k in chosen]),
        std=np.array([parts[k].std for k in chosen]),
    )
