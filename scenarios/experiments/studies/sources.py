"""A scenario's error sources, and how each is switched on and off.

A source that is drawn takes its value from its numbers, a noise its seed: its realisation varies, its size stays.
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
    """A scenario's error sources, ready to be switched.

    Attributes:
        scenario: With its `sources` tables.
        width: Uniform numbers that each source takes, in the order of the tables.
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
        """Columns of a source in a matrix that has all sources'."""
        start = sum(list(self.width.values())[: self.names.index(name)])
        return slice(start, start + self.width[name])


def sources_of(scenario: Scenario) -> Sources:
    """The sources of a scenario.

    Raises:
        ScenarioError: If it declares none, or one that names nothing of it.
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
    """Sources switched on and off: values of the scenario by place, and seeds of the noise streams that are on."""

    settings: Mapping[str, Value]
    streams: Mapping[str, int]


def settings_with(sources: Sources, on: Mapping[str, Array]) -> Switched:
    """Switch sources. Those that are `on` have uniform numbers, by name; all others are off."""
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
    """A number at every place of a source, in lists too; None leaves what is there."""
    own = {place: value_at(table, place) for place in source.targets}
    if number is None:
        return own
    return {place: [number] * len(value) if isinstance(value, list) else number for place, value in own.items()}
