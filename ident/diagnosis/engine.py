"""Which faults logs have: every alternative against the logs as they are, the best one read in, and once more.

Terms that a model may lack compete with faults, so that a fault is never accused of what a term explains.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.diagnosis.added import Added, each_added
from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.candidates import SHOWN, Compared, Small, likeliest
from ident.diagnosis.catalog import FAMILIES, Family
from ident.diagnosis.comparison import gains
from ident.diagnosis.fitted_currents import Reference, reference
from ident.diagnosis.free_model import free_model
from ident.diagnosis.logs import Logs, read_as, scored_as
from ident.diagnosis.screening import Screened, screened
from ident.support.errors import IdentificationError

LOOKED_AT = 3
"""Best alternatives of either kind that are compared in full."""
WORTH = 8.0
"""Gain in log likelihood on few instants from which a reading is compared in full: that of z = 4 if all is white."""
MOST = 4
"""Faults and terms that are looked for in one set of logs."""
REFINED = 3
"""Steps in which the size of a fault is refined."""
SETTLED = 0.5
"""Standard deviations of a size under which it needs no further step."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fault:
    """An alternative that is believed, or a term of the model.

    Attributes:
        found: The alternative in full, or the term.
        small: The direction, where the alternative is as small, None for a gross one; of a term, itself.
        rivals: Alternatives and terms that these logs cannot tell it from.
        before: The logs that it was found in: as they are, or with earlier faults read in.
    """

    found: Compared | Small
    small: Small | None
    rivals: tuple[Compared | Small, ...]
    before: Logs

    @property
    def z(self) -> float:
        """Standard errors by which it predicts better."""
        return self.found.z

    @property
    def rival_words(self) -> tuple[str, ...]:
        """What these logs cannot tell it from, each once."""
        return tuple(dict.fromkeys(each.words for each in self.rivals))


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """What is said of one set of logs by all alternatives.

    Attributes:
        logs: The logs.
        fit: The fit that directions were taken from, None where there is none.
        directions: Of all families.
        small: What they add, those that predict best first.
        gross: Other readings on few instants, the best first.
    """

    logs: Logs
    fit: Reference | None
    directions: tuple[Direction, ...]
    small: tuple[Small, ...]
    gross: tuple[Screened, ...]


def survey(logs: Logs) -> Survey:
    """Look at logs beside all alternatives."""
    fit = reference(logs.problem)
    small_ones = tuple(directions(fit, logs))
    small = smalls(logs, small_ones)
    gross = screened(logs, [each for family in FAMILIES.values() for each in family.alternatives(logs)])
    return Survey(logs, fit, small_ones, small, tuple(gross))


def directions(fit: Reference | None, logs: Logs, families: Collection[Family] = FAMILIES.values()) -> list[Direction]:
    """Of all families; none where there is no fit to take them from."""
    if fit is None:
        return []
    return [each for family in families for each in family.directions(fit, logs)]


def smalls(logs: Logs, found: Sequence[Direction]) -> tuple[Small, ...]:
    """What directions add, those that predict best first."""
    each = zip(found, each_added(logs.model.fits, [one.columns for one in found]), strict=True)
    small = [Small(direction, more) for direction, more in each if more is not None]
    return tuple(sorted(small, key=lambda each: -each.gain))


def faults(seen: Survey) -> Iterator[Fault]:
    """Faults and terms of logs as they are, the one that explains most first, each found beside those before it."""
    for _ in range(MOST):
        found = _best(seen)
        if found is None:
            return
        yield found
        if isinstance(found.found, Compared):
            seen = survey(found.found.read)
        else:
            seen = _with_term(seen, found.found.direction)


def _best(seen: Survey) -> Fault | None:
    """The alternative that predicts best of those that surely predict better."""
    full = [each for each in _in_full(seen) if each.z > SHOWN]
    terms = [each for each in seen.small if each.direction.alternative is None and each.z > SHOWN]
    candidates = [*full, *terms]
    if not candidates:
        return None
    best, rivals = likeliest(candidates)
    small = (
        best if isinstance(best, Small) else next((each for each in seen.small if each.near(best.alternative)), None)
    )
    return Fault(found=best, small=small, rivals=rivals, before=seen.logs)


def _in_full(seen: Survey) -> list[Compared]:
    """The likeliest alternatives compared in full, each with the size that fits best."""
    gross = [each.alternative for each in seen.gross if each.gain.sum() > WORTH]
    best_of = {each.family: each for each in reversed(gross)}  # one family does not keep the others out
    others = sorted(set(map(gross.index, best_of.values())) - set(range(LOOKED_AT)))[:LOOKED_AT]
    likely = [(each, SETTLED if each.searched else SHOWN) for each in (*gross[:LOOKED_AT], *(gross[k] for k in others))]
    shown = [each for each in seen.small if each.direction.alternative is not None and each.z > SHOWN - 1.0]
    likely += [(each.direction.alternative(each.found.value), SETTLED) for each in shown[:LOOKED_AT]]  # pyright: ignore
    found = dict[object, Compared]()
    for each, least in likely:
        full = _refined(seen.logs, each, least)
        if full is not None and (each.key not in found or found[each.key].gain < full.gain):
            found[each.key] = full
    return list(found.values())


def _refined(logs: Logs, alternative: Alternative, least: float) -> Compared | None:
    """An alternative in full with the size that fits best, found step by step from its directions.

    Args:
        logs: As they are.
        alternative: To begin with.
        least: Standard deviations of a first step that is worth taking; from a gross alternative of a natural size, as
            a negated position has, those of a fault.
    """
    best = compared(logs, alternative)
    for _ in range(REFINED):
        refined = None if best is None else best.alternative.refined
        if best is None or refined is None or best.z < SHOWN - 1.0:
            break
        more = _change(best)
        if more is None:
            break
        spread = np.sqrt(np.diag(more.covariance))
        best = replace(best, spread=spread)
        if not (np.abs(more.value) > least * spread).any():
            break
        nearer = compared(logs, refined(more.value))
        if nearer is None or nearer.gain <= best.gain:
            break
        best, least = replace(nearer, spread=spread), SETTLED
    return best


def _change(found: Compared) -> Added | None:
    """Change of the parameters that the logs read so ask for; None where they cannot say."""
    fit = reference(found.read.problem)
    own = [family for family in FAMILIES.values() if family.name == found.alternative.key[0]]
    of_it = [each for each in directions(fit, found.read, own) if each.key == found.alternative.key]
    return each_added(found.read.model.fits, [of_it[0].columns])[0] if of_it else None


def compared(logs: Logs, alternative: Alternative) -> Compared | None:
    """An alternative in full; None if logs read so cannot be filtered."""
    try:
        other = read_as(logs, alternative.hypothesis)
    except IdentificationError:
        return None
    return Compared(
        alternative, gains(logs.model.fits.score, scored_as(other.model.fits.score, alternative.hypothesis)), other
    )


def _with_term(seen: Survey, term: Direction) -> Survey:
    """The same logs beside a model that has the term, with a coefficient for each joint.

    Terms found before it are not kept, and alternatives in full are compared without any.
    """
    logs = replace(seen.logs, model=free_model(seen.logs.problem, term.columns))
    found = [each.direction for each in seen.small if each.direction is not term]
    return replace(seen, logs=logs, small=smalls(logs, found))
