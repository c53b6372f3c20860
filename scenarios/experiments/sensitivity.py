"""Sensitivity: effect of each error source of a scenario.

Uniform numbers determine the value of a drawn source, or the seed of a noise, whose size stays the same. A study has
two designs. One at a time: no source, each source alone at its declared size, and all together. Sobol (Saltelli et al.
2010): all sources at once on matrices A and B of uniform numbers, and, for each source, on A with that source's columns
taken from B.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from ident.support.arrays import Array
from scenarios.experiments.draws import check_draws, numbers_needed, places_of, settings_from
from scenarios.experiments.run import Trial
from scenarios.experiments.scenario import Value, value_at
from scenarios.experiments.schema import Scenario, ScenarioTable, SourceTable
from scenarios.experiments.setup import setup_of
from scenarios.experiments.study import Study
from scenarios.experiments.trials import trial_schema
from scenarios.support.errors import ScenarioError, StudyError, WrongDraw

NONE, ALL = "(none)", "(all)"
"""Labels of trials that are not of one source alone."""
ALONE, SOBOL = "one-at-a-time", "sobol"
TOGETHER = 4
"""Ratio of the number of trials with all sources to that of one source alone."""
LABELS: tuple[str, ...] = ("design", "source", "sample")
LARGEST = 2**16
"""Largest number of repeats or samples: such a Sobol design takes two hundred core hours."""
STREAM_SEEDS = 2**31


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

    @property
    def names(self) -> list[str]:
        """Names of the sources."""
        return list(self.width)

    def columns(self, name: str) -> slice:
        """Return the columns of a source in the matrix of all sources."""
        start = sum(list(self.width.values())[: self.names.index(name)])
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
            raise WrongDraw(f"{scenario.name}: sources.{name}: {error}") from error
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


def sensitivity(scenario: Scenario, *, repeats: int, samples: int, seed: int) -> Study:
    """Return the study of both designs.

    Trials by number: no source, each source alone, all together, then Saltelli's matrices row by row.

    Args:
        scenario: The scenario with its `sources`.
        repeats: Trials of each source alone, a power of 2 from 2 to `LARGEST`; all together get four times as many.
        samples: Rows of the Sobol matrices, also a power of 2; the design has (sources + 2) times as many trials.
        seed: Seed of both designs.

    Raises:
        StudyError: If a number is not such a power of 2.
        ScenarioError: If the scenario declares no sources or wrong ones.
    """
    for name, number in (("repeats", repeats), ("samples", samples)):
        if not 2 <= number <= LARGEST or number & (number - 1):
            text = str(number) if number < 10**20 else f"{str(number)[:6]}... ({len(str(number))} digits)"
            raise StudyError(f"{name} = {text}: expected a power of 2 up to {LARGEST}, such as 16 or 64")
    check_draws(scenario, setup_of)
    if not any(scenario.table.tolerance.identifiable):
        raise StudyError(f"{scenario.name}: tolerance.identifiable lists no joint, so there is no error to attribute")
    sources = sources_of(scenario)
    names, width = sources.names, sum(sources.width.values())

    def alone(index: int, sample: int) -> dict[str, Array]:
        return {names[index]: _uniform(sources.width[names[index]], repeats, seed, 2 + index)[sample]}

    def every(row: Array) -> dict[str, Array]:
        return {name: row[sources.columns(name)] for name in names}

    def trial(number: int) -> Trial:
        index, sample = divmod(number - 1, repeats)
        rest = number - 1 - (len(names) + TOGETHER) * repeats
        if number == 0:
            design, source, sample, on = ALONE, NONE, 0, dict[str, Array]()
        elif index < len(names):
            design, source, on = ALONE, names[index], alone(index, sample)
        elif rest < 0:
            sample = rest + TOGETHER * repeats
            design, source, on = ALONE, ALL, every(_uniform(width, TOGETHER * repeats, seed, 1)[sample])
        else:
            sample, column = divmod(rest, len(names) + 2)
            design, source = SOBOL, ("A", "B", *names)[column]
            A, B = np.split(_uniform(2 * width, samples, seed, 0)[sample], 2)
            row = B if source == "B" else A.copy()
            if column > 1:
                row[sources.columns(source)] = B[sources.columns(source)]
            on = every(row)
        switched = settings_with(sources, on)
        labels = dict(zip(LABELS, (design, source, str(sample)), strict=True))
        return Trial(number=number, seed=seed, settings=switched.settings, streams=switched.streams, labels=labels)

    return Study(
        kind="sensitivity",
        scenario=scenario,
        count=1 + (len(names) + TOGETHER) * repeats + (len(names) + 2) * samples,
        trial=trial,
        schema=trial_schema(scenario, places_of(scenario.table.sources), LABELS),
        identity={"seed": seed, "repeats": repeats, "samples": samples},
    )


@lru_cache(maxsize=64)
def _uniform(width: int, count: int, seed: int, stream: int) -> Array:
    """Return a scrambled Sobol sequence, shape (count, width), strictly inside (0, 1)."""
    rng = np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=(stream,)))
    points = qmc.Sobol(width, scramble=True, rng=rng).random(count)
    return np.clip(points, 2.0**-30, 1.0 - 2.0**-30)
