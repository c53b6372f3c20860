"""The predicted error budget of a scenario: error of each gain from each source, and from all together."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from operator import itemgetter
from statistics import NormalDist

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnose import horizon
from ident.diagnosis.diagnosis import Exclusion
from ident.estimation.estimate import RefusedGain
from ident.support.arrays import Array, Indices
from ident.support.errors import IdentificationError
from scenarios.experiments.draws import applied, numbers_needed, settings_from, settings_with, sources_of, spread_of
from scenarios.experiments.scenario import Setup, Value, changed, setup_of, value_at, with_settings
from scenarios.experiments.schema import TURNS, DrawTable, Scenario, ScenarioTable, in_turns
from scenarios.prediction.predictor import Expected, Linearised, enough, expected_logs
from scenarios.rendering.content import Cell, Mood, Paragraph, Part, column, table
from scenarios.rendering.plot import SERIES, Plot, draw_bars
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.rendering.wording import percent
from scenarios.results.diagnoses import PLANNED_LOGS, DiagnosedResult, horizon_fold
from scenarios.results.gains import budget_verdict
from scenarios.support.errors import ScenarioError
from sim.errors import PlantError, SimulationError
from sim.feedforward_currents import check_torque_limits

NO_SPECTRUM = "no first-order model for"
TAKEN = ("plant.", "experiment.sensors.")
"""Key paths (beginnings) that change the logs of the same motion."""
AGAIN = ("belief.", "identification.", "experiment.motion", "experiment.protocol")
"""Key paths (beginnings) that need a new estimate."""
Settings = Mapping[str, Value]
OTHER = "noise that is no source"
MEANING = (
    "First-order rms relative error from each source alone, at its declared size. All together: sums of "
    "biases (signed) and of variances. Within: share of runs within tolerance, for normal errors."
)
CONTROL = "Assumes perfect control, independent sources and additive effects; nothing was simulated."
NO_DRIFT = f"gains that are equal in bare and loaded motions (the order {', '.join(TURNS)} measures a change)"
"""Assumption of scenarios whose protocol does not show drift."""
LEAST = 5e-6
"""Relative error of a source below which it is reported as 0."""


def moments(draw: DrawTable, table: ScenarioTable, error: Callable[[Settings], Array]) -> Array:
    """Return mean and standard deviation of the errors of k gains from a draw, shape (2, k).

    `error` returns the errors (k,) with some settings. It is linearised about the mean of all numbers, in steps of
    one standard deviation of each independent number; values of a set are each taken in turn.
    """
    if draw.choice is not None:
        middle = (np.arange(len(draw.choice)) + 0.5) / len(draw.choice)
        at = np.array([error(settings_from(draw, np.array([u]), table)) for u in middle])
        return np.stack((at.mean(axis=0), at.std(axis=0)))
    mean, std = spread_of(draw, table)
    if not (np.isfinite(mean).all() and np.isfinite(std).all()):
        said = f"distribution {draw.distribution} with these parameters has no finite mean or standard deviation"
        raise ScenarioError(f"{', '.join(draw.targets)}: {said}")
    bias = error(applied(draw, mean, table))
    steps = [std] if draw.shared else np.diag(std)
    return np.stack((bias, np.linalg.norm([error(applied(draw, mean + step, table)) - bias for step in steps], axis=0)))


class Predictor:
    """Predicts errors of a scenario's gains from its sources with one linearised estimate, at medians of all draws.

    `joints` are the k ones with a gain that is required, from 0; `other_noise` is the error from noise that is on with
    every source off, None without any, and `unknown` its streams of unknown spectrum.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Linearise the estimate, and prepare the logs and their noise with every source off; raises as either."""
        sources, table = sources_of(scenario), scenario.table
        wanted = np.flatnonzero(table.tolerance.identifiable)
        medians = {name: np.full(at.stop - at.start, 0.5) for name, at in sources.columns.items()}
        middle = dict[str, Value]()
        for draw in table.random.values():
            middle |= settings_from(draw, np.full(numbers_needed(draw, table), 0.5), table)
        middle |= settings_with(sources, medians)[0]
        self._off = with_settings(scenario, settings_with(sources, {})[0])
        setup = setup_of(with_settings(scenario, middle))
        try:
            self.linear = Linearised.of(setup, enough(setup))
        except PlantError:  # of the median of a source, which is then reported as not predicted
            setup = setup_of(self._off)
            self.linear = Linearised.of(setup, enough(setup))
        self.joints: Indices = wanted[self.linear.estimate.identifiable[wanted]]
        self._rows = np.searchsorted(self.linear.estimate.solution.joints, self.joints)
        self._quiet, self._quiet_logs = self._logged({})
        streams = {name: medians[name] for name, source in table.sources.items() if source.stream is not None}
        _, loud = self._logged(settings_with(sources, streams)[0])
        self._variances = self.linear.noise_variances(loud)
        self._left = self.linear.noise_variances(self._quiet_logs)
        self.unknown = tuple(dict.fromkeys(name for each in self._quiet_logs for name in each.unknown))
        self.other_noise = self._of_noise(sum(self._left.values(), np.zeros(1))) if self._left else None

    def noise(self, stream: str) -> Array:
        """Return mean and standard deviation of the errors from a noise alone, (2, k); `ScenarioError` if unknown."""
        if stream not in self._variances:
            raise ScenarioError(f"{NO_SPECTRUM} {stream}")
        return self._of_noise(self._variances[stream] - self._left.get(stream, 0.0))

    def drawn(self, source: DrawTable) -> Array:
        """Return mean and standard deviation of the errors from a drawn source, all others off, (2, k).

        The estimate is the linearised one if only currents change, else a new one; `ScenarioError` if neither can be.
        """
        odd = [place for place in source.targets if not place.startswith((*TAKEN, *AGAIN))]
        if odd:
            raise ScenarioError(f"{odd[0]}: control is assumed perfect, so the effect of this source is not predicted")
        logged = all(place.startswith(TAKEN) for place in source.targets)
        return moments(source, self._off.table, self._by_currents if logged else self._again)

    def _by_currents(self, settings: Settings) -> Array:
        setup, logs = self._logged(settings)
        for quiet, experiment in zip(self._quiet_logs, setup.experiments, strict=True):
            if stronger := quiet.louder(experiment.sensors):
                raise ScenarioError(
                    f"it varies the level of a noise, {stronger[0]}; declare the noise itself as a source (key stream)"
                )
        quiet, true = (
            each.gain_under([log.log.v for log in found])[self.joints]
            for each, found in ((self._quiet, self._quiet_logs), (setup, logs))
        )
        return 1.0 / ((1.0 / quiet + self.linear.change(logs, self._quiet_logs)[self._rows]) * true) - 1.0

    def _again(self, settings: Settings) -> Array:
        own = self.linear.setup
        if all(value_at(own.scenario.table, place) == value for place, value in settings.items()):
            return np.zeros(len(self.joints))
        same = all(place.startswith("identification.") for place in settings)  # logs
        with_it = Linearised.of(changed(own, settings), self.linear.every, self.linear.expected.motions if same else ())
        before, now = self.linear.estimate.solution, with_it.estimate.solution
        lost = np.setdiff1d(self.joints, now.joints)
        if lost.size:
            raise ScenarioError(f"with this source, joint {', '.join(map(str, lost + 1))} is not identifiable")
        at = np.searchsorted(now.joints, self.joints)
        truth = with_it.true_gain[self.joints] / self.linear.true_gain[self.joints]
        return before.inverse[self._rows] / (now.inverse[at] * truth) - 1.0

    def _of_noise(self, variance: Array) -> Array:
        std = np.sqrt(variance[self._rows]) * np.abs(self._quiet.true_gain[self.joints])
        return np.stack((np.zeros(len(std)), std))

    def _logged(self, settings: Settings) -> tuple[Setup, tuple[Expected, ...]]:  # with all sources off
        setup = setup_of(with_settings(self._off, settings))
        return setup, expected_logs(setup, self.linear.every)


class Cost(ResultModel):
    """Relative error of a gain from one source."""

    source: str  # name of the source or scenario
    bias: float  # mean of the relative error of the gain
    std: float  # standard deviation of the relative error of the gain

    @property
    def rms(self) -> float:
        """Root mean square of the relative error of the gain."""
        return float(np.hypot(self.bias, self.std))


class PredictedBudgetJoint(ResultModel):
    """Budget of one joint."""

    joint: int = Field(ge=1)  # number of the joint, from 1
    costs: list[Cost]  # one entry per source, sorted by the largest rms on any joint
    together: Cost  # all sources together: sums of the signed biases and of the variances
    tolerance: float  # largest relative error that passes
    within: float  # probability that the error is within the tolerance


class PredictedBudget(ResultModel):
    """What `rx90 predict --json` prints."""

    scenario: str  # name of the source or scenario
    method: str  # name of the estimator
    remarks: list[str]  # assumptions of the model
    joints: list[PredictedBudgetJoint]  # joints whose gain the scenario requires and that have one
    refused: list[dict[str, int | str]]  # joints whose gain the scenario requires and that have none, with the reason
    unpredicted: list[dict[str, str]]  # sources without a prediction, with the reason
    excluded: list[FromOne[Exclusion]]  # faults that logs of these motions will exclude
    untold: list[str]  # faults that logs of these motions cannot reveal

    @property
    def title(self) -> str:
        """One line."""
        sources = len(self.joints[0].costs) if self.joints else 0
        return f"Predicted error budget of scenario {self.scenario}, method {self.method}: {sources} sources"

    def parts(self) -> Iterable[Part]:
        """Return verdict, all sources together with tolerances, error from each source, remarks."""
        worst = [(each, max(each.costs, key=lambda cost: cost.rms).source) for each in self.joints]
        yield budget_verdict([(each.joint, each.together.rms, each.tolerance, source) for each, source in worst])
        costs = list(zip(*(each.costs for each in self.joints), strict=True))  # of a source, by joint
        shown = [of_joints for of_joints in costs if any(each.rms >= LEAST for each in of_joints)]
        if shown:
            joints = [each.joint for each in self.joints]
            rms = {of[0].source: [100.0 * each.rms for each in of] for of in shown[: len(SERIES)]}
            series = {source: dict(zip(joints, errors, strict=True)) for source, errors in rms.items()}
            title, caption = "Error of each gain from the largest sources alone", "Root mean square, all others off."
            draw = partial(draw_bars, joints=joints, series=series)
            yield Plot(title=title, caption=caption, x="Joint", y="Error [% rms]", draw=draw)
        rows = [
            ("all together", *(percent(each.together.rms, ".3f") for each in self.joints)),
            ("  of which bias", *(percent(each.together.bias, "+.3f") for each in self.joints)),
            ("tolerance", *(percent(each.tolerance, ".3g") for each in self.joints)),
            ("within", *(_within(each.within) for each in self.joints)),
            *((of_joints[0].source, *(percent(each.rms, ".3f") for each in of_joints)) for of_joints in shown),
        ]
        alone = (column(f"Joint {each.joint} [%]", itemgetter(k)) for k, each in enumerate(self.joints, 1))
        yield table(rows, column("Source", itemgetter(0), words=True), *alone)
        if none := [of_joints[0].source for of_joints in costs if of_joints not in shown]:
            yield Paragraph(f"Below {100.0 * LEAST:g} % on every joint: {', '.join(none)}.")
        yield Paragraph(MEANING)
        yield Paragraph(CONTROL)
        if self.remarks:
            yield Paragraph(f"Assumed without an error source: {'; '.join(self.remarks)}.")
        for each in self.refused:
            yield Paragraph(f"Joint {each['joint']}: no gain: {each['reason']}.", Mood.DOUBTFUL)
        for each in self.unpredicted:
            yield Paragraph(f"Not predicted: {each['source']}: {each['reason']}.", Mood.DOUBTFUL)
        yield from horizon_fold(self.excluded, self.untold, PLANNED_LOGS)


def _within(share: float) -> Cell:
    return Cell(percent(share, ".0f"), Mood.GOOD if share > 0.95 else Mood.BAD if share < 0.5 else Mood.DOUBTFUL)


def predicted_budget(scenario: Scenario) -> PredictedBudget:
    """Predict the error budget of a scenario, and the faults that logs of its motions will exclude.

    Raises `TrajectoryError` if a drive cannot follow the motion; otherwise as `Predictor`.
    """
    check_torque_limits(setup_of(scenario).experiments)
    predictor = Predictor(scenario)
    estimate, costs, unpredicted = predictor.linear.estimate, dict[str, Array](), list[dict[str, str]]()
    for name, source in scenario.table.sources.items():
        try:
            costs[name] = predictor.noise(source.stream) if source.stream else predictor.drawn(source)
        except (ScenarioError, SimulationError, IdentificationError) as error:
            unpredicted.append({"source": name, "reason": str(error)})
    if (other := predictor.other_noise) is not None:
        costs[OTHER] = other
    unpredicted += [{"source": OTHER, "reason": f"{NO_SPECTRUM} {stream}"} for stream in predictor.unknown]
    costs = dict(sorted(costs.items(), key=lambda item: -float(np.max(np.hypot(*item[1]), initial=0.0))))
    tolerance, joints = scenario.table.tolerance, predictor.joints.tolist()
    each = np.array([*costs.values()]).reshape(len(costs), 2, len(joints))
    together = np.stack((each[:, 0].sum(axis=0), np.linalg.norm(each[:, 1], axis=0)))

    def joint(k: int, j: int) -> PredictedBudgetJoint:
        most, errors = tolerance.gain[j], NormalDist(together[0, k], max(together[1, k], 1e-300))
        return PredictedBudgetJoint(
            joint=j + 1,
            costs=[Cost(source=name, bias=cost[0, k], std=cost[1, k]) for name, cost in costs.items()],
            together=Cost(source="all together", bias=together[0, k], std=together[1, k]),
            tolerance=most,
            within=errors.cdf(most) - errors.cdf(-most),
        )

    said = DiagnosedResult.values_of(horizon(predictor.linear.expected.logs()))
    missing = [j for j in np.flatnonzero(tolerance.identifiable).tolist() if j not in joints]
    refused = [(j, gain.reason) for j in missing if isinstance(gain := estimate.joints[j], RefusedGain)]
    return PredictedBudget(
        scenario=scenario.name,
        method=estimate.method,
        remarks=[*estimate.remarks, *([] if in_turns(scenario.table.experiment.protocol) else [NO_DRIFT])],
        joints=[joint(k, j) for k, j in enumerate(joints)],
        refused=[{"joint": j + 1, "reason": reason} for j, reason in refused],
        unpredicted=unpredicted,
        excluded=said["excluded"],
        untold=said["untold"],
    )
