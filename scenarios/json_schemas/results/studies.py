"""JSON Schema of error budgets and repeated scenarios, predicted or carried out, and of the paper's experiment."""

from pydantic import Field

from scenarios.experiments.studies.budget import SourceCost
from scenarios.experiments.studies.statistics import JointStatistics
from scenarios.results.models.diagnoses import ResultExclusion
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


class StudyResult(ResultModel):
    """What `rx90 monte-carlo --json` prints.

    Attributes:
        scenario: Its name.
        seed: Of the first trial.
        trials: Carried out; the folder may hold more than were asked for.
        passed: Whether no joint contradicts the pass rate that the scenario asks for.
        joints: One entry a joint, in their order.
    """

    scenario: str
    seed: int
    trials: int
    passed: bool
    joints: list[JointStatistics]
    failures: dict[str, int] = Field(description="trials without any estimate, by kind")


class BudgetJoint(ResultModel):
    """What a joint's gain errs by, as shares of it.

    Attributes:
        joint: Its number, from 1.
        costs: One a source that gave a gain alone, the largest first.
        floor: Relative error with every source off, null where the joint was refused.
        together: Root mean square of the relative error with all sources on, null where no such trial gave a gain.
        samples: Rows of the Sobol design that its indices come from.
        lost: Trials that gave no gain for the joint.
        summed: The relative error that `together` would be if those of independent sources added up.
    """

    joint: int = Field(ge=1)
    costs: list[SourceCost]
    floor: float | None
    together: float | None
    samples: int
    lost: int
    summed: float
    silent: list[str] = Field(description="sources none of whose own trials gave the joint a gain")


class Budget(ResultModel):
    """What `rx90 sensitivity --json` prints.

    Attributes:
        scenario: Its name.
        trials: Carried out.
        joints: Those that should have a gain.
    """

    scenario: str
    trials: int
    joints: list[BudgetJoint]


class Claim(ResultModel):
    """A claim of the paper.

    Attributes:
        claim: In words.
        holds: Whether the simulated experiment confirms it.
    """

    claim: str
    holds: bool


class PaperGain(ResultModel):
    """The drive gain of one joint by eq. 27.

    Attributes:
        joint: Its number, from 1.
        true: Injected gain [N m / drive unit].
        estimate: Identified gain [N m / drive unit], null if refused.
        std: Standard deviation of the estimate, from the residual as in the paper [N m / drive unit].
        identifiable: Whether there is an estimate.
        reason: Why the joint is refused.
    """

    joint: int = Field(ge=1)
    true: float
    estimate: float | None
    std: float | None
    identifiable: bool
    reason: str | None


class PaperFit(ResultModel):
    """How well a case explains its rows (table 4).

    Attributes:
        method: `ols` or `wls`: whether each joint's rows are weighted by its own residual.
        rows: Of all joints and both motions.
        unknowns: Parameters of arm and payload that are solved for.
        error_norm: Norm of the residuals, each in deviations of its own joint's.
        rel_error_norm: The same as a share of the norm of the torques, weighted likewise.
        sigma: Standard deviation of the residuals, each in deviations of its own joint's.
    """

    method: str
    rows: int
    unknowns: int
    error_norm: float
    rel_error_norm: float
    sigma: float


class PaperPayload(ResultModel):
    """A payload identified with given gains.

    Attributes:
        gains: In use, one a joint [N m / drive unit].
        payload: Its ten parameters, each with its true value, estimate and standard deviation, and whether it is
            essential.
        fit: How well its rows are explained.
        published: What the paper prints of it; of the gains, only with case 2.
    """

    gains: list[float]
    payload: list[dict[str, object]]
    fit: PaperFit
    published: dict[str, object]


class PaperCase(PaperPayload):
    """One of the paper's three cases.

    Attributes:
        case: Its number.
    """

    case: int = Field(ge=1)


class PaperResult(ResultModel):
    """What `rx90 paper --json` prints.

    Attributes:
        gains: Drive gains of all joints, of which cases 2 and 3 use those of joints 1 to 4.
        cases: Cases 1, 2 and 3, each with its number, gains [N m / drive unit], payload parameters, fit and what the
            paper prints of it.
        second_payload: The same of the second payload, weighed with the gains of case 2.
        checks: Claims of the paper.
        passed: Whether all of them hold.
    """

    gains: list[PaperGain]
    cases: list[PaperCase]
    second_payload: PaperPayload
    checks: list[Claim]
    passed: bool
