"""Effects of faults on gains; and an estimate as a model of the currents, which predicts time blocks from the others.

All joints together, with the rows, weights and columns of the estimate and the payload as specified. Small alternatives
that are not identifiable in the free model of the logs, such as the payload's centre, are compared here. Their effect
on the gains follows from the influence of each row:

    error of g_j / g_j = -influence_j (C x) / (1 / g_j)        C x  currents that the direction adds
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Effect, Severity, two_digits
from ident.diagnosis.evidence import TOGETHER, UNSEEN, Evidence, Fits, Score, each_added
from ident.diagnosis.hypothesis import Alternative, Logs
from ident.diagnosis.models import Reference, numbered_blocks, reference_fit
from ident.diagnosis.search import Exact, FirstOrder, added
from ident.diagnosis.terms import payload_errors
from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain
from ident.estimation.intervals import BLOCKS, BlockedFit, max_of_classical_and_jackknife
from ident.estimation.problem import Problem
from ident.numerics.least_squares import column_space
from ident.support.arrays import Array
from ident.support.errors import IdentificationError

LINEAR = 1e-6
"""Relative part of the influence outside the column space; larger for instruments and total least squares than for
least squares."""
FINEST = 1e-3
"""Smallest relative standard deviation that effects are compared with: without noise any fault would refuse every
gain."""
NAMED = 2
"""Largest number of joints whose effects a sentence names; of more, only the worst."""
NO_RESULT = 10.0
"""Relative error of a gain beyond which it is invalid."""


def claimed(gain: IdentifiedGain, left: float = 1.0) -> float:
    """Relative standard deviation of a gain for the residual times `left`, at least that of weighing a payload."""
    total = float(np.linalg.norm((left * gain.residual_std, gain.payload_std, gain.model_std)))
    return max(total / abs(gain.value), FINEST)


def severity_of(effects: Sequence[Effect]) -> Severity:
    """Return the severity of the largest effect."""
    if any(each.spoils for each in effects):
        return Severity.WRONG
    known = any(each.deviations is not None for each in effects)
    return Severity.GOOD if known and not any(each.matters for each in effects) else Severity.WEAK


def between(now: GainEstimate, other: GainEstimate) -> Iterator[Effect]:
    """Error of gains if the others are correct, over the smaller deviation; unlimited for one in only one of them."""
    for j, (mine, theirs) in enumerate(zip(now.joints, other.joints, strict=True)):
        if isinstance(mine, IdentifiedGain) and isinstance(theirs, IdentifiedGain):
            share = float(np.clip(mine.value / theirs.value - 1.0, -NO_RESULT, NO_RESULT))
            yield Effect(joint=j, percent=100.0 * share, deviations=share / min(claimed(mine), claimed(theirs)))
        elif isinstance(mine, IdentifiedGain) or isinstance(theirs, IdentifiedGain):
            yield Effect(joint=j, percent=100.0 * NO_RESULT, deviations=NO_RESULT / now.options.max_rel_std)


def of_currents(before: Logs, found: Exact) -> Iterator[Effect]:
    """Share of each joint's current that a fault explains."""
    order = found.alternative.hypothesis.logs[found.alternative.logs[0]].v_order
    rms = np.array([np.sqrt(np.mean(each.V**2)) for each in before.rows])
    left, still = before.fits.score.variance, found.read.fits.score.variance
    lost = np.sqrt(np.maximum(left[order] - still, 0.0)) / rms[order]
    for j, share in zip(order, lost, strict=True):
        yield Effect(joint=int(j), percent=100.0 * float(share), deviations=None)


def of_ratios(fit: Reference, small: FirstOrder) -> Iterator[Effect]:
    """Error of the ratio of each gain to the one that gives the most accurate ratios."""
    found = reference_fit(fit.problem)
    influence = found.log_h.influence
    currents = np.concatenate(
        [
            np.zeros(rows) if each is None else each @ small.value
            for each, rows in zip(small.alternative.columns, np.bincount(found.rows.joint).tolist(), strict=True)
        ]
    )
    C = max_of_classical_and_jackknife(found.rows, influence)
    std = np.sqrt(np.maximum(np.diag(C)[:, None] + np.diag(C) - 2.0 * C, 0.0))  # of ratios, (n, n)
    surest = int(np.argmin(np.median(std, axis=1)))
    log_gain = influence @ currents
    for j, moved in enumerate(log_gain - log_gain[surest]):
        if std[surest, j] > 0.0:
            yield Effect(joint=j, percent=100.0 * float(moved), deviations=float(moved) / float(std[surest, j]))


def consequence(effects: Sequence[Effect], what: str = "gains from these logs") -> str:
    """Describe the errors of gains, their ratios or currents."""
    if not effects:
        return ""
    worst = max(effects, key=lambda each: abs(each.deviations or 0.0) or abs(each.percent))
    if worst.deviations is None:
        return f"; it explains {two_digits(worst.percent)} % of joint {worst.joint + 1}'s current"
    if abs(worst.percent) >= 100.0 * NO_RESULT:
        return f"; the gain of joint {worst.joint + 1} from these logs is invalid"
    listed = [each for each in effects if each.matters]
    if not listed:
        return "; no gain changes noticeably"
    rest = f" and {len(listed) - 1} more" if len(listed) > NAMED else ""
    listed = listed if not rest else [worst]
    more = ", ".join(f"joint {each.joint + 1} {two_digits(each.percent, sign='+')} %" for each in listed)
    return f"; {what} are off: {more}{rest}"


def diagnosis_of(
    best: Exact | FirstOrder,
    rivals: Sequence[str],
    names: Sequence[str],
    effects: Sequence[Effect],
    severity: Severity | None = None,
    what: str = "gains from these logs",
) -> Diagnosis:
    """Return the diagnosis of a fault, or of a term that a model lacks; `names` are those of all logs.

    A fault without a size, such as an order of columns, is not small: the logs are misread, whatever gains they give.
    """
    own = best.alternative
    if isinstance(best, Exact) and own.refined is None:
        severity = Severity.WRONG
    found = own.described(best.value, names) if isinstance(best, FirstOrder) else own
    return Diagnosis(
        name=own.family, severity=severity or severity_of(effects), cause=found.words, advice=found.advice,
        sentence=f"{found.words}{consequence(effects, what)}", joints=own.joints,
        logs=tuple(names[k] for k in own.logs) if len(own.logs) < len(names) else (),
        value=found.value, std=best.std, unit=own.unit if found.value is not None else None, z=best.z,
        effects=tuple(effects), rivals=tuple(rivals),
    )  # fmt: skip


Estimate = Callable[[Problem], GainEstimate]
"""Function that estimates gains from a problem."""


@dataclass(frozen=True, eq=False)
class HeldOutEstimate:
    """An estimate, prepared for held-out predictions."""

    problem: Problem  # motions and payloads
    estimate: GainEstimate  # the estimate from them
    reestimate: Estimate | None = None  # repeats the estimate with other logs
    other: GainSolution | None = None  # another solution of the same joints, None for that of the estimate

    @property
    def solution(self) -> GainSolution:
        """The solution that predicts."""
        return self.other or self.estimate.solution

    @cached_property
    def fit(self) -> BlockedFit:
        """The rows of all joints, in units of each joint's residual."""
        rows, problem = self.solution.rows, self.problem
        block, blocks = numbered_blocks(problem, rows.motion, rows.position), BLOCKS * len(problem.motions)
        return BlockedFit(rows.weight * rows.V, rows.weight * rows.residual, rows.explained, block, blocks)

    def again(self, problem: Problem) -> GainEstimate | None:
        """The estimate from another problem; None if it cannot be repeated, or fails."""
        with suppress(IdentificationError):
            return None if self.reestimate is None else self.reestimate(problem)

    @cached_property
    def predicts(self) -> bool:
        """Whether it is by least squares, so that its influence lies in its column space."""
        rows, solution = self.estimate.solution.rows, self.estimate.solution
        if not len(solution.joints) or not rows.explained.shape[1]:
            return False
        if not all(rows.sigma(j) > 0.0 for j in rows.unknowns):
            return False  # an exact fit, which no recording has
        weighted = solution.influence / rows.weight
        gram = np.zeros((rows.explained.shape[1],) * 2)
        for _, columns, Q in rows.explained.parts:
            gram[np.ix_(columns, columns)] += Q.T @ Q
        along = np.linalg.lstsq(gram, rows.explained.against(weighted.T), rcond=None)[0]
        left = np.linalg.norm(rows.explained.times(np.asarray(along, np.float64)) - weighted.T)
        return bool(left < LINEAR * np.linalg.norm(weighted))

    @cached_property
    def fits(self) -> Fits:
        """The fit, prepared for comparisons."""
        return Fits((self.fit,))

    @cached_property
    def by_joint(self) -> Score:
        """Accuracy of the predictions of each joint's currents, as for fits of each joint alone."""
        fit, rows = self.fit, self.solution.rows
        n, blocks = self.problem.structure.arm.n, fit.blocks
        left = fit.layout.rows(fit.held_residual)[:, 0] / rows.weight
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
        stacked = np.zeros((len(self.fit.V), next(each.shape[1] for each in columns if each is not None)))
        for j in self.solution.rows.unknowns:
            if (each := columns[j]) is not None:
                stacked[self.solution.rows.of(j)] = each
        return stacked

    def weighted(self, direction: Alternative) -> Array:
        """Columns of a direction on the rows of the estimate's fit, shape (R, m)."""
        return self.solution.rows.weight[:, None] * self.stacked(direction.columns)

    @cached_property
    def _known(self) -> dict[tuple[Alternative, float], Evidence | None]:
        """Improvements that were computed before."""
        return {}

    def each_added(self, directions: Sequence[Alternative], worth: float = 0.0) -> list[FirstOrder]:
        """Improvement by each of many directions, each added alone, without those of less than `worth`."""
        new = [each for each in directions if (each, worth) not in self._known]
        count = max(1, 4 * TOGETHER // len(self.fit.V))  # long columns are only made when they are compared
        for some in (new[start : start + count] for start in range(0, len(new), count)):
            found = each_added(self.fits, [(self.weighted(each),) for each in some], worth)
            self._known.update(((each, worth), more) for each, more in zip(some, found, strict=True))
        return added(directions, [self._known[each, worth] for each in directions])

    def beside(self, direction: Alternative) -> "HeldOutEstimate":
        """The same estimate with the direction added to its model."""
        fit, columns = self.fit, column_space(self.weighted(direction))
        left = fit.without(columns)
        values, turn = np.linalg.eigh(columns.T @ left)  # with priors, less than left' left
        turn = turn[:, values > UNSEEN] / np.sqrt(values[values > UNSEEN])
        new, rows = left @ turn, self.solution.rows
        residual = fit.residual - new @ (turn.T @ (columns.T @ fit.residual))
        rows = replace(rows, residual=residual / rows.weight, explained=fit.Q.beside(new))
        return replace(self, other=replace(self.solution, rows=rows))

    def effects(
        self, currents: Array, beside: "HeldOutEstimate | None" = None, corrected: GainEstimate | None = None
    ) -> tuple[Effect, ...]:
        """Error of each gain due to currents (R,) that the model does not include, and by the difference of the models.

        Errors are in standard deviations by the residual of the model `beside` with these currents, as a fault also
        increases the residual; for a gain that the fault makes inaccurate, of the estimate `corrected` without them.
        """
        own, solution = self.solution, self.estimate.solution
        moved = -(own.influence @ currents) / own.inverse
        moved += (1.0 + moved) * (own.inverse / solution.inverse - 1.0)
        place, gains = {int(j): k for k, j in enumerate(own.joints)}, self.estimate.identified
        std = {j: claimed(gain, 1.0 if beside is None else beside.left_of(j)) for j, gain in gains.items()}
        if corrected is not None:
            std = {j: claimed(gain) for j, gain in corrected.identified.items() if j in place} | std
        return tuple(
            Effect(joint=j, percent=100.0 * float(moved[place[j]]), deviations=float(moved[place[j]]) / std[j])
            for j in sorted(std)
        )

    def left_of(self, joint: int) -> float:
        """Ratio of this model's residual to the estimate's, of a joint, from 0."""
        before = self.estimate.solution.rows.residual_share(joint)
        return min(1.0, self.solution.rows.residual_share(joint) / before) if before > 0.0 else 1.0
