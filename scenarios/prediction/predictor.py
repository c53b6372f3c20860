"""What each source of a scenario costs its gains, one after the other, from one linearised estimate."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.support.arrays import Array, Indices
from scenarios.experiments.build import Setup, changed, setup_of
from scenarios.experiments.files.draws import numbers_needed, settings_from
from scenarios.experiments.files.schema import DrawTable, Scenario
from scenarios.experiments.files.settings import Value, value_at, with_settings
from scenarios.experiments.studies.sources import Sources, settings_with, sources_of
from scenarios.prediction.expected import Expected, added_currents, enough, expected_logs, louder
from scenarios.prediction.linear import Linearised, linearised
from scenarios.prediction.moments import points_of
from scenarios.prediction.noise import noise_variances
from scenarios.support.errors import StudyError
from sim.experiment import Experiment

OTHER = "noise that is no source"
NO_SPECTRUM = "no first-order model for"
TAKEN = ("plant.", "experiment.sensors.")
"""Beginnings of places that change what is logged along the same motion."""
AGAIN = ("belief.", "identification.", "experiment.motion", "experiment.protocol")
"""Beginnings of places that the estimate is made again for."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cost:
    """What one source costs the gains, relative to them; arrays are (k,).

    Attributes:
        source: Its name.
        bias: Mean error.
        std: Standard deviation of the error.
    """

    source: str
    bias: Array
    std: Array

    @property
    def rms(self) -> Array:
        """Root mean square of the error."""
        return np.hypot(self.bias, self.std)


@dataclass(frozen=True, slots=True, eq=False)
class _Outcome:
    """What one setting of a source makes of the motions and their logs, and the gains that are true there."""

    experiments: tuple[Experiment, ...]
    logs: tuple[Expected, ...]
    gain: Array


class Predictor:
    """Predicts one source after the other from one linearised estimate.

    Attributes:
        linear: The estimate.
        joints: The k joints that have a gain and are wanted, from 0, shape (k,).
    """

    def __init__(self, linear: Linearised, sources: Sources, joints: Indices) -> None:
        """Prepare what all sources are held against.

        Args:
            linear: The estimate.
            sources: Of its scenario.
            joints: As above.

        Raises:
            PlantError: If a plant cannot be built.
        """
        self.linear, self.joints = linear, joints
        self._rows = np.searchsorted(linear.estimate.solution.joints, joints)
        self._off = with_settings(sources.scenario, settings_with(sources, {}).settings)
        self._quiet = self._outcome({})
        tables = sources.scenario.table.sources
        streams = {name: np.full(1, 0.5) for name, source in tables.items() if source.stream is not None}
        loud = self._outcome(settings_with(sources, streams).settings)
        self._variances = noise_variances(linear, loud.logs)
        self._left = noise_variances(linear, self._quiet.logs)

    def noise(self, name: str, stream: str) -> Cost:
        """A noise at its size, all else off."""
        if stream not in self._variances:
            raise StudyError(f"{NO_SPECTRUM} {stream}")
        return self._of_noise(name, self._variances[stream] - self._left.get(stream, 0.0))

    @property
    def unknown(self) -> tuple[str, ...]:
        """Streams of noise that is on with every source off, of whose spectrum nothing is known."""
        return tuple(dict.fromkeys(name for each in self._quiet.logs for name in each.unknown))

    def other_noise(self) -> list[Cost]:
        """What noise is on with every source off."""
        return [self._of_noise(OTHER, sum(self._left.values(), np.zeros(1)))] if self._left else []

    def drawn(self, name: str, source: DrawTable) -> Cost:
        """A source that is drawn, all else off."""
        points = points_of(source, self._off.table)
        if points.equal:
            errors = np.array([self.error(source, each) for each in points.equal])
            return Cost(source=name, bias=errors.mean(axis=0), std=errors.std(axis=0))
        bias = self.error(source, points.mean)
        steps = np.array([self.error(source, each) - bias for each in points.deviated])
        return Cost(source=name, bias=bias, std=np.linalg.norm(steps, axis=0))

    def error(self, source: DrawTable, settings: Mapping[str, Value]) -> Array:
        """Relative error of the gains at settings of a source, all else off, shape (k,).

        What changes the log is told from the change of its currents, for anything else the estimate is made again.

        Raises:
            StudyError: If neither sees it.
            ScenarioError: If the settings do not fit.
        """
        odd = [place for place in source.targets if not place.startswith((*TAKEN, *AGAIN))]
        if odd:
            raise StudyError(f"{odd[0]}: control is assumed perfect, so this source has no effect")
        logged = all(place.startswith(TAKEN) for place in source.targets)
        return self._by_currents(settings) if logged else self._again(settings)

    def _by_currents(self, settings: Mapping[str, Value]) -> Array:
        outcome = self._outcome(settings)
        for quiet, experiment in zip(self._quiet.logs, outcome.experiments, strict=True):
            if stronger := louder(quiet, experiment.sensors, self.linear.every):
                raise StudyError(
                    f"it varies the level of a noise, {stronger[0]}; declare the noise as a source by its stream"
                )
        inverse = 1.0 / self._quiet.gain[self.joints]
        inverse = inverse + self.linear.change(added_currents(outcome.logs, self._quiet.logs))[self._rows]
        return 1.0 / (inverse * outcome.gain[self.joints]) - 1.0

    def _again(self, settings: Mapping[str, Value]) -> Array:
        if all(value_at(self.linear.setup.scenario.table, place) == value for place, value in settings.items()):
            return np.zeros(len(self.joints))
        with_it = linearised(changed(self.linear.setup, settings), self.linear.every)
        before, now = self.linear.estimate.solution, with_it.estimate.solution
        if not np.isin(self.joints, now.joints).all():
            raise StudyError("with it, other joints are identifiable")
        at = np.searchsorted(now.joints, self.joints)
        truth = with_it.setup.true_gain[self.joints] / self.linear.setup.true_gain[self.joints]
        return before.inverse[self._rows] / (now.inverse[at] * truth) - 1.0

    def _of_noise(self, name: str, variance: Array) -> Cost:
        std = np.sqrt(variance[self._rows]) * np.abs(self._quiet.gain[self.joints])
        return Cost(source=name, bias=np.zeros(len(std)), std=std)

    def _outcome(self, settings: Mapping[str, Value]) -> _Outcome:
        setup: Setup = setup_of(with_settings(self._off, settings))
        logs = expected_logs(setup, self.linear.every)
        return _Outcome(tuple(setup.experiments), logs, setup.true_gain)


def predictor_of(scenario: Scenario) -> Predictor:
    """Linearise the estimate of a scenario's gains.

    Every source stands at its median, and there is one realisation of the scenario's own noise: a method that lets data
    choose a model chooses it there.

    Raises:
        StudyError: If the scenario declares no error sources, or wants no gain; if its method has no first order.
        ScenarioError: If a source is wrong.
        IdentificationError: If there is nothing to identify.
        SimulationError: If a plant cannot be built.
    """
    sources = sources_of(scenario)
    wanted = np.flatnonzero(scenario.table.tolerance.identifiable)
    if not wanted.size:
        raise StudyError(f"{scenario.name}: tolerance.identifiable lists no joint, so there is no error to attribute")
    middle = {name: np.full(width, 0.5) for name, width in sources.width.items()}
    setup = setup_of(with_settings(scenario, {**_medians(scenario), **settings_with(sources, middle).settings}))
    linear = linearised(setup, enough(setup))
    return Predictor(linear, sources, wanted[linear.estimate.identifiable[wanted]])


def _medians(scenario: Scenario) -> dict[str, Value]:
    """What a scenario draws, at the medians."""
    settings = dict[str, Value]()
    table = scenario.table
    for draw in scenario.table.random.values():
        settings |= settings_from(draw, np.full(numbers_needed(draw, table), 0.5), table)
    return settings
