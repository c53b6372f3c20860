"""Error of the gains from each source of a scenario, from one linearised estimate."""

from collections.abc import Mapping

import numpy as np

from ident.support.arrays import Array, Indices
from scenarios.experiments.draws import numbers_needed, settings_from
from scenarios.experiments.scenario import Value, value_at, with_settings
from scenarios.experiments.schema import DrawTable, Scenario
from scenarios.experiments.sensitivity import Sources, settings_with, sources_of
from scenarios.experiments.setup import Setup, changed, setup_of
from scenarios.prediction.expected import Expected, enough, expected_logs, louder
from scenarios.prediction.linear import Linearised, linearised
from scenarios.prediction.moments import Moments, points_of
from scenarios.support.errors import StudyError

NO_SPECTRUM = "no first-order model for"
TAKEN = ("plant.", "experiment.sensors.")
"""Key paths (beginnings) that change the logs of the same motion."""
AGAIN = ("belief.", "identification.", "experiment.motion", "experiment.protocol")
"""Key paths (beginnings) that need a new estimate."""


class Predictor:
    """Predicts the errors from sources with one linearised estimate.

    Attributes:
        linear: The estimate.
        joints: The k joints with a gain that is required, from 0, shape (k,).
    """

    def __init__(self, linear: Linearised, sources: Sources, joints: Indices) -> None:
        """Prepare the logs and their noise with every source off.

        Raises:
            PlantError: If a plant cannot be built.
        """
        self.linear, self.joints = linear, joints
        self._rows = np.searchsorted(linear.estimate.solution.joints, joints)
        self._off = with_settings(sources.scenario, settings_with(sources, {}).settings)
        self._quiet, self._quiet_logs = self._logged({})
        tables = sources.scenario.table.sources
        streams = {name: np.full(1, 0.5) for name, source in tables.items() if source.stream is not None}
        _, loud = self._logged(settings_with(sources, streams).settings)
        self._variances = linear.noise_variances(loud)
        self._left = linear.noise_variances(self._quiet_logs)

    def noise(self, stream: str) -> Moments:
        """Return the error from a noise at its size, all other sources off.

        Raises:
            StudyError: If its spectrum is unknown.
        """
        if stream not in self._variances:
            raise StudyError(f"{NO_SPECTRUM} {stream}")
        return self._of_noise(self._variances[stream] - self._left.get(stream, 0.0))

    @property
    def unknown(self) -> tuple[str, ...]:
        """Noise streams of unknown spectrum that are on with every source off."""
        return tuple(dict.fromkeys(name for each in self._quiet_logs for name in each.unknown))

    @property
    def other_noise(self) -> Moments | None:
        """Error from noise that is on with every source off, None if there is none."""
        return self._of_noise(sum(self._left.values(), np.zeros(1))) if self._left else None

    def drawn(self, source: DrawTable) -> Moments:
        """Return the error from a drawn source, all others off.

        Raises:
            StudyError: As `error`; if a number has no mean or standard deviation.
            ScenarioError: If the draw is not possible.
        """
        return points_of(source, self._off.table).moments(lambda settings: self.error(source, settings))

    def error(self, source: DrawTable, settings: Mapping[str, Value]) -> Array:
        """Return the relative error of the gains at settings of a source, all others off, shape (k,).

        If only the currents change, the linearised estimate is used; otherwise a new estimate is made.

        Raises:
            StudyError: If neither is possible.
            ScenarioError: If the settings are not valid.
        """
        odd = [place for place in source.targets if not place.startswith((*TAKEN, *AGAIN))]
        if odd:
            raise StudyError(f"{odd[0]}: control is assumed perfect, so the effect of this source is not predicted")
        logged = all(place.startswith(TAKEN) for place in source.targets)
        return self._by_currents(settings) if logged else self._again(settings)

    def _by_currents(self, settings: Mapping[str, Value]) -> Array:
        setup, logs = self._logged(settings)
        for quiet, experiment in zip(self._quiet_logs, setup.experiments, strict=True):
            if stronger := louder(quiet, experiment.sensors, self.linear.every):
                raise StudyError(
                    f"it varies the level of a noise, {stronger[0]}; declare the noise itself as a source (key stream)"
                )
        inverse = 1.0 / self._quiet.true_gain[self.joints]
        inverse = inverse + self.linear.change(logs, self._quiet_logs)[self._rows]
        return 1.0 / (inverse * setup.true_gain[self.joints]) - 1.0

    def _again(self, settings: Mapping[str, Value]) -> Array:
        own = self.linear.setup
        if all(value_at(own.scenario.table, place) == value for place, value in settings.items()):
            return np.zeros(len(self.joints))
        with_it = linearised(changed(own, settings), self.linear.every)
        before, now = self.linear.estimate.solution, with_it.estimate.solution
        lost = np.setdiff1d(self.joints, now.joints)
        if lost.size:
            raise StudyError(f"with this source, joint {', '.join(map(str, lost + 1))} is not identifiable")
        at = np.searchsorted(now.joints, self.joints)
        truth = with_it.setup.true_gain[self.joints] / own.true_gain[self.joints]
        return before.inverse[self._rows] / (now.inverse[at] * truth) - 1.0

    def _of_noise(self, variance: Array) -> Moments:
        std = np.sqrt(variance[self._rows]) * np.abs(self._quiet.true_gain[self.joints])
        return Moments(np.zeros(len(std)), std)

    def _logged(self, settings: Mapping[str, Value]) -> tuple[Setup, tuple[Expected, ...]]:
        """Return the scenario with these settings and all sources off, and its logs."""
        setup = setup_of(with_settings(self._off, settings))
        return setup, expected_logs(setup, self.linear.every)


def predictor_of(scenario: Scenario) -> Predictor:
    """Linearise the estimate of a scenario's gains.

    Random values and sources have their medians, and there is one realisation of the scenario's noise, with which
    methods select their model.

    Raises:
        StudyError: If the scenario declares no error sources or requires no gain; if there is no first-order model of
            its method.
        ScenarioError: If a source is wrong.
        IdentificationError: If there is no gain to identify.
        SimulationError: If a plant cannot be built.
    """
    sources, table = sources_of(scenario), scenario.table
    wanted = np.flatnonzero(table.tolerance.identifiable)
    if not wanted.size:
        raise StudyError(f"{scenario.name}: tolerance.identifiable lists no joint, so there is no error to attribute")
    middle = dict[str, Value]()
    for draw in table.random.values():
        middle |= settings_from(draw, np.full(numbers_needed(draw, table), 0.5), table)
    middle |= settings_with(sources, {name: np.full(width, 0.5) for name, width in sources.width.items()}).settings
    setup = setup_of(with_settings(scenario, middle))
    linear = linearised(setup, enough(setup))
    return Predictor(linear, sources, wanted[linear.estimate.identifiable[wanted]])
