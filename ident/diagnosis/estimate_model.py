"""An estimate as a model of the currents: all joints together, with the payload as specified.

The rows, weights and columns of the estimate predict each time block from the others. Directions that are not
identifiable in the free model of the logs, such as the payload's centre, are compared here. The effect of each on the
gains follows from the influence of each row, that of large faults from another estimate; severity follows from it:

    error of g_j / g_j = -influence_j (C x) / (1 / g_j)        C x  currents that the direction adds
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.diagnosis.added import UNSEEN, Added, each_added
from ident.diagnosis.alternative import Direction, two_digits
from ident.diagnosis.comparison import (
    BLOCKS,
    Fits,
    FreeFit,
    HeldOut,
    Score,
    fits_of,
    held_out,
    held_out_beside,
    numbered_blocks,
)
from ident.diagnosis.diagnosis import Effect, Severity
from ident.diagnosis.free_model import row_counts
from ident.diagnosis.terms import payload_errors
from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain
from ident.estimation.problem import Problem
from ident.numerics.least_squares import column_space
from ident.support.arrays import Array

FINEST = 1e-3
"""Smallest relative standard deviation that effects are compared with: without noise any fault would refuse every
gain."""
Estimate = Callable[[Problem], GainEstimate]
"""Function that estimates gains from a problem."""
NAMED = 2
"""Largest number of joints whose effects a sentence names; of more, only the worst."""
NO_RESULT = 10.0
"""Relative error of a gain beyond which it is invalid."""


@dataclass(frozen=True, eq=False)
class Stated:
    """An estimate, prepared for held-out predictions.

    Attributes:
        problem: Motions and payloads.
        estimate: The estimate from them.
        solution: Its solution, or that of the same model with rigid joints.
        fits: The solution's rows as one part, in units of each joint's residual.
    """

    problem: Problem
    estimate: GainEstimate
    solution: GainSolution
    fits: Fits

    @property
    def _held(self) -> HeldOut:
        """The part with all its rows."""
        (held,) = self.fits.parts
        assert held is not None, "an estimate has more rows than unknowns"
        return held

    @cached_property
    def by_joint(self) -> Score:
        """Accuracy of the predictions of each joint's currents, as for fits of each joint alone."""
        held = self._held
        rows, n, blocks = self.solution.rows, self.problem.structure.arm.n, held.fit.blocks
        left = held.predicted(held.fit.residual[:, None]).reshape(-1)[held.place] / rows.weight
        squares, counts = np.zeros((n, blocks)), np.zeros((n, blocks))
        np.add.at(squares, (rows.joint, held.fit.block), left**2)
        np.add.at(counts, (rows.joint, held.fit.block), 1.0)
        return Score(squares, counts)

    @cached_property
    def payload_errors(self) -> tuple[Direction, ...]:
        """Errors of the specified payloads."""
        return tuple(payload_errors(self.problem, self.estimate))

    def stacked(self, columns: Sequence[Array | None]) -> Array:
        """Stack columns of each joint's rows in the order of the estimate, shape (R, m)."""
        rows = self.solution.rows
        width = next(each.shape[1] for each in columns if each is not None)
        parts = ((columns[j], rows.V[rows.of(j)]) for j in rows.unknowns)
        return np.vstack([np.zeros((len(V), width)) if each is None else each for each, V in parts])

    def weighted(self, direction: Direction) -> Direction:
        """A direction, converted to the rows of the estimate's fit, which is one part."""
        weight = self.solution.rows.weight[:, None]
        return replace(direction, columns=(weight * self.stacked(direction.columns),))

    def added(self, direction: Direction) -> Added | None:
        """Improvement by a direction; None if it is in the column space of the estimate."""
        return self.each_added([direction])[0]

    def each_added(self, directions: Sequence[Direction], worth: float = 0.0) -> list[Added | None]:
        """Improvement by each of many directions, each added alone; None also for less than `worth`."""
        return each_added(self.fits, [self.weighted(each).columns for each in directions], worth)

    def beside(self, direction: Direction) -> "Stated":
        """The same estimate with the direction added to its model."""
        held = self._held
        (columns,) = self.weighted(direction).columns
        assert columns is not None, "weighted"
        columns = column_space(columns)
        left = held.fit.without(columns)
        values, turn = np.linalg.eigh(columns.T @ left)  # with priors, less than left' left
        turn = turn[:, values > UNSEEN] / np.sqrt(values[values > UNSEEN])
        new = left @ turn
        residual = held.fit.residual - new @ (turn.T @ (columns.T @ held.fit.residual))
        return replace(self, fits=fits_of([held_out_beside(held, new, residual)]))

    def effects(self, currents: Array, beside: "Stated | None" = None) -> tuple[Effect, ...]:
        """Error of each gain due to currents that the model does not include.

        With another model than the estimate's, the error includes the difference of the gains.

        Args:
            currents: Currents added to the rows, shape (R,).
            beside: The estimate with them. Errors are compared with the standard deviation by its residual, as a fault
                also increases the residual.
        """
        own, solution = self.solution, self.estimate.solution
        moved = -(own.influence @ currents) / own.inverse
        moved += (1.0 + moved) * (own.inverse / solution.inverse - 1.0)
        place = {int(j): k for k, j in enumerate(own.joints)}
        return tuple(
            Effect(
                joint=j,
                percent=100.0 * float(moved[place[j]]),
                deviations=float(moved[place[j]]) / claimed(gain, 1.0 if beside is None else beside.left_of(j)),
            )
            for j, gain in enumerate(self.estimate.joints)
            if isinstance(gain, IdentifiedGain)
        )

    def left_of(self, joint: int) -> float:
        """Ratio of this model's residual to the estimate's, of a joint, from 0."""
        held = self._held
        rows, own = self.estimate.solution.rows, self.solution.rows.of(joint)
        left = held.fit.residual[own] / self.solution.rows.weight[own]
        before = float(np.linalg.norm(rows.residual[rows.of(joint)]))
        return min(1.0, float(np.linalg.norm(left)) / before) if before > 0.0 else 1.0


def stated(problem: Problem, estimate: GainEstimate, solution: GainSolution | None = None) -> Stated:
    """Prepare the held-out predictions of an estimate, or of another solution of the same joints."""
    solution = estimate.solution if solution is None else solution
    rows = solution.rows
    lengths = row_counts(problem)
    block = numbered_blocks(rows.motion, rows.position, lengths)
    fit = FreeFit(
        V=rows.weight * rows.V, residual=rows.weight * rows.residual, Q=rows.explained, block=block,
        blocks=BLOCKS * len(lengths), runs=tuple(rows.runs()),
    )  # fmt: skip
    return Stated(problem, estimate, solution, fits_of([held_out(fit)]))


def claimed(gain: IdentifiedGain, left: float = 1.0) -> float:
    """Estimated relative standard deviation of a gain, at least that of weighing a payload.

    Args:
        gain: The gain.
        left: Ratio of the residual to that of the estimate.
    """
    total = float(np.linalg.norm((left * gain.residual_std, gain.payload_std, gain.model_std)))
    return max(total / abs(gain.value), FINEST)


def severity_of(effects: Sequence[Effect]) -> Severity:
    """Return the severity of the largest effect."""
    if any(each.spoils for each in effects):
        return Severity.WRONG
    known = any(each.deviations is not None for each in effects)
    return Severity.GOOD if known and not any(each.matters for each in effects) else Severity.WEAK


def between(now: GainEstimate, other: GainEstimate) -> Iterator[Effect]:
    """Error of gains if the others are correct; unlimited for a gain in only one of them.

    It is in units of the smaller standard deviation, as a fault also increases the residual.
    """
    for j, (mine, theirs) in enumerate(zip(now.joints, other.joints, strict=True)):
        if isinstance(mine, IdentifiedGain) and isinstance(theirs, IdentifiedGain):
            share = float(np.clip(mine.value / theirs.value - 1.0, -NO_RESULT, NO_RESULT))
            yield Effect(joint=j, percent=100.0 * share, deviations=share / min(claimed(mine), claimed(theirs)))
        elif isinstance(mine, IdentifiedGain) or isinstance(theirs, IdentifiedGain):
            yield Effect(joint=j, percent=100.0 * NO_RESULT, deviations=NO_RESULT / now.options.max_rel_std)


def consequence(effects: Sequence[Effect], what: str = "gains") -> str:
    """Describe the errors of gains, their ratios or currents."""
    if not effects:
        return ""
    worst = max(effects, key=lambda each: abs(each.deviations or 0.0) or abs(each.percent))
    if worst.deviations is None:
        return f"; it explains {two_digits(worst.percent)} % of joint {worst.joint + 1}'s current"
    if abs(worst.percent) >= 100.0 * NO_RESULT:
        return f"; the gain of joint {worst.joint + 1} is invalid"
    listed = [each for each in effects if each.matters]
    if not listed:
        return "; no gain changes noticeably"
    rest = f" and {len(listed) - 1} more" if len(listed) > NAMED else ""
    listed = listed if not rest else [worst]
    more = ", ".join(f"joint {each.joint + 1} {two_digits(each.percent, sign='+')} %" for each in listed)
    return f"; {what} are off: {more}{rest}"
