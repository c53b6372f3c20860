"""What faults do to gains: how much one estimate differs from another, how severe that is, and in words."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ident.diagnosis.alternative import two_digits
from ident.diagnosis.diagnosis import Effect, Severity
from ident.diagnosis.estimate_model import claimed
from ident.estimation.estimate import GainEstimate, IdentifiedGain
from ident.estimation.problem import Problem

Estimate = Callable[[Problem], GainEstimate]
"""How gains are found from a problem."""
NAMED = 2
"""Joints whose effects a sentence names; of more, the worst."""
NO_RESULT = 10.0
"""Relative error of a gain beyond which it is none."""


def severity_of(effects: Sequence[Effect]) -> Severity:
    """By the largest effect."""
    if any(each.spoils for each in effects):
        return Severity.WRONG
    known = any(each.deviations is not None for each in effects)
    return Severity.GOOD if known and not any(each.matters for each in effects) else Severity.WEAK


def between(now: GainEstimate, other: GainEstimate) -> Iterator[Effect]:
    """Error of gains if others are right; of one that only the others have, or that they do not, no end to it.

    It counts in the smaller of both claims: what a fault adds to the residual is part of the damage.
    """
    for j, (mine, theirs) in enumerate(zip(now.joints, other.joints, strict=True)):
        if isinstance(mine, IdentifiedGain) and isinstance(theirs, IdentifiedGain):
            share = float(np.clip(mine.value / theirs.value - 1.0, -NO_RESULT, NO_RESULT))
            yield Effect(joint=j, percent=100.0 * share, deviations=share / min(claimed(mine), claimed(theirs)))
        elif isinstance(mine, IdentifiedGain) or isinstance(theirs, IdentifiedGain):
            yield Effect(joint=j, percent=100.0 * NO_RESULT, deviations=NO_RESULT / now.options.max_rel_std)


def consequence(effects: Sequence[Effect], what: str = "gains") -> str:
    """How much gains, their ratios or currents are off, in words."""
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
