"""Random settings of a scenario, drawn for one seed, and its error sources, switched one by one.

Every number is the distribution's quantile of a uniform number, so random and quasi-random designs use the same code.
Each draw has its own stream, so declaring another draw does not change it. A source is a draw, or the seed of a noise
of constant size.
"""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from ident.support.arrays import Array
from ident.support.errors import IdentificationError
from ident.support.naming import nearest
from scenarios.experiments.scenario import Value, setup_of, value_at, with_settings
from scenarios.experiments.schema import DrawTable, Scenario, ScenarioTable, SourceTable
from scenarios.support.errors import ScenarioError, StudyError, WrongValue
from sim.errors import SimulationError

CHECKED_AT = (1e-3, 0.5, 1.0 - 1e-3)
"""Quantiles at which a distribution is tested before it is used."""
STREAM_SEEDS = 2**31
"""Upper bound of the seeds of noises, exclusive."""
Number = float | tuple[float, ...]
"""A parameter of a distribution: one value, or one per number."""


def drawn_settings(scenario: Scenario, seed: int) -> dict[str, Value]:
    """Draw everything that a scenario declares random; the draw named k uses the stream of (seed, checksum of k).

    Returns:
        New values by key path; empty if nothing is random.

    Raises:
        WrongValue: If the target of a draw is not a number of the scenario, or the distribution does not exist.
    """
    table, settings = scenario.table, dict[str, Value]()
    for name, draw in table.random.items():
        key = np.random.SeedSequence(entropy=seed, spawn_key=(zlib.crc32(name.encode()),))
        try:
            uniform = np.random.default_rng(key).random(numbers_needed(draw, table))
            settings |= settings_from(draw, uniform, table)
        except ScenarioError as error:
            raise WrongValue(f"{scenario.name}: random.{name}: {error}") from error
    return settings


def places_of(draws: Mapping[str, DrawTable]) -> list[str]:
    """Return the key paths that draws change, in alphabetical order."""
    return sorted({place for draw in draws.values() for place in draw.targets})


def check_draws(scenario: Scenario) -> None:
    """Check that all draws and sources are possible, and that the scenario can be run with every choice.

    Raises:
        WrongValue: If a draw is not possible (the first one).
    """
    table = scenario.table
    drawn = {name: source for name, source in table.sources.items() if source.stream is None}
    for group, draws in (("random", table.random), ("sources", drawn)):
        for name, draw in draws.items():
            try:
                for u in CHECKED_AT:
                    settings_from(draw, np.full(numbers_needed(draw, table), u), table)
                for value in draw.choice or ():
                    setup_of(with_settings(scenario, dict.fromkeys(draw.targets, value)))
            except (ScenarioError, SimulationError, IdentificationError) as error:
                raise WrongValue(f"{scenario.name}: {group}.{name}: {error}") from error


def numbers_needed(draw: DrawTable, table: ScenarioTable) -> int:
    """Return the number of uniform numbers that a draw needs."""
    return 1 if draw.shared or draw.choice is not None else _size(draw, table)


def _size(draw: DrawTable, table: ScenarioTable) -> int:
    """Return the number of numbers in all targets of a draw."""
    return sum(np.size(np.asarray(value_at(table, place))) for place in draw.targets)


def settings_from(draw: DrawTable, uniform: Array, table: ScenarioTable) -> dict[str, Value]:
    """Return the values of a draw's targets from uniform numbers in (0, 1), shape (numbers_needed,).

    `add` and `multiply` start from the values of the table.

    Raises:
        ScenarioError: If a target does not exist.
        WrongValue: If distribution or parameters do not exist or do not fit.
    """
    if draw.choice is not None:
        if not draw.choice:
            raise WrongValue("choice is empty")
        chosen = draw.choice[min(int(uniform[0] * len(draw.choice)), len(draw.choice) - 1)]
        return dict.fromkeys(draw.targets, chosen)
    settings, used, total = dict[str, Value](), 0, _size(draw, table)
    for place in draw.targets:
        value = value_at(table, place)
        if isinstance(value, str):
            raise WrongValue(f"{place} is a name, {value!r}; draw it with choice = [...]")
        base = np.atleast_1d(np.asarray(value, dtype=np.float64))
        own = slice(used, used + len(base))
        used += len(base)
        numbers = _quantiles(draw, np.repeat(uniform, len(base)) if draw.shared else uniform[own], own, total)
        changed = {"replace": numbers, "add": base + numbers, "multiply": base * numbers}[draw.apply]
        settings[place] = changed.tolist() if isinstance(value, list) else float(changed[0])
    return settings


class Spread(NamedTuple):
    """Mean and standard deviation of a distribution; not finite if they do not exist."""

    mean: Array
    std: Array


def spread_of(draw: DrawTable, own: slice, total: int) -> Spread:
    """Return mean and standard deviation of a draw's distribution for one of its targets.

    `own` selects the target's numbers from the `total` numbers of all targets.

    Raises:
        WrongValue: If distribution or parameters do not exist or do not fit.
    """
    count, parameters = own.stop - own.start, _parameters(draw, own, total)
    _quantiles(draw, np.full(count, 0.5), own, total)  # raises if a draw is not possible
    with np.errstate(all="ignore"):
        distribution = _distribution(draw.distribution or "")
        mean, std = distribution.mean(**parameters), distribution.std(**parameters)
    return Spread(*(np.broadcast_to(np.asarray(x, np.float64), (count,)) for x in (mean, std)))


def _parameters(draw: DrawTable, own: slice, total: int) -> dict[str, Number]:
    """Return the parameters of some of a draw's numbers; an array has a value for each."""
    return {
        name: value[own] if isinstance(value, tuple) and len(value) == total else value
        for name, value in draw.parameters.items()
    }


def _quantiles(draw: DrawTable, uniform: Array, own: slice, total: int) -> Array:
    """Return the quantiles of a draw's distribution at uniform numbers, for one of its targets as in `spread_of`."""
    name, distribution = draw.distribution or "", _distribution(draw.distribution or "")
    shapes = [s.strip() for s in (distribution.shapes or "").split(",") if s.strip()]
    scaled = isinstance(distribution, Scaled | scipy.stats.rv_continuous)
    takes = [*shapes, "loc", *(["scale"] if scaled else [])]
    for parameter in draw.parameters:
        if parameter not in takes:
            raise WrongValue(
                f"{name} takes no parameter {parameter!r}{nearest(parameter, takes)}; it takes {', '.join(takes)}"
            )
    missing = [shape for shape in shapes if shape not in draw.parameters]
    if missing:
        raise WrongValue(f"{name} needs the parameter {', '.join(missing)}")
    stated = ", ".join(f"{k} = {v}" for k, v in draw.parameters.items()) or "no parameters"
    misfit = WrongValue(f"{name} with {stated}: expected numbers, or arrays of {len(uniform)}")
    try:
        with np.errstate(all="ignore"):
            numbers = np.asarray(distribution.ppf(uniform, **_parameters(draw, own, total)), dtype=np.float64)
    except ValueError as error:
        raise misfit from error
    if not np.isfinite(numbers).all():
        raise WrongValue(f"{name} with {stated} gives no finite numbers; is its scale above 0?")
    if numbers.shape != uniform.shape:
        raise misfit
    return numbers


class Scaled(NamedTuple):
    """A distribution with only location and scale, as in scipy.stats, whose import would take half a second.

    Attributes:
        quantiles: Quantile function for location 0 and scale 1.
        centre, spread: Mean and standard deviation for location 0 and scale 1.
        shapes: None.
    """

    quantiles: Callable[[Array], Array]
    centre: float
    spread: float
    shapes: None = None

    def ppf(self, uniform: Array, *, loc: Number = 0.0, scale: Number = 1.0) -> Array:
        """Return the quantiles at uniform numbers, NaN if the scale is not positive."""
        return np.where(np.asarray(scale) > 0.0, self.quantiles(uniform) * np.asarray(scale) + np.asarray(loc), np.nan)

    def mean(self, *, loc: Number = 0.0, scale: Number = 1.0) -> Array:
        """Mean."""
        return self.centre * np.asarray(scale) + np.asarray(loc)

    def std(self, *, loc: Number = 0.0, scale: Number = 1.0) -> Array:
        """Standard deviation."""
        return np.broadcast_to(self.spread * np.asarray(scale), np.broadcast_shapes(np.shape(loc), np.shape(scale)))


def _standard_normal(uniform: Array) -> Array:
    """Quantiles of the standard normal distribution; the median needs no special functions, whose import is slow."""
    return np.zeros_like(uniform) if np.all(uniform == 0.5) else scipy.special.ndtri(uniform)


SCALED = {
    "norm": Scaled(_standard_normal, 0.0, 1.0),
    "uniform": Scaled(np.asarray, 0.5, np.sqrt(1.0 / 12.0)),
}


@lru_cache(maxsize=64)
def _distribution(name: str) -> "Scaled | scipy.stats.rv_continuous | scipy.stats.rv_discrete":
    """Return a distribution of scipy.stats with its own quantile function; a numerical search may not end."""
    if name in SCALED:
        return SCALED[name]
    families = scipy.stats.rv_continuous, scipy.stats.rv_discrete
    known = [k for k, v in vars(scipy.stats).items() if isinstance(v, families)]
    if name not in known:
        raise WrongValue(f"no distribution {name!r} in scipy.stats{nearest(name, known)}")
    distribution = getattr(scipy.stats, name)
    if any(type(distribution)._ppf is family._ppf for family in families):
        raise WrongValue(f"{name} has no quantile function of its own; choose one that has, such as norm or gamma")
    return distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """The error sources of a scenario.

    Attributes:
        scenario: The scenario with its `sources` tables.
        width: Number of uniform numbers of each source, in the order of the tables.
        off: Settings that switch every source off.
    """

    scenario: Scenario
    width: Mapping[str, int]
    off: Mapping[str, Value]

    def columns(self, name: str) -> slice:
        """Return the columns of a source in the matrix of all sources."""
        start = sum(list(self.width.values())[: list(self.width).index(name)])
        return slice(start, start + self.width[name])


def sources_of(scenario: Scenario) -> Sources:
    """The sources of a scenario.

    Raises:
        ScenarioError: If it declares none, or the target of one does not exist.
    """
    table = scenario.table
    if not table.sources:
        raise StudyError(f"{scenario.name}: declares no error sources; add [sources.NAME] tables, as nominal.toml has")
    width, off = dict[str, int](), dict[str, Value]()
    for name, source in table.sources.items():
        try:
            width[name] = 1 if source.stream is not None else numbers_needed(source, table)
            off |= _settings(source, source.off, table)
        except ScenarioError as error:
            raise WrongValue(f"{scenario.name}: sources.{name}: {error}") from error
    return Sources(scenario=scenario, width=width, off=off)


class Switched(NamedTuple):
    """Switched sources: values of the scenario by key path, and seeds of the active noise streams."""

    settings: Mapping[str, Value]
    streams: Mapping[str, int]


def settings_with(sources: Sources, on: Mapping[str, Array]) -> Switched:
    """Switch sources. `on` has the uniform numbers of active sources, by name; all others are off."""
    table, settings, seeds = sources.scenario.table, dict(sources.off), dict[str, int]()
    for name, uniform in on.items():
        source = table.sources[name]
        if source.stream is None:
            settings |= settings_from(source, uniform, table)
        else:
            seeds[source.stream] = int(uniform[0] * STREAM_SEEDS)
            settings |= _settings(source, source.size, table)
    return Switched(settings, seeds)


def _settings(source: SourceTable, number: float | None, table: ScenarioTable) -> dict[str, Value]:
    """Return a number for every target of a source, also in lists; None keeps the value."""
    own = {place: value_at(table, place) for place in source.targets}
    if number is None:
        return own
    return {place: [number] * len(value) if isinstance(value, list) else number for place, value in own.items()}
