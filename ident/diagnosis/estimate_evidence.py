"""An estimate as a model of the currents, and what it lacks: payload values, terms, faults that only gains reveal.

The rows, weights and columns of the estimate, all joints together with the payload as specified, predict each time
block from the others. Small alternatives that are not identifiable in the free model of the logs, such as the payload's
centre, are compared here. Severity follows from the effect of each on the gains, by the influence of each row, for
large faults by another estimate:

    error of g_j / g_j = -influence_j (C x) / (1 / g_j)        C x  currents that the direction adds
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import TypeAlias

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Effect, Severity, two_digits
from ident.diagnosis.evidence import (
    BLOCKS,
    UNSEEN,
    Evidence,
    Fits,
    FreeFit,
    HeldOut,
    Score,
    each_added,
    fits_of,
    held_out,
    held_out_beside,
    log_density_improvement,
    numbered_blocks,
    z_of,
)
from ident.diagnosis.hypothesis import Alternative
from ident.diagnosis.models import FreeModel, row_counts
from ident.diagnosis.search import SHOWN, TIE, WORTH, FirstOrder, Significant, add_significant, added
from ident.diagnosis.terms import CENTRE, ELASTICITY, INERTIA, KNOWN_CENTRE, MEASURE_CENTRE, payload_errors
from ident.estimation.estimate import GainEstimate, GainSolution, IdentifiedGain
from ident.estimation.problem import Problem
from ident.numerics.least_squares import column_space
from ident.support.arrays import Array
from ident.support.errors import IdentificationError

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
class HeldOutEstimate:
    """An estimate, prepared for held-out predictions."""

    problem: Problem  # motions and payloads
    estimate: GainEstimate  # the estimate from them
    solution: GainSolution  # its solution, or that of the same model with rigid joints
    fits: Fits  # the solution's rows as one part, in units of each joint's residual

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
        found = each_added(self.fits, [(self.weighted(each),) for each in new], worth)
        self._known.update(((each, worth), more) for each, more in zip(new, found, strict=True))
        return [self._known[each, worth] for each in directions]

    def beside(self, direction: Alternative) -> "HeldOutEstimate":
        """The same estimate with the direction added to its model."""
        held = self._held
        columns = column_space(self.weighted(direction))
        left = held.fit.without(columns)
        values, turn = np.linalg.eigh(columns.T @ left)  # with priors, less than left' left
        turn = turn[:, values > UNSEEN] / np.sqrt(values[values > UNSEEN])
        new = left @ turn
        residual = held.fit.residual - new @ (turn.T @ (columns.T @ held.fit.residual))
        return replace(self, fits=fits_of([held_out_beside(held, new, residual)]))

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
        held = self._held
        rows, own = self.estimate.solution.rows, self.solution.rows.of(joint)
        left = held.fit.residual[own] / self.solution.rows.weight[own]
        before = float(np.linalg.norm(rows.residual[rows.of(joint)]))
        return min(1.0, float(np.linalg.norm(left)) / before) if before > 0.0 else 1.0


def stated(problem: Problem, estimate: GainEstimate, solution: GainSolution | None = None) -> HeldOutEstimate:
    """Prepare the held-out predictions of an estimate, or of another solution of the same joints."""
    solution = estimate.solution if solution is None else solution
    rows = solution.rows
    lengths = row_counts(problem)
    block = numbered_blocks(rows.motion, rows.position, lengths)
    fit = FreeFit(
        V=rows.weight * rows.V, residual=rows.weight * rows.residual, Q=rows.explained, block=block,
        blocks=BLOCKS * len(lengths), runs=tuple(rows.runs()),
    )  # fmt: skip
    return HeldOutEstimate(problem, estimate, solution, fits_of([held_out(fit)]))


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


MOST = 3
"""Largest number of effects that one estimate lacks."""
ANOTHER = "the payload is not as specified: its centre of mass, its inertia or its mounting differs"


def lacks_of(
    base: HeldOutEstimate,
    small: Sequence[Alternative],
    names: Sequence[str],
    free: FreeModel | None = None,
    reestimate: Estimate | None = None,
    *,
    stiff: GainSolution | None,
) -> Iterator[Diagnosis]:
    """Return effects that an estimate lacks, of the competing directions `small`, the one that explains most first.

    Fits of each joint alone (`free`) that predict significantly better show that something is lacking. Elastic joints
    may imitate faults: `stiff` is the solution with rigid ones. None skips either.
    """
    of_payload = base.payload_errors
    believed = [each for each in of_payload if each.prior_std is not None]
    open_ones = [*small, *(each for each in of_payload if each.prior_std is None)]
    taken_up = list(imitated(base, stiff, believed, open_ones))
    for lack in taken_up:
        yield diagnosis_of(lack, names, reestimate)
        base = base.beside(lack.best.alternative)
        open_ones.remove(lack.best.alternative)
    for each in believed:
        for found in added([each], base.each_added([each])):
            if found.z > SHOWN and beyond_prior(found):
                yield diagnosis_of(Lack(base, found, ()), names)
        base = base.beside(each)
    lacks = list(islice(shown_beside(base, open_ones), MOST - len(taken_up)))
    first = lacks[0] if lacks else None
    wrong = None if free is None or reestimate is None else _of_payload(base, free, reestimate, first, names)
    if wrong is not None:
        yield wrong
        return
    found = [diagnosis_of(each, names, reestimate) for each in lacks]
    yield from found
    if free is not None:
        faults = (each for lack, each in zip(lacks, found, strict=True) if lack.best.alternative.at_fault)
        beside_faults = any(each.severity is Severity.WRONG for each in faults)
        last = lacks[-1].model.beside(lacks[-1].best.alternative) if lacks else base
        yield from _unexplained(last, free, beside_faults=beside_faults)


Lack: TypeAlias = Significant[HeldOutEstimate, FirstOrder]
"""An effect that an estimate lacks."""


def shown_beside(base: HeldOutEstimate, choices: Sequence[Alternative]) -> Iterator[Lack]:
    """Return significant effects that a model lacks, the largest first, each with the earlier ones included."""

    def significant(base: HeldOutEstimate) -> list[FirstOrder]:
        return [each for each in added(choices, base.each_added(choices, WORTH)) if each.within and each.z > SHOWN]

    return add_significant(base, significant, lambda base, found: base.beside(found.alternative))


def imitated(
    base: HeldOutEstimate,
    solution: GainSolution | None,
    believed: Sequence[Alternative],
    choices: Sequence[Alternative],
) -> Iterator[Lack]:
    """Return faults that selected elastic joints absorb: they predict significantly better than elasticity."""
    if solution is None:
        return
    stiff = stated(base.problem, base.estimate, solution)
    for each in believed:
        stiff = stiff.beside(each)
    for lack in islice(shown_beside(stiff, choices), MOST):
        first_order = [lack.model.each_added([each])[0] for each in choices if each.family == ELASTICITY]
        elastic = [
            log_density_improvement(lack.model.by_joint, base.by_joint),
            *(each.u for each in first_order if each is not None),
        ]
        if any(z_of(lack.best.u - each) < TIE for each in elastic) or not lack.best.alternative.at_fault:
            return
        yield lack


def beyond_prior(found: FirstOrder) -> bool:
    """Whether an estimated parameter contradicts its specified standard deviation."""
    assert found.alternative.prior_std is not None, "asked of what is stated"
    spread = found.covariance + np.diag(np.square(found.alternative.prior_std))
    return float(found.value @ np.linalg.solve(spread, found.value)) > SHOWN**2


def _of_payload(
    base: HeldOutEstimate, free: FreeModel, reestimate: Estimate, first: Lack | None, names: Sequence[str]
) -> Diagnosis | None:
    """Return the diagnosis of a payload that is not as specified, by gains from its mass alone, None if it is as good.

    `first` is the best first-order effect; a payload that is rotated or far off exceeds the first order.
    """
    of_payload = first is not None and first.best.alternative.family in (CENTRE, INERTIA)
    if not _leaves(base, free) or not _may_be_of_payload(base, None if of_payload else first):
        return None
    found = from_mass_alone(base, reestimate)
    if found is None:
        return None
    other, u = found
    if z_of(u) < SHOWN or not (first is None or of_payload or z_of(u - first.best.u) > TIE):
        return None
    effects = tuple(between(base.estimate, other))
    if first is not None and of_payload and not _leaves(first.model.beside(first.best.alternative), free):
        # its size is correct to first order
        diagnosis = diagnosis_of(first, names, reestimate)
    else:
        logs = tuple(name for name, each in zip(names, base.problem.motions, strict=True) if each.payload is not None)
        diagnosis = Diagnosis(name="payload", sentence="", cause=ANOTHER, advice=MEASURE_CENTRE, logs=logs, z=z_of(u))
    effects = effects or diagnosis.effects
    return replace(
        diagnosis, severity=severity_of(effects), sentence=f"{diagnosis.cause}{consequence(effects)}", effects=effects
    )


def from_mass_alone(base: HeldOutEstimate, reestimate: Estimate) -> tuple[GainEstimate, Array] | None:
    """Return the estimate from masses of payloads alone, and its improvement, shape (blocks,); None if that fails."""
    masses = {id(each): replace(each, known="mass") for each in base.problem.payloads if each.known in KNOWN_CENTRE}
    motions = (replace(each, payload=masses.get(id(each.payload), each.payload)) for each in base.problem.motions)
    opened = replace(base.problem, motions=tuple(motions))
    try:
        other = reestimate(opened) if masses else None
    except IdentificationError:
        other = None
    return None if other is None else (other, log_density_improvement(base.by_joint, stated(opened, other).by_joint))


def _may_be_of_payload(base: HeldOutEstimate, other: Lack | None) -> bool:
    """Whether errors of all stated centres and inertias, to first order, predict better, also than another lack."""
    own = [each for each in base.payload_errors if each.family in (CENTRE, INERTIA)]
    if not own:
        return False
    of_joints = zip(*(each.columns for each in own), strict=True)
    columns = (np.hstack(each) if each[0] is not None else None for each in of_joints)
    (together,) = base.each_added([replace(own[0], columns=tuple(columns))])
    if together is None or z_of(together.u) < SHOWN - 1.0:
        return False
    return other is None or float(np.sum(together.u - other.best.u)) > 0.0


def _leaves(base: HeldOutEstimate, free: FreeModel) -> bool:
    """Whether fits of each joint alone, with free payloads, predict the currents significantly better."""
    return z_of(log_density_improvement(base.by_joint, free.fits.score)) > SHOWN


def _unexplained(base: HeldOutEstimate, free: FreeModel, *, beside_faults: bool) -> Iterator[Diagnosis]:
    """Return the diagnosis of currents that only fits of each joint alone explain; beside faults it refuses gains."""
    if not _leaves(base, free):
        return
    times = np.sqrt(base.by_joint.variance / np.where(free.fits.sigma > 0.0, free.fits.score.variance, np.inf))
    worst = int(np.argmax(times))
    most = float(times[worst])  # significant in a long log even if small
    size = (
        f"{two_digits(100.0 * (most - 1.0))} % larger than" if most < 2.0 else f"{two_digits(most)} times as large as"
    )
    yield Diagnosis(
        name="unexplained",
        severity=Severity.WRONG if beside_faults else Severity.WEAK,
        sentence=(
            f"the residual of joint {worst + 1} is {size} in a fit of this joint alone; no known cause explains the "
            "difference"
        ),
        advice="check that the model, the payload and all logs are of one robot",
        joints=tuple(range(len(times))) if beside_faults else (worst,),
        value=float(times[worst]),
        unit="times",
    )


def diagnosis_of(lack: Lack, names: Sequence[str], reestimate: Estimate | None = None) -> Diagnosis:
    """Return the diagnosis of an effect that an estimate lacks.

    What the model lacks is no fault of a log: it refuses gains only if it changes one by more than the largest standard
    deviation of a gain that is not refused.
    """
    base, best, rivals = lack
    corrected = None
    if best.alternative.at_fault and reestimate is not None and not base.estimate.identifiable.all():
        with suppress(IdentificationError):
            corrected = reestimate(_without(base.problem, best))
    effects = base.effects(
        base.stacked(best.alternative.columns) @ best.value, base.beside(best.alternative), corrected
    )
    severity = severity_of(effects)
    limit = 100.0 * base.problem.options.max_rel_std
    beyond = any(each.spoils and abs(each.percent) > limit for each in effects)
    if severity is Severity.WRONG and not best.alternative.at_fault and not beyond:
        severity = Severity.WEAK
    found, logs, one = best.alternative.described(best.value, names), best.alternative.logs, len(best.value) == 1
    return Diagnosis(
        name=best.alternative.family,
        severity=severity,
        sentence=f"{found.words}{consequence(effects)}",
        cause=found.words,
        advice=found.advice,
        joints=best.alternative.joints,
        logs=tuple(names[k] for k in logs) if len(logs) < len(names) else (),
        value=found.value,
        std=float(np.sqrt(best.covariance[0, 0])) * best.alternative.scale if one else None,
        unit=best.alternative.unit if found.value is not None else None,
        z=best.z,
        effects=effects,
        rivals=tuple(each.alternative.described(each.value, names).words for each in rivals),
    )


def _without(problem: Problem, found: FirstOrder) -> Problem:
    """Return a problem without the currents of an effect."""
    ends = np.cumsum([[len(own.V) for own in each.observation.joints] for each in problem.motions], axis=0)
    joints = [list(each.observation.joints) for each in problem.motions]
    for j, columns in enumerate(found.alternative.columns):
        if columns is not None:
            for of_motion, part in zip(joints, np.split(columns @ found.value, ends[:-1, j]), strict=True):
                of_motion[j] = replace(of_motion[j], V=of_motion[j].V - part)
    observed = (replace(each.observation, joints=tuple(own)) for each, own in zip(problem.motions, joints, strict=True))
    motions = (replace(each, observation=own) for each, own in zip(problem.motions, observed, strict=True))
    return replace(problem, motions=tuple(motions))
