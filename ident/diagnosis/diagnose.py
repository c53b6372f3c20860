"""From logs and an estimate to what is said of them: faults, what the model lacks, what is excluded, what is untold.

Severity follows from two numbers: z, whether it is so, and the effect on each gain, whether it matters.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ident.arrays import Array
from ident.diagnosis.alternative import Direction, in_logs
from ident.diagnosis.catalog import FAMILIES, payload
from ident.diagnosis.catalog.terms import ADVICE, SENTENCES
from ident.diagnosis.comparison import Added, z_of
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity, worst_first
from ident.diagnosis.engine import SHOWN, TIE, Fault, Small, Survey, directions, faults, survey
from ident.diagnosis.excluded import exclusions, untold
from ident.diagnosis.logs import Logs
from ident.diagnosis.reference import Reference, reference
from ident.diagnosis.stated import Stated, claimed, stated
from ident.errors import IdentificationError
from ident.estimate import GainEstimate, IdentifiedGain
from ident.problem import Problem
from ident.uncertainty.cautious import cautious

NAMED = 2
"""Joints whose effects a sentence names; of more, the worst."""
MOST = 3
"""Things that an estimate may lack, one beside the other."""
NO_RESULT = 10.0
"""Relative error of a gain beyond which it is none."""
LINEAR = 1e-6
"""Relative part of the influence that a fit by least squares cannot explain; instruments and total least squares do."""
Estimate = Callable[[Problem], GainEstimate]


def diagnose(logs: Logs, estimate: GainEstimate | None = None, again: Estimate | None = None) -> Diagnosed:
    """Compare logs and an estimate with every alternative.

    Args:
        logs: As they were observed.
        estimate: What was found from them, None where nothing was.
        again: The same estimate of other logs: tells the effect of gross faults.
    """
    seen = survey(logs)
    base = None if estimate is None or not _linear(estimate) else stated(logs.problem, estimate)
    found = list(faults(seen))
    of_logs = [each for each in found if each.compared is not None]
    diagnoses = [_of_fault(each, seen, base, again) for each in of_logs]
    if base is not None and not of_logs:
        diagnoses += list(_of_estimate(base, seen))
    elif base is None:
        diagnoses += [_of_term(each) for each in found if each.compared is None]
    if of_logs:
        return Diagnosed(diagnoses=worst_first(diagnoses))
    return Diagnosed(diagnoses=worst_first(diagnoses), excluded=tuple(exclusions(seen)), untold=tuple(untold(seen)))


def lacking(problem: Problem, estimate: GainEstimate, logs: Logs) -> Diagnosed:
    """What an estimate lacks, of logs that are trusted."""
    if not _linear(estimate):
        return Diagnosed()
    fit = reference(logs.problem)
    seen = Survey(logs, fit, tuple(directions(fit, logs, tuple(FAMILIES.values()))), (), ())
    return Diagnosed(diagnoses=worst_first(_of_estimate(stated(problem, estimate), seen)))


def severity_of(effects: Sequence[Effect]) -> Severity:
    """By the largest effect."""
    if any(each.spoils for each in effects):
        return Severity.WRONG
    known = any(each.deviations is not None for each in effects)
    return Severity.GOOD if known and not any(each.matters for each in effects) else Severity.WEAK


def _of_fault(fault: Fault, seen: Survey, base: Stated | None, again: Estimate | None) -> Diagnosis:
    """A fault of the logs."""
    logs = seen.logs
    assert fault.compared is not None, "a fault of the logs"
    alternative = fault.compared.alternative
    effects = _effects(fault, seen, base, again)
    std = None
    if fault.small is not None and len(fault.small.found.value) == 1:
        std = float(np.sqrt(fault.small.found.covariance[0, 0])) * fault.small.direction.scale
    return Diagnosis(
        name=alternative.family,
        severity=severity_of(effects),
        sentence=f"{alternative.words}{_consequence(effects, 'ratios of gains' if base is None else 'gains')}",
        advice=alternative.advice,
        joints=alternative.joints,
        logs=tuple(logs.names[k] for k in alternative.logs) if len(alternative.logs) < len(logs.names) else (),
        value=alternative.value,
        std=std,
        unit=alternative.unit,
        z=fault.z,
        effects=effects,
        rivals=fault.rivals,
    )


def _effects(fault: Fault, seen: Survey, base: Stated | None, again: Estimate | None) -> tuple[Effect, ...]:
    """What a fault does to the gains: by the influence of the rows if it is small, by another estimate if not.

    Without gains, or where no joint has one, it is what a small fault does to their ratios, and a gross one to the
    currents.
    """
    assert fault.compared is not None, "a fault of the logs"
    small = fault.small
    if small is not None and fault.before is seen.logs and small.within:
        if base is not None:
            moved = base.effects(base.stacked(small.direction.columns) @ small.found.value)
        else:
            moved = () if seen.fit is None else tuple(_of_ratios(seen.fit, small))
        if moved:
            return moved
    if base is not None and again is not None:
        try:
            moved = tuple(_between(base.estimate, again(fault.compared.logs.problem)))
        except IdentificationError:
            moved = ()  # nothing to hold the gains against
        if moved:
            return moved
    logs = seen.logs
    before, after = (each.model.fits.score for each in (fault.before, fault.compared.logs))
    order = fault.compared.alternative.reading.logs[-1].v_order
    rms = np.array([np.sqrt(np.mean(each.V**2)) for each in logs.model.rows])
    lost = np.sqrt(np.maximum(before.variance[order] - after.variance, 0.0)) / rms[order]
    return tuple(Effect(joint=int(order[j]), percent=100.0 * float(x), deviations=None) for j, x in enumerate(lost))


def _of_ratios(fit: Reference, small: Small) -> Iterator[Effect]:
    """Error of the ratio of each gain to that beside which the others are surest."""
    found = fit.fitted.fit
    currents = np.concatenate(
        [
            np.zeros(len(own.F)) if each is None else each @ small.found.value
            for each, own in zip(small.direction.columns, fit.fitted.own, strict=True)
        ]
    )
    C = cautious(found.rows, found.log_influence, 0.0)
    std = np.sqrt(np.maximum(np.diag(C)[:, None] + np.diag(C) - 2.0 * C, 0.0))  # of ratios, (n, n)
    surest = int(np.argmin(np.median(std, axis=1)))
    log_gain = found.log_influence @ currents
    for j, moved in enumerate(log_gain - log_gain[surest]):
        if std[surest, j] > 0.0:
            yield Effect(joint=j, percent=100.0 * float(moved), deviations=float(moved) / float(std[surest, j]))


def _between(now: GainEstimate, other: GainEstimate) -> Iterator[Effect]:
    """Error of gains if others are right; of one that only the others have, or that they do not, no end to it."""
    for j, (mine, theirs) in enumerate(zip(now.joints, other.joints, strict=True)):
        if isinstance(mine, IdentifiedGain) and isinstance(theirs, IdentifiedGain):
            share = float(np.clip(mine.value / theirs.value - 1.0, -NO_RESULT, NO_RESULT))
            yield Effect(joint=j, percent=100.0 * share, deviations=share / claimed(mine))
        elif isinstance(mine, IdentifiedGain) or isinstance(theirs, IdentifiedGain):
            yield Effect(joint=j, percent=100.0 * NO_RESULT, deviations=NO_RESULT / now.options.max_rel_std)


def _of_term(fault: Fault) -> Diagnosis:
    """A term that the free model lacks, where there are no gains that it could move."""
    assert fault.small is not None, "a term is a direction"
    direction = fault.small.direction
    return Diagnosis(
        name=direction.family, severity=Severity.GOOD, sentence=_term_words(direction), joints=direction.joints,
        z=fault.z, rivals=fault.rivals,
    )  # fmt: skip


def _of_estimate(base: Stated, seen: Survey) -> Iterator[Diagnosis]:
    """What an estimate lacks, the one that explains most first."""
    stated_ones = list(payload.directions(base.problem, base.estimate))
    for each in stated_ones:
        if each.prior_std is not None and (more := base.added(each)) is not None and z_of(more.u) > SHOWN:
            if beyond_prior(each, more):
                yield _lacks(base, each, more, (), seen.logs)
            base = base.beside(each)
    open_ones = [*seen.directions, *(each for each in stated_ones if each.prior_std is None)]
    for _ in range(MOST):
        added = zip(open_ones, base.each_added(open_ones), strict=True)
        shown = [(each, more) for each, more in added if more is not None and z_of(more.u) > SHOWN]
        if not shown:
            return
        best, more = max(shown, key=lambda pair: float(pair[1].u.sum()))
        rivals = [(each, other) for each, other in shown if each is not best and z_of(more.u - other.u) < TIE]
        yield _lacks(base, best, more, rivals, seen.logs)
        base = base.beside(best)
        open_ones.remove(best)


def beyond_prior(direction: Direction, more: Added) -> bool:
    """Whether what is found of a parameter is surely beyond what is stated of it."""
    assert direction.prior_std is not None, "asked of what is stated"
    spread = more.covariance + np.diag(np.square(direction.prior_std))
    return float(more.value @ np.linalg.solve(spread, more.value)) > SHOWN**2


def _lacks(
    base: Stated, direction: Direction, more: Added, rivals: Sequence[tuple[Direction, Added]], logs: Logs
) -> Diagnosis:
    effects = base.effects(base.stacked(direction.columns) @ more.value)
    severity = severity_of(effects)
    if direction.alternative is None and not direction.family.startswith("payload"):
        severity = Severity.WEAK if severity is Severity.WRONG else severity  # the model lacks it; no log is at fault
    words, advice = _words(direction, more.value, logs)
    one = len(more.value) == 1
    return Diagnosis(
        name=direction.family,
        severity=severity,
        sentence=f"{words}{_consequence(effects)}",
        advice=advice,
        joints=direction.joints,
        logs=tuple(logs.names[k] for k in direction.logs) if len(direction.logs) < len(logs.names) else (),
        value=float(more.value[0]) * direction.scale if one else None,
        std=float(np.sqrt(more.covariance[0, 0])) * direction.scale if one else None,
        unit=direction.unit if one else None,
        z=z_of(more.u),
        effects=effects,
        rivals=tuple(_words(each, other.value, logs)[0] for each, other in rivals),
    )


def _words(direction: Direction, value: Array, logs: Logs) -> tuple[str, str | None]:
    """What a direction with values of its parameters says, and what to do."""
    if direction.alternative is not None:
        found = direction.alternative(value)
        return found.words, found.advice
    words = _term_words(direction)
    if direction.family == "payload centre":
        size = ", ".join(f"{1e3 * x:+.2g}" for x in value)
        words = f"the payload's centre of mass seems to lie elsewhere than stated, by ({size}) mm"
    return in_logs(words, direction.logs, logs.names), ADVICE.get(direction.family)


def _term_words(direction: Direction) -> str:
    joints = ", ".join(str(j + 1) for j in direction.joints)
    if direction.family == "current drift" and joints:
        joints = f"joint {joints}: "
    return SENTENCES[direction.family].format(joints=joints)


def _consequence(effects: Sequence[Effect], what: str = "gains") -> str:
    """How much gains, their ratios or currents are off, in words."""
    if not effects:
        return ""
    worst = max(effects, key=lambda each: abs(each.deviations or 0.0) or abs(each.percent))
    if worst.deviations is None:
        return f"; it explains {percents(worst.percent)} % of joint {worst.joint + 1}'s current"
    if abs(worst.percent) >= 100.0 * NO_RESULT:
        return f"; the gain of joint {worst.joint + 1} is no result"
    listed = [each for each in effects if each.matters]
    if not listed:
        return "; no gain is moved noticeably"
    rest = f" and {len(listed) - 1} more" if len(listed) > NAMED else ""
    listed = listed if not rest else [worst]
    more = ", ".join(f"joint {each.joint + 1} {percents(each.percent, sign='+')} %" for each in listed)
    return f"; {what} are off: {more}{rest}"


def percents(value: float, *, sign: str = "") -> str:
    """A number in two digits, or all that stand before the point."""
    return f"{value:{sign}.0f}" if abs(value) >= 10.0 else f"{value:{sign}.2g}"


def _linear(estimate: GainEstimate) -> bool:
    """Whether an estimate is one of least squares, whose influence its explained columns give."""
    rows, solution = estimate.solution.rows, estimate.solution
    if not len(solution.joints) or not rows.explained.shape[1]:
        return False
    if not all(rows.sigma(j) > 0.0 for j in rows.unknowns):
        return False  # explained to the last digit, which no recording is
    weighted = solution.influence / rows.weight
    gram = rows.explained.T @ rows.explained
    along = np.linalg.lstsq(gram, rows.explained.T @ weighted.T, rcond=None)[0]
    left = np.linalg.norm(rows.explained @ along - weighted.T)
    return bool(left < LINEAR * np.linalg.norm(weighted))
