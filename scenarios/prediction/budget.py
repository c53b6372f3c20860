"""The error budget of a scenario, predicted: what each source costs each gain, and what they cost together."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ident.diagnosis.diagnose import horizon
from ident.diagnosis.diagnosis import Diagnosed
from ident.estimation.estimate import RefusedGain
from ident.numerics.normal import normal_cdf
from ident.support.arrays import Array, Indices
from ident.support.errors import IdentificationError
from scenarios.experiments.build import setup_of
from scenarios.experiments.files.schema import Scenario
from scenarios.prediction.predictor import NO_SPECTRUM, OTHER, Cost, Predictor, predictor_of
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError
from sim.torque_limits import check_torque_limits


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
        horizon: What logs of these motions will exclude, and what they will not tell.
    """

    scenario: str
    method: str
    joints: Indices
    refused: Mapping[int, str]
    remarks: tuple[str, ...]
    tolerance: Array
    costs: tuple[Cost, ...]
    unpredicted: tuple[Unpredicted, ...]
    horizon: Diagnosed

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
        return np.array([normal_cdf(a) - normal_cdf(b) for a, b in zip(upper.tolist(), lower.tolist(), strict=True)])


def predicted_budget(scenario: Scenario) -> PredictedBudget:
    """Predict the error budget of a scenario.

    Raises:
        Saturated: If its motion asks more of a drive than it has; else as `predictor_of`.
    """
    check_torque_limits(setup_of(scenario).experiments)
    predictor = predictor_of(scenario)
    estimate, costs, unpredicted = predictor.linear.estimate, list[Cost](), list[Unpredicted]()
    for name, source in scenario.table.sources.items():
        try:
            costs.append(predictor.noise(name, source.stream) if source.stream else predictor.drawn(name, source))
        except (ScenarioError, SimulationError, IdentificationError) as error:
            unpredicted.append(Unpredicted(name, str(error)))
    costs += predictor.other_noise()
    unpredicted += [Unpredicted(OTHER, f"{NO_SPECTRUM} {stream}") for stream in predictor.unknown]
    tolerance, joints = scenario.table.tolerance, predictor.joints
    refused = [j for j in np.flatnonzero(tolerance.identifiable).tolist() if j not in joints.tolist()]
    return PredictedBudget(
        scenario=scenario.name,
        method=estimate.method,
        joints=joints,
        refused={j: _reason(predictor, j) for j in refused},
        remarks=estimate.remarks,
        tolerance=np.array(tolerance.gain)[joints],
        costs=tuple(sorted(costs, key=lambda cost: -float(np.max(cost.rms, initial=0.0)))),
        unpredicted=tuple(unpredicted),
        horizon=horizon(predictor.linear.expected.logs()),
    )


def _reason(predictor: Predictor, joint: int) -> str:
    found = predictor.linear.estimate.joints[joint]
    assert isinstance(found, RefusedGain), "asked of joints without a gain"
    return found.reason
