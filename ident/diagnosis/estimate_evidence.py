"""An estimate as a model of the currents, which predicts each time block from the others.

All joints together, with the rows, weights and columns of the estimate and the payload as specified. Small alternatives
that are not identifiable in the free model of the logs, such as the payload's centre, are compared here. Their effect
on the gains follows from the influence of each row:

    error of g_j / g_j = -influence_j (C x) / (1 / g_j)        C x  currents that the direction adds
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.diagnosis.diagnosis import Effect
from ident.diagnosis.effects import claimed
from ident.diagnosis.evidence import BLOCKS, TOGETHER, UNSEEN, Evidence, Fits, FreeFit, Score, each_added, fits_of
from ident.diagnosis.hypothesis import Alternative
from ident.diagnosis.models import numbered_blocks
from ident.diagnosis.terms import payload_errors
from ident.estimation.estimate import GainEstimate, GainSolution
from ident.estimation.problem import Problem
from ident.numerics.least_squares import column_space
from ident.support.arrays import Array

LINEAR = 1e-6
"""Relative part of the influence outside the column space; larger for instruments and total least squares than for
least squares."""


@dataclass(frozen=True, eq=False)
class HeldOutEstimate:
    """An estimate, prepared for held-out predictions."""

    problem: Problem  # motions and payloads
    estimate: GainEstimate  # the estimate from them
    solution: GainSolution  # its solution, or that of the same model with rigid joints
    fit: FreeFit  # the solution's rows of all joints, in units of each joint's residual

    @cached_property
    def fits(self) -> Fits:
        """The fit, prepared for comparisons."""
        return fits_of([self.fit])

    @cached_property
    def by_joint(self) -> Score:
        """Accuracy of the predictions of each joint's currents, as for fits of each joint alone."""
        fit, rows = self.fit, self.solution.rows
        n, blocks = self.problem.structure.arm.n, fit.blocks
        left = fit.predicted(fit.residual[:, None]).reshape(-1)[fit.place] / rows.weight
        squares, counts = np.zeros((n, blocks)), np.zeros((n, blocks))
        np.add.at(squares, (rows.joint, fit.block), left**2)
        np.add.at(counts, (rows.joint, fit.block), 1.0)
        return Score(squares, counts)

    @cached_property
    def payload_errors(self) -> tuple[Alternative, ...]:
        """Errors of the specified payloads."""
        return tuple(payload_errors(self.problem, self.estimate))

    def stacked(self, columns: Sequence[Array | None]) -> Array:
        """Stack columns of each joint's rows in the order of the estimate, shape (R, m)."""
        rows = self.solution.rows
        width = next(each.shape[1] for each in columns if each is not None)
        parts = ((columns[j], rows.V[rows.of(j)]) for j in rows.unknowns)
        return np.vstack([np.zeros((len(V), width)) if each is None else each for each, V in parts])

    def weighted(self, direction: Alternative) -> Array:
        """Columns of a direction on the rows of the estimate's fit, shape (R, m)."""
        return self.solution.rows.weight[:, None] * self.stacked(direction.columns)

    @cached_property
    def _known(self) -> dict[tuple[Alternative, float], Evidence | None]:
        """Improvements that were computed before."""
        return {}

    def each_added(self, directions: Sequence[Alternative], worth: float = 0.0) -> list[Evidence | None]:
        """Improvement by each of many directions, each added alone; None also for less than `worth`."""
        new = [each for each in directions if (each, worth) not in self._known]
        count = max(1, 4 * TOGETHER // len(self.fit.V))  # long columns are only made when they are compared
        for some in (new[start : start + count] for start in range(0, len(new), count)):
            found = each_added(self.fits, [(self.weighted(each),) for each in some], worth)
            self._known.update(((each, worth), more) for each, more in zip(some, found, strict=True))
        return [self._known[each, worth] for each in directions]

    def beside(self, direction: Alternative) -> "HeldOutEstimate":
        """The same estimate with the direction added to its model."""
        fit, columns = self.fit, column_space(self.weighted(direction))
        left = fit.without(columns)
        values, turn = np.linalg.eigh(columns.T @ left)  # with priors, less than left' left
        turn = turn[:, values > UNSEEN] / np.sqrt(values[values > UNSEEN])
        new = left @ turn
        residual = fit.residual - new @ (turn.T @ (columns.T @ fit.residual))
        return replace(self, fit=replace(fit, residual=residual, Q=fit.Q.beside(new)))

    def effects(
        self, currents: Array, beside: "HeldOutEstimate | None" = None, corrected: GainEstimate | None = None
    ) -> tuple[Effect, ...]:
        """Error of each gain due to currents (R,) that the model does not include, and by the difference of the models.

        Errors are in standard deviations by the residual of the model `beside` with these currents, as a fault also
        increases the residual; for a gain that the fault makes inaccurate, of the estimate `corrected` without them.
        """
        known = {} if corrected is None else corrected.identified
        own, solution = self.solution, self.estimate.solution
        moved = -(own.influence @ currents) / own.inverse
        moved += (1.0 + moved) * (own.inverse / solution.inverse - 1.0)
        place = {int(j): k for k, j in enumerate(own.joints)}
        left = {j: 1.0 if beside is None else beside.left_of(j) for j in self.estimate.identified}
        std = {j: claimed(gain) for j, gain in known.items() if j in place}
        std |= {j: claimed(gain, left[j]) for j, gain in self.estimate.identified.items()}
        return tuple(
            Effect(joint=j, percent=100.0 * float(moved[place[j]]), deviations=float(moved[place[j]]) / std[j])
            for j in sorted(std)
        )

    def left_of(self, joint: int) -> float:
        """Ratio of this model's residual to the estimate's, of a joint, from 0."""
        rows, own = self.estimate.solution.rows, self.solution.rows.of(joint)
        left = self.fit.residual[own] / self.solution.rows.weight[own]
        before = float(np.linalg.norm(rows.residual[rows.of(joint)]))
        return min(1.0, float(np.linalg.norm(left)) / before) if before > 0.0 else 1.0


def stated(problem: Problem, estimate: GainEstimate, solution: GainSolution | None = None) -> HeldOutEstimate:
    """Prepare the held-out predictions of an estimate, or of another solution of the same joints."""
    solution = estimate.solution if solution is None else solution
    rows = solution.rows
    fit = FreeFit(
        V=rows.weight * rows.V, residual=rows.weight * rows.residual, Q=rows.explained,
        block=numbered_blocks(problem, rows.motion, rows.position), blocks=BLOCKS * len(problem.motions),
    )  # fmt: skip
    return HeldOutEstimate(problem, estimate, solution, fit)


def by_least_squares(estimate: GainEstimate) -> bool:
    """Whether an estimate is by least squares, so that its influence lies in its column space."""
    rows, solution = estimate.solution.rows, estimate.solution
    if not len(solution.joints) or not rows.explained.shape[1]:
        return False
    if not all(rows.sigma(j) > 0.0 for j in rows.unknowns):
        return False  # an exact fit, which no recording has
    weighted = solution.influence / rows.weight
    gram = np.zeros((rows.explained.shape[1],) * 2)
    for _, columns, Q in rows.explained.parts:
        gram[np.ix_(columns, columns)] += Q.T @ Q
    along = np.linalg.lstsq(gram, rows.explained.against(weighted.T), rcond=None)[0]
    left = np.linalg.norm(rows.explained.times(along) - weighted.T)
    return bool(left < LINEAR * np.linalg.norm(weighted))
