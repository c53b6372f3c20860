"""The columns of a joint's own friction and offset, in current units."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.all_joints.columns import JointColumns
from ident.arrays import Array
from ident.base import independent_columns

DEPENDENT = 1e-7
"""Part of a unit column that must be new on the rows at hand."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OwnColumns:
    """F of one joint.

    Attributes:
        names: What each column is, f strings; "Fv" and "Fc" come once a motion where they are its own.
        F: The columns, shape (r, f).
    """

    names: tuple[str, ...]
    F: Array


def own_columns(joint: JointColumns, extra: dict[str, Array], *, per_motion: bool) -> OwnColumns:
    """Offset, viscous and Coulomb friction of a joint, and further columns.

    Args:
        joint: Its rows.
        extra: Further columns by name, shape (r,) each.
        per_motion: Whether viscous and Coulomb friction differ between motions.

    Returns:
        Those of the columns that are independent on these rows, earlier ones first.
    """
    motions = np.unique(joint.motion)
    names, columns = list[str](), list[Array]()
    for name, column in joint.own.items():
        apart: Sequence[Array] = (
            [np.where(joint.motion == motion, column, 0.0) for motion in motions]
            if per_motion and name != "off"
            else [column]
        )
        names += [name] * len(apart)
        columns += apart
    names += extra
    columns += extra.values()
    F = np.column_stack(columns) if columns else np.zeros((len(joint.V), 0))
    seen = np.flatnonzero(F.any(axis=0))
    chosen = np.sort(seen[independent_columns(F[:, seen], [np.arange(len(seen))], DEPENDENT)]) if len(seen) else seen
    return OwnColumns(names=tuple(names[k] for k in chosen), F=F[:, chosen])
