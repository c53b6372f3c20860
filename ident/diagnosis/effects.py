"""Effects of faults on the gains, in per cent and in standard deviations; severity and wording follow from them."""

from collections.abc import Iterator, Sequence

import numpy as np

from ident.diagnosis.diagnosis import Diagnosis, Effect, Severity, two_digits
from ident.diagnosis.hypothesis import Logs
from ident.diagnosis.models import Reference
from ident.diagnosis.search import Exact, FirstOrder
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.intervals import max_of_classical_and_jackknife

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
    rms = np.array([np.sqrt(np.mean(each.V**2)) for each in before.model.rows])
    left, still = before.model.fits.score.variance, found.read.model.fits.score.variance
    lost = np.sqrt(np.maximum(left[order] - still, 0.0)) / rms[order]
    for j, share in zip(order, lost, strict=True):
        yield Effect(joint=int(j), percent=100.0 * float(share), deviations=None)


def of_ratios(fit: Reference, small: FirstOrder) -> Iterator[Effect]:
    """Error of the ratio of each gain to the one that gives the most accurate ratios."""
    found, influence = fit.fitted, fit.fitted.log_h.influence
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
    """Return the diagnosis of a fault, or of a term that a model lacks; `names` are those of all logs."""
    own = best.alternative
    found = own.described(best.value, names) if isinstance(best, FirstOrder) else own
    return Diagnosis(
        name=own.family, severity=severity or severity_of(effects), cause=found.words, advice=found.advice,
        sentence=f"{found.words}{consequence(effects, what)}", joints=own.joints,
        logs=tuple(names[k] for k in own.logs) if len(own.logs) < len(names) else (),
        value=found.value, std=best.std, unit=own.unit if found.value is not None else None, z=best.z,
        effects=tuple(effects), rivals=tuple(rivals),
    )  # fmt: skip
