"""What a part of the rows says about the gains, beside all of them; without another search.

Near its end a fit is linear: weighted rows `y = Q z`, Q orthonormal together with the rows of what is believed
beforehand, 1/g = l' z up to a constant. A part P of the rows, with the beliefs, has the normal matrix
G = 1 - Q_o' Q_o, o the rows left out, and moves z by -G^-1 Q_o' e_o, e the weighted residual. What noise of the
currents does to that difference is G^-1 Q_P' on the rows of the part, less Q' on all (Hausman 1978;
`docs/derivations.md`). A quantity that the part does not show lies outside the range of G.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ident.arrays import Array, Indices, Mask
from ident.estimate import GainSolution
from ident.rows import Rows

UNSEEN = 1e-7
"""Eigenvalue of G under which a part does not show a direction: 1 is all that all rows together know."""
SHOWN = 1e-3
"""Part of a quantity that may lie in such directions."""
LINEAR = 1e-6
"""Relative part of the influence that a fit by least squares cannot explain; instruments and total least squares do."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearFit:
    """A solution as the linear least squares fit that it is near its end.

    Attributes:
        solution: The solution.
        along: l of each 1/g, shape (k, u).
        group: Twice the joint of each row, and one more in the second half of its motion, shape (r,).
        gram: Q' Q of each group, shape (groups, u, u).
        pull: Q' e of each group, shape (groups, u).
    """

    solution: GainSolution
    along: Array
    group: Indices
    gram: Array
    pull: Array


@dataclass(frozen=True, slots=True, eq=False)
class PartChange:
    """How one 1/g changes if part of the rows alone is fitted.

    Attributes:
        value: Its change.
        influence: Derivative of that by the current of each row, shape (r,).
    """

    value: float
    influence: Array


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """What part of the rows alone says.

    Attributes:
        changes: Of those 1/g that it shows, by place in the solution.
        residual: What its own fit leaves of its rows [drive units], zero for the others, shape (r,).
    """

    changes: dict[int, PartChange]
    residual: Array


def linear_fit(solution: GainSolution) -> LinearFit | None:
    """The linear fit behind a solution; None if it is not one of least squares."""
    rows, Q = solution.rows, solution.rows.explained
    group = 2 * rows.joint + _second_half(rows)
    number, u = (int(group.max()) + 1 if len(group) else 0), Q.shape[1]
    gram, pull = np.zeros((number, u, u)), np.zeros((number, u))
    residual = rows.weight * rows.residual
    for g in np.unique(group):
        at = np.flatnonzero(group == g)
        own = Q[at]
        gram[g], pull[g] = own.T @ own, own.T @ residual[at]
    by_weighted = solution.influence / rows.weight
    along = linalg.solve(gram.sum(axis=0), (by_weighted @ Q).T, assume_a="pos", check_finite=False).T
    if np.linalg.norm(along @ Q.T - by_weighted) > LINEAR * np.linalg.norm(by_weighted):
        return None
    return LinearFit(solution, along, group, gram, pull)


def part_of(fit: LinearFit, kept: Mask, which: Sequence[int]) -> Part:
    """What the groups that are kept say beside all of them.

    Args:
        fit: The linear fit.
        kept: Which groups, shape (groups,).
        which: Places of the 1/g in the solution.
    """
    rows = fit.solution.rows
    size, directions = linalg.eigh(np.eye(fit.gram.shape[1]) - fit.gram[~kept].sum(axis=0), check_finite=False)
    seen = size > UNSEEN
    inside = fit.along[list(which)] @ directions
    lost = np.linalg.norm(inside[:, ~seen], axis=1) > SHOWN * np.linalg.norm(inside, axis=1)
    through = (inside[:, seen] / size[seen]) @ directions[:, seen].T  # l' G^+
    within = inside[:, seen] @ directions[:, seen].T
    own = np.flatnonzero(kept[fit.group])
    by_weighted = -within @ rows.explained.T
    by_weighted[:, own] += through @ rows.explained[own].T
    pull = fit.pull[~kept].sum(axis=0)
    value = -through @ pull
    moved = -directions[:, seen] @ ((directions[:, seen].T @ pull) / size[seen])  # of z
    residual = np.zeros(len(rows.V))
    residual[own] = rows.residual[own] - (rows.explained[own] @ moved) / rows.weight[own]
    changes = {
        k: PartChange(float(value[place]), by_weighted[place] * rows.weight)
        for place, k in enumerate(which)
        if not lost[place]
    }
    return Part(changes, residual)


def _second_half(rows: Rows) -> Indices:
    """0 for rows of the first half of their motion, 1 for those of the second, shape (r,)."""
    half = np.zeros(len(rows.V), dtype=np.intp)
    for motion in np.unique(rows.motion):
        own = rows.motion == motion
        at = rows.position[own]
        half[own] = 2 * at > at.min() + at.max()
    return half
