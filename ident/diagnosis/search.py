"""Search for faults of logs: all alternatives are compared with the logs as they are, the best is applied, and again.

Large ones are screened on subsampled states; small ones are compared to first order; the most likely of both exactly.
Terms that a model may lack compete with faults, so that no fault is reported for what a term explains.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ident.diagnosis.evidence import Evidence, each_added, log_density_improvement, z_of
from ident.diagnosis.families import FAMILIES, Family
from ident.diagnosis.fitted_currents import Reference, reference
from ident.diagnosis.free_model import free_model
from ident.diagnosis.hypothesis import Alternative, Direction, Logs, read_as, scored_as
from ident.diagnosis.screening import Screened, screened
from ident.support.arrays import Array
from ident.support.errors import IdentificationError

SHOWN = 5.0
"""Number of standard errors by which an alternative must improve the predictions to be accepted.

In 187 fault-free sets of logs, the best of some 400 alternatives exceeded 4 in 18 sets, and 5 in 5 sets, four of these
with very elastic joints, backlash or presliding (`docs/diagnosis.md` has the present rates).
"""
WORTH = 8.0
"""Improvement of the log-likelihood beyond which predictions are compared: z = 4 for white residuals.

Of a large alternative it is that on subsampled states, of a direction that of the fit, which predictions of omitted
blocks hardly exceed. It only saves time.
"""
TIE = 2.0
"""Difference of two alternatives, in standard errors, below which they cannot be distinguished."""
LOOKED_AT = 3
"""Number of best alternatives of each kind that are compared exactly."""
MOST = 4
"""Largest number of faults and terms in one set of logs."""
REFINED, SETTLED = 3, 0.5
"""Largest number of steps that refine the size of a fault, and step, in standard deviations, below which they end."""


class _Candidate:
    """Common properties of alternatives that are compared to first order and exactly."""

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def what(self) -> Direction | Alternative: ...

        @property
        def u(self) -> Array: ...

    @property
    def family(self) -> str:
        """Kind of fault, or of term of the model."""
        return self.what.family

    @property
    def parameter(self) -> str:
        """Family of directions that have its parameter."""
        return self.what.key[0]

    @property
    def logs(self) -> tuple[int, ...]:
        """Logs concerned, from 0."""
        return self.what.logs

    @property
    def gain(self) -> float:
        """Improvement of the log predictive density."""
        return float(self.u.sum())

    @property
    def z(self) -> float:
        """Improvement of the predictions, in standard errors."""
        return z_of(self.u)


@dataclass(frozen=True, slots=True, eq=False)
class FirstOrder(_Candidate):
    """A direction, and its improvement of the predictions."""

    direction: Direction
    found: Evidence

    @property
    def what(self) -> Direction:
        """The direction."""
        return self.direction

    @property
    def u(self) -> Array:
        """Improvement in each block, shape (blocks,)."""
        return self.found.u

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return len(self.found.value)

    @property
    def words(self) -> str:
        """Short description."""
        return self.direction.family

    @property
    def within(self) -> bool:
        """Whether the first order is valid for its size."""
        return bool((np.abs(self.found.value) <= self.direction.largest).all())

    def near(self, alternative: Alternative) -> bool:
        """Whether an alternative is this one evaluated exactly, not another one of a very different size."""
        if self.direction.alternative is None or self.direction.key != alternative.key:
            return False
        own = self.direction.alternative(self.found.value)
        if own.family != alternative.family or own.value is None or alternative.value is None:
            return False
        return abs(own.value - alternative.value) <= self.direction.largest * self.direction.scale


@dataclass(frozen=True, slots=True, eq=False)
class Exact(_Candidate):
    """An alternative compared exactly with the logs as they are.

    Attributes:
        alternative: The alternative.
        u: Improvement in each block, shape (blocks,).
        read: The logs under its hypothesis.
        spread: Standard deviations of its refined parameters, shape (m,); None without parameters, or if it predicts
            too badly.
    """

    alternative: Alternative
    u: Array  # pyright: ignore[reportIncompatibleMethodOverride]
    read: Logs
    spread: Array | None = None

    @property
    def what(self) -> Alternative:
        """The alternative."""
        return self.alternative

    @property
    def parameters(self) -> int:
        """Number of parameters."""
        return self.alternative.parameters

    @property
    def words(self) -> str:
        """Description."""
        return self.alternative.words

    @property
    def std(self) -> float | None:
        """Standard deviation of its size, None without one."""
        own = self.alternative
        if self.spread is None or own.value is None or own.refined is None:
            return None
        beside = [own.refined(sign * self.spread).value for sign in (1.0, -1.0)]
        return min((abs(each - own.value) for each in beside if each is not None), default=None)  # angles wrap


Found = TypeVar("Found", bound=Exact | FirstOrder)
Model = TypeVar("Model")


def select_hypothesis(shown: Sequence[Found]) -> tuple[Found, tuple[Found, ...]]:
    """Return the most likely of significantly better alternatives, and those that cannot be distinguished from it.

    An alternative with more parameters than its special case, such as separate delays of all joints of a common delay,
    must be significantly better than that; of those that predict as well as the best, rare faults come last.
    """

    def contains(general: Found, special: Found) -> bool:
        same = (general.parameter, general.logs) == (special.parameter, special.logs)
        return same and general.parameters > special.parameters

    best = max(shown, key=lambda each: each.gain)
    special = [each for each in shown if contains(best, each) and z_of(best.u - each.u) < SHOWN]
    best = max(special, key=lambda each: each.gain, default=best)
    seldom = {family.name for family in FAMILIES if family.seldom}
    tied = [each for each in shown if z_of(best.u - each.u) < TIE and not contains(each, best)]  # includes itself
    best = max(tied, key=lambda each: (each.family not in seldom, each.gain))
    return best, tuple(each for each in tied if each is not best)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fault:
    """An accepted alternative, or a term of the model.

    Attributes:
        found: The exactly evaluated alternative, or the term.
        small: The direction of a small alternative, or the term itself; None for a large one.
        rivals: Alternatives and terms that these logs cannot distinguish from it.
        before: The logs in which it was found: as they are, or with earlier faults corrected.
    """

    found: Exact | FirstOrder
    small: FirstOrder | None
    rivals: tuple[Exact | FirstOrder, ...]
    before: Logs

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
    small: tuple[FirstOrder, ...]
    gross: tuple[Screened, ...]


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


def smalls(logs: Logs, found: Sequence[Direction]) -> tuple[FirstOrder, ...]:
    """Return the improvements by directions that are worth a comparison, the best first."""
    each = zip(found, each_added(logs.model.fits, [one.columns for one in found], WORTH), strict=True)
    small = [FirstOrder(direction, more) for direction, more in each if more is not None]
    return tuple(sorted(small, key=lambda each: -each.gain))


def add_significant(
    model: Model,
    compare: Callable[[Model], list[Found]],
    extend: Callable[[Model, Found], Model],
    *,
    most: int | None = None,
    confirms: Callable[[Found], bool] = lambda _: True,
) -> Iterator[tuple[Model, Found, tuple[Found, ...]]]:
    """Yield what a model significantly lacks, that which explains most first, each with the earlier ones included.

    Args:
        model: The model of the logs.
        compare: Returns the significant hypotheses beside a model.
        extend: Returns a model with a hypothesis included.
        most: Largest number of hypotheses, None for any number.
        confirms: Whether a hypothesis is accepted; the next best one is taken if it is not.

    Yields:
        The model, the hypothesis, and those that cannot be distinguished from it.
    """
    for _ in count() if most is None else range(most):
        candidates = compare(model)
        while candidates:
            best, indistinguishable = select_hypothesis(candidates)
            if confirms(best):
                break
            candidates.remove(best)
        else:
            return
        yield model, best, indistinguishable
        model = extend(model, best)


def faults(seen: Survey, confirms: Callable[[Exact], bool] = lambda _: True) -> Iterator[Fault]:
    """Return faults and terms of the logs, the one that explains most first, each with the earlier ones included.

    Args:
        seen: Comparison with all alternatives.
        confirms: Whether an estimate, which has more information, agrees with a fault of the logs.
    """

    def significant(seen: Survey) -> list[Exact | FirstOrder]:
        terms = [each for each in seen.small if each.direction.alternative is None]
        return [each for each in (*_in_full(seen), *terms) if each.z > SHOWN]

    def extended(seen: Survey, found: Exact | FirstOrder) -> Survey:
        if isinstance(found, Exact):
            return survey(found.read)
        # terms found earlier are not kept; alternatives are evaluated exactly without any
        logs = replace(seen.logs, model=free_model(seen.logs.problem, found.direction.columns))
        others = [each.direction for each in seen.small if each.direction is not found.direction]
        return replace(seen, logs=logs, small=smalls(logs, others))

    def accepted(found: Exact | FirstOrder) -> bool:
        return isinstance(found, FirstOrder) or confirms(found)

    for seen_as, best, rivals in add_significant(seen, significant, extended, most=MOST, confirms=accepted):
        small = best if isinstance(best, FirstOrder) else None
        if isinstance(best, Exact):
            small = next((each for each in seen_as.small if each.near(best.alternative)), None)
        yield Fault(found=best, small=small, rivals=rivals, before=seen_as.logs)


def _in_full(seen: Survey) -> list[Exact]:
    """Compare the most likely alternatives exactly, each with the size that fits best."""
    gross = [each.alternative for each in seen.gross if each.gain > WORTH]
    best_of = {each.family: each for each in reversed(gross)}  # of different families
    others = sorted(set(map(gross.index, best_of.values())) - set(range(LOOKED_AT)))[:LOOKED_AT]
    likely = [(each, SETTLED if each.searched else SHOWN) for each in (*gross[:LOOKED_AT], *(gross[k] for k in others))]
    shown = [each for each in seen.small if each.direction.alternative is not None and each.z > SHOWN - 1.0]
    likely += [(each.direction.alternative(each.found.value), SETTLED) for each in shown[:LOOKED_AT]]  # pyright: ignore
    found = dict[object, Exact]()
    for each, least in likely:
        full = _refined(seen.logs, each, least)
        if full is not None and (each.key not in found or found[each.key].gain < full.gain):
            found[each.key] = full
    return list(found.values())


def _refined(logs: Logs, alternative: Alternative, least: float) -> Exact | None:
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


def _change(found: Exact) -> Evidence | None:
    """Return the next change of the parameters; None if it is not determined."""
    fit = reference(found.read.problem)
    own = [family for family in FAMILIES if family.name == found.alternative.key[0]]
    of_it = [each for each in directions(fit, found.read, own) if each.key == found.alternative.key]
    return each_added(found.read.model.fits, [of_it[0].columns])[0] if of_it else None


def compared(logs: Logs, alternative: Alternative) -> Exact | None:
    """Evaluate an alternative exactly; None if the logs cannot be filtered under its hypothesis."""
    try:
        other = read_as(logs, alternative.hypothesis)
    except IdentificationError:
        return None
    score = scored_as(other.model.fits.score, alternative.hypothesis)
    return Exact(alternative, log_density_improvement(logs.model.fits.score, score), other)
