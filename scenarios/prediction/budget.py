"""The error budget of a scenario, predicted: what each source costs each gain, and what they cost together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from ident.arrays import Array, Indices
from ident.errors import IdentificationError
from ident.estimate import RefusedGain
from scenarios.build import Bench, bench
from scenarios.errors import NoSources, ScenarioError
from scenarios.files.draws import numbers_needed, settings_from
from scenarios.files.resolved import resolved
from scenarios.files.schema import DrawTable, Scenario
from scenarios.files.settings import Value, value_at, with_settings
from scenarios.prediction.expected import Expected, added_currents, enough, expected_logs
from scenarios.prediction.linear import Linearised, linearised
from scenarios.prediction.moments import points_of
from scenarios.prediction.noise import noise_variances
from scenarios.studies.sensitivity import Sources, settings_with, sources_of
from sim.errors import SimulationError

OTHER = "noise that is no source"
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


@dataclass(frozen=True, slots=True)
class Unpredicted:
    """A source without a prediction, and why."""

    source: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PredictedBudget:
    """The predicted error budget of a scenario.

    Attributes:
        scenario: Its name.
        method: Of identification.
        joints: The k joints with a gain, from 0, shape (k,).
        refused: Why other joints of the tolerance's have none, by joint, from 0.
        remarks: What the method assumed.
        tolerance: Of each gain, shape (k,).
        costs: One a source, the largest first.
        unpredicted: Sources without prediction.
    """

    scenario: str
    method: str
    joints: Indices
    refused: Mapping[int, str]
    remarks: tuple[str, ...]
    tolerance: Array
    costs: tuple[Cost, ...]
    unpredicted: tuple[Unpredicted, ...]

    @property
    def together(self) -> Cost:
        """All sources at once, independent of each other: biases add by sign, variances add."""
        bias, variance = np.zeros(len(self.joints)), np.zeros(len(self.joints))
        for cost in self.costs:
            bias, variance = bias + cost.bias, variance + cost.std**2
        return Cost(source="all together", bias=bias, std=np.sqrt(variance))

    @property
    def within(self) -> Array:
        """Share of errors inside the tolerance if they are normal, shape (k,)."""
        both = self.together
        std = np.maximum(both.std, 1e-300)
        upper, lower = (self.tolerance - both.bias) / std, (-self.tolerance - both.bias) / std
        return stats.norm.cdf(upper) - stats.norm.cdf(lower)


def predicted_budget(scenario: Scenario) -> PredictedBudget:
    """Predict the error budget of a scenario.

    The estimate is linearised where every source stands at its median, with one realisation of the scenario's own
    noise: a method that lets data choose a model chooses it there.

    Raises:
        NoSources: If the scenario declares no error sources.
        NotLinear: If its method has no first order.
        ScenarioError: If a source is wrong.
        IdentificationError: If there is nothing to identify.
        SimulationError: If a plant cannot be built.
    """
    sources = sources_of(scenario)
    base = resolved(scenario)
    middle = {name: np.full(width, 0.5) for name, width in sources.width.items()}
    typical = {**_medians(base), **settings_with(sources, middle).settings}
    prepared = bench(with_settings(base, typical))
    linear = linearised(prepared, enough(prepared))
    wanted = [j for j, is_wanted in enumerate(base.table.tolerance.identifiable) if is_wanted]
    if not wanted:
        raise NoSources(f"{scenario.name}: tolerance.identifiable wants no joint's gain, so there is no error to share")
    found = [j for j in linear.estimate.solution.joints.tolist() if j in wanted and linear.estimate.identifiable[j]]
    rows = np.flatnonzero(np.isin(linear.estimate.solution.joints, found))
    off = with_settings(base, settings_with(sources, {}).settings)
    predictor = _Predictor(linear, off, rows, sources)
    costs, unpredicted = list[Cost](), list[Unpredicted]()
    for name, source in scenario.table.sources.items():
        try:
            costs.append(predictor.noise(name, source.stream) if source.stream else predictor.drawn(name, source))
        except _NoPrediction as error:
            unpredicted.append(Unpredicted(name, str(error)))
        except (ScenarioError, SimulationError, IdentificationError) as error:
            unpredicted.append(Unpredicted(name, str(error)))
    costs += predictor.other_noise()
    return PredictedBudget(
        scenario=scenario.name,
        method=linear.estimate.method,
        joints=linear.estimate.solution.joints[rows],
        refused={j: _reason(linear, j) for j in wanted if j not in found},
        remarks=linear.estimate.remarks,
        tolerance=np.array(base.table.tolerance.gain)[linear.estimate.solution.joints[rows]],
        costs=tuple(sorted(costs, key=lambda cost: -float(np.max(cost.rms, initial=0.0)))),
        unpredicted=tuple(unpredicted),
    )


class _NoPrediction(Exception):
    """Why a source is not predicted."""


@dataclass(frozen=True, slots=True, eq=False)
class _Outcome:
    """Logs that one setting of a source leads to, and the gains that are true there."""

    logs: tuple[Expected, ...]
    gain: Array


class _Predictor:
    """Predicts one source after the other from one linearised estimate."""

    def __init__(self, linear: Linearised, off: Scenario, rows: Indices, sources: Sources) -> None:
        self._linear, self._off, self._rows = linear, resolved(off), rows
        self._joints = linear.estimate.solution.joints[rows]
        self._quiet = self._outcome({})
        tables = sources.scenario.table.sources
        streams = {name: np.full(1, 0.5) for name, source in tables.items() if source.stream is not None}
        loud = self._outcome(settings_with(sources, streams).settings)
        self._variances = noise_variances(linear, loud.logs)
        self._left = noise_variances(linear, self._quiet.logs)

    def noise(self, name: str, stream: str) -> Cost:
        """A noise at its size, all else off."""
        if stream not in self._variances:
            raise _NoPrediction(f"nothing is known of the spectrum of {stream}")
        return self._of_noise(name, self._variances[stream] - self._left.get(stream, 0.0))

    def other_noise(self) -> list[Cost]:
        """What noise is on with every source off."""
        return [self._of_noise(OTHER, sum(self._left.values(), np.zeros(1)))] if self._left else []

    def drawn(self, name: str, source: DrawTable) -> Cost:
        """A source that is drawn, all else off."""
        answer = self._answer(source)
        points = points_of(source, self._off.table)
        if points.equal:
            errors = np.array([answer(each) for each in points.equal])
            return Cost(source=name, bias=errors.mean(axis=0), std=errors.std(axis=0))
        bias = answer(points.mean)
        steps = np.array([answer(each) - bias for each in points.deviated])
        return Cost(source=name, bias=bias, std=np.linalg.norm(steps, axis=0))

    def _answer(self, source: DrawTable) -> Callable[[Mapping[str, Value]], Array]:
        """What gives the error at settings of a source: from the change of currents, or the estimate made again."""
        if all(place.startswith(TAKEN) for place in source.targets):
            return self._by_currents
        if all(place.startswith((*TAKEN, *AGAIN)) for place in source.targets):
            return self._again
        odd = next(place for place in source.targets if not place.startswith((*TAKEN, *AGAIN)))
        raise _NoPrediction(f"{odd}: control is taken to be perfect, and a change of it to cost nothing")

    def _by_currents(self, settings: Mapping[str, Value]) -> Array:
        outcome = self._outcome(settings)
        inverse = 1.0 / self._quiet.gain[self._joints]
        inverse = inverse + self._linear.change(added_currents(outcome.logs, self._quiet.logs))[self._rows]
        return 1.0 / (inverse * outcome.gain[self._joints]) - 1.0

    def _again(self, settings: Mapping[str, Value]) -> Array:
        if all(value_at(self._linear.bench.scenario.table, place) == value for place, value in settings.items()):
            return np.zeros(len(self._joints))
        with_it = linearised(bench(with_settings(self._linear.bench.scenario, settings)), self._linear.every)
        before, now = self._linear.estimate.solution, with_it.estimate.solution
        if not np.isin(self._joints, now.joints).all():
            raise _NoPrediction("the joints that have a gain are not the same with it")
        at = np.searchsorted(now.joints, self._joints)
        truth = with_it.bench.true_gain[self._joints] / self._linear.bench.true_gain[self._joints]
        return before.inverse[self._rows] / (now.inverse[at] * truth) - 1.0

    def _of_noise(self, name: str, variance: Array) -> Cost:
        std = np.sqrt(variance[self._rows]) * np.abs(self._quiet.gain[self._joints])
        return Cost(source=name, bias=np.zeros(len(std)), std=std)

    def _outcome(self, settings: Mapping[str, Value]) -> _Outcome:
        prepared: Bench = bench(with_settings(self._off, settings))
        return _Outcome(expected_logs(prepared, self._linear.every), prepared.true_gain)


def _medians(scenario: Scenario) -> dict[str, Value]:
    """What a scenario draws, at the medians."""
    settings = dict[str, Value]()
    table = resolved(scenario).table
    for draw in scenario.table.random.values():
        settings |= settings_from(draw, np.full(numbers_needed(draw, table), 0.5), table)
    return settings


def _reason(linear: Linearised, joint: int) -> str:
    found = linear.estimate.joints[joint]
    assert isinstance(found, RefusedGain), "asked of joints without a gain"
    return found.reason
