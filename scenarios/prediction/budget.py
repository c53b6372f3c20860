"""The predicted error budget of a scenario: error of each gain from each source, and from all together."""

import numpy as np
from pydantic import Field

from ident.diagnosis.diagnose import horizon
from ident.diagnosis.diagnosis import Diagnosed, Exclusion
from ident.estimation.estimate import RefusedGain
from ident.numerics.normal import normal_cdf
from ident.support.errors import IdentificationError
from scenarios.experiments.schema import Scenario
from scenarios.experiments.setup import setup_of
from scenarios.prediction.moments import Moments
from scenarios.prediction.predictor import NO_SPECTRUM, predictor_of
from scenarios.rendering.result import FromOne, ResultModel
from scenarios.results.diagnoses import diagnosed_values
from scenarios.support.errors import ScenarioError
from sim.errors import SimulationError
from sim.feedforward_currents import check_torque_limits

OTHER = "noise that is no source"


class Cost(ResultModel):
    """Relative error of a gain from one source."""

    source: str = Field(description="Name of the source or scenario")
    bias: float = Field(description="Mean of the relative error of the gain")
    std: float = Field(description="Standard deviation of the relative error of the gain")
    rms: float = Field(description="Root mean square of the relative error of the gain")


class PredictedBudgetJoint(ResultModel):
    """Budget of one joint."""

    joint: int = Field(ge=1, description="Number of the joint, from 1")
    costs: list[Cost] = Field(description="One entry per source, sorted by the largest rms on any joint")
    together: Cost = Field(description="All sources together: sums of the signed biases and of the variances")
    tolerance: float = Field(description="Largest relative error that passes")
    within: float = Field(description="Probability that the error is within the tolerance")


class PredictedBudget(ResultModel):
    """What `rx90 predict --json` prints."""

    scenario: str = Field(description="Name of the source or scenario")
    method: str = Field(description="Name of the estimator")
    remarks: list[str] = Field(description="Assumptions of the model")
    joints: list[PredictedBudgetJoint] = Field(description="Joints whose gain the scenario requires and that have one")
    refused: list[dict[str, int | str]] = Field(
        description="Joints whose gain the scenario requires and that have none, with the reason"
    )
    unpredicted: list[dict[str, str]] = Field(description="Sources without a prediction, with the reason")
    excluded: list[FromOne[Exclusion]] = Field(description="Faults that logs of these motions will exclude")
    untold: list[str] = Field(description="Faults that logs of these motions cannot reveal")


def predicted_budget(scenario: Scenario) -> tuple[PredictedBudget, Diagnosed]:
    """Predict the error budget of a scenario, and the faults that logs of its motions will exclude.

    Raises:
        Saturated: If a drive cannot follow the motion; otherwise as `predictor_of`.
    """
    check_torque_limits(setup_of(scenario).experiments)
    predictor = predictor_of(scenario)
    estimate, costs, unpredicted = predictor.linear.estimate, dict[str, Moments](), list[dict[str, str]]()
    for name, source in scenario.table.sources.items():
        try:
            costs[name] = predictor.noise(source.stream) if source.stream else predictor.drawn(source)
        except (ScenarioError, SimulationError, IdentificationError) as error:
            unpredicted.append({"source": name, "reason": str(error)})
    if (other := predictor.other_noise) is not None:
        costs[OTHER] = other
    unpredicted += [{"source": OTHER, "reason": f"{NO_SPECTRUM} {stream}"} for stream in predictor.unknown]
    costs = dict(sorted(costs.items(), key=lambda item: -float(np.max(item[1].rms, initial=0.0))))
    tolerance, joints = scenario.table.tolerance, predictor.joints.tolist()
    none = np.zeros(len(joints))
    both = Moments(
        np.sum([none, *(cost.bias for cost in costs.values())], axis=0),
        np.sqrt(np.sum([none, *(cost.std**2 for cost in costs.values())], axis=0)),
    )
    found = horizon(predictor.linear.expected.logs())
    said = diagnosed_values(found)
    missing = [j for j in np.flatnonzero(tolerance.identifiable).tolist() if j not in joints]
    refused = [(j, gain.reason) for j in missing if isinstance(gain := estimate.joints[j], RefusedGain)]
    budget = PredictedBudget(
        scenario=scenario.name,
        method=estimate.method,
        remarks=list(estimate.remarks),
        joints=[_joint(joint, k, costs, both, tolerance.gain[joint]) for k, joint in enumerate(joints)],
        refused=[{"joint": j + 1, "reason": reason} for j, reason in refused],
        unpredicted=unpredicted,
        excluded=said["excluded"],
        untold=said["untold"],
    )
    return budget, found


def _joint(joint: int, k: int, costs: dict[str, Moments], both: Moments, tolerance: float) -> PredictedBudgetJoint:
    """Return the budget of the k-th joint: signed biases and variances are added."""
    std = max(float(both.std[k]), 1e-300)
    bias = float(both.bias[k])
    return PredictedBudgetJoint(
        joint=joint + 1,
        costs=[_cost(name, cost, k) for name, cost in costs.items()],
        together=_cost("all together", both, k),
        tolerance=tolerance,
        within=normal_cdf((tolerance - bias) / std) - normal_cdf((-tolerance - bias) / std),
    )


def _cost(name: str, cost: Moments, k: int) -> Cost:
    return Cost(source=name, bias=float(cost.bias[k]), std=float(cost.std[k]), rms=float(cost.rms[k]))
