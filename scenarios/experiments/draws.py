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
from scenarios.experiments.scenario_files import SEEDS
from scenarios.experiments.schema import DrawTable, Scenario, ScenarioTable, SourceTable
from scenarios.support.errors import ScenarioError, WrongValue
from sim.errors import SimulationError

CHECKED_AT = (1e-3, 0.5, 1.0 - 1e-3)
"""Quantiles at which a distribution is tested before it is used."""


def drawn_settings(scenario: Scenario, seed: int) -> dict[str, Value]:
    """Draw everything that a scenario declares random, by key path; draw k uses the stream of (seed, checksum of k)."""
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
    """Check that draws and sources are possible with every choice; raises `WrongValue` for the first that is not."""
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
    return 1 if draw.shared or draw.choice is not None else sum(map(np.size, _bases(draw, table).values()))


def _bases(draw: DrawTable, table: ScenarioTable) -> dict[str, float | list[float]]:
    bases = dict[str, float | list[float]]()
    for place in draw.targets:
        value = value_at(table, place)
        if isinstance(value, str):
            raise WrongValue(f"{place} is a name, {value!r}; draw it with choice = [...]")
        bases[place] = value
    return bases


def settings_from(draw: DrawTable, uniform: Array, table: ScenarioTable) -> dict[str, Value]:
    """Return the values of a draw's targets from uniform numbers in (0, 1), shape (numbers_needed,)."""
    if draw.choice is not None:
        if not draw.choice:
            raise WrongValue("choice is empty")
        chosen = draw.choice[min(int(uniform[0] * len(draw.choice)), len(draw.choice) - 1)]
        return dict.fromkeys(draw.targets, chosen)
    return applied(draw, _quantiles(draw, uniform, table), table)


def applied(draw: DrawTable, numbers: Array, table: ScenarioTable) -> dict[str, Value]:
    """Return the values of a draw's targets from a number for each of theirs, in order."""
    settings, used = dict[str, Value](), 0
    for place, value in _bases(draw, table).items():
        base = np.atleast_1d(np.asarray(value, dtype=np.float64))
        own = numbers[used : used + len(base)]
        used += len(base)
        changed = {"replace": own, "add": base + own, "multiply": base * own}[draw.apply]
        settings[place] = changed.tolist() if isinstance(value, list) else float(changed[0])
    return settings


def spread_of(draw: DrawTable, table: ScenarioTable) -> tuple[Array, Array]:
    """Return mean and standard deviation of each number of a draw, not finite if it has none."""
    middle = _quantiles(draw, np.full(numbers_needed(draw, table), 0.5), table)  # raises if a draw is not possible
    family, shapes, loc, scale = _distribution(draw, table)
    with np.errstate(all="ignore"):
        mean, std = loc + scale * family.mean(**shapes), scale * family.std(**shapes)
    return np.broadcast_to(mean, middle.shape), np.broadcast_to(std, middle.shape)


def _quantiles(draw: DrawTable, uniform: Array, table: ScenarioTable) -> Array:
    """Return the quantiles of a draw's distribution at uniform numbers, for each number of its targets."""
    family, shapes, loc, scale = _distribution(draw, table)
    total = sum(map(np.size, _bases(draw, table).values()))
    with np.errstate(all="ignore"):
        numbers = loc + np.where(scale > 0.0, scale, np.nan) * family.ppf(np.broadcast_to(uniform, total), **shapes)
    if not np.isfinite(numbers).all():
        stated = ", ".join(f"{k} = {v}" for k, v in draw.parameters.items()) or "no parameters"
        raise WrongValue(f"{draw.distribution} with {stated} gives no finite numbers; is its scale above 0?")
    return numbers


class Family(NamedTuple):
    """Distributions with loc 0 and scale 1 by their shapes; methods as in scipy.stats, whose import takes .3 s."""

    shapes: tuple[str, ...]
    ppf: Callable[..., Array]
    mean: Callable[..., Array | float]
    std: Callable[..., Array | float]


def _normal(u: Array) -> Array:
    return scipy.special.ndtri(u)


USUAL = {
    "norm": Family((), _normal, lambda: 0.0, lambda: 1.0),
    "uniform": Family((), np.positive, lambda: 0.5, lambda: 12.0**-0.5),
}


def _distribution(draw: DrawTable, table: ScenarioTable) -> tuple[Family, dict[str, Array], Array, Array]:
    """Return the family of a draw, shapes, loc and scale: arrays have a value per number of a target, or of all."""
    name, given = draw.distribution or "", {"loc": np.zeros(()), "scale": np.ones(())}
    family, sizes = USUAL.get(name) or _named(name), [np.size(base) for base in _bases(draw, table).values()]
    takes = [*family.shapes, *given]
    for key, value in draw.parameters.items():
        if key not in takes:
            raise WrongValue(f"{name} takes no parameter {key!r}{nearest(key, takes)}; it takes {', '.join(takes)}")
        array = np.asarray(value, dtype=np.float64)
        if array.ndim and len(array) != sum(sizes):
            if {len(array)} != set(sizes):
                raise WrongValue(f"{name} with {key} = {value}: expected numbers, or arrays of {sizes[0]}")
            array = np.tile(array, len(sizes))
        given[key] = array
    if missing := [shape for shape in family.shapes if shape not in given]:
        raise WrongValue(f"{name} needs the parameter {', '.join(missing)}")
    return family, {shape: given[shape] for shape in family.shapes}, given["loc"], given["scale"]


@lru_cache(maxsize=64)
def _named(name: str) -> Family:
    """Return a family of scipy.stats with its own quantile function; a numerical search may not end."""
    general = scipy.stats.rv_continuous
    known = [key for key, value in vars(scipy.stats).items() if isinstance(value, general)]
    if name not in known:
        raise WrongValue(f"no continuous distribution {name!r} in scipy.stats{nearest(name, known)}")
    found: scipy.stats.rv_continuous = getattr(scipy.stats, name)
    if type(found)._ppf is general._ppf:
        raise WrongValue(f"{name} has no quantile function of its own; choose one that has, such as norm or gamma")
    shapes = tuple(shape.strip() for shape in (found.shapes or "").split(",") if shape.strip())
    return Family(shapes, found.ppf, found.mean, found.std)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """The error sources of a scenario."""

    scenario: Scenario
    columns: Mapping[str, slice]  # of each source, in the order of the tables, in a matrix of uniform numbers
    off: Mapping[str, Value]  # settings that switch every source off

    @property
    def width(self) -> int:
        """Number of uniform numbers of all sources."""
        return max(each.stop for each in self.columns.values())


def sources_of(scenario: Scenario) -> Sources:
    """The sources of a scenario; `ScenarioError` if there are none, one has no such target, or no gain is required."""
    table, name = scenario.table, scenario.name
    if not table.sources:
        raise ScenarioError(f"{name}: declares no error sources; add [sources.NAME] tables, as nominal.toml has")
    if not any(table.tolerance.identifiable):
        raise ScenarioError(f"{name}: tolerance.identifiable lists no joint, so there is no error to attribute")
    columns, used, off = dict[str, slice](), 0, dict[str, Value]()
    for key, source in table.sources.items():
        try:
            columns[key] = slice(used, used := used + (1 if source.stream else numbers_needed(source, table)))
            off |= _settings(source, source.off, table)
        except ScenarioError as error:
            raise WrongValue(f"{name}: sources.{key}: {error}") from error
    return Sources(scenario=scenario, columns=columns, off=off)


def settings_with(sources: Sources, on: Mapping[str, Array]) -> tuple[dict[str, Value], dict[str, int]]:
    """Switch sources on, by name with their uniform numbers, and all others off.

    Returns values of the scenario by key path, and seeds of the active noise streams.
    """
    table, settings, seeds = sources.scenario.table, dict(sources.off), dict[str, int]()
    for name, uniform in on.items():
        source = table.sources[name]
        if source.stream is None:
            settings |= settings_from(source, uniform, table)
        else:
            seeds[source.stream] = int(uniform[0] * SEEDS)
            settings |= _settings(source, source.size, table)
    return settings, seeds


def _settings(source: SourceTable, number: float | None, table: ScenarioTable) -> dict[str, Value]:
    """Return a number for every target of a source, also in lists; None keeps the value."""
    own = {place: value_at(table, place) for place in source.targets}
    if number is None:
        return own
    return {place: [number] * len(value) if isinstance(value, list) else number for place, value in own.items()}
