"""A scenario's error sources, and their switching.

Uniform numbers determine the value of a drawn source, or the seed of a noise, whose size stays the same.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ident.support.arrays import Array
from scenarios.experiments.files.draws import numbers_needed, settings_from
from scenarios.experiments.files.schema import Scenario, ScenarioTable, SourceTable
from scenarios.experiments.files.settings import Value, value_at
from scenarios.support.errors import ScenarioError, StudyError, WrongDraw

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
