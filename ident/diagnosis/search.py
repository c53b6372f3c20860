"""Search for faults of logs: all alternatives are compared with the logs as they are, the best is applied, and again.

Large ones are screened on subsampled states; small ones are compared to first order; the most likely of both exactly.
Terms that a model may lack compete with faults, so that no fault is reported for what a term explains.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, count, repeat
from typing import Generic, NamedTuple, TypeAlias, TypeVar

import numpy as np

from ident.diagnosis.evidence import Evidence, Score, each_added, log_density_improvement
from ident.diagnosis.families import FAMILIES, Family
from ident.diagnosis.hypothesis import Alternative, Logs, beyond_limits, read_as, scored_as
from ident.diagnosis.models import Reference, reference
from ident.diagnosis.screening import Screened, screened
from ident.estimation.intervals import z_of
from ident.support.arrays import Array
from ident.support.errors import IdentificationError

SHOWN = 5.0
"""Number of standard errors by which an alternative must improve the predictions to be accepted: the best of some 400
exceeded 4 in 18 and 5 in 5 of 187 fault-free sets of logs (`docs/diagnosis.md` has the present rates)."""
WORTH = 8.0
"""Improvement of the log-likelihood, on subsampled states or of the fit, beyond which predictions are compared, to save
time: z = 4 for white residuals."""
TIE = 2.0
"""Difference of two alternatives, in standard errors, below which they cannot be distinguished."""
LOOKED_AT = 3
"""Number of best alternatives of each kind that are compared exactly."""
MOST = 4
"""Largest number of faults and terms in one set of logs."""
MOST_IMPOSSIBLE = 2
"""Largest number of faults that explain impossible positions; of more, none is the cause: logs of another robot."""
REFINED, SETTLED = 5, 0.5
"""Largest number of steps that refine the size of a fault, and step, in standard deviations, below which they end."""


@dataclass(frozen=True, eq=False)
class Compared:
    """An alternative compared with the logs as they are."""

    alternative: Alternative  # the alternative
    u: Array  # improvement of the log predictive density in each block, shape (blocks,)

    @property
    def gain(self) -> float:
        """Improvement of the log predictive density."""
        return float(self.u.sum())

    @property
    def z(self) -> float:
        """Improvement of the predictions, in standard errors."""
        return z_of(self.u)


@dataclass(frozen=True, eq=False)
class FirstOrder(Compared):
    """A small alternative compared to first order, with its parameters, shape (m,), and their covariance."""

    value: Array
    covariance: Array

    @property
    def std(self) -> float | None:
        """Standard deviation of its size, None with several parameters."""
        return float(np.sqrt(self.covariance[0, 0])) * self.alternative.scale if len(self.value) == 1 else None

    @property
    def within(self) -> bool:
        """Whether the first order is valid for its size."""
        return bool((np.abs(self.value) <= self.alternative.largest).all())

    def near(self, other: Alternative) -> bool:
        """Whether an alternative is this one evaluated exactly, not another one of a very different size."""
        if self.alternative.term or self.alternative.key != other.key:
            return False
        own = self.alternative.at(self.value)
        if own.family != other.family or own.value is None or other.value is None:
            return False
        return abs(own.value - other.value) <= self.alternative.largest * self.alternative.scale


@dataclass(frozen=True, eq=False)
class Exact(Compared):
    """An alternative compared exactly."""

    logs: Logs  # the logs as they are
    score: Score  # accuracy of the predictions under its hypothesis, of the columns and in the units of the logs
    # standard deviations of its refined parameters, shape (m,); None without parameters, or if it predicts too badly:
    spread: Array | None = None

    @property
    def read(self) -> Logs:
        """The logs under its hypothesis; raises `RecordingError` if they cannot be filtered under it."""
        return read_as(self.logs, self.alternative.hypothesis)

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


class Significant(NamedTuple, Generic[Model, Found]):
    """A fault, or a term that a model lacks."""

    model: Model  # the model, with what was found earlier
    best: Found  # the fault or term
    rivals: tuple[Found, ...]  # alternatives that cannot be distinguished from it

    @property
    def rival_words(self) -> tuple[str, ...]:
        """Descriptions of what cannot be distinguished from it, each once; families of those to first order."""
        described = (each.alternative for each in self.rivals)
        return tuple(dict.fromkeys(each.family if each.columns else each.words for each in described))


def select_hypothesis(shown: Sequence[Found]) -> tuple[Found, tuple[Found, ...]]:
    """Return the most likely of significantly better alternatives, and those that cannot be distinguished from it.

    An alternative with more parameters than its special case, such as separate delays of all joints of a common delay,
    must be significantly better than that; of those that predict as well as the best, rare faults come last.
    """

    def contains(general: Found, special: Found) -> bool:
        (one, _, logs), (other, _, others) = general.alternative.key, special.alternative.key
        return (one, logs) == (other, others) and general.alternative.parameters > special.alternative.parameters

    best = max(shown, key=lambda each: each.gain)
    special = [each for each in shown if contains(best, each) and z_of(best.u - each.u) < SHOWN]
    best = max(special, key=lambda each: each.gain, default=best)
    seldom = {family.name for family in FAMILIES if family.seldom}
    tied = [each for each in shown if z_of(best.u - each.u) < TIE and not contains(each, best)]  # includes itself
    best = max(tied, key=lambda each: (each.alternative.family not in seldom, each.gain))
    return best, tuple(each for each in tied if each is not best)


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """Comparison of one set of logs with all alternatives."""

    logs: Logs  # the logs
    fit: Reference | None  # the fit that directions are computed from, None if it failed
    directions: tuple[Alternative, ...]  # alternatives of all families
    small: tuple[FirstOrder, ...] = ()  # their improvements, the best first
    gross: tuple[Screened, ...] = ()  # large alternatives on subsampled states, the best first
    # alternatives of these logs compared exactly so far, by their key; also with terms added to the model:
    exact: dict[object, Exact] = field(default_factory=dict[object, Exact])


Fault: TypeAlias = Significant[Survey, Exact | FirstOrder]
"""A fault of logs or a term, and the survey in which it was found: of logs with earlier faults corrected."""


def survey(logs: Logs) -> Survey:
    """Compare logs with all alternatives."""
    found = tuple(directions(fit := reference(logs.problem), logs))
    gross = screened(logs, [each for family in FAMILIES for each in family.alternatives(logs)])
    return Survey(logs, fit, found, smalls(logs, found), tuple(gross))


def directions(fit: Reference | None, logs: Logs, families: Collection[Family] = FAMILIES) -> list[Alternative]:
    """Return the directions of all families; none without a fit."""
    return [] if fit is None else [each for family in families for each in family.directions(fit, logs)]


def smalls(logs: Logs, found: Sequence[Alternative]) -> tuple[FirstOrder, ...]:
    """Return the improvements by directions that are worth a comparison, the best first."""
    small = added(found, each_added(logs.fits, [one.columns for one in found], WORTH))
    return tuple(sorted(small, key=lambda each: -each.gain))


def added(found: Sequence[Alternative], evidence: Sequence[Evidence | None]) -> list[FirstOrder]:
    """Small alternatives with the evidence for them, without those that have none."""
    each = zip(found, evidence, strict=True)
    return [FirstOrder(one, more.u, more.value, more.covariance) for one, more in each if more is not None]


def add_significant(
    model: Model,
    compare: Callable[[Model], list[Found]],
    extend: Callable[[Model, Found], Model],
    *,
    most: int | None = None,
    confirms: Callable[[Found], bool] = lambda _: True,
) -> Iterator[Significant[Model, Found]]:
    """Yield what a model significantly lacks, that which explains most first, each with the earlier ones included.

    The next best of the hypotheses that `compare` returns is taken if `confirms` denies one; `most` is their largest
    number, None for any.
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
        yield Significant(model, best, indistinguishable)
        model = extend(model, best)


def faults(
    seen: Survey,
    confirms: Callable[[Exact], bool] = lambda _: True,
    harmless: Callable[[FirstOrder], bool] = lambda _: False,
) -> Iterator[Fault]:
    """Return faults and terms of the logs, the one that explains most first, each with the earlier ones included.

    A fault must be confirmed by an estimate, which has more information. If all significant small faults are harmless,
    none is compared exactly: long logs show errors of a hundredth of a degree. Impossible positions have few causes, or
    none that is known: then there is no fault.
    """
    original = seen.logs.problem

    def significant(seen: Survey) -> list[Exact | FirstOrder]:
        terms = [each for each in seen.small if each.alternative.term]
        tells = seen.logs.problem is original  # the estimate has the rows of the logs as they are
        full = _in_full(seen, harmless if tells else lambda _: False)
        found = [each for each in (*full, *terms) if each.z > SHOWN]
        beyond = joints_beyond_limits(seen.logs)
        rest = [each for family in FAMILIES for each in family.laborious(seen.logs)] if found or beyond else []
        likely = [each for each in screened(seen.logs, rest) if each.gain > WORTH]
        exact = (_refined(seen.logs, each, SETTLED) for each in _different(likely)[:LOOKED_AT])
        found = _each_once([*found, *(each for each in exact if each is not None and each.z > SHOWN)])
        if not beyond:
            return found
        # nothing else explains impossible positions
        return [each for each in found if isinstance(each, Exact) and joints_beyond_limits(each.read) < beyond]

    def extended(seen: Survey, found: Exact | FirstOrder) -> Survey:
        if isinstance(found, Exact):
            return survey(found.read)
        # terms found earlier are not kept; alternatives are evaluated exactly without any
        logs = replace(seen.logs, terms=found.alternative.columns)
        others = [each.alternative for each in seen.small if each.alternative is not found.alternative]
        return replace(seen, logs=logs, small=smalls(logs, others))

    every = add_significant(
        seen, significant, extended, most=MOST, confirms=lambda each: isinstance(each, FirstOrder) or confirms(each)
    )
    if not joints_beyond_limits(seen.logs):
        yield from every
        return
    found = list[Fault]()
    for each in every:
        found.append(each)
        if sum(isinstance(one.best, Exact) for one in found) > MOST_IMPOSSIBLE:
            return
    yield from found


def _different(likely: Sequence[Screened]) -> list[Alternative]:
    """Alternatives, the best first; of equally likely ones, as of mirrored arms, that with the fewest signs."""
    fewest = dict[float, Alternative]()
    for gain, own in ((float(f"{each.gain:.9g}"), each.alternative) for each in likely):
        fewest[gain] = min(fewest.get(gain, own), own, key=_signs)
    return list(fewest.values())


def _each_once(found: Sequence[Exact | FirstOrder]) -> list[Exact | FirstOrder]:
    """The best of each key, with the fewest signs of those that cannot be distinguished."""
    best = dict[object, Exact | FirstOrder]()
    for each in sorted(found, key=lambda each: _signs(each.alternative)):
        known = best.get(each.alternative.key)
        if known is None or z_of(each.u - known.u) > TIE:
            best[each.alternative.key] = each
    return list(best.values())


def _signs(own: Alternative) -> tuple[int, int]:
    """Number of parameters and of negated positions."""
    return own.parameters, int(np.sum(own.hypothesis.logs[own.logs[0]].q_factor < 0.0))


def joints_beyond_limits(logs: Logs) -> int:
    """Number of joints beyond their limits, in all logs."""
    return sum(len(beyond_limits(logs.structure.arm, each)) for each in logs.recordings)


def _in_full(seen: Survey, harmless: Callable[[FirstOrder], bool]) -> list[Exact]:
    """Compare the most likely alternatives exactly, each with the size that fits best."""
    shown = [each for each in seen.small if not each.alternative.term and each.z > SHOWN - 1.0]
    slight = shown if all(map(harmless, shown)) else []  # else the likely one of all, exactly
    gross = [each.alternative for each in seen.gross if each.gain > WORTH]
    gross = [each for each in gross if not any(own.near(each) for own in slight)]
    best_of = {each.family: each for each in reversed(gross)}  # of different families
    others = sorted(set(map(gross.index, best_of.values())) - set(range(LOOKED_AT)))[:LOOKED_AT]
    likely = [(each, SETTLED if each.searched else SHOWN) for each in (*gross[:LOOKED_AT], *(gross[k] for k in others))]
    likely += [(each.alternative.at(each.value), SETTLED) for each in shown if each not in slight][:LOOKED_AT]
    given, found = seen.logs.fits.score, dict[object, Exact]()  # with terms that were added to the model
    found |= {key: replace(each, u=log_density_improvement(given, each.score)) for key, each in seen.exact.items()}
    for each, least in likely:
        if each.key in seen.exact:
            continue
        full = _refined(seen.logs, each, least)
        if full is not None and (each.key not in found or found[each.key].gain < full.gain):
            found[each.key] = full
    seen.exact.update(found)
    return list(found.values())


def _refined(logs: Logs, first: Alternative, least: float) -> Exact | None:
    """An alternative compared exactly, with the size that fits best; None if the logs cannot be filtered under it."""
    return refined(first, partial(compared, logs), _change, steps=REFINED * first.parameters, least=least)[0]


def refined(
    first: Alternative,
    compare: Callable[[Alternative], Exact | None],
    change: Callable[[Exact], Evidence | FirstOrder | None],
    *,
    steps: int,
    least: float,
    limit: float = np.inf,
) -> tuple[Exact | None, Array]:
    """Return an alternative with the size that fits best, by first-order steps, and their sum, shape (m,).

    The first step is at least `least` standard deviations: more for a large alternative with a special size, such as a
    negated position.
    """
    best, moved = compare(first), np.zeros(first.parameters)
    for _ in range(steps):
        more = None if best is None or best.alternative.refined is None else change(best)
        if best is None or more is None:
            break
        best = replace(best, spread=np.sqrt(np.diag(more.covariance)))
        if not (np.abs(more.value) > least * np.asarray(best.spread)).any():
            break
        step = np.clip(more.value, -limit, limit)
        nearer = compare(best.alternative.at(step))
        if nearer is None or nearer.gain <= best.gain:
            break
        best, moved, least = replace(nearer, spread=best.spread), moved + step, SETTLED
    if best is not None and best.spread is not None:
        allowed = chain((SHOWN,), repeat(TIE))  # the simplest one may predict slightly worse, as a special case
        special = zip(map(compare, best.alternative.special(best.spread)), allowed, strict=False)
        near = (each for each, worse in special if each is not None and z_of(best.u - each.u) < worse)
        best = replace(next(near, best), spread=best.spread)
    return best, moved


def _change(found: Exact) -> Evidence | None:
    """Return the next change of the parameters; None if it is not determined, or if the alternative is unlikely."""
    further = None if found.z < SHOWN - 1.0 else direction_of(found)
    more = None if further is None else each_added(found.read.fits, [further.columns])[0]
    if more is None or further is None or further.parameters == 1:
        return more
    return replace(more, value=np.clip(more.value, -further.largest, further.largest))  # together they diverge


def direction_of(found: Exact) -> Alternative | None:
    """Return the small alternative of further changes of an alternative's parameters; None if it has none."""
    fit, key = reference(found.read.problem), found.alternative.key
    own = [family for family in FAMILIES if family.name == key[0]]
    own += [replace(family, directions=family.refining) for family in own]
    return next((each for each in directions(fit, found.read, own) if each.key == key), None)


def compared(logs: Logs, alternative: Alternative) -> Exact | None:
    """Evaluate an alternative exactly; None if the logs cannot be filtered under its hypothesis."""
    try:
        score = scored_as(read_as(logs, alternative.hypothesis).fits.score, alternative.hypothesis)
    except IdentificationError:
        return None
    return Exact(alternative, log_density_improvement(logs.fits.score, score), logs, score)
