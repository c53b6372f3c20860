"""Which faults logs have: every alternative against the logs as they are, the best one read in, and once more.

Terms that a model may lack compete with faults, so that a fault is never accused of what a term explains.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ident.arrays import Array
from ident.diagnosis.added import Added, added, each_added
from ident.diagnosis.alternative import Alternative, Direction
from ident.diagnosis.catalog import FAMILIES, Family
from ident.diagnosis.comparison import gains, z_of
from ident.diagnosis.free_model import free_model
from ident.diagnosis.logs import Logs, read_as, score_as
from ident.diagnosis.reference import Reference, reference
from ident.diagnosis.screen import Screened, screened
from ident.errors import IdentificationError

SHOWN = 5.0
"""Standard errors by which an alternative must predict the currents better to be believed.

The best of some 400 alternatives beat 187 sound sets of logs by more than 4 in 18 of them, by more than 5 in 5, four of
these with very soft joints, backlash or presliding (`docs/diagnosis.md` has what it does since).
"""
TIE = 2.0
"""Standard errors by which the best of two alternatives must predict better to be told from the other."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Small:
    """A direction, and what it adds to the predictions."""

    direction: Direction
    found: Added

    @property
    def family(self) -> str:
        """What kind of fault, or of term of the model, it would be."""
        return self.direction.family

    @property
    def logs(self) -> tuple[int, ...]:
        """Logs that it is about, from 0."""
        return self.direction.logs

    @property
    def parameters(self) -> int:
        """Number of sizes that it has."""
        return len(self.found.value)

    @property
    def within(self) -> bool:
        """Whether its size is one that the first order is to be believed of."""
        return self.direction.within(self.found.value)

    def near(self, alternative: Alternative) -> bool:
        """Whether an alternative is this one in full: no quarter turn or sign beside a zero of some degrees."""
        if self.direction.alternative is None or self.direction.key != alternative.key:
            return False
        own = self.direction.alternative(self.found.value)
        if own.family != alternative.family or own.value is None or alternative.value is None:
            return False
        return abs(own.value - alternative.value) <= self.direction.largest * self.direction.scale

    @property
    def u(self) -> Array:
        """Gain of each block, shape (blocks,)."""
        return self.found.u

    @property
    def gain(self) -> float:
        """In log predictive density."""
        return float(self.u.sum())

    @property
    def z(self) -> float:
        """Standard errors by which it predicts better."""
        return z_of(self.u)

    @property
    def words(self) -> str:
        """What it would be, in short."""
        return self.direction.family


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """An alternative compared in full with the logs as they are.

    Attributes:
        alternative: The alternative.
        u: Gain of each block, shape (blocks,).
        read: The logs read so.
        spread: Standard deviations of the parameters that the alternative is refined in, shape (m,); None where it has
            none, or where it predicts too badly for them to be asked.
    """

    alternative: Alternative
    u: Array
    read: Logs
    spread: Array | None = None

    @property
    def family(self) -> str:
        """What kind of fault it would be."""
        return self.alternative.family

    @property
    def logs(self) -> tuple[int, ...]:
        """Logs that it is about, from 0."""
        return self.alternative.logs

    @property
    def parameters(self) -> int:
        """Number of sizes that it has."""
        return self.alternative.parameters

    @property
    def words(self) -> str:
        """What it would be."""
        return self.alternative.words

    @property
    def std(self) -> float | None:
        """Standard deviation of its size, None where it has none."""
        own = self.alternative
        if self.spread is None or own.value is None or own.refined is None:
            return None
        beside = [own.refined(sign * self.spread).value for sign in (1.0, -1.0)]
        return min((abs(each - own.value) for each in beside if each is not None), default=None)  # angles wrap one way

    @property
    def gain(self) -> float:
        """In log predictive density."""
        return float(self.u.sum())

    @property
    def z(self) -> float:
        """Standard errors by which it predicts better."""
        return z_of(self.u)


Found = TypeVar("Found", bound=Compared | Small)


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


def survey(logs: Logs, families: Sequence[Family] = tuple(FAMILIES.values())) -> Survey:
    """Look at logs beside all alternatives."""
    fit = reference(logs.problem)
    small_ones = tuple(directions(fit, logs, families))
    small = smalls(logs, small_ones)
    gross = screened(logs, [each for family in families for each in family.alternatives(logs)])
    return Survey(logs, fit, small_ones, small, tuple(gross))


def directions(fit: Reference | None, logs: Logs, families: Sequence[Family]) -> list[Direction]:
    """Of all families; none where there is no fit to take them from."""
    if fit is None:
        return []
    return [each for family in families for each in family.directions(fit, logs)]


def smalls(logs: Logs, found: Sequence[Direction]) -> tuple[Small, ...]:
    """What directions add, those that predict best first."""
    each = zip(found, each_added(logs.model.fits, [one.columns for one in found]), strict=True)
    small = [Small(direction, more) for direction, more in each if more is not None]
    return tuple(sorted(small, key=lambda each: -each.gain))


def faults(first: Survey, families: Sequence[Family] = tuple(FAMILIES.values())) -> Iterator[Fault]:
    """Faults and terms, the one that explains most first, each found beside those before it.

    Args:
        first: Of the logs as they are.
        families: Whose alternatives compete.
    """
    seen = first
    for _ in range(MOST):
        found = _best(seen)
        if found is None:
            return
        yield found
        if isinstance(found.found, Compared):
            seen = survey(found.found.read, families)
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


def likeliest(shown: Sequence[Found]) -> tuple[Found, tuple[Found, ...]]:
    """Of alternatives that surely predict better the likeliest, and those that it cannot be told from.

    An alternative with more sizes than its special case must surely predict better than that; of those that predict as
    well as the best, one of a family that is seldom wrong comes last.
    """
    best = max(shown, key=lambda each: each.gain)
    special = [each for each in shown if _contains(best, each) and z_of(best.u - each.u) < SHOWN]
    best = max(special, key=lambda each: each.gain, default=best)
    seldom = {family.name for family in FAMILIES.values() if family.seldom}
    tied = [each for each in shown if z_of(best.u - each.u) < TIE and not _contains(each, best)]  # and itself
    best = max(tied, key=lambda each: (each.family not in seldom, each.gain))
    return best, tuple(each for each in tied if each is not best)


def _contains(general: Compared | Small, special: Compared | Small) -> bool:
    """Whether an alternative is another one with more sizes, as a delay of each joint of one of all joints."""
    same = (general.family, general.logs) == (special.family, special.logs)
    return same and general.parameters > special.parameters


def _in_full(seen: Survey) -> list[Compared]:
    """The likeliest alternatives compared in full, each with the size that fits best."""
    gross = [each.alternative for each in seen.gross if each.gain.sum() > WORTH]
    best_of = {each.family: each for each in reversed(gross)}  # one family does not keep the others out
    others = sorted(set(map(gross.index, best_of.values())) - set(range(LOOKED_AT)))[:LOOKED_AT]
    likely = [(each, SHOWN) for each in (*gross[:LOOKED_AT], *(gross[k] for k in others))]
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
        least: Standard deviations of a first step that is worth taking; from a gross alternative, those of a fault.
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
    return added(found.read.model.fits, of_it[0].columns) if of_it else None


def compared(logs: Logs, alternative: Alternative) -> Compared | None:
    """An alternative in full; None if logs read so cannot be filtered."""
    try:
        other = read_as(logs, alternative.reading)
    except IdentificationError:
        return None
    return Compared(alternative, gains(logs.model.fits.score, score_as(other, alternative.reading)), other)


def _with_term(seen: Survey, term: Direction) -> Survey:
    """The same logs beside a model that has the term, with a coefficient for each joint.

    Terms found before it are not kept, and alternatives in full are compared without any.
    """
    logs = replace(seen.logs, model=free_model(seen.logs.problem, term.columns))
    found = [each.direction for each in seen.small if each.direction is not term]
    return replace(seen, logs=logs, small=smalls(logs, found))
