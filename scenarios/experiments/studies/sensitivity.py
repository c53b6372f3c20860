"""Sensitivity: effect of each error source of a scenario.

A study has two designs. One at a time: no source, each source alone at its declared size, and all together. Sobol
(Saltelli et al. 2010): all sources at once on matrices A and B of uniform numbers, and, for each source, on A with that
source's columns taken from B.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.stats import qmc

from ident.support.arrays import Array
from scenarios.experiments.build import setup_of
from scenarios.experiments.files.draws import check_draws, places_of
from scenarios.experiments.files.schema import Scenario
from scenarios.experiments.studies.sources import Sources, settings_with, sources_of
from scenarios.experiments.studies.study import Study
from scenarios.experiments.trials import Trial, trial_schema
from scenarios.support.errors import StudyError

NONE, ALL = "(none)", "(all)"
"""Labels of trials that are not of one source alone."""
ALONE, SOBOL = "one-at-a-time", "sobol"
TOGETHER = 4
"""Ratio of the number of trials with all sources to that of one source alone."""
LABELS: tuple[str, ...] = ("design", "source", "sample")
LARGEST = 2**16
"""Largest number of repeats or samples: such a Sobol design takes two hundred core hours."""


def sensitivity(scenario: Scenario, *, repeats: int, samples: int, seed: int) -> Study:
    """Return the study of both designs.

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
            raise StudyError(f"{name} = {_short(number)}: expected a power of 2 up to {LARGEST}, such as 16 or 64")
    check_draws(scenario, setup_of)
    if not any(scenario.table.tolerance.identifiable):
        raise StudyError(f"{scenario.name}: tolerance.identifiable lists no joint, so there is no error to attribute")
    sources = sources_of(scenario)
    plan = Plan(names=tuple(sources.names), repeats=repeats, samples=samples)
    return Study(
        kind="sensitivity",
        scenario=scenario,
        count=plan.count,
        trial=lambda number: _trial(sources, number, plan, seed),
        schema=trial_schema(scenario, places_of(scenario.table.sources), LABELS),
        identity={"seed": seed, "repeats": repeats, "samples": samples},
    )


@dataclass(frozen=True, slots=True)
class Planned:
    """A trial of a design: the active source, and the row of its uniform numbers."""

    design: str
    source: str
    sample: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """All trials of both designs, by number: no source, each source alone, all together, then Saltelli's matrices.

    `repeats` are the trials of each source alone, `samples` the rows of the matrices.
    """

    names: tuple[str, ...]
    repeats: int
    samples: int

    @property
    def count(self) -> int:
        """Trials."""
        return 1 + (len(self.names) + TOGETHER) * self.repeats + (len(self.names) + 2) * self.samples

    def __getitem__(self, number: int) -> Planned:
        """Return the trial of a number, from 0."""
        if number == 0:
            return Planned(ALONE, NONE, 0)
        source, sample = divmod(number - 1, self.repeats)
        if source < len(self.names):
            return Planned(ALONE, self.names[source], sample)
        rest = number - 1 - len(self.names) * self.repeats
        if rest < TOGETHER * self.repeats:
            return Planned(ALONE, ALL, rest)
        sample, column = divmod(rest - TOGETHER * self.repeats, len(self.names) + 2)
        return Planned(SOBOL, ("A", "B", *self.names)[column], sample)


def _trial(sources: Sources, number: int, plan: Plan, seed: int) -> Trial:
    planned = plan[number]
    switched = settings_with(sources, _uniform_of(sources, planned, plan, seed))
    labels = dict(zip(LABELS, (planned.design, planned.source, str(planned.sample)), strict=True))
    return Trial(number=number, seed=seed, settings=switched.settings, streams=switched.streams, labels=labels)


def _uniform_of(sources: Sources, planned: Planned, plan: Plan, seed: int) -> dict[str, Array]:
    """Return uniform numbers of the active sources of a trial, by name."""
    source, width = planned.source, sum(sources.width.values())
    if planned.design == SOBOL:
        both = _uniform(2 * width, plan.samples, seed, 0)[planned.sample]
        row, other = both[:width].copy(), both[width:]
        if source == "B":
            row = other
        elif source != "A":
            row[sources.columns(source)] = other[sources.columns(source)]
    elif source == ALL:
        row = _uniform(width, TOGETHER * plan.repeats, seed, 1)[planned.sample]
    elif source == NONE:
        return {}
    else:
        index = 2 + sources.names.index(source)
        return {source: _uniform(sources.width[source], plan.repeats, seed, index)[planned.sample]}
    return {name: row[sources.columns(name)] for name in sources.names}


def _short(number: int) -> str:
    text = str(number)
    return text if len(text) < 20 else f"{text[:6]}... ({len(text)} digits)"


@lru_cache(maxsize=64)
def _uniform(width: int, count: int, seed: int, stream: int) -> Array:
    """Return a scrambled Sobol sequence, shape (count, width), strictly inside (0, 1)."""
    rng = np.random.default_rng(np.random.SeedSequence(entropy=seed, spawn_key=(stream,)))
    points = qmc.Sobol(width, scramble=True, rng=rng).random(count)
    return np.clip(points, 2.0**-30, 1.0 - 2.0**-30)
