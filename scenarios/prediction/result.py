"""What `rx90 predict` prints: a predicted error budget, joint by joint."""

from pydantic import Field

import scenarios.prediction.budget as prediction
from scenarios.prediction import predictor
from scenarios.results.models.diagnoses import ResultExclusion, diagnosed_values
from scenarios.support.result_model import ResultModel


class Cost(ResultModel):
    """What an error source costs a gain, as shares of it.

    Attributes:
        source: Its name.
        bias: Mean of the error, as a share of the gain.
        std: Standard deviation of the error, as a share of the gain.
        rms: Root mean square of the error, as a share of the gain.
    """

    source: str
    bias: float
    std: float
    rms: float


class PredictedBudgetJoint(ResultModel):
    """A joint's budget.

    Attributes:
        joint: Its number, from 1.
        costs: One a source, in the order of the largest cost on any joint.
        together: All sources at once: biases added by sign, variances added.
        tolerance: Relative error that passes.
    """

    joint: int = Field(ge=1)
    costs: list[Cost]
    together: Cost
    tolerance: float
    within: float = Field(description="probability that the error is within the tolerance")


class PredictedBudget(ResultModel):
    """What `rx90 predict --json` prints.

    Attributes:
        scenario: Its name.
        method: Name of the estimator.
        remarks: What the model takes for granted.
        joints: Those that the scenario wants and that have a gain.
        refused: Joints that the scenario wants and that have none, with the reason.
        unpredicted: Sources without a prediction, with the reason.
        excluded: Faults that logs of these motions will exclude.
        untold: What they will not tell.
    """

    scenario: str
    method: str
    remarks: list[str]
    joints: list[PredictedBudgetJoint]
    refused: list[dict[str, int | str]]
    unpredicted: list[dict[str, str]]
    excluded: list[ResultExclusion]
    untold: list[str]


def predicted_budget_result(budget: prediction.PredictedBudget) -> PredictedBudget:
    """A budget that was predicted."""
    both, said = budget.together, diagnosed_values(budget.horizon)
    return PredictedBudget(
        scenario=budget.scenario,
        method=budget.method,
        remarks=list(budget.remarks),
        joints=[
            PredictedBudgetJoint(
                joint=joint + 1,
                costs=[_cost(cost, k) for cost in budget.costs],
                together=_cost(both, k),
                tolerance=float(budget.tolerance[k]),
                within=float(budget.within[k]),
            )
            for k, joint in enumerate(budget.joints.tolist())
        ],
        refused=[{"joint": joint + 1, "reason": reason} for joint, reason in budget.refused.items()],
        unpredicted=[{"source": each.source, "reason": each.reason} for each in budget.unpredicted],
        excluded=said["excluded"],
        untold=said["untold"],
    )


def _cost(cost: predictor.Cost, k: int) -> Cost:
    return Cost(source=cost.source, bias=float(cost.bias[k]), std=float(cost.std[k]), rms=float(cost.rms[k]))
