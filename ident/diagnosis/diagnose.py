"""Diagnoses of logs and an estimate: faults, effects that the model lacks, excluded and undetectable faults.

Severity follows from two numbers: z, the significance, and the effect on each gain.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from ident.diagnosis.column_faults import SIGN, scaled
from ident.diagnosis.diagnosis import Diagnosed, Diagnosis, Effect, Severity, worst_first
from ident.diagnosis.effects import (
    Estimate,
    HeldOutEstimate,
    between,
    diagnosis_of,
    of_currents,
    of_ratios,
    severity_of,
)
from ident.diagnosis.evidence import log_density_improvement
from ident.diagnosis.gain_checks import ENCODER_NOISE, encoder_noise
from ident.diagnosis.hypothesis import Alternative, Logs, read_as, scored_as
from ident.diagnosis.lacks import from_mass_alone, lacks_of
from ident.diagnosis.limits import bounds, limits_of
from ident.diagnosis.models import reference
from ident.diagnosis.plausibility import opposed
from ident.diagnosis.search import (
    LOOKED_AT,
    MOST,
    SETTLED,
    SHOWN,
    TIE,
    WORTH,
    Exact,
    Fault,
    FirstOrder,
    Survey,
    compared,
    direction_of,
    directions,
    faults,
    joints_beyond_limits,
    refined,
    survey,
)
from ident.diagnosis.terms import ELASTICITY
from ident.estimation.estimate import GainEstimate
from ident.estimation.intervals import z_of
from ident.estimation.problem import Problem

DELAY = "delay"
STEPS = 5
"""Largest number of further estimates that refine the size of a fault that only gains reveal."""


def diagnose(logs: Logs, estimate: GainEstimate | None = None, reestimate: Estimate | None = None) -> Diagnosed:
    """Compare logs and an estimate with every alternative; `reestimate` gives the effect of large faults."""
    seen = survey(logs)
    known = None if estimate is None else _Known(HeldOutEstimate(logs.problem, estimate, reestimate))
    base = known.base if known is not None and known.base.predicts else None
    found = list(faults(seen) if known is None else faults(seen, known.confirms, known.harmless))
    read_as.cache_clear()  # of long logs, each interpretation has a hundred megabytes
    of_logs = [each for each in found if isinstance(each.best, Exact)]
    if known is not None and not of_logs and not joints_beyond_limits(logs):
        of_logs = [*known.beyond_first_order(seen)]
    diagnoses = [_of_fault(each, seen, known) for each in of_logs]
    signs = {each.alternative.joints for each in seen.gross if each.alternative.family == SIGN and not each.excluded}
    possible = sorted(joint for joints in signs for joint in joints)
    for joint, log in () if of_logs else opposed(logs.problem, possible):  # negated in one log, according to friction
        negated = compared(logs, scaled(logs, (log,), (joint,), -1.0))
        assert negated is not None, "only a sign is read otherwise"
        diagnosis = _of_fault(Fault(seen, negated, ()), seen, known)
        diagnoses.append(replace(diagnosis, severity=Severity.WRONG, z=None))
    if known is None or base is None:
        diagnoses += [
            Diagnosis(
                name=best.alternative.family, sentence=best.alternative.described(best.value, logs.names).words,
                joints=best.alternative.joints, z=best.z, rivals=each.rival_words,
            )
            for each in found if isinstance(best := each.best, FirstOrder)
        ]  # fmt: skip
    elif of_logs:  # what the estimate still lacks after the faults of the logs are corrected
        last = of_logs[-1].best
        assert isinstance(last, Exact), "a fault of the logs"
        # after the largest number of faults the logs are probably of another robot: what is lacking then says nothing
        own = known.predicting(last) if len(of_logs) < MOST else None
        if own is not None:
            fit = reference(last.read.problem)
            after = Survey(last.read, fit, tuple(directions(fit, last.read)))
            further = [*_Known(own).beyond_first_order(after)]
            diagnoses += [_of_fault(each, after, known) for each in further]
            if not further:
                stiff = own.estimate.solution.stiff
                diagnoses += lacks_of(own, after.directions, last.read, stiff=stiff)
    else:
        # from the logs alone: nothing imitates it
        elastic = any(each.best.alternative.family == ELASTICITY for each in found)
        stiff = None if elastic else base.solution.stiff
        diagnoses += lacks_of(base, seen.directions, logs, stiff=stiff)
    if estimate is not None:
        noise = list(encoder_noise(logs.problem, estimate))
        diagnoses = [each for each in diagnoses if not noise or each.name != ENCODER_NOISE] + noise
    spoilt = any(each.severity is Severity.WRONG for each in diagnoses)
    diagnosed = Diagnosed() if spoilt else limits_of(seen, base)  # with a fault, exclusions are not valid
    return replace(diagnosed, diagnoses=worst_first(diagnoses))


def horizon(logs: Logs) -> Diagnosed:
    """What fault-free logs exclude, and what they cannot reveal."""
    return limits_of(survey(logs), None)


def lacking(problem: Problem, estimate: GainEstimate, logs: Logs) -> Diagnosed:
    """What the model of an estimate lacks, if the logs are trusted."""
    base = HeldOutEstimate(problem, estimate)
    if not base.predicts:
        return Diagnosed()
    small = directions(reference(logs.problem), logs)
    return Diagnosed(diagnoses=worst_first(lacks_of(base, small, logs, stiff=base.solution.stiff)))


def common_delay(logs: Logs) -> tuple[float, Diagnosis]:
    """The delay of the currents common to all logs and joints, to be corrected [s], 0 for none, and its diagnosis.

    It is accepted only if it is the first fault and nothing else explains the currents equally well.
    """
    seen, weak = survey(logs), Severity.WEAK
    first = next((each for each in faults(seen) if isinstance(each.best, Exact)), None)
    if first is None:
        own = [each for each in seen.directions if each.key == (DELAY, (), logs.every)]
        limits = [size for size in bounds(seen.logs.fits, own) if size is not None]
        shown = f"delays beyond {1e3 * limits[0]:.2g} ms are excluded" if limits else "these logs exclude no delay"
        return 0.0, Diagnosis(name=DELAY, sentence=f"no delay of the currents detected; {shown}", asked=True)
    assert isinstance(first.best, Exact), "a fault of the logs"
    found, std = first.best.alternative, first.best.std
    other = found.key != (DELAY, (), logs.every)
    if other or found.value is None or first.rivals:
        reason = f": {found.words}, which these logs cannot distinguish from: {' or '.join(first.rival_words)}"
        reason = f", because another fault is more significant: {found.words}" if other else reason
        return 0.0, Diagnosis(name=DELAY, severity=weak, sentence=f"delay not corrected{reason}", asked=True)
    way, size = "late" if found.value > 0.0 else "early", f"{abs(found.value):.2g}"
    if std is not None:
        places = max(0, -int(np.floor(np.log10(std)))) if std > 0.0 else 2
        size = f"{abs(found.value):.{places}f} ± {std:.{places}f}"
    sentence = f"the currents are logged {size} ms {way}: corrected"
    return 1e-3 * found.value, Diagnosis(
        name=DELAY, severity=weak, sentence=sentence, value=found.value, std=std, unit="ms", z=first.best.z
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """What is known of the gains."""

    base: HeldOutEstimate  # the estimate
    # estimates under hypotheses so far, None for those that failed:
    others: dict[Alternative, GainEstimate | None] = field(default_factory=dict[Alternative, "GainEstimate | None"])

    def of(self, found: Exact) -> GainEstimate | None:
        """Return the estimate under a hypothesis, computed once; None if it fails."""
        if found.alternative not in self.others:
            self.others[found.alternative] = self.base.again(found.read.problem)
        return self.others[found.alternative]

    def predicting(self, found: Exact) -> HeldOutEstimate | None:
        """The same, prepared for predictions; None also if it does not predict."""
        other = self.of(found)
        known = None if other is None else HeldOutEstimate(found.read.problem, other, self.base.reestimate)
        return known if known is not None and known.predicts else None

    def confirms(self, found: Exact) -> bool:
        """Whether a fault improves the predictions of the estimate, which needs less motion than the free model."""
        other = self.predicting(found)
        if not self.base.predicts or other is None:
            return True
        read = scored_as(other.by_joint, found.alternative.hypothesis)
        return bool(log_density_improvement(self.base.by_joint, read).sum() > 0.0)

    def beyond_first_order(self, seen: Survey) -> Iterator[Fault]:
        """Yield the most likely fault of the logs that is too large for the first order, and that only gains reveal.

        An example is the scale of one log, which friction imitates if the payload is unknown. It must predict better
        than any fault or term to first order, and than a payload of known mass alone.
        """
        base = self.base
        if base.reestimate is None or not base.predicts:
            return
        choices = [*seen.directions, *base.payload_errors]
        small = sorted(base.each_added(choices, WORTH), key=lambda each: each.gain)
        if not any(each.alternative.at_fault and each.z > SHOWN for each in small):
            return
        open_to = [each for each in seen.directions if each.at_fault and not each.term and each.parameters == 1]
        own = [each for each in small if each.alternative in open_to]
        unbounded = zip(own, bounds(seen.logs.fits, [each.alternative for each in own]), strict=True)
        best_of = {one.alternative.family: one for one, size in unbounded if size is None and one.z > SHOWN - 1.0}
        likely = sorted(best_of.values(), key=lambda each: -each.gain)[:LOOKED_AT]
        found = [exact for each in likely if (exact := self._far(seen.logs, each)) is not None]
        best = max(found, key=lambda each: each.gain, default=None)
        if best is not None and best.z > SHOWN:
            within, other = [each for each in small if each.within], from_mass_alone(base)
            rivals = [*(each.u for each in within), *([] if other is None else [other[1]])]
            if all(float(np.sum(best.u - each)) > 0.0 for each in rivals):
                yield Fault(seen, best, tuple(each for each in within if z_of(best.u - each.u) < TIE))

    def _far(self, logs: Logs, start: FirstOrder) -> Exact | None:
        """The estimate under a fault, with the size that fits best; None if the first order is valid for it."""
        given, limit = self.base.by_joint, start.alternative.largest

        def compare(alternative: Alternative) -> Exact | None:
            found = Exact(alternative, np.empty(0), logs, logs.fits.score)
            if (other := self.predicting(found)) is None:
                return None
            score = scored_as(other.by_joint, alternative.hypothesis)
            return replace(found, u=log_density_improvement(given, score), score=score)

        def change(found: Exact) -> FirstOrder | None:
            further, other = direction_of(found), self.predicting(found)
            return None if further is None or other is None else next(iter(other.each_added([further])), None)

        first = np.clip(start.value, -limit, limit)
        best, moved = refined(start.alternative.at(first), compare, change, steps=STEPS, least=SETTLED, limit=limit)
        return best if (np.abs(first + moved) > limit).any() else None

    def harmless(self, found: FirstOrder) -> bool:
        """Whether a fault changes no gain noticeably, to first order, so that it is left to what the estimate lacks."""
        return self.base.predicts and found.within and severity_of(tuple(self.effects(found))) is Severity.GOOD

    def effects(self, found: Exact | FirstOrder) -> Iterator[Effect]:
        """Error of the gains due to a fault of the logs, or to a term that the model lacks."""
        if isinstance(found, FirstOrder):
            if self.base.predicts:
                yield from self.base.effects(self.base.stacked(found.alternative.columns) @ found.value)
        elif (other := self.of(found)) is not None:
            yield from between(self.base.estimate, other)


def _of_fault(fault: Fault, seen: Survey, known: _Known | None) -> Diagnosis:
    """Return the diagnosis of a fault of the logs."""
    what = "ratios of gains" if known is None else "gains from these logs"
    return diagnosis_of(fault.best, fault.rival_words, seen.logs.names, _effects(fault, seen, known), what=what)


def _effects(fault: Fault, seen: Survey, known: _Known | None) -> tuple[Effect, ...]:
    """Largest effect on each gain of a fault or its rivals; without gains on their ratios, else on the currents."""
    assert isinstance(fault.best, Exact), "a fault of the logs"
    moved = list[Effect]()
    if known is not None:
        moved += (effect for each in (fault.best, *fault.rivals) for effect in known.effects(each))
    elif fault.model.logs is seen.logs and seen.fit is not None:
        small = next((each for each in seen.small if each.near(fault.best.alternative)), None)
        moved += [] if small is None or not small.within else of_ratios(seen.fit, small)
    if moved:
        joints = sorted({each.joint for each in moved})
        own = ([each for each in moved if each.joint == j] for j in joints)
        return tuple(max(each, key=lambda effect: abs(effect.deviations or 0.0)) for each in own)
    return tuple(of_currents(fault.model.logs, fault.best))
