"""Search for faults of logs: all alternatives are compared with the logs as they are, the best is applied, and again.

Terms that a model may lack compete with faults, so that no fault is reported for what a term explains.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ident.diagnosis.added import Added, each_added
from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.candidates import SHOWN, WORTH, Compared, Small, likeliest
from ident.diagnosis.comparison import gains
from ident.diagnosis.families import FAMILIES, Family
from ident.diagnosis.fitted_currents import Reference, reference
from ident.diagnosis.free_model import free_model
from ident.diagnosis.logs import Logs, read_as, scored_as
from ident.diagnosis.screening import Screened, screened
from ident.support.errors import IdentificationError

LOOKED_AT = 3
"""Number of best alternatives of each kind that are compared exactly."""
MOST = 4
"""Largest number of faults and terms in one set of logs."""
REFINED = 3
"""Largest number of steps that refine the size of a fault."""
SETTLED = 0.5
"""Step of a size, in standard deviations, below which the refinement ends."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fault:
    """An accepted alternative, or a term of the model.

    Attributes:
        found: The exactly evaluated alternative, or the term.
        small: The direction of a small alternative, or the term itself; None for a large one.
        rivals: Alternatives and terms that these logs cannot distinguish from it.
        before: The logs in which it was found: as they are, or with earlier faults corrected.
    """

    found: Compared | Small
    small: Small | None
    rivals: tuple[Compared | Small, ...]
    before: Logs

    @property
    def z(self) -> float:
        """Improvement of the predictions, in standard errors."""
        return self.found.z

    @property
    def rival_words(self) -> tuple[str, ...]:
        """Descriptions of what these logs cannot distinguish from it, each once."""
        return tuple(dict.fromkeys(each.words for each in self.rivals))


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """Comparison of one set of logs with all alternatives.

    Attributes:
        logs: The logs.
        fit: The fit that directions are computed from, None if it failed.
        directions: Directions of all families.
        small: Their improvements, the best first.
        gross: Large alternatives on subsampled states, the best first.
    """

    logs: Logs
    fit: Reference | None
    directions: tuple[Direction, ...]
    small: tuple[Small, ...]
    gross: tuple[Screened, ...]


@lru_cache(maxsize=1)  # the same logs are asked for a delay, and for all faults
def survey(logs: Logs) -> Survey:
    """Compare logs with all alternatives."""
    fit = reference(logs.problem)
    small_ones = tuple(directions(fit, logs))
    small = smalls(logs, small_ones)
    gross = screened(logs, [each for family in FAMILIES for each in family.alternatives(logs)])
    return Survey(logs, fit, small_ones, small, tuple(gross))


def directions(fit: Reference | None, logs: Logs, families: Collection[Family] = FAMILIES) -> list[Direction]:
    """Return the directions of all families; none without a fit."""
    if fit is None:
        return []
    return [each for family in families for each in family.directions(fit, logs)]


def smalls(logs: Logs, found: Sequence[Direction]) -> tuple[Small, ...]:
    """Return the improvements by directions that are worth a comparison, the best first."""
    each = zip(found, each_added(logs.model.fits, [one.columns for one in found], WORTH), strict=True)
    small = [Small(direction, more) for direction, more in each if more is not None]
    return tuple(sorted(small, key=lambda each: -each.gain))


def faults(seen: Survey, confirms: Callable[[Compared], bool] = lambda _: True) -> Iterator[Fault]:
    """Return faults and terms of the logs, the one that explains most first, each with the earlier ones included.

    Args:
        seen: Comparison with all alternatives.
        confirms: Whether an estimate, which has more information, agrees with a fault of the logs; the next best one
            is taken if it does not.
    """
    for _ in range(MOST):
        found = _best(seen, confirms)
        if found is None:
            return
        yield found
        if isinstance(found.found, Compared):
            seen = survey(found.found.read)
        else:
            seen = _with_term(seen, found.found.direction)


def _best(seen: Survey, confirms: Callable[[Compared], bool]) -> Fault | None:
    """Return the best of the significantly better alternatives that are confirmed."""
    full = [each for each in _in_full(seen) if each.z > SHOWN]
    terms = [each for each in seen.small if each.direction.alternative is None and each.z > SHOWN]
    candidates = [*full, *terms]
    while candidates:
        best, rivals = likeliest(candidates)
        if isinstance(best, Small) or confirms(best):
            break
        candidates.remove(best)
    else:
        return None
    small = (
        best if isinstance(best, Small) else next((each for each in seen.small if each.near(best.alternative)), None)
    )
    return Fault(found=best, small=small, rivals=rivals, before=seen.logs)


def _in_full(seen: Survey) -> list[Compared]:
    """Compare the most likely alternatives exactly, each with the size that fits best."""
    gross = [each.alternative for each in seen.gross if each.gain > WORTH]
    best_of = {each.family: each for each in reversed(gross)}  # of different families
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
    """Return an alternative, evaluated exactly, with the size that fits best, by first-order steps.

    Args:
        logs: The logs as they are.
        alternative: The initial alternative.
        least: Smallest first step, in standard deviations; larger for a large alternative with a special size, such as
            a negated position.
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
    """Return the next change of the parameters; None if it is not determined."""
    fit = reference(found.read.problem)
    own = [family for family in FAMILIES if family.name == found.alternative.key[0]]
    of_it = [each for each in directions(fit, found.read, own) if each.key == found.alternative.key]
    return each_added(found.read.model.fits, [of_it[0].columns])[0] if of_it else None


def compared(logs: Logs, alternative: Alternative) -> Compared | None:
    """Evaluate an alternative exactly; None if the logs cannot be filtered under its hypothesis."""
    try:
        other = read_as(logs, alternative.hypothesis)
    except IdentificationError:
        return None
    return Compared(
        alternative, gains(logs.model.fits.score, scored_as(other.model.fits.score, alternative.hypothesis)), other
    )


def _with_term(seen: Survey, term: Direction) -> Survey:
    """Add a term, with a coefficient for each joint, to the model of the logs.

    Terms found earlier are not kept; alternatives are evaluated exactly without any.
    """
    logs = replace(seen.logs, model=free_model(seen.logs.problem, term.columns))
    found = [each.direction for each in seen.small if each.direction is not term]
    return replace(seen, logs=logs, small=smalls(logs, found))
